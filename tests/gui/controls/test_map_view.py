"""The control MapView: its layers, camera and goals."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from hands import click
from map_messages import grid, transform

from rosglass.comm import QoS
from rosglass.controls.maps.tiles import TileKey

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
    view = controls.show(
        'MapView { anchors.fill: parent; colorScheme: "map"; tools: false }', 640, 480
    )
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


def test_a_standing_robot_is_followed_from_its_first_pose(
    controls: Any, robot: Robot, wait: Callable[..., None]
) -> None:
    view = controls.show("MapView { anchors.fill: parent; follow: true }", 640, 480)
    robot.start()
    wait(lambda: view.property("scene").property("robotSeen"))
    assert view.property("camera").property("centerX") == pytest.approx(2.0)
    assert view.property("follow")


def test_updates_change_only_their_tiles(
    controls: Any, robot: Robot, wait: Callable[..., None]
) -> None:
    updates = controls.robot.create_publisher("/map_updates", "map_msgs/msg/OccupancyGridUpdate")
    robot.start(np.zeros((1100, 1100)))
    view = controls.show('MapView { anchors.fill: parent; colorScheme: "map" }')
    wait(updates.subscription_count)
    wait(lambda: is_complete(view))
    tiles = layer(view, "map").grid.tiles
    keys = [TileKey(0, column, row) for column in range(3) for row in range(3)]
    before = {key: tiles.version(key) for key in keys}
    data = np.full((3, 2), 100, np.int8)
    updates.publish(header={"frame_id": "map"}, x=1000, y=700, width=2, height=3, data=data.ravel())
    wait(lambda: tiles.value_at(100.05, 70.05) == 100)
    assert [key for key in keys if tiles.version(key) != before[key]] == [TileKey(0, 1, 1)]
    # A wall of one cell is seen from far.
    far = tiles.paint(TileKey(tiles.levels - 1, 0, 0))
    shown = {far.pixel(x, y) for x in range(far.width()) for y in range(far.height())}
    assert int(tiles.colors[101]) in shown
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
    view = controls.show('MapView { anchors.fill: parent; colorScheme: "map"; tools: false }')
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
    from rosglass.controls.maps.camera import MapCamera

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


def test_costmaps_paths_footprints_and_particles_are_found_and_drawn(
    controls: Any, robot: Robot, wait: Callable[..., None]
) -> None:
    robot.start()
    node = controls.robot
    costs = np.zeros((40, 60))
    costs[:, 30:35], costs[:, 35:40], costs[:, 40:45] = 100, 99, 50
    cost = node.create_publisher("/global_costmap/costmap", GRID, QoS.latched())
    cost.publish(grid(costs))
    path = node.create_publisher("/plan", "nav_msgs/msg/Path", QoS.latched())
    poses = [{"pose": {"position": {"x": x, "y": 3.0}}} for x in (0.5, math.nan, 2.5)]
    path.publish(header={"frame_id": "map"}, poses=poses)
    kind = "geometry_msgs/msg/PolygonStamped"
    outline = node.create_publisher("/footprint", kind, QoS.latched())
    corners = [{"x": x, "y": y} for x, y in ((-0.5, -0.3), (0.5, -0.3), (0.5, 0.3), (-0.5, 0.3))]
    outline.publish(header={"frame_id": "base_link"}, polygon={"points": corners})
    node.create_publisher("/other_polygon", kind)
    cloud = node.create_publisher("/particle_cloud", "geometry_msgs/msg/PoseArray", QoS.latched())
    cloud.publish(header={"frame_id": "map"}, poses=[{"position": {"x": 1.0, "y": 2.0}}])
    view = controls.show(
        'MapView { anchors.fill: parent; colorScheme: "map"; tools: false }', 640, 480
    )
    scene = view.property("scene")
    wait(lambda: len(scene.layers) == 5)
    kinds = [(one.KIND, one.property("topic")) for one in scene.layers]
    assert kinds == [
        ("map", "/map"), ("costmap", "/global_costmap/costmap"), ("particles", "/particle_cloud"),
        ("path", "/plan"), ("footprint", "/footprint"),
    ]  # fmt: skip
    wait(lambda: all(one.property("age") >= 0 for one in scene.layers))
    wait(lambda: all(one.is_complete for one in (x.layer for x in scene.layers[:2])))
    wait(lambda: "1 of 3 poses are not finite" in view.property("status"))

    # Over white with RViz's opacity of 0.6: purple, cyan, between blue and red, transparent.
    def drawn(x: float, y: float) -> tuple[int, int, int]:
        return pixel(controls, view, x, y).getRgb()[:3]

    wait(lambda: drawn(3.25, 1.0) == pytest.approx((255, 102, 255), abs=4))
    assert drawn(3.75, 1.0) == pytest.approx((102, 255, 255), abs=4)
    assert drawn(4.25, 1.0) == pytest.approx((178, 102, 178), abs=6)
    assert drawn(5.5, 1.0) == pytest.approx((255, 255, 255), abs=2)
    assert drawn(1.5, 3.0)[1] > drawn(1.5, 3.0)[0] + 60, "the path is green"
    assert drawn(2.5, 0.2)[2] < 200, "the footprint is orange"
    near = [drawn(1.0 + dx, 2.0 + dy) for dx in (-0.01, 0, 0.01) for dy in (-0.01, 0, 0.01)]
    assert min(red for red, _, _ in near) < 200, "a particle"
    scene.layers[1].shown = False
    wait(lambda: cost.subscription_count() == 0)
    wait(lambda: drawn(3.25, 1.0) == pytest.approx((255, 255, 255), abs=2))
    scene.layers[1].shown = True
    wait(lambda: drawn(3.25, 1.0) == pytest.approx((255, 102, 255), abs=4))


def test_topic_of_another_type_is_named(
    controls: Any, robot: Robot, wait: Callable[..., None]
) -> None:
    robot.start()
    node = controls.robot
    node.create_publisher("/odd", "std_msgs/msg/String", QoS.latched()).publish(data="map")
    view = controls.show('MapView { anchors.fill: parent; scans: ["/odd"] }')
    wait(lambda: "the topic's type is std_msgs/msg/String" in view.property("status"))
    wait(lambda: is_complete(view))


def test_unknown_frame_is_named_and_another_one_shows_the_map(
    controls: Any, robot: Robot, wait: Callable[..., None]
) -> None:
    robot.start()
    view = controls.show('MapView { anchors.fill: parent; frame: "world" }')
    wait(lambda: "no transform from map to world" in view.property("status"))
    assert not view.property("scene").property("hasMap")
    view.setProperty("frame", "base_link")
    wait(lambda: view.property("scene").property("hasMap"))
    box = view.property("scene").bounds()
    assert (box.x(), box.y(), box.width(), box.height()) == pytest.approx((-2, 0, 6, 4))


def test_robot_that_stops_sending_transforms_is_said(
    controls: Any, wait: Callable[..., None]
) -> None:
    node = controls.robot
    node.create_publisher("/map", GRID, QoS.latched()).publish(grid(np.zeros((40, 60))))
    moving = node.create_publisher("/tf", "tf2_msgs/msg/TFMessage")
    view = controls.show("MapView { anchors.fill: parent; follow: true; headingUp: true }")
    scene, camera = view.property("scene"), view.property("camera")
    wait(moving.subscription_count)
    for number in range(3):
        message = transform("map", "base_link", 1.0 + 0.5 * number, math.pi / 4)
        message["header"]["stamp"] = {"sec": 100 + number}
        moving.publish(transforms=[message])
        wait(lambda x=1.0 + 0.5 * number: scene.property("robotX") == pytest.approx(x))
    assert scene.property("driven") == pytest.approx(1.0)
    wait(lambda: camera.centerX == pytest.approx(2.0))
    assert camera.rotation == pytest.approx(math.pi / 4), "the robot heads up"
    wait(lambda: "the robot's position is" in view.property("status"))
    assert not scene.property("robotKnown")
    assert view.property("stale")


def test_map_of_a_publisher_that_is_gone_is_said(
    controls: Any, robot: Robot, wait: Callable[..., None]
) -> None:
    robot.start()
    view = controls.show("MapView { anchors.fill: parent }")
    wait(lambda: is_complete(view))
    robot.map.close()
    wait(lambda: "/map: it has had no publisher since" in view.property("status"))
    assert layer(view, "map").property("stale")
    assert layer(view, "map").grid, "it is still shown, faded"


def test_tiles_are_bounded_while_the_map_is_moved(
    controls: Any, robot: Robot, wait: Callable[..., None]
) -> None:
    rng = np.random.default_rng(3)
    robot.start(rng.integers(0, 100, (6000, 6000)))
    view = controls.show("MapView { anchors.fill: parent }")
    wait(lambda: is_complete(view))
    camera, tiles = view.property("camera"), layer(view, "map").layer
    assert len(tiles.model.rows) <= 4, "from far, a coarse level is enough"
    camera.zoomBy(12.0, 200, 150)
    for step in range(60):
        camera.panBy(300 if step < 30 else -300, 100 if step % 2 else -140)
        controls.grab()
        assert len(tiles.model.rows) <= 24 + 40
    wait(lambda: is_complete(view))
    # Those of other levels are dropped, except the coarsest.
    levels = {row.key.level for row in tiles.model.rows}
    assert len(levels) == 2
    assert len(tiles._images._images) == len(tiles.model.rows)


def test_colors_follow_the_theme(controls: Any, robot: Robot, wait: Callable[..., None]) -> None:
    robot.start()
    view = controls.show(
        "MapView { anchors.fill: parent; tools: false; property string mode: Theme.mode\n"
        "onModeChanged: Theme.mode = mode }"
    )
    wait(lambda: is_complete(view))
    wait(lambda: pixel(controls, view, 5.0, 3.5).lightness() < 60)
    view.setProperty("mode", "bright")
    try:
        wait(lambda: pixel(controls, view, 5.0, 3.5).lightness() > 240)
    finally:
        view.setProperty("mode", "dark")


def test_closing_while_tiles_are_made_leaves_nothing(
    controls: Any, robot: Robot, wait: Callable[..., None]
) -> None:
    robot.start(np.zeros((3000, 3000)))
    for _ in range(4):
        view = controls.show("MapView { anchors.fill: parent }")
        wait(lambda view=view: view.property("scene").property("hasMap"))
        controls.window.deleteLater()
        wait(lambda: robot.map.subscription_count() == 0)


def test_topics_are_those_of_a_namespace(controls: Any, wait: Callable[..., None]) -> None:
    node = controls.robot
    for name in ("/robot1", "/robot2"):
        publisher = node.create_publisher(f"{name}/map", GRID, QoS.latched())
        publisher.publish(
            grid(np.zeros((10, 10 if name == "/robot1" else 20)), frame=f"{name[1:]}_map")
        )
        node.create_publisher(f"{name}/scan", "sensor_msgs/msg/LaserScan")
    view = controls.show(
        'MapView { anchors.fill: parent; ns: "/robot2"; robotFrame: "/robot2_base" }'
    )
    scene = view.property("scene")
    wait(lambda: scene.property("hasMap"))
    assert [one.property("topic") for one in scene.layers] == ["/robot2/map", "/robot2/scan"]
    assert scene.property("fixedFrame") == "robot2_map"
    assert scene.property("robotFrame") == "robot2_base"
    view.setProperty("ns", "/robot1")
    wait(lambda: scene.property("fixedFrame") == "robot1_map")
    assert layer(view, "map").grid.tiles.columns == 10


def test_invalid_names_are_named(controls: Any, robot: Robot, wait: Callable[..., None]) -> None:
    robot.start()
    view = controls.show('MapView { anchors.fill: parent; scans: ["not a topic"] }')
    wait(lambda: "'not a topic' contains ' '" in view.property("status"))
    wait(lambda: view.property("scene").property("hasMap"))
    view.setProperty("scans", [])
    wait(lambda: is_complete(view))
    wait(lambda: view.property("status") == "")


def test_wheel_zooms_about_the_pointer_and_keys_move_and_turn(
    controls: Any, robot: Robot, wait: Callable[..., None]
) -> None:
    from rosglass.qt import QtCore, QtGui, optional

    robot.start()
    view = controls.show("MapView { anchors.fill: parent; tools: false }")
    camera, plane = view.property("camera"), controls.find("plane")
    wait(lambda: is_complete(view))
    before, scale = camera.toMap(60, 40), camera.scale
    at = plane.mapToScene(QtCore.QPointF(60, 40))
    none = QtCore.Qt.MouseButton.NoButton
    wheel = QtGui.QWheelEvent(
        at, at, QtCore.QPoint(), QtCore.QPoint(0, 240), none,
        QtCore.Qt.KeyboardModifier.NoModifier, QtCore.Qt.ScrollPhase.NoScrollPhase, False,
    )  # fmt: skip
    QtCore.QCoreApplication.sendEvent(controls.window, wheel)
    assert camera.scale == pytest.approx(scale * 1.44)
    assert camera.toMap(60, 40).x() == pytest.approx(before.x())
    test: Any = optional("QtTest")
    plane.forceActiveFocus()
    x = camera.centerX
    test.QTest.keyClick(controls.window, QtCore.Qt.Key.Key_Right)
    assert camera.centerX > x
    test.QTest.keyClick(
        controls.window, QtCore.Qt.Key.Key_Left, QtCore.Qt.KeyboardModifier.ShiftModifier
    )
    assert camera.rotation == pytest.approx(math.pi / 36)
    test.QTest.keyClick(controls.window, QtCore.Qt.Key.Key_0)
    assert camera.rotation == 0
    test.QTest.keyClick(controls.window, QtCore.Qt.Key.Key_Home)
    assert camera.scale == pytest.approx(scale)
    test.QTest.keyClick(controls.window, QtCore.Qt.Key.Key_F)
    assert view.property("follow")


def test_buttons_of_a_small_map_are_behind_one(controls: Any, wait: Any) -> None:
    view = controls.show("MapView { width: 240; height: 200 }")
    bar = controls.find("tools")
    wait(bar.isVisible)
    assert not controls.find("goal").isVisible()
    click(controls, "tools")
    wait(controls.find("goal").isVisible)
    click(controls, "goal")
    wait(lambda: view.property("tool") == "goal")
    # The map is free again for the goal.
    assert not controls.find("goal").isVisible()
    view.setProperty("width", 400)
    wait(controls.find("goal").isVisible)
    assert not bar.isVisible()


def test_map_of_a_robot_that_is_followed_is_fitted_once(
    robot: Robot, controls: Any, wait: Any
) -> None:
    robot.start()
    view = controls.show("MapView { width: 380; height: 280; follow: true }")
    camera = view.property("camera")
    # The map has 6 m x 4 m.
    wait(lambda: 4 <= camera.property("span") < 6)
    wait(lambda: view.property("scene").property("robotSeen"))
    assert camera.property("centerX") == pytest.approx(view.property("scene").property("robotX"))


def test_painted_track_follows_its_points(controls: Any) -> None:
    from rosglass.controls.maps.marks import MapMarks

    controls.show("MapView { anchors.fill: parent }")
    marks, points = MapMarks(), [(0.0, 0.0), (1.0, 0.0)]
    assert marks._way(points).size() == 2
    points.append((2.0, 1.0))
    assert marks._way(points).size() == 3
    begun_again = [(5.0, 6.0), (6.0, 6.0)]
    line = marks._way(begun_again)
    assert [(line.at(n).x(), line.at(n).y()) for n in range(line.size())] == begun_again
