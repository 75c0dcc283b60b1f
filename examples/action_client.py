"""Sends goals to the action /fibonacci of examples/action_server.py.

Run it with ``python examples/action_client.py [URL]``.
"""

from __future__ import annotations

import sys

import rosglass


def show(feedback) -> None:
    """Print the progress; runs on the node's own thread."""
    print(f"so far: {feedback.sequence.tolist()}")


with rosglass.connect(sys.argv[1] if len(sys.argv) > 1 else None, "student") as node:
    client = node.create_action_client("/fibonacci", "example_interfaces/action/Fibonacci")

    # Goals wait for their server.
    goal = client.send_goal({"order": 6}, on_feedback=show)
    try:
        status, result = goal.result()
    except rosglass.ServiceUnavailableError as error:
        sys.exit(f"is examples/action_server.py running? {error}")
    print(f"{status.value} {result.sequence.tolist()}")

    goal = client.send_goal({"order": 30})
    if goal.acceptance.result(timeout=5):
        answer = goal.cancel().result(timeout=5)
        print(f"cancelling {len(answer.accepted)} goal {answer.reason}")
    print(goal.result(timeout=5).status.value)

    try:
        client.send_goal({"order": 1000}).result(timeout=5)
    except rosglass.GoalRejectedError as error:
        print(error)
