"""Writing Python functions as text, and making them functions that debuggers can show."""

from __future__ import annotations

import itertools
import struct
from contextlib import contextmanager
from functools import lru_cache
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

__all__ = ["Source", "iterator", "packer", "unpacker"]

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


#: Lines, and levels of blocks, from which on a function calls others instead of growing. Python
#: takes some 5 kB and 10 us for a line, and 20 nested loops at most.
_MANY_LINES, _DEEP = 1000, 10


class Source:
    """The text of one function and the objects its names stand for."""

    def __init__(self) -> None:
        self.lines: list[str] = []
        self.globals: dict[str, Any] = {}
        #: The names of the objects, by their id.
        self.names: dict[int, str] = {}
        self._depth = 1
        self._fresh = itertools.count(1)

    @property
    def is_full(self) -> bool:
        """Whether what can be a function of its own should be one."""
        return len(self.lines) > _MANY_LINES or self._depth > _DEEP

    def line(self, text: str) -> None:
        """Add a line at the current indentation."""
        self.lines.append("    " * self._depth + text)

    def take_last(self, start: str) -> str | None:
        """Take back the last line if it is of the current block and starts with `start`.

        Returns:
            The rest of the line, None if there is no such line.
        """
        head = "    " * self._depth + start
        if self.lines and self.lines[-1].startswith(head):
            return self.lines.pop()[len(head) :]
        return None

    @contextmanager
    def block(self, head: str) -> Iterator[None]:
        """Add `head` and indent what follows."""
        self.line(head)
        self._depth += 1
        yield
        self._depth -= 1

    def bind(self, value: Any, hint: str) -> str:
        """Return the name that stands for `value` in the text, made from `hint`."""
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
        # Not in angle brackets: for such names nobody would ask the loader.
        filename = f"rosglass generated: {title}, {next(_numbers)}"
        self.globals.update(__name__="rosglass.messages.generated", __loader__=_Loader(text))
        exec(compile(text, filename, "exec"), self.globals)
        return self.globals[head[: head.index("(")]]


class _Loader:
    """Hands the text of generated code to tracebacks and debuggers (PEP 302's ``get_source``)."""

    def __init__(self, text: str) -> None:
        self._text = text

    def get_source(self, _name: str) -> str:
        """Return the text."""
        return self._text
