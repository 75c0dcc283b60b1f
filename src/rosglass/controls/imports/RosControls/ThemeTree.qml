// The rows of a tree: click or use the arrow keys to fold and unfold, Ctrl+C to copy a row.
import QtQuick 2.15

FocusScope {
    id: tree

    // Rows with the roles key, depth, folds, open and row, such as those of TopicRows.
    property var model: null
    // What a row shows; it sees `row` (the roles) and `current`, and says in `label` what it reads out.
    property Component delegate: null
    // What the tree shows, for screen readers.
    property string name
    // The key of the current row; empty without rows.
    readonly property string current: model && list.count > 0 ? key_(list.currentIndex) : ""

    signal toggled(string key)
    signal activated(string key)
    signal copied(string key)

    function key_(row) { return model.value(row, "key") || "" }
    function toggle_(row, open) {
        if (model.value(row, "folds") && (open === undefined || model.value(row, "open") !== open)) {
            toggled(key_(row))
            return true
        }
        return false
    }

    ListView {
        id: list
        anchors.fill: parent
        objectName: "rows"
        focus: true
        activeFocusOnTab: true
        clip: true
        boundsBehavior: Flickable.StopAtBounds
        highlightMoveDuration: 0
        cacheBuffer: 0
        model: tree.model
        onCountChanged: if (currentIndex < 0 && count > 0) currentIndex = 0
        Accessible.role: Accessible.Tree
        Accessible.name: tree.name

        readonly property int page_: Math.max(1, Math.floor(height / (Theme.touch * 0.7)) - 1)

        Keys.onPressed: function(event) {
            event.accepted = true
            if (event.key === Qt.Key_Right) {
                if (!tree.toggle_(currentIndex, true) && currentIndex + 1 < count
                        && tree.model.parentOf(currentIndex + 1) === currentIndex)
                    currentIndex += 1
            } else if (event.key === Qt.Key_Left) {
                const above = tree.model.parentOf(currentIndex)
                if (!tree.toggle_(currentIndex, false) && above >= 0)
                    currentIndex = above
            } else if (event.key === Qt.Key_Space) {
                tree.toggle_(currentIndex)
            } else if (event.key === Qt.Key_Return || event.key === Qt.Key_Enter) {
                if (tree.current)
                    tree.activated(tree.current)
            } else if (event.key === Qt.Key_Home) {
                currentIndex = 0
            } else if (event.key === Qt.Key_End) {
                currentIndex = count - 1
            } else if (event.key === Qt.Key_PageUp) {
                currentIndex = Math.max(0, currentIndex - page_)
            } else if (event.key === Qt.Key_PageDown) {
                currentIndex = Math.min(count - 1, currentIndex + page_)
            } else if (event.matches(StandardKey.Copy)) {
                if (tree.current)
                    tree.copied(tree.current)
            } else {
                event.accepted = false
            }
        }

        delegate: Item {
            id: line

            readonly property bool isCurrent: ListView.isCurrentItem
            readonly property string label: content.item && content.item.label !== undefined ? content.item.label : model.key

            width: list.width
            height: Math.max(Math.round(Theme.touch * 0.7), content.height)
            Accessible.role: Accessible.TreeItem
            Accessible.name: label
            Accessible.onPressAction: tree.toggle_(index)

            Rectangle {
                anchors.fill: parent
                visible: line.isCurrent
                radius: Theme.radius / 2
                color: Theme.track
                border { color: list.activeFocus ? Theme.accent : "transparent"; width: 1 }
            }
            MouseArea {
                anchors.fill: parent
                onClicked: {
                    list.forceActiveFocus()
                    list.currentIndex = index
                    tree.toggle_(index)
                }
                onDoubleClicked: tree.activated(model.key)
            }
            ThemeText {
                id: arrow
                x: Math.min((model.depth + 0.2) * Theme.gap * 1.4, list.width / 2)
                width: Theme.gap * 1.4
                height: Math.round(Theme.touch * 0.7)
                verticalAlignment: Text.AlignVCenter
                visible: model.folds
                text: model.open ? "▾" : "▸"
                color: Theme.dim
            }
            Loader {
                id: content
                property var row: model.row
                property bool current: line.isCurrent
                x: arrow.x + arrow.width
                width: Math.max(0, line.width - x - Theme.gap)
                sourceComponent: tree.delegate
            }
        }
    }
    Rectangle {
        visible: list.visibleArea.heightRatio < 1
        anchors.right: parent.right
        y: list.visibleArea.yPosition * list.height
        width: Math.max(3, Theme.gap * 0.3)
        height: Math.max(Theme.gap, list.visibleArea.heightRatio * list.height)
        radius: width / 2
        color: Theme.faint
    }
}
