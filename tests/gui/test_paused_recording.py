"""Every element with an age shows the moment at which a recording is paused."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest
from mcap import writer as mcap_writer

from rosglass import load
from rosglass.interfaces import full_text

if TYPE_CHECKING:
    from pathlib import Path

    from conftest import Bench

SECOND = 1_000_000_000
START = 1_700_000_000 * SECOND


def header(at: int, frame: str = "map") -> dict[str, Any]:
    return {"frame_id": frame, "stamp": {"sec": at // SECOND, "nanosec": at % SECOND}}


def image(at: int) -> dict[str, Any]:
    shape = {"width": 16, "height": 8, "encoding": "rgb8", "step": 48}
    return {"header": header(at), **shape, "data": bytes(384)}


TOPICS: dict[str, tuple[str, Any]] = {
    "/cam": ("sensor_msgs/msg/Image", image),
    "/tf": (
        "tf2_msgs/msg/TFMessage",
        lambda at: {"transforms": [{"header": header(at), "child_frame_id": "base"}]},
    ),
    "/a": ("sensor_msgs/msg/Imu", lambda at: {"header": header(at)}),
    "/b": ("sensor_msgs/msg/Temperature", lambda at: {"header": header(at)}),
}


@pytest.fixture
def drive(tmp_path: Path) -> Path:
    """A recording of 9 s, of which the robot was silent from 2 s on, but for its last word."""
    path = tmp_path / "drive.mcap"
    writer = mcap_writer.Writer(str(path))
    writer.start("ros2")
    for topic, (name, make) in {**TOPICS, "/c": ("std_msgs/msg/Empty", lambda _: {})}.items():
        kind = load(name)
        schema = writer.register_schema(name, "ros2msg", full_text(kind.definition).encode())
        channel = writer.register_channel(topic, "cdr", schema)
        for tick in [90] if topic == "/c" else range(20):
            at = START + tick * SECOND // 10
            writer.add_message(channel, at, kind.encode(make(at)), at)
    writer.finish()
    return path


def test_nothing_grows_old_while_time_stands_still(live: Bench, drive: Path, wait: Any) -> None:
    root: Any = live.load(
        f"""
        Item {{
            Replay {{ id: replay; file: "{drive}" }}
            ImageItem {{ width: 16; height: 8; source: camera }}
            ImageTransportSubscription {{ id: camera; topic: "/cam"; timeout: 1000 }}
            TfTransform {{ id: tf; targetFrame: "map"; sourceFrame: "base"; timeout: 1000 }}
            SynchronizedSubscription {{ id: both; topics: ["/a", "/b"]; timeout: 1000 }}
            function stale() {{ return [camera.stale, tf.stale, both.stale].join() }}
            function pause() {{ replay.pause() }}
            function seek(to) {{ replay.seek(to) }}
            function paused() {{ return replay.ready && !replay.playing }}
        }}
        """,
        "import QtQuick 2.15",
    )
    wait(lambda: root.stale() == "false,false,false")
    root.pause()
    wait(root.paused)
    wait.nothing_happens(1.5)
    assert root.stale() == "false,false,false"
    root.seek(8)
    wait(lambda: root.stale() == "true,true,true")
