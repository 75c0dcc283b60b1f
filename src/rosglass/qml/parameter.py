"""The element ``Parameter``: a setting of a node, to show and to change."""
# ruff: noqa: N815 - the names of slots and signals are QML's

from __future__ import annotations

import logging
from typing import TYPE_CHECKING, Any

from rosglass.errors import ConversionError, Error
from rosglass.qml.element import Element
from rosglass.qml.log import log_from_qml
from rosglass.qml.plain import plain_from_js
from rosglass.qml.properties import ReadOnly, Writable, report
from rosglass.qml.to_js import exact
from rosglass.qt import QJSValue, Signal, Slot, is_alive

if TYPE_CHECKING:
    from rosglass.comm.node import Node
    from rosglass.comm.parameters import ParameterDescriptor
    from rosglass.qml.parameter_link import ParameterLink, Reading
    from rosglass.qml.runtime import Runtime
    from rosglass.qml.session import Session
    from rosglass.qt import QtCore

__all__ = ["Parameter"]


class Parameter(Element):
    """One parameter of a node. See its page in ``docs/elements``."""

    #: The node refused a value, for this reason.
    rejected = Signal(str, arguments=["reason"])
    valueChanged = Signal()
    descriptionChanged = Signal()

    nodeName = Writable(str, "")
    name = Writable(str, "")
    value = Writable(
        QJSValue,
        read="_get_value",
        write="_set_value",
    )
    ready = ReadOnly(bool, False)
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

    _endpoint: ParameterLink | None

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        super().__init__(parent, runtime)
        self._shown: Any = None
        self._descriptor: ParameterDescriptor | None = None
        #: Requested changes without an answer.
        self._writes = 0
        #: Why the node gives no value.
        self._missing = ""

    @property
    def label(self) -> str:
        """What error messages call this element."""
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
                # Controls that show the requested value already return to the present one.
                self.valueChanged.emit()
            elif link is self._endpoint:
                self._show(wanted)
                # The node may have changed it to something else.
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

    # Following the node.

    def _wanted(self) -> tuple[Node, str, str] | None:
        node = self.node
        if node is not None and self.name and self.nodeName:
            try:
                return node, node.resolve(self.nodeName), self.name
            except Error as error:
                self._set_problem(f"{self.label}: {error}")
        return None

    def _create_endpoint(self, wanted: tuple[Any, ...]) -> None:
        from rosglass.qml.parameter_link import ParameterLink as Link  # noqa: PLC0415 - few need it

        session = self._session
        assert session is not None
        node, node_name, name = wanted
        self._set_endpoint(Link.join(session, node, node_name, self, name, self._on_reading))

    def _dispose(self, session: Session, endpoint: ParameterLink) -> None:  # noqa: ARG002
        endpoint.leave(self)

    def _on_created(self, endpoint: ParameterLink) -> None:  # noqa: ARG002 - the base's signature
        self._on_tick()

    def _on_closed(self, endpoint: ParameterLink | None) -> None:  # noqa: ARG002 - as above
        self._missing = ""
        # Replies to pending writes will never arrive.
        self._writes = 0
        report(self, ready=False, pending=False)
        self._show(None)

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

    def _on_reading(self, reading: Reading) -> None:
        link = self._endpoint
        if not is_alive(self) or link is None:
            return
        self._missing = reading.problem and f"{self.label}: {reading.problem}"
        self._set_problem(link.problem or self._missing)
        described = reading.descriptor != self._descriptor
        if described:
            # The range comes before the value: a slider would clamp it to the old one.
            self._descriptor = reading.descriptor
            self.descriptionChanged.emit()
        self._show(reading.value, again=described)
        # Handlers may have changed which parameter this is.
        if is_alive(self) and link is self._endpoint:
            report(self, ready=reading.value is not None and link.ready)

    def _show(self, value: Any, again: bool = False) -> None:
        """Show a value; announce it even if it is the same `again`."""
        same = value == self._shown and type(value) is type(self._shown)
        if is_alive(self) and (again or not same):
            self._shown = value
            self.valueChanged.emit()


def _to_js(value: Any) -> Any:
    """Return a parameter's value as JavaScript can hold it."""
    if type(value) is int:
        return exact(value)
    if isinstance(value, dict):
        return {str(key): _to_js(inner) for key, inner in value.items()}
    if isinstance(value, (list, tuple, bytes, bytearray)):
        return [_to_js(inner) for inner in value]
    if value is None or isinstance(value, (bool, float, str)):
        return value
    return str(value)
