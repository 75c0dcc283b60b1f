"""The displays Marker and MarkerArray."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from inside import device_of, renderers_of

from rosglass.scene.render.drawing import Labels, Lines, Mesh, Points
from rosglass.scene.render.mesh_shapes import BOX, CYLINDER, SPHERE, Shape

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from conftest import SceneBench

ADD, DELETE, DELETE_ALL = 0, 2, 3
RED = {"r": 1.0, "g": 0.0, "b": 0.0, "a": 1.0}


def marker(kind: int, number: int = 0, **fields: Any) -> dict[str, Any]:
    made = {
        "header": {"frame_id": "map"},
        "ns": "shapes",
        "id": number,
        "type": kind,
        "action": ADD,
        "pose": {"orientation": {"w": 1.0}},
        "scale": {"x": 1.0, "y": 1.0, "z": 1.0},
        "color": RED,
    }
    return {**made, **fields}


def points(*places: tuple[float, float, float]) -> list[dict[str, float]]:
    return [{"x": x, "y": y, "z": z} for x, y, z in places]


@pytest.fixture
def show(bench: SceneBench) -> Callable[..., Any]:
    """Publishes markers, and returns the display once it has received them."""
    display = bench.show('MarkerArrayDisplay { topic: "/markers" }')
    publisher = bench.publisher("/markers", "visualization_msgs/MarkerArray")

    return lambda *markers: bench.send(publisher, {"markers": list(markers)}, display)


def drawables(display: Any) -> list[Any]:
    return [one for one, _, _ in display.root.drawables()]


def xs(display: Any) -> list[float]:
    """Return where shapes are along x."""
    return [
        round(float((pose @ matrix.reshape(4, 4).T)[0, 3]), 3)
        for one, pose, _ in display.root.drawables()
        for matrix in one.instances["matrix"]
    ]


SHAPES = [
    (marker(0), 60),
    (marker(0, points=points((0, 0, 0), (2, 0, 0)), scale={"x": 0.3, "y": 0.6, "z": 0.0}), 60),
    (marker(1), 200),
    (marker(2), 200),
    (marker(3), 200),
    (marker(4, points=points((-2, 0, 0), (2, 0, 0)), scale={"x": 0.3}), 100),
    (marker(5, points=points((-2, 0, 0), (2, 0, 0)), scale={"x": 0.3}), 100),
    (marker(6, points=points((-2, 0, 0), (2, 0, 0))), 200),
    (marker(7, points=points((-2, 0, 0), (2, 0, 0))), 200),
    (marker(8, points=points((-2, 0, 0), (2, 0, 0)), scale={"x": 0.5, "y": 0.5}), 60),
    (marker(9, text="robot", scale={"z": 1.0}), 60),
    (marker(11, points=points((0, 0, 0), (3, 0, 0), (0, 3, 0))), 200),
    (marker(12, points=points((0, 0, 0), (2, 0, 0), (2, 2, 0)), scale={"x": 0.3, "y": 0.6}), 60),
]


@pytest.mark.parametrize(("shape", "pixels"), SHAPES)
def test_each_type_is_drawn(
    bench: SceneBench, show: Callable[..., Any], shape: dict[str, Any], pixels: int
) -> None:
    display = show(shape)
    assert display.statusLevel == "ok", display.statusText
    picture = bench.picture().astype(int)
    red = (picture[..., 0] > 60) & (picture[..., 1] < 40) & (picture[..., 2] < 40)
    assert red.sum() > pixels


def test_boxes_are_instances_of_one_mesh(show: Callable[..., Any]) -> None:
    display = show(*(marker(1, number) for number in range(50)))
    (mesh,) = drawables(display)
    assert isinstance(mesh, Mesh)
    assert (mesh.shape, mesh.count) == (BOX, 50)
    display = show(marker(1, 7, action=DELETE), marker(1, 49, action=DELETE))
    assert mesh.count == 48
    show(marker(1, action=DELETE_ALL, ns=""))
    assert drawables(display) == []


def test_boxes_of_one_message_move_go_and_become_others(show: Callable[..., Any]) -> None:
    def at(x: float, number: int, kind: int = 1, **fields: Any) -> dict[str, Any]:
        pose = {"position": {"x": x}, "orientation": {"w": 1.0}}
        return marker(kind, number, pose=pose, **fields)

    display = show(*(at(x, x) for x in range(4)))
    assert xs(display) == [0, 1, 2, 3]
    blue = {**RED, "r": 0.0, "b": 1.0}
    display = show(
        at(13, 3, color=blue),  # becomes the second one in the place of that which goes
        marker(1, 1, action=DELETE),
        at(12, 2),
        marker(1, 2, action=DELETE),
        at(10, 0, kind=2),
        at(14, 4),
    )
    (boxes, spheres) = drawables(display)
    assert (boxes.shape, spheres.shape) == (BOX, SPHERE)
    assert sorted(xs(display)) == [10, 13, 14]
    colors = {round(float(m[12])): c.tolist() for m, c in boxes.instances[["matrix", "rgba"]]}
    assert colors == {13: [0, 0, 1, 1], 14: [1, 0, 0, 1]}


def test_texts_and_lines_are_drawn_together(show: Callable[..., Any]) -> None:
    line = points((0, 0, 0), (1, 0, 0), (1, 1, 0))
    lines = [marker(4, number, points=line, scale={"x": 0.1}) for number in range(50)]
    texts = [marker(9, number, text=f"{number}", scale={"z": 1.0}) for number in range(50, 100)]
    display = show(*lines, *texts)
    strips, labels = drawables(display)
    assert (type(strips), strips.count, type(labels), labels.count) == (Lines, 100, Labels, 50)
    # One of another width, one that becomes a box, and one that goes.
    show({**lines[0], "scale": {"x": 0.2}}, marker(1, 1), marker(9, 99, action=DELETE))
    assert (strips.count, labels.count) == (96, 49)
    assert sorted(type(one).__name__ for one in drawables(display)) == [
        *("Labels", "Lines", "Lines", "Mesh"),
    ]
    show(*(marker(4, number, action=DELETE) for number in range(99)))
    assert drawables(display) == []
    assert len(display.root) == 1
    ((group,),) = [display.root]
    assert not any(isinstance(one, (Lines, Labels)) for one in group)


def test_lines_together_look_like_each_alone(
    bench: SceneBench, show: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    from rosglass.scene.displays import marker as module

    two = [RED, {"r": 0.0, "g": 1.0, "b": 0.0, "a": 0.2}]
    turned = {"position": {"x": 1.0}, "orientation": {"z": 0.38, "w": 0.92}}
    line = points((-2, 0, 0), (2, 0, 0), (2, 2, 0), (0, 1, 1))
    markers = [
        marker(4, 0, points=line, scale={"x": 0.1}, colors=two * 2),
        marker(4, 1, points=line, scale={"x": 0.1}, pose=turned),
        marker(5, 2, points=line, scale={"x": 0.1}, pose=turned, colors=two * 2),
    ]
    display = show(*markers)
    assert len(drawables(display)) == 1
    together = bench.picture()
    monkeypatch.setattr(module, "MAX_JOINED_POINTS", 0)
    show(*markers)
    assert len(drawables(display)) == 3
    assert np.abs(bench.picture().astype(int) - together).max() < 3


def test_translucent_lines_are_sorted_while_there_are_few(
    show: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    from rosglass.scene.displays import marker as module

    monkeypatch.setattr(module, "_MAX_ALONE", 3)
    line = points((0, 0, 0), (1, 0, 0))
    color = {**RED, "a": 0.5}
    strips = [marker(4, n, points=line, scale={"x": 0.1}, color=color) for n in range(10)]
    display = show(*strips)
    assert sorted(one.count for one in drawables(display)) == [1, 1, 1, 7]
    assert not any(one.opaque for one in drawables(display))
    show(*strips)
    assert sorted(one.count for one in drawables(display)) == [1, 1, 1, 7]
    show(*({**one, "color": RED} for one in strips))
    assert [(one.count, one.opaque) for one in drawables(display)] == [(10, True)]


def test_one_that_is_far_away_does_not_round_the_places_of_others(show: Callable[..., Any]) -> None:
    line = points((0, 0, 0), (1, 0, 0))
    places = [(0.0, 0.0), (5e6, 0.01), (5e6, 0.02), (1e18, 0.0)]
    poses = [{"position": {"x": x, "y": y}, "orientation": {"w": 1.0}} for x, y in places]
    texts = [marker(9, n, pose=pose, text=f"{n}") for n, pose in enumerate(poses)]
    lines = [marker(4, 10 + n, pose=pose, points=line) for n, pose in enumerate(poses)]
    display = show(*texts, *lines)
    found: dict[type, list[tuple[float, float]]] = {Labels: [], Lines: []}
    for one, pose, _ in display.root.drawables():
        starts = one.positions if isinstance(one, Labels) else one.rows["start"]
        at = starts.astype(np.float64) @ pose[:3, :3].T + pose[:3, 3]
        found[type(one)] += [(x, round(y, 6)) for x, y, _ in at.tolist()]
    assert found == {Labels: places, Lines: places}
    assert len(drawables(display)) == 6


def test_many_triangle_lists_are_drawn_together_and_look_the_same(
    bench: SceneBench, show: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    from rosglass.scene.displays import marker as module

    corners = points((0, 0, 0), (1, 0, 0), (0, 1, 0))
    turned = {"position": {"x": -2.0}, "orientation": {"x": 0.38, "w": 0.92}}
    green = {"r": 0.0, "g": 1.0, "b": 0.0, "a": 1.0}
    markers = [
        marker(11, 0, points=corners),
        marker(11, 1, points=corners, pose=turned, color=green, scale={"x": 2, "y": 1, "z": 1}),
        marker(11, 2, points=corners, colors=[RED, green, RED], pose={"position": {"y": -2.0}}),
        marker(11, 3, points=corners, color={**green, "a": 0.5}, pose={"position": {"y": 2.0}}),
    ]
    display = show(*markers)
    assert len(drawables(display)) == 4
    expected = bench.picture().astype(int)
    show(marker(1, action=DELETE_ALL, ns=""))
    monkeypatch.setattr(module, "_MAX_ALONE", 0)
    show(*markers)
    # Lit ones, one with colours of its own, and a translucent one.
    assert [(len(one.shape.rows), one.lit) for one in drawables(display)] == [
        *((6, True), (3, False), (3, True)),
    ]
    assert np.abs(bench.picture() - expected).max() < 4
    show(*(marker(11, number, action=DELETE) for number in range(4)))
    assert drawables(display) == []


def test_a_marker_replaces_the_one_of_its_id(show: Callable[..., Any]) -> None:
    display = show(marker(1), marker(9, 1, text="a", scale={"z": 1.0}))
    show(marker(9, text="b", scale={"z": 1.0}))
    (labels,) = drawables(display)
    assert sorted(labels.texts) == ["a", "b"]


def test_a_list_that_is_sent_again_is_drawn_in_each_frame(
    bench: SceneBench, show: Callable[..., Any]
) -> None:
    clear, blue = {**RED, "a": 0.5}, {"b": 1.0, "a": 1.0}
    sizes = {"x": 0.5, "y": 1.0, "z": 2.0}
    display = show(marker(6, points=points((-2, 0, 0), (2, 0, 0)), scale=sizes, color=clear))
    (cloud,) = drawables(display)
    assert (cloud.style, cloud.opaque) == ("boxes", False)
    bench.picture()
    # It stays the same drawable: a new one might be uploaded in a later frame.
    last = marker(7, points=points((0, 1, 0)), color=blue)
    assert drawables(show(last)) == [cloud]
    changed = bench.picture()
    show(marker(7, action=DELETE))
    assert drawables(show(last)) != [cloud]
    assert np.array_equal(bench.picture(), changed)
    # A list that becomes something else, and the other way round.
    (mesh,) = drawables(show(marker(1)))
    assert isinstance(mesh, Mesh)
    assert [type(one) for one in drawables(show(last))].count(Points) == 1


def test_colors_of_points_count(show: Callable[..., Any]) -> None:
    line = points((0, 0, 0), (1, 0, 0))
    two = [RED, {"r": 0.0, "g": 1.0, "b": 0.0, "a": 1.0}]
    display = show(marker(4, points=line, colors=two), marker(8, 1, points=line, colors=two))
    lines, cloud = drawables(display)
    assert isinstance(lines, Lines)
    assert lines.rows["first"].tolist() == [[255, 0, 0, 255]]
    assert lines.rows["last"].tolist() == [[0, 255, 0, 255]]
    assert isinstance(cloud, Points)
    assert cloud.coloring.mode == "bgra"


def test_a_lifetime_ends(bench: SceneBench, show: Callable[..., Any]) -> None:
    display = show(marker(1, lifetime={"sec": 0, "nanosec": 200_000_000}), marker(2, 1))
    assert len(drawables(display)) == 2
    bench.wait(lambda: len(drawables(display)) == 1)


def test_a_display_of_markers_shows_the_arrays_beside_its_topic(bench: SceneBench) -> None:
    from rosglass.comm.qos import QoS

    display = bench.show('MarkerDisplay { topic: "/visualization_marker"; durability: "Volatile" }')
    arrays = bench.robot.create_publisher(
        "/visualization_marker_array", "visualization_msgs/MarkerArray", QoS.latched()
    )
    arrays.publish({"markers": [marker(1), marker(2, 1)]})
    bench.wait(lambda: len(drawables(display)) == 2)
    single = bench.robot.create_publisher("/visualization_marker", "visualization_msgs/Marker")
    bench.wait(lambda: single.publish(marker(3, 2)) or len(drawables(display)) == 3)
    assert display.statusLevel == "ok", display.statusText


def test_a_marker_that_names_no_frame_is_an_error(show: Callable[..., Any]) -> None:
    display = show(marker(1), marker(2, 1, header={"frame_id": ""}))
    assert len(drawables(display)) == 1
    assert "shapes/1: header.frame_id is empty: the publisher has to" in display.statusText
    assert display.statusLevel == "error"


def test_a_namespace_is_hidden(bench: SceneBench, show: Callable[..., Any]) -> None:
    display = show(marker(1), marker(2, ns="other"))
    assert display.namespaces == ["other", "shapes"]
    display.setNamespaceEnabled("shapes", False)
    assert len(drawables(display)) == 1
    assert display.save_settings()["Namespaces"] == {"shapes": False}


def test_namespaces_are_bounded_and_empty_ones_make_room(
    show: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    from rosglass.scene.displays import marker as module

    monkeypatch.setattr(module, "_MAX_NAMESPACES", 3)
    for number in range(10):
        one = f"n{number}"
        display = show(marker(1, ns=one), marker(1, ns=one, action=DELETE))
    assert display.namespaces == ["n7", "n8", "n9"]
    assert display.statusLevel == "ok", display.statusText
    display = show(*(marker(1, ns=f"m{number}") for number in range(4)))
    assert display.namespaces == ["m0", "m1", "m2"]
    assert len(drawables(display)) == 3
    assert "m3/0: it cannot be drawn: there are more than 3 namespaces" in display.statusText
    display = show(marker(1, ns="m1", action=DELETE), marker(1, ns="m3"))
    assert display.namespaces == ["m0", "m2", "m3"]
    assert display.statusLevel == "ok", display.statusText


def test_hidden_namespaces_are_saved(show: Callable[..., Any]) -> None:
    display = show(marker(1, ns="a"), marker(1, ns="b"))
    assert display.save_settings()["Namespaces"] == {}
    assert display.parts.load({"Namespaces": {"c": False, "d": True}}) == []
    display.setNamespaceEnabled("a", False)
    saved = display.save_settings({"Namespaces": {"b": True, "d": False}})
    assert saved["Namespaces"] == {"b": True, "d": True, "c": False, "a": False}
    show(marker(1, ns="c"))
    assert len(drawables(display)) == 1


def test_markers_wait_for_their_frame_and_locked_ones_follow_it(
    bench: SceneBench, show: Callable[..., Any]
) -> None:
    display = show(
        marker(1, header={"frame_id": "arm"}, frame_locked=True),
        marker(2, 1, header={"frame_id": "arm"}),
    )
    assert "no transform from [arm]" in display.statusText
    assert drawables(display) == []

    def move(x: float, sec: int) -> None:
        bench.move("arm", (x, 0, 0), sec)

    move(1.0, 1)
    bench.wait(lambda: xs(display) == [1.0, 1.0])
    assert display.statusLevel == "ok"
    # Others that wait do not hold them up.
    show(marker(3, 2, header={"frame_id": "nowhere"}))
    boxes, _ = drawables(display)
    uploads = boxes.geometry
    move(3.0, 2)
    bench.wait(lambda: xs(display) == [3.0, 1.0])
    # Only its pose was set.
    assert (drawables(display)[0], boxes.geometry) == (boxes, uploads)


def test_locked_markers_fade_when_their_frame_is_not_updated(
    bench: SceneBench, show: Callable[..., Any], monkeypatch: Any
) -> None:
    from rosglass.scene.displays import display as displays

    monkeypatch.setattr(displays, "_FRAME_TIMEOUT_S", 0.5)
    display = show(
        marker(1, header={"frame_id": "arm"}, frame_locked=True),
        marker(2, 1, header={"frame_id": "arm"}),
        marker(3, 2),
    )

    def move() -> None:
        bench.move("arm", (0, 0, 0), bench.robot.now())

    def opacities() -> dict[int, float]:
        shapes = {BOX: 1, SPHERE: 2, CYLINDER: 3}
        return {shapes[one.shape]: alpha for one, _, alpha in display.root.drawables()}

    bench.wait(lambda: move() or opacities() == {1: 1.0, 2: 1.0, 3: 1.0})
    bench.wait(lambda: move() or display.statusLevel == "ok")
    # The others are where they were meant to be.
    bench.wait(lambda: opacities() == {1: 0.35, 2: 1.0, 3: 1.0}, opacities)
    assert "[arm] may be somewhere else: no transform received for" in display.statusText
    bench.wait(lambda: move() or opacities()[1] == 1.0)
    assert display.statusLevel == "ok", display.statusText
    bench.wait(lambda: opacities()[1] < 1.0)
    display.setNamespaceEnabled("shapes", False)
    bench.wait(lambda: display.statusLevel == "ok", lambda: display.statusText)


def test_all_markers_of_an_array_are_applied_in_order(show: Callable[..., Any]) -> None:
    display = show(*(marker(1, number) for number in range(1200)))
    assert [one.count for one in drawables(display)] == [1200]
    erase = marker(1, action=DELETE_ALL, ns="")
    show(erase, *(marker(1, number) for number in range(10)))
    assert [one.count for one in drawables(display)] == [10]
    show(erase)
    show(marker(1, 1, action=DELETE), marker(1, 1), marker(1, 2))
    assert [one.count for one in drawables(display)] == [2]
    assert display.statusLevel == "ok", display.statusText


def test_one_that_cannot_be_drawn_does_not_hide_the_others(
    show: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail() -> None:
        raise ValueError("no points today")

    monkeypatch.setattr("rosglass.scene.displays.marker.Points", fail)
    display = show(marker(1), marker(6, 1, points=points((0, 0, 0))), marker(2, 2), marker(3, 3))
    assert len(drawables(display)) == 3
    assert "shapes/1: it cannot be drawn: no points today" in display.statusText


def test_scales_that_are_beyond_what_is_drawn_are_named(show: Callable[..., Any]) -> None:
    display = show(
        marker(1, scale={"x": 1e30, "y": 1.0, "z": 1.0}),
        marker(6, 1, scale={"x": 1e-160, "y": 1.0, "z": 1.0}, points=points((0, 0, 0))),
    )
    assert "shapes/0: scale: 1e+30 is beyond the 1e+18 that is drawn" in display.statusText
    assert "shapes/1: scale (0.0, 1.0, 1.0) of a cube_list is 0" in display.statusText
    assert len(drawables(display)) == 1


def test_a_waiting_marker_is_replaced_and_deleted_by_newer_ones(
    bench: SceneBench, show: Callable[..., Any]
) -> None:
    away = {"frame_id": "arm"}
    display = show(marker(1), marker(1, header=away), marker(2, 1, header=away))
    assert len(drawables(display)) == 1  # the older one, until the newer one has a place
    show(marker(3), marker(2, 1, action=DELETE), marker(2, 2, header=away))
    bench.place("arm", at=(2.0, 0, 0))
    bench.wait(lambda: xs(display) == [0.0, 2.0])
    assert display.statusLevel == "ok", display.statusText


def test_markers_that_wait_are_bounded_and_their_lines_too(
    bench: SceneBench, show: Callable[..., Any]
) -> None:
    display = show(
        *(marker(1, number, header={"frame_id": f"f{number}"}) for number in range(1010))
    )
    assert len(display.status_lines) <= 52
    assert "Transform [f10]: no transform from [f10]" in display.statusText
    assert "Markers: and 960 more" in display.statusText
    bench.place("f1009")
    bench.wait(lambda: len(drawables(display)) == 1)
    show(*(marker(99, number) for number in range(1010)))
    assert len(display.status_lines) <= 52
    show(marker(1, action=DELETE_ALL, ns=""))
    assert display.statusLevel == "ok", display.statusText


def test_a_reset_drops_markers_and_what_was_wrong_with_them(
    bench: SceneBench, show: Callable[..., Any]
) -> None:
    display = show(marker(1), marker(99, 1), marker(1, 2, header={"frame_id": "arm"}))
    assert display.statusLevel == "error"
    display.reset()
    assert drawables(display) == []
    bench.wait(lambda: display.statusLevel == "ok")
    assert display.namespaces == []


def test_a_marker_of_a_time_that_never_comes_is_dropped(
    bench: SceneBench, show: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    from rosglass.scene.displays import marker as module

    monkeypatch.setattr(module, "_MAX_WAIT_S", 0.0)
    header = {"frame_id": "arm", "stamp": {"sec": 5, "nanosec": 0}}
    display = show(marker(1, header=header), marker(1, 1, header={"frame_id": "leg"}))
    bench.place("other")
    bench.wait(lambda: "shapes/0: it was dropped after 0 s: no trans" in display.statusText)
    assert "Transform [arm]" not in display.statusText
    # Any time is good for this one.
    assert "Transform [leg]" in display.statusText


def test_markers_without_transform_to_a_new_fixed_frame_are_hidden(
    bench: SceneBench, show: Callable[..., Any]
) -> None:
    bench.place("arm", at=(2.0, 0, 0))
    view = bench.view
    bench.wait(lambda: "arm" in view.scene.frames())
    display = show(
        marker(1, header={"frame_id": "arm"}),
        marker(2, 1, header={"frame_id": "arm"}, frame_locked=True),
        marker(3, 2, header={"frame_id": "island"}),
    )
    bench.wait(lambda: xs(display) == [2.0, 2.0])
    view.scene.fixed_frame = "island"
    bench.wait(lambda: xs(display) == [0.0])
    bench.wait(lambda: "Transform [arm]: no transform from [arm]" in display.statusText)
    view.scene.fixed_frame = "map"
    bench.wait(lambda: xs(display) == [2.0, 2.0])
    bench.wait(lambda: "Transform [arm]" not in display.statusText)
    assert "Transform [island]" in display.statusText


def test_a_display_makes_no_timer_per_message(bench: SceneBench, show: Callable[..., Any]) -> None:
    from rosglass.qt import QtCore

    display = show(marker(1))
    before = len(display.findChildren(QtCore.QTimer))
    for _ in range(5):
        show(marker(1))
    assert len(display.findChildren(QtCore.QTimer)) == before


def test_markers_of_a_publisher_that_is_gone_are_faded(bench: SceneBench) -> None:
    display = bench.show('MarkerArrayDisplay { topic: "/markers" }')
    publisher = bench.publisher("/markers", "visualization_msgs/MarkerArray")
    assert display.stale
    publisher.publish({"markers": [marker(1)]})
    bench.wait(lambda: not display.stale)
    assert display.root.alpha == 1.0
    publisher.close()
    bench.wait(lambda: display.stale and display.root.alpha < 1.0)
    assert "Data: its publisher is gone" in display.statusText


@pytest.mark.parametrize(("kind", "pixels"), [(1, 100), (3, 100), (0, 20), (6, 100), (7, 100)])
def test_flat_shapes_are_drawn_with_a_warning(
    bench: SceneBench, show: Callable[..., Any], kind: int, pixels: int
) -> None:
    lists = {"points": points((0, 0, 0))} if kind in (6, 7) else {}
    display = show(marker(kind, scale={"x": 2.0, "y": 2.0, "z": 0.0}, **lists))
    # RViz takes flat arrows without a word.
    assert display.statusLevel == ("ok" if kind == 0 else "warn"), display.statusText
    assert ("is 0 in a direction: drawn as 0.0001 m" in display.statusText) == (kind != 0)
    picture = bench.picture().astype(int)
    red = (picture[..., 0] > 60) & (picture[..., 1] < 40) & (picture[..., 2] < 40)
    assert red.sum() > pixels
    show(marker(kind, **lists))
    assert display.statusLevel == "ok"


def test_labels_of_wild_texts_are_bounded(bench: SceneBench, show: Callable[..., Any]) -> None:
    display = show(marker(9, text="wide " * 5000, scale={"z": 1e18}))
    (labels,) = drawables(display)
    assert isinstance(labels, Labels)
    assert len(labels.texts[0]) == Labels.MAX_LENGTH
    assert np.isfinite(bench.picture()).all()
    assert bench.view.problem == ""


def textured_triangle(folder: Path) -> str:
    """Write a triangle with a green texture; return its URI."""
    from PySide6.QtGui import QImage

    image = QImage(2, 2, QImage.Format.Format_RGBA8888)
    image.fill(0xFF00FF00)
    image.save(str(folder / "green.png"))
    (folder / "quad.mtl").write_text("newmtl paint\nKd 1 1 1\nmap_Kd green.png\n")
    (folder / "quad.obj").write_text(
        "mtllib quad.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\n"
        "usemtl paint\nf 1/1 2/2 3/3\n"
    )
    return f"file://{folder}/quad.obj"


def test_markers_with_one_mesh_share_its_texture(
    bench: SceneBench, show: Callable[..., Any], tmp_path: Path
) -> None:
    uri = textured_triangle(tmp_path)
    first = marker(10, mesh_resource=uri, mesh_use_embedded_materials=True)
    # Another colour, which needs a drawable of its own.
    second = {**first, "id": 1, "color": {**RED, "g": 0.5}}
    display = show(first, second)
    # Each has its texture, and its colour over it.
    bench.wait(lambda: len(drawables(display)) == 4)
    bench.picture()
    (renderer,) = renderers_of(bench.view)
    (image,) = device_of(renderer).images.values()
    assert image.users == 2
    show({**first, "action": DELETE})
    bench.picture()
    assert (list(device_of(renderer).images.values()), image.users) == ([image], 1)
    show({**second, "action": DELETE})
    bench.picture()
    assert device_of(renderer).images == {}


def test_meshes_have_their_textures_and_are_made_in_another_thread(
    bench: SceneBench,
    show: Callable[..., Any],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    from rosglass.scene.displays import robot_model as module

    threads = []

    class Shape(module.Shape):
        def __init__(self, *args: Any, **options: Any) -> None:
            threads.append(threading.current_thread())
            super().__init__(*args, **options)

    monkeypatch.setattr(module, "Shape", Shape)
    uri = textured_triangle(tmp_path)
    display = show(
        marker(10, mesh_resource=uri, mesh_use_embedded_materials=True),
        marker(10, 1, mesh_resource=uri),
        marker(10, 2, mesh_resource=f"file://{tmp_path}/gone.obj"),
    )
    bench.wait(lambda: len(drawables(display)) == 3)
    painted, over, plain = drawables(display)
    assert painted.texture[0, 0].tolist() == [0, 255, 0, 255]
    assert painted.color == (1.0, 1.0, 1.0, 1.0)
    assert (over.texture, over.color) == (None, (1.0, 0.0, 0.0, 0.5))
    assert (plain.texture, plain.color) == (None, (1.0, 0.0, 0.0, 1.0))
    assert len(threads) == 1
    assert threading.main_thread() not in threads
    bench.wait(lambda: "shapes/2" in display.status_lines)
    assert "gone.obj: there is no such file" in display.status_lines["shapes/2"].text
    show(marker(1, 2))
    assert display.statusLevel == "ok", display.statusText
    # Sent again in another place, it is not uploaded again.
    again = marker(10, mesh_resource=uri, mesh_use_embedded_materials=True)
    again["pose"] = {"position": {"x": 3.0}}
    show(again)
    assert painted in drawables(display)
    assert 3.0 in xs(display)
    show({**again, "color": {**RED, "g": 0.5}})
    assert painted not in drawables(display)


def test_meshes_of_markers_come_from_web_servers(
    bench: SceneBench, show: Callable[..., Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from web_server import WebServer

    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    with WebServer() as web:
        web.files["/flat.obj"] = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
        display = show(
            marker(10, 0, mesh_resource=f"{web.url}/flat.obj"),
            marker(10, 1, mesh_resource=f"{web.url}/gone.obj"),
        )
        bench.wait(lambda: len(drawables(display)) == 1 and "shapes/1" in display.status_lines)
        text = display.status_lines["shapes/1"].text
        assert f"{web.url}/gone.obj: the server answers 404 Not Found" in text


def test_meshes_of_markers_that_were_missing_are_read_again(
    bench: SceneBench, show: Callable[..., Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from web_server import WebServer

    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setattr("rosglass.scene.displays.scene_frames._ASK_AGAIN_S", 0.1)
    triangle = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
    with WebServer() as web:
        web.files["/flat.obj"] = lambda request: request.send_error(503)
        mesh = marker(10, 0, mesh_resource=f"{web.url}/flat.obj", scale={"x": 1, "y": 1, "z": 0})
        display = show(mesh)
        scene = display.scene
        scene.ask_again_s = 0.1
        bench.wait(lambda: display.statusLevel == "error")
        text = display.status_lines["shapes/0"].text
        assert "503 Service Unavailable; it is retried later, or at once by Reset" in text
        web.files["/flat.obj"] = triangle
        bench.wait(lambda: len(drawables(display)) == 1)
        bench.wait(lambda: display.statusLevel == "warn", lambda: display.statusText)
        assert "is 0 in a direction" in display.status_lines["shapes/0"].text
        # Of what the server does not have, Reset asks again.
        gone = marker(10, 0, mesh_resource=f"{web.url}/gone.obj")
        show(gone)
        bench.wait(lambda: "404 Not Found" in display.statusText)
        web.files["/gone.obj"] = triangle
        bench.view.reset()
        again = bench.robot.create_publisher("/markers", "visualization_msgs/MarkerArray")
        bench.wait(lambda: again.publish({"markers": [gone]}) or len(drawables(display)) == 1)
        assert display.statusLevel == "ok", display.statusText


def test_meshes_that_are_kept_are_bounded() -> None:
    from rosglass.errors import Error
    from rosglass.scene.displays.marker_meshes import MarkerMeshes
    from rosglass.scene.displays.marker_messages import MESH, MarkerRecord

    waiting: list[Any] = []
    loaded: list[str] = []
    meshes = MarkerMeshes(lambda _, done: waiting.append(done), lambda uri, _: loaded.append(uri))

    def of(number: int) -> None:
        list(meshes.of(MarkerRecord(("", number), MESH, ADD, resource=f"{number}.stl")))

    for number in range(1000):
        of(number)
    with pytest.raises(Error, match="more than 1000 meshes are being read"):
        of(1000)
    for done in waiting:
        done(Error("gone"))
    assert len(loaded) == 1000
    # The latest 200 are kept.
    for number in range(800, 1000):
        of(number)
    assert len(waiting) == 1000
    of(799)
    of(1000)
    assert len(waiting) == 1002


def mesh_file(triangles: int) -> Any:
    from rosglass.scene.displays.marker_meshes import _MeshFile

    corners = np.arange(9 * triangles, dtype=np.float32).reshape(-1, 3)
    return _MeshFile([(Mesh(Shape(corners)), None)], "")


def test_bytes_of_meshes_are_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    from rosglass.scene.displays import marker_meshes as markers
    from rosglass.scene.displays.marker_messages import MESH, MarkerRecord

    size = mesh_file(100).size
    assert size == 300 * 36 + 300 * 4
    monkeypatch.setattr(markers, "_MAX_KEPT_BYTES", 2 * size)
    monkeypatch.setattr(markers, "_MAX_MESH_BYTES", 4 * size)
    done: dict[str, Any] = {}
    problems: dict[str, str] = {}
    meshes: Any = None

    def start(_: Any, then: Any) -> None:
        done[uri] = then

    meshes = markers.MarkerMeshes(start, problems.__setitem__)

    def draw(name: str, triangles: int = 100) -> list[Any]:
        nonlocal uri
        uri = name
        record = MarkerRecord(("", 1), MESH, ADD, resource=name)
        assert list(meshes.of(record)) == []
        done[name](mesh_file(triangles))
        return list(meshes.of(record))

    uri = ""
    # What is shown stays, and counts; of the others two are kept.
    shown = [draw("1"), draw("2")]
    for name in "3456":
        draw(name)
    done.clear()
    for uri in "564":
        list(meshes.of(MarkerRecord(("", 1), MESH, ADD, resource=uri)))
    assert list(done) == ["4"], "the others are kept"
    assert set(problems.values()) == {""}
    draw("large", 300)
    assert problems.pop("large") == (
        f"large: with its {3 * size} bytes, all meshes have more than {4 * size}; reduce them"
    )
    # Others may be shown, and this one once there is room.
    shown.append(draw("7"))
    shown.clear()
    assert meshes.forget_failed() == {"large"}
    assert draw("large", 300)
    assert set(problems.values()) == {""}


def test_markers_have_bytes_at_most(
    bench: SceneBench, show: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("rosglass.scene.displays.marker._MAX_SHOWN_BYTES", 100)
    monkeypatch.setattr("rosglass.scene.displays.marker._MAX_LATE_BYTES", 100)
    points = [{"x": float(at)} for at in range(6)]  # 72 bytes
    display = show(marker(8, 1, points=points), marker(8, 2, points=points[:2]))
    assert len(drawables(display)) == 2
    show(marker(8, 2, points=points))
    assert "shapes/2: it is not shown: all markers have more than 0 MiB" in display.statusText
    assert len(drawables(display)) == 1
    show(marker(8, 1, points=points[:2]), marker(8, 2, points=points[:2]))
    assert len(drawables(display)) == 2
    assert display.statusLevel == "ok", display.statusText
    late = [marker(8, at, points=points, header={"frame_id": "nowhere"}) for at in (3, 4)]
    show(*late)
    text = "shapes/3: it was dropped: more than 1000 markers, or 0 MiB, wait for transforms"
    assert text in display.statusText
    assert "shapes/4: it was dropped" not in display.statusText
