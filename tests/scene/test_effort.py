"""The display Effort."""

from __future__ import annotations

import itertools
import math
import time
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pytest

from rosglass.scene.render.drawing import Lines, Mesh
from rosglass.scene.render.mesh_shapes import CONE

if TYPE_CHECKING:
    from conftest import SceneBench

URDF = """<robot name="arm">
  <link name="base"/><link name="upper"/><link name="lower"/><link name="wheel"/>
  <link name="free"/><link name="rail"/>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/>
    <axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="10" velocity="1"/></joint>
  <joint name="elbow" type="revolute"><parent link="upper"/><child link="lower"/>
    <axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="4" velocity="1"/></joint>
  <joint name="drive" type="continuous"><parent link="base"/><child link="wheel"/>
    <axis xyz="0 0 1"/><limit effort="2" velocity="1"/></joint>
  <joint name="caster" type="continuous"><parent link="base"/><child link="free"/></joint>
  <joint name="lift" type="prismatic"><parent link="base"/><child link="rail"/>
    <limit lower="0" upper="1" effort="100" velocity="1"/></joint>
</robot>"""
STATES = "sensor_msgs/JointState"


class Robot:
    """Publishes a description, joint states and the frames of the links."""

    def __init__(self, bench: SceneBench) -> None:
        from rosglass.comm import QoS

        self.bench = bench
        self.descriptions = bench.robot.create_publisher(
            "/robot_description", "std_msgs/String", QoS.latched()
        )
        self.states = bench.robot.create_publisher("/joint_states", STATES)

    def place(self, *links: str, prefix: str = "") -> None:
        for at, link in enumerate(links):
            self.bench.place(f"{prefix}{link}", at=(float(at), 0.0, 0.0))

    def send(self, efforts: dict[str, float], **fields: Any) -> None:
        self.bench.wait(self.states.subscription_count)
        self.states.publish(
            {"name": list(efforts), "effort": np.array(list(efforts.values())), **fields}
        )


@pytest.fixture
def robot(bench: SceneBench) -> Robot:
    return Robot(bench)


def add(bench: SceneBench, robot: Robot, urdf: str = URDF, **settings: Any) -> Any:
    """Show the display, and wait for the description."""
    display = bench.load().scene.add("Effort", topic="/joint_states", **settings)
    robot.descriptions.publish({"data": urdf})
    bench.wait(lambda: "waiting" not in display.statusText and "URDF: " in display.statusText)
    return display


class Arc(NamedTuple):
    """The drawing of a joint's effort, in the fixed frame.

    Attributes:
        color: RGBA bytes.
        centre: Of the circle.
        first, second: The first points of the arc.
        head, tip: From where to where its head is.
        lines: What draws it, with others.
    """

    color: list[int]
    centre: Any
    first: Any
    second: Any
    head: Any
    tip: Any
    lines: Any

    @property
    def radius(self) -> float:
        return float(np.linalg.norm(self.first - self.centre))


def arcs(display: Any) -> list[tuple[str, Arc]]:
    """Return what is drawn, by joint; of a history the oldest first."""
    found: list[tuple[str, Arc]] = []
    drawn = [(one, pose) for one, pose, _ in display.root.drawables()]
    for (lines, pose), (heads, other) in zip(drawn[::2], drawn[1::2], strict=True):
        assert (type(lines), type(heads), heads.shape) == (Lines, Mesh, CONE)
        assert (pose == other).all()
        assert lines.owner.names == heads.owner.names

        def at(point: Any, pose: Any = pose) -> Any:
            return (pose @ [*point[:3], 1])[:3]

        for number, name in enumerate(lines.owner.names):
            rows = lines.rows[29 * number : 29 * number + 29]
            matrix = heads.instances["matrix"][number].reshape(4, 4).T
            first, second, opposite = at(rows["start"][0]), at(rows["end"][0]), rows["start"][16]
            arc = Arc(
                rows["first"][0].tolist(),
                (first + at(opposite)) / 2,
                first,
                second,
                at(matrix @ (0, 0, 0, 1)),
                at(matrix @ (0, 0, 1, 1)),
                lines,
            )
            found.append((name, arc))
    return found


def test_an_effort_is_an_arc_as_large_as_its_share_of_the_limit(
    bench: SceneBench, robot: Robot
) -> None:
    display = add(bench, robot)
    assert "URDF: Robot model parsed Ok" in display.statusText
    assert display.joints == ["drive", "elbow", "shoulder"]
    assert (display.maxEffort("shoulder"), display.maxEffort("caster")) == (10.0, 0.0)
    robot.place("upper", "lower", "wheel")
    robot.send({"shoulder": 5.0, "elbow": -8.0, "drive": 0.0, "lift": 50.0})
    bench.wait(lambda: len(arcs(display)) == 3)
    assert display.statusLevel == "ok", display.statusText
    by_joint = dict(arcs(display))
    shoulder, elbow = by_joint["shoulder"], by_joint["elbow"]
    # RViz's radius: 5 cm, and half a metre for the share of the limit and 5 %.
    assert shoulder.radius == pytest.approx(0.05 + 0.55 / 2)
    assert shoulder.centre == pytest.approx([0, 0, 0], abs=1e-6)
    assert elbow.centre == pytest.approx([1, 0, 0])
    assert (shoulder.lines.width, shoulder.lines.in_metres) == (pytest.approx(0.02), True)
    assert elbow.radius == pytest.approx(0.05 + 1.05 / 2), "no more than 100 %"
    assert elbow.color == [255, 0, 0, 255], "red at the limit"
    assert by_joint["drive"].radius == pytest.approx(0.05 + 0.05 / 2)
    at = shoulder.lines.owner.names.index("shoulder")
    assert shoulder.lines.owner.describe(29 * at + 28) == [
        ("Joint", "shoulder"),
        ("Effort", "5 Nm"),
        ("Max Effort", "10 Nm"),
    ]
    assert display.effort("elbow") == -8.0
    assert math.isnan(display.effort("neck"))
    display.scale, display.width, display.alpha = 2.0, 0.1, 0.5
    shoulder = dict(arcs(display))["shoulder"]
    assert shoulder.radius == pytest.approx(0.05 + 0.55)
    assert (shoulder.lines.width, shoulder.lines.opaque) == (pytest.approx(0.1), False)
    display.setJointEnabled("shoulder", False)
    assert len(arcs(display)) == 2
    assert not display.isJointEnabled("shoulder")


@pytest.mark.parametrize("axis", [(0, 0, 1), (0, 0, -1), (1, 0, 0), (0, -1, 0), (1, 1, 0)])
@pytest.mark.parametrize("effort", [5.0, -5.0])
def test_the_head_points_where_the_torque_turns(
    bench: SceneBench, robot: Robot, axis: tuple[int, int, int], effort: float
) -> None:
    words = " ".join(map(str, axis))
    display = add(bench, robot, URDF.replace('<axis xyz="0 1 0"/>', f'<axis xyz="{words}"/>'))
    robot.place("upper", "lower")
    robot.send({"elbow": effort})
    bench.wait(lambda: len(arcs(display)) == 1)
    ((_, arc),) = arcs(display)
    turning = np.cross(arc.head - arc.centre, arc.tip - arc.head)
    along = turning / np.linalg.norm(turning)
    assert along == pytest.approx(np.sign(effort) * np.array(axis) / np.linalg.norm(axis), abs=1e-5)
    # The arc begins at the head, and lies on its other side.
    assert arc.first == pytest.approx(arc.head, abs=1e-5)
    assert (arc.second - arc.first) @ (arc.tip - arc.head) < 0


def test_joints_without_drawing_are_in_the_status(
    bench: SceneBench, robot: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    from rosglass.scene.displays import effort

    monkeypatch.setattr(effort, "_COMBINED_S", 0.0)
    display = add(bench, robot)
    robot.place("upper", "wheel")
    robot.send({"shoulder": float("nan"), "elbow": 1.0, "drive": float("-inf"), "caster": 1.0})
    bench.wait(lambda: "Joint elbow" in display.statusText)
    assert display.statusLevel == "error"
    lines = display.status_lines
    assert lines["Joint shoulder"] == ("error", "effort[0] is nan")
    assert lines["Joint drive"] == ("error", "effort[2] is -inf")
    assert lines["Joint elbow"].text.startswith("no transform from [lower]: ")
    assert lines["Joint caster"] == (
        "warn",
        "the description has no <limit>: an effort above 0 is needed",
    )
    assert arcs(display) == []
    robot.place("upper", "lower", "wheel")
    robot.send({"shoulder": 1.0, "elbow": 1.0, "drive": 1.0})
    bench.wait(lambda: len(arcs(display)) == 3)
    assert display.statusLevel == "ok", display.statusText
    robot.send({"neck": 1.0})
    bench.wait(lambda: "Joints: " in display.statusText)
    expected = "name has no revolute or continuous joint of the robot 'arm'"
    assert display.status_lines["Joints"] == ("warn", expected)
    assert arcs(display) == []


def test_limit_of_zero_is_a_warning(bench: SceneBench, robot: Robot) -> None:
    display = add(bench, robot, URDF.replace('effort="10"', 'effort="0"'))
    assert display.joints == ["drive", "elbow"]
    robot.place("upper")
    robot.send({"shoulder": 1000.0})
    bench.wait(lambda: "Joint shoulder" in display.statusText)
    text = 'the description has <limit effort="0">: an effort above 0 is needed'
    assert display.status_lines["Joint shoulder"] == ("warn", text)
    assert arcs(display) == []


def test_a_broken_description_is_an_error_until_a_good_one_comes(
    bench: SceneBench, robot: Robot
) -> None:
    display = add(bench, robot, "<robot")
    assert display.statusLevel == "error"
    assert "URDF: robot_description:1" in display.statusText
    robot.place("upper")
    robot.send({"shoulder": 5.0})
    bench.wait(lambda: display.received == 1)
    assert arcs(display) == []
    robot.descriptions.publish({"data": URDF})
    bench.wait(lambda: len(arcs(display)) == 1)
    assert display.statusLevel == "ok", display.statusText


def test_efforts_are_where_the_joints_were_at_their_time(bench: SceneBench, robot: Robot) -> None:
    display = add(bench, robot)

    def move(second: int) -> None:
        bench.move("upper", (float(second), 0.0, 0.0), second)

    def stamped(nanoseconds: int) -> dict[str, Any]:
        return {"stamp": {"sec": nanoseconds // 10**9, "nanosec": nanoseconds % 10**9}}

    move(100)
    bench.wait(lambda: "upper" in display.scene.frames())
    robot.send({"shoulder": 5.0}, header=stamped(100_500_000_000))
    bench.wait(lambda: display.received == 1)
    assert arcs(display) == []
    move(101)
    bench.wait(lambda: len(arcs(display)) == 1)
    assert arcs(display)[0][1].centre == pytest.approx([100.5, 0, 0])
    # One that is older than all transforms is not shown as if it was of now.
    robot.send({"shoulder": 5.0}, header=stamped(2_000_000_000))
    later = itertools.count(102)
    bench.wait(lambda: move(next(later)) or "no transform from [upper]" in display.statusText)
    assert display.statusLevel == "error"


def test_joints_of_several_publishers_are_shown_together(
    bench: SceneBench, robot: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    from rosglass.scene.displays import effort

    display = add(bench, robot)
    robot.place("upper", "lower", "wheel")
    robot.send({"shoulder": 5.0})
    robot.send({"elbow": 1.0})
    # A gripper that measures no efforts.
    robot.send({}, name=["finger"])
    bench.wait(lambda: len(arcs(display)) == 2 and display.received == 3)
    assert display.statusLevel == "ok", display.statusText
    assert (display.effort("shoulder"), display.effort("elbow")) == (5.0, 1.0)
    robot.send({"elbow": 2.0})
    bench.wait(lambda: display.effort("elbow") == 2.0)
    assert len(arcs(display)) == 2
    # One that is not sent any more is not shown any more.
    monkeypatch.setattr(effort, "_COMBINED_S", 0.0)
    robot.send({"elbow": 3.0})
    bench.wait(lambda: display.effort("elbow") == 3.0)
    assert len(arcs(display)) == 1


def test_states_at_a_high_rate_are_drawn_30_times_per_second(
    bench: SceneBench, robot: Robot
) -> None:
    display = add(bench, robot)
    robot.place("upper")
    robot.send({"shoulder": 0.0})
    bench.wait(lambda: len(arcs(display)) == 1)
    drawn = []
    show = display.show
    display.show = lambda *given: drawn.append(time.monotonic()) or show(*given)
    for number in range(300):
        robot.send({"shoulder": number / 100})
        bench.wait.settled(bench.session)
    bench.wait(lambda: display.effort("shoulder") == 2.99)
    assert display.received > len(drawn)
    assert min(np.diff(drawn)) > 0.025
    del display.show


def test_joint_states_that_stop_fade(
    bench: SceneBench, robot: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    from rosglass.scene.displays import topic_display as module

    monkeypatch.setattr(module, "_CONTINUOUS_S", 0.5)
    display = add(bench, robot)
    robot.place("upper")
    robot.send({"shoulder": 5.0})
    bench.wait(lambda: len(arcs(display)) == 1)
    bench.wait(lambda: display.root.alpha < 1.0)
    assert "Data: no message for " in display.statusText
    robot.send({"shoulder": 5.0})
    bench.wait(lambda: display.root.alpha == 1.0)
    assert display.statusLevel == "ok", display.statusText


def test_another_robot_has_other_limits(bench: SceneBench, robot: Robot) -> None:
    display = add(bench, robot)
    robot.place("upper")
    robot.send({"shoulder": 5.0})
    bench.wait(lambda: len(arcs(display)) == 1)
    robot.descriptions.publish({"data": URDF.replace('effort="10"', 'effort="5"')})
    bench.wait(lambda: arcs(display)[0][1].radius == pytest.approx(0.05 + 1.05 / 2))
    robot.descriptions.publish({"data": "<robot"})
    bench.wait(lambda: arcs(display) == [])
    assert display.statusLevel == "error"


def test_a_prefix_names_the_frames_and_messages_have_a_history(
    bench: SceneBench, robot: Robot
) -> None:
    display = add(bench, robot, tfPrefix="/r1/", historyLength=2)
    robot.place("upper", prefix="r1/")
    for effort in (1.0, 5.0, 10.0):
        robot.send({"shoulder": effort})
    bench.wait(lambda: display.received == 3 and len(arcs(display)) == 2)
    found = [arc.radius for _, arc in arcs(display)]
    assert found == pytest.approx([0.05 + 0.55 / 2, 0.05 + 1.05 / 2])


def test_settings_and_joints_are_written_for_either_rviz(bench: SceneBench) -> None:
    view = bench.load()
    for ros, name in ((1, "robot_description"), (2, "/robot_description")):
        class_id = {1: "rviz/Effort", 2: "rviz_default_plugins/Effort"}[ros]
        topic: Any = "/joints" if ros == 1 else {"Value": "/joints", "Depth": 7}
        saved = {
            "Class": class_id,
            "Alpha": 0.5,
            "Width": 0.1,
            "Scale": 3,
            "History Length": 4,
            "Robot Description": name,
            "TF Prefix": "r1",
            "Joints": {"elbow": {"Value": False}},
            "Topic": topic,
        }
        display = view.scene.add("Effort")
        assert display.load_settings(saved) == []
        assert (display.alpha, display.width, display.scale) == (0.5, pytest.approx(0.1), 3.0)
        assert (display.historyLength, display.robotDescription) == (4, name)
        assert (display.tfPrefix, display.topic) == ("r1", "/joints")
        assert not display.isJointEnabled("elbow")
        display.setJointEnabled("wrist", False)
        kept = display.save_settings(saved, ros)
        assert kept["Joints"] == {"elbow": {"Value": False}, "wrist": {"Value": False}}
        assert kept["Robot Description"] == name
        assert (kept["Topic"] if ros == 1 else kept["Topic"]["Value"]) == "/joints"


def test_the_panel_lists_joints_with_their_efforts(bench: SceneBench, robot: Robot) -> None:
    from rosglass.scene.app.panel_models import DisplaysModel

    display = add(bench, robot)
    robot.place("upper", "lower", "wheel")
    robot.send({"shoulder": 5.0})
    bench.wait(lambda: len(arcs(display)) == 1)
    model = DisplaysModel()
    model.view = bench.view

    def row(label: str) -> int:
        model.refresh()
        return next(n for n, one in enumerate(model.rows) if one.label == label)

    for label in ("Effort", "Joints", "shoulder"):
        model.toggle(row(label))
    rows = {one.label: one for one in model.rows[row("shoulder") :]}
    assert [rows[one].value for one in ("Effort", "Max Effort")] == ["5 Nm", "10 Nm"]
    assert rows["shoulder"].checked
    model.setEnabled(row("shoulder"), False)
    assert arcs(display) == []
    assert not display.isJointEnabled("shoulder")


def test_the_dialog_offers_it_for_joint_states(bench: SceneBench, robot: Robot) -> None:
    from rosglass.scene.app.panel_models import DisplaysModel

    view = bench.load()
    model = DisplaysModel()
    model.view = view
    wanted = {"topic": "/joint_states", "type": "sensor_msgs/JointState", "display": "Effort"}
    bench.wait(lambda: wanted in [dict(one) for one in model.suggestions()])
    assert "Effort" in model.types()
    assert robot.states is not None


def test_in_ros1_the_description_is_a_parameter(
    ros1_bench: SceneBench, monkeypatch: pytest.MonkeyPatch
) -> None:
    from rosglass.scene.displays import effort

    monkeypatch.setattr(effort, "_RETRY_MS", 200)
    bench = ros1_bench
    display = bench.load().scene.add(
        "Effort", topic="/joint_states", robotDescription="arm_description"
    )
    bench.wait(lambda: display.statusLevel == "error")
    assert "URDF: parameter /arm_description is not set on" in display.statusText
    bench.robot.parameter_server.set("arm_description", URDF)  # type: ignore[attr-defined]
    bench.wait(lambda: "Robot model parsed Ok" in display.statusText)
    robot = Robot(bench)
    robot.place("upper")
    robot.send({"shoulder": 5.0})
    bench.wait(lambda: len(arcs(display)) == 1)
    assert display.statusLevel == "ok", display.statusText
