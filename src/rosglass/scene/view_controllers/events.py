"""Events of the mouse, the wheel and fingers in a scene, as plain values.

Lengths are in units of the item that shows the scene. A tool gets an event first; the view gets
the ones that the tool does not use.
"""

from __future__ import annotations

import enum
import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rosglass.scene.render.camera import Size

__all__ = ["Action", "Button", "Drag", "Modifier", "Touch", "Wheel"]


class Button(enum.IntFlag):
    """Buttons of a mouse; the values are Qt's."""

    NONE = 0
    LEFT = 1
    RIGHT = 2
    MIDDLE = 4


class Modifier(enum.IntFlag):
    """Keys that are held during an event; the values are Qt's."""

    NONE = 0
    SHIFT = 0x02000000
    CTRL = 0x04000000
    ALT = 0x08000000
    META = 0x10000000


class Action(enum.Enum):
    """The effect of a drag; the values are the names of RViz's cursors."""

    NONE = "cursor"
    ROTATE_3D = "rotate_cam"
    ROTATE_2D = "rotate"
    MOVE_XY = "move2d"
    MOVE_Z = "move_z"
    ZOOM = "zoom"


class Drag(NamedTuple):
    """A movement of the mouse with a button held, in units of the item.

    Attributes:
        x: Its present position, from the left edge.
        y: The same, from the upper edge.
        dx: How far it has moved to the right since the last event.
        dy: The same, downwards.
        buttons: The buttons that are held.
        modifiers: The keys that are held.
        size: Width and height of the item.
    """

    x: float
    y: float
    dx: float
    dy: float
    buttons: Button
    modifiers: Modifier
    size: Size


class Wheel(NamedTuple):
    """A turn of the mouse's wheel.

    Attributes:
        steps: Notches away from the user, i.e. Qt's ``angleDelta`` / 120; negative towards them.
        modifiers: The keys that are held.
    """

    steps: float
    modifiers: Modifier = Modifier.NONE


class Touch(NamedTuple):
    """A movement of fingers on a screen, in units of the item.

    Attributes:
        fingers: How many.
        x: Their centre now, from the left edge.
        y: The same, from the upper edge.
        dx: How far their centre has moved to the right since the last event.
        dy: The same, downwards.
        pinch: Ratio by which they moved apart.
        twist: Radians by which they turned, clockwise as seen by the user.
        size: Width and height of the item.
    """

    fingers: int
    x: float
    y: float
    dx: float
    dy: float
    pinch: float
    twist: float
    size: Size

    @classmethod
    def between(
        cls,
        before: Sequence[tuple[float, float]],
        after: Sequence[tuple[float, float]],
        size: Size,
    ) -> Touch:
        """Return the movement from one event to the next.

        Args:
            before: x and y of each finger at the last event.
            after: The same now, of the same fingers in the same order.
            size: Width and height of the item.
        """
        old, new = np.array(before, np.float64), np.array(after, np.float64)
        (x, y), (old_x, old_y) = new.mean(axis=0), old.mean(axis=0)
        old, new = old - (old_x, old_y), new - (x, y)
        pinch = float(np.linalg.norm(new)) / max(float(np.linalg.norm(old)), 1.0)
        cross = float(np.sum(old[:, 0] * new[:, 1] - old[:, 1] * new[:, 0]))
        twist = math.atan2(cross, float(np.sum(old * new)))
        pinch = min(max(pinch, 0.1), 10.0) if len(after) > 1 else 1.0
        move = (float(x - old_x), float(y - old_y))
        return cls(len(after), float(x), float(y), *move, pinch, twist, size)
