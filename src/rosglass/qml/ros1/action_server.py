"""The element ``ActionServer`` of ``Ros 1.0``, and its types' names."""

from __future__ import annotations

import re

from rosglass.qml.action_server import ActionServer
from rosglass.qml.dialect import Dialect
from rosglass.qml.singleton import full_type

__all__ = ["RosActionServer", "action_type"]

_MESSAGE = re.compile(r"([A-Za-z]\w*)/([A-Za-z]\w*)Action\Z")


def action_type(name: str) -> str:
    """Return ``pkg/action/Do`` for ``pkg/DoAction``, as ROS 1 calls it, and for ``pkg/Do``."""
    match = _MESSAGE.match(name)
    return full_type(f"{match[1]}/{match[2]}" if match else name, "action")


class RosActionServer(ActionServer):
    """Offers an action; goals follow the habits of ``Ros 1.0``, types are ``pkg/DoAction``."""

    DIALECT = Dialect.ROS1

    def _full_type(self) -> str:
        return action_type(self._type)
