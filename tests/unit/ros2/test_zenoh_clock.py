"""A system clock that jumps changes neither what is received nor what is kept for late readers."""

from __future__ import annotations

import time
from types import SimpleNamespace

import pytest

zenoh = pytest.importorskip("zenoh")

from rosglass.comm import Durability, Duration, EndpointInfo, EndpointKind, NodeName, QoS  # noqa: E402
from rosglass.wires.zenoh.endpoints import LocalRegistry, ZenohWriter  # noqa: E402
from rosglass.wires.zenoh.options import ZenohOptions  # noqa: E402
from rosglass.wires.zenoh.reader import Drain, _Collected  # noqa: E402

HOUR = 3_600_000_000_000
JUMPS = (HOUR, -HOUR)


class Session:
    """A Zenoh session that keeps what is put, and holds one sample for each subscriber."""

    def __init__(self):
        self.put = []
        self.samples = []

    def declare_subscriber(self, *_, **__):
        session = self

        class Subscriber:
            class handler:  # noqa: N801 - as Zenoh names it
                @staticmethod
                def try_recv():
                    return session.samples.pop() if session.samples else None

        return Subscriber

    def declare_publisher(self, *_, **__):
        session = self

        class Publisher:
            @staticmethod
            def put(payload, attachment):
                session.put.append(bytes(payload))

        return Publisher


@pytest.mark.parametrize("jump", JUMPS)
def test_samples_collected_around_a_jump_of_the_clock_are_new(monkeypatch, jump):
    session, received, clock = Session(), [], time.time_ns
    collected = _Collected(session, "key", 10, lambda _, at: received.append(at), Drain("", 0.1))
    monkeypatch.setattr(time, "time_ns", lambda: clock() + jump)
    session.samples.append("sample")
    collected.flush()
    # It waited for less than a minute, by whichever clock its stamp is.
    assert abs(time.time_ns() - received[0]) < HOUR / 60


def test_samples_that_waited_in_a_program_that_stalled_are_received_late(monkeypatch):
    session, received, steady = Session(), [], time.monotonic_ns
    collected = _Collected(session, "key", 10, lambda _, at: received.append(at), Drain("", 0.1))
    monkeypatch.setattr(time, "monotonic_ns", lambda: steady() + HOUR)
    session.samples.append("sample")
    collected.flush()
    # By the time between stamp and reception they are late; else they would look fast.
    assert abs(time.time_ns() - received[0]) < HOUR / 60


@pytest.mark.parametrize("jump", JUMPS)
def test_lifespan_of_latched_samples_does_not_follow_the_system_clock(monkeypatch, jump):
    qos = QoS(durability=Durability.TRANSIENT_LOCAL, lifespan=Duration.from_seconds(600))
    node, clock = NodeName("/", "robot"), time.time_ns
    end = EndpointInfo(EndpointKind.PUBLISHER, "/map", "std_msgs/msg/String", node, qos)
    writer = ZenohWriter(
        SimpleNamespace(options=ZenohOptions()), "token", end, None, LocalRegistry()
    )
    writer.write(b"\0\1\0\0map")
    monkeypatch.setattr(time, "time_ns", lambda: clock() + jump)
    declare = Session.declare_publisher
    monkeypatch.setattr(zenoh.ext, "declare_advanced_publisher", declare)
    late = Session()
    writer.declare(late)
    assert late.put == [b"\0\1\0\0map"]
