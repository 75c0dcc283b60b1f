import QtQuick 2.15
import QtQuick.Controls 2.15

// A popup that follows a point of RViz's scene; the user can move it by its edge.
Popup {
    id: popup

    // x, y and z in metres, in `frame`; null positions the popup by `x` and `y`.
    property var point: null
    // The frame of the point; empty for RViz's fixed frame.
    property string frame: ""
    // The point of the popup that is at its position, in shares of its width and height.
    property point anchor: Qt.point(0.5, 0.5)
    // Whether the user may move it; it then stops following the point.
    property bool movable: false
    // Why the point cannot be followed or its position is old; empty otherwise.
    readonly property string problem: refused || (tracker ? tracker.problem : "")
    // Whether no transform of the frame arrived for 3 s; the popup is then half transparent.
    readonly property bool stale: tracker !== null && tracker.stale

    property var tracker: null
    property string refused: ""
    readonly property size room: parent ? Qt.size(parent.width, parent.height) : Qt.size(0, 0)

    function follow() {
        var wrong = ""
        try {
            if (!point) {
                tracker = null
            } else if (tracker) {
                tracker.point = point
                tracker.frame = frame
            } else {
                tracker = rviz.createPositionTracker(point, frame)
            }
        } catch (error) {
            tracker = null
            wrong = error.message
        }
        if (wrong && wrong !== refused)
            rviz.refuse(popup, "AnchoredPopup: " + wrong)
        refused = wrong
        place()
    }

    function place() {
        if (!parent)
            return
        var at = tracker ? tracker.position : null
        var seen = at !== null && at.x >= 0 && at.y >= 0 && at.x <= parent.width && at.y <= parent.height
        var hidden = !seen && !modal && (tracker !== null || refused !== "")
        opacity = hidden ? 0 : stale ? 0.5 : 1
        // A hidden popup must not accept the mouse.
        if (contentItem && contentItem.parent)
            contentItem.parent.enabled = !hidden
        if (seen) {
            x = Math.max(0, Math.min(at.x - anchor.x * width, parent.width - width))
            y = Math.max(0, Math.min(at.y - anchor.y * height, parent.height - height))
        } else if (!hidden && (tracker || refused)) {
            // A modal popup blocks all input, so it must stay visible.
            x = (parent.width - width) / 2
            y = (parent.height - height) / 2
        }
    }

    function moveBy(dx, dy) {
        tracker = null
        refused = ""
        x = Math.max(0, Math.min(x + dx, parent.width - width))
        y = Math.max(0, Math.min(y + dy, parent.height - height))
    }

    parent: rviz._area || Overlay.overlay
    // Popups have the size of the window, whatever the scale of their parent.
    scale: rviz._area ? rviz._area.scale : 1
    transformOrigin: Popup.TopLeft
    focus: modal
    z: modal ? 1 : 0
    closePolicy: modal ? Popup.CloseOnEscape : Popup.NoAutoClose
    onPointChanged: follow()
    onFrameChanged: follow()
    onAnchorChanged: place()
    onStaleChanged: {
        if (stale && !isNaN(tracker.position.x))
            rviz.warn(popup, "AnchoredPopup: " + problem)
        place()
    }
    onRoomChanged: place()
    onWidthChanged: place()
    onHeightChanged: place()
    Component.onCompleted: follow()

    Connections {
        target: popup.tracker
        function onPositionChanged() { popup.place() }
    }

    background: Rectangle {
        color: popup.palette.window
        border.color: popup.palette.mid
        radius: 4

        MouseArea {
            property point start

            anchors.fill: parent
            enabled: popup.movable
            cursorShape: enabled ? Qt.SizeAllCursor : Qt.ArrowCursor
            onPressed: start = Qt.point(mouse.x, mouse.y)
            onPositionChanged: popup.moveBy(mouse.x - start.x, mouse.y - start.y)
        }
    }
}
