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
    readonly property var parts: view && visible ? view.selection.parts : []

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
            // Rows stay where they are scrolled to while what is selected moves.
            model: panel.parts.length
            delegate: Column {
                required property int index
                readonly property var part: panel.parts[index] || ({ display: "", part: "", lines: [] })

                width: list.width
                Label { width: parent.width; text: parent.part.display + ": " + parent.part.part; textFormat: Text.PlainText; elide: Text.ElideRight; font.bold: true; topPadding: 6 }
                Repeater {
                    model: parent.part.lines
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
