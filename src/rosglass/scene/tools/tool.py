"""The base class of RViz's tools: what the mouse, fingers and keys do in a view.

A view has one current tool. It gets each press first; what it does not take moves the camera. A
tool is declared in QML inside a ``SceneView``, or added with ``view.tools.add``. Own tools derive
from :class:`Tool` in Python, or are a ``Tool`` in QML with handlers of its signals.
"""
# ruff: noqa: N802, N815 - the names of slots, properties and signals are QML's

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar

from rosglass.errors import Error
from rosglass.overlay.property_values import shown
from rosglass.qml.elements.element import Element
from rosglass.qml.engine.properties import ReadOnly, Writable, report
from rosglass.qml.engine.runtime import runtime_of
from rosglass.qt import Property, QtCore, QtGui, Signal, Slot, is_alive
from rosglass.scene.configs.rviz_formats import TOOLS
from rosglass.scene.configs.settings import Configurable, Setting
from rosglass.scene.displays.declared import expect_view, find_view
from rosglass.scene.render.scene_tree import Group
from rosglass.scene.tools.pointer_event import PointerEvent, ToolView, cursor_shape
from rosglass.scene.view_controllers.events import Button, Modifier, Wheel

if TYPE_CHECKING:
    from rosglass.qml.engine.runtime import Runtime

__all__ = ["LIST", "MAP", "Tool"]

#: Types of Qt by name, which PySide's hints do not have.
MAP: Any = "QVariantMap"
LIST: Any = "QVariantList"


class Tool(Configurable, Element):
    """A tool of a view: it gets the mouse, one finger as the left button, and keys.

    This class itself is the ``Tool`` of QML, which takes the left button and only sends signals.

    Attributes:
        TYPE: Its name in RViz, e.g. ``Measure``; empty for own tools.
        NAME: Text of its button.
        KEY: The key that selects it.
        DESCRIPTION: Its purpose.
        root: Its drawables, in the fixed frame.
        view: The view that it is in; None before.
    """

    TYPE: ClassVar[str] = ""
    NAME: ClassVar[str] = ""
    KEY: ClassVar[str] = ""
    DESCRIPTION: ClassVar[str] = ""
    SETTINGS: ClassVar[dict[str, Setting]] = {}
    _HOLDS = ("view", "_tools")

    nameChanged = Signal()
    #: A button, or a finger, was pressed; with what :meth:`PointerEvent.for_qml` returns.
    pressed = Signal(MAP)
    #: The mouse or the finger has moved, also without a button.
    moved = Signal(MAP)
    released = Signal(MAP)
    #: A key was pressed that is not the shortcut of a tool.
    keyPressed = Signal(MAP)
    #: It has become the current tool, or another one has.
    selectedChanged = Signal()
    statusTextChanged = Signal()

    name = Writable(str, read=lambda self: self._name or self.NAME or self.TYPE, write="_set_name")
    #: The key that selects it, and returns to the default tool; empty for none.
    shortcutKey = Writable(
        str, read=lambda self: self.KEY if self._key is None else self._key, write="_set_key"
    )
    description = Writable(
        str, "", read=lambda self: self._description or self.DESCRIPTION, then=""
    )
    type = Property(str, lambda self: self.TYPE, constant=True)
    #: Whether it is the current tool.
    selected = ReadOnly(bool, False)
    #: Instructions for a status bar; bold as in HTML.
    statusText = ReadOnly(str, "")

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        self.root = Group()
        self.view: ToolView | None = None
        #: The list that it is in, a :class:`~rosglass.scene.tools.tool_manager.Tools`.
        self._tools: Any = None
        self._name = ""
        self._key: str | None = None
        self._has_hit = False
        #: True once it was removed and waits to be destroyed.
        self._is_removed = False
        #: Whether it uses the node; only then it joins the session.
        self._uses_node = False
        #: RViz's class, as the file had it; RViz 2's for new ones.
        self.class_id = TOOLS.get(self.TYPE, ("", ""))[1]
        #: The tool's entry in a ``.rviz`` file, and its settings then.
        self.saved: dict[str, Any] = {}
        self.loaded: dict[str, Any] = {}
        super().__init__(parent, runtime)

    @property
    def label(self) -> str:
        """The tool in error messages."""
        return f"tool {self.name!r}"

    def _set_name(self, name: str) -> None:
        if name != self._name:
            self._name = name
            self.nameChanged.emit()

    def _set_key(self, key: str) -> None:
        if len(key) > 1:
            self._refuse(f"{self.label}: shortcutKey: expected one character, got {shown(key)}")
        elif key != self._key:
            self._key = key
            self.shortcutKeyChanged.emit()  # type: ignore[attr-defined]

    def values(self) -> dict[str, Any]:
        """Return the values of all settings by their path."""
        return {path: getattr(self, setting.name) for path, setting in self.SETTINGS.items()}

    @Slot(result=LIST)
    def settings(self) -> list[dict[str, Any]]:
        """Return the settings for a panel: name, kind, value and choices for SettingEditor.

        Also their description, and in `placeholder` what an empty text means.
        """
        return [
            {
                "name": path,
                "kind": self.SETTINGS[path].kind.NAME,
                "value": value if isinstance(value, bool) else _text_of(value),
                "choices": list(self.SETTINGS[path].kind.options.get("choices", ())),
                "description": self.SETTINGS[path].description,
                "placeholder": self._placeholder(path),
            }
            for path, value in self.values().items()
            if self.SETTINGS[path].is_shown(self)
        ]

    def _placeholder(self, path: str) -> str:  # noqa: ARG002 - for subclasses
        return ""

    @Slot(str, str, result=str)
    def setSetting(self, path: str, text: str) -> str:
        """Change a setting to what the user has entered; return why it does not fit, or ""."""
        try:
            setting = self._setting(path)
            setattr(self, setting.name, setting.restore(text))
        except Error as error:
            return f"{path}: {error}"
        return ""

    def _restyle(self) -> None:
        """Apply changed settings."""

    @Slot()
    def _run_update(self) -> None:
        if not is_alive(self) or self._is_removed:
            return
        if self.view is None:
            # Declared in QML inside a view; the view adds the tools that Python makes.
            view = find_view(self)
            if view is not None:
                view.adopt_tool(self)
            else:
                expect_view(self, "view")
        self._scheduled = False
        if self._uses_node:
            super()._run_update()

    def _find_runtime(self) -> Runtime | None:
        if self._runtime is None and self.view is not None:
            view: Any = self.view
            self._runtime = runtime_of(self) or runtime_of(view)
        return self._runtime or super()._find_runtime()

    @Slot()
    def select(self) -> None:
        """Make it the current tool; logged where it is in no view."""
        if self._tools is None:
            self._refuse(f"{self.label} is in no view; declare it inside a SceneView")
        else:
            self._tools.select(self)

    # -- for subclasses --------------------------------------------------------------------------

    def activate(self) -> None:
        """Become the current tool."""

    def deactivate(self) -> None:
        """Stop being the current tool."""

    def on_press(self, event: PointerEvent) -> bool:
        """Handle a press; return whether the tool gets all up to the release, not the camera."""
        return event.button is Button.LEFT

    def on_move(self, event: PointerEvent) -> None:
        """Handle a move without a button, or after a press that it has taken."""

    def on_release(self, event: PointerEvent) -> None:
        """Handle the release of the button whose press it has taken."""

    def on_cancel(self) -> None:
        """Cancel a press, as for Escape, a second finger or another fixed frame."""

    def on_fixed_frame(self) -> None:
        """Drop points of the fixed frame before."""

    def on_leave(self) -> None:
        """Follow the mouse out of the view."""

    def on_wheel(self, event: PointerEvent, wheel: Wheel) -> bool:  # noqa: ARG002 - for subclasses
        """Handle the wheel; return whether it was used, and does not move the camera."""
        return False

    def on_key(self, key: str, event: PointerEvent) -> bool:  # noqa: ARG002 - for subclasses
        """Handle a key; return whether it was used.

        Args:
            key: The character.
            event: The event of the mouse.
        """
        return False

    def drop_waiting(self) -> bool:
        """Drop a waiting message (Escape); return whether there was one."""
        return False

    def set_status(self, text: str, *, hit: bool | None = None) -> None:
        """Show the instructions, and whether there is a target under the mouse.

        Args:
            text: For the status bar.
            hit: Whether the cursor is a cross; None to leave it.
        """
        if hit is not None:
            self._has_hit = hit
        if is_alive(self):
            report(self, statusText=text)

    def finish(self, outcome: str = "") -> None:
        """Return to the default tool, if this one is the current one.

        Args:
            outcome: The outcome, for the status bar.
        """
        if self._tools is not None:
            self._tools.finish(self, outcome)

    def announce(self, outcome: str) -> None:
        """Show in the status bar what it has done."""
        if self._tools is not None:
            self._tools.announce(outcome)

    # -- for the list of tools -------------------------------------------------------------------

    def cursor(self, event: PointerEvent) -> QtCore.Qt.CursorShape:  # noqa: ARG002 - for subclasses
        """Return the cursor of the mouse."""
        return cursor_shape("CrossCursor" if self._has_hit else "ArrowCursor")

    def help(self, modifiers: Modifier) -> str:  # noqa: ARG002 - for subclasses
        """Return the text for the status bar."""
        return self.statusText

    def join(self, view: ToolView, tools: Any) -> None:
        """Belong to a view; called by its list of tools."""
        self.view, self._tools, self._is_removed = view, tools, False
        view.overlay.add(self.root)
        self._restyle()

    def leave(self) -> None:
        """Belong to no view any more; called by its list of tools."""
        self.root.remove()
        self.view, self._tools, self._is_removed = None, None, True

    def _set_selected(self, selected: bool) -> None:
        if is_alive(self) and report(self, selected=selected):
            if selected:
                self.activate()
            else:
                self.deactivate()

    def _send(self, signal: str, event: PointerEvent, **more: Any) -> bool:
        """Send a signal if there is a handler; picking what is under the mouse is not free."""
        meta = self.metaObject()
        method = meta.method(meta.indexOfSignal(f"{signal}(QVariantMap)"))
        if not self.isSignalConnected(method):
            return False
        getattr(self, signal).emit({**event.for_qml(), **more})
        return True


def _text_of(value: Any) -> str:
    if isinstance(value, QtGui.QColor):
        return str(value.name())
    return f"{value:.6g}" if isinstance(value, float) else str(value)
