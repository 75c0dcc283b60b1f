import QtQuick
import QtQuick.Controls.Fusion
import QtQuick.Layouts
import RosScene 1.0

// The displays of a view, with their status and settings, as in RViz.
Pane {
    id: panel

    // The SceneView that is shown and changed.
    property alias view: rows.view
    // The row that is selected; it follows rows that come and go above it.
    property alias current: list.currentIndex
    readonly property bool ofDisplay: current >= 0 && list.currentItem !== null && list.currentItem.ofDisplay
    // What the user has entered and does not fit.
    property string problem: ""

    padding: 0

    DisplaysModel {
        id: rows
        onRefused: text => { panel.problem = text; forget.restart() }
        onAccepted: panel.problem = ""
    }
    Timer { id: forget; interval: 8000; onTriggered: panel.problem = "" }

    ColumnLayout {
        anchors.fill: parent
        spacing: 4

        ListView {
            id: list
            objectName: "displayRows"
            Layout.fillWidth: true
            Layout.fillHeight: true
            clip: true
            model: rows
            currentIndex: -1
            boundsBehavior: Flickable.StopAtBounds
            ScrollBar.vertical: ScrollBar { }

            delegate: Rectangle {
                id: row
                required property int index
                required property int depth
                required property string label
                required property string kind
                required property var value
                required property string description
                required property string level
                required property bool checked
                required property bool expandable
                required property bool expanded
                required property var choices
                readonly property bool ofDisplay: kind === "display"
                readonly property color tint: level === "error" ? "#c62818" : level === "warn" ? "#9a5b00" : palette.text

                width: list.width
                height: 24
                color: index === panel.current ? palette.highlight
                     : ofDisplay || kind === "options" ? palette.alternateBase : "transparent"

                MouseArea {
                    anchors.fill: parent
                    hoverEnabled: true
                    onClicked: panel.current = row.index
                    onDoubleClicked: if (row.expandable) rows.toggle(row.index)
                    PlainToolTip { visible: parent.containsMouse && row.description !== ""; plain: row.description }
                }
                RowLayout {
                    anchors { fill: parent; leftMargin: 4 + 14 * row.depth; rightMargin: 10 }
                    spacing: 4

                    Text {
                        Layout.preferredWidth: 12
                        text: row.expandable ? (row.expanded ? "\u25be" : "\u25b8") : ""
                        textFormat: Text.PlainText
                        color: palette.text
                        MouseArea { anchors.fill: parent; anchors.margins: -6; enabled: row.expandable; onClicked: rows.toggle(row.index) }
                    }
                    CheckBox {
                        visible: row.ofDisplay
                        checked: row.checked
                        onToggled: rows.setEnabled(row.index, checked)
                    }
                    Text {
                        Layout.fillWidth: true
                        Layout.preferredWidth: 100
                        text: row.label
                        textFormat: Text.PlainText
                        elide: Text.ElideRight
                        font.bold: row.ofDisplay
                        color: row.tint
                    }
                    Text {
                        visible: row.kind === "status"
                        Layout.fillWidth: true
                        Layout.preferredWidth: 160
                        text: String(row.value)
                        textFormat: Text.PlainText
                        elide: Text.ElideRight
                        color: row.tint
                    }
                    Rectangle {
                        visible: row.kind === "color"
                        Layout.preferredWidth: 16
                        Layout.preferredHeight: 16
                        color: row.kind === "color" ? row.value : "transparent"
                        border.color: palette.mid
                    }
                    CheckBox {
                        visible: row.kind === "bool"
                        checked: row.kind === "bool" && row.value === true
                        onToggled: rows.edit(row.index, checked)
                    }
                    ComboBox {
                        visible: row.kind === "enum" || ((row.kind === "frame" || row.kind === "topic") && row.choices.length > 0)
                        Layout.fillWidth: true
                        Layout.preferredWidth: 150
                        Layout.preferredHeight: 22
                        model: row.choices
                        editable: row.kind !== "enum"
                        currentIndex: row.choices.indexOf(String(row.value))
                        // What is set may be none of the choices, e.g. a frame that is not there yet.
                        readonly property string given: String(row.value)
                        onGivenChanged: if (editable) editText = given
                        onModelChanged: if (editable) Qt.callLater(() => { editText = given })
                        Component.onCompleted: if (editable) editText = given
                        onActivated: rows.edit(row.index, currentText)
                        onAccepted: rows.edit(row.index, editText)
                    }
                    TextField {
                        visible: ["int", "float", "string", "path", "color", "vector", "quaternion"].indexOf(row.kind) >= 0
                              || ((row.kind === "frame" || row.kind === "topic") && row.choices.length === 0)
                        Layout.fillWidth: true
                        Layout.preferredWidth: 150
                        Layout.preferredHeight: 22
                        text: row.kind === "bool" ? "" : String(row.value)
                        selectByMouse: true
                        onEditingFinished: {
                            if (text === String(row.value)) return
                            rows.edit(row.index, text)
                            // What was refused is not left standing.
                            text = Qt.binding(() => row.kind === "bool" ? "" : String(row.value))
                        }
                    }
                }
            }
        }
        Text {
            Layout.fillWidth: true
            Layout.margins: 4
            visible: panel.problem !== ""
            text: panel.problem
            textFormat: Text.PlainText
            wrapMode: Text.Wrap
            color: "#c62818"
        }
        RowLayout {
            Layout.margins: 4
            Button { objectName: "addDisplay"; text: "Add"; onClicked: adding.open() }
            Button { text: "Remove"; enabled: panel.ofDisplay; onClicked: rows.remove(panel.current) }
            Button { text: "Rename"; enabled: panel.ofDisplay; onClicked: renaming.open() }
            Item { Layout.fillWidth: true }
        }
    }

    Dialog {
        id: renaming
        title: "New name of the display"
        modal: true
        standardButtons: Dialog.Ok | Dialog.Cancel
        parent: Overlay.overlay
        anchors.centerIn: parent
        contentItem: TextField { id: newName; selectByMouse: true; onAccepted: renaming.accept() }
        onOpened: { newName.text = list.currentItem ? list.currentItem.label : ""; newName.selectAll(); newName.forceActiveFocus() }
        onAccepted: rows.rename(panel.current, newName.text)
    }
    Dialog {
        id: adding
        objectName: "addDialog"
        title: "Add a display"
        modal: true
        width: 420
        height: 420
        parent: Overlay.overlay
        anchors.centerIn: parent
        standardButtons: Dialog.Cancel
        onOpened: { byType.model = rows.types(); byTopic.model = rows.suggestions() }
        ColumnLayout {
            anchors.fill: parent
            TabBar {
                id: tabs
                Layout.fillWidth: true
                TabButton { text: "By topic" }
                TabButton { text: "By type" }
            }
            StackLayout {
                currentIndex: tabs.currentIndex
                ListView {
                    id: byTopic
                    clip: true
                    delegate: ItemDelegate {
                        width: ListView.view.width
                        contentItem: Text { text: modelData.topic + "   " + modelData.display; textFormat: Text.PlainText; color: palette.text }
                        onClicked: { rows.add(modelData.display, modelData.topic); adding.close() }
                    }
                    Label {
                        anchors.centerIn: parent
                        visible: byTopic.count === 0
                        text: "The robot publishes nothing that a display shows."
                    }
                }
                ListView {
                    id: byType
                    objectName: "typeList"
                    clip: true
                    delegate: ItemDelegate {
                        width: ListView.view.width
                        contentItem: Text { text: modelData; textFormat: Text.PlainText; color: palette.text }
                        onClicked: { rows.add(modelData, ""); adding.close() }
                    }
                }
            }
        }
    }
}
