"""Driving lifecycle nodes: their states, and the transitions between them.

States, transitions and services: design article "Managed nodes" and ``lifecycle_msgs``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from rosglass.comm import LifecycleClient, State, Time, Transition, TransitionEvent
from rosglass.comm.promise import Deadline
from rosglass.errors import TransitionError
from rosglass.ros2.other_node import OtherNode

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from rosglass.comm import Executor, Handle, Node
    from rosglass.messages import Message

__all__ = ["Ros2LifecycleClient"]

_SERVICES = {
    "change_state": "lifecycle_msgs/srv/ChangeState",
    "get_available_states": "lifecycle_msgs/srv/GetAvailableStates",
    "get_available_transitions": "lifecycle_msgs/srv/GetAvailableTransitions",
    "get_state": "lifecycle_msgs/srv/GetState",
    "get_transition_graph": "lifecycle_msgs/srv/GetAvailableTransitions",
}
_EVENT_TYPE = "lifecycle_msgs/msg/TransitionEvent"


class Ros2LifecycleClient(OtherNode, LifecycleClient):
    """Drives a lifecycle node; made by :meth:`Node.create_lifecycle_client`.

    Args:
        owner: The node that asks.
        node: Full name of the lifecycle node.
    """

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
        """Let the node take a transition; see the base class."""
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

    def watch(
        self, callback: Callable[[TransitionEvent], None], executor: Executor | None = None
    ) -> Handle:
        """Call `callback` with each transition of the node, whoever asked for it."""
        self._check_open()
        if not callable(callback):
            raise TransitionError(f"watch() needs something that can be called, got {callback!r}")
        return self._watch(
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
