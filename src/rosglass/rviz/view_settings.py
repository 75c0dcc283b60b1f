"""How RViz's camera is moved: what the operator sets in the Displays panel, and files keep."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING, Any, Generic, TypeVar, overload

from rosglass.errors import Error
from rosglass.ros1.names import expand
from rosglass.rviz.registered_properties import RegisteredProperties
from rosglass.rviz.shown import shown

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.rviz.registered_property import RegisteredProperty

__all__ = ["ViewSettings"]

_log = logging.getLogger("rosglass.rviz")
_T = TypeVar("_T", bool, float, str)


class _Setting(Generic[_T]):
    """One setting, an attribute of :class:`ViewSettings`.

    Args:
        kind: Of registered properties.
        name: In the panel and in files.
        default: Where neither a file nor a program says otherwise.
        about: What it does, for people.
        check: Raises an Error for what is not valid, besides what the kind refuses.
        options: Of the kind.
    """

    def __init__(
        self,
        kind: str,
        name: str,
        default: _T,
        about: str,
        check: Callable[[_T], object] = bool,
        **options: Any,
    ) -> None:
        self.kind, self.name, self.about, self.options = kind, name, about, options
        self.default: _T = default
        self._check: Callable[[_T], object] = check

    @overload
    def __get__(self, settings: None, kind: type[ViewSettings]) -> _Setting[_T]: ...

    @overload
    def __get__(self, settings: ViewSettings, kind: type[ViewSettings]) -> _T: ...

    def __get__(self, settings: ViewSettings | None, kind: type[ViewSettings]) -> _T | _Setting[_T]:
        if settings is None:
            return self
        value: _T = self.of(settings).get()
        return value

    def __set__(self, settings: ViewSettings, value: _T) -> None:
        try:
            self.give(settings, value)
        except Error as error:
            raise Error(f"{self.name}: {error}") from None

    def give(self, settings: ViewSettings, value: object) -> None:
        """Set it, for a program; the error does not name it.

        Raises:
            Error: It cannot be that.
        """
        try:
            read = self.of(settings).kind.read(value)
            self._check(read)
        except Error:
            if "max" not in self.options:
                raise
            low, high = self.options["min"], self.options["max"]
            raise Error(f"expected a number from {low:g} to {high:g}, got {shown(value)}") from None
        settings.by_program[self.name] = read
        self.of(settings).set(read)

    def of(self, settings: ViewSettings) -> RegisteredProperty:
        """Return the property with its value, and the signal that it is another."""
        return settings.properties.properties[self.name]


class ViewSettings:
    """How the camera is moved, and by whom besides the mouse.

    Attributes are read and set::

        app.view.settings.animation_duration = 0.5

    Raises:
        Error: One is set to what it cannot be; the error says what it can.
    """

    animation_duration = _Setting(
        "float",
        "Animation Duration",
        1.0,
        "Seconds that a movement takes; 0 jumps.",
        min=0.0,
        max=60.0,
        step=0.1,
    )
    tracking_gain = _Setting(
        "float",
        "Tracking Gain",
        3.0,
        "How quickly the camera follows the tracked frame, in 1/s: high ones follow at once, "
        "low ones smoothly.",
        min=0.0,
        max=1000.0,
        step=0.5,
    )
    keys = _Setting(
        "bool",
        "Keyboard Navigation",
        True,
        "Whether arrow keys shift the view, twice as fast with Shift, and Ctrl+D switches between "
        "2D and 3D, while the 3D view has the keys.",
    )
    speed = _Setting(
        "float",
        "Movement Speed",
        4.0,
        "Metres per second while an arrow key is held.",
        min=0.0,
        max=1000.0,
    )
    topics = _Setting(
        "bool", "Enable Topics", True, "Whether robots are told the mode and the tracked frame."
    )
    services = _Setting(
        "bool", "Enable Services", True, "Whether robots may move the camera by services."
    )
    namespace = _Setting(
        "string",
        "Namespace",
        "~hector_view_controller",
        "Where topics and services are: a name of ROS, of which ~ stands for RViz's node.",
        lambda name: expand(name, "rviz", "/"),
    )

    def __init__(self) -> None:
        #: As the panel shows them.
        self.properties = RegisteredProperties()
        #: What has been set by Python or QML, by name.
        self.by_program: dict[str, Any] = {}
        for found in vars(ViewSettings).values():
            if isinstance(found, _Setting):
                self.properties.register(
                    found.kind,
                    found.name,
                    default=found.default,
                    description=found.about,
                    **found.options,
                )

    def save(self) -> dict[str, Any]:
        """Return all values by name, as a file keeps them."""
        return self.properties.save()

    def load(self, saved: dict[str, Any]) -> None:
        """Take what a file has; what it does not have is as a program has set it, or as at first.

        Args:
            saved: Values by name, which may be text; one that does not fit is told in the log.
        """
        for setting in vars(ViewSettings).values():
            if isinstance(setting, _Setting):
                found, name = setting.of(self), setting.name
                value = self.by_program.get(name, setting.default)
                if name in saved:
                    try:
                        value = found.kind.restore(saved[name])
                    except Error as error:
                        _log.warning("the view's %s in the file: %s", name.lower(), error)
                found.set(value)
