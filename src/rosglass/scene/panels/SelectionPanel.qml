import QtQuick
import QtQuick.Controls.Fusion
import QtQuick.Layouts
import RosScene 1.0

// What is selected, and its descriptions.
Pane {
    id: panel

    // The SceneView whose selection is shown.
    property SceneView view: null
    readonly property int count: view ? view.selection.count : 0

    padding: 4

    ColumnLayout {
        anchors.fill: parent
        RowLayout {
            Label { Layout.fillWidth: true; text: panel.count + " selected"; textFormat: Text.PlainText }
            Button { text: "Clear"; enabled: panel.count > 0; onClicked: panel.view.selection.clear() }
        }
        ListView {
            id: list

            objectName: "parts"
            Layout.fillWidth: true
            Layout.fillHeight: true
            clip: true
            model: panel.view ? panel.view.selection.parts : []
            delegate: Column {
                required property var modelData

                width: list.width
                Label { width: parent.width; text: modelData.display + ": " + modelData.part; textFormat: Text.PlainText; elide: Text.ElideRight; font.bold: true; topPadding: 6 }
                Repeater {
                    model: modelData.lines
                    Label {
                        required property var modelData

                        width: list.width
                        text: modelData.name + ": " + modelData.value
                        textFormat: Text.PlainText
                        wrapMode: Text.Wrap
                        maximumLineCount: 5
                        elide: Text.ElideRight
                    }
                }
            }
        }
        Label { visible: panel.count > list.count; text: "and " + (panel.count - list.count) + " more"; textFormat: Text.PlainText }
    }
}
