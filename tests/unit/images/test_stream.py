"""A stream decodes every packet of a video, shows the newest frame, says what it waits for."""

from __future__ import annotations

import threading
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import cv2
import numpy as np
import pytest

import rosglass
from rosglass.comm import Sample
from rosglass.comm.qos import QoS, Reliability
from rosglass.errors import DecodeError, NoPictureError
from rosglass.images import ImageStream, RawImage, Transport
from rosglass.images import stream as stream_module
from rosglass.images.transports import TRANSPORTS

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

IMAGE = "sensor_msgs/msg/Image"


class Counting:
    """A video's decoder; the text of a packet says what becomes of it."""

    def __init__(self) -> None:
        self.packets: list[str] = []
        self.losses = 0
        self.gate = threading.Event()
        self.gate.set()
        self.entered = threading.Event()

    def read(self, stamp: object, frame_id: str, text: str) -> RawImage | None:
        self.entered.set()
        self.gate.wait(30)
        self.packets.append(text)
        if text == "bad":
            raise DecodeError(IMAGE, "the packet is corrupt", "data")
        if text == "late":
            raise NoPictureError("waiting for the next key frame")
        return None if text == "header" else RawImage(1, 1, "mono8", 1, b"0", frame_id=text)

    def lost(self) -> None:
        self.losses += 1


class FakeNode:
    """A node with one topic."""

    def __init__(self, topic: str, type: str) -> None:
        self.topic, self.type = topic, type
        self.qos: Any = None
        self.deliver: Callable[[Sample], None] | None = None
        self.subscribed = threading.Event()
        self.problem = ""

    def resolve(self, name: str) -> str:
        return name

    def topics(self) -> dict[str, list[str]]:
        return {self.topic: [self.type]}

    def publishers(self, topic: str) -> list[SimpleNamespace]:
        return [SimpleNamespace(node="camera", qos=QoS())]

    def on_graph_change(self, *_: Any) -> FakeNode:
        return self

    def create_subscription(self, topic: str, type: str, **options: Any) -> FakeNode:
        assert (topic, type) == (self.topic, self.type)
        self.qos, self.deliver = options["qos"], options["raw_callback"]
        self.subscribed.set()
        return self

    def close(self) -> None:
        """As a subscription, and as a listener."""


class Rig:
    def __init__(self, node: FakeNode) -> None:
        self.node = node
        self.shown: list[str] = []
        self.news = threading.Condition()
        self.stream = ImageStream(node, "/cam", self.show, changed=self.wake)
        assert node.subscribed.wait(30)

    def show(self, picture: RawImage, sample: Sample) -> None:
        with self.news:
            self.shown.append(picture.frame_id or picture.encoding)
            self.news.notify_all()

    def wake(self) -> None:
        with self.news:
            self.news.notify_all()

    def until(self, condition: Callable[[], Any]) -> None:
        with self.news:
            assert self.news.wait_for(condition, 30), self.stream.problem


@pytest.fixture
def decoder(monkeypatch: pytest.MonkeyPatch) -> Counting:
    made = Counting()
    transport = Transport("theora", "std_msgs/msg/Header", ("frame_id",), lambda: made, video=True)
    monkeypatch.setattr(Transport, "reader", lambda *_: Reading(made))
    monkeypatch.setitem(TRANSPORTS, "theora", transport)
    return made


class Reading:
    def __init__(self, decoder: Counting) -> None:
        self.decoder, self.lost = decoder, decoder.lost

    def __call__(self, sample: Sample) -> RawImage | None:
        return self.decoder.read(None, "", bytes(sample.data).decode())


@pytest.fixture
def rig(decoder: Counting) -> Iterator[Rig]:
    made = Rig(FakeNode("/cam/theora", "std_msgs/msg/Header"))
    yield made
    decoder.gate.set()
    made.stream.close()
    assert made.stream.join(10)


def send(rig: Rig, *texts: str) -> None:
    kind = rosglass.load("std_msgs/msg/Header")
    for text in texts:
        rig.node.deliver(Sample(text.encode(), "cdr", kind, 1))


def test_every_packet_is_decoded_and_the_newest_frame_shown(rig: Rig, decoder: Counting) -> None:
    decoder.gate.clear()
    send(rig, "header")
    send(rig, *(f"p{number}" for number in range(20)))
    decoder.gate.set()
    rig.until(lambda: rig.shown and rig.shown[-1] == "p19")
    assert decoder.packets == ["header", *(f"p{number}" for number in range(20))]
    assert not decoder.losses
    statistics = rig.stream.statistics()
    assert statistics.received == 21
    assert statistics.shown + statistics.dropped == 20
    assert rig.node.qos.reliability is Reliability.BEST_AVAILABLE
    assert rig.node.qos.depth > 1


def test_waiting_is_reported_but_not_counted_as_fault(rig: Rig) -> None:
    send(rig, "late")
    rig.until(lambda: "key frame" in rig.stream.problem)
    assert rig.stream.statistics().invalid == 0
    send(rig, "header")
    send(rig, "p1")
    rig.until(lambda: rig.shown == ["p1"] and not rig.stream.problem)
    send(rig, "bad")
    rig.until(lambda: "corrupt" in rig.stream.problem)
    assert rig.stream.statistics().invalid == 1


def test_backlog_is_dropped_and_the_decoder_notified(rig: Rig, decoder: Counting) -> None:
    decoder.gate.clear()
    send(rig, "p0")
    assert decoder.entered.wait(30)
    many = 2 * stream_module.MAX_BACKLOG
    send(rig, *(f"q{number}" for number in range(many)))
    decoder.gate.set()
    rig.until(lambda: rig.shown and rig.shown[-1] == f"q{many - 1}")
    assert decoder.losses == 1
    assert len(decoder.packets) < many
    statistics = rig.stream.statistics()
    assert statistics.shown + statistics.dropped == statistics.received


def test_depth_has_the_type_of_compressed_images_but_its_own_decoder() -> None:
    node = FakeNode("/cam/compressedDepth", "sensor_msgs/msg/CompressedImage")
    rig = Rig(node)
    assert rig.stream.transport in {"", "compressedDepth"}
    png = cv2.imencode(".png", np.full((4, 6), 1234, np.uint16))[1].tobytes()
    kind = rosglass.load(node.type)
    data = kind.encode(format="16UC1; compressedDepth png", data=bytes(12) + png)
    node.deliver(Sample(data, "cdr", kind, 1))
    rig.until(lambda: rig.shown == ["16UC1"])
    assert rig.stream.transport == "compressedDepth"
    assert node.qos.reliability is Reliability.BEST_EFFORT
    rig.stream.close()
    assert rig.stream.join(10)
