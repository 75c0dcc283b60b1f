"""The element ``ImageTransportSubscriber`` of ``Ros 1.0``."""
# ruff: noqa: N815 - the names of signals are QML's

from __future__ import annotations

from typing import TYPE_CHECKING

from rosglass.qml.dialect import Dialect
from rosglass.qml.image_subscription import ImageTransportSubscription
from rosglass.qml.ros1.namespaces import resolved, within
from rosglass.qt import Property, QtCore, Signal, is_alive

if TYPE_CHECKING:
    from rosglass.qml.runtime import Runtime

__all__ = ["ImageTransportSubscriber"]


class ImageTransportSubscriber(ImageTransportSubscription):
    """Shows a camera; everything of ``Ros2``'s ImageTransportSubscription, and a namespace."""

    DIALECT = Dialect.ROS1

    nsChanged = Signal()

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        super().__init__(parent, runtime)
        self._namespace = self._shown_ns = ""

    def _set_namespace(self, namespace: str) -> None:
        if namespace != self._namespace:
            self._namespace, self._resolved = namespace, ""
            self._shown_ns = resolved(self.node, namespace)
            self._clear_sink()
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

    ns = Property(
        str, lambda self: resolved(self.node, self._namespace), _set_namespace, notify=nsChanged
    )
