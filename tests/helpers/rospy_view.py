"""A robot's program with rospy: calls the camera's services, hears its topics, sends transforms.

Takes one JSON object per line and answers with one.
"""

import json
import sys
import threading

import genpy
import hector_rviz_plugins.msg
import hector_rviz_plugins.srv
import rospy
import std_msgs.msg
from geometry_msgs.msg import TransformStamped
from tf2_msgs.msg import TFMessage

messages = {}
messages_lock = threading.Lock()
subscribers, transforms = {}, {}


def do_call(service, type, request, times=1):
    kind = getattr(hector_rviz_plugins.srv, type)
    made = kind._request_class()
    genpy.message.fill_message_args(made, [request])
    rospy.wait_for_service(service, 20)
    try:
        for _ in range(times):
            rospy.ServiceProxy(service, kind)(made)
    except rospy.ServiceException as error:
        return f"{error}"
    return "done"


def do_listen(topic, mode):
    def heard(message):
        with messages_lock:
            messages.setdefault(topic, []).append(message.mode if mode else message.data)

    if topic in subscribers:
        subscribers[topic].unregister()
    with messages_lock:
        messages[topic] = []
    kind = hector_rviz_plugins.msg.ViewMode if mode else std_msgs.msg.String
    subscribers[topic] = rospy.Subscriber(topic, kind, heard)


def do_heard(topic):
    with messages_lock:
        return messages.get(topic, [])


def do_tf(parent, child, translation, rotation):
    if parent not in transforms:
        transforms[parent] = rospy.Publisher("/tf", TFMessage, queue_size=10, latch=True)
    made = TransformStamped()
    made.header.stamp, made.header.frame_id = rospy.Time.now(), parent
    made.child_frame_id = child
    t, r = made.transform.translation, made.transform.rotation
    t.x, t.y, t.z = translation
    r.x, r.y, r.z, r.w = rotation
    transforms[parent].publish(TFMessage([made]))


def do_md5(kind, type):
    return getattr(getattr(hector_rviz_plugins, kind), type)._md5sum


rospy.init_node("robot_with_rospy", disable_signals=True)
for line in sys.stdin:
    asked = json.loads(line)
    answer = globals()["do_" + asked.pop("do")](**asked)
    sys.stdout.write(json.dumps(answer) + "\n")
    sys.stdout.flush()
