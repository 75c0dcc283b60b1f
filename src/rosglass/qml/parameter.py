"""The element ``Parameter``: a setting of a node, to show and to change."""
# ruff: noqa: N815 - the names of slots and signals are QML's

from __future__ import annotations

import logging
from typing import TYPE_CHECKING, Any

from rosglass.errors import ConversionError, Error
from rosglass.qml.element import Element
from rosglass.qml.log import log_from_qml
from rosglass.qml.plain import plain_from_js
from rosglass.qml.to_js import exact
from rosglass.qt import Property, QJSValue, Signal, Slot, is_alive

if TYPE_CHECKING:
    from rosglass.comm.node import Node
    from rosglass.comm.parameters import ParameterDescriptor
    from rosglass.qml.parameter_link import ParameterLink, Reading
    from rosglass.qml.runtime import Runtime
    from rosglass.qt import QtCore

__all__ = ["Parameter"]


class Parameter(Element):
    """One parameter of a node. See its page in ``docs/elements``."""

    nodeNameChanged = Signal()
    nameChanged = Signal()
    valueChanged = Signal()
    readyChanged = Signal()
    pendingChanged = Signal()
    descriptionChanged = Signal()
    problemChanged = Signal()
    #: The node refused a value; says why.
    rejected = Signal(str, arguments=["reason"])

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        super().__init__(parent, runtime)
        self._node_name, self._name = "", ""
        self._value: Any = None
        self._descriptor: ParameterDescriptor | None = None
        self._ready, self._writes = False, 0
        #: Why the node gives no value.
        self._missing = ""
        self._link: ParameterLink | None = None
        self._have: tuple[Node, str, str] | None = None

    # Properties.

    def _set_node(self, name: str) -> None:
        if name != self._node_name:
            self._node_name = name
            self.nodeNameChanged.emit()
            self._schedule()

    def _set_name(self, name: str) -> None:
        if name != self._name:
            self._name = name
            self.nameChanged.emit()
            self._schedule()

    def _get_value(self) -> QJSValue:
        runtime = self._find_runtime()
        return QJSValue() if runtime is None else runtime.value(_shown(self._value))

    def _set_value(self, value: QJSValue) -> None:
        runtime, link = self._find_runtime(), self._link
        if link is None or self._have is None:
            self._refuse(f"Parameter {self._name!r}: nothing was set: {self._reason()}")
            return
        try:
            wanted = plain_from_js(value)
        except ConversionError as error:
            self._refuse(f"Parameter {self._name!r}: {error}")
            return
        place = runtime.caller() if runtime is not None else None
        have = self._have
        self._writes += 1
        self.pendingChanged.emit()

        def done(reason: str | Error) -> None:
            if not is_alive(self) or have is not self._have:
                return
            self._writes -= 1
            self.pendingChanged.emit()
            if reason:
                text = f"Parameter {self._name!r} of {have[1]}: {reason}"
                if place is not None:
                    log_from_qml("", logging.WARNING, text, place)
                self.rejected.emit(str(reason))
                # Whoever showed the wish already has to show the truth again.
                self.valueChanged.emit()
            elif link is self._link:
                self._set_shown(wanted)
                # The node may have made something else of it.
                link.read_soon()

        link.write(have[2], wanted, done)

    def _reason(self) -> str:
        return self._problem or "there is no node yet"

    def _describe(self) -> str:
        return self._descriptor.description if self._descriptor is not None else ""

    def _type(self) -> str:
        return self._descriptor.type.name.lower() if self._descriptor is not None else ""

    def _is_read_only(self) -> bool:
        return self._descriptor is not None and self._descriptor.read_only

    def _bound(self, end: str) -> QJSValue:
        allowed = self._descriptor.range if self._descriptor is not None else None
        runtime = self._find_runtime()
        if allowed is None or runtime is None:
            return QJSValue()
        return runtime.value(getattr(allowed, end))

    nodeName = Property(str, lambda self: self._node_name, _set_node, notify=nodeNameChanged)
    name = Property(str, lambda self: self._name, _set_name, notify=nameChanged)
    value = Property(QJSValue, _get_value, _set_value, notify=valueChanged)
    ready = Property(bool, lambda self: self._ready, notify=readyChanged)
    pending = Property(bool, lambda self: self._writes > 0, notify=pendingChanged)
    type = Property(str, _type, notify=descriptionChanged)
    description = Property(str, _describe, notify=descriptionChanged)
    readOnly = Property(bool, _is_read_only, notify=descriptionChanged)
    minimum = Property(QJSValue, lambda self: self._bound("low"), notify=descriptionChanged)
    maximum = Property(QJSValue, lambda self: self._bound("high"), notify=descriptionChanged)
    stepSize = Property(QJSValue, lambda self: self._bound("step"), notify=descriptionChanged)
    problem = Property(str, lambda self: self._problem, notify=problemChanged)

    # Following the node.

    def _update(self) -> None:
        node = self.node
        want: tuple[Node, str, str] | None = None
        if node is not None and self._name and self._node_name:
            try:
                want = (node, node.resolve(self._node_name), self._name)
            except Error as error:
                self._say(f"Parameter {self._name!r}: {error}")
        if want == self._have:
            return
        self._leave()
        self._have = want
        if want is None or self._session is None:
            return
        from rosglass.qml.parameter_link import ParameterLink as Link  # noqa: PLC0415 - few need it

        link = self._link = Link.join(
            self._session, want[0], want[1], self, self._name, self._on_reading
        )
        self._at_end["link"] = lambda: link.leave(self)
        self._on_tick()

    def _leave(self) -> None:
        link, self._link = self._link, None
        self._at_end.pop("link", None)
        if link is not None:
            link.leave(self)
        self._missing = ""
        self._set_ready(False)
        if self._writes:
            # Their replies will never arrive.
            self._writes = 0
            self.pendingChanged.emit()
        self._set_shown(None)

    @Slot()
    def _on_graph(self) -> None:
        if self._link is not None:
            self._link.on_graph()

    @Slot()
    def _on_tick(self) -> None:
        link = self._link
        if link is None:
            return
        link.on_tick()
        self._say(link.problem or self._missing)
        if link.problem or not link.ready:
            self._set_ready(False)

    def _set_ready(self, ready: bool) -> None:
        if ready != self._ready:
            self._ready = ready
            self.readyChanged.emit()

    def _on_reading(self, reading: Reading) -> None:
        link = self._link
        if not is_alive(self) or link is None:
            return
        self._missing = reading.problem and f"Parameter {self._name!r}: {reading.problem}"
        self._say(link.problem or self._missing)
        described = reading.descriptor != self._descriptor
        if described:
            # The range comes before the value: a slider would clamp it to the old one.
            self._descriptor = reading.descriptor
            self.descriptionChanged.emit()
        self._set_shown(reading.value, again=described)
        # Handlers may have changed which parameter this is.
        if is_alive(self) and link is self._link:
            self._set_ready(reading.value is not None and link.ready)

    def _set_shown(self, value: Any, again: bool = False) -> None:
        """Show a value; announce it even if it is the same `again`."""
        if is_alive(self) and (
            again or value != self._value or type(value) is not type(self._value)
        ):
            self._value = value
            self.valueChanged.emit()

    def _problem_changed(self) -> None:
        self.problemChanged.emit()


def _shown(value: Any) -> Any:
    """Return a parameter's value as JavaScript can hold it."""
    if type(value) is int:
        return exact(value)
    if isinstance(value, dict):
        return {str(key): _shown(inner) for key, inner in value.items()}
    if isinstance(value, (list, tuple, bytes, bytearray)):
        return [_shown(inner) for inner in value]
    if value is None or isinstance(value, (bool, float, str)):
        return value
    return str(value)
