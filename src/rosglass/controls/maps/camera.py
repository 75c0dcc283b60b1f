"""The element ``MapCamera``: which part of a plane a map shows, from where, and how large."""
# ruff: noqa: N802, N815 - the names of slots and signals are QML's

from __future__ import annotations

import math
from typing import Any, NamedTuple

from rosglass.qt import Property, QtCore, Signal, Slot

__all__ = ["MapCamera", "Plane", "Track"]

#: Numbers of metres beyond which floating point is too coarse for a map.
_MAX_METRES = 1e9


class Plane(NamedTuple):
    """An affine map of the plane: ``x' = a x + b y + e`` and ``y' = c x + d y + f``."""

    a: float
    b: float
    c: float
    d: float
    e: float
    f: float

    @classmethod
    def pose(cls, x: float, y: float, yaw: float) -> Plane:
        """Return the map from a frame to its parent, in which it has this pose."""
        cos, sin = math.cos(yaw), math.sin(yaw)
        return cls(cos, -sin, sin, cos, x, y)

    def apply(self, x: float, y: float) -> tuple[float, float]:
        """Return where a point comes to lie."""
        return self.a * x + self.b * y + self.e, self.c * x + self.d * y + self.f

    def after(self, other: Plane) -> Plane:
        """Return the map that applies `other` first."""
        a, b, c, d, e, f = other
        return Plane(
            self.a * a + self.b * c,
            self.a * b + self.b * d,
            self.c * a + self.d * c,
            self.c * b + self.d * d,
            *self.apply(e, f),
        )

    def inverse(self) -> Plane:
        """Return the map back."""
        det = self.a * self.d - self.b * self.c
        a, b, c, d = self.d / det, -self.b / det, -self.c / det, self.a / det
        return Plane(a, b, c, d, -(a * self.e + b * self.f), -(c * self.e + d * self.f))

    def box(self, width: float, height: float) -> tuple[float, float, float, float]:
        """Return left, bottom, right and top around the image of a rectangle at the origin."""
        corners = [self.apply(x, y) for x in (0.0, width) for y in (0.0, height)]
        xs, ys = zip(*corners, strict=True)
        return min(xs), min(ys), max(xs), max(ys)


#: Points of a track that are kept.
_MOST_TRACK = 4000


class Track:
    """The way that a robot has come; its older parts become coarser.

    Args:
        step: Metres between two points.
        jump: Metres in one step beyond which the robot was moved, or is another one.

    Attributes:
        points: x and y in metres, the newest last.
        length: Metres since it began.
    """

    def __init__(self, step: float, jump: float) -> None:
        self._step, self._jump = step, jump
        self.points: list[tuple[float, float]] = []
        self.length = 0.0

    def append(self, x: float, y: float) -> None:
        """Add where the robot is."""
        points = self.points
        step = math.dist(points[-1], (x, y)) if points else math.inf
        if step > self._jump:
            self.points, self.length = [(x, y)], 0.0
        elif step >= self._step:
            self.length += step
            points.append((x, y))
            if len(points) > _MOST_TRACK:
                half = len(points) // 2
                self.points = points[:half:2] + points[half:]

    def clear(self) -> None:
        """Begin a new one."""
        self.points, self.length = self.points[-1:], 0.0


def _number(name: str, low: float, high: float, *, clamps: bool) -> Any:
    """Return a property of a number between two limits; others are ignored."""
    attribute = f"_{name}"

    def write(camera: MapCamera, value: float) -> None:
        if math.isfinite(value) and (clamps or low <= value <= high):
            camera.put(**{attribute: min(max(value, low), high)})

    return Property(float, lambda camera: getattr(camera, attribute), write, notify=camera_changed)


camera_changed = Signal()


class MapCamera(QtCore.QObject):
    """Which part of a plane is shown. See the page of ``MapView``.

    `scale` is in pixels per metre; `rotation`, in radians, turns the plane counter-clockwise on the
    screen. The span, i.e. metres along the shorter side, stays between `minSpan` and `maxSpan`.
    """

    changed = camera_changed

    centerX = _number("centerX", -_MAX_METRES, _MAX_METRES, clamps=True)
    centerY = _number("centerY", -_MAX_METRES, _MAX_METRES, clamps=True)
    scale = Property(
        float, lambda self: self._scale, lambda self, value: self._set_scale(value), notify=changed
    )
    rotation = _number("rotation", -1e6, 1e6, clamps=False)
    #: Pixels of the item.
    width = _number("width", 0.0, 1e5, clamps=True)
    height = _number("height", 0.0, 1e5, clamps=True)
    minSpan = _number("minSpan", 1e-6, _MAX_METRES, clamps=False)
    maxSpan = _number("maxSpan", 1e-6, _MAX_METRES, clamps=False)
    span = Property(float, lambda self: self._shorter() / self._scale, notify=changed)

    def __init__(self, parent: QtCore.QObject | None = None) -> None:
        super().__init__(parent)
        self._centerX = self._centerY = self._rotation = 0.0
        self._width = self._height = 0.0
        self._scale, self._minSpan, self._maxSpan = 20.0, 0.1, 10_000.0

    def put(self, **values: float) -> None:
        """Set several attributes, then notify once if any of them changed."""
        before = {name: getattr(self, name) for name in values}
        if before != values:
            vars(self).update(values)
            self.changed.emit()

    def to_screen(self) -> Plane:
        """Return the map from metres to pixels, whose y points down."""
        scale = self._scale
        cos, sin = scale * math.cos(self._rotation), scale * math.sin(self._rotation)
        x, y = self._centerX, self._centerY
        return Plane(
            cos,
            -sin,
            -sin,
            -cos,
            self._width / 2 - cos * x + sin * y,
            self._height / 2 + sin * x + cos * y,
        )

    def box(self) -> tuple[float, float, float, float]:
        """Return left, bottom, right and top of what is seen, in metres."""
        return self.to_screen().inverse().box(self._width, self._height)

    def _shorter(self) -> float:
        return max(1.0, min(self._width, self._height))

    def _limited(self, scale: float) -> float:
        shorter = self._shorter()
        return min(max(scale, shorter / self._maxSpan), shorter / self._minSpan)

    def _set_scale(self, scale: float) -> None:
        if math.isfinite(scale) and scale > 0:
            self.put(_scale=self._limited(scale))

    @Slot(float, float, result=QtCore.QPointF)
    def toMap(self, x: float, y: float) -> QtCore.QPointF:
        """Return the metres at a pixel."""
        return QtCore.QPointF(*self.to_screen().inverse().apply(x, y))

    @Slot(float, float, result=QtCore.QPointF)
    def toScreen(self, x: float, y: float) -> QtCore.QPointF:
        """Return the pixel of a point in metres."""
        return QtCore.QPointF(*self.to_screen().apply(x, y))

    @Slot(float, float)
    def panBy(self, x: float, y: float) -> None:
        """Move what is shown by pixels to the right and down."""
        back = self.to_screen().inverse()
        self.lookAt(
            self._centerX - back.a * x - back.b * y, self._centerY - back.c * x - back.d * y
        )

    @Slot(float, float)
    def lookAt(self, x: float, y: float) -> None:
        """Move a point, in metres, to the middle; ignored if it is not finite."""
        if math.isfinite(x) and math.isfinite(y):
            most = _MAX_METRES
            self.put(_centerX=min(max(x, -most), most), _centerY=min(max(y, -most), most))

    @Slot(float, float, float)
    def zoomBy(self, factor: float, x: float, y: float) -> None:
        """Enlarge by a factor about a pixel, which keeps showing the same point."""
        if math.isfinite(factor) and factor > 0:
            self._about(x, y, self._limited(self._scale * factor), self._rotation)

    @Slot(float, float, float)
    def rotateBy(self, angle: float, x: float, y: float) -> None:
        """Turn counter-clockwise by radians about a pixel."""
        if math.isfinite(angle):
            turned = math.remainder(self._rotation + angle, math.tau)
            self._about(x, y, self._scale, turned)

    def _about(self, x: float, y: float, scale: float, rotation: float) -> None:
        at = self.to_screen().inverse().apply(x, y)
        before = (self._scale, self._rotation)
        self._scale, self._rotation = scale, rotation
        back = self.to_screen().inverse()
        self._scale, self._rotation = before
        dx, dy = x - self._width / 2, y - self._height / 2
        self.put(
            _scale=scale,
            _rotation=rotation,
            _centerX=at[0] - back.a * dx - back.b * dy,
            _centerY=at[1] - back.c * dx - back.d * dy,
        )

    @Slot(float, float, float, float)
    def fit(self, left: float, bottom: float, right: float, top: float) -> None:
        """Show a rectangle, in metres, as large as possible, as it is turned."""
        if not all(map(math.isfinite, (left, bottom, right, top))):
            return
        cos, sin = abs(math.cos(self._rotation)), abs(math.sin(self._rotation))
        wide, high = abs(right - left), abs(top - bottom)
        across, up = cos * wide + sin * high, sin * wide + cos * high
        ratios = [
            pixels / metres
            for pixels, metres in ((self._width, across), (self._height, up))
            if metres > 0 and pixels > 0
        ]
        scale = self._limited(0.95 * min(ratios)) if ratios else self._scale
        self.put(_scale=scale, _centerX=(left + right) / 2, _centerY=(bottom + top) / 2)
