"""How long a disk or network that does not answer may hold an interface up."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, TypeVar

from rosglass.errors import Error

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = ["FILE_PATIENCE", "FOLDER_PATIENCE", "within"]

_T = TypeVar("_T")

#: Seconds that a file may hold up the interface, and a tree of folders that is searched.
FILE_PATIENCE, FOLDER_PATIENCE = 2.0, 5.0


def within(seconds: float, what: str, work: Callable[[], _T]) -> _T:
    """Return what `work` returns; it runs on a thread, since calls to a dead server never end.

    Args:
        seconds: How long it may take.
        what: The file or folder, for the error.
        work: Touches files, and nothing else.

    Raises:
        Error: It took longer; it may come to its end later.
        Exception: What `work` raises.
    """
    found: list[_T] = []
    failed: list[Exception] = []

    def run() -> None:
        try:
            found.append(work())
        except Exception as error:
            failed.append(error)

    thread = threading.Thread(target=run, name="rosglass-files", daemon=True)
    thread.start()
    thread.join(seconds)
    if failed:
        raise failed[0]
    if not found:
        raise Error(
            f"{what} did not answer within {seconds:g} s: is it on a network drive that cannot be "
            "reached? Nothing on the screen moves meanwhile"
        )
    return found[0]
