"""The displays of a 3D view: list, status, properties, adding and removing."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from rosglass.comm.names import similar
from rosglass.errors import Error
from rosglass.overlay.plugins import Plugin, PluginList
from rosglass.overlay.property_values import shown
from rosglass.qt import Signal

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

__all__ = ["Display", "Displays", "Status"]


_MAX_NAME_LENGTH = 1000


class Status(NamedTuple):
    """The status of a display, or of the 3D view."""

    #: ``ok``, ``warn`` or ``error``.
    level: str
    #: The status messages, one per line.
    text: str


class Display(Plugin):
    """One display, created by :class:`Displays`; name and class stay readable after removal.

    Derived classes implement the methods that raise NotImplementedError here.
    """

    _REMOVED = "was removed; ask for it again"

    def _read(self) -> tuple[str, bool, Status]:
        """Return name, whether it is shown, and status."""
        raise NotImplementedError(f"{type(self).__name__} must implement _read()")

    @property
    def name(self) -> str:
        """Its name in the panel, which need not be unique.

        Raises:
            Error: When setting it: the name is not a line of text, or the display was removed.
        """
        return str(self._now()[0])

    @name.setter
    def name(self, name: str) -> None:
        self.require()
        self._rename(_plain_name(name))
        self._owner.emit_changes()

    @property
    def enabled(self) -> bool:
        """True while the display is shown.

        Raises:
            Error: When setting it: the display was removed.
        """
        return self.exists and bool(self._now()[1])

    @enabled.setter
    def enabled(self, enabled: bool) -> None:
        self.require()
        self._enable(enabled)
        self._owner.emit_changes()

    @property
    def status(self) -> Status:
        """Its status; an error after removal."""
        if not self.exists:
            return Status("error", f"{self.name} was removed")
        status: Status = self._now()[2]
        return status

    def properties(self) -> list[dict[str, Any]]:
        """Return all its properties as nested dicts.

        Raises:
            Error: The display was removed.
        """
        properties: list[dict[str, Any]] = self._owner.describe(self.require())
        return properties

    def get(self, path: str | Sequence[str]) -> Any:
        """Return the value of a property.

        Args:
            path: Path of the property, e.g. ``Offset/X``.

        Raises:
            Error: The property does not exist, or the display was removed.
        """
        return self._owner.read(self.require(), joined_path(path), self.name)

    def set(self, path: str | Sequence[str], value: Any) -> None:
        """Change a property.

        Args:
            path: Path of the property, e.g. ``Offset/X``.
            value: Its new value.

        Raises:
            Error: The property does not exist, does not accept the value, or the display was
                removed.
        """
        self._owner.write(self.require(), joined_path(path), value, self.name)
        self._owner.emit_changes()

    def _rename(self, name: str) -> None:
        raise NotImplementedError(f"{type(self).__name__} must implement _rename()")

    def _enable(self, enabled: bool) -> None:
        raise NotImplementedError(f"{type(self).__name__} must implement _enable()")


class Displays(PluginList):
    """The displays of a 3D view, including those in groups.

    `changed` reports a new name, a new status, and showing or hiding. Derived classes implement
    the methods that raise NotImplementedError here.
    """

    NOUN, EXAMPLE = "display", "rviz/Grid"

    #: :attr:`status` has changed.
    status_changed = Signal()

    def __init__(self) -> None:
        super().__init__()
        self._status: Status | None = None

    @property
    def status(self) -> Status:
        """The view's own status, e.g. an error for an unknown fixed frame."""
        raise NotImplementedError(f"{type(self).__name__} must implement status")

    def find(self, name: str) -> Display | None:
        """Return the first display with the given name; None if there is none."""
        return next((display for display in self._items if display.name == name), None)

    def get(self, path: str | Sequence[str]) -> Any:
        """Return the value of a property of any display, or of the view.

        Args:
            path: Path of the property, e.g. ``Grid/Color`` or ``Global Options/Background Color``.

        Raises:
            Error: The property does not exist.
        """
        display, rest = self._split(joined_path(path))
        return self.read(None, rest, "") if display is None else display.get(rest)

    def set(self, path: str | Sequence[str], value: Any) -> None:
        """Change a property of any display, or of the view; see :meth:`get`.

        Raises:
            Error: The property does not exist, or does not accept the value.
        """
        display, rest = self._split(joined_path(path))
        if display is None:
            self.write(None, rest, value, "")
            self.emit_changes()
        else:
            display.set(rest, value)

    def options(self) -> list[dict[str, Any]]:
        """Return the view's global options as nested dicts, as those of displays."""
        return self.describe(None)

    def _split(self, path: str) -> tuple[Display | None, str]:
        """Return the display of a path and the path below it; None for one of the view.

        Raises:
            Error: Neither a display nor a property of the view has the first name.
        """
        for display in self._items:
            if path.startswith(f"{display.name}/"):
                return display, path[len(display.name) + 1 :]
        first, _, below = path.partition("/")
        found = self.find(first)
        if found is not None and not below:
            own = next((one["name"] for one in found.properties()), "Alpha")
            example = f"{first}/{own}"
            raise Error(f"{first!r} is a display; name one of its properties, e.g. {example!r}")
        known = [*(one["name"] for one in self.options()), *(one.name for one in self._items)]
        if first not in known:
            hint = similar(first, known) or f"; there are: {', '.join(known)}"
            raise Error(f"nothing in the Displays panel is called {shown(first)}{hint}")
        return None, path

    def add(self, class_id: str, name: str = "", *, enabled: bool = True) -> Display:
        """Append a display.

        Args:
            class_id: RViz's class id, e.g. ``rviz/Grid``.
            name: Its name; by default the class name.
            enabled: Whether to show it.

        Raises:
            Error: The class does not exist, or could not be loaded.
        """
        class_id = self._require_class_id(class_id)
        title = _plain_name(name) if name else class_id.rpartition("/")[2]
        made: Display = self._item_of(self._add(class_id, title, enabled))
        self.emit_changes()
        return made

    def remove(self, display: Display) -> None:
        """Remove a display, and if it is a group, the displays in it.

        Raises:
            Error: It was removed before.
        """
        self._remove(display.require())
        self.emit_changes()

    def close(self) -> None:
        """Stop checking for changes; safe to call twice."""

    def describe(self, handle: Any) -> list[dict[str, Any]]:
        """Return the properties of a display, or of the view for None, as nested dicts."""
        raise NotImplementedError(f"{type(self).__name__} must implement describe()")

    def read(self, handle: Any, path: str, name: str) -> Any:
        """Return the value of a property of a display, or of the view for None.

        Raises:
            Error: The property does not exist; the error begins with `name`.
        """
        raise NotImplementedError(f"{type(self).__name__} must implement read()")

    def write(self, handle: Any, path: str, value: Any, name: str) -> None:
        """Change a property of a display, or of the view for None.

        Raises:
            Error: The property does not exist, or does not accept the value.
        """
        raise NotImplementedError(f"{type(self).__name__} must implement write()")

    def _add(self, class_id: str, name: str, enabled: bool) -> Any:
        """Append a display and return its handle."""
        raise NotImplementedError(f"{type(self).__name__} must implement _add()")

    def _remove(self, handle: Any) -> None:
        raise NotImplementedError(f"{type(self).__name__} must implement _remove()")

    def _sync_rest(self) -> Callable[[], None]:
        before, self._status = self._status, self.status
        return self.status_changed.emit if self._status != before else lambda: None


def _plain_name(name: object) -> str:
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


def joined_path(path: str | Sequence[str]) -> str:
    """Return a path that is given as a text or as a list of names as a text."""
    return path if isinstance(path, str) else "/".join(map(str, path))
