"""A robot that sends transforms: `tf_peer.py PLAN`, the plan with "url", "name", "static"."""

from __future__ import annotations

import json
import sys

from summary import report

import rosglass
from rosglass.tf import StaticTransformBroadcaster, Transform, TransformBroadcaster

plan = json.loads(sys.argv[1])
node = rosglass.connect(plan["url"], plan["name"])
fixed, moving = StaticTransformBroadcaster(node), TransformBroadcaster(node)
fixed.send_transform(
    [Transform((1.0, 0.0, 0.0), frame_id="base", child_frame_id=name) for name in plan["static"]]
)
report(ready=True)
for line in sys.stdin:
    request = json.loads(line)
    stamp = rosglass.Time(request["stamp"])
    moving.send_transform(
        Transform((0.0, 2.0, 0.0), stamp=stamp, frame_id="map", child_frame_id="base")
    )
    report(sent=True)
