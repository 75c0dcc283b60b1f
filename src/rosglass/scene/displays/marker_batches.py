"""Draws markers of one namespace together: ten thousand of them are a few drawables.

Texts, lines and triangles of one batch are near its origin: as float32, positions that are far from
it would be rounded.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from rosglass.scene.render.drawing import Labels, Lines, Mesh
from rosglass.scene.render.matrices import instance_matrix
from rosglass.scene.render.mesh_shapes import Shape

if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import TypeAlias

    from numpy.typing import NDArray

    Matrix: TypeAlias = NDArray[np.float64]
    Key: TypeAlias = tuple[str, int]
    Color: TypeAlias = tuple[float, ...]

__all__ = ["MAX_JOINED_POINTS", "LineBatch", "SolidBatch", "TextBatch", "TriangleBatch"]

#: Points of lines or triangles in one batch, all of which are computed again when a marker of it
#: changes, and points of a marker up to which it is part of one.
_MAX_POINTS, MAX_JOINED_POINTS = 10_000, 1000


class SolidBatch:
    """Markers of one shape, as instances of one mesh with a slot for each."""

    def __init__(self, shape: Shape, owner: Any) -> None:
        self.mesh = Mesh(shape)
        self.mesh.owner = owner
        self._slots: dict[Key, int] = {}
        self._keys: list[Key] = []
        self._matrices = np.zeros((16, 4, 4), np.float32)
        self._colors = np.zeros((16, 4), np.float32)
        #: Instances put since the last flush, by slot: pose of the frame, matrix in it, colour.
        self._changed: dict[int, tuple[Matrix, Matrix, Color]] = {}
        self._dirty = True

    def put(self, key: Key, pose: Matrix, place: Matrix, color: Color) -> None:
        """Draw a marker, in place of the one of the same key.

        Args:
            key: Its namespace and id.
            pose: Pose of its frame.
            place: Pose and size in this frame.
            color: RGBA.
        """
        slot = self._slots.get(key)
        if slot is None:
            slot = self._slots[key] = len(self._keys)
            self._keys.append(key)
        self._changed[slot] = (pose, place, color)

    def discard(self, key: Key) -> None:
        """Do not draw a marker any more."""
        slot = self._slots.pop(key, None)
        if slot is None:
            return
        # The last one takes its place.
        last, end = self._keys.pop(), len(self._keys)
        changed = self._changed.pop(end, None)
        if slot != end:
            self._keys[slot] = last
            self._slots[last] = slot
            if changed is not None:
                self._changed[slot] = changed
            else:
                self._changed.pop(slot, None)
                self._matrices[slot], self._colors[slot] = self._matrices[end], self._colors[end]
        self._dirty = True

    def key_of(self, index: int) -> Key:
        """Return the marker of an instance."""
        return self._keys[index]

    def flush(self) -> None:
        """Update the mesh."""
        count = len(self._keys)
        if self._changed:
            while count > len(self._matrices):
                self._matrices = np.concatenate([self._matrices, np.zeros_like(self._matrices)])
                self._colors = np.concatenate([self._colors, np.zeros_like(self._colors)])
            slots = list(self._changed)
            poses, places, colors = zip(*self._changed.values(), strict=True)
            first = poses[0]
            if all(pose is first for pose in poses):
                at = first
            else:
                at = np.concatenate(poses).reshape(-1, 4, 4)
            with np.errstate(over="ignore", invalid="ignore"):
                self._matrices[slots] = at @ np.concatenate(places).reshape(-1, 4, 4)
            self._colors[slots] = colors
        elif not self._dirty:
            return
        self._changed.clear()
        self._dirty = False
        self.mesh.set_instances(
            self._matrices[:count].copy(), self._colors[:count].copy() if count else (1,) * 4
        )


class TextBatch:
    """Texts, as the labels of one drawable.

    Args:
        origin: x, y, z of a place in the group near all of them.
        owner: The result of picking them; None if they cannot be picked.
    """

    #: Letters in one batch, each text as a rectangle of as many as its longest line has: they fit
    #: into one image.
    MAX_LETTERS = 10_000

    def __init__(self, origin: Sequence[float], owner: Any) -> None:
        self._origin = np.array(origin)
        self.drawable = Labels()
        self.drawable.owner = owner
        self.drawable.pose = instance_matrix(origin)
        #: Text, position in the group, height and colour of each.
        self._texts: dict[Key, tuple[str, NDArray[np.float64], float, Color]] = {}
        self._letters = 0
        self._dirty = False

    def __len__(self) -> int:
        return len(self._texts)

    def has_room(self, key: Key, text: str) -> bool:
        """Return whether a marker may have a text: the only one may be of any length."""
        is_new = key not in self._texts
        if len(self._texts) - (not is_new) == 0:
            return True
        before = 0 if is_new else _letters(self._texts[key][0])
        letters = self._letters - before + _letters(text)
        return letters <= self.MAX_LETTERS and len(self._texts) + is_new <= Labels.MAX_COUNT

    def put(
        self, key: Key, text: str, position: NDArray[np.float64], height: float, color: Color
    ) -> None:
        """Draw a marker, in place of the one of the same key."""
        self.discard(key)
        self._texts[key] = (text, position, height, color)
        self._letters += _letters(text)

    def discard(self, key: Key) -> None:
        """Do not draw a marker any more."""
        before = self._texts.pop(key, None)
        self._letters -= 0 if before is None else _letters(before[0])
        self._dirty = True

    def flush(self) -> None:
        """Update the labels."""
        if not self._dirty:
            return
        self._dirty = False
        if not self._texts:
            self.drawable.set_texts([], [])
            return
        texts, positions, heights, colors = zip(*self._texts.values(), strict=True)
        self.drawable.set_texts(texts, np.array(positions) - self._origin, heights, colors)


def _letters(text: str) -> int:
    lines = text.split("\n")
    return len(lines) * (max(map(len, lines)) + 1)


class LineBatch:
    """Lines of one width, as the segments of one drawable.

    Args:
        width: Metres.
        origin: x, y, z of a place in the group near all of them.
        owner: The result of picking them; None if they cannot be picked.
    """

    def __init__(self, width: float, origin: Sequence[float], owner: Any) -> None:
        self._origin = np.array(origin)
        self.drawable = Lines(width, in_metres=True)
        self.drawable.owner = owner
        self.drawable.pose = instance_matrix(origin)
        #: Pose in the group, points, colours of these or one for all, and whether they are a strip.
        self._lines: dict[Key, tuple[Matrix, NDArray[np.float32], NDArray[np.float32], bool]] = {}
        self._points = 0
        self._dirty = False

    def __len__(self) -> int:
        return len(self._lines)

    def has_room(self, key: Key, points: NDArray[np.float32]) -> bool:
        """Return whether a marker may have as many points."""
        before = len(self._lines[key][1]) if key in self._lines else 0
        return self._points - before + len(points) <= _MAX_POINTS

    def put(
        self,
        key: Key,
        pose: Matrix,
        points: NDArray[np.float32],
        colors: NDArray[np.float32] | Color,
        is_strip: bool,
    ) -> None:
        """Draw a marker, in place of the one of the same key.

        Args:
            key: Its namespace and id.
            pose: Its pose in the group.
            points: (n, 3), metres.
            colors: RGBA for each or all.
            is_strip: Whether each point is connected with the next, or the first of each two.
        """
        self.discard(key)
        tints = np.broadcast_to(np.asarray(colors, np.float32), (len(points), 4))
        self._lines[key] = (pose, points, tints, is_strip)
        self._points += len(points)

    def discard(self, key: Key) -> None:
        """Do not draw a marker any more."""
        before = self._lines.pop(key, None)
        self._points -= 0 if before is None else len(before[1])
        self._dirty = True

    def flush(self) -> None:
        """Update the lines."""
        if not self._dirty:
            return
        self._dirty = False
        if not self._lines:
            self.drawable.set_segments([])
            return
        poses, points, colors, strips = zip(*self._lines.values(), strict=True)
        counts = [len(one) for one in points]
        marker = np.repeat(np.arange(len(counts)), counts)
        turns = np.concatenate(poses).reshape(-1, 4, 4)
        turns[:, :3, 3] -= self._origin
        at = np.einsum("nij,nj->ni", turns[marker, :3, :3], np.concatenate(points))
        at += turns[marker, :3, 3]
        tints = np.concatenate(colors)
        number = np.arange(len(marker))
        # A line begins at each point but the last of a strip, at every second one of a list.
        has_next = np.append(marker[1:] == marker[:-1], False)
        first = np.cumsum([0, *counts[:-1]])
        is_strip = np.array(strips)[marker]
        is_start = has_next & (is_strip | ((number - first[marker]) % 2 == 0))
        start = np.flatnonzero(is_start)
        # Strips bend to the points beside; those of lists, and at the ends, are their own ones.
        before = np.where(is_strip[start] & (start > first[marker[start]]), start - 1, start)
        after = np.where(is_strip[start] & has_next[start + 1], start + 2, start + 1)
        with np.errstate(over="ignore"):
            at = at.astype(np.float32)
        self.drawable.set_segments(
            np.stack([at[start], at[start + 1]], axis=1),
            np.stack([tints[start], tints[start + 1]], axis=1),
            np.stack([at[before], at[after]], axis=1),
        )


class TriangleBatch:
    """Triangles, as one shape of one drawable.

    Args:
        lit: Whether the headlight shades them.
        origin: x, y, z of a place in the group near all of them.
        owner: The result of picking them; None if they cannot be picked.
    """

    def __init__(self, lit: bool, origin: Sequence[float], owner: Any) -> None:
        self._origin = np.array(origin)
        self.drawable = Mesh(Shape([]), lit=lit)
        self.drawable.owner = owner
        self.drawable.pose = instance_matrix(origin)
        #: Pose in the group, triangles, and the colour that these are multiplied with.
        self._parts: dict[Key, tuple[Matrix, Shape, Color]] = {}
        self._points = 0
        self._dirty = False

    def __len__(self) -> int:
        return len(self._parts)

    def has_room(self, key: Key, shape: Shape) -> bool:
        """Return whether a marker may have these triangles."""
        before = len(self._parts[key][1].rows) if key in self._parts else 0
        return self._points - before + len(shape.rows) <= _MAX_POINTS

    def put(self, key: Key, pose: Matrix, shape: Shape, color: Color) -> None:
        """Draw a marker, in place of the one of the same key."""
        self.discard(key)
        self._parts[key] = (pose, shape, color)
        self._points += len(shape.rows)

    def discard(self, key: Key) -> None:
        """Do not draw a marker any more."""
        before = self._parts.pop(key, None)
        self._points -= 0 if before is None else len(before[1].rows)
        self._dirty = True

    def flush(self) -> None:
        """Update the mesh."""
        if not self._dirty:
            return
        self._dirty = False
        mesh = self.drawable
        if not self._parts:
            mesh.shape = Shape([])
            mesh.set_instances(np.eye(4)[np.newaxis])
            return
        poses, shapes, colors = zip(*self._parts.values(), strict=True)
        counts = [len(shape.rows) for shape in shapes]
        marker = np.repeat(np.arange(len(counts)), counts)
        rows = np.concatenate([shape.rows for shape in shapes])
        turns = np.concatenate(poses).reshape(-1, 4, 4)
        turns[:, :3, 3] -= self._origin
        turn = turns[marker, :3, :3]
        at = np.einsum("nij,nj->ni", turn, rows["position"]) + turns[marker, :3, 3]
        first = np.repeat(np.cumsum([0, *counts[:-1]]), [len(shape.faces) for shape in shapes])
        mesh.shape = Shape(
            at,
            np.einsum("nij,nj->ni", turn, rows["normal"]),
            np.concatenate([shape.faces for shape in shapes]) + first[:, np.newaxis],
            colors=rows["rgba"] / np.float32(255) * np.array(colors, np.float32)[marker],
        )
        mesh.set_instances(np.eye(4)[np.newaxis])
