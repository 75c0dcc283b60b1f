// All parameters of a node, to show and to change: with ranges, choices, refused values and undo.
import QtQml 2.15 as Qml
import QtQuick 2.15
import QtQuick.Templates 2.15 as T
import Ros2 1.0
import RosControls 1.0
import "fields.js" as Fields

LiveFrame {
    id: form

    // Full name of the node, in ROS 1 any namespace of the parameter server; without one, the operator chooses.
    property string nodeName
    // Part of a name; only parameters whose names contain it are shown.
    property string filter
    // Lists of values by parameter name, for parameters whose descriptors do not list them.
    property var choices: ({})
    // Lists of the least and greatest value by parameter name, for descriptors without a range (ROS 1 has none).
    property var ranges: ({})
    // Whether values can be changed.
    property bool editable: true

    readonly property bool ready: parameters.ready
    // Number of parameters.
    readonly property int total: parameters.total
    // The change that undo() reverts, in words; empty without one.
    readonly property string undoText: parameters.undoText
    readonly property string node_: nodeName || picked_
    property string picked_
    property var nodes_: []

    // The node refused a value of a parameter, for this reason.
    signal rejected(string name, string reason)

    // Asks the node to set a parameter.
    function setValue(name, value) { parameters.setValue(name, value) }
    // Reverts the last change that was made here.
    function undo() { parameters.undo() }

    function list_() { nodes_ = Ros2.queryNodes().filter(name => name !== own_()) }
    function own_() { return (Ros2.getNamespace().replace(/\/$/, "") || "") + "/" + Ros2.getName() }

    title: nodeName ? qsTr("Parameters of %1").arg(nodeName) : qsTr("Parameters")
    source: null
    stale: node_ !== "" && !ready
    age: total ? 0 : -1
    problem: parameters.problem ? Fields.bounded(parameters.problem)
        : node_ && !ready ? (total ? qsTr("NOT AVAILABLE: these values are old") : qsTr("waiting for %1").arg(node_)) : ""
    note: total ? (parameters.count < total ? Fields.fill(qsTr("%1 of %2"), [parameters.count, total]) : String(total)) : ""
    contentWidth: 380 * Theme.size
    contentHeight: 300 * Theme.size
    // A reason in the middle would cover the choice of another node.
    filled: true

    NodeParameters {
        id: parameters
        nodeName: form.node_
        filter: form.filter || search.text
        onRejected: function(name, reason) { form.rejected(name, reason) }
    }
    Connections {
        target: form.nodeName ? null : Ros2
        function onGraphChanged() { form.list_() }
        function onInitialized() { form.list_() }
    }
    Component.onCompleted: if (!nodeName) list_()

    Row {
        id: head
        width: parent.width
        spacing: Theme.gap
        readonly property real rest: width - undoButton.width - spacing - (picker.visible ? picker.width + spacing : 0)

        ThemeChoice {
            id: picker
            objectName: "picker"
            width: parent.width * 0.4
            visible: form.nodeName === ""
            name: qsTr("Node")
            model: form.nodes_
            currentIndex: form.nodes_.indexOf(form.picked_)
            displayText: form.picked_ || qsTr("choose a node")
            onActivated: function(index) { form.picked_ = form.nodes_[index] || "" }
        }
        ThemeField {
            id: search
            objectName: "search"
            width: parent.rest
            visible: form.filter === ""
            placeholderText: qsTr("search")
            placeholderTextColor: Theme.dim
        }
        ThemeButton {
            id: undoButton
            objectName: "undo"
            text: qsTr("Undo")
            enabled: form.editable && form.ready && form.undoText !== ""
            Accessible.description: form.undoText
            onClicked: form.undo()
        }
    }
    ThemeText {
        anchors.centerIn: list
        width: list.width
        visible: !list.count && text !== ""
        text: !form.node_ ? qsTr("no node is chosen") : !form.ready ? "" : form.total ? qsTr("no name contains the text searched for") : qsTr("this node has no parameters")
        color: Theme.dim
        horizontalAlignment: Text.AlignHCenter
    }
    ListView {
        id: list
        objectName: "list"
        anchors { top: head.bottom; topMargin: Theme.gap; left: parent.left; right: parent.right; bottom: parent.bottom }
        clip: true
        spacing: 2
        boundsBehavior: Flickable.StopAtBounds
        model: parameters.rows
        // A current row would take the focus from a field when rows appear.
        currentIndex: -1
        T.ScrollBar.vertical: ThemeScrollBar { id: bar }

        delegate: Item {
            id: row
            objectName: "row_" + model.name
            width: list.width - (bar.visible ? bar.width + 4 : 0)
            height: Theme.touch + (narrow ? label.height : 0) + (detail.text ? detail.implicitHeight + 2 : 0)

            readonly property string name: model.name
            readonly property string type: model.type
            readonly property string text: model.text
            readonly property var value: model.value
            readonly property bool locked: model.readOnly || !form.editable
            readonly property bool usable: form.ready && !locked
            // Too little room for the name beside the value.
            readonly property bool narrow: width < 300 * Theme.size
            readonly property var range: form.ranges[name] || []
            readonly property real low: model.maximum > model.minimum || range.length !== 2 ? model.minimum : range[0]
            readonly property real high: model.maximum > model.minimum || range.length !== 2 ? model.maximum : range[1]
            readonly property real step: model.stepSize
            readonly property var choices: form.choices[name] || model.choices
            readonly property bool isNumber: type === "integer" || type === "double"
            readonly property bool ranged: isNumber && high > low && typeof value === "number"
            readonly property string problem: model.problem

            function choose(text) { parameters.setText(name, text) }
            function seen() { list.positionViewAtIndex(index, ListView.Contain) }

            ThemeText {
                id: label
                anchors { left: parent.left; top: parent.top; right: row.narrow ? parent.right : editor.left; rightMargin: row.narrow ? 0 : Theme.gap }
                height: row.narrow ? Theme.normal * 1.5 : Theme.touch
                text: row.name
                color: model.changed ? Theme.accent : row.locked ? Theme.dim : Theme.text
                elide: Text.ElideLeft
                verticalAlignment: Text.AlignVCenter
            }
            Loader {
                id: editor
                anchors { right: parent.right; top: row.narrow ? label.bottom : parent.top }
                width: parent.width * (row.narrow ? 1 : 0.55)
                height: Theme.touch
                opacity: model.pending ? 0.5 : 1
                sourceComponent: row.locked ? lockedEditor
                    : row.type === "bool" ? boolEditor
                    : row.choices && row.choices.length ? choiceEditor
                    : row.ranged ? rangeEditor : textEditor
            }
            ThemeText {
                id: detail
                objectName: "detail"
                anchors { left: parent.left; right: parent.right; top: editor.bottom }
                text: row.problem ? qsTr("REFUSED: %1").arg(row.problem)
                    : model.external ? qsTr("changed by the robot or another client")
                    : [model.description, model.constraints].filter(part => part !== "").join(" · ")
                color: row.problem ? Theme.bad : model.external ? Theme.warn : Theme.dim
                font.pixelSize: Theme.small
                wrapMode: row.problem ? Text.Wrap : Text.NoWrap
                maximumLineCount: row.problem ? 3 : 1
            }

            Component {
                id: lockedEditor
                ThemeText {
                    text: row.text || qsTr("not set")
                    color: Theme.dim
                    verticalAlignment: Text.AlignVCenter
                    Accessible.role: Accessible.StaticText
                    Accessible.name: Fields.fill(qsTr("%1, read-only: %2"), [row.name, text])
                }
            }
            Component {
                id: boolEditor
                ThemeSwitch {
                    id: toggle
                    objectName: "editor"
                    enabled: row.usable
                    Accessible.name: row.name
                    onToggled: parameters.setValue(row.name, checked)
                    onActiveFocusChanged: if (activeFocus) row.seen()
                    Qml.Binding { target: toggle; property: "checked"; value: row.value === true; when: !model.pending; restoreMode: Qml.Binding.RestoreNone }
                }
            }
            Component {
                id: choiceEditor
                ThemeChoice {
                    objectName: "editor"
                    enabled: row.usable
                    name: row.name
                    model: row.choices
                    currentIndex: row.choices.map(String).indexOf(row.type === "string" ? String(row.value) : row.text)
                    displayText: row.type === "string" ? String(row.value) : row.text
                    onActivated: function(index) { row.choose(String(row.choices[index])) }
                    onActiveFocusChanged: if (activeFocus) row.seen()
                }
            }
            Component {
                id: rangeEditor
                Row {
                    spacing: Theme.gap / 2
                    ThemeSlider {
                        id: slider
                        objectName: "editor"
                        width: parent.width - number.width - parent.spacing
                        enabled: row.usable
                        name: row.name
                        from: row.low
                        to: row.high
                        stepSize: row.step > 0 ? row.step : row.type === "integer" ? 1 : 0
                        snapMode: stepSize > 0 ? T.Slider.SnapAlways : T.Slider.NoSnap
                        // Set when it is let go, so that a drag is one request.
                        onMoved: if (!pressed) send()
                        onPressedChanged: if (!pressed && value !== row.value) send()
                        onActiveFocusChanged: if (activeFocus) row.seen()
                        function send() { parameters.setValue(row.name, row.type === "integer" ? Math.round(value) : value) }
                        Qml.Binding { target: slider; property: "value"; value: row.value; when: !slider.pressed && !model.pending; restoreMode: Qml.Binding.RestoreNone }
                    }
                    ThemeField {
                        id: number
                        objectName: "number"
                        width: 80 * Theme.size
                        enabled: row.usable
                        problem: row.problem
                        Accessible.name: row.name
                        onAccepted: row.choose(text)
                        onActiveFocusChanged: if (activeFocus) row.seen()
                        Keys.onEscapePressed: text = row.text
                        Qml.Binding { target: number; property: "text"; value: slider.pressed ? slider.value.toPrecision(5) : row.text; when: !number.activeFocus; restoreMode: Qml.Binding.RestoreNone }
                    }
                }
            }
            Component {
                id: textEditor
                ThemeField {
                    id: field
                    objectName: "editor"
                    enabled: row.usable
                    maximumLength: 20000
                    problem: row.problem
                    placeholderText: qsTr("not set")
                    Accessible.name: row.name
                    onAccepted: row.choose(text)
                    onActiveFocusChanged: if (activeFocus) row.seen()
                    Keys.onEscapePressed: text = row.text
                    Qml.Binding { target: field; property: "text"; value: row.text; when: !field.activeFocus; restoreMode: Qml.Binding.RestoreNone }
                }
            }
        }
    }
}
