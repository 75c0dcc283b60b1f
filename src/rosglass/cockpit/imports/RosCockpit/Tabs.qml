// Shows one of its panels, with a bar to choose it.
import QtQuick 2.15
import RosControls 1.0
import "elements.js" as Elements

Item {
    id: tabs

    readonly property string element_: "tabs"
    readonly property Item cockpit_: Elements.cockpitOf(parent)
    readonly property Item holder_: area

    // Its share of a Split.
    property real share: 1
    // Number of the panel that is shown, from 0.
    property int currentIndex: 0
    readonly property int count: elements_.length
    readonly property Item currentItem: count > 0 ? elements_[Math.max(0, Math.min(currentIndex, count - 1))] : null

    default property alias content: area.data

    property var elements_: []
    readonly property bool away_: count === 0 && !(cockpit_ && cockpit_.editing)
    property bool shown_: true
    readonly property real minimumWidth_: most_("minimumWidth_")
    readonly property real minimumHeight_: bar.height + most_("minimumHeight_")
    readonly property Item maximized_: cockpit_ ? cockpit_.maximized : null
    property bool complete_: false
    readonly property var wishes_: {
        let all = []
        for (const child of Elements.list(area.children))
            all.push(child.away_)
        return all
    }

    visible: shown_

    function most_(name) {
        let most = Theme.touch * 1.5
        for (const one of elements_)
            if (one[name] > most)
                most = one[name]
        return most
    }

    // Shows the panel at a distance from the present one, and gives it the keyboard.
    function next(step) {
        if (count < 2)
            return
        show((elements_.indexOf(currentItem) + step + count) % count)
        const panel = currentItem
        if (panel && panel.focusTitle)
            panel.focusTitle()
    }

    function show(index) {
        if (elements_[index] === currentItem)
            return
        if (cockpit_)
            cockpit_.halt()
        currentIndex = index
    }

    // The tab under a point, which side of it, and where to draw a mark for that; null without one.
    function tabAt(x, y) {
        if (y >= bar.height)
            return null
        return bar.tabAt(x, y)
    }

    function arrange() {
        if (!tabs || !area)
            return
        let all = []
        for (const child of Elements.list(area.children))
            if (!(child instanceof Repeater) && !child.away_)
                all.push(child)
        for (const child of all)
            child.anchors.fill = area
        elements_ = all
        reveal_()
    }

    function reveal_() {
        for (const one of elements_)
            if (one.shown_ !== undefined)
                one.shown_ = one === currentItem
            else
                one.visible = one === currentItem
    }

    onCurrentItemChanged: reveal_()
    onWishes_Changed: if (complete_) Qt.callLater(arrange)
    onShareChanged: Elements.checkShare(tabs, "Tabs")
    Component.onCompleted: {
        complete_ = true
        arrange()
    }

    TabRow {
        id: bar
        anchors { left: parent.left; right: parent.right; top: parent.top }
        tabs: tabs
    }
    Item {
        id: area
        anchors { left: parent.left; right: parent.right; top: bar.bottom; bottom: parent.bottom }
        onChildrenChanged: if (tabs.complete_) tabs.arrange()
    }
}
