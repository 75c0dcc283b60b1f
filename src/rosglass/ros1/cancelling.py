"""Requests to cancel many goals at once, which no ROS 1 server answers: its goals' states tell."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, NamedTuple

from rosglass.comm import CancelAnswer, Time
from rosglass.ros1.action_state import ServerState

if TYPE_CHECKING:
    from rosglass.comm import Promise

__all__ = ["Entry", "Sweep"]

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
