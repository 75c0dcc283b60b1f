"""The element ``Parameter``: shows and changes a parameter of a node."""
# ruff: noqa: N815 - the names of slots and signals are QML's

from __future__ import annotations

import logging
import time
from typing import TYPE_CHECKING, Any, NamedTuple

from rosglass.comm.executor import Dispatcher
from rosglass.comm.names import similar
from rosglass.comm.parameters import ParameterDescriptor, ParameterType
from rosglass.errors import ConversionError, Error, ParameterError
from rosglass.qml.elements.element import Element
from rosglass.qml.engine.from_js import plain_from_js
from rosglass.qml.engine.log import log_from_qml
from rosglass.qml.engine.properties import ReadOnly, Writable, report
from rosglass.qml.engine.session import result_of
from rosglass.qml.engine.to_js import exact
from rosglass.qt import QJSValue, Signal, Slot, is_alive

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from rosglass.comm.handle import Handle
    from rosglass.comm.node import Node
    from rosglass.comm.parameters import ParameterClient, ParameterEvent
    from rosglass.qml.engine.runtime import Runtime
    from rosglass.qml.engine.session import Session
    from rosglass.qt import QtCore


__all__ = ["Parameter", "ParameterElement", "ParameterLink", "Reading", "as_type"]

_log = logging.getLogger("rosglass.qml")
#: Seconds that a node has to answer.
_ANSWER_TIMEOUT_S = 5.0
#: Seconds between two readings. A change that the node makes before our subscription is matched
#: is lost, so values are read again: often while nodes come and go, then less often.
_QUICK_READ_S, _READ_S = 1.0, 5.0
#: Seconds after a change of the graph during which values are read often.
_UNSETTLED_S = 10.0
#: Seconds until a node that is not found is reported as missing.
_DISCOVERY_S = 3.0
#: Parameters of a node that are read at once at most.
_MOST = 2000


class Reading(NamedTuple):
    """A node's reply about a parameter.

    Attributes:
        value: Its value, or None.
        descriptor: Its descriptor; None if it is not declared.
        problem: Why there is no value; empty if there is one.
    """

    value: Any
    descriptor: ParameterDescriptor | None
    problem: str = ""


class ParameterLink:
    """Reads the parameters of one node for elements, on its own thread.

    Values and descriptors are read together, so that a range is set before its value; in between,
    changes that the node announces are passed on. Created by :meth:`join`, closed when the last
    listener has left; on the GUI thread only.
    """

    def __init__(self, session: Session, node: Node, name: str) -> None:
        self._session, self._node, self._name = session, node, name
        self._listeners: dict[Any, tuple[str, Callable[[Reading], None]]] = {}
        #: Listeners to all parameters.
        self._watchers: dict[Any, Callable[[dict[str, Reading], bool], None]] = {}
        self._worker = Dispatcher(f"rosglass-qml parameters of {name}")
        self._client: ParameterClient | None = None
        self._watch: Handle | None = None
        self._closed = False
        now = time.monotonic()
        self._missing_since, self._unsettled_until = now, now + _UNSETTLED_S
        #: When to read next; whether a reading is pending, and what has changed since its request.
        self._read_at, self._reading = 0.0, False
        self._changed_since: dict[str, Any] = {}
        self._known: dict[str, Reading] = {}
        self._was_ready = False
        self._failure = ""
        #: Why the node cannot be queried; empty if it can.
        self.problem = ""
        self._worker.post(self._open)

    @classmethod
    def join(
        cls,
        session: Session,
        node: Node,
        name: str,
        listener: Any,
        parameter: str,
        on_reading: Callable[[Reading], None],
    ) -> ParameterLink:
        """Return the link to a node, after adding a parameter and its listener.

        Args:
            session: The session.
            node: Its node.
            name: Full name of the other node.
            listener: The key for :meth:`leave`.
            parameter: Name of the parameter.
            on_reading: Called on the GUI thread with every reading, changed or not.
        """
        made = cls._shared(session, node, name)
        made._listeners[listener] = (parameter, on_reading)
        return made

    @classmethod
    def join_all(
        cls,
        session: Session,
        node: Node,
        name: str,
        listener: Any,
        on_readings: Callable[[dict[str, Reading], bool], None],
    ) -> ParameterLink:
        """Return the link to a node, after adding a listener to all its parameters.

        Args:
            session: The session.
            node: Its node.
            name: Full name of the other node.
            listener: The key for :meth:`leave`.
            on_readings: Called on the GUI thread with readings by name, and whether these are all.
        """
        made = cls._shared(session, node, name)
        made._watchers[listener] = on_readings
        return made

    @classmethod
    def _shared(cls, session: Session, node: Node, name: str) -> ParameterLink:
        key = (cls, node, name)
        link = session.shared.get(key)
        if link is None:
            link = session.shared[key] = cls(session, node, name)
        made: ParameterLink = link
        made._read_at = 0.0
        return made

    def leave(self, listener: Any) -> None:
        """Stop calling a listener."""
        self._listeners.pop(listener, None)
        self._watchers.pop(listener, None)
        if not self._listeners and not self._watchers:
            self.close()

    def close(self) -> None:
        """Close the link; safe to call twice."""
        if self._closed:
            return
        self._closed = True
        self._session.shared.pop((type(self), self._node, self._name), None)
        # The GUI thread must not wait for a pending request.
        self._session.background(self._shut)

    @property
    def ready(self) -> bool:
        """True while the node exists and serves its parameters."""
        client = self._client
        try:
            return client is not None and client.ready
        except Error:
            return False

    def on_graph(self) -> None:
        """Read often for a while: the node may have been restarted."""
        self._unsettled_until = time.monotonic() + _UNSETTLED_S
        self._read_at = min(self._read_at, time.monotonic() + _QUICK_READ_S)

    def on_tick(self) -> None:
        """Read the parameters when due; find out why the node does not answer."""
        now, ready = time.monotonic(), self.ready
        if ready != self._was_ready:
            self._was_ready, self._missing_since = ready, now
            self._read_at, self._unsettled_until = now, now + _UNSETTLED_S
            self.problem = ""
        if ready:
            if not self._reading and now >= self._read_at:
                self._read()
        elif self._failure:
            self.problem = self._failure
        elif now - self._missing_since > _DISCOVERY_S:
            self.problem = self._why_missing()

    def read_soon(self) -> None:
        """Read at the next tick."""
        self._read_at = 0.0

    def write(self, name: str, value: Any, done: Callable[[str | Error], None]) -> None:
        """Set a parameter; call `done` with an Error, the reason of a refusal, or an empty text."""

        def work(client: ParameterClient) -> str:
            wanted = client.describe([name], timeout=_ANSWER_TIMEOUT_S)[name].type
            result = client.set({name: as_type(value, wanted)}, timeout=_ANSWER_TIMEOUT_S)[name]
            return "" if result.successful else result.reason or "refused without a reason"

        self._ask(work, done)

    def _read(self) -> None:
        asked = {name for name, _ in self._listeners.values()}
        whole = bool(self._watchers)
        self._reading, self._changed_since = True, {}
        now = time.monotonic()
        self._read_at = now + (_QUICK_READ_S if now < self._unsettled_until else _READ_S)

        def work(client: ParameterClient) -> dict[str, Reading]:
            declared = client.names(timeout=_ANSWER_TIMEOUT_S)[:_MOST] if whole else []
            names = sorted(asked.union(declared))
            return self._read_each(client, names) if names else {}

        def done(result: dict[str, Reading] | Error) -> None:
            self._reading = False
            if isinstance(result, Error):
                self.problem = str(result)
                return
            self.problem = ""
            for name, value in self._changed_since.items():
                reading = result.get(name)
                if reading is not None and reading.value is not None and value is not None:
                    result[name] = reading._replace(value=value)
            self._known = result
            self._notify(result, whole)

        self._ask(work, done)

    def _read_each(self, client: ParameterClient, names: Sequence[str]) -> dict[str, Reading]:
        try:
            return self._readings(client, names)
        except ParameterError as error:
            if len(names) == 1:
                return {names[0]: Reading(None, None, str(error))}
        # One invalid name must not prevent reading the others.
        return {n: r for name in names for n, r in self._read_each(client, [name]).items()}

    def _readings(self, client: ParameterClient, names: Sequence[str]) -> dict[str, Reading]:
        """Request values and descriptors; raises Error."""
        values = client.get(names, timeout=_ANSWER_TIMEOUT_S)
        described = client.describe(names, timeout=_ANSWER_TIMEOUT_S)
        found = {name: Reading(values[name], described[name]) for name in names}
        missing = [name for name in names if values[name] is None]
        if missing:
            declared = client.names(timeout=_ANSWER_TIMEOUT_S)
            for name in missing:
                if name in declared:
                    found[name] = Reading(None, described[name], f"{name!r} has no value yet")
                else:
                    found[name] = Reading(None, None, self._why_undeclared(name, declared))
        return found

    def _why_undeclared(self, name: str, declared: list[str]) -> str:
        """Return the error text for a parameter that the node does not have."""
        hint = similar(name, declared)
        if not declared:
            hint = similar(self._name, (str(node) for node in self._node.nodes()))
        return f"{self._name} has no parameter {name!r}{hint}"

    def _why_missing(self) -> str:
        """Return the error text for a node that does not serve parameters."""
        try:
            names = [str(node) for node in self._node.nodes()]
        except Error as error:
            return str(error)
        if self._name in names:
            return f"{self._name} is there, but does not serve parameters"
        return f"there is no node {self._name}{similar(self._name, names)}"

    def _ask(self, work: Callable[[ParameterClient], Any], done: Callable[[Any], None]) -> None:
        def ask() -> Any:
            if self._client is None:
                raise ParameterError(f"the parameters of {self._name}: {self._failure}")
            return work(self._client)

        def run() -> None:
            result = result_of(ask, "asking for parameters")
            self._session.executor.post(lambda: None if self._closed else done(result))

        self._worker.post(run)

    def _open(self) -> None:
        try:
            self._client = self._node.create_parameter_client(self._name)
            self._watch = self._client.watch(self._on_event, self._session.executor)
        except Error as error:
            self._failure = str(error)
            _log.warning("the parameters of %s: %s", self._name, error)

    def _shut(self) -> None:
        self._worker.close()
        for part in (self._watch, self._client):
            if part is not None:
                part.close()

    def _on_event(self, event: ParameterEvent) -> None:
        changes = {**event.new, **event.changed, **dict.fromkeys(event.deleted)}
        self._changed_since |= changes
        known = {}
        for name, value in changes.items():
            reading = self._known.get(name)
            if name in event.changed and value is not None and reading and reading.descriptor:
                known[name] = self._known[name] = reading._replace(value=value, problem="")
            elif self._watchers or any(name == shown for shown, _ in self._listeners.values()):
                # Declared or undeclared: the descriptor has changed, too.
                self.read_soon()
        self._notify(known)

    def _notify(self, readings: dict[str, Reading], whole: bool = False) -> None:
        for name, on_reading in list(self._listeners.values()):
            if name in readings:
                on_reading(readings[name])
        for on_readings in list(self._watchers.values()):
            if readings or whole:
                on_readings(readings, whole)


def as_type(value: Any, wanted: ParameterType) -> Any:
    """Convert a JavaScript number, which has no integer type, to the parameter's type."""
    if wanted is ParameterType.DOUBLE and type(value) is int:
        return float(value)
    if wanted is ParameterType.DOUBLE_ARRAY and isinstance(value, list):
        return [float(one) if type(one) is int else one for one in value]
    return value


class ParameterElement(Element):
    """Base of elements for the parameters of a node."""

    nodeName = Writable(str, "")
    #: Whether the node is available, and what is shown of it is known.
    ready = ReadOnly(bool, False)

    _endpoint: ParameterLink | None
    #: Why the node returns no value.
    _missing = ""

    def _dispose(self, session: Session, endpoint: ParameterLink) -> None:  # noqa: ARG002
        endpoint.leave(self)

    def _on_created(self, endpoint: ParameterLink) -> None:  # noqa: ARG002 - the base's signature
        self._on_tick()

    @Slot()
    def _on_graph(self) -> None:
        if self._endpoint is not None:
            self._endpoint.on_graph()

    @Slot()
    def _on_tick(self) -> None:
        link = self._endpoint
        if link is None:
            return
        link.on_tick()
        self._set_problem(link.problem or self._missing)
        if link.problem or not link.ready:
            report(self, ready=False)


class Parameter(ParameterElement):
    """One parameter of a node. See its page in ``docs/elements``."""

    #: The node rejected a value, for this reason.
    rejected = Signal(str, arguments=["reason"])
    valueChanged = Signal()
    descriptionChanged = Signal()

    name = Writable(str, "")
    value = Writable(
        QJSValue,
        read="_get_value",
        write="_set_value",
    )
    pending = ReadOnly(bool, False)
    type = ReadOnly(str, read="_get_type", notify="descriptionChanged")
    description = ReadOnly(
        str,
        read=lambda self: self._descriptor.description if self._descriptor is not None else "",
        notify="descriptionChanged",
    )
    readOnly = ReadOnly(
        bool,
        read=lambda self: self._descriptor is not None and self._descriptor.read_only,
        notify="descriptionChanged",
    )
    minimum = ReadOnly(
        QJSValue, read=lambda self: self._get_bound("low"), notify="descriptionChanged"
    )
    maximum = ReadOnly(
        QJSValue, read=lambda self: self._get_bound("high"), notify="descriptionChanged"
    )
    stepSize = ReadOnly(
        QJSValue, read=lambda self: self._get_bound("step"), notify="descriptionChanged"
    )

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        super().__init__(parent, runtime)
        self._shown: Any = None
        self._descriptor: ParameterDescriptor | None = None
        #: Number of requested changes without a reply.
        self._writes = 0

    @property
    def label(self) -> str:
        """The element's name in error messages."""
        return f"Parameter {self.name!r}"

    def _get_value(self) -> QJSValue:
        runtime = self._find_runtime()
        return QJSValue() if runtime is None else runtime.value(_to_js(self._shown))

    def _set_value(self, value: QJSValue) -> None:
        runtime, link, config = self._find_runtime(), self._endpoint, self._config
        if link is None or config is None:
            self._refuse(
                f"{self.label}: nothing was set: {self._problem or 'there is no node yet'}"
            )
            return
        try:
            wanted = plain_from_js(value)
        except ConversionError as error:
            self._refuse(f"{self.label}: {error}")
            return
        caller = runtime.caller() if runtime is not None else None
        self._writes += 1
        report(self, pending=True)

        def done(reason: str | Error) -> None:
            if not is_alive(self) or config is not self._config:
                return
            self._writes -= 1
            report(self, pending=self._writes > 0)
            if reason:
                text = f"{self.label} of {config[1]}: {reason}"
                if caller is not None:
                    log_from_qml("", logging.WARNING, text, caller)
                self.rejected.emit(str(reason))
                # Reset controls that already show the requested value.
                self.valueChanged.emit()
            elif link is self._endpoint:
                self._show(wanted)
                # The node may have set a different value.
                link.read_soon()

        link.write(config[2], wanted, done)

    def _get_type(self) -> str:
        return self._descriptor.type.name.lower() if self._descriptor is not None else ""

    def _get_bound(self, end: str) -> QJSValue:
        allowed = self._descriptor.range if self._descriptor is not None else None
        runtime = self._find_runtime()
        if allowed is None or runtime is None:
            return QJSValue()
        return runtime.value(getattr(allowed, end))

    # Updates from the node.

    def _wanted(self) -> tuple[Node, str, str] | None:
        node = self.node
        if node is not None and self.name and self.nodeName:
            try:
                return node, node.resolve(self.nodeName), self.name
            except Error as error:
                self._set_problem(f"{self.label}: {error}")
        return None

    def _create_endpoint(self, wanted: tuple[Any, ...]) -> None:

        session = self._session
        assert session is not None
        node, node_name, name = wanted
        self._set_endpoint(
            ParameterLink.join(session, node, node_name, self, name, self._on_reading)
        )

    def _on_closed(self, endpoint: ParameterLink | None) -> None:  # noqa: ARG002 - as above
        self._missing = ""
        # Replies to pending writes will never arrive.
        self._writes = 0
        report(self, ready=False, pending=False)
        self._show(None)

    def _on_reading(self, reading: Reading) -> None:
        link = self._endpoint
        if not is_alive(self) or link is None:
            return
        self._missing = reading.problem and f"{self.label}: {reading.problem}"
        self._set_problem(link.problem or self._missing)
        described = reading.descriptor != self._descriptor
        if described:
            # Set the range before the value: a slider would clamp the value to the old range.
            self._descriptor = reading.descriptor
            self.descriptionChanged.emit()
        self._show(reading.value, again=described)
        # Handlers may have changed the parameter's name.
        if is_alive(self) and link is self._endpoint:
            report(self, ready=reading.value is not None and link.ready)

    def _show(self, value: Any, again: bool = False) -> None:
        """Show a value; with `again`, emit the signal even if it has not changed."""
        same = value == self._shown and type(value) is type(self._shown)
        if is_alive(self) and (again or not same):
            self._shown = value
            self.valueChanged.emit()


def _to_js(value: Any) -> Any:
    """Convert a parameter's value to a form that JavaScript supports."""
    if type(value) is int:
        return exact(value)
    if isinstance(value, dict):
        return {str(key): _to_js(inner) for key, inner in value.items()}
    if isinstance(value, (list, tuple, bytes, bytearray)):
        return [_to_js(inner) for inner in value]
    if value is None or isinstance(value, (bool, float, str)):
        return value
    return str(value)
