// The mission: its state and progress, and how to pause it.
import QtQuick 2.15
import Ros 1.0

Column {
    id: mission
    spacing: 8
    property bool live
    readonly property int count: path.message ? path.message.poses.length - 1 : 0
    readonly property int next: waypoint.message ? waypoint.message.data : 0

    Subscriber { id: state_; topic: "/mission/state"; messageType: "std_msgs/String"; timeout: 2000 }
    Subscriber { id: waypoint; topic: "/mission/waypoint"; messageType: "std_msgs/Int32"; timeout: 2000 }
    Subscriber { id: path; topic: "/mission/path"; messageType: "nav_msgs/Path"; timeout: 0 }

    Request { id: request }

    Text {
        width: parent.width
        wrapMode: Text.Wrap
        maximumLineCount: 8
        elide: Text.ElideRight
        textFormat: Text.PlainText
        text: state_.stale ? "STATE UNKNOWN" : state_.message.data
        color: state_.stale ? Theme.bad : Theme.text
        font { pixelSize: 17; weight: Font.Light }
    }
    Row {
        spacing: 6
        Repeater {
            model: mission.count
            Rectangle {
                width: 26; height: 26; radius: 13
                color: index < mission.next ? Theme.accent : Theme.button
                opacity: state_.stale ? 0.3 : 1
                border { color: index === mission.next ? Theme.accent : Theme.edge; width: 2 }
                Text {
                    anchors.centerIn: parent
                    textFormat: Text.PlainText
                    text: index + 1
                    color: index < mission.next ? "black" : Theme.text
                    font.pixelSize: 11
                }
            }
        }
    }
    Text {
        textFormat: Text.PlainText
        text: "next waypoint " + (mission.next + 1) + " of " + mission.count
        visible: mission.count > 0 && !state_.stale
        color: Theme.dim
        font.pixelSize: 11
    }
    Row {
        spacing: 5
        enabled: mission.live && !state_.stale
        Push { text: "Continue"; onClicked: request.ask("Continue", "/mission/pause", "std_srvs/SetBool", {data: false}) }
        Push { objectName: "pause"; text: "Pause"; onClicked: request.ask("Pause", "/mission/pause", "std_srvs/SetBool", {data: true}) }
        Push { text: "Restart"; onClicked: request.ask("Restart", "/mission/restart", "std_srvs/Trigger", {}) }
    }
    Text {
        width: parent.width
        wrapMode: Text.Wrap
        maximumLineCount: 8
        elide: Text.ElideRight
        textFormat: Text.PlainText
        text: request.note
        color: request.failed ? Theme.bad : Theme.dim
        font.pixelSize: 11
    }
}
