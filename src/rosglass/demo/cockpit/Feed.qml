// One topic: its newest message, and whether that may still be shown as true.
import QtQuick
import Ros2 1.0

Subscription {
    id: feed

    // Seconds without a message after which the one received last is no longer true.
    property real limit: 1.0
    readonly property bool received: message !== undefined
    readonly property bool fresh: received && !stale

    timeout: limit * 1000
}
