"""The kinds of registered properties, and conversion of values to and from RViz's ``Config``."""

from __future__ import annotations

import json
import math
import re
from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from rosglass.comm.names import similar
from rosglass.errors import ConversionError, Error
from rosglass.qt import QtCore, QtGui

if TYPE_CHECKING:
    from collections.abc import Mapping

__all__ = [
    "KINDS",
    "Kind",
    "from_config",
    "from_plain",
    "merged",
    "plain_config",
    "shown",
    "to_config",
    "to_plain",
    "to_storable",
]


_MAX_SHOWN, _MAX_SHOWN_DEPTH = 80, 4


def shown(value: object) -> str:
    """Return a value in JavaScript's notation, in one line of at most 80 characters."""
    text = _shown_text(value, 0)
    return text if len(text) <= _MAX_SHOWN else f"{text[: _MAX_SHOWN - 3]}..."


def _shown_text(value: object, depth: int) -> str:
    if value is None:
        return "null"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float) and not math.isfinite(value):
        return "NaN" if math.isnan(value) else "Infinity" if value > 0 else "-Infinity"
    if isinstance(value, (dict, list, tuple)) and depth >= _MAX_SHOWN_DEPTH:
        return "..."
    if isinstance(value, dict):
        # Convert no more than can be shown.
        parts = [f"{key}: {_shown_text(value[key], depth + 1)}" for key in list(value)[:_MAX_SHOWN]]
        return f"{{{', '.join(parts)}}}"
    if isinstance(value, (list, tuple)):
        return f"[{', '.join(_shown_text(item, depth + 1) for item in value[:_MAX_SHOWN])}]"
    if isinstance(value, QtGui.QColor):
        return str(value.name())
    if isinstance(value, QtCore.QObject):
        return str(getattr(value, "CALLED", "") or value.metaObject().className())
    return repr(value)


_INT32 = (-(2**31), 2**31 - 1)
_TOPIC = re.compile(r"([~/]?[A-Za-z][A-Za-z0-9_]*(/[A-Za-z][A-Za-z0-9_]*)*|/)?\Z")
_TYPE = re.compile(r"([A-Za-z]\w*(/msg)?/[A-Za-z]\w*)?\Z", re.ASCII)
_CONTROL = re.compile(r"[\0-\x08\x0b-\x1f\x7f\ud800-\udfff]")


class Kind:
    """The type of a property's values, with validation and conversion.

    Args:
        options: Options listed in :attr:`OPTIONS`, e.g. limits.

    Raises:
        Error: An option is invalid.
    """

    #: Name of the kind.
    NAME: ClassVar[str] = ""
    #: Default value of properties that declare none.
    DEFAULT: ClassVar[Any] = None
    #: Description of valid values.
    WANTED: ClassVar[str] = "no value"
    #: Names of the kind's options.
    OPTIONS: ClassVar[tuple[str, ...]] = ()
    #: Whether a property of this kind may have children.
    HOLDS_OTHERS: ClassVar[bool] = True

    def __init__(self, **options: Any) -> None:
        self.options = options

    @property
    def default(self) -> Any:
        """Default value of properties that declare none."""
        return self.DEFAULT

    def read(self, value: Any) -> Any:
        """Return a value converted to the property's type.

        Raises:
            Error: The value is invalid.
        """
        if value is not None:
            raise self._value_error(value)
        return None

    def saved(self, value: Any) -> Any:
        """Return a value for ``.rviz`` files: a str, number, bool, or flat dict."""
        return value

    def restore(self, saved: Any) -> Any:
        """Return a value read from a file, in which scalars may be text.

        Raises:
            Error: The value is invalid.
        """
        return self.read(saved)

    def _value_error(self, value: Any) -> Error:
        return Error(f"expected {self.WANTED}, got {shown(value)}")


class _Container(Kind):
    NAME = "container"


class _Bool(Kind):
    NAME, DEFAULT, WANTED = "bool", False, "true or false"

    def read(self, value: Any) -> bool:
        if not isinstance(value, bool):
            raise self._value_error(value)
        return value

    def restore(self, saved: Any) -> bool:
        if isinstance(saved, str) and saved.lower() in {"true", "false"}:
            return saved.lower() == "true"
        return self.read(saved)


class _Number(Kind, ABC):
    """A number between `min` and `max`; editors change it in steps of `step`."""

    DEFAULT: ClassVar[Any] = 0
    OPTIONS = ("min", "max", "step")
    #: Limits of properties without `min` and `max`.
    LIMITS: ClassVar[tuple[Any, Any]]
    PARSE: ClassVar[type[int | float]]

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        self.min, self.max = self.LIMITS
        for name, value in options.items():
            given = self._number(value)
            if given is None:
                raise Error(f"{name}: expected {self.WANTED}, got {shown(value)}")
            setattr(self, name, given)
        if self.min > self.max:
            raise Error(f"min {self.min} is above max {self.max}; swap them")
        self.step = self._number(options.get("step", 1))
        if self.step is None or self.step <= 0:
            raise Error(f"step {options['step']!r} is not above 0")

    @property
    def default(self) -> Any:
        return min(max(self.DEFAULT, self.min), self.max)

    @abstractmethod
    def _number(self, value: Any) -> Any: ...

    def read(self, value: Any) -> Any:
        number = self._number(value)
        if number is None:
            raise self._value_error(value)
        if not self.min <= number <= self.max:
            raise Error(f"{number} is not from {self.min} to {self.max}")
        return number

    def restore(self, saved: Any) -> Any:
        try:
            return self.read(self.PARSE(saved) if isinstance(saved, str) else saved)
        except ValueError:
            raise self._value_error(saved) from None


class _Int(_Number):
    NAME, WANTED, LIMITS, PARSE = "int", "a whole number", _INT32, int

    def _number(self, value: Any) -> int | None:
        if isinstance(value, float) and value.is_integer():
            value = int(value)
        if isinstance(value, bool) or not isinstance(value, int):
            return None
        return value if _INT32[0] <= value <= _INT32[1] else None


class _Float(_Number):
    NAME, DEFAULT, WANTED = "float", 0.0, "a finite number"
    LIMITS, PARSE = (-math.inf, math.inf), float

    def _number(self, value: Any) -> float | None:
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            return None
        try:
            return float(value) if math.isfinite(value) else None
        except OverflowError:
            return None


class _String(Kind):
    NAME, DEFAULT, WANTED = "string", "", "a text without control characters"

    def read(self, value: Any) -> str:
        if not isinstance(value, str) or _CONTROL.search(value):
            raise self._value_error(value)
        return value

    def restore(self, saved: Any) -> str:
        return self.read("" if saved is None else saved)


class _Path(_String):
    """A file; `filter` is for its file dialog, e.g. ``QML files (*.qml)``."""

    NAME, OPTIONS = "path", ("filter",)


class _Topic(_String):
    NAME, OPTIONS = "topic", ("messageType",)
    WANTED = "the name of a topic, e.g. '/robot/scan'"

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        wanted = options.get("messageType", "")
        if not isinstance(wanted, str) or not _TYPE.match(wanted):
            example = "'sensor_msgs/LaserScan'"
            raise Error(
                f"messageType: expected the name of a type, e.g. {example}, got {shown(wanted)}"
            )

    def read(self, value: Any) -> str:
        text = super().read(value)
        if not _TOPIC.match(text):
            raise self._value_error(value)
        return text


class _Frame(_String):
    NAME, OPTIONS = "frame", ("includeFixedFrame",)
    WANTED = "the name of a frame, e.g. 'base_link'"


class _Enum(_String):
    NAME, OPTIONS = "enum", ("choices",)

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        choices = options.get("choices")
        if not isinstance(choices, (list, tuple)) or not choices:
            raise Error(
                f"choices: expected a list of texts, e.g. ['slow', 'fast'], got {shown(choices)}"
            )
        self.choices = [super(_Enum, self).read(choice) for choice in choices]
        if len(set(self.choices)) < len(self.choices):
            raise Error(f"choices: {shown(choices)} has duplicates")

    @property
    def default(self) -> str:
        return self.choices[0]

    def read(self, value: Any) -> str:
        if value not in self.choices:
            # A choice may be empty.
            choices = ", ".join(choice or "''" for choice in self.choices)
            hint = similar(value, self.choices) if isinstance(value, str) else ""
            raise Error(f"expected one of {choices}, got {shown(value)}{hint}")
        return str(value)


class _Color(Kind):
    NAME, WANTED = "color", "a colour, e.g. '#ff8800', '#80ff8800' or 'orange'"

    @property
    def default(self) -> QtGui.QColor:
        return QtGui.QColor("white")

    def read(self, value: Any) -> QtGui.QColor:
        if isinstance(value, (QtGui.QColor, str)):
            color = QtGui.QColor(value)
            if color.isValid():
                # Normalise it: the same colour in another notation is equal.
                return QtGui.QColor(color.name(QtGui.QColor.NameFormat.HexArgb))
        raise self._value_error(value)

    def saved(self, value: QtGui.QColor) -> str:
        whole = value.alpha() == 255
        form = QtGui.QColor.NameFormat
        return str(value.name(form.HexRgb if whole else form.HexArgb))


class _Parts(Kind, ABC):
    """Named numbers, saved like RViz's own vectors: ``X: 1, Y: 2, Z: 3``."""

    HOLDS_OTHERS = False
    NAMES: ClassVar[tuple[str, ...]] = ()

    @abstractmethod
    def _make(self, parts: list[float]) -> Any: ...

    def parts(self, value: Any) -> dict[str, float]:
        """Return the numbers by their names in capitals."""
        # Qt uses 32-bit floats: return the shortest decimal number that is equal to it.
        numbers = [float(str(np.float32(getattr(value, name)()))) for name in self.NAMES]
        return dict(zip((name.upper() for name in self.NAMES), numbers, strict=True))

    def with_part(self, value: Any, name: str, number: float) -> Any:
        """Return a value with one of its numbers changed."""
        return self._from({**self.parts(value), name: number})

    def _from(self, named: dict[str, Any]) -> Any:
        if {name.lower() for name in named} != set(self.NAMES) or len(named) != len(self.NAMES):
            raise self._value_error(named)
        by_name = {name.lower(): value for name, value in named.items()}
        parts = []
        for name in self.NAMES:
            try:
                number = float("nan") if isinstance(by_name[name], bool) else float(by_name[name])
            except (TypeError, ValueError, OverflowError):
                number = math.nan
            with np.errstate(over="ignore"):
                narrow = np.float32(number)
            if not np.isfinite(narrow):
                raise Error(f"{name}: expected a finite number, got {shown(by_name[name])}")
            parts.append(number)
        return self._make(parts)

    def saved(self, value: Any) -> dict[str, float]:
        return self.parts(value)

    def restore(self, saved: Any) -> Any:
        if not isinstance(saved, dict):
            raise self._value_error(saved)
        return self._from(saved)


class _Vector(_Parts):
    NAME, NAMES = "vector", ("x", "y", "z")
    WANTED = "a vector, e.g. Qt.vector3d(1, 2, 3), {x: 1, y: 2, z: 3} or [1, 2, 3]"

    @property
    def default(self) -> QtGui.QVector3D:
        return QtGui.QVector3D()

    def read(self, value: Any) -> QtGui.QVector3D:
        found: Any = None
        if isinstance(value, QtGui.QVector3D):
            found = self._from(self.parts(value))
        elif isinstance(value, (list, tuple)) and len(value) == 3:
            found = self._from(dict(zip(self.NAMES, value, strict=True)))
        elif isinstance(value, dict):
            found = self._from(value)
        else:
            raise self._value_error(value)
        vector: QtGui.QVector3D = found
        return vector

    def _make(self, parts: list[float]) -> QtGui.QVector3D:
        return QtGui.QVector3D(*parts)


class _Quaternion(_Parts):
    NAME, NAMES = "quaternion", ("x", "y", "z", "w")
    WANTED = "a quaternion, e.g. Qt.quaternion(1, 0, 0, 0) or {x: 0, y: 0, z: 0, w: 1}"

    @property
    def default(self) -> QtGui.QQuaternion:
        return QtGui.QQuaternion()

    def parts(self, value: Any) -> dict[str, float]:
        vector = _Vector().parts(value.vector())
        return {**vector, "W": float(str(np.float32(value.scalar())))}

    def read(self, value: Any) -> QtGui.QQuaternion:
        if isinstance(value, QtGui.QQuaternion):
            value = self.parts(value)
        # Refuse lists: Qt has w first, ROS has it last.
        if not isinstance(value, dict):
            raise self._value_error(value)
        quaternion: QtGui.QQuaternion = self._from(value)
        return quaternion

    def _make(self, parts: list[float]) -> QtGui.QQuaternion:
        x, y, z, w = parts
        return QtGui.QQuaternion(w, x, y, z)


#: All kinds by name.
KINDS: dict[str, type[Kind]] = {
    kind.NAME: kind
    for kind in (
        _Container,
        _Bool,
        _Int,
        _Float,
        _String,
        _Path,
        _Topic,
        _Frame,
        _Enum,
        _Color,
        _Vector,
        _Quaternion,
    )
}


_INT = re.compile(r"[-+]?[0-9]+\Z")
_FLOAT = re.compile(r"[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][-+]?[0-9]+)?\Z")
_WORDS: dict[str, Any] = {
    "true": True,
    "false": False,
    "null": None,
    "~": None,
    ".inf": math.inf,
    "-.inf": -math.inf,
    ".nan": math.nan,
    "{}": {},
    "[]": [],
}
_WANTED = "null, true, false, a number, a text, a list or a map of these"
_MAX_DEPTH = 50
#: Characters that YAML cannot represent, or would not preserve.
_UNSTORABLE = re.compile(r"[\0-\x08\x0b-\x1f\x7f-\x9f\ud800-\udfff\ufffe\uffff\ufeff\u2028\u2029]")


def to_storable(value: Any, path: str) -> Any:
    """Return a value with tuples as lists, after checking that a file can store it.

    Raises:
        ConversionError: A file cannot store it; the error names the part.
    """
    return _to_storable(value, path, 0)


def _to_storable(value: Any, path: str, depth: int) -> Any:
    if depth > _MAX_DEPTH:
        raise ConversionError(path[:60], "more", f"values nested at most {_MAX_DEPTH} deep")
    if isinstance(value, dict):
        for key in value:
            if not isinstance(key, str) or _UNSTORABLE.search(key):
                raise ConversionError(path, key, "names that are texts without control characters")
        items = value.items()
        return {key: _to_storable(inner, f"{path}.{key}", depth + 1) for key, inner in items}
    if isinstance(value, (list, tuple)):
        return [_to_storable(inner, f"{path}[{at}]", depth + 1) for at, inner in enumerate(value)]
    if value is None or isinstance(value, (bool, int, float)):
        return value
    if isinstance(value, str) and not _UNSTORABLE.search(value):
        return value
    raise ConversionError(path, value, _WANTED)


def to_config(config: Any, value: Any, *, plain: bool = False) -> None:
    """Write a value to RViz's ``Config``.

    Args:
        config: An empty ``Config``.
        value: A value from :func:`to_storable`.
        plain: Whether to write strings unquoted, for readers that know the type.
    """
    if isinstance(value, dict) and value:
        for key, inner in value.items():
            to_config(config.mapMakeChild(key), inner, plain=plain)
    elif isinstance(value, list) and value:
        for inner in value:
            to_config(config.listAppendNew(), inner, plain=plain)
    else:
        config.setValue(value if plain and isinstance(value, str) else _text(value))


def _text(value: Any) -> str:
    if isinstance(value, str):
        # Write a text as a JSON string if it would be read as another type.
        return value if _scalar(value) == value and value[:1] != '"' else json.dumps(value)
    if isinstance(value, float) and not math.isfinite(value):
        return ".nan" if math.isnan(value) else ".inf" if value > 0 else "-.inf"
    if value is None or isinstance(value, bool):
        return {None: "null", True: "true", False: "false"}[value]
    return repr(value)


def _scalar(text: str) -> Any:
    if text.lower() in _WORDS:
        word = _WORDS[text.lower()]
        return type(word)() if isinstance(word, (dict, list)) else word
    if text[:1] == '"':
        try:
            return json.loads(text)
        except ValueError:
            return text
    if _INT.match(text) and len(text) < 20:
        return int(text)
    return float(text) if _FLOAT.match(text) else text


def from_config(config: Any) -> Any:
    """Return a value written by :func:`to_config` or by hector_rviz_overlay."""
    return from_plain(plain_config(config))


def from_plain(value: Any) -> Any:
    """Return a value written by :func:`to_plain`, from dicts, lists and scalars of a file."""
    if isinstance(value, dict):
        return {key: from_plain(inner) for key, inner in value.items()}
    if isinstance(value, list):
        return [from_plain(inner) for inner in value]
    return _scalar(value) if isinstance(value, str) else value


def to_plain(value: Any) -> Any:
    """Return a value from :func:`to_storable` as a file has it, which :func:`to_config` writes."""
    if isinstance(value, dict) and value:
        return {key: to_plain(inner) for key, inner in value.items()}
    if isinstance(value, list) and value:
        return [to_plain(inner) for inner in value]
    return _text(value)


def plain_config(config: Any) -> Any:
    """Return an RViz ``Config`` as dicts, lists and scalars; scalars from files are text."""
    kinds = type(config)
    kind = config.getType()
    if kind == kinds.Map:
        found, at = {}, config.mapIterator()
        while at.isValid():
            found[str(at.currentKey())] = plain_config(at.currentChild())
            at.advance()
        return found
    if kind == kinds.List:
        return [plain_config(config.listChildAt(at)) for at in range(config.listLength())]
    return config.getValue() if kind == kinds.Value else None


def merged(older: Mapping[str, Any], newer: Mapping[str, Any]) -> dict[str, Any]:
    """Return `newer` plus the keys that only `older` has, recursively."""
    found = {**older, **newer}
    for key, value in newer.items():
        before = older.get(key)
        if isinstance(before, dict):
            found[key] = merged(before, value if isinstance(value, dict) else {"Value": value})
    return found
