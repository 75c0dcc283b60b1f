"""Corresponding types of ROS 1 and ROS 2: names, fields, times, and what is lost or added.

Differences (ROS 2 design article "Mapping between ROS interface types and DDS", the migration
guide, and ros1_bridge's rules): ``time`` and ``duration`` are messages in ROS 2, its ``Header`` has
no ``seq``, field names are lower case, some types have moved, some have more fields.
"""

from __future__ import annotations

import logging
import re
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from rosglass.errors import Error, TypeNotFoundError, UnsupportedError
from rosglass.interfaces.definition import (
    ActionDefinition,
    ArrayKind,
    Constant,
    Definition,
    Field,
    FieldType,
    ServiceDefinition,
    Source,
)

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from rosglass.interfaces.definition import InterfaceDefinition
    from rosglass.interfaces.library import Library

__all__ = ["RENAMED", "Counterparts", "Pair", "PairedField", "match"]

#: ROS 1's types that have another name in ROS 2.
RENAMED = {
    "rosgraph_msgs/msg/Log": "rcl_interfaces/msg/Log",
    "std_msgs/msg/Duration": "builtin_interfaces/msg/Duration",
    "std_msgs/msg/Time": "builtin_interfaces/msg/Time",
    "tf/msg/tfMessage": "tf2_msgs/msg/TFMessage",
    "roscpp/srv/Empty": "std_srvs/srv/Empty",
    "roscpp_tutorials/srv/TwoInts": "example_interfaces/srv/AddTwoInts",
    "rospy_tutorials/srv/AddTwoInts": "example_interfaces/srv/AddTwoInts",
}
#: ROS 2's types with another name in ROS 1; of several names, the usual one.
_BACK = {new: old for old, new in RENAMED.items()}
#: Packages that have another name in ROS 2.
_PACKAGES = {
    "hector_rviz_plugins": "hector_rviz_plugins_msgs",
    "topic_tools": "topic_tools_interfaces",
}
_PACKAGES_BACK = {new: old for old, new in _PACKAGES.items()}
#: ROS 1's primitives that are messages in ROS 2.
_TIMES = {"time": "builtin_interfaces/msg/Time", "duration": "builtin_interfaces/msg/Duration"}
_TIMES_BACK = {new: old for old, new in _TIMES.items()}
#: ROS 1's primitives -> ROS 2's with the same meaning, the usual one first.
_PRIMITIVES = {
    "byte": ("int8", "byte", "uint8"),
    "char": ("uint8", "char"),
    "string": ("string", "wstring"),
    "uint8": ("uint8", "byte", "char"),
}
#: ROS 2's primitives -> ROS 1's.
_PRIMITIVES_BACK = {"byte": "uint8", "char": "uint8", "wstring": "string"}
_HEADER = "std_msgs/msg/Header"
#: The field that only ROS 1's Header has.
_SEQ = "seq"
#: The field that rosidl adds to messages without fields.
_FILLER = "structure_needs_at_least_one_member"


@dataclass(frozen=True, slots=True)
class PairedField:
    """A field in ROS 1 and the corresponding one in ROS 2.

    Attributes:
        one: Path of attributes in ROS 1's message, usually one name.
        two: The same in ROS 2's.
        type_one: Its type in ROS 1.
        type_two: Its type in ROS 2.
        inner: For messages, how their fields correspond; None for primitives and times.
    """

    one: tuple[str, ...]
    two: tuple[str, ...]
    type_one: FieldType
    type_two: FieldType
    inner: Pair | None = None


@dataclass(frozen=True, slots=True)
class Pair:
    """A message type of ROS 1 and the corresponding one of ROS 2.

    Attributes:
        one: ROS 1's definition.
        two: ROS 2's.
        fields: The corresponding fields, in ROS 1's order.
        only_one: Fields that only ROS 1's has, except ``Header.seq``; dropped on the way to ROS 2.
        only_two: Fields that only ROS 2's has; dropped on the way to ROS 1, default the other way.
        exact: Whether the fields have the same bytes in one wire format, except ``Header.seq`` at
            the very beginning.
        has_times: Whether it contains times or durations, at any depth.
        has_seq: Whether it contains a ``Header.seq`` that ROS 2 lacks.
    """

    one: Definition
    two: Definition
    fields: tuple[PairedField, ...]
    only_one: tuple[str, ...] = ()
    only_two: tuple[str, ...] = ()
    exact: bool = False
    has_times: bool = False
    has_seq: bool = False

    def lost(self, ros: int, prefix: str = "") -> Iterator[str]:
        """Yield the paths of fields that only ROS `ros` has."""
        for name in self.only_one if ros == 1 else self.only_two:
            yield prefix + name
        for field in self.fields:
            if field.inner is not None:
                kind = field.type_one if ros == 1 else field.type_two
                many = "" if kind.array is ArrayKind.NONE else "[]"
                path = ".".join(field.one if ros == 1 else field.two)
                yield from field.inner.lost(ros, f"{prefix}{path}{many}.")


#: Pairs by the ids of both definitions, which the pairs keep alive.
_Pairs = dict[tuple[int, int], tuple[Definition, Definition, "Pair | None"]]


class Counterparts:
    """Finds or derives the corresponding type of the other ROS.

    Args:
        library: Library for the types of the other ROS.
    """

    def __init__(self, library: Library) -> None:
        self._library = library
        #: Caches for nested types, each of which is looked up, derived and compared once.
        self._found: dict[int, tuple[Definition, Pair]] = {}
        self._pairs: _Pairs = {}

    def message(self, source: Definition, *wanted: Definition) -> Pair:
        """Return a message and its counterpart.

        Args:
            source: The definition, of either ROS.
            wanted: Definitions of the other ROS to prefer when they correspond: those in use.

        Raises:
            UnsupportedError: It has no counterpart: field names differ only in case.
        """
        for candidate in wanted:
            pair = self._match(source, candidate)
            if pair is not None:
                return pair
        if id(source) not in self._found:
            self._found[id(source)] = source, self._counterpart(source)
        return self._found[id(source)][1]

    def _counterpart(self, source: Definition) -> Pair:
        for candidate in self._candidates(source.name, source.ros):
            if isinstance(candidate, Definition):
                pair = self._match(source, candidate)
                if pair is not None:
                    return pair
        pair = self._match(source, self._derived(source))
        assert pair is not None, source.name
        return pair

    def _match(self, source: Definition, other: Definition) -> Pair | None:
        one, two = (source, other) if source.ros == 1 else (other, source)
        return match(one, two, self._pairs)

    def service(
        self, source: ServiceDefinition, *wanted: ServiceDefinition
    ) -> tuple[ServiceDefinition, Pair, Pair]:
        """Return a service's counterpart, and how requests and responses correspond.

        Arguments and errors as in :meth:`message`.
        """
        for candidate in (*wanted, *self._candidates(source.name, source.ros)):
            if isinstance(candidate, ServiceDefinition):
                request = self._match(source.request, candidate.request)
                response = self._match(source.response, candidate.response)
                if request is not None and response is not None:
                    return candidate, request, response
        ros = 3 - source.ros
        joint = "_" if ros == 2 else ""
        asked = replace(self._derived(source.request), name=f"{source.name}{joint}Request")
        reply = replace(self._derived(source.response), name=f"{source.name}{joint}Response")
        text = f"{asked.text}---\n{reply.text}"
        found = ServiceDefinition(source.name, ros, asked, reply, text, asked.source)
        first, second = self._match(source.request, asked), self._match(source.response, reply)
        assert first is not None
        assert second is not None
        return found, first, second

    def action(
        self, source: ActionDefinition, *wanted: ActionDefinition
    ) -> tuple[ActionDefinition, Pair, Pair, Pair]:
        """Return an action's counterpart, and how goals, results and feedback correspond.

        Arguments and errors as in :meth:`message`.
        """
        parts = source.goal, source.result, source.feedback
        for candidate in (*wanted, *self._candidates(source.name, source.ros)):
            if isinstance(candidate, ActionDefinition):
                others = candidate.goal, candidate.result, candidate.feedback
                pairs = [self._match(one, two) for one, two in zip(parts, others, strict=True)]
                first, second, third = pairs
                if first is not None and second is not None and third is not None:
                    return candidate, first, second, third
        ros = 3 - source.ros
        base = f"{source.name}_" if ros == 2 else source.name.replace("/action/", "/msg/")
        goal, result, feedback = (
            replace(self._derived(part), name=f"{base}{word}")
            for part, word in zip(parts, ("Goal", "Result", "Feedback"), strict=True)
        )
        text = f"{goal.text}---\n{result.text}---\n{feedback.text}"
        found = ActionDefinition(source.name, ros, goal, result, feedback, text, goal.source)
        first, second, third = (
            self._match(one, two) for one, two in zip(parts, (goal, result, feedback), strict=True)
        )
        assert first is not None
        assert second is not None
        assert third is not None
        return found, first, second, third

    def _candidates(self, name: str, ros: int) -> Iterator[InterfaceDefinition]:
        for other in dict.fromkeys(_names(name, ros)):
            try:
                yield self._library.definition(other, ros=3 - ros)
            except TypeNotFoundError:  # noqa: PERF203 - a few names
                continue
            except Error as error:
                logging.getLogger("rosglass.interfaces").warning(
                    "%s of ROS %d is not used as the counterpart of %s: %s",
                    other, 3 - ros, name, error,
                )  # fmt: skip

    def _derived(self, source: Definition) -> Definition:
        """Derive the definition for the other ROS."""
        ros = 3 - source.ros
        nested: dict[str, Definition] = {}
        fields = []
        for field in source.fields:
            if _left_out(source, field):
                continue
            name, bound = field.type.name, field.type.string_bound
            if ros == 2 and name in _TIMES:
                found = self._library.definition(_TIMES[name], ros=2)
                assert isinstance(found, Definition)
                name, nested[found.name] = found.name, found
            elif ros == 1 and name in _TIMES_BACK:
                name = _TIMES_BACK[name]
            elif field.type.is_compound:
                pair = self.message(source.nested[name])
                found = pair.two if ros == 2 else pair.one
                name, nested[found.name] = found.name, found
                nested.update(found.nested)
            elif ros == 2:
                name = _PRIMITIVES.get(name, (name,))[0]
            else:
                name, bound = _PRIMITIVES_BACK.get(name, name), None
            kind = FieldType(name, field.type.array, field.type.size, bound)
            if ros == 1 and kind.array is ArrayKind.BOUNDED:
                kind = FieldType(name, ArrayKind.UNBOUNDED)
            called = _legal(field.name) if ros == 2 else field.name
            fields.append(Field(called, kind, None, field.comment, field.unit))
        if len({field.name for field in fields}) < len(fields):
            raise UnsupportedError(
                f"{source.name} has field names that differ only in case, which ROS 2 forbids; "
                "leave its topics out with --exclude"
            )
        constants = tuple(_constant(constant, ros) for constant in source.constants)
        lines = [f"{c.type} {c.name}={c.text}" for c in constants]
        lines += [f"{field.type} {field.name}".replace("/msg/", "/") for field in fields]
        return Definition(
            source.name,
            ros,
            tuple(fields),
            constants,
            "".join(f"{line}\n" for line in lines),
            Source(f"derived from ROS {source.ros}", f"<{source.name} derived>"),
            nested,
            source.comment,
        )


def match(one: Definition, two: Definition, known: _Pairs | None = None) -> Pair | None:
    """Return how the fields of a message of ROS 1 and one of ROS 2 correspond.

    None if they do not: a field of ROS 1 is missing in ROS 2, or has another meaning there.

    Args:
        one: ROS 1's message.
        two: ROS 2's.
        known: Cache of the pairs found so far; extended.
    """
    known = {} if known is None else known
    key = id(one), id(two)
    if key not in known:
        # Keep both alive, so that no other object gets their ids.
        known[key] = one, two, _match(one, two, known)
    return known[key][2]


def _match(one: Definition, two: Definition, known: _Pairs) -> Pair | None:
    if one.name == "rosgraph_msgs/msg/Log" and two.name == "rcl_interfaces/msg/Log":
        return _log(one, two)
    if _TIMES_BACK.get(two.name) is not None and [f.type.name for f in one.fields] == [
        _TIMES_BACK[two.name]
    ]:
        field = one.fields[0]
        # Its only field corresponds to the whole other message.
        paired = PairedField((field.name,), (), field.type, FieldType(two.name))
        return Pair(one, two, (paired,), exact=True, has_times=True)
    ours = [field for field in one.fields if not _left_out(one, field)]
    theirs = {field.name.lower(): field for field in two.fields if field.name != _FILLER}
    names = [_name_in(field.name, theirs) for field in ours]
    if not set(names) <= theirs.keys() or len(set(names)) < len(names):
        return None
    fields = []
    for field, name in zip(ours, names, strict=True):
        inner, other = None, theirs[name]
        if not _same_array(field.type, other.type):
            return None
        if field.type.name in _TIMES:
            if other.type.name != _TIMES[field.type.name]:
                return None
        elif field.type.is_compound:
            found = two.nested.get(other.type.name)
            inner = None if found is None else match(one.nested[field.type.name], found, known)
            if inner is None:
                return None
        elif other.type.name not in _PRIMITIVES.get(field.type.name, (field.type.name,)):
            return None
        fields.append(PairedField((field.name,), (other.name,), field.type, other.type, inner))
    left = tuple(field.name for key, field in theirs.items() if key not in names)
    inners = [field.inner for field in fields if field.inner is not None]
    made = Pair(
        one,
        two,
        tuple(fields),
        (),
        left,
        has_times=any(field.type_one.name in _TIMES for field in fields)
        or any(inner.has_times for inner in inners),
        has_seq=(one.name == _HEADER and len(one.fields) > len(two.fields))
        or any(inner.has_seq for inner in inners),
    )
    return replace(made, exact=_exact(made, list(theirs) == names))


def _exact(pair: Pair, same_order: bool) -> bool:
    if not same_order or pair.only_two:
        return False
    for place, field in enumerate(pair.fields):
        if field.type_two.name == "wstring":
            return False
        many = field.type_one.array is not ArrayKind.NONE
        if field.type_one.name in _TIMES and many:
            return False  # each value must be checked for its range
        if field.inner is not None:
            if not field.inner.exact or (many and field.inner.has_times):
                return False
            if (place or many) and field.inner.has_seq:
                return False
    return True


def _log(one: Definition, two: Definition) -> Pair:
    """Pair the two logs: ROS 2's has its stamp at the top, and other levels."""
    ours = {field.name: field for field in one.fields}
    theirs = {field.name: field for field in two.fields}
    stamp = PairedField(("header", "stamp"), ("stamp",), FieldType("time"), theirs["stamp"].type)
    fields = [
        PairedField((name,), (name,), ours[name].type, theirs[name].type)
        for name in ("level", "name", "msg", "file", "function", "line")
    ]
    return Pair(one, two, (stamp, *fields), ("header.frame_id", "topics"), has_times=True)


def _same_array(one: FieldType, two: FieldType) -> bool:
    fixed = (ArrayKind.NONE, ArrayKind.FIXED)
    if one.array in fixed or two.array in fixed:
        return one.array is two.array and one.size == two.size
    return True


def _left_out(owner: Definition, field: Field) -> bool:
    if owner.ros == 1:
        return owner.name == _HEADER and field.name == _SEQ
    return field.name == _FILLER


def _legal(name: str) -> str:
    """Convert a field's name to one that is valid in ROS 2."""
    return re.sub("__+", "_", name.lower()).strip("_")


def _name_in(name: str, theirs: Iterable[str]) -> str:
    lower = name.lower()
    return lower if lower in theirs else _legal(name)


def _names(name: str, ros: int) -> Iterator[str]:
    """Yield possible names of a type in the other ROS, the most likely first."""
    package, _, rest = name.partition("/")
    if ros == 1:
        if name in RENAMED:
            yield RENAMED[name]
        yield name
        yield f"{_PACKAGES.get(package, package)}/{rest}"
        if package.endswith("_msgs"):
            yield f"{package.removesuffix('_msgs')}_interfaces/{rest}"
        return
    yield name
    if name in _BACK:
        yield _BACK[name]
    yield f"{_PACKAGES_BACK.get(package, package)}/{rest}"
    if package.endswith("_interfaces"):
        yield f"{package.removesuffix('_interfaces')}_msgs/{rest}"


def _constant(constant: Constant, ros: int) -> Constant:
    """Convert a constant to the other ROS."""
    value = constant.value
    if ros == 1:
        kind = _PRIMITIVES_BACK.get(constant.type, constant.type)
        text = str(value) if isinstance(value, (str, bool)) else constant.text
        return replace(constant, type=kind, text=text)
    kind = _PRIMITIVES.get(constant.type, (constant.type,))[0]
    text = constant.text
    if isinstance(value, str):
        quoted = value.replace("\\", "\\\\").replace('"', '\\"')
        text = f'"{quoted}"'
    elif isinstance(value, bool):
        text = str(value).lower()
    return replace(constant, type=kind, text=text)
