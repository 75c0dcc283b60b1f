"""The element ``Subscriber`` of ``Ros 1.0``."""
# ruff: noqa: N815 - the names of signals are QML's

from __future__ import annotations

from rosglass.qml.dialect import Dialect
from rosglass.qml.subscription import Subscription
from rosglass.qt import Property, Signal

__all__ = ["Subscriber"]


class Subscriber(Subscription):
    """Receives a topic; everything of ``Ros2``'s Subscription, and the names of ``Ros 1.0``."""

    DIALECT = Dialect.ROS1

    runningChanged = Signal()

    def _set_running(self, running: bool) -> None:
        if running != self._enabled:
            self._set_enabled(running)
            self.runningChanged.emit()

    running = Property(bool, lambda self: self._enabled, _set_running, notify=runningChanged)
