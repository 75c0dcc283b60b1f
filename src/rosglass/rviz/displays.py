"""RViz's displays."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rosglass.errors import Error
from rosglass.overlay.displays import Display, Displays, Status
from rosglass.qt import QtCore
from rosglass.rviz.host import Hook, address, as_pyside, class_of
from rosglass.rviz.plugins import DISPLAY, declared
from rosglass.rviz.properties import (
    describe_properties,
    find_property,
    read_property,
    write_property,
)
from rosglass.rviz.tools import loading_error

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rosglass.rviz.window import Window

__all__ = ["RvizDisplays"]


#: Milliseconds between checks for changes that RViz does not signal.
_PERIOD_MS = 200
#: Length to which paths are cut in errors.
_MAX_SHOWN = 120
_SIGNALS = ("displayAdded(rviz::Display*)", "displayRemoved(rviz::Display*)")


class RvizDisplay(Display):
    """One display of RViz."""

    _REMOVED = "was removed or moved; ask for it again"

    def __init__(self, owner: RvizDisplays, handle: Any) -> None:
        super().__init__(owner, handle, str(handle.getClassId()))

    def _read(self) -> tuple[str, bool, Status]:
        handle = self.handle
        return str(handle.getName()), bool(handle.isEnabled()), _status_of(handle)

    def _rename(self, name: str) -> None:
        self.handle.setName(name)

    def _enable(self, enabled: bool) -> None:
        self.handle.setEnabled(enabled)


class RvizDisplays(Displays):
    """The displays of an RViz.

    A display that the user drags to another group is removed and added again.
    """

    def __init__(self, window: Window) -> None:
        super().__init__()
        self._window = window
        self._hook = Hook(self._on_change)
        self._root = window.manager.getRootDisplayGroup()
        self._groups: set[int] = set()
        self._start()
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
        return _status_of(self._root)

    def close(self) -> None:
        """Stop checking for changes; safe to call twice."""
        self._timer.stop()

    def describe(self, handle: Any) -> list[dict[str, Any]]:
        """Return the properties of a display, or of RViz for None; see `describe_properties`."""
        return describe_properties(self._of(handle))

    def read(self, handle: Any, path: str, name: str) -> Any:
        """Return the value of a property; see :func:`rosglass.rviz.properties.read_property`."""
        return read_property(find_property(self._of(handle), path, name or "RViz"))

    def write(self, handle: Any, path: str, value: Any, name: str) -> None:
        """Change a property; see :func:`rosglass.rviz.properties.write_property`."""
        found = find_property(self._of(handle), path, name or "RViz")
        write_property(found, value, (f"{name}/{path}" if name else path)[:_MAX_SHOWN])

    def _of(self, handle: Any) -> Any:
        return self._root if handle is None else handle

    def _add(self, class_id: str, name: str, enabled: bool) -> Any:
        handle = self._window.manager.createDisplay(class_id, name, enabled)
        text = loading_error(handle, class_id, DISPLAY)
        if text:
            self._remove(handle)
            self.emit_changes()
            raise Error(f"no display was added: {text}")
        return handle

    def _remove(self, handle: Any) -> None:
        self._window.flush_panels()
        wrapped = as_pyside(handle, QtCore.QObject)
        # Like RViz's panel: delete it later, because other threads may have emitted its signals.
        handle.disconnect()
        handle.getParent().takeChild(handle)
        wrapped.deleteLater()

    def _key(self, handle: Any) -> int:
        return address(handle)

    def _create(self, handle: Any) -> Display:
        return RvizDisplay(self, handle)

    def _handles(self) -> list[Any]:
        found, groups = [], set()
        for handle, is_group in _walk(self._root):
            if handle is not self._root:
                found.append(handle)
            if is_group:
                at = address(handle)
                groups.add(at)
                if at not in self._groups:
                    self._hook.watch(handle, *_SIGNALS)
        self._groups = groups
        return found


def _status_of(item: Any) -> Status:
    """Return the status of a display of RViz; of RViz for the root display group."""
    for index in range(item.numChildren()):
        child = item.childAt(index)
        if class_of(child) == "rviz::StatusList":
            level = str(child.getName()).rpartition(":")[2].strip().lower()
            each = [child.childAt(at) for at in range(child.numChildren())]
            lines = [f"{one.getName()}: {one.getValue()}" for one in each]
            return Status(level or "ok", "\n".join(lines))
    return Status("ok", "")


def _walk(group: Any) -> Iterator[tuple[Any, bool]]:
    """Iterate over a group and all displays in it, as pairs (display, is it a group)."""
    yield group, True
    for index in range(group.numDisplays()):
        inner = group.getGroupAt(index)
        if inner is not None:
            yield from _walk(inner)
        else:
            yield group.getDisplayAt(index), False
