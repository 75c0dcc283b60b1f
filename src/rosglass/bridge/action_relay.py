"""Relaying one action: offered in one world, goals sent to it from the other."""

from __future__ import annotations

import logging
import threading
import time
from concurrent.futures import wait
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from rosglass.bridge.offered_relay import OfferedRelay
from rosglass.comm import IMMEDIATE, ActionClient, ActionServer, GoalStatus
from rosglass.errors import Error, GoalRejectedError, NodeClosedError
from rosglass.errors import TimeoutError as LateError
from rosglass.messages import ActionTranslation, ActionType

if TYPE_CHECKING:
    from rosglass.bridge.side import Side
    from rosglass.comm import ClientGoal, ServerGoal
    from rosglass.messages import Message

__all__ = ["ActionRelay"]

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


class ActionRelay(OfferedRelay[ActionClient, ActionServer, ActionType, ActionTranslation]):
    """Offers in one world an action that a server in the other offers.

    Requests to cancel are passed on and count as accepted; the end is what the server makes of it.
    When the relay ends, its goals are cancelled: nobody could watch them any more.

    Arguments as for :class:`OfferedRelay`; the time is for accepting or rejecting a goal.
    """

    KIND = "action"
    PARTS = ("goal", "result", "feedback")

    def __init__(self, source: Side, target: Side, name: str, other: str, **options: Any) -> None:
        super().__init__(source, target, name, other, **options)
        self._lock = threading.Lock()
        #: By the message that its client sent, which accepting and executing it have in common.
        self._goals: dict[int, tuple[Message, _Goal]] = {}

    def _ask(self) -> ActionClient:
        return self._source.node.create_action_client(self.name, self._kind or None)

    def _type_of(self, client: ActionClient) -> ActionType | None:
        return client.type

    def _translate(self, kind: ActionType) -> ActionTranslation:
        return ActionTranslation(kind)

    def _offer(self, kind: ActionType) -> ActionServer:
        return self._target.node.create_action_server(
            self.other, kind, self._execute, accept=self._accept, cancel=self._cancel
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
        _log.warning("%s: a goal is not relayed: %s", self.name, error)

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
