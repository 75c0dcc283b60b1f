"""Type definitions that DDS endpoints announce themselves, read with XTypes TypeLookup.

ROS 2 nodes announce none; programs that use Cyclone DDS directly do. DDS for Extensible Types 1.3,
section 7.3.4 (type representations) and annex B (type objects). Type objects are read as data:
``cyclonedds.dynamic`` would turn them into Python classes, and names from the network into Python
code.

Limits: a ``char`` is read as ``uint8``, which is the same on the wire. Wide strings, enumerations
and unions, optional members, inheritance and the like do not exist in ROS 2 and are refused.
Constants, comments and defaults are not announced.
"""

from __future__ import annotations

import time
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any
from uuid import UUID

from rosglass.comm.names import demangle_type
from rosglass.errors import (
    DefinitionError,
    TimeoutError,  # noqa: A004 - the field's own word
)
from rosglass.interfaces import Definition, parse_type_description
from rosglass.interfaces.resolver import MAX_DEPTH, MAX_FIELDS, MAX_TYPES

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = ["announced_definition", "describe_struct"]

#: Number of endpoints to read at once.
_ROOM = 100
#: Maximum length of a chain of aliases.
_MAX_ALIASES = 16
#: Type ids of ``type_description_interfaces/msg/FieldType`` by the kind's number in XTypes.
_PRIMITIVES = {
    1: 15, 2: 16, 3: 4, 4: 6, 5: 8, 6: 5, 7: 7, 8: 9, 9: 10, 10: 11, 11: 12, 12: 2, 13: 3, 16: 3,
    17: 14,
}  # fmt: skip
_STRINGS = {112: "string_sdefn", 113: "string_ldefn"}
_SEQUENCES = {128: "seq_sdefn", 129: "seq_ldefn"}
_ARRAYS = {144: "array_sdefn", 145: "array_ldefn"}
_COMPLETE, _ALIAS, _STRUCT = 242, 48, 81
_FOREIGN = {
    64: "an enumeration",
    65: "a bit mask",
    82: "a union",
    83: "a bit set",
    98: "a map",
    114: "a wide string",
    115: "a wide string",
    160: "a map",
    161: "a map",
    241: "a type of which only a hash is known",
}
_STRING, _BOUNDED_STRING, _NESTED = 17, 21, 1
_ARRAY, _BOUNDED, _UNBOUNDED = 48, 96, 144


def announced_definition(
    participant: int, guid: bytes, provider: str, timeout: float
) -> Definition | None:
    """Return the definition that a writer or reader in the domain announces.

    Args:
        participant: Cyclone DDS's number for our participant.
        guid: The endpoint's identity.
        provider: Recorded in the definition's source.
        timeout: Seconds to wait for its participant to send missing type objects.

    Returns:
        None if it announces none, or has left.

    Raises:
        TimeoutError: Its participant does not send it.
        DefinitionError: It is not a ROS 2 message.
    """
    from cyclonedds import _clayer, builtin  # noqa: PLC0415 - takes 0.2 s to import
    from cyclonedds.idl._typesupport.DDS.XTypes import TypeObject  # noqa: PLC0415 - the same

    root = _type_id(builtin, participant, guid)
    if root is None:
        return None
    deadline = time.monotonic() + timeout

    def fetch(type_id: Any) -> Any:
        left = max(0.001, deadline - time.monotonic())
        wanted = type_id.serialize(use_version_2=True)[4:]
        found = _clayer.ddspy_get_typeobj(participant, wanted, int(left * 1e9))
        if isinstance(found, int):
            raise TimeoutError(f"the type that it announces is not sent (code {found})")
        try:
            return TypeObject.deserialize(found, has_header=False, use_version_2=True).complete
        except Exception as error:  # a peer's bytes make the parser raise all kinds of errors
            raise DefinitionError(f"its type cannot be read: {error}", "<TypeLookup>") from error

    described = parse_type_description(describe_struct(root, fetch), provider=provider)
    assert isinstance(described, Definition)  # only messages are described
    return described


def _type_id(builtin: Any, participant: int, guid: bytes) -> Any:
    """Return the identifier of an endpoint's type, None if it announces none."""
    key = UUID(bytes=guid)
    owner: Any = SimpleNamespace(_ref=participant)  # no other attribute is used
    for topic in (builtin.BuiltinTopicDcpsPublication, builtin.BuiltinTopicDcpsSubscription):
        reader = builtin.BuiltinDataReader(owner, topic)
        while samples := reader.take(_ROOM):
            for sample in samples:
                if sample.key == key:
                    return sample.type_id
    return None


def describe_struct(root: Any, fetch: Callable[[Any], Any]) -> dict[str, Any]:
    """Return the type description of a struct, as :func:`parse_type_description` takes it.

    Args:
        root: Its type identifier (``cyclonedds``'s ``TypeIdentifier``).
        fetch: Returns the complete type object of an identifier.

    Raises:
        DefinitionError: It uses features that ROS 2 does not have.
    """
    return _Describer(fetch).describe(root)


class _Describer:
    """Describes one struct and the structs that it uses."""

    def __init__(self, fetch: Callable[[Any], Any]) -> None:
        self._fetch = fetch
        self._objects: dict[bytes, Any] = {}
        self._described: dict[str, dict[str, Any]] = {}
        self._depth = self._fields = 0

    def describe(self, root: Any) -> dict[str, Any]:
        """Return the description of the struct with the identifier `root`."""
        main = self._struct(root, "<TypeLookup>")
        others = sorted(name for name in self._described if name != main)
        return {
            "type_description": self._described[main],
            "referenced_type_descriptions": [self._described[name] for name in others],
        }

    def _object(self, type_id: Any, where: str) -> Any:
        if type_id.discriminator != _COMPLETE:
            raise _refusal(type_id.discriminator, where)
        key = bytes(type_id.equivalence_hash)
        if key not in self._objects:
            if len(self._objects) >= MAX_TYPES:
                raise DefinitionError(f"it needs more than {MAX_TYPES} other types", where)
            self._objects[key] = self._fetch(type_id)
        found = self._objects[key]
        if found.discriminator == _ALIAS:
            return None
        if found.discriminator != _STRUCT:
            raise _refusal(found.discriminator, where)
        return found.struct_type

    def _struct(self, type_id: Any, where: str) -> str:
        """Describe a struct and the structs that it uses; return its name."""
        struct = self._object(type_id, where)
        if struct is None:
            raise DefinitionError("an alias cannot be a message", where)
        name = demangle_type(struct.header.detail.type_name)
        if name in self._described:
            return name
        label = f"<{name[:300]} from TypeLookup>"
        if struct.struct_flags.IS_MUTABLE or struct.header.base_type.discriminator:
            raise DefinitionError("mutable and derived structs are not ROS 2's", label)
        self._depth += 1
        self._fields += len(struct.member_seq)
        if self._depth > MAX_DEPTH:
            raise DefinitionError(f"types nest deeper than {MAX_DEPTH} levels", label)
        if self._fields > MAX_FIELDS:
            raise DefinitionError(f"it has more than {MAX_FIELDS} fields", label)
        fields: list[dict[str, Any]] = []
        self._described[name] = {"type_name": name, "fields": fields}
        for member in struct.member_seq:
            where = f"{label}, field {member.detail.name[:100]}"
            if member.common.member_flags.IS_OPTIONAL:
                raise DefinitionError("optional fields are not ROS 2's", where)
            kind = self._field(member.common.member_type_id, where)
            fields.append({"name": member.detail.name, "type": kind, "default_value": ""})
        self._depth -= 1
        return name

    def _field(self, type_id: Any, where: str) -> dict[str, Any]:
        type_id = self._unaliased(type_id, where)
        kind = type_id.discriminator
        if kind in _SEQUENCES:
            sequence = getattr(type_id, _SEQUENCES[kind])
            block = _BOUNDED if sequence.bound else _UNBOUNDED
            return self._element(sequence.element_identifier, where, block, sequence.bound)
        if kind in _ARRAYS:
            array = getattr(type_id, _ARRAYS[kind])
            if len(array.array_bound_seq) != 1:
                raise DefinitionError("arrays of several dimensions are not ROS 2's", where)
            return self._element(array.element_identifier, where, _ARRAY, array.array_bound_seq[0])
        return self._element(type_id, where, 0, 0)

    def _element(self, type_id: Any, where: str, block: int, capacity: int) -> dict[str, Any]:
        type_id = self._unaliased(type_id, where)
        kind = type_id.discriminator
        bound, nested = 0, ""
        if kind in _PRIMITIVES:
            base = _PRIMITIVES[kind]
        elif kind in _STRINGS:
            bound = getattr(type_id, _STRINGS[kind]).bound
            base = _BOUNDED_STRING if bound else _STRING
        elif kind in _SEQUENCES or kind in _ARRAYS:
            raise DefinitionError("sequences of sequences are not ROS 2's", where)
        else:
            base, nested = _NESTED, self._struct(type_id, where)
        return {
            "type_id": base + block,
            "capacity": capacity,
            "string_capacity": bound,
            "nested_type_name": nested,
        }

    def _unaliased(self, type_id: Any, where: str) -> Any:
        """Return the identifier of a type with its aliases resolved."""
        for _ in range(_MAX_ALIASES + 1):
            if type_id.discriminator != _COMPLETE or self._object(type_id, where) is not None:
                return type_id
            alias = self._objects[bytes(type_id.equivalence_hash)].alias_type
            type_id = alias.body.common.related_type
        raise DefinitionError(f"more than {_MAX_ALIASES} aliases lead to its type", where)


def _refusal(kind: int, where: str) -> DefinitionError:
    what = _FOREIGN.get(kind, f"a type of kind {kind}")
    return DefinitionError(f"it is or contains {what}, which ROS 2 does not have here", where)
