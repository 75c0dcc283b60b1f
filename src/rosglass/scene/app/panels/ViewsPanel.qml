import QtQuick
import QtQuick.Controls.Fusion
import QtQuick.Layouts
import RosScene 1.0

// The type of a view, its settings, and the saved views.
Pane {
    id: panel

    // The SceneView that is shown and changed.
    property SceneView view: null
    property var settings: []
    property string problem: ""

    function refresh() { settings = view ? view.viewSettings() : [] }

    padding: 4
    onViewChanged: refresh()
    Connections {
        target: panel.view
        function onViewChanged() { panel.refresh() }
        function onCameraChanged() { later.start() }
    }
    Timer { id: later; interval: 200; onTriggered: panel.refresh() }
    // Frames come and go.
    Timer { interval: 1000; repeat: true; running: panel.visible; onTriggered: panel.refresh() }

    ColumnLayout {
        anchors.fill: parent
        RowLayout {
            Label { text: "Type" }
            PlainComboBox {
                objectName: "viewType"
                Layout.fillWidth: true
                model: panel.view ? panel.view.viewTypes : []
                currentIndex: panel.view ? model.indexOf(panel.view.view) : -1
                onActivated: panel.view.view = currentText
            }
            Button { Layout.preferredWidth: 48; text: "Zero"; onClicked: panel.view.resetView() }
        }
        ListView {
            Layout.fillWidth: true
            Layout.fillHeight: true
            clip: true
            // Rows stay while the camera moves: an editor that is open stays so.
            model: panel.settings.length
            delegate: RowLayout {
                id: row

                required property int index
                readonly property var setting: panel.settings[index] || ({ name: "", kind: "", value: "", choices: [] })

                width: ListView.view.width
                height: 24
                Label { Layout.fillWidth: true; Layout.preferredWidth: 100; text: row.setting.name; textFormat: Text.PlainText; elide: Text.ElideRight }
                SettingEditor {
                    kind: row.setting.kind
                    value: row.setting.value
                    choices: row.setting.choices
                    onEdited: value => panel.problem = panel.view.setViewSetting(row.setting.name, String(value))
                }
            }
        }
        RowLayout {
            TextField {
                id: name
                objectName: "viewName"
                Layout.fillWidth: true
                placeholderText: "Name of this view"
                onAccepted: save.clicked()
            }
            Button {
                id: save
                objectName: "saveView"
                text: "Save"
                onClicked: {
                    panel.problem = panel.view.saveView(name.text)
                    if (!panel.problem) name.clear()
                }
            }
        }
        ListView {
            objectName: "savedViews"
            Layout.fillWidth: true
            Layout.preferredHeight: Math.min(contentHeight, 150)
            clip: true
            model: panel.view ? panel.view.savedViews : []
            delegate: RowLayout {
                id: saved

                required property int index
                required property string modelData
                readonly property string type: panel.view ? panel.view.savedViewTypes[index] || "" : ""

                width: ListView.view.width
                spacing: 0
                ItemDelegate {
                    Layout.fillWidth: true
                    text: modelData
                    contentItem: RowLayout {
                        Label { Layout.fillWidth: true; text: saved.modelData; textFormat: Text.PlainText; elide: Text.ElideRight }
                        // As RViz does, unless it is the name as well.
                        Label { visible: text !== saved.modelData; text: saved.type; textFormat: Text.PlainText; elide: Text.ElideRight; opacity: 0.6 }
                    }
                    onClicked: panel.problem = panel.view.showSavedView(index)
                    PlainToolTip { visible: parent.hovered; plain: "Look from there" }
                }
                ToolButton {
                    text: "×"
                    onClicked: panel.view.removeSavedView(index)
                    PlainToolTip { visible: parent.hovered; plain: "Remove this saved view" }
                }
            }
        }
        Label { Layout.fillWidth: true; visible: panel.problem !== ""; text: panel.problem; textFormat: Text.PlainText; wrapMode: Text.Wrap; maximumLineCount: 20; elide: Text.ElideRight; color: "#c62818" }
    }
}
