"""The tools that publish nothing: Interact, Move Camera, Select, Focus Camera and Measure."""
# ruff: noqa: N815 - the names of properties and signals are QML's

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar, Protocol

import numpy as np

from rosglass.overlay.orbit import Point
from rosglass.qml.engine.properties import ReadOnly, report
from rosglass.qt import QtCore, QtQml, Signal
from rosglass.scene.configs.settings import Setting, rgb_of
from rosglass.scene.render.drawing import Labels, Lines
from rosglass.scene.render.matrices import instance_matrix
from rosglass.scene.tools.pointer_event import PointerEvent, camera_cursor, point_text
from rosglass.scene.tools.tool import Tool
from rosglass.scene.view_controllers.events import Button, Modifier, Wheel

if TYPE_CHECKING:
    from rosglass.qml.engine.runtime import Runtime
    from rosglass.scene.tools.selection import Change

__all__ = [
    "FocusCameraTool",
    "InteractTool",
    "Interactive",
    "MeasureTool",
    "MoveCameraTool",
    "SelectTool",
]


class Interactive(Protocol):
    """Owner of a drawable that handles the mouse itself, as interactive markers do."""

    @property
    def help(self) -> str:
        """The instructions for the status bar."""

    def handle_pointer(self, what: str, event: PointerEvent) -> bool:
        """Handle an event of the tool Interact.

        Args:
            what: ``enter``, ``leave``, ``press``, ``move``, ``release``, ``wheel`` or ``cancel``.
            event: The event.

        Returns:
            Of a press: whether it gets all events up to the release; of the wheel: whether it was
            used. The camera moves otherwise.
        """


class MoveCameraTool(Tool):
    """Moves the camera, and nothing else."""

    TYPE, NAME, KEY = "MoveCamera", "Move Camera", "m"
    DESCRIPTION = "Moves the camera by the mouse, and touches nothing in the scene."

    def on_press(self, event: PointerEvent) -> bool:  # noqa: ARG002 - the base class's signature
        """Leave every press to the camera."""
        return False

    def cursor(self, event: PointerEvent) -> QtCore.Qt.CursorShape:
        """Return the cursor for what a drag would do."""
        return camera_cursor(event)

    def help(self, modifiers: Modifier) -> str:
        """Return the instructions for the camera."""
        return "" if self.view is None else self.view.controller.help(modifiers)


class InteractTool(MoveCameraTool):
    """Gives the mouse to what handles it, as interactive markers do; elsewhere moves the camera."""

    TYPE, NAME, KEY = "Interact", "Interact", "i"
    DESCRIPTION = "Drags interactive markers; beside them, the mouse moves the camera."

    hideInactiveObjects = Setting(
        "Hide Inactive Objects", "bool", True,
        "While holding down a mouse button, hide all other interactive objects.",
    )  # fmt: skip

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        #: The object under the mouse, or the one that is being dragged.
        self._focused: Interactive | None = None
        super().__init__(parent, runtime)

    @property
    def focused(self) -> Interactive | None:
        """The object that handles the mouse now; None for the camera."""
        return self._focused

    def _focus(self, event: PointerEvent) -> None:
        # Picking takes milliseconds: not at every move over a scene without such objects.
        drawables = [one for one, _, _ in event.view.scene.root.drawables()]
        is_any = any(hasattr(one.owner, "handle_pointer") for one in drawables)
        owner = event.hit.drawable.owner if is_any and event.hit is not None else None
        found = owner if hasattr(owner, "handle_pointer") else None
        if found is not self._focused:
            before, self._focused = self._focused, found
            if before is not None:
                before.handle_pointer("leave", event)
            if found is not None:
                found.handle_pointer("enter", event)
            self.set_status("" if found is None else found.help)

    def help(self, modifiers: Modifier) -> str:
        """Return the instructions for the object under the mouse, or for the camera."""
        return self.statusText or super().help(modifiers)

    def on_press(self, event: PointerEvent) -> bool:
        """Pass the press to the object under the mouse, if it handles presses."""
        self._focus(event)
        return self._focused is not None and self._focused.handle_pointer("press", event)

    def on_move(self, event: PointerEvent) -> None:
        """Find the object under the mouse, or drag."""
        if not event.buttons:
            self._focus(event)
        if self._focused is not None:
            self._focused.handle_pointer("move", event)

    def on_release(self, event: PointerEvent) -> None:
        """End a drag."""
        if self._focused is not None:
            self._focused.handle_pointer("release", event)

    def on_wheel(self, event: PointerEvent, wheel: Wheel) -> bool:  # noqa: ARG002
        """Pass the wheel to the object under the mouse."""
        return self._focused is not None and self._focused.handle_pointer("wheel", event)

    def on_cancel(self) -> None:
        """Drop a drag."""
        focused, self._focused = self._focused, None
        self.set_status("")
        if focused is not None and self.view is not None:
            focused.handle_pointer("cancel", PointerEvent(self.view, (0.0, 0.0)))

    def deactivate(self) -> None:
        """Leave the object that was under the mouse."""
        self.on_leave()

    def on_leave(self) -> None:
        """Leave the object that was under the mouse."""
        focused, self._focused = self._focused, None
        self.set_status("")
        if focused is not None and self.view is not None:
            focused.handle_pointer("leave", PointerEvent(self.view, (0.0, 0.0)))

    def cursor(self, event: PointerEvent) -> QtCore.Qt.CursorShape:
        """Return a hand over what handles the mouse."""
        if self._focused is not None:
            return QtCore.Qt.CursorShape.PointingHandCursor
        return super().cursor(event)


class FocusCameraTool(Tool):
    """Turns the camera towards the point that is clicked."""

    TYPE, NAME, KEY = "FocusCamera", "Focus Camera", ""
    DESCRIPTION = "A click turns the camera towards a point."

    def activate(self) -> None:
        """Show the instructions."""
        self.set_status("Left-Click: Focus on a point.", hit=False)

    def on_move(self, event: PointerEvent) -> None:
        """Show the point."""
        if event.point is None:
            self.set_status("Left-Click: Look in this direction.", hit=False)
        else:
            point = point_text(event.point)
            self.set_status(f"Left-Click: Focus on this point. {point}", hit=True)

    def on_release(self, event: PointerEvent) -> None:
        """Turn the camera to the clicked point, or in its direction if nothing is there."""
        if self.view is None:
            return
        target = event.point
        if target is None:
            origin, way = self.view.camera().ray(event.x, event.y)
            target = Point(origin.x + way.x, origin.y + way.y, origin.z + way.z)
        self.view.move_camera(lambda view: view.look_at(target))
        self.finish()


class MeasureTool(Tool):
    """Measures the distance between two points that are clicked."""

    TYPE, NAME, KEY = "Measure", "Measure", ""
    DESCRIPTION = "Two clicks measure the distance between two points."
    _HELP = "Click on two points to measure their distance. Right-click to reset."
    #: Pixels of the screen.
    _LINE_WIDTH, _TEXT_HEIGHT = 3.0, 22.0

    #: A distance was measured: metres.
    measured = Signal(float)

    color = Setting("Line color", "color", "#ffd500", "Colour of the line.")
    #: Metres between the points; -1 before the second one.
    length = ReadOnly(float, -1.0)

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        self._line = Lines(self._LINE_WIDTH)
        self._text = Labels(in_pixels=True, align="below", outlined=True)
        self._start: Point | None = None
        #: Whether the second point follows the mouse.
        self._open = False
        self._end: Point | None = None
        super().__init__(parent, runtime)
        self.root.add(self._line, self._text)

    def activate(self) -> None:
        """Begin anew; the last line stays until then."""
        self._open = False
        self._show_help(hit=False)

    def on_press(self, event: PointerEvent) -> bool:
        """Use both buttons."""
        return event.button in (Button.LEFT, Button.RIGHT)

    def on_move(self, event: PointerEvent) -> None:
        """Draw the line to the mouse."""
        if self._open and event.point is not None:
            self._draw(event.point)
        self._show_help(hit=event.point is not None)

    def on_release(self, event: PointerEvent) -> None:
        """Use the clicked point."""
        if event.button is Button.RIGHT:
            self.clear()
        elif event.point is not None:
            if self._open:
                self._open = False
                self._draw(event.point)
                self.measured.emit(self.length)
            else:
                self.clear()
                self._start, self._open = event.point, True
        self._show_help(hit=event.point is not None)

    def on_cancel(self) -> None:
        """Drop the first point."""
        self.clear()

    def on_fixed_frame(self) -> None:
        """Drop the line, which is in the frame before."""
        self.clear()

    def clear(self) -> None:
        """Remove the line."""
        self._start = self._end = None
        self._open = False
        self._line.set_segments([])
        self._text.set_texts([], [])
        report(self, length=-1.0)

    def _restyle(self) -> None:
        if self._end is not None:
            self._draw(self._end)

    def _draw(self, end: Point) -> None:
        start, self._end = self._start, end
        if start is None:
            return
        way = np.array(end) - np.array(start)
        length = float(np.linalg.norm(way))
        # From the first point: coordinates may be too large for float32.
        self.root.pose = instance_matrix(start)
        self._line.set_segments([[(0.0, 0.0, 0.0), way]], rgb_of(self.color))
        self._text.set_texts([f"{length:.3f} m"], [way / 2], self._TEXT_HEIGHT, (1.0, 1.0, 1.0))
        report(self, length=length)

    def _show_help(self, *, hit: bool) -> None:
        found = f"[Length: {self.length:.6g} m] " if self.length >= 0 else ""
        self.set_status(found + self._HELP, hit=hit)


class SelectTool(Tool):
    """Selects parts in a rectangle, or under a click; ``view.selection`` lists them."""

    TYPE, NAME, KEY = "Select", "Select", "s"
    DESCRIPTION = "Selects what is in a rectangle. Shift adds, Ctrl removes, Alt moves the camera."
    _HELP = (
        "Left-Click: Select.  Shift: Add.  Ctrl: Remove.  "
        "Alt: Move the camera.  F: Look at the selection."
    )
    #: Units of the view within which a drag counts as a click.
    _CLICK = 3.0
    _RECTANGLE: ClassVar[bytes] = (
        b'import QtQuick\nRectangle { color: "#3060a0ff"; border { color: "#60a0ff"; width: 1 } }'
    )

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        self._corner: tuple[float, float] | None = None
        #: Drawn by Qt Quick above the view: dragging it draws no 3D.
        self._rectangle: Any = None
        super().__init__(parent, runtime)

    def activate(self) -> None:
        """Show the instructions."""
        self.set_status(self._HELP, hit=True)

    def deactivate(self) -> None:
        """Drop a rectangle that was begun."""
        self.on_cancel()

    def on_press(self, event: PointerEvent) -> bool:
        """Begin a rectangle."""
        if event.button is not Button.LEFT or event.modifiers & Modifier.ALT:
            return False
        self._corner = (event.x, event.y)
        return True

    def on_move(self, event: PointerEvent) -> None:
        """Draw the rectangle."""
        if self._corner is None:
            return
        rectangle = self._rectangle or self._make_rectangle()
        if rectangle is None:
            return
        (left, right), (top, bottom) = (
            sorted(pair) for pair in zip(self._corner, (event.x, event.y), strict=True)
        )
        rectangle.setX(left)
        rectangle.setY(top)
        rectangle.setWidth(right - left)
        rectangle.setHeight(bottom - top)
        rectangle.setVisible(True)

    def on_release(self, event: PointerEvent) -> None:
        """Select the parts in the rectangle."""
        corner, view = self._corner, self.view
        self.on_cancel()
        if corner is None or view is None:
            return
        change: Change = "replace"
        if event.modifiers & Modifier.SHIFT:
            change = "add"
        elif event.modifiers & Modifier.CTRL:
            change = "remove"
        if max(abs(event.x - corner[0]), abs(event.y - corner[1])) <= self._CLICK:
            view.selection.select_at(event.x, event.y, change)
        else:
            view.selection.select_between(corner, (event.x, event.y), change)
        self.announce(view.selection.summary())

    def on_cancel(self) -> None:
        """Drop the rectangle."""
        self._corner = None
        if self._rectangle is not None:
            self._rectangle.setVisible(False)

    def on_key(self, key: str, event: PointerEvent) -> bool:  # noqa: ARG002
        """Turn the camera to the selection (F)."""
        view = self.view
        middle = None if view is None or key not in "fF" else view.selection.middle()
        if view is None or middle is None:
            return False
        return view.move_camera(lambda controller: controller.look_at(middle))

    def _make_rectangle(self) -> Any:
        view: Any = self.view
        engine = None if view is None else QtQml.qmlEngine(view)
        if engine is None:
            return None  # a view without QML; the selection works all the same
        component = QtQml.QQmlComponent(engine)
        component.setData(self._RECTANGLE, QtCore.QUrl())
        made: Any = component.create()
        self._rectangle = made
        if made is not None:
            made.setParent(view)
            made.setParentItem(view)
        return made
