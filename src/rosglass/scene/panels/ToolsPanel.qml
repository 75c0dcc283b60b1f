import QtQuick
import QtQuick.Controls.Fusion
import QtQuick.Layouts
import RosScene 1.0

// RViz's Tool Properties: the settings of all tools.
Pane {
    id: panel

    // The SceneView whose tools are shown.
    property SceneView view: null
    property string problem: ""

    padding: 4

    ColorChooser {
        id: chooser
        property var group: null
        property string setting: ""
        onTried: color => { if (group) group.set(setting, color) }
    }
    ColumnLayout {
        anchors.fill: parent
        ListView {
            objectName: "tools"
            Layout.fillWidth: true
            Layout.fillHeight: true
            clip: true
            model: panel.view ? panel.view.tools.all : []
            delegate: Column {
                id: group

                required property var modelData
                property var settings: modelData.settings()

                function set(name, value) {
                    panel.problem = modelData.setSetting(name, String(value))
                    settings = modelData.settings()
                }

                width: ListView.view.width
                visible: settings.length > 0
                height: visible ? implicitHeight : 0
                Label { text: group.modelData.name; textFormat: Text.PlainText; font.bold: true; topPadding: 6 }
                Repeater {
                    model: group.settings
                    RowLayout {
                        required property var modelData

                        width: group.width
                        height: 24
                        Label {
                            Layout.fillWidth: true
                            Layout.preferredWidth: 100
                            text: modelData.name
                            textFormat: Text.PlainText
                            elide: Text.ElideRight
                            HoverHandler { id: hover }
                            PlainToolTip { visible: hover.hovered && modelData.description !== ""; plain: modelData.description }
                        }
                        SettingEditor {
                            kind: modelData.kind
                            value: modelData.value
                            choices: modelData.choices
                            placeholder: modelData.placeholder
                            onEdited: value => group.set(modelData.name, value)
                            onColorAsked: before => {
                                chooser.group = group
                                chooser.setting = modelData.name
                                chooser.ask(before, modelData.name)
                            }
                        }
                    }
                }
            }
        }
        Label { Layout.fillWidth: true; visible: panel.problem !== ""; text: panel.problem; textFormat: Text.PlainText; wrapMode: Text.Wrap; color: "#c62818" }
    }
}
