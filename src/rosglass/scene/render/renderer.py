"""Draws a scene with QRhi: OpenGL, Vulkan, Metal or Direct3D.

One :class:`SceneRenderer` belongs to one view. In :meth:`~SceneRenderer.synchronize` the GUI thread
waits; it takes a :class:`Frame`, the list of what is to be drawn. :meth:`~SceneRenderer.render`
uploads what has changed and draws it. What is not in the list any more is freed.

An exception in :meth:`~SceneRenderer.render` must never leave an update batch or a pass open.
"""

from __future__ import annotations

import contextlib
import logging
import time
from collections import Counter
from itertools import pairwise, product
from operator import itemgetter
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from PySide6.QtGui import (
    QColor,
    QRhiCommandBuffer,
    QRhiDepthStencilClearValue,
    QRhiSampler,
    QRhiTexture,
    QRhiViewport,
)
from PySide6.QtQuick import QQuickRhiItemRenderer

from rosglass.errors import Error
from rosglass.scene.render.drawing import Labels, Lines, MapImage, Mesh, Points
from rosglass.scene.render.graphics_device import (
    FRAME_BYTES,
    GraphicsDevice,
    ShapeBuffers,
    SharedImage,
    pointer_to,
)
from rosglass.scene.render.text_images import TextImage

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence
    from typing import TypeAlias

    from numpy.typing import NDArray
    from PySide6.QtGui import QRhiResourceUpdateBatch
    from PySide6.QtQuick import QQuickRhiItem

    from rosglass.scene.render.camera import Camera
    from rosglass.scene.render.mesh_shapes import Shape
    from rosglass.scene.render.scene_tree import Drawable, Item

    _Drawn: TypeAlias = "_OnDevice | _LabelsPart"

__all__ = ["Frame", "SceneRenderer"]

_log = logging.getLogger("rosglass.scene")

#: Bytes of a drawable's block in shaders/frame.glsl.
_OBJECT_BYTES = 144
#: Metres from the origin of what is drawn at which the origin moves: 32 bits stay exact to 0.1 mm.
_ORIGIN_STEP_M = 1000.0
#: Points that software draws while the camera moves: twice as many and more are thinned out to it.
MOVING_POINTS = 50_000
#: Pixels up to which software draws a square as one vertex: larger ones are clipped at the edges.
SPRITE_PX = 16.0
_MODES = {"flat": 0.0, "bgra": 1.0, "rainbow": 2.0, "gradient": 3.0, "axis": 4.0}
_INDEX_UINT32 = QRhiCommandBuffer.IndexFormat.IndexUInt32
#: Bytes from one vertex to the next that every graphics interface takes.
_MAX_STRIDE = 2048
#: Seconds per frame for uploading new drawables; the others follow in the next frame.
_UPLOAD_S = 0.03
#: Largest width and height of an image of texts, in pixels.
_MAX_TEXTS_PX = 4096


class Frame(NamedTuple):
    """The content of one frame.

    Attributes:
        drawables: Drawable, pose in the fixed frame, opacity of its groups.
        camera: The camera.
        background: Behind everything; its alpha below 1 lets other items shine through.
        moving: Whether the camera is being moved, so that speed counts more than completeness.
    """

    drawables: Sequence[tuple[Drawable, NDArray[np.float64], float]]
    camera: Camera
    background: QColor
    moving: bool = False


_QUAD = "TriangleStrip"
_SHAPE_LAYOUT = (
    (0, 0, "Float3", 0),
    (0, 1, "Float3", 12),
    (0, 2, "Float2", 24),
    (0, 3, "UNormByte4", 32),
    *((1, 4 + column, "Float4", 16 * column) for column in range(5)),
)


class _Pass(NamedTuple):
    """One frame that is being drawn.

    Attributes:
        commands: The buffer that records drawing commands.
        viewport: The whole target.
        thin: Only every `thin`-th point is drawn.
        depth: Factors of x, y, z, 1 from the renderer's origin whose sum is the depth.
        pixels: Pixels per metre at a depth of 1.
    """

    commands: QRhiCommandBuffer
    viewport: QRhiViewport
    thin: int
    depth: NDArray[np.float64]
    pixels: float


class _OnDevice:
    """One drawable on the device: a class for each kind gives what it uploads and draws."""

    def __init__(self, device: GraphicsDevice, drawable: Any) -> None:
        self.device, self.drawable = device, drawable
        self.block = device.uniform(_OBJECT_BYTES)
        self._geometry = self._look = -1
        self._placed: Any = None
        self.seen = True
        self.bound: Any = None
        #: The parts of it that are not drawn, in words.
        self.problem = ""

    def prepare(
        self,
        batch: QRhiResourceUpdateBatch,
        place: NDArray[np.float64],
        alpha: float,
    ) -> None:
        """Upload changes."""
        drawable = self.drawable
        if self._geometry != drawable.geometry:
            self.upload(batch)
            self._geometry = drawable.geometry
        key = (alpha, drawable.look, place.tobytes())
        if key != self._placed:
            self._placed = key
            block = np.zeros(_OBJECT_BYTES // 4, np.float32)
            block[:16] = place.T.reshape(-1)
            self.fill_block(block[16:].reshape(5, 4), alpha)
            batch.updateDynamicBuffer(self.block, 0, block.nbytes, pointer_to(block))

    def upload(self, batch: QRhiResourceUpdateBatch) -> None:
        """Upload the data."""
        raise NotImplementedError

    def fill_block(self, block: NDArray[np.float32], alpha: float) -> None:
        """Fill colour, a, b, c, d of the shader's block."""
        raise NotImplementedError

    def draw(self, run: _Pass, blend: bool) -> None:
        """Draw it."""
        raise NotImplementedError

    def bind(self, *images: tuple[QRhiTexture, QRhiSampler]) -> None:
        """Bind other images to the shaders."""
        old, self.bound = self.bound, self.device.bindings(self.block, *images)
        self.device.free(old)

    def begin(self, run: _Pass, pipeline: Any) -> None:
        """Set pipeline, viewport (on Vulkan only after the pipeline) and bindings."""
        run.commands.setGraphicsPipeline(pipeline)
        run.commands.setViewport(run.viewport)
        run.commands.setShaderResources(self.bound)

    def close(self) -> None:
        """Free everything."""
        self.device.free(self.block, self.bound)


#: Fragment shaders of styles that are quads; others have one colour.
_QUADS = {"spheres": "spheres", "squares": "squares", "tiles": "squares"}


class _PointsOnDevice(_OnDevice):
    def __init__(self, device: GraphicsDevice, drawable: Points) -> None:
        super().__init__(device, drawable)
        self._buffer: Any = None
        self._place: NDArray[np.float64] = np.eye(4)
        self.bound = device.bindings(self.block)

    def prepare(
        self, batch: QRhiResourceUpdateBatch, place: NDArray[np.float64], alpha: float
    ) -> None:
        self._place = place
        super().prepare(batch, place, alpha)

    def upload(self, batch: QRhiResourceUpdateBatch) -> None:
        points = self.drawable
        self._buffer = self.device.fill(
            batch, self._buffer, points.data[: points.count * points.stride]
        )

    def fill_block(self, block: NDArray[np.float32], alpha: float) -> None:
        points = self.drawable
        paint = points.coloring
        sprites_px, has_edge = SPRITE_PX if self._has_sprites() else 0, points.style == "squares"
        block[0] = (sprites_px, has_edge, 0, points.alpha * alpha)
        flag = paint.per_point_alpha if paint.mode == "bgra" else paint.invert
        block[1] = (_MODES[paint.mode], paint.low, paint.high, flag)
        block[2] = (*paint.first, points.size)
        unit = {"points": 0, "tiles": 3}.get(points.style, 2 if points.size_by_depth else 1)
        block[3] = (*paint.last, unit)
        block[4] = paint.axis

    def _has_sprites(self) -> bool:
        """Return whether small squares are drawn as points of the graphics interface (by CPU)."""
        device = self.device
        is_square = self.drawable.style in ("squares", "flat squares")
        return is_square and device.is_software and device.has_point_size

    def _has_large(self, run: _Pass) -> bool:
        """Return whether squares may be too large for sprites, at the box's nearest corner."""
        points = self.drawable
        box = points.bounds()
        if box is None:
            return False
        corners = np.array([(x, y, z, 1.0) for x, y, z in product(*zip(*box, strict=True))])
        nearest = float((corners @ (run.depth @ self._place)).min())
        size = float(np.max(points.sizes(corners)))
        return not size * run.pixels < SPRITE_PX * nearest

    def draw(self, run: _Pass, blend: bool) -> None:
        style = self.drawable.style
        if style == "points" and self.device.has_point_size:
            self._draw_as("points", "points", run, blend)
        elif style == "boxes":
            self._draw_as("boxes", "boxes", run, blend)
        elif self._has_sprites():
            self._draw_as("sprites", "sprites", run, blend)
            if self._has_large(run):
                self._draw_as("quads", _QUADS.get(style, "points"), run, blend)
        else:
            self._draw_as("quads", _QUADS.get(style, "points"), run, blend)

    def _draw_as(self, vertex: str, fragment: str, run: _Pass, blend: bool) -> None:
        points = self.drawable
        channel = points.channel if points.channel >= 0 else points.position
        thin = max(min(run.thin, _MAX_STRIDE // points.stride), 1)
        #: Vertices of each point.
        each = {"quads": 4, "boxes": 18}.get(vertex, 1)
        layout = (
            ((points.stride * thin, each > 1),),
            (
                (0, 0, "Float3", points.position),
                (0, 1, "UNormByte4" if points.channel_is_bytes else "Float", channel),
            ),
        )
        topology = {"quads": _QUAD, "boxes": "Triangles"}.get(vertex, "Points")
        shaders = (f"{vertex}.vert", f"{fragment}.frag")
        pipeline = self.device.pipeline(
            shaders, layout, topology, blend, self.bound, vertex == "boxes"
        )
        self.begin(run, pipeline)
        run.commands.setVertexInput(0, [(self._buffer, 0)])
        count = -(-points.count // thin)
        if each > 1:
            run.commands.draw(each, count)
        else:
            run.commands.draw(count)

    def close(self) -> None:
        super().close()
        self.device.free(self._buffer)


class _LinesOnDevice(_OnDevice):
    _LAYOUT = (
        ((Lines.ROW.itemsize, True),),
        (
            (0, 0, "Float3", 0),
            (0, 1, "Float3", 12),
            (0, 2, "UNormByte4", 24),
            (0, 3, "UNormByte4", 28),
            (0, 4, "Float3", 32),
            (0, 5, "Float3", 44),
        ),
    )

    def __init__(self, device: GraphicsDevice, drawable: Lines) -> None:
        super().__init__(device, drawable)
        self._buffer: Any = None
        self.bound = device.bindings(self.block)

    def upload(self, batch: QRhiResourceUpdateBatch) -> None:
        self._buffer = self.device.fill(batch, self._buffer, self.drawable.rows)

    def fill_block(self, block: NDArray[np.float32], alpha: float) -> None:
        block[0] = (1, 1, 1, self.drawable.alpha * alpha)
        block[1] = (self.drawable.width, self.drawable.in_metres, 0, 0)

    def draw(self, run: _Pass, blend: bool) -> None:
        pipeline = self.device.pipeline(
            ("lines.vert", "flat.frag"), self._LAYOUT, _QUAD, blend, self.bound
        )
        self.begin(run, pipeline)
        run.commands.setVertexInput(0, [(self._buffer, 0)])
        run.commands.draw(4, self.drawable.count)

    def close(self) -> None:
        super().close()
        self.device.free(self._buffer)


class _MeshOnDevice(_OnDevice):
    def __init__(self, device: GraphicsDevice, drawable: Mesh) -> None:
        super().__init__(device, drawable)
        self._instances: Any = None
        self._shape: Shape | None = None
        self._image: SharedImage | None = None
        self._textures = -1

    def prepare(
        self, batch: QRhiResourceUpdateBatch, place: NDArray[np.float64], alpha: float
    ) -> None:
        mesh = self.drawable
        if self._textures != mesh.textures:
            old, self._image = self._image, self.device.share_image(batch, mesh.texture)
            image = self._image.texture if self._image else self.device.white_texture(batch)
            self.bind((image, self.device.smooth))
            self.device.leave_image(old)
            self._textures = mesh.textures
        super().prepare(batch, place, alpha)

    def upload(self, batch: QRhiResourceUpdateBatch) -> None:
        shape = self.drawable.shape
        if shape is not self._shape:
            if shape not in self.device.shapes:
                self.device.shapes[shape] = ShapeBuffers(self.device, batch, shape)
            self.device.shapes[shape].users += 1
            self._leave_shape()
            self._shape = shape
        self._instances = self.device.fill(batch, self._instances, self.drawable.instances)

    def _leave_shape(self) -> None:
        shared = self.device.shapes.get(self._shape) if self._shape is not None else None
        if shared is not None:
            shared.users -= 1
            if not shared.users:
                self.device.free(shared.vertices, shared.indices)
                assert self._shape is not None
                del self.device.shapes[self._shape]
        self._shape = None

    def fill_block(self, block: NDArray[np.float32], alpha: float) -> None:
        red, green, blue, own = self.drawable.color
        block[0] = (red, green, blue, own * alpha)
        block[1, :2] = self.drawable.lit, self.drawable.shape.closed

    def draw(self, run: _Pass, blend: bool) -> None:
        assert self._shape is not None
        shape = self.device.shapes[self._shape]
        pipeline = self.device.pipeline(
            ("mesh.vert", "mesh.frag"),
            (((36, False), (80, True)), _SHAPE_LAYOUT),
            "Triangles",
            blend,
            self.bound,
            self._shape.one_sided,
        )
        self.begin(run, pipeline)
        run.commands.setVertexInput(
            0,
            [(shape.vertices, 0), (self._instances, 0)],
            shape.indices,
            0,
            _INDEX_UINT32,
        )
        run.commands.drawIndexed(shape.count, self.drawable.count)

    def close(self) -> None:
        super().close()
        self._leave_shape()
        self.device.leave_image(self._image)
        self.device.free(self._instances)


class _MapOnDevice(_OnDevice):
    def __init__(self, device: GraphicsDevice, drawable: MapImage) -> None:
        super().__init__(device, drawable)
        self._cells: QRhiTexture | None = None
        self._palette: QRhiTexture | None = None
        self._sent: Any = None

    def upload(self, batch: QRhiResourceUpdateBatch) -> None:
        drawable, device = self.drawable, self.device
        if self._sent is None or self._sent[0] is not drawable.cells:
            self._cells = device.texture(batch, drawable.cells, self._cells)
        if self._sent is None or self._sent[1] is not drawable.palette:
            self._palette = device.texture(batch, drawable.palette[np.newaxis], self._palette)
        self._sent = drawable.cells, drawable.palette
        assert self._cells is not None
        assert self._palette is not None
        self.bind((self._cells, device.sharp), (self._palette, device.sharp))

    def fill_block(self, block: NDArray[np.float32], alpha: float) -> None:
        block[0] = (1, 1, 1, self.drawable.alpha * alpha)
        block[1, :2] = self.drawable.size

    def draw(self, run: _Pass, blend: bool) -> None:
        pipeline = self.device.pipeline(
            ("map.vert", "map.frag"), ((), ()), _QUAD, blend, self.bound
        )
        self.begin(run, pipeline)
        run.commands.draw(4)

    def close(self) -> None:
        super().close()
        self.device.free(self._cells, self._palette)


class _LabelsOnDevice(_OnDevice):
    ROW = np.dtype(
        [("position", "<f4", 3), ("size", "<f4", 2), ("place", "<f4", 4), ("rgba", "u1", 4)]
    )
    _LAYOUT = (
        ((ROW.itemsize, True),),
        (
            (0, 0, "Float3", 0),
            (0, 1, "Float2", 12),
            (0, 2, "Float4", 20),
            (0, 3, "UNormByte4", 36),
        ),
    )

    def __init__(self, device: GraphicsDevice, drawable: Labels) -> None:
        super().__init__(device, drawable)
        self._buffer: Any = None
        self._texture: QRhiTexture | None = None
        self._painted = -1
        self._image = TextImage(min(device.largest_texture, _MAX_TEXTS_PX))
        self._rows = np.zeros(0, self.ROW)
        #: Their numbers in the order in which they are drawn; None before they were uploaded.
        self._order: NDArray[np.intp] | None = None
        #: Squared metres from the eye, in this order.
        self._far = np.zeros(0)

    def prepare(
        self, batch: QRhiResourceUpdateBatch, place: NDArray[np.float64], alpha: float
    ) -> None:
        super().prepare(batch, place, alpha)
        # Their edges are soft: those that are far away are drawn first.
        away = self._rows["position"] @ place[:3, :3].T + place[:3, 3] - self.device.eye
        far = np.einsum("ij,ij->i", away, away)
        order = np.argsort(-far, kind="stable")
        if self._order is None or not np.array_equal(order, self._order):
            self._buffer = self.device.fill(batch, self._buffer, self._rows[order])
            self._order = order
        self._far = far[order]

    def upload(self, batch: QRhiResourceUpdateBatch) -> None:
        labels, device = self.drawable, self.device
        if self._painted != labels.texts_changed:
            top, bottom = self._image.set_texts(labels.texts, labels.outlined)
            if top < bottom:
                pixels = self._image.pixels
                try:
                    self._texture = device.texture(batch, pixels, self._texture, (top, bottom))
                except MemoryError:  # it is painted and tried again with the next frame
                    self._image = TextImage(self._image.limit)
                    raise
                self.bind((self._texture, device.smooth))
            self._painted = labels.texts_changed
        places, shapes = self._image.places(labels.texts)
        left_out = np.count_nonzero(shapes[:, 1] == 0)
        self.problem = f"{left_out} of {labels.count} texts have no room" if left_out else ""
        rows = np.zeros(labels.count, self.ROW)
        rows["position"] = np.nan_to_num(labels.positions, nan=0.0, posinf=0.0, neginf=0.0)
        # One that has no place is not shown.
        shown = np.isfinite(labels.positions).all(axis=1)
        rows["size"] = shapes * labels.heights[:, np.newaxis] * shown[:, np.newaxis]
        rows["place"], rows["rgba"] = places, labels.colors
        if labels.outlined:
            # Edges are texts of their own, drawn before the letters, which are as far away.
            edges = rows.copy()
            edges["place"], _ = self._image.places(labels.texts, edges=True)
            edges["rgba"][:, :3] = 0
            rows = np.concatenate([edges, rows])
        self._rows, self._order = rows, None

    def fill_block(self, block: NDArray[np.float32], alpha: float) -> None:
        block[0] = (1, 1, 1, self.drawable.alpha * alpha)
        align = self.drawable.align
        block[1, :3] = (self.drawable.in_pixels, align == "left", align == "below")

    def parts(self, others: NDArray[np.float64]) -> Iterator[tuple[float, _LabelsPart]]:
        """Iterate over the texts between other drawables, each with the distance of the first.

        Args:
            others: Squared metres from the eye.
        """
        if not len(self._far):
            return  # they were taken away after the frame was taken
        ends = [0, len(self._far)]
        if len(self._far) > 1:
            cuts = np.searchsorted(-self._far, -others)
            ends = np.unique(np.concatenate([ends, cuts])).tolist()
        for first, end in pairwise(ends):
            yield float(self._far[first]), _LabelsPart(self, first, end - first)

    def draw(self, run: _Pass, blend: bool) -> None:
        self.draw_some(run, blend, 0, len(self._rows))

    def draw_some(self, run: _Pass, blend: bool, first: int, count: int) -> None:
        """Draw those from one number to another, in their order."""
        pipeline = self.device.pipeline(
            ("labels.vert", "labels.frag"), self._LAYOUT, _QUAD, blend, self.bound
        )
        self.begin(run, pipeline)
        run.commands.setVertexInput(0, [(self._buffer, first * self.ROW.itemsize)])
        run.commands.draw(4, count)

    def close(self) -> None:
        super().close()
        self.device.free(self._buffer, self._texture)


class _LabelsPart(NamedTuple):
    """Texts that are drawn one after the other, between other translucent drawables.

    Attributes:
        labels: All texts.
        first: Number of the first one, in the order in which they are drawn.
        size: How many.
    """

    labels: _LabelsOnDevice
    first: int
    size: int

    @property
    def drawable(self) -> Labels:
        """The drawable that they are part of."""
        drawable: Labels = self.labels.drawable
        return drawable

    def draw(self, run: _Pass, blend: bool) -> None:
        """Draw them."""
        self.labels.draw_some(run, blend, self.first, self.size)


_KINDS: dict[type, type[_OnDevice]] = {
    Points: _PointsOnDevice,
    Lines: _LinesOnDevice,
    Mesh: _MeshOnDevice,
    MapImage: _MapOnDevice,
    Labels: _LabelsOnDevice,
}


@contextlib.contextmanager
def _noting(failures: list[str]) -> Iterator[None]:
    """Note why nothing can be drawn: C++ calls the renderer, and may be within a frame."""
    try:
        yield
    except Exception as error:  # of a graphics driver, or of a program's drawable
        if not isinstance(error, Error):
            _log.exception("the 3D view")
        failures.append(f"the 3D view cannot draw: {error}")


class SceneRenderer(QQuickRhiItemRenderer):
    """Draws the frames of one view.

    Args:
        take_frame: Returns what to draw; called while the GUI thread waits.
        on_problem: Called in the render thread with what could not be drawn, in words; empty again
            once all could.
    """

    def __init__(self, take_frame: Callable[[], Frame], on_problem: Callable[[str], None]) -> None:
        super().__init__()
        self._take_frame, self._on_problem = take_frame, on_problem
        self._device: GraphicsDevice | None = None
        self._frame: Frame | None = None
        self._on_device: dict[Drawable, _OnDevice] = {}
        self._origin = np.zeros(3)
        self._problem = ""
        #: Whether the frame is taken while drawing, as the GUI thread draws and took none before.
        self._takes_late = False
        #: Why there is no newer frame than the last one.
        self._failures: list[str] = []
        #: Number of drawn frames.
        self.count = 0
        #: Whether the last frame shows everything; otherwise, the next ones upload the rest.
        self.is_complete = True
        #: Seconds that drawing the last frame took.
        self._drawn_s = 0.0

    def initialize(self, commands: QRhiCommandBuffer) -> None:  # noqa: ARG002 - Qt's signature
        """Start using a graphics interface, or a target of other samples."""
        failures: list[str] = []
        with _noting(failures):
            target = self.renderTarget()
            device = self._device
            if device is not None and (device.rhi, device.samples) == (
                self.rhi(),
                target.sampleCount(),
            ):
                device.target = target
                return
            self.close()
            self._device = GraphicsDevice(self.rhi(), target.sampleCount(), target)
        if failures:
            self._report(failures[0])

    @property
    def draws_in_software(self) -> bool:
        """True if the CPU draws; False before the first frame."""
        return self._device is not None and self._device.is_software

    def draw_again(self) -> None:
        """Draw a new frame with the next one of the window; only where the GUI thread draws.

        After ``QQuickRhiItem.update()``, Qt draws the window twice: its ``updatePaintNode()`` asks
        for one more frame while the first is under way.
        """
        self._takes_late = True
        self.update()

    def synchronize(self, item: QQuickRhiItem) -> None:  # noqa: ARG002 - Qt's signature
        """Receive the next frame; the GUI thread waits."""
        self._take()

    def _take(self) -> None:
        self._takes_late, self._failures = False, []
        with _noting(self._failures):
            self._frame = self._take_frame()
        if self._failures:
            self._report(self._failures[0])

    def render(self, commands: QRhiCommandBuffer) -> None:
        """Draw the frame."""
        if self._takes_late:
            self._take()
        device, frame = self._device, self._frame
        if device is None or frame is None:
            return
        ready: list[tuple[_Drawn, bool]] = []
        problem, failures = "", list(self._failures)
        batch = device.rhi.nextResourceUpdateBatch()
        with _noting(failures):
            ready, problem = self._prepare(device, frame, batch)
        began = time.perf_counter()
        target = self.renderTarget()
        commands.beginPass(target, frame.background, QRhiDepthStencilClearValue(1.0, 0), batch)
        try:
            with _noting(failures):
                problem = self._draw(device, frame, commands, ready) or problem
        finally:
            commands.endPass()
        self._drawn_s = time.perf_counter() - began
        if not self.is_complete:
            self.update()
        self.count += 1
        self._report(failures[0] if failures else problem)

    def _draw(
        self,
        device: GraphicsDevice,
        frame: Frame,
        commands: QRhiCommandBuffer,
        ready: list[tuple[_Drawn, bool]],
    ) -> str:
        """Draw what is on the device; return the problem of a drawable, empty without one."""
        size, camera, problem = self.renderTarget().pixelSize(), frame.camera, ""
        viewport = QRhiViewport(0, 0, size.width(), size.height())
        depth = camera.projection[3] @ self._view_of(camera)
        pixels = abs(float(camera.projection[1, 1])) * size.height() / 2
        run = _Pass(commands, viewport, self._thinning(device, frame), depth, pixels)
        for one, blend in ready:
            try:
                one.draw(run, blend)
            except Exception as error:  # noqa: PERF203 - the others are drawn all the same
                _log.exception("the 3D view")
                problem = f"{type(one.drawable).__name__} cannot be drawn: {error}"
        return problem

    def _thinning(self, device: GraphicsDevice, frame: Frame) -> int:
        """Return k where only every k-th point is drawn, as the processor draws a moving view."""
        if not (frame.moving and device.is_software):
            return 1
        points = sum(one.count for one, _, _ in frame.drawables if isinstance(one, Points))
        return max(1, points // MOVING_POINTS)

    def _prepare(
        self, device: GraphicsDevice, frame: Frame, batch: QRhiResourceUpdateBatch
    ) -> tuple[list[tuple[_Drawn, bool]], str]:
        """Upload changes; return the drawables in their order, and the problems of others."""
        eye = np.array(frame.camera.eye)
        if np.abs(eye - self._origin).max() > _ORIGIN_STEP_M:
            self._origin = np.round(eye)
        origin = self._origin
        device.eye = eye - origin
        self._send_camera(device, frame, batch)
        opaque: list[tuple[int, _Drawn]] = []
        blended: list[tuple[int, float, int, _Drawn]] = []
        texts: list[tuple[int, int, _LabelsOnDevice]] = []
        problem = ""
        for one in self._on_device.values():
            one.seen = False
        self.is_complete = True
        # As long as drawing takes: otherwise many drawables would need too many frames.
        left_s = max(_UPLOAD_S, self._drawn_s)
        for number in self._in_order_of_upload(frame):
            drawable, pose, alpha = frame.drawables[number]
            on_device = self._on_device.get(drawable)
            is_new, began = on_device is None, time.perf_counter()
            if is_new and left_s <= 0:
                self.is_complete = False
                continue
            try:
                if on_device is None:
                    on_device = _KINDS[type(drawable)](device, drawable)
                    self._on_device[drawable] = on_device
                on_device.seen = True
                place = pose.copy()
                place[:3, 3] -= origin
                on_device.prepare(batch, place, alpha)
                if on_device.problem:
                    problem = f"{type(drawable).__name__} of {drawable.owner}: {on_device.problem}"
            except Exception as error:  # the others are drawn all the same
                problem = f"{type(drawable).__name__} of {drawable.owner}: {error}"
                continue
            finally:
                left_s -= time.perf_counter() - began if is_new else 0.0
            if drawable.opaque and alpha >= 0.9998:
                opaque.append((number, on_device))
            elif isinstance(on_device, _LabelsOnDevice):
                texts.append((number, drawable.layer, on_device))
            else:
                box = drawable.bounds() if isinstance(drawable, Mesh) else None
                middle = (
                    pose[:3, 3] if box is None else (pose @ np.append((box[0] + box[1]) / 2, 1))[:3]
                )
                far = float(np.sum((middle - eye) ** 2))
                blended.append((drawable.layer, -far, number, on_device))
        for drawable, one in list(self._on_device.items()):
            if not one.seen:
                one.close()
                del self._on_device[drawable]
        others = np.array([-far for _, far, _, _ in blended])
        # Texts come after what is as far away and of the same layer.
        last = len(frame.drawables)
        for _, layer, labels in sorted(texts, key=itemgetter(0)):
            for far, part in labels.parts(others):
                blended.append((layer, -far, last, part))
                last += 1
        opaque.sort(key=itemgetter(0))
        blended.sort(key=itemgetter(0, 1, 2))
        ready = [(one, False) for _, one in opaque] + [(one, True) for *_, one in blended]
        return ready, problem

    def _in_order_of_upload(self, frame: Frame) -> Sequence[int]:
        """Return the numbers of a frame's drawables: new ones last, of the displays with few first.

        A display that makes new ones for each message would not be shown while another one has
        thousands.
        """
        known: list[int] = []
        new: list[int] = []
        for number, (drawable, _, _) in enumerate(frame.drawables):
            (known if drawable in self._on_device else new).append(number)
        if not new:
            return known
        turns: Counter[Item] = Counter()
        ranked: list[tuple[int, int]] = []
        for number in (*known, *new):
            display: Item = frame.drawables[number][0]
            while (above := display.parent) is not None and above.parent is not None:
                display = above
            turns[display] += 1
            ranked.append((turns[display], number))
        return [*known, *(number for _, number in sorted(ranked[len(known) :]))]

    def _view_of(self, camera: Camera) -> NDArray[np.float64]:
        """Return the matrix from the renderer's origin to the eye."""
        view = np.array(camera.view, np.float64)
        view[:3, 3] += view[:3, :3] @ self._origin
        return view

    def _send_camera(
        self, device: GraphicsDevice, frame: Frame, batch: QRhiResourceUpdateBatch
    ) -> None:
        camera = frame.camera
        block = np.zeros(FRAME_BYTES // 4, np.float32)
        block[:16] = self._view_of(camera).T.reshape(-1)
        block[16:32] = (device.correction @ camera.projection).T.reshape(-1)
        size = self.renderTarget().pixelSize()
        flat = abs(float(camera.projection[3, 3])) > 0.5
        ratio = size.width() / camera.size[0]
        block[32:36] = (size.width(), size.height(), ratio, flat)
        batch.updateDynamicBuffer(device.frame_block, 0, block.nbytes, pointer_to(block))

    def _report(self, problem: str) -> None:
        if problem != self._problem:
            self._problem = problem
            self._on_problem(problem)

    def close(self) -> None:
        """Free everything on the device; in the render thread."""
        for one in self._on_device.values():
            one.close()
        self._on_device.clear()
        if self._device is not None:
            self._device.close()
            self._device = None
