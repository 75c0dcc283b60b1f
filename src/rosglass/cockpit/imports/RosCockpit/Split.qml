// Lays its children out side by side, or one below the other, by their `share` of the room.
import QtQuick 2.15
import RosControls 1.0
import "elements.js" as Elements

Item {
    id: split

    property string element_: "split"
    readonly property Item cockpit_: Elements.cockpitOf(parent)
    readonly property Item holder_: split

    // Qt.Horizontal: side by side; Qt.Vertical: from top to bottom.
    property int orientation: Qt.Horizontal
    // Its own share, in a Split around it.
    property real share: 1
    // Pixels between its children.
    property real spacing: Math.round(Theme.gap * 0.6)

    readonly property bool vertical_: orientation === Qt.Vertical
    // Children that are laid out: not those that are in a window of their own now.
    property var elements_: []
    // Whether there is nothing to lay out; an empty one in edit mode is a place to drop at.
    readonly property bool away_: elements_.length === 0 && !(cockpit_ && cockpit_.editing)
    property bool shown_: true
    readonly property real least_: Theme.touch * 1.5
    property real minimumWidth_: least_
    property real minimumHeight_: least_
    property bool complete_: false
    readonly property var handles_: handles.item
    // While an edge is dragged: the shares to show.
    property var preview_: null

    // All that an arrangement depends on, besides sizes and children.
    readonly property var wishes_: {
        let all = [orientation, spacing, preview_, cockpit_ ? cockpit_.maximized : null]
        for (const child of Elements.list(children))
            all.push(child.share, child.minimumWidth_, child.minimumHeight_, child.away_)
        return all
    }
    // Not at once: it may be the arrangement that has changed them.
    onWishes_Changed: if (complete_) Qt.callLater(arrange)
    onWidthChanged: if (complete_) arrange()
    onHeightChanged: if (complete_) arrange()
    onShareChanged: Elements.checkShare(split, "Split")

    visible: shown_

    function arrange() {
        // It may have been destroyed since it was called for.
        if (!split || !split.children)
            return
        const solo = cockpit_ ? cockpit_.maximized : null
        let all = [], only = null, wide = 0, high = 0
        for (const child of Elements.list(children)) {
            if (child === handles || child instanceof Repeater || child.away_)
                continue
            all.push(child)
            const least = vertical_ ? child.minimumHeight_ : child.minimumWidth_
            const across = vertical_ ? child.minimumWidth_ : child.minimumHeight_
            wide += least !== undefined ? least : least_
            high = Math.max(high, across !== undefined ? across : least_)
            if (solo && Elements.contains(child, solo))
                only = child
        }
        wide += Math.max(0, all.length - 1) * spacing
        minimumWidth_ = vertical_ ? high : wide
        minimumHeight_ = vertical_ ? wide : high
        for (const child of all) {
            if (child.shown_ !== undefined) {
                child.shown_ = only === null || child === only
                // It may have been in tabs.
                if (child.anchors.fill)
                    child.anchors.fill = undefined
            }
            // Its own `visible` may be a binding.
            else if (only !== null && child !== only)
                child.x = -100000
        }
        if (only !== null)
            place_(only, 0, vertical_ ? height : width)
        else
            placeAll_(all)
        elements_ = all
    }

    function placeAll_(all) {
        const room = (vertical_ ? height : width) - Math.max(0, all.length - 1) * spacing
        const sizes = Elements.sizes(room,
            all.map((child, at) => preview_ && preview_.length === all.length ? preview_[at] : Elements.share(child)),
            all.map(child => (vertical_ ? child.minimumHeight_ : child.minimumWidth_) || least_))
        let place = 0
        for (let at = 0; at < all.length; at++) {
            place_(all[at], place, sizes[at])
            place += sizes[at] + spacing
        }
    }

    function place_(child, place, size) {
        child.x = vertical_ ? 0 : place
        child.y = vertical_ ? place : 0
        child.width = vertical_ ? width : size
        child.height = vertical_ ? size : height
    }

    onChildrenChanged: if (complete_) arrange()
    Component.onCompleted: {
        complete_ = true
        arrange()
    }

    Loader {
        id: handles
        z: 1
        anchors.fill: parent
        active: split.cockpit_ !== null && split.cockpit_.editing
        source: "SplitHandles.qml"
        onLoaded: item.split = split
    }
}
