"""Settings of displays and tools: RViz's properties, as QML properties.

A class body says ``cellSize = Setting("Cell Size", "float", 1.0, "metres", min=0.0001)``. That
makes the QML property ``cellSize``, refuses values that do not fit, and reads and writes the value
in ``.rviz`` files under RViz's name. A path with slashes is a property below another one.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar

from rosglass.comm.names import similar
from rosglass.errors import Error
from rosglass.overlay.property_values import KINDS
from rosglass.qml.engine.properties import Writable
from rosglass.qt import QtGui
from rosglass.scene.configs.rviz_formats import read_color, setting_text

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

__all__ = ["Configurable", "Setting", "rgb_of"]

_QT_TYPES: dict[str, type] = {
    "bool": bool,
    "int": int,
    "float": float,
    "string": str,
    "path": str,
    "enum": str,
    "topic": str,
    "frame": str,
    "color": QtGui.QColor,
    "vector": QtGui.QVector3D,
    "quaternion": QtGui.QQuaternion,
}
#: Kinds whose values are text.
_TEXTS = {"enum", "frame", "path", "string", "topic"}


def rgb_of(color: QtGui.QColor) -> tuple[float, float, float]:
    """Return red, green and blue from 0 to 1."""
    return color.redF(), color.greenF(), color.blueF()


class Setting(Writable[Any]):
    """One setting.

    Args:
        path: Its name in RViz, with those that it stands below: ``Covariance/Position/Alpha``.
        kind: Of ``bool``, ``int``, ``float``, ``string``, ``path``, ``enum``, ``topic``, ``frame``,
            ``color``, ``vector`` and ``quaternion``.
        default: RViz's default.
        description: Its effect, with its unit.
        then: Method to call after a change.
        shown_if: When it has an effect: values of other properties, or tuples of them, by their
            names. Panels hide it otherwise, as RViz does. None for always.
        options: Limits of the values: `min`, `max`, `choices`.
    """

    def __init__(
        self,
        path: str,
        kind: str,
        default: Any,
        description: str = "",
        *,
        then: str = "_restyle",
        shown_if: Mapping[str, Any] | None = None,
        **options: Any,
    ) -> None:
        self.path, self.description = path, description
        self._shown_if = {
            name: values if isinstance(values, tuple) else (values,)
            for name, values in (shown_if or {}).items()
        }
        self.kind = KINDS[kind](**options)
        self.default = self.kind.read(default)
        #: The QML property.
        self.name = ""
        super().__init__(_QT_TYPES[kind], self.default, self._accept_value, then=then)

    def _accept_value(self, value: Any) -> Any:
        try:
            return self.kind.read(value)
        except Error as error:
            raise Error(f"{self.name}: {error}") from None

    def is_shown(self, owner: Any) -> bool:
        """Return whether it has an effect on what it is a setting of, by the other properties."""
        return all(getattr(owner, name) in values for name, values in self._shown_if.items())

    def __set_name__(self, owner: type[Any], name: str) -> None:
        self.name = name
        super().__set_name__(owner, name)
        # One of a base class is replaced where it stands, even if its path is another.
        before: dict[str, Setting] = getattr(owner, "SETTINGS", {})
        owner.SETTINGS = {
            self.path if setting.name == name else path: self if setting.name == name else setting
            for path, setting in before.items()
        }
        owner.SETTINGS[self.path] = self

    def restore(self, saved: Any) -> Any:
        """Return the value that a ``.rviz`` file keeps.

        Raises:
            Error: The setting cannot hold it.
        """
        if self.kind.NAME == "color" and isinstance(saved, str) and ";" in saved:
            return QtGui.QColor.fromRgbF(*read_color(saved, self.path))
        if self.kind.NAME in _TEXTS and isinstance(saved, (bool, int, float)):
            saved = setting_text(saved)  # a name that YAML takes for a number
        return self.kind.restore(saved)

    def saved(self, value: Any) -> Any:
        """Return a value in the form that ``.rviz`` files keep."""
        if self.kind.NAME == "color":
            return f"{value.red()}; {value.green()}; {value.blue()}"
        return self.kind.saved(value)


class Configurable:
    """Mix-in for QObjects with settings.

    Attributes:
        SETTINGS: All settings by their path, those of base classes first.
    """

    SETTINGS: ClassVar[dict[str, Setting]] = {}
    #: Values that replaced invalid ones of a file, by setting.
    _instead: Mapping[str, Any] = {}

    def _setting(self, path: str) -> Setting:
        found = self.SETTINGS.get(path)
        if found is None:
            hint = similar(path, self.SETTINGS) or f"; there are: {', '.join(self.SETTINGS)}"
            raise Error(f"{self.label} has no setting {path!r}{hint}")
        return found

    @property
    def label(self) -> str:
        """The name of the owner of the settings, in error messages."""
        return type(self).__name__

    def get(self, path: str) -> Any:
        """Return the value of a setting.

        Args:
            path: RViz's name, e.g. ``Cell Size`` or ``Offset``.

        Raises:
            Error: There is no such setting.
        """
        return getattr(self, self._setting(path).name)

    def set(self, path: str, value: Any) -> None:
        """Change a setting.

        Raises:
            Error: There is no such setting, or it cannot hold the value.
        """
        setting = self._setting(path)
        try:
            accepted = setting.kind.read(value)
        except Error as error:
            raise Error(f"{self.label}, {path}: {error}") from None
        setattr(self, setting.name, accepted)

    def describe(self) -> Iterator[dict[str, Any]]:
        """Iterate over the settings: path, kind, value, default, description and options."""
        for path, setting in self.SETTINGS.items():
            yield {
                "path": path,
                "name": setting.name,
                "kind": setting.kind.NAME,
                "value": getattr(self, setting.name),
                "default": setting.default,
                "description": setting.description,
                **setting.kind.options,
            }

    def load_settings(self, saved: Mapping[str, Any]) -> list[str]:
        """Apply the settings in a ``.rviz`` file; leave others as they are.

        Returns:
            What was left out, in words: values that do not fit.
        """
        refused = []
        instead = self._instead = {}
        for path, setting in self.SETTINGS.items():
            value: Any = saved
            for part in path.split("/"):
                value = value.get(part) if isinstance(value, dict) else None
            if isinstance(value, dict) and "Value" in value:
                value = value["Value"]
            if value is None or (isinstance(value, dict) and setting.kind.HOLDS_OTHERS):
                continue
            try:
                setattr(self, setting.name, setting.restore(value))
            except Error as error:
                refused.append(f"{path}: {error}")
                instead[path] = getattr(self, setting.name)
        return refused

    def save_settings(
        self,
        older: Mapping[str, Any] | None = None,
        ros: int = 2,  # noqa: ARG002 - for subclasses
    ) -> dict[str, Any]:
        """Return the settings as a ``.rviz`` file keeps them.

        Args:
            older: What a file had; what is not a setting, or did not fit and was not changed, stays
                in it as it is.
            ros: The RViz that the file is for, 1 or 2.
        """
        kept: dict[str, Any] = dict(older or {})
        for path, setting in self.SETTINGS.items():
            *above, last = path.split("/")
            place = kept
            for part in above:
                inner = place.get(part)
                inner = (
                    dict(inner)
                    if isinstance(inner, dict)
                    else ({} if inner is None else {"Value": inner})
                )
                place[part] = inner
                place = inner
            now, before = getattr(self, setting.name), place.get(last)
            if before is not None and path in self._instead and self._instead[path] == now:
                continue
            value = setting.saved(now)
            if isinstance(before, dict) and not isinstance(value, dict):
                place[last] = {**before, "Value": value}
            else:
                place[last] = value
        return kept
