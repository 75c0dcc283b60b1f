// The surface of a map: moved, zoomed and turned by mouse, fingers and keys, and poses are dragged on
// it; a part of the maps.
import QtQuick 2.15

Item {
    id: plane

    // The MapCamera that it moves.
    property var camera: null
    // Whether a drag sets a pose, and the point, {x, y} in metres, that its first heading leads away
    // from.
    property bool aims: false
    property var from: null
    // Whether the wheel zooms about the middle, not about the pointer.
    property bool centered: false
    // The pose that is being dragged: null, or {x, y, yaw} in metres and radians.
    property var draft: null
    // Whether the pointer is over it, and the metres there.
    readonly property bool hovered: pointer.containsMouse
    readonly property point at: camera && camera.scale && hovered ? camera.toMap(pointer.mouseX, pointer.mouseY) : Qt.point(0, 0)

    default property alias content: layers.data

    // It was moved by hand; a pose was set; it was clicked (in metres); keys were pressed.
    signal moved()
    signal posed(real x, real y, real yaw)
    signal clicked(real x, real y)
    signal homeKey()
    signal followKey()
    signal escapeKey()

    clip: true
    activeFocusOnTab: true
    Accessible.role: Accessible.Graphic
    Accessible.focusable: true
    onAimsChanged: draft = null

    Keys.onPressed: function(event) {
        const step = Math.max(20, Math.min(width, height) / 10)
        const shift = event.modifiers & Qt.ShiftModifier
        event.accepted = true
        switch (event.key) {
        case Qt.Key_Left: shift ? turn_(Math.PI / 36) : pan_(step, 0); break
        case Qt.Key_Right: shift ? turn_(-Math.PI / 36) : pan_(-step, 0); break
        case Qt.Key_Up: pan_(0, step); break
        case Qt.Key_Down: pan_(0, -step); break
        case Qt.Key_Plus: case Qt.Key_Equal: zoom_(1.25); break
        case Qt.Key_Minus: zoom_(0.8); break
        case Qt.Key_0: camera.rotation = 0; break
        case Qt.Key_Home: homeKey(); break
        case Qt.Key_F: followKey(); break
        case Qt.Key_Comma: head_(Math.PI / 12); break
        case Qt.Key_Period: head_(-Math.PI / 12); break
        case Qt.Key_Return: case Qt.Key_Enter:
            if (!aims)
                event.accepted = false
            else if (!draft)
                aim_()
            else
                release_()
            break
        case Qt.Key_Escape:
            if (draft)
                draft = null
            else if (aims)
                escapeKey()
            else
                event.accepted = false
            break
        default: event.accepted = false
        }
    }
    function pan_(x, y) {
        moved()
        camera.panBy(x, y)
        if (draft)
            aim_()
    }
    function zoom_(factor) {
        camera.zoomBy(factor, width / 2, height / 2)
    }
    function turn_(angle) {
        camera.rotateBy(angle, width / 2, height / 2)
    }
    // With the keyboard, a pose is set in the middle.
    function aim_() {
        if (aims && !pointer.pressed)
            draft = { x: camera.centerX, y: camera.centerY, yaw: draft ? draft.yaw : 0 }
    }
    function head_(angle) {
        aim_()
        if (draft)
            draft = { x: draft.x, y: draft.y, yaw: draft.yaw + angle }
    }
    function release_() {
        const pose = draft
        draft = null
        if (pose)
            posed(pose.x, pose.y, pose.yaw)
    }

    Rectangle {
        anchors.fill: parent
        color: Theme.mapUnknown
    }
    Item {
        id: layers
        anchors.fill: parent
    }
    PinchHandler {
        target: null
        property real scale_: 1
        property real angle_: 0
        property point at_

        function begin_() {
            scale_ = activeScale
            angle_ = activeRotation
            at_ = centroid.position
        }
        onActiveChanged: {
            plane.draft = null
            plane.moved()
            begin_()
        }
        onUpdated: {
            const at = centroid.position
            plane.camera.panBy(at.x - at_.x, at.y - at_.y)
            plane.camera.zoomBy(activeScale / scale_, at.x, at.y)
            plane.camera.rotateBy((angle_ - activeRotation) * Math.PI / 180, at.x, at.y)
            begin_()
        }
    }
    MouseArea {
        id: pointer
        objectName: "pointer"
        anchors.fill: parent
        hoverEnabled: true
        acceptedButtons: Qt.LeftButton | Qt.RightButton | Qt.MiddleButton
        cursorShape: plane.aims ? Qt.CrossCursor : pressed ? Qt.ClosedHandCursor : Qt.ArrowCursor

        property real lastX_: 0
        property real lastY_: 0
        property bool dragged_: false
        property bool turns_: false

        onPressed: function(mouse) {
            plane.forceActiveFocus(Qt.MouseFocusReason)
            lastX_ = mouse.x
            lastY_ = mouse.y
            dragged_ = false
            turns_ = mouse.button === Qt.RightButton || (mouse.modifiers & Qt.ShiftModifier)
            if (plane.aims && mouse.button === Qt.LeftButton) {
                const at = plane.camera.toMap(mouse.x, mouse.y)
                const from = plane.from
                plane.draft = { x: at.x, y: at.y, yaw: from ? Math.atan2(at.y - from.y, at.x - from.x) : 0 }
            }
        }
        onPositionChanged: function(mouse) {
            if (!pressed)
                return
            dragged_ = dragged_ || Math.hypot(mouse.x - lastX_, mouse.y - lastY_) > 4
            if (!dragged_)
                return
            const draft = plane.draft
            if (draft) {
                const at = plane.camera.toMap(mouse.x, mouse.y)
                plane.draft = { x: draft.x, y: draft.y, yaw: Math.atan2(at.y - draft.y, at.x - draft.x) }
                return
            }
            if (turns_) {
                const before = Math.atan2(lastY_ - height / 2, lastX_ - width / 2)
                const now = Math.atan2(mouse.y - height / 2, mouse.x - width / 2)
                plane.turn_(before - now)
            } else {
                plane.moved()
                plane.camera.panBy(mouse.x - lastX_, mouse.y - lastY_)
            }
            lastX_ = mouse.x
            lastY_ = mouse.y
        }
        onReleased: function(mouse) {
            if (plane.draft && mouse.button === Qt.LeftButton) {
                plane.release_()
            } else if (!dragged_ && !plane.aims) {
                const at = plane.camera.toMap(mouse.x, mouse.y)
                plane.clicked(at.x, at.y)
            }
        }
        // Not released by the hand: nothing is set.
        onCanceled: plane.draft = null
        onWheel: function(wheel) {
            const about = plane.centered ? Qt.point(width / 2, height / 2) : Qt.point(wheel.x, wheel.y)
            plane.camera.zoomBy(Math.pow(1.2, wheel.angleDelta.y / 120), about.x, about.y)
        }
    }
    FocusRing { item: plane }
}
