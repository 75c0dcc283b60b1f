"""Every error rosglass raises, so that one ``except rosglass.Error`` catches them all.

Messages follow one pattern: what happened, where (topic, field path, file and line), what to do.
"""

from __future__ import annotations

import builtins
import re

__all__ = [
    "ArgumentError",
    "BagError",
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


#: Characters of one word, and of one line, that a message shows: it is read by people, and may be
#: about a value of any size.
_MOST_IN_WORD, _MOST_IN_LINE = 300, 4000
_LONG_WORD = re.compile(rf"\S{{{_MOST_IN_WORD + 1},}}")
_LONG_LINE = re.compile(rf".{{{_MOST_IN_LINE + 1},}}")


#: What moves a terminal's cursor, changes its state or reorders its text: C0 but tab and line feed,
#: DEL, C1, line and paragraph separators, directional controls of Unicode.
_CONTROLS = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069]")


def escape_controls(text: str) -> str:
    r"""Return a text with its control characters as ``\uXXXX``, tabs and line feeds kept.

    Names and texts of other nodes go through this on their way to terminals and logs. The escapes
    are those of JSON, so that JSON stays JSON.
    """
    return _CONTROLS.sub(lambda found: f"\\u{ord(found[0]):04x}", text)


def shown(value: object) -> str:
    """Return a value as error messages show it, cut if it is long."""
    try:
        text = repr(value)
    except Exception as error:  # an integer of 5,000 digits, or a class of the user's
        text = f"a value that cannot be shown ({type(error).__name__}: {error})"
    return f"{text[:77]}..." if len(text) > 80 else text


def _shortened(text: str) -> str:
    """Return a message with the beginnings only of words and lines that are very long."""
    if len(text) <= _MOST_IN_WORD:
        return text
    text = _LONG_WORD.sub(lambda found: _cut(found[0], 200), text)
    return _LONG_LINE.sub(lambda found: _cut(found[0], 2000), text)


def _cut(text: str, kept: int) -> str:
    return f"{text[:kept]}... ({len(text)} characters)"


class Error(Exception):
    """Base of every error raised by rosglass.

    Args:
        args: The message; control characters are escaped, and of words and lines that no person
            would read, it keeps the beginning and tells the length.
    """

    def __init__(self, *args: object) -> None:
        super().__init__(
            *(_shortened(escape_controls(arg)) if isinstance(arg, str) else arg for arg in args)
        )


class DefinitionError(Error):
    """An interface definition cannot be parsed.

    Attributes:
        file: Where the text came from: a path, or a label such as ``<std_msgs/msg/String>``.
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
    """A value does not fit the field it was given for.

    Attributes:
        path: Field path from the message's root, e.g. ``poses[3].position.x``; empty for the root.
        value: The offending value.
        expected: What would have been accepted, in words.
    """

    def __init__(self, path: str, value: object, expected: str, type_name: str = "") -> None:
        where = f"{type_name}: " if type_name else ""
        super().__init__(f"{where}{path or '(message)'}: expected {expected}, got {shown(value)}")
        self.path, self.value, self.expected, self.type_name = path, value, expected, type_name


class ArgumentError(ConversionError, TypeError, ValueError):
    """An argument, an option of a URL or a setting is not what it may be.

    It is a :class:`ConversionError` as well until 0.3; from then on, that is for values that do not
    fit a message.

    Attributes:
        path: Name of the argument, option or setting.
        value: What was given.
        expected: What would have been accepted, in words.
    """


class DecodeError(Error):
    """Received bytes are not a valid message of the type.

    Attributes:
        type_name: Full name of the type, e.g. ``geometry_msgs/msg/Pose``.
        path: Field path at which decoding stopped, if known.
        offset: Byte offset into the buffer at which decoding stopped, -1 if unknown.
    """

    def __init__(self, type_name: str, message: str, path: str = "", offset: int = -1) -> None:
        place = f".{path}" if path else ""
        at = f" at byte {offset}" if offset >= 0 else ""
        super().__init__(f"{type_name}{place}{at}: {message}")
        self.type_name, self.path, self.offset = type_name, path, offset


class InvalidNameError(Error, ValueError):
    """A node, topic, namespace or type name breaks ROS's naming rules."""


class UnsupportedError(Error):
    """This world or middleware cannot do what was asked; the message says why."""


class NoPictureError(Error):
    """A video stream cannot be shown yet; the message says what it is waiting for."""


class NodeClosedError(Error):
    """The node, or the object created from it, was closed before this call."""


class ConnectionLostError(Error):
    """The middleware could not be reached, or the connection to it was lost."""


class TimeoutError(Error, builtins.TimeoutError):  # noqa: A001 - the field's own word
    """What was waited for did not come within the given time."""


class ServiceError(Error):
    """A service was called, and its server says that it failed, or its reply makes no sense."""


class ServiceUnavailableError(ServiceError):
    """No server of the service or action appeared within the given time."""


class GoalRejectedError(Error):
    """An action server did not accept a goal."""


class ParameterError(Error):
    """A parameter does not exist, has another type, or its node refuses the value."""


class MasterError(Error):
    """A ROS 1 master or node answers a question with a refusal, e.g. that it knows no such name."""


class TransitionError(Error):
    """A lifecycle node cannot take a transition, or failed to."""


class RosArgumentError(Error, ValueError):
    """What a program was told on its command line, for ROS, is not valid."""


class BagError(Error):
    """A recording cannot be read or written; the message names the file."""


class QmlError(Error):
    """A QML file is missing or has errors; the message lists them as ``file:line:column``."""


class TransformException(Error):  # noqa: N818 - tf2's name
    """A transform cannot be had, or is not valid; one class below says which. Names as in tf2."""


class LookupException(TransformException):
    """A frame does not exist, or the frames form a loop."""


class ConnectivityException(TransformException):
    """Both frames exist, but nothing connects them."""


class ExtrapolationException(TransformException):
    """There is no data for the time asked for: it is too old, too new, or the only one."""


class InvalidArgumentException(TransformException):
    """A frame name, a time or a transform is not valid."""


class TimeoutException(TransformException, TimeoutError):  # noqa: N818 - tf2's name
    """A transform that was waited for did not become available within the time."""
