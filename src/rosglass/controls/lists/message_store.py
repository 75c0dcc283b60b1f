"""Messages that were sent from forms, and favourites, by type, in files of the user.

Each type has a file ``rosglass/messages/pkg__msg__Type.json`` in ``XDG_STATE_HOME`` or
``~/.local/state``. It is read before it is written, so that several programs add to it.
"""

from __future__ import annotations

import json
import os
import queue
import re
import threading
import time
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from rosglass.errors import Error

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = ["MAX_FAVOURITES", "MAX_HISTORY", "MessageStore", "Stored", "run_later"]

#: Sent messages and favourites of a type.
MAX_HISTORY, MAX_FAVOURITES = 20, 50
#: Characters of a message, and bytes of a file, that are kept and read.
_MAX_MESSAGE, _MAX_FILE = 50_000, 4_000_000
_MAX_NAME = 60


def run_later(job: Callable[[], None]) -> None:
    """Run a job that reads or writes kept messages, in the order of the calls.

    On a thread of its own: a lost network disk must not block the session's worker, which serves
    the robot, nor the end of the program.
    """
    _jobs().put(job)


@cache
def _jobs() -> queue.SimpleQueue[Callable[[], None]]:
    jobs: queue.SimpleQueue[Callable[[], None]] = queue.SimpleQueue()

    def run() -> None:
        while True:
            jobs.get()()

    threading.Thread(target=run, name="kept messages", daemon=True).start()
    return jobs


class Stored(NamedTuple):
    """The kept messages of a type, as JSON.

    Attributes:
        history: Sent messages, the last one first.
        favourites: Messages by name, in alphabetical order.
    """

    history: tuple[str, ...] = ()
    favourites: tuple[tuple[str, str], ...] = ()


class MessageStore:
    """The kept messages of one type. The methods read and write files: for :func:`run_later`.

    Args:
        kind: Full name of the type.
        folder: Folder of the files; by default, the user's.
    """

    def __init__(self, kind: str, folder: Path | None = None) -> None:
        base = os.environ.get("XDG_STATE_HOME", "")
        state = Path(base) if os.path.isabs(base) else Path.home() / ".local/state"  # noqa: PTH117
        name = re.sub(r"[^A-Za-z0-9_]", "_", kind.replace("/", "__"))[:200]
        self.path = (folder or state / "rosglass/messages") / f"{name}.json"

    def read(self) -> Stored:
        """Return what is kept; nothing without a file.

        Raises:
            Error: The file cannot be read, or does not hold kept messages.
        """
        try:
            with self.path.open("rb") as file:
                data = file.read(_MAX_FILE + 1)
            if len(data) > _MAX_FILE:
                raise ValueError(f"it has more than {_MAX_FILE:,} bytes")
            return _checked(json.loads(data))
        except FileNotFoundError:
            return Stored()
        except OSError as error:
            raise Error(f"{self.path} cannot be read: {error.strerror or error}") from None
        except (ValueError, TypeError, KeyError, AttributeError, RecursionError) as error:
            raise Error(
                f"{self.path}: no kept messages are in it ({error}); move it away"
            ) from None

    def remember(self, message: str) -> Stored:
        """Put a message at the beginning of the history; return what is kept.

        Raises:
            Error: It is too long, or the file cannot be read or written.
        """
        if len(message) > _MAX_MESSAGE:
            raise Error(f"the message is not kept: it has {len(message):,} characters")
        now = self.read()
        rest = [one for one in now.history if one != message]
        return self._write(Stored((message, *rest)[:MAX_HISTORY], now.favourites))

    def add_favourite(self, name: str, message: str) -> Stored:
        """Keep a message under a name, instead of one that has the name; return what is kept.

        Raises:
            Error: Name or message are too long, there are too many favourites, or the file cannot
                be read or written.
        """
        name = name.strip()
        if not 0 < len(name) <= _MAX_NAME or not name.isprintable():
            raise Error(f"a favourite has a name of 1 to {_MAX_NAME} characters, got {name!r:.80}")
        if len(message) > _MAX_MESSAGE:
            raise Error(f"{name} is not kept: it has {len(message):,} characters")
        now = self.read()
        favourites = {**dict(now.favourites), name: message}
        if len(favourites) > MAX_FAVOURITES:
            raise Error(f"{MAX_FAVOURITES} favourites are kept: remove one first")
        return self._write(Stored(now.history, tuple(sorted(favourites.items()))))

    def remove_favourite(self, name: str) -> Stored:
        """Forget a favourite; return what is kept. Raises Error as :meth:`read` does."""
        now = self.read()
        left = tuple(one for one in now.favourites if one[0] != name)
        return self._write(Stored(now.history, left))

    def _write(self, stored: Stored) -> Stored:
        """Replace the file: readers see the old one or the new one, never a part."""
        text = json.dumps({"history": stored.history, "favourites": dict(stored.favourites)})
        part = self.path.with_name(f".{self.path.name}.{os.getpid()}.{time.time_ns()}")
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            part.write_text(text, encoding="utf-8")
            part.replace(self.path)
        except OSError as error:
            with suppress(OSError):
                part.unlink()
            raise Error(f"{self.path} cannot be written: {error.strerror or error}") from None
        return stored


def _checked(data: Any) -> Stored:
    history, favourites = data["history"], data["favourites"]
    texts = [*history, *favourites.values()]
    if not isinstance(history, list) or not all(isinstance(one, str) for one in texts):
        raise ValueError("a message is not a text")
    kept = sorted(favourites.items())
    return Stored(tuple(history[:MAX_HISTORY]), tuple(kept[:MAX_FAVOURITES]))
