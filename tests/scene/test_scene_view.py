"""The item SceneView: what it draws, when, and what it says where it cannot."""

from __future__ import annotations

import itertools
import os
import subprocess
import sys
import threading
import time
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from inside import (
    device_of,
    endpoint_of,
    frames_of,
    on_device,
    queue_of,
    renderers_of,
    runtime_of,
    watch_frames,
    watch_uploads,
)

if TYPE_CHECKING:
    from pathlib import Path

    from conftest import SceneBench

STAMP = {"sec": 0, "nanosec": 0}


def has_color(picture: Any, red: int, green: int, blue: int, tolerance: int = 40) -> int:
    """Return how many pixels have a colour."""
    off = np.abs(picture.astype(int) - (red, green, blue)).max(axis=2)
    return int((off <= tolerance).sum())


def shaded(picture: Any, channel: int) -> Any:
    """Return which pixels are red (0), green (1) or blue (2), in light or shade."""
    others = np.delete(picture, channel, axis=2).max(axis=2)
    return (picture[..., channel] > 70) & (others < 30)


def test_axes_are_drawn_in_the_middle(bench: SceneBench) -> None:
    bench.load("AxesDisplay { length: 2 }")
    picture = bench.picture()
    assert tuple(picture[5, 5]) == (48, 48, 48)
    for channel in range(3):
        assert shaded(picture, channel).sum() > 100
    # Blue, z, points up from the middle.
    rows, columns = np.nonzero(shaded(picture, 2))
    assert rows.min() < 120
    assert abs(columns.mean() - 200) < 5


def test_nothing_is_drawn_while_nothing_changes(bench: SceneBench) -> None:
    view = bench.load("AxesDisplay {}")
    bench.wait(lambda: bench.drawn() > 0)
    bench.picture()
    before = bench.drawn()
    bench.wait.nothing_happens(0.5)
    assert bench.drawn() == before
    view.scene.displays[0].length = 3
    bench.wait(lambda: bench.drawn() > before)


def test_the_window_is_drawn_once_with_a_new_frame(bench: SceneBench) -> None:
    axes = bench.show("AxesDisplay {}")
    frames: list[int] = []
    bench.wait(lambda: bench.drawn() > 0)
    bench.picture()
    bench.wait.nothing_happens(0.1)  # the grabbed frame is followed by one more
    bench.window.frameSwapped.connect(lambda: frames.append(bench.drawn()))
    for length in (2, 3, 4):
        before = bench.drawn()
        axes.length = length
        bench.wait(lambda before=before: bench.drawn() > before)
        bench.wait.nothing_happens(0.1)
    assert frames == sorted(set(frames))
    assert len(frames) == 3


_PROBLEM = """
import sys, time
from PySide6.QtGui import QGuiApplication
from PySide6.QtQuick import QQuickView
import rosglass.scene
from rosglass.qml import Session, install

app = QGuiApplication(["problem"])
rosglass.scene.register()
window = QQuickView()
session = Session("local://problem")
install(window.engine(), session)
window.setSource("file://" + sys.argv[1])
window.show()
view, until = window.rootObject(), time.monotonic() + 30
while not (view.problem or view.pictures_drawn()) and time.monotonic() < until:
    app.processEvents()
print(view.problem)
session.close()
"""


def test_missing_graphics_interface_is_reported(tmp_path: Path) -> None:
    file = tmp_path / "View.qml"
    file.write_text("import RosScene 1.0\nSceneView {}")
    env = {**os.environ, "QT_QPA_PLATFORM": "offscreen", "QT_QUICK_BACKEND": "software"}
    command = [sys.executable, "-c", _PROBLEM, str(file)]
    ended = subprocess.run(command, env=env, stdout=subprocess.PIPE, text=True, check=True)
    assert "Unset QT_QUICK_BACKEND; without a graphics card, Mesa's llvmpipe" in ended.stdout


def test_an_old_opengl_is_a_problem_in_words(app: Any, tmp_path: Path) -> None:
    file = tmp_path / "View.qml"
    file.write_text("import RosScene 1.0\nSceneView { width: 200; height: 100; AxesDisplay {} }")
    mesa = {"__GLX_VENDOR_LIBRARY_NAME": "mesa", "LIBGL_ALWAYS_SOFTWARE": "1"}
    old = {"MESA_GL_VERSION_OVERRIDE": "2.1", "MESA_GLSL_VERSION_OVERRIDE": "120"}
    command = [sys.executable, "-c", _PROBLEM, str(file)]
    ended = subprocess.run(
        command, env={**os.environ, **mesa, **old}, capture_output=True, text=True, check=True
    )
    assert "cannot draw: it needs OpenGL 3.3 or OpenGL ES 3.0, and Qt has an older" in ended.stdout
    assert "Traceback" not in ended.stderr


def test_a_scene_that_changes_all_the_time_leaves_frames_to_qml(
    bench: SceneBench, monkeypatch: pytest.MonkeyPatch
) -> None:
    from scene_mouse import Hand

    from rosglass.scene.render.renderer import SceneRenderer

    draw = SceneRenderer.render

    def draw_slowly(renderer: SceneRenderer, commands: Any) -> None:
        time.sleep(0.05)  # as long as three frames of QML
        draw(renderer, commands)

    monkeypatch.setattr(SceneRenderer, "render", draw_slowly)

    view = bench.load(
        "AxesDisplay {}\n"
        'Rectangle { width: 50; height: 50; color: "red"\n'
        "NumberAnimation on rotation { from: 0; to: 360; duration: 999; loops: -1 } }"
    )
    (axes,) = view.scene.displays
    frames: list[int] = []

    def change() -> None:
        frames.append(bench.drawn())
        axes.length = 1 + len(frames) % 2
        view.camera_moved()

    def share(count: int) -> float:
        """Return the share of the window's frames that show a new frame of the scene."""
        frames.clear()
        bench.wait(lambda: len(frames) > count)
        return (frames[-1] - frames[0]) / (len(frames) - 1)

    bench.window.frameSwapped.connect(change)
    bench.wait(lambda: len(frames) > 5)
    if not view.scene.draws_in_software:
        pytest.skip("a graphics card draws, which leaves the time to QML")
    share(5)
    assert share(40) < 0.75
    # What the user drags is drawn at once.
    hand = Hand(bench)
    hand.press((200, 150))
    bench.wait(lambda: view.tools.holds_mouse)
    share(5)
    assert share(20) == 1.0
    hand.release((200, 150))
    share(5)
    assert share(40) < 0.75
    bench.window.frameSwapped.disconnect(change)
    # The last change is drawn, too.
    axes.length = 3
    before = bench.drawn()
    bench.wait(lambda: bench.drawn() > before)


def test_items_are_drawn_over_it_and_shine_through_from_below(bench: SceneBench) -> None:
    view = bench.load(
        'background: "transparent"; AxesDisplay {}\n'
        'Rectangle { z: -1; anchors.fill: parent; color: "#00ffff" }\n'
        'Rectangle { width: 50; height: 50; color: "#ff00ff" }'
    )
    picture = bench.picture()
    assert tuple(picture[10, 10]) == (255, 0, 255)
    assert view.problem == ""


def test_two_views_show_one_scene_from_two_sides(bench: SceneBench) -> None:
    view = bench.load(
        "id: main; AxesDisplay { length: 2; radius: 0.3 }\n"
        'SceneView { objectName: "above"; width: 100; height: 100; scene: main.scene\n'
        'view: "TopDownOrtho"; background: "#101010" }'
    )
    above = view.findChild(type(view), "above")
    assert above.scene is view.scene
    assert above.fixedFrame == "map"
    picture = bench.picture()
    part, rest = picture[:100, :100], picture[100:]
    assert tuple(part[5, 5]) == (16, 16, 16)
    assert shaded(part, 0).sum() > 10
    assert shaded(rest, 2).sum() > 100
    view.scene.displays[0].enabled = False
    picture = bench.picture()
    assert not (shaded(picture, 0) | shaded(picture, 1)).any()


def test_a_view_whose_scene_is_gone_shows_nothing_old(bench: SceneBench) -> None:
    from PySide6.QtCore import QObject

    from rosglass.qt import is_alive, send_deferred_deletes

    view = bench.load(
        'Loader { id: loader; objectName: "loader"\n'
        "sourceComponent: Component { SceneView { AxesDisplay { length: 2; radius: 0.3 } } } }\n"
        'SceneView { objectName: "other"; anchors.fill: parent\n'
        "scene: loader.item ? loader.item.scene : null }"
    )
    other = view.findChild(type(view), "other")
    assert shaded(bench.picture(), 2).sum() > 100
    assert other.problem == ""
    view.findChild(QObject, "loader").setProperty("active", False)
    send_deferred_deletes()
    assert other.problem == "The scene was that of another view, which is gone: nothing is shown."
    assert not shaded(bench.picture(), 2).any()
    bench.wait(lambda: is_alive(other.scene))
    assert other.scene.displays == []
    assert "which is gone" in other.problem
    # It is a view like others again.
    other.scene.add("Axes", length=2, radius=0.3)
    bench.wait(lambda: shaded(bench.picture(), 2).sum() > 100)
    other.setProperty("scene", view.scene)
    assert other.problem == ""


def test_frame_that_cannot_be_made_is_a_problem_until_one_can(
    bench: SceneBench, monkeypatch: Any, caplog: Any
) -> None:
    view = bench.load("AxesDisplay {}")
    bench.picture()
    with monkeypatch.context() as patch:
        patch.setattr(view, "_drawables", lambda: 1 / 0)
        view.update()
        bench.picture()
        bench.wait(lambda: view.problem)
        bench.wait.nothing_happens(0.8)
        assert view.problem == "the 3D view cannot draw: division by zero"
        assert "division by zero" in caplog.text
    # The scene does not remember it, without a node either.
    bench.session.shutdown()
    view.update()
    bench.picture()
    bench.wait(lambda: not view.problem)


def test_a_destroyed_view_frees_what_it_made_on_the_device(bench: SceneBench) -> None:
    from PySide6.QtCore import QObject

    from rosglass.qt import send_deferred_deletes

    view = bench.load(
        'Loader { objectName: "loader"; anchors.fill: parent\n'
        "sourceComponent: Component { SceneView { GridDisplay {} } } }"
    )
    loader = view.findChild(QObject, "loader")
    bench.picture()
    (renderer,) = renderers_of(loader.property("item"))
    assert device_of(renderer) is not None
    loader.setProperty("active", False)
    # The scene graph lets go of it before the item is gone.
    bench.picture()
    send_deferred_deletes()
    bench.wait(lambda: device_of(renderer) is None, timeout=5)


def test_a_view_that_is_destroyed_does_not_wait_for_a_file_that_is_read(
    bench: SceneBench, monkeypatch: pytest.MonkeyPatch
) -> None:
    from PySide6.QtCore import QObject

    from rosglass.qt import is_alive, send_deferred_deletes

    monkeypatch.setattr("rosglass.comm.executor._CLOSE_TIMEOUT_S", 20.0)
    view = bench.load('Loader { objectName: "loader"; sourceComponent: SceneView {} }')
    loader = view.findChild(QObject, "loader")
    scene = loader.property("item").scene
    bench.wait(lambda: scene.node is not None)
    reads, gone = threading.Event(), threading.Event()
    was_gone: list[bool] = []
    shown: list[Any] = []

    def read(_: Any) -> None:
        reads.set()
        was_gone.append(gone.wait(10))

    scene.load(read, shown.append)
    assert reads.wait(10)
    loader.setProperty("active", False)
    send_deferred_deletes()
    assert not is_alive(scene)
    gone.set()
    bench.wait(lambda: was_gone)
    bench.wait.settled(bench.session)
    assert (was_gone, shown) == ([True], [])


def test_a_display_in_a_frame_follows_it(bench: SceneBench) -> None:
    axes = bench.show('AxesDisplay { frame: "tool"; length: 0.3; radius: 0.1 }')
    bench.wait(lambda: "no transform from [tool]" in axes.statusText)
    assert axes.statusLevel == "error"
    assert not shaded(bench.picture(), 2).any()

    def send() -> bool:
        bench.move("tool", (0, 0, 2), 7)
        return axes.statusLevel == "ok"

    bench.wait(send)
    rows, _ = np.nonzero(shaded(bench.picture(), 2))
    assert len(rows)
    assert rows.mean() < 110


def test_display_of_a_frame_fades_once_the_frame_is_not_published(
    bench: SceneBench, monkeypatch: pytest.MonkeyPatch
) -> None:
    from rosglass.scene.displays import display as displays

    monkeypatch.setattr(displays, "_FRAME_TIMEOUT_S", 3600.0)
    axes = bench.show('AxesDisplay { frame: "tool" }')
    bench.wait(lambda: bench.move("tool", (0, 0, 2), 7) or axes.statusLevel == "ok")
    bench.moving.close()
    bench.wait(lambda: "[tool] may be somewhere else" in axes.statusText)
    assert axes.root.alpha < 1.0


def test_a_broken_display_keeps_no_other_from_fading(
    bench: SceneBench, monkeypatch: pytest.MonkeyPatch
) -> None:
    from rosglass.scene.displays import display as displays

    monkeypatch.setattr(displays, "_FRAME_TIMEOUT_S", 0.1)
    view = bench.load('AxesDisplay {} AxesDisplay { frame: "tool" }')
    broken, axes = view.scene.displays
    monkeypatch.setattr(broken, "followed_frames", lambda: 1 / 0)
    bench.wait(lambda: bench.move("tool", (0, 0, 2), 7) or axes.statusLevel == "ok")
    bench.wait(lambda: "[tool] may be somewhere else" in axes.statusText)
    assert "ZeroDivisionError" in broken.statusText


def test_a_broken_display_keeps_no_other_from_reading_its_files_again(
    bench: SceneBench, monkeypatch: pytest.MonkeyPatch
) -> None:
    view = bench.load("AxesDisplay {} AxesDisplay {}")
    broken, other = view.scene.displays
    read: list[str] = []
    monkeypatch.setattr(broken, "on_files", lambda _: 1 / 0)
    monkeypatch.setattr(other, "on_files", read.extend)
    view.scene._on_asked_again(["http://robot/arm.stl"])
    assert read == ["http://robot/arm.stl"]
    assert "ZeroDivisionError" in broken.statusText


def test_transforms_in_the_namespace_of_the_node_have_publishers(
    bench: SceneBench, monkeypatch: pytest.MonkeyPatch
) -> None:
    from rosglass import Time
    from rosglass.scene.displays import display as displays
    from rosglass.tf import Transform, TransformBroadcaster

    monkeypatch.setattr(displays, "_UNPUBLISHED_TIMEOUT_S", -1.0)
    axes = bench.show('AxesDisplay { frame: "tool" }')
    bench.session.shutdown()
    bench.session.init("view", "/robot1")
    broadcaster = TransformBroadcaster(bench.robot, "/robot1")
    pose = Transform((0, 0, 2), (0, 0, 0, 1), Time.from_parts(7, 0), "map", "tool")
    bench.wait(lambda: broadcaster.send_transform(pose) or axes.statusLevel == "ok")
    bench.wait.nothing_happens(1.2)
    assert (axes.root.alpha, axes.statusLevel) == (1.0, "ok"), axes.statusText
    broadcaster.close()
    bench.wait(lambda: "[tool] may be somewhere else" in axes.statusText)


def test_a_path_is_shown_and_fades_when_its_publisher_is_gone(bench: SceneBench) -> None:
    path = bench.show('PathDisplay { topic: "/plan"; lineStyle: "Billboards"; lineWidth: 0.2 }')
    publisher = bench.robot.create_publisher("/plan", "nav_msgs/Path")
    poses = [
        {"pose": {"position": {"x": x, "y": 0.0, "z": 0.0}, "orientation": {"w": 1.0}}}
        for x in (-3.0, 0.0, 3.0)
    ]

    def send() -> bool:
        publisher.publish({"header": {"frame_id": "map"}, "poses": poses})
        return bool(path.received)

    bench.wait(send)
    bench.wait(lambda: path.statusLevel == "ok", lambda: path.statusText)
    assert "messages received" in path.statusText
    bright = has_color(bench.picture(), 25, 255, 0)
    assert bright > 100
    publisher.close()
    gone = "its publisher is gone; the last message is of"
    bench.wait(lambda: gone in path.statusText, lambda: path.statusText)
    assert path.statusLevel == "warn"
    assert has_color(bench.picture(), 25, 255, 0) == 0


def test_a_topic_of_another_type_is_an_error_in_words(bench: SceneBench) -> None:
    path = bench.show('PathDisplay { topic: "/scan" }')
    publisher = bench.robot.create_publisher("/scan", "sensor_msgs/LaserScan")

    def send() -> bool:
        publisher.publish({})
        return path.statusLevel == "error"

    bench.wait(send)
    assert "the topic's type is sensor_msgs/msg/LaserScan, not nav_msgs/Path" in path.statusText


@pytest.mark.parametrize(
    ("settings", "error"),
    [
        ({"topic": "/a b"}, "expected the name of a topic"),
        ({"color": "no colour"}, "expected a colour"),
        ({"alpha": 2.0}, "is not from 0.0 to 1.0"),
        ({"colour": "red"}, "has no property 'colour'; did you mean"),
    ],
)
def test_python_gets_errors_for_bad_settings(
    bench: SceneBench, settings: dict[str, Any], error: str
) -> None:
    from rosglass.errors import Error

    view = bench.load()
    with pytest.raises(Error, match=error):
        view.scene.add("Path", **settings)
    assert view.scene.displays == []


def test_invalid_displays_and_views_raise_in_python(bench: SceneBench) -> None:
    from rosglass.errors import Error

    view = bench.load("GridDisplay {}")
    scene = view.scene
    (grid,) = scene.displays
    for call, error in (
        (lambda: scene.add(5), "expected a display, or the name of its type, e.g. 'Grid', got 5"),
        (lambda: scene.adopt(None), "expected a display, .* got None"),
        (lambda: scene.remove("Grid"), "'Grid' is not in this scene, whose displays are"),
        (lambda: scene.move(grid, before="Grid"), "'Grid' is not in this scene"),
        (lambda: grid.set_status("Topic", "bad", ""), "level: expected one of ok, warn, error"),
        (lambda: view.show_view("Orbit"), "a view controller; select_view"),
        (lambda: view.show_saved_view("home"), "there is no saved view 'home'; there are 0"),
        (lambda: view.save_view(None), "name: expected a text, got None"),
        (lambda: view.tools.select(None), "the name, type or class id of a tool, got None"),
        (lambda: view.tools.remove("Measure"), "tool 'Measure' is not in this view"),
    ):
        with pytest.raises(Error, match=error):
            call()
    assert scene.displays == [grid]
    assert view.camera().focus == (0.0, 0.0, 0.0)


def test_displays_are_added_and_removed_from_python(bench: SceneBench) -> None:
    from rosglass.errors import Error

    view = bench.load()
    grid = view.scene.add("rviz_default_plugins/Grid", "Floor", planeCellCount=4)
    assert view.scene.find("Floor") is grid
    assert has_color(bench.picture(), 104, 104, 106, 20) > 50
    view.scene.remove(grid)
    assert has_color(bench.picture(), 104, 104, 106, 20) == 0
    with pytest.raises(Error, match="is not in this scene"):
        view.scene.remove(grid)
    with pytest.raises(Error, match="there is no type of displays 'Gird'"):
        view.scene.add("Gird")


def test_an_error_in_a_setting_names_it(bench: SceneBench, caplog: Any) -> None:
    bench.load("AxesDisplay { length: -1 }")
    assert "display 'Axes': length: -1.0 is not from 0.0001" in caplog.text


def test_made_and_destroyed_many_times(bench: SceneBench) -> None:
    for _ in range(5):
        bench.load('GridDisplay {} AxesDisplay {} PathDisplay { topic: "/plan" } TFDisplay {}')
        bench.picture()
        assert bench.view.problem == ""


def test_picking_finds_the_nearest_drawable(bench: SceneBench) -> None:
    from rosglass.scene.render.drawing import Mesh, Points
    from rosglass.scene.render.matrices import instance_matrix
    from rosglass.scene.render.mesh_shapes import BOX

    view = bench.load()
    box, cloud = Mesh(BOX), Points()
    box.owner, cloud.owner = "box", "cloud"
    cloud.set_points([[0, 0, 1.5], [5, 5, 0], [float("nan"), 0, 0]])
    view.scene.root.add(box, cloud)
    middle = view.camera().project((0, 0, 0))
    hit = view.pick(middle.x, middle.y)
    assert hit.drawable is box
    assert np.abs(np.array(hit.point)).max() == pytest.approx(0.5)
    above = view.camera().project((0, 0, 1.5))
    hit = view.pick(above.x + 1, above.y)
    assert (hit.drawable, hit.number) == (cloud, 0)
    assert hit.point == pytest.approx((0, 0, 1.5))
    assert view.pick(2, 2) is None
    box.pose = instance_matrix((50, 50, 0))
    assert view.pick(middle.x, middle.y) is None


def test_data_ahead_of_its_transform_is_not_an_error_for_a_second(bench: SceneBench) -> None:
    path = bench.show('PathDisplay { topic: "/plan" }')
    publisher = bench.publisher("/plan", "nav_msgs/Path")

    def send(sec: int) -> None:
        before = path.received
        header = {"frame_id": "odom", "stamp": {"sec": sec, "nanosec": 0}}
        publisher.publish({"header": header})
        bench.wait(lambda: path.received > before)

    def move(sec: int) -> None:
        bench.move("odom", (0, 0, 0), sec)

    send(5)
    assert "no transform from [odom]" in path.statusText
    move(5)
    bench.wait(lambda: path.statusLevel == "ok")
    send(6)
    assert path.statusLevel == "ok"
    bench.wait.nothing_happens(1.1)
    send(7)
    assert path.statusLevel == "error"
    move(7)
    bench.wait(lambda: path.statusLevel == "ok")


def test_a_display_that_qml_destroys_leaves_the_list(bench: SceneBench) -> None:
    from PySide6.QtCore import QObject

    view = bench.load(
        "property int count: scene.displayList.length\n"
        'Instantiator { objectName: "grids"; model: 2; GridDisplay { } }'
    )
    bench.wait(lambda: view.property("count") == 2)
    view.findChild(QObject, "grids").setProperty("model", 1)
    bench.wait(lambda: view.property("count") == 1)


def test_python_keeps_the_items_around_a_view_that_is_destroyed(bench: SceneBench) -> None:
    from rosglass.qt import is_alive, send_deferred_deletes

    view = bench.load(
        "Loader { active: parent.fixedFrame === 'map'; anchors.fill: parent\n"
        "sourceComponent: Component { SceneView { AxesDisplay {} } } }"
    )
    bench.picture()
    view.fixedFrame = "odom"
    send_deferred_deletes()
    assert is_alive(view)
    assert is_alive(bench.window)
    bench.picture()


def test_a_view_that_leaves_its_window_has_nothing_on_its_device(bench: SceneBench) -> None:
    from PySide6.QtCore import QObject
    from PySide6.QtQuick import QQuickItem

    view = bench.load('SceneView { objectName: "inner"; anchors.fill: parent; AxesDisplay {} }')
    bench.picture()
    inner = view.findChild(QObject, "inner")
    kept = renderers_of(inner)
    assert [device_of(one) is not None for one in kept] == [True]
    # The window may be gone, with its device, before the item is destroyed.
    QQuickItem.setParentItem(inner, None)
    assert [device_of(one) for one in kept] == [None]
    QQuickItem.setParentItem(inner, view)
    bench.picture()
    assert device_of(renderers_of(inner)[-1]) is not None


def test_frames_fade_one_by_one_and_all_when_transforms_stop(bench: SceneBench) -> None:
    from rosglass.scene.render.drawing import Mesh

    view = bench.load("TFDisplay { frameTimeout: 3600; showArrows: false }")
    (frames,) = view.scene.displays
    bench.place("mast", at=(1, 0, 0))
    bench.place("hand", at=(1, 0, 0), parent="arm")
    bench.move("arm", (2, 0, 0), 1)

    def opacities() -> dict[str, float]:
        meshes = [one for one, _, _ in frames.root.drawables() if isinstance(one, Mesh)]
        alphas = meshes[0].instances["rgba"][::3, 3].tolist() if meshes else []
        return dict(zip(frames.frames, alphas, strict=True))

    bench.wait(lambda: opacities() == {"arm": 1.0, "hand": 1.0, "map": 1.0, "mast": 1.0})
    # What is fixed on a frame fades with it.
    bench.wait(lambda: view.scene.seconds_without_update("arm") > 0.5)
    frames.frameTimeout = 2 * view.scene.seconds_without_update("arm")
    assert 0.0 < opacities()["hand"] < 1.0
    assert opacities()["hand"] == opacities()["arm"]
    assert opacities()["mast"] == 1.0
    assert "[arm] and 1 more may be somewhere else" in frames.statusText
    bench.wait(lambda: frames.frames == ["map", "mast"])
    # Nothing moves any more: nothing is drawn.
    bench.picture()
    before = bench.drawn()
    bench.wait.nothing_happens(1.2)
    assert bench.drawn() == before


def test_frames_that_do_not_move_follow_another_fixed_frame(bench: SceneBench) -> None:
    from rosglass.scene.render.drawing import Mesh

    view = bench.load("TFDisplay { showArrows: false }")
    (frames,) = view.scene.displays
    bench.place("mast", at=(3, 0, 0))

    def places() -> dict[str, float]:
        (axes,) = (one for one, _, _ in frames.root.drawables() if isinstance(one, Mesh))
        # The second of three cylinders stands on the origin, along y.
        xs = axes.instances["matrix"].reshape(-1, 4, 4)[1::3, 3, 0].tolist()
        return dict(zip(frames.frames, xs, strict=True))

    bench.wait(lambda: frames.frames == ["map", "mast"])
    assert places() == {"map": 0.0, "mast": 3.0}
    view.fixedFrame = "mast"
    assert places() == {"map": -3.0, "mast": 0.0}


def test_frames_are_updated_at_the_interval_and_at_once_after_it_is_0(bench: SceneBench) -> None:
    from rosglass.scene.render.drawing import Mesh

    frames = bench.show("TFDisplay { updateInterval: 1000; showArrows: false }")
    sent = itertools.count(1)

    def move(x: float) -> list[str]:
        bench.move("arm", (x, 0, 0), next(sent))
        return frames.frames

    def places() -> list[float]:
        (axes,) = (one for one, _, _ in frames.root.drawables() if isinstance(one, Mesh))
        return axes.instances["matrix"].reshape(-1, 4, 4)[1::3, 3, 0].tolist()

    frames.updateInterval = 0
    bench.wait(lambda: move(1.0) == ["arm", "map"])
    frames.updateInterval = 1000
    bench.wait(lambda: places() == [1.0, 0.0])
    move(2.0)
    # Longer than between two looks at frames that fade.
    bench.wait.nothing_happens(1.2)
    assert places() == [1.0, 0.0]
    frames.updateInterval = 0
    assert places() == [2.0, 0.0]
    bench.wait(lambda: move(3.0) and places() == [3.0, 0.0])


def test_a_static_frame_is_shown_after_the_interval_in_which_it_came(bench: SceneBench) -> None:
    frames = bench.show("TFDisplay { updateInterval: 1 }")

    def add(frame: str) -> None:
        bench.place(frame, at=(1, 0, 0))

    add("arm")
    bench.wait(lambda: frames.frames == ["arm", "map"])
    add("hand")
    bench.wait(lambda: frames.frames == ["arm", "hand", "map"])


def test_displays_of_frames_fade_without_a_node(bench: SceneBench) -> None:
    view = bench.load('TFDisplay { frameTimeout: 2 } AxesDisplay { frame: "arm" } GridDisplay {}')
    frames, axes, grid = view.scene.displays
    sent = itertools.count(1)

    def move() -> bool:
        bench.move("arm", (1, 0, 0), next(sent))
        return frames.frames == ["arm", "map"] and axes.statusLevel == "ok"

    bench.wait(move)
    assert (frames.root.alpha, axes.root.alpha) == (1.0, 1.0)
    bench.session.url = "zenho://robot"
    bench.wait(lambda: frames.root.alpha < 1.0 and axes.root.alpha < 1.0)
    assert "may be somewhere else: the robot is not connected" in frames.statusText
    assert "[arm] may be somewhere else: the robot is not connected" in axes.statusText
    assert (frames.statusLevel, axes.statusLevel) == ("warn", "warn")
    assert (grid.root.alpha, grid.statusLevel) == (1.0, "ok")
    assert frames.frames == ["arm", "map"]
    bench.session.url = bench.url
    bench.wait(lambda: move() and frames.root.alpha == axes.root.alpha == 1.0)
    assert (frames.statusLevel, axes.statusLevel) == ("ok", "ok")


def test_no_frame_fades_while_a_simulation_is_paused(bench: SceneBench, monkeypatch: Any) -> None:
    from rosglass import Time
    from rosglass.scene.displays import display as displays
    from rosglass.scene.displays import scene_frames as scenes

    monkeypatch.setattr(displays, "_FRAME_TIMEOUT_S", 1.0)
    monkeypatch.setattr(scenes, "_PAUSED_S", 0.3)
    view = bench.load('TFDisplay { frameTimeout: 1 } AxesDisplay { frame: "arm" }')
    frames, axes = view.scene.displays
    clock = bench.robot.create_publisher("/clock", "rosgraph_msgs/msg/Clock")
    view.scene.node.parameters.set({"use_sim_time": True})
    bench.wait(clock.subscription_count)
    passed = itertools.count(1)

    def run() -> None:
        clock.publish({"clock": {"sec": 10, "nanosec": next(passed)}})

    def move() -> bool:
        bench.move("arm", (1, 0, 0), Time.from_parts(10, next(passed)))
        return frames.frames == ["arm", "map"] and axes.statusLevel == "ok"

    run()
    bench.wait.settled(bench.session)
    bench.wait(move)
    bench.wait.nothing_happens(2.5)
    assert frames.frames == ["arm", "map"]
    assert (axes.root.alpha, axes.statusLevel) == (1.0, "ok"), axes.statusText
    # It goes on, without what sends the transform.
    bench.wait(lambda: run() or axes.root.alpha < 1.0)
    bench.wait(lambda: run() or frames.frames == ["map"])
    bench.wait(lambda: move() and axes.root.alpha == 1.0)
    # A simulation that is gone is not paused.
    clock.close()
    bench.wait(lambda: axes.root.alpha < 1.0)


def test_the_camera_follows_a_frame_that_stands_still(bench: SceneBench) -> None:
    view = bench.load("TFDisplay {}")
    bench.place("mast", at=(3, 0, 0))
    bench.wait(lambda: view.scene.displays[0].frames == ["map", "mast"])
    bench.wait.settled(bench.session)
    # With the slash of RViz 1.
    assert view.setViewSetting("Target Frame", "/mast") == ""
    assert view.controller.get("Target Frame") == "mast"
    assert view.controller.get("Focal Point") == pytest.approx((-3, 0, 0))
    assert view.camera().focus == pytest.approx((0, 0, 0))
    view.resetView()
    assert view.camera().focus == pytest.approx((3, 0, 0))
    assert view.problem == ""
    view.controller.target_frame = "mats"
    assert "Target Frame: " in view.problem
    assert "mats" in view.problem
    assert view.camera().focus == pytest.approx((3, 0, 0))
    view.controller.target_frame = "<Fixed Frame>"
    assert view.problem == ""


def test_a_silent_link_above_the_fixed_frame_is_of_no_account(bench: SceneBench) -> None:
    from rosglass.tf import Transform, TransformBroadcaster

    view = bench.load()
    view.fixedFrame = "odom"
    broadcaster = TransformBroadcaster(bench.robot)
    still = (0, 0, 0), (0, 0, 0, 1)
    broadcaster.send_transform(Transform(*still, bench.robot.now(), "map", "odom"))

    def move() -> None:
        stamp = bench.robot.now()
        broadcaster.send_transform(Transform(*still, stamp, "odom", "base"))

    move()
    bench.wait(lambda: move() or view.scene.seconds_without_update("map") > 1.5)
    assert view.scene.seconds_without_update("base") < 1.0


def test_data_of_a_publisher_that_is_gone_stays_so_beside_another(bench: SceneBench) -> None:
    from rosglass.comm.qos import QoS

    path = bench.show('PathDisplay { topic: "/plan" }')

    def publish(qos: Any = 1) -> Any:
        publisher = bench.publisher("/plan", "nav_msgs/Path", qos)
        before = path.received
        publisher.publish({"header": {"frame_id": "map"}})
        bench.wait(lambda: path.received > before and path.statusLevel == "ok")
        return publisher

    first = publish()
    first.close()
    bench.wait(lambda: "its publisher is gone" in path.statusText)
    second = bench.publisher("/plan", "nav_msgs/Path")
    bench.wait.nothing_happens(0.3)
    assert "its publisher is gone" in path.statusText
    second.close()
    # The same connection again: what is latched is valid, what is not may be old.
    for qos, level in ((1, "warn"), (QoS.latched(), "ok")):
        publisher = publish(qos)
        path._outdated = True
        path._on_connection()
        bench.wait.nothing_happens(0.2)
        assert path.statusLevel == level, path.statusText
        publisher.close()


def test_displays_of_a_hidden_group_show_nothing_old_later(bench: SceneBench) -> None:
    from rosglass.scene.view.display_configs import GroupDisplay

    view = bench.load()
    group = view.scene.add(GroupDisplay(view.scene, runtime_of(view.scene)))
    path = view.scene.TYPES["Path"](view.scene, runtime_of(view.scene))
    path.group, path.topic = group, "/plan"
    view.scene.adopt(path)
    publisher = bench.publisher("/plan", "nav_msgs/Path")
    publisher.publish({"header": {"frame_id": "map"}})
    bench.wait(lambda: path.statusLevel == "ok" and list(path.root))
    group.enabled = False
    assert not list(path.root)
    assert path.statusText == ""


@pytest.mark.parametrize("change", ["topic", "enabled"])
def test_nothing_that_is_on_its_way_is_shown_after_a_change(bench: SceneBench, change: str) -> None:
    from rosglass.qt import QtCore

    path = bench.show('PathDisplay { topic: "/plan" }')
    publisher = bench.robot.create_publisher("/plan", "nav_msgs/Path")
    bench.wait(lambda: endpoint_of(path) is not None and publisher.subscription_count())
    queue = queue_of(path)
    publisher.publish({"header": {"frame_id": "map"}})
    while not queue.received:
        QtCore.QThread.msleep(10)
    if change == "topic":
        path.topic = "/other"
    else:
        path.enabled = False
        path.enabled = True
    bench.wait.nothing_happens(0.2)
    assert path.received == 0
    assert not list(path.root)
    # It receives again.
    path.topic = "/plan"
    bench.wait(lambda: publisher.publish({"header": {"frame_id": "map"}}) or path.received)


def test_a_fixed_frame_that_does_not_exist_is_a_problem(bench: SceneBench) -> None:
    view = bench.load()
    bench.place("mast", at=(1, 0, 0))
    bench.wait(view.scene.frames)
    view.fixedFrame = "mapp"
    bench.wait(lambda: view.problem)
    assert "the fixed frame [mapp] does not exist; did you mean map?" in view.problem
    view.fixedFrame = "map"
    bench.wait(lambda: not view.problem)


def test_a_problem_of_a_fixed_frame_ends_with_the_node(bench: SceneBench) -> None:
    view = bench.load()
    bench.place("mast", at=(1, 0, 0))
    bench.wait(view.scene.frames)
    view.fixedFrame = "mapp"
    bench.wait(lambda: "does not exist" in view.problem)
    bench.session.shutdown()
    bench.wait(lambda: view.problem == "")


def test_transforms_that_are_not_received_are_a_problem(
    bench: SceneBench, monkeypatch: Any
) -> None:
    from rosglass.errors import Error

    def refuse(*_: Any) -> None:
        raise Error("no memory for /tf")

    monkeypatch.setattr("rosglass.tf.TransformListener", refuse)
    view = bench.load()
    bench.wait(lambda: view.problem == "transforms are not received: no memory for /tf")


def test_two_robots_of_one_name_are_said(bench: SceneBench) -> None:
    import rosglass

    view = bench.load('PathDisplay { topic: "/plan" } PathDisplay { topic: "/plan" }')
    path, other = view.scene.displays
    twin = rosglass.connect(bench.url, "robot")
    for node in (bench.robot, twin):
        node.create_publisher("/plan", "nav_msgs/Path")
        node.create_publisher("/tf", "tf2_msgs/TFMessage")
    text = "{}: 2 publishers of nodes called /robot, a name of 2 nodes, are mixed".format
    bench.wait(lambda: text("/plan") in path.statusText, lambda: path.statusText)
    assert path.statusLevel == "warn"
    bench.wait(lambda: text("/tf") in view.problem)
    other.enabled = False
    bench.wait.settled(bench.session)
    assert other.statusText == ""
    twin.close()
    bench.wait(lambda: "are mixed" not in path.statusText + view.problem)


def test_an_error_of_a_display_is_forgotten_when_it_draws_again(
    bench: SceneBench, monkeypatch: Any
) -> None:
    view = bench.load("GridDisplay {}")
    (grid,) = view.scene.displays
    with monkeypatch.context() as patch:
        patch.setattr(grid, "on_fixed_frame", lambda: 1 / 0)
        view.fixedFrame = "odom"
        assert "Display: ZeroDivisionError" in grid.statusText
        assert grid.statusLevel == "error"
    view.fixedFrame = "map"
    assert grid.statusLevel == "ok", grid.statusText


def test_a_jump_of_time_and_reset_begin_anew(bench: SceneBench) -> None:
    from rosglass.comm.clock import ClockChange, Jump
    from rosglass.comm.qos import QoS
    from rosglass.comm.time import Duration

    view = bench.load('PathDisplay { topic: "/plan" } MapDisplay { topic: "/map" }')
    path, area = view.scene.displays
    plan = bench.robot.create_publisher("/plan", "nav_msgs/Path")
    latched = bench.robot.create_publisher("/map", "nav_msgs/OccupancyGrid", QoS.latched())
    info = {"resolution": 1.0, "width": 1, "height": 1, "origin": {"orientation": {"w": 1.0}}}
    header = {"frame_id": "map"}
    latched.publish({"header": header, "info": info, "data": [0]})

    def is_shown() -> bool:
        plan.publish({"header": header})
        return bool(len(path.root)) and area.cells is not None

    def begin() -> None:
        bench.wait(is_shown)

    begin()
    back = Jump(Duration.from_seconds(-3.0), ClockChange.NONE)
    for _ in range(3):
        view.scene.node.clock._notify(back)
    bench.wait(lambda: not len(path.root))
    begin()
    view.reset()
    assert not len(path.root)
    assert area.cells is None
    begin()


def test_reset_forgets_transforms_that_are_not_static(bench: SceneBench) -> None:
    view = bench.load()
    bench.place("laser", at=(1, 0, 0), parent="base_link")

    def is_known() -> bool:
        bench.move("base_link", (1, 0, 0), 1)
        return {"map", "base_link", "laser"} <= set(view.scene.frames())

    bench.wait(is_known)
    bench.wait.settled(bench.session)
    view.reset()
    assert view.scene.frames() == ["base_link", "laser"]
    bench.wait(is_known)


def test_a_display_of_another_scene_is_refused(bench: SceneBench) -> None:
    from rosglass.errors import Error

    view = bench.load('SceneView { objectName: "other" }')
    grid = view.scene.add("Grid")
    other = view.findChild(type(view), "other").scene
    with pytest.raises(Error, match="display 'Grid' is in another scene"):
        other.add(grid)
    assert other.displays == []


def test_a_scene_ends_before_its_displays(bench: SceneBench, capfd: Any) -> None:
    from rosglass.qt import is_alive, send_deferred_deletes
    from rosglass.scene.displays.scene import Scene

    view = bench.load()
    scene = Scene(None, runtime_of(view.scene))
    display = scene.TYPES["Grid"](view, runtime_of(scene))
    scene.adopt(display)
    for one in (scene, display):
        one.deleteLater()
        send_deferred_deletes()
        assert not is_alive(one)
    assert "Signal source" not in capfd.readouterr().err


def test_disabled_displays_report_nothing(bench: SceneBench) -> None:
    view = bench.load('AxesDisplay { frame: "tool" } GridDisplay { frame: "tool" }')
    bench.wait(lambda: all(one.statusLevel == "error" for one in view.scene.displays))
    for display in view.scene.displays:
        display.enabled = False
        display.alpha = 0.2
        assert display.statusText == ""


def test_a_view_that_leaves_its_window_frees_what_it_made_there(bench: SceneBench) -> None:
    from PySide6.QtCore import QObject

    view = bench.load(
        'Loader { objectName: "other"; active: false; sourceComponent: Component {\n'
        "Window { width: 100; height: 100; visible: true } } }\n"
        'SceneView { objectName: "guest"; width: 80; height: 80; GridDisplay {} }'
    )
    guest = view.findChild(type(view), "guest")
    bench.picture()
    (renderer,) = renderers_of(guest)
    assert device_of(renderer) is not None
    loader = view.findChild(QObject, "other")
    loader.setProperty("active", True)
    other = loader.property("item")
    bench.wait(other.isExposed)
    before = guest.pictures_drawn()
    guest.setParentItem(other.contentItem())
    bench.wait(lambda: guest.pictures_drawn() > before and renderer not in renderers_of(guest))
    assert device_of(renderer) is None
    guest.setParentItem(view)
    bench.picture()


def test_the_first_frame_may_be_announced_with_further_ones(bench: SceneBench) -> None:
    from PySide6.QtCore import QMetaObject, Qt

    view = bench.load("AxesDisplay {}")
    bench.picture()
    for _ in range(4):  # as from a thread that has already drawn four frames
        QMetaObject.invokeMethod(view, "_take_mouse", Qt.ConnectionType.QueuedConnection)
    bench.wait(lambda: view.acceptedMouseButtons() == Qt.MouseButton.AllButtons)
    bench.wait.nothing_happens(0.1)
    # The view still follows the frames of its window, by which it leaves time to QML.
    frames = frames_of(view)
    began = frames.began
    view.update()
    bench.wait(lambda: frames.began > began)


def test_the_whole_is_drawn_after_a_move_whose_timer_ends_early(
    bench: SceneBench, monkeypatch: pytest.MonkeyPatch
) -> None:
    view = bench.load("AxesDisplay {}")
    bench.picture()
    (renderer,) = renderers_of(view)
    frames: list[Any] = []
    watch_frames(monkeypatch, renderer, frames.append)
    view.camera_moved()
    # Qt's timers may end 5 % early; this one ends much earlier, so that it always does.
    view._still.start(1)
    bench.wait(lambda: frames and not view.is_moving and not frames[-1].moving)


def boxes_in_a_row(count: int) -> list[Any]:
    """Return red boxes beside each other, as drawables of their own."""
    from rosglass.scene.render.drawing import Mesh
    from rosglass.scene.render.matrices import instance_matrix
    from rosglass.scene.render.mesh_shapes import BOX

    made = [Mesh(BOX, (1.0, 0.0, 0.0, 1.0), lit=False) for _ in range(count)]
    for number, box in enumerate(made):
        box.pose = instance_matrix((0.0, 1.5 * (number - count // 2), 0.0))
    return made


def test_new_drawables_are_uploaded_over_several_frames(
    bench: SceneBench, monkeypatch: pytest.MonkeyPatch
) -> None:
    from rosglass.scene.render import renderer as module

    view = bench.load()
    bench.picture()
    (renderer,) = renderers_of(view)
    shown: list[tuple[int, bool]] = []
    clock = itertools.count()
    watch_uploads(
        monkeypatch,
        renderer,
        lambda: shown.append((len(on_device(renderer)), renderer.is_complete)),
    )
    # Each upload takes as long as the budget.
    monkeypatch.setattr(module.time, "perf_counter", lambda: float(next(clock)))
    before = len(on_device(renderer))
    boxes = boxes_in_a_row(4)
    view.scene.root.add(*boxes)
    assert view.is_complete
    bench.wait(lambda: shown and view.is_complete)
    assert shown == [(before + n, n == 4) for n in (1, 2, 3, 4)]
    # What is there is uploaded at once when it changes.
    for box in boxes:
        box.set_instances(np.eye(4)[np.newaxis])
    drawn = view.pictures_drawn()
    bench.wait(lambda: view.pictures_drawn() > drawn)
    assert view.is_complete


def test_displays_upload_what_is_new_in_turns(
    bench: SceneBench, monkeypatch: pytest.MonkeyPatch
) -> None:
    from rosglass.scene.render import renderer as module
    from rosglass.scene.render.scene_tree import Group

    view = bench.load()
    bench.picture()
    many, few = boxes_in_a_row(40), boxes_in_a_row(2)
    robot, path = Group(Group(*many)), Group(*few)
    (renderer,) = renderers_of(view)
    shown: list[tuple[int, ...]] = []
    clock = itertools.count()
    watch_uploads(
        monkeypatch,
        renderer,
        lambda: shown.append(tuple(len(on_device(renderer) & {*one}) for one in (many, few))),
    )
    # Each upload takes as long as the budget.
    monkeypatch.setattr(module.time, "perf_counter", lambda: float(next(clock)))
    view.scene.root.add(robot, path)
    bench.wait(lambda: (40, 2) in shown)
    assert shown[:4] == [(1, 0), (1, 1), (2, 1), (2, 2)], "the path waits for all of the robot"


def test_grabbed_frame_shows_all(bench: SceneBench, monkeypatch: pytest.MonkeyPatch) -> None:
    from rosglass.scene.render import renderer as module

    view = bench.load()
    bench.picture()
    boxes = boxes_in_a_row(4)
    view.scene.root.add(*boxes)
    expected = bench.picture()
    clock = itertools.count()
    monkeypatch.setattr(module.time, "perf_counter", lambda: float(next(clock)))
    for box in boxes:
        box.remove()
    bench.picture()
    view.scene.root.add(*boxes)
    view.update()
    bench.window.grabWindow()
    assert not view.is_complete
    assert np.array_equal(bench.picture(), expected)
    # One that is hidden does not wait for more.
    for box in boxes:
        box.remove()
    bench.picture()
    view.scene.root.add(*boxes)
    view.update()
    bench.window.grabWindow()
    view.setProperty("visible", False)
    bench.picture()


def test_texts_removed_during_drawing_hide_nothing(
    bench: SceneBench, monkeypatch: pytest.MonkeyPatch
) -> None:
    from rosglass.scene.render.drawing import Labels

    view = bench.load("AxesDisplay {}")
    labels = Labels()
    labels.set_texts(["a text"], [(0.0, 0.0, 1.0)])
    view.scene.root.add(labels)
    bench.picture()
    (renderer,) = renderers_of(view)
    problems: list[Any] = []

    def remove(_: Any) -> None:
        if labels.count:
            # Another thread draws then, or the next frame waits, for QML is to have its time.
            frames_of(view).next_picture = time.monotonic() + 60
            labels.set_texts([], [])

    watch_frames(monkeypatch, renderer, remove)
    monkeypatch.setattr(renderer, "_on_problem", problems.append)
    bench.picture()
    assert not labels.count
    assert problems == []


def test_texts_are_drawn_between_what_is_translucent_by_their_distance(bench: SceneBench) -> None:
    from rosglass.scene.render.drawing import Labels, Mesh
    from rosglass.scene.render.matrices import instance_matrix
    from rosglass.scene.render.mesh_shapes import BOX

    view = bench.load('view: "TopDownOrtho"')
    red, green, labels = (1.0, 0.0, 0.0, 0.5), (0.0, 1.0, 0.0), Labels()
    sheets = [Mesh(BOX, red, lit=False), Mesh(BOX, red, lit=False)]
    for x, sheet in zip((-2.0, 2.0), sheets, strict=True):
        sheet.set_instances(instance_matrix((x, 0, 1), scale=(3.5, 3.5, 0.01))[np.newaxis])
    view.scene.root.add(labels, *sheets)
    labels.set_texts(["HHH", "HHH"], [(-2, 0, 2), (2, 0, 0)], 1.0, green)
    picture = bench.picture().astype(int)
    left, right = np.split(picture, 2, axis=1)
    # Above the sheet, and below it.
    assert left[..., 1].max() == 255
    assert 100 < right[..., 1].max() < 160
    labels.set_texts(["HHH", "HHH"], [(-2, 0, 0), (2, 0, 2)], 1.0, green)
    left, right = np.split(bench.picture().astype(int), 2, axis=1)
    assert right[..., 1].max() == 255
    assert 100 < left[..., 1].max() < 160


def test_texts_without_room_are_a_problem(bench: SceneBench) -> None:
    from rosglass.scene.render.drawing import Labels

    view = bench.load("GridDisplay {}")
    labels = Labels(in_pixels=True)
    texts = [f"{number} " + "frame" * 60 for number in range(600)]
    labels.set_texts(texts, np.zeros((600, 3)), 10.0)
    view.scene.root.add(labels)
    bench.wait(lambda: "of 600 texts have no room" in view.problem)
    labels.set_texts(texts[:10], np.zeros((10, 3)), 10.0)
    bench.wait(lambda: view.problem == "")


def test_texts_whose_image_is_refused_are_painted_again(
    bench: SceneBench, monkeypatch: pytest.MonkeyPatch
) -> None:
    from rosglass.scene.render.drawing import Labels
    from rosglass.scene.render.graphics_device import GraphicsDevice

    view = bench.load()
    labels = Labels(in_pixels=True)
    labels.set_texts(["x"], np.zeros((1, 3)), 100.0)
    with monkeypatch.context() as patch:

        def refuse(*_: Any) -> None:
            raise MemoryError("the graphics interface refused a QRhiTexture")

        patch.setattr(GraphicsDevice, "texture", refuse)
        view.scene.root.add(labels)
        bench.wait(lambda: "refused a QRhiTexture" in view.problem)
    view.update()
    bench.wait(lambda: view.problem == "")
    assert has_color(bench.picture(), 255, 255, 255) > 50


def test_an_image_beyond_the_limit_keeps_the_walls_of_a_map() -> None:
    from rosglass.scene.render.graphics_device import reduce_image

    cells = np.zeros((101, 60), np.int8)
    cells[:, 31] = 100
    cells[:4] = -1
    # Unknown cells beside a wall, and beside free ones.
    cells[50, 30] = cells[50, 10] = -1
    small = reduce_image(cells.view(np.uint8), 51).view(np.int8)
    assert small.shape == (51, 30)
    assert (small[2:, 15] == 100).all()
    assert (small[:2] == -1).all()
    assert not small[2:, :15].any()
    colors = np.arange(100 * 100 * 4, dtype=np.uint8).reshape(100, 100, 4)
    assert reduce_image(colors, 50).shape == (50, 50, 4)
    assert reduce_image(colors, 100) is colors


def test_a_depth_that_a_config_may_not_have_is_named(bench: SceneBench) -> None:
    display = bench.show('PathDisplay { topic: "/path" }')
    notes = display.load_settings({"Topic": {"Value": "/path", "Depth": 5000}})
    assert notes == ["Depth: 5000 is out of range; 1000 is used, and the file keeps it"]
    assert display.depth == 1000
    assert display.load_settings({"Topic": {"Value": "/path", "Depth": 20}}) == []


def test_mistakes_in_qml_are_errors_that_name_the_line(
    bench: SceneBench,
    caplog: pytest.LogCaptureFixture,
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
) -> None:
    from PySide6.QtCore import QUrl

    from rosglass.scene.displays import camera, declared

    monkeypatch.setattr(declared, "_PLACED_MS", 50)
    monkeypatch.setattr(camera, "_HIDDEN_CHECK_MS", 50)
    file = tmp_path / "Mistakes.qml"
    file.write_text(
        "import QtQuick\n"
        "import RosScene 1.0\n"
        "Item {\n"
        '    GridDisplay { name: "Floor" }\n'
        "    MeasureTool { }\n"
        '    SceneOverlay { source: "none.qml" }\n'
        "    ImagePanel { display: path }\n"
        "    PathDisplay { id: path }\n"
        "    SceneView {\n"
        '        view: "Orbital"; tool: "Mesure"\n'
        '        CameraDisplay { hiddenDisplays: ["Robt"] }\n'
        '        AxesDisplay { name: "Robot" }\n'
        '        PoseDisplay { id: pose; shape: "Arow" }\n'
        "        PoseDisplay { }\n"
        "    }\n"
        "}\n"
    )
    bench.window.setSource(QUrl.fromLocalFile(str(file)))

    def said() -> str:
        return "\n".join(f"{r.lineno}: {r.getMessage()}" for r in caplog.records if r.levelno >= 40)

    for text in (
        "4: display 'Floor' is in no view, and has no effect: put it into a SceneView { }",
        "5: tool 'Measure' is in no view",
        "6: SceneOverlay is in no view",
        "7: display: expected an ImageDisplay or a CameraDisplay, got PathDisplay",
        "8: display 'Path' is in no view",
        "9: SceneView: view: there is no view",
        "9: SceneView: tool: there is no tool 'Mesure' in this view; did you mean Measure?",
        "11: display 'Camera': hiddenDisplays: there is no display 'Robt'; did you mean Robot?",
        "13: display 'Pose': shape: expected one of Arrow, Axes, got 'Arow'; did you mean Arrow?",
    ):
        bench.wait(lambda text=text: text in said(), said)
