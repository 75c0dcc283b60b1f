"""Lifecycle nodes: their states, and the transitions between them.

States and transitions: design article "Managed nodes" and ``lifecycle_msgs``.
"""

from __future__ import annotations

from abc import abstractmethod
from typing import TYPE_CHECKING, NamedTuple

from rosglass.comm.node import Handle

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.comm.node import Executor
    from rosglass.comm.time import Time

__all__ = ["LifecycleClient", "State", "Transition", "TransitionEvent"]


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


class LifecycleClient(Handle):
    """Drives a lifecycle node; made by :meth:`Node.create_lifecycle_client`.

    Every method that asks the node takes `timeout`, seconds in all (None waits for ever), and
    raises ServiceUnavailableError when the node is not there or is no lifecycle node,
    TimeoutError when it does not answer, and NodeClosedError.

    Attributes:
        node: Full name of the lifecycle node.
    """

    node: str

    def __repr__(self) -> str:
        return f"<{type(self).__name__} of {self.node}>"

    @property
    @abstractmethod
    def ready(self) -> bool:
        """Whether the node is there and has a lifecycle."""

    @abstractmethod
    def wait_for_server(self, timeout: float | None = None) -> bool:
        """Wait for the node; return whether it is there."""

    @abstractmethod
    def state(self, *, timeout: float | None = 10.0) -> State:
        """Return the state that the node is in."""

    @abstractmethod
    def available_states(self, *, timeout: float | None = 10.0) -> list[State]:
        """Return the states that the node can be in."""

    @abstractmethod
    def available_transitions(self, *, timeout: float | None = 10.0) -> list[Transition]:
        """Return the transitions that are possible in the state that the node is in."""

    @abstractmethod
    def transition_graph(self, *, timeout: float | None = 10.0) -> list[Transition]:
        """Return all transitions of the node."""

    @abstractmethod
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

    @abstractmethod
    def watch(
        self, callback: Callable[[TransitionEvent], None], executor: Executor | None = None
    ) -> Handle:
        """Call `callback` with each transition of the node, whoever asked for it."""
