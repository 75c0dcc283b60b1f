"""The displays Image and Camera, and their panels."""

from __future__ import annotations

import itertools
import os
import subprocess
import sys
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from inside import endpoint_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from conftest import SceneBench

WIDTH, HEIGHT = 200, 150
#: Numbers that make images differ.
NUMBERS = itertools.count(1)
#: The camera sits at (0, 0, 1) of the map and looks along x.
OPTICAL = (-0.5, 0.5, -0.5, 0.5)
P = [180.0, 0, 90, 0, 0, 190.0, 80, 0, 0, 0, 1, 0]

IMAGE = 'ImageDisplay { id: front; topic: "/front/image" }'
CAMERA = 'CameraDisplay { id: front; topic: "/front/image" }'
PANEL = 'ImagePanel { objectName: "panel"; display: front; width: 400; height: 300 }'


def picture_of(color: tuple[int, int, int], seconds: int = 7, **fields: Any) -> dict[str, Any]:
    pixels = np.full((HEIGHT, WIDTH, 3), color, np.uint8)
    return {
        "header": {"frame_id": "camera", "stamp": {"sec": seconds, "nanosec": next(NUMBERS)}},
        "width": WIDTH,
        "height": HEIGHT,
        "encoding": "rgb8",
        "step": WIDTH * 3,
        "data": pixels.reshape(-1),
        **fields,
    }


def shown_of(display: Any) -> Any:
    """Return the image that a display shows; None without one."""
    return display._picture


class Robot:
    """Publishes images, CameraInfo and transforms."""

    def __init__(self, bench: SceneBench, topic: str = "/front/image") -> None:
        self.bench = bench
        self.images = bench.robot.create_publisher(topic, "sensor_msgs/Image")
        self.infos = bench.robot.create_publisher("/front/camera_info", "sensor_msgs/CameraInfo")

    def show(self, display: Any, *color: int, **fields: Any) -> None:
        """Publish an image until the display shows it."""
        message = picture_of((color or (0, 255, 255)), **fields)  # type: ignore[arg-type]
        stamp = message["header"]["stamp"]
        nanoseconds = stamp["sec"] * 1_000_000_000 + stamp["nanosec"]

        def shown() -> bool:
            self.images.publish(message)
            picture = shown_of(display)
            return picture is not None and picture.frame.stamp.nanoseconds == nanoseconds

        self.bench.wait(shown)

    def send_info(self, display: Any, level: str = "ok", **fields: Any) -> None:
        """Publish a CameraInfo until the display has it."""
        message = {"width": WIDTH, "height": HEIGHT, "p": P, **fields}
        self.bench.wait(
            lambda: (
                self.infos.publish(message) or display.status_lines["Camera Info"].level == level
            )
        )

    def send_info_until_received(self, display: Any, message: dict[str, Any]) -> None:
        """Publish a CameraInfo until the display has received it, and shows what follows."""
        self.bench.wait(self.infos.subscription_count)
        self.bench.send(self.infos, message, display.infos)

    def place(self, seconds: int = 7, y: float = 0.0) -> None:
        """Publish the camera's transform."""
        self.bench.move("camera", (0, y, 1), seconds, turn=OPTICAL)


@pytest.fixture
def load(bench: SceneBench) -> Callable[..., tuple[Any, Robot]]:
    def loaded(body: str) -> tuple[Any, Robot]:
        view = bench.load(body)
        bench.wait(lambda: view.scene.find("front") or view.scene.displays)
        return view.scene.displays[-1], Robot(bench)

    return loaded


def close(a: tuple[int, ...], b: tuple[int, ...], tolerance: int = 3) -> bool:
    return max(abs(int(x) - int(y)) for x, y in zip(a, b, strict=True)) <= tolerance


def test_a_panel_shows_the_images(bench: SceneBench, load: Callable[..., Any]) -> None:
    display, robot = load(IMAGE + PANEL)
    robot.show(display)
    assert bench.pixel() == (0, 255, 255)
    assert display.statusLevel == "ok", display.statusText
    robot.show(display, 255, 0, 255)
    assert bench.pixel() == (255, 0, 255)
    display.enabled = False
    bench.wait(lambda: endpoint_of(display) is None)
    assert bench.pixel(390, 290) == (48, 48, 48), "the panel is hidden"


def test_without_a_panel_nothing_is_received(bench: SceneBench, load: Callable[..., Any]) -> None:
    display, robot = load(IMAGE)
    bench.wait(lambda: display.statusText)
    assert "declare ImagePanel" in display.statusText
    assert robot.images.subscription_count() == 0


@pytest.mark.parametrize("kind", [IMAGE, CAMERA])
def test_a_panel_that_is_destroyed_ends_the_stream(
    bench: SceneBench, load: Callable[..., Any], kind: str
) -> None:
    display, robot = load(
        f"{kind} Loader {{ active: parent.fixedFrame === 'map'; sourceComponent: {PANEL} }}"
    )
    robot.show(display)
    bench.view.fixedFrame = "odom"
    bench.wait(lambda: endpoint_of(display) is None)
    assert "declare ImagePanel" in display.statusText
    assert shown_of(display) is None
    bench.wait(lambda: robot.images.subscription_count() == 0)
    bench.view.fixedFrame = "map"
    robot.show(display)
    bench.wait(lambda: bench.pixel(200, 290) == (0, 255, 255))


def test_a_display_that_is_removed_leaves_no_panel(
    bench: SceneBench, load: Callable[..., Any]
) -> None:
    display, robot = load(CAMERA + "id: main; ImagePanels { anchors.fill: parent; view: main }")
    robot.show(display)
    bench.wait(lambda: bench.pixel(100, 280) == (0, 255, 255))
    bench.view.scene.remove(display)
    bench.wait(lambda: bench.pixel(100, 280) == (48, 48, 48))
    bench.wait(lambda: robot.images.subscription_count() == 0)


def test_image_that_is_not_live_fades(bench: SceneBench, load: Callable[..., Any]) -> None:
    display, robot = load(IMAGE + PANEL)
    robot.show(display)
    robot.images.close()
    bench.wait(lambda: display.statusLevel == "warn")
    assert "its publisher is gone; the last one is of" in display.statusText
    assert display.stale
    assert close(bench.pixel(), (0, 89, 89)), "35 % of the picture, on black"


def test_old_image_fades_though_its_publisher_lives(
    bench: SceneBench, load: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    from rosglass.scene.displays import image

    monkeypatch.setattr(image, "_MAX_AGE_S", 0.3)
    display, robot = load(IMAGE + PANEL)

    def now() -> dict[str, Any]:
        # The time of the second one decides whether it is late.
        seconds, nanoseconds = divmod(bench.robot.now().nanoseconds, 10**9)
        return {"frame_id": "camera", "stamp": {"sec": seconds, "nanosec": nanoseconds}}

    robot.show(display, header=now())
    bench.wait(lambda: display.statusLevel == "warn")
    assert "no new image is shown" in display.statusText
    robot.show(display, header=now())
    bench.wait(lambda: display.statusLevel == "ok", lambda: display.statusText)


def test_image_does_not_fade_while_a_simulation_is_paused(
    bench: SceneBench, load: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    from rosglass.scene.displays import image
    from rosglass.scene.displays import scene_frames as scenes

    monkeypatch.setattr(image, "_MAX_AGE_S", 1.0)
    monkeypatch.setattr(scenes, "_PAUSED_S", 0.3)
    display, robot = load(IMAGE + PANEL)
    clock = bench.robot.create_publisher("/clock", "rosgraph_msgs/msg/Clock")
    bench.view.scene.node.parameters.set({"use_sim_time": True})
    bench.wait(clock.subscription_count)

    def run() -> None:
        clock.publish({"clock": {"sec": 7, "nanosec": next(NUMBERS)}})

    run()
    bench.wait.settled(bench.session)
    robot.show(display)
    bench.wait.nothing_happens(1.8)
    assert not display.stale
    bench.wait(lambda: run() or display.stale)


def test_depths_are_shown_in_greys(bench: SceneBench, load: Callable[..., Any]) -> None:
    display, robot = load(IMAGE + PANEL)
    depths = np.tile(np.linspace(2, 6, WIDTH, dtype="<f4"), (HEIGHT, 1))
    depths[:10] = np.nan
    raw = {"encoding": "32FC1", "step": WIDTH * 4, "data": depths.view(np.uint8).reshape(-1)}
    robot.show(display, **raw)
    picture = bench.picture()
    assert close(tuple(picture[200, (2, 200, 397), 0]), (0, 127, 255), 4)
    assert tuple(picture[10, 397]) == (0, 0, 0), "NaN is black"
    display.normalizeRange, display.maxValue = False, 12
    robot.show(display, **raw)
    robot.show(display, **raw)
    assert close(tuple(bench.picture()[200, (2, 200, 397), 0]), (42, 85, 127), 4)
    display.minValue = 12
    assert "Min Value 12 is not below Max Value 12" in display.statusText


def test_compressed_images_are_shown(bench: SceneBench, load: Callable[..., Any]) -> None:
    import cv2

    display, robot = load(IMAGE.replace("id:", 'transport: "compressed"; id:') + PANEL)
    publisher = bench.robot.create_publisher(
        "/front/image/compressed", "sensor_msgs/CompressedImage"
    )
    _, data = cv2.imencode(".png", np.full((HEIGHT, WIDTH, 3), (255, 0, 255), np.uint8))
    message = {"format": "rgb8; png compressed ", "data": data.reshape(-1)}
    bench.wait(lambda: publisher.publish(message) or shown_of(display) is not None)
    assert bench.pixel() == (255, 0, 255)
    assert robot.images.subscription_count() == 0, "raw pictures are not received"


@pytest.mark.parametrize(
    ("fields", "text"),
    [
        ({"encoding": "nosuch"}, "image encoding 'nosuch' cannot be shown"),
        ({"width": 4_000_000_000}, "4000000000x150 pixels are more than"),
        ({"step": 3}, "step is 3"),
        ({"data": np.zeros(5, np.uint8)}, "data has 5"),
    ],
)
def test_bad_image_is_an_error_in_words(
    bench: SceneBench, load: Callable[..., Any], fields: dict[str, Any], text: str
) -> None:
    display, robot = load(IMAGE + PANEL)
    robot.show(display)
    bad = picture_of((0, 0, 0), **fields)
    bench.wait(lambda: robot.images.publish(bad) or display.statusLevel == "error")
    assert text in display.statusText
    robot.show(display, 0, 255, 0)
    assert display.statusLevel == "ok"


MARKERS = (
    'PointStampedDisplay { topic: "/point"; radius: 0.1; color: "#ff0000"; alpha: 1 }' + CAMERA
)


@pytest.fixture
def camera(bench: SceneBench, load: Callable[..., Any]) -> tuple[Any, Robot]:
    """A camera that sees a red sphere at (5, -0.5, 1.4), placed in the map."""
    display, robot = load(MARKERS + PANEL)
    points = bench.robot.create_publisher("/point", "geometry_msgs/PointStamped")
    ball = bench.view.scene.displays[0]
    point = {"header": {"frame_id": "map"}, "point": {"x": 5.0, "y": -0.5, "z": 1.4}}
    bench.wait(lambda: points.publish(point) or ball.received)
    robot.place(7)
    robot.place(8)
    robot.send_info(display)
    robot.show(display, 0, 0, 255)
    bench.wait(lambda: "Transform: Transform OK" in display.statusText)
    return display, robot


def middle_of_ball(bench: SceneBench) -> tuple[float, float]:
    """Return column and row of what is red in the panel."""
    picture = bench.picture().astype(int)
    rows, columns = np.nonzero((picture[..., 0] > 60) & (picture[..., 1] < 60))
    assert len(rows) > 20, "the sphere is not seen"
    return float(columns.mean()), float(rows.mean())


def expected(y: float = 0.0, *, p: list[float] = P) -> tuple[float, float]:
    """Return where the sphere is seen, in pixels of the panel: twice those of the camera."""
    right, down, ahead = 0.5 + y, -0.4, 5.0
    # Angles are kept: fx and fy differ.
    aspect = (WIDTH / p[0]) / (HEIGHT / p[5])
    wide, high = min(400, 300 * aspect), min(300, 400 / aspect)
    u = (p[0] * right + p[3]) / ahead + p[2] + 0.5
    v = (p[5] * down + p[7]) / ahead + p[6] + 0.5
    return (400 - wide) / 2 + u * wide / WIDTH, (300 - high) / 2 + v * high / HEIGHT


def test_the_scene_fits_the_image(bench: SceneBench, camera: tuple[Any, Robot]) -> None:
    display, robot = camera
    display.imageRendering = "background"
    assert display.statusLevel == "ok", display.statusText
    assert bench.pixel(50, 250) == (0, 0, 255), "the picture is behind"
    assert middle_of_ball(bench) == pytest.approx(expected(), abs=2)
    # The image is placed at its own time.
    robot.place(10, y=0.4)
    robot.show(display, 0, 0, 255, seconds=9)
    assert middle_of_ball(bench) == pytest.approx(expected(0.2), abs=2)


def test_the_right_camera_of_a_pair_is_beside_its_frame(
    bench: SceneBench, camera: tuple[Any, Robot]
) -> None:
    display, robot = camera
    display.imageRendering = "background"
    right = [*P[:3], -P[0] * 0.3, *P[4:]]
    robot.send_info_until_received(display, {"width": WIDTH, "height": HEIGHT, "p": right})
    assert middle_of_ball(bench) == pytest.approx(expected(p=right), abs=2)


def test_image_may_be_of_a_region_of_the_sensor(
    bench: SceneBench, camera: tuple[Any, Robot]
) -> None:
    display, robot = camera
    display.imageRendering = "background"
    region = {"x_offset": 60, "y_offset": 40, "width": WIDTH, "height": HEIGHT}
    p = [*P[:2], P[2] + 60, *P[3:6], P[6] + 40, *P[7:]]
    info = {"width": 400, "height": 300, "p": p, "roi": region}
    robot.send_info_until_received(display, info)
    assert middle_of_ball(bench) == pytest.approx(expected(), abs=2)


def test_single_image_is_shown_alone_until_its_transform_is_known(
    bench: SceneBench, load: Callable[..., Any]
) -> None:
    display, robot = load(CAMERA + PANEL)
    robot.send_info(display)
    bench.wait(robot.images.subscription_count)
    robot.images.publish(picture_of((0, 0, 255), seconds=7))
    # Nothing else is received, and no transform.
    bench.wait(lambda: shown_of(display) is not None)
    assert bench.pixel() == (0, 0, 255)
    assert "Transform: no transform from [camera]" in display.statusText
    robot.place(7)
    robot.place(8)
    bench.wait(lambda: "Transform: Transform OK" in display.statusText)


def test_the_image_is_behind_over_or_both(bench: SceneBench, camera: tuple[Any, Robot]) -> None:
    display, _ = camera
    x, y = (round(part) for part in expected())
    display.imageRendering = "background"
    red = bench.pixel(x, y)
    assert red[2] < 60 < red[0]
    display.imageRendering = "overlay"
    assert close(bench.pixel(50, 250), (0, 0, 127))
    assert close(bench.pixel(x, y), (red[0] // 2, 0, 127), 40)
    display.imageRendering, display.overlayAlpha = "background and overlay", 1.0
    assert bench.pixel(x, y) == (0, 0, 255)
    display.imageRendering, display.zoomFactor = "background", 0.5
    picture = bench.picture()
    assert tuple(picture[20, 200]) == (0, 0, 0), "around the picture"
    assert tuple(picture[200, 130]) == (0, 0, 255)
    u, v = expected()
    assert middle_of_ball(bench) == pytest.approx((100 + u / 2, 75 + v / 2), abs=2)


def test_displays_can_be_hidden_in_the_camera(bench: SceneBench, camera: tuple[Any, Robot]) -> None:
    display, _ = camera
    display.imageRendering = "background"
    display.hiddenDisplays = ["PointStamped"]
    x, y = (round(part) for part in expected())
    assert bench.pixel(x, y) == (0, 0, 255)


@pytest.mark.parametrize(
    ("fields", "text"),
    [
        ({"p": [float("nan"), *P[1:]]}, "CameraInfo/p: contains NaN or infinite numbers"),
        ({"p": [*P[:3], 1e300, *P[4:]]}, "CameraInfo/p: 1e+300 is not a number of pixels"),
        ({"p": [0.0] * 12}, "expected focal lengths above 0 pixels, got fx 0 and fy 0"),
    ],
)
def test_a_bad_camera_info_draws_no_scene(
    bench: SceneBench, camera: tuple[Any, Robot], fields: dict[str, Any], text: str
) -> None:
    display, robot = camera
    display.imageRendering = "background"
    robot.send_info(display, "error", **fields)
    assert text in display.statusText
    x, y = (round(part) for part in expected())
    assert bench.pixel(x, y) == (0, 0, 255), "only the picture"
    robot.send_info(display)
    assert middle_of_ball(bench) == pytest.approx(expected(), abs=2)


def test_a_camera_info_without_a_size_takes_the_images(
    bench: SceneBench, camera: tuple[Any, Robot]
) -> None:
    display, robot = camera
    display.imageRendering = "background"
    robot.send_info_until_received(display, {"width": 0, "height": 0, "p": P})
    assert middle_of_ball(bench) == pytest.approx(expected(), abs=2)


def test_without_camera_info_the_image_is_shown_alone(
    bench: SceneBench, load: Callable[..., Any]
) -> None:
    display, robot = load(CAMERA + PANEL)
    robot.show(display)
    assert "no CameraInfo received on /front/camera_info" in display.statusText
    assert display.camera_for(400, 300) is None
    assert bench.pixel(200, 290) == (0, 255, 255)


def test_without_a_transform_the_image_waits_and_is_then_shown_alone(
    bench: SceneBench, load: Callable[..., Any]
) -> None:
    display, robot = load(CAMERA + PANEL)
    robot.send_info(display)
    robot.show(display)
    assert display.status_lines["Transform"].level == "error"
    assert "no transform from [camera]" in display.statusText
    assert display.camera_for(400, 300) is None
    robot.place(7)
    robot.place(8)
    robot.show(display)
    bench.wait(lambda: display.camera_for(400, 300) is not None)
    assert display.status_lines["Transform"].level == "ok"


def test_settings_of_rviz_files(bench: SceneBench, load: Callable[..., Any]) -> None:
    display, _ = load("GridDisplay {}" + CAMERA)
    assert "Panel Geometry" not in display.save_settings({}, 2)
    place = {"X": 30, "Y": 125, "Width": 180, "Height": 135}
    saved = {
        "Class": "rviz/Camera",
        "Image Topic": "/rear/image",
        "Transport Hint": "compressed",
        "Queue Size": 7,
        "Image Rendering": "overlay",
        "Zoom Factor": 2,
        "Visibility": {"Grid": False, "Robot": {"Value": True, "TF": False}, "Value": True},
        "Panel Geometry": place,
    }
    assert display.load_settings(saved) == []
    assert (display.topic, display.transport, display.depth) == ("/rear/image", "compressed", 7)
    assert (display.imageRendering, display.zoomFactor) == ("overlay", 2)
    assert display.hiddenDisplays == ["/Grid", "/Robot/TF"]
    assert display.panelGeometry.getRect() == (30, 125, 180, 135)
    kept = display.save_settings({"Class": "rviz/Camera"}, 1)
    assert (kept["Image Topic"], kept["Queue Size"]) == ("/rear/image", 7)
    assert kept["Visibility"] == {"Value": True, "Grid": False}
    assert kept["Panel Geometry"] == place
    # Displays in groups stand in them, as RViz looks for them there.
    scene = display.scene
    group = scene.add("Group", "Robot")
    scene.move(scene.add("TF"), group=group)
    kept = display.save_settings(saved, 1)
    assert kept["Visibility"] == saved["Visibility"]
    display.parts.set_enabled("Robot/TF", True)
    display.parts.set_enabled("Robot", False)
    assert display.hiddenDisplays == ["/Grid", "/Robot"]
    inner = {"Value": False, "TF": True}
    assert display.save_settings(saved, 1)["Visibility"] == {
        "Grid": False,
        "Robot": inner,
        "Value": True,
    }
    assert display.parts.names() == ["Grid", "Robot", "Robot/TF"]
    (refused,) = display.load_settings({"Panel Geometry": {**place, "Width": "wide"}})
    assert "Panel Geometry/Width: expected a" in refused


def test_displays_of_one_name_are_hidden_one_by_one(
    bench: SceneBench, load: Callable[..., Any]
) -> None:
    display, _ = load(CAMERA)
    scene = display.scene
    for group in ("A", "B", "C"):
        scene.move(scene.add("Grid", "Map"), group=scene.add("Group", group))
    maps = [one for one in scene.displays if one.name == "Map"]
    shown = {"Map": True, "Value": True}
    saved = {"A": {**shown, "Map": False}, "B": shown, "C": shown, "Value": True}
    display.load_settings({"Visibility": saved})
    assert [display.hides(one) for one in maps] == [True, False, False]
    assert display.save_settings({}, 2)["Visibility"] == saved
    # A name is that of all of them, until one of them is switched.
    display.hiddenDisplays = ["Map"]
    assert [display.parts.is_enabled(f"{group}/Map") for group in "ABC"] == [False] * 3
    display.parts.set_enabled("B/Map", True)
    assert [display.hides(one) for one in maps] == [True, False, True]
    assert display.hiddenDisplays == ["/A/Map", "/C/Map"]


@pytest.mark.parametrize("ros", [1, 2])
def test_the_matrix_of_ros_1_is_a_capital(ros: int) -> None:
    pytest.importorskip("PySide6")
    from rosglass.messages import load
    from rosglass.scene.displays.camera import _read_lens

    kind = load("sensor_msgs/msg/CameraInfo", ros=ros)
    lens = _read_lens(kind({"width": 4, "height": 3, "P" if ros == 1 else "p": P}))
    assert lens == (4, 3, 180, 190, 90, 80, 0, 0)


def test_panels_over_a_view_are_moved_and_resized(
    bench: SceneBench, load: Callable[..., Any]
) -> None:
    from PySide6.QtCore import QPoint, QRectF, Qt
    from PySide6.QtTest import QTest

    display, robot = load(IMAGE + "id: main; ImagePanels { anchors.fill: parent; view: main }")
    robot.show(display)
    bench.wait(lambda: bench.pixel(100, 240) == (0, 255, 255))
    left = Qt.MouseButton.LeftButton

    def drag(*points: tuple[int, int]) -> QRectF:
        QTest.mousePress(bench.window, left, pos=QPoint(*points[0]))
        for at in points[1:]:
            QTest.mouseMove(bench.window, QPoint(*at))
        QTest.mouseRelease(bench.window, left, pos=QPoint(*points[-1]))
        return display.panelGeometry

    assert drag((60, 160), (70, 140), (80, 130)) == QRectF(30, 125, 180, 135)
    assert drag((205, 255), (215, 260), (235, 275)) == QRectF(30, 125, 210, 155)
    assert drag((60, 130), (20, 100), (5, 130)) == QRectF(0, 125, 210, 155), "not out of the view"
    bench.view.scene.add("Grid")
    bench.wait(lambda: bench.pixel(205, 260) == (0, 255, 255))


@pytest.mark.parametrize("size", [(400, 300), (1200, 250), (300, 900)])
def test_many_panels_are_in_the_window_and_can_be_closed(
    bench: SceneBench, load: Callable[..., Any], size: tuple[int, int], caplog: Any
) -> None:
    from PySide6.QtCore import QObject, QPoint, QRectF, Qt
    from PySide6.QtTest import QTest

    bench.window.resize(*size)
    load(IMAGE + 'id: main; ImagePanels { objectName: "area"; anchors.fill: parent; view: main }')
    for number in range(5):
        bench.view.scene.add("Camera" if number % 2 else "Image", f"more{number}")
    area: Any = bench.view.findChild(QObject, "area")

    def panels() -> list[Any]:
        return [one for one in area.childItems() if one.property("has")]

    bench.wait(lambda: len(panels()) == 6 and bench.window.width() == size[0])
    places = [QRectF(one.x(), one.y(), one.width(), one.height()) for one in panels()]
    for at, place in enumerate(places):
        assert QRectF(0, 0, *size).contains(place), f"{place} is outside of the window"
        assert place.width() > 40
        assert not any(place.intersects(other) for other in places[:at])
    shown, display = panels()[4], panels()[4].property("display")
    button = shown.findChild(QObject, "closePanel")
    middle = button.mapToScene(QPoint(button.width() // 2, button.height() // 2)).toPoint()
    bench.picture()
    QTest.mouseMove(bench.window, middle)
    QTest.mouseClick(bench.window, Qt.MouseButton.LeftButton, pos=middle)
    assert not display.enabled
    assert not shown.isVisible()
    assert "cannot be used yet" not in caplog.text


@pytest.mark.parametrize("display", ["Camera", "Image"])
def test_one_display_of_images_brings_all_types_of_their_panel(display: str) -> None:
    # In a process of its own, which has loaded no other displays: types come with the first use.
    code = (
        "from rosglass.scene import Scene\n"
        "from rosglass.scene.app.modules import register_window\n"
        "from PySide6.QtQml import QQmlComponent, QQmlEngine\n"
        "from PySide6.QtGui import QGuiApplication\n"
        "app = QGuiApplication([])\n"
        "register_window()\n"
        f"Scene.TYPES[{display!r}]\n"
        "engine = QQmlEngine()\n"
        "component = QQmlComponent(engine)\n"
        "text = b'import QtQuick; import RosScene 1.0; Item { CameraView {} PictureItem {} }'\n"
        "component.setData(text, '')\n"
        "print(component.errorString() or 'ready')\n"
    )
    env = {**os.environ, "QT_QPA_PLATFORM": "offscreen"}
    done = subprocess.run(
        [sys.executable, "-c", code],
        env=env,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.stdout == "ready\n", done.stderr
