"""The displays of poses, points, polygons, ranges, wrenches, twists and accelerations."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from rosglass.scene.render.drawing import Lines, Mesh
from rosglass.scene.render.mesh_shapes import CONE, CYLINDER, SPHERE

if TYPE_CHECKING:
    from collections.abc import Callable

    from conftest import SceneBench

HEADER = {"frame_id": "map"}
UP = {"x": 0.0, "y": 0.0, "z": 1.0}


def pose(x: float = 0.0, y: float = 0.0, **rotation: float) -> dict[str, Any]:
    return {"position": {"x": x, "y": y, "z": 0.0}, "orientation": rotation or {"w": 1.0}}


def covariance(**variances: float) -> np.ndarray:
    names = ("x", "y", "z", "roll", "pitch", "yaw")
    return np.diag([variances.get(name, 0.0) for name in names]).reshape(-1)


@pytest.fixture
def show(bench: SceneBench) -> Callable[..., Any]:
    """Shows messages in a display of a type; returns the display once it has received them."""

    def send(
        display_type: str, message_type: str, *messages: dict[str, Any], **settings: Any
    ) -> Any:
        view = bench.load()
        display = view.scene.add(display_type, topic="/shown", **settings)
        publisher = bench.publisher("/shown", message_type)
        for number, message in enumerate(messages, 1):
            publisher.publish({"header": HEADER, **message})
            bench.wait(
                lambda number=number: display.received >= number or display.statusLevel == "error"
            )
        return display

    return send


def parts(display: Any, shape: Any = None) -> list[Any]:
    found = [one for one, _, _ in display.root.drawables()]
    return (
        [one for one in found if isinstance(one, Mesh) and one.shape is shape] if shape else found
    )


def place(matrix: Any) -> list[float]:
    return np.round(matrix.reshape(4, 4).T[:3, 3], 3).tolist()


def test_a_pose_is_an_arrow_or_axes(show: Callable[..., Any]) -> None:
    display = show("Pose", "geometry_msgs/PoseStamped", {"pose": pose(2.0, 1.0)})
    assert display.statusLevel == "ok", display.statusText
    (shaft,), (head,) = parts(display, CYLINDER), parts(display, CONE)
    assert place(shaft.instances["matrix"][0]) == [2.5, 1.0, 0.0]
    assert place(head.instances["matrix"][0]) == [3.0, 1.0, 0.0]
    display.shape = "Axes"
    assert parts(display, CONE) == []
    (axes,) = parts(display, CYLINDER)
    assert axes.count == 3


def test_an_array_of_poses_is_drawn_in_three_ways(show: Callable[..., Any]) -> None:
    display = show("PoseArray", "geometry_msgs/PoseArray", {"poses": [pose(1.0), pose(2.0)]})
    (flat,) = parts(display)
    assert isinstance(flat, Lines)
    assert flat.count == 6
    assert flat.rows["end"][0].tolist() == pytest.approx([1.3, 0, 0])
    display.shape = "Arrow (3D)"
    assert [one.count for one in parts(display)] == [2, 2]
    display.shape = "Axes"
    assert [one.count for one in parts(display)] == [6]


def test_covariances_are_ellipsoids_and_cones(show: Callable[..., Any]) -> None:
    one = {"pose": pose(), "covariance": covariance(x=4.0, y=1.0, yaw=0.04)}
    display = show("PoseWithCovariance", "geometry_msgs/PoseWithCovarianceStamped", {"pose": one})
    (ellipsoid,) = parts(display, SPHERE)
    matrix = ellipsoid.instances["matrix"][0].reshape(4, 4).T
    # Two standard deviations from end to end, as RViz draws them: 2 m and 1 m.
    assert sorted(np.round(np.linalg.norm(matrix[:3, :3], axis=0), 3)) == [0.001, 2.0, 4.0]
    assert len(parts(display, CONE)) == 2  # the arrow's head, and the yaw
    display.covariance = False
    assert parts(display, SPHERE) == []
    assert len(parts(display, CONE)) == 1


def ellipsoids(display: Any) -> dict[float, float]:
    """Return how long the ellipsoids of covariances are, by where they are along x."""
    found = [one for mesh in parts(display, SPHERE) for one in mesh.instances["matrix"]]
    lengths = [np.linalg.norm(one.reshape(4, 4)[:3], axis=1).max() for one in found]
    return {place(one)[0]: round(float(far), 3) for one, far in zip(found, lengths, strict=True)}


def test_a_covariance_is_that_of_the_newest_pose(show: Callable[..., Any]) -> None:
    poses = [{"pose": {"pose": pose(), "covariance": covariance(x=x)}} for x in (4.0, 9.0)]
    display = show("PoseWithCovariance", "geometry_msgs/PoseWithCovarianceStamped", *poses)
    assert ellipsoids(display) == {0.0: 6.0}
    display.positionScale = 2.0
    assert ellipsoids(display) == {0.0: 12.0}


def test_each_pose_of_an_odometry_keeps_its_covariance(
    bench: SceneBench, show: Callable[..., Any]
) -> None:
    way = [{"pose": {"pose": pose(x), "covariance": covariance(x=x * x)}} for x in range(1, 6)]
    display = show("Odometry", "nav_msgs/Odometry", *way, keep=3)
    assert ellipsoids(display) == {3.0: 6.0, 4.0: 8.0, 5.0: 10.0}
    # As after a jump of the robot's time.
    display.reset()
    publisher = bench.robot.create_publisher("/shown", "nav_msgs/Odometry")
    bench.wait(lambda: publisher.publish({"header": HEADER, **way[0]}) or ellipsoids(display))
    assert ellipsoids(display) == {1.0: 2.0}


def test_fewer_poses_are_shown_at_once_and_the_most_is_said(
    show: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    from rosglass.scene.displays import pose as module

    monkeypatch.setattr(module, "_MAX_KEPT", 4)
    way = [{"pose": {"pose": pose(float(x)), "covariance": covariance()}} for x in range(6)]
    display = show("Odometry", "nav_msgs/Odometry", *way, keep=0)
    assert parts(display, CYLINDER)[0].count == 4
    assert display.statusLevel == "warn"
    assert "Keep: only the latest 4 poses are shown" in display.statusText
    display.keep = 2
    assert parts(display, CYLINDER)[0].count == 2
    assert display.statusLevel == "ok", display.statusText
    display.set_status("Keep", "warn", "of poses that are dropped")
    display.reset()
    assert "Keep" not in display.status_lines


def test_the_most_messages_of_a_history_is_said(
    show: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    from rosglass.scene.displays import topic_display

    monkeypatch.setattr(topic_display, "_MAX_HISTORY", 4)
    messages = [{"point": {"x": float(x)}} for x in range(6)]
    display = show("PointStamped", "geometry_msgs/PointStamped", *messages, historyLength=5)
    assert len(parts(display, SPHERE)) == 4
    assert "History Length: only the latest 4 are shown" in display.statusText
    display.historyLength = 3
    assert len(parts(display, SPHERE)) == 3
    assert display.statusLevel == "ok", display.statusText
    display.set_status("History Length", "warn", "of messages that are dropped")
    display.reset()
    assert "History Length" not in display.status_lines


def test_odometry_keeps_poses_that_are_apart(show: Callable[..., Any]) -> None:
    way = [
        {"pose": {"pose": pose(x), "covariance": covariance()}} for x in (0.0, 0.05, 1.0, 2.0, 3.0)
    ]
    display = show("Odometry", "nav_msgs/Odometry", *way, keep=3)
    (shafts,) = parts(display, CYLINDER)
    assert [place(one)[0] for one in shafts.instances["matrix"]] == [1.5, 2.5, 3.5]
    assert display.save_settings()["Shape"]["Value"] == "Arrow"
    assert display.save_settings()["Shape"]["Shaft Length"] == 1.0


def test_points_are_spheres_with_a_history(show: Callable[..., Any]) -> None:
    messages = [{"point": {"x": x, "y": 0.0, "z": 0.0}} for x in (1.0, 2.0, 3.0)]
    display = show(
        "PointStamped", "geometry_msgs/PointStamped", *messages, historyLength=2, radius=0.5
    )
    balls = parts(display, SPHERE)
    assert [place(one.instances["matrix"][0])[0] for one in balls] == [2.0, 3.0]


def test_a_polygon_is_closed(show: Callable[..., Any]) -> None:
    corners = [{"x": 0.0, "y": 0.0}, {"x": 1.0, "y": 0.0}, {"x": 0.0, "y": 1.0}]
    display = show("Polygon", "geometry_msgs/PolygonStamped", {"polygon": {"points": corners}})
    (outline,) = parts(display)
    assert outline.count == 3
    assert outline.rows["end"][2].tolist() == [0.0, 0.0, 0.0]


@pytest.mark.parametrize(
    ("value", "low", "base"),
    [
        (2.0, 0.1, 2.0),
        (9.0, 0.1, None),
        (math.inf, 0.1, None),
        (math.nan, 0.1, None),
        # Of a sensor of one fixed distance, infinity says whether something is there.
        (-math.inf, 5.0, 5.0),
        (5.0, 5.0, 5.0),
        (math.inf, 5.0, None),
    ],
)
def test_a_range_is_a_cone_within_its_limits(
    show: Callable[..., Any], value: float, low: float, base: float | None
) -> None:
    about = {"field_of_view": 0.5, "min_range": low, "max_range": 5.0, "range": value}
    display = show("Range", "sensor_msgs/Range", about)
    cones = parts(display, CONE)
    if base is None:
        assert cones == []
        return
    matrix = cones[0].instances["matrix"][0].reshape(4, 4).T
    assert (matrix @ [0, 0, 1, 1])[:3] == pytest.approx([0, 0, 0])  # its tip is at the sensor
    assert (matrix @ [0.5, 0, 0, 1])[:3] == pytest.approx([base, base * np.tan(0.25), 0], abs=1e-5)


@pytest.mark.parametrize(
    ("display_type", "message_type", "message"),
    [
        ("WrenchStamped", "geometry_msgs/WrenchStamped", {"wrench": {"force": UP, "torque": UP}}),
        ("TwistStamped", "geometry_msgs/TwistStamped", {"twist": {"linear": UP, "angular": UP}}),
        ("AccelStamped", "geometry_msgs/AccelStamped", {"accel": {"linear": UP, "angular": UP}}),
    ],
)
def test_two_vectors_are_two_arrows_and_a_circle(
    show: Callable[..., Any], display_type: str, message_type: str, message: dict[str, Any]
) -> None:
    display = show(display_type, message_type, message)
    assert len(parts(display, CONE)) == 3, "the head of the circle as well"
    shaft = parts(display, CYLINDER)[0].instances["matrix"][0]
    assert place(shaft) == [0.0, 0.0, 1.0]  # the middle of 2 m along z
    assert sum(isinstance(one, Lines) for one in parts(display)) == 1
    display.arrowWidth = 3.0
    assert parts(display) == [], "arrows shorter than their width are hidden"
