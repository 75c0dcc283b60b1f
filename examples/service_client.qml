// Calls a service and shows the response, without blocking the interface.
import QtQuick 2.15
import QtQuick.Controls 2.15
import Ros2 1.0

Column {
    width: 480; height: 320; padding: 20; spacing: 8
    property string title: "Service client"
    property string answer: "not called yet"
    property var client: Ros2.createServiceClient("/flashlight/set", "std_srvs/srv/SetBool")
    Component.onCompleted: Ros2.init("service_client_example")

    function call(on) {
        client.call({data: on}).then(
            function (response) { answer = response.message },
            function (error) { answer = error.message })
    }

    Label { textFormat: Text.PlainText; text: client.name + (client.ready ? " is available" : " is not available yet") }
    Row {
        spacing: 8
        Button { text: "On"; enabled: client.ready; onClicked: call(true) }
        Button { text: "Off"; enabled: client.ready; onClicked: call(false) }
    }
    Label { textFormat: Text.PlainText; text: "answer: " + answer }
}
