"""Transforms between rosglass programs over Zenoh and DDS: latched ones of several publishers."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest
from waiting import eventually

from rosglass.comm import Time
from rosglass.errors import ExtrapolationException, UnsupportedError
from rosglass.tf import (
    StaticTransformBroadcaster,
    Transform,
    TransformBroadcaster,
    TransformListener,
)

PEERS = Path(__file__).parent / "peers"
GUIDE = Path(__file__).parents[3] / "docs/tf.md"
START = 1_700_000_000_123_456_789


@pytest.fixture(params=["zenoh", "dds"])
def node(request: pytest.FixtureRequest) -> Any:
    connect = request.getfixturevalue("connect" if request.param == "zenoh" else "dds_connect")
    return connect("cockpit")


def test_two_robots(node: Any, start: Any) -> None:
    robots = {}
    for name, frames in (("left", ["camera", "lidar"]), ("right", ["gripper"])):
        plan = {"url": node.url, "name": name, "static": frames}
        robots[name] = start(str(PEERS / "tf_peer.py"), json.dumps(plan))
    for robot in robots.values():
        robot.event("ready")
    # Who comes later gets the static ones of both.
    listener = TransformListener(node)
    buffer = listener.buffer
    buffer.wait_for_transform("gripper", "camera", timeout=30)
    buffer.wait_for_transform("gripper", "lidar", timeout=30)
    tree = buffer.tree
    eventually(lambda: tree()["camera"].authority == "/left", lambda: tree()["camera"])
    eventually(lambda: tree()["gripper"].authority == "/right", lambda: tree()["gripper"])

    notified: list[None] = []
    buffer.on_change("map", "camera", lambda: notified.append(None))
    eventually(lambda: listener.subscriptions[0].publisher_count() == 2)
    later = Time(START + 50_000_000)
    promise = buffer.lookup_transform_async("map", "camera", later, timeout=30)
    for step in (0, 100_000_000):
        robots["left"].ask(stamp=START + step)
        robots["left"].event("sent")
    found = promise.result(30)
    assert found.translation == (1.0, 2.0, 0.0)
    assert found.stamp == later
    assert notified
    with pytest.raises(ExtrapolationException):
        buffer.lookup_transform("map", "camera", Time(START - 1))

    listener.close()


def test_receiving_thread_cannot_wait(node: Any, start: Any) -> None:
    plan = {"url": node.url, "name": "waker", "static": ["waker"]}
    robot = start(str(PEERS / "tf_peer.py"), json.dumps(plan))
    robot.event("ready")
    listener = TransformListener(node)
    caught: list[Exception] = []

    def wait() -> None:
        try:
            listener.buffer.wait_for_transform("map", "never", timeout=30)
        except Exception as error:
            caught.append(error)

    listener.buffer.wait_for_transform("base", "waker", timeout=30)
    eventually(listener.subscriptions[0].publisher_count)
    listener.buffer.on_update(wait)
    robot.ask(stamp=START)
    eventually(lambda: caught)
    assert isinstance(caught[0], UnsupportedError)


def test_a_clock_that_jumps_back(node: Any) -> None:
    listener = TransformListener(node)
    sent = Transform(stamp=Time(START), frame_id="table", child_frame_id="cup")
    broadcaster = TransformBroadcaster(node, namespace="/")
    eventually(broadcaster.publisher.subscription_count)
    broadcaster.send_transform(sent)
    eventually(lambda: listener.buffer.has_frame("cup"))
    node.clock.simulate(True)
    node.clock.advance(Time(START))
    eventually(lambda: not listener.buffer.has_frame("cup"))
    broadcaster.send_transform(sent)
    eventually(lambda: listener.buffer.has_frame("cup"))
    node.clock.advance(Time(START - 10**9))
    eventually(lambda: not listener.buffer.has_frame("cup"))


def test_the_guide_as_it_is_printed(
    node: Any,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setenv("ROSGLASS_URL", node.url)
    fixed = StaticTransformBroadcaster(node)
    fixed.send_transform(Transform((2.0, 0.0, 0.0), frame_id="map", child_frame_id="base_link"))
    names: dict[str, Any] = {}
    blocks = re.findall(r"```python\n(.*?)```", GUIDE.read_text(encoding="utf-8"), re.DOTALL)
    assert len(blocks) >= 4
    try:
        for block in blocks:
            exec(compile(block, str(GUIDE), "exec"), names)
        eventually(lambda: "camera" in names["buffer"].tree())
        eventually(lambda: "odom" in names["buffer"].tree())
    finally:
        names["node"].close()
    output = capsys.readouterr().out
    assert "(3.0, 0.0, 0.0)" in output
    assert "'camera'" in output
