"""Shows an overlay's frame over RViz's 3D view, by panels of an Ogre overlay."""

from __future__ import annotations

import itertools
import time
from functools import cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from rosglass.errors import Error
from rosglass.rviz.host import ogre, ogre_overlay
from rosglass.rviz.overlay import guarded
from rosglass.rviz.tiles import TILE, Rect, changed_tiles, cover, trimmed, uncovered, update_covered

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    from rosglass.overlay.overlay import Overlay

__all__ = ["HIGHEST_Z", "Drawing", "Layer", "Work"]


#: Ogre's highest z order; overlays of higher order are drawn later.
HIGHEST_Z = 650
_numbers = itertools.count()
#: Ogre's names of RViz's two windows, one of which is hidden.
_RENDER_WINDOWS = ("OgreWindow(0)", "OgreWindow(1)")
_GROUP = "General"
#: Cost of drawing another panel, in pixels that could be blended in that time.
_PANEL_COST_PIXELS = 2000
#: Number of empty tiles that panels may additionally cover before they are rearranged.
_MAX_EXTRA_TILES = 128
#: Draws the texture only; OpenGL's fixed pipeline would add the specular colour that Ogre enables.
_SHADER = """#version 120
uniform sampler2D frame;
void main() { gl_FragColor = texture2D(frame, gl_TexCoord[0].st); }
"""


class Layer:
    """A texture of the size of the 3D view, drawn by panels where it is not empty.

    For the GUI thread only, between two frames of RViz. Ogre owns its resources;
    :meth:`close` releases them.
    """

    def __init__(self, name: str) -> None:
        self._name = f"rosglass/{next(_numbers)}/{name}"
        self._manager = ogre_overlay().OverlayManager.getSingleton()
        self._overlay = self._manager.create(self._name)
        self._texture: Any = None
        self._material: Any = None
        self._pass: Any = None
        self._texture_unit: Any = None
        self._panels: list[Any] = []
        self._previous: NDArray[np.uint32] | None = None
        self._covered = np.zeros((0, 0), np.bool_)
        #: Each panel's rectangle, and its visible part without empty edges.
        self._rects: list[Rect] = []
        self._shown: list[Rect | None] = []
        self._extra_tiles = 0
        self._opacity = 1.0
        self._visible = True
        #: Seconds that :meth:`update` last spent on comparing and on uploading.
        self.compared = self.uploaded = 0.0
        self._closed = False

    def set_z(self, z: int) -> None:
        """Set the z order, from 0 to :data:`HIGHEST_Z`; higher layers are drawn later."""
        if not self._closed:
            self._overlay.setZOrder(z)

    def set_visible(self, visible: bool) -> None:
        """Show or hide the layer."""
        if visible != self._visible and not self._closed:
            self._visible = visible
            self._apply_visibility()

    def set_opacity(self, opacity: float) -> None:
        """Set the opacity, from 0 to 1."""
        if opacity != self._opacity:
            self._opacity = opacity
            self._apply_opacity()

    @property
    def rectangles(self) -> int:
        """Number of visible panels."""
        return len(self._rects)

    @property
    def covered(self) -> float:
        """Share of the view that the panels cover, and RViz has to blend."""
        whole = 1 if self._previous is None else self._previous.size
        return sum(rect.area for rect in self._shown if rect) / max(whole, 1)

    def update(
        self, pixels: NDArray[np.uint32], within: Iterable[tuple[int, int, int, int]] | None = None
    ) -> list[Rect]:
        """Show a frame.

        Args:
            pixels: Array of the view's shape (height, width), each pixel 0xAARRGGBB with
                premultiplied colours.
            within: Rectangles that may have changed; None for the whole frame.

        Returns:
            The rectangles that have changed and were uploaded to the graphics card.
        """
        if self._closed:
            return []
        height, width = pixels.shape
        _use_own_context()
        started = time.perf_counter()
        if self._previous is None or self._previous.shape != pixels.shape:
            self._make_texture(width, height)
            self._previous = np.empty_like(pixels, order="C")
            self._covered = np.zeros((-(-height // TILE), -(-width // TILE)), np.bool_)
            rects = [Rect(0, 0, width, height)]
        else:
            rects = cover(changed_tiles(pixels, self._previous, within), width, height, most=12)
        compared = time.perf_counter()
        for rect in rects:
            self._upload(pixels, rect)
        uploaded = time.perf_counter()
        if rects:
            update_covered(self._covered, self._previous, rects)
            self._arrange_panels(rects, width, height)
        self.compared = compared - started + time.perf_counter() - uploaded
        self.uploaded = uploaded - compared
        return rects

    def close(self) -> None:
        """Remove the panels and the texture; safe to call twice."""
        if self._closed:
            return
        self._closed = True
        _use_own_context()
        self._overlay.hide()
        self._drop_panels()
        self._manager.destroy(self._name)
        self._drop_texture()

    def _make_texture(self, width: int, height: int) -> None:
        o = ogre()
        self._drop_panels()
        self._drop_texture()
        name = f"{self._name}/{width}x{height}"
        # Without depth 1, the bindings call another overload, which creates a texture of depth 0.
        self._texture = o.TextureManager.getSingleton().createManual(
            name, _GROUP, o.TEX_TYPE_2D, width, height, 1, 0, o.PF_A8R8G8B8, o.TU_DYNAMIC_WRITE_ONLY
        )
        self._material = o.MaterialManager.getSingleton().create(name, _GROUP)
        render = self._material.getTechnique(0).getPass(0)
        render.setLightingEnabled(False)
        render.setDepthCheckEnabled(False)
        render.setDepthWriteEnabled(False)
        # Qt's colours are premultiplied with alpha.
        render.setSceneBlending(o.SBF_ONE, o.SBF_ONE_MINUS_SOURCE_ALPHA)
        self._pass = render
        self._texture_unit = render.createTextureUnitState(name)
        self._texture_unit.setTextureFiltering(o.TFO_NONE)
        self._texture_unit.setTextureAddressingMode(o.TextureUnitState.TAM_CLAMP)
        self._apply_opacity()

    def _apply_opacity(self) -> None:
        if self._texture_unit is None:
            return
        o, part = ogre(), self._opacity
        # With software OpenGL, multiplying by one would cost a third more.
        how = o.LBX_SOURCE1 if part == 1 else o.LBX_MODULATE
        # Premultiplied colours have to fade like their alpha.
        one, faint = o.ColourValue(1, 1, 1, 1), o.ColourValue(part, part, part, part)
        self._texture_unit.setColourOperationEx(how, o.LBS_TEXTURE, o.LBS_MANUAL, one, faint)
        self._texture_unit.setAlphaOperation(how, o.LBS_TEXTURE, o.LBS_MANUAL, 1.0, part)
        self._pass.setFragmentProgram(fragment_program() if part == 1 else "")

    def _upload(self, pixels: NDArray[np.uint32], rect: Rect) -> None:
        o = ogre()
        assert self._previous is not None
        # Ogre's bindings require writable memory.
        part = pixels[rect.top : rect.bottom, rect.left : rect.right]
        part = np.require(part, requirements=["C", "W"])
        self._previous[rect.top : rect.bottom, rect.left : rect.right] = part
        height, width = part.shape
        source = o.PixelBox(width, height, 1, o.PF_A8R8G8B8, part.view(np.uint8).reshape(-1))
        self._texture.getBuffer().blitFromMemory(
            source, o.Box(rect.left, rect.top, rect.right, rect.bottom)
        )

    def _arrange_panels(self, changed: list[Rect], width: int, height: int) -> None:
        """Rearrange the panels if they no longer fit the non-empty tiles, and trim changed ones."""
        waste = uncovered(self._covered, self._rects)
        if waste is None or waste - self._extra_tiles > _MAX_EXTRA_TILES:
            changed = self._rects = cover(self._covered, width, height, worth=_PANEL_COST_PIXELS)
            self._extra_tiles = uncovered(self._covered, self._rects) or 0
            self._make_panels()
        for number, rect in enumerate(self._rects):
            if any(rect.overlaps(other) for other in changed):
                self._trim_panel(number, width, height)

    def _make_panels(self) -> None:
        """Show one panel per rectangle; create missing ones and hide the others."""
        o = ogre_overlay()
        self._shown = [None] * len(self._rects)
        while len(self._panels) < len(self._rects):
            name = f"{self._name}/panel{len(self._panels)}"
            panel = self._manager.createOverlayElement("Panel", name).castPanelOverlayElement()
            panel.setMetricsMode(o.GMM_RELATIVE)
            panel.setMaterialName(self._material.getName(), _GROUP)
            self._overlay.add2D(panel)
            self._panels.append(panel)
        for number, panel in enumerate(self._panels):
            if number < len(self._rects):
                panel.show()
            else:
                panel.hide()
        self._apply_visibility()

    def _trim_panel(self, number: int, width: int, height: int) -> None:
        """Trim a panel to the non-empty part of its rectangle."""
        assert self._previous is not None
        rect, panel = trimmed(self._previous, self._rects[number]), self._panels[number]
        if rect == self._shown[number]:
            return
        self._shown[number] = rect
        left, right = rect.left / width, rect.right / width
        top, bottom = rect.top / height, rect.bottom / height
        panel.setPosition(left, top)
        panel.setDimensions(right - left, bottom - top)
        panel.setUV(left, top, right, bottom)

    def _apply_visibility(self) -> None:
        if self._visible and self._rects:
            self._overlay.show()
        else:
            self._overlay.hide()

    def _drop_panels(self) -> None:
        for panel in self._panels:
            self._overlay.remove2D(panel)
            self._manager.destroyOverlayElement(panel)
        self._panels.clear()
        self._rects, self._shown = [], []
        self._extra_tiles = 0

    def _drop_texture(self) -> None:
        if self._texture is not None:
            o = ogre()
            o.MaterialManager.getSingleton().remove(self._material.getName(), _GROUP)
            o.TextureManager.getSingleton().remove(self._texture.getName(), _GROUP)
            self._texture = self._material = self._pass = self._texture_unit = None


@cache
def fragment_program() -> str:
    """Return the name of the layers' fragment program; empty if shaders are not supported."""
    o = ogre()
    name = "rosglass/picture"
    program = o.HighLevelGpuProgramManager.getSingleton().createProgram(
        name, _GROUP, "glsl", o.GPT_FRAGMENT_PROGRAM
    )
    program.setSource(_SHADER)
    program.load()
    return name if program.isSupported() else ""


def _use_own_context() -> None:
    """Make Ogre's OpenGL context current: a closed Qt window leaves another one, or none."""
    root = ogre().Root.getSingleton()
    system = root.getRenderSystem()
    # Ogre switches contexts only when the window changes, so switch to each in turn.
    for name in _RENDER_WINDOWS:
        system._setRenderTarget(root.getRenderTarget(name))


class Work(NamedTuple):
    """Time spent on overlays before a frame of RViz, in milliseconds."""

    #: Drawing.
    render: float = 0.0
    #: Reading pixels back from OpenGL.
    read_back: float = 0.0
    #: Comparing with the previous frame, and arranging panels.
    compare: float = 0.0
    #: Uploading changes to the graphics card.
    upload: float = 0.0

    @property
    def total(self) -> float:
        """The sum."""
        return sum(self)


class Drawing:
    """Draws an overlay into its layer."""

    def __init__(self, overlay: Overlay) -> None:
        self.overlay = overlay
        #: The layer that shows the overlay.
        self.layer = Layer(overlay.name)
        #: Whether the overlay has to be drawn again.
        self.dirty = True
        self._size = (0, 0, 0.0)
        self._size_applied = False
        self._failed = False

    def mark_dirty(self) -> None:
        """Mark the overlay to be drawn before the next frame in which it is visible."""
        self.dirty = True

    @property
    def shown(self) -> bool:
        """True while the overlay is visible."""
        return self.overlay.visible and self.overlay.opacity > 0

    def before_frame(self, width: int, height: int, ratio: float) -> Work | None:
        """Draw the overlay if it is visible and has changed.

        Args:
            width: Width of the 3D view in pixels.
            height: Its height in pixels.
            ratio: The screen's pixel ratio.

        Returns:
            The time it took; None if there was nothing to draw.
        """
        overlay, layer = self.overlay, self.layer
        if not self.shown:
            layer.set_visible(False)
            return None
        size = (width, height, ratio * overlay.scale)
        work = self._draw(size) if self.dirty or size != self._size else None
        layer.set_opacity(overlay.opacity)
        # Do not show outdated content after a failure.
        layer.set_visible(not self._failed)
        return work

    def _draw(self, size: tuple[int, int, float]) -> Work:
        overlay, layer = self.overlay, self.layer
        resized = size != self._size or not self._size_applied
        self._size, self._size_applied, self.dirty = size, False, False
        started = time.perf_counter()
        done, drawn = False, 0.0
        pixels: NDArray[np.uint32] | None = None
        overlay.read_back, overlay.painted = 0.0, None
        with guarded(overlay, "drawing"):
            if resized:
                overlay.resize(*size)
            self._size_applied = True
            pixels = overlay.draw()
            _check(pixels, size)
            drawn = time.perf_counter() - started
            if pixels is not None:
                # After a failure, the texture may differ anywhere.
                layer.update(pixels, None if self._failed else overlay.painted)
            done = True
        if done and self._failed:
            overlay.show_problem("")
        self._failed = not done
        if pixels is None or not done:
            return Work(1e3 * (time.perf_counter() - started))
        render = drawn - overlay.read_back
        parts = (render, overlay.read_back, layer.compared, layer.uploaded)
        return Work(*(1e3 * part for part in parts))

    def close(self) -> None:
        """Remove the layer; the caller closes the overlay."""
        self.layer.close()


def _check(pixels: object, size: tuple[int, int, float]) -> None:
    if pixels is None:
        return
    wanted = (size[1], size[0])
    if not (
        isinstance(pixels, np.ndarray) and pixels.dtype == np.uint32 and pixels.shape == wanted
    ):
        kind = f"{pixels.dtype}{pixels.shape}" if isinstance(pixels, np.ndarray) else type(pixels)
        raise Error(f"draw() must return an array of uint32 of shape {wanted}, but returned {kind}")
