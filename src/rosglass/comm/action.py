"""Actions: long tasks with feedback that can be cancelled; asking for them, and offering them."""

from __future__ import annotations

from abc import abstractmethod
from enum import Enum
from typing import TYPE_CHECKING, Any, NamedTuple

from rosglass.comm.node import Handle
from rosglass.comm.rclpy_names import hint_at_members

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from rosglass.comm.node import Executor
    from rosglass.comm.promise import Promise
    from rosglass.comm.time import Time
    from rosglass.messages import ActionType, Message

__all__ = [
    "ActionClient",
    "ActionResult",
    "ActionServer",
    "CancelAnswer",
    "ClientGoal",
    "GoalStatus",
    "ServerGoal",
]


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


@hint_at_members
class ClientGoal(Handle):
    """A goal that was sent; the same object in every callback, for as long as it lives.

    Closing it ends its callbacks and the waiting; the goal itself goes on at the server.

    Attributes:
        id: 16 bytes (a UUID) in ROS 2; a text in UTF-8 in ROS 1.
        goal: What was asked for; None while the action's type is not discovered yet.
    """

    id: bytes
    goal: Message | None

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.id_text} {self.status.value}>"

    @property
    def id_text(self) -> str:
        """The id as ROS's tools print it.

        In ROS 2, 32 hexadecimal digits (some logs put dashes in); in ROS 1, the text that it is.
        """
        return self.id.hex()

    @property
    @abstractmethod
    def status(self) -> GoalStatus:
        """What has become of it, as last heard."""

    @property
    @abstractmethod
    def accepted(self) -> Time | None:
        """When the server accepted it, by the server's clock; None before."""

    @property
    @abstractmethod
    def feedback(self) -> Message | None:
        """The newest feedback; None before the first."""

    @property
    @abstractmethod
    def acceptance(self) -> Promise[bool]:
        """The server's decision: whether it accepts the goal, or why it could not be asked."""

    @property
    @abstractmethod
    def done(self) -> Promise[ActionResult]:
        """The end: a result, or one of :meth:`result`'s errors. Cannot be cancelled itself."""

    def result(self, timeout: float | None = None) -> ActionResult:
        """Wait for the end.

        Args:
            timeout: Seconds to wait, None for ever.

        Raises:
            TimeoutError: It has not ended within the time, and goes on; or the server did not
                accept it within the time given to send_goal() (status LOST).
            GoalRejectedError: The server did not accept it.
            ServiceUnavailableError: No server appeared within the time given to send_goal(), or the
                goal was cancelled before any server told the action's type (status CANCELED).
            ConversionError: A value does not fit the type, which was discovered after sending.
            ServiceError: The server's answer cannot be decoded.
            ConnectionLostError: The server went away before the end.
            NodeClosedError: The client is closed, or gets closed meanwhile.
        """
        return self.done.result(timeout)

    @abstractmethod
    def cancel(self, timeout: float | None = 10.0) -> Promise[CancelAnswer]:
        """Ask the server to cancel it; returns at once. A goal not sent yet is not sent at all.

        Args:
            timeout: Seconds for the server to answer, None for ever; then a TimeoutError. Some
                servers never answer.
        """

    @abstractmethod
    def on_feedback(
        self, callback: Callable[[Message], None], executor: Executor | None = None
    ) -> Handle:
        """Call `callback` with each feedback from now on.

        Args:
            callback: Told the feedback; when it is slow, the newest ones only.
            executor: Where it runs; None for the node's own dispatcher thread.
        """

    @abstractmethod
    def on_status_change(
        self, callback: Callable[[GoalStatus], None], executor: Executor | None = None
    ) -> Handle:
        """Call `callback` with each new status from now on; arguments as :meth:`on_feedback`."""


@hint_at_members
class ActionClient(Handle):
    """Sends goals to an action; made by :meth:`Node.create_action_client`.

    Closing it leaves its goals to the server: cancel them first if they must not go on.

    Attributes:
        name: Absolute action name.
        type: The action type; None while it is not discovered yet.
    """

    name: str
    type: ActionType | None

    def __repr__(self) -> str:
        kind = self.type.name if self.type is not None else "type not known yet"
        return f"<{type(self).__name__} {self.name} [{kind}]>"

    @property
    @abstractmethod
    def ready(self) -> bool:
        """Whether a server is there that understands the goals."""

    @property
    @abstractmethod
    def problem(self) -> str:
        """Why goals cannot be sent, in words; empty when all is well."""

    @property
    @abstractmethod
    def goals(self) -> Sequence[ClientGoal]:
        """The goals of this client that have not ended, in order of sending."""

    @abstractmethod
    def wait_for_server(self, timeout: float | None = None) -> bool:
        """Wait up to `timeout` seconds (None: for ever) for a server; return whether it is there.

        Raises:
            NodeClosedError: The client is closed, or gets closed meanwhile.
        """

    @abstractmethod
    def send_goal(
        self,
        goal: Message | dict[str, Any] | None = None,
        /,
        *,
        on_feedback: Callable[[Message], None] | None = None,
        on_status_change: Callable[[GoalStatus], None] | None = None,
        on_done: Callable[[ClientGoal], None] | None = None,
        executor: Executor | None = None,
        timeout: float | None = 10.0,
    ) -> ClientGoal:
        """Send a goal, as soon as a server is there, and return at once.

        A goal that the server does not answer within `timeout` is given up, and the server is
        asked to cancel it, should it have accepted it: nothing runs that nobody watches.

        Args:
            goal: A message or a dict of fields; missing fields, and None, get the defaults.
            on_feedback: Called with each feedback.
            on_status_change: Called with each new status.
            on_done: Called with the goal when it has ended, one way or another.
            executor: Where callbacks run; None for the node's own dispatcher thread.
            timeout: Seconds for the server to appear and to accept or reject it; None for ever.

        Raises:
            ConversionError: A value does not fit its field; nothing is sent. While the type is not
                discovered yet, that shows later: the goal ends with it.
            NodeClosedError: The client is closed.
        """

    @abstractmethod
    def cancel_all(self, timeout: float | None = 10.0) -> Promise[CancelAnswer]:
        """Ask the server to cancel all its goals, other clients' too; returns at once.

        Goals of this client that wait for a server are not sent any more.

        Args:
            timeout: Seconds for the server to appear and to answer, None for ever.
        """

    @abstractmethod
    def cancel_before(self, time: Time, timeout: float | None = 10.0) -> Promise[CancelAnswer]:
        """Ask the server to cancel all goals that it accepted at or before `time`.

        Args:
            time: By the server's clock, e.g. :attr:`ClientGoal.accepted`; in ROS 1, by the clocks
                of those who sent the goals.
            timeout: As for :meth:`cancel_all`.

        Raises:
            ConversionError: It is no time after the epoch that a message can carry.
        """

    @abstractmethod
    def on_ready_change(
        self, callback: Callable[[bool], None], executor: Executor | None = None
    ) -> Handle:
        """Call `callback` with :attr:`ready` whenever it changes, to and fro."""


@hint_at_members
class ServerGoal(Handle):
    """A goal that a server accepted.

    Closing it aborts it, unless it has ended: ``with goal:`` leaves no goal behind.

    Attributes:
        id: 16 bytes (a UUID) in ROS 2; a text in UTF-8 in ROS 1.
        goal: What is asked for.
        accepted: When it was accepted.
    """

    id: bytes
    goal: Message
    accepted: Time

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.id_text} {self.status.value}>"

    @property
    def id_text(self) -> str:
        """The id as ROS's tools print it.

        In ROS 2, 32 hexadecimal digits (some logs put dashes in); in ROS 1, the text that it is.
        """
        return self.id.hex()

    @property
    @abstractmethod
    def status(self) -> GoalStatus:
        """What has become of it."""

    @property
    @abstractmethod
    def is_cancel_requested(self) -> bool:
        """Whether it should end soon: with :meth:`canceled`, or because the server closes."""

    @property
    @abstractmethod
    def cancel_request(self) -> Promise[None]:
        """Comes when :attr:`is_cancel_requested` becomes true: to be told of it, or to await it."""

    @abstractmethod
    def wait_for_cancel(self, timeout: float) -> bool:
        """Sleep up to `timeout` seconds; return early, with True, when it should end."""

    @abstractmethod
    def publish_feedback(
        self, feedback: Message | dict[str, Any] | None = None, /, **fields: Any
    ) -> None:
        """Send feedback: a message, a dict of fields, or the fields as keyword arguments.

        Raises:
            ConversionError: A value does not fit its field; nothing is sent.
            NodeClosedError: The server was closed.
            Error: The goal has ended.
        """

    @abstractmethod
    def succeed(self, result: Message | dict[str, Any] | None = None) -> None:
        """End it as done.

        Args:
            result: A message or a dict of fields; missing fields, and None, get the defaults.

        Raises:
            ConversionError: A value does not fit its field; the goal goes on.
            NodeClosedError: The server was closed.
            Error: The goal has ended already.
        """

    @abstractmethod
    def abort(self, result: Message | dict[str, Any] | None = None) -> None:
        """End it as failed; arguments and errors as :meth:`succeed`."""

    @abstractmethod
    def canceled(self, result: Message | dict[str, Any] | None = None) -> None:
        """End it as cancelled, after a request to cancel; as :meth:`succeed`.

        Raises:
            Error: Nobody asked to cancel it: abort() is for ends of the server's own choice.
        """


@hint_at_members
class ActionServer(Handle):
    """Offers an action; made by :meth:`Node.create_action_server`.

    Closing it aborts the goals that run, and tells their clients.

    Attributes:
        name: Absolute action name.
        type: The action type.
    """

    name: str
    type: ActionType

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.name} [{self.type.name}]>"

    @property
    @abstractmethod
    def goals(self) -> Sequence[ServerGoal]:
        """The goals that have not ended, in order of acceptance."""

    @property
    @abstractmethod
    def problem(self) -> str:
        """Why some clients cannot be served, in words; empty when all is well."""
