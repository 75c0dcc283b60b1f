"""A node that keeps what the robot sends, and calls what it offers."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, Any

import pytest
from waiting import eventually

import rosglass
from rosglass.comm import ParameterEvent, QoS

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.demo.robot import Robot


class Recorder:
    """A publisher that encodes, as a real one does, and keeps what it was given."""

    def __init__(self, type_name: str, qos: QoS | int) -> None:
        self.type, self.qos = rosglass.load(type_name), qos
        self.sent: list[Any] = []
        self.listeners = 1
        self.blocked = threading.Event()
        self.blocked.set()

    def publish(self, message: Any = None, /, **fields: Any) -> None:
        data = self.type.encode(fields if message is None else message, wire="cdr")
        self.sent.append(self.type.decode(bytes(data), wire="cdr"))
        self.blocked.wait(30)

    def subscription_count(self) -> int:
        return self.listeners


class Listener:
    def close(self) -> None:
        pass


class Settings:
    """Parameters that anybody may set."""

    def __init__(self) -> None:
        self.callbacks: list[Callable[[Any], None]] = []

    def declare(self, name: str, value: Any, descriptor: Any) -> Any:
        assert descriptor.range.low <= value <= descriptor.range.high
        return value

    def on_change(self, callback: Callable[[Any], None]) -> Listener:
        self.callbacks.append(callback)
        return Listener()

    def set(self, **values: Any) -> None:
        for callback in self.callbacks:
            callback(ParameterEvent("/robot", {}, values, ()))


class StubNode:
    """As much of a node as the robot uses."""

    wire = "ros1"

    def __init__(self) -> None:
        self.parameters = Settings()
        self.services: dict[str, Callable[[Any], Any]] = {}
        self.publishers: dict[str, Recorder] = {}
        self.commands: dict[str, tuple[Any, Callable[[Any], None]]] = {}

    def create_publisher(self, topic: str, type: str, qos: QoS | int = 10) -> Recorder:
        self.publishers[topic] = Recorder(type, qos)
        return self.publishers[topic]

    def create_subscription(
        self, topic: str, type: str, callback: Callable[[Any], None], qos: QoS | int = 10
    ) -> Listener:
        self.commands[topic] = (rosglass.load(type), callback)
        return Listener()

    def create_service_server(
        self, name: str, type: str, callback: Callable[[Any], Any]
    ) -> Listener:
        self.services[name] = callback
        return Listener()

    def create_action_server(
        self, name: str, type: str, callback: Callable[[Any], Any]
    ) -> Listener:
        self.services[name] = callback
        return Listener()

    def command(self, topic: str, **fields: Any) -> None:
        type_, callback = self.commands[topic]
        callback(type_.decode(bytes(type_.encode(fields, wire="cdr")), wire="cdr"))

    def last(self, topic: str, timeout: float = 30.0) -> Any:
        """Return the next message sent on a topic."""
        sent = self.publishers[topic].sent
        count = len(sent)
        eventually(lambda: len(sent) > count, f"something sent on {topic}", timeout=timeout)
        return sent[-1]

    def ask(self, service: str, **fields: Any) -> dict[str, Any]:
        answer: dict[str, Any] = self.services[service](type("Request", (), fields))
        return answer


@pytest.fixture(scope="session")
def stub_node() -> type[StubNode]:
    return StubNode


@pytest.fixture(scope="session")
def lives_on() -> Callable[[Robot, float], None]:
    """Wait until a robot has lived on for some seconds of its own, however busy the machine is."""

    def lives_on(robot: Robot, seconds: float) -> None:
        end = robot.state.time + seconds
        eventually(lambda: robot.state.time > end)

    return lives_on
