"""Puts transforms and questions, read as JSON, to tf2's own BufferCore; run by Debian's Python."""

import json
import sys

import rospy
import tf2_py
from geometry_msgs.msg import TransformStamped


def stamp(nanoseconds):
    return rospy.Time(nanoseconds // 10**9, nanoseconds % 10**9)


def answer(function, *arguments):
    try:
        found = function(*arguments)
    except tf2_py.TransformException as error:
        return {"error": type(error).__name__, "message": str(error)}
    p, q = found.transform.translation, found.transform.rotation
    return {
        "value": [p.x, p.y, p.z, q.x, q.y, q.z, q.w],
        "stamp": found.header.stamp.to_nsec(),
        "frames": [found.header.frame_id, found.child_frame_id],
    }


def main():
    plan = json.load(sys.stdin)
    core = tf2_py.BufferCore(rospy.Duration(plan["cache_time"]))
    for parent, child, time, numbers, authority, static in plan["transforms"]:
        message = TransformStamped()
        message.header.frame_id, message.child_frame_id = parent, child
        message.header.stamp = stamp(time)
        p, q = message.transform.translation, message.transform.rotation
        p.x, p.y, p.z, q.x, q.y, q.z, q.w = numbers
        (core.set_transform_static if static else core.set_transform)(message, authority)
    answers = []
    for query in plan["queries"]:
        if len(query) == 3:
            target, source, time = query
            lookup = (core.lookup_transform_core, target, source, stamp(time))
            can = core.can_transform_core(target, source, stamp(time))
        else:
            target, target_time, source, source_time, fixed = query
            arguments = (target, stamp(target_time), source, stamp(source_time), fixed)
            lookup = (core.lookup_transform_full_core, *arguments)
            can = core.can_transform_full_core(*arguments)
        answers.append({**answer(*lookup), "can": bool(can[0])})
    json.dump({"answers": answers, "yaml": core.all_frames_as_yaml()}, sys.stdout)


main()
