"""What waits to be sent on one connection: whole frames, the oldest of which make room."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    Buffer = bytes | bytearray | memoryview

__all__ = ["Frame", "Outgoing"]

#: Parts of a frame that the system takes at once.
_MOST_PARTS = 256


class Frame:
    """A frame on its way to any number of connections.

    Its parts may be somebody else's memory as long as they are being handed to the system; what
    has to wait is copied, once for all connections.

    Args:
        parts: The bytes, length and all.

    Attributes:
        parts: As given, as views of bytes.
        size: Bytes in all.
        kept: Whether it must not make room for others: the last message of a latched publisher.
    """

    __slots__ = ("_copied", "_start", "kept", "parts", "size")

    def __init__(self, parts: Sequence[Buffer], kept: bool = False) -> None:
        views = [memoryview(part).cast("B") for part in parts]
        if len(views) > _MOST_PARTS:
            views = [memoryview(b"".join(views))]
        self.parts = views
        self.size = sum(map(len, views))
        self.kept = kept
        self._copied: memoryview | None = None
        self._start = 0

    def rest(self, sent: int) -> memoryview:
        """Return what follows the first `sent` bytes, in memory that nobody else changes."""
        copied = self._copied
        if copied is None or sent < self._start:
            copied = self._copied = memoryview(b"".join(after(self.parts, sent)))
            self._start = sent
        return copied[sent - self._start :]


class Outgoing:
    """The frames that wait on one connection; guarded by its owner's lock.

    Attributes:
        lost: Frames that made room for newer ones.
        held: Bytes that wait.
    """

    __slots__ = ("_begun", "_frames", "held", "lost")

    def __init__(self) -> None:
        #: What is left of each frame.
        self._frames: deque[tuple[Frame, memoryview]] = deque()
        #: Whether the first frame was sent in part: it cannot be taken back.
        self._begun = False
        self.lost = self.held = 0

    def __len__(self) -> int:
        return len(self._frames)

    def add(self, frame: Frame, sent: int, most: int, most_bytes: int) -> None:
        """Queue what is left of a frame.

        Args:
            frame: The frame.
            sent: How many of its bytes are sent already; more than none only when nothing waits.
            most: How many frames may wait; 0 for any number.
            most_bytes: How many bytes may wait, besides the frame; 0 for any number.
        """
        left = frame.rest(sent)
        self._frames.append((frame, left))
        self._begun = self._begun or sent > 0
        self.held += len(left)
        while most and len(self._frames) - self._begun > most and self._drop():
            pass
        while most_bytes and self.held > most_bytes and self._drop():
            pass

    def _drop(self) -> bool:
        """Drop the oldest frame that may be dropped; return whether there was one."""
        for index in range(self._begun, len(self._frames) - 1):
            frame, left = self._frames[index]
            if not frame.kept:
                del self._frames[index]
                self.held -= len(left)
                self.lost += 1
                return True
        return False

    def send(self, write: Callable[[Sequence[memoryview]], int]) -> None:
        """Send what `write` takes; it returns how many bytes that were."""
        while self._frames:
            frame, left = self._frames[0]
            sent = write((left,))
            self.held -= sent
            if sent < len(left):
                if sent:
                    self._begun = True
                    self._frames[0] = (frame, left[sent:])
                return
            self._frames.popleft()
            self._begun = False

    def clear(self) -> None:
        """Forget everything."""
        self._frames.clear()
        self._begun, self.held = False, 0


def after(parts: Sequence[memoryview], sent: int) -> list[memoryview]:
    """Return what is left of `parts` after so many bytes."""
    rest = []
    for part in parts:
        if sent >= len(part):
            sent -= len(part)
        else:
            rest.append(part[sent:] if sent else part)
            sent = 0
    return rest
