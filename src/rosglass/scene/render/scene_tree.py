"""The tree of what is drawn: groups that move, and are shown and hidden, together."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from rosglass.errors import ArgumentError, Error
from rosglass.scene.render.arrays import finite_number

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from numpy.typing import NDArray

    from rosglass.scene.render.arrays import Box

__all__ = ["Drawable", "Group", "Item", "move_items"]

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
        """True if it is drawn whenever its groups are."""
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
        """Request a new frame from every scene that this item is in."""
        item: Item | None = self
        while item is not None:
            if item.parent is None and isinstance(item, Group) and item.on_change is not None:
                item.on_change()
            # Hidden items do not change the frame; hiding one does.
            if not item._visible and item is not self:
                return
            item = item.parent

    def remove(self) -> None:
        """Remove it from its group; safe to call twice."""
        if self.parent is not None:
            self.parent.discard(self)


def move_items(items: Sequence[Item], poses: NDArray[np.float64]) -> None:
    """Move items of one group, and request one new frame for all of them.

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
        alpha = finite_number("alpha", alpha)
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
        """Remove an item, if it is in the group."""
        if item in self._items:
            del self._items[item]
            item.parent = None
            self.touch()

    def clear(self) -> None:
        """Remove all items."""
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
        owner: The result of picking it; None if it cannot be picked.
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
        """True if nothing behind it shines through."""
        return True

    def bounds(self) -> Box | None:
        """Return the corners of the box around it in its own frame; None for nothing finite."""
        if self._boxed != self.geometry:
            self._boxed, self._box = self.geometry, self._find_bounds()
        return self._box

    def _find_bounds(self) -> Box | None:
        """Compute the box, once for all frames until the data changes."""
        raise NotImplementedError
