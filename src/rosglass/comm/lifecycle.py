"""Lifecycle nodes: a client that drives them through their states and transitions.

States, transitions and services: design article "Managed nodes" and ``lifecycle_msgs``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from rosglass.comm.executor import check_plain
from rosglass.comm.node import RemoteNodeClient
from rosglass.comm.promise import Deadline
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
    """A transition from one state to another.

    Attributes:
        id: Its number (``lifecycle_msgs/msg/Transition``), e.g. 3.
        label: Its name, e.g. ``activate``.
        start: The state in which it starts.
        goal: The state to which it leads; the node may pass through others on the way.
    """

    id: int
    label: str
    start: State
    goal: State

    def __str__(self) -> str:
        return f"{self.label} [{self.id}]"


class TransitionEvent(NamedTuple):
    """A transition that a lifecycle node has made.

    Attributes:
        time: Time by the node's clock; zero if the node does not report it.
        transition: The transition, with the actual start and goal states.
    """

    time: Time
    transition: Transition


class LifecycleClient(RemoteNodeClient):
    """Drives a lifecycle node; created by :meth:`Node.create_lifecycle_client`.

    Methods that call the node take `timeout`, the total seconds to wait (None for no limit), and
    raise ServiceUnavailableError if the node is not available or not a lifecycle node, TimeoutError
    if it does not answer, and NodeClosedError.

    Args:
        owner: The node that the client belongs to.
        node: Full name of the lifecycle node.

    Attributes:
        node: As given.
    """

    def __repr__(self) -> str:
        return f"<{type(self).__name__} of {self.node}>"

    def __init__(self, owner: Node, node: str) -> None:
        super().__init__(owner, node, _SERVICES, "get_state")

    def state(self, *, timeout: float | None = 10.0) -> State:
        """Return the current state of the node."""
        return _state(self._ask("get_state", timeout).current_state)

    def available_states(self, *, timeout: float | None = 10.0) -> list[State]:
        """Return all states of the node."""
        response = self._ask("get_available_states", timeout)
        return [_state(state) for state in response.available_states]

    def available_transitions(self, *, timeout: float | None = 10.0) -> list[Transition]:
        """Return the transitions that are possible in the current state."""
        response = self._ask("get_available_transitions", timeout)
        return _transitions(response.available_transitions)

    def transition_graph(self, *, timeout: float | None = 10.0) -> list[Transition]:
        """Return all transitions of the node."""
        response = self._ask("get_transition_graph", timeout)
        return _transitions(response.available_transitions)

    def change_state(self, transition: str | int, *, timeout: float | None = 10.0) -> State:
        """Request a transition, wait for its end, and return the state of the node after it.

        A transition may take long: give a driver that searches for its hardware more than the
        default of 10 s.

        Args:
            transition: Its name, e.g. ``configure`` (``shutdown`` stands for those of all states),
                or its number.
            timeout: Total seconds to wait.

        Raises:
            TransitionError: It is not possible in the current state (the message lists those that
                are), or it failed.
        """
        deadline = Deadline(timeout, self.node)
        allowed = self.available_transitions(timeout=deadline.left())
        chosen = next((t for t in allowed if _matches(t, transition)), None)
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
        """Go to finalized, which is final."""
        return self.change_state("shutdown", timeout=timeout)

    def watch(
        self, callback: Callable[[TransitionEvent], None], executor: Executor | None = None
    ) -> Handle:
        """Call `callback` with each transition of the node, whatever requested it."""
        self._check_open()
        check_plain(callback, f"{self.node}: watch()")
        return self._subscribe(
            f"{self.node}/transition_event",
            _EVENT_TYPE,
            lambda message: callback(_event(message)),
            10,
            executor,
        )

    def _ask(self, service: str, timeout: float | None) -> Message:
        return self._call(service, {}, Deadline(timeout, self.node))


def _matches(transition: Transition, wanted: str | int) -> bool:
    if not isinstance(wanted, str):
        return transition.id == wanted
    # Older distributions have one per state: unconfigured_shutdown and so on.
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
    made = message.transition
    start, goal = _state(message.start_state), _state(message.goal_state)
    return TransitionEvent(Time(message.timestamp), Transition(made.id, made.label, start, goal))
