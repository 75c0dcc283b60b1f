"""RViz's displays: list, status, properties, adding and removing."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from rosglass.comm.names import similar
from rosglass.errors import Error
from rosglass.qt import QtCore, Signal
from rosglass.rviz.host import Hook, address, as_pyside, class_of
from rosglass.rviz.plugins import DISPLAY, PluginList, declared, require_class_id
from rosglass.rviz.properties import (
    child_properties,
    describe_properties,
    find_property,
    read_property,
    write_property,
)
from rosglass.rviz.property_values import shown
from rosglass.rviz.tools import loading_error

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from rosglass.rviz.window import Window

__all__ = ["Display", "Displays", "Status", "plain_name", "status_of"]


#: Milliseconds between checks for changes that RViz does not signal.
_PERIOD_MS = 200
_MAX_NAME_LENGTH = 1000
_SIGNALS = ("displayAdded(rviz::Display*)", "displayRemoved(rviz::Display*)")


class Status(NamedTuple):
    """The status of a display, or of RViz."""

    #: ``ok``, ``warn`` or ``error``.
    level: str
    #: The status messages, one per line.
    text: str


def status_of(item: Any) -> Status:
    """Return the status of a display; of RViz for the root display group."""
    for index in range(item.numChildren()):
        child = item.childAt(index)
        if class_of(child) == "rviz::StatusList":
            level = str(child.getName()).rpartition(":")[2].strip().lower()
            each = [child.childAt(at) for at in range(child.numChildren())]
            lines = [f"{one.getName()}: {one.getValue()}" for one in each]
            return Status(level or "ok", "\n".join(lines))
    return Status("ok", "")


class Display:
    """One display, created by :class:`Displays`; name and class stay readable after removal."""

    def __init__(self, owner: Displays, handle: Any) -> None:
        self._owner = owner
        #: RViz's display; None after removal.
        self.handle: Any = handle
        #: The class id, e.g. ``rviz/Grid``.
        self.class_id = str(handle.getClassId())
        self._state = self._read()

    def _read(self) -> tuple[str, bool, Status]:
        if self.handle is None:
            return self._state
        handle = self.handle
        return str(handle.getName()), bool(handle.isEnabled()), status_of(handle)

    def refresh(self) -> bool:
        """Read the state from RViz; return whether it has changed."""
        before, self._state = self._state, self._read()
        return before != self._state

    @property
    def exists(self) -> bool:
        """Whether RViz has not removed it."""
        return self.handle is not None

    @property
    def at(self) -> int:
        """Its address in memory; 0 after removal."""
        return 0 if self.handle is None else address(self.handle)

    @property
    def name(self) -> str:
        """Its name in the panel, which need not be unique.

        Raises:
            Error: When setting it: the name is not a line of text, or the display was removed.
        """
        return self._read()[0]

    @name.setter
    def name(self, name: str) -> None:
        self.require().setName(plain_name(name))
        self._owner.emit_changes()

    @property
    def enabled(self) -> bool:
        """Whether it is shown.

        Raises:
            Error: When setting it: the display was removed.
        """
        return self.exists and self._read()[1]

    @enabled.setter
    def enabled(self, enabled: bool) -> None:
        self.require().setEnabled(enabled)
        self._owner.emit_changes()

    @property
    def status(self) -> Status:
        """Its status; an error after removal."""
        return self._read()[2] if self.exists else Status("error", f"{self.name} was removed")

    def properties(self) -> list[dict[str, Any]]:
        """Return all its properties; see :func:`rosglass.rviz.properties.describe_properties`.

        Raises:
            Error: The display was removed.
        """
        return describe_properties(self.require())

    def get(self, path: str | Sequence[str]) -> Any:
        """Return the value of a property; see :func:`rosglass.rviz.properties.read_property`.

        Args:
            path: Path of the property, e.g. ``Offset/X``.

        Raises:
            Error: The property does not exist, or the display was removed.
        """
        return read_property(find_property(self.require(), path, self.name))

    def set(self, path: str | Sequence[str], value: Any) -> None:
        """Change a property; see :func:`rosglass.rviz.properties.write_property`.

        Args:
            path: Path of the property, e.g. ``Offset/X``.
            value: Its new value.

        Raises:
            Error: The property does not exist, does not accept the value, or the display was
                removed.
        """
        found = find_property(self.require(), path, self.name)
        write_property(found, value, f"{self.name}/{path}")
        self._owner.emit_changes()

    def remove(self) -> None:
        """Remove the display from RViz.

        Raises:
            Error: It was removed before.
        """
        self._owner.remove(self)

    def require(self) -> Any:
        """Return RViz's display.

        Raises:
            Error: It was removed.
        """
        if self.handle is None:
            raise Error(f"the display {self.name} was removed or moved; ask for it again")
        return self.handle


class Displays(PluginList):
    """The displays of an RViz, including those in groups.

    `changed` reports a new name, a new status, and showing or hiding. A display that the user
    drags to another group is removed and added again.
    """

    #: :attr:`status` has changed.
    status_changed = Signal()

    def __init__(self, window: Window) -> None:
        super().__init__()
        self._window = window
        self._hook = Hook(self._on_change)
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
        """Class ids of the displays that can be added."""
        return list(declared(DISPLAY))

    @property
    def status(self) -> Status:
        """RViz's own status, e.g. an error for an unknown fixed frame."""
        return status_of(self._root)

    def find(self, name: str) -> Display | None:
        """Return the first display with the given name; None if there is none."""
        return next((display for display in self._items if display.name == name), None)

    def get(self, path: str | Sequence[str]) -> Any:
        """Return the value of a property of any display, or of RViz.

        Args:
            path: Path of the property, e.g. ``Grid/Color`` or ``Global Options/Background Color``.

        Raises:
            Error: The property does not exist.
        """
        return read_property(self._find_property(path))

    def set(self, path: str | Sequence[str], value: Any) -> None:
        """Change a property of any display, or of RViz; see :meth:`get`.

        Raises:
            Error: The property does not exist, or does not accept the value.
        """
        names = path if isinstance(path, str) else "/".join(map(str, path))
        write_property(self._find_property(names), value, names[:120])
        self.emit_changes()

    def options(self) -> list[dict[str, Any]]:
        """Return RViz's global options; see `describe_properties`."""
        return describe_properties(self._root)

    def _find_property(self, path: str | Sequence[str]) -> Any:
        names = path if isinstance(path, str) else "/".join(map(str, path))
        for display in self._items:
            if names.startswith(f"{display.name}/"):
                rest = names[len(display.name) + 1 :]
                return find_property(display.require(), rest, display.name)
        self._require_known(names)
        return find_property(self._root, names, "RViz")

    def _require_known(self, path: str) -> None:
        """Raise an Error if no display or property of RViz has the first name of a path."""
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
        """Append a display.

        Args:
            class_id: Class id, e.g. ``rviz/Grid``.
            name: Its name; by default the class name.
            enabled: Whether to show it.

        Raises:
            Error: The class does not exist, or could not be loaded.
        """
        class_id = require_class_id(class_id, DISPLAY)
        shown = plain_name(name) if name else class_id.rpartition("/")[2]
        handle = self._window.manager.createDisplay(class_id, shown, enabled)
        text = loading_error(handle, class_id, DISPLAY)
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
        """Remove a display, and if it is a group, the displays in it.

        Raises:
            Error: It was removed before.
        """
        self._delete(display.require())
        self.emit_changes()

    def _delete(self, handle: Any) -> None:
        self._window.flush_panels()
        wrapped = as_pyside(handle, QtCore.QObject)
        # Like RViz's panel: delete it later, because other threads may have emitted its signals.
        handle.disconnect()
        handle.getParent().takeChild(handle)
        wrapped.deleteLater()

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
    """Iterate over a group and all displays in it, as pairs (display, is it a group)."""
    yield group, True
    for index in range(group.numDisplays()):
        inner = group.getGroupAt(index)
        if inner is not None:
            yield from _walk(inner)
        else:
            yield group.getDisplayAt(index), False


def plain_name(name: object) -> str:
    """Return the name of a display unchanged.

    Raises:
        Error: It is not a line of text of at most 1000 characters.
    """
    if (
        isinstance(name, str)
        and name.strip()
        and len(name) <= _MAX_NAME_LENGTH
        and name.isprintable()
    ):
        return name
    raise Error(f"expected a name, a text of one line, got {shown(name)}")
