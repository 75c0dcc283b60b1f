"""The overlays of an RViz, drawn in their stacking order."""

from __future__ import annotations

import ctypes
import gc
from functools import cache
from typing import TYPE_CHECKING, Any

from rosglass.errors import Error
from rosglass.overlay.overlay import Overlay
from rosglass.qt import QtCore, Signal, Slot, is_alive, send_deferred_deletes
from rosglass.rviz.input import Input
from rosglass.rviz.layer import HIGHEST_Z, Drawing, Work
from rosglass.rviz.overlay import guarded

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from rosglass.rviz.window import Window

__all__ = ["MemoryCleaner", "Stack"]


#: Milliseconds after which an added overlay has been drawn, and a removed one deleted.
_CLEAN_DELAY_MS = 3000


class MemoryCleaner(QtCore.QObject):
    """Returns memory to the system some seconds after overlays were added or removed."""

    def __init__(self) -> None:
        super().__init__()
        self._collect_garbage = False
        self._timer = QtCore.QTimer(self)
        self._timer.setSingleShot(True)
        self._timer.setInterval(_CLEAN_DELAY_MS)
        self._timer.timeout.connect(self._clean)

    def overlay_added(self) -> None:
        """Schedule returning the memory that was needed only to create an overlay."""
        if not self._timer.isActive():
            self._timer.start()

    def overlay_removed(self) -> None:
        """Schedule a garbage collection: the parts of an overlay refer to each other.

        Python's own collector would run only hundreds of overlays later, with memory fragmented.
        """
        self._collect_garbage = True
        self.overlay_added()

    @Slot()
    def _clean(self) -> None:
        collect, self._collect_garbage = self._collect_garbage, False
        if collect:
            gc.collect()
        trim = _malloc_trim()
        if trim is not None:
            trim(0)


@cache
def _malloc_trim() -> Callable[[int], Any] | None:
    """Return glibc's function that returns freed memory to the system; None without glibc."""
    found: Callable[[int], Any] | None = getattr(ctypes.CDLL(None), "malloc_trim", None)
    return found


class Stack(QtCore.QObject):
    """Holds the overlays of an RViz, and draws them right before each of its frames."""

    #: Overlays were added, removed or reordered.
    changed = Signal()
    #: Overlays were drawn before a frame. Argument: the times that it took, a `layer.Work`.
    drawn = Signal(object)

    def __init__(self, window: Window) -> None:
        super().__init__()
        self._window = window
        #: In the order in which they were added, raised or lowered, which decides for equal `z`.
        self._entries: list[Drawing] = []
        #: In stacking order, lowest first.
        self._arranged: list[Drawing] = []
        self._drawing = False
        self._deferred: list[Callable[[], None]] = []
        self._cleaner = MemoryCleaner()
        window.before_frame.connect(self._before_frame)
        #: Routes mouse, touch and keyboard events.
        self.input = Input(window, self.topmost_first, self.raise_popup)
        self.changed.connect(self.input.on_stack_changed)

    def add(self, overlay: Overlay) -> None:
        """Show an overlay above those of lower or equal `z`.

        Raises:
            Error: The name is taken, or `overlay` is not an overlay.
        """
        if not (isinstance(overlay, Overlay) and hasattr(overlay, "name")):
            raise Error(_not_an_overlay(overlay))
        if self.find(overlay.name) is not None:
            raise Error(f"there is an overlay {overlay.name!r} already; give this one another name")
        overlay.attach(self._window)
        entry = Drawing(overlay)
        self._entries.append(entry)
        overlay.changed.connect(entry.mark_dirty)
        overlay.arranged.connect(self._arrange)
        overlay.renewed.connect(self.input.forget)
        self._arrange()
        self._cleaner.overlay_added()

    def remove(self, overlay: Overlay) -> None:
        """Remove and close an overlay; do nothing if it is not in the stack."""
        for entry in self._entries:
            if entry.overlay is overlay:
                self._entries.remove(entry)
                self._arranged.remove(entry)
                overlay.changed.disconnect(entry.mark_dirty)
                overlay.arranged.disconnect(self._arrange)
                overlay.renewed.disconnect(self.input.forget)
                entry.close()
                self.input.forget(overlay)
                if self._drawing:
                    self._deferred.append(lambda: _close(overlay))
                else:
                    # The overlay may be handling the event that removes it.
                    self.input.after_event(lambda: _close(overlay))
                self._cleaner.overlay_removed()
                self.changed.emit()
                return

    def find(self, name: str) -> Overlay | None:
        """Return the overlay with the given name; None if there is none."""
        return next((o for o in self if o.name == name), None)

    def free_name(self, wanted: str, overlay: Overlay | None = None) -> str:
        """Return a name that no other overlay has: `wanted`, numbered if it is taken."""
        name, number = wanted, 2
        while self.find(name) not in (None, overlay):
            name, number = f"{wanted} {number}", number + 1
        return name

    def __iter__(self) -> Iterator[Overlay]:
        """Iterate over the overlays, lowest first."""
        return iter([entry.overlay for entry in self._arranged])

    def topmost_first(self) -> list[Overlay]:
        """Return the visible overlays, topmost first: the order in which they get input."""
        return [o for o in reversed(list(self)) if o.visible and o.opacity > 0]

    def raise_popup(self, overlay: Overlay) -> None:
        """Raise a pressed popup above all others; does nothing for other overlays."""
        if overlay.is_popup:
            self.to_front(overlay)

    def to_front(self, overlay: Overlay) -> None:
        """Put an overlay above all other popups, or above all that are not popups."""
        self._move_to_end(overlay, -1, max)

    def to_back(self, overlay: Overlay) -> None:
        """Put an overlay below all other popups, or below all that are not popups."""
        self._move_to_end(overlay, 0, min)

    def reorder(self, overlays: Sequence[Overlay]) -> None:
        """Stack overlays of equal `z` in the given order, lowest first.

        Args:
            overlays: Some of the overlays; the others keep their positions.
        """
        number = {id(overlay): at for at, overlay in enumerate(overlays)}
        positions = [at for at, e in enumerate(self._entries) if id(e.overlay) in number]
        moved = sorted((self._entries[at] for at in positions), key=lambda e: number[id(e.overlay)])
        for at, entry in zip(positions, moved, strict=True):
            self._entries[at] = entry
        self._arrange()

    def _move_to_end(self, overlay: Overlay, end: int, outermost: Callable[..., int]) -> None:
        alike = [e for e in self._arranged if e.overlay.is_popup == overlay.is_popup]
        entry = next((e for e in alike if e.overlay is overlay), None)
        if entry is None:
            return
        # Its position among overlays of equal `z`.
        self._entries.remove(entry)
        self._entries.insert(0 if end == 0 else len(self._entries), entry)
        if alike[end] is not entry:
            # Setting `z` reorders the stack.
            overlay.z = outermost(e.overlay.z for e in alike)

    @property
    def covered(self) -> float:
        """Share of the 3D view that RViz blends overlays over; above 1 if overlays overlap."""
        return sum(entry.layer.covered for entry in self._entries if entry.shown)

    def close(self) -> None:
        """Remove every overlay."""
        for overlay in list(self):
            self.remove(overlay)
        if QtCore.QThread.currentThread().loopLevel() == 0:
            # No QML is running, so delete it now; at Python's exit, its objects would disappear.
            send_deferred_deletes()

    def _arrange(self) -> None:
        self._arranged = sorted(self._entries, key=lambda e: (e.overlay.is_popup, e.overlay.z))
        for number, entry in enumerate(self._arranged):
            entry.layer.set_z(max(HIGHEST_Z - len(self._arranged) + number, 0))
        self.changed.emit()

    def _before_frame(self) -> None:
        panel = self._window.panel
        if not is_alive(panel) or not panel.isVisible() or panel.window().isMinimized():
            return
        width, height, ratio = self._window.view_size()
        # RViz's timer fires in the nested event loop of QML that waits for a reply.
        if not width or not height or self._drawing:
            return
        # Drawing may add and remove overlays, including the one being drawn.
        self._drawing = True
        try:
            works = [entry.before_frame(width, height, ratio) for entry in list(self._arranged)]
        finally:
            self._drawing = False
        later, self._deferred = self._deferred, []
        for close in later:
            close()
        done = [work for work in works if work is not None]
        if done:
            self.drawn.emit(Work(*map(sum, zip(*done, strict=True))))


def _close(overlay: Overlay) -> None:
    with guarded(overlay, "closing"):
        overlay.close()


def _not_an_overlay(given: object) -> str:
    """Return the error text for a value that is not an overlay."""
    if isinstance(given, Overlay):
        kind = type(given).__name__
        return f"overlay {kind}: its __init__ must call super().__init__(), which gives it a name"
    if isinstance(given, type) and issubclass(given, Overlay):
        return f"expected an overlay, got the class; create an instance: {given.__name__}()"
    return (
        f"expected an overlay, got {given!r}; use WidgetOverlay(widget) for a widget, or "
        "app.add_qml(file) for a QML file"
    )
