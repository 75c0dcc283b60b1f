"""The parameter services of ROS 2 nodes: our node's, and asking other nodes by theirs.

Six services and ``/parameter_events``. Names, types and profiles: rclcpp's ``ParameterService`` and
``NodeParameters``, rmw's ``rmw_qos_profile_parameters`` and ``rmw_qos_profile_parameter_events``;
fields: ``rcl_interfaces/msg/ParameterValue``, ``ParameterDescriptor`` and ``ParameterEvent``.
"""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING, Any

from rosglass.comm import (
    IMMEDIATE,
    Handle,
    ParameterDescriptor,
    ParameterEvent,
    ParameterType,
    QoS,
    Range,
    SetResult,
)
from rosglass.comm.other_node import OtherNode
from rosglass.comm.parameters import RemoteParameters
from rosglass.errors import NodeClosedError, ParameterError
from rosglass.ros2.parameters import NOT_SET, TypedValue, check_name, typed

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping
    from os import PathLike

    from rosglass.comm import Executor, Node, ParameterValue, Publisher, Time
    from rosglass.comm.promise import Deadline
    from rosglass.messages import Message
    from rosglass.ros2.parameters import Change, Ros2Parameters

__all__ = [
    "EVENTS",
    "SERVICES",
    "ParameterServices",
    "RemoteParameterServices",
    "descriptor_from_message",
    "descriptor_to_message",
    "event_from_message",
    "event_to_message",
    "value_from_message",
    "value_to_message",
]

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
#: A ``ParameterValue``'s field by its type.
_FIELDS = {
    ParameterType.BOOL: "bool_value",
    ParameterType.INTEGER: "integer_value",
    ParameterType.DOUBLE: "double_value",
    ParameterType.STRING: "string_value",
    ParameterType.BYTE_ARRAY: "byte_array_value",
    ParameterType.BOOL_ARRAY: "bool_array_value",
    ParameterType.INTEGER_ARRAY: "integer_array_value",
    ParameterType.DOUBLE_ARRAY: "double_array_value",
    ParameterType.STRING_ARRAY: "string_array_value",
}
_ARRAY_TYPES = frozenset(kind for kind in ParameterType if kind >= ParameterType.BYTE_ARRAY)


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
        self._made += [self._events, self._parameters.changes.add(self._publish_event, IMMEDIATE)]

    def _publish_event(self, change: Change) -> None:
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
            except (ParameterError, NodeClosedError):  # the service's end says that it closed
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


class RemoteParameterServices(OtherNode, RemoteParameters):
    """Another node's parameters, reached by its parameter services.

    Args:
        owner: The node that asks.
        node: Full name of the node that is asked.
    """

    def __init__(self, owner: Node, node: str) -> None:
        super().__init__(owner, node, SERVICES, "get_parameters", SERVICES_QOS)

    def find(self, prefixes: list[str], depth: int, deadline: Deadline) -> list[str]:
        """Return the names under `prefixes`."""
        request = {"prefixes": prefixes, "depth": depth}
        return list(self._call("list_parameters", request, deadline).result.names)

    def values(self, names: list[str] | None, deadline: Deadline) -> dict[str, ParameterValue]:
        """Return values by name."""
        messages = self._ask("get_parameters", "values", names, deadline)
        found: dict[str, ParameterValue] = {}
        for name, message in messages.items():
            who = f"parameter {name!r} of {self.node}"
            found[name] = None if message is None else value_from_message(message, who).value
        return found

    def descriptors(
        self, names: list[str] | None, deadline: Deadline
    ) -> dict[str, ParameterDescriptor]:
        """Return what is known by name."""
        messages = self._ask("describe_parameters", "descriptors", names, deadline)
        return {
            name: ParameterDescriptor(name)
            if message is None
            else descriptor_from_message(message, f"parameter {name!r} of {self.node}")
            for name, message in messages.items()
        }

    def set(self, values: Mapping[str, ParameterValue], deadline: Deadline) -> dict[str, SetResult]:
        """Set parameters one by one."""
        parameters = self._parameters(values, deadline)
        if not parameters:
            return {}
        response = self._call("set_parameters", {"parameters": parameters}, deadline)
        if len(response.results) != len(parameters):
            raise self._mismatch("set_parameters", len(response.results), len(parameters))
        results = [SetResult(bool(r.successful), r.reason) for r in response.results]
        return dict(zip(values, results, strict=True))

    def set_atomically(self, values: Mapping[str, ParameterValue], deadline: Deadline) -> SetResult:
        """Set parameters, all or none."""
        parameters = self._parameters(values, deadline)
        response = self._call("set_parameters_atomically", {"parameters": parameters}, deadline)
        return SetResult(bool(response.result.successful), response.result.reason)

    def watch(
        self, callback: Callable[[ParameterEvent], None], executor: Executor | None
    ) -> Handle:
        """Call `callback` with what the node publishes on ``/parameter_events``."""

        def receive(message: Message) -> None:
            if message.node == self.node:
                callback(event_from_message(message))

        return self._watch(EVENTS, EVENT_TYPE, receive, EVENTS_QOS, executor)

    def load(self, path: str | PathLike[str], deadline: Deadline) -> list[str]:
        """Set what a file has for the node, wildcards included."""
        from rosglass.ros2 import parameter_files  # noqa: PLC0415 - yaml

        given = parameter_files.read(path).for_node(self.node)
        values = {name: value for name, value in given.items() if value is not None}
        if not values:
            raise ParameterError(f"{path} has no parameters for {self.node}")
        results = self.set(values, deadline)
        refused = [name for name, result in results.items() if not result.successful]
        if refused:
            # What is read-only may stand in a file that was saved, too.
            now = self.values(refused, deadline)
            refused = [
                name
                for name in refused
                if type(now[name]) is not type(values[name]) or now[name] != values[name]
            ]
        if refused:
            reasons = "; ".join(f"{name}: {results[name].reason}" for name in refused)
            raise ParameterError(f"{path}: {self.node} refuses {reasons}")
        return list(values)

    def save(self, path: str | PathLike[str], deadline: Deadline) -> None:
        """Write the node's parameters as ``ros2 param dump`` does."""
        from rosglass.ros2 import parameter_files  # noqa: PLC0415 - yaml

        parameter_files.write(path, {self.node: self.values(None, deadline)})

    def _ask(
        self, service: str, field: str, names: list[str] | None, deadline: Deadline
    ) -> dict[str, Message | None]:
        """Return what a service says of each name, None for parameters that are not declared."""
        wanted = self.find([], 0, deadline) if names is None else [check_name(n) for n in names]
        if not wanted:
            return {}
        found = self._call(service, {"names": wanted}, deadline)[field]
        if len(found) == len(wanted):
            return dict(zip(wanted, found, strict=True))
        # rclcpp's nodes say nothing at all as soon as one of the parameters is not declared.
        declared = set(self.find([], 0, deadline))
        known = [name for name in wanted if name in declared]
        found = self._call(service, {"names": known}, deadline)[field] if known else []
        if len(found) != len(known):
            raise self._mismatch(service, len(found), len(known))
        return dict.fromkeys(wanted) | dict(zip(known, found, strict=True))

    def _parameters(
        self, values: Mapping[str, ParameterValue], deadline: Deadline
    ) -> list[dict[str, Any]]:
        empty = [check_name(name) for name, value in values.items() if _is_empty(value)]
        known = self._types(empty, deadline) if empty else {}
        not_set = ParameterType.NOT_SET
        return [
            parameter_to_message(check_name(name), typed(name, value, known.get(name, not_set)))
            for name, value in values.items()
        ]

    def _types(self, names: list[str], deadline: Deadline) -> dict[str, ParameterType]:
        """Return the types of parameters that are to become empty lists."""
        response = self._call("get_parameter_types", {"names": names}, deadline)
        found = [int(number) for number in response.types]
        if len(found) != len(names) or not all(0 < n <= max(ParameterType) for n in found):
            raise ParameterError(
                f"{self.node} does not know the types of {', '.join(names)}, and an empty list "
                "does not say its own; are they declared there?"
            )
        return {name: ParameterType(number) for name, number in zip(names, found, strict=True)}

    def _mismatch(self, service: str, got: int, asked: int) -> ParameterError:
        return ParameterError(
            f"{self.node}/{service} answers with {got} results for {asked} parameters"
        )


def _is_empty(value: object) -> bool:
    return hasattr(value, "__len__") and not isinstance(value, (str, bytes)) and not len(value)


def value_to_message(value: TypedValue) -> dict[str, Any]:
    """Return the fields of a ``ParameterValue``."""
    if value.type is ParameterType.NOT_SET:
        return {"type": 0}
    return {"type": int(value.type), _FIELDS[value.type]: value.value}


def value_from_message(message: Message, who: str = "") -> TypedValue:
    """Return the value of a received ``ParameterValue``.

    Args:
        message: The message.
        who: Whose parameter it is, for messages.

    Raises:
        ParameterError: Its type is none of ROS's.
    """
    parameter_type = _type(message["type"], who)
    if parameter_type is ParameterType.NOT_SET:
        return NOT_SET
    value = getattr(message, _FIELDS[parameter_type])
    if parameter_type is ParameterType.BYTE_ARRAY:
        return TypedValue(parameter_type, bytes(value))
    if parameter_type in _ARRAY_TYPES:
        plain = value.tolist() if hasattr(value, "tolist") else list(value)
        return TypedValue(parameter_type, plain)
    return TypedValue(parameter_type, value)


def _type(number: int, who: str) -> ParameterType:
    try:
        return ParameterType(number)
    except ValueError:
        raise ParameterError(
            f"{who or 'a parameter'} has the type {number!r}, which ROS 2 does not know "
            f"(0 to {max(ParameterType)})"
        ) from None


def parameter_to_message(name: str, value: TypedValue) -> dict[str, Any]:
    """Return the fields of a ``Parameter``."""
    return {"name": name, "value": value_to_message(value)}


def descriptor_to_message(descriptor: ParameterDescriptor) -> dict[str, Any]:
    """Return the fields of a ``ParameterDescriptor``."""
    fields: dict[str, Any] = {
        "name": descriptor.name,
        "type": int(descriptor.type),
        "description": descriptor.description,
        "additional_constraints": descriptor.constraints,
        "read_only": descriptor.read_only,
        "dynamic_typing": descriptor.dynamic_typing,
    }
    if descriptor.range is not None:
        low, high, step = descriptor.range
        if descriptor.type is ParameterType.INTEGER:
            limits = {"from_value": int(low), "to_value": int(high), "step": int(step)}
            fields["integer_range"] = [limits]
        else:
            limits = {"from_value": float(low), "to_value": float(high), "step": float(step)}  # type: ignore[dict-item]
            fields["floating_point_range"] = [limits]
    return fields


def descriptor_from_message(message: Message, who: str = "") -> ParameterDescriptor:
    """Return a received ``ParameterDescriptor``; raises ParameterError."""
    limits = [*message.integer_range, *message.floating_point_range]
    allowed = Range(limits[0].from_value, limits[0].to_value, limits[0].step) if limits else None
    return ParameterDescriptor(
        message.name,
        _type(message["type"], who or message.name),
        message.description,
        message.additional_constraints,
        message.read_only,
        message.dynamic_typing,
        allowed,
    )


def event_to_message(
    node: str,
    stamp: Time,
    new: Mapping[str, TypedValue],
    changed: Mapping[str, TypedValue],
    deleted: Iterable[str],
) -> dict[str, Any]:
    """Return the fields of a ``ParameterEvent``."""
    return {
        "stamp": stamp.to_dict(),
        "node": node,
        "new_parameters": [parameter_to_message(*item) for item in new.items()],
        "changed_parameters": [parameter_to_message(*item) for item in changed.items()],
        "deleted_parameters": [parameter_to_message(name, NOT_SET) for name in deleted],
    }


def event_from_message(message: Message) -> ParameterEvent:
    """Return a received ``ParameterEvent``; raises ParameterError."""
    return ParameterEvent(
        message.node,
        _values(message.new_parameters, message.node),
        _values(message.changed_parameters, message.node),
        tuple(parameter.name for parameter in message.deleted_parameters),
    )


def _values(parameters: Iterable[Message], node: str) -> dict[str, ParameterValue]:
    return {
        parameter.name: value_from_message(
            parameter.value, f"parameter {parameter.name!r} of {node}"
        ).value
        for parameter in parameters
    }
