"""Settings of the view controller, which the panel shows and ``.rviz`` files keep."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING, Any, Generic, TypeVar, overload

from rosglass.errors import Error
from rosglass.overlay.property_values import shown
from rosglass.overlay.registered_properties import RegisteredProperties
from rosglass.wires.tcpros.graph import expand

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.overlay.registered_properties import RegisteredProperty

__all__ = ["CONTROLLER_CLASS", "ControllerSetting", "ViewSettings"]


_log = logging.getLogger("rosglass.overlay")
#: Class id of the view controller's entry in ``.rviz`` files.
CONTROLLER_CLASS = "rosglass/ViewController"
_T = TypeVar("_T", bool, float, str)


class ControllerSetting(Generic[_T]):
    """Descriptor of one setting of :class:`ViewSettings`.

    Args:
        kind: Kind of the registered property.
        name: Name in the panel and in files.
        default: Value unless a file or the program sets another.
        about: Description for the panel.
        check: Raises an Error for invalid values, in addition to the kind's own check.
        options: Options of the kind.
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
    def __get__(self, settings: None, kind: type[ViewSettings]) -> ControllerSetting[_T]: ...

    @overload
    def __get__(self, settings: ViewSettings, kind: type[ViewSettings]) -> _T: ...

    def __get__(
        self, settings: ViewSettings | None, kind: type[ViewSettings]
    ) -> _T | ControllerSetting[_T]:
        if settings is None:
            return self
        value: _T = self.of(settings).get()
        return value

    def __set__(self, settings: ViewSettings, value: _T) -> None:
        try:
            self.set(settings, value)
        except Error as error:
            raise Error(f"{self.name}: {error}") from None

    def set(self, settings: ViewSettings, value: object) -> None:
        """Set the value on behalf of the program.

        Raises:
            Error: The value is invalid; the message does not name the setting.
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
        """Return the registered property that holds the value."""
        return settings.properties.properties[self.name]


def _check_namespace(name: str) -> None:
    if name:
        expand(name, "rviz", "/")


class ViewSettings:
    """Settings of the view controller, as attributes.

    ::

        app.view.settings.animation_duration = 0.5

    Raises:
        Error: A value is invalid; the message says what is valid.
    """

    animation_duration = ControllerSetting(
        "float",
        "Animation Duration",
        1.0,
        "Duration of a camera movement in seconds; 0 jumps.",
        min=0.0,
        max=60.0,
        step=0.1,
    )
    tracking_gain = ControllerSetting(
        "float",
        "Tracking Gain",
        3.0,
        "How quickly the camera follows the tracked frame, in 1/s: high values follow at once, "
        "low values smoothly.",
        min=0.0,
        max=1000.0,
        step=0.5,
    )
    keys = ControllerSetting(
        "bool",
        "Keyboard Navigation",
        True,
        "Let arrow keys shift the view, twice as fast with Shift, and Ctrl+D switch between "
        "2D and 3D, while the 3D view has the keyboard focus.",
    )
    speed = ControllerSetting(
        "float",
        "Movement Speed",
        4.0,
        "Speed of the view in m/s while an arrow key is held.",
        min=0.0,
        max=1000.0,
    )
    topics = ControllerSetting(
        "bool", "Enable Topics", True, "Publish the mode and the tracked frame."
    )
    services = ControllerSetting(
        "bool", "Enable Services", True, "Let robots move the camera through services."
    )
    namespace = ControllerSetting(
        "string",
        "Namespace",
        "",
        "Namespace of the topics and services: a ROS name, in which ~ stands for the node; empty "
        "for ~hector_view_controller in ROS 1, hector_view_controller in ROS 2.",
        _check_namespace,
    )

    def __init__(self) -> None:
        #: The settings as registered properties, which the panel shows.
        self.properties = RegisteredProperties()
        #: Values set by Python or QML, by name.
        self.by_program: dict[str, Any] = {}
        for found in vars(ViewSettings).values():
            if isinstance(found, ControllerSetting):
                self.properties.register(
                    found.kind,
                    found.name,
                    default=found.default,
                    description=found.about,
                    **found.options,
                )

    def set(self, attribute: str, value: object) -> None:
        """Set an attribute.

        Raises:
            Error: The value is invalid; the message does not name the attribute.
        """
        setting: ControllerSetting[Any] = getattr(ViewSettings, attribute)
        setting.set(self, value)

    def changed(self, attribute: str) -> Any:
        """Return the signal that is emitted when an attribute changes."""
        setting: ControllerSetting[Any] = getattr(ViewSettings, attribute)
        return setting.of(self).valueChanged

    def save(self) -> dict[str, Any]:
        """Return all values by name, as saved in a file."""
        return self.properties.save()

    def load(self, saved: dict[str, Any]) -> None:
        """Restore values from a file; missing ones revert to the program's values or the defaults.

        Args:
            saved: Values by name, possibly as text; invalid ones are logged.
        """
        for setting in vars(ViewSettings).values():
            if isinstance(setting, ControllerSetting):
                found, name = setting.of(self), setting.name
                value = self.by_program.get(name, setting.default)
                if name in saved:
                    try:
                        value = found.kind.restore(saved[name])
                    except Error as error:
                        _log.warning("the view's %s in the file: %s", name.lower(), error)
                found.set(value)
