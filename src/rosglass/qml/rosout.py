"""What an interface logs, on the topic where a robot's logs are followed."""

from __future__ import annotations

import copy
import logging
from typing import TYPE_CHECKING

from rosglass.comm.log import RosoutHandler
from rosglass.errors import Error
from rosglass.qml.log import ROOT

if TYPE_CHECKING:
    from rosglass.comm.node import Node

__all__ = ["QmlRosout"]


class QmlRosout(logging.Handler):
    """Hands on to ``/rosout`` what QML logs, with its file and line, until it is closed.

    Of what the elements say by themselves only warnings are handed on.

    Args:
        node: Whose log it is.
    """

    def __init__(self, node: Node) -> None:
        super().__init__()
        self._node = node
        logger = logging.getLogger(ROOT)
        if logger.level == logging.NOTSET:
            # ROS's own level; Python's would keep what interfaces log from the robot.
            logger.setLevel(logging.INFO)
        logger.addHandler(self)

    def emit(self, record: logging.LogRecord) -> None:
        """Hand on a record."""
        if record.pathname.endswith(".py") and record.levelno < logging.WARNING:
            return
        try:
            logger = self._node.logger
        except Error:
            return
        if not (logger.isEnabledFor(record.levelno) or _has_level(record.name)):
            return
        told = copy.copy(record)
        told.name = logger.name + record.name.removeprefix(ROOT)
        # Printed it is already: only those who publish are told.
        for handler in logger.handlers:
            if isinstance(handler, RosoutHandler):
                handler.emit(told)

    def close(self) -> None:
        """Hand on no more; safe to call twice."""
        logging.getLogger(ROOT).removeHandler(self)
        super().close()


def _has_level(name: str) -> bool:
    """Return whether a named QML logger was given a level of its own, which it has passed."""
    while name.startswith(f"{ROOT}."):
        if logging.getLogger(name).level != logging.NOTSET:
            return True
        name = name.rpartition(".")[0]
    return False
