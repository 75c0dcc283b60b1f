"""Functions in C++ of the libraries that RViz has loaded, for which there are no bindings.

Called by their names in the library, as the Itanium C++ ABI has them.
"""

from __future__ import annotations

import ctypes
from functools import cache
from pathlib import Path
from typing import Any

from rosglass.errors import UnsupportedError

__all__ = ["cpp_function"]


@cache
def _library(name: str) -> ctypes.CDLL:
    """Return a library that RViz has loaded.

    Raises:
        UnsupportedError: It has not.
    """
    for line in Path("/proc/self/maps").read_text().splitlines():
        file = line.split(maxsplit=5)[-1]
        if Path(file).name.startswith(f"{name}.so"):
            return ctypes.CDLL(file)
    raise UnsupportedError(f"RViz's bindings come without {name}: they are none of RViz 1")


def cpp_function(library: str, symbol: str, result: Any = None) -> Any:
    """Return a function.

    Args:
        library: Its library, such as ``librviz``.
        symbol: Its name there.
        result: The type in ctypes of what it returns; None for nothing.

    Raises:
        UnsupportedError: This RViz has it not.
    """
    try:
        found = _library(library)[symbol]
    except AttributeError:
        raise UnsupportedError(
            f"{library} has no {symbol}: it was built for another C++ library than GNU's"
        ) from None
    found.restype = result
    return found
