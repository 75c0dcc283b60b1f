"""What a scene draws: groups of points, lines, meshes, maps and labels, as numpy arrays.

Displays fill these; the renderer (:mod:`rosglass.scene.render.renderer`) uploads what has changed
and draws it, the picker intersects it with rays. No Qt here. Arrays are never written after they
were given: a change gives a new one, so that a renderer in another thread may still read the old
one.
"""

from __future__ import annotations

import math
from copy import copy
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from rosglass.errors import ArgumentError, Error

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence
    from typing import TypeAlias

    from numpy.typing import ArrayLike, NDArray

    #: The corners of a box with the smallest and the largest x, y and z.
    Box: TypeAlias = tuple[NDArray[np.float64], NDArray[np.float64]]

__all__ = [
    "BOX",
    "CONE",
    "CYLINDER",
    "SPHERE",
    "Coloring",
    "Drawable",
    "Group",
    "Item",
    "Labels",
    "Lines",
    "MapImage",
    "Mesh",
    "Points",
    "Shape",
    "are_drawable",
    "check_numbers",
    "instance_matrix",
    "move_items",
    "rgba_bytes",
]

#: What RViz takes for opaque: more than this is drawn without blending.
OPAQUE = 0.9998
#: Vertices, instances and points of one drawable: bytes of a GPU buffer stay below 2 GiB.
_MAX_COUNT = 20_000_000
#: Largest number of a message that is drawn: shaders square it as a float32.
_MAX_NUMBER = 1e18
#: Largest number whose fourth power is a float32.
_MAX_FOR_NORMALS = 1e9
_IDENTITY = np.eye(4)
_IDENTITY.setflags(write=False)


class Item:
    """A member of the tree that is drawn.

    Attributes:
        parent: The group that it is in; None outside of one.
    """

    def __init__(self) -> None:
        self.parent: Group | None = None
        self._visible = True
        self._pose: NDArray[np.float64] = _IDENTITY

    @property
    def visible(self) -> bool:
        """Whether it is drawn, as far as its groups are."""
        return self._visible

    @visible.setter
    def visible(self, visible: bool) -> None:
        if visible != self._visible:
            self._visible = visible
            self.touch()

    @property
    def pose(self) -> NDArray[np.float64]:
        """Its pose in its group, a matrix of 4 x 4; of the root's children in the fixed frame."""
        return self._pose

    @pose.setter
    def pose(self, pose: NDArray[np.float64]) -> None:
        is_matrix = isinstance(pose, np.ndarray) and pose.shape == (4, 4)
        if not is_matrix or not np.isfinite(pose).all():
            raise Error(f"a pose must be a finite matrix of 4 x 4, got {pose!r:.200}")
        if not np.array_equal(pose, self._pose):
            self._pose = pose
            self.touch()

    def touch(self) -> None:
        """Request a new picture from every scene that this item is in."""
        item: Item | None = self
        while item is not None:
            if item.parent is None and isinstance(item, Group) and item.on_change is not None:
                item.on_change()
            # What is hidden changes no picture; hiding itself does.
            if not item._visible and item is not self:
                return
            item = item.parent

    def remove(self) -> None:
        """Take it out of its group; safe to call twice."""
        if self.parent is not None:
            self.parent.discard(self)


def move_items(items: Sequence[Item], poses: NDArray[np.float64]) -> None:
    """Move items of one group, and request one new picture for all of them.

    Args:
        items: The items.
        poses: The pose of each in the group, (n, 4, 4); not copied.

    Raises:
        Error: A pose is not finite, or there are more or fewer poses than items.
    """
    if poses.shape != (len(items), 4, 4) or not np.isfinite(poses).all():
        raise Error(f"expected finite matrices, ({len(items)}, 4, 4), got {poses.shape}")
    shown = None
    for item, pose in zip(items, poses, strict=True):
        item._pose = pose
        shown = item if item._visible else shown
    if shown is not None:
        shown.touch()


class Group(Item):
    """Items that move, and are shown and hidden, together.

    Attributes:
        on_change: Called after each change of anything in it; set on the root only.
        alpha: Opacity from 0 to 1, multiplied with that of everything in it.
    """

    def __init__(self, *items: Item) -> None:
        super().__init__()
        self.on_change: Callable[[], None] | None = None
        self._alpha = 1.0
        self._items: dict[Item, None] = {}
        for item in items:
            self.add(item)

    def __iter__(self) -> Iterator[Item]:
        return iter(list(self._items))

    def __len__(self) -> int:
        return len(self._items)

    @property
    def alpha(self) -> float:
        """Opacity from 0 to 1, multiplied with that of everything in it."""
        return self._alpha

    @alpha.setter
    def alpha(self, alpha: float) -> None:
        alpha = _number("alpha", alpha)
        if alpha != self._alpha:
            self._alpha = alpha
            self.touch()

    def add(self, *items: Item) -> None:
        """Add items as the last ones, out of their former groups.

        Raises:
            Error: One is neither a drawable nor a group, or a group would be in itself.
        """
        for item in items:
            above: Group | None = self
            while above is not None and above is not item:
                above = above.parent
            if not isinstance(item, Item) or above is not None:
                expected = "a drawable, or a group that this one is not in"
                raise ArgumentError("item", item, expected, "Group.add()")
            item.remove()
            item.parent = self
            self._items[item] = None
        self.touch()

    def discard(self, item: Item) -> None:
        """Take an item out, if it is in."""
        if item in self._items:
            del self._items[item]
            item.parent = None
            self.touch()

    def clear(self) -> None:
        """Take everything out."""
        for item in self:
            item.parent = None
        if self._items:
            self._items.clear()
            self.touch()

    def drawables(self) -> Iterator[tuple[Drawable, NDArray[np.float64], float]]:
        """Iterate over what is drawn: drawable, pose in the root's frame, opacity of its groups."""
        if self._visible:
            yield from self._walk(self._pose, self._alpha)

    def _walk(
        self, pose: NDArray[np.float64], alpha: float
    ) -> Iterator[tuple[Drawable, NDArray[np.float64], float]]:
        for item in list(self._items):
            if not item._visible:
                continue
            own = item._pose
            placed = pose if own is _IDENTITY else own if pose is _IDENTITY else pose @ own
            if isinstance(item, Group):
                yield from item._walk(placed, alpha * item._alpha)
            elif isinstance(item, Drawable) and item.count:
                yield item, placed, alpha


class Drawable(Item):
    """Data of one kind that is drawn at once.

    Attributes:
        owner: What a pick of it finds; None where it cannot be picked.
        geometry: Counts changes of the data that the renderer uploads.
        look: Counts changes of colours, sizes and the like, which are few numbers.
        count: How many of its kind there are; nothing is drawn for 0.
        layer: Translucent drawables of a lower layer are drawn first, e.g. maps.
    """

    def __init__(self) -> None:
        super().__init__()
        self.owner: Any = None
        self.geometry = self.look = 0
        self.count = 0
        self.layer = 0
        #: The box around it, and the count of changes that it is of.
        self._box: Box | None = None
        self._boxed = -1

    def changed(self, *, geometry: bool = False) -> None:
        """Announce that its look, or all its data, has changed."""
        self.look += 1
        self.geometry += geometry
        self.touch()

    @property
    def opaque(self) -> bool:
        """Whether nothing behind it shines through."""
        return True

    def bounds(self) -> Box | None:
        """Return the corners of the box around it in its own frame; None for nothing finite."""
        if self._boxed != self.geometry:
            self._boxed, self._box = self.geometry, self._find_bounds()
        return self._box

    def _find_bounds(self) -> Box | None:
        """Compute the box, once for all pictures until the data changes."""
        raise NotImplementedError


def _box_of(points: NDArray[Any]) -> Box | None:
    finite = points[np.isfinite(points).all(axis=1)] if len(points) else points
    if not len(finite):
        return None
    return finite.min(axis=0).astype(np.float64), finite.max(axis=0).astype(np.float64)


def rgba_bytes(colors: ArrayLike, count: int) -> NDArray[np.uint8]:
    """Return colours as (count, 4) bytes, one for each or the same for all.

    Args:
        colors: RGB or RGBA, floats from 0 to 1 or bytes; shape (3), (4), (count, 3), (count, 4).
        count: How many are wanted.

    Raises:
        Error: They have another shape.
    """
    given = np.asarray(colors)
    if given.dtype != np.uint8:
        with np.errstate(invalid="ignore"):
            scaled = np.nan_to_num(_floats("colors", given), nan=0.0, posinf=1.0, neginf=0.0)
            given = (np.clip(scaled, 0, 1) * 255 + 0.5).astype(np.uint8)
    if given.ndim == 1:
        given = given[np.newaxis, :]
    if given.ndim != 2 or given.shape[1] not in (3, 4) or len(given) not in (1, count):
        raise Error(f"expected 1 or {count} colours of 3 or 4 numbers, got shape {given.shape}")
    out = np.full((count, 4), 255, np.uint8)
    out[:, : given.shape[1]] = given
    return out


def are_drawable(numbers: ArrayLike) -> NDArray[np.bool_]:
    """Return whether numbers of a message can be drawn: those that are finite and at most 1e18."""
    return np.asarray(np.abs(np.asarray(numbers)) <= _MAX_NUMBER)  # NaN is not


def check_numbers(name: str, numbers: ArrayLike) -> None:
    """Check that numbers of a message can be drawn.

    Args:
        name: Of the field; where there are several rows, the error has the number of the first bad
            one, as in ``cells[7]``.
        numbers: Shape (k) or (n, k).

    Raises:
        Error: One is not finite, or beyond 1e18.
    """
    array, good = np.asarray(numbers), are_drawable(numbers)
    if good.all():
        return
    bad = float(array[~good][0])
    where = f"{name}[{np.argwhere(~good)[0][0]}]" if array.ndim > 1 else name
    reason = f"beyond the {_MAX_NUMBER:g} that is drawn" if math.isfinite(bad) else "not finite"
    raise Error(f"{where}: {bad:g} is {reason}")


def _number(name: str, value: float) -> float:
    """Return a finite number; raises ArgumentError."""
    try:
        number = float(value)
    except (TypeError, ValueError):
        number = math.nan
    if not math.isfinite(number):
        raise ArgumentError(name, value, "a finite number")
    return number


def _floats(name: str, given: ArrayLike, shape: tuple[int, ...] | None = None) -> NDArray[Any]:
    """Return an array of float32, of one row for all if a shape is given; raises ArgumentError."""
    try:
        with np.errstate(over="ignore"):
            array = np.ascontiguousarray(given, np.float32)
        return array if shape is None else np.broadcast_to(array, shape)
    except (TypeError, ValueError):
        expected = "numbers" if shape is None else f"numbers that fit the shape {shape}"
        raise ArgumentError(name, given, expected) from None


def _checked(name: str, given: ArrayLike, shape: tuple[int, ...]) -> NDArray[np.float32]:
    """Return an array of floats of the shape (n, *shape).

    Raises:
        Error: It has another shape, or too many rows.
    """
    array = _floats(name, given)
    if array.size == 0:
        array = array.reshape(0, *shape)
    if array.shape[1:] != shape:
        raise Error(f"{name}: expected shape (n, {', '.join(map(str, shape))}), got {array.shape}")
    if len(array) > _MAX_COUNT:
        raise Error(
            f"{name}: {len(array)} are more than the {_MAX_COUNT} that can be drawn at once"
        )
    return array


@dataclass(frozen=True, slots=True)
class Coloring:
    """How points get their colors, in the shader.

    With the vertex's position and channel, the color is::

        flat      first
        bgra      channel.bgr, with channel.a if per_point_alpha
        rainbow   rainbow(invert ? part : 1.0 - part)    value = channel
        gradient  mix(first, last, part)                 value = channel
        axis      the same as rainbow                    value = dot(axis, vec4(position, 1.0))

        part = high != low ? (value - low) / (high - low) : 0.0;
        if (!(abs(part) < 1e30)) part = 0.0;  // NaN as well
        part = clamp(part, 0.0, 1.0);

    Attributes:
        mode: ``flat``, ``bgra``, ``rainbow``, ``gradient`` or ``axis``.
        low: Value at which the part is 0.
        high: Value at which the part is 1.
        invert: Whether the rainbow is red at `high`.
        first: Color of flat points, or at `low`: red, green, blue from 0 to 1.
        last: Color at `high`.
        axis: What x, y, z of a point in its own frame and 1 are multiplied with.
        per_point_alpha: Whether points are as transparent as their channel says.
    """

    mode: str = "flat"
    low: float = 0.0
    high: float = 1.0
    invert: bool = False
    first: tuple[float, float, float] = (1.0, 1.0, 1.0)
    last: tuple[float, float, float] = (1.0, 1.0, 1.0)
    axis: tuple[float, float, float, float] = (0.0, 0.0, 1.0, 0.0)
    per_point_alpha: bool = False


class Points(Drawable):
    """Points, as they lie in a message: one row of `stride` bytes for each.

    Attributes:
        data: All bytes.
        stride: Bytes from one point to the next, divisible by 4.
        position: Where x, y, z (float32) are in a row.
        channel: Where the channel is in a row; -1 for none.
        channel_is_bytes: Whether the channel is four bytes B, G, R, A; otherwise one float32.
        style: ``points`` (pixels), ``squares``, ``flat squares``, ``spheres``, ``boxes`` (metres),
            ``tiles`` (squares in the plane of their own frame, metres).
        size: Pixels of the screen for ``points``, metres for the others.
        size_by_depth: Whether metres are multiplied with z of each point, as the pixels of depth
            images are as large as they are far away.
        coloring: How they get their colours.
        alpha: Opacity, 0 to 1.
    """

    STYLES = ("points", "squares", "flat squares", "spheres", "boxes", "tiles")

    def __init__(self) -> None:
        super().__init__()
        self.data: NDArray[np.uint8] = np.zeros(0, np.uint8)
        self.stride, self.position, self.channel = 16, 0, -1
        self.channel_is_bytes = False
        self.style, self.size, self.size_by_depth = "points", 3.0, False
        self.coloring = Coloring()
        self.alpha = 1.0

    def set_data(
        self,
        data: Any,
        count: int,
        stride: int,
        *,
        position: int = 0,
        channel: int = -1,
        channel_is_bytes: bool = False,
        box: tuple[ArrayLike, ArrayLike] | None = None,
    ) -> None:
        """Take bytes, without a copy.

        Args:
            data: Anything with the buffer protocol; kept, and never to be changed again.
            count: How many points.
            stride: Bytes from one to the next.
            position: Offset of three float32.
            channel: Offset of the channel; -1 for none.
            channel_is_bytes: Whether it is B, G, R, A.
            box: Smallest and largest x, y, z, if they are known; otherwise found when needed.

        Raises:
            Error: An offset is beyond a row or not divisible by 4, or `data` is too short.
        """
        try:
            view = np.frombuffer(data, np.uint8)
        except (TypeError, ValueError):
            raise ArgumentError("data", data, "bytes, or an array of them") from None
        offsets = (stride, position, max(channel, 0))
        if min(offsets) < 0 or any(n % 4 for n in offsets) or stride < 12 or count < 0:
            raise Error(f"stride {stride}, position {position}, channel {channel}: not usable")
        if position + 12 > stride or channel + 4 > stride:
            raise Error(f"position {position} or channel {channel} is beyond a row of {stride}")
        if count > _MAX_COUNT or count * stride > len(view):
            raise Error(f"{count} points of {stride} bytes are more than {len(view)} bytes hold")
        self.data, self.count, self.stride = view, count, stride
        self.position, self.channel, self.channel_is_bytes = position, channel, channel_is_bytes
        self.changed(geometry=True)
        if box is not None:
            self._boxed = self.geometry
            self._box = (np.asarray(box[0], np.float64), np.asarray(box[1], np.float64))

    def set_points(self, points: ArrayLike, colors: ArrayLike | None = None) -> None:
        """Take positions of shape (n, 3) in metres, and RGBA for each or all."""
        xyz = _checked("points", points, (3,))
        rows = np.zeros((len(xyz), 4), np.float32)
        rows[:, :3] = xyz
        if colors is not None:
            rgba = rgba_bytes(colors, len(xyz))
            rows.view(np.uint8).reshape(-1, 16)[:, 12:] = rgba[:, (2, 1, 0, 3)]
            clear = bool((rgba[:, 3] < 255).any())
            self.coloring = replace(self.coloring, mode="bgra", per_point_alpha=clear)
        self.set_data(
            rows.reshape(-1).view(np.uint8),
            len(xyz),
            16,
            channel=12 if colors is not None else -1,
            channel_is_bytes=True,
        )

    def set_look(
        self,
        *,
        style: str | None = None,
        size: float | None = None,
        size_by_depth: bool | None = None,
        coloring: Coloring | None = None,
        alpha: float | None = None,
    ) -> None:
        """Change what is given.

        Raises:
            Error: The style is unknown.
        """
        if style is not None and style not in self.STYLES:
            raise Error(f"style {style!r} is none of {', '.join(self.STYLES)}")
        before = (self.style, self.size, self.size_by_depth, self.coloring, self.alpha)
        self.style = self.style if style is None else style
        self.size = self.size if size is None else _number("size", size)
        self.size_by_depth = self.size_by_depth if size_by_depth is None else size_by_depth
        self.coloring = self.coloring if coloring is None else coloring
        self.alpha = self.alpha if alpha is None else _number("alpha", alpha)
        if before != (self.style, self.size, self.size_by_depth, self.coloring, self.alpha):
            self.changed()

    @property
    def opaque(self) -> bool:
        """Whether nothing behind it shines through."""
        paint = self.coloring
        return self.alpha >= OPAQUE and not (paint.mode == "bgra" and paint.per_point_alpha)

    def xyz(self) -> NDArray[np.float32]:
        """Return the positions, (n, 3), in their own frame; a view of the bytes."""
        if not self.count:
            return np.zeros((0, 3), np.float32)
        strides = (self.stride, 4)
        rows: NDArray[np.float32] = np.ndarray(
            (self.count, 3), np.float32, self.data.data, self.position, strides
        )
        return rows

    def sizes(self, xyz: NDArray[Any]) -> Any:
        """Return the size of points at these positions, in metres: one for all, or for each."""
        if self.style == "points":
            return 0.0
        return self.size * np.abs(xyz[:, 2]) if self.size_by_depth else self.size

    def _find_bounds(self) -> Box | None:
        return _box_of(self.xyz())


class Lines(Drawable):
    """Straight lines between pairs of points.

    Attributes:
        rows: A row for each: start, end (float32 x 3 each), RGBA of both (uint8 x 4 each), the
            points before and after it (float32 x 3 each), which lines of metres bend to; its own
            ones if it is alone.
        width: Pixels of the screen, or metres.
        in_metres: Whether `width` is metres.
    """

    ROW = np.dtype(
        [
            *(("start", "<f4", 3), ("end", "<f4", 3)),
            *(("first", "u1", 4), ("last", "u1", 4)),
            *(("before", "<f4", 3), ("after", "<f4", 3)),
        ]
    )

    def __init__(self, width: float = 1.0, *, in_metres: bool = False) -> None:
        super().__init__()
        self.rows: NDArray[Any] = np.zeros(0, self.ROW)
        self.width, self.in_metres, self.alpha = _number("width", width), in_metres, 1.0
        self._opaque = True

    def set_segments(
        self,
        segments: ArrayLike,
        colors: ArrayLike = (1.0, 1.0, 1.0, 1.0),
        neighbours: NDArray[np.float32] | None = None,
    ) -> None:
        """Take lines.

        Args:
            segments: Shape (n, 2, 3), metres.
            colors: For all, for each, or of both ends of each: shape (n, 2, 4).
            neighbours: The points before and after each, of the same shape; None for none.
        """
        points = _checked("segments", segments, (2, 3))
        given = np.asarray(colors)
        if given.ndim == 3:
            ends = rgba_bytes(given.reshape(-1, given.shape[2]), 2 * len(points)).reshape(-1, 2, 4)
        else:
            ends = np.repeat(rgba_bytes(given, len(points))[:, np.newaxis], 2, axis=1)
        # One that is not finite would cover the view.
        good = np.isfinite(points).all(axis=(1, 2))
        rows = np.zeros(int(good.sum()), self.ROW)
        rows["start"], rows["end"] = points[good, 0], points[good, 1]
        rows["first"], rows["last"] = ends[good, 0], ends[good, 1]
        beside = points if neighbours is None else neighbours
        usable = np.isfinite(beside).all(axis=2, keepdims=True)
        beside = np.where(usable, beside, points)[good]
        rows["before"], rows["after"] = beside[:, 0], beside[:, 1]
        self._opaque = bool((ends[..., 3] == 255).all())
        self.rows, self.count = rows, len(rows)
        self.changed(geometry=True)

    def set_strip(self, points: ArrayLike, colors: ArrayLike = (1.0, 1.0, 1.0, 1.0)) -> None:
        """Take a line through points of shape (n, 3), with a colour for all or for each point."""
        line = _checked("points", points, (3,))
        given = np.asarray(colors)
        if given.ndim == 2 and len(given) == len(line):
            given = np.stack([given[:-1], given[1:]], axis=1)
        beside = np.concatenate([line[:1], line, line[-1:]])
        self.set_segments(
            np.stack([line[:-1], line[1:]], axis=1),
            given if len(line) > 1 else (1, 1, 1),
            np.stack([beside[:-3], beside[3:]], axis=1) if len(line) > 1 else None,
        )

    def set_look(self, *, width: float | None = None, alpha: float | None = None) -> None:
        """Change the width, in pixels or metres, or the opacity."""
        before = self.width, self.alpha
        self.width = self.width if width is None else _number("width", width)
        self.alpha = self.alpha if alpha is None else _number("alpha", alpha)
        if before != (self.width, self.alpha):
            self.changed()

    @property
    def opaque(self) -> bool:
        """Whether nothing behind it shines through."""
        return self._opaque and self.alpha >= OPAQUE

    def _find_bounds(self) -> Box | None:
        return _box_of(np.concatenate([self.rows["start"], self.rows["end"]]))


class Shape:
    """Vertices and triangles that meshes share, uploaded once for each.

    Args:
        positions: (n, 3), metres.
        normals: (n, 3); made from the triangles if None.
        indices: (m, 3) or (m * 3) numbers of vertices; if None, each three vertices are a triangle.
        colors: RGBA for each vertex; white if None.
        uv: (n, 2) places in the texture, from its upper left corner; 0 if None.
        one_sided: Whether triangles are seen only from the side where their corners are in
            counter-clockwise order.
        closed: Whether it is one-sided, and symmetric to x = 0: mirrored, it is still seen from
            outside.

    Raises:
        Error: The shapes of the arrays don't fit, or an index is beyond the vertices.
    """

    ROW = np.dtype(
        [("position", "<f4", 3), ("normal", "<f4", 3), ("uv", "<f4", 2), ("rgba", "u1", 4)]
    )

    def __init__(
        self,
        positions: ArrayLike,
        normals: ArrayLike | None = None,
        indices: ArrayLike | None = None,
        *,
        colors: ArrayLike | None = None,
        uv: ArrayLike | None = None,
        one_sided: bool = False,
        closed: bool = False,
    ) -> None:
        self.one_sided, self.closed = one_sided or closed, closed
        at = _checked("positions", positions, (3,))
        if indices is None:
            faces = np.arange(len(at) // 3 * 3, dtype=np.uint32).reshape(-1, 3)
        else:
            given = np.asarray(indices)
            if given.size % 3 or (given.size and (given.min() < 0 or given.max() >= len(at))):
                raise Error(f"indices: expected triangles of {len(at)} vertices")
            faces = np.ascontiguousarray(given, np.uint32).reshape(-1, 3)
        good: NDArray[np.bool_] = np.asarray(np.isfinite(at).all(axis=1))
        if not good.all():
            faces = faces[good[faces].all(axis=1)]
            at = np.where(good[:, np.newaxis], at, np.float32(0))
        rows = np.zeros(len(at), self.ROW)
        rows["position"] = at
        rows["normal"] = (
            _normals(at, faces) if normals is None else _fitting("normals", normals, at, 3)
        )
        rows["rgba"] = 255 if colors is None else rgba_bytes(colors, len(at))
        if uv is not None:
            rows["uv"] = _fitting("uv", uv, at, 2)
        #: A row for each vertex.
        self.rows: NDArray[Any] = rows
        #: Numbers of vertices, three for each triangle.
        self.faces: NDArray[np.uint32] = faces
        #: Whether no vertex is translucent.
        self.opaque = bool((rows["rgba"][:, 3] == 255).all())
        #: Corners of the box around it.
        used = np.zeros(len(at), bool)
        used[faces] = True
        self.box = _box_of(at[used])
        self._mirrored: Shape | None = None

    @property
    def size(self) -> int:
        """How many bytes it takes."""
        return self.rows.nbytes + self.faces.nbytes

    def mirrored(self) -> Shape:
        """Return the same shape with its triangles turned, to be seen from the other side."""
        if self._mirrored is None:
            other = copy(self)
            other.faces = np.ascontiguousarray(self.faces[:, ::-1])
            self._mirrored = other
        return self._mirrored


def _fitting(name: str, given: ArrayLike, at: NDArray[Any], width: int) -> NDArray[np.float32]:
    array = _checked(name, given, (width,))
    if len(array) != len(at):
        raise Error(f"{name}: expected {len(at)}, one for each vertex, got {len(array)}")
    return np.nan_to_num(array, nan=0.0, posinf=0.0, neginf=0.0)


def _normals(at: NDArray[np.float32], faces: NDArray[np.uint32]) -> NDArray[np.float32]:
    """Return the normals of vertices: the mean of their triangles', by area."""
    most = np.abs(at).max(initial=0.0)
    if most > _MAX_FOR_NORMALS:
        at = at / most
    a, b, c = at[faces[:, 0]], at[faces[:, 1]], at[faces[:, 2]]
    flat = np.cross(b - a, c - a)
    out = np.zeros_like(at)
    for corner in range(3):
        np.add.at(out, faces[:, corner], flat)
    length = np.linalg.norm(out, axis=1, keepdims=True)
    unit: NDArray[np.float32] = np.divide(out, length, out=np.zeros_like(out), where=length > 0)
    return unit


def instance_matrix(
    position: Sequence[float] = (0.0, 0.0, 0.0),
    rotation: Sequence[float] = (0.0, 0.0, 0.0, 1.0),
    scale: Sequence[float] | float = 1.0,
) -> NDArray[np.float64]:
    """Return the matrix of a place, a quaternion (x, y, z, w) and a scale.

    A quaternion of length 0 is no rotation, others are normalised, as RViz does it.
    """
    x, y, z, w = (float(number) for number in rotation)
    most = max(abs(x), abs(y), abs(z), abs(w))
    if 0 < most < math.inf:
        # Squares of very small numbers are 0, or so coarse that their sum is.
        x, y, z, w = x / most, y / most, z / most, w / most
    n = x * x + y * y + z * z + w * w
    m = np.eye(4)
    if n > 0 and math.isfinite(n):
        s = 2.0 / n
        m[0, 0], m[0, 1], m[0, 2] = (
            1 - s * (y * y + z * z),
            s * (x * y - z * w),
            s * (x * z + y * w),
        )
        m[1, 0], m[1, 1], m[1, 2] = (
            s * (x * y + z * w),
            1 - s * (x * x + z * z),
            s * (y * z - x * w),
        )
        m[2, 0], m[2, 1], m[2, 2] = (
            s * (x * z - y * w),
            s * (y * z + x * w),
            1 - s * (x * x + y * y),
        )
    m[:3, :3] *= np.broadcast_to(np.asarray(scale, np.float64), 3)
    m[:3, 3] = position
    return m


class Mesh(Drawable):
    """A shape, drawn once or many times.

    Attributes:
        shape: What is drawn.
        instances: A row for each time: matrix (float32, 16, column by column), RGBA (float32, 4).
        lit: Whether the headlight shades it.
        texture: Pixels (h, w, 4) of uint8, or None.
        color: RGBA, multiplied with that of vertices, instances and texture.
    """

    ROW = np.dtype([("matrix", "<f4", 16), ("rgba", "<f4", 4)])

    def __init__(
        self, shape: Shape, color: Sequence[float] = (1.0, 1.0, 1.0, 1.0), *, lit: bool = True
    ) -> None:
        if not isinstance(shape, Shape):
            raise ArgumentError(
                "shape", shape, "a Shape, such as rosglass.scene.render.drawing.BOX"
            )
        super().__init__()
        self.shape, self.lit = shape, lit
        self.color = tuple(color)
        self.texture: NDArray[np.uint8] | None = None
        self.texture_opaque = True
        #: Counts textures, which are uploaded apart.
        self.textures = 0
        self.instances: NDArray[Any] = np.zeros(0, self.ROW)
        self._opaque = True
        self.set_instances(np.eye(4)[np.newaxis])

    def set_instances(self, matrices: ArrayLike, colors: ArrayLike = (1.0, 1.0, 1.0, 1.0)) -> None:
        """Draw it once for each matrix.

        Args:
            matrices: Shape (n, 4, 4); those that are not finite are left out.
            colors: RGBA from 0 to 1, for each or all.
        """
        given = _checked("matrices", matrices, (4, 4))
        rgba = _floats("colors", colors, (len(given), 4))
        good = np.isfinite(given).all(axis=(1, 2))
        rows = np.zeros(int(good.sum()), self.ROW)
        rows["matrix"] = given[good].transpose(0, 2, 1).reshape(-1, 16)
        rows["rgba"] = np.clip(np.nan_to_num(rgba[good]), 0, 1)
        self._opaque = bool((rows["rgba"][:, 3] >= OPAQUE).all())
        self.instances = rows
        self.count = len(rows) if len(self.shape.faces) else 0
        self.changed(geometry=True)

    def set_texture(self, pixels: NDArray[np.uint8] | None) -> None:
        """Put an image of shape (h, w, 4) on it; None for none.

        Raises:
            Error: It has another shape, or more than 16384 rows or columns.
        """
        shape = () if pixels is None else np.shape(pixels)
        if pixels is not None and (len(shape) != 3 or shape[2] != 4 or not 0 < max(shape) <= 16384):
            raise Error(f"texture: expected up to 16384 x 16384 x 4 bytes, got {shape}")
        self.texture = None if pixels is None else np.ascontiguousarray(pixels, np.uint8)
        self.texture_opaque = pixels is None or bool((pixels[..., 3] == 255).all())
        self.textures += 1
        self.changed()

    def set_look(self, *, color: Sequence[float] | None = None, lit: bool | None = None) -> None:
        """Change the colour, RGBA from 0 to 1, or whether it is lit."""
        before = self.color, self.lit
        self.color = self.color if color is None else tuple(color)
        self.lit = self.lit if lit is None else lit
        if before != (self.color, self.lit):
            self.changed()

    @property
    def opaque(self) -> bool:
        """Whether nothing behind it shines through."""
        return (
            self._opaque and self.shape.opaque and self.texture_opaque and self.color[3] >= OPAQUE
        )

    def _find_bounds(self) -> Box | None:
        if self.shape.box is None or not self.count:
            return None
        low, high = self.shape.box
        corners = np.array(
            [
                [x, y, z, 1.0]
                for x in (low[0], high[0])
                for y in (low[1], high[1])
                for z in (low[2], high[2])
            ]
        )
        matrices = self.instances["matrix"].reshape(-1, 4, 4).transpose(0, 2, 1)
        return _box_of((matrices @ corners.T).transpose(0, 2, 1)[..., :3].reshape(-1, 3))


class MapImage(Drawable):
    """A rectangle of cells in the plane z = 0, each an index into a palette.

    Attributes:
        cells: (rows, columns) of uint8; row 0 is at y = 0, column 0 at x = 0.
        palette: (256, 4) RGBA bytes.
        size: Metres in x and y.
        alpha: Opacity, 0 to 1.
    """

    def __init__(self) -> None:
        super().__init__()
        self.cells: NDArray[np.uint8] = np.zeros((0, 0), np.uint8)
        self.palette: NDArray[np.uint8] = np.zeros((256, 4), np.uint8)
        self.size = (0.0, 0.0)
        self.alpha = 1.0
        self.layer = -1

    def set_cells(self, cells: NDArray[np.uint8], resolution: float) -> None:
        """Take cells of a size in metres.

        Raises:
            Error: They are not bytes in two dimensions of up to 16384, or the size is not positive.
        """
        cells = np.asarray(cells)
        if cells.ndim != 2 or cells.dtype != np.uint8 or max(cells.shape, default=0) > 16384:
            raise Error(f"expected up to 16384 x 16384 cells, got {cells.shape} of {cells.dtype}")
        if not _number("resolution", resolution) > 0:
            raise Error(f"resolution: expected a positive number of metres, got {resolution}")
        self.cells = np.ascontiguousarray(cells)
        self.size = (cells.shape[1] * resolution, cells.shape[0] * resolution)
        self.count = int(cells.size > 0)
        self.changed(geometry=True)

    def set_palette(self, palette: NDArray[np.uint8]) -> None:
        """Take the colours, (256, 4) RGBA bytes."""
        palette = np.asarray(palette)
        if palette.shape != (256, 4) or palette.dtype != np.uint8:
            raise Error(f"palette: expected 256 x 4 bytes, got {palette.shape} of {palette.dtype}")
        self.palette = np.ascontiguousarray(palette)
        self.changed(geometry=True)

    def set_look(self, *, alpha: float | None = None, below: bool | None = None) -> None:
        """Change the opacity, or whether it is drawn below all else that is translucent."""
        before = self.alpha, self.layer
        self.alpha = self.alpha if alpha is None else _number("alpha", alpha)
        self.layer = self.layer if below is None else -2 if below else -1
        if before != (self.alpha, self.layer):
            self.changed()

    @property
    def opaque(self) -> bool:
        """Whether nothing behind it shines through."""
        return self.alpha >= OPAQUE and bool((self.palette[:, 3] == 255).all())

    def _find_bounds(self) -> Box | None:
        return (np.zeros(3), np.array([*self.size, 0.0])) if self.count else None


class Labels(Drawable):
    """Texts that face the viewer.

    Attributes:
        texts: One for each; several lines are allowed.
        extents: (n, 2), letters of the longest line of each, and how many lines it has.
        positions: (n, 3), metres; where the middle of each is, or of its left or upper edge.
        heights: Of a line, in metres, or in pixels of the screen.
        colors: (n, 4) RGBA bytes.
        in_pixels: Whether `heights` are pixels.
        align: ``centre``, ``left`` or ``below``.
        outlined: Whether letters have dark edges, to be read on anything.
    """

    MAX_LENGTH = 1000
    MAX_COUNT = 2000

    def __init__(
        self, *, in_pixels: bool = False, align: str = "centre", outlined: bool = False
    ) -> None:
        super().__init__()
        self.texts: tuple[str, ...] = ()
        self.extents = np.zeros((0, 2))
        self.positions: NDArray[np.float32] = np.zeros((0, 3), np.float32)
        self.heights: NDArray[np.float32] = np.zeros(0, np.float32)
        self.colors: NDArray[np.uint8] = np.zeros((0, 4), np.uint8)
        self.in_pixels, self.align, self.alpha = in_pixels, align, 1.0
        self.outlined = outlined
        #: Counts changes of the texts, which are painted anew.
        self.texts_changed = 0

    def set_texts(
        self,
        texts: Sequence[str],
        positions: ArrayLike,
        heights: ArrayLike = 0.1,
        colors: ArrayLike = (1.0, 1.0, 1.0, 1.0),
    ) -> None:
        """Take texts, positions (n, 3), heights and colours for each or all.

        Raises:
            Error: There are not as many positions, or more than 2000.
        """
        at = _checked("positions", positions, (3,))
        if len(at) != len(texts) or len(texts) > self.MAX_COUNT:
            raise Error(
                f"expected up to {self.MAX_COUNT} texts with a position each, got "
                f"{len(texts)} and {len(at)}"
            )
        wrong = next((text for text in texts if not isinstance(text, str)), "")
        if wrong != "":
            raise ArgumentError("texts", wrong, "a text")
        cut = tuple(text[: self.MAX_LENGTH] for text in texts)
        if cut != self.texts:
            self.texts = cut
            lines = [text.split("\n") for text in cut]
            extents = [(max(map(len, one)), len(one)) for one in lines]
            self.extents = np.array(extents, np.float64).reshape(-1, 2)
            self.texts_changed += 1
        self.positions = at
        self.heights = _floats("heights", heights, (len(at),)).copy()
        self.colors = rgba_bytes(colors, len(at))
        self.count = len(at)
        self.changed(geometry=True)

    @property
    def opaque(self) -> bool:
        """Whether nothing behind it shines through: never, for the edges of letters are soft."""
        return False

    def _find_bounds(self) -> Box | None:
        return _box_of(self.positions)


# -- shapes ----------------------------------------------------------------------------------------


def _box_shape() -> Shape:
    corners, normals, uv = [], [], []
    for axis in range(3):
        for side in (-1.0, 1.0):
            u, v = (axis + 1) % 3, (axis + 2) % 3
            normal = [side * (n == axis) for n in range(3)]
            # Each side has the whole picture, as in RViz.
            up = np.array([0.0, 0.0, 1.0] if axis < 2 else [0.0, 1.0, 0.0])
            right = np.cross(up, normal)
            quad = [(-side, -1), (side, -1), (side, 1), (-side, 1)]
            for a, b in quad:
                at = [0.0, 0.0, 0.0]
                at[axis], at[u], at[v] = side * 0.5, a * 0.5, b * 0.5
                corners.append(at)
                normals.append(normal)
                uv.append([0.5 + right @ at, 0.5 - up @ at])
    first = 4 * np.arange(6)[:, np.newaxis]
    faces = np.concatenate([first + np.array([0, 1, 2]), first + np.array([0, 2, 3])])
    return Shape(corners, normals, faces, uv=uv, closed=True)


def _turned(
    profile: list[tuple[float, float, float, float]],
    around: int = 32,
    uv: Callable[[NDArray[Any], float], NDArray[Any]] | None = None,
) -> Shape:
    """Return a shape turned around z.

    Args:
        profile: (radius, z, normal outward, normal along z) of each ring.
        around: Sides of a ring.
        uv: Places in a texture, (n, 2), of n shares of a turn and a z.
    """
    turns = np.linspace(0, 1, around + 1)
    angles = 2 * np.pi * turns
    c, s = np.cos(angles), np.sin(angles)
    at = [np.stack([r * c, r * s, np.full_like(c, z)], axis=1) for r, z, _, _ in profile]
    normal = [np.stack([n * c, n * s, np.full_like(c, m)], axis=1) for _, _, n, m in profile]
    faces = []
    for ring in range(len(profile) - 1):
        if profile[ring][:2] == profile[ring + 1][:2]:
            continue  # a sharp edge: the same ring twice, with two normals
        a = ring * (around + 1) + np.arange(around)
        b = a + around + 1
        faces += [np.stack([a, a + 1, b + 1], axis=1), np.stack([a, b + 1, b], axis=1)]
    places = None if uv is None else np.concatenate([uv(turns, z) for _, z, _, _ in profile])
    corners, normals = np.concatenate(at), np.concatenate(normal)
    return Shape(corners, normals, np.concatenate(faces), uv=places, closed=True)


def _sphere_shape(rings: int = 16) -> Shape:
    tilt = np.linspace(-np.pi / 2, np.pi / 2, rings + 1)
    return _turned(
        [(0.5 * math.cos(t), 0.5 * math.sin(t), math.cos(t), math.sin(t)) for t in tilt],
        2 * rings,
        # A picture of the earth, as in RViz.
        lambda turns, z: _places(turns + 0.5, math.acos(min(max(2 * z, -1.0), 1.0)) / math.pi),
    )


def _places(across: NDArray[Any], down: float) -> NDArray[Any]:
    return np.stack([across, np.full_like(across, down)], axis=1)


#: One metre in every direction, around the origin.
BOX = _box_shape()
#: Of one metre in diameter, around the origin.
SPHERE = _sphere_shape()
#: Of one metre in diameter and height, around the origin, along z.
CYLINDER = _turned(
    [
        (0, -0.5, 0, -1),
        (0.5, -0.5, 0, -1),
        (0.5, -0.5, 1, 0),
        (0.5, 0.5, 1, 0),
        (0.5, 0.5, 0, 1),
        (0, 0.5, 0, 1),
    ],
    uv=lambda turns, z: _places(0.75 - turns, z + 0.5),
)
_SLOPE = math.hypot(1, 0.5)
#: Of one metre in diameter and height, from z = 0 to its tip at z = 1.
CONE = _turned(
    [
        (0, 0, 0, -1),
        (0.5, 0, 0, -1),
        (0.5, 0, 1 / _SLOPE, 0.5 / _SLOPE),
        (0, 1, 1 / _SLOPE, 0.5 / _SLOPE),
    ]
)
