"""Arrays that can be drawn: numbers of messages, checked, and colours as bytes."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from rosglass.errors import ArgumentError, Error

if TYPE_CHECKING:
    from typing import TypeAlias

    from numpy.typing import ArrayLike, NDArray

    #: The corners of a box with the smallest and the largest x, y and z.
    Box: TypeAlias = tuple[NDArray[np.float64], NDArray[np.float64]]

__all__ = [
    "MAX_COUNT",
    "are_drawable",
    "box_of",
    "check_numbers",
    "finite_number",
    "floats_of",
    "rgba_bytes",
    "rows_of",
]

#: Vertices, instances and points of one drawable: bytes of a GPU buffer stay below 2 GiB.
MAX_COUNT = 20_000_000
#: Largest number of a message that is drawn: shaders square it as a float32.
_MAX_NUMBER = 1e18


def rgba_bytes(colors: ArrayLike, count: int) -> NDArray[np.uint8]:
    """Return colours as (count, 4) bytes, one for each or the same for all.

    Args:
        colors: RGB or RGBA, floats from 0 to 1 or bytes; shape (3), (4), (count, 3), (count, 4).
        count: How many are wanted.

    Raises:
        Error: They have another shape.
    """
    given = np.asarray(colors)
    if given.dtype != np.uint8:
        with np.errstate(invalid="ignore"):
            scaled = np.nan_to_num(floats_of("colors", given), nan=0.0, posinf=1.0, neginf=0.0)
            given = (np.clip(scaled, 0, 1) * 255 + 0.5).astype(np.uint8)
    if given.ndim == 1:
        given = given[np.newaxis, :]
    if given.ndim != 2 or given.shape[1] not in (3, 4) or len(given) not in (1, count):
        raise Error(f"expected 1 or {count} colours of 3 or 4 numbers, got shape {given.shape}")
    out = np.full((count, 4), 255, np.uint8)
    out[:, : given.shape[1]] = given
    return out


def are_drawable(numbers: ArrayLike) -> NDArray[np.bool_]:
    """Return whether numbers of a message can be drawn: those that are finite and at most 1e18."""
    return np.asarray(np.abs(np.asarray(numbers)) <= _MAX_NUMBER)  # NaN is not


def check_numbers(name: str, numbers: ArrayLike) -> None:
    """Check that numbers of a message can be drawn.

    Args:
        name: Of the field; where there are several rows, the error has the number of the first bad
            one, as in ``cells[7]``.
        numbers: Shape (k) or (n, k).

    Raises:
        Error: One is not finite, or beyond 1e18.
    """
    array, good = np.asarray(numbers), are_drawable(numbers)
    if good.all():
        return
    bad = float(array[~good][0])
    where = f"{name}[{np.argwhere(~good)[0][0]}]" if array.ndim > 1 else name
    reason = f"beyond the {_MAX_NUMBER:g} that is drawn" if math.isfinite(bad) else "not finite"
    raise Error(f"{where}: {bad:g} is {reason}")


def finite_number(name: str, value: float) -> float:
    """Return a finite number; raises ArgumentError."""
    try:
        number = float(value)
    except (TypeError, ValueError):
        number = math.nan
    if not math.isfinite(number):
        raise ArgumentError(name, value, "a finite number")
    return number


def floats_of(name: str, given: ArrayLike, shape: tuple[int, ...] | None = None) -> NDArray[Any]:
    """Return an array of float32, of one row for all if a shape is given; raises ArgumentError."""
    try:
        with np.errstate(over="ignore"):
            array = np.ascontiguousarray(given, np.float32)
        return array if shape is None else np.broadcast_to(array, shape)
    except (TypeError, ValueError):
        expected = "numbers" if shape is None else f"numbers that fit the shape {shape}"
        raise ArgumentError(name, given, expected) from None


def rows_of(name: str, given: ArrayLike, shape: tuple[int, ...]) -> NDArray[np.float32]:
    """Return an array of floats of the shape (n, *shape).

    Raises:
        Error: It has another shape, or too many rows.
    """
    array = floats_of(name, given)
    if array.size == 0:
        array = array.reshape(0, *shape)
    if array.shape[1:] != shape:
        raise Error(f"{name}: expected shape (n, {', '.join(map(str, shape))}), got {array.shape}")
    if len(array) > MAX_COUNT:
        raise Error(f"{name}: {len(array)} are more than the {MAX_COUNT} that can be drawn at once")
    return array


def box_of(points: NDArray[Any]) -> Box | None:
    """Return the corners of the box around points, (n, 3), that are finite; None for none."""
    finite = points[np.isfinite(points).all(axis=1)] if len(points) else points
    if not len(finite):
        return None
    return finite.min(axis=0).astype(np.float64), finite.max(axis=0).astype(np.float64)
