"""YAML files for interfaces: ``Ros.io`` and ``Ros2.io``."""
# ruff: noqa: N802 - the names of slots are QML's

from __future__ import annotations

import logging
import os
import re
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from rosglass.comm.text_files import load_yaml
from rosglass.comm.time import Duration, Time
from rosglass.errors import Error, UnsupportedError
from rosglass.qml.engine.dialect import Dialect
from rosglass.qml.engine.from_js import plain_from_js
from rosglass.qml.engine.js_values import wide
from rosglass.qml.engine.log import log_from_qml
from rosglass.qml.engine.to_js import exact
from rosglass.qml.engine.waiting import FILE_TIMEOUT_S, within
from rosglass.qt import QJSValue, QtCore, Slot

if TYPE_CHECKING:
    from rosglass.qml.engine.runtime import Runtime

__all__ = ["Io"]

#: Maximum file size in bytes: larger files are not settings, and would freeze the screen.
_LARGEST = 64 << 20
#: Limits, because anchors and aliases make small files large (``&a [*b, *b]``).
_MOST_VALUES, _DEEPEST = 200_000, 100
_SCHEME = re.compile(r"([A-Za-z][A-Za-z0-9+.-]*)://")
_DATE = re.compile(
    r"[0-9]{4}-[0-9]{2}-[0-9]{2}"
    r"([Tt ][0-9]{2}:[0-9]{2}(:[0-9]{2}(\.[0-9]+)?)?([Zz]|[+-][0-9]{2}:?[0-9]{2})?)?\Z"
)
_FLOAT = (
    r"([-+]?([0-9]+\.[0-9]*|\.[0-9]+|[0-9]+(?=[eE]))([eE][-+]?[0-9]+)?"
    r"|[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN))\Z"
)
_CLOCK = 1  # Ros2ClockTypes.Ros


class Io(QtCore.QObject):
    """Reads and writes YAML files.

    Args:
        runtime: The engine's runtime.
        dialect: The module, which determines the format of times.
        parent: The singleton.
    """

    def __init__(self, runtime: Runtime, dialect: Dialect, parent: QtCore.QObject) -> None:
        super().__init__(parent)
        self._runtime, self._dialect = runtime, dialect

    @Slot("QVariant", result=QJSValue)
    def readYaml(self, path: Any) -> QJSValue:
        """Return the contents of a file; if it cannot be read, log why and return false.

        Args:
            path: Path or ``file://`` URL; relative to the working directory.
        """
        try:
            file = _local(path)
            text = within(FILE_TIMEOUT_S, str(file), lambda: _read(file))
            return _Reader(self._runtime, self._dialect).value(_load(text, file), 0)
        except (OSError, UnicodeError, RecursionError, Error) as error:
            return self._failed("readYaml", error)

    @Slot("QVariant", QJSValue, result=bool)
    def writeYaml(self, path: Any, value: QJSValue) -> bool:
        """Write a value to a file atomically.

        Returns:
            False, with the reason in the log, if the value or the file cannot be written.
        """
        try:
            file = _local(path)
            text = _dump(plain_from_js(value), self._dialect)
            within(FILE_TIMEOUT_S, str(file), lambda: _replace(file, text))
        except (OSError, UnicodeError, RecursionError, Error) as error:
            self._failed("writeYaml", error)
            return False
        return True

    def _failed(self, what: str, error: Exception) -> QJSValue:
        name = "Ros" if self._dialect is Dialect.ROS1 else "Ros2"
        text = f"{name}.io.{what}: {error}"
        log_from_qml("", logging.ERROR, text, self._runtime.caller())
        return self._runtime.value(False)


def _local(path: Any) -> Path:
    """Return the path of a file given as a path or URL."""
    if isinstance(path, QJSValue):
        path = path.toString()
    text = path.toString() if isinstance(path, QtCore.QUrl) else path
    if not isinstance(text, str) or not text or "\0" in text:
        raise UnsupportedError(f"the path must be a text or a file:// URL, got {text!r:.80}")
    scheme = _SCHEME.match(text)
    if scheme is None:
        return Path(text)
    url = QtCore.QUrl(text)
    if not url.isLocalFile() or url.host():
        raise UnsupportedError(f"{text}: only local files can be read and written (file://)")
    return Path(url.toLocalFile())


def _read(file: Path) -> str:
    if not file.is_file():
        raise UnsupportedError(f"{file}: there is no such file")
    if file.stat().st_size > _LARGEST:
        raise UnsupportedError(f"{file}: larger than {_LARGEST >> 20} MiB")
    return file.read_text(encoding="utf-8")


def _replace(file: Path, text: str) -> None:
    """Write a file atomically: readers never see a partial file."""
    if file.is_dir():
        raise IsADirectoryError(f"{file} is a folder")
    data = text.encode("utf-8")
    target = file.resolve()
    new = target.with_name(f".{target.name}.{os.getpid()}.new")
    try:
        new.write_bytes(data)
        if target.exists():
            new.chmod(target.stat().st_mode & 0o777)
        new.replace(target)
    except OSError:
        new.unlink(missing_ok=True)
        raise


# -- reading ---------------------------------------------------------------------------------------


class _Moment(NamedTuple):
    """A date as written in the file."""

    text: str


@cache
def _yaml() -> tuple[Any, Any, Any]:
    """Return PyYAML, and a loader and a dumper with our own rules for plain scalars.

    PyYAML reads ``12:30`` as 750 and ``1e3`` as text; otherwise, YAML 1.1 applies.
    """
    import yaml  # noqa: PLC0415 - few interfaces have files

    safe: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
    words = "yes|Yes|YES|no|No|NO|true|True|TRUE|false|False|FALSE|on|On|ON|off|Off|OFF"
    rules = (
        ("bool", rf"({words})\Z", "yYnNtTfFoO"),
        ("int", r"[-+]?(0|[1-9][0-9]*|0[0-7]+|0x[0-9a-fA-F]+)\Z", "-+0123456789"),
        (
            "float",
            _FLOAT,
            "-+0123456789.",
        ),
        ("null", r"(~|null|Null|NULL|)\Z", ["~", "n", "N", ""]),
        ("timestamp", _DATE.pattern, "0123456789"),
        ("merge", r"<<\Z", "<"),
    )

    class Loader(safe):  # type: ignore[misc]
        yaml_implicit_resolvers: dict[str, Any] = {}  # noqa: RUF012 - PyYAML's

        def construct_mapping(self, node: Any, deep: bool = False) -> Any:
            # PyYAML silently uses the last of several equal keys.
            keys = [key.value for key, _ in node.value if key.tag != "tag:yaml.org,2002:merge"]
            seen: set[str] = set()
            for key in keys:
                if isinstance(key, str) and key in seen:
                    place = node.start_mark
                    raise yaml.constructor.ConstructorError(
                        None, None, f"the key {key!r} occurs twice", place
                    )
                seen.update([key] if isinstance(key, str) else [])
            return super().construct_mapping(node, deep)

    class Dumper(yaml.SafeDumper):
        yaml_implicit_resolvers: dict[str, Any] = {}  # noqa: RUF012 - PyYAML's

        def ignore_aliases(self, data: Any) -> bool:  # noqa: ARG002
            return True

    for kind in (Loader, Dumper):
        for tag, pattern, first in rules:
            kind.add_implicit_resolver(f"tag:yaml.org,2002:{tag}", re.compile(pattern), list(first))
    Loader.add_constructor(
        "tag:yaml.org,2002:timestamp", lambda loader, node: _Moment(loader.construct_scalar(node))
    )
    Dumper.add_representer(
        _Moment,
        lambda dumper, moment: dumper.represent_scalar("tag:yaml.org,2002:timestamp", moment.text),
    )
    return yaml, Loader, Dumper


def _load(text: str, file: Path) -> Any:
    yaml, loader, _ = _yaml()
    try:
        documents = load_yaml(text, loader)
    except yaml.YAMLError as error:
        raise UnsupportedError(f"{file}: {error}") from None
    if len(documents) > 1:
        raise UnsupportedError(f"{file}: it holds {len(documents)} documents, one is expected")
    return documents[0] if documents else None


class _Reader:
    """Converts the contents of a file to JavaScript values."""

    def __init__(self, runtime: Runtime, dialect: Dialect) -> None:
        self._runtime, self._dialect = runtime, dialect
        self._count = 0

    def value(self, found: Any, depth: int) -> QJSValue:
        """Convert a value to JavaScript."""
        self._count += 1
        if depth > _DEEPEST or self._count > _MOST_VALUES:
            raise UnsupportedError(
                f"more than {_MOST_VALUES} values, or nested more than {_DEEPEST} deep"
            )
        engine = self._runtime.engine
        if engine is None:
            return QJSValue()
        if isinstance(found, dict):
            time = self._time(found)
            if time is not None:
                return time
            made = engine.newObject()
            for key, inner in found.items():
                made.setProperty(_key(key), self.value(inner, depth + 1))
            return made
        if isinstance(found, (list, set)):
            made = engine.newArray(len(found))
            for index, inner in enumerate(found):
                made.setProperty(index, self.value(inner, depth + 1))
            return made
        if isinstance(found, (_Moment, bytes)):
            script: Any = engine.toScriptValue(_qt(found))
            value: QJSValue = script
            return value
        return self._runtime.value(exact(found) if type(found) is int else found)

    def _time(self, found: dict[Any, Any]) -> QJSValue | None:
        """Return a map in this module's time format as a time; None for other maps."""
        first, second = self._dialect.time_fields
        kind = "time"
        keys = set(found)
        if self._dialect is Dialect.ROS2:
            kind = str(found.get("type"))
            if kind not in {"time", "duration"} or not {first, second} <= keys:
                return None
            keys -= {"type", "clocktype"}
        if keys != {first, second}:
            return None
        sec, nanosec = found[first], found[second]
        if type(sec) is not int or type(nanosec) is not int:
            return None
        if kind == "time":
            return self._runtime.time(Time.from_parts(sec, nanosec), self._dialect)
        return self._runtime.duration(Duration(sec * 10**9 + nanosec), self._dialect)


def _key(key: Any) -> str:
    """Return a map's key as text in JavaScript's format."""
    if isinstance(key, bool):
        return "true" if key else "false"
    return "null" if key is None else key.text if isinstance(key, _Moment) else str(key)


def _qt(found: _Moment | bytes) -> QtCore.QDateTime | QtCore.QByteArray:
    if isinstance(found, bytes):
        return QtCore.QByteArray(found)
    text = found.text.replace("t", "T").replace(" ", "T").replace("z", "Z")
    return QtCore.QDateTime.fromString(text, QtCore.Qt.DateFormat.ISODateWithMs)


# -- writing ---------------------------------------------------------------------------------------


def _dump(value: Any, dialect: Dialect) -> str:
    yaml, _, dumper = _yaml()
    try:
        text: str = yaml.dump(
            _writable(value, dialect),
            Dumper=dumper,
            sort_keys=False,
            default_flow_style=False,
            allow_unicode=True,
            width=2**31,
        )
    except yaml.YAMLError as error:
        raise UnsupportedError(str(error)) from None
    return text


def _writable(value: Any, dialect: Dialect) -> Any:
    if isinstance(value, dict):
        return {key: _writable(inner, dialect) for key, inner in value.items()}
    if isinstance(value, list):
        return [_writable(inner, dialect) for inner in value]
    if isinstance(value, str):
        # JavaScript has integers from 2^53 on as texts: they stay integers in the file.
        number = wide(value)
        is_wide = type(number) is int and exact(number) == value and -(2**63) <= number < 2**64
        return number if is_wide else value
    if isinstance(value, QtCore.QDateTime):
        return _Moment(value.toUTC().toString(QtCore.Qt.DateFormat.ISODateWithMs))
    if isinstance(value, (Time, Duration)):
        is_time = isinstance(value, Time)
        parts = dict(zip(dialect.time_fields, divmod(value.nanoseconds, 10**9), strict=True))
        if dialect is Dialect.ROS1:
            return parts
        written = {"type": "time" if is_time else "duration", **parts}
        return {**written, "clocktype": _CLOCK} if is_time else written
    return value
