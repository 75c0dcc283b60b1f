// Promises, one after the other without blocking: a message, a service, the robot's new state.
import QtQuick 2.15
import QtQuick.Controls 2.15
import Ros2 1.0

Column {
    width: 480; height: 180; padding: 20; spacing: 8
    property string title: "Promises"
    property var steps: []
    property var client: Ros2.createServiceClient("/flashlight/set", "std_srvs/srv/SetBool")
    Component.onCompleted: { Ros2.init("promises_example"); run() }

    function tell(text) { steps = steps.concat([text]) }
    function run() {
        steps = []
        // 5000: time limit in ms; undefined without a message until then.
        Ros2.waitForMessageAsync("/battery_state", 5000).then(function (battery) {
            tell("the battery has " + (battery.percentage * 100).toFixed(0) + " %")
            return client.call({data: true})
        }).then(function (response) {
            tell("the robot answers: " + response.message)
            return Ros2.waitForMessageAsync("/odom", 5000)
        }).then(function (odom) {
            tell("and stands at x = " + odom.pose.pose.position.x.toFixed(2) + " m")
        }).catch(function (error) {
            tell("failed: " + error.message)       // of any step
        })
    }

    Button { text: "Again"; onClicked: run() }
    Repeater { model: steps; Label { textFormat: Text.PlainText; text: (index + 1) + ". " + modelData } }
}
