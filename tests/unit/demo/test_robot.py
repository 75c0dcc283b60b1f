"""The simulated robot as a node: what it says, what it obeys, what it refuses."""

from __future__ import annotations

import logging
import math
import time
from typing import TYPE_CHECKING, Any

import pytest

pytest.importorskip("cv2", reason="the simulated camera needs the extra `camera`")

from waiting import eventually

from rosglass.comm import Durability, QoS
from rosglass.demo.robot import ReleaseCounter, Robot, RobotOptions
from rosglass.demo.simulation import FLIPPERS, CommandRejectedError
from rosglass.errors import Error

if TYPE_CHECKING:
    from collections.abc import Iterator

    from conftest import StubNode


@pytest.fixture(scope="module")
def alive(stub_node: type[StubNode]) -> Iterator[tuple[StubNode, Robot]]:
    node = stub_node()
    robot = Robot(node)  # type: ignore[arg-type]
    robot.start()
    yield node, robot
    robot.close()


@pytest.fixture
def node(alive: tuple[StubNode, Robot]) -> Iterator[StubNode]:
    yield alive[0]
    alive[0].command("/emergency_stop/release", data=alive[0].last("/emergency_stop/counter").data)


@pytest.fixture
def robot(alive: tuple[StubNode, Robot]) -> Robot:
    return alive[1]


def log_anew(robot: Robot) -> None:
    """Let the robot log the next refused command, as if the last one were long ago."""
    robot.logged_at = -math.inf


def test_every_topic_is_sent_in_ros_messages(node: StubNode) -> None:
    for topic, recorder in node.publishers.items():
        eventually(lambda recorder=recorder: recorder.sent)
        assert recorder.sent[0] is not None, topic


def test_latched_topics_are_transient_local(node: StubNode) -> None:
    for topic in ("/map", "/tf_static", "/emergency_stop/state"):
        qos = node.publishers[topic].qos
        assert isinstance(qos, QoS)
        assert qos.durability is Durability.TRANSIENT_LOCAL, topic


def test_stamps_are_now(node: StubNode) -> None:
    for topic in ("/odom", "/scan", "/camera/image_raw", "/imu"):
        stamp = node.last(topic).header.stamp
        assert abs(stamp.sec + stamp.nanosec * 1e-9 - time.time()) < 0.5, topic


def test_raw_and_compressed_images_are_the_same(node: StubNode) -> None:
    import cv2
    import numpy as np

    raw = node.last("/camera/image_raw")
    assert (raw.width, raw.height, raw.encoding, raw.step) == (640, 480, "rgb8", 1920)
    packed = node.last("/camera/image_raw/compressed")
    assert packed.format == "rgb8; jpeg compressed bgr8"
    picture = cv2.cvtColor(
        cv2.imdecode(np.asarray(packed.data), cv2.IMREAD_COLOR), cv2.COLOR_BGR2RGB
    )
    same = next(
        m
        for m in reversed(node.publishers["/camera/image_raw"].sent)
        if m.header.stamp == packed.header.stamp
    )
    plain = np.asarray(same.data).reshape(480, 640, 3)
    assert np.abs(plain.astype(int) - picture).mean() < 6


def test_images_are_not_compressed_without_subscribers(node: StubNode) -> None:
    recorder = node.publishers["/camera/image_raw/compressed"]
    recorder.listeners = 0
    for _ in range(2):  # what was begun before is over
        node.last("/camera/image_raw")
    count = len(recorder.sent)
    node.last("/camera/image_raw")
    node.last("/camera/image_raw")
    recorder.listeners = 1
    assert len(recorder.sent) == count


def test_frames_join_map_and_every_part(node: StubNode) -> None:
    parents = {
        transform.child_frame_id: transform.header.frame_id
        for message in (node.last("/tf"), node.publishers["/tf_static"].sent[0])
        for transform in message.transforms
    }
    for frame in ("camera_optical_frame", "laser", "imu_link", *FLIPPERS):
        while frame != "map":
            frame = parents[frame]  # noqa: PLW2901 - climbing up


def test_it_drives_and_stops_when_commands_cease(node: StubNode, robot: Robot) -> None:
    def odometry() -> float:
        node.command("/cmd_vel", linear={"x": 0.3})
        return float(node.last("/odom").twist.twist.linear.x)

    eventually(lambda: odometry() > 0.2)
    assert robot.state.speed > 0.1
    eventually(lambda: robot.state.speed == 0.0)


def test_stop_is_confirmed_at_once_and_holds(node: StubNode, robot: Robot, lives_on: Any) -> None:
    confirmations = node.publishers["/emergency_stop/state"].sent
    count = len(confirmations)
    node.command("/emergency_stop", data=True)
    assert len(confirmations) > count
    assert confirmations[-1].data is True
    for _ in range(8):
        node.command("/cmd_vel", linear={"x": 0.3})
        lives_on(robot, 0.03)
    assert robot.state.speed == 0.0
    assert node.last("/diagnostics").status[0].message == "emergency stop latched"


def release(node: StubNode, number: int | None = None) -> None:
    if number is None:
        number = node.last("/emergency_stop/counter").data
    node.command("/emergency_stop/release", data=number)


def test_release_names_a_number_published_after_the_stop(node: StubNode, robot: Robot) -> None:
    eventually(lambda: node.publishers["/emergency_stop/counter"].sent)
    node.command("/emergency_stop", data=True)
    old = node.last("/emergency_stop/counter").data
    node.command("/emergency_stop", data=True)  # another operator presses it while it is latched
    release(node, old)
    assert robot.state.emergency_stop, "what releases the first stop does not undo the second"
    node.command("/emergency_stop", data=False)
    assert robot.state.emergency_stop, "an old false may be meant for an earlier stop"
    release(node)
    assert not robot.state.emergency_stop
    assert node.last("/emergency_stop/state").data is False
    release(node)  # repeated until the cockpit receives the state
    assert not robot.state.emergency_stop


def test_release_that_is_too_old_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    releases = ReleaseCounter()
    first = releases.count()
    releases.check(first)
    with monkeypatch.context() as patch:
        patch.setattr("rosglass.demo.robot._RELEASE_TIMEOUT_S", 0.0)
        with pytest.raises(CommandRejectedError, match="in the last 0 s"):
            releases.check(first)
    second = releases.count()
    releases.check(second)
    releases.invalidate()
    with pytest.raises(CommandRejectedError, match="after the last stop"):
        releases.check(second)


@pytest.mark.parametrize(
    ("fields", "named"),
    [
        ({"linear": {"x": math.nan}}, "linear.x"),
        ({"angular": {"z": math.inf}}, "angular.z"),
        ({"linear": {"x": 1e9}}, "linear.x"),
        ({"linear": {"y": 0.5}}, "another component"),
        ({"angular": {"x": math.nan}}, "another component"),
    ],
)
def test_garbage_is_logged_and_does_not_move_it(
    node: StubNode,
    robot: Robot,
    caplog: pytest.LogCaptureFixture,
    fields: dict[str, Any],
    named: str,
    lives_on: Any,
) -> None:
    log_anew(robot)
    eventually(lambda: robot.state.speed == 0.0)
    with caplog.at_level(logging.WARNING, "rosglass.demo"):
        node.command("/cmd_vel", **fields)
        node.command("/cmd_vel", **fields)
    assert len(caplog.records) == 1, "one line, not one for each message"
    assert "/cmd_vel" in caplog.text
    assert named in caplog.text
    lives_on(robot, 0.1)
    assert robot.state.speed == 0.0


def test_malformed_bytes_are_refused(
    node: StubNode, robot: Robot, caplog: pytest.LogCaptureFixture
) -> None:
    log_anew(robot)
    type_, callback = node.commands["/cmd_vel"]
    with caplog.at_level(logging.WARNING, "rosglass.demo"):
        callback(type_.decode(b"\x00\x01\x00\x00\x01", wire="cdr"))
    assert "/cmd_vel" in caplog.text


def test_flippers_and_lamp(node: StubNode, robot: Robot, lives_on: Any) -> None:
    node.command("/flashlight", data=True)
    assert node.publishers["/flashlight/state"].sent[-1].data is True
    node.command("/flashlight", data=False)
    node.command("/flipper_controller/commands", data=[0.5, 0.5, 0.3, 0.3])
    eventually(lambda: robot.state.flippers == (0.5, 0.5, 0.3, 0.3))
    message = node.last("/joint_states")
    assert tuple(message.name) == FLIPPERS
    node.command("/flipper_controller/commands", data=[9.0] * 4)
    lives_on(robot, 0.1)
    assert robot.state.flippers == (0.5, 0.5, 0.3, 0.3)


def test_blocked_network_does_not_stop_the_simulation(
    node: StubNode, robot: Robot, lives_on: Any
) -> None:
    stuck = [node.publishers["/camera/image_raw"], node.publishers["/odom"]]
    for recorder in stuck:
        recorder.blocked.clear()
    try:
        lives_on(robot, 0.1)  # the threads that send stand by then
        lives_on(robot, 0.5)
        eventually(lambda: node.command("/cmd_vel", linear={"x": 0.2}) or robot.state.speed > 0.05)
    finally:
        for recorder in stuck:
            recorder.blocked.set()
    eventually(lambda: robot.state.speed == 0.0)


class Turning:
    """A goal of the action /turn."""

    is_cancel_requested = False

    def __init__(self, theta: float) -> None:
        self.goal = type("Goal", (), {"theta": theta})
        self.left: list[float] = []

    def publish_feedback(self, feedback: dict[str, float]) -> None:
        self.left.append(feedback["remaining"])


def test_it_turns_to_a_heading(node: StubNode, robot: Robot) -> None:
    wanted = robot.state.yaw + 0.3
    goal = Turning(wanted)
    result = node.services["/turn"](goal)
    assert abs(math.remainder(robot.state.yaw - wanted, math.tau)) < 0.1
    assert result["delta"] == pytest.approx(0.3, abs=0.1)
    assert goal.left[0] == pytest.approx(0.3, abs=0.05)


def test_no_goal_overrides_the_emergency_stop(node: StubNode, robot: Robot) -> None:
    node.command("/emergency_stop", data=True)
    with pytest.raises(Error, match="emergency stop"):
        node.services["/turn"](Turning(robot.state.yaw + 1.0))
    with pytest.raises(Error, match="not an angle"):
        node.services["/turn"](Turning(math.nan))


def test_flashlight_is_a_service_too(node: StubNode, robot: Robot) -> None:
    request = type("Request", (), {"data": True})
    assert node.services["/flashlight/set"](request) == {"success": True, "message": "on"}
    assert robot.state.flashlight


def test_highest_speed_is_a_parameter(node: StubNode, robot: Robot) -> None:
    node.parameters.set(max_speed=0.1)
    eventually(lambda: node.command("/cmd_vel", linear={"x": 1.0}) or robot.state.speed > 0.05)
    assert robot.state.speed <= 0.11
    node.parameters.set(max_speed=1.2)


def test_robot_that_fails_ends_instead_of_driving_on(stub_node: type[StubNode]) -> None:
    node = stub_node()
    robot = Robot(node, RobotOptions(raw=False, compressed=False))  # type: ignore[arg-type]
    node.publishers["/odom"].publish = None  # type: ignore[assignment]
    robot.start()
    try:
        assert robot.wait(30)
    finally:
        robot.close()


@pytest.mark.parametrize("options", [{"fps": 0.0}, {"fps": math.nan}, {"jpeg_quality": 0}])
def test_impossible_options_are_refused(options: dict[str, Any]) -> None:
    with pytest.raises(Error, match="expected"):
        RobotOptions(**options)
