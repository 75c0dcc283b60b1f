"""RosControls over RViz's 3D view, with data of a robot, used by mouse, wheel and keys."""

from __future__ import annotations

import itertools
import math
from typing import TYPE_CHECKING, Any

import pytest

import rosglass
from rosglass.comm import QoS

if TYPE_CHECKING:
    from collections.abc import Iterator

IMPORTS = "import Ros2 1.0\nimport RosControls 1.0\n"


def item(root: Any, name: str) -> Any:
    from rosglass.rviz.qt5 import QtQuick

    return root.findChild(QtQuick.QQuickItem, name)


class Robot:
    """A robot with a camera, a map, odometry and an emergency stop."""

    def __init__(self, node: Any) -> None:
        self.node, self._count = node, itertools.count()
        self.speeds: list[float] = []
        self.goals: list[Any] = []
        self.stopped = False
        self.image = node.create_publisher("/camera/image_raw", "sensor_msgs/msg/Image")
        self.map = node.create_publisher("/map", "nav_msgs/msg/OccupancyGrid", QoS.latched())
        self.odometry = node.create_publisher("/odom", "nav_msgs/msg/Odometry")
        self.tf = node.create_publisher("/tf", "tf2_msgs/msg/TFMessage")
        self.state = node.create_publisher("/emergency_stop/state", "std_msgs/msg/Bool")
        node.create_subscription(
            "/cmd_vel", "geometry_msgs/msg/Twist", lambda m: self.speeds.append(m.linear.x)
        )
        node.create_subscription("/emergency_stop", "std_msgs/msg/Bool", self._stop)
        node.create_subscription(
            "/move_base_simple/goal", "geometry_msgs/msg/PoseStamped", self.goals.append
        )
        cells = [0] * 100 * 100
        for at in range(100):
            cells[at] = cells[at * 100] = 100
        self.map.publish(
            header={"frame_id": "map", "stamp": node.now()},
            info={"resolution": 0.1, "width": 100, "height": 100,
                  "origin": {"position": {"x": -5, "y": -5}, "orientation": {"w": 1}}},
            data=cells,
        )  # fmt: skip
        node.create_timer(0.1, self.send)

    def _stop(self, message: Any) -> None:
        self.stopped = message.data

    def send(self) -> None:
        count, now = next(self._count), self.node.now()
        # The image's left half is red; a bar moves through the right one.
        row = bytearray(b"\xf0\x00\x00" * 32 + b"\x00\x00\x80" * 32)
        at = 96 + 3 * (count % 32)
        row[at : at + 3] = b"\xff\xff\xff"
        self.image.publish(
            header={"frame_id": "camera", "stamp": now},
            height=48, width=64, encoding="rgb8", step=192, data=bytes(row) * 48,
        )  # fmt: skip
        self.odometry.publish(
            header={"frame_id": "odom", "stamp": now},
            twist={"twist": {"linear": {"x": math.sin(count / 5)}}},
        )
        moved = {"translation": {"x": 1.0}, "rotation": {"w": 1.0}}
        header = {"frame_id": "map", "stamp": now}
        self.tf.publish(
            transforms=[{"header": header, "child_frame_id": "base_link", "transform": moved}]
        )
        self.state.publish(data=self.stopped)


@pytest.fixture
def robot(app: Any, master: str) -> Iterator[Robot]:
    with rosglass.connect(f"ros1://{master.removeprefix('http://').rstrip('/')}", "robot") as node:
        yield Robot(node)


def middle(item: Any) -> tuple[float, float]:
    from rosglass.rviz.qt5 import QtCore

    at = item.mapToScene(QtCore.QPointF(item.width() / 2, item.height() / 2))
    return at.x(), at.y()


@pytest.fixture
def over(robot: Robot, show: Any, wait: Any) -> Any:
    """Show a control over RViz; return its root."""

    def over(control: str, more: str = "") -> Any:
        return show(
            f"{IMPORTS}Item {{ Component.onCompleted: Ros2.init('panel'); {more}\n{control} }}"
        )

    return over


def test_map_is_moved_zoomed_and_takes_goals(
    over: Any, robot: Robot, hand: Any, view: Any, wait: Any
) -> None:
    root = over('MapView { objectName: "map"; x: 20; y: 20; width: 400; height: 400 }')
    shown = item(root, "map")
    wait(lambda: not shown.property("stale") and shown.property("fitted_"))
    camera, before = shown.property("camera"), (view("Yaw"), view("Distance"))
    x, y = middle(item(root, "plane"))
    scale, centre = camera.property("scale"), camera.property("centerX")
    hand.wheel(x, y)
    assert camera.property("scale") == pytest.approx(1.2 * scale)
    hand.drag(x, y + 40, x + 60, y + 40)
    assert camera.property("centerX") == pytest.approx(centre - 60 / camera.property("scale"))
    hand.key("Left")
    assert camera.property("centerX") < centre - 60 / camera.property("scale")
    hand.key("Home")
    assert camera.property("scale") == pytest.approx(scale)
    hand.click(*middle(item(root, "goal")))
    hand.drag(x, y, x, y - 50)
    wait(lambda: robot.goals)
    pose = robot.goals[0].pose
    assert (pose.position.x, pose.position.y) == pytest.approx((0, 0), abs=0.1)
    assert pose.orientation.z == pytest.approx(math.sin(math.pi / 4), abs=0.02)
    assert (view("Yaw"), view("Distance")) == before


def test_plot_is_zoomed_dragged_and_paused(over: Any, hand: Any, view: Any, wait: Any) -> None:
    root = over(
        """Plot { objectName: "plot"; x: 20; y: 20; width: 500; height: 300
        paths: ["/odom:twist.twist.linear.x"] }"""
    )
    plot, before = item(root, "plot"), (view("Yaw"), view("Distance"))
    wait(lambda: not plot.property("stale"))
    hand.wheel(270, 180)
    assert plot.property("window") == pytest.approx(24)
    hand.drag(270, 180, 350, 180)
    wait(lambda: plot.property("paused"))
    assert plot.property("source").property("behind") > 0
    hand.click(*middle(item(root, "pause")))
    wait(lambda: not plot.property("paused"))
    assert (view("Yaw"), view("Distance")) == before


def test_stop_by_click_by_space_bar_and_release(
    over: Any, robot: Robot, hand: Any, wait: Any
) -> None:
    root = over('EmergencyStop { objectName: "stop"; x: 40; y: 80; topic: "/emergency_stop" }')
    stop = item(root, "stop")
    wait(lambda: stop.property("known"))
    hand.click(*middle(item(root, "mushroom")))
    wait(lambda: robot.stopped and stop.property("stopped"))
    hand.move(*middle(item(root, "unlock")))
    hand.press()
    wait(lambda: not robot.stopped)
    hand.release()
    wait(lambda: not stop.property("stopped"))
    # The focus is in RViz's own view, then in the list of its displays.
    for x in (400, -100):
        hand.click(x, 560)
        hand.key("space")
        wait(lambda: robot.stopped)
        stop.release()
        wait(lambda: not stop.property("stopped"))


def test_camera_shows_live_and_lost_images(
    over: Any, robot: Robot, hand: Any, wait: Any, grab: Any
) -> None:
    root = over('CameraView { objectName: "camera"; x: 20; y: 20; width: 320; height: 240 }')
    camera = item(root, "camera")
    wait(lambda: camera.property("live"))

    def colour(x: float, y: float) -> tuple[int, int, int]:
        return grab().pixelColor(round(x), round(y)).getRgb()[:3]

    wait(lambda: colour(60, 140) == (240, 0, 0))
    hand.click(*middle(item(root, "fill")))
    assert camera.property("fillMode") == "crop"
    hand.click(*middle(item(root, "turn")))
    wait(lambda: colour(180, 60) == (240, 0, 0))
    robot.image.close()
    wait(lambda: not camera.property("live"))
    # It must not look live.
    wait(lambda: colour(180, 60) not in {(240, 0, 0), (0, 0, 128)})


def test_colours_change_and_reasons_are_shown_whole(
    over: Any, hand: Any, wait: Any, grab: Any
) -> None:
    root = over(
        """Battery { objectName: "battery"; x: 20; y: 20; width: 160; height: 100; topic: "/odom" }
        ServiceButton { objectName: "button"; x: 440; y: 20; width: 160; service: "/dock" }""",
        "function use(mode) { Theme.mode = mode }",
    )
    wait(lambda: "is not sensor_msgs" in item(root, "battery").property("status"))
    wait(lambda: item(root, "status").property("truncated"))
    panel = grab().pixelColor(26, 60).name()
    root.use("bright")
    wait(lambda: grab().pixelColor(26, 60).name() != panel)
    root.use("dark")
    hand.move(*middle(item(root, "status")))
    # The reason, whole, lies over RViz's view.
    lines = item(root, "status")
    below = middle(lines)[1] + lines.height()
    wait(lambda: grab().pixelColor(445, round(below + 4)).name() == panel)
