"""Sending goals to an action: what comes before the sending, in every world."""

from __future__ import annotations

import threading
from abc import abstractmethod
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from rosglass.comm.action import ActionClient
from rosglass.comm.client import Client, untyped
from rosglass.comm.node import Executor
from rosglass.comm.promise import check_timeout
from rosglass.comm.similar import similar
from rosglass.comm.time import Time
from rosglass.comm.watched_goal import WatchedGoal
from rosglass.errors import ConversionError, NodeClosedError, ServiceUnavailableError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from rosglass.comm.action import ClientGoal, GoalStatus
    from rosglass.comm.core import NodeCore
    from rosglass.messages import Message

__all__ = ["GoalClient"]

_Goal = TypeVar("_Goal", bound=WatchedGoal)


class GoalClient(Client, ActionClient, Generic[_Goal]):
    """An action client; the world sends the goals, and hears of them.

    Args:
        core: The node it belongs to.
        name: Absolute action name.
        end_of_time: Seconds since 1970 that the world's messages cannot carry any more, and the
            year that this is.
    """

    _goals: dict[Any, _Goal]

    def __init__(self, core: NodeCore[Any], name: str, end_of_time: tuple[int, int]) -> None:
        super().__init__(core, name)
        self.type = None
        self._end_of_time = end_of_time
        self._lock = threading.Lock()

    @property
    def closed(self) -> bool:
        """Whether :meth:`close` was called, of the client or of its node."""
        return self._closed or self._core.closed

    @property
    def goals(self) -> Sequence[ClientGoal]:
        """The goals of this client that have not ended, in order of sending."""
        return tuple(self._live())

    def ended(self) -> NodeClosedError:
        """Return the error of goals whose client was closed."""
        told = f"the client of {self.name} was closed before the goal ended, which goes on"
        return NodeClosedError(told)

    def unsent(self, timeout: float | None) -> ServiceUnavailableError:
        """Return the error of goals that found no server within `timeout` seconds."""
        why = self.problem or "its server appeared too late"
        return ServiceUnavailableError(
            f"no goal could be sent to {self.name} within {timeout or 0.0:g} s: {why}"
        )

    @abstractmethod
    def _make(self, goal: Any, timeout: float | None, *, typed: bool) -> _Goal:
        """Return a goal that is not sent yet: a message, or what becomes one (`typed` false)."""

    def _new_goal(
        self,
        goal: Any,
        timeout: float | None,
        executor: Executor | None,
        on_feedback: Callable[[Message], None] | None,
        on_status_change: Callable[[GoalStatus], None] | None,
        on_done: Callable[[ClientGoal], None] | None,
    ) -> _Goal:
        """Return a goal that is not sent yet; see :meth:`ActionClient.send_goal`."""
        self._check_open()
        timeout = check_timeout(timeout, self.name)
        if executor is not None and not isinstance(executor, Executor):
            raise ConversionError("executor", executor, "a rosglass.comm.Executor", self.name)
        kind = self.type
        value = untyped(goal, self.name) if kind is None else kind.goal.create(goal)
        made = self._make(value, timeout, typed=kind is not None)
        if on_feedback is not None:
            made.on_feedback(on_feedback, executor)
        if on_status_change is not None:
            made.on_status_change(on_status_change, executor)
        if on_done is not None:
            if not callable(on_done):
                raise ConversionError("on_done", on_done, "something that can be called", self.name)
            made.done.on_done(lambda _: on_done(made), executor)
        return made

    def _live(self) -> list[_Goal]:
        with self._lock:
            return list(self._goals.values())

    def _check_stamp(self, time: Time) -> None:
        """Raise ConversionError for a time until which no goals can be cancelled."""
        seconds, year = self._end_of_time
        if not isinstance(time, Time) or not 0 < time.nanoseconds < seconds * 1_000_000_000:
            told = f"a rosglass.Time after 1970 and before {year}; cancel_all() cancels all goals"
            raise ConversionError("time", time, told, self.name)

    def _no_server(self, offered: Iterable[str]) -> str:
        """Say that nobody offers the action, and what may be meant of what is offered."""
        kind = "" if self.type is None else f" [{self.type.name}]"
        return (
            f"no server offers the action {self.name}{kind} on {self._core.url} "
            f"({self._core.status()}){similar(self.name, offered)}"
        )
