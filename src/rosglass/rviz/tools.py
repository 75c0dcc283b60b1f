"""RViz's tools: list, selection, adding and removing."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rosglass.comm.names import similar
from rosglass.errors import Error
from rosglass.qt import Signal
from rosglass.rviz.host import Hook, address, mangled_class_of, pyqt
from rosglass.rviz.overlay import QML_CLASS, REFERENCE_QML_CLASS
from rosglass.rviz.plugins import DISPLAY, TOOL, PluginList, declared, require_class_id
from rosglass.rviz.qt5 import QtGui

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.rviz.window import Window

__all__ = ["Tool", "Tools", "loading_error"]

#: RViz's placeholder classes for tools and displays that could not be loaded.
_FAILED = ("N4rviz10FailedToolE", "N4rviz13FailedDisplayE")


class Tool:
    """One tool, created by :class:`Tools`; its members stay readable after removal."""

    def __init__(self, owner: Tools, handle: Any) -> None:
        self._owner = owner
        #: RViz's tool; None after removal.
        self.handle: Any = handle
        #: The class id, e.g. ``rviz/Measure``; not unique.
        self.class_id = str(handle.getClassId())
        key = str(handle.getShortcutKey())
        #: The key that selects it, e.g. ``m``; empty for none.
        self.shortcut_key = "" if key == "\0" else key
        self._name = str(handle.getName())
        self._description = ""
        self.refresh()

    def refresh(self) -> bool:
        """Read name and description from RViz; return whether they have changed."""
        before = (self._name, self._description)
        if self.handle is not None:
            self._name = str(self.handle.getName())
            self._description = " ".join(str(self.handle.getDescription()).split())
        return before != (self._name, self._description)

    @property
    def exists(self) -> bool:
        """Whether RViz has not removed it."""
        return self.handle is not None

    @property
    def name(self) -> str:
        """The text of its button; not unique."""
        return self._name

    @property
    def description(self) -> str:
        """Description of the tool."""
        return self._description

    @property
    def selected(self) -> bool:
        """Whether it is the selected tool."""
        return self.exists and self._owner.current is self

    def select(self) -> None:
        """Select the tool.

        Raises:
            Error: It was removed.
        """
        self._owner.select(self)

    def remove(self) -> None:
        """Remove the tool from RViz.

        Raises:
            Error: It was removed.
        """
        self._owner.remove(self)

    def picture(self) -> Any:
        """Return the largest size of its icon, a ``QPixmap``; a null pixmap if it has no icon."""
        made, icon = QtGui.QPixmap(), self.icon()
        sizes = icon.availableSizes() if icon is not None else []
        if sizes:
            largest = icon.pixmap(max(sizes, key=lambda size: size.width() * size.height()))
            core = pyqt()
            kept, buffer = core.QByteArray(), core.QBuffer()
            buffer.setBuffer(kept)
            buffer.open(core.QIODevice.WriteOnly)
            # PySide2 does not accept PyQt5's pixmap.
            largest.save(buffer, "PNG")
            made.loadFromData(bytes(kept.data()), "PNG")
        return made

    def icon(self) -> Any:
        """Return its icon, a ``QIcon`` of PyQt5; None after removal."""
        return None if self.handle is None else self.handle.getIcon()


class Tools(PluginList):
    """The tools of an RViz; `changed` reports a new name or description."""

    #: Another tool was selected.
    selected = Signal()

    def __init__(self, window: Window) -> None:
        super().__init__()
        self._window = window
        self._hook = Hook(self._on_change)
        self._manager = window.manager.getToolManager()
        self._items: list[Tool]
        self._known_current: Tool | None = None
        signals = ("toolAdded(Tool*)", "toolRemoved(Tool*)", "toolChanged(Tool*)")
        self._hook.watch(self._manager, *signals, "toolRefreshed(Tool*)")
        self._sync_items()
        self._known, self._known_current = list(self._items), self.current

    @property
    def classes(self) -> list[str]:
        """Class ids of the tools that can be added."""
        return list(declared(TOOL))

    @property
    def current(self) -> Tool | None:
        """The selected tool; None if there is none."""
        handle = self._manager.getCurrentTool()
        if handle is None:
            return None
        at = address(handle)
        return next((t for t in self._items if t.exists and address(t.handle) == at), None)

    def find(self, class_id: str) -> Tool | None:
        """Return the first tool of a class; None if there is none."""
        return next((tool for tool in self._items if tool.class_id == class_id), None)

    def select(self, tool: Tool) -> None:
        """Select a tool.

        Raises:
            Error: It was removed.
        """
        self._manager.setCurrentTool(self._handle(tool))
        self.emit_changes()

    def add(self, class_id: str) -> Tool:
        """Add a tool.

        Raises:
            Error: The class does not exist, or could not be loaded.
        """
        class_id = require_class_id(class_id, TOOL)
        handle = self._manager.addTool(class_id)
        text = loading_error(handle, class_id, TOOL)
        made = next(tool for tool in reversed(self._items) if tool.handle is not None)
        if text:
            self._manager.removeTool(self._manager.numTools() - 1)
            self.emit_changes()
            raise Error(f"no tool was added: {text}")
        self.emit_changes()
        return made

    def ask_for_new(self) -> None:
        """Open RViz's dialog for adding a tool, from the event loop."""
        core = pyqt()
        frame, queued = self._window.frame, core.Qt.QueuedConnection
        core.QMetaObject.invokeMethod(frame, "openNewToolDialog", queued)

    def remove(self, tool: Tool) -> None:
        """Remove a tool; if it was selected, RViz selects its first one.

        Raises:
            Error: It was removed before.
        """
        self._handle(tool)
        self._manager.removeTool(self._items.index(tool))
        self.emit_changes()

    def remove_all(self) -> None:
        """Remove all tools; the mouse does nothing in the 3D view until one is added."""
        self._manager.removeAll()
        self.emit_changes()

    def _sync_rest(self) -> Callable[[], None]:
        before, self._known_current = self._known_current, self.current
        return self.selected.emit if self._known_current is not before else lambda: None

    def _handle(self, tool: Tool) -> Any:
        if tool.handle is None or tool not in self._items:
            raise Error(f"the tool {tool.name} was removed")
        return tool.handle

    def _sync_items(self) -> None:
        manager = self._manager
        handles = [manager.getTool(index) for index in range(manager.numTools())]
        known = {address(tool.handle): tool for tool in self._items}
        self._items = [
            known.pop(address(handle)) if address(handle) in known else Tool(self, handle)
            for handle in handles
        ]
        for removed in known.values():
            removed.handle = None


def loading_error(handle: Any, class_id: str, base: str) -> str:
    """Return why RViz could not load a tool or display (its base class is `base`), or ``""``."""
    if mangled_class_of(handle) not in _FAILED:
        return ""
    known = declared(base)
    if class_id in known:
        return f"{class_id} could not be loaded; RViz's log says why"
    for other, what in ((DISPLAY, "a display: use addDisplay"), (TOOL, "a tool: use addTool")):
        if other != base and class_id in declared(other):
            return f"{class_id} is {what}"
    if class_id in (QML_CLASS, REFERENCE_QML_CLASS):
        return f"{class_id} is an overlay: add it by the Overlays menu, --overlay or app.add_qml()"
    hint = similar(class_id, known) or f"; there are: {', '.join(known)}"
    return f"no package has the class {class_id}{hint}"
