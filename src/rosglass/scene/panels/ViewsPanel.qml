import QtQuick
import QtQuick.Controls.Fusion
import QtQuick.Layouts
import RosScene 1.0

// The type of a view, and its settings.
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

    ColumnLayout {
        anchors.fill: parent
        RowLayout {
            Label { text: "Type" }
            ComboBox {
                objectName: "viewType"
                Layout.fillWidth: true
                model: panel.view ? panel.view.viewTypes : []
                currentIndex: panel.view ? model.indexOf(panel.view.view) : -1
                onActivated: panel.view.view = currentText
            }
            Button { text: "Zero"; onClicked: panel.view.resetView() }
        }
        ListView {
            Layout.fillWidth: true
            Layout.fillHeight: true
            clip: true
            model: panel.settings
            delegate: RowLayout {
                width: ListView.view.width
                height: 24
                Label { Layout.fillWidth: true; Layout.preferredWidth: 100; text: modelData.name; textFormat: Text.PlainText; elide: Text.ElideRight }
                TextField {
                    Layout.fillWidth: true
                    Layout.preferredWidth: 120
                    Layout.preferredHeight: 22
                    text: modelData.text
                    onEditingFinished: if (text !== modelData.text) panel.problem = panel.view.setViewSetting(modelData.name, text)
                }
            }
        }
        Label { Layout.fillWidth: true; visible: panel.problem !== ""; text: panel.problem; textFormat: Text.PlainText; wrapMode: Text.Wrap; color: "#c62818" }
    }
}
