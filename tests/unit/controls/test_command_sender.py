"""CommandSender: zeros until they arrive."""

from __future__ import annotations

import threading
import time
from typing import Any

from waiting import eventually

from rosglass.controls.steering import command_sender
from rosglass.controls.steering.command_sender import CommandSender, Limits, Velocity


class StalledPublisher:
    """A publisher whose messages are dropped on this machine while its link stands still."""

    topic = "/cmd_vel"

    def __init__(self) -> None:
        self.sent: list[float] = []
        self.dropped, self.stalled = 0, False

    def publish(self, message: dict[str, Any]) -> None:
        self.sent.append(message["speed"])
        self.dropped += self.stalled

    def subscription_count(self) -> int:
        return 1

    def close(self) -> None:
        pass


def test_zeros_are_sent_for_as_long_as_they_are_dropped(monkeypatch: Any) -> None:
    """Each zero is dropped when it is given, long before the next one is due."""
    monkeypatch.setattr(command_sender, "_ZERO_PHASE_S", 0.2)
    publisher = StalledPublisher()
    sender = CommandSender(
        publisher,  # type: ignore[arg-type]
        lambda velocity, _: {"speed": velocity.forward},
        lambda _: None,
    )
    sender.limits = Limits(Velocity(forward=1.0))
    try:
        sender.begin(1, 0, 0)
        eventually(lambda: publisher.sent)
        publisher.stalled = True
        sender.halt()
        # Without the outage, 5 are sent.
        eventually(lambda: publisher.sent.count(0.0) >= 10)
        assert publisher.sent[-1] == 0.0
    finally:
        sender.close()


def test_command_is_not_sent_when_the_process_was_stopped_on_its_way() -> None:
    """Between the decision to send it and the publisher, where a thread waits for its turn."""
    publisher, stopped = StalledPublisher(), 0.0
    decided, continued = threading.Event(), threading.Event()

    def compose(velocity: Velocity, _: str) -> dict[str, Any]:
        if velocity.forward:
            decided.set()
            assert continued.wait(30)
        return {"speed": velocity.forward}

    sender = CommandSender(publisher, compose, lambda _: None)  # type: ignore[arg-type]
    sender._clock = lambda: time.monotonic() + stopped
    sender.limits = Limits(Velocity(forward=1.0))
    try:
        sender.begin(1, 0, 0)
        assert decided.wait(30)
        stopped = 1.0
        continued.set()
        eventually(lambda: len(publisher.sent) >= 3)
        assert not any(publisher.sent)
    finally:
        sender.close()
