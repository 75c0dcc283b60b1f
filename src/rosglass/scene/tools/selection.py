"""The selection of a view: parts of displays, with their descriptions, marked by boxes."""

from __future__ import annotations

import inspect
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np

from rosglass.overlay.orbit import Point
from rosglass.qml.elements.element import single_shot
from rosglass.qt import Property, QtCore, Signal, Slot, is_alive
from rosglass.scene.configs.settings import Configurable
from rosglass.scene.render.drawing import Lines, MapImage, Mesh, Points
from rosglass.scene.render.matrices import instance_matrix
from rosglass.scene.render.picking import Selected, pick, select
from rosglass.scene.render.scene_tree import Group

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from numpy.typing import NDArray

    from rosglass.scene.render.camera import Camera
    from rosglass.scene.render.scene_tree import Drawable

__all__ = ["Change", "SelectedPart", "Selection"]

#: A type of Qt by its name, which PySide's hints do not have.
LIST: Any = "QVariantList"

Change = Literal["replace", "add", "remove"]

#: Parts that are described; of more, only the number is known.
_MAX_DESCRIBED = 200
#: Parts that get a box.
_MAX_BOXES = 2000
#: Milliseconds until the boxes follow what has moved.
_FOLLOW_MS = 100
#: RViz's colour of selections.
_COLOR = (0.6, 0.8, 1.0)
#: Least size of a box, metres.
_LEAST_M = 0.02
_CORNERS = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], np.float64)
_EDGES = np.array(
    [(a, b) for a in range(8) for b in range(a + 1, 8) if bin(a ^ b).count("1") == 1], np.intp
)


_Placed = tuple["Drawable", "NDArray[np.float64]", float]


class SelectedPart(NamedTuple):
    """Something that is selected.

    Attributes:
        display: Name of the display.
        part: Which part of it, e.g. the name of a link or the number of a point.
        lines: Names and values.
    """

    display: str
    part: str
    lines: list[tuple[str, str]]


class _Marked(NamedTuple):
    """The selected part of one drawable.

    Attributes:
        indices: Indices of its points, lines, instances or cells, in order.
        geometry: Its data when it was selected: new points are others.
        whole: The owner if it is selected as a whole, e.g. a link of a robot; None otherwise.
    """

    indices: NDArray[np.intp]
    geometry: int
    whole: Any


class Selection(QtCore.QObject):
    """The selection of a view.

    Args:
        view: The view.
        overlay: The group in which the boxes are drawn.
        drawables: Returns the drawables, see
            :meth:`rosglass.scene.render.scene_tree.Group.drawables`.
        camera: Returns the view's camera.
    """

    changed = Signal()

    #: Number of selected parts.
    count = Property(int, len, notify=changed)
    #: The selected parts, at most 200: ``display``, ``part`` and ``lines`` of name and value.
    parts = Property(LIST, lambda self: self._for_qml(), notify=changed)

    def __init__(
        self,
        view: QtCore.QObject,
        overlay: Group,
        drawables: Callable[[], Iterable[_Placed]],
        camera: Callable[[], Camera],
    ) -> None:
        super().__init__(view)
        self._drawables, self._camera = drawables, camera
        self._marked: dict[Drawable, _Marked] = {}
        self._lines = Lines(1.5)
        self._root = Group(self._lines)
        overlay.add(self._root)
        self._timer = single_shot(self, self._follow)

    def __len__(self) -> int:
        marked = self._marked.values()
        wholes = {id(one.whole) for one in marked if one.whole is not None}
        return len(wholes) + sum(len(one.indices) for one in marked if one.whole is None)

    # -- changing it -----------------------------------------------------------------------------

    def select_at(self, x: float, y: float, change: Change = "replace") -> None:
        """Select the foremost part under a point of the view.

        Args:
            x: Units of the view, from its left edge.
            y: The same, from its upper edge.
            change: Whether it replaces the selection, is added or removed.
        """
        hit = pick(self._drawables(), self._camera(), x, y)
        found = [] if hit is None else [Selected(hit.drawable, np.array([hit.number]))]
        self.apply(found, change)

    def select_between(
        self, corner: tuple[float, float], opposite: tuple[float, float], change: Change = "replace"
    ) -> None:
        """Select the parts in a rectangle of the view, hidden or not.

        Args:
            corner: x and y, units of the view.
            opposite: The corner across.
            change: Whether it replaces the selection, is added or removed.
        """
        self.apply(select(self._drawables(), self._camera(), corner, opposite), change)

    def apply(self, found: Iterable[Selected], change: Change = "replace") -> None:
        """Replace the selection, add to it or remove from it."""
        if change == "replace":
            self._marked = {}
        for drawable, indices in found:
            old = self._marked.pop(drawable, None)
            # Flags: numpy's sets take a second for 200,000 points.
            is_same = old is not None and not _is_outdated(drawable, old)
            known = old.indices if old is not None and is_same else indices[:0]
            both = np.concatenate([known, indices])
            if not len(both):
                continue
            first = both.min()
            flags = np.zeros(both.max() - first + 1, np.bool_)
            flags[known - first] = True
            flags[indices - first] = change != "remove"
            new = np.flatnonzero(flags) + first
            if len(new):
                self._marked[drawable] = _Marked(new, drawable.geometry, _find_whole(drawable))
        self._draw()
        self.changed.emit()

    @Slot()
    def clear(self) -> None:
        """Select nothing."""
        self.apply([])

    # -- reading it ------------------------------------------------------------------------------

    def items(self) -> list[SelectedPart]:
        """Return the selected parts, at most 200."""
        poses = {drawable: pose for drawable, pose, _ in self._drawables()}
        found: list[SelectedPart] = []
        wholes: set[int] = set()
        for drawable, marked in self._marked.items():
            indices = marked.indices[: _MAX_DESCRIBED - len(found)]
            if marked.whole is not None:
                indices = indices[: id(marked.whole) not in wholes]
                wholes.add(id(marked.whole))
            found += [_describe(drawable, int(n), poses.get(drawable)) for n in indices]
        return found

    def _for_qml(self) -> list[dict[str, Any]]:
        return [
            {
                "display": part.display,
                "part": part.part,
                "lines": [{"name": name, "value": value} for name, value in part.lines],
            }
            for part in self.items()
        ]

    def summary(self) -> str:
        """Return in words how much is selected."""
        names = {_owner_names(drawable, 0)[0] for drawable in self._marked}
        count = len(self)
        if not count:
            return "Nothing is selected."
        return f"{count} selected: {', '.join(sorted(names))}"

    def middle(self) -> Point | None:
        """Return the middle of what is selected, in the fixed frame; None for nothing."""
        corners = self._corners()
        if not len(corners):
            return None
        at = corners.reshape(-1, 3)
        x, y, z = ((at.min(axis=0) + at.max(axis=0)) / 2).tolist()
        return Point(x, y, z)

    # -- boxes -----------------------------------------------------------------------------------

    def _corners(self) -> NDArray[np.float64]:
        """Return the corners of the boxes, (n, 8, 3), in the fixed frame."""
        found = [np.zeros((0, 8, 3))]
        left = _MAX_BOXES
        for drawable, pose, _ in self._drawables():
            marked = self._marked.get(drawable)
            if marked is not None and left > 0:
                local = _boxes(drawable, marked.indices[:left])
                left -= len(local)
                found.append(local @ pose[:3, :3].T + pose[:3, 3])
        corners = np.concatenate(found)
        return corners[np.isfinite(corners).all(axis=(1, 2))]

    def _draw(self) -> bool:
        """Draw the boxes; return whether they are others."""
        corners = self._corners()
        middle: NDArray[np.float64] = np.zeros(3)
        if len(corners):
            middle = corners.reshape(-1, 3).mean(axis=0)
        segments = (corners - middle)[:, _EDGES].reshape(-1, 2, 3)
        # Equal boxes are not drawn anew: that would be a change to follow.
        same = np.array_equal(self._root.pose[:3, 3], middle) and np.array_equal(
            segments.astype(np.float32),
            np.stack([self._lines.rows["start"], self._lines.rows["end"]], axis=1),
        )
        if not same:
            self._root.pose = instance_matrix(middle.tolist())
            self._lines.set_segments(segments, _COLOR)
        return not same

    @Slot()
    def on_scene(self) -> None:
        """Follow changes, a little later; called by the view."""
        if self._marked and not self._timer.isActive():
            self._timer.start(_FOLLOW_MS)

    @Slot()
    def _follow(self) -> None:
        """Drop parts that no longer exist, and move the boxes with the rest."""
        if not is_alive(self):
            return
        before = len(self)
        drawn = {drawable for drawable, _, _ in self._drawables()}
        for drawable, marked in list(self._marked.items()):
            kept = _existing(drawable, marked.indices)
            if drawable not in drawn or _is_outdated(drawable, marked) or not len(kept):
                del self._marked[drawable]
            else:
                self._marked[drawable] = _Marked(kept, drawable.geometry, marked.whole)
        if self._draw() or len(self) != before:
            self.changed.emit()


def _is_outdated(drawable: Drawable, marked: _Marked) -> bool:
    """Return whether other data has replaced what was selected.

    Instances and lines are the same ones after a move, e.g. the axes of frames; points are not.
    """
    return isinstance(drawable, (Points, MapImage)) and drawable.geometry != marked.geometry


def _existing(drawable: Drawable, indices: NDArray[np.intp]) -> NDArray[np.intp]:
    """Return the numbers that a drawable still has."""
    count = drawable.cells.size if isinstance(drawable, MapImage) else drawable.count
    found: NDArray[np.intp] = indices[indices < count]
    return found


def _boxes(drawable: Drawable, indices: NDArray[np.intp]) -> NDArray[np.float64]:
    """Return the corners of the boxes around parts of a drawable, (n, 8, 3), in its own frame."""
    indices = _existing(drawable, indices)
    if isinstance(drawable, Mesh):
        if drawable.shape.box is None:
            return np.zeros((0, 8, 3))
        low, high = drawable.shape.box
        matrices = drawable.instances["matrix"][indices].reshape(-1, 4, 4).transpose(0, 2, 1)
        corners = low + _CORNERS * (high - low)
        turned: NDArray[np.float64] = (
            corners @ matrices[:, :3, :3].transpose(0, 2, 1).astype(np.float64)
            + matrices[:, np.newaxis, :3, 3]
        )
        return turned
    if isinstance(drawable, Points):
        at = drawable.xyz()[indices].astype(np.float64)
        size = np.reshape(np.maximum(drawable.sizes(at), _LEAST_M), (-1, 1))
        low, high = at - size / 2, at + size / 2
    elif isinstance(drawable, Lines):
        rows = drawable.rows[indices]
        low = np.minimum(rows["start"], rows["end"]).astype(np.float64)
        high = np.maximum(rows["start"], rows["end"]).astype(np.float64)
    elif isinstance(drawable, MapImage):
        rows, columns = np.divmod(indices, drawable.cells.shape[1])
        cell = np.array(drawable.size) / drawable.cells.shape[::-1]
        flat = np.stack([columns * cell[0], rows * cell[1], np.zeros(len(indices))], axis=1)
        low, high = flat, flat + np.append(cell, 0.0)
    else:
        return np.zeros((0, 8, 3))
    boxes: NDArray[np.float64] = low[:, np.newaxis] + _CORNERS * (high - low)[:, np.newaxis]
    return boxes


# -- descriptions ----------------------------------------------------------------------------------


def _owner_names(drawable: Drawable, index: int) -> tuple[str, str]:
    """Return the name of the display, and that of the part."""
    owner = drawable.owner
    display = getattr(owner, "display", owner)
    part = "" if display is owner else str(getattr(owner, "name", ""))
    return str(getattr(display, "name", display)), part or str(index)


def _find_description(drawable: Drawable) -> tuple[Any, bool]:
    """Return the describer of a drawable's parts, or None; and whether it takes their indices."""
    owner = drawable.owner
    # The describe() of a display itself lists its settings.
    describe = None if isinstance(owner, Configurable) else getattr(owner, "describe", None)
    return describe, describe is not None and bool(inspect.signature(describe).parameters)


def _find_whole(drawable: Drawable) -> Any:
    """Return the owner of a drawable if all that it draws is one part; None otherwise."""
    describe, is_numbered = _find_description(drawable)
    return None if describe is None or is_numbered else drawable.owner


def _describe(drawable: Drawable, index: int, pose: NDArray[np.float64] | None) -> SelectedPart:
    display, part = _owner_names(drawable, index)
    lines: list[tuple[str, str]] = []
    describe, is_numbered = _find_description(drawable)
    if describe is not None:
        lines = [(str(name), str(value)) for name, value in _called(describe, index, is_numbered)]
    if pose is not None and not any(name == "Position" for name, _ in lines):
        box = _boxes(drawable, np.array([index]))
        if len(box):
            middle = pose[:3, :3] @ box[0].mean(axis=0) + pose[:3, 3]
            lines.insert(0, ("Position", "; ".join(f"{number:.6g}" for number in middle)))
    return SelectedPart(display, part, lines)


def _called(describe: Any, index: int, numbered: bool) -> list[tuple[str, str]]:
    try:
        return list(describe(index) if numbered else describe())
    except Exception as error:  # a display's mistake hides nothing else
        return [("Error", repr(error))]
