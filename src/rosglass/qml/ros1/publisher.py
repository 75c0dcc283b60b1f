"""Publishers made by ``Ros.advertise``."""
# ruff: noqa: N802, N815 - the names of slots and signals are QML's

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING

from rosglass.comm.qos import Durability, History, QoS
from rosglass.errors import UnsupportedError
from rosglass.qml.dialect import Dialect
from rosglass.qml.publisher import Publisher
from rosglass.qml.singleton import full_type
from rosglass.qt import Property, Signal, Slot, is_alive

if TYPE_CHECKING:
    from rosglass.comm.events import Matched
    from rosglass.comm.publisher import Publisher as Sender
    from rosglass.qml.runtime import Runtime
    from rosglass.qml.session import Session

__all__ = ["RosPublisher"]


class RosPublisher(Publisher):
    """A publisher with the names of ``Ros 1.0``.

    Args:
        runtime: The engine's runtime.
        type_name: Message type, as in QML.
        topic: Topic name, as in QML.
        queue_size: Messages that wait for a slow subscriber; 0 for no limit.
        latch: Whether new subscribers get the last message at once.
    """

    DIALECT = Dialect.ROS1

    connected = Signal()
    disconnected = Signal()

    def __init__(
        self, runtime: Runtime, type_name: str, topic: str, queue_size: int, latch: bool
    ) -> None:
        qos = QoS(depth=queue_size) if queue_size else QoS(history=History.KEEP_ALL)
        if latch:
            qos = QoS(depth=1, durability=Durability.TRANSIENT_LOCAL)
        super().__init__(runtime, topic, full_type(type_name), qos)
        self._written, self._size = type_name, queue_size

    type = Property(str, lambda self: self._written, constant=True)
    queueSize = Property(int, lambda self: self._size, constant=True)
    isLatched = Property(
        bool, lambda self: self._qos.durability is Durability.TRANSIENT_LOCAL, constant=True
    )

    @Slot(result=int)
    def getNumSubscribers(self) -> int:
        """Return how many subscribers are connected; 0 before the topic is advertised."""
        return self.getSubscriptionCount()

    def _watch(self, sender: Sender, session: Session) -> None:
        def on_matched(event: Matched) -> None:
            if is_alive(self):
                (self.connected if event.change > 0 else self.disconnected).emit()

        with suppress(UnsupportedError):  # a recording, which has no subscribers
            sender.on_matched(on_matched, session.executor)
