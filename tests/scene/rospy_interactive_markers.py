"""A server of Debian's interactive_markers (ROS 1), which lines of its input move and change."""

import json
import sys

import rospy
from genpy.message import fill_message_args
from interactive_markers.interactive_marker_server import InteractiveMarkerServer
from interactive_markers.menu_handler import MenuHandler
from visualization_msgs.msg import InteractiveMarker, InteractiveMarkerControl

rospy.init_node("marker_server", disable_signals=True)
server = InteractiveMarkerServer("arm_markers")


def on_feedback(feedback):
    position = feedback.pose.position
    print(
        f"feedback {feedback.marker_name} {feedback.event_type} {position.x:.2f} {position.y:.2f}"
        f" {feedback.menu_entry_id}",
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
# In the first second of a marker, the server takes feedback for that of a second client.
rospy.sleep(1.1)
print("ready", flush=True)
for line in sys.stdin:
    command, _, rest = line.strip().partition(" ")
    if command == "markers":
        for fields in json.loads(rest):
            marker = InteractiveMarker()
            fill_message_args(marker, [fields])
            server.insert(marker, on_feedback)
        server.applyChanges()
        continue
    if command == "settle":
        rospy.sleep(1.1)
        print("settled", flush=True)
        continue
    name, *numbers = rest.split()
    if command == "insert":
        insert(name, float(numbers[0]))
    elif command == "menu":
        menu = MenuHandler()
        for title in numbers:
            menu.insert(title, callback=on_feedback)
        menu.apply(server, name)
        server.applyChanges()
    elif command == "erase":
        server.erase(name)
        server.applyChanges()
    elif command == "skip":
        # As if an update were lost.
        server.seq_num += 1
        server.publishInit()
