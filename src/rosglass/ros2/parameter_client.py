"""Reading and setting another node's parameters."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from rosglass.comm import (
    Handle,
    ParameterClient,
    ParameterDescriptor,
    ParameterType,
    SetResult,
)
from rosglass.comm.deadline import Deadline
from rosglass.errors import ParameterError
from rosglass.ros2 import parameter_files
from rosglass.ros2.other_node import OtherNode
from rosglass.ros2.parameter_services import (
    EVENT_TYPE,
    EVENTS,
    EVENTS_QOS,
    SERVICES,
    SERVICES_QOS,
)
from rosglass.ros2.parameter_values import (
    check_name,
    check_values,
    descriptor_from_message,
    event_from_message,
    parameter_to_message,
    typed,
    value_from_message,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from os import PathLike

    from rosglass.comm import (
        Executor,
        Node,
        ParameterEvent,
        ParameterValue,
    )
    from rosglass.messages import Message

__all__ = ["Ros2ParameterClient"]


class Ros2ParameterClient(OtherNode, ParameterClient):
    """A client of another node's parameters; made by :meth:`Node.create_parameter_client`.

    Args:
        owner: The node that asks.
        node: Full name of the node that is asked.
    """

    def __init__(self, owner: Node, node: str) -> None:
        super().__init__(owner, node, SERVICES, "get_parameters", SERVICES_QOS)

    def names(
        self, prefixes: Iterable[str] = (), depth: int = 0, *, timeout: float | None = 10.0
    ) -> list[str]:
        """Return the names of its parameters, sorted; see the base class."""
        return self._names(prefixes, depth, Deadline(timeout, self.node))

    def get(
        self, names: Iterable[str] | None = None, *, timeout: float | None = 10.0
    ) -> dict[str, ParameterValue]:
        """Return the values of parameters, of all without `names`; see the base class."""
        deadline = Deadline(timeout, self.node)
        messages = self._ask("get_parameters", "values", names, deadline)
        found: dict[str, ParameterValue] = {}
        for name, message in messages.items():
            who = f"parameter {name!r} of {self.node}"
            found[name] = None if message is None else value_from_message(message, who).value
        return found

    def describe(
        self, names: Iterable[str] | None = None, *, timeout: float | None = 10.0
    ) -> dict[str, ParameterDescriptor]:
        """Return what is known about parameters, about all without `names`; see the base class."""
        deadline = Deadline(timeout, self.node)
        messages = self._ask("describe_parameters", "descriptors", names, deadline)
        return {
            name: ParameterDescriptor(name)
            if message is None
            else descriptor_from_message(message, f"parameter {name!r} of {self.node}")
            for name, message in messages.items()
        }

    def set(
        self, values: Mapping[str, ParameterValue], *, timeout: float | None = 10.0
    ) -> dict[str, SetResult]:
        """Set parameters one by one; see the base class."""
        deadline = Deadline(timeout, self.node)
        parameters = self._parameters(values, deadline)
        if not parameters:
            return {}
        response = self._call("set_parameters", {"parameters": parameters}, deadline)
        if len(response.results) != len(parameters):
            raise self._mismatch("set_parameters", len(response.results), len(parameters))
        results = [SetResult(bool(r.successful), r.reason) for r in response.results]
        return dict(zip(values, results, strict=True))

    def set_atomically(
        self, values: Mapping[str, ParameterValue], *, timeout: float | None = 10.0
    ) -> SetResult:
        """Set parameters, all or none; see the base class."""
        deadline = Deadline(timeout, self.node)
        parameters = self._parameters(values, deadline)
        response = self._call("set_parameters_atomically", {"parameters": parameters}, deadline)
        return SetResult(bool(response.result.successful), response.result.reason)

    def watch(
        self, callback: Callable[[ParameterEvent], None], executor: Executor | None = None
    ) -> Handle:
        """Call `callback` with each change of the node's parameters."""
        self._check_open()
        if not callable(callback):
            raise ParameterError(f"watch() needs something that can be called, got {callback!r}")

        def receive(message: Message) -> None:
            if message.node == self.node:
                callback(event_from_message(message))

        return self._watch(EVENTS, EVENT_TYPE, receive, EVENTS_QOS, executor)

    def load(self, path: str | PathLike[str], *, timeout: float | None = 10.0) -> list[str]:
        """Set the parameters that a file has for the node; see the base class."""
        deadline = Deadline(timeout, self.node)
        given = parameter_files.read(path).for_node(self.node)
        values = {name: value for name, value in given.items() if value is not None}
        if not values:
            raise ParameterError(f"{path} has no parameters for {self.node}")
        results = self.set(values, timeout=deadline.left())
        refused = [name for name, result in results.items() if not result.successful]
        if refused:
            # What is read-only may stand in a file that was saved, too.
            now = self.get(refused, timeout=deadline.left())
            refused = [
                name
                for name in refused
                if type(now[name]) is not type(values[name]) or now[name] != values[name]
            ]
        if refused:
            reasons = "; ".join(f"{name}: {results[name].reason}" for name in refused)
            raise ParameterError(f"{path}: {self.node} refuses {reasons}")
        return list(values)

    def save(self, path: str | PathLike[str], *, timeout: float | None = 10.0) -> None:
        """Write the node's parameters to a file that can be loaded; see the base class."""
        parameter_files.write(path, {self.node: self.get(timeout=timeout)})

    def _names(self, prefixes: Iterable[str], depth: int, deadline: Deadline) -> list[str]:
        wanted = _texts(prefixes, "prefixes", self.node)
        request = {"prefixes": wanted, "depth": depth}
        return sorted(self._call("list_parameters", request, deadline).result.names)

    def _ask(
        self, service: str, field: str, names: Iterable[str] | None, deadline: Deadline
    ) -> dict[str, Message | None]:
        """Return what a service says of each name, None for parameters that are not declared."""
        if names is None:
            wanted = self._names((), 0, deadline)
        else:
            wanted = [check_name(n) for n in _texts(names, "names", self.node)]
        wanted = list(dict.fromkeys(wanted))
        if not wanted:
            return {}
        found = self._call(service, {"names": wanted}, deadline)[field]
        if len(found) == len(wanted):
            return dict(zip(wanted, found, strict=True))
        # rclcpp's nodes say nothing at all as soon as one of the parameters is not declared.
        declared = set(self._names((), 0, deadline))
        known = [name for name in wanted if name in declared]
        found = self._call(service, {"names": known}, deadline)[field] if known else []
        if len(found) != len(known):
            raise self._mismatch(service, len(found), len(known))
        return dict.fromkeys(wanted) | dict(zip(known, found, strict=True))

    def _parameters(
        self, values: Mapping[str, ParameterValue], deadline: Deadline
    ) -> list[dict[str, Any]]:
        check_values(values, self.node)
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


def _texts(given: object, what: str, node: str) -> list[str]:
    """Return names as a list; raises ParameterError."""
    if isinstance(given, str):
        return [given]
    if not isinstance(given, Iterable):
        raise ParameterError(f"{node}: {what} must be a list of names, got {given!r}")
    return list(given)


def _is_empty(value: object) -> bool:
    return hasattr(value, "__len__") and not isinstance(value, (str, bytes)) and not len(value)
