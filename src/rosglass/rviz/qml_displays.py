"""RViz's displays in QML."""
# ruff: noqa: N815 - the names of slots, properties and signals are QML's

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rosglass.errors import Error
from rosglass.qt import Property, QJSValue, QtCore, Signal, Slot
from rosglass.rviz.face import VARIANT, Face, given, switch_of, taking, text_of
from rosglass.rviz.property_values import shown

if TYPE_CHECKING:
    from rosglass.qml.runtime import Runtime
    from rosglass.rviz.displays_access import Display, Displays

__all__ = ["QmlDisplay", "QmlDisplays", "path_of"]


class QmlDisplay(Face):
    """One display. Its name and class stay readable once it is removed."""

    CALLED = "display"

    #: Its name, status, or whether it is shown.
    changed = Signal()
    existsChanged = Signal()

    def __init__(self, display: Display, runtime: Runtime, parent: QtCore.QObject) -> None:
        super().__init__(runtime, parent)
        self.display = display

    def _set_name(self, name: Any) -> None:
        with self._telling("display.name"):
            self.display.name = text_of(name, "a name, a text of one line")

    def _set_enabled(self, enabled: Any) -> None:
        with self._telling("display.enabled"):
            self.display.enabled = switch_of(enabled)

    def _get_properties(self) -> QJSValue:
        display = self.display
        return self._runtime.value(display.properties() if display.exists else [])

    exists = Property(bool, lambda self: self.display.exists, notify=existsChanged)
    name = Property(VARIANT, lambda self: self.display.name, _set_name, notify=changed)
    classId = Property(str, lambda self: self.display.class_id, constant=True)
    enabled = Property(VARIANT, lambda self: self.display.enabled, _set_enabled, notify=changed)
    #: ``ok``, ``warn`` or ``error``.
    status = Property(str, lambda self: self.display.status.level, notify=changed)
    #: What it says about itself, one line for each.
    statusText = Property(str, lambda self: self.display.status.text, notify=changed)
    #: All its properties as they are now, nested.
    properties = Property(QJSValue, _get_properties, notify=existsChanged)

    @taking(1, 1)
    def get(self, path: QJSValue) -> QJSValue:
        """Return the value of a property, e.g. of ``Offset/X``."""
        with self._telling(f"{self.display.name}.get"):
            return self._runtime.value(self.display.get(path_of(path)))
        return QJSValue()

    @taking(2, 2, None)
    def set(self, path: QJSValue, value: QJSValue) -> None:
        """Change a property, as if it were done in the panel."""
        with self._telling(f"{self.display.name}.set"):
            self.display.set(path_of(path), given(value))

    @Slot()
    def remove(self) -> None:
        """Remove it from RViz."""
        with self._telling("display.remove"):
            self.display._owner.remove(self.display)


class QmlDisplays(Face):
    """The displays, each with one face."""

    changed = Signal()
    added = Signal(QtCore.QObject)
    removed = Signal(QtCore.QObject)
    statusChanged = Signal()

    def __init__(self, displays: Displays, runtime: Runtime, parent: QtCore.QObject) -> None:
        super().__init__(runtime, parent)
        self.displays = displays
        self._faces: dict[Display, QmlDisplay] = {}
        displays.added.connect(self._on_added)
        displays.removed.connect(self._on_removed)
        displays.changed.connect(self._on_changed)
        displays.status_changed.connect(self.statusChanged)

    def face(self, display: Display) -> QmlDisplay:
        """Return what QML sees of a display."""
        found = self._faces.get(display)
        if found is None:
            found = self._faces[display] = QmlDisplay(display, self._runtime, self)
        return found

    def all(self) -> list[Any]:
        """Return all of them."""
        return [self.face(display) for display in self.displays.all]

    def wanted(self, value: Any) -> Display:
        """Return the display that QML means by an object or a name.

        Raises:
            Error: There is none.
        """
        if isinstance(value, QmlDisplay):
            return value.display
        if not isinstance(value, str):
            raise Error(f"expected a display or its name, got {shown(value)}")
        found = self.displays.find(value)
        if found is None:
            names = ", ".join(display.name for display in self.displays.all) or "none"
            raise Error(f"there is no display {shown(value)}; there are: {names}")
        return found

    @Slot(object)
    def _on_added(self, display: Display) -> None:
        self.changed.emit()
        self.added.emit(self.face(display))

    @Slot(object)
    def _on_removed(self, display: Display) -> None:
        face = self.face(display)
        self._faces.pop(display, None)
        face.let_go()
        self.changed.emit()
        face.existsChanged.emit()
        face.changed.emit()
        self.removed.emit(face)

    @Slot(object)
    def _on_changed(self, display: Display) -> None:
        if display in self._faces:
            self._faces[display].changed.emit()


def path_of(value: QJSValue, example: str = "Offset/X") -> str | list[str]:
    """Return a path that QML gives, a text or a list of texts.

    Args:
        value: What was given.
        example: Such a path, for the error.

    Raises:
        Error: It is neither.
    """
    found = given(value)
    names = found if isinstance(found, list) else [found]
    if all(isinstance(name, str) for name in names) and names:
        path: str | list[str] = found
        return path
    raise Error(f"expected the path of a property, e.g. {example!r}, got {shown(found)}")
