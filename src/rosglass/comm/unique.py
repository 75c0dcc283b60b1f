"""What stands for something outside this program, and exists once."""

from __future__ import annotations

from typing import NoReturn

from rosglass.errors import UnsupportedError

__all__ = ["Unique"]


class Unique:
    """Base of what cannot be copied: a copy would share threads and sockets, and close them."""

    def __reduce_ex__(self, _: object) -> NoReturn:
        # What copy.copy, copy.deepcopy and pickle ask for.
        raise UnsupportedError(
            f"{self!r} can neither be copied nor pickled: it lives in this process, and exists "
            "once; hand on the object itself, or create another one"
        )
