// A text that says why something is not as it should be: what has no room is shown whole, over what
// is around it, while the pointer is on it, or after a tap.
import QtQuick 2.15
import QtQuick.Window 2.15

ThemeText {
    id: reason

    property bool tapped_: false
    readonly property bool open_: truncated && visible && (hover.hovered || tapped_)

    font.pixelSize: Theme.small
    onTruncatedChanged: if (!truncated) tapped_ = false
    onVisibleChanged: if (!visible) tapped_ = false
    onOpen_Changed: if (open_) balloon.place()

    HoverHandler { id: hover; enabled: reason.truncated }
    TapHandler { enabled: reason.truncated; onTapped: reason.tapped_ = !reason.tapped_ }
    Timer {
        interval: 10000
        running: reason.tapped_
        onTriggered: reason.tapped_ = false
    }
    Rectangle {
        id: balloon
        objectName: reason.objectName + "Balloon"
        // Above all that is in the window, and not cut by the frame.
        parent: reason.Window.contentItem
        z: 1000
        visible: reason.open_
        width: whole.width + 2 * Theme.gap
        height: whole.height + Theme.gap
        radius: Theme.radius / 2
        color: Theme.panel
        border { color: reason.color; width: 1 }

        // The right end of the text, and its upper and lower edge, in the window.
        property real right_: 0
        property real top_: 0
        property real bottom_: 0
        readonly property real most_: parent ? parent.width : 0
        x: Math.max(0, Math.min(right_, most_) - width)
        y: bottom_ + height <= (parent ? parent.height : 0) ? bottom_ : Math.max(0, top_ - height)

        function place() {
            const at = reason.mapToItem(parent, reason.width, 0)
            right_ = at.x
            top_ = at.y - 2
            bottom_ = at.y + reason.height + 2
        }
        ThemeText {
            id: whole
            objectName: reason.objectName + "Whole"
            anchors.centerIn: parent
            width: Math.min(implicitWidth, Math.max(1, balloon.most_ - 2 * Theme.gap), 420 * Theme.size)
            text: balloon.visible ? reason.text : ""
            color: reason.color
            elide: Text.ElideNone
            wrapMode: Text.Wrap
            font.pixelSize: Theme.small
            Accessible.ignored: true
        }
    }
}
