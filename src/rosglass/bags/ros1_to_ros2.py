"""Playing ROS 1 recordings to ROS 2 robots: the same message, in ROS 2's words.

What differs (design article "Mapping between ROS 1 and ROS 2", ros1_bridge's rules): ``time`` and
``duration`` are messages, ``Header`` has no ``seq``, field names are lower case.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

from rosglass.errors import BagError, Error
from rosglass.interfaces import Definition, Source
from rosglass.messages import MessageType, default_library

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.interfaces import Field, Library

__all__ = ["Converter"]

_TIMES = {
    "time": ("builtin_interfaces/msg/Time", ("sec", "nanosec")),
    "duration": ("builtin_interfaces/msg/Duration", ("sec", "nanosec")),
}
_RENAMED = {"tf/msg/tfMessage": "tf2_msgs/msg/TFMessage"}
#: ROS 1's older names of numbers -> what they are on the wire.
_NUMBERS = {"char": "uint8", "byte": "int8"}
#: ROS 1's numbers that have other names in ROS 2.
_COUNTERPARTS = {"char": ("uint8", "char"), "byte": ("byte", "uint8", "int8")}
#: What ROS 2's headers do without.
_LEFT_OUT = {"std_msgs/msg/Header": frozenset({"seq"})}


class _Step(NamedTuple):
    source: str
    target: str
    convert: Callable[[Any], Any] | None


class Converter:
    """Turns one type's messages from ROS 1 into ROS 2.

    The target is ROS 2's own type of the same name where its fields correspond, otherwise a type
    derived from ROS 1's definition.

    Args:
        source: ROS 1's type.
        library: Where ROS 2's types are looked up; None for the shared library.

    Attributes:
        type: The type in ROS 2.

    Raises:
        BagError: The type has no counterpart in ROS 2; says which field.
    """

    def __init__(self, source: MessageType, library: Library | None = None) -> None:
        self._source = source
        self._library = default_library() if library is None else library
        target = self._target(source.definition)
        self.type = MessageType(target)
        self._plan = self._steps(source.definition, target)

    def convert(self, data: bytes) -> bytes:
        """Return the message in CDR; raises DecodeError when it is none of the source's type."""
        values = _apply(self._plan, self._source.decode(data, wire="ros1"))
        return self.type.encode(values, wire="cdr")

    def _target(self, source: Definition) -> Definition:
        name = _RENAMED.get(source.name, source.name)
        try:
            known = self._library.definition(name, ros=2)
        except Error:
            known = None
        if isinstance(known, Definition) and _corresponds(source, known):
            return known
        return self._derived(source)

    def _derived(self, source: Definition) -> Definition:
        nested: dict[str, Definition] = {}
        fields = []
        for field in source.fields:
            if field.name in _LEFT_OUT.get(source.name, ()):
                continue
            type_name = field.type.name
            if type_name in _TIMES:
                type_name = _TIMES[type_name][0]
                found = self._library.definition(type_name, ros=2)
                assert isinstance(found, Definition)
            elif field.type.is_compound:
                found = self._target(source.nested[type_name])
                type_name = found.name
            else:
                fields.append(_renamed(field, _NUMBERS.get(type_name, type_name)))
                continue
            nested[found.name] = found
            nested.update(found.nested)
            fields.append(_renamed(field, type_name))
        names = [field.name for field in fields]
        if len(set(names)) < len(names):
            raise BagError(
                f"{source.name} has field names that differ only in case, which ROS 2 forbids; "
                "leave its topics out with --exclude"
            )
        constants = [replace(c, type=_NUMBERS.get(c.type, c.type)) for c in source.constants]
        lines = [f"{c.type} {c.name}={c.text}" for c in constants]
        lines += [f"{field.type} {field.name}".replace("/msg/", "/") for field in fields]
        return replace(
            source,
            ros=2,
            fields=tuple(fields),
            constants=tuple(constants),
            text="\n".join(lines) + "\n",
            source=Source("ros1 recording", f"<{source.name}>"),
            nested=nested,
        )

    def _steps(self, source: Definition, target: Definition) -> tuple[_Step, ...]:
        theirs = {field.name.lower(): field for field in target.fields}
        steps = []
        for field in source.fields:
            if field.name in _LEFT_OUT.get(source.name, ()):
                continue
            other = theirs[field.name.lower()]
            convert: Callable[[Any], Any] | None = None
            if field.type.name in _TIMES:
                convert = _time
            elif field.type.is_compound:
                steps_in = self._steps(
                    source.nested[field.type.name], target.nested[other.type.name]
                )
                convert = _applying(steps_in)
            elif field.type.name == "byte" and other.type.name != "int8":
                steps.append(_Step(field.name, other.name, _octets))
                continue
            if convert is not None and field.type.array.value != "single value":
                convert = _each(convert)
            steps.append(_Step(field.name, other.name, convert))
        return tuple(steps)


def _renamed(field: Field, type_name: str) -> Field:
    return replace(field, name=field.name.lower(), type=replace(field.type, name=type_name))


def _corresponds(source: Definition, target: Definition) -> bool:
    """Say whether each of the source's fields has its place in the target, and the reverse."""
    ours = {
        field.name.lower(): field
        for field in source.fields
        if field.name not in _LEFT_OUT.get(source.name, ())
    }
    theirs = {field.name.lower(): field for field in target.fields}
    if ours.keys() != theirs.keys():
        return False
    for name, field in ours.items():
        other = theirs[name]
        if (field.type.array, field.type.size) != (other.type.array, other.type.size):
            return False
        if field.type.name in _TIMES:
            if other.type.name != _TIMES[field.type.name][0]:
                return False
        elif field.type.is_compound:
            inner = target.nested.get(other.type.name)
            if inner is None or not _corresponds(source.nested[field.type.name], inner):
                return False
        elif other.type.name not in _COUNTERPARTS.get(field.type.name, (field.type.name,)):
            return False
    return True


def _time(value: Any) -> dict[str, int]:
    return {"sec": value.secs, "nanosec": value.nsecs}


def _octets(value: Any) -> Any:
    """Return ROS 1's signed bytes as ROS 2's, which have no sign."""
    return value & 0xFF if isinstance(value, int) else [int(item) & 0xFF for item in value]


def _applying(steps: tuple[_Step, ...]) -> Callable[[Any], Any]:
    return lambda value: _apply(steps, value)


def _each(convert: Callable[[Any], Any]) -> Callable[[Any], Any]:
    return lambda values: [convert(value) for value in values]


def _apply(steps: tuple[_Step, ...], message: Any) -> dict[str, Any]:
    return {
        target: message[source] if convert is None else convert(message[source])
        for source, target, convert in steps
    }
