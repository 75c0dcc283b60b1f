"""Serving a node's parameters: six services and ``/parameter_events``, as every ROS 2 node does.

Names, types and profiles: rclcpp's ``ParameterService`` and ``NodeParameters``, rmw's
``rmw_qos_profile_parameters`` and ``rmw_qos_profile_parameter_events``.
"""

from __future__ import annotations

import logging
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from rosglass.comm import IMMEDIATE, Handle, ParameterDescriptor, QoS
from rosglass.errors import NodeClosedError, ParameterError
from rosglass.ros2.parameter_values import (
    descriptor_to_message,
    event_to_message,
    value_from_message,
    value_to_message,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from rosglass.comm import Executor, Node, Publisher
    from rosglass.messages import Message
    from rosglass.ros2.parameter_values import TypedValue
    from rosglass.ros2.parameters import Change, Ros2Parameters

__all__ = ["EVENTS", "EVENTS_QOS", "EVENT_TYPE", "SERVICES", "SERVICES_QOS", "ParameterServices"]

_log = logging.getLogger("rosglass.ros2")
EVENTS, EVENT_TYPE = "/parameter_events", "rcl_interfaces/msg/ParameterEvent"
EVENTS_QOS = SERVICES_QOS = QoS(depth=1000)
#: The services' names below the node's, and their types.
SERVICES = {
    "describe_parameters": "rcl_interfaces/srv/DescribeParameters",
    "get_parameter_types": "rcl_interfaces/srv/GetParameterTypes",
    "get_parameters": "rcl_interfaces/srv/GetParameters",
    "list_parameters": "rcl_interfaces/srv/ListParameters",
    "set_parameters": "rcl_interfaces/srv/SetParameters",
    "set_parameters_atomically": "rcl_interfaces/srv/SetParametersAtomically",
}


class ParameterServices(Handle):
    """Serves a node's parameters.

    Args:
        node: The node.
        parameters: Its parameters.
        executor: Where requests are answered.
    """

    def __init__(self, node: Node, parameters: Ros2Parameters, executor: Executor) -> None:
        self._node, self._parameters, self._executor = node, parameters, executor
        self._made: list[Handle] = []
        self._events: Publisher | None = None

    def offer(self) -> Iterator[None]:
        """Offer all of it, in pieces of a millisecond or so."""
        answers = {
            "describe_parameters": self._describe,
            "get_parameter_types": self._types,
            "get_parameters": self._get,
            "list_parameters": self._list,
            "set_parameters": self._set,
            "set_parameters_atomically": self._set_atomically,
        }
        self._announce()
        for name, answer in answers.items():
            yield
            self._serve(name, answer)

    def close(self) -> None:
        """Withdraw the services; safe to call twice."""
        while self._made:
            self._made.pop().close()

    def _serve(self, name: str, answer: Callable[[Message], dict[str, Any]]) -> None:
        self._made.append(
            self._node.create_service_server(
                f"~/{name}", SERVICES[name], answer, SERVICES_QOS, executor=self._executor
            )
        )

    def _announce(self) -> None:
        self._events = self._node.create_publisher(EVENTS, EVENT_TYPE, EVENTS_QOS)
        self._made += [self._events, self._parameters.changes.add(self._tell, IMMEDIATE)]

    def _tell(self, change: Change) -> None:
        events = self._events
        assert events is not None
        with suppress(NodeClosedError):
            events.publish(event_to_message(self._parameters.node, self._node.now(), *change))

    # -- answers ---------------------------------------------------------------------------------

    def _describe(self, request: Message) -> dict[str, Any]:
        descriptors = []
        for name in request.names:
            try:
                descriptor = self._parameters.describe(name)
            except (ParameterError, NodeClosedError):  # closing is told by the service's end
                descriptor = ParameterDescriptor(name)
            descriptors.append(descriptor_to_message(descriptor))
        return {"descriptors": descriptors}

    def _types(self, request: Message) -> dict[str, Any]:
        return {"types": [int(self._parameters.typed_value(name).type) for name in request.names]}

    def _get(self, request: Message) -> dict[str, Any]:
        values = [self._parameters.typed_value(name) for name in request.names]
        return {"values": [value_to_message(value) for value in values]}

    def _list(self, request: Message) -> dict[str, Any]:
        names = self._parameters.find(request.prefixes, request.depth)
        prefixes = dict.fromkeys(name.rpartition(".")[0] for name in names if "." in name)
        return {"result": {"names": names, "prefixes": list(prefixes)}}

    def _set(self, request: Message) -> dict[str, Any]:
        return {"results": [self._try([parameter]) for parameter in request.parameters]}

    def _set_atomically(self, request: Message) -> dict[str, Any]:
        return {"result": self._try(request.parameters)}

    def _try(self, parameters: Iterable[Message]) -> dict[str, Any]:
        values: dict[str, TypedValue] = {}
        reason = ""
        try:
            for parameter in parameters:
                who = f"parameter {parameter.name!r}"
                values[parameter.name] = value_from_message(parameter.value, who)
        except ParameterError as error:
            reason = str(error)
        reason = reason or self._parameters.try_set(values)
        return {"successful": not reason, "reason": reason}
