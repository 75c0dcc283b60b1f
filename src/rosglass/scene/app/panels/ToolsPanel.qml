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

                function refresh() { settings = modelData.settings() }
                function set(name, value) {
                    panel.problem = modelData.setSetting(name, String(value))
                    refresh()
                }

                // Programs change them, too.
                Timer { interval: 1000; repeat: true; triggeredOnStart: true; running: panel.visible; onTriggered: group.refresh() }

                width: ListView.view.width
                visible: settings.length > 0
                height: visible ? implicitHeight : 0
                Label { text: group.modelData.name; textFormat: Text.PlainText; font.bold: true; topPadding: 6 }
                Repeater {
                    // Rows stay: an editor that is open stays so.
                    model: group.settings.length
                    RowLayout {
                        id: row

                        required property int index
                        readonly property var setting: group.settings[index] || ({ name: "", kind: "", value: "", choices: [], description: "", placeholder: "" })

                        width: group.width
                        height: 24
                        Label {
                            Layout.fillWidth: true
                            Layout.preferredWidth: 100
                            text: row.setting.name
                            textFormat: Text.PlainText
                            elide: Text.ElideRight
                            HoverHandler { id: hover }
                            PlainToolTip { visible: hover.hovered && row.setting.description !== ""; plain: row.setting.description }
                        }
                        SettingEditor {
                            kind: row.setting.kind
                            value: row.setting.value
                            choices: row.setting.choices
                            placeholder: row.setting.placeholder
                            onEdited: value => group.set(row.setting.name, value)
                            onColorAsked: before => {
                                chooser.group = group
                                chooser.setting = row.setting.name
                                chooser.ask(before, row.setting.name)
                            }
                        }
                    }
                }
            }
        }
        Label { Layout.fillWidth: true; visible: panel.problem !== ""; text: panel.problem; textFormat: Text.PlainText; wrapMode: Text.Wrap; maximumLineCount: 20; elide: Text.ElideRight; color: "#c62818" }
    }
}
