"""Requests to cancel many goals at once, which no ROS 1 server answers: its goals' states tell."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, NamedTuple

from rosglass.comm import CancelAnswer, Time
from rosglass.errors import (
    ServiceUnavailableError,
    TimeoutError,  # noqa: A004 - the field's own word
)
from rosglass.ros1.action_state import ServerState

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.comm import Promise
    from rosglass.errors import Error

__all__ = ["Entry", "Sweep", "Sweeps"]

#: Seconds after which a server without goals to cancel has heard of the request.
_HEARD = 0.5
_RUNNING = (ServerState.PENDING, ServerState.ACTIVE)
_CANCELING = (ServerState.PREEMPTING, ServerState.RECALLING)
_CANCELED = (*_CANCELING, ServerState.PREEMPTED, ServerState.RECALLED)


class Entry(NamedTuple):
    """What a status message says of a goal.

    Attributes:
        state: Its state.
        text: Why, in the server's words.
        stamp: The goal's time stamp.
    """

    state: ServerState
    text: str
    stamp: Time


class Sweep:
    """A request to cancel all goals of a server, or those until a time.

    Args:
        until: The last time stamp of goals to be cancelled; None for all.
        answer: Fulfilled when the goals that ran are cancelled, or have ended.
        before: The server's goals when it was asked, by their ids.
    """

    def __init__(
        self, until: Time | None, answer: Promise[CancelAnswer], before: dict[str, Entry]
    ) -> None:
        self.answer = answer
        self._begun = time.monotonic()
        self._canceling = {key for key, entry in before.items() if entry.state in _CANCELED}
        self._meant = {
            key
            for key, entry in before.items()
            if entry.state in _RUNNING and (until is None or entry.stamp <= until)
        }
        self._canceled: dict[str, None] = {}

    def hear(self, entries: dict[str, Entry]) -> bool:
        """Take a status message; return whether the request is answered now."""
        for key, entry in entries.items():
            if entry.state in _CANCELED and key not in self._canceling:
                self._canceled[key] = None
        if any(key in entries and entries[key].state in _RUNNING for key in self._meant):
            return False
        if not self._canceled and time.monotonic() - self._begun < _HEARD:
            return False  # it may have been on its way already
        accepted = tuple(key.encode() for key in self._canceled)
        self.answer.fulfil(
            CancelAnswer(accepted, "" if accepted else "there was no goal to cancel")
        )
        return True


class Sweeps:
    """A client's requests to cancel many goals: those that wait for a server, and for its sign.

    Args:
        name: Of the action.
    """

    def __init__(self, name: str) -> None:
        self._name = name
        self._waiting: list[tuple[Time | None, Promise[CancelAnswer]]] = []
        self._asked: list[Sweep] = []

    def add(self, until: Time | None, answer: Promise[CancelAnswer]) -> None:
        """Take a request in; it waits for :meth:`ask`."""
        self._waiting.append((until, answer))

    def ask(self, before: dict[str, Entry], send: Callable[[Time | None], object]) -> None:
        """Ask a server for all that waits.

        Args:
            before: What the server said last of its goals.
            send: Sends one request.
        """
        waiting, self._waiting = self._waiting, []
        for until, answer in waiting:
            self._asked.append(Sweep(until, answer, before))
            send(until)

    def hear(self, entries: dict[str, Entry]) -> None:
        """Take a status message of the server that was asked."""
        self._asked = [sweep for sweep in self._asked if not sweep.hear(entries)]

    def give_up(self, answer: Promise[CancelAnswer], timeout: float, why: str) -> None:
        """Wait no longer.

        Args:
            answer: For whom.
            timeout: Seconds that were waited.
            why: What kept the server from being asked.
        """
        if any(each is answer for _, each in self._waiting):
            told = f"{self._name} could not be asked to cancel within {timeout:g} s: {why}"
            answer.fail(ServiceUnavailableError(told))
        answer.fail(
            TimeoutError(
                f"{self._name} did not tell within {timeout:g} s that all goals are cancelled. It "
                "may cancel them all the same: watch their status"
            )
        )
        self._waiting = [entry for entry in self._waiting if entry[1] is not answer]
        self._asked = [sweep for sweep in self._asked if sweep.answer is not answer]

    def fail(self, error: Error) -> None:
        """Answer all with an error."""
        answers = [sweep.answer for sweep in self._asked] + [each for _, each in self._waiting]
        self._asked, self._waiting = [], []
        for answer in answers:
            answer.fail(error)
