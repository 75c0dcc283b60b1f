"""The exceptions of rosglass; all derive from :class:`Error`.

Messages say what happened, where (topic, field path, file and line), and what to do.

```
Error
├── DefinitionError             an interface definition cannot be parsed
│   └── CyclicTypeError
├── TypeNotFoundError           no definition of a type
├── DefinitionConflictError     two definitions of a type
├── FieldPathError
├── ConversionError             a value does not fit a message
│   └── ArgumentError           an invalid argument; also a TypeError and a ValueError
├── DecodeError                 invalid bytes
├── InvalidNameError            also a ValueError
├── UnsupportedError
├── NodeClosedError
├── ConnectionLostError
├── TimeoutError                also Python's TimeoutError
├── ServiceError
│   └── ServiceUnavailableError
├── GoalRejectedError
├── ParameterError
├── TransitionError             of lifecycle nodes
├── MasterError                 of ROS 1
├── RosArgumentError            also a ValueError
├── BagError
├── NoPictureError
├── QmlError
│   ├── QmlSyntaxError
│   └── BoundError              an expression would be overwritten by a value
└── TransformException          the exceptions of tf2
    ├── LookupException
    ├── ConnectivityException
    ├── ExtrapolationException
    ├── InvalidArgumentException
    └── TimeoutException        also a TimeoutError
```
"""

from __future__ import annotations

import builtins
import re
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable

__all__ = [
    "ArgumentError",
    "BagError",
    "BoundError",
    "ConnectionLostError",
    "ConnectivityException",
    "ConversionError",
    "CyclicTypeError",
    "DecodeError",
    "DefinitionConflictError",
    "DefinitionError",
    "Error",
    "ExtrapolationException",
    "FieldPathError",
    "GoalRejectedError",
    "InvalidArgumentException",
    "InvalidNameError",
    "LookupException",
    "MasterError",
    "NoPictureError",
    "NodeClosedError",
    "ParameterError",
    "QmlError",
    "QmlSyntaxError",
    "RosArgumentError",
    "ServiceError",
    "ServiceUnavailableError",
    "TimeoutError",
    "TimeoutException",
    "TransformException",
    "TransitionError",
    "TypeNotFoundError",
    "UnsupportedError",
]


#: Longest word and line, in characters, that a message shows in full: values have any size.
_MOST_IN_WORD, _MOST_IN_LINE = 300, 4000
_LONG_WORD = re.compile(rf"\S{{{_MOST_IN_WORD + 1},}}")
_LONG_LINE = re.compile(rf".{{{_MOST_IN_LINE + 1},}}")


#: Characters that control a terminal or reorder its text: C0 except tab and line feed, DEL, C1,
#: line and paragraph separators, directional controls of Unicode.
_CONTROLS = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069]")


def escape_controls(text: str) -> str:
    r"""Return a text with its control characters as ``\uXXXX``, tabs and line feeds kept.

    For names and texts of other nodes in terminals and logs. The escapes are those of JSON, so JSON
    stays valid.
    """
    return _CONTROLS.sub(lambda found: f"\\u{ord(found[0]):04x}", text)


def shown(value: object) -> str:
    """Return the repr of a value for an error message, shortened if it is long."""
    try:
        text = repr(value)
    except Exception as error:  # noqa: BLE001 - an integer of 5,000 digits, or a class of the user's
        text = f"a value that cannot be shown ({type(error).__name__}: {error})"
    return f"{text[:77]}..." if len(text) > 80 else text


def close_matches(name: str, known: Iterable[str], most: int, cutoff: float) -> list[str]:
    """Return the known names that are most like `name`, for an error's hint.

    Args:
        name: The name.
        known: Names that would be right.
        most: How many to return.
        cutoff: Likeness from 0 to 1 that they need.
    """
    import difflib  # noqa: PLC0415 - most programs have no error to explain

    return difflib.get_close_matches(name, list(known), most, cutoff)


def _shortened(text: str) -> str:
    """Return a message with very long words and lines cut."""
    if len(text) <= _MOST_IN_WORD:
        return text
    text = _LONG_WORD.sub(lambda found: _cut(found[0], 200), text)
    return _LONG_LINE.sub(lambda found: _cut(found[0], 2000), text)


def _cut(text: str, kept: int) -> str:
    return f"{text[:kept]}... ({len(text)} characters)"


class Error(Exception):
    """Base of every error raised by rosglass.

    Args:
        args: The message. Control characters are escaped; very long words and lines are cut, with
            their length.
    """

    def __init__(self, *args: object) -> None:
        super().__init__(
            *(_shortened(escape_controls(arg)) if isinstance(arg, str) else arg for arg in args)
        )


class DefinitionError(Error):
    """An interface definition cannot be parsed.

    Attributes:
        file: Source of the text: a path, or a label such as ``<std_msgs/msg/String>``.
        line: 1-based line number, 0 when the error concerns the whole text.
        column: 1-based column, 0 when the error concerns the whole line.
    """

    def __init__(self, message: str, file: str = "<text>", line: int = 0, column: int = 0) -> None:
        super().__init__(f"{file}:{line}:{column}: {message}")
        self.file, self.line, self.column = file, line, column


class CyclicTypeError(DefinitionError):
    """A type contains itself, directly or through its fields."""


class TypeNotFoundError(Error):
    """No provider of the library has a definition of the type."""


class DefinitionConflictError(Error):
    """Two sources define the same type differently."""


class FieldPathError(Error):
    """A field path does not exist in the type it is applied to."""


class ConversionError(Error):
    """A value does not fit its field.

    Attributes:
        path: Field path from the message's root, e.g. ``poses[3].position.x``; empty for the root.
        value: The rejected value.
        expected: Description of the accepted values.
    """

    def __init__(self, path: str, value: object, expected: str, type_name: str = "") -> None:
        where = f"{type_name}: " if type_name else ""
        super().__init__(f"{where}{path or '(message)'}: expected {expected}, got {shown(value)}")
        self.path, self.value, self.expected, self.type_name = path, value, expected, type_name


class ArgumentError(ConversionError, TypeError, ValueError):
    """An argument, a URL option or a setting is invalid.

    It is also a :class:`ConversionError` until version 0.3; from then on, that is only for values
    that do not fit a message.

    Attributes:
        path: Name of the argument, option or setting.
        value: The given value.
        expected: Description of the accepted values.
    """


class DecodeError(Error):
    """Received bytes are not a valid message of the type.

    Attributes:
        type_name: Full name of the type, e.g. ``geometry_msgs/msg/Pose``.
        path: Field path at which decoding stopped, if known.
        offset: Byte offset into the buffer at which decoding stopped, -1 if unknown.
    """

    def __init__(self, type_name: str, message: str, path: str = "", offset: int = -1) -> None:
        field = f".{path}" if path else ""
        at = f" at byte {offset}" if offset >= 0 else ""
        super().__init__(f"{type_name}{field}{at}: {message}")
        self.type_name, self.path, self.offset = type_name, path, offset


class InvalidNameError(Error, ValueError):
    """A node, topic, namespace or type name breaks ROS's naming rules."""


class UnsupportedError(Error):
    """The protocol, middleware or platform does not support this; the message says why."""


class NoPictureError(Error):
    """A video stream has no image yet; the message says what is missing."""


class NodeClosedError(Error):
    """The node, or the object created from it, was closed before this call."""


class ConnectionLostError(Error):
    """The robot could not be reached, or the connection to it was lost."""


class TimeoutError(Error, builtins.TimeoutError):  # noqa: A001 - the name in ROS and Python
    """An operation did not complete within the given time."""


class ServiceError(Error):
    """The server of a service reported a failure, or its response is invalid."""


class ServiceUnavailableError(ServiceError):
    """No server of the service or action appeared within the given time."""


class GoalRejectedError(Error):
    """An action server rejected a goal."""


class ParameterError(Error):
    """A parameter does not exist, has another type, or its node refuses the value."""


class MasterError(Error):
    """A ROS 1 master or node refused a request, e.g. because of an unknown name."""


class TransitionError(Error):
    """A lifecycle transition is not possible, or failed."""


class RosArgumentError(Error, ValueError):
    """A ROS argument on the command line is invalid."""


class BagError(Error):
    """A recording cannot be read or written; the message names the file."""


class QmlError(Error):
    """A QML file is missing or has errors; the message lists them as ``file:line:column``."""


class QmlSyntaxError(QmlError):
    """The text of a QML file is incomplete or wrong; the message says what was expected.

    Attributes:
        file: Path of the file, or a label such as ``<text>``.
        line: 1-based line number.
        column: 1-based column.
    """

    def __init__(self, message: str, file: str = "<text>", line: int = 1, column: int = 1) -> None:
        super().__init__(f"{file}:{line}:{column}: {message}")
        self.file, self.line, self.column = file, line, column


class BoundError(QmlError):
    """A property has an expression, which a value would overwrite.

    Attributes:
        name: Name of the property.
        expression: Text of the expression.
        file: Path of the file, or a label such as ``<text>``.
        line: 1-based line number.
        column: 1-based column.
    """

    def __init__(
        self, name: str, expression: str = "", file: str = "<text>", line: int = 1, column: int = 1
    ) -> None:
        super().__init__(
            f"{file}:{line}:{column}: {name} is bound to an expression, which a value would "
            f"overwrite: {expression}"
        )
        self.name, self.expression = name, expression
        self.file, self.line, self.column = file, line, column


class TransformException(Error):  # noqa: N818 - tf2's name
    """A transform is not available or not valid; the subclasses have the names of tf2."""


class LookupException(TransformException):
    """A frame does not exist, or the frames form a loop."""


class ConnectivityException(TransformException):
    """Both frames exist, but are not connected."""


class ExtrapolationException(TransformException):
    """There is no data for the requested time."""


class InvalidArgumentException(TransformException):
    """A frame name, a time or a transform is not valid."""


class TimeoutException(TransformException, TimeoutError):  # noqa: N818 - tf2's name
    """A transform did not become available in time."""
