"""The displays of point clouds: PointCloud2, PointCloud, LaserScan, measured values.

The node's thread reads a message as a :class:`~rosglass.scene.data.point_clouds.Cloud` and
prepares its vertices; the GUI thread places it and sets a few numbers of the shader.
"""
# ruff: noqa: N815 - the names of properties are QML's

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple, cast

import numpy as np

from rosglass.comm.time import Time
from rosglass.errors import Error, TransformException
from rosglass.qml.engine.properties import ReadOnly, report
from rosglass.qt import Slot
from rosglass.scene.configs.settings import Setting, rgb_of
from rosglass.scene.data.cloud_sources import (
    cloud_from_columns,
    cloud_from_laser_scan,
    cloud_from_point_cloud,
)
from rosglass.scene.data.point_clouds import Cloud, CloudHistory, is_ordered, order_points
from rosglass.scene.displays.topic_display import TopicDisplay
from rosglass.scene.render.drawing import Points
from rosglass.scene.render.point_colors import (
    COLOR_TRANSFORMERS,
    AxisColor,
    FlatColor,
    Intensity,
    Mono8,
    Rgb8,
    RgbF32,
    choose_color_transformer,
    supported_color_transformers,
)
from rosglass.tf import Transform

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    from numpy.typing import NDArray

    from rosglass.messages import Message
    from rosglass.qml.engine.runtime import Runtime
    from rosglass.qt import QtCore
    from rosglass.scene.data.point_clouds import CloudEntry, VertexData
    from rosglass.scene.render.point_colors import ColorTransformer, PointColors

__all__ = [
    "MAX_SIZE_M",
    "METRIC_STYLES",
    "CloudDisplay",
    "ColorSettings",
    "FluidPressureDisplay",
    "IlluminanceDisplay",
    "LaserScanDisplay",
    "PointCloud2Display",
    "PointCloudDisplay",
    "PreparedCloud",
    "RelativeHumidityDisplay",
    "TemperatureDisplay",
    "size_setting",
]

#: The largest value of a float32, which is what shaders compute with.
_MAX_FLOAT = 3e38
#: Largest size of points in metres and in pixels.
MAX_SIZE_M, _MAX_SIZE_PX = 1000.0, 256.0
#: Most points of one cloud: more do not fit into a buffer of the GPU.
_MAX_POINTS = 20_000_000
#: Seconds that one turn of a laser scanner may take.
_MAX_SCAN_S = 10.0
#: Metres, or half of the radians, up to which a scanner has not moved during a scan.
_STILL = 1e-5

#: Conditions of settings: the colour transformers and styles that they belong to.
_INTENSITY = {"wanted_transformer": "Intensity"}
_AXIS_COLOR = {"wanted_transformer": "AxisColor"}
_RAINBOW = {**_INTENSITY, "useRainbow": True}
_TWO_COLORS = {**_INTENSITY, "useRainbow": False}
METRIC_STYLES = {"style": ("Squares", "Flat Squares", "Spheres", "Boxes")}


class PreparedCloud(NamedTuple):
    """A cloud that is ready to be drawn.

    Attributes:
        cloud: The cloud.
        transformer: Name of the colour transformer.
        vertices: Its vertices, with the channel that the transformer needs.
        colors: Its colours, as if its frame was the fixed frame.
        is_translucent: Whether points have an opacity each, and not all are opaque.
        source: The message that it is from, if others belong to it, or it is needed again.
        duration_ns: Time from the first ray of a laser scan to its last one, nanoseconds.
        pixel_m: Size of a pixel of a depth image at a depth of 1 m, metres.
        hidden: How many of the last points are of earlier depth images.
    """

    cloud: Cloud
    transformer: str
    vertices: VertexData
    colors: PointColors
    is_translucent: bool
    source: Any = None
    duration_ns: int = 0
    pixel_m: float = 0.0
    hidden: int = 0


class ColorSettings(NamedTuple):
    """The settings of colours of a display, as values for the node's thread.

    Attributes:
        chosen: The user's choice; empty for RViz's.
        transformers: All transformers by name.
        orders_points: Whether the processor draws, which is faster if neighbours follow each other:
            200,000 random points take llvmpipe 94 instead of 127 ms, and 4 ms to order.
    """

    chosen: str
    transformers: dict[str, ColorTransformer]
    orders_points: bool

    def prepare(self, cloud: Cloud) -> PreparedCloud:
        """Return a cloud with everything that depends on each of its points."""
        if cloud.point_count > _MAX_POINTS:
            raise Error(
                f"{cloud.point_count} points are more than the {_MAX_POINTS} that are drawn; "
                "publish a thinned-out cloud"
            )
        name = choose_color_transformer(cloud.layout, self.chosen)
        # These are computed once: the GUI thread only reads them.
        cloud.bounds()
        colors = self.transformers[name].colors(cloud)
        vertices = cloud.vertex_data(colors.channel)
        if self.orders_points and not is_ordered(cloud):
            vertices = order_points(cloud, vertices)
        is_translucent = False
        if colors.per_point_alpha and vertices.count:
            shape, strides = (vertices.count,), (vertices.stride,)
            alpha = np.ndarray(shape, np.uint8, vertices.data, vertices.channel + 3, strides)
            is_translucent = int(alpha.min()) < 255
        return PreparedCloud(cloud, name, vertices, colors, is_translucent)


class _ShownCloud:
    """A cloud on the screen, and what a pick of its points finds.

    Attributes:
        points: The drawable.
        display: The display that shows it.
    """

    def __init__(self, display: CloudDisplay) -> None:
        self.points, self.display = Points(), display
        self._data: PreparedCloud | None = None
        self._pose: NDArray[np.float64] = np.eye(4)
        self._frame = ""

    def set_cloud(self, data: PreparedCloud, pose: NDArray[np.float64], frame: str) -> None:
        """Set the cloud, its pose in the fixed frame, and its frame."""
        self._data, self._pose, self._frame = data, pose, frame
        self.points.pose = pose
        self._set_vertices(data)

    def _set_vertices(self, data: PreparedCloud) -> None:
        vertices = data.vertices
        self.points.set_data(
            vertices.data,
            vertices.count,
            vertices.stride,
            position=vertices.position,
            channel=vertices.channel,
            channel_is_bytes=vertices.channel_is_bytes,
            box=data.cloud.bounds(),
        )

    def restyle(self, settings: ColorSettings) -> PointColors | None:
        """Apply the display's settings, and return the colours."""
        data, display = self._data, self.display
        if data is None:
            return None
        name = choose_color_transformer(data.cloud.layout, settings.chosen)
        colors = settings.transformers[name].colors(data.cloud, self._pose)
        if name != data.transformer or colors.channel != data.colors.channel:
            new = settings.prepare(data.cloud)
            data = self._data = new._replace(source=data.source, pixel_m=data.pixel_m)
            self._set_vertices(data)
        size, by_depth = display._point_size(data)
        self.points.set_look(
            style=display.style.lower(),
            size=size,
            size_by_depth=by_depth,
            alpha=display.alpha,
            coloring=replace(colors, per_point_alpha=data.is_translucent),
        )
        self.points.owner = self if display.selectable else None
        return colors

    @property
    def transformer(self) -> str:
        """Name of the colour transformer in use."""
        return "" if self._data is None else self._data.transformer

    def describe(self, number: int | None = None) -> list[tuple[str, str]]:
        """Return names and values for the Selection panel: of one point, or of the cloud.

        Args:
            number: Number of the point, as a pick returns it.
        """
        data = self._data
        if data is None:
            return []
        if number is None:
            names = ", ".join(data.cloud.layout.channels)
            return [("Points", str(data.cloud.finite_count)), ("Fields", names)]
        point = data.vertices.point_index(number)
        (_, position), *values = data.cloud.describe_point(point)
        # The selection knows the position in the fixed frame.
        found = [("Point", point), (f"Position in {self._frame or 'its frame'}", position), *values]
        return [(name, _text_of(value)) for name, value in found]


def _text_of(value: Any) -> str:
    if isinstance(value, tuple):
        return "; ".join(_text_of(part) for part in value)
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _channel(default: str) -> Setting:
    text = "Field that Intensity colours by."
    return Setting("Channel Name", "string", default, text, shown_if=_INTENSITY)


def _autocompute(default: bool) -> Setting:
    return Setting(
        "Autocompute Intensity Bounds",
        "bool",
        default,
        "Take the bounds from the points.",
        shown_if=_INTENSITY,
    )


def _bound(path: str, default: float) -> Setting:
    name = "first" if "Min" in path else "last"
    text = f"Value of the {name} colour; metres for AxisColor."
    shown_if: dict[str, Any] = {**_INTENSITY, "autocomputeIntensityBounds": False}
    if "Intensity" not in path:
        shown_if = {**_AXIS_COLOR, "autocomputeValueBounds": False}
    return Setting(path, "float", default, text, min=-_MAX_FLOAT, max=_MAX_FLOAT, shown_if=shown_if)


def _invert(default: bool) -> Setting:
    text = "Show the maximum in red."
    return Setting("Invert Rainbow", "bool", default, text, shown_if=_RAINBOW)


def size_setting(**conditions: Any) -> Setting:
    """Return the setting of the size of points in metres, shown under these conditions, too."""
    return Setting(
        "Size (m)", "float", 0.01, "Size of points in metres.", min=0.0001,
        max=MAX_SIZE_M, shown_if={**METRIC_STYLES, **conditions},
    )  # fmt: skip


class CloudDisplay(TopicDisplay):
    """Base class of displays of points: their settings, colours and Decay Time."""

    #: Converts a message to a cloud, in the node's thread.
    READ: ClassVar[Callable[[Any], Cloud]] = Cloud.from_message

    selectable = Setting("Selectable", "bool", True, "Let points be selected.")
    style = Setting(
        "Style", "enum", "Flat Squares", "How points are drawn.",
        choices=["Points", *METRIC_STYLES["style"]],
    )  # fmt: skip
    size = size_setting()
    sizePixels = Setting(
        "Size (Pixels)", "float", 3.0, "Size of points in pixels.", min=1.0, max=_MAX_SIZE_PX,
        shown_if={"style": "Points"},
    )  # fmt: skip
    alpha = Setting("Alpha", "float", 1.0, "Opacity.", min=0.0, max=1.0)
    decayTime = Setting(
        "Decay Time", "float", 0.0, "Seconds for which points are shown; 0 until the next message.",
        min=0.0, max=1e9,
    )  # fmt: skip
    positionTransformer = Setting(
        "Position Transformer", "enum", "", "Source of positions; empty for x, y and z.",
        choices=["", "XYZ"],
    )  # fmt: skip
    colorTransformer = Setting(
        "Color Transformer", "enum", "", "Source of colours; empty for RViz's choice.",
        choices=["", *COLOR_TRANSFORMERS],
    )  # fmt: skip
    axis = Setting(
        "Axis", "enum", "Z", "Axis along which colours change (AxisColor).",
        choices=["X", "Y", "Z"], shown_if=_AXIS_COLOR,
    )  # fmt: skip
    autocomputeValueBounds = Setting(
        "Autocompute Value Bounds", "bool", True, "Take the bounds from the points.",
        shown_if=_AXIS_COLOR,
    )  # fmt: skip
    minValue = _bound("Autocompute Value Bounds/Min Value", -10.0)
    maxValue = _bound("Autocompute Value Bounds/Max Value", 10.0)
    useFixedFrame = Setting(
        "Use Fixed Frame", "bool", True, "Take the axis of the fixed frame.",
        shown_if=_AXIS_COLOR,
    )  # fmt: skip
    color = Setting(
        "Color",
        "color",
        "#ffffff",
        "Colour of FlatColor.",
        shown_if={"wanted_transformer": "FlatColor"},
    )
    channelName = _channel("intensity")
    useRainbow = Setting(
        "Use rainbow", "bool", True, "Use rainbow colours instead of two colours.",
        shown_if=_INTENSITY,
    )  # fmt: skip
    invertRainbow = _invert(False)
    minColor = Setting(
        "Min Color", "color", "#000000", "Colour of the minimum.", shown_if=_TWO_COLORS
    )
    maxColor = Setting(
        "Max Color", "color", "#ffffff", "Colour of the maximum.", shown_if=_TWO_COLORS
    )
    autocomputeIntensityBounds = _autocompute(True)
    minIntensity = _bound("Min Intensity", 0.0)
    maxIntensity = _bound("Max Intensity", 4096.0)

    #: Number of points with a position.
    points = ReadOnly(int, 0)
    #: The colour transformer in use.
    usedColorTransformer = ReadOnly(str, "")
    #: The colour transformers that the last cloud allows.
    colorTransformers: ReadOnly[list[str]] = ReadOnly(cast("type[list[str]]", "QStringList"), [])
    #: The fields of the last cloud, for Channel Name.
    channels: ReadOnly[list[str]] = ReadOnly(cast("type[list[str]]", "QStringList"), [])

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        self._history = CloudHistory()
        self._shown: dict[CloudEntry, _ShownCloud] = {}
        self._colors: ColorSettings | None = None
        super().__init__(parent, runtime)

    def placeholder(self, path: str) -> str:
        """Return the transformer in use where none is chosen."""
        used = {"Color Transformer": self.usedColorTransformer, "Position Transformer": "XYZ"}
        return f"{name} (automatic)" if (name := used.get(path)) else super().placeholder(path)

    @property
    def wanted_transformer(self) -> str:
        """The colour transformer that is chosen, or else in use; empty while there is none."""
        return str(self.colorTransformer or self.usedColorTransformer)

    def save_settings(self, older: Mapping[str, Any] | None = None, ros: int = 2) -> dict[str, Any]:
        """Return the settings for a file; bounds that are computed are not the user's."""
        kept, before = super().save_settings(older, ros), dict(older or {})
        if self.autocomputeIntensityBounds:
            for name in ("Min Intensity", "Max Intensity"):
                kept[name] = before.get(name, self.SETTINGS[name].default)
        if self.autocomputeValueBounds:
            title = "Autocompute Value Bounds"
            inner = before.get(title)
            for name in ("Min Value", "Max Value"):
                default = self.SETTINGS[f"{title}/{name}"].default
                kept[title][name] = inner.get(name, default) if isinstance(inner, dict) else default
        return kept

    # -- in the node's thread --------------------------------------------------------------------

    def preparer(self) -> Callable[[Message], Any]:
        """Return the function that reads a message as a cloud and prepares its vertices."""
        read, settings = type(self).READ, self._color_settings()
        return lambda message: settings.prepare(read(message))

    def _color_settings(self) -> ColorSettings:
        transformers: dict[str, ColorTransformer] = {
            "AxisColor": AxisColor(
                self.axis,
                self.autocomputeValueBounds,
                self.minValue,
                self.maxValue,
                self.useFixedFrame,
            ),
            "FlatColor": FlatColor(rgb_of(self.color)),
            "Intensity": Intensity(
                self.channelName,
                self.useRainbow,
                self.invertRainbow,
                rgb_of(self.minColor),
                rgb_of(self.maxColor),
                self.autocomputeIntensityBounds,
                self.minIntensity,
                self.maxIntensity,
            ),
            "MONO8": Mono8(),
            "RGB8": Rgb8(),
            "RGBF32": RgbF32(),
        }
        in_software = self.scene is not None and self.scene.draws_in_software
        return ColorSettings(self.colorTransformer, transformers, in_software)

    # -- in the GUI thread -----------------------------------------------------------------------

    def show(self, data: Any, pose: NDArray[np.float64], frame: str, stamp: int) -> None:  # noqa: ARG002
        """Show a cloud, beside the earlier ones of the Decay Time."""
        assert self.scene is not None
        entry, removed = self._history.add(data.cloud, pose, self.scene.time_s())
        # One that is not shown any more lends its buffer.
        shown = self._take_out(removed) or _ShownCloud(self)
        self._shown[entry] = shown
        shown.set_cloud(data, pose, frame)
        self.root.add(shown.points)
        colors = shown.restyle(self._current_settings())
        layout = data.cloud.layout
        report(
            self,
            usedColorTransformer=shown.transformer,
            channels=layout.channels,
            colorTransformers=supported_color_transformers(layout),
        )
        if colors is not None:
            self._show_colors(colors, shown.transformer)
        self._set_warning("Cloud", data.cloud.warnings)
        self._count_points()

    def _point_size(self, data: PreparedCloud) -> tuple[float, bool]:  # noqa: ARG002 - for subclasses
        """Return the size of points, and whether it is multiplied with their depth."""
        return (self.sizePixels if self.style == "Points" else self.size), False

    def _take_out(self, removed: Iterable[CloudEntry]) -> _ShownCloud | None:
        """Stop showing clouds, and return one of them."""
        last = None
        for entry in removed:
            last = self._shown.pop(entry)
            last.points.remove()
        return last

    def _current_settings(self) -> ColorSettings:
        if self._colors is None:
            self._colors = self._color_settings()
        return self._colors

    def _show_colors(self, colors: PointColors, name: str) -> None:
        """Show which bounds are in use, and what of the settings cannot be used."""
        chosen = self.colorTransformer
        if chosen and chosen != name:
            text = f"the cloud has no fields for {chosen}, so {name} is used"
            self.set_status("Color Transformer", "warn", text)
        elif colors.warning:
            level = "warn" if chosen or self.channelName != "intensity" else "ok"
            self.set_status("Color Transformer", level, colors.warning)
        else:
            self.delete_status("Color Transformer")
        if colors.bounds is None:
            return
        if name == "Intensity" and self.autocomputeIntensityBounds:
            self._show_bounds("minIntensity", "maxIntensity", colors.bounds)
        elif name == "AxisColor" and self.autocomputeValueBounds:
            self._show_bounds("minValue", "maxValue", colors.bounds)

    def _show_bounds(self, low: str, high: str, bounds: tuple[float, float]) -> None:
        # As in RViz, computed bounds are the values of the settings, and stay if the user then
        # switches computing off. Nothing has to be drawn anew for them.
        for name, value in zip((low, high), bounds, strict=True):
            if getattr(self, f"_{name}") != value:
                setattr(self, f"_{name}", value)
                getattr(self, f"{name}Changed").emit()

    def _set_warning(self, name: str, warnings: Iterable[str]) -> None:
        text = "; ".join(warnings)
        if text:
            self.set_status(name, "warn", text)
        else:
            self.delete_status(name)

    def _count_points(self) -> None:
        entries = self._history.entries
        count = sum(entry.cloud.finite_count for entry in entries)
        invalid = sum(entry.cloud.point_count for entry in entries) - count
        text = f"Showing [{count}] points from [{len(entries)}] messages"
        if invalid:
            text += f"; [{invalid}] have no finite position"
        self.set_status("Points", "ok", text)
        self._set_warning("Decay Time", [self._history.warning] if self._history.warning else [])
        report(self, points=count)

    def _show_waiting(self) -> None:
        if self.decayTime:
            self._show_all_waiting()
        else:
            super()._show_waiting()

    def _is_loss(self) -> bool:
        return bool(self.decayTime)

    def _renew_preparer(self) -> None:
        self._colors = None
        super()._renew_preparer()

    def _restyle(self) -> None:
        self._renew_preparer()
        self._history.decay_time_s = self.decayTime
        self._expire()
        settings = self._current_settings()
        colors, name = None, ""
        for shown in self._shown.values():
            colors, name = shown.restyle(settings), shown.transformer
        if colors is not None:
            report(self, usedColorTransformer=name)
            self._show_colors(colors, name)

    @Slot()
    def _on_tick(self) -> None:
        super()._on_tick()
        self._expire()

    def _expire(self) -> None:
        """Remove clouds older than the Decay Time."""
        scene = self.scene
        removed = self._history.expire(scene.time_s()) if scene is not None else []
        if removed:
            self._take_out(removed)
            self._count_points()

    def on_fixed_frame(self) -> None:
        """Show the last cloud in the new fixed frame; where earlier ones are is not known."""
        self._drop_clouds()
        super().on_fixed_frame()

    def reset(self) -> None:
        """Drop all clouds."""
        super().reset()
        self._drop_clouds()
        report(self, points=0)

    def _drop_clouds(self) -> None:
        self._take_out(self._history.clear())
        self.delete_status("Points")


class PointCloud2Display(CloudDisplay):
    """A ``sensor_msgs/PointCloud2``. See its page in ``docs/scene.md``."""

    TYPE = "PointCloud2"
    IS_CONTINUOUS = True
    MESSAGES = ("sensor_msgs/PointCloud2",)


class PointCloudDisplay(CloudDisplay):
    """A ``sensor_msgs/PointCloud``, the type before PointCloud2. See ``docs/scene.md``."""

    TYPE = "PointCloud"
    IS_CONTINUOUS = True
    MESSAGES = ("sensor_msgs/PointCloud",)
    READ = cloud_from_point_cloud


class LaserScanDisplay(CloudDisplay):
    """A ``sensor_msgs/LaserScan``, corrected by the scanner's motion. See ``docs/scene.md``."""

    TYPE = "LaserScan"
    IS_CONTINUOUS = True
    MESSAGES = ("sensor_msgs/LaserScan",)

    def preparer(self) -> Callable[[Message], Any]:
        """Return the function that reads a scan as a cloud."""
        settings = self._color_settings()
        return lambda message: _prepare_scan(message, settings)

    def _place(self, item: Any) -> NDArray[np.float64] | None:
        # Where the scanner was at the last ray has to be known, too.
        if item.data.duration_ns and item.stamp:
            last = self.place_of(item.frame, item.stamp + item.data.duration_ns)
            if last is None:
                return None
        return super()._place(item)

    def show(self, data: Any, pose: NDArray[np.float64], frame: str, stamp: int) -> None:
        """Show a scan, each ray from where the scanner was."""
        if data.duration_ns and stamp:
            motion = self._motion(frame, stamp, stamp + data.duration_ns)
            if motion is not None:
                cloud = cloud_from_laser_scan(data.source, Transform(), motion)
                data = self._current_settings().prepare(cloud)
        super().show(data, pose, frame, stamp)

    def _motion(self, frame: str, first: int, last: int) -> Transform | None:
        """Return where a frame was at a later time, in itself; None if it has not moved."""
        scene = self.scene
        if scene is None or scene.transforms is None or frame in ("", scene.fixed_frame):
            return None
        look_up = scene.transforms.lookup_transform
        try:
            start = look_up(scene.fixed_frame, frame, Time(first))
            end = look_up(scene.fixed_frame, frame, Time(last))
        except TransformException:
            return None  # in a new fixed frame, the time of an old scan may not be known any more
        motion = start.inverse() @ end
        moved = max(map(abs, (*motion.translation, *motion.rotation[:3])))
        return motion if moved > _STILL else None


def _prepare_scan(scan: Any, settings: ColorSettings) -> PreparedCloud:
    cloud = cloud_from_laser_scan(scan)
    duration = float(scan.time_increment) * max(len(scan.ranges) - 1, 0)
    if not 0 <= duration <= _MAX_SCAN_S:
        text = (
            f"time_increment: {scan.time_increment} s for each of {len(scan.ranges)} rays is not "
            f"from 0 to {_MAX_SCAN_S:g} s in all; motion of the scanner is not corrected"
        )
        cloud.warnings = (*cloud.warnings, text)
        duration = 0.0
    return settings.prepare(cloud)._replace(source=scan, duration_ns=round(duration * 1e9))


def _read_value(name: str) -> Callable[[Any], Cloud]:
    """Return a function that makes a cloud of one point, with a field of the message."""

    def read(message: Any) -> Cloud:
        return cloud_from_columns({"x": [0.0], "y": [0.0], "z": [0.0], name: [message[name]]})

    return read


class TemperatureDisplay(CloudDisplay):
    """A ``sensor_msgs/Temperature``, as a point in its frame. See ``docs/scene.md``."""

    TYPE = "Temperature"
    IS_CONTINUOUS = True
    MESSAGES = ("sensor_msgs/Temperature",)
    READ = _read_value("temperature")

    channelName = _channel("temperature")
    invertRainbow = _invert(True)
    autocomputeIntensityBounds = _autocompute(False)
    minIntensity = _bound("Min Intensity", 0.0)
    maxIntensity = _bound("Max Intensity", 100.0)


class FluidPressureDisplay(CloudDisplay):
    """A ``sensor_msgs/FluidPressure``, as a point in its frame. See ``docs/scene.md``."""

    TYPE = "FluidPressure"
    IS_CONTINUOUS = True
    MESSAGES = ("sensor_msgs/FluidPressure",)
    READ = _read_value("fluid_pressure")

    channelName = _channel("fluid_pressure")
    autocomputeIntensityBounds = _autocompute(False)
    minIntensity = _bound("Min Intensity", 98_000.0)
    maxIntensity = _bound("Max Intensity", 105_000.0)


class IlluminanceDisplay(CloudDisplay):
    """A ``sensor_msgs/Illuminance``, as a point in its frame. See ``docs/scene.md``."""

    TYPE = "Illuminance"
    IS_CONTINUOUS = True
    MESSAGES = ("sensor_msgs/Illuminance",)
    READ = _read_value("illuminance")

    channelName = _channel("illuminance")
    autocomputeIntensityBounds = _autocompute(False)
    minIntensity = _bound("Min Intensity", 0.0)
    maxIntensity = _bound("Max Intensity", 1000.0)


class RelativeHumidityDisplay(CloudDisplay):
    """A ``sensor_msgs/RelativeHumidity``, as a point in its frame. See ``docs/scene.md``."""

    TYPE = "RelativeHumidity"
    IS_CONTINUOUS = True
    MESSAGES = ("sensor_msgs/RelativeHumidity",)
    READ = _read_value("relative_humidity")

    channelName = _channel("relative_humidity")
    autocomputeIntensityBounds = _autocompute(False)
    minIntensity = _bound("Min Intensity", 0.0)
    maxIntensity = _bound("Max Intensity", 1.0)
