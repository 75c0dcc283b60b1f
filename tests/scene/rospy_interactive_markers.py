"""A server of Debian's interactive_markers (ROS 1), which lines of its input move and change."""

import sys

import rospy
from interactive_markers.interactive_marker_server import InteractiveMarkerServer
from visualization_msgs.msg import InteractiveMarker, InteractiveMarkerControl

rospy.init_node("marker_server", disable_signals=True)
server = InteractiveMarkerServer("arm_markers")


def on_feedback(feedback):
    position = feedback.pose.position
    print(
        f"feedback {feedback.marker_name} {feedback.event_type} {position.x:.2f} {position.y:.2f}",
        flush=True,
    )
    server.applyChanges()


def insert(name, y=0.0):
    marker = InteractiveMarker(name=name, description=f"the {name}", scale=2.0)
    marker.header.frame_id = "map"
    marker.pose.position.y = y
    marker.pose.orientation.w = 1.0
    control = InteractiveMarkerControl(
        name="along", interaction_mode=InteractiveMarkerControl.MOVE_AXIS
    )
    marker.controls.append(control)
    server.insert(marker, on_feedback)
    server.applyChanges()


insert("arm")
# In the first second, the server takes feedback for that of a second client.
rospy.sleep(1.1)
print("ready", flush=True)
for line in sys.stdin:
    command, name, *numbers = line.split()
    if command == "insert":
        insert(name, float(numbers[0]))
    elif command == "erase":
        server.erase(name)
        server.applyChanges()
    elif command == "skip":
        # As if an update were lost.
        server.seq_num += 1
        server.publishInit()
