"""A robot with types of its own: `types_peer.py PLAN` with the plan as JSON, see below."""

from __future__ import annotations

import json
import sys

from summary import report
from waiting import at_rate

import rosglass
from rosglass.comm.types import Types
from rosglass.ros2.type_descriptions import describe

# The plan: "url", "folder" with the robot's packages, "name" of the node; "mood": "honest",
# "mute" (no get_type_description), "silent" (never answers) or "liar" (sends other definitions,
# those in the folder "lies").
plan = json.loads(sys.argv[1])
mood = plan.get("mood", "honest")
library = rosglass.Library()
library.add_path(plan["folder"])
name = plan.get("name", "robot")
node = rosglass.connect(plan["url"], name, library=library, own_services=mood == "honest")

if mood in ("silent", "liar"):
    other = rosglass.Library()
    if mood == "liar":
        other.add_path(plan["lies"])

    def respond(request):
        report(asked=request.type_name)
        if mood == "silent":
            return rosglass.comm.Promise(cancellable=True)
        return describe(Types(other, ""), request.type_name, "", sources=True)

    node.create_service_server(
        f"/{name}/get_type_description",
        "type_description_interfaces/srv/GetTypeDescription",
        respond,
        executor=rosglass.comm.IMMEDIATE,
    )

state = node.create_publisher("/state", "my_msgs/msg/State")
node.create_subscription(
    "/command", "my_msgs/msg/State", lambda message: report(command=message.to_dict())
)
node.create_service_server(
    "/ask", "my_msgs/srv/Ask", lambda request: {"yes": request.part.a == 5, "text": "ok"}
)


def go(goal):
    goal.publish_feedback(left=0.5)
    return {"part": {"a": goal.goal.speed}}


if plan.get("action"):
    node.create_action_server("/go", "my_msgs/action/Go", go)

report(ready=True)
for number in at_rate(0.05, 12_000):
    state.publish(state=number % 200, parts=[{"a": -1}, {"a": 2}], name="Grüße")
