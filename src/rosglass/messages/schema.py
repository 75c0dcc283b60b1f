"""Schemas: resolved definitions with the Python attribute, kind and nested schema of each member.

Schemas are interned by structure: definitions that differ only in comments share one schema, hence
one Python class, whatever their origin.
"""

from __future__ import annotations

import keyword
import threading
import weakref
from dataclasses import dataclass, replace
from enum import Enum
from typing import TYPE_CHECKING, Any, ClassVar

from rosglass.errors import CyclicTypeError, DefinitionError
from rosglass.interfaces.definition import ArrayKind, Definition, Field, FieldType
from rosglass.interfaces.resolver import MAX_DEPTH, Extent

if TYPE_CHECKING:
    from collections.abc import Callable, Hashable, Mapping

__all__ = ["Kind", "Member", "Number", "Schema", "schema_of"]

#: Names of :class:`~rosglass.messages.message.Message` that no field may take.
_PRIVATE = ("_buffer__", "_fill__", "_offset__", "_root__", "_schema__")


class Kind(Enum):
    """The kind of a member's elements."""

    NUMBER = "number"
    TEXT = "text"
    STRUCT = "message"


@dataclass(frozen=True, slots=True)
class Number:
    """A primitive of fixed size.

    Attributes:
        name: Its name in definitions.
        code: Its :mod:`struct` format character.
        size: Bytes, which is also its alignment in CDR.
        dtype: Its numpy type without byte order; ``u1`` for ``bool``.
        low: Smallest integer it holds; None for floats and ``bool``.
        high: Largest integer it holds; None for floats and ``bool``.
    """

    name: str
    code: str
    size: int
    dtype: str
    low: int | None = None
    high: int | None = None

    @property
    def python(self) -> type:
        """The Python class of its values."""
        return bool if self.code == "?" else float if self.low is None else int


def _integer(name: str, code: str, size: int, signed: bool) -> Number:
    bits = 8 * size
    low, high = (-(1 << bits - 1), (1 << bits - 1) - 1) if signed else (0, (1 << bits) - 1)
    return Number(name, code, size, f"{'i' if signed else 'u'}{size}", low, high)


_NUMBERS = {
    number.name: number
    for number in (
        Number("bool", "?", 1, "u1"),
        _integer("int8", "b", 1, True),
        _integer("uint8", "B", 1, False),
        _integer("char", "B", 1, False),
        _integer("byte", "B", 1, False),
        _integer("int16", "h", 2, True),
        _integer("uint16", "H", 2, False),
        _integer("int32", "i", 4, True),
        _integer("uint32", "I", 4, False),
        _integer("int64", "q", 8, True),
        _integer("uint64", "Q", 8, False),
        Number("float32", "f", 4, "f4"),
        Number("float64", "d", 8, "f8"),
    )
}
# byte is int8 in ROS 1 (genmsg), an octet in ROS 2 (rosidl).
_NUMBERS_ROS1 = {**_NUMBERS, "byte": _integer("byte", "b", 1, True)}


def _stamp_definition(name: str, part: str) -> Definition:
    return Definition(name, 1, (Field("secs", FieldType(part)), Field("nsecs", FieldType(part))))


# ROS 1's built-in times are treated as messages of two fields.
_BUILTIN_ROS1 = {
    "time": _stamp_definition("time", "uint32"),
    "duration": _stamp_definition("duration", "int32"),
}
_TIME_TYPES = {"builtin_interfaces/msg/Time", "builtin_interfaces/msg/Duration", *_BUILTIN_ROS1}


@dataclass(frozen=True, slots=True)
class Member:
    """A field of a schema.

    Attributes:
        name: Name on the wire and in dicts.
        attr: Name of the Python attribute.
        field: The definition's field.
        kind: Kind of its elements.
        array: Whether and how it repeats.
        size: Count of a fixed array, maximum of a bounded sequence.
        number: The primitive, for numbers.
        struct: The nested schema, for messages.
        wide: Whether it is a ``wstring``.
        bound: Maximum length of a bounded string, in code units.
    """

    name: str
    attr: str
    field: Field
    kind: Kind
    array: ArrayKind
    size: int | None
    number: Number | None = None
    struct: Schema | None = None
    wide: bool = False
    bound: int | None = None

    @property
    def is_array(self) -> bool:
        """True if the member is an array."""
        return self.array is not ArrayKind.NONE

    @property
    def fixed_count(self) -> int | None:
        """The number of elements of a fixed array, otherwise None."""
        return self.size if self.array is ArrayKind.FIXED else None


class Schema:
    """A message type for the codecs.

    Attributes:
        definition: The definition it was made from.
        name: Full name, ``pkg/msg/Type``.
        ros: 1 or 2.
        members: The fields in wire order.
        by_name: The same, by wire name and by attribute.
        is_time: Whether it is a time or duration (two numbers: seconds and nanoseconds).
        has_wide: Whether a ``wstring`` occurs anywhere in it.
        extent: Number of its fields and values, including those of nested messages.
        cache: Objects that other modules derive from the schema (class, codecs), by key.
    """

    #: Creates a schema's MessageType; set by :mod:`rosglass.messages.types`, which is above.
    make_type: ClassVar[Callable[[Schema], Any]]

    def __init__(self, definition: Definition, members: tuple[Member, ...], extent: Extent) -> None:
        self.definition, self.extent = definition, extent
        self.name, self.ros = definition.name, definition.ros
        self.members = members
        self.by_name = {member.attr: member for member in members}
        self.by_name.update({member.name: member for member in members})
        self.is_time = self.name in _TIME_TYPES and len(members) == 2
        self.has_wide: bool = any(m.wide or (m.struct and m.struct.has_wide) for m in members)
        self.cache: dict[Hashable, Any] = {}
        self.lock = threading.RLock()

    def __repr__(self) -> str:
        return f"<Schema {self.name} (ROS {self.ros})>"

    def cached(self, key: Hashable, make: Callable[[], Any]) -> Any:
        """Return the cached object for `key`, created when it is first used."""
        try:
            return self.cache[key]
        except KeyError:
            with self.lock:
                if key not in self.cache:
                    self.cache[key] = make()
                return self.cache[key]

    @property
    def type(self) -> Any:
        """The MessageType of this schema."""
        return self.cached("type", lambda: Schema.make_type(self))


_interned: weakref.WeakValueDictionary[Hashable, Schema] = weakref.WeakValueDictionary()
#: Guards `_interned` only, so that resolving a large type blocks no other thread.
_intern_lock = threading.Lock()


def schema_of(definition: Definition) -> Schema:
    """Return the schema of a definition.

    Raises:
        CyclicTypeError: The type contains itself.
        DefinitionError: A nested type is missing, a field name repeats, or a limit of
            :mod:`rosglass.interfaces.resolver` is exceeded.
    """
    return _resolve(definition, definition.nested, (), {})


def _resolve(
    definition: Definition,
    nested: Mapping[str, Definition],
    above: tuple[str, ...],
    done: dict[tuple[int, int], Schema],
) -> Schema:
    """Return a schema; each nested definition is resolved once, and then found in `done`."""
    file = definition.source.file
    numbers = _NUMBERS_ROS1 if definition.ros == 1 else _NUMBERS
    members: dict[str, Member] = {}
    taken: set[str] = set(_PRIVATE)
    extent = Extent()
    for field in definition.fields:
        if field.name in members:
            raise DefinitionError(f"field {field.name!r} appears twice in {definition.name}", file)
        # Names are used in generated code; no parser has checked definitions made by hand.
        if not (field.name.isascii() and field.name.isidentifier()):
            raise DefinitionError(f"{definition.name}: {field.name!r} is not a field name", file)
        attr = _attribute(field.name, taken)
        taken.add(attr)
        ftype = field.type
        kind, number, struct = Kind.NUMBER, numbers.get(ftype.name), None
        if ftype.name in ("string", "wstring"):
            kind = Kind.TEXT
        elif number is None:
            kind = Kind.STRUCT
            struct = _struct(definition, field, nested, above, done)
        extent.add(definition, field, None if struct is None else struct.extent)
        members[field.name] = Member(
            field.name,
            attr,
            field,
            kind,
            ftype.array,
            ftype.size,
            number,
            struct,
            ftype.name == "wstring",
            ftype.string_bound,
        )
    return _intern(definition, tuple(members.values()), extent)


def _struct(
    owner: Definition,
    field: Field,
    nested: Mapping[str, Definition],
    above: tuple[str, ...],
    done: dict[tuple[int, int], Schema],
) -> Schema:
    """Return the schema of a field that is a message."""
    name, file = field.type.name, owner.source.file
    inner = _BUILTIN_ROS1.get(name) if owner.ros == 1 else None
    inner = inner or nested.get(name)
    if inner is None:
        raise DefinitionError(
            f"{owner.name}.{field.name}: no definition of {name!r}", file, *field.place
        )
    inside = inner.nested if inner.nested else nested
    key = id(inner), id(inside)
    found = done.get(key)
    if found is None:
        chain = (*above, owner.name)
        if inner.name in chain:
            cycle = " -> ".join((*chain[chain.index(inner.name) :], inner.name))
            raise CyclicTypeError(f"cyclic type: {cycle}", inner.source.file)
        if len(chain) >= MAX_DEPTH:
            raise DefinitionError(f"types nest deeper than {MAX_DEPTH} levels", inner.source.file)
        found = done[key] = _resolve(inner, inside, chain, done)
    return found


def _intern(definition: Definition, members: tuple[Member, ...], extent: Extent) -> Schema:
    """Return the existing schema with these members, or a new one."""
    key = (
        definition.ros,
        definition.name,
        tuple((m.name, str(m.field.type), repr(m.field.default), id(m.struct)) for m in members),
        tuple((c.name, c.type, repr(c.value)) for c in definition.constants),
    )
    with _intern_lock:
        schema = _interned.get(key)
    if schema is not None:
        return schema
    if not definition.nested:
        used: dict[str, Definition] = {}
        for member in members:
            if member.struct is not None and member.struct.name not in _BUILTIN_ROS1:
                used[member.struct.name] = member.struct.definition
                used.update(member.struct.definition.nested)
        definition = replace(definition, nested=used) if used else definition
    made = Schema(definition, members, extent)
    with _intern_lock:
        return _interned.setdefault(key, made)


def _attribute(name: str, taken: set[str]) -> str:
    attr = name
    if attr.startswith("__"):
        attr = attr.strip("_") + "_"
    if keyword.iskeyword(attr) or not attr:
        attr += "_"
    while attr in taken:
        attr += "_"
    return attr
