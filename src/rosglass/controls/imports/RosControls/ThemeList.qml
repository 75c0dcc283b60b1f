// A list of rows that is scrolled, walked through by keys, and says how many rows are out of sight.
import QtQuick 2.15
import QtQuick.Templates 2.15 as T

FocusScope {
    id: list

    // What is in it, for screen readers.
    property string name
    property alias model: view.model
    property alias delegate: view.delegate
    property alias view: view
    property alias currentIndex: view.currentIndex
    // What else to say below the rows.
    property string more
    property color moreTint: Theme.dim
    // Rows below what is in sight.
    readonly property int below: below_

    property int below_: 0

    // Later: the text that shows it takes height from the rows.
    function count_() {
        const bottom = view.contentY + view.height - 1
        const last = view.contentHeight > view.height ? view.indexAt(1, bottom) : view.count - 1
        below_ = last < 0 ? 0 : view.count - 1 - last
    }

    // A row was chosen, by Enter, space or a press.
    signal chosen(int index)

    property real place_: 0

    Accessible.role: Accessible.List
    Accessible.name: name

    ListView {
        id: view
        objectName: "rows"
        anchors { left: parent.left; right: parent.right; top: parent.top; bottom: foot.visible ? foot.top : parent.bottom }
        clip: true
        focus: true
        keyNavigationEnabled: true
        activeFocusOnTab: true
        currentIndex: -1
        boundsBehavior: Flickable.StopAtBounds
        highlightMoveDuration: 0
        interactive: contentHeight > height
        onContentYChanged: Qt.callLater(list.count_)
        onHeightChanged: Qt.callLater(list.count_)
        onContentHeightChanged: Qt.callLater(list.count_)
        onCountChanged: Qt.callLater(list.count_)
        Keys.onReturnPressed: if (currentIndex >= 0) list.chosen(currentIndex)
        Keys.onEnterPressed: if (currentIndex >= 0) list.chosen(currentIndex)
        Keys.onSpacePressed: if (currentIndex >= 0) list.chosen(currentIndex)
        Keys.onPressed: function(event) {
            const page = Math.max(1, Math.floor(count * height / Math.max(1, contentHeight)))
            const wanted = event.key === Qt.Key_PageDown ? Math.min(count - 1, currentIndex + page)
                : event.key === Qt.Key_PageUp ? Math.max(0, currentIndex - page)
                : event.key === Qt.Key_Home ? 0 : event.key === Qt.Key_End ? count - 1 : -2
            if (wanted >= -1) {
                currentIndex = wanted
                event.accepted = true
            }
        }
        T.ScrollBar.vertical: ThemeScrollBar {}
    }
    FocusRing { item: view; visible: view.activeFocus }
    ThemeText {
        id: foot
        objectName: "more"
        anchors { left: parent.left; right: parent.right; bottom: parent.bottom }
        visible: text !== ""
        text: [list.below ? qsTr("%1 more below").arg(list.below) : "", list.more].filter(function(part) { return part }).join(" · ")
        color: list.moreTint
        font.pixelSize: Theme.small
    }
    // A model that shows its rows anew would take the view to its top, away from what is read.
    Connections {
        target: list.model
        ignoreUnknownSignals: true
        function onModelAboutToBeReset() { list.place_ = view.contentY }
        function onModelReset() {
            view.forceLayout()
            view.contentY = Math.max(0, Math.min(list.place_, view.contentHeight - view.height))
        }
    }
}
