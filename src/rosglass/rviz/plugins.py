"""RViz's plugin classes as declared by packages, and the common base of `Tools` and `Displays`."""

from __future__ import annotations

import os
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree

from rosglass.comm.names import similar
from rosglass.errors import Error
from rosglass.interfaces.provider import workspace
from rosglass.qt import QtCore, Signal
from rosglass.rviz.property_values import shown

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

__all__ = ["DISPLAY", "TOOL", "VIEW", "PluginList", "declared", "require_class_id"]


DISPLAY, TOOL, VIEW = "rviz::Display", "rviz::Tool", "rviz::ViewController"
_EXAMPLES = {DISPLAY: "rviz/Grid", TOOL: "rviz/Measure", VIEW: "rviz/Orbit"}
#: Prefix of Debian's ROS packages, which rospack finds without environment variables.
_SYSTEM = "/usr/share"
_MAX_ID_LENGTH = 200


@cache
def declared(base: str) -> tuple[str, ...]:
    """Return the class ids of all plugins of a type; like RViz, searches once per process.

    Args:
        base: Base class: :data:`DISPLAY`, :data:`TOOL` or :data:`VIEW`.
    """
    found = [element for file in _descriptions() for element in _classes(file)]
    names = {
        element.get("name") or element.get("type", "").replace("::", "/")
        for element in found
        if element.get("base_class_type") == base
    }
    return tuple(sorted(names - {""}))


def require_class_id(class_id: object, base: str) -> str:
    """Return a class id unchanged.

    Raises:
        Error: It is not a string of the form ``package/Class``.
    """
    if isinstance(class_id, str) and len(class_id) <= _MAX_ID_LENGTH:
        package, slash, name = class_id.partition("/")
        if slash and all(p.replace("_", "").isalnum() and p.isascii() for p in (package, name)):
            return class_id
    near = similar(class_id, declared(base)) if isinstance(class_id, str) else ""
    example = _EXAMPLES[base]
    raise Error(f"expected a class id, e.g. {example!r}, got {shown(class_id)}{near}")


def _descriptions() -> Iterator[str]:
    """Iterate over the plugin description files of RViz (REP 140, section "<export>")."""
    folders = dict(workspace(os.environ).packages())
    for manifest in Path(_SYSTEM).glob("*/package.xml"):
        folders.setdefault(manifest.parent.name, str(manifest.parent))
    for folder in folders.values():
        try:
            root = ElementTree.parse(Path(folder, "package.xml")).getroot()
        except (OSError, ElementTree.ParseError):
            continue
        for element in root.iterfind("./export/rviz"):
            yield element.get("plugin", "").replace("${prefix}", folder)


def _classes(file: str) -> list[ElementTree.Element]:
    try:
        return list(ElementTree.parse(file).getroot().iter("class"))
    except (OSError, ElementTree.ParseError):
        # RViz itself logs the error.
        return []


class PluginList(QtCore.QObject):
    """Base class of the list of tools and the list of displays.

    Derived classes implement :meth:`_sync_items`, which updates :attr:`_items`, and
    :meth:`_sync_rest`. Signals are emitted from the event loop, when RViz has finished its work, so
    that slots may add and remove items.
    """

    #: An item was added. Argument: the item.
    added = Signal(object)
    #: An item was removed. Argument: the item.
    removed = Signal(object)
    #: An item has changed. Argument: the item.
    changed = Signal(object)

    def __init__(self) -> None:
        super().__init__()
        #: Items have `handle` (None after removal), `exists` and `refresh()`.
        self._items: list[Any] = []
        self._known: list[Any] = []
        self._scheduled = False

    @property
    def all(self) -> list[Any]:
        """The items in the order of RViz's panel or tool bar."""
        return list(self._items)

    def emit_changes(self) -> None:
        """Emit the signals of all changes since the last call."""
        self._scheduled = False
        self._sync_items()
        before, self._known = self._known, list(self._items)
        emit_rest = self._sync_rest()
        for item in before:
            if not item.exists:
                self.removed.emit(item)
        for item in self._known:
            if item not in before:
                # RViz names a display only after it has announced it.
                item.refresh()
                self.added.emit(item)
            elif item.refresh():
                self.changed.emit(item)
        emit_rest()

    def _sync_items(self) -> None:
        """Update the items; drop handles that RViz is about to delete: addresses are reused."""
        raise NotImplementedError(f"{type(self).__name__} must implement _sync_items()")

    def _sync_rest(self) -> Callable[[], None]:
        """Read other state that may have changed; return a function that emits its signals."""
        raise NotImplementedError(f"{type(self).__name__} must implement _sync_rest()")

    def _on_change(self) -> None:
        self._sync_items()
        if not self._scheduled:
            self._scheduled = True
            QtCore.QTimer.singleShot(0, self.emit_changes)
