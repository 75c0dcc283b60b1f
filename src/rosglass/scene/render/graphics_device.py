"""The graphics interface that a window draws with, and what drawables share on it.

What PySide needs: data goes over as ``VoidPtr``; resources of QRhi are freed with ``deleteLater()``
only.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from PySide6.QtCore import QByteArray, QPoint, QSize
from PySide6.QtGui import (
    QRhi,
    QRhiBuffer,
    QRhiGraphicsPipeline,
    QRhiSampler,
    QRhiShaderResourceBinding,
    QRhiShaderStage,
    QRhiTexture,
    QRhiTextureSubresourceUploadDescription,
    QRhiTextureUploadDescription,
    QRhiTextureUploadEntry,
    QRhiVertexInputAttribute,
    QRhiVertexInputBinding,
    QRhiVertexInputLayout,
    QShader,
)
from shiboken6 import Shiboken

from rosglass.errors import UnsupportedError

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from PySide6.QtGui import QRhiResourceUpdateBatch

    from rosglass.scene.render.mesh_shapes import Shape

__all__ = [
    "FRAME_BYTES",
    "GraphicsDevice",
    "ShapeBuffers",
    "SharedImage",
    "pointer_to",
    "reduce_image",
]

#: Bytes of the block in shaders/frame.glsl that all drawables of a frame share.
FRAME_BYTES = 144
_SHADERS = Path(__file__).with_name("shaders")
_STAGES = (
    QRhiShaderResourceBinding.StageFlag.VertexStage
    | QRhiShaderResourceBinding.StageFlag.FragmentStage
)
_FRAGMENT = QRhiShaderResourceBinding.StageFlag.FragmentStage
_PerInstance = QRhiVertexInputBinding.Classification.PerInstance
#: In the names of drivers that draw with the processor.
_SOFTWARE = ("llvmpipe", "lavapipe", "softpipe", "swiftshader", "basic render")
_OLD_OPENGL = (
    "it needs OpenGL 3.3 or OpenGL ES 3.0, and Qt has an older one of {}. Update the graphics "
    "driver, let Mesa's llvmpipe draw (LIBGL_ALWAYS_SOFTWARE=1), or use a screen, as Xvfb is one, "
    "instead of QT_QPA_PLATFORM=offscreen."
)
#: Pipelines that are kept, each for a kind of drawable and a layout of its data.
_MOST_PIPELINES = 64


@cache
def _shader(name: str) -> QShader:
    return QShader.fromSerialized(QByteArray((_SHADERS / f"{name}.qsb").read_bytes()))


def pointer_to(array: NDArray[Any]) -> Any:
    """Return the data of an array as a ``VoidPtr``, valid for as long as the array."""
    pointer: Any = Shiboken.VoidPtr
    # Not array.ctypes, which runs an import statement each time.
    return pointer(array.__array_interface__["data"][0], array.nbytes)


class GraphicsDevice:
    """The graphics interface of a window, with what all drawables share on it.

    Args:
        rhi: Qt's.
        samples: Samples for each pixel of the target.
        target: The render target.
    """

    def __init__(self, rhi: QRhi, samples: int, target: Any) -> None:
        self.rhi, self.samples, self.target = rhi, samples, target
        driver = rhi.driverInfo()  # its name lives no longer than it
        name = bytes(driver.deviceName.data()).decode(errors="replace")
        if not rhi.isFeatureSupported(QRhi.Feature.Instancing):
            raise UnsupportedError(_OLD_OPENGL.format(name))
        #: Whether the processor draws.
        self.is_software = any(word in name.lower() for word in _SOFTWARE)
        self.has_point_size = rhi.isFeatureSupported(QRhi.Feature.VertexShaderPointSize)
        self.largest_texture = rhi.resourceLimit(QRhi.ResourceLimit.TextureSizeMax)
        self.correction = np.array(rhi.clipSpaceCorrMatrix().copyDataTo(), np.float64).reshape(4, 4)
        self._resources: set[Any] = set()
        self._pipelines: dict[Any, QRhiGraphicsPipeline] = {}
        self.frame_block = self.uniform(FRAME_BYTES)
        self.smooth = self._sampler(QRhiSampler.Filter.Linear, QRhiSampler.AddressMode.Repeat)
        self.sharp = self._sampler(QRhiSampler.Filter.Nearest, QRhiSampler.AddressMode.ClampToEdge)
        self.white: QRhiTexture | None = None
        #: The camera's position, from the renderer's origin.
        self.eye = np.zeros(3)
        self.shapes: dict[Shape, ShapeBuffers] = {}
        #: The images of meshes by the id of their pixels.
        self.images: dict[int, SharedImage] = {}

    def keep(self, resource: Any) -> Any:
        """Create a resource, and free it with the device at the latest.

        Raises:
            MemoryError: The graphics interface refuses it.
        """
        self._resources.add(resource)
        if not resource.create():
            self.free(resource)
            raise MemoryError(f"the graphics interface refused a {type(resource).__name__}")
        return resource

    def free(self, *resources: Any) -> None:
        """Free resources; None is allowed."""
        for resource in resources:
            if resource is not None and resource in self._resources:
                self._resources.discard(resource)
                resource.deleteLater()

    def close(self) -> None:
        """Free everything."""
        for resource in list(self._resources):
            self.free(resource)
        self._pipelines.clear()
        self.shapes.clear()
        self.images.clear()

    def _sampler(self, kind: Any, mode: Any) -> Any:
        return self.keep(self.rhi.newSampler(kind, kind, QRhiSampler.Filter.None_, mode, mode))

    def uniform(self, size: int) -> QRhiBuffer:
        """Return a small block for shaders."""
        made: QRhiBuffer = self.keep(
            self.rhi.newBuffer(QRhiBuffer.Type.Dynamic, QRhiBuffer.UsageFlag.UniformBuffer, size)
        )
        return made

    def fill(
        self,
        batch: QRhiResourceUpdateBatch,
        buffer: QRhiBuffer | None,
        array: NDArray[Any],
        usage: Any = QRhiBuffer.UsageFlag.VertexBuffer,
    ) -> QRhiBuffer:
        """Upload an array, into the same buffer if it is large enough and not much too large."""
        size = max(array.nbytes, 16)
        if buffer is None or not size <= buffer.size() <= 4 * size:
            # The old one is freed last: the graphics interface may refuse a new one.
            old, buffer = buffer, self.keep(self.rhi.newBuffer(QRhiBuffer.Type.Static, usage, size))
            self.free(old)
        assert buffer is not None
        if array.nbytes:
            batch.uploadStaticBuffer(buffer, 0, array.nbytes, pointer_to(array))
        return buffer

    def texture(
        self,
        batch: QRhiResourceUpdateBatch,
        pixels: NDArray[np.uint8],
        old: QRhiTexture | None,
        rows: tuple[int, int] | None = None,
    ) -> QRhiTexture:
        """Upload an image of (h, w) or (h, w, 4) bytes; one that is too large is reduced.

        Args:
            batch: The batch that uploads it.
            pixels: The image.
            old: Its texture, which another one replaces if it has another size; None for none.
            rows: The first row that has changed, and the one after the last; None for all.
        """
        pixels = reduce_image(pixels, self.largest_texture)
        height, width = pixels.shape[:2]
        kind = QRhiTexture.Format.R8 if pixels.ndim == 2 else QRhiTexture.Format.RGBA8
        size = QSize(width, height)
        if old is None or old.pixelSize() != size or old.format() != kind:
            made = self.keep(self.rhi.newTexture(kind, size))
            self.free(old)
            old, rows = made, None
        assert old is not None
        top, bottom = rows or (0, height)
        part = QRhiTextureSubresourceUploadDescription(QByteArray(pixels[top:bottom].tobytes()))
        part.setDataStride(pixels.strides[0])
        part.setDestinationTopLeft(QPoint(0, top))
        part.setSourceSize(QSize(width, bottom - top))
        entry = QRhiTextureUploadEntry(0, 0, part)
        batch.uploadTexture(old, QRhiTextureUploadDescription(entry))
        return old

    def share_image(
        self, batch: QRhiResourceUpdateBatch, pixels: NDArray[np.uint8] | None
    ) -> SharedImage | None:
        """Return the texture of an image, uploaded once for all meshes that have it."""
        if pixels is None:
            return None
        found = self.images.get(id(pixels))
        if found is None:
            found = self.images[id(pixels)] = SharedImage(pixels, self.texture(batch, pixels, None))
        found.users += 1
        return found

    def leave_image(self, image: SharedImage | None) -> None:
        """Free an image that no other mesh has; None is allowed."""
        if image is not None:
            image.users -= 1
            if not image.users:
                self.free(image.texture)
                self.images.pop(id(image.pixels), None)

    def white_texture(self, batch: QRhiResourceUpdateBatch) -> QRhiTexture:
        """Return the texture that stands for a missing image."""
        if self.white is None:
            self.white = self.texture(batch, np.full((1, 1, 4), 255, np.uint8), None)
        return self.white

    def bindings(self, block: QRhiBuffer, *images: tuple[QRhiTexture, QRhiSampler]) -> Any:
        """Return the resources of a drawable's shaders: the frame's block, its own, its images."""
        binding = QRhiShaderResourceBinding
        made = self.rhi.newShaderResourceBindings()
        made.setBindings(
            [
                binding.uniformBuffer(0, _STAGES, self.frame_block),
                binding.uniformBuffer(1, _STAGES, block),
                *(
                    binding.sampledTexture(2 + at, _FRAGMENT, texture, sampler)
                    for at, (texture, sampler) in enumerate(images)
                ),
            ]
        )
        return self.keep(made)

    def pipeline(
        self,
        shaders: tuple[str, str],
        layout: tuple[tuple[tuple[int, bool], ...], tuple[tuple[int, int, str, int], ...]],
        topology: str,
        blend: bool,
        bindings: Any,
        cull: bool = False,
    ) -> QRhiGraphicsPipeline:
        """Return a pipeline, made when it is first needed.

        Args:
            shaders: Names of the vertex and the fragment shader.
            layout: Stride and "per instance" of each buffer; buffer, location, format and offset of
                each attribute. Formats are named, for Python hashes strings much faster than enums.
            topology: Name of what the vertices are.
            blend: Whether it is translucent; it does not hide what is behind it then.
            bindings: Bindings of any drawable of this kind.
            cull: Whether triangles are drawn from their outer side only.
        """
        key = (shaders, layout, topology, blend, cull)
        if key in self._pipelines:
            return self._pipelines[key]
        if len(self._pipelines) >= _MOST_PIPELINES:
            # The layouts of clouds are their publishers' choice. Freed later, after this frame.
            self.free(self._pipelines.pop(next(iter(self._pipelines))))
        made = self.rhi.newGraphicsPipeline()
        kinds = (QRhiShaderStage.Type.Vertex, QRhiShaderStage.Type.Fragment)
        made.setShaderStages(
            [
                QRhiShaderStage(kind, _shader(name))
                for kind, name in zip(kinds, shaders, strict=True)
            ]
        )
        buffers, attributes = layout
        inputs = QRhiVertexInputLayout()
        inputs.setBindings(
            [
                QRhiVertexInputBinding(stride, _PerInstance)
                if each
                else QRhiVertexInputBinding(stride)
                for stride, each in buffers
            ]
        )
        formats = QRhiVertexInputAttribute.Format
        inputs.setAttributes(
            [
                QRhiVertexInputAttribute(buffer, location, formats[name], offset)
                for buffer, location, name, offset in attributes
            ]
        )
        made.setVertexInputLayout(inputs)
        made.setTopology(QRhiGraphicsPipeline.Topology[topology])
        if cull:
            made.setCullMode(QRhiGraphicsPipeline.CullMode.Back)
        made.setDepthTest(True)
        made.setDepthWrite(not blend)
        made.setDepthOp(QRhiGraphicsPipeline.CompareOp.LessOrEqual)
        # Premultiplied: what Qt Quick expects of an item, opaque or not.
        mix: Any = QRhiGraphicsPipeline.TargetBlend()
        mix.enable = blend
        mix.srcColor = mix.srcAlpha = QRhiGraphicsPipeline.BlendFactor.One
        mix.dstColor = mix.dstAlpha = QRhiGraphicsPipeline.BlendFactor.OneMinusSrcAlpha
        made.setTargetBlends([mix])
        made.setSampleCount(self.samples)
        made.setShaderResourceBindings(bindings)
        made.setRenderPassDescriptor(self.target.renderPassDescriptor())
        self._pipelines[key] = self.keep(made)
        return made


def reduce_image(pixels: NDArray[np.uint8], limit: int) -> NDArray[np.uint8]:
    """Return an image with at most `limit` pixels in each direction.

    Of the cells of a map that become one, the most occupied one is kept: walls stay.
    """
    step = -(-max(pixels.shape[:2]) // limit)
    if step <= 1:
        return pixels
    if pixels.ndim > 2:
        return np.ascontiguousarray(pixels[::step, ::step])
    # As signed numbers, an unknown cell (-1) is below a free one (0).
    cells = pixels.view(np.int8)
    for axis in (0, 1):
        cells = np.maximum.reduceat(cells, range(0, cells.shape[axis], step), axis=axis)
    return np.ascontiguousarray(cells).view(np.uint8)


class ShapeBuffers:
    """Vertices and triangles of a shape on the device, shared by all meshes that draw it."""

    def __init__(
        self, device: GraphicsDevice, batch: QRhiResourceUpdateBatch, shape: Shape
    ) -> None:
        self.vertices = device.fill(batch, None, shape.rows)
        try:
            self.indices = device.fill(batch, None, shape.faces, QRhiBuffer.UsageFlag.IndexBuffer)
        except MemoryError:
            device.free(self.vertices)  # it is tried again with the next frame
            raise
        self.count = shape.faces.size
        self.users = 0


class SharedImage:
    """The image of a mesh on the device, shared by all meshes that have the same pixels."""

    def __init__(self, pixels: NDArray[np.uint8], texture: QRhiTexture) -> None:
        self.pixels, self.texture = pixels, texture
        self.users = 0
