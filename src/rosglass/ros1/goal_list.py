"""The goals that an action server knows, with their states; what it publishes as its status.

Behaviour: ROS wiki, "actionlib/DetailedDescription", sections "Server-Side States" and "Cancel
Policy"; where it is silent, actionlib's servers in C++ and Python.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rosglass.comm import Time
from rosglass.ros1.action_state import ServerState

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rosglass.ros1.server_goal import Ros1ServerGoal

__all__ = ["GoalEntry", "GoalList"]

#: Goals that have ended and are kept at most: clients gone wild must not fill the memory.
_MAX_ENDED = 1000
_CANCELABLE = (ServerState.PENDING, ServerState.ACTIVE)


class GoalEntry:
    """A goal in the list.

    Attributes:
        id: Its id.
        stamp: Its time stamp.
        state: Its state.
        text: Why, in words for its client.
        asked: What is asked for; None for one that is known from a request to cancel only.
        goal: Who executes it; None before it is accepted.
        until: Monotonic time until which it stays in the list; None for one that has not ended.
    """

    def __init__(self, id: str, stamp: Time, state: ServerState, asked: Any = None) -> None:
        self.id, self.stamp, self.state, self.asked = id, stamp, state, asked
        self.text = ""
        self.goal: Ros1ServerGoal | None = None
        self.until: float | None = None

    def go(self, state: ServerState, text: str = "") -> None:
        """Change its state."""
        self.state, self.text = state, text

    def status(self) -> dict[str, Any]:
        """Return its ``actionlib_msgs/GoalStatus``."""
        stamp = {"secs": self.stamp.sec, "nsecs": self.stamp.nanosec}
        goal_id = {"stamp": stamp, "id": self.id}
        return {"goal_id": goal_id, "status": int(self.state), "text": self.text}


class GoalList:
    """Goals in order of arrival; the caller sees to it that one thread uses it at a time.

    Args:
        keep: Seconds that goals stay in it after their end.

    Attributes:
        keep: As given; may be changed.
    """

    def __init__(self, keep: float = 5.0) -> None:
        self.keep = keep
        self._entries: dict[str, GoalEntry] = {}
        self._last_cancel = Time()

    def __iter__(self) -> Any:
        return iter(list(self._entries.values()))

    def take(self, id: str, stamp: Time, asked: Any, now: float) -> GoalEntry | None:
        """Take a goal in.

        Args:
            id: Its id.
            stamp: Its time stamp.
            asked: What is asked for.
            now: Monotonic time.

        Returns:
            Its entry, RECALLED when it was cancelled before it came; None for one that is known,
            of which no notice need be taken.
        """
        known = self._entries.get(id)
        if known is not None:
            if known.until is not None:
                known.until = now + self.keep
            if known.state is not ServerState.RECALLING or known.asked is not None:
                return None
            known.asked, known.stamp = asked, stamp
            known.go(ServerState.RECALLED, "It was cancelled before it came")
            return known
        entry = self._entries[id] = GoalEntry(id, stamp, ServerState.PENDING, asked)
        if stamp <= self._last_cancel:
            told = "Its time stamp is not after that of the last request to cancel"
            entry.go(ServerState.RECALLED, told)
            self.end(entry, now)
        return entry

    def select(self, id: str, stamp: Time, now: float) -> Sequence[GoalEntry]:
        """Return the goals that a request to cancel means and that can be cancelled.

        An id means its goal; a stamp, all goals until then; both mean both; neither, all goals. An
        unknown goal is cancelled when it comes.
        """
        everything = not id and stamp == Time()
        chosen = [
            entry
            for entry in self._entries.values()
            if everything or entry.id == id or (stamp != Time() and entry.stamp <= stamp)
        ]
        if id and id not in self._entries:
            self._entries[id] = GoalEntry(id, stamp, ServerState.RECALLING)
            self._entries[id].until = now + self.keep
        self._last_cancel = max(self._last_cancel, stamp)
        return [entry for entry in chosen if entry.state in _CANCELABLE]

    def end(self, entry: GoalEntry, now: float) -> None:
        """Take note that a goal has ended."""
        entry.until = now + self.keep

    def expire(self, now: float) -> None:
        """Forget goals that ended some time ago."""
        ended = [entry for entry in self._entries.values() if entry.until is not None]
        surplus = len(ended) - _MAX_ENDED
        for number, entry in enumerate(sorted(ended, key=lambda entry: entry.until or 0.0)):
            if number < surplus or (entry.until is not None and entry.until < now):
                del self._entries[entry.id]
