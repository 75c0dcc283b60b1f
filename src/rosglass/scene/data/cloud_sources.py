"""Point clouds from other messages: laser scans, depth images, and the old ``PointCloud``."""

from __future__ import annotations

import math
import sys
import threading
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from rosglass.errors import DecodeError, shown
from rosglass.images.encodings import ENCODINGS, RawImage, pixels_of
from rosglass.messages import MessageSequence
from rosglass.scene.data.point_clouds import (
    FLOAT32,
    MAX_FIELDS,
    UINT32,
    Cloud,
    CloudField,
    CloudLayout,
    read_bytes,
    read_field,
    read_integer,
    read_sequence,
)

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from rosglass.tf.transform import Transform

__all__ = [
    "OcclusionBuffer",
    "cloud_from_columns",
    "cloud_from_depth_image",
    "cloud_from_laser_scan",
    "cloud_from_point_cloud",
]


Array: TypeAlias = NDArray[Any]

_CLOUD, _SCAN = "sensor_msgs/msg/PointCloud", "sensor_msgs/msg/LaserScan"
_CAMERA, _IMAGE = "sensor_msgs/msg/CameraInfo", "sensor_msgs/msg/Image"


def cloud_from_columns(columns: Mapping[str, Any], warnings: Sequence[str] = ()) -> Cloud:
    """Create a cloud from one array for each field.

    Args:
        columns: Arrays of the same length by name of the field, x, y and z among them. uint32 (for
            packed colours) stays so, all others become float32.
        warnings: Texts for the display's status.

    Raises:
        DecodeError: There is no x, y or z.
    """
    arrays = {name: _column(value) for name, value in columns.items()}
    count = len(next(iter(arrays.values()))) if arrays else 0
    values = np.empty((count, len(arrays)), np.uint32)
    for index, array in enumerate(arrays.values()):
        values[:, index] = array.view(np.uint32)
    return _cloud({name: array.dtype for name, array in arrays.items()}, values, warnings)


def _cloud(types: Mapping[str, Any], values: Array, warnings: Sequence[str] = ()) -> Cloud:
    """Create a cloud from points x fields of 4 bytes."""
    fields = tuple(
        CloudField(name, 4 * index, UINT32 if dtype == np.uint32 else FLOAT32)
        for index, (name, dtype) in enumerate(types.items())
    )
    step, is_bigendian = 4 * len(fields), sys.byteorder == "big"
    layout = CloudLayout(len(values), 1, step, step * len(values), fields, is_bigendian)
    return Cloud(layout, values.reshape(-1).view(np.uint8), warnings)


def _column(value: Any) -> Array:
    array = np.asarray(value)
    with np.errstate(over="ignore", invalid="ignore"):
        return array.astype(np.uint32 if array.dtype == np.uint32 else np.float32, copy=False)


def cloud_from_point_cloud(message: Any) -> Cloud:
    """Create a cloud from a ``sensor_msgs/PointCloud``, the type before PointCloud2.

    Channels with another number of values than points are left out, with a warning.

    Raises:
        DecodeError: The message is not a PointCloud, or has values other than numbers.
    """
    points = read_sequence(message, _CLOUD, "points")
    columns: dict[str, Any] = {}
    for name in "xyz":
        if isinstance(points, MessageSequence):
            columns[name] = points.array[name]
        else:
            values = [read_field(point, _CLOUD, name) for point in points]
            columns[name] = _numbers(values, _CLOUD, f"points[*].{name}")
    warnings = []
    channels = read_sequence(message, _CLOUD, "channels")
    if len(channels) > MAX_FIELDS - 3:
        warnings.append(f"{len(channels)} channels; those from {MAX_FIELDS - 3} on are left out")
    for index in range(min(len(channels), MAX_FIELDS - 3)):
        channel, path = channels[index], f"channels[{index}].values"
        name = str(read_field(channel, _CLOUD, "name"))
        numbers = _numbers(read_field(channel, _CLOUD, "values"), _CLOUD, path)
        if len(numbers) != len(points):
            warnings.append(
                f"channel {shown(name)} has {len(numbers)} values for {len(points)} points and is "
                "left out"
            )
        elif name in columns:
            warnings.append(f"channel {index} is left out: its name {shown(name)} is in use")
        else:
            columns[name] = numbers
    return cloud_from_columns(columns, warnings)


def cloud_from_laser_scan(
    scan: Any, start: Transform | None = None, end: Transform | None = None
) -> Cloud:
    """Create a cloud from a ``sensor_msgs/LaserScan``, with the channel ``intensity``.

    Rays below range_min, and from range_max on, are left out.

    Args:
        scan: The message.
        start: Pose of the scanner at the first ray. With `end`, the points are in the frame of
            these, corrected by the motion in between; otherwise they are in the scanner's frame.
        end: Pose of the scanner at the last ray.

    Raises:
        DecodeError: The message is not a LaserScan, or its angles or limits are not numbers.
    """
    ranges = _numbers(read_field(scan, _SCAN, "ranges"), _SCAN, "ranges")
    intensities = _numbers(read_field(scan, _SCAN, "intensities"), _SCAN, "intensities")
    limits = {}
    for name in ("angle_min", "angle_increment", "range_min", "range_max"):
        limits[name] = number = _number(scan, _SCAN, name)
        if math.isnan(number) or (name.startswith("angle") and math.isinf(number)):
            raise DecodeError(_SCAN, f"expected a finite number, got {number}", name)
    with np.errstate(invalid="ignore"):
        rays = np.flatnonzero((ranges >= limits["range_min"]) & (ranges < limits["range_max"]))
    kept = ranges[rays]
    angles = limits["angle_min"] + rays * limits["angle_increment"]
    points = np.zeros((len(rays), 3))
    points[:, 0], points[:, 1] = kept * np.cos(angles), kept * np.sin(angles)
    if start is not None and end is not None:
        points = _move(points, rays / max(len(ranges) - 1, 1), start, end)
    columns = dict(zip("xyz", points.T, strict=True))
    warnings = []
    if len(intensities) == len(ranges):
        columns["intensity"] = intensities[rays]
    elif len(intensities):
        warnings.append(
            f"{len(intensities)} intensities for {len(ranges)} ranges; they are left out"
        )
    return cloud_from_columns(columns, warnings)


def _move(
    points: NDArray[np.float64], ratio: NDArray[np.float64], start: Transform, end: Transform
) -> NDArray[np.float64]:
    """Transform points by poses interpolated between two."""
    first, last = np.array(start.rotation), np.array(end.rotation)
    first, last = first / np.linalg.norm(first), last / np.linalg.norm(last)
    dot = float(first @ last)
    if dot < 0:
        dot, last = -dot, -last
    angle = math.acos(min(dot, 1.0))
    weights = np.stack([1 - ratio, ratio])
    if angle > 1e-6:
        weights = np.sin(weights * angle) / math.sin(angle)
    rotations = weights[0][:, None] * first + weights[1][:, None] * last
    axes, w = rotations[:, :3], rotations[:, 3:]
    cross = 2 * np.cross(axes, points)
    turned = points + w * cross + np.cross(axes, cross)
    translations = np.array(start.translation), np.array(end.translation)
    moved: NDArray[np.float64] = (
        turned + translations[0] + ratio[:, None] * (translations[1] - translations[0])
    )
    return moved


#: Order of red, green and blue in colour images that colour depth images.
_RED_GREEN_BLUE = {
    "rgb8": (0, 1, 2),
    "rgba8": (0, 1, 2),
    "bgr8": (2, 1, 0),
    "bgra8": (2, 1, 0),
    "8UC3": (2, 1, 0),
    "8UC4": (2, 1, 0),
}


def cloud_from_depth_image(depth: Any, camera_info: Any, color: Any = None) -> Cloud:
    """Create a cloud from a depth image, its ``CameraInfo``, and an image of the same camera.

    Args:
        depth: ``sensor_msgs/Image`` or RawImage in millimetres (16UC1, mono16) or metres (32FC1).
        camera_info: Its calibration.
        color: ``sensor_msgs/Image`` or RawImage of the same size, for a field rgb; None for white
            points.

    Returns:
        The known pixels in the optical frame (z forward).

    Raises:
        DecodeError: Sizes, encodings or the calibration do not fit.
    """
    return _depth_cloud(_read_depth(depth, camera_info, color).values)


class _DepthPixels(NamedTuple):
    """The known pixels of a depth image.

    Attributes:
        values: x, y, z and the packed colour of each, float32.
        known: Their indices in the image, row by row.
        camera: Size of the image and its projection, which identify the camera.
    """

    values: NDArray[np.float32]
    known: NDArray[np.intp]
    camera: tuple[float, ...]


def _depth_cloud(values: Array) -> Cloud:
    types = {"x": np.float32, "y": np.float32, "z": np.float32, "rgb": np.uint32}
    return _cloud(types, values.view(np.uint32))


def _read_depth(depth: Any, camera_info: Any, color: Any) -> _DepthPixels:
    image = _raw_image(depth)
    if image.encoding not in {"16UC1", "mono16", "32FC1"}:
        raise DecodeError(
            _IMAGE,
            f"a depth image is 16UC1, mono16 or 32FC1, got {shown(image.encoding)}",
            "encoding",
        )
    fx, fy, cx, cy = _projection(camera_info)
    z = pixels_of(image, ENCODINGS[image.encoding])
    is_metric = image.encoding == "32FC1"
    known = np.flatnonzero(np.isfinite(z) if is_metric else z)
    z = z if is_metric else z * np.float32(0.001)
    u = ((np.arange(image.width) - cx) / fx).astype(np.float32)
    v = ((np.arange(image.height) - cy) / fy).astype(np.float32)
    # One column after the other: new memory is what costs most here.
    values = np.empty((len(known), 4), np.float32)
    with np.errstate(over="ignore", invalid="ignore"):
        values[:, 0] = (u * z).reshape(-1).take(known)
        values[:, 1] = (v[:, None] * z).reshape(-1).take(known)
    values[:, 2] = z.reshape(-1).take(known)
    colors = values.view(np.uint32)[:, 3]
    colors[:] = 0xFFFFFF
    if color is not None:
        colors[:] = _packed_colors(_raw_image(color), image).reshape(-1).take(known)
    return _DepthPixels(values, known, (image.width, image.height, fx, fy, cx, cy))


#: Metres by which a point has to be nearer than another one to hide it, as in RViz.
_OCCLUSION_DISTANCE_M = 0.01


class OcclusionBuffer:
    """Points that a resting depth camera has seen behind the nearer objects of its images.

    Its points are those that RViz's Occlusion Compensation adds: for each pixel, the last one that
    nothing nearer has hidden since, at half the brightness. Used in any thread.

    Attributes:
        timeout_s: Seconds for which a hidden point is kept.
    """

    def __init__(self, timeout_s: float = 30.0) -> None:
        self.timeout_s = timeout_s
        self._lock = threading.Lock()
        self._camera: tuple[float, ...] = ()
        self._points: NDArray[np.float32] = np.zeros((0, 4), np.float32)
        self._depths: NDArray[np.float32] = np.zeros(0, np.float32)
        self._expiries_s: NDArray[np.float64] = np.zeros(0)

    def reset(self) -> None:
        """Forget all points, as the camera has moved."""
        with self._lock:
            self._camera = ()

    def add(self, depth: Any, camera_info: Any, color: Any, now_s: float) -> tuple[Cloud, int]:
        """Return the cloud of an image and of what it hides, and how many points that is.

        Args:
            depth: As for :func:`cloud_from_depth_image`.
            camera_info: Likewise; another calibration resets the buffer.
            color: Likewise.
            now_s: Time of the image, seconds.

        Returns:
            The cloud, with the points that are hidden as its last ones, and their number.

        Raises:
            DecodeError: Sizes, encodings or the calibration do not fit.
        """
        pixels = _read_depth(depth, camera_info, color)
        values, known = pixels.values, pixels.known
        with self._lock:
            if pixels.camera != self._camera:
                self._camera, count = pixels.camera, int(pixels.camera[0] * pixels.camera[1])
                self._points = np.zeros((count, 4), np.float32)
                self._depths, self._expiries_s = np.zeros(count, np.float32), np.zeros(count)
            self._depths[self._expiries_s < now_s] = 0
            covers = values[:, 2] < self._depths[known] - np.float32(_OCCLUSION_DISTANCE_M)
            seen, fresh = known[~covers], values[~covers]
            is_hidden = self._depths != 0
            is_hidden[seen] = False
            hidden = self._points[is_hidden]
            self._points[seen] = fresh
            colors = self._points.view(np.uint32)[:, 3]
            colors[seen] = fresh.view(np.uint32)[:, 3] >> np.uint32(1) & np.uint32(0x7F7F7F)
            self._depths[seen], self._expiries_s[seen] = fresh[:, 2], now_s + self.timeout_s
        return _depth_cloud(np.concatenate([values, hidden])), len(hidden)


def _raw_image(message: Any) -> RawImage:
    if isinstance(message, RawImage):
        return message
    width, height, step = (
        read_integer(message, _IMAGE, name) for name in ("width", "height", "step")
    )
    encoding = read_field(message, _IMAGE, "encoding")
    big = bool(read_field(message, _IMAGE, "is_bigendian"))
    data = read_bytes(read_field(message, _IMAGE, "data"), _IMAGE)
    return RawImage(width, height, str(encoding), step, data, big)


def _projection(camera_info: Any) -> tuple[float, float, float, float]:
    """Return focal lengths and centre of the rectified image, in its own pixels."""
    p = _numbers(read_field(camera_info, _CAMERA, "p", "P"), _CAMERA, "p")
    if len(p) != 12 or not np.isfinite(p).all():
        raise DecodeError(_CAMERA, f"expected 12 finite numbers, got {shown(p.tolist())}", "p")
    roi = read_field(camera_info, _CAMERA, "roi")
    focal, center = [], []
    for index, axis in ((0, "x"), (5, "y")):
        binning = max(1, read_integer(camera_info, _CAMERA, f"binning_{axis}"))
        offset = read_integer(roi, _CAMERA, f"{axis}_offset")
        focal.append(float(p[index]) / binning)
        # RViz does not divide it, and so draws binned images beside where they are.
        center.append((float(p[2 if index == 0 else 6]) - offset) / binning)
        if not focal[-1]:
            raise DecodeError(
                _CAMERA, "the focal length is 0: the camera is not calibrated", f"p[{index}]"
            )
    return focal[0], focal[1], center[0], center[1]


def _packed_colors(color: RawImage, depth: RawImage) -> NDArray[np.uint32]:
    """Return the pixels as 0xRRGGBB."""
    if (color.width, color.height) != (depth.width, depth.height):
        raise DecodeError(
            _IMAGE,
            f"the colour image is {color.width}x{color.height} pixels, the depth image "
            f"{depth.width}x{depth.height}; use a registered depth image",
            "width",
        )
    if color.encoding in {"mono8", "8UC1"}:
        return pixels_of(color, ENCODINGS[color.encoding]).astype(np.uint32) * 0x10101
    if color.encoding not in _RED_GREEN_BLUE:
        known = ", ".join(("mono8", "8UC1", *_RED_GREEN_BLUE))
        raise DecodeError(
            _IMAGE, f"colours are one of {known}, got {shown(color.encoding)}", "encoding"
        )
    pixels = pixels_of(color, ENCODINGS[color.encoding])
    packed = np.zeros(pixels.shape[:2], np.uint32)
    for channel in _RED_GREEN_BLUE[color.encoding]:
        packed = packed << np.uint32(8) | pixels[..., channel]
    return packed


def _number(message: Any, type_name: str, name: str) -> float:
    value = read_field(message, type_name, name)
    try:
        return float(value)
    except (TypeError, ValueError, OverflowError):
        raise DecodeError(type_name, f"expected a number, got {shown(value)}", name) from None


def _numbers(value: Any, type_name: str, path: str) -> Array:
    """Return an array field of numbers as float32."""
    try:
        with np.errstate(over="ignore"):
            array = np.asarray(value, np.float32)
    except (TypeError, ValueError, OverflowError):
        raise DecodeError(type_name, f"expected numbers, got {shown(value)}", path) from None
    if array.ndim != 1:
        raise DecodeError(type_name, f"expected an array, got {shown(value)}", path)
    return array
