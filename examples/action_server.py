"""Offers the action /fibonacci: counts with feedback, and can be cancelled.

Run it with ``python examples/action_server.py [URL]``.
"""

from __future__ import annotations

import sys
import threading

import rosglass


def accept(goal) -> bool:
    """Reject goals that would take too long."""
    return goal.order <= 40


def fibonacci(goal):
    """Runs on the goal's own thread; the return value is the result."""
    sequence = [0, 1]
    while len(sequence) < goal.goal.order:
        if goal.wait_for_cancel(0.2):
            break  # return the result of a cancelled goal
        sequence.append(sequence[-1] + sequence[-2])
        goal.publish_feedback(sequence=sequence)
    return {"sequence": sequence}


with rosglass.connect(sys.argv[1] if len(sys.argv) > 1 else None, "mathematician") as node:
    action = "example_interfaces/action/Fibonacci"
    node.create_action_server("/fibonacci", action, fibonacci, accept=accept)
    print("ready; Ctrl-C ends it", flush=True)
    try:
        threading.Event().wait()
    except KeyboardInterrupt:
        print("bye")
