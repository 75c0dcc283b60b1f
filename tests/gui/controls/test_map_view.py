"""The control MapView: its layers, camera and goals."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from map_messages import grid, transform

from rosglass.comm import QoS

if TYPE_CHECKING:
    from collections.abc import Callable

GRID = "nav_msgs/msg/OccupancyGrid"
pytestmark = pytest.mark.both_qt


class Robot:
    """The topics of a robot with a map."""

    def __init__(self, node: Any) -> None:
        self.node = node
        self.map = node.create_publisher("/map", GRID, QoS.latched())
        self.static = node.create_publisher("/tf_static", "tf2_msgs/msg/TFMessage", QoS.latched())

    def start(self, cells: Any = None, **more: Any) -> None:
        """Publish a map of 6 m x 4 m, and where the robot is."""
        self.static.publish(transforms=[transform("map", "base_link", 2.0)])
        self.map.publish(grid(np.zeros((40, 60)) if cells is None else cells, **more))


@pytest.fixture
def robot(controls: Any) -> Robot:
    return Robot(controls.robot)


def layer(view: Any, kind: str) -> Any:
    """Return the first layer of a kind."""
    return next(one for one in view.property("scene").layers if kind == one.KIND)


def pixel(controls: Any, view: Any, x: float, y: float) -> Any:
    """Return the colour that a point in metres has on the screen."""
    plane = controls.find("plane")
    at = plane.mapToScene(view.property("camera").toScreen(x, y))
    return controls.grab().pixelColor(round(at.x()), round(at.y()))


def is_complete(view: Any) -> bool:
    """Return whether all tiles of the map are shown."""
    return bool(layer(view, "map").layer.model.rows) and layer(view, "map").layer.is_complete


def test_map_is_found_by_type_fitted_and_painted(
    controls: Any, robot: Robot, wait: Callable[..., None]
) -> None:
    cells = np.zeros((40, 60))
    cells[:, :5] = 100  # a wall in the west
    cells[:5, 30:] = -1
    robot.start(cells)
    view = controls.show('MapView { anchors.fill: parent; colors: "map"; tools: false }', 640, 480)
    wait(lambda: view.property("scene").layers and layer(view, "map").grid)
    wait(lambda: is_complete(view))
    wait(lambda: not view.property("stale"))
    assert view.property("status") == ""
    assert view.property("scene").property("fixedFrame") == "map"
    assert view.property("camera").property("centerX") == pytest.approx(3.0)
    assert pixel(controls, view, 0.25, 3.5).lightness() < 30
    assert pixel(controls, view, 3.0, 3.5).lightness() > 225
    assert abs(pixel(controls, view, 5.0, 0.2).red() - 0x70) < 8
    assert view.property("scene").property("robotX") == pytest.approx(2.0)


def test_updates_change_only_their_tiles(
    controls: Any, robot: Robot, wait: Callable[..., None]
) -> None:
    updates = controls.robot.create_publisher("/map_updates", "map_msgs/msg/OccupancyGridUpdate")
    robot.start(np.zeros((1100, 1100)))
    view = controls.show('MapView { anchors.fill: parent; colors: "map" }')
    wait(updates.subscription_count)
    wait(lambda: is_complete(view))
    tiles = layer(view, "map").grid.tiles
    before = [versions.copy() for versions in tiles._versions]
    data = np.full((3, 2), 100, np.int8)
    updates.publish(header={"frame_id": "map"}, x=1000, y=700, width=2, height=3, data=data.ravel())
    wait(lambda: tiles.value_at(100.05, 70.05) == 100)
    changed = np.argwhere(tiles._versions[0] != before[0]).tolist()
    assert changed == [[1, 1]]
    # A wall of one cell is seen from far.
    assert tiles._cells[-1].max() == 101
    wait(lambda: is_complete(view))
    updates.publish(header={"frame_id": "map"}, x=1099, y=0, width=2, height=3, data=data.ravel())
    wait(lambda: "beyond the map of 1100 x 1100 cells" in view.property("status"))
    assert tiles.value_at(100.05, 70.05) == 100


@pytest.mark.parametrize(
    ("change", "named"),
    [
        ({"resolution": 0.0}, "info.resolution is 0"),
        ({"resolution": math.nan}, "info.resolution is nan"),
        ({"width": 30_000, "height": 30_000}, "30000 x 30000 cells are more than"),
        ({"width": 7}, "the map has 2400 cells, expected 7 x 40 = 280"),
        ({"origin": {"position": {"x": math.inf}}}, "info.origin has a number that is not finite"),
    ],
)
def test_bad_maps_are_named_and_the_rest_lives_on(
    controls: Any, robot: Robot, wait: Callable[..., None], change: Any, named: str
) -> None:
    robot.start()
    view = controls.show("MapView { anchors.fill: parent }")
    wait(lambda: is_complete(view))
    bad = grid(np.zeros((40, 60)))
    bad["info"] |= change
    robot.map.publish(bad)
    wait(lambda: named in view.property("status"))
    assert layer(view, "map").grid.tiles.columns == 60, "what was shown before stays"
    robot.map.publish(grid(np.zeros((10, 10))))
    wait(lambda: view.property("status") == "")
    assert layer(view, "map").grid.tiles.columns == 10


def test_map_with_a_quaternion_of_zeros_is_shown_and_named(
    controls: Any, robot: Robot, wait: Callable[..., None]
) -> None:
    robot.start(w=0.0)
    view = controls.show("MapView { anchors.fill: parent }")
    wait(lambda: "orientation is 0, 0, 0, 0" in view.property("status"))
    wait(lambda: is_complete(view))


def test_scan_waits_for_its_transform_and_is_drawn(
    controls: Any, robot: Robot, wait: Callable[..., None]
) -> None:
    robot.start()
    laser = controls.robot.create_publisher("/scan", "sensor_msgs/msg/LaserScan")
    view = controls.show('MapView { anchors.fill: parent; colors: "map"; tools: false }')
    wait(laser.subscription_count)
    scan = {
        "header": {"frame_id": "laser"},
        "angle_min": 0.0,
        "angle_increment": 0.01,
        "range_max": 10.0,
        "ranges": [1.0, math.inf, math.nan, 2.0],
    }
    laser.publish(scan)
    wait(lambda: "no transform from laser to map" in view.property("status"))
    frames = [transform("map", "base_link", 2.0), transform("base_link", "laser", 0.5)]
    robot.static.publish(transforms=frames)
    wait(lambda: len(layer(view, "scan").shape.points) == 2 if layer(view, "scan").shape else False)
    wait(lambda: view.property("status") == "")
    color = pixel(controls, view, 3.5, 0.0)
    assert color.red() > color.blue() + 60
    wait(lambda: layer(view, "scan").property("stale"))
    wait(lambda: "/scan: " in view.property("status"))


def test_camera_keeps_the_point_under_the_pointer_and_its_limits(controls: Any) -> None:
    from rosglass.controls.map_camera import MapCamera

    camera = MapCamera()
    camera.width, camera.height = 800.0, 600.0
    camera.rotation = 0.3
    camera.lookAt(4_000_000.0, -500_000.0)
    before = camera.toMap(100, 50)
    camera.zoomBy(3.0, 100, 50)
    camera.rotateBy(0.7, 100, 50)
    after = camera.toMap(100, 50)
    assert (after.x(), after.y()) == pytest.approx((before.x(), before.y()), abs=1e-6)
    camera.zoomBy(1e9, 0, 0)
    assert camera.span == pytest.approx(0.1)
    camera.zoomBy(1e-9, 0, 0)
    assert camera.span == pytest.approx(10_000)
    camera.scale = math.nan
    camera.centerX = math.inf
    camera.zoomBy(math.nan, 0, 0)
    assert math.isfinite(camera.scale + camera.centerX)
    camera.rotation = 0.0
    camera.fit(0, 0, 80, 20)
    x, y = camera.to_screen().apply(80, 20)
    assert (x, y) == (pytest.approx(780), pytest.approx(205))
