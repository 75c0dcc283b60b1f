"""The element ``ActionServer`` of ``Ros 1.0``."""

from __future__ import annotations

from rosglass.qml.action_server import ActionServer
from rosglass.qml.dialect import Dialect
from rosglass.qml.ros1.action_client import action_type

__all__ = ["RosActionServer"]


class RosActionServer(ActionServer):
    """Offers an action; goals follow the habits of ``Ros 1.0``, types are ``pkg/DoAction``."""

    DIALECT = Dialect.ROS1

    def _full_type(self) -> str:
        return action_type(self._type)
