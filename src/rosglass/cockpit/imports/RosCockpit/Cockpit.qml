// The root of a layout: pages of panels, a bar to choose the page, and what is written beside them.
// In use mode nothing moves; while `editing`, the wishes of the hand are signals, which an editor carries out.
import QtQuick 2.15
import Ros2 1.0
import RosControls 1.0
import "elements.js" as Elements

Item {
    id: cockpit

    readonly property string element_: "cockpit"
    // For children, which look for it in their parents; see elements.js.
    readonly property Item cockpit_: cockpit

    // Title of the window, and name of the node.
    property string title
    property string nodeName: "cockpit"
    // Edit mode: panels can be moved, split, resized, renamed and removed.
    property bool editing: false
    // Number of the page that is shown, from 0; the page, and all of them.
    property int pageIndex: 0
    readonly property Item page: pages.length ? pages[Math.max(0, Math.min(pageIndex, pages.length - 1))] : null
    property var pages: []
    // The windows of the layout beside the main one.
    property var windows: []
    // The panel that the hand was in last; keys go to it.
    property Item current: null
    // The panel that fills its page, and null if none does.
    readonly property Item maximized: maximized_
    // Further entries of the menu of panels: [{ name: "settings", text: "Settings" }, ...].
    property var panelActions: []
    // Keys that this module uses, with what they do: [[keys, text], ...].
    readonly property var keyMap: [
        [qsTr("Ctrl+1 … Ctrl+9"), qsTr("page")],
        [qsTr("Ctrl+Page Up, Ctrl+Page Down"), qsTr("page before, page after")],
        [qsTr("Ctrl+Tab, Ctrl+Shift+Tab"), qsTr("next tab, last tab")],
        [qsTr("F6, Shift+F6"), qsTr("next panel, last panel")],
        [qsTr("F11"), qsTr("maximise the panel, restore it")],
        [qsTr("Shift+F10"), qsTr("menu of the panel")],
        [qsTr("F1"), qsTr("help on the panel")]
    ]
    // Keys of edit mode: of the panel whose title has the keyboard (F6), and of a page's button.
    readonly property var editKeyMap: [
        [qsTr("Ctrl+Shift+arrow keys"), qsTr("move the panel past its neighbour, or to the edge of the page; move the page")],
        [qsTr("F8, arrow keys, Enter"), qsTr("change the size of the panel; with Shift, finely")],
        [qsTr("F2"), qsTr("rename the panel or page")],
        [qsTr("Del"), qsTr("remove the panel or page")],
        [qsTr("Esc"), qsTr("cancel dragging")]
    ]

    default property alias content: area.data
    readonly property Item holder_: stage
    readonly property Item area_: area
    readonly property alias bar_: bar

    property Item maximized_: null
    property bool halting_: false
    // What drags panels, in edit mode.
    readonly property var drag_: drag.item

    // F1 was pressed, or an entry of `panelActions` chosen.
    signal helpRequested(var panel)
    signal actionChosen(var panel, string name)

    // What the hand wants, in edit mode. `edge` is "left", "right", "top" or "bottom" of the target, "center" for
    // tabs with it (or the end of a Page, Tabs or PanelWindow), or "before" and "after" for its place among tabs.
    signal moved(var panel, var target, string edge)
    signal resized(var split, var shares)
    // A panel goes to a window of its own: on a screen, in pixels from the screen's corner.
    signal detached(var panel, string screenName, real x, real y, real width, real height)
    signal windowMoved(var window, string screenName, real x, real y, real width, real height)
    signal windowClosed(var window)
    signal renamed(var element, string title)
    signal removed(var element)
    signal pageAdded()
    signal pageMoved(var page, int index)

    // Halts every command of the layout: what is held has to be let go first.
    function halt() {
        halting_ = true
        halting_ = false
    }

    // Shows a page, by its number from 0 or itself.
    function showPage(wanted) {
        const index = typeof wanted === "number" ? wanted : pages.indexOf(wanted)
        if (!(index >= 0 && index < pages.length)) {
            console.error("Cockpit.showPage: expected a page from 0 to " + (pages.length - 1) + "; got " + wanted)
            return
        }
        pageIndex = index
    }

    // Shows the page of a robot: the first one with its namespace as `ns`. Returns whether there is one.
    function showRobot(ns) {
        const index = pages.findIndex(one => one.ns !== "" && one.ns === ns)
        if (index >= 0)
            showPage(index)
        return index >= 0
    }

    // Lets a panel fill its page or window; null restores what is maximised.
    function maximize(panel) {
        if (panel === maximized_)
            return
        halt()
        maximized_ = panel
    }

    // The panels of the page and of all windows, in the order of the file.
    function panels() {
        let found = [], waiting = windows.map(one => one.holder_).reverse()
        waiting.push(page || stage)
        while (waiting.length) {
            const item = waiting.pop()
            if (item.element_ === "panel")
                found.push(item)
            else
                for (let at = item.children.length - 1; at >= 0; at--)
                    waiting.push(item.children[at])
        }
        return found
    }

    // Gives the keyboard to the next panel; by -1, to the last one.
    function nextPanel(step) {
        const all = panels().filter(one => one.onScreen_)
        if (!all.length)
            return
        const at = all.indexOf(current)
        all[at < 0 ? (step > 0 ? 0 : all.length - 1) : (at + step + all.length) % all.length].focusTitle()
    }

    // Shows the next tab of the tabs around the current panel, or of the first ones of the page.
    function nextTab(step) {
        let tabs = current
        while (tabs && tabs.element_ !== "tabs")
            tabs = tabs.parent
        if (!tabs) {
            const inside = panels().find(one => one.tabs_ !== null && one.onScreen_)
            tabs = inside ? inside.tabs_ : null
        }
        if (tabs)
            tabs.next(step)
    }

    function arrange() {
        if (arranging_)
            return
        arranging_ = true
        for (const child of Elements.list(area.children)) {
            if (child.element_ !== undefined && child.element_ !== "window")
                child.parent = stage
        }
        for (const child of Elements.list(stage.children)) {
            if (child.element_ !== "page") {
                child.anchors.fill = stage
                child.shown_ = true
            }
        }
        pages = Elements.list(stage.children).filter(child => child.element_ === "page")
        windows = Elements.list(area.children).filter(child => child.element_ === "window")
        arranging_ = false
    }

    onPageChanged: {
        maximized_ = null
        halt()
        if (current && current.cockpit_ === cockpit && !current.onScreen_)
            current = null
    }
    onEditingChanged: {
        maximized_ = null
        halt()
        for (const panel of panels())
            panel.attach()
    }
    onPageIndexChanged: {
        if (complete_ && !(pageIndex >= 0 && pageIndex < Math.max(1, pages.length)))
            console.error("Cockpit.pageIndex is from 0 to " + (pages.length - 1) + "; got " + pageIndex)
    }
    property bool complete_: false
    property bool arranging_: false
    Component.onCompleted: {
        arrange()
        complete_ = true
        // After a handler of the layout, which may have its own name for the node.
        Qt.callLater(function() { if (cockpit && !Ros2.isInitialized()) Ros2.init(cockpit.nodeName) })
    }

    implicitWidth: 1024 * Theme.size
    implicitHeight: 640 * Theme.size
    Accessible.role: Accessible.Pane
    Accessible.name: title

    Rectangle {
        anchors.fill: parent
        color: Theme.background
    }
    CockpitKeys { cockpit: cockpit }
    PageBar {
        id: bar
        objectName: "pageBar"
        anchors { left: parent.left; right: parent.right; top: parent.top }
        height: visible ? implicitHeight : 0
        visible: cockpit.pages.length > 1 || cockpit.editing || closed_.length > 0
        cockpit: cockpit
    }
    Loader {
        id: drag
        anchors.fill: parent
        z: 1
        active: cockpit.editing
        source: "DragLayer.qml"
        onLoaded: item.cockpit = cockpit
    }
    ThemeText {
        objectName: "emptyPage"
        anchors.centerIn: stage
        width: Math.min(stage.width - 2 * Theme.gap, 420 * Theme.size)
        // A panel that is in a window of its own still belongs to the page.
        visible: cockpit.page !== null && cockpit.page.elements_.length === 0
            && !Elements.list(cockpit.page.children).some(child => child.element_ !== undefined)
        text: cockpit.editing ? qsTr("This page is empty: choose a panel from the list, or drag one here.")
            : qsTr("This page is empty. Edit the layout to add panels.")
        color: Theme.dim
        wrapMode: Text.Wrap
        horizontalAlignment: Text.AlignHCenter
        Accessible.role: Accessible.StaticText
        Accessible.name: text
    }
    Item {
        id: stage
        anchors { left: parent.left; right: parent.right; top: bar.bottom; bottom: parent.bottom }
        onChildrenChanged: if (cockpit.complete_) cockpit.arrange()
    }
    // What is written beside the pages is above them, and at home here: windows, commands, an emergency stop.
    Item {
        id: area
        anchors.fill: stage
        enabled: !cockpit.halting_
        onChildrenChanged: if (cockpit.complete_) cockpit.arrange()
    }
}
