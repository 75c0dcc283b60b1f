// Nodes and topics of the robot as a graph: drag to move it, turn the wheel or pinch to zoom.
import QtQuick 2.15
import RosControls 1.0

LiveFrame {
    id: view

    // Text that names of nodes or topics contain; what is connected to these is shown, too.
    property alias filter: field.text
    // Namespace of nodes or topics; empty for all.
    property string ns
    // Names of nodes and topics that are left out.
    property alias hide: graph.hide
    // Whether hidden names are included, such as topics of actions.
    property alias showHidden: graph.showHidden
    // Whether topics are shown; otherwise nodes are connected directly.
    property alias showTopics: graph.showTopics
    // Name of the selected node or topic; empty for none.
    readonly property string selected: selected_.substring(selected_.indexOf(" ") + 1)

    // Enter, or a double click on a node or topic.
    signal activated(string name, bool isNode)

    property string selected_
    property bool moved_: false
    readonly property real column_: 250 * Theme.size
    readonly property real line_: 44 * Theme.size
    readonly property real box_: 190 * Theme.size
    // Lines stay visible in a graph that is made small.
    readonly property real thin_: Math.max(1, 1 / canvas.scale)
    readonly property string detail_: {
        const row = graph.version >= 0 && graph.items ? graph.items.find(selected_) : -1
        if (row < 0)
            return ""
        return selected + " — " + (graph.items.value(row, "conflict") || graph.items.value(row, "detail"))
    }

    // Show all of the graph, not enlarged.
    function fit() {
        moved_ = false
        place_()
    }
    function place_() {
        if (moved_ || graph.count === 0)
            return
        canvas.scale = Math.max(0.05, Math.min(1, area.width / canvas.width, area.height / canvas.height))
        canvas.x = (area.width - canvas.width * canvas.scale) / 2
        canvas.y = (area.height - canvas.height * canvas.scale) / 2
    }
    // Zoom around a point of the area.
    function zoom_(factor, x, y) {
        const scale = Math.max(0.05, Math.min(4, canvas.scale * factor))
        canvas.x = x - (x - canvas.x) * scale / canvas.scale
        canvas.y = y - (y - canvas.y) * scale / canvas.scale
        canvas.scale = scale
        moved_ = true
    }
    function select_(key) {
        selected_ = key
        const row = graph.items.find(key)
        if (row < 0)
            return
        // Into the area, if it is not there.
        const x = canvas.x + (graph.items.value(row, "column") + 0.5) * column_ * canvas.scale
        const y = canvas.y + (graph.items.value(row, "line") + 0.5) * line_ * canvas.scale
        if (x < 0 || x > area.width || y < 0 || y > area.height) {
            canvas.x += area.width / 2 - x
            canvas.y += area.height / 2 - y
            moved_ = true
        }
    }

    title: qsTr("Nodes and topics")
    source: graph
    age: graph.count > 0 ? 0 : -1
    note: graph.omitted > 0 ? qsTr("%1 not shown: enter a filter").arg(graph.omitted) : qsTr("%1 shown").arg(graph.count)
    contentWidth: 480 * Theme.size
    contentHeight: 320 * Theme.size

    GraphLayout {
        id: graph
        ns: view.ns
        filter: view.filter
        onVersionChanged: view.place_()
    }
    ThemeField {
        id: field
        objectName: "filter"
        anchors { left: parent.left; right: whole.left; rightMargin: Theme.gap }
        placeholderText: qsTr("Filter by name")
    }
    ThemeButton {
        id: whole
        anchors.right: parent.right
        text: qsTr("Fit")
        Accessible.description: qsTr("Show all of the graph")
        onClicked: view.fit()
    }
    Item {
        id: area
        objectName: "area"
        anchors { top: field.bottom; topMargin: Theme.gap / 2; left: parent.left; right: parent.right; bottom: detail.top }
        clip: true
        activeFocusOnTab: true
        Accessible.role: Accessible.Chart
        Accessible.name: view.title
        Accessible.description: view.detail_
        Accessible.focusable: true
        onWidthChanged: view.place_()
        onHeightChanged: view.place_()

        Keys.onPressed: function(event) {
            event.accepted = true
            if (event.key === Qt.Key_Right)
                view.select_(graph.neighbour(view.selected_, 1, 0))
            else if (event.key === Qt.Key_Left)
                view.select_(graph.neighbour(view.selected_, -1, 0))
            else if (event.key === Qt.Key_Down)
                view.select_(graph.neighbour(view.selected_, 0, 1))
            else if (event.key === Qt.Key_Up)
                view.select_(graph.neighbour(view.selected_, 0, -1))
            else if (event.key === Qt.Key_Plus || event.key === Qt.Key_Equal)
                view.zoom_(1.25, width / 2, height / 2)
            else if (event.key === Qt.Key_Minus)
                view.zoom_(0.8, width / 2, height / 2)
            else if (event.key === Qt.Key_0 || event.key === Qt.Key_Home)
                view.fit()
            else if (event.key === Qt.Key_Escape && view.selected_)
                view.selected_ = ""
            else if ((event.key === Qt.Key_Return || event.key === Qt.Key_Enter) && view.selected_)
                view.activated(view.selected, view.selected_.indexOf("node ") === 0)
            else if (event.matches(StandardKey.Copy) && view.selected_)
                graph.copy(view.selected_)
            else
                event.accepted = false
        }

        PinchHandler {
            target: canvas
            minimumRotation: 0
            maximumRotation: 0
            minimumScale: 0.05
            maximumScale: 4
            onActiveChanged: view.moved_ = true
        }
        MouseArea {
            anchors.fill: parent
            drag.target: canvas
            drag.threshold: 4
            onPressed: area.forceActiveFocus()
            onPositionChanged: if (drag.active) view.moved_ = true
            onClicked: view.selected_ = ""
            onWheel: function(wheel) { view.zoom_(Math.pow(1.0015, wheel.angleDelta.y), wheel.x, wheel.y) }
        }
        Item {
            id: canvas
            objectName: "canvas"
            width: Math.max(1, graph.columns * view.column_)
            height: Math.max(1, graph.lines * view.line_)
            transformOrigin: Item.TopLeft

            // Lines, as Debian's Qt 5 has no shapes, and a canvas would be painted again for each zoom.
            Repeater {
                model: graph.segments
                Rectangle {
                    readonly property bool isSelected: view.selected_ !== "" && (model.start === view.selected_ || model.stop === view.selected_)
                    readonly property real right_: (model.x2 - model.x1) * view.column_ + (model.enters - model.leaves) * view.box_ / 2
                    readonly property real down_: (model.y2 - model.y1) * view.line_

                    x: (model.x1 + 0.5) * view.column_ + model.leaves * view.box_ / 2
                    y: (model.y1 + 0.5) * view.line_ - height / 2
                    z: isSelected ? 1 : 0
                    width: Math.sqrt(right_ * right_ + down_ * down_)
                    height: (isSelected ? 2.5 : 1.2) * view.thin_
                    rotation: Math.atan2(down_, right_) * 180 / Math.PI
                    transformOrigin: Item.Left
                    antialiasing: true
                    color: isSelected ? Theme.accent : Theme.faint
                }
            }
            Repeater {
                model: graph.items
                Rectangle {
                    id: box

                    readonly property bool isSelected: view.selected_ === model.key

                    z: 2
                    x: (model.column + 0.5) * view.column_ - width / 2
                    y: (model.line + 0.5) * view.line_ - height / 2
                    width: view.box_
                    height: view.line_ * 0.66
                    radius: model.isNode ? height / 2 : Theme.radius / 3
                    color: isSelected ? Theme.accent : model.isNode ? Theme.track : Theme.panel
                    border { color: model.conflict ? Theme.bad : model.isNode ? Theme.accent : Theme.faint; width: (model.conflict ? 2 : 1) * view.thin_ }
                    Accessible.role: Accessible.Button
                    Accessible.name: model.name
                    Accessible.description: model.conflict || model.detail
                    Accessible.onPressAction: view.select_(model.key)

                    ThemeText {
                        anchors { fill: parent; leftMargin: Theme.gap; rightMargin: Theme.gap }
                        horizontalAlignment: Text.AlignHCenter
                        verticalAlignment: Text.AlignVCenter
                        elide: Text.ElideMiddle
                        text: model.name
                        color: box.isSelected ? Theme.onAccent : Theme.text
                        font.pixelSize: Theme.small
                    }
                    MouseArea {
                        anchors.fill: parent
                        drag.target: canvas
                        drag.threshold: 4
                        onPressed: area.forceActiveFocus()
                        onPositionChanged: if (drag.active) view.moved_ = true
                        onClicked: view.select_(model.key)
                        onDoubleClicked: view.activated(model.name, model.isNode)
                    }
                }
            }
        }
        FocusRing { anchors.margins: 1; visible: area.activeFocus }
    }
    ThemeText {
        anchors.centerIn: area
        width: area.width
        horizontalAlignment: Text.AlignHCenter
        wrapMode: Text.Wrap
        visible: !graph.stale && graph.count === 0
        color: Theme.dim
        text: graph.omitted > 0 ? qsTr("Too many connections to draw: enter a filter.")
            : view.filter ? qsTr("No node or topic matches the filter.") : qsTr("There are no nodes yet.")
    }
    ThemeText {
        id: detail
        objectName: "detail"
        anchors { left: parent.left; right: parent.right; bottom: parent.bottom }
        height: text ? Theme.small * 3.6 : 0
        topPadding: Theme.gap / 2
        text: view.detail_
        color: Theme.dim
        wrapMode: Text.Wrap
        maximumLineCount: 2
        font.pixelSize: Theme.small
    }
}
