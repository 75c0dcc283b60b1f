"""The element ``Subscriber`` of ``Ros 1.0``."""
# ruff: noqa: N802, N815 - the names of slots and signals are QML's

from __future__ import annotations

from typing import TYPE_CHECKING

from rosglass.qml.dialect import Dialect
from rosglass.qml.ros1.namespaces import resolved, within
from rosglass.qml.subscription import Subscription
from rosglass.qt import Property, QtCore, Signal, Slot, is_alive

if TYPE_CHECKING:
    from rosglass.comm.qos import QoS
    from rosglass.qml.runtime import Runtime

__all__ = ["Subscriber"]


class Subscriber(Subscription):
    """Receives a topic; everything of ``Ros2``'s Subscription, and the names of ``Ros 1.0``."""

    DIALECT = Dialect.ROS1

    runningChanged = Signal()
    nsChanged = Signal()

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        super().__init__(parent, runtime)
        self._namespace = self._shown_ns = ""
        self.enabledChanged.connect(self.runningChanged)

    def configure_within(self, namespace: str, topic: str, qos: QoS) -> None:
        """Set what ``Ros.subscribe`` was given."""
        self.configure(topic, "", qos)
        self._namespace = self._shown_ns = namespace

    def _set_namespace(self, namespace: str) -> None:
        if namespace != self._namespace:
            self._namespace, self._resolved = namespace, ""
            self._shown_ns = resolved(self.node, namespace)
            self._forget()
            self.nsChanged.emit()
            self._schedule()

    def _update(self) -> None:
        before, self._shown_ns = self._shown_ns, resolved(self.node, self._namespace)
        if before != self._shown_ns:
            self.nsChanged.emit()
        if is_alive(self):
            super()._update()

    def _resolve(self, topic: str) -> str:
        return super()._resolve(within(self._namespace, topic))

    running = Property(
        bool,
        lambda self: self._enabled,
        lambda self, running: self._set_enabled(running),
        notify=runningChanged,
    )
    ns = Property(
        str, lambda self: resolved(self.node, self._namespace), _set_namespace, notify=nsChanged
    )

    @Slot(result=int)
    def getNumPublishers(self) -> int:
        """Return how many publishers the topic has; 0 while not connected."""
        return self.getPublisherCount()
