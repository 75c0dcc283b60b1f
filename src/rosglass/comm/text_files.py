"""Small text files that people write: read whole, written in one go."""

from __future__ import annotations

import os
import tempfile
from contextlib import suppress
from pathlib import Path

from rosglass.errors import ParameterError

__all__ = ["read_text", "write_text"]


def read_text(path: str | os.PathLike[str], most: int) -> tuple[str, str]:
    """Return a parameter file's text, and its path for messages.

    Args:
        path: The file.
        most: Bytes that it may have.

    Raises:
        ParameterError: It cannot be read, is too large, or is no UTF-8.
    """
    label = _checked(path)
    try:
        size = Path(label).stat().st_size
        if size > most:
            raise ParameterError(f"{label} has {size} bytes, too many for a parameter file")
        return Path(label).read_text(encoding="utf-8"), label
    except OSError as error:
        raise ParameterError(f"{label} cannot be read: {error.strerror or error}") from None
    except UnicodeDecodeError as error:
        raise ParameterError(f"{label} is not UTF-8 text (byte {error.start})") from None


def write_text(path: str | os.PathLike[str], text: str) -> None:
    """Write a file such that others see the old one or the new one, never a part.

    Raises:
        ParameterError: That is not possible.
    """
    target = Path(_checked(path))
    try:
        handle, name = tempfile.mkstemp(dir=target.parent, prefix=f".{target.name}.")
        try:
            with os.fdopen(handle, "w", encoding="utf-8") as file:
                file.write(text)
            mask = os.umask(0)
            os.umask(mask)
            Path(name).chmod(0o666 & ~mask)
            Path(name).replace(target)
        except BaseException:
            with suppress(OSError):
                Path(name).unlink()
            raise
    except OSError as error:
        raise ParameterError(f"{target} cannot be written: {error.strerror or error}") from None


def _checked(path: str | os.PathLike[str]) -> str:
    """Return a path that the system can be asked for."""
    name = os.fspath(path) if isinstance(path, (str, os.PathLike)) else None
    if not isinstance(name, str):
        raise ParameterError(f"a parameter file is given by its path, got {path!r:.200}")
    try:
        impossible = b"\0" in os.fsencode(name)
    except UnicodeEncodeError:
        impossible = True
    if impossible or not name:
        raise ParameterError(f"{name!r:.200} is no path of a file")
    return name
