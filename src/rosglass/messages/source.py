"""Generated Python functions: their source text, compiled so that debuggers can show it."""

from __future__ import annotations

import itertools
import struct
from collections.abc import MutableSequence, Sequence
from contextlib import contextmanager
from functools import lru_cache
from importlib import import_module
from typing import TYPE_CHECKING, Any, NoReturn

from rosglass.errors import close_matches
from rosglass.interfaces.resolver import MAX_EMPTY

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    import numpy as np

__all__ = [
    "MAX_EMPTY",
    "Source",
    "TooShortError",
    "iterator",
    "load_numpy",
    "number_type",
    "packer",
    "read_wide",
    "too_short",
    "unpacker",
    "write_wide",
]


_numbers = itertools.count(1)


@lru_cache(maxsize=4096)
def unpacker(fmt: str) -> Callable[..., tuple[Any, ...]]:
    """Return ``struct.Struct(fmt).unpack_from``, shared between all generated functions."""
    return struct.Struct(fmt).unpack_from


@lru_cache(maxsize=4096)
def packer(fmt: str) -> Callable[..., bytes]:
    """Return ``struct.Struct(fmt).pack``, shared between all generated functions."""
    return struct.Struct(fmt).pack


@lru_cache(maxsize=4096)
def iterator(fmt: str) -> Callable[..., Iterator[tuple[Any, ...]]]:
    """Return ``struct.Struct(fmt).iter_unpack``, shared between all generated functions."""
    return struct.Struct(fmt).iter_unpack


#: Lines and levels of blocks beyond which a function calls others instead of growing. Python takes
#: some 5 kB and 10 us for a line, and allows 20 nested loops.
_MANY_LINES, _DEEP = 1000, 10


class Source:
    """The text of a function and the objects that its names refer to."""

    def __init__(self) -> None:
        self.lines: list[str] = []
        self.globals: dict[str, Any] = {}
        #: The names of the objects, by their id.
        self.names: dict[int, str] = {}
        self._depth = 1
        self._fresh = itertools.count(1)

    @property
    def is_full(self) -> bool:
        """True if further code should go into functions of its own."""
        return len(self.lines) > _MANY_LINES or self._depth > _DEEP

    def line(self, text: str) -> None:
        """Add a line at the current indentation."""
        self.lines.append("    " * self._depth + text)

    def take_last(self, start: str) -> str | None:
        """Remove the last line if it is in the current block and starts with `start`.

        Returns:
            The rest of the line, None if there is no such line.
        """
        head = "    " * self._depth + start
        if self.lines and self.lines[-1].startswith(head):
            return self.lines.pop()[len(head) :]
        return None

    @contextmanager
    def block(self, head: str) -> Iterator[None]:
        """Add `head` and indent the following lines."""
        self.line(head)
        self._depth += 1
        yield
        self._depth -= 1

    def bind(self, value: Any, hint: str) -> str:
        """Return the name of `value` in the text, derived from `hint`."""
        name = self.names.get(id(value))
        if name is None:
            name = hint if hint not in self.globals else f"{hint}_{len(self.globals)}"
            self.names[id(value)] = name
            self.globals[name] = value
        return name

    def fresh(self, prefix: str) -> str:
        """Return a local name not used before."""
        return f"{prefix}{next(self._fresh)}"

    def compile(self, head: str, title: str) -> Any:
        """Return the function ``def head: lines``; `title` names it in tracebacks."""
        text = "\n".join((f"def {head}:", *self.lines, ""))
        # Not in angle brackets: the loader is not used for such names.
        filename = f"rosglass generated: {title}, {next(_numbers)}"
        self.globals.update(__name__="rosglass.messages.generated", __loader__=_Loader(text))
        exec(compile(text, filename, "exec"), self.globals)
        return self.globals[head[: head.index("(")]]


class _Loader:
    """Provides the text of generated code to tracebacks and debuggers (PEP 302, ``get_source``)."""

    def __init__(self, text: str) -> None:
        self._text = text

    def get_source(self, _name: str) -> str:
        """Return the text."""
        return self._text


class TooShortError(Exception):
    """The buffer ends too early; raised by generated code, callers get a DecodeError."""


def too_short() -> NoReturn:
    """Raise TooShortError, as an expression."""
    raise TooShortError


class OddValueError(Exception):
    """A value needs the slow conversion; raised by generated code, callers never get it."""


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


def load_numpy() -> Any:
    """Return numpy, which messages without numeric arrays do not need; importing it is slow."""
    return import_module("numpy")


@lru_cache(maxsize=64)
def number_type(dtype: str, order: str) -> np.dtype:
    """Return the numpy type with its byte order; the machine's own is numpy's singleton."""
    found: np.dtype = load_numpy().dtype(order + dtype)
    return found


def hint(name: Any, known: Sequence[str]) -> str:
    """Return a hint for an unknown field name."""
    near = close_matches(name, known, 1, 0.6) if isinstance(name, str) else []
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
