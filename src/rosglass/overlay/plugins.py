"""The base of the lists of tools and displays of a 3D view."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rosglass.comm.names import similar
from rosglass.errors import Error
from rosglass.overlay.property_values import shown
from rosglass.qt import QtCore, Signal, Slot

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

__all__ = ["Plugin", "PluginList"]


_MAX_ID_LENGTH = 200


class Plugin:
    """A tool or a display in its list, which creates it; its texts stay readable after removal.

    Args:
        owner: The list.
        handle: The 3D view's own object.
        class_id: RViz's class id, e.g. ``rviz/Grid``; not unique.
    """

    #: The reason in the error of :meth:`require` after removal.
    _REMOVED = "was removed"

    def __init__(self, owner: Any, handle: Any, class_id: str) -> None:
        self._owner = owner
        #: The 3D view's own object; None after removal.
        self.handle: Any = handle
        self.class_id = class_id
        self._state = self._read()

    def _read(self) -> Any:
        """Return its state, with the name at first; not called after removal."""
        raise NotImplementedError(f"{type(self).__name__} must implement _read()")

    def _now(self) -> Any:
        return self._state if self.handle is None else self._read()

    def refresh(self) -> bool:
        """Read the state; return whether it has changed."""
        before, self._state = self._state, self._now()
        return bool(before != self._state)

    @property
    def exists(self) -> bool:
        """True until it is removed."""
        return self.handle is not None

    def remove(self) -> None:
        """Remove it.

        Raises:
            Error: It was removed before.
        """
        self._owner.remove(self)

    def require(self) -> Any:
        """Return the 3D view's own object.

        Raises:
            Error: It was removed.
        """
        if self.handle is None:
            raise Error(f"the {self._owner.NOUN} {self._state[0]} {self._REMOVED}")
        return self.handle


class PluginList(QtCore.QObject):
    """Base class of the list of tools and the list of displays.

    Derived classes implement :meth:`_handles`, :meth:`_create` and :meth:`_sync_rest`, and call
    :meth:`_start` in their ``__init__``. Signals are emitted from the event loop, when the view has
    finished its work, so that slots may add and remove items.
    """

    #: An item was added. Argument: the item.
    added = Signal(object)
    #: An item was removed. Argument: the item.
    removed = Signal(object)
    #: An item has changed. Argument: the item.
    changed = Signal(object)
    #: The word for an item in errors, and a class id as an example.
    NOUN = EXAMPLE = ""

    def __init__(self) -> None:
        super().__init__()
        self._items: list[Any] = []
        self._known: list[Any] = []
        self._scheduled = False

    def _start(self) -> None:
        """Read the items and other state that there are already, without signals."""
        self._sync_items()
        self._known = list(self._items)
        self._sync_rest()

    @property
    def all(self) -> list[Any]:
        """The items in the order of the panel or tool bar."""
        return list(self._items)

    @property
    def classes(self) -> list[str]:
        """Class ids of what can be added."""
        raise NotImplementedError(f"{type(self).__name__} must implement classes")

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

    def _handles(self) -> Iterable[Any]:
        """Return the view's present objects."""
        raise NotImplementedError(f"{type(self).__name__} must implement _handles()")

    def _create(self, handle: Any) -> Plugin:
        """Return a new item."""
        raise NotImplementedError(f"{type(self).__name__} must implement _create()")

    def _key(self, handle: Any) -> int:
        """Return a key that is unique among the existing handles."""
        return id(handle)

    def _sync_items(self) -> None:
        """Update the items; drop handles that the view is about to delete: addresses are reused."""
        known = {self._key(item.handle): item for item in self._items}
        self._items = [
            known.pop(self._key(handle), None) or self._create(handle) for handle in self._handles()
        ]
        for item in known.values():
            item.handle = None

    def _sync_rest(self) -> Callable[[], None]:
        """Read other state that may have changed; return a function that emits its signals."""
        raise NotImplementedError(f"{type(self).__name__} must implement _sync_rest()")

    def _item_of(self, handle: Any) -> Any:
        """Return the item of a handle that was just added."""
        self._sync_items()
        key = self._key(handle)
        return next(item for item in self._items if self._key(item.handle) == key)

    def _require_class_id(self, class_id: object) -> str:
        """Return a class id unchanged.

        Raises:
            Error: It is not a string of the form ``package/Class``.
        """
        if isinstance(class_id, str) and len(class_id) <= _MAX_ID_LENGTH:
            package, slash, name = class_id.partition("/")
            if slash and all(p.replace("_", "").isalnum() and p.isascii() for p in (package, name)):
                return class_id
        near = similar(class_id, self.classes) if isinstance(class_id, str) else ""
        raise Error(f"expected a class id, e.g. {self.EXAMPLE!r}, got {shown(class_id)}{near}")

    @Slot()
    def _on_change(self) -> None:
        self._sync_items()
        if not self._scheduled:
            self._scheduled = True
            QtCore.QTimer.singleShot(0, self.emit_changes)
