"""Previews of several cameras of a real robot: one image at a time, one camera at a time."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from rosglass.comm import Time

if TYPE_CHECKING:
    from collections.abc import Iterator

COUNT = 3
PREVIEWS = (
    "Item {"
    + "".join(
        f"""
    property QtObject sub{i}: ImageTransportSubscription {{
        topic: "/cam{i}"; throttleRate: 1; videoSink: view{i}.videoSink; timeout: 10000
    }}
    ImageItem {{ id: view{i}; width: 64; height: 48 }}"""
        for i in range(COUNT)
    )
    + "}"
)


class Cameras:
    """Films with several cameras at 20 Hz and counts how many are watched."""

    def __init__(self, node: Any) -> None:
        self.sent = 0
        #: Images published without subscribers.
        self.unwatched = 0
        self._cameras = [
            node.create_publisher(f"/cam{i}", "sensor_msgs/msg/Image", 1) for i in range(COUNT)
        ]
        self._end = threading.Event()
        self._thread = threading.Thread(target=self._film)
        self._thread.start()

    def _film(self) -> None:
        data = np.full(48 * 64 * 3, 200, np.uint8)
        while not self._end.wait(0.05):
            for camera in self._cameras:
                self.unwatched += camera.subscription_count() == 0
                self.sent += 1
                camera.publish(
                    header={"stamp": Time.now()},
                    width=64,
                    height=48,
                    encoding="rgb8",
                    step=192,
                    data=data,
                )

    def close(self) -> None:
        self._end.set()
        self._thread.join()


@pytest.fixture
def cameras(live: Any) -> Iterator[Cameras]:
    made = Cameras(live.robot)
    yield made
    made.close()


def test_a_robot_sends_only_what_is_shown(live: Any, cameras: Cameras, wait: Any) -> None:
    root = live.load(PREVIEWS, "import QtQuick 2.15")
    subs = [root.property(f"sub{i}") for i in range(COUNT)]
    wait(lambda: len(live.session.streams) == COUNT)
    streams = [stream.stream for stream in live.session.streams.values()]
    wait(lambda: all(stream.statistics().shown >= 3 for stream in streams), timeout=60)
    sent, unwatched = cameras.sent, cameras.unwatched
    before = [stream.statistics() for stream in streams]
    wait(
        lambda: all(
            stream.statistics().shown >= last.shown + 4
            for stream, last in zip(streams, before, strict=True)
        ),
        timeout=60,
    )
    # Most of the time the robot has no subscriber to compress and send for.
    assert cameras.unwatched - unwatched > (cameras.sent - sent) / 2
    for stream, last in zip(streams, before, strict=True):
        now = stream.statistics()
        assert now.received - last.received < (cameras.sent - sent) / COUNT / 2
    assert not any(sub.property("stale") for sub in subs)
    assert all(sub.property("subscribed") for sub in subs)
    # A viewer that wants all gets all, at once.
    subs[0].setProperty("throttleRate", 0)
    wait(lambda: subs[0].property("framerate") > 8)
