"""Undo and redo of texts."""

from __future__ import annotations

from typing import NamedTuple

__all__ = ["History"]


class History:
    """The texts that a document had, for undo and redo.

    Only the parts that changed are kept, so that a long history of a large file is small. Undo
    gives back exactly the text from before.

    Args:
        text: The text to start with.
        most_bytes: Memory that the changes may take; the oldest ones are forgotten beyond.
    """

    def __init__(self, text: str, most_bytes: int = 32 * 1024 * 1024) -> None:
        self._text = text
        self._most_bytes = most_bytes
        self._done: list[_Change] = []
        self._undone: list[_Change] = []

    @property
    def text(self) -> str:
        """The text as it is now."""
        return self._text

    @property
    def undo_name(self) -> str:
        """Name of the action that :meth:`undo` takes back; empty if there is none."""
        return self._done[-1].name if self._done else ""

    @property
    def redo_name(self) -> str:
        """Name of the action that :meth:`redo` repeats; empty if there is none."""
        return self._undone[-1].name if self._undone else ""

    def push(self, name: str, text: str, merge: str = "") -> None:
        """Add a change.

        Args:
            name: Name of the action, such as ``Move Battery``.
            text: The text after it. One that is the same as before adds nothing.
            merge: Changes in a row with the same `merge`, such as those of a slider that is
                dragged, are undone together.
        """
        if text == self._text:
            return
        before = self._text
        if merge and self._done and self._done[-1].merge == merge and not self._undone:
            before = self._done.pop().reverted(before)
        self._undone.clear()
        self._text = text
        if text != before:
            self._done.append(_Change.between(name, merge, before, text))
        size = sum(change.size for change in self._done)
        while self._done and size > self._most_bytes:
            size -= self._done.pop(0).size

    def undo(self) -> str:
        """Take the last action back, and return the text; the same text if there is none."""
        if self._done:
            change = self._done.pop()
            self._undone.append(change)
            self._text = change.reverted(self._text)
        return self._text

    def redo(self) -> str:
        """Repeat the action that was undone last, and return the text."""
        if self._undone:
            change = self._undone.pop()
            self._done.append(change)
            self._text = change.applied(self._text)
        return self._text


class _Change(NamedTuple):
    name: str
    merge: str
    start: int
    old: str
    new: str

    @classmethod
    def between(cls, name: str, merge: str, old: str, new: str) -> _Change:
        start = _common(old, new, 0)
        rest = _common(old, new, start, end=True)
        return cls(name, merge, start, old[start : len(old) - rest], new[start : len(new) - rest])

    @property
    def size(self) -> int:
        # Characters may take four bytes; the rest is the tuple's own.
        return 4 * (len(self.old) + len(self.new)) + 200

    def applied(self, text: str) -> str:
        return text[: self.start] + self.new + text[self.start + len(self.old) :]

    def reverted(self, text: str) -> str:
        return text[: self.start] + self.old + text[self.start + len(self.new) :]


def _common(old: str, new: str, start: int, end: bool = False) -> int:
    """Return how many characters two texts share from `start`, or at their ends, by bisection."""
    low, high = 0, min(len(old), len(new)) - start
    while low < high:
        middle = (low + high + 1) // 2
        if end:
            same = old[len(old) - middle :] == new[len(new) - middle :]
        else:
            same = old[:middle] == new[:middle]
        low, high = (middle, high) if same else (low, middle - 1)
    return low
