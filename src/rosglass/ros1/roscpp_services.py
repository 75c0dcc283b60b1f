"""The built-in services of roscpp and rospy: parameters, ``/rosout``, log levels, simulated time.

Behaviour: ROS wiki, "rosout", "Clock", "roscpp" and "rospy/Overview/Logging"; levels and fields are
``rosgraph_msgs/Log``'s. As in rospy and roscpp, ``name`` is the node's and ``topics`` are those
that the node publishes or subscribes to, unless ``/rosout_disable_topics_generation`` is set. The
services ``~get_loggers`` and ``~set_logger_level`` are what rosconsole and rqt_logger_level call.
"""

from __future__ import annotations

import itertools
import logging
from typing import TYPE_CHECKING, Any

from rosglass.comm import IMMEDIATE, QoS
from rosglass.comm.builtin_services import USE_SIM_TIME, BuiltinProtocol, SimTime
from rosglass.comm.log import NodeLog, RosoutTopic, clean, message_of
from rosglass.errors import ServiceError
from rosglass.ros1.parameter_namespace import Ros1Parameters
from rosglass.ros1.parameter_server import StartParameters

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from rosglass.comm import Node
    from rosglass.comm.builtin_services import BuiltinServices
    from rosglass.messages import Message
    from rosglass.ros1.parameter_server import ParameterServer
    from rosglass.wires.tcpros.core import TcprosCore

__all__ = ["RoscppServices"]

_NO_TOPICS = "/rosout_disable_topics_generation"
#: Latched, as in rospy and roscpp.
_ROSOUT_QOS = QoS(depth=1000, durability=QoS.latched().durability)
#: How long the first messages wait for the node ``/rosout``: only the last one is latched.
_ROSOUT_WAIT_S = 2.0
#: The levels' names in roscpp; fatal is Python's critical.
_LEVELS = {
    "debug": logging.DEBUG,
    "info": logging.INFO,
    "warn": logging.WARNING,
    "error": logging.ERROR,
    "fatal": logging.CRITICAL,
}
#: ``rosgraph_msgs/Log``'s levels by the lowest of Python's that they stand for.
_LOG_LEVELS = ((50, 16), (40, 8), (30, 4), (20, 2))
_DEBUG = 1
_LIBRARY = "rosglass"


class RoscppServices(BuiltinProtocol["Ros1Parameters"]):
    """The parameters, log, clock and log level services of a ROS 1 node.

    The clock follows ``/use_sim_time``. roscpp and rospy read that parameter once, as they start;
    this node follows it, so that a screen started before the simulation has its time, too.

    Args:
        node: The node.
        core: The node's core.
        server: The master's parameter server.
        topics: Returns the topics that the node publishes or subscribes to.
    """

    def __init__(
        self, node: Node, core: TcprosCore, server: ParameterServer, topics: Callable[[], list[str]]
    ) -> None:
        self._node, self._core, self._server, self._topics = node, core, server, topics

    def open(self, services: BuiltinServices[Ros1Parameters]) -> None:
        """Set the program's start parameters, and follow simulated time.

        Until the master has answered, which takes some milliseconds after connecting, the clock
        shows the system's time.
        """
        services.own(self._server)
        self._core.add(StartParameters(self._server))
        sim_time = SimTime(self._core, self._node.create_subscription)
        services.own(sim_time)
        # As in rospy, 1 counts, too.
        services.own(
            self._server.subscribe(
                f"/{USE_SIM_TIME}", lambda value: sim_time.follow(bool(value)), IMMEDIATE
            )
        )

    def create_parameters(
        self,
        services: BuiltinServices[Ros1Parameters],  # noqa: ARG002 - they need not be closed
    ) -> Ros1Parameters:
        """Return the node's parameters on the master's server."""
        return Ros1Parameters(self._core, self._server)

    def create_log(self, services: BuiltinServices[Ros1Parameters]) -> NodeLog:
        """Return the log; its logger is below ``ros``, as in roscpp: ``ros.arm.gripper``."""
        core, numbers = self._core, itertools.count(1)
        without_topics = self._server.subscribe(_NO_TOPICS)
        services.own(without_topics)

        def fields(record: logging.LogRecord) -> dict[str, Any]:
            # The node's time may be simulated; the record's is the system's.
            now = core.clock.now().nanoseconds
            return {
                "header": {
                    "seq": next(numbers) % 2**32,
                    "stamp": {"secs": now // 10**9, "nsecs": now % 10**9},
                },
                "level": _level_of(record.levelno),
                "name": core.name.full,
                "msg": message_of(record),
                "file": clean(record.pathname),
                "function": clean(record.funcName or ""),
                "line": max(0, record.lineno),
                "topics": [] if without_topics.value else self._topics(),
            }

        topic = RosoutTopic("rosgraph_msgs/Log", _ROSOUT_QOS, fields, _ROSOUT_WAIT_S)
        name = "ros." + core.name.full.strip("/").replace("/", ".")
        return NodeLog(core, name, topic)

    def offer(self, services: BuiltinServices[Ros1Parameters]) -> Iterator[None]:
        """Publish ``/rosout``, and offer the services for log levels."""
        services.log.open()
        yield
        self._logger = services.log.logger
        for name, type_name, answer in (
            ("~get_loggers", "roscpp/GetLoggers", self._list_loggers),
            ("~set_logger_level", "roscpp/SetLoggerLevel", self._set_level),
        ):
            executor = self._core.own_dispatcher
            services.own(
                self._node.create_service_server(name, type_name, answer, executor=executor)
            )

    def _loggers(self) -> dict[str, logging.Logger]:
        own = {logger.name: logger for logger in self._logger.family()}
        library = {
            name: known
            for name, known in sorted(logging.Logger.manager.loggerDict.items())
            if name.partition(".")[0] == _LIBRARY and isinstance(known, logging.Logger)
        }
        return own | library

    def _list_loggers(self, _: Message) -> dict[str, Any]:
        return {
            "loggers": [
                {"name": name, "level": _name_of(logger.getEffectiveLevel())}
                for name, logger in self._loggers().items()
            ]
        }

    def _set_level(self, request: Message) -> dict[str, Any]:
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
    """Return the name of the most severe level that is not above `level`."""
    return next((n for n, least in reversed(_LEVELS.items()) if level >= least), "debug")


def _level_of(number: int) -> int:
    """Return the most severe level of ``rosgraph_msgs/Log`` that is not above `number`."""
    return next((ros for least, ros in _LOG_LEVELS if number >= least), _DEBUG)
