"""Transforms in QML: followed, looked up and sent, on real middleware."""

from __future__ import annotations

import threading
import time
from typing import TYPE_CHECKING, Any

import pytest

from rosglass.comm import ConnectionState, Status, Time
from rosglass.tf import StaticTransformBroadcaster, Transform, TransformBroadcaster

if TYPE_CHECKING:
    from collections.abc import Iterator

    from conftest import Bench

FOLLOWING = """
    QtObject {
        property TfTransform tf: TfTransform { sourceFrame: "base"; targetFrame: "map" }
        property var order: []
        property Connections c: Connections {
            target: tf
            function onMessageChanged() { order.push("message " + tf.valid) }
            function onValidChanged() { order.push("valid " + tf.message.valid) }
        }
        function x() { return tf.translation.x }
        function w() { return tf.rotation.w }
        function shown() {
            return [tf.valid, tf.stale, tf.rate, tf.enabled, tf.active, tf.message.exception].join()
        }
        function changes() { return order.join() }
    }
"""


class Robot:
    """Moves along x by a millimetre each 20 ms, with a laser 0.5 m ahead of its centre."""

    def __init__(self, node: Any) -> None:
        self.node = node
        self._moving, self._static = TransformBroadcaster(node), StaticTransformBroadcaster(node)
        self._static.send_transform(
            Transform((0.5, 0.0, 0.0), frame_id="base", child_frame_id="laser")
        )
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._move)
        self._thread.start()

    def _move(self) -> None:
        x = 1.0
        while not self._ended.wait(0.02):
            x += 0.001
            place = Transform(
                (x, 0.0, 0.0), stamp=Time.now(), frame_id="map", child_frame_id="base"
            )
            self._moving.send_transform(place)

    def close(self) -> None:
        self._ended.set()
        self._thread.join()
        self._moving.close()
        self._static.close()


@pytest.fixture
def robot(live: Bench) -> Iterator[Robot]:
    made = Robot(live.robot)
    yield made
    made.close()


@pytest.mark.parametrize("module", ["Ros2 1.0", "Ros 1.0"])
def test_following(live: Bench, robot: Robot, module: str, wait: Any) -> None:
    live.module = module
    root: Any = live.load(FOLLOWING)
    assert root.shown() == "false,true,62.5,true,true,Uninitialized"
    assert root.w() == 1
    wait(lambda: root.shown().startswith("true,false"))
    # A handler that is notified of a valid transform must not see the old message.
    assert root.changes().startswith("message true,valid true") or "valid true" in root.changes()
    before = root.x()
    assert before > 1
    wait(lambda: root.x() > before)
    robot.close()
    wait(lambda: root.shown().startswith("true,true"))


def test_a_chain_with_a_link_that_stands_still_is_stale(live: Bench, wait: Any) -> None:
    """The localisation goes on, the odometry is dead: the robot stands still on the screen."""
    broadcaster, ended = TransformBroadcaster(live.robot), threading.Event()

    def send(parent: str, child: str) -> None:
        place = Transform((1.0, 0.0, 0.0), stamp=Time.now(), frame_id=parent, child_frame_id=child)
        broadcaster.send_transform(place)

    odometry = threading.Event()

    def localise() -> None:
        while not ended.wait(0.05):
            send("map", "odom")
            if not odometry.is_set():
                send("odom", "base")

    thread = threading.Thread(target=localise)
    thread.start()
    try:
        root: Any = live.load(FOLLOWING)
        wait(lambda: root.shown().startswith("true,false"))
        odometry.set()
        wait(lambda: root.shown().startswith("true,true"))
    finally:
        ended.set()
        thread.join()


def test_a_transform_that_was_held_back_is_stale_as_it_arrives(live: Bench, wait: Any) -> None:
    broadcaster = TransformBroadcaster(live.robot)
    root: Any = live.load("""
        QtObject {
            property var seen: []
            property TfTransform tf: TfTransform {
                sourceFrame: "base"; targetFrame: "map"; timeout: 500
            }
            function shown() { return [tf.translation.x, tf.stale].join() }
        }""")

    def send(x: float, stamp: float) -> None:
        frames = {"frame_id": "map", "child_frame_id": "base"}
        broadcaster.send_transform(
            Transform((x, 0.0, 0.0), stamp=Time(round(stamp * 1e9)), **frames)
        )

    def is_live(x: float) -> bool:
        send(x, time.time())
        return bool(root.shown() == f"{x:g},false")

    wait(lambda: is_live(1.0))
    wait(lambda: is_live(2.0))
    sent = time.time()
    wait(lambda: time.time() > sent + 2)
    send(3.0, sent + 0.2)
    wait(lambda: root.shown().startswith("3,"))
    assert root.shown() == "3,true"
    wait(lambda: is_live(4.0))


def test_transforms_of_a_dead_robot_are_stale(live: Bench, robot: Robot, wait: Any) -> None:
    first: Any = live.load(FOLLOWING)
    wait(lambda: first.shown().startswith("true,false"))
    robot.close()
    wait(lambda: first.shown().startswith("true,true"))
    page: Any = live.load("""
        QtObject {
            property var seen: []
            property TfTransform tf: TfTransform {
                sourceFrame: "base"; targetFrame: "map"
                onStaleChanged: seen.push(stale)
            }
            function valid() { return tf.valid }
            function seenLive() { return seen.length }
        }
    """)
    wait(page.valid)
    wait.settled(live.session)
    assert page.seenLive() == 0


def test_transforms_received_without_the_master_are_live(
    live: Bench, robot: Robot, wait: Any
) -> None:
    root: Any = live.load(FOLLOWING)
    wait(lambda: root.shown().startswith("true,false"))
    live.session._set_status(Status(ConnectionState.LOST, "no master"))
    assert root.shown().startswith("true,true")
    wait(lambda: root.shown().startswith("true,false"))
    robot.close()
    wait(lambda: root.shown().startswith("true,true"))


def test_static_transforms_stay_fresh(live: Bench, robot: Robot, wait: Any) -> None:
    root: Any = live.load("""
        QtObject {
            property TfTransform tf: TfTransform {
                sourceFrame: "laser"; targetFrame: "base"; timeout: 200
            }
            function shown() { return [tf.valid, tf.stale, tf.age, tf.translation.x].join() }
        }
    """)
    wait(lambda: root.shown() == "true,false,-1,0.5")
    wait.nothing_happens(0.5)
    assert root.shown() == "true,false,-1,0.5"


def test_the_rate_is_kept(live: Bench, wait: Any) -> None:
    root: Any = live.load("""
        QtObject {
            property TfTransform tf: TfTransform {
                sourceFrame: "base"; targetFrame: "map"; rate: 120
                onMessageChanged: times.push(Date.now())
            }
            property var times: []
            function total() { return times.length }
            function seconds() { return (Date.now() - times[0]) / 1000 }
            function recent() {
                const now = Date.now()
                return times.filter(t => now - t < 1000).length
            }
            property TfBroadcaster sent: TfBroadcaster {
                frameId: "map"; childFrameId: "camera"; rate: 400
            }
        }
    """)
    sender, ended = TransformBroadcaster(live.robot), threading.Event()
    sent: list[float] = []

    def move() -> None:
        x = 0.0
        while not ended.wait(1 / 300):
            x += 0.001
            sender.send_transform(
                Transform((x, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0), Time.now(), "map", "base")
            )

    def on_tf(message: Any) -> None:
        if message.transforms[0].child_frame_id == "camera":
            sent.append(time.monotonic())

    live.robot.create_subscription("/tf", "tf2_msgs/msg/TFMessage", on_tf)
    thread = threading.Thread(target=move)
    thread.start()
    try:
        # In any second; a busy machine has slow ones.
        wait(lambda: root.recent() >= 110)
        wait(lambda: len(sent) > 400)
        assert root.total() <= root.seconds() * 120 + 2
        assert len(sent) <= (time.monotonic() - sent[0]) * 400 * 1.05 + 2
    finally:
        ended.set()
        thread.join()


def test_enabled_frames_and_rate(live: Bench, robot: Robot, wait: Any) -> None:
    root: Any = live.load("""
        QtObject {
            property int n: 0
            property TfTransform tf: TfTransform {
                sourceFrame: "base"; targetFrame: "map"; rate: 5; onMessageChanged: n += 1
            }
            function valid() { return tf.valid }
            function disable() { tf.enabled = false }
            function enable() { tf.enabled = true }
            function other() { tf.sourceFrame = "nothing" }
            function exception() { return tf.message.exception }
        }
    """)
    wait(root.valid)
    before = root.property("n")
    wait.nothing_happens(1)
    assert root.property("n") - before <= 8
    root.disable()
    wait.settled(live.session)
    before = root.property("n")
    wait.nothing_happens(0.3)
    assert root.property("n") == before
    root.other()
    root.enable()
    wait(lambda: root.exception() == "LookupException")
    assert not root.valid()


@pytest.mark.both_qt
def test_lookups(live: Bench, robot: Robot, wait: Any) -> None:
    live.run("TfTransformListener.initialize()")
    wait(lambda: live.run('return TfTransformListener.canTransform("map", "laser")') is True)
    found = live.run('return TfTransformListener.lookUpTransform("map", "laser")')
    assert found["valid"] is True
    assert found["transform"]["translation"]["x"] > 1.5
    assert (found["header"]["frame_id"], found["child_frame_id"]) == ("map", "laser")
    why = live.run('return TfTransformListener.canTransform("map", "moon")')
    assert "moon" in why
    missing = live.run('return TfTransformListener.lookUpTransform("map", "moon")')
    assert (missing["valid"], missing["exception"]) == (False, "LookupException")
    assert "moon" in missing["message"]

    def look_up() -> Any:
        return live.run("""
            const then = new Date(Date.now() - 100), at = ["base", then, "base", Ros2.now(), "map"]
            return TfTransformListener.lookUpTransform(...at, 5000)
        """)

    full = wait(lambda: (found := look_up())["valid"] and found)
    assert 0 < full["transform"]["translation"]["x"] < 0.2


def test_current_reason_is_shown(live: Bench, wait: Any) -> None:
    root: Any = live.load("""
        QtObject {
            property TfTransform tf: TfTransform { sourceFrame: "bace"; targetFrame: "map" }
            function why() { return tf.message.message }
        }
    """)
    wait(lambda: '"map" passed as target does not exist' in root.why())
    robot = Robot(live.robot)
    try:
        wait(lambda: '"bace" passed as source does not exist' in root.why())
    finally:
        robot.close()


def test_waiting_for_a_transform(live: Bench, wait: Any) -> None:
    live.run("TfTransformListener.initialize()")
    broadcaster = StaticTransformBroadcaster(live.robot)
    place = Transform((2.0, 0.0, 0.0), frame_id="base", child_frame_id="arm")
    timer = threading.Timer(0.5, lambda: broadcaster.send_transform(place))
    timer.start()
    found = live.run('return TfTransformListener.lookUpTransform("base", "arm", 0, 20000)')
    assert found["transform"]["translation"]["x"] == 2
    late = live.run('return TfTransformListener.lookUpTransform("base", "leg", 0, 50)')
    assert (late["valid"], late["exception"]) == (False, "TimeoutException")
    timer.join()


@pytest.mark.parametrize("module", ["Ros2 1.0", "Ros 1.0"])
def test_before_init_there_is_nothing_to_look_up(bench: Bench, module: str) -> None:
    bench.module = module
    script = """const l = TfTransformListener
        return [l.canTransform("map", "base"), l.canTransform("map", 0, "base", 0, "odom", 50),
                l.lookUpTransform("map", "base").exception,
                l.lookUpTransform("map", "base").valid]"""
    assert bench.run(script) == ["Uninitialized", "Uninitialized", "Uninitialized", False]


def test_the_tree(live: Bench, robot: Robot, wait: Any) -> None:
    live.run("TfTransformListener.initialize()")
    wait(lambda: live.run('return TfTransformListener.canTransform("map", "laser")') is True)
    frame = live.run('return TfTransformListener.getFrame("laser")')
    assert frame | {"frequency": 0} == {
        "frameId": "laser",
        "parentId": "base",
        "authority": "/robot",
        "translation": {"x": 0.5, "y": 0, "z": 0},
        "rotation": {"x": 0, "y": 0, "z": 0, "w": 1},
        "isStatic": True,
        "children": [],
        "frequency": 0,
    }
    shown = live.run("""
        const l = TfTransformListener
        return [l.getAllFrames().map(f => f.frameId), l.getFrameAuthority("base"),
                l.getFrameAuthority("moon"), l.getTransformAge("map"), l.getTransformAge("laser"),
                l.getChain("map", "laser"), l.getFrame("moon") === undefined]
    """)
    assert shown == [
        ["base", "laser", "map"], "/robot", "", -1, shown[4], ["laser", "base", "map"], True
    ]  # fmt: skip
    # Of static ones, too: the time since their stamp, which is zero.
    assert abs(shown[4] - time.time()) < 60
    assert live.run('return TfTransformListener.getTransformAge("moon")') == -1
    age = live.run('return TfTransformListener.getTransformAge("base")')
    assert 0 <= age < 20


@pytest.mark.parametrize("module", ["Ros2 1.0", "Ros 1.0"])
def test_the_frequency_of_a_frame_falls_to_zero(live: Bench, module: str, wait: Any) -> None:
    live.module = module
    root: Any = live.load("""
        QtObject {
            property TfBuffer b: TfBuffer {}
            function frequency(frame) {
                const f = b.getFrame(frame)
                return f === undefined ? -1 : f.frequency
            }
        }
    """)
    robot = Robot(live.robot)
    try:
        wait(lambda: root.frequency("base") > 10)
    finally:
        robot.close()
    wait(lambda: root.frequency("base") == 0)


def test_namespaces_are_apart(live: Bench, robot: Robot, wait: Any) -> None:
    other = StaticTransformBroadcaster(live.robot, "/arm")
    other.send_transform(Transform((3.0, 0.0, 0.0), frame_id="root", child_frame_id="tip"))
    root: Any = live.load("""
        QtObject {
            property Component buffers: Component { TfBuffer { ns: "/arm/" } }
            property TfBuffer b: buffers.createObject(null)
            property TfTransform tf: TfTransform {
                sourceFrame: "tip"; targetFrame: "root"; Component.onCompleted: buffer = b
            }
            function shown() { return [b.ns, tf.valid, tf.translation.x].join() }
            function other() { return b.canTransform("map", "base") }
            function wrong() { b.ns = "no good"; return b.ns }
            function drop() { b.destroy() }
            function exception() { return tf.message.exception }
        }
    """)
    wait(lambda: root.shown() == "/arm,true,3")
    assert root.other() is not True
    assert root.wrong() == "/arm"
    root.drop()
    wait(lambda: root.exception() == "Uninitialized")


def test_changes_are_notified(live: Bench, robot: Robot, wait: Any) -> None:
    root: Any = live.load("""
        QtObject {
            property int transforms: 0
            property int frames: 0
            property Connections c: Connections {
                target: TfTransformListener
                function onTransformChanged() { transforms += 1 }
                function onFramesChanged() { frames += 1 }
            }
        }
    """)
    wait(lambda: root.property("transforms") > 3 and root.property("frames") > 0)


@pytest.mark.both_qt
@pytest.mark.parametrize("static", ["true", "false"])
def test_broadcasting(live: Bench, static: str, wait: Any) -> None:
    live.load(
        f"""
        QtObject {{
            property TfBroadcaster b: TfBroadcaster {{
                frameId: "map"; childFrameId: "goal"; isStatic: {static}
                translation: Qt.vector3d(1, 2, 3); rotation: Qt.quaternion(0, 0, 0, 1)
            }}
        }}
    """,
        "import QtQuick 2.15",
    )
    from rosglass.tf import TransformListener

    listener = TransformListener(live.robot)
    promise = listener.buffer.lookup_transform_async("map", "goal")
    wait(promise.done)
    found = promise.result()
    assert (found.translation, found.rotation) == ((1.0, 2.0, 3.0), (0.0, 0.0, 1.0, 0.0))
    listener.close()


def test_misuse_is_reported(live: Bench, caplog: Any) -> None:
    for script in (
        "TfTransformListener.canTransform(1, 2)",
        'TfTransformListener.lookUpTransform("a", "b", "noon")',
        'TfTransformListener.lookUpTransform("a", "b", 0, -1)',
    ):
        text = live.run(f"try {{ {script} }} catch (e) {{ return String(e) }}; return ''")
        assert text.startswith("Error:"), script
    root: Any = live.load("""
        QtObject {
            property TfTransform tf: TfTransform { }
            property TfBroadcaster b: TfBroadcaster { }
            Component.onCompleted: {
                tf.rate = NaN; tf.timeout = -1; b.rate = -1; b.rotation = "none"
            }
            function rate() { return tf.rate }
        }
    """)
    assert root.rate() == 62.5
    for word in ("rate nan", "timeout -1", "rate -1", "rotation"):
        assert word in caplog.text
