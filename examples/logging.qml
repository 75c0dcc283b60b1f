// Log messages of an interface go to the terminal with file and line, and to /rosout.
import QtQuick 2.15
import QtQuick.Controls 2.15
import Ros2 1.0

Column {
    width: 480; height: 320; padding: 20; spacing: 8
    property string title: "Logging"
    property var arm: Ros2.getLogger("arm")
    property var lines: []
    Component.onCompleted: Ros2.init("logging_example")
    Timer { id: hello; interval: 1000; onTriggered: Ros2.info("the interface is there") }

    Subscription {
        topic: "/rosout"; throttleRate: 0; qos: Ros2.QoS().reliable().keep_last(10)
        onSubscribedChanged: if (subscribed) hello.start()
        onNewMessage: function (message) {
            lines = lines.concat([message.name + ": " + message.msg]).slice(-8)
        }
    }

    Row {
        spacing: 8
        Button { text: "Info"; onClicked: Ros2.info("a word") }
        Button { text: "Warn"; onClicked: arm.warn("the arm is warm") }
        Button { text: "Debug on"; onClicked: arm.setLoggerLevel(Ros2LoggerLevel.Debug) }
    }
    Repeater { model: lines; Label { textFormat: Text.PlainText; text: modelData } }
}
