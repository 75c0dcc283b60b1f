// A window of the layout beside the main one, on a screen of its own. Several children are side by side, as in a Split.
import QtQuick 2.15
import QtQuick.Window 2.15
import RosControls 1.0
import "elements.js" as Elements

// `x`, `y`, `width` and `height` are those of the window, in pixels from the corner of its screen.
Item {
    id: panelWindow

    readonly property string element_: "window"
    readonly property Item cockpit_: Elements.cockpitOf(parent)
    readonly property Item holder_: body

    property string title
    // Name of its screen; empty for the primary one, which also stands in for one that is not there.
    property string screenName
    // Fills the screen, without a frame.
    property bool fullScreen: false
    property int orientation: Qt.Horizontal
    // Whether it is shown. Closed by its frame, it is opened by a button on the bar of pages.
    property bool open: true
    // The screen it is on, and what is wrong with that; empty if it is the one that was asked for.
    readonly property string onScreen: screen_ ? screen_.name : ""
    readonly property string problem: screenName && onScreen !== screenName
        ? qsTr("The screen %1 is not there: shown on %2").arg(screenName).arg(onScreen || qsTr("the primary screen")) : ""

    default property alias content: body.data

    readonly property var screens_: Qt.application.screens
    readonly property var screen_: {
        for (let at = 0; at < screens_.length; at++)
            if (screens_[at].name === screenName)
                return screens_[at]
        return screens_.length ? screens_[0] : null
    }

    implicitWidth: 800 * Theme.size
    implicitHeight: 600 * Theme.size
    visible: false

    function arrange() {
        body.arrange()
    }

    onProblemChanged: if (problem) console.warn("PanelWindow " + title + ": " + problem)

    Window {
        id: frame

        title: panelWindow.title
        color: Theme.background
        screen: panelWindow.screen_
        x: (panelWindow.screen_ ? panelWindow.screen_.virtualX : 0) + (panelWindow.fullScreen ? 0 : panelWindow.x)
        y: (panelWindow.screen_ ? panelWindow.screen_.virtualY : 0) + (panelWindow.fullScreen ? 0 : panelWindow.y)
        width: panelWindow.screen_ ? Math.min(panelWindow.fullScreen ? panelWindow.screen_.width : panelWindow.width, panelWindow.screen_.width) : panelWindow.width
        height: panelWindow.screen_ ? Math.min(panelWindow.fullScreen ? panelWindow.screen_.height : panelWindow.height, panelWindow.screen_.height) : panelWindow.height
        visible: panelWindow.open
        visibility: !panelWindow.open ? Window.Hidden : panelWindow.fullScreen ? Window.FullScreen : Window.Windowed
        // Where the hand has put it, in edit mode: once it lies still, and not where a window manager puts a new one.
        onXChanged: moved_()
        onYChanged: moved_()
        onWidthChanged: moved_()
        onHeightChanged: moved_()
        function moved_() {
            if (visible && active && !settling.running && !panelWindow.fullScreen && panelWindow.cockpit_ && panelWindow.cockpit_.editing)
                still.restart()
        }
        onVisibleChanged: if (visible) settling.restart()
        onClosing: {
            if (panelWindow.cockpit_ && panelWindow.cockpit_.editing)
                panelWindow.cockpit_.windowClosed(panelWindow)
            panelWindow.open = false
        }

        Timer {
            id: settling
            interval: 1000
        }
        Timer {
            id: still
            interval: 400
            onTriggered: {
                const on = frame.screen, corner = { x: on ? on.virtualX : 0, y: on ? on.virtualY : 0 }
                const x = frame.x - corner.x, y = frame.y - corner.y
                if (x !== panelWindow.x || y !== panelWindow.y || frame.width !== panelWindow.width || frame.height !== panelWindow.height)
                    panelWindow.cockpit_.windowMoved(panelWindow, panelWindow.screenName && on ? on.name : "", x, y, frame.width, frame.height)
            }
        }
        CockpitKeys { cockpit: panelWindow.cockpit_ }
        ThemeText {
            id: note
            anchors { left: parent.left; right: parent.right; top: parent.top; margins: visible ? Theme.gap / 2 : 0 }
            height: visible ? implicitHeight : 0
            visible: text !== ""
            text: panelWindow.problem
            color: Theme.warn
            font.pixelSize: Theme.small
        }
        // Its children look for the Cockpit in their parents.
        Item {
            readonly property Item cockpit_: panelWindow.cockpit_
            anchors { left: parent.left; right: parent.right; top: note.bottom; bottom: parent.bottom }
            Split {
                id: body
                anchors { fill: parent; margins: spacing }
                orientation: panelWindow.orientation
            }
        }
    }
}
