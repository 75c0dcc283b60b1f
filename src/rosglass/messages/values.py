"""Strict conversion of numbers, strings and numeric arrays, with the field path in every error.

The same rules apply everywhere. Integers take integers and floats without a fraction, in range;
floats take integers and floats (a finite value that float32 cannot hold is refused); bools take
bools; strings take str. A ``byte`` also takes bytes of length 1, as rclpy writes it. Nothing is
truncated, wrapped or guessed.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from rosglass.errors import ConversionError
from rosglass.interfaces.definition import ArrayKind
from rosglass.messages.source import load_numpy, number_type

if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy as np

    from rosglass.messages.layout import Wire
    from rosglass.messages.schema import Member, Number

__all__ = [
    "array_packer",
    "as_bool",
    "as_float",
    "as_int",
    "as_number",
    "as_sequence",
    "as_text",
    "check_length",
    "elements",
    "numbers",
]

_FLOAT32_MAX = struct.unpack("<f", b"\xff\xff\x7f\x7f")[0]


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


def as_number(number: Number, value: Any, path: str) -> Any:
    """Return a value of a primitive type; raises ConversionError, also when it is out of range."""
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


def as_text(member: Member, value: Any, path: str) -> str:
    """Return a string; raises ConversionError if it is too long, or cannot be encoded."""
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


def check_length(member: Member, count: int, value: Any, path: str) -> None:
    """Raise ConversionError unless an array field may have `count` elements."""
    if member.array is ArrayKind.FIXED and count != member.size:
        raise ConversionError(path, value, f"exactly {member.size} elements, not {count}")
    if member.size is not None and count > member.size:
        raise ConversionError(path, value, f"at most {member.size} elements, not {count}")
    if count > 0xFFFFFFFF:
        raise ConversionError(path, value, "fewer than 2**32 elements")


def as_sequence(value: Any, path: str, what: str) -> Sequence[Any]:
    """Return `value` if it is an ordered collection of elements; raises ConversionError."""
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
    check_length(member, len(made), value, path)
    return made


def elements(member: Member, step: int | slice, count: int, value: Any, path: str) -> Any:
    """Return the value to assign to an element of a numeric array, or to a slice of `count` ones.

    A single number is assigned to the whole slice.

    Raises:
        ConversionError: It does not fit.
    """
    assert member.number is not None
    if isinstance(step, int) or isinstance(value, (int, float)) or _numpy_kind(value):
        return as_number(member.number, value, path)
    made = _some_numbers(member.number, value, path)
    if len(made) != count:
        raise ConversionError(path, value, f"exactly {count} elements, not {len(made)}")
    return made


def _some_numbers(number: Number, value: Any, path: str) -> np.ndarray:
    numpy = load_numpy()
    dtype = numpy.dtype(bool) if number.python is bool else number_type(number.dtype, "<")
    if isinstance(value, (bytes, bytearray, memoryview)):
        if number.python is not int or number.size != 1:
            raise ConversionError(path, value, f"a list or numpy array of {number.name}")
        made = numpy.frombuffer(bytes(value), dtype)
    elif isinstance(value, numpy.ndarray):
        made = _from_array(number, dtype, value, path)
    else:
        items = as_sequence(value, path, number.name)
        plain = [as_number(number, item, f"{path}[{index}]") for index, item in enumerate(items)]
        made = numpy.array(plain, dtype)
    return numpy.ascontiguousarray(made)  # type: ignore[no-any-return]


def _from_array(number: Number, dtype: Any, value: np.ndarray, path: str) -> np.ndarray:
    numpy = load_numpy()
    if value.ndim != 1:
        raise ConversionError(path, value, f"one dimension, not {value.ndim}; use .ravel()")
    kind = value.dtype.kind
    if kind == "O":
        items = [as_number(number, item, f"{path}[{i}]") for i, item in enumerate(value.tolist())]
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
        as_number(number, value[index].item(), f"{path}[{index}]")
        raise ConversionError(f"{path}[{index}]", value[index], number.name)
    return made


def _changed(number: Number, value: Any, made: Any) -> Any:
    """Return which elements of `value` the cast to `made` has changed; None if it changed none."""
    numpy = load_numpy()
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
        numpy = load_numpy()
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
            check_length(member, count, value, "")
        return data, count

    return pack
