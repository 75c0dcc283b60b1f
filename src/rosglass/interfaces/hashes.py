"""md5 sums (ROS 1) and RIHS01 hashes (ROS 2), by which peers compare types.

md5: ``genmsg/gentools.py``. RIHS01: REP 2016 and ``rosidl_generator_type_description``: the SHA-256
of the type description as JSON, without default values.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rosglass.errors import DefinitionError, UnsupportedError
from rosglass.interfaces.definition import (
    PLACEHOLDER,
    ActionDefinition,
    ArrayKind,
    Definition,
    ServiceDefinition,
)
from rosglass.interfaces.derived import derive, service_event
from rosglass.interfaces.parser import parse_message

if TYPE_CHECKING:
    from collections.abc import Mapping

    from rosglass.interfaces.definition import Field, InterfaceDefinition

__all__ = [
    "announced_hashes",
    "load_json",
    "md5",
    "nested_definition",
    "rihs01",
    "type_description",
]

# type_description_interfaces/msg/FieldType's constants. rosidl turns a .msg file's char into IDL's
# uint8, so its id is 3 (AddTwoInts' official hash depends on it); IDL's own has FIELD_TYPE_CHAR.
_TYPE_IDS = {
    "int8": 2, "uint8": 3, "int16": 4, "uint16": 5, "int32": 6, "uint32": 7, "int64": 8,
    "uint64": 9, "float32": 10, "float64": 11, "char": 3, "bool": 15, "byte": 16, "string": 17,
    "wstring": 18,
}  # fmt: skip
_NESTED_ID = 1
_LETTER_ID = 13
_BOUNDED_STRING_OFFSET = 4
_ARRAY_OFFSETS = {
    ArrayKind.NONE: 0,
    ArrayKind.FIXED: 48,
    ArrayKind.BOUNDED: 96,
    ArrayKind.UNBOUNDED: 144,
}

# Types that rosidl and actionlib add to services and actions; fixed parts of the hashes.
_BUILT_IN = {
    (2, "builtin_interfaces/msg/Time"): "int32 sec\nuint32 nanosec",
    (2, "unique_identifier_msgs/msg/UUID"): "uint8[16] uuid",
    (2, "service_msgs/msg/ServiceEventInfo"): (
        "uint8 event_type\nbuiltin_interfaces/Time stamp\nchar[16] client_gid\n"
        "int64 sequence_number"
    ),
    (1, "std_msgs/msg/Header"): "uint32 seq\ntime stamp\nstring frame_id",
    (1, "actionlib_msgs/msg/GoalID"): "time stamp\nstring id",
    (1, "actionlib_msgs/msg/GoalStatus"): (
        "uint8 PENDING=0\nuint8 ACTIVE=1\nuint8 PREEMPTED=2\nuint8 SUCCEEDED=3\nuint8 ABORTED=4\n"
        "uint8 REJECTED=5\nuint8 PREEMPTING=6\nuint8 RECALLING=7\nuint8 RECALLED=8\nuint8 LOST=9\n"
        "GoalID goal_id\nuint8 status\nstring text"
    ),
}


class NoSuchHashError(UnsupportedError, AttributeError):
    """The hash belongs to the other ROS; an AttributeError so that hasattr() and debuggers work."""


def check_definition(value: object) -> None:
    """Raise UnsupportedError if `value` is not a definition, for example a type's name."""
    if not isinstance(value, (Definition, ServiceDefinition, ActionDefinition)):
        raise UnsupportedError(
            f"a definition is expected, as Library.definition(name) returns it, not {value!r:.80}"
        )


def md5(definition: InterfaceDefinition) -> str:
    """Return the md5 sum that ROS 1 peers compare.

    An action's is that of its ``pkg/TypeAction`` message.

    Raises:
        UnsupportedError: `definition` is a ROS 2 one, or no definition.
        DefinitionError: `definition` is not resolved.
    """
    check_definition(definition)
    if definition.ros != 1:
        raise NoSuchHashError(
            f"{definition.name} is a ROS 2 definition, which has no md5 sum; use rihs01()"
        )
    sums: dict[str, str] = {}
    if isinstance(definition, ServiceDefinition):
        texts = [
            _md5_text(part, part.nested, sums) for part in (definition.request, definition.response)
        ]
    else:
        message = _action_message(definition)
        texts = [_md5_text(message, message.nested, sums)]
    return _md5("".join(texts))


def _action_message(definition: Definition | ActionDefinition) -> Definition:
    if isinstance(definition, Definition):
        return definition
    message = derive(definition, "Action")
    assert isinstance(message, Definition)
    return message


def _md5_text(
    definition: Definition, nested: Mapping[str, Definition], sums: dict[str, str]
) -> str:
    lines = [f"{c.type} {c.name}={c.text}" for c in definition.constants]
    for field in definition.fields:
        name = field.type.name
        if not field.type.is_compound:
            lines.append(f"{field.type} {field.name}")
            continue
        if name not in sums:
            sums[name] = _md5(_md5_text(nested_definition(definition, field, nested), nested, sums))
        lines.append(f"{sums[name]} {field.name}")
    return "\n".join(lines).strip()


def _md5(text: str) -> str:
    return _digest("md5", text)


def rihs01(definition: InterfaceDefinition) -> str:
    """Return the type hash of REP 2016, ``RIHS01_`` and 64 hexadecimal digits.

    Raises:
        UnsupportedError: `definition` is a ROS 1 one, or no definition.
        DefinitionError: `definition` is not resolved.
    """
    description = type_description(definition)
    for part in (description["type_description"], *description["referenced_type_descriptions"]):
        for field in part["fields"]:
            del field["default_value"]
    text = load_json().dumps(description, separators=(", ", ": "))
    return f"RIHS01_{_digest('sha256', text)}"


def _digest(algorithm: str, text: str) -> str:
    import hashlib  # noqa: PLC0415 - its 3 ms would be spent by all who load a definition

    return hashlib.new(algorithm, text.encode(), usedforsecurity=False).hexdigest()


def load_json() -> Any:
    """Return Python's json module, whose 1 ms would be spent by all who load a definition."""
    import json  # noqa: PLC0415 - as above

    return json


def announced_hashes(definition: InterfaceDefinition) -> tuple[str, ...]:
    """Return the hashes that peers may announce for a type, its own first.

    For a service, ROS 2 nodes over Zenoh announce the service's own hash. Those over DDS announce
    that of its request (and, with replies, of its response): rmw_fastrtps's ``rmw_service.cpp``.

    Raises:
        UnsupportedError: `definition` is a ROS 1 one, or no definition.
        DefinitionError: `definition` is not resolved.
    """
    own = rihs01(definition)
    if isinstance(definition, ServiceDefinition):
        return own, rihs01(definition.request), rihs01(definition.response)
    return (own,)


def type_description(definition: InterfaceDefinition) -> dict[str, Any]:
    """Return the type description of REP 2016 (``type_description_interfaces/TypeDescription``).

    Returns:
        ``type_description`` and ``referenced_type_descriptions`` (sorted by name), each with
        ``type_name`` and ``fields``.

    Raises:
        UnsupportedError: `definition` is a ROS 1 one, or no definition.
        DefinitionError: `definition` is not resolved.
    """
    check_definition(definition)
    if definition.ros != 2:
        raise NoSuchHashError(
            f"{definition.name} is a ROS 1 definition, which has no RIHS01 hash; use md5()"
        )
    described: dict[str, dict[str, Any]] = {}
    _describe(definition, described)
    main = described.pop(definition.name)
    return {
        "type_description": main,
        "referenced_type_descriptions": [described[name] for name in sorted(described)],
    }


def _describe(definition: InterfaceDefinition, described: dict[str, dict[str, Any]]) -> None:
    if isinstance(definition, ServiceDefinition):
        members: dict[str, InterfaceDefinition] = {
            "request_message": definition.request,
            "response_message": definition.response,
            "event_message": service_event(definition),
        }
    elif isinstance(definition, ActionDefinition):
        labels = ("SendGoal", "GetResult", "FeedbackMessage")
        send_goal, get_result, feedback_message = (
            _derived(definition, f"_{label}") for label in labels
        )
        members = {
            "goal": definition.goal,
            "result": definition.result,
            "feedback": definition.feedback,
            "send_goal_service": send_goal,
            "get_result_service": get_result,
            "feedback_message": feedback_message,
        }
    else:
        _describe_message(definition, definition.nested, described)
        return
    fields = [_field(name, _NESTED_ID, nested=part.name) for name, part in members.items()]
    described[definition.name] = {"type_name": definition.name, "fields": fields}
    for part in members.values():
        _describe(part, described)


def _derived(action: ActionDefinition, suffix: str) -> InterfaceDefinition:
    derived = derive(action, suffix)
    assert derived is not None
    return derived


def _describe_message(
    definition: Definition,
    nested: Mapping[str, Definition],
    described: dict[str, dict[str, Any]],
) -> None:
    if definition.name in described:
        return
    fields: list[dict[str, Any]] = []
    described[definition.name] = {"type_name": definition.name, "fields": fields}
    for field in definition.fields:
        kind = field.type
        capacity = kind.size or 0
        offset = _ARRAY_OFFSETS[kind.array]
        default = "" if field.default is None else str(field.default)
        if kind.is_compound:
            fields.append(_field(field.name, _NESTED_ID + offset, capacity, nested=kind.name))
            _describe_message(nested_definition(definition, field, nested), nested, described)
            continue
        bound = kind.string_bound or 0
        basic = _LETTER_ID if kind.letter else _TYPE_IDS[kind.name]
        type_id = basic + offset + (_BOUNDED_STRING_OFFSET if bound else 0)
        fields.append(_field(field.name, type_id, capacity, bound, default=default))
    if not fields:
        fields.append(_field(PLACEHOLDER, _TYPE_IDS["uint8"]))


def _field(
    name: str,
    type_id: int,
    capacity: int = 0,
    bound: int = 0,
    nested: str = "",
    default: str = "",
) -> dict[str, Any]:
    return {
        "name": name,
        "type": {
            "type_id": type_id,
            "capacity": capacity,
            "string_capacity": bound,
            "nested_type_name": nested,
        },
        "default_value": default,
    }


def nested_definition(
    owner: Definition, field: Field, nested: Mapping[str, Definition]
) -> Definition:
    """Return the message of a field, which the resolved `owner` has or ROS itself adds."""
    name = field.type.name
    found = nested.get(name)
    if found is None:
        text = _BUILT_IN.get((owner.ros, name))
        if text is None:
            raise DefinitionError(
                f"field {field.name}: {owner.name} is not resolved, {name} is missing; load it "
                "with Library.definition()",
                owner.source.file,
                *field.place,
            )
        found = parse_message(text, name, ros=owner.ros)
    return found
