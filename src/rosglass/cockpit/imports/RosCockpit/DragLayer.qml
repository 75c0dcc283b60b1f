// What edit mode adds to a Cockpit: panels dragged by their titles, the places to drop them at, and the keys that do the same.
import QtQuick 2.15
import RosControls 1.0
import "elements.js" as Elements

Item {
    id: layer

    property Item cockpit: null
    // The panel that is dragged, and the one whose size the arrow keys change; null without one.
    property Item panel: null
    // Whether a title is pressed.
    property bool holding: false
    property Item resized: null
    // Where the panel would go now; see the signal moved of Cockpit. Without a target, nowhere.
    property var target: null
    property string edge
    // Whether it would go to a window of its own.
    property bool outside: false

    property point global_: Qt.point(0, 0)

    function begin(wanted) {
        cancel()
        panel = wanted
        return true
    }

    function cancel() {
        panel = null
        target = null
        outside = false
        pageTimer.stop()
        mark.parent = layer
    }

    function move(point) {
        if (!panel)
            return
        global_ = point
        const found = find_(point)
        target = found.target || null
        edge = found.edge || ""
        outside = !!found.outside
        showMark_(found)
        const here = layer.mapFromGlobal(point.x, point.y)
        ghost.x = Math.max(0, Math.min(width - ghost.width, here.x + 12))
        ghost.y = Math.max(0, Math.min(height - ghost.height, here.y + 12))
    }

    function drop() {
        const one = panel, to = target, side = edge, away = outside, at = global_
        cancel()
        if (!one)
            return
        if (to) {
            cockpit.moved(one, to, side)
        } else if (away) {
            const screen = screenAt_(at)
            const x = screen ? screen.virtualX : 0, y = screen ? screen.virtualY : 0
            cockpit.detached(one, screen ? screen.name : "", Math.max(0, Math.round(at.x - x - one.width / 2)),
                Math.max(0, Math.round(at.y - y - 12)), Math.round(Math.max(240, one.width)), Math.round(Math.max(160, one.height)))
        }
    }

    function screenAt_(point) {
        const all = Qt.application.screens
        for (let at = 0; at < all.length; at++) {
            const one = all[at]
            if (point.x >= one.virtualX && point.y >= one.virtualY && point.x < one.virtualX + one.width && point.y < one.virtualY + one.height)
                return one
        }
        return all.length ? all[0] : null
    }

    function inside_(item, point) {
        return point.x >= 0 && point.y >= 0 && point.x < item.width && point.y < item.height
    }

    // What is under a point of the screen: { target, edge, root } or { page } or { outside }.
    function find_(global) {
        for (const one of cockpit.windows) {
            const root = one.holder_
            if (one.open && inside_(root.parent, root.parent.mapFromGlobal(global.x, global.y)))
                return findIn_(root, one, root.mapFromGlobal(global.x, global.y))
        }
        const here = cockpit.mapFromGlobal(global.x, global.y)
        if (!inside_(cockpit, here))
            return { outside: true }
        const bar = cockpit.bar_
        const onBar = bar.mapFromGlobal(global.x, global.y)
        if (inside_(bar, onBar)) {
            const page = bar.pageAt(onBar.x, onBar.y)
            if (!page || page === cockpit.page) {
                pageTimer.stop()
                return {}
            }
            pageTimer.page = page
            if (!pageTimer.running)
                pageTimer.start()
            return { target: page, edge: "center", page: page }
        }
        pageTimer.stop()
        const page = cockpit.page
        return page ? findIn_(page, page, page.mapFromGlobal(global.x, global.y)) : {}
    }

    // In a page or window. The outermost pixels stand for all of it.
    function findIn_(root, element, point) {
        if (!root.elements_.length)
            return { target: element, edge: "center", root: root }
        const rim = 12
        const whole = side_(point.x, root.width - point.x, point.y, root.height - point.y, rim)
        if (whole && !(root.elements_.length === 1 && root.elements_[0] === panel))
            return { target: element, edge: whole, root: root }
        let item = root
        while (item && item.element_ !== "panel") {
            const local = item.mapFromItem(root, point.x, point.y)
            if (item.element_ === "tabs") {
                const tab = item.tabAt(local.x, local.y)
                if (tab)
                    return tab.item === panel ? {} : { target: tab.item, edge: tab.edge, root: root, mark: tab.rect, of: item }
                if (panel.tabs_ === item && item.count === 1)
                    return {}
                break
            }
            item = (item.elements_ || []).find(child => inside_(child, child.mapFromItem(root, point.x, point.y))) || null
        }
        if (!item || item === panel)
            return {}
        const local = item.mapFromItem(root, point.x, point.y)
        const near = side_(local.x / item.width, 1 - local.x / item.width, local.y / item.height, 1 - local.y / item.height, 0.28)
        if (!near && item.element_ !== "tabs" && item.element_ !== "panel")
            return {}
        if (!near && panel.tabs_ === item)
            return {}
        return { target: item, edge: near || "center", root: root }
    }

    function side_(left, right, top, bottom, within) {
        const least = Math.min(left, right, top, bottom)
        return least > within ? "" : least === left ? "left" : least === right ? "right" : least === top ? "top" : "bottom"
    }

    function showMark_(found) {
        if (!found.root || !found.target) {
            mark.parent = layer
            mark.visible_ = false
            return
        }
        // In the window of the target.
        const over = found.root.element_ === "page" ? layer : found.root.parent
        const item = found.of || (found.target.element_ === "window" ? found.root : found.target)
        const at = item.mapToItem(over, 0, 0)
        let x = at.x, y = at.y, wide = item.width, high = item.height
        if (found.mark) {
            x += found.mark.x
            y += found.mark.y
            wide = found.mark.width
            high = found.mark.height
        } else if (found.edge === "left" || found.edge === "right") {
            x += found.edge === "right" ? wide / 2 : 0
            wide /= 2
        } else if (found.edge === "top" || found.edge === "bottom") {
            y += found.edge === "bottom" ? high / 2 : 0
            high /= 2
        }
        mark.parent = over
        mark.x = x
        mark.y = y
        mark.width = wide
        mark.height = high
        mark.visible_ = true
    }

    // -- by keys --

    // Of a panel whose title has the keyboard; returns whether the key was used.
    function key(one, event) {
        const arrows = {}
        arrows[Qt.Key_Left] = "left"
        arrows[Qt.Key_Right] = "right"
        arrows[Qt.Key_Up] = "top"
        arrows[Qt.Key_Down] = "bottom"
        const arrow = arrows[event.key]
        if (event.key === Qt.Key_Escape && (panel || resized)) {
            cancel()
            resized = null
        } else if (resized && arrow) {
            resizeBy_(one, arrow, event.modifiers & Qt.ShiftModifier ? 1 : 20)
        } else if (resized && (event.key === Qt.Key_Return || event.key === Qt.Key_Enter)) {
            resized = null
        } else if (event.key === Qt.Key_F8) {
            beginResize(resized ? null : one)
        } else if (event.key === Qt.Key_F2) {
            one.rename()
        } else if (event.key === Qt.Key_Delete && !event.modifiers) {
            cockpit.removed(one)
        } else if (arrow && (event.modifiers & Qt.ControlModifier) && (event.modifiers & Qt.ShiftModifier)) {
            moveBeside(one, arrow)
        } else {
            return false
        }
        return true
    }

    function beginResize(one) {
        resized = one
        if (one)
            one.focusTitle()
    }

    // The right and lower edge follow the arrow; of a panel at the end, the left or upper one.
    function resizeBy_(one, arrow, step) {
        const across = arrow === "left" || arrow === "right"
        const by = arrow === "right" || arrow === "bottom" ? step : -step
        for (let item = one; item; item = item.parent) {
            const split = item.parent
            if (!split || !split.elements_ || split.orientation === undefined || split.vertical_ === across || split.elements_.length < 2)
                continue
            const at = split.elements_.indexOf(item)
            if (at >= 0 && split.handles_) {
                split.handles_.nudge(Math.min(at, split.elements_.length - 2), by)
                return
            }
        }
    }

    // Moves a panel past its neighbour on a side; without one, to that edge of its page or window.
    function moveBeside(one, side) {
        if (one.tabs_ !== null && one.tabs_.count > 1) {
            cockpit.moved(one, one.tabs_, side)
            return
        }
        const root = Elements.around(one, "page") || cockpit.windows.find(window => Elements.contains(window.holder_, one))
        if (!root)
            return
        const holder = root.holder_
        const self = one.tabs_ || one
        const mine = rect_(self, holder)
        let best = null, least = Infinity
        for (const other of leaves_(holder)) {
            if (other === self)
                continue
            const its = rect_(other, holder)
            const across = side === "left" || side === "right"
            const overlap = across ? Math.min(mine.bottom, its.bottom) - Math.max(mine.top, its.top)
                : Math.min(mine.right, its.right) - Math.max(mine.left, its.left)
            const far = side === "left" ? mine.left - its.right : side === "right" ? its.left - mine.right
                : side === "top" ? mine.top - its.bottom : its.top - mine.bottom
            if (overlap > 0 && far > -2 && far - overlap / 10000 < least) {
                least = far - overlap / 10000
                best = other
            }
        }
        if (best || holder.elements_.length > 1)
            cockpit.moved(one, best || root, side)
    }

    function rect_(item, root) {
        const at = item.mapToItem(root, 0, 0)
        return { left: at.x, top: at.y, right: at.x + item.width, bottom: at.y + item.height }
    }

    function leaves_(root) {
        let found = []
        for (const item of root.elements_)
            if (item.element_ === "split")
                found = found.concat(leaves_(item))
            else
                found.push(item)
        return found
    }

    Timer {
        id: pageTimer
        property Item page: null
        interval: 500
        onTriggered: if (page && layer.panel) layer.cockpit.showPage(page)
    }
    Rectangle {
        id: mark
        objectName: "dropMark"
        property bool visible_: false
        z: 10
        visible: visible_ && layer.panel !== null
        color: Qt.rgba(Theme.accent.r, Theme.accent.g, Theme.accent.b, 0.25)
        border { color: Theme.accent; width: 2 }
        radius: Theme.radius / 2
    }
    Rectangle {
        id: ghost
        visible: layer.panel !== null
        width: Math.min(260, label.implicitWidth + 2 * Theme.gap)
        height: Theme.touch
        radius: Theme.radius
        color: Theme.panel
        opacity: 0.9
        border { color: Theme.accent; width: 1 }
        ThemeText {
            id: label
            anchors { fill: parent; leftMargin: Theme.gap; rightMargin: Theme.gap }
            verticalAlignment: Text.AlignVCenter
            text: !layer.panel ? "" : layer.outside ? qsTr("%1: own window").arg(layer.panel.title_)
                : layer.target && layer.target.element_ === "page" && layer.edge === "center" ? qsTr("%1: to %2").arg(layer.panel.title_).arg(layer.target.title)
                : layer.panel.title_
        }
    }
    Rectangle {
        anchors { horizontalCenter: parent.horizontalCenter; bottom: parent.bottom; margins: Theme.gap }
        visible: layer.resized !== null
        width: hint.implicitWidth + 2 * Theme.gap
        height: Theme.touch
        radius: Theme.radius
        color: Theme.panel
        border { color: Theme.accent; width: 1 }
        ThemeText {
            id: hint
            anchors.centerIn: parent
            text: layer.resized ? qsTr("Size of %1: arrow keys; Enter when done").arg(layer.resized.title_) : ""
        }
    }
}
