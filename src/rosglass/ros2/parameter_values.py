"""Parameter values: Python's on one side, ``rcl_interfaces`` messages on the other.

Types and fields: ``rcl_interfaces/msg/ParameterType``, ``ParameterValue``, ``ParameterDescriptor``
and ``ParameterEvent``.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

from rosglass.comm import ParameterDescriptor, ParameterEvent, ParameterType, Range
from rosglass.errors import ParameterError

if TYPE_CHECKING:
    from collections.abc import Iterable

    from rosglass.comm import ParameterValue, Time
    from rosglass.messages import Message

__all__ = [
    "TYPE_NAMES",
    "TypedValue",
    "check_name",
    "check_values",
    "descriptor_from_message",
    "descriptor_to_message",
    "event_from_message",
    "event_to_message",
    "in_range",
    "parameter_to_message",
    "typed",
    "value_from_message",
    "value_to_message",
]

#: What people call the types, and what ROS's own tools print.
TYPE_NAMES = {
    ParameterType.NOT_SET: "not set",
    ParameterType.BOOL: "boolean",
    ParameterType.INTEGER: "integer",
    ParameterType.DOUBLE: "double",
    ParameterType.STRING: "string",
    ParameterType.BYTE_ARRAY: "byte array",
    ParameterType.BOOL_ARRAY: "boolean array",
    ParameterType.INTEGER_ARRAY: "integer array",
    ParameterType.DOUBLE_ARRAY: "double array",
    ParameterType.STRING_ARRAY: "string array",
}
_FIELDS = {
    ParameterType.BOOL: "bool_value",
    ParameterType.INTEGER: "integer_value",
    ParameterType.DOUBLE: "double_value",
    ParameterType.STRING: "string_value",
    ParameterType.BYTE_ARRAY: "byte_array_value",
    ParameterType.BOOL_ARRAY: "bool_array_value",
    ParameterType.INTEGER_ARRAY: "integer_array_value",
    ParameterType.DOUBLE_ARRAY: "double_array_value",
    ParameterType.STRING_ARRAY: "string_array_value",
}
_SCALARS: dict[type, ParameterType] = {
    bool: ParameterType.BOOL,
    int: ParameterType.INTEGER,
    float: ParameterType.DOUBLE,
    str: ParameterType.STRING,
}
_ARRAYS = {
    ParameterType.BOOL: ParameterType.BOOL_ARRAY,
    ParameterType.INTEGER: ParameterType.INTEGER_ARRAY,
    ParameterType.DOUBLE: ParameterType.DOUBLE_ARRAY,
    ParameterType.STRING: ParameterType.STRING_ARRAY,
}
_ARRAY_TYPES = frozenset(_ARRAYS.values()) | {ParameterType.BYTE_ARRAY}
_INT_LIMITS = (-(2**63), 2**63 - 1)
#: Units in the last place that two doubles may differ by and count as equal, as in rclcpp.
_ULPS = 100


class TypedValue(NamedTuple):
    """A value together with its type, which an empty list does not show.

    Attributes:
        type: The type.
        value: The value: None, bool, int, float, str, bytes, or a list of the middle four.
    """

    type: ParameterType
    value: ParameterValue

    def copy(self) -> ParameterValue:
        """Return the value, a list as a copy of its own."""
        return list(self.value) if isinstance(self.value, list) else self.value  # type: ignore[return-value]

    def is_already(self, value: ParameterValue) -> bool:
        """Return whether setting `value` would change nothing: equal, and of the same type."""
        return self.value == value and typed("", value, self.type).type is self.type


_NOT_SET = TypedValue(ParameterType.NOT_SET, None)


def check_name(name: object) -> str:
    """Return `name` if a parameter can have it; raises ParameterError."""
    if not isinstance(name, str) or not name:
        raise ParameterError(f"a parameter's name must be a text that is not empty, got {name!r}")
    _check_text(f"the parameter name {name!r}", name)
    return name


def check_values(values: object, node: str) -> None:
    """Raise ParameterError unless `values` gives values by name."""
    if not isinstance(values, Mapping):
        raise ParameterError(
            f"{node}: parameters are set by a dict of names and values, e.g. "
            f"set({{'speed': 1.5}}); got {values!r}"
        )


def typed(name: str, value: object, known: ParameterType = ParameterType.NOT_SET) -> TypedValue:
    """Return a Python value with the parameter type that it has.

    Numpy's scalars and arrays, tuples, bytearrays and the like become plain values and lists.

    Args:
        name: The parameter's name, for messages.
        value: The value.
        known: The type the parameter has already; an empty list takes it over.

    Raises:
        ParameterError: The value can be no parameter's.
    """
    if not isinstance(value, (bool, int, float, str, bytes, bytearray, memoryview, list, tuple)):
        plain = getattr(value, "tolist", None)
        if plain is not None:
            value = plain()
    if value is None:
        return _NOT_SET
    if isinstance(value, (bytes, bytearray, memoryview)):
        return TypedValue(ParameterType.BYTE_ARRAY, bytes(value))
    if isinstance(value, (list, tuple)):
        return _typed_list(name, value, known)
    return _typed_scalar(f"parameter {name!r}", value)


def _typed_list(name: str, values: list[Any] | tuple[Any, ...], known: ParameterType) -> TypedValue:
    if not values:
        if known is ParameterType.BYTE_ARRAY:
            return TypedValue(known, b"")
        if known in _ARRAY_TYPES:
            return TypedValue(known, [])
        if known is not ParameterType.NOT_SET:
            raise ParameterError(
                f"parameter {name!r} is of type {TYPE_NAMES[known]}, and cannot become a list"
            )
        raise ParameterError(
            f"parameter {name!r}: an empty list does not say its type; give it in the descriptor, "
            "e.g. ParameterDescriptor(type=ParameterType.STRING_ARRAY)"
        )
    if isinstance(values[0], (bytes, bytearray)):
        raise ParameterError(
            f"parameter {name!r}: a byte array is one bytes object, e.g. bytes([1, 2]), not a list"
        )
    items = [_typed_scalar(f"parameter {name!r}[{i}]", item) for i, item in enumerate(values)]
    first = items[0].type
    for position, item in enumerate(items):
        if item.type is not first:
            advice = (
                "; write whole numbers as 1.0" if ParameterType.DOUBLE in (first, item.type) else ""
            )
            raise ParameterError(
                f"parameter {name!r}: the items of a list must be of one type, but [0] is of type "
                f"{TYPE_NAMES[first]} and [{position}] of type {TYPE_NAMES[item.type]}{advice}"
            )
    return TypedValue(_ARRAYS[first], [item.value for item in items])  # type: ignore[arg-type]


def _typed_scalar(what: str, value: object) -> TypedValue:
    plain = getattr(value, "tolist", None)
    if plain is not None:
        value = plain()
    kind = next((kind for kind in _SCALARS if isinstance(value, kind)), None)
    if kind is None:
        raise ParameterError(
            f"{what}: a parameter is a bool, int, float, str, bytes or a list of one of the first "
            f"four, got {_shown(value)}"
        )
    parameter_type = _SCALARS[kind]
    if parameter_type is ParameterType.INTEGER:
        low, high = _INT_LIMITS
        assert isinstance(value, int)
        if not low <= value <= high:
            raise ParameterError(
                f"{what}: {value} is beyond the 64 bits of an integer ({low} to {high}); "
                "a float would hold it, without its last digits"
            )
    if parameter_type is ParameterType.STRING:
        assert isinstance(value, str)
        _check_text(what, value)
    # Subclasses (IntEnum, numpy's float64) would surprise whoever reads the value.
    return TypedValue(parameter_type, kind(value))


def _check_text(what: str, text: str) -> None:
    if "\0" in text:
        raise ParameterError(f"{what} has a NUL character at position {text.index(chr(0))}")
    try:
        text.encode()
    except UnicodeEncodeError as error:
        raise ParameterError(
            f"{what} cannot be written as UTF-8 (position {error.start}: {error.reason})"
        ) from None


def _shown(value: object) -> str:
    shown = repr(value)
    return f"{shown[:77]}..." if len(shown) > 80 else shown


def in_range(allowed: Range, value: float) -> str:
    """Say why a number is not allowed; an empty string when it is.

    The rules are rclcpp's (``node_parameters.cpp``): both ends are allowed, and between them the
    steps counted from the lower one; doubles may be off by rounding.
    """
    low, high, step = allowed
    if isinstance(value, float):
        if _same(value, low) or _same(value, high):
            return ""
        inside = low < value < high
        on_step = not step or _same(value, low + round((value - low) / step) * step)
    else:
        if value in (low, high):
            return ""
        inside = low < value < high
        on_step = not step or (value - low) % step == 0
    if not inside:
        return f"{value} is outside {low} to {high}"
    return "" if on_step else f"{value} is not among {low}, {low + step} ... {high} (step {step})"


def _same(one: float, other: float) -> bool:
    tolerance = sys.float_info.epsilon * abs(one + other) * _ULPS
    return one == other or (math.isfinite(tolerance) and abs(one - other) <= tolerance)


def value_to_message(value: TypedValue) -> dict[str, Any]:
    """Return the fields of a ``ParameterValue``."""
    if value.type is ParameterType.NOT_SET:
        return {"type": 0}
    return {"type": int(value.type), _FIELDS[value.type]: value.value}


def value_from_message(message: Message, who: str = "") -> TypedValue:
    """Return the value of a received ``ParameterValue``.

    Args:
        message: The message.
        who: Whose parameter it is, for messages.

    Raises:
        ParameterError: Its type is none of ROS's.
    """
    parameter_type = _type(message["type"], who)
    if parameter_type is ParameterType.NOT_SET:
        return _NOT_SET
    value = getattr(message, _FIELDS[parameter_type])
    if parameter_type is ParameterType.BYTE_ARRAY:
        return TypedValue(parameter_type, bytes(value))
    if parameter_type in _ARRAY_TYPES:
        plain = value.tolist() if hasattr(value, "tolist") else list(value)
        return TypedValue(parameter_type, plain)
    return TypedValue(parameter_type, value)


def _type(number: int, who: str) -> ParameterType:
    try:
        return ParameterType(number)
    except ValueError:
        raise ParameterError(
            f"{who or 'a parameter'} has the type {number!r}, which ROS 2 does not know "
            f"(0 to {max(ParameterType)})"
        ) from None


def parameter_to_message(name: str, value: TypedValue) -> dict[str, Any]:
    """Return the fields of a ``Parameter``."""
    return {"name": name, "value": value_to_message(value)}


def descriptor_to_message(descriptor: ParameterDescriptor) -> dict[str, Any]:
    """Return the fields of a ``ParameterDescriptor``."""
    fields: dict[str, Any] = {
        "name": descriptor.name,
        "type": int(descriptor.type),
        "description": descriptor.description,
        "additional_constraints": descriptor.constraints,
        "read_only": descriptor.read_only,
        "dynamic_typing": descriptor.dynamic_typing,
    }
    if descriptor.range is not None:
        low, high, step = descriptor.range
        if descriptor.type is ParameterType.INTEGER:
            limits = {"from_value": int(low), "to_value": int(high), "step": int(step)}
            fields["integer_range"] = [limits]
        else:
            limits = {"from_value": float(low), "to_value": float(high), "step": float(step)}  # type: ignore[dict-item]
            fields["floating_point_range"] = [limits]
    return fields


def descriptor_from_message(message: Message, who: str = "") -> ParameterDescriptor:
    """Return a received ``ParameterDescriptor``; raises ParameterError."""
    limits = [*message.integer_range, *message.floating_point_range]
    allowed = Range(limits[0].from_value, limits[0].to_value, limits[0].step) if limits else None
    return ParameterDescriptor(
        message.name,
        _type(message["type"], who or message.name),
        message.description,
        message.additional_constraints,
        message.read_only,
        message.dynamic_typing,
        allowed,
    )


def event_to_message(
    node: str,
    stamp: Time,
    new: Mapping[str, TypedValue],
    changed: Mapping[str, TypedValue],
    deleted: Iterable[str],
) -> dict[str, Any]:
    """Return the fields of a ``ParameterEvent``."""
    return {
        "stamp": stamp.to_dict(),
        "node": node,
        "new_parameters": [parameter_to_message(*item) for item in new.items()],
        "changed_parameters": [parameter_to_message(*item) for item in changed.items()],
        "deleted_parameters": [parameter_to_message(name, _NOT_SET) for name in deleted],
    }


def event_from_message(message: Message) -> ParameterEvent:
    """Return a received ``ParameterEvent``; raises ParameterError."""
    return ParameterEvent(
        message.node,
        _values(message.new_parameters, message.node),
        _values(message.changed_parameters, message.node),
        tuple(parameter.name for parameter in message.deleted_parameters),
    )


def _values(parameters: Iterable[Message], node: str) -> dict[str, ParameterValue]:
    return {
        parameter.name: value_from_message(
            parameter.value, f"parameter {parameter.name!r} of {node}"
        ).value
        for parameter in parameters
    }
