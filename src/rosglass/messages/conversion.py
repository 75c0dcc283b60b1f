"""Strict conversion of Python values into messages, with the field path in every error.

The same rules apply everywhere. Integers take integers and floats without a fraction, in range;
floats take integers and floats (a finite value that float32 cannot hold is refused); bools take
bools; strings take str. A ``byte`` also takes bytes of length 1, as rclpy writes it. Nothing is
truncated, wrapped or guessed. Missing fields get the type's defaults.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Mapping, Sequence
from functools import partial
from importlib import import_module
from typing import TYPE_CHECKING, Any

from rosglass.errors import ConversionError
from rosglass.interfaces.definition import ArrayKind
from rosglass.messages.message import Message, plain_class, to_dict
from rosglass.messages.schema import Kind
from rosglass.messages.source import hint, number_type

if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy as np

    from rosglass.messages.layout import Wire
    from rosglass.messages.schema import Member, Number, Schema

__all__ = [
    "array_packer",
    "as_bool",
    "as_float",
    "as_int",
    "complete",
    "convert",
    "elements",
    "numbers",
]

_FLOAT32_MAX = struct.unpack("<f", b"\xff\xff\x7f\x7f")[0]
_NANO = 1_000_000_000


# -- numbers -------------------------------------------------------------------------------------


def as_bool(value: Any) -> bool:
    """Return a bool; raises ConversionError for anything but Python's and numpy's bools."""
    if value is True or value is False:
        return bool(value)
    if _numpy_kind(value) == "b":
        return bool(value)
    raise ConversionError("", value, "a bool, True or False")


def as_int(value: Any) -> int:
    """Return an int; floats must be whole. Raises ConversionError; the range is not checked."""
    if isinstance(value, int) and not isinstance(value, bool):
        return int(value)
    if isinstance(value, float) or _numpy_kind(value) in ("i", "u", "f"):
        whole = math.isfinite(value) and int(value) == value
        if whole:
            return int(value)
    raise ConversionError("", value, "an integer")


def as_float(value: Any) -> float:
    """Return a float; raises ConversionError for bools and for anything but numbers."""
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        try:
            return float(value)
        except OverflowError:
            raise ConversionError("", value, "a number within the range of float64") from None
    if _numpy_kind(value) in ("i", "u", "f"):
        return float(value)
    raise ConversionError("", value, "a number")


def _numpy_kind(value: Any) -> str:
    """Return the kind of a numpy scalar, '' for everything else (arrays included)."""
    dtype = getattr(value, "dtype", None)
    return dtype.kind if dtype is not None and getattr(value, "shape", None) == () else ""


def _number(number: Number, value: Any, path: str) -> Any:
    try:
        if number.python is bool:
            return as_bool(value)
        if number.python is int:
            single = number.name == "byte" and isinstance(value, (bytes, bytearray))
            if single and len(value) == 1:
                return int.from_bytes(value, "little", signed=number.low != 0)
            found = as_int(value)
            assert number.low is not None
            assert number.high is not None
            if not number.low <= found <= number.high:
                raise ConversionError("", value, f"an integer from {number.low} to {number.high}")
            return found
        made = as_float(value)
    except ConversionError as error:
        also = ", or bytes of length 1" if number.name == "byte" else ""
        raise ConversionError(path, value, f"{error.expected}{also} ({number.name})") from None
    if number.code == "f" and math.isfinite(made):
        _check_float32(made, value, path)
    return made


def _check_float32(made: float, value: Any, path: str) -> None:
    try:
        struct.pack("<f", made)
    except OverflowError:
        limit = f"a number within +-{_FLOAT32_MAX:.8g} (float32)"
        raise ConversionError(path, value, limit) from None


# -- text ----------------------------------------------------------------------------------------


def _text(member: Member, value: Any, path: str) -> str:
    if not isinstance(value, str):
        hint = " (decode the bytes first)" if isinstance(value, (bytes, bytearray)) else ""
        raise ConversionError(path, value, f"a string{hint}")
    try:
        if member.wide:
            units = len(value.encode("utf-16-le", "surrogatepass")) // 2
        else:
            units = len(value.encode("utf-8", "surrogateescape"))
    except UnicodeEncodeError:
        raise ConversionError(path, value, "text that UTF-8 can encode") from None
    if member.bound is not None and units > member.bound:
        what = "UTF-16 units" if member.wide else "bytes of UTF-8"
        raise ConversionError(path, value, f"at most {member.bound} {what}, not {units}")
    return str(value)


# -- arrays --------------------------------------------------------------------------------------


def _check_length(member: Member, count: int, value: Any, path: str) -> None:
    if member.array is ArrayKind.FIXED and count != member.size:
        raise ConversionError(path, value, f"exactly {member.size} elements, not {count}")
    if member.size is not None and count > member.size:
        raise ConversionError(path, value, f"at most {member.size} elements, not {count}")
    if count > 0xFFFFFFFF:
        raise ConversionError(path, value, "fewer than 2**32 elements")


def _sequence(value: Any, path: str, what: str) -> Sequence[Any]:
    """Return `value` if it is an ordered collection of elements."""
    if isinstance(value, Sequence) and not isinstance(value, (str, bytes, bytearray, memoryview)):
        return value
    if getattr(value, "typecode", None) is not None:  # array.array
        return value  # type: ignore[no-any-return]
    if getattr(value, "ndim", 0) == 1:
        return value.tolist()  # type: ignore[no-any-return]
    raise ConversionError(path, value, f"a list of {what}")


def numbers(member: Member, value: Any, path: str) -> np.ndarray:
    """Return a numeric array in the machine's byte order, or little endian.

    Raises:
        ConversionError: An element, or their number, does not fit.
    """
    assert member.number is not None
    made = _some_numbers(member.number, value, path)
    _check_length(member, len(made), value, path)
    return made


def elements(member: Member, step: int | slice, count: int, value: Any, path: str) -> Any:
    """Return the value to assign to an element of a numeric array, or to a slice of `count` ones.

    A single number is assigned to the whole slice.

    Raises:
        ConversionError: It does not fit.
    """
    assert member.number is not None
    if isinstance(step, int) or isinstance(value, (int, float)) or _numpy_kind(value):
        return _number(member.number, value, path)
    made = _some_numbers(member.number, value, path)
    if len(made) != count:
        raise ConversionError(path, value, f"exactly {count} elements, not {len(made)}")
    return made


def _some_numbers(number: Number, value: Any, path: str) -> np.ndarray:
    numpy = import_module("numpy")
    dtype = numpy.dtype(bool) if number.python is bool else number_type(number.dtype, "<")
    if isinstance(value, (bytes, bytearray, memoryview)):
        if number.python is not int or number.size != 1:
            raise ConversionError(path, value, f"a list or numpy array of {number.name}")
        made = numpy.frombuffer(bytes(value), dtype)
    elif isinstance(value, numpy.ndarray):
        made = _from_array(number, dtype, value, path)
    else:
        items = _sequence(value, path, number.name)
        plain = [_number(number, item, f"{path}[{index}]") for index, item in enumerate(items)]
        made = numpy.array(plain, dtype)
    return numpy.ascontiguousarray(made)  # type: ignore[no-any-return]


def _from_array(number: Number, dtype: Any, value: np.ndarray, path: str) -> np.ndarray:
    numpy = import_module("numpy")
    if value.ndim != 1:
        raise ConversionError(path, value, f"one dimension, not {value.ndim}; use .ravel()")
    kind = value.dtype.kind
    if kind == "O":
        items = [_number(number, item, f"{path}[{i}]") for i, item in enumerate(value.tolist())]
        return numpy.array(items, dtype)  # type: ignore[no-any-return]
    allowed = "b" if number.python is bool else "iuf"
    if kind not in allowed:
        raise ConversionError(path, value, f"an array of {number.name}, not of {value.dtype}")
    if value.dtype == dtype:
        return value
    with numpy.errstate(all="ignore"):
        made = value.astype(dtype)
        wrong = _changed(number, value, made)
    if wrong is not None and wrong.any():
        index = int(wrong.argmax())
        _number(number, value[index].item(), f"{path}[{index}]")
        raise ConversionError(f"{path}[{index}]", value[index], number.name)
    return made


def _changed(number: Number, value: Any, made: Any) -> Any:
    """Return which elements of `value` the cast to `made` has changed; None if it changed none."""
    numpy = import_module("numpy")
    if number.python is float:
        return numpy.isfinite(value) & ~numpy.isfinite(made)
    if numpy.can_cast(value.dtype, made.dtype, "safe"):
        return None
    # High bounds are compared as powers of two, which every float represents exactly.
    assert number.high is not None
    if value.dtype.kind == "f":
        limit = float(number.high + 1)
        fits = (value >= float(number.low or 0)) & (value < limit) & (value == numpy.floor(value))
        return ~fits
    return (value < number.low) | (value > number.high) | (made != value)


def array_packer(member: Member, wire: Wire) -> Callable[[Any], tuple[Any, int]]:
    """Return ``pack(value) -> (buffer, count)`` for a numeric array on a wire.

    The buffer is bytes or an array that has them; large arrays are not copied.
    """
    number = member.number
    assert number is not None
    order, code, kind, size = wire.order, number.code, number.python, number.size
    raw_allowed = kind is int and size == 1
    fixed, limit = member.fixed_count, member.size

    def target() -> Any:
        numpy = import_module("numpy")
        return numpy.dtype(bool) if kind is bool else number_type(number.dtype, order)

    wanted = None

    def pack(value: Any) -> tuple[Any, int]:
        nonlocal wanted
        found = type(value)
        if found is list or found is tuple:
            count = len(value)
            if count and set(map(type, value)) != {kind}:
                value = numbers(member, value, "").tolist()
            data: Any = struct.pack(f"{order}{count}{code}", *value)
        elif found is bytes and raw_allowed:
            data, count = value, len(value)
        else:
            if wanted is None:
                wanted = target()
            if getattr(value, "dtype", None) is not wanted or value.ndim != 1:
                value = numbers(member, value, "")
                if value.dtype != wanted:
                    value = value.astype(wanted)
            # Gaps between the elements are detected when the parts are joined, see Codec.
            count, data = len(value), value
        if limit is not None and (count > limit or (fixed is not None and count != fixed)):
            _check_length(member, count, value, "")
        return data, count

    return pack


# -- messages ------------------------------------------------------------------------------------


def convert(schema: Schema, value: Any) -> Message:
    """Return a plain message made from a dict, a message of the type, or something like a time.

    Raises:
        ConversionError: A value does not fit; its path is the field's from the root.
    """
    try:
        return _message(schema, value, "")
    except ConversionError as error:
        raise ConversionError(error.path, error.value, error.expected, schema.name) from None


def _message(schema: Schema, value: Any, path: str) -> Message:
    cls = plain_class(schema)
    if isinstance(value, Message):
        if value._schema__ is not schema:
            raise ConversionError(path, value, _expected(schema, value._schema__))
        given = _attributes(value)
    elif isinstance(value, Mapping):
        given = _known_fields(schema, value, path)
    elif schema.is_time and (parts := _time_parts(value)) is not None:
        given = dict(zip((m.name for m in schema.members), parts, strict=True))
    else:
        raise ConversionError(path, value, f"a dict or a {schema.name}")
    made = cls()
    for member in schema.members:
        if member.name in given:
            inner = f"{path}.{member.name}" if path else member.name
            found = _member(member, given[member.name], inner)
        else:
            found = _default(member)
        setattr(made, member.attr, found)
    return made


def _attributes(message: Message) -> dict[str, Any]:
    return {m.name: getattr(message, m.attr) for m in message._schema__.members}


def complete(schema: Schema, value: Any) -> dict[str, Any]:
    """Return a dict with every field, the missing ones with their defaults; checks no values.

    Raises:
        LookupError, TypeError, AttributeError, ConversionError: Missing fields are not the only
            fault.
    """
    if isinstance(value, Message):
        if value._schema__ is not schema:
            raise TypeError
        value = _attributes(value)
    defaults: dict[str, Any] = schema.cached("defaults", lambda: to_dict(_message(schema, {}, "")))
    made = dict(defaults)
    for name, given in value.items():
        member = schema.by_name[name]
        if name != member.name and member.name in value:
            raise LookupError
        struct = member.struct
        if struct is None:
            made[member.name] = given
        elif member.is_array:
            items = _sequence(given, name, struct.name)
            made[member.name] = [complete(struct, item) for item in items]
        else:
            made[member.name] = complete(struct, given)
    return made


def _expected(schema: Schema, other: Schema) -> str:
    text = f"a {schema.name}"
    if schema.name == other.name:
        text += f" of ROS {schema.ros}" if schema.ros != other.ros else " with the same definition"
    return text


def _known_fields(schema: Schema, value: Mapping[Any, Any], path: str) -> dict[str, Any]:
    given = {}
    for key, item in value.items():
        member = schema.by_name.get(key) if isinstance(key, str) else None
        if member is None:
            names = [known.name for known in schema.members]
            where = f"{path}.{key}" if path else str(key)
            raise ConversionError(where, item, f"a field of {schema.name} ({hint(key, names)})")
        if member.name in given:
            raise ConversionError(f"{path}.{key}" if path else str(key), item, "each field once")
        given[member.name] = item
    return given


def _time_parts(value: Any) -> tuple[Any, Any] | None:
    for names in (("secs", "nsecs"), ("sec", "nanosec")):
        if all(hasattr(value, name) for name in names):
            return getattr(value, names[0]), getattr(value, names[1])
    total = getattr(value, "nanoseconds", None)
    if isinstance(total, int) and not isinstance(total, bool):
        return divmod(total, _NANO)
    return None


def _member(member: Member, value: Any, path: str) -> Any:
    """Return the value of a field, checked and in its canonical Python form."""
    if not member.is_array:
        return _element(member, value, path)
    if member.number is not None:
        return numbers(member, value, path)
    items = _sequence(value, path, member.field.type.name)
    _check_length(member, len(items), value, path)
    return [_element(member, item, f"{path}[{index}]") for index, item in enumerate(items)]


def _element(member: Member, value: Any, path: str) -> Any:
    if member.number is not None:
        return _number(member.number, value, path)
    if member.kind is Kind.TEXT:
        return _text(member, value, path)
    assert member.struct is not None
    return _message(member.struct, value, path)


def _default(member: Member) -> Any:
    """Return a fresh default value of a field: the definition's, or zero and empty."""
    given = member.field.default
    if given is not None:
        return _member(member, list(given) if isinstance(given, tuple) else given, member.name)
    count = member.fixed_count or 0
    one: Callable[[], Any]
    if member.number is not None:
        if member.is_array:
            kind = bool if member.number.python is bool else number_type(member.number.dtype, "<")
            return import_module("numpy").zeros(count, kind)
        one = member.number.python
    elif member.kind is Kind.TEXT:
        one = str
    else:
        assert member.struct is not None
        one = partial(_message, member.struct, {}, "")
    return [one() for _ in range(count)] if member.is_array else one()
