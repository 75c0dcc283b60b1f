// Whether the robot is connected, and which of the shown data is old: RViz itself keeps showing
// the last data.
import QtQuick 2.15
import Ros2 1.0
import RosControls 1.0

Item {
    id: contact
    readonly property bool live: !place.stale
    readonly property var problems: {
        var found = []
        if (Ros2.connectionState === "failed")
            found.push("NO CONNECTION, start again: " + Ros2.connectionDetail)
        else if (Ros2.connectionState !== "connected" && Ros2.connectionState !== "uninitialized")
            found.push("NO CONNECTION: nothing new is found")
        if (place.stale)
            found.push(place.age < 0 ? "NO ROBOT: nothing was heard of it yet"
                : "ROBOT SILENT for " + place.age.toFixed(0) + " s: it may be anywhere")
        else
            for (var name in sensors)
                if (sensors[name].stale)
                    found.push("NO " + name + ": what is shown of it is old")
        return found
    }
    readonly property var sensors: ({"LASER": laser, "POINT CLOUD": cloud})

    TfTransform { id: place; sourceFrame: "base_link"; targetFrame: rviz.fixedFrame; rate: 5; timeout: 1500 }
    LiveTopic { id: laser; topic: "/scan"; types: ["sensor_msgs/msg/LaserScan"]; throttleRate: 2; timeout: 2000 }
    LiveTopic { id: cloud; topic: "/points"; types: ["sensor_msgs/msg/PointCloud2"]; throttleRate: 1; timeout: 3000 }
}
