"""RViz's tools."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rosglass.comm.names import similar
from rosglass.errors import Error
from rosglass.overlay.tools import Tool, Tools
from rosglass.rviz.host import Hook, address, mangled_class_of, pyqt
from rosglass.rviz.overlay import QML_CLASS, REFERENCE_QML_CLASS
from rosglass.rviz.plugins import DISPLAY, TOOL, declared
from rosglass.rviz.qt5 import QtGui

if TYPE_CHECKING:
    from rosglass.rviz.window import Window

__all__ = ["RvizTools", "loading_error"]

#: RViz's placeholder classes for tools and displays that could not be loaded.
_FAILED = ("N4rviz10FailedToolE", "N4rviz13FailedDisplayE")


class RvizTool(Tool):
    """One tool of RViz."""

    def __init__(self, owner: RvizTools, handle: Any) -> None:
        key = str(handle.getShortcutKey())
        super().__init__(owner, handle, str(handle.getClassId()), "" if key == "\0" else key)

    def _read(self) -> tuple[str, str]:
        return str(self.handle.getName()), " ".join(str(self.handle.getDescription()).split())

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


class RvizTools(Tools):
    """The tools of an RViz."""

    def __init__(self, window: Window) -> None:
        super().__init__()
        self._window = window
        self._hook = Hook(self._on_change)
        self._manager = window.manager.getToolManager()
        signals = ("toolAdded(Tool*)", "toolRemoved(Tool*)", "toolChanged(Tool*)")
        self._hook.watch(self._manager, *signals, "toolRefreshed(Tool*)")
        self._start()

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

    def ask_for_new(self) -> None:
        """Open RViz's dialog for adding a tool, from the event loop."""
        core = pyqt()
        frame, queued = self._window.frame, core.Qt.QueuedConnection
        core.QMetaObject.invokeMethod(frame, "openNewToolDialog", queued)

    def remove_all(self) -> None:
        """Remove all tools; the mouse does nothing in the 3D view until one is added."""
        self._manager.removeAll()
        self.emit_changes()

    def _handles(self) -> list[Any]:
        return [self._manager.getTool(index) for index in range(self._manager.numTools())]

    def _key(self, handle: Any) -> int:
        return address(handle)

    def _create(self, handle: Any) -> Tool:
        return RvizTool(self, handle)

    def _select(self, tool: Tool) -> None:
        self._manager.setCurrentTool(tool.handle)

    def _add(self, class_id: str) -> Any:
        handle = self._manager.addTool(class_id)
        text = loading_error(handle, class_id, TOOL)
        if text:
            self._manager.removeTool(self._manager.numTools() - 1)
            self.emit_changes()
            raise Error(f"no tool was added: {text}")
        return handle

    def _remove(self, tool: Tool) -> None:
        self._manager.removeTool(self._items.index(tool))


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
