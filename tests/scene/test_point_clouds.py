"""The displays of point clouds: colours, styles, Decay Time, motion of a laser scanner."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from inside import queue_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from conftest import SceneBench

#: Seen from above, the middle of the frame is the origin, and 10 pixels are a metre.
CENTER, PIXELS_PER_M = (150, 200), 10
FLOAT32, UINT32 = 7, 6


def cloud(
    rows: Any, *names: str, types: dict[str, int] | None = None, **more: Any
) -> dict[str, Any]:
    """Return a PointCloud2 with float32 (or other) fields x, y, z and those named."""
    fields = ("x", "y", "z", *names)
    packed = np.zeros((len(rows), len(fields)), np.float32)
    for column, name in enumerate(fields):
        values = [row[column] for row in rows]
        if (types or {}).get(name) == UINT32:
            packed[:, column] = np.array(values, np.uint32).view(np.float32)
        else:
            packed[:, column] = values
    return {
        "header": {"frame_id": "map"},
        "height": 1,
        "width": len(rows),
        "fields": [
            {
                "name": name,
                "offset": 4 * column,
                "datatype": (types or {}).get(name, FLOAT32),
                "count": 1,
            }
            for column, name in enumerate(fields)
        ],
        "point_step": 4 * len(fields),
        "row_step": 4 * len(fields) * len(rows),
        "data": packed.tobytes(),
        "is_dense": True,
        **more,
    }


class Shown:
    """A display, and the publisher of its topic."""

    def __init__(self, bench: SceneBench, kind: str, settings: str = "") -> None:
        self.bench = bench
        body = f'view: "TopDownOrtho"; {kind}Display {{ topic: "/cloud"; size: 1; {settings} }}'
        self.display = bench.show(body)
        self.publisher = bench.publisher("/cloud", self.display.MESSAGES[0])

    def send(self, message: dict[str, Any]) -> Any:
        """Publish a message, and return the display once it has received it."""
        return self.bench.send(self.publisher, message, self.display)

    def at(self, x: float, y: float, picture: Any = None) -> tuple[int, ...]:
        """Return the colour of the frame at a position on the ground."""
        picture = self.bench.picture() if picture is None else picture
        row, column = round(CENTER[0] - y * PIXELS_PER_M), round(CENTER[1] + x * PIXELS_PER_M)
        return tuple(int(part) for part in picture[row, column])


@pytest.fixture
def show(bench: SceneBench) -> Callable[..., Shown]:
    return lambda kind, settings="": Shown(bench, kind, settings)


BACKGROUND = (48, 48, 48)


def near(color: tuple[int, ...], *wanted: int, tolerance: int = 2) -> bool:
    return all(abs(a - b) <= tolerance for a, b in zip(color, wanted, strict=True))


def test_points_have_rviz_rainbow_by_intensity(show: Callable[..., Shown]) -> None:
    shown = show("PointCloud2")
    rows = [(x, 0, 0, 10.0 + x) for x in range(-8, 9, 4)]
    display = shown.send(cloud(rows, "intensity"))
    assert display.statusLevel == "ok", display.statusText
    assert "Points: Showing [5] points from [1] messages" in display.statusText
    assert (display.minIntensity, display.maxIntensity) == (2.0, 18.0)
    assert display.usedColorTransformer == "Intensity"
    assert display.channels == ["intensity", "x", "y", "z"]
    picture = shown.bench.picture()
    # Red at the minimum, then yellow-green, cyan-green, blue, magenta.
    wanted = [(255, 0, 0), (191, 255, 0), (0, 255, 128), (0, 64, 255), (255, 0, 255)]
    for (x, *_), color in zip(rows, wanted, strict=True):
        assert near(shown.at(x, 0, picture), *color), (x, shown.at(x, 0, picture))
    display.invertRainbow = True
    assert near(shown.at(8, 0), 255, 0, 0)
    display.useRainbow = False
    display.minColor, display.maxColor = "#00ff00", "#0000ff"
    picture = shown.bench.picture()
    assert near(shown.at(-8, 0, picture), 0, 255, 0)
    assert near(shown.at(0, 0, picture), 0, 128, 128)
    assert near(shown.at(8, 0, picture), 0, 0, 255)
    display.autocomputeIntensityBounds = False
    display.minIntensity, display.maxIntensity = 10.0, 14.0
    picture = shown.bench.picture()
    assert near(shown.at(0, 0, picture), 0, 255, 0)
    assert near(shown.at(4, 0, picture), 0, 0, 255)


def test_points_have_packed_colors_with_alpha(show: Callable[..., Shown]) -> None:
    shown = show("PointCloud2")
    types = {"rgb": UINT32, "rgba": UINT32}
    display = shown.send(cloud([(-3, 0, 0, 0xFF8000), (3, 0, 0, 0x0080FF)], "rgb", types=types))
    assert display.usedColorTransformer == "RGB8"
    picture = shown.bench.picture()
    assert shown.at(-3, 0, picture) == (255, 128, 0)
    assert shown.at(3, 0, picture) == (0, 128, 255)
    shown.send(cloud([(-3, 0, 0, 0xFFFF8000), (3, 0, 0, 0x800080FF)], "rgba", types=types))
    picture = shown.bench.picture()
    assert shown.at(-3, 0, picture) == (255, 128, 0)
    assert near(shown.at(3, 0, picture), 24, 88, 152, tolerance=3)
    (drawable,) = display.root
    assert not drawable.opaque
    shown.send(cloud([(3, 0, 0, 0xFF0080FF)], "rgba", types=types))
    assert drawable.opaque, "no point needs blending"
    display.colorTransformer = "MONO8"
    red, green, blue = shown.at(-3, 0)
    assert red == green == blue
    display.colorTransformer = "FlatColor"
    display.color = "#00ffff"
    display.alpha = 0.5
    assert near(shown.at(3, 0), 24, 152, 152, tolerance=3)


def test_an_axis_is_that_of_the_fixed_frame(bench: SceneBench, show: Callable[..., Shown]) -> None:
    # The sensor lies on its side: its x is up.
    bench.place("sensor", at=(0, 0, 5), turn=(0, -math.sqrt(0.5), 0, math.sqrt(0.5)))
    shown = show("PointCloud2", 'colorTransformer: "AxisColor"')
    bench.wait(lambda: "sensor" in bench.view.scene.frames())
    rows = [(x, x * 4 - 4, 0) for x in (0, 1, 2)]
    display = shown.send(cloud(rows, header={"frame_id": "sensor"}))
    assert display.statusLevel == "ok", display.statusText
    assert (display.minValue, display.maxValue) == pytest.approx((5.0, 7.0))
    picture = bench.picture()
    assert near(shown.at(0, -4, picture), 255, 0, 0)
    assert near(shown.at(0, 0, picture), 0, 255, 128, tolerance=4)
    assert near(shown.at(0, 4, picture), 255, 0, 255)
    display.useFixedFrame = False
    display.axis = "X"
    assert (display.minValue, display.maxValue) == pytest.approx((0.0, 2.0))


@pytest.mark.parametrize("style", ["Points", "Squares", "Flat Squares", "Spheres", "Boxes"])
def test_styles_have_their_size(show: Callable[..., Shown], style: str) -> None:
    shown = show("PointCloud2", f'style: "{style}"; sizePixels: 9; color: "#00ff00"')
    display = shown.send(cloud([(0, 0, 0)]))
    display.colorTransformer = "FlatColor"
    display.size = 3
    picture = shown.bench.picture()
    green = int(((picture[..., 1] > 60) & (picture[..., 0] < 30)).sum())
    wanted = {"Points": 81, "Spheres": 707}.get(style, 900)
    assert wanted * 0.9 < green < wanted * 1.1


def test_boxes_and_spheres_have_the_light_of_rviz(show: Callable[..., Shown]) -> None:
    shown = show("PointCloud2", 'style: "Boxes"; colorTransformer: "FlatColor"')
    display = shown.send(cloud([(0, 0, 0)]))
    display.size = 4
    picture = shown.bench.picture()
    assert near(shown.at(0, 0, picture), 230, 230, 230)
    assert near(shown.at(1.9, 0, picture), 115, 115, 115, tolerance=10)
    display.style = "Spheres"
    picture = shown.bench.picture()
    assert near(shown.at(0, 0, picture), 255, 255, 255)
    assert near(shown.at(1, 0, picture), 242, 242, 242)
    assert near(shown.at(1.9, 0, picture), 207, 207, 207, tolerance=3)


def test_a_square_faces_the_eye_across_to_y(bench: SceneBench) -> None:
    display = bench.show('PointCloud2Display { topic: "/cloud"; size: 3 }')
    publisher = bench.publisher("/cloud", "sensor_msgs/PointCloud2")
    publisher.publish(cloud([(0, 0, 0)]))
    bench.wait(lambda: display.points == 1)
    # RViz's first view looks from (-x, -y) down at it: the square is seen turned by 35 degrees.
    rows, columns = np.nonzero((bench.picture() == 255).all(axis=2))
    box = (np.ptp(rows) + 1) * (np.ptp(columns) + 1)
    assert 0.4 < len(rows) / box < 0.7


@pytest.mark.parametrize("style", ["Squares", "Flat Squares"])
@pytest.mark.parametrize("view", ["Orbit", "TopDownOrtho"])
def test_squares_of_one_vertex_look_as_those_of_four(
    bench: SceneBench, monkeypatch: pytest.MonkeyPatch, style: str, view: str
) -> None:
    from rosglass.scene.render import renderer

    body = f'view: "{view}"; PointCloud2Display {{ topic: "/cloud"; style: "{style}" }}'
    (display,) = bench.load(body).scene.displays
    publisher = bench.publisher("/cloud", "sensor_msgs/PointCloud2")
    random = np.random.default_rng(0)
    rows = [*zip(*random.uniform(-4, 4, (3, 400)), random.uniform(0, 1, 400), strict=True)]
    publisher.publish(cloud(rows, "intensity"))
    bench.wait(lambda: display.received)
    if view == "Orbit":
        # So near that some are larger than the limit, and that they are turned.
        for name, value in (("Distance", 6.0), ("Yaw", 0.5), ("Pitch", 0.3)):
            bench.view.controller.set(name, value)
        bench.view.camera_moved()
    bench.wait(lambda: not bench.view.is_moving)

    def picture(limit_px: float) -> Any:
        monkeypatch.setattr(renderer, "SPRITE_PX", limit_px)
        for size in (0.3, 0.2):
            display.size = size
        return bench.picture().astype(int)

    by_points, by_quads = picture(16.0), picture(0.0)
    drawn = np.abs(by_quads - BACKGROUND).max(axis=2) > 3
    assert drawn.sum() > 1000
    # Only pixels at edges, by rounding; Squares have edges of less than a pixel.
    differs = np.abs(by_points - by_quads).max(axis=2) > (24 if style == "Squares" else 3)
    assert differs.sum() <= 0.02 * drawn.sum()


@pytest.mark.parametrize("transformer", ["AxisColor", "Intensity"])
def test_bounds_that_are_computed_do_not_change_a_config(
    bench: SceneBench, show: Callable[..., Shown], transformer: str
) -> None:
    shown = show("PointCloud2", f'colorTransformer: "{transformer}"')
    display = bench.view.scene.displays[0]
    before = display.save_settings()
    shown.send(cloud([(1, 2, 3, 7.0), (4, 5, 6, 9.0)], "intensity"))
    low = display.minValue if transformer == "AxisColor" else display.minIntensity
    assert low == {"AxisColor": 3.0, "Intensity": 7.0}[transformer]
    assert display.save_settings() == before
    display.autocomputeValueBounds = display.autocomputeIntensityBounds = False
    saved = display.save_settings()
    bounds = {"AxisColor": saved["Autocompute Value Bounds"]["Min Value"]}
    bounds["Intensity"] = saved["Min Intensity"]
    assert bounds[transformer] == low


def test_clouds_stay_for_the_decay_time(bench: SceneBench, show: Callable[..., Shown]) -> None:
    shown = show("PointCloud2", 'decayTime: 1000; colorTransformer: "FlatColor"')
    for x in (-3, 0, 3):
        display = shown.send(cloud([(x, 0, 0)]))
    assert "Showing [3] points from [3] messages" in display.statusText
    picture = bench.picture()
    assert [shown.at(x, 0, picture)[0] for x in (-3, 0, 3)] == [255] * 3
    drawables = len(list(display.root))
    display.decayTime = 0.3
    bench.wait(lambda: display.points == 0)
    assert shown.at(0, 0) == BACKGROUND
    display.decayTime = 0
    for x in (-3, 0):
        shown.send(cloud([(x, 0, 0)]))
    assert (drawables, len(list(display.root)), display.points) == (3, 1, 1)
    picture = bench.picture()
    assert shown.at(0, 0, picture) == (255, 255, 255)
    assert shown.at(-3, 0, picture) == BACKGROUND
    display.enabled = False
    display.enabled = True
    bench.wait.settled(bench.session)
    assert shown.at(0, 0) == BACKGROUND, "what is old does not return"


def test_each_cloud_counts_that_has_waited_for_its_transform(
    bench: SceneBench, show: Callable[..., Shown]
) -> None:
    shown = show("PointCloud2", 'decayTime: 1000; colorTransformer: "FlatColor"')
    for x in (-3, 0, 3):
        display = shown.send(cloud([(x, 0, 0)], header={"frame_id": "late"}))
    assert display.points == 0
    bench.place("late")
    bench.wait(lambda: display.points == 3)


def test_points_without_a_position_are_counted_and_not_drawn(show: Callable[..., Shown]) -> None:
    shown = show("PointCloud2", 'style: "Spheres"')
    nan, inf = math.nan, math.inf
    display = shown.send(cloud([(nan, 0, 0), (0, -inf, 0), (inf, nan, 0), (3, 0, 0)]))
    assert "Showing [1] points from [1] messages; [3] have no finite" in display.statusText
    assert (shown.bench.picture() != BACKGROUND).any(axis=2).sum() < 120
    display = shown.send(cloud([]))
    assert "Showing [0] points from [1] messages" in display.statusText


def test_a_cloud_of_too_many_points_is_an_error_in_words(
    show: Callable[..., Shown], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("rosglass.scene.displays.point_cloud._MAX_POINTS", 2)
    shown = show("PointCloud2")
    shown.send(cloud([(0, 0, 0)] * 2))
    display = shown.send(cloud([(3, 0, 0)] * 3))
    assert "3 points are more than the 2 that are drawn" in display.statusText
    assert shown.at(0, 0) == (255, 255, 255), "the last good cloud stays"


def test_transformer_without_its_fields_is_reported(show: Callable[..., Shown]) -> None:
    shown = show("PointCloud2", 'colorTransformer: "RGB8"')
    display = shown.send(cloud([(0, 0, 0, 1)], "ring"))
    assert display.statusLevel == "warn"
    assert "no fields for RGB8, so Intensity is used" in display.statusText
    display.colorTransformer = "Intensity"
    assert "no readable channel 'intensity'" in display.statusText
    display.channelName = "ring"
    assert display.statusLevel == "ok", display.statusText


def test_a_picked_point_has_all_fields(bench: SceneBench, show: Callable[..., Shown]) -> None:
    shown = show("PointCloud2")
    bench.view.scene.set_draws_in_software(True)
    random = np.random.default_rng(1).uniform(-9, 9, (500, 3))
    rows = [(x, y, 0, number) for number, (x, y, _) in enumerate(random)]
    display = shown.send(cloud(rows, "intensity"))
    x, y = rows[321][:2]
    hit = bench.view.pick(CENTER[1] + x * PIXELS_PER_M, CENTER[0] - y * PIXELS_PER_M, 0.0)
    # Squares of one metre overlap: the nearest of those at the same height is any of them.
    assert hit is not None
    described = dict(hit.drawable.owner.describe(hit.number))
    point = int(described["Point"])
    assert point != hit.number, "points are drawn in another order"
    assert described["3: intensity"] == str(point)
    assert described["Position in map"] == "; ".join(
        f"{float(np.float32(value)):.6g}" for value in rows[point][:3]
    )
    assert max(abs(rows[point][0] - x), abs(rows[point][1] - y)) <= 0.6
    display.selectable = False
    assert bench.view.pick(CENTER[1], CENTER[0], 50) is None


def test_a_cloud_returns_with_its_frame(bench: SceneBench, show: Callable[..., Shown]) -> None:
    shown = show("PointCloud2", "decayTime: 1000")
    shown.send(cloud([(0, 0, 0)]))
    bench.view.fixedFrame = "odom"
    assert "no transform from [map]" in shown.display.statusText
    assert shown.at(0, 0) == BACKGROUND
    shown.send(cloud([(0, 0, 0)], header={"frame_id": "odom"}))
    assert shown.at(0, 0) == (255, 255, 255)
    assert "Showing [1] points from [1] messages" in shown.display.statusText


def test_settings_of_a_subclass_stand_where_those_of_the_base_class_do() -> None:
    from rosglass.scene.displays.point_cloud import PointCloud2Display, TemperatureDisplay

    assert list(TemperatureDisplay.SETTINGS) == list(PointCloud2Display.SETTINGS)
    assert TemperatureDisplay.SETTINGS["Max Intensity"].default == 100.0
    assert PointCloud2Display.SETTINGS["Max Intensity"].default == 4096.0


def scan(ranges: list[float], **more: Any) -> dict[str, Any]:
    return {
        "header": {"frame_id": "map"},
        "angle_min": -math.pi / 2,
        "angle_increment": math.pi / 2,
        "range_min": 0.5,
        "range_max": 30.0,
        "ranges": ranges,
        **more,
    }


def test_a_laser_scan_is_drawn(show: Callable[..., Shown]) -> None:
    shown = show("LaserScan")
    intensities = [1.0, 2.0, 3.0, 4.0]
    display = shown.send(scan([5.0, 10.0, 5.0, math.inf], intensities=intensities))
    assert display.statusLevel == "ok", display.statusText
    assert "Showing [3] points from [1] messages" in display.statusText
    picture = shown.bench.picture()
    assert near(shown.at(0, -5, picture), 255, 0, 0)
    assert near(shown.at(10, 0, picture), 0, 255, 128, tolerance=3)
    assert near(shown.at(0, 5, picture), 255, 0, 255)
    display = shown.send(scan([1.0], intensities=[1.0, 2.0]))
    assert "2 intensities for 1 ranges" in display.statusText
    display = shown.send(scan([1.0, 1.0], time_increment=-1.0))
    assert "motion of the scanner is not corrected" in display.statusText
    display = shown.send(scan([1.0], angle_min=math.nan))
    assert "angle_min: expected a finite number" in display.statusText


def test_a_laser_scan_is_corrected_by_the_motion_of_the_scanner(
    bench: SceneBench, show: Callable[..., Shown]
) -> None:
    shown = show("LaserScan")

    def move(seconds: int, x: float) -> None:
        bench.move("laser", (x, 0, 0), seconds)

    move(10, 0.0)
    bench.wait(lambda: "laser" in bench.view.scene.frames())
    header = {"frame_id": "laser", "stamp": {"sec": 10, "nanosec": 0}}
    # Two seconds from the first ray to the last one.
    display = shown.send(scan([5.0, 5.0, 5.0], header=header, time_increment=1.0))
    assert display.points == 0, "where the scanner was at the last ray is not known yet"
    move(14, 12.0)
    bench.wait(lambda: display.points == 3)
    assert display.statusLevel == "ok", display.statusText
    picture = bench.picture()
    for x, y in ((0, -5), (3 + 5, 0), (6, 5)):
        assert shown.at(x, y, picture) == (255, 255, 255), (x, y)


def test_a_point_cloud_of_the_old_type_is_drawn(show: Callable[..., Shown]) -> None:
    shown = show("PointCloud", 'channelName: "heat"')
    points = [{"x": -3.0, "y": 0.0, "z": 0.0}, {"x": 3.0, "y": 0.0, "z": 0.0}]
    display = shown.send(
        {
            "header": {"frame_id": "map"},
            "points": points,
            "channels": [{"name": "heat", "values": [1.0, 2.0]}, {"name": "b", "values": [1.0]}],
        }
    )
    assert "channel 'b' has 1 values for 2 points and is left out" in display.statusText
    picture = shown.bench.picture()
    assert near(shown.at(-3, 0, picture), 255, 0, 0)
    assert near(shown.at(3, 0, picture), 255, 0, 255)


@pytest.mark.parametrize(
    ("kind", "field", "value", "color"),
    [
        ("Temperature", "temperature", 100.0, (255, 0, 0)),
        ("FluidPressure", "fluid_pressure", 98_000.0, (255, 0, 0)),
        ("Illuminance", "illuminance", 1000.0, (255, 0, 255)),
        ("RelativeHumidity", "relative_humidity", 0.5, (0, 255, 128)),
    ],
)
def test_a_measured_value_is_a_point_of_its_color(
    show: Callable[..., Shown], kind: str, field: str, value: float, color: tuple[int, int, int]
) -> None:
    shown = show(kind)
    display = shown.send({"header": {"frame_id": "map"}, field: value})
    assert display.statusLevel == "ok", display.statusText
    assert near(shown.at(0, 0), *color, tolerance=3)


DEPTH = {"height": 2, "width": 2, "encoding": "16UC1", "step": 4}
COLOR = {"height": 2, "width": 2, "encoding": "rgb8", "step": 6}
CAMERA = {"width": 2, "height": 2, "p": [1.0, 0, 0.5, 0, 0, 1.0, 0.5, 0, 0, 0, 1.0, 0]}


class Camera:
    """A display of depth images, and the publishers of a camera that looks down from above."""

    def __init__(self, bench: SceneBench, settings: str = "") -> None:
        bench.place("camera", at=(0, 0, 10), turn=(1, 0, 0, 0))
        self.bench = bench
        body = f'DepthCloudDisplay {{ topic: "/camera/depth/image_raw"; {settings} }}'
        (self.display,) = bench.load(f'view: "TopDownOrtho"; {body}').scene.displays
        bench.wait(lambda: "camera" in bench.view.scene.frames())
        names = {
            "/camera/depth/image_raw": "Image",
            "/camera/depth/camera_info": "CameraInfo",
            "/camera/rgb/image_raw": "Image",
        }
        self.publishers = {
            name: bench.robot.create_publisher(name, f"sensor_msgs/{kind}")
            for name, kind in names.items()
        }
        bench.wait(self.publishers["/camera/depth/camera_info"].subscription_count)

    def send(self, topic: str, message: dict[str, Any], second: int = 1) -> Any:
        header = {"frame_id": "camera", "stamp": {"sec": second, "nanosec": 0}}
        self.bench.wait(self.publishers[topic].subscription_count)
        message = {"header": header, **message}
        self.bench.send(self.publishers[topic], message, queue_of(self.display))
        return self.display

    def depth(self, values: list[int], second: int = 1, **more: Any) -> Any:
        data = np.array(values, "<u2").tobytes()
        return self.send("/camera/depth/image_raw", {**DEPTH, "data": data, **more}, second)

    def color(self, value: tuple[int, int, int], second: int = 1, **more: Any) -> Any:
        data = bytes(value) * 4
        return self.send("/camera/rgb/image_raw", {**COLOR, "data": data, **more}, second)


def test_a_depth_image_is_a_cloud_of_squares_of_its_pixels(bench: SceneBench) -> None:
    camera = Camera(bench)
    display = camera.depth([4000, 4000, 0, 8000])
    assert "no camera info received; publish it on /camera/depth/camera_info" in display.statusText
    camera.send("/camera/depth/camera_info", CAMERA)
    camera.depth([4000, 4000, 0, 8000])
    assert display.statusLevel == "ok", display.statusText
    assert "Showing [3] points from [1] messages" in display.statusText
    picture = bench.picture()
    white = int((picture == 255).all(axis=2).sum())
    # Pixels of 4 m at (-2, 2) and (2, 2), one of 8 m at (4, -4) below these.
    assert white == pytest.approx((2 * 16 + 64) * PIXELS_PER_M**2, rel=0.03)
    corner = bench.view.pick(CENTER[1] + 70, CENTER[0] + 70, 0.0)
    assert corner is not None
    assert corner.point == pytest.approx((4, -4, 2))
    display.autoSize = False
    display.size = 1.0
    assert bench.view.pick(CENTER[1] + 70, CENTER[0] + 70, 0.0) is None
    white = int((bench.picture() == 255).all(axis=2).sum())
    assert white == pytest.approx(3 * PIXELS_PER_M**2, rel=0.03)
    hit = bench.view.pick(CENTER[1] + 40, CENTER[0] + 40, 1.0)
    assert hit is not None
    assert hit.point == pytest.approx((4, -4, 2))


def test_a_depth_image_has_the_color_of_its_time(bench: SceneBench) -> None:
    camera = Camera(bench, 'colorTopic: "/camera/rgb/image_raw"')
    camera.send("/camera/depth/camera_info", CAMERA)
    display = camera.color((255, 0, 0), 1)
    assert display.statusLevel != "error", display.statusText
    camera.depth([4000] * 4, 2)
    assert display.points == 0, "a colour image of a nearer time may follow"
    camera.color((0, 255, 0), 2)
    assert display.points == 4
    assert tuple(bench.picture()[CENTER[0] - 20, CENTER[1] - 20]) == (0, 255, 0)
    camera.color((0, 0, 255), 9)
    camera.depth([4000] * 4, 3)
    assert tuple(bench.picture()[CENTER[0] - 20, CENTER[1] - 20]) == (0, 255, 0)
    display = camera.depth([4000] * 4, 8, header={"frame_id": "map"})
    assert "the frame of the depth image is [map], that of the colour image [camera]" in (
        display.statusText
    )


def test_color_images_that_stop_are_an_error(bench: SceneBench) -> None:
    camera = Camera(bench, 'colorTopic: "/camera/rgb/image_raw"')
    camera.send("/camera/depth/camera_info", CAMERA)
    camera.color((255, 0, 0), 2)
    assert camera.depth([4000] * 4, 2).statusLevel == "ok"
    assert camera.depth([4000] * 4, 5).statusLevel == "ok", "its colour image may follow"
    display = camera.depth([4000] * 4, 6)
    assert display.statusLevel == "error"
    text = "the last colour image of /camera/rgb/image_raw is 4 s older than the depth image"
    assert text in display.statusText
    assert camera.color((0, 255, 0), 6).statusLevel == "ok", display.statusText


def test_depth_images_that_stop_fade(bench: SceneBench, monkeypatch: pytest.MonkeyPatch) -> None:
    from rosglass.scene.displays import topic_display as module

    monkeypatch.setattr(module, "_CONTINUOUS_S", 0.5)
    camera = Camera(bench)
    camera.send("/camera/depth/camera_info", CAMERA)
    display = camera.depth([4000] * 4, 1)
    bench.wait(lambda: display.root.alpha < 1.0)
    assert "Data: no message for " in display.statusText
    camera.depth([4000] * 4, 2)
    bench.wait(lambda: display.root.alpha == 1.0)


def test_depth_and_color_images_may_be_compressed(bench: SceneBench) -> None:
    cv2 = pytest.importorskip("cv2", reason="compressed images need OpenCV")
    topics = {
        "/camera/depth/image_raw/compressedDepth": "16UC1; compressedDepth png",
        "/camera/rgb/image_raw/compressed": "rgb8; png compressed bgr8",
    }
    camera = Camera(
        bench,
        'transport: "compressedDepth"; colorTopic: "/camera/rgb/image_raw"\n'
        'colorTransport: "compressed"',
    )
    for topic in topics:
        camera.publishers[topic] = bench.robot.create_publisher(
            topic, "sensor_msgs/CompressedImage"
        )
    camera.send("/camera/depth/camera_info", CAMERA)
    depth, color = np.full((2, 2), 4000, np.uint16), np.full((2, 2, 3), (0, 128, 255), np.uint8)
    files = [bytes(12) + cv2.imencode(".png", depth)[1].tobytes(), cv2.imencode(".png", color)[1]]
    for (topic, kind), file in zip(topics.items(), files, strict=True):
        display = camera.send(topic, {"format": kind, "data": bytes(file)})
    assert display.statusLevel == "ok", display.statusText
    assert display.points == 4
    assert tuple(bench.picture()[CENTER[0] - 20, CENTER[1] - 20]) == (255, 128, 0)
    camera.send(next(iter(topics)), {"format": "16UC1; compressedDepth png", "data": bytes(20)}, 2)
    display = camera.send(list(topics)[1], {"format": "rgb8; jpeg", "data": b""}, 2)
    assert display.statusLevel == "error"


@pytest.mark.parametrize(
    ("camera_info", "change", "text"),
    [
        ({"width": 0, "height": 0}, {"width": 3_000_000}, "step"),
        ({"p": [0.0] * 12}, {}, "the focal length is 0"),
        ({"p": [math.nan] * 12}, {}, "expected 12 finite numbers"),
    ],
)
def test_a_bad_depth_image_is_an_error_in_words(
    bench: SceneBench, camera_info: dict[str, Any], change: dict[str, Any], text: str
) -> None:
    camera = Camera(bench)
    camera.send("/camera/depth/camera_info", {**CAMERA, **camera_info})
    display = camera.depth([4000] * 4, **change)
    assert display.statusLevel == "error"
    assert text in display.statusText


def test_a_depth_cloud_keeps_its_topics_in_files() -> None:
    from rosglass.scene.displays.depth_cloud import DepthCloudDisplay

    display = DepthCloudDisplay()
    saved = {
        "Class": "rviz/DepthCloud",
        "Depth Map Topic": "/depth",
        "Color Image Topic": "/rgb",
        "Queue Size": 7,
        "Auto Size": {"Auto Size Factor": 2, "Value": False},
    }
    assert display.load_settings(saved) == []
    assert (display.topic, display.colorTopic, display.depth) == ("/depth", "/rgb", 7)
    assert (display.autoSize, display.autoSizeFactor) == (False, 2.0)
    for ros in (1, 2):
        kept = display.save_settings(saved, ros)
        assert {key: kept[key] for key in saved} == saved
        assert "Topic" not in kept


def test_hidden_points_stay_until_they_time_out(bench: SceneBench) -> None:
    camera = Camera(bench, "occlusionCompensation: true; occlusionTimeOut: 10")
    camera.send("/camera/depth/camera_info", CAMERA)
    display = camera.depth([4000] * 4, 1)
    assert display.points == 4
    # Two pixels are hidden by something nearer, one is not known any more.
    display = camera.depth([2000, 2000, 0, 4000], 2)
    assert display.points == 6
    assert "Occlusion: [3] points are of earlier images, 10 s old at most" in display.statusText
    assert display.statusLevel == "ok", display.statusText
    ((shown, _, _),) = display.root.drawables()
    depths = sorted(np.round(shown.xyz()[:, 2], 3).tolist())
    assert depths == [2.0, 2.0, 4.0, 4.0, 4.0, 4.0]
    assert camera.depth([2000, 2000, 0, 4000], 11).points == 6
    assert camera.depth([2000, 2000, 0, 4000], 12).points == 3, "10 s after the first image"
    assert camera.depth([2000, 2000, 3000, 0], 13).points == 4, "the last pixel was seen before"
    display.occlusionCompensation = False
    assert camera.depth([0, 0, 0, 4000], 14).points == 1
    assert "Occlusion" not in display.statusText
    display.occlusionCompensation = True
    assert camera.depth([0, 0, 0, 4000], 15).points == 1, "nothing of before is known"


def test_hidden_points_are_dropped_when_the_camera_moves(bench: SceneBench) -> None:
    camera = Camera(bench, "occlusionCompensation: true")
    camera.send("/camera/depth/camera_info", CAMERA)
    near = [2000, 2000, 0, 4000]
    camera.depth([4000] * 4, 1)
    assert camera.depth(near, 2).points == 6

    def move(height: float, roll: float = math.pi) -> None:
        turn = (math.sin(roll / 2), 0, 0, math.cos(roll / 2))
        bench.place("camera", at=(0, 0, height), turn=turn)
        scene = bench.view.scene
        bench.wait(lambda: abs(scene.look_up("camera")[2, 3] - height) < 1e-6)

    move(10.005)
    assert camera.depth(near, 3).points == 6, "not as far as 1 cm"
    move(9.98)
    assert camera.depth(near, 4).points == 3
    assert camera.depth(near, 5).points == 3
    assert camera.depth([1000] * 4, 6).points == 4 + 3
    move(9.985, math.pi + math.radians(0.6))
    assert camera.depth([1000] * 4, 7).points == 4, "turned by more than 0.5 degrees"
    assert "[0] points are of earlier images" in camera.display.statusText


def test_the_brightness_of_hidden_points_is_half(bench: SceneBench) -> None:
    camera = Camera(bench, 'occlusionCompensation: true; colorTopic: "/camera/rgb/image_raw"')
    camera.send("/camera/depth/camera_info", CAMERA)
    camera.color((0, 200, 100), 1)
    camera.depth([4000] * 4, 1)
    camera.color((200, 0, 0), 2)
    # The points that hide others are out of the frame.
    camera.depth([60, 60, 60, 60], 2)
    bench.wait(lambda: camera.display.points == 8)
    assert tuple(bench.picture()[CENTER[0] - 40, CENTER[1] - 40]) == (0, 100, 50)


@pytest.mark.parametrize("end", ["", "/compressedDepth"])
def test_the_calibration_is_beside_the_images_of_any_transport(end: str) -> None:
    from rosglass.scene.displays.depth_cloud import DepthCloudDisplay

    topics = DepthCloudDisplay().further_topics(f"/camera/depth/image_raw{end}")
    assert topics == ("/camera/depth/camera_info",)


def test_occlusion_compensation_is_kept_in_files() -> None:
    from rosglass.scene.displays.depth_cloud import DepthCloudDisplay

    display = DepthCloudDisplay()
    saved = {
        "Depth Map Topic": "/depth",
        "Occlusion Compensation": {"Occlusion Time-Out": 5, "Value": True},
    }
    assert display.load_settings(saved) == []
    assert (display.occlusionCompensation, display.occlusionTimeOut) == (True, 5.0)
    for ros in (1, 2):
        kept = display.save_settings(saved, ros)
        assert kept["Occlusion Compensation"] == saved["Occlusion Compensation"]


@pytest.mark.parametrize("ros", [1, 2])
def test_a_depth_image_of_either_ros_is_a_cloud(ros: int) -> None:
    from rosglass.errors import Error
    from rosglass.messages import load
    from rosglass.scene.displays.depth_cloud import DepthCloudDisplay

    def received(name: str, value: dict[str, Any]) -> Any:
        kind = load(f"sensor_msgs/msg/{name}", ros=ros)
        return kind.decode(kind.encode(value))

    prepare = DepthCloudDisplay().preparer()
    camera = {"P" if ros == 1 and name == "p" else name: value for name, value in CAMERA.items()}
    # A region of 4 x 2 pixels of a sensor with 8 x 6, of which 2 x 1 become one.
    sensor = {**camera, "width": 8, "height": 6, "binning_x": 2}
    region = {"x_offset": 2, "y_offset": 4, "width": 4, "height": 2}
    assert prepare(received("CameraInfo", {**sensor, "roi": region})) is None
    data = np.array([1000, 0, 0, 2000], "<u2").tobytes()
    found = prepare(received("Image", {**DEPTH, "data": data}))
    assert found.cloud.point_count == 2
    assert found.pixel_m == 2.0
    assert prepare(received("CameraInfo", sensor)) is None
    with pytest.raises(Error, match=r"2x2 pixels, the camera info 4x6; use the camera"):
        prepare(received("Image", {**DEPTH, "data": data}))
