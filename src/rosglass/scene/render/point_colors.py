"""The colours of point clouds, by RViz's names, defaults and rules.

Colours are parameters of a shader, so that no cloud is repacked for them;
:meth:`PointColors.of_points` computes the same with numpy.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, TypeAlias

import numpy as np
from numpy.typing import NDArray

from rosglass.errors import shown
from rosglass.scene.data.point_clouds import (
    FLOAT32,
    Channel,
    to_unorm,
)
from rosglass.scene.render.drawing import Coloring

if TYPE_CHECKING:
    from rosglass.scene.data.point_clouds import Cloud, CloudField, CloudLayout

__all__ = [
    "COLOR_TRANSFORMERS",
    "AxisColor",
    "ColorTransformer",
    "FlatColor",
    "Intensity",
    "Mono8",
    "PointColors",
    "Rgb8",
    "RgbF32",
    "choose_color_transformer",
    "rainbow",
    "supported_color_transformers",
]


Array: TypeAlias = NDArray[Any]
#: Red, green, blue from 0 to 1.
Rgb: TypeAlias = tuple[float, float, float]
#: The same, or with alpha.
Color: TypeAlias = tuple[float, float, float] | tuple[float, float, float, float]

_BLACK: Rgb = (0.0, 0.0, 0.0)
_WHITE: Rgb = (1.0, 1.0, 1.0)


def rainbow(part: Array) -> Array:
    """Return RViz's rainbow: magenta at 0, then blue, cyan, green, yellow, and red at 1.

    In GLSL, with a part from 0 to 1::

        float h = 5.0 * part;
        clamp(vec3(max(1.0 - h, h - 3.0), min(h - 1.0, 5.0 - h), 3.0 - h), 0.0, 1.0)

    Returns:
        Red, green and blue from 0 to 1 on a new last axis.
    """
    h = 5 * np.asarray(part, np.float32)
    channels = (np.maximum(1 - h, h - 3), np.minimum(h - 1, 5 - h), 3 - h)
    out: Array = np.clip(np.stack(channels, axis=-1), 0, 1)
    return out


@dataclass(frozen=True, slots=True)
class PointColors(Coloring):
    """The colours of one cloud, as parameters of the shader, or computed here.

    Attributes:
        channel: The vertex's channel; None if it needs none.
        bounds: Lower and upper bound of the values in use, to show as Min and Max Intensity, or Min
            and Max Value; None if there are none.
        warning: Text for the display's status; empty if there is none.
    """

    channel: Channel | None = None
    bounds: tuple[float, float] | None = None
    warning: str = ""

    def of_points(self, cloud: Cloud) -> NDArray[np.uint8]:
        """Return the colour of each point, points x (red, green, blue, alpha)."""
        out = np.full((cloud.point_count, 4), 255, np.uint8)
        if self.mode == "flat":
            out[:, :3] = to_unorm(np.array(self.first))
        elif self.mode == "bgra" and self.channel is not None:
            received = cloud.color_bytes(self.channel)
            out[:, :3] = received[:, 2::-1]
            if self.per_point_alpha:
                out[:, 3] = received[:, 3]
        else:
            part = self._part(cloud)
            if self.mode == "gradient":
                first, last = np.array(self.first), np.array(self.last)
                out[:, :3] = to_unorm(first + (last - first) * part[:, None])
            else:
                out[:, :3] = to_unorm(rainbow(part if self.invert else 1 - part))
        return out

    def _part(self, cloud: Cloud) -> NDArray[np.float32]:
        with np.errstate(over="ignore", invalid="ignore"):
            if self.channel is not None:
                value = cloud.column(self.channel.fields[0])
            else:
                axis = np.array(self.axis, np.float32)
                value = cloud.positions() @ axis[:3] + axis[3]
            span = np.float32(self.high) - np.float32(self.low)
            part = (value - np.float32(self.low)) / span if span else np.zeros_like(value)
        part[~(np.abs(part) < 1e30)] = 0
        clipped: NDArray[np.float32] = np.clip(part, 0, 1)
        return clipped


@dataclass(frozen=True, slots=True)
class ColorTransformer:
    """A choice of RViz's property Color Transformer, with its properties as attributes."""

    #: RViz takes the supported transformer of the highest score, of equal ones the last by name.
    score: ClassVar[int] = 0

    @classmethod
    def supports(cls, layout: CloudLayout) -> bool:  # noqa: ARG003 - for subclasses
        """Return whether it can colour a cloud."""
        return True

    def colors(self, cloud: Cloud, transform: Array | None = None) -> PointColors:
        """Return the colours of a cloud.

        Args:
            cloud: A cloud that it supports.
            transform: Pose of the cloud in the fixed frame, 4x4; None if it is the same frame.
        """
        raise NotImplementedError


@dataclass(frozen=True, slots=True)
class FlatColor(ColorTransformer):
    """One colour for all points.

    Attributes:
        color: The colour; its alpha, if it has one, is not used.
    """

    color: Color = _WHITE

    def colors(self, cloud: Cloud, transform: Array | None = None) -> PointColors:  # noqa: ARG002
        """Return the colours of a cloud."""
        return PointColors("flat", first=_rgb(self.color))


@dataclass(frozen=True, slots=True)
class Rgb8(ColorTransformer):
    """Colours of a packed field rgb, or rgba, whose alpha is used as well."""

    _is_grey: ClassVar[bool] = False

    @classmethod
    def supports(cls, layout: CloudLayout) -> bool:
        """Return whether the cloud has such a field of 4 bytes."""
        field = cls._field(layout)
        return field is not None and field.is_packed_color

    @staticmethod
    def _field(layout: CloudLayout) -> CloudField | None:
        """Return the last of rgb and rgba, as RViz does."""
        last = None
        for field in layout.fields:
            if field.name in {"rgb", "rgba"}:
                last = field
        return last

    def colors(self, cloud: Cloud, transform: Array | None = None) -> PointColors:  # noqa: ARG002
        """Return the colours of a cloud."""
        field = self._field(cloud.layout)
        if field is None or not self.supports(cloud.layout):
            return _white("no field rgb or rgba of 4 bytes", cloud)
        channel = Channel((field.name,), is_color=True, is_grey=self._is_grey)
        alpha = cloud.layout.find("rgb") is None
        return PointColors("bgra", channel=channel, per_point_alpha=alpha)


@dataclass(frozen=True, slots=True)
class Mono8(Rgb8):
    """The grey value of a packed field rgb or rgba."""

    _is_grey: ClassVar[bool] = True


@dataclass(frozen=True, slots=True)
class RgbF32(ColorTransformer):
    """Colours of the fields r, g and b, float32 from 0 to 1."""

    @classmethod
    def supports(cls, layout: CloudLayout) -> bool:
        """Return whether the cloud has these fields."""
        fields = [layout.find(name) for name in "rgb"]
        return all(field is not None and field.datatype == FLOAT32 for field in fields)

    def colors(self, cloud: Cloud, transform: Array | None = None) -> PointColors:  # noqa: ARG002
        """Return the colours of a cloud."""
        if not self.supports(cloud.layout):
            return _white("no fields r, g and b of float32", cloud)
        return PointColors("bgra", channel=Channel(("r", "g", "b"), is_color=True))


@dataclass(frozen=True, slots=True)
class Intensity(ColorTransformer):
    """Colours by the value of a field; points stay white if the cloud does not have it.

    Attributes:
        channel_name: Name of the field.
        use_rainbow: Whether to use the rainbow, from red at the minimum, or two colours.
        invert_rainbow: Whether the rainbow is red at the maximum.
        min_color: Colour at the minimum.
        max_color: Colour at the maximum.
        autocompute_intensity_bounds: Whether minimum and maximum are those of the cloud.
        min_intensity: Minimum otherwise.
        max_intensity: Maximum otherwise.
    """

    score: ClassVar[int] = 255

    channel_name: str = "intensity"
    use_rainbow: bool = True
    invert_rainbow: bool = False
    min_color: Color = _BLACK
    max_color: Color = _WHITE
    autocompute_intensity_bounds: bool = True
    min_intensity: float = 0.0
    max_intensity: float = 4096.0

    def colors(self, cloud: Cloud, transform: Array | None = None) -> PointColors:  # noqa: ARG002
        """Return the colours of a cloud."""
        field = cloud.layout.find_channel(self.channel_name)
        if field is None:
            return _white(f"no readable channel {shown(self.channel_name)}", cloud)
        low, high = self.min_intensity, self.max_intensity
        if self.autocompute_intensity_bounds:
            low, high = cloud.channel_range(field.name) or (0.0, 0.0)
        return PointColors(
            "rainbow" if self.use_rainbow else "gradient",
            low,
            high,
            self.invert_rainbow,
            _rgb(self.min_color),
            _rgb(self.max_color),
            channel=Channel((field.name,)),
            bounds=(low, high),
        )


@dataclass(frozen=True, slots=True)
class AxisColor(ColorTransformer):
    """The rainbow along an axis, from red at the minimum.

    Attributes:
        axis: ``X``, ``Y`` or ``Z``.
        autocompute_value_bounds: Whether minimum and maximum are those of the cloud.
        min_value: Minimum otherwise, in metres.
        max_value: Maximum otherwise, in metres.
        use_fixed_frame: Whether it is the fixed frame's axis, or that of the cloud's frame.
    """

    score: ClassVar[int] = 255

    axis: str = "Z"
    autocompute_value_bounds: bool = True
    min_value: float = -10.0
    max_value: float = 10.0
    use_fixed_frame: bool = True

    def colors(self, cloud: Cloud, transform: Array | None = None) -> PointColors:
        """Return the colours of a cloud."""
        row = np.eye(4)["XYZ".index(self.axis)]
        if self.use_fixed_frame and transform is not None:
            row = transform["XYZ".index(self.axis)]
        axis, offset = (float(row[0]), float(row[1]), float(row[2])), float(row[3])
        low, high = self.min_value, self.max_value
        if self.autocompute_value_bounds:
            lowest, highest = cloud.axis_range(axis) or (0.0, 0.0)
            low, high = lowest + offset, highest + offset
        return PointColors(
            "axis",
            # The offset is in the bounds: 100 km from the map's origin, float32 has centimetres.
            low=low - offset,
            # RViz's rule: equal bounds are 1 mm apart.
            high=high - offset if high != low else low - offset + 0.001,
            axis=(*axis, 0.0),
            bounds=(low, high),
        )


#: RViz's colour transformers by name, sorted.
COLOR_TRANSFORMERS: dict[str, type[ColorTransformer]] = {
    "AxisColor": AxisColor,
    "FlatColor": FlatColor,
    "Intensity": Intensity,
    "MONO8": Mono8,
    "RGB8": Rgb8,
    "RGBF32": RgbF32,
}


def supported_color_transformers(layout: CloudLayout) -> list[str]:
    """Return the names of the colour transformers that support a cloud, sorted."""
    return [name for name, found in COLOR_TRANSFORMERS.items() if found.supports(layout)]


def choose_color_transformer(layout: CloudLayout, current: str = "") -> str:
    """Return the name of the colour transformer to use: the current one if it supports the cloud.

    Otherwise RViz's choice: RGB8 if the cloud has such colours, or the highest score.
    """
    names = supported_color_transformers(layout)
    if current in names:
        return current
    if "RGB8" in names:
        return "RGB8"
    return max(names, key=lambda name: (COLOR_TRANSFORMERS[name].score, name))


def _white(problem: str, cloud: Cloud) -> PointColors:
    if not cloud.point_count:
        return PointColors("flat")
    warning = f"the cloud has {problem}, so its points are white; {cloud.layout.describe_fields()}"
    return PointColors("flat", warning=warning)


def _rgb(color: Color) -> Rgb:
    return float(color[0]), float(color[1]), float(color[2])
