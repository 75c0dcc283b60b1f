// A gamepad's axes and buttons, live and by name; and a choice where there are several.
import QtQuick 2.15
import RosControls 1.0

LiveFrame {
    id: view

    // The Gamepad.
    property var gamepad: null

    readonly property var axes_: gamepad ? gamepad.axes : []
    readonly property var buttons_: gamepad ? gamepad.buttons : []
    readonly property var devices_: gamepad ? gamepad.devices : []
    // Why what is held does not move the robot.
    readonly property string refused_: gamepad && gamepad.command && gamepad.held ? gamepad.command.problem : ""
    readonly property bool connected_: gamepad !== null && gamepad.connected

    title: qsTr("Gamepad")
    source: null
    stale: !connected_
    needsRobot: false
    problem: !gamepad ? qsTr("no Gamepad is set") : gamepad.problem ? gamepad.problem
        : !connected_ ? (gamepad.device ? qsTr("%1 is not connected").arg(gamepad.device) : qsTr("no gamepad is connected")) : ""
    note: connected_ ? gamepad.name : ""
    contentWidth: 280 * Theme.size
    contentHeight: column.height
    Accessible.description: status || state_.text

    Column {
        id: column
        width: parent.width
        spacing: Theme.gap * 0.6

        ThemeText {
            id: state_
            objectName: "state"
            width: parent.width
            visible: view.connected_
            text: !view.connected_ ? ""
                : view.gamepad.refusal ? qsTr("does not count: %1").arg(view.gamepad.refusal)
                : view.gamepad.held ? (view.refused_ ? qsTr("does not steer: %1").arg(view.refused_) : qsTr("steers"))
                : view.gamepad.deadMan ? qsTr("hold %1 to steer").arg(view.gamepad.deadMan)
                : qsTr("let go")
            color: !view.connected_ || !view.gamepad.held ? Theme.dim : view.refused_ ? Theme.bad : Theme.accent
            font.pixelSize: Theme.small
        }
        Flow {
            width: parent.width
            spacing: Theme.gap / 2
            visible: view.devices_.length > 1
            Repeater {
                model: view.devices_.length > 1 ? view.devices_ : []
                ThemeButton {
                    objectName: "device" + index
                    width: Math.min(implicitWidth, column.width)
                    text: modelData
                    checkable: false
                    tint: view.connected_ && view.gamepad.name === modelData ? Theme.accent : Theme.dim
                    onClicked: view.gamepad.device = modelData
                }
            }
        }
        Grid {
            id: grid
            columns: Math.max(1, Math.floor(column.width / (130 * Theme.size)))
            spacing: Theme.gap * 0.6
            Repeater {
                model: view.axes_.length
                Item {
                    readonly property real value: index < view.axes_.length ? view.axes_[index] : 0
                    width: (column.width - (grid.columns - 1) * grid.spacing) / grid.columns
                    height: Theme.small * 2.6
                    ThemeText {
                        width: parent.width - number.width
                        text: view.gamepad && index < view.gamepad.axisNames.length ? view.gamepad.axisNames[index] : ""
                        color: Theme.dim
                        font.pixelSize: Theme.small
                    }
                    ThemeText {
                        id: number
                        objectName: "axis" + index
                        anchors.right: parent.right
                        text: parent.value.toFixed(2)
                        font.pixelSize: Theme.small
                    }
                    Rectangle {
                        anchors.bottom: parent.bottom
                        width: parent.width
                        height: Theme.gap * 0.6
                        radius: height / 2
                        color: Theme.track
                        Rectangle {
                            // Left is positive, and on the left.
                            readonly property real end: parent.width / 2 * (1 - parent.parent.value)
                            x: Math.min(parent.width / 2, end)
                            width: Math.abs(parent.width / 2 - end)
                            height: parent.height
                            radius: parent.radius
                            color: Theme.accent
                        }
                        Rectangle {
                            x: parent.width / 2
                            width: 1
                            height: parent.height
                            color: Theme.faint
                        }
                    }
                }
            }
        }
        Flow {
            width: parent.width
            spacing: Theme.gap / 2
            Repeater {
                model: view.buttons_.length
                Rectangle {
                    readonly property bool down: index < view.buttons_.length && view.buttons_[index] === 1
                    objectName: "button" + index
                    width: Math.max(height, name.implicitWidth + Theme.gap)
                    height: Theme.small * 1.9
                    radius: height / 2
                    color: down ? Theme.accent : Theme.track
                    border { color: down ? Theme.accent : Theme.edge; width: 1 }
                    ThemeText {
                        id: name
                        anchors.centerIn: parent
                        text: view.gamepad && index < view.gamepad.buttonNames.length ? view.gamepad.buttonNames[index] : ""
                        color: parent.down ? Theme.onAccent : Theme.dim
                        font.pixelSize: Theme.small
                    }
                }
            }
        }
    }
}
