"""Driving lifecycle nodes: their states, and the transitions between them.

States, transitions and services: design article "Managed nodes" and ``lifecycle_msgs``.
"""

from __future__ import annotations

import threading
import time
from typing import TYPE_CHECKING, Any

from rosglass.comm import LifecycleClient, State, Time, Transition, TransitionEvent
from rosglass.comm.promise import check_timeout
from rosglass.errors import NodeClosedError, TransitionError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from rosglass.comm import Executor, Handle, Node, ServiceClient, Subscription
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


class Ros2LifecycleClient(LifecycleClient):
    """Drives a lifecycle node; made by :meth:`Node.create_lifecycle_client`.

    Args:
        owner: The node that asks.
        node: Full name of the lifecycle node.
    """

    def __init__(self, owner: Node, node: str) -> None:
        self.node = node
        self._owner = owner
        self._lock = threading.Lock()
        self._clients: dict[str, ServiceClient] = {}
        self._watches: list[Subscription] = []
        self._closed = False
        self._client("get_state")

    @property
    def ready(self) -> bool:
        """Whether the node is there and has a lifecycle."""
        return not self._closed and self._client("get_state").ready

    def wait_for_server(self, timeout: float | None = None) -> bool:
        """Wait for the node; return whether it is there."""
        return self._client("get_state").wait_for_server(timeout)

    def state(self, *, timeout: float | None = 10.0) -> State:
        """Return the state that the node is in."""
        return _state(self._call("get_state", {}, timeout).current_state)

    def available_states(self, *, timeout: float | None = 10.0) -> list[State]:
        """Return the states that the node can be in."""
        response = self._call("get_available_states", {}, timeout)
        return [_state(state) for state in response.available_states]

    def available_transitions(self, *, timeout: float | None = 10.0) -> list[Transition]:
        """Return the transitions that are possible in the state that the node is in."""
        response = self._call("get_available_transitions", {}, timeout)
        return _transitions(response.available_transitions)

    def transition_graph(self, *, timeout: float | None = 10.0) -> list[Transition]:
        """Return all transitions of the node."""
        response = self._call("get_transition_graph", {}, timeout)
        return _transitions(response.available_transitions)

    def change_state(self, transition: str | int, *, timeout: float | None = 10.0) -> State:
        """Let the node take a transition; see the base class."""
        end = _end(timeout, self.node)
        allowed = self.available_transitions(timeout=_left(end))
        chosen = next((t for t in allowed if _is_called(t, transition)), None)
        if chosen is None:
            state = self.state(timeout=_left(end))
            names = ", ".join(map(str, allowed)) or "none"
            raise TransitionError(
                f"{self.node} cannot {transition!r} now: it is {state}; possible are: {names}"
            )
        request = {"transition": {"id": chosen.id, "label": chosen.label}}
        success = self._call("change_state", request, _left(end)).success
        state = self.state(timeout=_left(end))
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
        watch = self._owner.create_subscription(
            f"{self.node}/transition_event",
            _EVENT_TYPE,
            lambda message: callback(_event(message)),
            executor=executor,
        )
        with self._lock:
            self._watches = [*(w for w in self._watches if not w.closed), watch]
        return watch

    def close(self) -> None:
        """Ask and watch no more; calls that wait end with NodeClosedError. Safe to call twice."""
        with self._lock:
            self._closed = True
            made = [*self._clients.values(), *self._watches]
            self._clients, self._watches = {}, []
        for handle in made:
            handle.close()

    def _check_open(self) -> None:
        if self._closed:
            raise NodeClosedError(f"{self!r} is closed; create another one")

    def _client(self, service: str) -> ServiceClient:
        with self._lock:
            self._check_open()
            client = self._clients.get(service)
            if client is None:
                name = f"{self.node}/{service}"
                client = self._owner.create_service_client(name, _SERVICES[service])
                self._clients[service] = client
            return client

    def _call(self, service: str, request: dict[str, Any], timeout: float | None) -> Message:
        return self._client(service).call(request, timeout=timeout)


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


def _end(timeout: float | None, where: str) -> float | None:
    timeout = check_timeout(timeout, where)
    return None if timeout is None else time.monotonic() + timeout


def _left(end: float | None) -> float | None:
    # Rounded: people read it when the time is over.
    return None if end is None else max(0.0, round(end - time.monotonic(), 2))
