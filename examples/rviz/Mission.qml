// The mission: its state and progress, and how to pause it.
import QtQuick 2.15
import Ros2 1.0
import RosControls 1.0

LiveFrame {
    id: mission
    property bool live
    readonly property int count: path.message ? path.message.poses.length - 1 : 0
    readonly property int next: waypoint.message ? waypoint.message.data : 0
    // Of the three requests, the one that the operator should know about.
    readonly property var notable: [resume, pause, restart].find(one => one.status !== "" && one.outcome !== "done")

    title: "Mission"
    source: state_

    LiveTopic { id: state_; topic: "/mission/state"; types: ["std_msgs/msg/String"]; timeout: 2000 }
    LiveTopic { id: waypoint; topic: "/mission/waypoint"; types: ["std_msgs/msg/Int32"]; timeout: 2000 }
    LiveTopic { id: path; topic: "/mission/path"; types: ["nav_msgs/msg/Path"]; qos: Ros2.BestAvailableQoS(); timeout: 0 }

    Column {
        width: parent.width
        spacing: Theme.gap * 0.7

        ThemeText {
            width: parent.width
            text: mission.stale ? "STATE UNKNOWN" : state_.message.data.slice(0, 300)
            color: mission.stale ? Theme.bad : Theme.text
            font { pixelSize: Theme.large; weight: Font.Light }
        }
        Row {
            spacing: Theme.gap * 0.7
            Repeater {
                model: mission.count
                Rectangle {
                    width: 28 * Theme.size; height: width; radius: width / 2
                    color: index < mission.next ? Theme.accent : Theme.track
                    border { color: index === mission.next ? Theme.accent : Theme.edge; width: 2 }
                    ThemeText {
                        anchors.centerIn: parent
                        text: index + 1
                        color: index < mission.next ? Theme.onAccent : Theme.text
                        font.pixelSize: Theme.small
                    }
                }
            }
        }
        ThemeText {
            text: "next waypoint " + (mission.next + 1) + " of " + mission.count
            visible: mission.count > 0 && !mission.stale
            color: Theme.dim
            font.pixelSize: Theme.small
        }
        Row {
            id: requests
            spacing: Theme.gap / 2
            enabled: mission.live && !mission.stale
            component Request: ServiceButton { showStatus: false; timeout: 2000; width: (mission.body.width - 2 * requests.spacing) / 3 }
            Request { id: resume; text: "Continue"; service: "/mission/pause"; request: ({data: false}) }
            Request { id: pause; objectName: "pause"; text: "Pause"; service: "/mission/pause"; request: ({data: true}) }
            Request { id: restart; text: "Restart"; service: "/mission/restart" }
        }
        ThemeText {
            width: parent.width
            wrapMode: Text.Wrap
            maximumLineCount: 3
            text: mission.notable ? mission.notable.text + ": " + mission.notable.status : ""
            color: mission.notable && mission.notable.busy ? Theme.dim : Theme.bad
            font.pixelSize: Theme.small
        }
    }
}
