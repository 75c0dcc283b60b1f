"""How samples that are collected now and then are taken, and the end of that."""

from __future__ import annotations

import gc
import threading
import weakref
from types import SimpleNamespace

import pytest

pytest.importorskip("zenoh")

from rosglass.comm import EndpointInfo, EndpointKind, NodeName
from rosglass.wires.zenoh.endpoints import LocalRegistry
from rosglass.wires.zenoh.keys import HUMBLE_HASH
from rosglass.wires.zenoh.options import ZenohOptions
from rosglass.wires.zenoh.reader import ZenohReader, _Collected


class Subscriber:
    """A subscriber of Zenoh, whose handler is borrowed while a sample is taken from it."""

    def __init__(self):
        self.handler = self
        self.reading, self.go_on = threading.Event(), threading.Event()
        self.borrowed, self.undeclared = False, False

    def try_recv(self):
        self.borrowed = True
        self.reading.set()
        self.go_on.wait(30)
        self.borrowed = False

    def undeclare(self):
        if self.borrowed:
            raise RuntimeError("Already borrowed")
        self.undeclared = True


class Key:
    """A declared key, whose declaration ends with it."""


class Session:
    def __init__(self, subscriber):
        self.declare_subscriber = lambda *_, **__: subscriber
        self.keys = weakref.WeakValueDictionary()

    def declare_keyexpr(self, text):
        return self.keys.setdefault(text, Key())


class Drain:
    def __init__(self, closing):
        self.remove = lambda _: closing.set()
        self.interval_ns = 100_000_000


def test_reader_is_closed_while_the_drain_takes_its_samples():
    subscriber, closing, failed = Subscriber(), threading.Event(), []
    collected = _Collected(Session(subscriber), "key", 10, print, Drain(closing))

    def end():
        try:
            collected.end()
        except RuntimeError as error:
            failed.append(error)

    taking = threading.Thread(target=collected.flush)
    taking.start()
    assert subscriber.reading.wait(30)
    ending = threading.Thread(target=end)
    ending.start()
    assert closing.wait(30)
    ending.join(0.05)  # where it raised before
    subscriber.go_on.set()
    for thread in (taking, ending):
        thread.join(30)
    assert failed == []
    assert subscriber.undeclared


def test_reader_closed_while_it_changes_its_mode_ends_each_source_once(monkeypatch):
    calls = []

    class Source:
        """A source that is closed with its reader as soon as it begins."""

        def __init__(self, *_):
            pass

        def begin(self):
            calls.append("begin")
            reader.close()

        def end(self):
            calls.append("end")

    # Any rate is high enough for a thread of their own.
    monkeypatch.setattr("rosglass.wires.zenoh.reader._MIN_RATE_WINDOW_S", 0.0)
    monkeypatch.setattr("rosglass.wires.zenoh.reader._THREAD_RATE_HZ", -1.0)
    monkeypatch.setattr("rosglass.wires.zenoh.reader._Pumped", Source)
    first = Subscriber()
    owner = SimpleNamespace(options=ZenohOptions(), forget=lambda _: None, recycle=lambda _: None)
    endpoint = EndpointInfo(
        EndpointKind.SUBSCRIPTION, "/topic", "std_msgs/msg/Empty", NodeName("/", "node")
    )
    reader = ZenohReader(owner, "token", endpoint, print, None, None, LocalRegistry())
    reader.declare(Session(first))
    reader.poll()
    assert first.undeclared
    assert calls == ["begin", "end"]


@pytest.mark.parametrize(
    ("options", "type_hash"),
    [
        (ZenohOptions(), "RIHS01_" + "a" * 64),
        (ZenohOptions(), ""),
        (ZenohOptions(humble=True), "RIHS01_" + "a" * 64),
    ],
)
def test_reader_declares_the_key_of_its_definition(options, type_hash):
    """Zenoh handles each message on a key that no entity has in twice the time."""
    session = Session(Subscriber())
    owner = SimpleNamespace(options=options, forget=lambda _: None, recycle=lambda _: None)
    endpoint = EndpointInfo(
        EndpointKind.SUBSCRIPTION,
        "/topic",
        "std_msgs/msg/Empty",
        NodeName("/", "node"),
        type_hash=type_hash,
    )
    reader = ZenohReader(owner, "token", endpoint, print, None, None, LocalRegistry())
    reader.declare(session)
    announced = HUMBLE_HASH if options.humble else type_hash or HUMBLE_HASH
    assert list(session.keys) == [f"0/topic/std_msgs::msg::dds_::Empty_/{announced}"]
    reader.close()
    gc.collect()
    assert not session.keys
