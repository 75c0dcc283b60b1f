"""The element ``ServiceServer`` of ``Ros 1.0``."""

from __future__ import annotations

from rosglass.qml.dialect import Dialect
from rosglass.qml.service_server import ServiceServer

__all__ = ["RosServiceServer"]


class RosServiceServer(ServiceServer):
    """Offers a service; requests follow the habits of ``Ros 1.0``."""

    DIALECT = Dialect.ROS1
