"""What rcl gives every ROS 2 node: parameters, ``/rosout``, type descriptions, simulated time.

Behaviour: design articles "Logging" and "Clock and Time"; ``rcl``'s ``logging_rosout``, whose
levels and fields are ``rcl_interfaces/msg/Log``'s; its numbers are those of :mod:`logging`, too.
"""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING, Any

from rosglass.comm import IMMEDIATE, QoS
from rosglass.comm.builtin_services import BuiltinProtocol
from rosglass.comm.sim_time import USE_SIM_TIME, SimTime

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rosglass.comm import Node
    from rosglass.comm.builtin_services import BuiltinServices
    from rosglass.comm.log import NodeLog
    from rosglass.ros2.core import Core
    from rosglass.ros2.parameters import Change, Ros2Parameters

__all__ = ["RclServices"]

_FATAL = 50


class RclServices(BuiltinProtocol["Ros2Parameters"]):
    """What every ROS 2 node has by itself.

    Args:
        node: The node.
        core: What it consists of.
    """

    def __init__(self, node: Node, core: Core) -> None:
        self._node, self._core = node, core

    def open(self, services: BuiltinServices[Ros2Parameters]) -> None:
        """Set the levels of the library's loggers, and follow the simulation's time if asked to."""
        arguments, name = self._core.arguments, self._core.name
        for logger, level in arguments.logger_levels.items():
            if logger.partition(".")[0] == "rosglass":
                logging.getLogger(logger).setLevel(level)
        if USE_SIM_TIME in arguments.parameters(name.full):
            _ = services.parameters

    def create_parameters(self, services: BuiltinServices[Ros2Parameters]) -> Ros2Parameters:
        """Return the parameters; with them, the clock begins to follow ``use_sim_time``."""
        from rosglass.ros2.parameters import Ros2Parameters  # noqa: PLC0415

        core, full = self._core, self._core.name.full
        parameters = Ros2Parameters(full, core.dispatcher, core.arguments.parameters(full))
        sim_time = SimTime(self._node, core)

        def follow() -> None:
            sim_time.follow(parameters.typed_value(USE_SIM_TIME).value is True)

        def on_change(change: Change) -> None:
            if any(USE_SIM_TIME in names for names in change):
                follow()

        services.own(sim_time)
        services.own(parameters.changes.add(on_change, IMMEDIATE))
        follow()
        return parameters

    def create_log(self, services: BuiltinServices[Ros2Parameters]) -> NodeLog:  # noqa: ARG002
        """Return the log; its logger is named as by rcl: ``/arm/gripper`` logs as arm.gripper."""
        from rosglass.comm.log import NodeLog, RosoutTopic  # noqa: PLC0415

        core, arguments = self._core, self._core.arguments
        topic = RosoutTopic("rcl_interfaces/msg/Log", QoS.rosout(), _log_fields)
        return NodeLog(
            self._node,
            core,
            core.name.full.strip("/").replace("/", "."),
            topic if arguments.rosout else None,
            level=logging.INFO if arguments.log_level is None else arguments.log_level,
            levels=arguments.logger_levels,
            to_python=arguments.stdout,
        )

    def offer(self, services: BuiltinServices[Ros2Parameters]) -> Iterator[None]:
        """Announce ``/rosout``, and offer descriptions of types and the parameter services."""
        from rosglass.ros2.parameter_services import ParameterServices  # noqa: PLC0415
        from rosglass.ros2.parameters import DESCRIBE_TYPES  # noqa: PLC0415
        from rosglass.ros2.type_descriptions import TypeDescriptionServer  # noqa: PLC0415

        core, parameters = self._core, services.parameters
        services.log.open()
        yield
        if parameters.get(DESCRIBE_TYPES):
            descriptions = TypeDescriptionServer(core)
            services.own(descriptions)
            descriptions.open()
            yield
        offered = ParameterServices(self._node, parameters, core.own_dispatcher)
        services.own(offered)
        yield from offered.offer()


def _log_fields(record: logging.LogRecord) -> dict[str, Any]:
    """Return the fields of a ``Log`` message."""
    from rosglass.comm.log import clean, message_of  # noqa: PLC0415

    return {
        "stamp": {
            "sec": int(record.created),
            "nanosec": min(999_999_999, int(record.created % 1 * 1e9)),
        },
        "level": max(10, min(_FATAL, record.levelno // 10 * 10)),
        "name": clean(record.name),
        "msg": message_of(record),
        "file": clean(record.pathname),
        "function": clean(record.funcName or ""),
        "line": max(0, record.lineno),
    }
