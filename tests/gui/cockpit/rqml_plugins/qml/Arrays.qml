// Keeps a message in a ListModel, which copies its arrays.
import QtQml.Models
import QtQuick
import Ros2

Item {
    property string last
    property ListModel kept: ListModel {}

    Component.onCompleted: {
        const message = Ros2.createEmptyMessage("sensor_msgs/msg/JointState")
        message.name = ["shoulder", "elbow"]
        kept.append({ message: message })
        last = kept.get(0).message.name.at(1) + ActionResultCode.SUCCEEDED
    }
}
