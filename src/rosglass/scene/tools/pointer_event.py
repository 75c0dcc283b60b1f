"""Events of the mouse, and what the view of a tool has."""
# ruff: noqa: N802 - the names of slots, properties and signals are QML's

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any, Protocol

from rosglass.overlay.orbit import Point
from rosglass.qt import QtCore, QtGui
from rosglass.scene.view_controllers.events import Action, Button, Drag, Modifier

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from rosglass.scene.displays.scene import Scene
    from rosglass.scene.render.camera import Camera
    from rosglass.scene.render.picking import Hit
    from rosglass.scene.render.scene_tree import Group
    from rosglass.scene.tools.selection import Selection
    from rosglass.scene.view_controllers.view_controller import ViewController

__all__ = ["PointerEvent", "ToolView", "camera_cursor", "cursor_shape", "point_text"]

#: Cursors for what a drag of the camera does: names in ``Qt.CursorShape``.
_CURSORS = {
    Action.NONE: "ArrowCursor",
    Action.ROTATE_3D: "OpenHandCursor",
    Action.ROTATE_2D: "OpenHandCursor",
    Action.MOVE_XY: "SizeAllCursor",
    Action.MOVE_Z: "SizeVerCursor",
    Action.ZOOM: "SizeVerCursor",
}


class ToolView(Protocol):
    """The part of a ``SceneView`` that tools use; see there."""

    scene: Scene
    overlay: Group

    @property
    def controller(self) -> ViewController:
        """The view controller, which moves the camera."""

    @property
    def selection(self) -> Selection:
        """The selection."""

    def camera(self) -> Camera:
        """Return the camera of the next frame."""

    def pick(self, x: float, y: float) -> Hit | None:
        """Return the hit nearest to the camera at a point of the view."""

    def move_camera(self, change: Callable[[ViewController], bool | None]) -> bool:
        """Turn the camera to another view; return whether there was a change."""

    def width(self) -> float:
        """Return its width."""

    def height(self) -> float:
        """Return its height."""

    def cursor(self) -> QtGui.QCursor:
        """Return the cursor of the mouse."""

    def setCursor(self, cursor: QtCore.Qt.CursorShape, /) -> None:
        """Change the cursor of the mouse."""


class PointerEvent:
    """An event of the mouse, or of one finger as its left button.

    Attributes:
        view: The view.
        x: Units of the view, from its left edge.
        y: The same, from its upper edge.
        dx: How far it has moved to the right since the last event.
        dy: The same, downwards.
        button: The button that was pressed or released; none for moves.
        buttons: The buttons that are held, after the event.
        modifiers: The keys that are held.
    """

    def __init__(
        self,
        view: ToolView,
        at: tuple[float, float],
        moved: tuple[float, float] = (0.0, 0.0),
        button: Button = Button.NONE,
        buttons: Button = Button.NONE,
        modifiers: Modifier = Modifier.NONE,
    ) -> None:
        self.view = view
        self.x, self.y = at
        self.dx, self.dy = moved
        self.button, self.buttons, self.modifiers = button, buttons, modifiers

    @cached_property
    def hit(self) -> Hit | None:
        """The hit under the pointer; None for nothing."""
        return self.view.pick(self.x, self.y)

    @property
    def point(self) -> Point | None:
        """The point of the fixed frame that is under the pointer, on whatever is drawn there."""
        return None if self.hit is None else Point(*self.hit.point)

    @cached_property
    def ground(self) -> Point | None:
        """The point under the pointer in the plane z = 0 of the fixed frame."""
        origin, direction = self.view.camera().ray(self.x, self.y)
        if abs(direction.z) < 1e-9 or (length := -origin.z / direction.z) < 0:
            return None
        return Point(origin.x + direction.x * length, origin.y + direction.y * length, 0.0)

    def drag(self) -> Drag:
        """Return the event as one that moves the camera."""
        size = (self.view.width(), self.view.height())
        return Drag(self.x, self.y, self.dx, self.dy, self.buttons, self.modifiers, size)

    def for_qml(self) -> dict[str, Any]:
        """Return the event as QML gets it."""
        hit = self.hit
        display = (
            None if hit is None else getattr(hit.drawable.owner, "display", hit.drawable.owner)
        )
        return {
            "x": self.x,
            "y": self.y,
            "button": int(self.button),
            "buttons": int(self.buttons),
            "modifiers": int(self.modifiers),
            "point": _xyz(self.point),
            "ground": _xyz(self.ground),
            "display": str(getattr(display, "name", "")),
        }


def _xyz(point: Point | None) -> dict[str, float] | None:
    # No QVector3D: of UTM coordinates, its float32 keep half a metre.
    return None if point is None else point._asdict()


def cursor_shape(name: str) -> QtCore.Qt.CursorShape:
    """Return a cursor by its name in ``Qt.CursorShape``."""
    # Looked up when needed: with the first, PySide makes all of Qt's enumerations, in 12 ms.
    found: QtCore.Qt.CursorShape = getattr(QtCore.Qt.CursorShape, name)
    return found


def camera_cursor(event: PointerEvent) -> QtCore.Qt.CursorShape:
    """Return the cursor for what a drag of the camera would do."""
    return cursor_shape(_CURSORS[event.view.controller.action(event.buttons, event.modifiers)])


def point_text(point: Iterable[float]) -> str:
    """Return a point for the status bar, in metres to the millimetre, also of UTM coordinates."""
    return "[" + ", ".join(f"{round(number, 3) + 0.0:.12g}" for number in point) + "]"
