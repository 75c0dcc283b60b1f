"""The tools of a view, and which of them has the mouse: RViz's tool manager."""
# ruff: noqa: N802, N815 - the names of slots, properties and signals are QML's

from __future__ import annotations

import logging
from typing import TYPE_CHECKING, Any, ClassVar

from rosglass.comm.names import similar
from rosglass.errors import ArgumentError, Error
from rosglass.overlay.property_values import shown
from rosglass.qml.elements.element import single_shot
from rosglass.qml.engine.properties import ReadOnly, report
from rosglass.qt import Property, QtCore, Signal, Slot, is_alive
from rosglass.scene.configs.rviz_formats import TOOLS, ros_of, tool_type
from rosglass.scene.tools.pointer_event import PointerEvent, ToolView, camera_cursor, cursor_shape
from rosglass.scene.tools.tool import LIST, Tool
from rosglass.scene.view_controllers.events import Button, Modifier, Touch, Wheel

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from rosglass.qml.engine.runtime import Runtime

__all__ = ["DEFAULT_TOOLS", "Tools"]

_log = logging.getLogger("rosglass.scene")
#: Types of the tools that a view starts with, in the order of RViz's tool bar; the first is the
#: default tool, to which others return.
DEFAULT_TOOLS = (
    "Interact",
    "MoveCamera",
    "Select",
    "FocusCamera",
    "Measure",
    "SetInitialPose",
    "SetGoal",
    "PublishPoint",
)
#: Milliseconds that the status bar shows the outcome of a tool, e.g. what was published.
_OUTCOME_MS = 5000


class Tools(QtCore.QObject):
    """The tools of a view, and which of them is the current one.

    Args:
        view: The view.
        runtime: The engine's runtime, if the view was made for one.
    """

    #: Another tool is the current one.
    currentChanged = Signal()
    #: Tools were added or removed.
    changed = Signal()
    statusTextChanged = Signal()

    #: Types of tools by their name in RViz, e.g. ``Measure``.
    TYPES: ClassVar[dict[str, type[Tool]]] = {}

    #: All tools, for a tool bar.
    all = Property(LIST, lambda self: list(self._items), notify=changed)
    #: The tool that has the mouse; null where there is none.
    current = Property(QtCore.QObject, lambda self: self._current, notify=currentChanged)
    #: The current tool's instructions, or for some seconds the outcome of its last action.
    statusText = ReadOnly(str, "")
    #: The outcome of a tool's action in the last seconds, as plain text; empty otherwise.
    outcome = ReadOnly(str, "")

    def __init__(self, view: Any, runtime: Runtime | None = None) -> None:
        super().__init__(view)
        self._view: ToolView = view
        self._runtime = runtime
        self._items: list[Tool] = []
        self._current: Tool | None = None
        #: The owner of the drag in progress: "tool", "camera", or "none" after it was cancelled.
        self._grab = ""
        self._held = Button.NONE
        self._modifiers = Modifier.NONE
        self._outcome_end = single_shot(self, self._show_status)
        #: The tools from DEFAULT_TOOLS, which declared ones replace.
        self._defaults: set[Tool] = set()
        #: The tools that QML has declared, which replace those of a file.
        self._declared: set[Tool] = set()
        #: Tools of a file that rosglass does not have, by their number in it.
        self._unknown: dict[int, dict[str, Any]] = {}
        view.fixedFrameChanged.connect(self._on_fixed_frame)
        for name in DEFAULT_TOOLS:
            if name in self.TYPES:
                self._defaults.add(self.add(name))

    #: Names of the types of tools that can be added.
    types = Property(list, lambda self: sorted(self.TYPES), constant=True)

    @Slot(str, result=str)
    def nameOf(self, kind: str) -> str:
        """Return the button's text for a type of tools; the type itself if it does not exist."""
        return self.TYPES[kind].NAME if kind in self.TYPES else kind

    @Slot(str, result=str)
    def addTool(self, kind: str) -> str:
        """Add a tool of a type as the last one; return what is wrong, or an empty text."""
        try:
            self.add(kind)
        except Error as error:
            return str(error)
        return ""

    @Slot(QtCore.QObject)
    def removeTool(self, tool: Any) -> None:
        """Remove a tool."""
        if tool in self._items:
            self.remove(tool)

    # -- the list --------------------------------------------------------------------------------

    def __iter__(self) -> Any:
        return iter(list(self._items))

    def __len__(self) -> int:
        return len(self._items)

    @property
    def default(self) -> Tool | None:
        """The tool that others return to: the first one."""
        return self._items[0] if self._items else None

    def add(self, tool: str | Tool | type[Tool], name: str = "", **settings: Any) -> Tool:
        """Add a tool as the last one.

        Args:
            tool: A tool, its class, or the name of its type in RViz or a class id, e.g.
                ``SetGoal`` or ``rviz/SetGoal``.
            name: Text of its button; by default the type's.
            settings: Values of its properties, e.g. ``topic="/robot1/goal_pose"``.

        Raises:
            Error: There is no such type or property, or a value does not fit.
        """
        made = self._make(tool)
        by_name = {setting.name: path for path, setting in type(made).SETTINGS.items()}
        try:
            for key, value in settings.items():
                if key in by_name:
                    made.set(by_name[key], value)
                elif key in ("shortcutKey", "description"):
                    setattr(made, key, value)
                else:
                    raise Error(f"{made.label} has no property {key!r}{similar(key, by_name)}")
        except Error:
            if made is not tool:
                made.deleteLater()
            raise
        if name:
            made.name = name
        self.adopt(made)
        return made

    def _make(self, tool: str | Tool | type[Tool]) -> Tool:
        if isinstance(tool, Tool):
            return tool
        kind = tool if isinstance(tool, type) and issubclass(tool, Tool) else None
        if isinstance(tool, str):
            kind = self.TYPES.get(tool_type(tool) if "/" in tool else tool)
            if kind is None:
                hint = similar(tool, self.TYPES) or f"; there are: {', '.join(sorted(self.TYPES))}"
                raise Error(f"there is no tool {shown(tool)}{hint}")
        if kind is None:
            raise ArgumentError("tool", tool, "a Tool, a class of it or the name of one")
        made = kind(self.parent(), self._runtime)
        if isinstance(tool, str) and "/" in tool:
            made.class_id = tool
        return made

    def adopt(self, tool: Tool, *, declared: bool = False) -> None:
        """Add a tool that exists; a declared one replaces the default one of its type."""
        if tool in self._items:
            return
        if tool.view is not None:
            raise Error(f"{tool.label} is in another view; remove it there first")
        index = len(self._items)
        replaced = None
        if declared and tool.TYPE:
            replaced = next((t for t in self._defaults if t.TYPE == tool.TYPE), None)
            index = self._items.index(replaced) if replaced is not None else index
        self._items.insert(index, tool)
        if declared:
            self._declared.add(tool)
        root = tool.root

        def forget() -> None:
            # QML has destroyed it: only its Python half is left.
            root.remove()
            if is_alive(self) and tool in self._items:
                self._items.remove(tool)
                self._declared.discard(tool)
                if self._current is tool:
                    self._current, self._grab = None, ""
                    self._make_current(self.default)
                self.changed.emit()

        tool.destroyed.connect(forget)
        tool.join(self._view, self)
        if replaced is not None:
            self.remove(replaced)
        self.changed.emit()
        if self._current is None or not is_alive(self._current):
            self.select(tool)

    def remove(self, tool: Tool) -> None:
        """Remove a tool; the default one gets the mouse where it was the current one.

        Raises:
            Error: It is not in this view.
        """
        if tool not in self._items:
            label = tool.label if isinstance(tool, Tool) else f"tool {shown(tool)}"
            raise Error(f"{label} is not in this view, whose tools are in view.tools")
        self._items.remove(tool)
        self._defaults.discard(tool)
        self._declared.discard(tool)
        if tool is self._current:
            self._make_current(self.default)
        tool.leave()
        tool.deleteLater()
        self.changed.emit()

    def clear(self) -> None:
        """Remove every tool: the mouse moves the camera until one is added."""
        self._make_current(None)
        for tool in list(self._items):
            self.remove(tool)

    def find(self, name: str) -> Tool | None:
        """Return the first tool of a name, type or class id.

        Raises:
            ArgumentError: The name is not a string.
        """
        if not isinstance(name, str):
            raise ArgumentError("name", name, "the name, type or class id of a tool")
        named = [tool for tool in self._items if tool.name == name]
        kind = tool_type(name) if "/" in name else name
        typed = [tool for tool in self._items if kind and kind == tool.TYPE]
        return next(iter(named + typed), None)

    def find_key(self, key: str) -> Tool | None:
        """Return the first tool with a shortcut key."""
        return next((t for t in self._items if key and t.shortcutKey.lower() == key.lower()), None)

    def select(self, tool: Tool | str) -> None:
        """Give the mouse to a tool.

        Args:
            tool: A tool of this view, or its name, type or class id.

        Raises:
            Error: It is not in this view.
        """
        found = tool if isinstance(tool, Tool) else self.find(tool)
        if found is None or found not in self._items:
            names = ", ".join(one.TYPE or one.name for one in self._items)
            text = tool.label if isinstance(tool, Tool) else shown(tool)
            hint = similar(tool, names.split(", ")) if isinstance(tool, str) else ""
            raise Error(f"there is no tool {text} in this view{hint or f'; there are: {names}'}")
        self._make_current(found)

    def _make_current(self, tool: Tool | None) -> None:
        before = self._current
        if tool is before:
            return
        self._cancel()
        self._current = tool
        if before is not None:
            self._call(before, before._set_selected, False)
        if tool is not None:
            self._call(tool, tool._set_selected, True)
            tool.statusTextChanged.connect(self._show_status)
        if before is not None and is_alive(before):
            before.statusTextChanged.disconnect(self._show_status)
        self.currentChanged.emit()
        self._show_status()

    def load_configs(self, configs: Iterable[Mapping[str, Any]]) -> list[str]:
        """Replace RViz's tools by those of a ``.rviz`` file; own tools stay, after them.

        A tool that QML has declared takes the place of the file's first one of its type.

        Args:
            configs: The settings of each, with ``Class``.

        Returns:
            What was left out, a line each.
        """
        notes = []
        self._make_current(None)
        for tool in list(self._items):
            if tool in self._declared:
                tool.saved, tool.loaded = {}, {}
            elif tool.class_id:
                self.remove(tool)
        self._unknown = {}
        order: list[Tool] = []
        for number, settings in enumerate(configs):
            class_id = settings.get("Class")
            if not isinstance(class_id, str) or tool_type(class_id) not in self.TYPES:
                text = shown(class_id)
                notes.append(f"tool {text}: rosglass has no such tool; it is kept as it is")
                self._unknown[number] = dict(settings)
                continue
            own = (t for t in self._items if t in self._declared and t not in order)
            declared = next((t for t in own if tool_type(class_id) == t.TYPE), None)
            if declared is not None:
                tool, tool.class_id = declared, class_id
            else:
                tool = self._make(class_id)
                notes += [f"tool {tool.name!r}: {text}" for text in tool.load_settings(settings)]
                self.adopt(tool)
            tool.saved, tool.loaded = dict(settings), tool.values()
            order.append(tool)
        self._items.sort(key=lambda tool: order.index(tool) if tool in order else len(order))
        self._make_current(self.default)
        self.changed.emit()
        return notes

    def save_configs(self, ros: int) -> list[dict[str, Any]]:
        """Return the tools as a ``.rviz`` file of one RViz keeps them, 1 or 2.

        Tools of its file that were not changed, or that rosglass does not have, stay as they were;
        own tools are left out.
        """
        found: list[dict[str, Any]] = []
        for tool in self._items:
            class_id = tool.class_id
            is_other = ros_of(class_id) not in (None, ros)
            if tool.saved and not is_other and tool.values() == tool.loaded:
                found.append(tool.saved)
            elif class_id:
                if is_other:
                    class_id = TOOLS[tool.TYPE][ros - 1] or class_id
                settings = tool.save_settings(tool.saved, ros)
                found.append({**settings, "Class": class_id})
        for number, settings in self._unknown.items():
            found.insert(number, settings)
        return found

    # -- the status bar --------------------------------------------------------------------------

    def finish(self, tool: Tool, outcome: str = "") -> None:
        """Return from a tool to the default one."""
        if tool is self._current:
            self._make_current(self.default)
        if outcome:
            self.announce(outcome)

    def announce(self, outcome: str) -> None:
        """Show for some seconds what a tool has done, as plain text."""
        self._outcome_end.start(_OUTCOME_MS)
        if report(self, outcome=outcome):
            self._show_status()

    @Slot()
    def _show_status(self) -> None:
        if not is_alive(self):
            return
        if self.outcome and self._outcome_end.isActive():
            text = self.outcome
        else:
            report(self, outcome="")
            tool = self._current
            if tool is None:
                text = self._view.controller.help(self._modifiers)
            else:
                text = self._call(tool, tool.help, self._modifiers)
        if text is not None:  # otherwise the tool has failed, which is shown
            report(self, statusText=text)

    # -- events ----------------------------------------------------------------------------------

    @property
    def holds_mouse(self) -> bool:
        """True while the mouse drags the camera or something of a tool."""
        return self._grab in ("camera", "tool")

    @property
    def moves_camera(self) -> bool:
        """True while the camera is being dragged."""
        return self._grab == "camera"

    def on_press(self, event: PointerEvent) -> bool:
        """Handle a press; return whether the tool has taken it, and not the camera."""
        if self._grab == "tool":
            self._cancel()
        elif not self._grab:
            tool = self._current
            taken = False
            if tool is not None:
                tool._send("pressed", event)
                taken = self._call(tool, tool.on_press, event) is True
            self._grab, self._held = ("tool" if taken else "camera"), event.button
        self._follow(event)
        return self._grab != "camera"

    def on_move(self, event: PointerEvent) -> None:
        """Handle a move, with or without a button."""
        tool = self._current
        if self._grab == "camera":
            self._view.controller.on_drag(event.drag())
        elif tool is not None and self._grab != "none":
            tool._send("moved", event)
            self._call(tool, tool.on_move, event)
        self._follow(event)

    def on_release(self, event: PointerEvent) -> None:
        """Handle a release."""
        tool = self._current
        if self._grab == "tool" and event.button == self._held and tool is not None:
            self._grab = "none"
            tool._send("released", event)
            self._call(tool, tool.on_release, event)
        if not event.buttons:
            self._grab = ""
        self._follow(event)

    def on_leave(self) -> None:
        """Handle that the mouse has left the view."""
        tool = self._current
        if tool is not None and not self._grab:
            self._call(tool, tool.on_leave)

    def on_wheel(self, event: PointerEvent, wheel: Wheel) -> None:
        """Handle the wheel."""
        tool = self._current
        if tool is None or not self._call(tool, tool.on_wheel, event, wheel):
            self._view.controller.on_wheel(wheel)

    def on_touch(self, touch: Touch) -> None:
        """Handle fingers that the tool has not taken."""
        self._view.controller.on_touch(touch)

    def on_key(self, key: str, event: PointerEvent) -> bool:
        """Handle a key: shortcuts of tools, then the tool, then the view.

        Returns:
            Whether it was used.
        """
        found, tool = self.find_key(key), self._current
        if found is not None:
            self._make_current(self.default if found is tool else found)
            return True
        if tool is not None:
            sent = tool._send("keyPressed", event, key=key)
            if self._call(tool, tool.on_key, key, event) or sent:
                return True
        point = event.point if key in "fF" else None
        return self._view.move_camera(lambda view: view.on_key(key, point))

    def on_escape(self) -> bool:
        """Cancel the present action, or return to the default tool; return whether it was used."""
        if self._grab == "tool":
            self._cancel()
            return True
        dropped = [self._call(tool, tool.drop_waiting) for tool in self._items]
        if any(dropped):
            return True
        if self._current is not self.default:
            self._make_current(self.default)
            return True
        return False

    def on_modifiers(self, modifiers: Modifier) -> None:
        """Follow keys like Shift, which change what the mouse does."""
        if modifiers != self._modifiers:
            self._modifiers = modifiers
            self._show_status()

    @Slot()
    def _on_fixed_frame(self) -> None:
        """Drop points of the fixed frame before."""
        tool = self._current
        if self._grab == "tool" and tool is not None:
            self._cancel()
            self.announce(f"{tool.name}: dropped: the fixed frame has changed")
        for one in list(self._items):
            self._call(one, one.on_fixed_frame)

    def cancel(self) -> None:
        """Cancel a press."""
        self._cancel()
        self._grab = ""

    def _cancel(self) -> None:
        tool = self._current
        if self._grab == "tool" and tool is not None:
            self._grab = "none"
            self._call(tool, tool.on_cancel)

    def _follow(self, event: PointerEvent) -> None:
        """Show the cursor and the status."""
        if not is_alive(self):
            return  # a handler has destroyed the view
        self.on_modifiers(event.modifiers)
        tool = self._current
        if self._grab == "camera" or tool is None:
            cursor = camera_cursor(event)
        else:
            cursor = self._call(tool, tool.cursor, event) or cursor_shape("ArrowCursor")
        if self._view.cursor().shape() != cursor:
            self._view.setCursor(cursor)

    def _call(self, tool: Tool, handler: Any, *arguments: Any) -> Any:
        """Call a tool; what it raises is logged, and never ends Qt's event loop."""
        try:
            return handler(*arguments)
        except Error as error:
            text = f"{tool.label}: {error}"
            tool._log(text, logging.ERROR)
        except Exception as error:  # a tool's mistake never ends the event loop
            text = f"{tool.label}: {error!r}"
            _log.exception("%s", tool.label)
        if is_alive(self):
            self.announce(text)
        return None
