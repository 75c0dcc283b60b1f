"""The states that a goal goes through, as its client hears of them.

Source: ROS wiki, "actionlib/DetailedDescription", section "Client-Side States"; where it is silent,
the transitions that actionlib's clients in C++ and Python have in common.
"""

from __future__ import annotations

from enum import Enum, IntEnum
from typing import NamedTuple

from rosglass.comm import GoalStatus

__all__ = ["CommState", "CommStateMachine", "ServerState", "Step", "TerminalState"]


class ServerState(IntEnum):
    """What a server says of a goal: the codes of ``actionlib_msgs/GoalStatus``."""

    PENDING = 0
    ACTIVE = 1
    PREEMPTED = 2
    SUCCEEDED = 3
    ABORTED = 4
    REJECTED = 5
    PREEMPTING = 6
    RECALLING = 7
    RECALLED = 8
    LOST = 9

    @property
    def is_terminal(self) -> bool:
        """Whether the goal has ended."""
        return self in _TERMINAL


_TERMINAL = {
    ServerState.PREEMPTED,
    ServerState.SUCCEEDED,
    ServerState.ABORTED,
    ServerState.REJECTED,
    ServerState.RECALLED,
    ServerState.LOST,
}


class CommState(Enum):
    """How far client and server have come with a goal."""

    #: The goal was sent, or waits for a server; no server has told that it knows it.
    WAITING_FOR_GOAL_ACK = "waiting for goal ack"
    #: A server knows it, and has not decided yet.
    PENDING = "pending"
    #: It is executed.
    ACTIVE = "active"
    #: It has ended, and its result is on its way.
    WAITING_FOR_RESULT = "waiting for result"
    #: It shall be cancelled, which the server has not told to know.
    WAITING_FOR_CANCEL_ACK = "waiting for cancel ack"
    #: It was cancelled before it was executed, and is about to end.
    RECALLING = "recalling"
    #: It was cancelled while it was executed, and is about to end.
    PREEMPTING = "preempting"
    #: It has ended, one way or another; see :class:`TerminalState`.
    DONE = "done"


class TerminalState(Enum):
    """How a goal ended."""

    #: Cancelled before it was executed.
    RECALLED = "recalled"
    #: Refused.
    REJECTED = "rejected"
    #: Cancelled while it was executed.
    PREEMPTED = "preempted"
    #: Failed.
    ABORTED = "aborted"
    #: Done.
    SUCCEEDED = "succeeded"
    #: Nobody knows: the server has gone, or does not know the goal (any more).
    LOST = "lost"


_States = tuple[CommState, ...]
_G, _P, _A = CommState.WAITING_FOR_GOAL_ACK, CommState.PENDING, CommState.ACTIVE
_R, _C, _D = CommState.WAITING_FOR_RESULT, CommState.WAITING_FOR_CANCEL_ACK, CommState.DONE
_RECALLING, _PREEMPTING = CommState.RECALLING, CommState.PREEMPTING

#: What a state is followed by when a server says something; nothing where it changes nothing.
#: What is missing cannot be: the server contradicts itself.
_NEXT: dict[CommState, dict[ServerState, _States]] = {
    _G: {
        ServerState.PENDING: (_P,),
        ServerState.ACTIVE: (_A,),
        ServerState.PREEMPTED: (_A, _PREEMPTING, _R),
        ServerState.SUCCEEDED: (_A, _R),
        ServerState.ABORTED: (_A, _R),
        ServerState.REJECTED: (_P, _R),
        ServerState.PREEMPTING: (_A, _PREEMPTING),
        ServerState.RECALLING: (_P, _RECALLING),
        ServerState.RECALLED: (_P, _R),
    },
    _P: {
        ServerState.PENDING: (),
        ServerState.ACTIVE: (_A,),
        ServerState.PREEMPTED: (_A, _PREEMPTING, _R),
        ServerState.SUCCEEDED: (_A, _R),
        ServerState.ABORTED: (_A, _R),
        ServerState.REJECTED: (_R,),
        ServerState.PREEMPTING: (_A, _PREEMPTING),
        ServerState.RECALLING: (_RECALLING,),
        ServerState.RECALLED: (_RECALLING, _R),
    },
    _A: {
        ServerState.ACTIVE: (),
        ServerState.PREEMPTED: (_PREEMPTING, _R),
        ServerState.SUCCEEDED: (_R,),
        ServerState.ABORTED: (_R,),
        ServerState.PREEMPTING: (_PREEMPTING,),
    },
    _R: {
        ServerState.ACTIVE: (),
        ServerState.PREEMPTED: (),
        ServerState.SUCCEEDED: (),
        ServerState.ABORTED: (),
        ServerState.REJECTED: (),
        ServerState.RECALLED: (),
    },
    _C: {
        ServerState.PENDING: (),
        ServerState.ACTIVE: (),
        ServerState.PREEMPTED: (_PREEMPTING, _R),
        ServerState.SUCCEEDED: (_PREEMPTING, _R),
        ServerState.ABORTED: (_PREEMPTING, _R),
        ServerState.REJECTED: (_R,),
        ServerState.PREEMPTING: (_PREEMPTING,),
        ServerState.RECALLING: (_RECALLING,),
        ServerState.RECALLED: (_RECALLING, _R),
    },
    _RECALLING: {
        ServerState.PREEMPTED: (_PREEMPTING, _R),
        ServerState.SUCCEEDED: (_PREEMPTING, _R),
        ServerState.ABORTED: (_PREEMPTING, _R),
        ServerState.REJECTED: (_R,),
        ServerState.PREEMPTING: (_PREEMPTING,),
        ServerState.RECALLING: (),
        ServerState.RECALLED: (_R,),
    },
    _PREEMPTING: {
        ServerState.PREEMPTED: (_R,),
        ServerState.SUCCEEDED: (_R,),
        ServerState.ABORTED: (_R,),
        ServerState.PREEMPTING: (),
    },
    _D: {state: () for state in (*ServerState,) if state.is_terminal},
}

_ENDS = {
    ServerState.PREEMPTED: (TerminalState.PREEMPTED, GoalStatus.CANCELED),
    ServerState.SUCCEEDED: (TerminalState.SUCCEEDED, GoalStatus.SUCCEEDED),
    ServerState.ABORTED: (TerminalState.ABORTED, GoalStatus.ABORTED),
    ServerState.REJECTED: (TerminalState.REJECTED, GoalStatus.REJECTED),
    ServerState.RECALLED: (TerminalState.RECALLED, GoalStatus.CANCELED),
    ServerState.LOST: (TerminalState.LOST, GoalStatus.LOST),
}


class Step(NamedTuple):
    """One of the states that a goal goes through.

    Attributes:
        state: The state.
        status: What that is in all worlds.
    """

    state: CommState
    status: GoalStatus


class CommStateMachine:
    """Where a goal is, as its client knows; changed by what is heard.

    All that changes it returns the states it went through, in order: a server that is faster than
    its status messages makes it go through several at once.

    Attributes:
        state: Where it is.
        heard: What the server said last; None before it said anything.
        executed: Whether the server has begun to execute it.
    """

    def __init__(self) -> None:
        self.state = CommState.WAITING_FOR_GOAL_ACK
        self.heard: ServerState | None = None
        self.executed = False

    @property
    def terminal(self) -> TerminalState | None:
        """How the goal ended; None before it is done."""
        if self.state is not CommState.DONE:
            return None
        return _ENDS[self.heard or ServerState.LOST][0]

    @property
    def status(self) -> GoalStatus:
        """What that is in all worlds.

        PENDING until the server executes it; CANCELING once the server knows that it shall be
        cancelled; RECALLED and PREEMPTED are both CANCELED.
        """
        if self.state in (CommState.WAITING_FOR_RESULT, CommState.DONE):
            return _ENDS[self.heard or ServerState.LOST][1]
        if self.state in (CommState.RECALLING, CommState.PREEMPTING):
            return GoalStatus.CANCELING
        return GoalStatus.EXECUTING if self.executed else GoalStatus.PENDING

    def hear(self, said: ServerState) -> list[Step]:
        """Take what the server says of the goal.

        Raises:
            ValueError: It cannot be so after what the server said before; nothing is changed.
        """
        if said is ServerState.LOST:
            return self.lose()
        steps = _NEXT[self.state].get(said)
        if steps is None:
            raise ValueError(f"{said.name} does not follow {self.state.name}")
        if self.state in (CommState.WAITING_FOR_RESULT, CommState.DONE):
            return []  # it has ended as what was heard first
        self.heard = said
        return self._go(*steps)

    def finish(self, said: ServerState) -> list[Step]:
        """Take the result, which says how the goal ended; nothing happens when it was done already.

        Raises:
            ValueError: What it says is no end.
        """
        if self.state is CommState.DONE:
            return []
        if not said.is_terminal:
            raise ValueError(f"a result cannot come with {said.name}")
        # The result counts, whatever was heard before.
        steps = _NEXT[self.state].get(said, ())
        self.heard = said
        return self._go(*steps, CommState.DONE)

    def cancel(self) -> list[Step]:
        """Take note that the server is being asked to cancel the goal.

        One that is being cancelled, or has ended, stays where it is.
        """
        if self.state in (CommState.WAITING_FOR_GOAL_ACK, CommState.PENDING, CommState.ACTIVE):
            return self._go(CommState.WAITING_FOR_CANCEL_ACK)
        return []

    def lose(self) -> list[Step]:
        """Take note that nobody will hear of the goal any more."""
        if self.state is CommState.DONE:
            return []
        self.heard = ServerState.LOST
        return self._go(CommState.DONE)

    def _go(self, *states: CommState) -> list[Step]:
        steps = []
        for state in states:
            self.state = state
            self.executed |= state in (CommState.ACTIVE, CommState.PREEMPTING)
            steps.append(Step(state, self.status))
        return steps
