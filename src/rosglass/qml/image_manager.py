"""The singleton ``ImageTransportManager``: what all cameras have in common."""
# ruff: noqa: N802, N815 - the names of slots and signals are QML's

from __future__ import annotations

from typing import TYPE_CHECKING

from rosglass.qml.runtime import own_runtime
from rosglass.qt import Property, QtCore, Signal, Slot

if TYPE_CHECKING:
    from rosglass.qml.load_balancer import LoadBalancer

__all__ = ["ImageTransportManager"]


class ImageTransportManager(QtCore.QObject):
    """Switches load balancing; one per engine, all of a session sharing the setting."""

    loadBalancingEnabledChanged = Signal()

    @property
    def _balancer(self) -> LoadBalancer:
        return own_runtime(self).session.balancer

    def _is_enabled(self) -> bool:
        return self._balancer.enabled

    @Slot(bool)
    def setLoadBalancingEnabled(self, enabled: bool) -> None:
        """Say whether pictures of throttled cameras are fetched one by one, taking turns.

        Otherwise cameras are received as fast as they send, and what is too much is not decoded.
        """
        if enabled != self._balancer.enabled:
            self._balancer.enabled = enabled
            self.loadBalancingEnabledChanged.emit()

    loadBalancingEnabled = Property(
        bool, _is_enabled, setLoadBalancingEnabled, notify=loadBalancingEnabledChanged
    )
