"""Point clouds: their bytes as vertices, their order, and the clouds that are still shown.

A :class:`Cloud` shares the received bytes of a ``PointCloud2``. Common layouts go to the graphics
card unchanged; others are repacked.
"""

from __future__ import annotations

import math
import operator
import sys
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from rosglass.errors import DecodeError, FieldPathError, shown
from rosglass.messages import Message

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rosglass.comm.time import Time

__all__ = [
    "FLOAT32",
    "MAX_FIELDS",
    "UINT32",
    "Channel",
    "Cloud",
    "CloudEntry",
    "CloudField",
    "CloudHistory",
    "CloudLayout",
    "VertexData",
    "is_ordered",
    "order_points",
    "read_bytes",
    "read_field",
    "read_integer",
    "read_sequence",
    "to_unorm",
]


Array: TypeAlias = NDArray[Any]
#: Smallest and largest x, y, z in metres.
Bounds: TypeAlias = tuple[NDArray[np.float32], NDArray[np.float32]]

#: Type codes of ``sensor_msgs/PointField``, as numpy types without byte order.
_DATATYPES = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 8: "f8"}
INT32, UINT32, FLOAT32 = 5, 6, 7

#: Largest distance between vertices, in bytes, that all graphics interfaces accept.
_MAX_STRIDE_BYTES = 2048
#: Most fields of a cloud: each is checked in Python.
MAX_FIELDS = 256
#: Most values of one field that the description of a point shows.
_MAX_SHOWN_VALUES = 16
#: Most points and bytes of all clouds of one display.
_MAX_KEPT_POINTS = 20_000_000
_MAX_KEPT_BYTES = 1 << 30

#: Bits of a cell's number along x, y and z; 16 in all at most, which numpy sorts fastest.
_CELL_BITS = (5, 5, 5)
#: Number of points that decide whether a cloud is ordered.
_SAMPLED_POINTS = 1024
#: Largest ratio of the distance between successive points to the cloud's diagonal, if ordered.
_ORDERED_RATIO = 1 / 16

_CLOUD2 = "sensor_msgs/msg/PointCloud2"


def read_field(message: Any, type_name: str, *names: str) -> Any:
    """Return a field of a message, dict or object, by the first of these names that it has."""
    by_item = isinstance(message, (Message, Mapping))
    for name in names:
        try:
            return message[name] if by_item else getattr(message, name)
        except (LookupError, AttributeError, FieldPathError):  # noqa: PERF203 - two names at most
            continue
    raise DecodeError(
        type_name, f"{type(message).__name__} has no such field; pass a {type_name}", names[0]
    )


def read_integer(message: Any, type_name: str, name: str, path: str = "") -> int:
    """Return a field that is an unsigned integer of 32 bits.

    Args:
        message: A message, dict or object.
        type_name: Its type, for errors.
        name: Name of the field.
        path: Path of the message in the whole, with a final dot.

    Raises:
        DecodeError: The field is missing, or its value is invalid.
    """
    value = read_field(message, type_name, name)
    try:
        number = operator.index(value)
    except TypeError:
        number = -1
    if isinstance(value, bool) or not 0 <= number < 1 << 32:
        expected = "expected an integer from 0 to 4294967295"
        raise DecodeError(type_name, f"{expected}, got {shown(value)}", path + name)
    return number


def read_sequence(message: Any, type_name: str, name: str) -> Any:
    """Return a field that is an array.

    Raises:
        DecodeError: The field is missing, or its value is not an array.
    """
    value = read_field(message, type_name, name)
    if not hasattr(value, "__len__") or isinstance(value, (str, Mapping)):
        raise DecodeError(type_name, f"expected an array, got {shown(value)}", name)
    return value


def read_bytes(value: Any, type_name: str) -> NDArray[np.uint8]:
    """Return a data field as an array of bytes, which shares its memory if possible."""
    try:
        if isinstance(value, (list, tuple)):
            array = np.array([operator.index(item) for item in value], np.uint8)
        else:
            array = np.frombuffer(value, np.uint8)
    except (TypeError, ValueError, OverflowError, BufferError, AttributeError):
        raise DecodeError(type_name, f"expected bytes, got {shown(value)}", "data") from None
    return array


@dataclass(frozen=True, slots=True)
class CloudField:
    """A field of each point, a ``sensor_msgs/PointField``.

    Attributes:
        name: Name, e.g. ``intensity``.
        offset: Offset in bytes from the start of the point.
        datatype: Type code of the values; only known ones (1 to 8) can be read.
        count: Number of values. Publishers leave 0 for 1.
    """

    name: str
    offset: int
    datatype: int
    count: int = 1

    @property
    def is_known(self) -> bool:
        """True if the type code is one of PointField's."""
        return self.datatype in _DATATYPES

    @property
    def is_packed_color(self) -> bool:
        """True if the value has 4 bytes, as those of rgb and rgba do."""
        return self.datatype in {INT32, UINT32, FLOAT32} and self.count == 1

    def dtype(self, is_bigendian: bool = False) -> np.dtype[Any]:
        """Return the numpy type of the values.

        Raises:
            DecodeError: The type code is unknown.
        """
        code = _DATATYPES.get(self.datatype)
        if code is None:
            raise DecodeError(
                _CLOUD2,
                f"field {shown(self.name)} has datatype {self.datatype}; known are 1 (INT8) "
                "to 8 (FLOAT64)",
                "fields",
            )
        return np.dtype((">" if is_bigendian else "<") + code)


@dataclass(frozen=True, slots=True)
class CloudLayout:
    """The layout of the bytes of a cloud; clouds with equal layouts are drawn in the same way.

    A cloud without points may lack everything else.

    Attributes:
        width: Points per row.
        height: Number of rows; 1 if the points are in no grid.
        point_step: Distance between points in bytes.
        row_step: Distance between rows in bytes.
        fields: The fields of each point.
        is_bigendian: Whether values are big-endian.

    Raises:
        DecodeError: A field or a point does not fit, two fields have the same name, or there is no
            x, y or z.
    """

    width: int
    height: int
    point_step: int
    row_step: int
    fields: tuple[CloudField, ...]
    is_bigendian: bool = False

    def __post_init__(self) -> None:
        if not self.point_count:
            return
        needed = self.width * self.point_step
        if self.row_step < needed:
            raise DecodeError(
                _CLOUD2,
                f"{self.width} points of {self.point_step} bytes need {needed} bytes per row, "
                f"row_step is {self.row_step}",
                "row_step",
            )
        names: set[str] = set()
        for index, field in enumerate(self.fields):
            self._check_field(field, f"fields[{index}]")
            # PCL calls padding "_", several times.
            if field.name in names - {"", "_"}:
                raise DecodeError(
                    _CLOUD2, f"two fields have the name {shown(field.name)}", f"fields[{index}]"
                )
            names.add(field.name)
        for name in "xyz":
            position = self.find(name)
            if position is None:
                raise DecodeError(_CLOUD2, f"no field {name!r}; {self.describe_fields()}", "fields")
            position.dtype()

    def _check_field(self, field: CloudField, path: str) -> None:
        size = np.dtype(_DATATYPES[field.datatype]).itemsize if field.is_known else 1
        end = field.offset + size * field.count
        if min(field.offset, field.count - 1) < 0 or end > self.point_step:
            raise DecodeError(
                _CLOUD2,
                f"{shown(field.name)} has {field.count} values of {size} bytes at offset "
                f"{field.offset} and ends at byte {end}, but point_step is {self.point_step}",
                path,
            )

    @property
    def point_count(self) -> int:
        """Number of points."""
        return self.width * self.height

    @property
    def is_packed(self) -> bool:
        """True if rows follow each other without padding."""
        return self.height == 1 or self.row_step == self.width * self.point_step

    @property
    def channels(self) -> list[str]:
        """Names of the fields that have one, sorted, as RViz offers them for Channel Name."""
        return sorted({field.name for field in self.fields if field.name})

    def find(self, name: str) -> CloudField | None:
        """Return the field of this name, None if there is none."""
        return next((field for field in self.fields if field.name == name), None)

    def find_channel(self, name: str) -> CloudField | None:
        """Return the readable field of this name; intensity and intensities mean the same."""
        other = {"intensity": "intensities", "intensities": "intensity"}.get(name, name)
        found = self.find(name) or self.find(other)
        return found if found is not None and found.is_known else None

    def describe_fields(self) -> str:
        """Return the names of the fields for a message."""
        names = ", ".join(self.channels[:20]) or "none"
        return f"its fields are {names}{', ...' if len(self.channels) > 20 else ''}"


@dataclass(frozen=True, slots=True)
class Channel:
    """A value of each vertex besides its position.

    Attributes:
        fields: The field, or three whose values from 0 to 1 are red, green and blue.
        is_color: Whether it is a colour, as the bytes blue, green, red, alpha; otherwise a float32.
        is_grey: Whether the colour is made grey.
    """

    fields: tuple[str, ...]
    is_color: bool = False
    is_grey: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class VertexData:
    """A vertex buffer: the bytes of a cloud as received, or repacked.

    Attributes:
        data: The bytes; they may share the received message.
        stride: Distance between vertices in bytes, a multiple of 4.
        count: Number of vertices.
        position: Offset of x, y and z (float32) in a vertex, in bytes.
        channel: Offset of the channel; -1 if there is none.
        channel_is_bytes: Whether the channel is blue, green, red and alpha; otherwise a float32.
        order: Number of each vertex's point in the cloud; None if they are the same.
    """

    data: NDArray[np.uint8]
    stride: int
    count: int
    position: int = 0
    channel: int = -1
    channel_is_bytes: bool = False
    order: NDArray[np.intp] | None = None

    def point_index(self, vertex: int) -> int:
        """Return the number in the cloud of a vertex's point, e.g. of a picked one."""
        return vertex if self.order is None else int(self.order[vertex])


class Cloud:
    """A point cloud over the received bytes; fields are read when they are needed.

    Attributes:
        layout: The layout of the bytes.
        data: The bytes.
        warnings: Irregularities that do not prevent drawing.

    Args:
        layout: The layout of the bytes.
        data: The bytes, exactly as many as the layout needs.
        warnings: Texts for the display's status.

    Raises:
        DecodeError: The number of bytes is another.
    """

    def __init__(
        self, layout: CloudLayout, data: NDArray[np.uint8], warnings: Sequence[str] = ()
    ) -> None:
        needed = layout.row_step * layout.height if layout.point_count else 0
        if data.nbytes != needed:
            problem = "is too short" if data.nbytes < needed else "is too long"
            raise DecodeError(
                _CLOUD2,
                f"{problem}: it has {data.nbytes} bytes; height {layout.height} x row_step "
                f"{layout.row_step} is {needed}, width {layout.width} x height x point_step "
                f"{layout.point_step} is {layout.point_count * layout.point_step}",
                "data",
            )
        self.layout, self.data, self.warnings = layout, data, tuple(warnings)
        self._ranges: dict[str, tuple[float, float] | None] = {}

    @classmethod
    def from_message(cls, message: Any) -> Cloud:
        """Create a cloud from a ``PointCloud2`` of ROS 1 or ROS 2, or a dict with its fields.

        As in RViz, a row_step that does not fit is ignored if the data has no padding.

        Raises:
            DecodeError: Sizes, fields and data are inconsistent, or the message is not a
                PointCloud2.
        """
        width, height, point_step, row_step = (
            read_integer(message, _CLOUD2, name)
            for name in ("width", "height", "point_step", "row_step")
        )
        data = read_bytes(read_field(message, _CLOUD2, "data"), _CLOUD2)
        packed = width * point_step
        warnings = []
        if width * height and row_step != packed and data.nbytes == packed * height:
            warnings.append(
                f"row_step is {row_step}, but {width} points of {point_step} bytes are {packed} "
                "bytes; the publisher should correct it"
            )
            row_step = packed
        fields = _fields(message)
        is_bigendian = bool(read_field(message, _CLOUD2, "is_bigendian"))
        layout = CloudLayout(width, height, point_step, row_step, fields, is_bigendian)
        return cls(layout, data, warnings)

    @property
    def point_count(self) -> int:
        """Number of points, invalid ones included."""
        return self.layout.point_count

    def values(self, name: str) -> Array:
        """Return the values of a field, one for each point, as received.

        Returns:
            points, or points x values if the field has several; shares the received bytes unless
            rows are padded.

        Raises:
            DecodeError: Its type code is unknown.
        """
        field = self.layout.find(name)
        assert field is not None, name
        return self._view(field.offset, field.dtype(self.layout.is_bigendian), field.count)

    def _view(self, offset: int, dtype: np.dtype[Any], count: int = 1) -> Array:
        layout = self.layout
        shape: tuple[int, ...] = (layout.height, layout.width)
        strides: tuple[int, ...] = (layout.row_step, layout.point_step)
        if count != 1:
            shape, strides = (*shape, count), (*strides, dtype.itemsize)
        if not layout.point_count:
            return np.empty((0, *shape[2:]), dtype)
        view: Array = np.ndarray(shape, dtype, self.data, offset, strides)
        return view.reshape(layout.point_count, *shape[2:])

    def column(self, name: str) -> NDArray[np.float32]:
        """Return the (first) value of each point as adjacent float32."""
        if not self.point_count:
            return np.empty(0, np.float32)
        values = self.values(name)
        with np.errstate(over="ignore", invalid="ignore"):
            return np.ascontiguousarray(values if values.ndim == 1 else values[:, 0], np.float32)

    def positions(self) -> NDArray[np.float32]:
        """Return the positions in metres, points x 3; invalid ones are NaN or infinite."""
        return np.stack([self.column(name) for name in "xyz"], axis=1)

    @cached_property
    def _extent(self) -> tuple[NDArray[np.bool_] | None, int, Bounds | None]:
        """Mask of the valid points (None: all are), their number, and their bounds."""
        columns = [self.column(name) for name in "xyz"]
        ranges = [_range_with_nan(column) for column in columns]
        if np.isfinite(ranges).all():
            return None, self.point_count, _bounds(ranges)
        valid = np.isfinite(columns[0])
        for column in columns[1:]:
            valid &= np.isfinite(column)
        count = int(np.count_nonzero(valid))
        if not count:
            return valid, 0, None
        return valid, count, _bounds([_range_with_nan(column[valid]) for column in columns])

    @property
    def finite_count(self) -> int:
        """Number of points whose position has no NaN and no infinity; only these are visible."""
        return self._extent[1]

    @property
    def finite_mask(self) -> NDArray[np.bool_] | None:
        """A mask of the points with a finite position; None if all have one."""
        return self._extent[0]

    def bounds(self) -> Bounds | None:
        """Return the smallest and largest x, y, z in metres; None without a finite position."""
        return self._extent[2]

    def channel_range(self, name: str) -> tuple[float, float] | None:
        """Return the smallest and largest finite value of a field over the visible points.

        Raises:
            DecodeError: Its type code is unknown.
        """
        if name not in self._ranges:
            self._ranges[name] = self._range(self.column(name))
        return self._ranges[name]

    def axis_range(self, axis: Sequence[float]) -> tuple[float, float] | None:
        """Return the smallest and largest component of the positions along a vector."""
        bounds = self.bounds()
        if bounds is None:
            return None
        used = [index for index in range(3) if abs(axis[index]) > 1e-9]
        if len(used) == 1:
            factor = float(axis[used[0]])
            ends = (factor * float(bounds[0][used[0]]), factor * float(bounds[1][used[0]]))
            return min(ends), max(ends)
        total = np.zeros(self.point_count, np.float32)
        with np.errstate(over="ignore", invalid="ignore"):
            for index in used:
                total += np.float32(axis[index]) * self.column("xyz"[index])
        return self._range(total)

    def _range(self, column: NDArray[np.float32]) -> tuple[float, float] | None:
        if self.finite_mask is not None:
            column = column[self.finite_mask]
        low, high = _range_with_nan(column)
        if not (math.isfinite(low) and math.isfinite(high)):
            column = column[np.isfinite(column)]
            low, high = _range_with_nan(column)
        return (low, high) if column.size else None

    def vertex_data(self, channel: Channel | None = None) -> VertexData:
        """Return the vertices for the graphics card, without copying where it can read the bytes.

        It can if values are little-endian, steps and offsets are multiples of 4, x, y and z are
        adjacent float32, and the channel is a float32 or a packed colour.

        Args:
            channel: The channel that colours need; None for positions alone.
        """
        is_bytes = channel is not None and channel.is_color
        offsets = self._direct_offsets(channel)
        if offsets is not None:
            step, count = self.layout.point_step, self.point_count
            return VertexData(self.data[: step * count], step, count, *offsets, is_bytes)
        packed = np.empty((self.point_count, 3 if channel is None else 4), "<f4")
        for index, name in enumerate("xyz"):
            packed[:, index] = self.column(name)
        if channel is not None and is_bytes:
            packed.view(np.uint8)[:, 12:] = self.color_bytes(channel)
        elif channel is not None:
            packed[:, 3] = self.column(channel.fields[0])
        data, stride = packed.reshape(-1).view(np.uint8), 4 * packed.shape[1]
        return VertexData(data, stride, self.point_count, 0, 12 if stride > 12 else -1, is_bytes)

    def _direct_offsets(self, channel: Channel | None) -> tuple[int, int] | None:
        """Return the offsets of position and channel; None if the card cannot read them."""
        layout = self.layout
        x, y, z = (layout.find(name) for name in "xyz")
        if (
            sys.byteorder != "little"
            or layout.is_bigendian
            or not layout.is_packed
            or not layout.point_count
            or layout.point_step % 4
            or layout.point_step > _MAX_STRIDE_BYTES
            or (x is None or y is None or z is None)
            or any(field.datatype != FLOAT32 for field in (x, y, z))
            or x.offset % 4
            or (y.offset, z.offset) != (x.offset + 4, x.offset + 8)
        ):
            return None
        if channel is None:
            return x.offset, -1
        if len(channel.fields) > 1 or channel.is_grey:
            return None
        field = layout.find(channel.fields[0])
        if field is None or field.offset % 4:
            return None
        usable = field.is_packed_color if channel.is_color else field.datatype == FLOAT32
        return (x.offset, field.offset) if usable else None

    def color_bytes(self, channel: Channel) -> NDArray[np.uint8]:
        """Return a channel that is a colour, as points x (blue, green, red, alpha)."""
        names = channel.fields
        if len(names) == 1:
            field = self.layout.find(names[0])
            assert field is not None, names[0]
            order = ">u4" if self.layout.is_bigendian else "<u4"
            bits = np.ascontiguousarray(self._view(field.offset, np.dtype(order)), "<u4")
            out = bits.view(np.uint8).reshape(-1, 4)
        else:
            out = np.full((self.point_count, 4), 255, np.uint8)
            for index, name in enumerate(reversed(names)):
                out[:, index] = to_unorm(self.column(name))
        if channel.is_grey:
            grey = np.rint(out[:, :3] @ np.array((0.1140, 0.5870, 0.2989), np.float32))
            out = np.concatenate([np.repeat(grey[:, None], 3, axis=1), out[:, 3:]], axis=1)
            out = out.astype(np.uint8)
        return out

    def describe_point(self, index: int) -> list[tuple[str, Any]]:
        """Return names and values of a point's fields for the Selection panel.

        The position is the first; names of others have the number of the field, as in RViz. Packed
        colours are r, g, b, a from 0 to 255.
        """
        layout = self.layout
        row, column = divmod(index, layout.width)
        start = row * layout.row_step + column * layout.point_step

        def read(field: CloudField) -> Any:
            count = min(field.count, _MAX_SHOWN_VALUES)
            dtype = field.dtype(layout.is_bigendian)
            values = np.ndarray((count,), dtype, self.data, start + field.offset).tolist()
            return values[0] if field.count == 1 else tuple(values)

        position = tuple(float(read(field)) for field in map(layout.find, "xyz") if field)
        found: list[tuple[str, Any]] = [("Position", position)]
        for number, field in enumerate(layout.fields):
            label = f"{number}: {field.name}"
            if field.name in {"x", "y", "z"}:
                continue
            if not field.is_known:
                found.append((label, f"(datatype {field.datatype})"))
            elif field.name in {"rgb", "rgba"} and field.is_packed_color:
                bits = read(CloudField(field.name, field.offset, UINT32))
                found.append((label, tuple(bits >> shift & 255 for shift in (16, 8, 0, 24))))
            else:
                more = f"[{field.count}]" if field.count > _MAX_SHOWN_VALUES else ""
                found.append((label + more, read(field)))
        return found


def _fields(message: Any) -> tuple[CloudField, ...]:
    value = read_sequence(message, _CLOUD2, "fields")
    count = len(value)
    if count > MAX_FIELDS:
        raise DecodeError(_CLOUD2, f"{count} fields; at most {MAX_FIELDS} are read", "fields")
    fields = []
    for index in range(count):
        path = f"fields[{index}]."
        item = value[index]
        name = read_field(item, _CLOUD2, "name")
        if not isinstance(name, str):
            raise DecodeError(_CLOUD2, f"expected a text, got {shown(name)}", f"{path}name")
        offset, datatype, values = (
            read_integer(item, _CLOUD2, field, path) for field in ("offset", "datatype", "count")
        )
        fields.append(CloudField(name, offset, datatype, values or 1))
    return tuple(fields)


def _range_with_nan(column: NDArray[np.float32]) -> tuple[float, float]:
    """Return minimum and maximum; NaN if one value is, or there is none."""
    if not column.size:
        return math.nan, math.nan
    with np.errstate(invalid="ignore"):
        return float(column.min()), float(column.max())


def _bounds(ranges: list[tuple[float, float]]) -> Bounds:
    both = np.array(ranges, np.float32)
    return both[:, 0].copy(), both[:, 1].copy()


def to_unorm(values: Array) -> NDArray[np.uint8]:
    """Convert numbers from 0 to 1 to bytes, as graphics cards do; NaN becomes 0."""
    clipped = np.fmin(np.fmax(values, 0), 1)
    out: NDArray[np.uint8] = np.rint(clipped * 255).astype(np.uint8)
    return out


def is_ordered(cloud: Cloud) -> bool:
    """Return whether successive points are close to each other, as in lidar rows and depth images.

    Decided by about a thousand points.
    """
    if cloud.point_count < 3:
        return True
    step = max(1, (cloud.point_count - 1) // _SAMPLED_POINTS)
    with np.errstate(over="ignore", invalid="ignore"):
        columns = [cloud.values(name).reshape(cloud.point_count, -1)[:, 0] for name in "xyz"]
        first = np.stack([column[:-1:step] for column in columns]).astype(np.float32)
        second = np.stack([column[1::step] for column in columns]).astype(np.float32)
        valid = np.isfinite(first + second).all(axis=0)
        if np.count_nonzero(valid) < 3:
            return True
        first, second = first[:, valid], second[:, valid]
        # A few outliers do not count.
        low, high = np.percentile(first, (5, 95), axis=1)
        distance = np.median(np.linalg.norm(second - first, axis=0))
        return bool(distance <= _ORDERED_RATIO * np.linalg.norm(high - low))


def order_points(cloud: Cloud, vertices: VertexData) -> VertexData:
    """Return the vertices ordered by the cells of a coarse grid, without invalid points.

    Software OpenGL draws these twice as fast, because neighbours are in the same tile. Clouds that
    are ordered already (:func:`is_ordered`) do not gain.

    Args:
        cloud: The cloud.
        vertices: Its vertices in the cloud's own order.
    """
    bounds = cloud.bounds()
    count, stride = vertices.count, vertices.stride
    order = np.empty(0, np.intp)
    if bounds is not None:
        cells = np.zeros(count, np.uint16)
        for index, bits in enumerate(_CELL_BITS):
            offset = vertices.position + 4 * index
            values = np.ndarray((count,), "<f4", vertices.data, offset, (stride,))
            low, high = float(bounds[0][index]), float(bounds[1][index])
            # Just below the number of cells, so that the maximum is in the last one.
            scale = np.float32(((1 << bits) - 0.01) / max(high - low, 1e-6))
            with np.errstate(over="ignore", invalid="ignore"):
                cell = ((values - np.float32(low)) * scale).astype(np.uint16)
            cells <<= bits
            cells |= cell
        order = np.argsort(cells, kind="stable")
        if cloud.finite_mask is not None:
            order = order[cloud.finite_mask.take(order)]
    # take() needs an eighth of the time of an index here.
    data = vertices.data.reshape(count, stride).take(order, axis=0).reshape(-1)
    return replace(vertices, data=data, count=len(order), order=order)


@dataclass(frozen=True, slots=True, eq=False)
class CloudEntry:
    """A cloud that is shown, at the pose of its stamp.

    Attributes:
        cloud: The cloud.
        transform: Pose of the cloud in the fixed frame, 4x4.
        received_s: Time of reception in seconds of a steady clock, as ``Node.steady()``.
        stamp: Stamp of the message; None if it has none.
    """

    cloud: Cloud
    transform: NDArray[np.float64]
    received_s: float
    stamp: Time | None = None


class CloudHistory:
    """The clouds of a display that are still shown: the latest, or those of the Decay Time.

    Clouds beyond 20 million points or 1 GiB are dropped, the oldest first; the latest is always
    kept. Not thread-safe.

    Attributes:
        warning: Text for the display's status if clouds were dropped; empty otherwise.

    Args:
        decay_time_s: Seconds that clouds are shown; 0 until the next one arrives.
        max_points: Most points of all clouds.
        max_bytes: Most bytes of all clouds.
    """

    def __init__(
        self,
        decay_time_s: float = 0.0,
        max_points: int = _MAX_KEPT_POINTS,
        max_bytes: int = _MAX_KEPT_BYTES,
    ) -> None:
        self._max_points, self._max_bytes = max_points, max_bytes
        self._entries: deque[CloudEntry] = deque()
        self._points = self._bytes = 0
        self.warning = ""
        self.decay_time_s = decay_time_s

    @property
    def decay_time_s(self) -> float:
        """Seconds that clouds are shown; 0 until the next one arrives."""
        return self._decay_time_s

    @decay_time_s.setter
    def decay_time_s(self, seconds: float) -> None:
        self._decay_time_s = seconds
        self.warning = ""

    @property
    def entries(self) -> tuple[CloudEntry, ...]:
        """The clouds that are shown, the oldest first."""
        return tuple(self._entries)

    @property
    def point_count(self) -> int:
        """Number of points of all clouds."""
        return self._points

    def add(
        self,
        cloud: Cloud,
        transform: NDArray[np.float64],
        received_s: float,
        stamp: Time | None = None,
    ) -> tuple[CloudEntry, list[CloudEntry]]:
        """Add a cloud, and remove those that it replaces.

        Args:
            cloud: The cloud.
            transform: Its pose in the fixed frame at its stamp, 4x4.
            received_s: Time of reception in seconds of a steady clock.
            stamp: Stamp of the message.

        Returns:
            The new entry, and those removed.
        """
        entry = CloudEntry(cloud, transform, received_s, stamp)
        removed = self.expire(received_s) if self._decay_time_s else self.clear()
        self._entries.append(entry)
        self._points += cloud.point_count
        self._bytes += cloud.data.nbytes
        expired = len(removed)
        while len(self._entries) > 1 and (
            self._points > self._max_points or self._bytes > self._max_bytes
        ):
            removed.append(self._pop())
        self.warning = ""
        if len(removed) > expired:
            shown_s = entry.received_s - self._entries[0].received_s
            self.warning = (
                f"Decay Time {self._decay_time_s:g} s has too many points: the latest "
                f"{len(self._entries)} clouds ({shown_s:.1f} s, {self._points} points) are shown; "
                "reduce Decay Time"
            )
        return entry, removed

    def expire(self, now_s: float) -> list[CloudEntry]:
        """Remove the clouds older than the Decay Time, and return them."""
        removed = []
        while self._decay_time_s and self._entries:
            if now_s - self._entries[0].received_s < self._decay_time_s:
                break
            removed.append(self._pop())
        return removed

    def clear(self) -> list[CloudEntry]:
        """Remove all clouds, and return them."""
        removed = list(self._entries)
        self._entries.clear()
        self._points = self._bytes = 0
        return removed

    def _pop(self) -> CloudEntry:
        entry = self._entries.popleft()
        self._points -= entry.cloud.point_count
        self._bytes -= entry.cloud.data.nbytes
        return entry
