"""The settings of views: RViz's properties, with its names, limits and form in files. No Qt."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Generic, TypeVar, overload

from rosglass.errors import ArgumentError
from rosglass.overlay.orbit import Point

if TYPE_CHECKING:
    from collections.abc import Iterable


__all__ = [
    "MAX_NAME_LENGTH",
    "ChoiceSetting",
    "FlagSetting",
    "FrameSetting",
    "NumberSetting",
    "PointSetting",
    "ScaleSetting",
    "ViewSetting",
    "finite_number",
    "setting_text",
    "setting_value",
]

MAX_NAME_LENGTH = 1000
#: Coordinates and distances are clamped to this, so that nothing overflows.
_FARTHEST_M = 1e9

_T = TypeVar("_T")


class ViewSetting(Generic[_T]):
    """A setting of a view: an attribute of it, and RViz's property in panels and files.

    Attributes:
        name: As RViz shows and saves it.
        default: Its value where neither a file nor a program says otherwise.
        description: A sentence for the panel.
    """

    #: As of the settings of displays.
    KIND = ""

    def __init__(self, name: str, default: _T, description: str) -> None:
        self.name, self.default, self.description = name, default, description

    @overload
    def __get__(self, view: None, owner: type) -> ViewSetting[_T]: ...

    @overload
    def __get__(self, view: Any, owner: type) -> _T: ...

    def __get__(self, view: Any | None, owner: type) -> ViewSetting[_T] | _T:
        if view is None:
            return self
        value: _T = view._values[self.name]
        return value

    def __set__(self, view: Any, value: Any) -> None:
        view._store(self.name, self.read(value))
        view._on_set(self.name)

    def read(self, value: Any) -> _T:
        """Return a value of a program or of a file as it is kept.

        Raises:
            ArgumentError: The value is invalid for this setting.
        """
        raise NotImplementedError

    def write(self, value: _T) -> Any:
        """Return a value as it stands in a file."""
        return value

    def options(self) -> dict[str, Any]:
        """Return the limits of the values, for the panel."""
        return {}


class NumberSetting(ViewSetting[float]):
    """A finite number; outside of its limits it is clamped, as in RViz.

    Attributes:
        low: The lowest value.
        high: The highest value.
    """

    KIND = "float"

    def __init__(
        self,
        name: str,
        default: float,
        description: str,
        low: float = -_FARTHEST_M,
        high: float = _FARTHEST_M,
    ) -> None:
        super().__init__(name, default, description)
        self.low, self.high = low, high

    def read(self, value: Any) -> float:
        """Return a number; PyYAML gives 1e-05 as a text."""
        return min(max(finite_number(value, self.name), self.low), self.high)

    def options(self) -> dict[str, Any]:
        """Return the limits."""
        return {"min": self.low, "max": self.high}


class ScaleSetting(NumberSetting):
    """A number of either sign; negative ones turn the view by half a turn, as in RViz."""

    def read(self, value: Any) -> float:
        """Return a number, at least as far from 0 as `low`: RViz draws nothing at 0."""
        number = finite_number(value, self.name)
        return math.copysign(min(max(abs(number), self.low), self.high), number)

    def options(self) -> dict[str, Any]:
        """Return the limits."""
        return {"min": -self.high, "max": self.high}


class FlagSetting(ViewSetting[bool]):
    """True or false."""

    KIND = "bool"

    def read(self, value: Any) -> bool:
        """Return a truth value; files also say ``"true"`` and 1."""
        if isinstance(value, str):
            value = {"true": True, "false": False}.get(value.strip().lower(), value)
        if not isinstance(value, (bool, int)) or value not in (0, 1):
            raise ArgumentError(self.name, value, "true or false")
        return bool(value)


class FrameSetting(ViewSetting[str]):
    """A frame's name."""

    KIND = "frame"

    def read(self, value: Any) -> str:
        """Return a name, without the slash in front that files of RViz 1 may have."""
        if isinstance(value, str) and value.startswith("/"):
            value = value[1:]
        if not isinstance(value, str) or not 0 < len(value) <= MAX_NAME_LENGTH:
            raise ArgumentError(
                self.name, value, f"a frame's name of 1 to {MAX_NAME_LENGTH} characters"
            )
        return value


class ChoiceSetting(ViewSetting[str]):
    """One of some names.

    Attributes:
        choices: The names.
    """

    KIND = "enum"

    def __init__(self, name: str, default: str, description: str, choices: Iterable[str]) -> None:
        super().__init__(name, default, description)
        self.choices = tuple(choices)

    def read(self, value: Any) -> str:
        """Return one of the names."""
        if value not in self.choices:
            raise ArgumentError(self.name, value, f"one of {', '.join(self.choices)}")
        return str(value)

    def options(self) -> dict[str, Any]:
        """Return the names."""
        return {"choices": self.choices}


class PointSetting(ViewSetting[Point]):
    """A point in metres: three numbers, in files X, Y and Z."""

    KIND = "vector"

    def read(self, value: Any) -> Point:
        """Return a point; of a file, with 0 for what is missing."""
        if isinstance(value, Mapping):
            value = [value.get(axis, 0.0) for axis in "XYZ"]
        try:
            x, y, z = value
        except (TypeError, ValueError):
            raise ArgumentError(self.name, value, "X, Y and Z in metres") from None
        numbers = (
            finite_number(n, f"{self.name}.{axis}")
            for n, axis in zip((x, y, z), "XYZ", strict=True)
        )
        return Point(*(min(max(number, -_FARTHEST_M), _FARTHEST_M) for number in numbers))

    def write(self, value: Point) -> dict[str, float]:
        """Return X, Y and Z."""
        return dict(zip("XYZ", value, strict=True))


def finite_number(value: Any, name: str) -> float:
    """Return a number.

    Raises:
        ArgumentError: The value is not a finite number; the error begins with `name`.
    """
    try:
        number = math.nan if isinstance(value, bool) else float(value)
    except (TypeError, ValueError, OverflowError):
        number = math.nan
    if not math.isfinite(number):
        raise ArgumentError(name, value, "a finite number")
    return number


def setting_text(value: Any) -> Any:
    """Return the value of a setting as a panel shows it."""
    if isinstance(value, bool):
        return value
    if isinstance(value, dict):
        return "; ".join(_coordinate_text(number) for number in value.values())
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _coordinate_text(metres: float) -> str:
    # Of UTM coordinates, too.
    return f"{round(metres, 5):.12g}"


def setting_value(before: Any, text: str) -> Any:
    """Return a text as what a setting of a view holds; texts that do not fit stay texts."""
    if isinstance(before, bool):
        return {"true": True, "false": False}.get(text.strip().lower(), text)
    if isinstance(before, tuple):
        numbers = text.replace(";", " ").replace(",", " ").split()
        if len(numbers) != 3:
            return text
        # Coordinates that were not edited keep the digits that are not shown.
        return {
            axis: old if new == _coordinate_text(old) else new
            for axis, old, new in zip("XYZ", before, numbers, strict=True)
        }
    return text
