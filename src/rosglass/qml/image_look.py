"""How a camera is looked at: turned, enlarged, in colours, how often."""
# ruff: noqa: N815 - the names of signals are QML's

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from rosglass.qml.element import TopicElement
from rosglass.qt import Property, QtCore, Signal

if TYPE_CHECKING:
    from rosglass.qml.image_rendering import Look
    from rosglass.qml.runtime import Runtime

__all__ = ["LookElement"]


class LookElement(TopicElement):
    """The properties of a camera that say how its pictures are shown."""

    rotationChanged = Signal()
    mirroredChanged = Signal()
    flippedChanged = Signal()
    zoomChanged = Signal()
    regionOfInterestChanged = Signal()
    colorMapChanged = Signal()
    minimumDepthChanged = Signal()
    maximumDepthChanged = Signal()
    throttleRateChanged = Signal()
    fullResolutionChanged = Signal()

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        super().__init__(parent, runtime)
        self._rotation = 0
        self._mirrored = self._flipped = False
        self._zoom = 1.0
        self._region = QtCore.QRectF()
        self._colors = ""
        self._near = self._far = -1.0
        self._rate = 0.0
        self._full = False

    def _look(self, video: bool, room: tuple[int, int] | None, painted: bool) -> Look:
        """Return what the properties ask for.

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

        box = self._region
        region = None
        if box.width() or box.height():
            region = (round(box.x()), round(box.y()), round(box.width()), round(box.height()))
        view = View(self._rotation, self._mirrored, self._flipped, region, self._zoom)
        colors = None
        if self._colors:
            near, far = (None if depth < 0 else depth for depth in (self._near, self._far))
            colors = (self._colors, near, far)
            DepthColors(*colors)
        if room is not None and self._rotation % 180:
            room = (room[1], room[0])
        return Look(video, view, colors, self._interval, None if self._full else room, painted)

    @property
    def _interval(self) -> float:
        """Seconds between two pictures at least."""
        return 1 / self._rate if self._rate else 0.0

    def _set_rotation(self, degrees: int) -> None:
        if degrees % 90:
            self._refuse(f"{self._who}: rotation {degrees} is no multiple of 90 degrees")
        elif degrees % 360 != self._rotation:
            self._rotation = degrees % 360
            self.rotationChanged.emit()
            self._schedule()

    def _set_mirrored(self, mirrored: bool) -> None:
        if mirrored != self._mirrored:
            self._mirrored = mirrored
            self.mirroredChanged.emit()
            self._schedule()

    def _set_flipped(self, flipped: bool) -> None:
        if flipped != self._flipped:
            self._flipped = flipped
            self.flippedChanged.emit()
            self._schedule()

    def _set_zoom(self, zoom: float) -> None:
        if not 1 <= zoom < math.inf:
            self._refuse(f"{self._who}: zoom {zoom} is below 1, where the whole picture is shown")
        elif zoom != self._zoom:
            self._zoom = zoom
            self.zoomChanged.emit()
            self._schedule()

    def _set_region(self, region: QtCore.QRectF) -> None:
        edges = (region.x(), region.y(), region.width(), region.height())
        if not all(0 <= edge < 1e6 for edge in edges):
            self._refuse(
                f"{self._who}: regionOfInterest {edges} is no part of a picture: give x, y, width "
                "and height in pixels from its top left corner"
            )
        elif region != self._region:
            self._region = QtCore.QRectF(region)
            self.regionOfInterestChanged.emit()
            self._schedule()

    def _set_colors(self, name: str) -> None:
        if name != self._colors:
            self._colors = name
            self.colorMapChanged.emit()
            self._schedule()

    def _set_near(self, depth: float) -> None:
        if self._is_depth("minimumDepth", depth) and depth != self._near:
            self._near = depth
            self.minimumDepthChanged.emit()
            self._schedule()

    def _set_far(self, depth: float) -> None:
        if self._is_depth("maximumDepth", depth) and depth != self._far:
            self._far = depth
            self.maximumDepthChanged.emit()
            self._schedule()

    def _is_depth(self, name: str, depth: float) -> bool:
        if math.isfinite(depth):
            return True
        self._refuse(f"{self._who}: {name} {depth} is no depth; metres, or -1 to follow the camera")
        return False

    def _set_rate(self, rate: float) -> None:
        if not 0 <= rate < math.inf:
            self._refuse(f"{self._who}: throttleRate {rate} is no number of pictures per second")
        elif rate != self._rate:
            self._rate = rate
            self.throttleRateChanged.emit()
            self._schedule()

    def _set_full(self, full: bool) -> None:
        if full != self._full:
            self._full = full
            self.fullResolutionChanged.emit()
            self._schedule()

    @property
    def _who(self) -> str:
        """What errors call this element."""
        return f"{type(self).__name__} {self._topic!r}"

    rotation = Property(int, lambda self: self._rotation, _set_rotation, notify=rotationChanged)
    mirrored = Property(bool, lambda self: self._mirrored, _set_mirrored, notify=mirroredChanged)
    flipped = Property(bool, lambda self: self._flipped, _set_flipped, notify=flippedChanged)
    zoom = Property(float, lambda self: self._zoom, _set_zoom, notify=zoomChanged)
    regionOfInterest = Property(
        QtCore.QRectF, lambda self: self._region, _set_region, notify=regionOfInterestChanged
    )
    colorMap = Property(str, lambda self: self._colors, _set_colors, notify=colorMapChanged)
    minimumDepth = Property(float, lambda self: self._near, _set_near, notify=minimumDepthChanged)
    maximumDepth = Property(float, lambda self: self._far, _set_far, notify=maximumDepthChanged)
    fullResolution = Property(
        bool, lambda self: self._full, _set_full, notify=fullResolutionChanged
    )
    throttleRate = Property(float, lambda self: self._rate, _set_rate, notify=throttleRateChanged)
