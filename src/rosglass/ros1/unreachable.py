"""Telling of a publisher that cannot be reached once, however many topics it publishes."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable

    from rosglass.ros1.errands import Errands
    from rosglass.ros1.io_loop import IoLoop
    from rosglass.ros1.publisher_link import PublisherLink

__all__ = ["Unreachable"]

_log = logging.getLogger("rosglass.ros1")
#: Seconds in which the topics of a publisher are gathered: each has a connection of its own.
_GATHERING = 1.0
#: Topics that a line names, and publishers' topics that are remembered as told of.
_NAMED, _MOST = 12, 1000


class Unreachable:
    """Writes to the log which publishers cannot be reached, and when they are back.

    All but the writing happens in the loop's thread.

    Args:
        loop: Runs what happens later.
        errands: Where the log is written: its handlers may take their time.
    """

    def __init__(self, loop: IoLoop, errands: Errands) -> None:
        self._loop, self._errands = loop, errands
        self._failed: set[PublisherLink] = set()
        self._back: set[PublisherLink] = set()
        #: Publisher and topic -> the problem that was told.
        self._told: dict[tuple[str, str], str] = {}
        self._gathering = False

    def fail(self, link: PublisherLink) -> None:
        """Tell soon of a publisher that cannot be reached, unless it can be by then."""
        self._failed.add(link)
        self._gather()

    def greet(self, link: PublisherLink) -> None:
        """Tell soon of a publisher that was out of reach, and is connected now."""
        if any((name, link.topic) in self._told for name in (link.name, link.uri)):
            self._back.add(link)
            self._gather()

    def _gather(self) -> None:
        if not self._gathering:
            self._gathering = True
            self._loop.after(_GATHERING, self._tell)

    def _tell(self) -> None:
        self._gathering = False
        lines: dict[str, set[str]] = {}
        for link in self._back:
            known = [self._told.pop((name, link.topic), "") for name in (link.name, link.uri)]
            if any(known) and not link.ended:
                lines.setdefault(f"{link.name} is back", set()).add(link.topic)
        for link in self._failed:
            key = (link.name, link.topic)
            wanted = link.problem and not link.lost and not link.ended
            if wanted and self._told.get(key) != link.problem:
                self._told[key] = link.problem
                lines.setdefault(link.problem, set()).add(link.topic)
        self._failed.clear()
        self._back.clear()
        while len(self._told) > _MOST:
            self._told.pop(next(iter(self._told)))
        if lines:
            self._errands.run(lambda: _write(lines))


def _write(lines: dict[str, set[str]]) -> None:
    for line, topics in lines.items():
        # Being back is no mistake of anybody's, but who has seen the warning must see its end.
        _log.warning("%s: %s", _listed(topics), line)


def _listed(topics: Iterable[str]) -> str:
    names = sorted(topics)
    more = len(names) - _NAMED
    return ", ".join(names[:_NAMED]) + (f" and {more} more topics" if more > 0 else "")
