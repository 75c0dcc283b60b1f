import QtQuick 2.15
import Ros2 1.0
import "../../examples/rviz" as Example

Item {
    Component.onCompleted: Ros2.init("behaviours")
    Example.Behaviours { live: true; width: 220 }
}
