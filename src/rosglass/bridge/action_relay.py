"""Relaying one action: offered in one world, goals sent to it from the other."""

from __future__ import annotations

import logging
import threading
import time
from concurrent.futures import wait
from contextlib import suppress
from typing import TYPE_CHECKING

from rosglass.bridge.status import RelayStatus
from rosglass.comm import IMMEDIATE, GoalStatus
from rosglass.errors import Error, GoalRejectedError, NodeClosedError
from rosglass.errors import TimeoutError as LateError
from rosglass.messages import ActionTranslation

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.bridge.side import Side
    from rosglass.comm import ActionClient, ActionServer, ClientGoal, ServerGoal
    from rosglass.messages import ActionType, Message

__all__ = ["ActionRelay", "action_notes"]

_log = logging.getLogger("rosglass.bridge")
#: Seconds that a goal may hold up others until its server has decided; then it counts as accepted,
#: and is aborted if the server rejects it after all.
_DECISION = 2.0
#: Seconds that servers have to take note, when the bridge ends, that goals are cancelled.
_FAREWELL = 1.0
#: Goals of which it is remembered where they were sent, whatever became of them.
_REMEMBERED = 100


class _Goal:
    """A goal on its way through: as sent to the server, and as taken from its client.

    Attributes:
        sent: Where the server works on it.
        taken: What its client knows of; None until it is accepted.
        waiting: Feedback that came before.
        stopped: Whether its client has asked to cancel it.
    """

    def __init__(self) -> None:
        self.sent: ClientGoal | None = None
        self.taken: ServerGoal | None = None
        self.waiting: list[Message] = []
        self.stopped = False


class ActionRelay:
    """Offers in one world an action that a server in the other offers.

    Requests to cancel are passed on and count as accepted; the end is what the server makes of it.
    When the relay ends, its goals are cancelled: nobody could watch them any more.

    Args:
        source: Where the server is.
        target: Where goals are to be sent.
        action: Its name at the source.
        other: Its name at the target.
        kind: Name of its type at the source, when it is not told there; empty to be told.
        timeout: Seconds that the server has to accept or reject a goal.
    """

    def __init__(
        self,
        source: Side,
        target: Side,
        action: str,
        other: str,
        *,
        kind: str = "",
        timeout: float = 10.0,
    ) -> None:
        self._source, self._target = source, target
        self.action, self.other = action, other
        self._kind, self._timeout = kind, timeout
        self._client: ActionClient | None = None
        self._server: ActionServer | None = None
        self._translation: ActionTranslation | None = None
        self._type: ActionType | None = None
        self._lock = threading.Lock()
        #: By the message that its client sent, which accepting and executing it have in common.
        self._goals: dict[int, tuple[Message, _Goal]] = {}
        self._problem = ""
        self._count = self._refused = 0

    def follow(self, wake: Callable[[], None]) -> None:
        """Do what is to be done; on the bridge's thread."""
        try:
            if self._client is None:
                self._client = self._source.node.create_action_client(
                    self.action, self._kind or None
                )
                self._client.on_ready_change(lambda _: wake(), IMMEDIATE)
            if self._server is None and self._client.type is not None and not self._problem:
                self._serve(self._client.type)
        except NodeClosedError:
            return
        except Error as error:
            if str(error) != self._problem:
                self._problem = str(error)
                _log.warning("%s is not relayed: %s", self.action, error)

    def _serve(self, kind: ActionType) -> None:
        offered = kind
        if self._source.node.wire != self._target.node.wire:
            self._translation = ActionTranslation(kind)
            self._target.teach(self._translation)
            offered = self._translation.type
        self._type = kind
        self._server = self._target.node.create_action_server(
            self.other, offered, self._execute, accept=self._accept, cancel=self._cancel
        )

    # -- from the client to the server -----------------------------------------------------------

    def _accept(self, message: Message) -> bool:
        """Send a goal on and return what the server decides."""
        translation, client, goal = self._translation, self._client, _Goal()
        assert client is not None
        try:
            asked = message if translation is None else translation.goal.convert(message)
            goal.sent = client.send_goal(
                asked,
                on_feedback=lambda told: self._feed(goal, told),
                executor=IMMEDIATE,
                timeout=self._timeout,
            )
            with self._lock:
                undecided = sum(not one.sent.acceptance.done() for _, one in self._goals.values()
                                if one.sent is not None)  # fmt: skip
                self._goals[id(message)] = message, goal
                while len(self._goals) > _REMEMBERED and self._forget_one():
                    pass
            accepted = goal.sent.acceptance.result(_DECISION if not undecided else 0.0)
        except LateError:
            accepted = goal.sent is not None and not goal.sent.acceptance.done()
        except Error as error:
            self._complain(error)
            accepted = False
        if not accepted:
            self._refused += 1
            with self._lock:
                self._goals.pop(id(message), None)
        return accepted

    def _cancel(self, taken: ServerGoal) -> bool:
        with self._lock:
            _, goal = self._goals.get(id(taken.goal), (None, None))
        if goal is not None and goal.sent is not None:
            goal.stopped = True
            goal.sent.cancel(self._timeout)
        return True

    # -- from the server to the client -----------------------------------------------------------

    def _execute(self, taken: ServerGoal) -> None:
        with self._lock:
            _, goal = self._goals.get(id(taken.goal), (None, None))
        if goal is None or goal.sent is None:
            taken.abort()
            return
        result: Message | None
        while goal.taken is None:
            with self._lock:
                waiting, goal.waiting = goal.waiting, []
                if not waiting:
                    goal.taken = taken
            for told in waiting:
                self._publish(taken, told)
        try:
            status, told = goal.sent.result()
            result = told if self._translation is None else self._translation.result.convert(told)
            self._count += 1
        except Error as error:
            if not isinstance(error, (GoalRejectedError, NodeClosedError)):
                self._complain(error)
            self._refused += 1
            status, result = GoalStatus.ABORTED, None
        finally:
            with self._lock:
                self._goals.pop(id(taken.goal), None)
        if goal.stopped:
            # The server may be quicker than the answer to the request.
            taken.wait_for_cancel(_DECISION)
        with suppress(NodeClosedError):
            if status is GoalStatus.SUCCEEDED:
                taken.succeed(result)
            elif status is GoalStatus.CANCELED and taken.is_cancel_requested:
                taken.canceled(result)
            else:
                # Cancelled by others than its client: to that it has failed.
                taken.abort(result)

    def _feed(self, goal: _Goal, told: Message) -> None:
        with self._lock:
            taken = goal.taken
            if taken is None:
                goal.waiting.append(told)
                del goal.waiting[:-_REMEMBERED]
                return
        self._publish(taken, told)

    def _publish(self, taken: ServerGoal, told: Message) -> None:
        try:
            if self._translation is not None:
                told = self._translation.feedback.convert(told)
            taken.publish_feedback(told)
        except NodeClosedError:
            return
        except Error as error:
            if taken.status.is_active:
                self._complain(error)

    # -- for people ------------------------------------------------------------------------------

    def _forget_one(self) -> bool:
        for key, (_, goal) in self._goals.items():
            if goal.sent is not None and goal.sent.done.done():
                del self._goals[key]
                return True
        return False

    def _complain(self, error: Error) -> None:
        _log.warning("%s: a goal is not relayed: %s", self.action, error)

    def status(self) -> RelayStatus:
        """Return how it is doing."""
        kind, translation = self._type, self._translation
        problem = self._problem
        if not problem and self._client is not None:
            problem = self._client.problem
        return RelayStatus(
            "action",
            self.action,
            self.other,
            "->" if self._source.number == 0 else "<-",
            "" if kind is None else kind.name,
            translation.type.name if translation is not None else kind.name if kind else "",
            count=self._count,
            refused=self._refused,
            notes=() if translation is None else action_notes(translation),
            problem=problem,
        )

    def close(self) -> None:
        """Stop relaying; goals are cancelled, and their clients told. Safe to call twice."""
        client, self._client = self._client, None
        if client is not None:
            with suppress(Error):
                asked = [goal.cancel(_FAREWELL) for goal in client.goals]
                deadline = time.monotonic() + _FAREWELL
                for answer in asked:
                    wait([answer], max(0.0, deadline - time.monotonic()))
            client.close()
        if self._server is not None:
            self._server.close()


def action_notes(translation: ActionTranslation) -> tuple[str, ...]:
    """Say what a translation loses, and makes up."""
    told = []
    for name in ("goal", "result", "feedback"):
        part = getattr(translation, name)
        told += [f"left out of the {name}: {path}" for path in part.left_out]
    if translation.derived:
        told.append(f"ROS {translation.type.ros} has no such type of its own")
    return tuple(told)
