// One topic: its newest message, and whether that may still be shown as true.
import QtQuick
import Ros2 1.0

QtObject {
    id: feed

    property alias topic: subscription.topic
    property alias messageType: subscription.messageType
    property alias age: subscription.age
    property alias throttleRate: subscription.throttleRate
    property alias queueSize: subscription.queueSize
    // Seconds without a message after which the one received last is no longer true.
    property real limit: 0.7
    // True to show a message at once instead of together with the next camera image.
    property bool urgent: false
    property var message: undefined
    readonly property bool received: message !== undefined
    readonly property bool fresh: received && !subscription.stale

    signal arrived(var message)

    property bool waiting: false

    function take() {
        if (!waiting)
            return
        waiting = false
        message = subscription.message
        if (received)
            arrived(message)
    }

    readonly property Subscription subscription: Subscription {
        id: subscription
        throttleRate: 30
        timeout: feed.limit * 1000
        onMessageChanged: {
            feed.waiting = true
            if (feed.urgent)
                feed.take()
        }
    }
    readonly property Connections beat: Connections {
        target: Beat
        enabled: !feed.urgent
        function onTick() { feed.take() }
    }
}
