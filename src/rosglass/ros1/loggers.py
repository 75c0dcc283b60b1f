"""The services by which others see and change a node's log levels.

Services: ``~get_loggers`` and ``~set_logger_level`` (ROS wiki, "roscpp" and "rospy/Overview/
Logging"), which rosconsole and rqt_logger_level call.
"""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING, Any

from rosglass.comm import Handle
from rosglass.errors import ServiceError

if TYPE_CHECKING:
    from rosglass.comm import Executor, Node, ServiceServer
    from rosglass.comm.logger import NodeLogger
    from rosglass.messages import Message

__all__ = ["LoggerServices"]

#: Names of the levels as roscpp tells them; both spell fatal what Python calls critical.
_LEVELS = {
    "debug": logging.DEBUG,
    "info": logging.INFO,
    "warn": logging.WARNING,
    "error": logging.ERROR,
    "fatal": logging.CRITICAL,
}
_LIBRARY = "rosglass"


class LoggerServices(Handle):
    """Offers a node's loggers, its children and the library's own to others.

    Args:
        node: The node.
        logger: Its logger.
        executor: Where the services run.
    """

    def __init__(self, node: Node, logger: NodeLogger, executor: Executor) -> None:
        self._node, self._logger, self._executor = node, logger, executor
        self._servers: list[ServiceServer] = []

    def open(self) -> None:
        """Offer the services; raises NodeClosedError and what a service server does."""
        for name, kind, answer in (
            ("~get_loggers", "roscpp/GetLoggers", self._tell),
            ("~set_logger_level", "roscpp/SetLoggerLevel", self._set),
        ):
            self._servers.append(
                self._node.create_service_server(name, kind, answer, executor=self._executor)
            )

    def close(self) -> None:
        """Withdraw them; safe to call twice."""
        servers, self._servers = self._servers, []
        for server in servers:
            server.close()

    def _loggers(self) -> dict[str, logging.Logger]:
        own = {logger.name: logger for logger in self._logger.family()}
        library = {
            name: known
            for name, known in sorted(logging.Logger.manager.loggerDict.items())
            if name.partition(".")[0] == _LIBRARY and isinstance(known, logging.Logger)
        }
        return own | library

    def _tell(self, _: Message) -> dict[str, Any]:
        return {
            "loggers": [
                {"name": name, "level": _name_of(logger.getEffectiveLevel())}
                for name, logger in self._loggers().items()
            ]
        }

    def _set(self, request: Message) -> dict[str, Any]:
        known = self._loggers()
        level = _LEVELS.get(request.level.lower())
        if level is None:
            raise ServiceError(f"no level {request.level!r}; one of {', '.join(_LEVELS)}")
        logger = known.get(request.logger) if request.logger else self._logger
        if logger is None:
            raise ServiceError(f"no logger {request.logger!r}; one of {', '.join(known)}")
        logger.setLevel(level)
        return {}


def _name_of(level: int) -> str:
    """Return the name of the level that is no more severe, the least one at least."""
    return next((n for n, least in reversed(_LEVELS.items()) if level >= least), "debug")
