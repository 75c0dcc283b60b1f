"""Unregistering, for a while after they were closed, nodes whose master did not answer then."""

from __future__ import annotations

import logging
import threading
import time
from typing import TYPE_CHECKING

from rosglass.errors import ConnectionLostError, Error, MasterError
from rosglass.ros1.master import Master

if TYPE_CHECKING:
    from collections.abc import Iterable

    from rosglass.ros1.core import Core, Member

__all__ = ["see_off"]

_log = logging.getLogger("rosglass.ros1")
#: Seconds for which a master is tried again, and between two tries.
_PATIENCE, _PAUSE = 60.0, 1.0


class _Farewell:
    """What a closed node has to tell its master yet.

    Args:
        core: The node.
        members: What the master may know of it.

    Attributes:
        uri: The master's.
        answered: Whether the master has answered the last time.
    """

    def __init__(self, core: Core, members: Iterable[Member]) -> None:
        self._core, self._members = core, list(members)
        self._left, self._again = list(self._members), True
        self.uri, self.answered = core.master.uri, True
        self._master = Master(self.uri, core.name.full)
        self._until = time.monotonic() + _PATIENCE

    def go_on(self) -> bool:
        """Tell the master what is left; return whether that was all."""
        try:
            while self._left:
                self._tell(self._left[-1])
                self._left.pop()
            self.answered = True
            if self._forgotten():
                return True
        except ConnectionLostError as error:
            self.answered = False
            _log.debug("%s has left, but its master does not know: %s", self._core.name, error)
            return False
        # A registration from before it hung was taken up after the end of it. Once is enough: who
        # has this name and address then is another node, on the same ports.
        again, self._again = self._again, False
        self._left = list(self._members)
        return not again

    def expired(self) -> bool:
        """Return whether to give up, and tell it then."""
        if time.monotonic() < self._until:
            return False
        _log.info(
            "%s does not answer, and may list %s still when it does: rosglass node cleanup "
            "removes what is gone",
            self.uri,
            self._core.name,
        )
        return True

    def end(self) -> None:
        """Close the connection with the master."""
        self._master.close()

    def _tell(self, member: Member) -> None:
        try:
            member.unregister(self._master)
        except ConnectionLostError:
            raise
        except Error as error:
            _log.debug("%s: %s", member, error)

    def _forgotten(self) -> bool:
        try:
            return self._master.call("lookupNode", self._core.name.full) not in self._core.uris
        except MasterError:
            return True


class _Farewells:
    """Goes through all farewells again and again, on one daemon thread, until none is left."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._open: list[_Farewell] = []
        self._thread: threading.Thread | None = None

    def add(self, farewell: _Farewell) -> None:
        """Take one in."""
        with self._lock:
            self._open.append(farewell)
            if self._thread is None or not self._thread.is_alive():
                self._thread = threading.Thread(
                    target=self._work, name="rosglass farewells", daemon=True
                )
                self._thread.start()

    def _work(self) -> None:
        while True:
            with self._lock:
                around = list(self._open)
                if not around:
                    self._thread = None
                    return
            done = self._round(around)
            with self._lock:
                self._open = [one for one in self._open if one not in done]
                left = bool(self._open)
            if left:
                time.sleep(_PAUSE)

    def _round(self, around: list[_Farewell]) -> list[_Farewell]:
        """Return those that are over."""
        silent: set[str] = set()
        done = []
        for one in around:
            over = one.uri not in silent and one.go_on()
            if not one.answered:
                silent.add(one.uri)
            if over or one.expired():
                one.end()
                done.append(one)
        return done


#: One for the process: nodes are gone when theirs is due.
_farewells = _Farewells()


def see_off(core: Core, members: Iterable[Member]) -> None:
    """Let the master of a closed node forget it once it answers, within a minute.

    Args:
        core: The node.
        members: What the master may know of it.
    """
    _farewells.add(_Farewell(core, members))
