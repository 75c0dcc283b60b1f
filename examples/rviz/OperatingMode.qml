// The mode that the robot reports; a click requests another.
import QtQuick 2.15
import Ros 1.0

Panel {
    id: panel
    title: "Mode"
    stale: mode.stale
    note: request.failed ? "NO ANSWER" : request.note ? "…" : ""
    alarming: request.failed

    Request { id: request }
    Subscriber { id: mode; topic: "/mode"; messageType: "std_msgs/String"; timeout: 2000 }
    Column {
        anchors.fill: parent
        spacing: 3
        Repeater {
            model: ["autonomous", "supervised", "safe"]
            Push {
                objectName: "mode " + modelData
                width: parent.width; height: 22
                text: modelData
                tint: modelData === "autonomous" ? Theme.accent : modelData === "safe" ? Theme.good : Theme.warn
                checked: !mode.stale && mode.message.data === modelData
                onClicked: request.ask(modelData, "/mode/" + modelData, "std_srvs/Trigger", {})
            }
        }
    }
}
