"""What RViz can make, by the packages that declare it, and what there is of it."""

from __future__ import annotations

import os
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple
from xml.etree import ElementTree

from rosglass.comm.names import similar
from rosglass.errors import Error
from rosglass.interfaces.provider import workspace
from rosglass.qt import QtCore, Signal
from rosglass.rviz.host import Hook
from rosglass.rviz.property_values import shown

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from rosglass.rviz.window import Window

__all__ = ["DISPLAY", "TOOL", "VIEW", "Plugin", "Watched", "declared", "require_class_id"]


DISPLAY, TOOL, VIEW = "rviz::Display", "rviz::Tool", "rviz::ViewController"
_EXAMPLES = {DISPLAY: "rviz/Grid", TOOL: "rviz/Measure", VIEW: "rviz/Orbit"}
#: Where Debian has its packages, which rospack finds without any variable.
_SYSTEM = "/usr/share"
_MAX_ID_LENGTH = 200


class Plugin(NamedTuple):
    """A class that RViz can make."""

    #: E.g. ``rviz/Measure``.
    class_id: str
    #: What its package says about it.
    description: str


@cache
def declared(base: str) -> dict[str, Plugin]:
    """Return the classes of a kind by their id; found once per process, as RViz does.

    Args:
        base: :data:`DISPLAY`, :data:`TOOL` or :data:`VIEW`.
    """
    found: dict[str, Plugin] = {}
    for file in _descriptions():
        for element in _classes(file):
            name = element.get("name") or element.get("type", "").replace("::", "/")
            if element.get("base_class_type") == base and name:
                about = " ".join((element.findtext("description") or "").split())
                found.setdefault(name, Plugin(name, about))
    return dict(sorted(found.items()))


def require_class_id(class_id: object, base: str) -> str:
    """Return the id of a class, if it is one.

    Raises:
        Error: It is no text of the form ``package/Class``.
    """
    if isinstance(class_id, str) and len(class_id) <= _MAX_ID_LENGTH:
        package, slash, name = class_id.partition("/")
        if slash and all(p.replace("_", "").isalnum() and p.isascii() for p in (package, name)):
            return class_id
    near = similar(class_id, declared(base)) if isinstance(class_id, str) else ""
    example = _EXAMPLES[base]
    raise Error(f"expected the id of a class, e.g. {example!r}, got {shown(class_id)}{near}")


def _descriptions() -> Iterator[str]:
    """Iterate over files that describe plugins of RViz (REP 140, section "<export>")."""
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
        # RViz logs it.
        return []


class Watched(QtCore.QObject):
    """All tools, or all displays, of an RViz.

    A base class: :meth:`_sync_items` brings :attr:`_items` up to date, and :meth:`_sync_rest` says
    what else has changed. Signals are emitted once RViz has finished what it was doing, so that
    slots may add and remove items.
    """

    #: One came: itself.
    added = Signal(object)
    #: One went: itself.
    removed = Signal(object)
    #: One is another way than before: itself.
    changed = Signal(object)

    def __init__(self, window: Window) -> None:
        super().__init__()
        self._window = window
        #: Each has `handle`, None once it is gone, `exists`, and `refresh()`.
        self._items: list[Any] = []
        self._known: list[Any] = []
        self._scheduled = False
        self._hook = Hook(self._on_change)

    @property
    def all(self) -> list[Any]:
        """The items in RViz's order."""
        return list(self._items)

    def emit_changes(self) -> None:
        """Emit signals for what has changed since the last call."""
        self._scheduled = False
        self._sync_items()
        before, self._known = self._known, list(self._items)
        emit_rest = self._sync_rest()
        for item in before:
            if not item.exists:
                self.removed.emit(item)
        for item in self._known:
            if item not in before:
                self.added.emit(item)
            elif item.refresh():
                self.changed.emit(item)
        emit_rest()

    def _sync_items(self) -> None:
        """Update the items; drop what RViz is about to delete before its address is reused."""
        raise NotImplementedError(f"{type(self).__name__} has to give _sync_items()")

    def _sync_rest(self) -> Callable[[], None]:
        """Read what else may change beside the items; return what emits its signals."""
        raise NotImplementedError(f"{type(self).__name__} has to give _sync_rest()")

    def _on_change(self) -> None:
        self._sync_items()
        if not self._scheduled:
            self._scheduled = True
            QtCore.QTimer.singleShot(0, self.emit_changes)
