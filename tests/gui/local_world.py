"""A robot and its operator in this process: nodes on a ``local://`` graph of their own."""

from __future__ import annotations

import uuid
from typing import TYPE_CHECKING, Any

from rosglass.comm import ConnectionState, Status
from rosglass.errors import TypeNotFoundError
from rosglass.ros2.node import Ros2Node
from rosglass.wires.local import LocalMiddleware

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.comm import Publisher, Subscription
    from rosglass.comm.graph import Graph

#: The topics that every node has by itself.
_OWN = {"/clock", "/parameter_events", "/rosout"}


class LocalWorld:
    """Connects nodes to one graph, and shows what is open in all of them.

    Attributes:
        nodes: Those that are open.
        publishers: What their users publish, in order of appearance.
        subscriptions: What they subscribe to.
        missing: Names of types that no node knows.
        held_back_s: For how long the network holds back what is sent, in seconds.
    """

    def __init__(self) -> None:
        self.name = f"gui-{uuid.uuid4().hex}"
        self.nodes: list[LocalNode] = []
        self.publishers: list[Publisher] = []
        self.subscriptions: list[Subscription] = []
        self.missing: set[str] = set()
        self.held_back_s = 0.0

    def connect(
        self,
        url: str | None,
        name: str,
        namespace: str = "/",
        arguments: tuple[str, ...] = (),
        *,
        own_services: bool = False,
    ) -> LocalNode:
        """Return a new node that says it is connected to `url`; what it opens is shown."""
        node = LocalNode(self, url or "memory://", name, namespace, own_services)
        self.show(node, self.nodes)
        return node

    def show(self, handle: Any, shown: list[Any]) -> None:
        """Show a handle until it is closed."""
        close = handle.close

        def close_and_hide() -> None:
            if handle in shown:
                shown.remove(handle)
            close()

        handle.close = close_and_hide
        shown.append(handle)


class LocalNode(Ros2Node):
    """A node whose connection breaks when a test says so."""

    def __init__(
        self, world: LocalWorld, url: str, name: str, namespace: str, own_services: bool = False
    ) -> None:
        self._world, self._end = world, _End(world, url)
        super().__init__(self._end, url, name, namespace, own_services=own_services)

    def set_status(self, state: ConnectionState, detail: str = "") -> None:
        """Change the state of the connection."""
        self._end.set_status(Status(state, detail))

    def create_publisher(self, topic: str, type: Any, *given: Any, **options: Any) -> Publisher:
        """Publish, and show it."""
        self._check(type)
        return self._show(super().create_publisher(topic, type, *given, **options), "publishers")

    def create_subscription(
        self, topic: str, type: Any = None, *given: Any, **options: Any
    ) -> Subscription:
        """Subscribe, and show it."""
        self._check(type)
        made = super().create_subscription(topic, type, *given, **options)
        return self._show(made, "subscriptions")

    def _check(self, type: Any) -> None:
        if type in self._world.missing:
            raise TypeNotFoundError(f"no definition of {type}")

    def _show(self, made: Any, kind: str) -> Any:
        if made.topic not in _OWN:
            self._world.show(made, getattr(self._world, kind))
        return made


class _End(LocalMiddleware):
    """A node's end of the network."""

    def __init__(self, world: LocalWorld, url: str) -> None:
        super().__init__(f"local://{world.name}")
        self._world = world
        self._status = Status(ConnectionState.CONNECTED, f"connected to {url}")

    def open(self, graph: Graph, changed: Callable[[], None]) -> None:
        super().open(graph, changed)
        self._changed = changed

    def set_status(self, status: Status) -> None:
        self._status = status
        self._changed()

    def status(self) -> Status:
        return self._status

    def stamp(self) -> tuple[int, int | None]:
        now, _ = super().stamp()
        return now, now - int(self._world.held_back_s * 1e9)
