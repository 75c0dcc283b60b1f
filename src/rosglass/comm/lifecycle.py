"""Lifecycle nodes: their states, and the transitions between them.

States, transitions and services: design article "Managed nodes" and ``lifecycle_msgs``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from rosglass.comm.promise import Deadline
from rosglass.comm.service_client import OtherNode
from rosglass.comm.time import Time
from rosglass.errors import TransitionError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from rosglass.comm.handle import Executor, Handle
    from rosglass.comm.node import Node
    from rosglass.messages import Message

__all__ = ["LifecycleClient", "State", "Transition", "TransitionEvent"]

_SERVICES = {
    "change_state": "lifecycle_msgs/srv/ChangeState",
    "get_available_states": "lifecycle_msgs/srv/GetAvailableStates",
    "get_available_transitions": "lifecycle_msgs/srv/GetAvailableTransitions",
    "get_state": "lifecycle_msgs/srv/GetState",
    "get_transition_graph": "lifecycle_msgs/srv/GetAvailableTransitions",
}
_EVENT_TYPE = "lifecycle_msgs/msg/TransitionEvent"


class State(NamedTuple):
    """A state of a lifecycle node.

    Attributes:
        id: Its number (``lifecycle_msgs/msg/State``), e.g. 3.
        label: Its name, e.g. ``active``.
    """

    id: int
    label: str

    def __str__(self) -> str:
        return f"{self.label} [{self.id}]"


class Transition(NamedTuple):
    """A way from one state to another.

    Attributes:
        id: Its number (``lifecycle_msgs/msg/Transition``), e.g. 3.
        label: Its name, e.g. ``activate``.
        start: The state it begins in.
        goal: The state it leads to, by way of the states that the node passes through.
    """

    id: int
    label: str
    start: State
    goal: State

    def __str__(self) -> str:
        return f"{self.label} [{self.id}]"


class TransitionEvent(NamedTuple):
    """A lifecycle node that went from one state to another.

    Attributes:
        time: When, by the node's clock; zero when it does not say.
        transition: What it did; its states are those it came from and went to.
    """

    time: Time
    transition: Transition


class LifecycleClient(OtherNode):
    """Drives a lifecycle node; made by :meth:`Node.create_lifecycle_client`.

    Every method that asks the node takes `timeout`, seconds in all (None waits for ever), and
    raises ServiceUnavailableError when the node is not there or is no lifecycle node,
    TimeoutError when it does not answer, and NodeClosedError.

    Args:
        owner: The node that asks.
        node: Full name of the lifecycle node.

    Attributes:
        node: As given.
    """

    def __repr__(self) -> str:
        return f"<{type(self).__name__} of {self.node}>"

    def __init__(self, owner: Node, node: str) -> None:
        super().__init__(owner, node, _SERVICES, "get_state")

    def state(self, *, timeout: float | None = 10.0) -> State:
        """Return the state that the node is in."""
        return _state(self._ask("get_state", timeout).current_state)

    def available_states(self, *, timeout: float | None = 10.0) -> list[State]:
        """Return the states that the node can be in."""
        response = self._ask("get_available_states", timeout)
        return [_state(state) for state in response.available_states]

    def available_transitions(self, *, timeout: float | None = 10.0) -> list[Transition]:
        """Return the transitions that are possible in the state that the node is in."""
        response = self._ask("get_available_transitions", timeout)
        return _transitions(response.available_transitions)

    def transition_graph(self, *, timeout: float | None = 10.0) -> list[Transition]:
        """Return all transitions of the node."""
        response = self._ask("get_transition_graph", timeout)
        return _transitions(response.available_transitions)

    def change_state(self, transition: str | int, *, timeout: float | None = 10.0) -> State:
        """Let the node take a transition, wait until it has, and return the state it is in then.

        A node may take its time for that: give a driver that looks for its hardware more than the
        usual 10 s.

        Args:
            transition: Its name, e.g. ``configure`` (``shutdown`` is possible in several states
                under one name), or its number.
            timeout: Seconds to wait in all.

        Raises:
            TransitionError: It is not possible now (the message names those that are), or the
                node tried and failed.
        """
        deadline = Deadline(timeout, self.node)
        allowed = self.available_transitions(timeout=deadline.left())
        chosen = next((t for t in allowed if _is_called(t, transition)), None)
        if chosen is None:
            state = self.state(timeout=deadline.left())
            names = ", ".join(map(str, allowed)) or "none"
            raise TransitionError(
                f"{self.node} cannot {transition!r} now: it is {state}; possible are: {names}"
            )
        request = {"transition": {"id": chosen.id, "label": chosen.label}}
        success = self._call("change_state", request, deadline).success
        state = self.state(timeout=deadline.left())
        if not success:
            raise TransitionError(
                f"{self.node} failed to {chosen.label}, and is {state} now; its own log says why"
            )
        return state

    def configure(self, *, timeout: float | None = 10.0) -> State:
        """Go from unconfigured to inactive."""
        return self.change_state("configure", timeout=timeout)

    def activate(self, *, timeout: float | None = 10.0) -> State:
        """Go from inactive to active."""
        return self.change_state("activate", timeout=timeout)

    def deactivate(self, *, timeout: float | None = 10.0) -> State:
        """Go from active to inactive."""
        return self.change_state("deactivate", timeout=timeout)

    def cleanup(self, *, timeout: float | None = 10.0) -> State:
        """Go from inactive to unconfigured."""
        return self.change_state("cleanup", timeout=timeout)

    def shutdown(self, *, timeout: float | None = 10.0) -> State:
        """Go to finalized, from which there is no way back."""
        return self.change_state("shutdown", timeout=timeout)

    def watch(
        self, callback: Callable[[TransitionEvent], None], executor: Executor | None = None
    ) -> Handle:
        """Call `callback` with each transition of the node, whoever asked for it."""
        self._check_open()
        if not callable(callback):
            raise TransitionError(f"watch() needs something that can be called, got {callback!r}")
        return self._subscribe(
            f"{self.node}/transition_event",
            _EVENT_TYPE,
            lambda message: callback(_event(message)),
            10,
            executor,
        )

    def _ask(self, service: str, timeout: float | None) -> Message:
        return self._call(service, {}, Deadline(timeout, self.node))


def _is_called(transition: Transition, wanted: str | int) -> bool:
    if not isinstance(wanted, str):
        return transition.id == wanted
    # Older distributions have a shutdown for each state: unconfigured_shutdown and so on.
    label = transition.label
    return label == wanted or (wanted == "shutdown" and label.endswith("_shutdown"))


def _state(message: Message) -> State:
    return State(message.id, message.label)


def _transitions(descriptions: Iterable[Message]) -> list[Transition]:
    return [
        Transition(d.transition.id, d.transition.label, _state(d.start_state), _state(d.goal_state))
        for d in descriptions
    ]


def _event(message: Message) -> TransitionEvent:
    taken = message.transition
    start, goal = _state(message.start_state), _state(message.goal_state)
    return TransitionEvent(Time(message.timestamp), Transition(taken.id, taken.label, start, goal))
