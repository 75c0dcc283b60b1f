"""What generated code calls: the few things that are better said once than generated."""

from __future__ import annotations

from collections.abc import MutableSequence, Sequence
from functools import lru_cache
from importlib import import_module
from typing import TYPE_CHECKING, Any, NoReturn

from rosglass.interfaces.resolver import MAX_EMPTY

if TYPE_CHECKING:
    import numpy as np

__all__ = ["MAX_EMPTY", "TooShortError", "number_type", "read_wide", "too_short", "write_wide"]


class TooShortError(Exception):
    """The buffer ends too early; generated code raises it, callers see a DecodeError."""


def too_short() -> NoReturn:
    """Raise TooShortError, as an expression."""
    raise TooShortError


class OddValueError(Exception):
    """A value needs the slow conversion; generated code raises it, callers never see it."""


def odd() -> NoReturn:
    """Raise OddValueError, as an expression."""
    raise OddValueError


def own(value: Any, cls: type) -> None:
    """Check that a value is a message of the class, or a shell of it."""
    if not isinstance(value, cls):
        raise OddValueError


def as_list(value: Any) -> list[Any]:
    """Return the elements of an array field that is not a list."""
    if isinstance(value, (tuple, MutableSequence)) and not isinstance(value, bytearray):
        return list(value)
    raise OddValueError


@lru_cache(maxsize=64)
def number_type(dtype: str, order: str) -> np.dtype:
    """Return the numpy type with its byte order; the machine's own is numpy's singleton."""
    found: np.dtype = import_module("numpy").dtype(order + dtype)
    return found


def hint(name: Any, known: Sequence[str]) -> str:
    """Return what to tell somebody who used an unknown field name."""
    near = (
        import_module("difflib").get_close_matches(name, known, 1) if isinstance(name, str) else []
    )
    return f"did you mean {near[0]!r}?" if near else f"it has: {', '.join(known) or 'no fields'}"


def read_wide(buffer: bytes | memoryview, start: int, end: int, width: int, big: bool) -> str:
    """Decode the code units of a ``wstring``: UTF-16, or one unit in 4 bytes (ROS 2's nodes)."""
    raw = buffer[start:end]
    if len(raw) < end - start:
        too_short()
    order = "be" if big else "le"
    if width == 2:
        return str(raw, f"utf-16-{order}", "surrogatepass")
    text = str(raw, f"utf-32-{order}", "surrogatepass")
    # Units beyond the BMP arrive as surrogate pairs, each in 4 bytes.
    return text.encode("utf-16-le", "surrogatepass").decode("utf-16-le", "surrogatepass")


def write_wide(text: str, width: int, big: bool) -> tuple[bytes, int]:
    """Encode a ``wstring``; return its bytes and the number of its UTF-16 code units."""
    order = "be" if big else "le"
    units = text.encode(f"utf-16-{order}", "surrogatepass")
    count = len(units) // 2
    if width == 4:
        zero = bytes(2)
        parts = (units[i : i + 2] for i in range(0, len(units), 2))
        units = b"".join(zero + unit if big else unit + zero for unit in parts)
    return units, count
