"""The parsed form of ``.msg``, ``.srv``, ``.action`` and ``.idl`` definitions.

All classes are frozen. Names are always full and in ROS 2's spelling (``pkg/msg/Type``), for
ROS 1 too; the ROS version of a definition is :attr:`Definition.ros`.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping

__all__ = [
    "PLACEHOLDER",
    "ActionDefinition",
    "ArrayKind",
    "Constant",
    "Definition",
    "Field",
    "FieldType",
    "InterfaceDefinition",
    "ServiceDefinition",
    "Source",
    "Value",
    "parts_of",
]

#: A constant's or default's value; lists only as defaults of array fields.
Value = bool | int | float | str | tuple[bool | int | float | str, ...]


#: The field that rosidl adds to empty messages.
PLACEHOLDER = "structure_needs_at_least_one_member"


class ArrayKind(Enum):
    """The array kind of a field."""

    NONE = "single value"
    FIXED = "fixed array"
    BOUNDED = "bounded sequence"
    UNBOUNDED = "unbounded sequence"


@dataclass(frozen=True, slots=True)
class FieldType:
    """The type of a field.

    Attributes:
        name: A primitive (``bool``, ``byte``, ``char``, ``int8`` ... ``uint64``, ``float32``,
            ``float64``, ``string``, ``wstring``; in ROS 1 also ``time``, ``duration``) or the full
            name of a message type.
        array: Whether and how the field repeats.
        size: Element count of a fixed array, maximum of a bounded sequence, otherwise None.
        string_bound: Maximum length of a bounded string, in UTF-8 bytes (wstring: UTF-16 units),
            otherwise None.
        letter: Whether a ``char`` is IDL's own, which has another hash; rosidl treats that of a
            ``.msg`` file as ``uint8``. Both are numbers from 0 to 255 here.
    """

    name: str
    array: ArrayKind = ArrayKind.NONE
    size: int | None = None
    string_bound: int | None = None
    letter: bool = False

    @property
    def is_compound(self) -> bool:
        """True if the element type is a message type."""
        return "/" in self.name

    def __str__(self) -> str:
        text = self.name if self.string_bound is None else f"{self.name}<={self.string_bound}"
        if self.array is ArrayKind.FIXED:
            return f"{text}[{self.size}]"
        if self.array is ArrayKind.BOUNDED:
            return f"{text}[<={self.size}]"
        return f"{text}[]" if self.array is ArrayKind.UNBOUNDED else text


@dataclass(frozen=True, slots=True)
class Field:
    """One field of a message.

    Attributes:
        name: The name on the wire.
        type: Its type.
        default: Default value given in the definition (ROS 2); None if there is none.
        comment: The comment lines above and beside the field, joined by newlines.
        unit: Unit named in the comment, e.g. ``m`` or ``rad/s``; empty if there is none.
        place: Line and column in the source's file, 1-based; zeros if unknown.
    """

    name: str
    type: FieldType
    default: Value | None = None
    comment: str = ""
    unit: str = ""
    place: tuple[int, int] = field(default=(0, 0), compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Constant:
    """A named constant of a message.

    Attributes:
        name: Its name, e.g. ``STATUS_EXECUTING``.
        type: Primitive type name.
        value: The value, converted to Python.
        text: The value as written in the definition (md5 sums are computed over it).
        comment: The comment lines above and beside the constant, joined by newlines.
    """

    name: str
    type: str
    value: bool | int | float | str
    text: str
    comment: str = ""


@dataclass(frozen=True, slots=True)
class Source:
    """The origin of a definition.

    Attributes:
        provider: Name of the provider, e.g. ``rosbags jazzy``, ``workspace /opt/ros/jazzy``,
            ``wire /camera/image``.
        file: Path or label used in error messages.
    """

    provider: str
    file: str


@dataclass(frozen=True)
class Definition:
    """A message definition.

    Attributes:
        name: Full name, ``pkg/msg/Type``.
        ros: 1 or 2: the ROS whose syntax, primitive types and wire format it has.
        fields: In order of declaration. An empty ROS 2 message has no fields here; codecs add the
            placeholder byte that its wire format demands.
        constants: In order of declaration.
        text: The definition as received, comments included.
        source: Its origin.
        nested: Every message type it needs, directly or indirectly, by full name.
        comment: The comment at the start of the definition, about the message as a whole.
    """

    name: str
    ros: int
    fields: tuple[Field, ...]
    constants: tuple[Constant, ...] = ()
    text: str = ""
    source: Source = Source("text", "<text>")
    nested: Mapping[str, Definition] = field(default_factory=dict, compare=False, repr=False)
    comment: str = ""

    def constant(self, name: str) -> Constant:
        """Return the constant `name`; raises KeyError with the known names."""
        for candidate in self.constants:
            if candidate.name == name:
                return candidate
        known = ", ".join(c.name for c in self.constants) or "none"
        raise KeyError(f"{self.name} has no constant {name!r}; it has: {known}")


@dataclass(frozen=True)
class ServiceDefinition:
    """A service definition: ``pkg/srv/Type`` with its request and response messages."""

    name: str
    ros: int
    request: Definition
    response: Definition
    text: str = ""
    source: Source = Source("text", "<text>")


@dataclass(frozen=True)
class ActionDefinition:
    """An action definition: ``pkg/action/Type`` with its goal, result and feedback messages."""

    name: str
    ros: int
    goal: Definition
    result: Definition
    feedback: Definition
    text: str = ""
    source: Source = Source("text", "<text>")


InterfaceDefinition = Definition | ServiceDefinition | ActionDefinition


def parts_of(definition: InterfaceDefinition) -> tuple[Definition, ...]:
    """Return the messages that an interface consists of: one, two (services) or three (actions)."""
    if isinstance(definition, ServiceDefinition):
        return definition.request, definition.response
    if isinstance(definition, ActionDefinition):
        return definition.goal, definition.result, definition.feedback
    return (definition,)
