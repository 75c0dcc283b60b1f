// A button to look again. Its icon turns while `animate` is true, at least once.
import QtQuick
import QtQuick.Controls
import RQml.Fonts

RoundButton {
    id: button

    property bool animate: false

    implicitWidth: implicitHeight
    radius: 4
    text: IconFont.iconRefresh
    font { family: IconFont.name; pixelSize: 18 }
    Accessible.name: qsTr("Refresh")
    contentItem: Item {
        Label {
            id: icon
            textFormat: Text.PlainText
            anchors.centerIn: parent
            text: button.text
            font: button.font
            color: button.palette.buttonText
        }
    }
    onAnimateChanged: if (animate) turn.start()

    RotationAnimation {
        id: turn
        target: icon
        property: "rotation"
        from: 0
        to: 360
        duration: 600
        onFinished: if (button.animate) start()
    }
}
