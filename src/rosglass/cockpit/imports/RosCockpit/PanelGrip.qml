// What the pointer does with the title of a panel: choose, maximise by a double click, the menu by the right button, and in
// edit mode, drag the panel.
import QtQuick 2.15

MouseArea {
    id: grip

    property Item panel: null
    readonly property Item cockpit_: panel ? panel.cockpit_ : null
    readonly property var drag_: cockpit_ ? cockpit_.drag_ : null
    property point start_: Qt.point(0, 0)
    property bool dragging_: false

    acceptedButtons: Qt.LeftButton | Qt.RightButton
    preventStealing: true
    cursorShape: !drag_ ? Qt.ArrowCursor : dragging_ ? Qt.ClosedHandCursor : Qt.OpenHandCursor

    onPressed: function(mouse) {
        if (!panel)
            return
        // In edit mode, it is chosen when it is let go: what an editor shows of it must not move the places to drop at.
        if (drag_)
            drag_.holding = true
        panel.focusTitle()
        start_ = Qt.point(mouse.x, mouse.y)
        if (mouse.button === Qt.RightButton)
            panel.openMenu()
    }
    onDoubleClicked: function(mouse) {
        if (panel && mouse.button === Qt.LeftButton && !panel.detached)
            panel.toggleMaximized()
    }
    onPositionChanged: function(mouse) {
        if (!(mouse.buttons & Qt.LeftButton) || !panel || !drag_)
            return
        if (!dragging_ && Math.hypot(mouse.x - start_.x, mouse.y - start_.y) > 8)
            dragging_ = drag_.begin(panel)
        if (dragging_)
            drag_.move(mapToGlobal(mouse.x, mouse.y))
    }
    onReleased: end_(true)
    onCanceled: end_(false)
    function end_(drops) {
        const one = panel, drag = drag_, was = dragging_
        dragging_ = false
        if (!drag)
            return
        drag.holding = false
        if (one && cockpit_)
            cockpit_.current = one
        if (was && drops)
            drag.drop()
        else if (was)
            drag.cancel()
    }
}
