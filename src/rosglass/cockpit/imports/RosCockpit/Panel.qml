// A titled place for a control: it can fill its page, go to a window of its own, and says what is wrong with its content.
import QtQuick 2.15
import QtQuick.Window 2.15
import RosControls 1.0
import "elements.js" as Elements

Item {
    id: panel

    readonly property string element_: "panel"
    readonly property Item cockpit_: Elements.cockpitOf(parent)

    property string title
    // Its share of a Split.
    property real share: 1
    // Pixels that it needs at least; by default, what its content asks for.
    property size minimumSize: Qt.size(0, 0)
    // Why its content cannot be shown; empty if it can.
    property string problem
    // Whether it is in a window of its own now, and the panel of it that fills its page.
    readonly property bool detached: window_ !== null

    // A single item fills the panel, unless it has anchors; several stay where they place themselves.
    default property alias content: body.data
    readonly property Item holder_: body
    readonly property alias frame_: frame

    // Whether the keyboard is in it, or the hand was in it last.
    readonly property bool current_: cockpit_ ? cockpit_.current === panel : frame.activeFocus
    readonly property bool isMaximized_: cockpit_ !== null && cockpit_.maximized === panel
    readonly property bool onScreen_: detached || visible
    readonly property Item tabs_: parent && parent.parent && parent.parent.element_ === "tabs" && parent.parent.holder_ === parent ? parent.parent : null
    property bool shown_: true
    readonly property bool away_: detached
    property var window_: null
    // The item that fills the panel.
    property Item only_: null
    property bool complete_: false
    readonly property bool empty_: complete_ && body.children.length === 0 && problem === ""
    // A framed control leaves title, edge and status to the panel.
    readonly property Item framed_: only_ !== null && only_.shell_ === panel && only_.framed ? only_ : null
    readonly property string title_: title || (framed_ ? framed_.title : "")
    readonly property string status_: framed_ && !problem ? framed_.aside_ : ""
    readonly property bool wrong_: problem !== "" || (framed_ !== null && framed_.wrong)
    // Whether the title has no room for all of the status.
    property bool cut_: false
    readonly property size wanted_: {
        const hint = only_ ? only_.kddockwidgets_min_size : undefined
        if (hint !== undefined && hint.width > 0)
            return hint
        return only_ ? Qt.size(only_.implicitWidth, only_.implicitHeight) : Qt.size(0, 0)
    }
    readonly property real minimumWidth_: Math.max(Theme.touch * 1.5, minimumSize.width > 0 ? minimumSize.width : wanted_.width)
    readonly property real minimumHeight_: Math.max(Theme.touch * 1.5, (minimumSize.height > 0 ? minimumSize.height : wanted_.height) + bar.height)

    visible: shown_

    // Gives the keyboard to the panel, so that its keys go to it.
    function focusTitle() {
        choose_()
        bar.forceActiveFocus()
    }

    function choose_() {
        if (cockpit_ && !(cockpit_.drag_ && cockpit_.drag_.holding))
            cockpit_.current = panel
    }

    function toggleMaximized() {
        if (cockpit_ && !detached)
            cockpit_.maximize(isMaximized_ ? null : panel)
    }

    function toggleDetached() {
        if (detached)
            attach()
        else
            detach()
    }

    // Shows it in a window of its own: in edit mode, that is for an editor to do.
    function detach() {
        if (detached || !visible)
            return
        const place = panel.mapToGlobal(0, 0)
        const size = Qt.size(Math.max(240, width), Math.max(160, height))
        if (cockpit_ && cockpit_.editing) {
            cockpit_.detached(panel, Screen.name, place.x - Screen.virtualX, place.y - Screen.virtualY, size.width, size.height)
            return
        }
        if (cockpit_) {
            cockpit_.halt()
            if (isMaximized_)
                cockpit_.maximize(null)
        }
        const made = ownWindow.createObject(panel, { x: place.x, y: place.y, width: size.width, height: size.height })
        window_ = made
        frame.parent = made.contentItem
        made.visible = true
    }

    // Puts it back into the layout.
    function attach() {
        if (!detached)
            return
        if (cockpit_)
            cockpit_.halt()
        const made = window_
        frame.parent = panel
        window_ = null
        made.visible = false
        made.destroy()
    }

    // A robot was chosen in the panel: its page is shown, if there is one.
    function showRobot_(ns) {
        if (cockpit_ && !cockpit_.editing)
            cockpit_.showRobot(ns)
    }

    function openMenu() {
        if (cockpit_)
            cockpit_.halt()
        menu.active = true
        menu.item.open()
    }

    function rename() {
        if (cockpit_ && cockpit_.editing)
            bar.rename()
    }

    // An item that says itself where it is keeps its place.
    function fit_() {
        if (!panel || !body)
            return
        const all = body.children
        const one = all.length === 1 && !(all[0] instanceof Repeater) ? all[0] : null
        if (one !== null && !one.anchors.fill && !one.anchors.centerIn)
            one.anchors.fill = body
        only_ = one
        if (one !== null && one.shell_ !== undefined)
            one.shell_ = panel
    }

    onShareChanged: Elements.checkShare(panel, "Panel")
    Component.onCompleted: {
        complete_ = true
        fit_()
    }
    Component.onDestruction: if (cockpit_ && cockpit_.current === panel) cockpit_.current = null

    Component {
        id: ownWindow
        Window {
            title: panel.title_
            color: Theme.background
            onClosing: panel.attach()
            CockpitKeys { cockpit: panel.cockpit_ }
        }
    }
    Loader {
        id: menu
        active: false
        source: "PanelMenu.qml"
        onLoaded: item.panel = panel
    }

    FocusScope {
        id: frame
        anchors.fill: parent
        // An item that is only hidden keeps the keyboard: its keys would steer, and press its buttons.
        enabled: visible
        Accessible.role: Accessible.Grouping
        Accessible.name: panel.title_
        Accessible.description: panel.problem || panel.status_
        onActiveFocusChanged: if (activeFocus) panel.choose_()

        Rectangle {
            anchors.fill: parent
            color: Theme.panel
            radius: Theme.radius / 2
            border { color: panel.current_ ? Theme.faint : Theme.edge; width: 1 }
        }
        // Only then: whatever changes below it is painted again with it.
        Rectangle {
            z: 2
            anchors.fill: parent
            visible: panel.wrong_
            radius: Theme.radius / 2
            color: "transparent"
            border { color: Theme.bad; width: 2 }
        }
        PanelTitle {
            id: bar
            z: 1
            anchors { left: parent.left; right: parent.right; top: parent.top }
            // Tabs have the titles of theirs.
            height: panel.tabs_ === null || panel.detached ? Math.round(24 * Theme.size) : 0
            panel: panel
        }
        Item {
            id: body
            anchors { left: parent.left; right: parent.right; top: bar.bottom; bottom: parent.bottom; margins: 1 }
            visible: panel.problem === ""
            enabled: !panel.cockpit_ || !panel.cockpit_.halting_
            // Not always: what is cut is drawn apart from the rest.
            clip: width < panel.wanted_.width || height < panel.wanted_.height
            onChildrenChanged: if (panel.complete_) Qt.callLater(panel.fit_)
        }
        // Above the control, which would keep a press for itself.
        Item {
            z: 1
            anchors.fill: body
            PointHandler {
                acceptedDevices: PointerDevice.AllDevices
                onActiveChanged: if (active && panel.cockpit_) panel.cockpit_.current = panel
            }
        }
        Loader {
            anchors.fill: body
            active: panel.problem !== "" || panel.empty_
            sourceComponent: ThemeText {
                objectName: "panelText"
                text: panel.problem ? panel.problem
                    : panel.cockpit_ && panel.cockpit_.editing ? qsTr("Empty: choose what it shows from the list of panels, or drag a panel here.")
                    : qsTr("This panel is empty. Edit the layout to say what it shows.")
                color: panel.problem ? Theme.bad : Theme.dim
                padding: Theme.gap
                wrapMode: Text.Wrap
                horizontalAlignment: Text.AlignHCenter
                verticalAlignment: Text.AlignVCenter
                Accessible.role: Accessible.StaticText
                Accessible.name: text
            }
        }
    }
}
