"""``rviz.toolManager`` in QML, and its tools with their icons."""
# ruff: noqa: N802 N815 - the names of slots, properties and signals are QML's

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rosglass.errors import Error
from rosglass.qt import Property, QJSValue, QtCore, Signal, Slot
from rosglass.rviz.face import Face, given, taking
from rosglass.rviz.host import pyqt
from rosglass.rviz.property_values import shown
from rosglass.rviz.qt5 import QtGui, QtQuick

if TYPE_CHECKING:
    from rosglass.qml.runtime import Runtime
    from rosglass.rviz.tools import Tool, Tools

__all__ = ["PROVIDER", "QmlTool", "QmlToolManager", "ToolIcons"]
#: Qt reads lists of texts into what it has of them already, and so twice.
_LIST: Any = "QVariantList"

#: What the addresses of icons begin with, after ``image://``.
PROVIDER = "rviz_tool_icons"
#: Pixels of an icon that is asked for without a size.
_SIZE = 48
_LARGEST = 1024


class QmlTool(Face):
    """One tool. Its members stay readable once it is removed."""

    CALLED = "tool"

    isSelectedChanged = Signal()
    #: Its name or description.
    changed = Signal()
    existsChanged = Signal()

    def __init__(self, tool: Tool, runtime: Runtime, parent: QtCore.QObject) -> None:
        super().__init__(runtime, parent)
        self.tool = tool

    isSelected = Property(bool, lambda self: self.tool.selected, notify=isSelectedChanged)
    exists = Property(bool, lambda self: self.tool.exists, notify=existsChanged)
    name = Property(str, lambda self: self.tool.name, notify=changed)
    description = Property(str, lambda self: self.tool.description, notify=changed)
    shortcutKey = Property(str, lambda self: self.tool.shortcut_key, constant=True)
    classId = Property(str, lambda self: self.tool.class_id, constant=True)
    iconSource = Property(str, lambda self: f"image://{PROVIDER}/{self.classId}", constant=True)

    @Slot()
    def select(self) -> None:
        """Give it the mouse."""
        with self._telling("tool.select"):
            self.tool.select()

    @Slot()
    def remove(self) -> None:
        """Remove it from RViz."""
        with self._telling("tool.remove"):
            self.tool._owner.remove(self.tool)


class QmlToolManager(Face):
    """RViz's tools."""

    CALLED = "rviz.toolManager"

    toolsChanged = Signal()
    toolAdded = Signal(QtCore.QObject, arguments=["tool"])
    toolRemoved = Signal(QtCore.QObject, arguments=["tool"])
    #: Another tool has the mouse.
    toolChanged = Signal(QtCore.QObject, arguments=["tool"])

    def __init__(self, tools: Tools, runtime: Runtime, parent: QtCore.QObject) -> None:
        super().__init__(runtime, parent)
        self._tools = tools
        self._faces: dict[Tool, QmlTool] = {}
        tools.added.connect(self._on_added)
        tools.removed.connect(self._on_removed)
        tools.selected.connect(self._on_selected)
        tools.changed.connect(self._on_changed)

    def _face(self, tool: Tool) -> QmlTool:
        face = self._faces.get(tool)
        if face is None:
            face = self._faces[tool] = QmlTool(tool, self._runtime, self)
        return face

    def _get_tools(self) -> list[Any]:
        return [self._face(tool) for tool in self._tools.all]

    def _get_current(self) -> QJSValue:
        current = self._tools.current
        return self._to_js(None if current is None else self._face(current))

    def _set_current(self, value: QJSValue) -> None:
        with self._telling("rviz.toolManager.currentTool"):
            self._wanted(value).select()

    #: In the order of their buttons.
    tools = Property(_LIST, _get_tools, notify=toolsChanged)
    #: The tool that has the mouse; takes a tool or the id of a class.
    currentTool = Property(QJSValue, _get_current, _set_current, notify=toolChanged)
    #: Ids of the classes that can be added.
    toolClasses = Property(_LIST, lambda self: self._tools.classes, constant=True)

    @taking(0, 1)
    def addTool(self, class_id: QJSValue | None = None) -> QJSValue:
        """Add a tool of a class, and return it; without one, show RViz's dialog instead."""
        with self._telling("rviz.toolManager.addTool"):
            if class_id is None or class_id.isUndefined():
                self._tools.ask_for_new()
            else:
                return self._to_js(self._face(self._tools.add(given(class_id))))
        return self._to_js(None)

    @taking(1, 1)
    def getTool(self, class_id: QJSValue) -> QJSValue:
        """Return the first tool of a class; null where there is none."""
        with self._telling("rviz.toolManager.getTool"):
            wanted = given(class_id)
            if not isinstance(wanted, str):
                raise Error(f"expected the id of a class, e.g. 'rviz/Measure', got {shown(wanted)}")
            tool = self._tools.find(wanted)
            return self._to_js(None if tool is None else self._face(tool))
        return self._to_js(None)

    @taking(1, 1, None)
    def removeTool(self, tool: QJSValue) -> None:
        """Remove a tool; takes a tool, its place among the tools, or the id of a class."""
        with self._telling("rviz.toolManager.removeTool"):
            self._tools.remove(self._wanted(tool))

    @Slot()
    def removeAll(self) -> None:
        """Remove every tool."""
        self._tools.remove_all()

    def _wanted(self, value: QJSValue) -> Tool:
        wanted, there = given(value), self._tools.all
        if isinstance(wanted, QmlTool):
            return wanted.tool
        if isinstance(wanted, int) and not isinstance(wanted, bool):
            if 0 <= wanted < len(there):
                return there[wanted]
            known = f"there are {len(there)}, the first one is 0" if there else "there are none"
            raise Error(f"there is no tool {wanted}; {known}")
        if isinstance(wanted, str):
            found = self._tools.find(wanted)
            if found is not None:
                return found
            known = ", ".join(tool.class_id for tool in there) or "none"
            named = [t.class_id for t in there if wanted in (t.name, t.class_id.rpartition("/")[2])]
            hint = f"; did you mean {named[0]!r}?" if named else f"; there are: {known}"
            raise Error(f"there is no tool of the class {shown(wanted)}{hint}")
        raise Error(f"expected a tool, its place, or the id of a class, got {shown(wanted)}")

    @Slot(object)
    def _on_added(self, tool: Tool) -> None:
        self.toolsChanged.emit()
        self.toolAdded.emit(self._face(tool))

    @Slot(object)
    def _on_removed(self, tool: Tool) -> None:
        face = self._face(tool)
        self._faces.pop(tool, None)
        face.let_go()
        self.toolsChanged.emit()
        face.existsChanged.emit()
        face.isSelectedChanged.emit()
        self.toolRemoved.emit(face)

    @Slot()
    def _on_selected(self) -> None:
        for face in list(self._faces.values()):
            face.isSelectedChanged.emit()
        current = self._tools.current
        self.toolChanged.emit(None if current is None else self._face(current))

    @Slot(object)
    def _on_changed(self, tool: Tool) -> None:
        if tool in self._faces:
            self._faces[tool].changed.emit()


class ToolIcons(QtQuick.QQuickImageProvider):  # type: ignore[misc]
    """Gives ``image://rviz_tool_icons/<classId>``; asked in the GUI thread only.

    The largest size there is, scaled to what is asked for, 48 pixels otherwise; a width or height
    alone keeps the proportions.

    Args:
        tools: The tools.
    """

    def __init__(self, tools: Tools) -> None:
        super().__init__(QtQuick.QQuickImageProvider.Pixmap)
        self._tools = tools

    def requestPixmap(self, name: str, size: Any, requested: Any) -> Any:
        """Return an icon; transparent where there is no such tool, or no icon."""
        tool = self._tools.find(name)
        icon = tool.icon() if tool is not None else None
        picture = self._largest(icon)
        width, height = (requested.width(), requested.height())
        if picture.isNull():
            side = min(max(width, height, 0) or _SIZE, _LARGEST)
            picture = QtGui.QPixmap(side, side)
            picture.fill(QtGui.QColor(0, 0, 0, 0))
        wide, high = picture.width(), picture.height()
        if width <= 0 and height <= 0:
            factor = _SIZE / max(wide, high)
            width, height = round(wide * factor), round(high * factor)
        elif width <= 0:
            width = round(wide * height / high)
        elif height <= 0:
            height = round(high * width / wide)
        width, height = (min(max(side, 1), _LARGEST) for side in (width, height))
        scaled = picture.scaled(
            width,
            height,
            QtCore.Qt.AspectRatioMode.KeepAspectRatio,
            QtCore.Qt.TransformationMode.SmoothTransformation,
        )
        if size is not None:
            size.setWidth(scaled.width())
            size.setHeight(scaled.height())
        return scaled

    @staticmethod
    def _largest(icon: Any) -> Any:
        sizes = icon.availableSizes() if icon is not None else []
        if not sizes:
            return QtGui.QPixmap()
        best = max(sizes, key=lambda one: one.width() * one.height())
        core = pyqt()
        kept, buffer = core.QByteArray(), core.QBuffer()
        buffer.setBuffer(kept)
        buffer.open(core.QIODevice.WriteOnly)
        # A pixmap of one binding is none of the other's.
        icon.pixmap(best).save(buffer, "PNG")
        made = QtGui.QPixmap()
        made.loadFromData(bytes(kept.data()), "PNG")
        return made
