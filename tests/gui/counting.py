"""Shared by tests of action clients in QML: the robot's side, and a root object with a client."""

from __future__ import annotations

import json
import threading
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable


class Counter:
    """The robot's side: counts up to the order; an order of 50 goes on until it is cancelled.

    Attributes:
        type: The action's type, of the robot's ROS.
        go: Goals wait for it.
        stop: Goals that are cancelled wait for it.
        server: The server; None while none is offered.
    """

    def __init__(self, robot: Any, url: str) -> None:
        package = "actionlib_tutorials" if url.startswith("ros1") else "example_interfaces"
        self.type = f"{package}/action/Fibonacci"
        self.ros1 = url.startswith("ros1")
        self.robot, self.go, self.stop = robot, threading.Event(), threading.Event()
        self.go.set()
        self.stop.set()
        self.server: Any = None

    def offer(self, **more: Any) -> None:
        self.server = self.robot.create_action_server(
            "/count", self.type, self.count, accept=lambda goal: goal.order > 0, **more
        )

    def count(self, goal: Any) -> Any:
        self.go.wait(30)
        sequence = [0, 1]
        while len(sequence) < goal.goal.order:
            if goal.wait_for_cancel(0.01):
                self.stop.wait(30)
                break
            sequence = [*sequence[:40], sequence[-1] + 1]
            goal.publish_feedback(sequence=sequence)
        if goal.goal.order == 13:
            raise ValueError("unlucky")
        return {"sequence": sequence}


class Client:
    """A root object with a client, its log as Python has it."""

    def __init__(self, root: Any, wait: Callable[..., None]) -> None:
        self.root, self.wait = root, wait

    @property
    def log(self) -> list[list[Any]]:
        return self.run("log")

    def of(self, kind: str) -> list[list[Any]]:
        return [entry[1:] for entry in self.log if entry[0] == kind]

    def run(self, script: str) -> Any:
        text = self.root.run(script)
        return None if not text else json.loads(text)

    def until(self, kind: str) -> list[Any]:
        self.wait(lambda: self.of(kind))
        return self.of(kind)[-1]
