"""The map and the scan as images, and the figures of the demo."""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

pytest.importorskip("cv2", reason="the simulated camera needs the extra `camera`")
multimedia = pytest.importorskip("PySide6.QtMultimedia", reason="needs the extra `camera`")

from PySide6.QtCore import QSize, Qt  # noqa: E402
from PySide6.QtGui import QColor, QImage  # noqa: E402

from rosglass.demo import framecode  # noqa: E402
from rosglass.demo.app import CameraFigures, Latency, table  # noqa: E402
from rosglass.demo.camera import CODE_POSITION, HEIGHT, WIDTH  # noqa: E402
from rosglass.demo.pictures import paint_map, paint_scan, register  # noqa: E402
from rosglass.errors import Error  # noqa: E402

if TYPE_CHECKING:
    from collections.abc import Callable

pytestmark = pytest.mark.usefixtures("app")


def test_a_map_is_painted_north_up_and_unknown_stays_transparent() -> None:
    cells = np.zeros((3, 4), np.int8)
    cells[0, 0] = 100  # south-west
    cells[2, 3] = -1  # north-east
    picture = paint_map(cells.ravel(), 4, 3)
    assert picture.size() == QSize(4, 3)
    free, taken = picture.pixelColor(1, 1), picture.pixelColor(0, 2)
    assert taken.lightness() > free.lightness() + 50
    assert picture.pixelColor(3, 0).alpha() == 0
    assert free.alpha() == 255


def test_a_map_that_contradicts_itself_is_refused() -> None:
    with pytest.raises(Error, match="4 x 3 cells but brings 11"):
        paint_map(np.zeros(11, np.int8), 4, 3)


def test_a_scan_is_painted_where_the_beams_end() -> None:
    ranges = np.full(360, 4.0, np.float32)
    ranges[180:] = np.inf
    picture = paint_scan(ranges, 0.0, math.tau / 360, 100, 10.0)
    ahead, left, right = (picture.pixelColor(x, y) for x, y in ((90, 50), (50, 10), (50, 90)))
    assert ahead.red() > 150, "a beam's end"
    assert left.red() > 150, "counter-clockwise is up"
    assert right.red() < 150, "nothing was hit there"
    assert picture.pixelColor(2, 2).alpha() == 0


def grid(**fields: Any) -> dict[str, Any]:
    info = {"resolution": 0.5, "width": 4, "height": 2, "origin": {"position": {"x": -1.0}}}
    info.update(fields)
    return {"info": info, "data": [0, 0, 0, 100, 0, 0, 0, 0]}


@pytest.fixture
def view(running: Any) -> Any:
    """An interface with a map and a scan."""
    register()
    return running.load(
        """QtObject {
            property QtObject map: MapPicture { topic: "/map" }
            property QtObject scan: ScanPicture { topic: "/scan"; limit: 0.3 }
        }""",
        "import RosglassDemo 1.0",
    )


def test_the_map_arrives_with_its_place(running: Any, view: Any, wait: Callable[..., None]) -> None:
    from rosglass.comm import QoS

    element = view.property("map")
    assert (element.property("received"), element.property("age")) == (False, -1.0)
    running.robot.create_publisher("/map", "nav_msgs/msg/OccupancyGrid", QoS.latched()).publish(
        grid()
    )
    wait(lambda: element.property("received"))
    numbers = [element.property(n) for n in ("left", "bottom", "metresWide", "metresHigh")]
    assert numbers == [-1.0, 0.0, 2.0, 1.0]
    assert element.property("source").toString().startswith("image://")
    assert element.property("problem") == ""


@pytest.mark.parametrize(
    ("fields", "named"),
    [
        ({"width": 5}, "5 x 2 cells"),
        ({"width": 100_000, "height": 100_000}, "too many"),
        ({"resolution": 0.0}, "resolution"),
        ({"origin": {"orientation": {"z": 0.7, "w": 0.7}}}, "rotated"),
    ],
)
def test_a_map_that_cannot_be_shown_says_why(
    running: Any, view: Any, wait: Callable[..., None], fields: dict[str, Any], named: str
) -> None:
    from rosglass.comm import QoS

    element = view.property("map")
    running.robot.create_publisher("/map", "nav_msgs/msg/OccupancyGrid", QoS.latched()).publish(
        grid(**fields)
    )
    wait(lambda: element.property("problem"))
    assert named in element.property("problem")
    assert not element.property("received")


def test_a_scan_that_stops_is_stale(running: Any, view: Any, wait: Callable[..., None]) -> None:
    from rosglass.comm import QoS

    element = view.property("scan")
    laser = running.robot.create_publisher("/scan", "sensor_msgs/msg/LaserScan", QoS.sensor_data())
    wait(laser.subscription_count)
    laser.publish(ranges=[1.0, math.inf, math.nan, 2.5], angle_increment=0.1)
    wait(lambda: element.property("received"))
    assert not element.property("stale")
    assert element.property("metres") == 6.0
    wait(lambda: element.property("stale"))
    laser.publish(ranges=[], angle_increment=0.1)
    wait(lambda: not element.property("stale"))


def test_a_destroyed_image_is_not_subscribed_any_more(
    running: Any, view: Any, wait: Callable[..., None]
) -> None:
    laser = running.robot.create_publisher("/scan", "sensor_msgs/msg/LaserScan")
    wait(laser.subscription_count)
    view.property("scan").deleteLater()
    wait(lambda: laser.subscription_count() == 0)


class Window:
    """As much of a window as the figures need."""

    def __init__(self) -> None:
        from PySide6.QtCore import QObject, Signal

        class Swapping(QObject):
            frameSwapped = Signal()  # noqa: N815 - Qt's

        self.item = Swapping()


def frame(number: int, age: float = 0.0) -> Any:
    """Return a video frame with a frame code in it."""
    picture = np.zeros((HEIGHT, WIDTH, 4), np.uint8)
    code = framecode.FrameCode.at(time.time_ns() - round(age * 1e9), number)
    framecode.draw(picture, code, *CODE_POSITION)
    image = QImage(picture.data, WIDTH, HEIGHT, 4 * WIDTH, QImage.Format.Format_RGBX8888).copy()
    return multimedia.QVideoFrame(image)


def test_images_are_counted_and_timed(wait: Callable[..., None]) -> None:
    sink, window = multimedia.QVideoSink(), Window()
    figures = CameraFigures(sink, window.item)  # type: ignore[arg-type]
    for count, number in enumerate((65_534, 65_535, 0, 3, 4, 1), start=1):
        sink.setVideoFrame(frame(number, 0.05))
        window.item.frameSwapped.emit()
        wait(lambda count=count: len(figures.latencies) == count)
    assert figures.frames == 6
    assert figures.missing == 2, "1 and 2; then the robot was restarted"
    assert list(figures.latencies) == pytest.approx([0.05] * 6, abs=0.04)


def test_images_of_other_cameras_are_only_counted() -> None:
    sink, window = multimedia.QVideoSink(), Window()
    figures = CameraFigures(sink, window.item)  # type: ignore[arg-type]
    plain = QImage(320, 240, QImage.Format.Format_RGBX8888)
    plain.fill(QColor(Qt.GlobalColor.red))
    sink.setVideoFrame(multimedia.QVideoFrame(plain))
    assert (figures.frames, figures.missing, list(figures.latencies)) == (1, 0, [])


def test_latency_without_samples_is_nan() -> None:
    assert math.isnan(Latency.of([]).median)
    assert Latency.of([0.01, 0.02, 0.03]) == Latency(3, 20.0, pytest.approx(29.0), 30.0)


def test_tables_line_up() -> None:
    text = table([["topic", "Hz"], ["/a", "30.0"], ["/long/name", ""]])
    assert text.splitlines() == [
        "topic       Hz",
        "----------  ----",
        "/a          30.0",
        "/long/name",
    ]
