"""Actions, long tasks with feedback that can be cancelled: the status of a goal, and its end."""

from __future__ import annotations

from enum import Enum
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from rosglass.messages import Message

__all__ = ["ActionResult", "CancelAnswer", "GoalStatus"]


class GoalStatus(Enum):
    """What has become of a goal."""

    PENDING = "pending"
    REJECTED = "rejected"
    ACCEPTED = "accepted"
    EXECUTING = "executing"
    CANCELING = "canceling"
    SUCCEEDED = "succeeded"
    CANCELED = "canceled"
    ABORTED = "aborted"
    #: The server went away, or never came: nobody knows.
    LOST = "lost"

    @property
    def is_active(self) -> bool:
        """Whether the goal has not ended."""
        return self in _ACTIVE


_ACTIVE = (GoalStatus.PENDING, GoalStatus.ACCEPTED, GoalStatus.EXECUTING, GoalStatus.CANCELING)


class ActionResult(NamedTuple):
    """How a goal ended.

    Attributes:
        status: SUCCEEDED, CANCELED or ABORTED.
        result: What the server sent with it; the type's defaults for a goal that was cancelled
            before it was sent.
    """

    status: GoalStatus
    result: Message


class CancelAnswer(NamedTuple):
    """What a server answers to a request to cancel.

    Attributes:
        accepted: Ids of the goals that are being cancelled.
        reason: Why there are none, in words; empty when there are.
    """

    accepted: tuple[bytes, ...]
    reason: str = ""
