"""The tools of a 3D view: list, selection, adding and removing."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rosglass.errors import UnsupportedError
from rosglass.overlay.plugins import Plugin, PluginList
from rosglass.qt import Signal

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = ["Tool", "Tools"]


class Tool(Plugin):
    """One tool, created by :class:`Tools`; its members stay readable after removal.

    Args:
        owner: The list.
        handle: The 3D view's own object.
        class_id: RViz's class id, e.g. ``rviz/Measure``; not unique.
        shortcut_key: The key that selects it, e.g. ``m``; empty for none.
    """

    def __init__(self, owner: Tools, handle: Any, class_id: str, shortcut_key: str) -> None:
        self.shortcut_key = shortcut_key
        super().__init__(owner, handle, class_id)

    def _read(self) -> tuple[str, str]:
        """Return name and description."""
        raise NotImplementedError(f"{type(self).__name__} must implement _read()")

    @property
    def name(self) -> str:
        """The text of its button; not unique."""
        return str(self._state[0])

    @property
    def description(self) -> str:
        """Description of the tool."""
        return str(self._state[1])

    @property
    def selected(self) -> bool:
        """True if it is the selected tool."""
        return self.exists and self._owner.current is self

    def select(self) -> None:
        """Select the tool.

        Raises:
            Error: It was removed.
        """
        self._owner.select(self)

    def picture(self) -> Any:
        """Return its icon, a ``QPixmap``; a null pixmap if it has none."""
        raise NotImplementedError(f"{type(self).__name__} must implement picture()")


class Tools(PluginList):
    """The tools of a 3D view; `changed` reports a new name or description.

    Derived classes also implement :meth:`_select`, :meth:`_add` and :meth:`_remove`.
    """

    NOUN, EXAMPLE = "tool", "rviz/Measure"

    #: Another tool was selected.
    selected = Signal()

    def __init__(self) -> None:
        super().__init__()
        self._known_current: Tool | None = None

    @property
    def current(self) -> Tool | None:
        """The selected tool; None if there is none."""
        raise NotImplementedError(f"{type(self).__name__} must implement current")

    def find(self, class_id: str) -> Tool | None:
        """Return the first tool of a class; None if there is none."""
        return next((tool for tool in self._items if tool.class_id == class_id), None)

    def select(self, tool: Tool) -> None:
        """Select a tool.

        Raises:
            Error: It was removed.
        """
        tool.require()
        self._select(tool)
        self.emit_changes()

    def add(self, class_id: str) -> Tool:
        """Add a tool.

        Args:
            class_id: RViz's class id, e.g. ``rviz/Measure``.

        Raises:
            Error: The class does not exist, or could not be loaded.
        """
        made: Tool = self._item_of(self._add(self._require_class_id(class_id)))
        self.emit_changes()
        return made

    def ask_for_new(self) -> None:
        """Open a dialog for adding a tool, from the event loop.

        Raises:
            UnsupportedError: There is none.
        """
        raise UnsupportedError("there is no dialog for adding tools; give addTool() a class id")

    def remove(self, tool: Tool) -> None:
        """Remove a tool; if it was selected, the first one is selected.

        Raises:
            Error: It was removed before.
        """
        tool.require()
        self._remove(tool)
        self.emit_changes()

    def remove_all(self) -> None:
        """Remove all tools."""
        raise NotImplementedError(f"{type(self).__name__} must implement remove_all()")

    def _select(self, tool: Tool) -> None:
        raise NotImplementedError(f"{type(self).__name__} must implement _select()")

    def _add(self, class_id: str) -> Any:
        """Add a tool and return its handle."""
        raise NotImplementedError(f"{type(self).__name__} must implement _add()")

    def _remove(self, tool: Tool) -> None:
        raise NotImplementedError(f"{type(self).__name__} must implement _remove()")

    def _sync_rest(self) -> Callable[[], None]:
        before, self._known_current = self._known_current, self.current
        return self.selected.emit if self._known_current is not before else lambda: None
