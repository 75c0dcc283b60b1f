"""The display DepthCloud: a depth image as points, with the colours of another image."""
# ruff: noqa: N815 - the names of properties are QML's

from __future__ import annotations

import math
import threading
import time
from collections import deque
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from rosglass.errors import Error
from rosglass.images.compressed import decompress, decompress_depth
from rosglass.images.transports import camera_info_topic
from rosglass.qml.elements.message_queue import drop_oldest, frame_and_stamp
from rosglass.scene.configs.settings import Setting
from rosglass.scene.data.cloud_sources import (
    OcclusionBuffer,
    cloud_from_depth_image,
)
from rosglass.scene.data.point_clouds import Cloud
from rosglass.scene.displays.point_cloud import (
    MAX_SIZE_M,
    METRIC_STYLES,
    CloudDisplay,
    ColorSettings,
    PreparedCloud,
    size_setting,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from numpy.typing import NDArray

    from rosglass.messages import Message
    from rosglass.qml.engine.runtime import Runtime
    from rosglass.qt import QtCore

__all__ = ["DepthCloudDisplay"]

#: Encodings of depth images; others are colour images.
_DEPTH_ENCODINGS = ("16UC1", "mono16", "32FC1")
#: Seconds that colour images may be behind depth images, which wait for them.
_MAX_BEHIND_S = 3.0
#: Motion of a depth camera after which hidden points are dropped, as in RViz.
_MOVED_M, _MOVED_DEG = 0.01, 0.5
#: In the format of compressed ones.
_COMPRESSED_DEPTH = "compressedDepth"


class _DepthMatcher:
    """Combines depth images with the camera's calibration, and with colour images of the same time.

    Used in the node's threads.

    Args:
        info_topic: Topic of the calibration, for errors.
        color_topic: The same of colour images; empty if depth images have no colour.
        size: How many images wait for others.
    """

    def __init__(self, info_topic: str, color_topic: str, size: int) -> None:
        self._info_topic, self._color_topic = info_topic, color_topic
        self._lock = threading.Lock()
        self._info: Any = None
        self._size = size
        self._depths: deque[Any] = deque()
        self._colors: deque[Any] = deque()

    def match(self, message: Any) -> tuple[Any, Any, Any] | None:
        """Take a message, and return a depth image, its calibration and colour once all are there.

        Raises:
            Error: Something is missing; the text says what.
        """
        with self._lock:
            if "format" in message:
                is_depth, kind = _COMPRESSED_DEPTH in message.format, message.format
            elif "encoding" in message:
                is_depth, kind = message.encoding in _DEPTH_ENCODINGS, message.encoding
            else:
                self._info = message
                return None
            if not is_depth and not self._color_topic:
                known = ", ".join((*_DEPTH_ENCODINGS, _COMPRESSED_DEPTH))
                raise Error(f"encoding: a depth image is {known}, got {kind[:60]!r}")
            images = self._depths if is_depth else self._colors
            images.append(message)
            drop_oldest(images, self._size, lambda one: len(one.data))
            if self._info is None:
                raise Error(f"no camera info received; publish it on {self._info_topic}")
            if not self._color_topic:
                return self._depths.pop(), self._info, None
            return self._pair()

    def _pair(self) -> tuple[Any, Any, Any] | None:
        """Return the newest depth image whose colour is known: that of the nearest time."""
        if not self._depths:
            return None
        colors = [(frame_and_stamp(color)[1], color) for color in self._colors]
        if not colors:
            if len(self._depths) == self._size:
                raise Error(f"no colour image received; publish it on {self._color_topic}")
            return None
        for at in range(len(self._depths) - 1, -1, -1):
            depth = self._depths[at]
            stamp = frame_and_stamp(depth)[1]
            # Until one of this time or a later one is there, a nearer one may follow.
            if max(when for when, _ in colors) >= stamp:
                for _ in range(at + 1):
                    self._depths.popleft()
                return depth, self._info, min(colors, key=lambda one: abs(one[0] - stamp))[1]
        behind_s = (frame_and_stamp(self._depths[-1])[1] - max(when for when, _ in colors)) * 1e-9
        if behind_s > _MAX_BEHIND_S:
            raise Error(
                f"the last colour image of {self._color_topic} is {behind_s:.0f} s older than the "
                "depth image"
            )
        return None


def _prepare_depth(
    message: Any,
    matcher: _DepthMatcher,
    settings: ColorSettings,
    occlusion: OcclusionBuffer | None,
) -> PreparedCloud | None:
    found = matcher.match(message)
    if found is None:
        return None
    depth, info, color = found
    image = _decompress(depth)
    size = _image_size(info)
    if all(size) and size != (image.width, image.height):
        raise Error(
            f"the depth image is {image.width}x{image.height} pixels, the camera info "
            f"{size[0]}x{size[1]}; use the camera info of the depth image"
        )
    colors = None if color is None else _decompress(color)
    hidden = 0
    if occlusion is None:
        cloud = cloud_from_depth_image(image, info, colors)
    else:
        # RViz takes the time of arrival, which says less of an image that was recorded.
        stamp = frame_and_stamp(depth)[1]
        now_s = stamp * 1e-9 if stamp else time.monotonic()
        cloud, hidden = occlusion.add(image, info, colors, now_s)
    if color is not None and color.header.frame_id != depth.header.frame_id:
        text = (
            f"the frame of the depth image is [{depth.header.frame_id}], that of the colour image "
            f"[{color.header.frame_id}]; use a registered depth image"
        )
        cloud.warnings = (*cloud.warnings, text)
    focal_px = float(info["p" if "p" in info else "P"][0]) / max(info.binning_x, 1)
    pixel_m = min(1 / abs(focal_px), MAX_SIZE_M)
    return settings.prepare(cloud)._replace(source=depth, pixel_m=pixel_m, hidden=hidden)


def _image_size(info: Any) -> tuple[int, int]:
    """Return width and height of a camera's images: of its region of interest, binned."""
    roi = info.roi
    return (
        (roi.width or info.width) // max(info.binning_x, 1),
        (roi.height or info.height) // max(info.binning_y, 1),
    )


def _has_moved(pose: NDArray[np.float64], before: NDArray[np.float64]) -> bool:
    """Return whether a camera has moved so far that what it has seen before is elsewhere."""
    turn = before[:3, :3].T @ pose[:3, :3]
    angle = math.degrees(math.acos(min(max((float(np.trace(turn)) - 1) / 2, -1.0), 1.0)))
    moved = float(np.linalg.norm(pose[:3, 3] - before[:3, 3]))
    return moved > _MOVED_M or angle > _MOVED_DEG


def _decompress(message: Any) -> Any:
    """Return an image that a transport has compressed; others as they are."""
    if "format" not in message:
        return message
    is_depth = _COMPRESSED_DEPTH in message.format
    return (decompress_depth if is_depth else decompress)(message.data, message.format)


class DepthCloudDisplay(CloudDisplay):
    """The points of a depth image, and their colours. See its page in ``docs/scene.md``."""

    TYPE = "DepthCloud"
    MESSAGES = ("sensor_msgs/Image", "sensor_msgs/CompressedImage", "sensor_msgs/CameraInfo")
    SUGGESTED = ("sensor_msgs/Image",)
    IS_CONTINUOUS = True

    transport = Setting(
        "Depth Map Transport Hint", "enum", "raw", "Transport of depth images.",
        choices=["raw", _COMPRESSED_DEPTH], then="_on_topic",
    )  # fmt: skip
    colorTransport = Setting(
        "Color Transport Hint", "enum", "raw", "Transport of colour images.",
        choices=["raw", "compressed"], then="_on_topic",
    )  # fmt: skip
    colorTopic = Setting(
        "Color Image Topic", "topic", "", "Color images of the same camera; empty for none.",
        then="_on_topic",
    )  # fmt: skip
    size = size_setting(autoSize=False)
    autoSize = Setting(
        "Auto Size", "bool", True, "Draw points as large as their pixels.", shown_if=METRIC_STYLES
    )
    autoSizeFactor = Setting(
        "Auto Size/Auto Size Factor", "float", 1.0, "Factor of the automatic size.",
        min=0.0001, max=MAX_SIZE_M, shown_if={"autoSize": True},
    )  # fmt: skip
    occlusionCompensation = Setting(
        "Occlusion Compensation", "bool", False,
        "Keep points that nearer ones hide, until the camera moves.",
        then="_on_occlusion",
    )  # fmt: skip
    occlusionTimeOut = Setting(
        "Occlusion Compensation/Occlusion Time-Out", "float", 30.0,
        "Seconds for which hidden points are kept.", min=0.0, max=1e9,
        shown_if={"occlusionCompensation": True},
    )  # fmt: skip

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        self._matcher = _DepthMatcher("", "", 1)
        self._occlusion = OcclusionBuffer()
        #: Pose of the camera when the buffer was reset; None before the first image.
        self._camera_pose: NDArray[np.float64] | None = None
        super().__init__(parent, runtime)

    def further_topics(self, topic: str) -> tuple[str, ...]:
        """Return the topics of the calibration, and of colour images."""
        colors = self._resolve_further("Color Image Topic", self.colorTopic)
        return (
            camera_info_topic(topic),
            *(_transported(one, self.colorTransport) for one in colors),
        )

    def _wanted(self) -> tuple[Any, ...] | None:
        wanted = super()._wanted()
        if wanted is None:
            return None
        node, (topic, *others), qos = wanted
        self._resolved = _transported(topic, self.transport)
        return node, (self._resolved, *others), qos

    def _factory(self, *wanted: Any) -> Callable[[], Any]:
        (topic, info_topic, *color), depth = wanted[1], self.depth
        del topic
        self._matcher = _DepthMatcher(info_topic, color[0] if color else "", depth)
        return super()._factory(*wanted)

    def preparer(self) -> Callable[[Message], Any]:
        """Return the function that waits for what belongs together, and makes a cloud of it."""
        matcher, settings = self._matcher, self._color_settings()
        occlusion = self._occlusion if self.occlusionCompensation else None
        return lambda message: _prepare_depth(message, matcher, settings, occlusion)

    def _on_occlusion(self) -> None:
        self._forget_hidden()
        self._restyle()

    def _restyle(self) -> None:
        self._occlusion.timeout_s = self.occlusionTimeOut
        super()._restyle()

    def _forget_hidden(self) -> None:
        self._occlusion.reset()
        self._camera_pose = None
        self.delete_status("Occlusion")

    def show(self, data: Any, pose: NDArray[np.float64], frame: str, stamp: int) -> None:
        """Show a cloud, without points that were hidden before the camera has moved."""
        if self.occlusionCompensation:
            before = self._camera_pose
            if before is None or _has_moved(pose, before):
                self._camera_pose = pose
                if before is not None:
                    self._occlusion.reset()
                    data = self._without_hidden(data)
            text = f"[{data.hidden}] points are of earlier images, {self.occlusionTimeOut:g} s old"
            self.set_status("Occlusion", "ok", f"{text} at most")
        super().show(data, pose, frame, stamp)

    def _without_hidden(self, data: PreparedCloud) -> PreparedCloud:
        if not data.hidden:
            return data
        cloud, count = data.cloud, data.cloud.point_count - data.hidden
        size = count * cloud.layout.point_step
        layout = replace(cloud.layout, width=count, row_step=size)
        seen = Cloud(layout, cloud.data[:size], cloud.warnings)
        new = self._current_settings().prepare(seen)
        return new._replace(source=data.source, pixel_m=data.pixel_m)

    def on_fixed_frame(self) -> None:
        """Show the last cloud in the new fixed frame, in which the camera may be elsewhere."""
        self._forget_hidden()
        super().on_fixed_frame()

    def reset(self) -> None:
        """Drop all clouds, and what the camera has seen."""
        super().reset()
        self._forget_hidden()

    def _point_size(self, data: PreparedCloud) -> tuple[float, bool]:
        if self.autoSize and self.style != "Points":
            return self.autoSizeFactor * data.pixel_m, True
        return super()._point_size(data)

    def load_settings(self, saved: Mapping[str, Any]) -> list[str]:
        """Apply the settings in a file, in which the topic has another name."""
        return super().load_settings({**saved, "Topic": saved.get("Depth Map Topic", "")})

    def save_settings(self, older: Mapping[str, Any] | None = None, ros: int = 2) -> dict[str, Any]:  # noqa: ARG002 - in both RViz the same
        """Return the settings for a file of either RViz."""
        kept = super().save_settings(older, 1)
        kept["Depth Map Topic"] = kept.pop("Topic")
        # A setting of this name is another one's.
        return {**kept, "Topic": older["Topic"]} if older and "Topic" in older else kept


def _transported(topic: str, transport: str) -> str:
    """Return the topic of a transport of image_transport."""
    return topic if transport == "raw" else f"{topic}/{transport}"
