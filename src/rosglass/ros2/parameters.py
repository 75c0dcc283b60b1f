"""ROS 2 parameters: a node's own, the services that offer them, and those of other nodes.

Rules: rclcpp's documentation of ``Node::declare_parameter`` and related functions, and the design
article "ROS 2 Parameter API": parameters are declared before they are used, and keep their type.
Services and ``/parameter_events``: rclcpp's ``ParameterService`` and ``NodeParameters``, rmw's
``rmw_qos_profile_parameters`` and ``rmw_qos_profile_parameter_events``, ``rcl_interfaces``.
"""

from __future__ import annotations

import logging
import math
import sys
import threading
from collections import deque
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

from rosglass.comm import (
    IMMEDIATE,
    Handle,
    Listeners,
    ParameterDescriptor,
    ParameterEvent,
    Parameters,
    ParameterType,
    QoS,
    Range,
    SetResult,
)
from rosglass.comm.builtin_services import USE_SIM_TIME
from rosglass.comm.executor import check_plain
from rosglass.comm.node import RemoteNodeClient
from rosglass.comm.parameters import RemoteParameters, check_values
from rosglass.errors import NodeClosedError, ParameterError, shown
from rosglass.ros2 import parameter_files

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping
    from os import PathLike

    from rosglass.comm import Executor, Node, ParameterValue, Time
    from rosglass.comm.promise import Deadline
    from rosglass.messages import Message

__all__ = [
    "DESCRIBE_TYPES",
    "EVENTS",
    "NOT_SET",
    "SERVICES",
    "TYPE_NAMES",
    "Change",
    "ParameterServices",
    "RemoteParameterServices",
    "Ros2Parameters",
    "TypedValue",
    "check_name",
    "descriptor_from_message",
    "descriptor_to_message",
    "event_from_message",
    "event_to_message",
    "in_range",
    "typed",
    "value_from_message",
    "value_to_message",
]

_log = logging.getLogger("rosglass.ros2")
#: A parameter that every node has, like :data:`USE_SIM_TIME`: whether the node describes its types
#: to others. It can only be set at the start.
DESCRIBE_TYPES = "start_type_description_service"
#: Names of the types, as ROS's own tools print them.
TYPE_NAMES = {
    ParameterType.NOT_SET: "not set",
    ParameterType.BOOL: "boolean",
    ParameterType.INTEGER: "integer",
    ParameterType.DOUBLE: "double",
    ParameterType.STRING: "string",
    ParameterType.BYTE_ARRAY: "byte array",
    ParameterType.BOOL_ARRAY: "boolean array",
    ParameterType.INTEGER_ARRAY: "integer array",
    ParameterType.DOUBLE_ARRAY: "double array",
    ParameterType.STRING_ARRAY: "string array",
}
_SCALARS: dict[type, ParameterType] = {
    bool: ParameterType.BOOL,
    int: ParameterType.INTEGER,
    float: ParameterType.DOUBLE,
    str: ParameterType.STRING,
}
_ARRAYS = {
    ParameterType.BOOL: ParameterType.BOOL_ARRAY,
    ParameterType.INTEGER: ParameterType.INTEGER_ARRAY,
    ParameterType.DOUBLE: ParameterType.DOUBLE_ARRAY,
    ParameterType.STRING: ParameterType.STRING_ARRAY,
}
_ARRAY_TYPES = frozenset(_ARRAYS.values()) | {ParameterType.BYTE_ARRAY}
_INT_LIMITS = (-(2**63), 2**63 - 1)
#: Units in the last place by which two equal doubles may differ, as in rclcpp.
_ULPS = 100
_NUMBERS = (ParameterType.INTEGER, ParameterType.DOUBLE)


class TypedValue(NamedTuple):
    """A value with its type, which an empty list does not show.

    Attributes:
        type: The type.
        value: The value: None, bool, int, float, str, bytes, or a list of the middle four.
    """

    type: ParameterType
    value: ParameterValue

    def copy(self) -> ParameterValue:
        """Return the value; a list is copied."""
        return list(self.value) if isinstance(self.value, list) else self.value  # type: ignore[return-value]

    def is_already(self, value: ParameterValue) -> bool:
        """Return whether setting `value` would change nothing: equal, and of the same type."""
        return self.value == value and typed("", value, self.type).type is self.type


NOT_SET = TypedValue(ParameterType.NOT_SET, None)


@dataclass(slots=True)
class _Entry:
    value: TypedValue
    descriptor: ParameterDescriptor


class Change(NamedTuple):
    """Parameters that changed together, with their types."""

    new: Mapping[str, TypedValue]
    changed: Mapping[str, TypedValue]
    deleted: tuple[str, ...]


class Ros2Parameters(Parameters):
    """A node's own parameters.

    Args:
        node: The node's full name.
        executor: Runs callbacks that are registered without an executor.
        overrides: Values that the program was started with.
    """

    def __init__(
        self, node: str, executor: Executor, overrides: Mapping[str, ParameterValue] | None = None
    ) -> None:
        self.node = node
        #: Notified of each change when it is made, with types.
        self.changes: Listeners[Change] = Listeners()
        self._executor = executor
        self._overrides = dict(overrides or {})
        #: Guards all of the following: users and the parameter services set parameters.
        self._lock = threading.Lock()
        self._entries: dict[str, _Entry] = {}
        self._version = 0
        self._validators: list[_Validator] = []
        self._waiting: deque[Change] = deque()
        self._notifying = False
        self._closed = False
        self.declare(
            USE_SIM_TIME, False, ParameterDescriptor(description="Follow the time on /clock.")
        )
        described = ParameterDescriptor(
            description="Describe types to other nodes.", read_only=True
        )
        self.declare(DESCRIBE_TYPES, True, described)

    def __repr__(self) -> str:
        return f"<{type(self).__name__} of {self.node}>"

    def __contains__(self, name: object) -> bool:
        return name in self._entries

    @property
    def overrides(self) -> Mapping[str, ParameterValue]:
        """Values that the program was started with, for parameters declared or not."""
        return dict(self._overrides)

    def declare(
        self,
        name: str,
        default: ParameterValue = None,
        descriptor: ParameterDescriptor | None = None,
    ) -> ParameterValue:
        """Declare a parameter; see :meth:`rosglass.comm.Parameters.declare`."""
        self._check_open()
        check_name(name)
        descriptor = ParameterDescriptor() if descriptor is None else descriptor
        if not isinstance(descriptor, ParameterDescriptor):
            raise ParameterError(f"parameter {name!r}: {descriptor!r} is not a ParameterDescriptor")
        initial = typed(name, default, descriptor.type)
        descriptor = _complete(name, initial, descriptor)
        override = self._overrides.get(name)
        if override is not None:
            try:
                value = typed(name, override, descriptor.type)
                _check_value(descriptor, value)
            except ParameterError as error:
                raise ParameterError(f"{error} (the program was started with that value)") from None
        else:
            value = initial
            if value.type is not ParameterType.NOT_SET:
                _check_value(descriptor, value)
        problem = self._validate({name: value.copy()})
        if problem:
            raise ParameterError(
                f"{self.node}: parameter {name!r} cannot be {value.value!r}: {problem}"
            )
        with self._lock:
            if name in self._entries:
                raise ParameterError(f"{self.node}: parameter {name!r} is declared already")
            self._entries[name] = _Entry(value, descriptor)
            self._version += 1
            self._waiting.append(Change({name: value}, {}, ()))
        self._notify()
        return value.copy()

    def undeclare(self, name: str) -> None:
        """Undeclare a parameter; raises ParameterError."""
        self._check_open()
        with self._lock:
            entry = self._entry(name)
            if entry.descriptor.read_only:
                raise ParameterError(
                    f"{self.node}: parameter {name!r} is read-only and cannot be undeclared"
                )
            del self._entries[name]
            self._version += 1
            self._waiting.append(Change({}, {}, (name,)))
        self._notify()

    def get(self, name: str) -> ParameterValue:
        """Return a value, None if it is not set; raises ParameterError if not declared."""
        self._check_open()
        with self._lock:
            return self._entry(name).value.copy()

    def set(self, values: Mapping[str, ParameterValue]) -> None:
        """Set parameters, all or none; see :meth:`rosglass.comm.Parameters.set`."""
        self._check_open()
        check_values(values, self.node)
        with self._lock:
            known = {name: self._entry(name).descriptor.type for name in values}
        reason = self.try_set({name: typed(name, values[name], known[name]) for name in values})
        if reason:
            raise ParameterError(f"{self.node}: {reason}")

    def describe(self, name: str) -> ParameterDescriptor:
        """Return the descriptor; raises ParameterError if not declared."""
        self._check_open()
        with self._lock:
            return self._entry(name).descriptor

    def names(self) -> list[str]:
        """Return the declared names, sorted."""
        self._check_open()
        return sorted(self._entries)

    def find(self, prefixes: Iterable[str] = (), depth: int = 0) -> list[str]:
        """Return the names below `prefixes` (none: all names), up to `depth` levels (0: all)."""
        prefixes = list(prefixes)
        if not prefixes:
            return [n for n in sorted(self._entries) if not depth or n.count(".") < depth]
        return [n for n in sorted(self._entries) if any(_below(n, p, depth) for p in prefixes)]

    def typed_value(self, name: str) -> TypedValue:
        """Return the value with its type; type NOT_SET if it is not declared or has no value."""
        entry = self._entries.get(name)
        return NOT_SET if entry is None else entry.value

    def snapshot(self) -> dict[str, TypedValue]:
        """Return all values with their types, by name."""
        with self._lock:
            return {name: entry.value for name, entry in sorted(self._entries.items())}

    def try_set(self, values: Mapping[str, TypedValue]) -> str:
        """Set parameters, all or none; return why they were not set, empty if they were."""
        while True:
            with self._lock:
                version = self._version
                problem = self._problem(values)
            problem = problem or self._validate({n: value.copy() for n, value in values.items()})
            if problem:
                return problem
            # Validators run unlocked: repeat if another thread has set something since.
            with self._lock:
                if self._version != version:
                    continue
                self._apply(values)
            self._notify()
            return ""

    def on_set(self, validate: Callable[[Mapping[str, ParameterValue]], str]) -> Handle:
        """Add a validator; see :meth:`rosglass.comm.Parameters.on_set`."""
        self._check_open()
        check_plain(validate, f"{self.node}: on_set()")
        validator = _Validator(self, validate)
        with self._lock:
            self._validators.append(validator)
        return validator

    def on_change(
        self, callback: Callable[[ParameterEvent], None], executor: Executor | None = None
    ) -> Handle:
        """Call `callback` with each change."""
        self._check_open()
        check_plain(callback, f"{self.node}: on_change()")

        def on_change(change: Change) -> None:
            new = {name: value.copy() for name, value in change.new.items()}
            changed = {name: value.copy() for name, value in change.changed.items()}
            callback(ParameterEvent(self.node, new, changed, change.deleted))

        return self.changes.add(on_change, executor or self._executor)

    def load(self, path: str | PathLike[str]) -> None:
        """Set the parameters that a file contains for this node; see the base class."""
        self._check_open()
        values = parameter_files.read(path).for_node(self.node)
        if not values:
            raise ParameterError(f"{path} has no parameters for {self.node}")
        # The file may contain read-only parameters with their current values.
        now = self.snapshot()
        wanted = {
            name: value
            for name, value in values.items()
            if value is not None and not (name in now and now[name].is_already(value))
        }
        try:
            self.set(wanted)
        except ParameterError as error:
            raise ParameterError(f"{path}: {error}") from None

    def save(self, path: str | PathLike[str]) -> None:
        """Write the parameters to a file that can be loaded; raises ParameterError."""
        self._check_open()
        values = {name: value.value for name, value in self.snapshot().items()}
        parameter_files.write(path, {self.node: values})

    def close(self) -> None:
        """Remove validators and listeners; safe to call twice."""
        with self._lock:
            self._closed = True
            self._validators.clear()
        self.changes.clear()

    def remove(self, validator: _Validator) -> None:
        """Remove a validator."""
        with self._lock:
            if validator in self._validators:
                self._validators.remove(validator)

    def _check_open(self) -> None:
        if self._closed:
            raise NodeClosedError(f"node {self.node} is closed; connect again")

    def _entry(self, name: str) -> _Entry:
        entry = self._entries.get(name)
        if entry is None:
            close = [known for known in self._entries if known.lower() == str(name).lower()]
            hint = f"; did you mean {close[0]!r}?" if close else "; declare() it first"
            raise ParameterError(f"{self.node}: parameter {name!r} is not declared{hint}")
        return entry

    def _problem(self, values: Mapping[str, TypedValue]) -> str:
        for name, value in values.items():
            entry = self._entries.get(name)
            if entry is None:
                return f"parameter {name!r} is not declared"
            descriptor = entry.descriptor
            if descriptor.read_only:
                return f"parameter {name!r} is read-only"
            if value.type is ParameterType.NOT_SET and descriptor.dynamic_typing:
                continue
            try:
                _check_value(descriptor, value)
            except ParameterError as error:
                return str(error)
        return ""

    def _validate(self, values: Mapping[str, ParameterValue]) -> str:
        with self._lock:
            validators = list(self._validators)
        for validator in validators:
            problem = validator.ask(values)
            if problem:
                return problem
        return ""

    def _apply(self, values: Mapping[str, TypedValue]) -> None:
        changed: dict[str, TypedValue] = {}
        deleted = []
        for name, value in values.items():
            entry = self._entries[name]
            if value.type is ParameterType.NOT_SET:
                del self._entries[name]
                deleted.append(name)
                continue
            entry.value = TypedValue(value.type, value.copy())
            if entry.descriptor.type is not value.type:
                entry.descriptor = replace(entry.descriptor, type=value.type)
            changed[name] = entry.value
        self._version += 1
        self._waiting.append(Change({}, changed, tuple(deleted)))

    def _notify(self) -> None:
        """Report changes in the order they were made, without holding a lock."""
        with self._lock:
            if self._notifying:
                return
            self._notifying = True
        while True:
            with self._lock:
                if not self._waiting or self._closed:
                    self._notifying = False
                    return
                change = self._waiting.popleft()
            self.changes.notify(change)


class _Validator(Handle):
    def __init__(
        self, owner: Ros2Parameters, validate: Callable[[Mapping[str, ParameterValue]], str]
    ) -> None:
        self._owner, self._validate = owner, validate

    def ask(self, values: Mapping[str, ParameterValue]) -> str:
        try:
            reason = self._validate(values)
        except Exception as error:  # noqa: BLE001 - a user's callback
            _log.exception("%s: a callback of on_set() failed", self._owner.node)
            return f"it was refused with {type(error).__name__}: {error}"
        if isinstance(reason, str):
            return reason
        if reason is None:
            return ""
        return f"a callback of on_set() returned {reason!r} instead of a text"

    def close(self) -> None:
        self._owner.remove(self)


def _complete(
    name: str, initial: TypedValue, descriptor: ParameterDescriptor
) -> ParameterDescriptor:
    """Return the descriptor with name and type filled in; raises ParameterError."""
    kind = descriptor.type
    if kind is ParameterType.NOT_SET:
        kind = initial.type
    if kind is ParameterType.NOT_SET and not descriptor.dynamic_typing:
        raise ParameterError(
            f"parameter {name!r} has neither a default nor a type; give one, or allow any type "
            "with ParameterDescriptor(dynamic_typing=True)"
        )
    if descriptor.range is not None:
        _check_range(name, kind, descriptor.range)
    return replace(descriptor, name=name, type=kind)


def _check_range(name: str, kind: ParameterType, allowed: Any) -> None:
    what = f"parameter {name!r}: its range {tuple(allowed)!r}"
    if kind not in _NUMBERS:
        raise ParameterError(f"{what} does not go with the type {TYPE_NAMES[kind]}")
    low, high, step = Range(*allowed)
    if not (low <= high and step >= 0):
        raise ParameterError(f"{what} is empty; give (low, high, step) with low <= high, step >= 0")
    if step and not math.isfinite(low):
        raise ParameterError(f"{what} counts steps from an infinite end; leave the step out")
    if kind is ParameterType.INTEGER and not all(
        isinstance(limit, int) and _INT_LIMITS[0] <= limit <= _INT_LIMITS[1]
        for limit in (low, high, step)
    ):
        raise ParameterError(f"{what} must be of whole numbers of 64 bits, as the parameter is")


def _check_value(descriptor: ParameterDescriptor, value: TypedValue) -> None:
    name, kind = descriptor.name, descriptor.type
    if value.type is not kind and not descriptor.dynamic_typing:
        advice = "; write 1.0 instead of 1" if _is_whole(kind, value) else ""
        raise ParameterError(
            f"parameter {name!r} is of type {TYPE_NAMES[kind]}, and cannot be set to "
            f"{shown(value.value)} of type {TYPE_NAMES[value.type]}{advice}"
        )
    if descriptor.range is not None and value.type in _NUMBERS:
        problem = in_range(descriptor.range, value.value)  # type: ignore[arg-type]
        if problem:
            raise ParameterError(f"parameter {name!r}: {problem}")


def _is_whole(kind: ParameterType, value: TypedValue) -> bool:
    return (kind, value.type) in (
        (ParameterType.DOUBLE, ParameterType.INTEGER),
        (ParameterType.DOUBLE_ARRAY, ParameterType.INTEGER_ARRAY),
    )


def _below(name: str, prefix: str, depth: int) -> bool:
    if name == prefix:
        return True
    rest = name[len(prefix) + 1 :] if name.startswith(f"{prefix}.") else ""
    return bool(rest) and (not depth or rest.count(".") < depth)


def check_name(name: object) -> str:
    """Return `name` if it is a valid parameter name; raises ParameterError."""
    if not isinstance(name, str) or not name:
        raise ParameterError(f"a parameter's name must be a non-empty string, got {name!r}")
    _check_text(f"the parameter name {name!r}", name)
    return name


def typed(name: str, value: object, known: ParameterType = ParameterType.NOT_SET) -> TypedValue:
    """Return a Python value with its parameter type.

    Numpy's scalars and arrays, tuples, bytearrays and the like become plain values and lists.

    Args:
        name: The parameter's name, for messages.
        value: The value.
        known: The parameter's current type; an empty list gets this type.

    Raises:
        ParameterError: The value cannot be a parameter's.
    """
    if not isinstance(value, (bool, int, float, str, bytes, bytearray, memoryview, list, tuple)):
        plain = getattr(value, "tolist", None)
        if plain is not None:
            value = plain()
    if value is None:
        return NOT_SET
    if isinstance(value, (bytes, bytearray, memoryview)):
        return TypedValue(ParameterType.BYTE_ARRAY, bytes(value))
    if isinstance(value, (list, tuple)):
        return _typed_list(name, value, known)
    return _typed_scalar(f"parameter {name!r}", value)


def _typed_list(name: str, values: list[Any] | tuple[Any, ...], known: ParameterType) -> TypedValue:
    if not values:
        if known is ParameterType.BYTE_ARRAY:
            return TypedValue(known, b"")
        if known in _ARRAY_TYPES:
            return TypedValue(known, [])
        if known is not ParameterType.NOT_SET:
            raise ParameterError(
                f"parameter {name!r} is of type {TYPE_NAMES[known]}, and cannot become a list"
            )
        raise ParameterError(
            f"parameter {name!r}: an empty list does not say its type; give it in the descriptor, "
            "e.g. ParameterDescriptor(type=ParameterType.STRING_ARRAY)"
        )
    if isinstance(values[0], (bytes, bytearray)):
        raise ParameterError(
            f"parameter {name!r}: a byte array is one bytes object, e.g. bytes([1, 2]), not a list"
        )
    items = [_typed_scalar(f"parameter {name!r}[{i}]", item) for i, item in enumerate(values)]
    first = items[0].type
    for position, item in enumerate(items):
        if item.type is not first:
            advice = (
                "; write whole numbers as 1.0" if ParameterType.DOUBLE in (first, item.type) else ""
            )
            raise ParameterError(
                f"parameter {name!r}: the items of a list must be of one type, but [0] is of type "
                f"{TYPE_NAMES[first]} and [{position}] of type {TYPE_NAMES[item.type]}{advice}"
            )
    return TypedValue(_ARRAYS[first], [item.value for item in items])  # type: ignore[arg-type]


def _typed_scalar(what: str, value: object) -> TypedValue:
    plain = getattr(value, "tolist", None)
    if plain is not None:
        value = plain()
    kind = next((kind for kind in _SCALARS if isinstance(value, kind)), None)
    if kind is None:
        raise ParameterError(
            f"{what}: a parameter is a bool, int, float, str, bytes or a list of one of the first "
            f"four, got {shown(value)}"
        )
    parameter_type = _SCALARS[kind]
    if parameter_type is ParameterType.INTEGER:
        low, high = _INT_LIMITS
        assert isinstance(value, int)
        if not low <= value <= high:
            raise ParameterError(
                f"{what}: {value} is beyond the 64 bits of an integer ({low} to {high}); "
                "a float would hold it, without its last digits"
            )
    if parameter_type is ParameterType.STRING:
        assert isinstance(value, str)
        _check_text(what, value)
    # Instances of subclasses (IntEnum, numpy's float64) become plain values.
    return TypedValue(parameter_type, kind(value))


def _check_text(what: str, text: str) -> None:
    if "\0" in text:
        raise ParameterError(f"{what} has a NUL character at position {text.index(chr(0))}")
    try:
        text.encode()
    except UnicodeEncodeError as error:
        raise ParameterError(
            f"{what} cannot be written as UTF-8 (position {error.start}: {error.reason})"
        ) from None


def in_range(allowed: Range, value: float) -> str:
    """Return why a number is not allowed, empty if it is.

    The rules are rclcpp's (``node_parameters.cpp``): both bounds are allowed, and between them the
    steps counted from the lower one; doubles may deviate by rounding.
    """
    low, high, step = allowed
    if isinstance(value, float):
        if _same(value, low) or _same(value, high):
            return ""
        inside = low < value < high
        on_step = not step or _same(value, low + round((value - low) / step) * step)
    else:
        if value in (low, high):
            return ""
        inside = low < value < high
        on_step = not step or (value - low) % step == 0
    if not inside:
        return f"{value} is outside {low} to {high}"
    return "" if on_step else f"{value} is not among {low}, {low + step} ... {high} (step {step})"


def _same(one: float, other: float) -> bool:
    tolerance = sys.float_info.epsilon * abs(one + other) * _ULPS
    return one == other or (math.isfinite(tolerance) and abs(one - other) <= tolerance)


EVENTS, EVENT_TYPE = "/parameter_events", "rcl_interfaces/msg/ParameterEvent"
EVENTS_QOS = SERVICES_QOS = QoS(depth=1000)
#: The services' names relative to the node's, and their types.
SERVICES = {
    "describe_parameters": "rcl_interfaces/srv/DescribeParameters",
    "get_parameter_types": "rcl_interfaces/srv/GetParameterTypes",
    "get_parameters": "rcl_interfaces/srv/GetParameters",
    "list_parameters": "rcl_interfaces/srv/ListParameters",
    "set_parameters": "rcl_interfaces/srv/SetParameters",
    "set_parameters_atomically": "rcl_interfaces/srv/SetParametersAtomically",
}
#: The fields of a ``ParameterValue``, such as ``bool_value``, by its type.
_FIELDS = {kind: f"{kind.name.lower()}_value" for kind in ParameterType if kind}


class ParameterServices(Handle):
    """The parameter services of a node.

    Args:
        node: The node.
        parameters: Its parameters.
        executor: Runs the requests.
    """

    def __init__(self, node: Node, parameters: Ros2Parameters, executor: Executor) -> None:
        self._node, self._parameters, self._executor = node, parameters, executor
        self._made: list[Handle] = []

    def offer(self) -> Iterator[None]:
        """Create publisher and services, in steps of about a millisecond."""
        node, parameters = self._node, self._parameters
        events = node.create_publisher(EVENTS, EVENT_TYPE, EVENTS_QOS)

        def publish(change: Change) -> None:
            with suppress(NodeClosedError):  # then nothing is to be reported
                events.publish(event_to_message(parameters.node, node.now(), *change))

        self._made += [events, parameters.changes.add(publish, IMMEDIATE)]
        callbacks = {
            "describe_parameters": self._describe,
            "get_parameter_types": self._types,
            "get_parameters": self._get,
            "list_parameters": self._list,
            "set_parameters": self._set,
            "set_parameters_atomically": self._set_atomically,
        }
        for name, callback in callbacks.items():
            yield
            server = node.create_service_server(
                f"~/{name}", SERVICES[name], callback, SERVICES_QOS, executor=self._executor
            )
            self._made.append(server)

    def close(self) -> None:
        """Close publisher and services; safe to call twice."""
        while self._made:
            self._made.pop().close()

    # -- callbacks -------------------------------------------------------------------------------

    def _describe(self, request: Message) -> dict[str, Any]:
        descriptors = []
        for name in request.names:
            try:
                descriptor = self._parameters.describe(name)
            except (ParameterError, NodeClosedError):
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
                label = f"parameter {parameter.name!r}"
                values[parameter.name] = value_from_message(parameter.value, label)
        except ParameterError as error:
            reason = str(error)
        reason = reason or self._parameters.try_set(values)
        return {"successful": not reason, "reason": reason}


class RemoteParameterServices(RemoteNodeClient, RemoteParameters):
    """Another node's parameters, accessed through its parameter services.

    Args:
        owner: The node that calls the services.
        node: Full name of the node with the parameters.
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
            label = f"parameter {name!r} of {self.node}"
            found[name] = None if message is None else value_from_message(message, label).value
        return found

    def descriptors(
        self, names: list[str] | None, deadline: Deadline
    ) -> dict[str, ParameterDescriptor]:
        """Return descriptors by name."""
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
        """Call `callback` with the node's events on ``/parameter_events``."""

        def receive(message: Message) -> None:
            if message.node == self.node:
                callback(event_from_message(message))

        return self._subscribe(EVENTS, EVENT_TYPE, receive, EVENTS_QOS, executor)

    def load(self, path: str | PathLike[str], deadline: Deadline) -> list[str]:
        """Set the parameters that a file contains for the node, including wildcards."""
        given = parameter_files.read(path).for_node(self.node)
        values = {name: value for name, value in given.items() if value is not None}
        if not values:
            raise ParameterError(f"{path} has no parameters for {self.node}")
        results = self.set(values, deadline)
        refused = [name for name, result in results.items() if not result.successful]
        if refused:
            # Saved files also contain read-only parameters.
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
        parameter_files.write(path, {self.node: self.values(None, deadline)})

    def _ask(
        self, service: str, field: str, names: list[str] | None, deadline: Deadline
    ) -> dict[str, Message | None]:
        """Return a service's response for each name; None for undeclared parameters."""
        wanted = self.find([], 0, deadline) if names is None else [check_name(n) for n in names]
        if not wanted:
            return {}
        found = self._call(service, {"names": wanted}, deadline)[field]
        if len(found) == len(wanted):
            return dict(zip(wanted, found, strict=True))
        # rclcpp's nodes send an empty response if one of the parameters is not declared.
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
        """Return the types of parameters to be set to empty lists."""
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


def value_from_message(message: Message, label: str = "") -> TypedValue:
    """Return the value of a received ``ParameterValue``.

    Args:
        message: The message.
        label: The parameter, for messages.

    Raises:
        ParameterError: Its type is unknown in ROS.
    """
    parameter_type = _type(message["type"], label)
    if parameter_type is ParameterType.NOT_SET:
        return NOT_SET
    value = getattr(message, _FIELDS[parameter_type])
    if parameter_type is ParameterType.BYTE_ARRAY:
        return TypedValue(parameter_type, bytes(value))
    if parameter_type in _ARRAY_TYPES:
        plain = value.tolist() if hasattr(value, "tolist") else list(value)
        return TypedValue(parameter_type, plain)
    return TypedValue(parameter_type, value)


def _type(number: int, label: str) -> ParameterType:
    try:
        return ParameterType(number)
    except ValueError:
        raise ParameterError(
            f"{label or 'a parameter'} has the type {number!r}, which ROS 2 does not know "
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
        integer = descriptor.type is ParameterType.INTEGER
        number, field = (int, "integer_range") if integer else (float, "floating_point_range")
        limits = {"from_value": number(low), "to_value": number(high), "step": number(step)}
        fields[field] = [limits]
    return fields


def descriptor_from_message(message: Message, label: str = "") -> ParameterDescriptor:
    """Return a received ``ParameterDescriptor``; raises ParameterError."""
    limits = [*message.integer_range, *message.floating_point_range]
    allowed = Range(limits[0].from_value, limits[0].to_value, limits[0].step) if limits else None
    return ParameterDescriptor(
        message.name,
        _type(message["type"], label or message.name),
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
