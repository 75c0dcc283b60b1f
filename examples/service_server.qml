// A service that the operator answers: robots ask, the operator decides.
import QtQuick 2.15
import QtQuick.Controls 2.15
import Ros2 1.0

Column {
    id: root
    width: 480; height: 320; padding: 20; spacing: 8
    property string title: "Service server"
    property var answer: null
    Component.onCompleted: Ros2.init("service_server_example")

    ServiceServer {
        id: server
        name: "/ask_operator"
        serviceType: "std_srvs/srv/Trigger"
        // Two parameters: respond later.
        handler: function (request, respond) { root.answer = respond }
    }

    function decide(yes) {
        answer({success: yes, message: yes ? "go on" : "stay"})
        answer = null
    }

    Label { textFormat: Text.PlainText; text: server.ready ? "rosglass service call /ask_operator '{}'" : server.problem }
    Label { textFormat: Text.PlainText; text: answer ? "The robot asks: may I?" : "no question"; font.bold: true }
    Row {
        spacing: 8
        Button { text: "Yes"; enabled: !!root.answer; onClicked: decide(true) }
        Button { text: "No"; enabled: !!root.answer; onClicked: decide(false) }
    }
}
