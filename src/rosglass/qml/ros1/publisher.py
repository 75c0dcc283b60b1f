"""Publishers made by ``Ros.advertise``."""
# ruff: noqa: N802, N815 - the names of slots and signals are QML's

from __future__ import annotations

from typing import TYPE_CHECKING

from rosglass.comm.qos import Durability, QoS
from rosglass.qml.dialect import Dialect
from rosglass.qml.publisher import Publisher
from rosglass.qml.singleton import full_type
from rosglass.qt import Property, Signal, Slot

if TYPE_CHECKING:
    from rosglass.qml.runtime import Runtime

__all__ = ["RosPublisher"]


class RosPublisher(Publisher):
    """A publisher with the names of ``Ros 1.0``.

    Args:
        runtime: The engine's runtime.
        type_name: Message type, as in QML.
        topic: Topic name, as in QML.
        queue_size: Messages that wait for a slow subscriber.
        latch: Whether new subscribers get the last message at once.
    """

    DIALECT = Dialect.ROS1

    connected = Signal()
    disconnected = Signal()

    def __init__(
        self, runtime: Runtime, type_name: str, topic: str, queue_size: int, latch: bool
    ) -> None:
        qos = QoS(depth=queue_size)
        if latch:
            qos = QoS(depth=1, durability=Durability.TRANSIENT_LOCAL)
        super().__init__(runtime, topic, full_type(type_name), qos)
        self._written, self._size, self._subscribers = type_name, queue_size, 0

    type = Property(str, lambda self: self._written, constant=True)
    queueSize = Property(int, lambda self: self._size, constant=True)
    isLatched = Property(
        bool, lambda self: self._qos.durability is Durability.TRANSIENT_LOCAL, constant=True
    )

    @Slot(result=int)
    def getNumSubscribers(self) -> int:
        """Return how many subscribers are connected; 0 before the topic is advertised."""
        return self.getSubscriptionCount()

    @Slot()
    def _on_tick(self) -> None:
        super()._on_tick()
        before, self._subscribers = self._subscribers, self.getSubscriptionCount()
        for _ in range(self._subscribers - before):
            self.connected.emit()
        for _ in range(before - self._subscribers):
            self.disconnected.emit()
