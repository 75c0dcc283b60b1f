"""The view of a camera: rotation, region, zoom, colours and rate."""
# ruff: noqa: N815 - the names of signals are QML's

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from rosglass.qml.element import TopicElement
from rosglass.qml.properties import Writable
from rosglass.qt import QtCore

if TYPE_CHECKING:
    from rosglass.qml.image_rendering import Look

__all__ = ["LookElement"]


def _quarter_turns(degrees: int) -> int:
    if degrees % 90:
        raise ValueError("is no multiple of 90 degrees")
    return degrees % 360


def _zoom(zoom: float) -> float:
    if not 1 <= zoom < math.inf:
        raise ValueError("is below 1, where the whole picture is shown")
    return zoom


def _region(region: QtCore.QRectF) -> QtCore.QRectF:
    edges = (region.x(), region.y(), region.width(), region.height())
    if not all(0 <= edge < 1e6 for edge in edges):
        raise ValueError(
            "is no part of a picture: give x, y, width and height in pixels from its top "
            "left corner"
        )
    return QtCore.QRectF(region)


def _depth(depth: float) -> float:
    if not math.isfinite(depth):
        raise ValueError("is no depth; metres, or -1 to follow the camera")
    return depth


def _rate(rate: float) -> float:
    if not 0 <= rate < math.inf:
        raise ValueError("is no number of pictures per second")
    return rate


class LookElement(TopicElement):
    """The properties of a camera that say how its pictures are shown."""

    #: Degrees clockwise, a multiple of 90.
    rotation = Writable(int, 0, _quarter_turns)
    mirrored = Writable(bool, False)
    flipped = Writable(bool, False)
    zoom = Writable(float, 1.0, _zoom)
    #: Pixels from the top left corner; an empty rectangle is the whole picture.
    regionOfInterest = Writable(QtCore.QRectF, QtCore.QRectF(), _region)
    colorMap = Writable(str, "")
    #: Metres; -1 follows the camera.
    minimumDepth = Writable(float, -1.0, _depth)
    maximumDepth = Writable(float, -1.0, _depth)
    #: Pictures per second at most; 0 shows all.
    throttleRate = Writable(float, 0.0, _rate)
    fullResolution = Writable(bool, False)

    def _look(self, video: bool, room: tuple[int, int] | None, painted: bool) -> Look:
        """Return the view that the properties describe.

        Args:
            video: Whether video frames are wanted; otherwise images.
            room: Width and height on the screen, as far as known.
            painted: Whether images are wanted besides video frames.

        Raises:
            UnsupportedError: The colour map is unknown, or the depths are no range.
        """
        # They bring numpy, which an interface without a camera does not need.
        from rosglass.images import DepthColors, View  # noqa: PLC0415
        from rosglass.qml.image_rendering import Look  # noqa: PLC0415

        box = self.regionOfInterest
        region = None
        if box.width() or box.height():
            region = (round(box.x()), round(box.y()), round(box.width()), round(box.height()))
        view = View(self.rotation, self.mirrored, self.flipped, region, self.zoom)
        colors = None
        if self.colorMap:
            near, far = (
                None if depth < 0 else depth for depth in (self.minimumDepth, self.maximumDepth)
            )
            colors = (self.colorMap, near, far)
            DepthColors(*colors)
        if room is not None and self.rotation % 180:
            room = (room[1], room[0])
        return Look(
            video, view, colors, self._interval, None if self.fullResolution else room, painted
        )

    @property
    def _interval(self) -> float:
        """Seconds between two pictures at least."""
        return 1 / self.throttleRate if self.throttleRate else 0.0

    @property
    def label(self) -> str:
        """What error messages call this element."""
        return f"{type(self).__name__} {self._topic!r}"
