// Steers a robot by keys that are held down, wherever the focus in the window is, except in a text field.
import QtQuick 2.15
import RosControls 1.0

Item {
    id: drive

    objectName: "DriveKeys"

    // What it steers; without one, a TwistCommand of its own on `topic`.
    property var command: own_
    // Topic of its own TwistCommand.
    property string topic: "cmd_vel"
    property string ns
    // Qt.Key_... of each direction; without the arrows, lists and sliders can use them.
    property var forwardKeys: [Qt.Key_W, Qt.Key_Up]
    property var backKeys: [Qt.Key_S, Qt.Key_Down]
    property var leftKeys: [Qt.Key_A, Qt.Key_Left]
    property var rightKeys: [Qt.Key_D, Qt.Key_Right]
    // Shares of full deflection.
    property real speedShare: 0.8
    property real turnShare: 0.8
    // Whether the keys are drawn.
    property bool keycaps: true

    // Whether a key is held, and whether that steers the robot.
    readonly property bool held: keys.held.length > 0
    readonly property bool active: held && steers_
    // From -1 to 1: forward, and to the left.
    readonly property real forward: speedShare * (any_(forwardKeys) - any_(backKeys))
    readonly property real leftward: turnShare * (any_(leftKeys) - any_(rightKeys))

    property bool steers_: false

    // Not 0, for which layouts keep the size that it had.
    implicitWidth: keycaps ? 3 * Theme.touch + 2 * caps.spacing : 1
    implicitHeight: keycaps ? 2 * Theme.touch + caps.spacing : 1
    Accessible.role: Accessible.StaticText
    Accessible.name: qsTr("Keys that drive the robot")
    Accessible.description: held && !active && command ? command.problem : ""

    function any_(wanted) {
        return keys.held.some(key => wanted.indexOf(key) >= 0) ? 1 : 0
    }

    function apply_() {
        if (!command)
            return
        if (held)
            steers_ = command.steer(drive, forward, leftward)
        else
            command.release(drive)
    }

    onHeldChanged: apply_()
    onForwardChanged: if (held) apply_()
    onLeftwardChanged: if (held) apply_()

    TwistCommand {
        id: own_
        topic: drive.command === own_ ? drive.topic : ""
        ns: drive.ns
    }
    WindowKeys {
        id: keys
        enabled: drive.enabled && drive.visible
        keys: [].concat(drive.forwardKeys, drive.backKeys, drive.leftKeys, drive.rightKeys)
    }
    // Reports to the command that a key is still held.
    Timer {
        interval: 40
        repeat: true
        running: drive.held
        onTriggered: drive.apply_()
    }

    Grid {
        id: caps
        anchors.centerIn: parent
        visible: drive.keycaps
        columns: 3
        spacing: Theme.gap / 3
        Repeater {
            model: ["", "forward", "", "left", "back", "right"]
            Rectangle {
                readonly property var keys_: modelData ? drive[modelData + "Keys"] : []
                readonly property bool down_: modelData !== "" && drive.any_(keys_) > 0
                width: Theme.touch
                height: Theme.touch
                radius: Theme.radius
                opacity: modelData ? 1 : 0
                color: !down_ ? Theme.track : drive.active ? Theme.accent : Theme.bad
                border { width: 1; color: Theme.edge }
                ThemeText {
                    anchors.centerIn: parent
                    text: parent.keys_.length ? keys.label(parent.keys_[0]) : ""
                    color: parent.down_ ? Theme.onAccent : Theme.dim
                    font.weight: Font.DemiBold
                }
            }
        }
    }
}
