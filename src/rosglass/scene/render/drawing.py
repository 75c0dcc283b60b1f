"""The drawables of a scene: points, lines, meshes, maps and labels, as numpy arrays.

Displays fill these; the renderer (:mod:`rosglass.scene.render.renderer`) uploads and draws
changes, the picker intersects it with rays. No Qt here. Arrays are never written after they
were given: a change gives a new one, so that a renderer in another thread may still read the old
one.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from rosglass.errors import ArgumentError, Error
from rosglass.scene.render.arrays import (
    MAX_COUNT,
    box_of,
    finite_number,
    floats_of,
    rgba_bytes,
    rows_of,
)
from rosglass.scene.render.mesh_shapes import Shape
from rosglass.scene.render.scene_tree import Drawable

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike, NDArray

    from rosglass.scene.render.arrays import Box

__all__ = ["OPAQUE", "Coloring", "Labels", "Lines", "MapImage", "Mesh", "Points"]

#: Opacity from which RViz draws without blending.
OPAQUE = 0.9998


@dataclass(frozen=True, slots=True)
class Coloring:
    """The colouring of points in the shader.

    With the vertex's position and channel, the colour is::

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
        first: Colour of flat points, or at `low`: red, green, blue from 0 to 1.
        last: Colour at `high`.
        axis: Factors of x, y, z of a point in its own frame, and of 1.
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
        position: Offset of x, y, z (float32) in a row.
        channel: Offset of the channel in a row; -1 without one.
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
        """Set the vertices from bytes, without a copy.

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
        if count > MAX_COUNT or count * stride > len(view):
            raise Error(f"{count} points of {stride} bytes are more than {len(view)} bytes hold")
        self.data, self.count, self.stride = view, count, stride
        self.position, self.channel, self.channel_is_bytes = position, channel, channel_is_bytes
        self.changed(geometry=True)
        if box is not None:
            self._boxed = self.geometry
            self._box = (np.asarray(box[0], np.float64), np.asarray(box[1], np.float64))

    def set_points(self, points: ArrayLike, colors: ArrayLike | None = None) -> None:
        """Set positions of shape (n, 3) in metres, and RGBA for each or all."""
        xyz = rows_of("points", points, (3,))
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
        """Change the given properties.

        Raises:
            Error: The style is unknown.
        """
        if style is not None and style not in self.STYLES:
            raise Error(f"style {style!r} is not one of {', '.join(self.STYLES)}")
        before = (self.style, self.size, self.size_by_depth, self.coloring, self.alpha)
        self.style = self.style if style is None else style
        self.size = self.size if size is None else finite_number("size", size)
        self.size_by_depth = self.size_by_depth if size_by_depth is None else size_by_depth
        self.coloring = self.coloring if coloring is None else coloring
        self.alpha = self.alpha if alpha is None else finite_number("alpha", alpha)
        if before != (self.style, self.size, self.size_by_depth, self.coloring, self.alpha):
            self.changed()

    @property
    def opaque(self) -> bool:
        """True if nothing behind it shines through."""
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
        return box_of(self.xyz())


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
        self.width, self.in_metres, self.alpha = finite_number("width", width), in_metres, 1.0
        self._opaque = True

    def set_segments(
        self,
        segments: ArrayLike,
        colors: ArrayLike = (1.0, 1.0, 1.0, 1.0),
        neighbours: NDArray[np.float32] | None = None,
    ) -> None:
        """Set the lines.

        Args:
            segments: Shape (n, 2, 3), metres.
            colors: For all, for each, or of both ends of each: shape (n, 2, 4).
            neighbours: The points before and after each, of the same shape; None for none.
        """
        points = rows_of("segments", segments, (2, 3))
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
        """Set one line through points of shape (n, 3), with a colour for all or for each point."""
        line = rows_of("points", points, (3,))
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
        self.width = self.width if width is None else finite_number("width", width)
        self.alpha = self.alpha if alpha is None else finite_number("alpha", alpha)
        if before != (self.width, self.alpha):
            self.changed()

    @property
    def opaque(self) -> bool:
        """True if nothing behind it shines through."""
        return self._opaque and self.alpha >= OPAQUE

    def _find_bounds(self) -> Box | None:
        return box_of(np.concatenate([self.rows["start"], self.rows["end"]]))


class Mesh(Drawable):
    """A shape, drawn once or many times.

    Attributes:
        shape: The shape.
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
            raise ArgumentError("shape", shape, "a Shape, such as rosglass.scene.drawing.BOX")
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
        given = rows_of("matrices", matrices, (4, 4))
        rgba = floats_of("colors", colors, (len(given), 4))
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
        """True if nothing behind it shines through."""
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
        return box_of((matrices @ corners.T).transpose(0, 2, 1)[..., :3].reshape(-1, 3))


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
        """Set cells of a size in metres.

        Raises:
            Error: They are not bytes in two dimensions of up to 16384, or the size is not positive.
        """
        cells = np.asarray(cells)
        if cells.ndim != 2 or cells.dtype != np.uint8 or max(cells.shape, default=0) > 16384:
            raise Error(f"expected up to 16384 x 16384 cells, got {cells.shape} of {cells.dtype}")
        if not finite_number("resolution", resolution) > 0:
            raise Error(f"resolution: expected a positive number of metres, got {resolution}")
        self.cells = np.ascontiguousarray(cells)
        self.size = (cells.shape[1] * resolution, cells.shape[0] * resolution)
        self.count = int(cells.size > 0)
        self.changed(geometry=True)

    def set_palette(self, palette: NDArray[np.uint8]) -> None:
        """Set the colours, (256, 4) RGBA bytes."""
        palette = np.asarray(palette)
        if palette.shape != (256, 4) or palette.dtype != np.uint8:
            raise Error(f"palette: expected 256 x 4 bytes, got {palette.shape} of {palette.dtype}")
        self.palette = np.ascontiguousarray(palette)
        self.changed(geometry=True)

    def set_look(self, *, alpha: float | None = None, below: bool | None = None) -> None:
        """Change the opacity, or whether it is drawn below all else that is translucent."""
        before = self.alpha, self.layer
        self.alpha = self.alpha if alpha is None else finite_number("alpha", alpha)
        self.layer = self.layer if below is None else -2 if below else -1
        if before != (self.alpha, self.layer):
            self.changed()

    @property
    def opaque(self) -> bool:
        """True if nothing behind it shines through."""
        return self.alpha >= OPAQUE and bool((self.palette[:, 3] == 255).all())

    def _find_bounds(self) -> Box | None:
        return (np.zeros(3), np.array([*self.size, 0.0])) if self.count else None


class Labels(Drawable):
    """Texts that face the viewer.

    Attributes:
        texts: One for each; several lines are allowed.
        extents: (n, 2), letters of the longest line of each, and how many lines it has.
        positions: (n, 3), metres; where the middle of each is, or of its left or upper edge.
        heights: Height of a line, in metres, or in pixels of the screen.
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
        """Set texts, positions (n, 3), heights and colours for each or all.

        Raises:
            Error: There are not as many positions, or more than 2000.
        """
        at = rows_of("positions", positions, (3,))
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
        self.heights = floats_of("heights", heights, (len(at),)).copy()
        self.colors = rgba_bytes(colors, len(at))
        self.count = len(at)
        self.changed(geometry=True)

    @property
    def opaque(self) -> bool:
        """True if nothing behind it shines through: never, as the edges of letters are soft."""
        return False

    def _find_bounds(self) -> Box | None:
        return box_of(self.positions)
