"""The look of overlays over RViz's 3D view; drawing stops when nothing changes."""

from __future__ import annotations

import gc
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from usage import memory

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

GREY = (48, 48, 48)
BLUE = (0, 128, 255)
IMPORTS = "import QtQuick 2.15\nimport QtQuick.Controls 2.15\nimport QtQuick.Window 2.15\n"


@pytest.fixture
def show(app: Any, tmp_path: Path) -> Callable[..., Any]:
    """Show QML text over the 3D view."""

    def show(text: str, name: str = "Test", **options: Any) -> Any:
        file = tmp_path / f"{name}.qml"
        file.write_text(IMPORTS + text)
        return app.add_qml(file, **options)

    return show


def colour(picture: Any, x: float, y: float) -> tuple[int, int, int]:
    return tuple(picture.pixelColor(round(x), round(y)).getRgb()[:3])


def close_to(one: tuple[int, ...], other: tuple[int, ...], by: int = 2) -> bool:
    return all(abs(a - b) <= by for a, b in zip(one, other, strict=True))


def square(x: int, y: int, fill: str, size: int = 60) -> str:
    return f'Rectangle {{ x: {x}; y: {y}; width: {size}; height: {size}; color: "{fill}" }}\n'


def test_translucent_colours_are_blended_right(show: Any, grab: Any) -> None:
    show('Item { Rectangle { x: 40; y: 30; width: 100; height: 60; color: "#800080ff" } }')
    picture = grab()
    # Half of (0, 128, 255) and half of RViz's own grey.
    assert close_to(colour(picture, 90, 60), (24, 88, 152), by=1)
    assert colour(picture, 30, 60) == GREY


def test_overlays_lie_above_each_other_by_z_and_popups_above_all(
    app: Any, show: Any, grab: Any
) -> None:
    low = show(f"Item {{ {square(40, 40, 'red')} }}", "Low", z=1)
    high = show(f"Item {{ {square(70, 70, 'lime')} }}", "High", z=2)
    assert colour(grab(), 85, 85) == (0, 255, 0)
    low.z = 3
    picture = grab()
    assert colour(picture, 85, 85) == (255, 0, 0)
    assert colour(picture, 115, 115) == (0, 255, 0)
    high.is_popup = True
    high.z = 0
    assert colour(grab(), 85, 85) == (0, 255, 0)
    app.overlays.remove(high)
    picture = grab()
    assert colour(picture, 85, 85) == (255, 0, 0)
    assert colour(picture, 115, 115) == GREY


def test_opacity_is_blended_without_redrawing(
    show: Any, grab: Any, drawn: list[Any], frames: Any
) -> None:
    overlay = show(f"Item {{ {square(40, 40, '#0080ff')} {square(140, 40, '#800080ff')} }}")
    assert colour(grab(), 70, 70) == BLUE
    count = len(drawn)
    overlay.opacity = 0.5
    picture = grab()
    assert close_to(colour(picture, 70, 70), (24, 88, 152))
    # A quarter of it is left where it is half transparent itself.
    assert close_to(colour(picture, 170, 70), (36, 68, 100))
    overlay.opacity = 0
    assert colour(grab(), 70, 70) == GREY
    overlay.opacity = 1
    assert colour(grab(), 70, 70) == BLUE
    assert len(drawn) == count


def test_overlays_look_the_same_where_there_are_no_shaders(
    app: Any, show: Any, grab: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    from rosglass.rviz import layer

    text = """Item { Repeater { model: 8; Rectangle { x: 40 * index; width: 90; height: 200; y: 9
        color: Qt.hsva(index / 8, 0.8, 0.9, (index + 1) / 8); radius: 20 } } }"""
    assert layer.fragment_program() != ""
    overlay = show(text)
    picture = grab()
    overlay.opacity = 0.999
    assert close_to(colour(grab(), 200, 50), colour(picture, 200, 50))
    overlay.opacity = 1
    assert grab() == picture
    app.overlays.remove(overlay)
    assert grab() != picture
    monkeypatch.setattr(layer, "fragment_program", lambda: "")
    show(text, "Plain")
    assert grab() == picture


def test_hidden_overlays_are_not_drawn_and_show_the_newest_when_shown_again(
    show: Any, grab: Any, drawn: list[Any], frames: Any
) -> None:
    overlay = show(
        f"Rectangle {{ width: 9; height: 9; color: 'transparent'; {square(40, 40, 'red')} }}"
    )
    rectangle = overlay.root.childItems()[0]
    grab()
    for hide, back in (({"visible": False}, {"visible": True}), ({"opacity": 0}, {"opacity": 1.0})):
        for name, value in hide.items():
            setattr(overlay, name, value)
        frames(1)
        count = len(drawn)
        for fill in ("blue", "yellow", "lime"):
            rectangle.setProperty("color", fill)
            frames(2)
        assert len(drawn) == count
        assert colour(grab(), 70, 70) == GREY
        for name, value in back.items():
            setattr(overlay, name, value)
        assert colour(grab(), 70, 70) == (0, 255, 0)
        rectangle.setProperty("color", "red")
        assert colour(grab(), 70, 70) == (255, 0, 0)


def test_nothing_is_drawn_when_nothing_changes_and_little_uploaded_when_little_does(
    app: Any, show: Any, drawn: list[Any], frames: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    from rosglass.rviz.layer import Layer

    uploads: list[list[Any]] = []
    update = Layer.update
    monkeypatch.setattr(Layer, "update", lambda *a: uploads.append(update(*a)) or uploads[-1])
    overlay = show(f"Item {{ {square(0, 0, 'red', 400)} {square(500, 500, 'blue', 10)} }}")
    frames(5)
    count = len(drawn)
    frames(10)
    assert len(drawn) == count
    overlay.root.childItems()[1].setProperty("color", "lime")
    frames(3)
    assert len(drawn) == count + 1
    assert [tuple(rect) for rect in uploads[-1]] == [(496, 496, 512, 512)]
    assert drawn[-1].render > 0
    assert drawn[-1].total > 0
    width, height, _ = app.window.view_size()
    assert app.overlays.covered == pytest.approx((400 * 400 + 16 * 16) / (width * height), rel=0.02)


def test_panels_grow_and_shrink_with_their_content(
    app: Any, show: Any, grab: Any, wait: Any
) -> None:
    overlay = show(f"Item {{ {square(43, 43, '#0080ff', 8)} }}")
    item = overlay.root.childItems()[0]
    width, height, _ = app.window.view_size()
    grab()
    assert app.overlays.covered * width * height == pytest.approx(8 * 8)

    def is_seen(x: int, y: int, right: int, bottom: int) -> bool:
        picture = grab()
        inside = ((x, y), (right - 1, bottom - 1))
        outside = ((x - 1, y), (x, y - 1), (right, y), (x, bottom))
        return all(colour(picture, *at) == BLUE for at in inside) and all(
            colour(picture, *at) == GREY for at in outside
        )

    for x, y, across, down in (
        (43, 43, 8, 8),
        (42, 41, 10, 13),
        (41, 40, 14, 15),
        (44, 46, 3, 5),
        (60, 46, 3, 5),
        (43, 43, 8, 8),
    ):
        for name, value in (("x", x), ("y", y), ("width", across), ("height", down)):
            item.setProperty(name, value)
        # A screen under load shows frames late.
        wait(lambda at=(x, y, x + across, y + down): is_seen(*at))
        covered = app.overlays.covered * width * height
        assert across * down - 0.1 <= covered <= (across + 8) * (down + 8)


def test_scaled_overlays_have_as_many_units_less(show: Any, grab: Any, app: Any) -> None:
    width, height, _ = app.window.view_size()
    overlay = show(
        "Item { property var window: Window.width\n"
        'Text { x: 20; y: 20; text: "|||||"; font.pixelSize: 40; color: "white" }\n'
        f"{square(40, 100, '#0080ff')} }}",
        scale=2.0,
    )
    picture = grab()
    root = overlay.root
    assert (root.width(), root.height()) == (width / 2, height / 2)
    assert abs(root.property("window") - width / 2) <= 1
    assert colour(picture, 81, 201) == BLUE
    assert colour(picture, 199, 319) == BLUE
    assert colour(picture, 201, 319) != BLUE
    overlay.scale = 0.5
    picture = grab()
    assert colour(picture, 21, 51) == BLUE
    assert colour(picture, 51, 51) == GREY
    assert (root.width(), root.height()) == (width * 2, height * 2)


def test_frames_of_idle_overlays_are_released(show: Any, grab: Any, wait: Any) -> None:
    from rosglass.rviz.qt5 import QtGui

    overlay = show(f"Item {{ {square(40, 40, '#0080ff')} }}")
    kept = vars(overlay._scene.renderer)
    assert colour(grab(), 70, 70) == BLUE
    wait(lambda: not any(isinstance(v, (np.ndarray, QtGui.QImage)) for v in kept.values()))
    overlay.root.childItems()[0].setProperty("color", "red")
    assert colour(grab(), 70, 70) == (255, 0, 0)


@pytest.mark.parametrize("scale", [4.0, 0.4])
def test_text_is_as_sharp_as_text_of_the_size_that_it_is_seen_in(
    app: Any, show: Any, frames: Any, scale: float
) -> None:
    text = """Item { Text { text: "Wik"; color: "white"
        font { pixelSize: %d; hintingPreference: Font.PreferNoHinting } } }"""

    def ink(size: float, scale: float) -> Any:
        overlay = show(text % round(size), f"Text{size:.0f}x{scale:.0f}", scale=scale)
        frames(3)
        pixels = np.array(overlay.draw() >> 24, np.float64)
        app.overlays.remove(overlay)
        return pixels

    wanted, seen, plain = ink(64, 1.0), ink(64 / scale, scale), ink(64 / scale, 1.0)
    rows, columns = (np.minimum(np.arange(n) / scale, n - 1).astype(int) for n in wanted.shape)
    stretched = plain[np.ix_(rows, columns)]
    part = np.s_[:128, :256]
    assert wanted[part].max() == 255
    blur = np.abs(stretched[part] - wanted[part]).mean()
    assert np.abs(seen[part] - wanted[part]).mean() < 0.6 * blur


def test_resized_views_show_no_stretched_frame(app: Any, show: Any, grab: Any, wait: Any) -> None:
    overlay = show(
        "Item {\n"
        "Rectangle { width: 50; height: 50; anchors { right: parent.right; bottom: parent.bottom }"
        ' color: "#0080ff" } }'
    )
    grab()
    window = app.window.widget
    before = window.size()
    try:
        for size in ((900, 700), (1100, 640), (before.width(), before.height())):
            window.resize(*size)
            wait(lambda size=size: (window.width(), window.height()) == size)
            picture = grab()
            width, height, _ = app.window.view_size()
            assert (picture.width(), picture.height()) == (width, height)
            assert (overlay.root.width(), overlay.root.height()) == (width, height)
            assert colour(picture, width - 49, height - 49) == BLUE
            assert colour(picture, width - 2, height - 2) == BLUE
            assert colour(picture, width - 52, height - 2) != BLUE
            assert colour(picture, width - 2, height - 52) != BLUE
    finally:
        window.resize(before)


def test_minimised_rviz_draws_no_overlay(
    app: Any, show: Any, drawn: list[Any], frames: Any
) -> None:
    overlay = show(f"Item {{ {square(40, 40, 'red')} }}")
    frames(3)
    window = app.window.widget
    state = window.windowState()
    try:
        window.showMinimized()
        frames(1)
        count = len(drawn)
        overlay.root.childItems()[0].setProperty("color", "lime")
        frames(3)
        assert len(drawn) == count
    finally:
        window.setWindowState(state)
        window.show()
    frames(3)
    assert len(drawn) > count


def test_errors_of_an_overlay_are_reported_once_and_hurt_no_other(
    app: Any, show: Any, grab: Any, frames: Any, caplog: pytest.LogCaptureFixture
) -> None:
    from rosglass.rviz import Overlay

    class Broken(Overlay):
        answer: Any = None
        size = (0, 0)

        def resize(self, width: int, height: int, ratio: float) -> None:
            self.size = (height, width)

        def draw(self) -> Any:
            if isinstance(self.answer, Exception):
                raise self.answer
            return self.answer

    broken = Broken("Broken")
    broken.answer = ZeroDivisionError("no robot")
    app.add(broken)
    show(f"Item {{ {square(40, 40, '#0080ff')} }}")
    for _ in range(3):
        broken.changed.emit()
        frames(2)
    assert "no robot" in broken.problem
    errors = [r for r in caplog.records if r.levelname == "ERROR" and "no robot" in r.getMessage()]
    assert len(errors) == 1
    broken.answer = np.zeros((3, 3), np.uint32)
    broken.changed.emit()
    frames(2)
    assert "shape" in broken.problem
    assert "(3, 3)" in broken.problem
    broken.answer = np.full(broken.size, 0xFF00FF00, np.uint32)
    broken.changed.emit()
    assert colour(grab(), 300, 30) == (0, 255, 0)
    assert broken.problem == ""
    broken.answer = ValueError("again")
    broken.changed.emit()
    picture = grab()
    # What it showed before is true no longer.
    assert colour(picture, 300, 30) != (0, 255, 0)
    assert colour(picture, 70, 70) == BLUE


def test_an_overlay_may_be_removed_while_it_draws(
    app: Any, frames: Any, show: Any, grab: Any
) -> None:
    from rosglass.rviz import Overlay

    closed: list[str] = []

    class Leaving(Overlay):
        def resize(self, width: int, height: int, ratio: float) -> None:
            self.size = (height, width)

        def draw(self) -> Any:
            app.overlays.remove(self)
            assert not closed
            return np.full(self.size, 0xFFFF0000, np.uint32)

        def close(self) -> None:
            closed.append(self.name)

    app.add(Leaving("Leaving"))
    show(f"Item {{ {square(40, 40, '#0080ff')} }}")
    picture = grab()
    assert closed == ["Leaving"]
    assert colour(picture, 70, 70) == BLUE
    assert colour(picture, 10, 70) == GREY


def test_controls_popups_canvas_and_clipped_items_are_drawn(
    show: Any, grab: Any, wait: Any, app: Any
) -> None:
    overlay = show(
        """Item {
        property bool opened: popup.opened
        property bool wanted: false
        Popup { id: popup; visible: parent.wanted; x: 300; y: 40; width: 80; height: 60; padding: 0
            background: Rectangle { color: "#0080ff" } }
        TextField { id: field; x: 40; y: 140; width: 200; height: 40; text: "hello"
            background: Rectangle { color: "white" } }
        Canvas { x: 40; y: 200; width: 60; height: 60
            onPaint: { var c = getContext("2d"); c.fillStyle = "red"; c.fillRect(0, 0, 60, 60) } }
        Canvas { x: 140; y: 200; width: 60; height: 60; renderTarget: Canvas.FramebufferObject
            onPaint: { var c = getContext("2d"); c.fillStyle = "lime"; c.fillRect(0, 0, 60, 60) } }
        Rectangle { x: 240; y: 200; width: 60; height: 60; color: "#ff0000"; opacity: 0.5 }
        Item { x: 340; y: 200; width: 60; height: 60; clip: true; rotation: 45
            Rectangle { width: 200; height: 200; color: "#ff0000" } }
        }"""
    )
    overlay.root.setProperty("wanted", True)
    wait(lambda: overlay.root.property("opened"))
    picture = grab()
    assert colour(picture, 340, 70) == BLUE
    assert colour(picture, 230, 160) == (255, 255, 255)
    letters = {colour(picture, x, y) for x in range(45, 120) for y in range(145, 175)}
    assert min(letters) < (100, 100, 100)
    assert colour(picture, 70, 230) == (255, 0, 0)
    assert colour(picture, 170, 230) == (0, 255, 0)
    assert close_to(colour(picture, 270, 230), (152, 24, 24))
    assert colour(picture, 370, 230) == (255, 0, 0)
    assert colour(picture, 345, 205) == GREY


def test_items_without_a_size_fill_the_view(show: Any, app: Any, frames: Any) -> None:
    overlay = show("Item { }")
    frames(2)
    width, height, _ = app.window.view_size()
    assert (overlay.root.width(), overlay.root.height()) == (width, height)
    assert app.overlays.covered == 0


def test_overlays_that_come_and_go_leave_nothing_behind(
    app: Any, show: Any, frames: Any, wait: Any, grab: Any
) -> None:
    from rosglass.rviz.host import ogre

    text = f"""Item {{ {square(40, 40, "#0080ff")}
        Text {{ y: 200; text: "native"; renderType: Text.NativeRendering; color: "white" }}
        Button {{ y: 300; text: "stop" }} }}"""
    textures = ogre().TextureManager.getSingleton().getMemoryUsage
    steady = show(text, "Steady")

    def cycle(number: int) -> None:
        overlay = show(text.replace("stop", f"stop {number}"), "Passing", scale=1 + number % 3)
        frames(1)
        overlay.scale = 0.7
        frames(1)
        app.overlays.remove(overlay)
        wait.frames(1)

    for number in range(5):
        cycle(number)
    gc.collect()
    used, before = textures(), memory()
    for number in range(30):
        cycle(number)
    gc.collect()
    assert textures() == used
    # One image of the view alone has 4 MB.
    assert memory() - before < 20_000_000
    steady.root.childItems()[1].setProperty("text", "QWERTZ")
    assert colour(grab(), 70, 70) == BLUE


def test_camera_images_are_drawn(app: Any, show: Any, grab: Any, wait: Any, master: str) -> None:
    import rosglass

    show(
        """import QtMultimedia 5.15
        import Ros2 1.0
        Item {
        VideoOutput { x: 20; y: 20; width: 64; height: 48; fillMode: VideoOutput.Stretch
            source: ImageTransportSubscription { topic: "/test/camera/image" } }
        Component.onCompleted: Ros2.init("camera_overlay") }"""
    )
    with rosglass.connect(master.replace("http", "ros1"), name="camera") as node:
        publisher = node.create_publisher("/test/camera/image", "sensor_msgs/Image")
        data = bytes((255, 128, 0)) * (64 * 48)
        image = {"height": 48, "width": 64, "encoding": "rgb8", "step": 192, "data": data}

        def arrived() -> bool:
            publisher.publish(image)
            wait.frames(2)
            return colour(grab(), 50, 40) == (255, 128, 0)

        wait(arrived)
