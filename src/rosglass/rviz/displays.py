"""RViz's displays: their list, status and properties; adding and removing them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from rosglass.comm.names import similar
from rosglass.errors import Error
from rosglass.qt import QtCore, Signal
from rosglass.rviz.host import address, as_pyside, class_of
from rosglass.rviz.plugins import DISPLAY, Watched, declared, require_class_id
from rosglass.rviz.properties import (
    child_properties,
    describe_properties,
    find_property,
    read_property,
    write_property,
)
from rosglass.rviz.property_values import shown
from rosglass.rviz.qt5 import QtWidgets
from rosglass.rviz.tools import failure

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from rosglass.rviz.window import Window

__all__ = ["Display", "Displays", "Status", "status_of"]


#: Milliseconds between checks of what RViz has no signal for.
_PERIOD_MS = 200
_MAX_NAME_LENGTH = 1000
_SIGNALS = ("displayAdded(rviz::Display*)", "displayRemoved(rviz::Display*)")


class Status(NamedTuple):
    """The status of a display."""

    #: ``ok``, ``warn`` or ``error``.
    level: str
    #: What it says about itself, one line for each; empty where it says nothing.
    text: str


def status_of(item: Any) -> Status:
    """Return the status below a display, or of RViz below its root."""
    for index in range(item.numChildren()):
        child = item.childAt(index)
        if class_of(child) == "rviz::StatusList":
            level = str(child.getName()).rpartition(":")[2].strip().lower()
            each = [child.childAt(at) for at in range(child.numChildren())]
            lines = [f"{one.getName()}: {one.getValue()}" for one in each]
            return Status(level or "ok", "\n".join(lines))
    return Status("ok", "")


class Display:
    """One display; its name and class stay readable once it is gone. Made by :class:`Displays`."""

    def __init__(self, owner: Displays, handle: Any) -> None:
        self._owner = owner
        #: RViz's display; None once it is gone.
        self.handle: Any = handle
        #: The class, e.g. ``rviz/Grid``.
        self.class_id = str(handle.getClassId())
        self._state = self._read()

    def _read(self) -> tuple[str, bool, Status]:
        if self.handle is None:
            return self._state
        handle = self.handle
        return str(handle.getName()), bool(handle.isEnabled()), status_of(handle)

    def refresh(self) -> bool:
        """Read its state; return whether it has changed."""
        before, self._state = self._state, self._read()
        return before != self._state

    @property
    def exists(self) -> bool:
        """Whether RViz still has it."""
        return self.handle is not None

    @property
    def at(self) -> int:
        """Its address in memory; 0 once it is gone."""
        return 0 if self.handle is None else address(self.handle)

    @property
    def name(self) -> str:
        """Its name in the panel; several displays may have the same.

        Raises:
            Error: It is set to no text of one line, or the display is gone.
        """
        return self._read()[0]

    @name.setter
    def name(self, name: str) -> None:
        self.require().setName(_plain_name(name))
        self._owner.emit_changes()

    @property
    def enabled(self) -> bool:
        """Whether it is shown.

        Raises:
            Error: It is set once the display is gone.
        """
        return self.exists and self._read()[1]

    @enabled.setter
    def enabled(self, enabled: bool) -> None:
        self.require().setEnabled(enabled)
        self._owner.emit_changes()

    @property
    def status(self) -> Status:
        """Its status; an error once it is gone."""
        return self._read()[2] if self.exists else Status("error", f"{self.name} was removed")

    def properties(self) -> list[dict[str, Any]]:
        """Return all its properties; see :func:`rosglass.rviz.properties.describe_properties`.

        Raises:
            Error: It is gone.
        """
        return describe_properties(self.require())

    def get(self, path: str | Sequence[str]) -> Any:
        """Return the value of a property; see :func:`rosglass.rviz.properties.read_property`.

        Args:
            path: E.g. ``Offset/X``.

        Raises:
            Error: It has no such property, or is gone.
        """
        return read_property(find_property(self.require(), path, self.name))

    def set(self, path: str | Sequence[str], value: Any) -> None:
        """Change a property; see :func:`rosglass.rviz.properties.write_property`.

        Args:
            path: E.g. ``Offset/X``.
            value: Its new value.

        Raises:
            Error: It has no such property or is gone, or the property cannot hold the value.
        """
        found = find_property(self.require(), path, self.name)
        write_property(found, value, f"{self.name}/{path}")
        self._owner.emit_changes()

    def remove(self) -> None:
        """Remove it from RViz.

        Raises:
            Error: It is gone.
        """
        self._owner.remove(self)

    def require(self) -> Any:
        """Return RViz's display.

        Raises:
            Error: It is gone.
        """
        if self.handle is None:
            raise Error(f"the display {self.name} was removed or moved; ask for it again")
        return self.handle


class Displays(Watched):
    """The displays of an RViz, those in groups included.

    What changes of one is its name, its status, or whether it is shown; one that is dragged to
    another group is another one then.
    """

    #: RViz's own status has changed, e.g. to an unknown fixed frame.
    status_changed = Signal()

    def __init__(self, window: Window) -> None:
        super().__init__(window)
        self._root = window.manager.getRootDisplayGroup()
        self._items: list[Display]
        self._status = status_of(self._root)
        self._groups: set[int] = set()
        self._sync_items()
        self._known = list(self._items)
        self._timer = QtCore.QTimer(self)
        self._timer.setInterval(_PERIOD_MS)
        self._timer.timeout.connect(self.emit_changes)
        self._timer.start()

    @property
    def classes(self) -> list[str]:
        """Ids of the classes that can be added."""
        return list(declared(DISPLAY))

    @property
    def status(self) -> Status:
        """RViz's own status, e.g. whether the fixed frame is known."""
        return status_of(self._root)

    def find(self, name: str) -> Display | None:
        """Return the first display of a name."""
        return next((display for display in self._items if display.name == name), None)

    def get(self, path: str | Sequence[str]) -> Any:
        """Return the value of a property of any display, or of RViz.

        Args:
            path: E.g. ``Grid/Color`` or ``Global Options/Background Color``.

        Raises:
            Error: There is no such property.
        """
        return read_property(self._find_property(path))

    def set(self, path: str | Sequence[str], value: Any) -> None:
        """Change a property of any display, or of RViz; see :meth:`get`.

        Raises:
            Error: There is no such property, or it cannot hold the value.
        """
        names = path if isinstance(path, str) else "/".join(map(str, path))
        write_property(self._find_property(names), value, names[:120])
        self.emit_changes()

    def options(self) -> list[dict[str, Any]]:
        """Return RViz's global options, as `describe_properties` does."""
        return describe_properties(self._root)

    def _find_property(self, path: str | Sequence[str]) -> Any:
        names = path if isinstance(path, str) else "/".join(map(str, path))
        for display in self._items:
            if names.startswith(f"{display.name}/"):
                rest = names[len(display.name) + 1 :]
                return find_property(display.require(), rest, display.name)
        self._require_first(names)
        return find_property(self._root, names, "RViz")

    def _require_first(self, path: str) -> None:
        """Raise an Error if nothing in the panel has the first name of a path."""
        first, _, below = path.partition("/")
        displays = [display.name for display in self._items]
        known = [*(str(c.getName()) for c in child_properties(self._root)), *displays]
        display = self.find(first)
        if display is not None and not below:
            example = f"{first}/{next(child_properties(display.handle)).getName()}"
            raise Error(f"{first!r} is a display; name one of its properties, e.g. {example!r}")
        if first not in known:
            hint = similar(first, known) or f"; there are: {', '.join(known)}"
            raise Error(f"nothing in the Displays panel is called {shown(first)}{hint}")

    def add(self, class_id: str, name: str = "", *, enabled: bool = True) -> Display:
        """Add a display, as the last one.

        Args:
            class_id: E.g. ``rviz/Grid``.
            name: Its name; that of the class by default.
            enabled: Whether it is shown.

        Raises:
            Error: There is no such class, or it could not be loaded.
        """
        class_id = require_class_id(class_id, DISPLAY)
        shown = _plain_name(name) if name else class_id.rpartition("/")[2]
        handle = self._window.manager.createDisplay(class_id, shown, enabled)
        text = failure(handle, class_id, DISPLAY)
        if text:
            self._delete(handle)
            self.emit_changes()
            raise Error(f"no display was added: {text}")
        self._sync_items()
        at = address(handle)
        made = next(display for display in self._items if display.at == at)
        self.emit_changes()
        return made

    def remove(self, display: Display) -> None:
        """Remove a display, with those in it.

        Raises:
            Error: It was removed before.
        """
        self._delete(display.require())
        self.emit_changes()

    def _delete(self, handle: Any) -> None:
        self.flush_panels()
        wrapped = as_pyside(handle, QtCore.QObject)
        # As RViz's own panel does it: displays may have sent signals from other threads.
        handle.disconnect()
        handle.getParent().takeChild(handle)
        wrapped.deleteLater()

    def flush_panels(self) -> None:
        """Deliver what is queued for RViz's panels.

        They hide and show properties later, and crash if a display was removed in between.
        """
        event = int(QtCore.QEvent.Type.MetaCall)
        for tree in self._window.widget.findChildren(QtWidgets.QTreeView):
            QtCore.QCoreApplication.sendPostedEvents(tree, event)

    def _sync_rest(self) -> Callable[[], None]:
        before, self._status = self._status, self.status
        return self.status_changed.emit if self._status != before else lambda: None

    def close(self) -> None:
        """Stop checking for changes; safe to call twice."""
        self._timer.stop()

    def _sync_items(self) -> None:
        known = {display.at: display for display in self._items}
        found, groups = [], set()
        for handle, is_group in _walk(self._root):
            at = address(handle)
            if handle is not self._root:
                found.append(known.pop(at) if at in known else Display(self, handle))
            if is_group:
                groups.add(at)
                if at not in self._groups:
                    self._hook.watch(handle, *_SIGNALS)
        self._items, self._groups = found, groups
        for display in known.values():
            display.handle = None


def _walk(group: Any) -> Iterator[tuple[Any, bool]]:
    """Iterate over a group and the displays in it, each with whether it is a group."""
    yield group, True
    for index in range(group.numDisplays()):
        inner = group.getGroupAt(index)
        if inner is not None:
            yield from _walk(inner)
        else:
            yield group.getDisplayAt(index), False


def _plain_name(name: object) -> str:
    if (
        isinstance(name, str)
        and name.strip()
        and len(name) <= _MAX_NAME_LENGTH
        and name.isprintable()
    ):
        return name
    raise Error(f"expected a name, a text of one line, got {shown(name)}")
