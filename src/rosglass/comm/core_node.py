"""The node of a world whose nodes have a core: what that answers in every such world."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rosglass.comm.loop import check_plain
from rosglass.comm.node import Node

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.comm.clock import Clock
    from rosglass.comm.core import NodeCore
    from rosglass.comm.graph import Status
    from rosglass.comm.node import Executor, Handle
    from rosglass.comm.time import Time

__all__ = ["CoreNode"]


class CoreNode(Node):
    """A node that keeps time, and tells its status and changes of the graph, by its core."""

    _core: NodeCore[Any]

    @property
    def clock(self) -> Clock:
        """The node's clock, which follows ``/clock`` where ROS's parameter says so."""
        return self._core.clock

    def now(self) -> Time:
        """Return the time of the node's clock."""
        return self._core.clock.now()

    def on_graph_change(
        self, callback: Callable[[], None], executor: Executor | None = None
    ) -> Handle:
        """Call `callback` after nodes or endpoints appeared or went; changes may be merged."""
        self._core.check_open()
        check_plain(callback, "on_graph_change()")
        return self._core.graph_listeners.add(
            lambda _: callback(), executor or self._core.dispatcher
        )

    def status(self) -> Status:
        """Return the state of the connection and what is being done about it."""
        return self._core.status()

    def on_status_change(
        self, callback: Callable[[Status], None], executor: Executor | None = None
    ) -> Handle:
        """Call `callback` with the new status whenever it changes."""
        self._core.check_open()
        return self._core.status_listeners.add(callback, executor or self._core.dispatcher)
