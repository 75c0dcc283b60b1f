// A slider for a speed, with its limits and its number as fields, and a button for zero.
import QtQuick
import QtQuick.Controls
import QtQuick.Layouts

Item {
    id: speed

    property int direction: Qt.Vertical
    property alias from: lowest.value
    property alias to: highest.value
    property alias value: slider.value
    readonly property bool isUpright_: direction === Qt.Vertical

    implicitWidth: grid.implicitWidth
    implicitHeight: grid.implicitHeight

    GridLayout {
        id: grid
        anchors.fill: parent
        columns: 3

        DecimalInputField {
            id: highest
            Layout.row: speed.isUpright_ ? 0 : 1
            Layout.column: speed.isUpright_ ? 1 : 2
            Layout.preferredWidth: 60
            Layout.alignment: Qt.AlignCenter
            from: 0.1
            to: 100
            value: 1
            decimals: 1
            Accessible.name: qsTr("Highest speed")
        }
        Button {
            Layout.row: speed.isUpright_ ? 1 : 0
            Layout.column: speed.isUpright_ ? 0 : 1
            Layout.preferredWidth: 60
            Layout.alignment: Qt.AlignCenter
            text: "0"
            Accessible.name: qsTr("Zero")
            onClicked: slider.value = 0
        }
        Slider {
            id: slider
            Layout.row: 1
            Layout.column: 1
            Layout.fillHeight: speed.isUpright_
            Layout.fillWidth: !speed.isUpright_
            Layout.alignment: Qt.AlignCenter
            orientation: speed.direction
            from: Math.min(-0.1, lowest.value)
            to: Math.max(0.1, highest.value)
            stepSize: (to - from) / 1000
            Accessible.name: qsTr("Speed")
        }
        DecimalInputField {
            Layout.row: speed.isUpright_ ? 1 : 2
            Layout.column: speed.isUpright_ ? 2 : 1
            Layout.preferredWidth: 60
            Layout.alignment: Qt.AlignCenter
            from: slider.from
            to: slider.to
            decimals: 2
            value: slider.value
            set: number => slider.value = number
            Accessible.name: qsTr("Speed")
        }
        DecimalInputField {
            id: lowest
            Layout.row: speed.isUpright_ ? 2 : 1
            Layout.column: speed.isUpright_ ? 1 : 0
            Layout.preferredWidth: 60
            Layout.alignment: Qt.AlignCenter
            from: -100
            to: -0.1
            value: -1
            decimals: 1
            Accessible.name: qsTr("Lowest speed")
        }
    }
}
