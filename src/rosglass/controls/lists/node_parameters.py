"""The element ``NodeParameters``: all parameters of a node, as rows to show and to change."""
# ruff: noqa: N802, N815 - the names of slots and signals are QML's

from __future__ import annotations

import json
import math
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from rosglass.comm.parameters import ParameterDescriptor, ParameterType
from rosglass.controls.lists.row_model import RowModel
from rosglass.errors import ConversionError, Error
from rosglass.qml.elements.parameter import ParameterElement, ParameterLink, as_type
from rosglass.qml.engine.from_js import plain_from_js
from rosglass.qml.engine.properties import ReadOnly, Writable, report
from rosglass.qml.engine.to_js import exact
from rosglass.qt import Property, QJSValue, QtCore, Signal, Slot, is_alive

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.comm.node import Node
    from rosglass.qml.elements.parameter import Reading
    from rosglass.qml.engine.runtime import Runtime

__all__ = ["NodeParameters"]

#: Seconds for which a change by another client is marked.
_MARK_S = 5.0
#: Characters of a value or reason that are shown.
_LONGEST = 2000
_MAX_UNDO = 100
_ARRAYS = {
    ParameterType.BYTE_ARRAY,
    ParameterType.BOOL_ARRAY,
    ParameterType.INTEGER_ARRAY,
    ParameterType.DOUBLE_ARRAY,
    ParameterType.STRING_ARRAY,
}
_TRUE, _FALSE = {"true", "yes", "on", "1"}, {"false", "no", "off", "0"}
#: Constraints of a descriptor that list the values: ``one of: a, b``, ``{a, b}`` or ``[a, b]``.
_CHOICES = re.compile(
    r"(?:.*\b(?:one of|choices|options)\b[:\s]*)?[\[{]([^\[\]{}]+)[\]}]\.?\s*$"
    r"|.*\bone of\b[:\s]+([^\[\]{}]+?)\.?\s*$",
    re.I,
)


@dataclass
class _Row:
    """A parameter as it is shown.

    Attributes:
        name: Its name.
        value: Its value; None if it is not set.
        descriptor: Its descriptor.
        problem: Why a value was refused, or cannot be read.
        first: The value when it was first shown.
        pending: Number of changes without a reply.
        is_marked: Whether it is marked as changed by another client.
    """

    name: str
    value: Any
    descriptor: ParameterDescriptor
    problem: str = ""
    first: Any = None
    pending: int = 0
    is_marked: bool = False

    @property
    def text(self) -> str:
        """The value in the form in which it is edited."""
        value = self.value
        if value is None:
            return ""
        if isinstance(value, str):
            return value[:_LONGEST]
        if isinstance(value, (bytes, bytearray)):
            value = list(value)
        if isinstance(value, float):
            return repr(value)
        return json.dumps(value, default=str)[:_LONGEST]

    @property
    def is_cut(self) -> bool:
        """True if :attr:`text` does not hold the whole value, which must not be edited then."""
        return len(self.text) >= _LONGEST

    @property
    def choices(self) -> list[str]:
        """The texts that the descriptor's constraints list; empty for any."""
        if self.descriptor.type not in (ParameterType.STRING, ParameterType.INTEGER):
            return []
        found = _CHOICES.match(self.descriptor.constraints[:_LONGEST])
        if found is None:
            return []
        return [part.strip().strip("'\"") for part in (found[1] or found[2]).split(",")]


def _bound(row: _Row, end: str) -> float:
    allowed = row.descriptor.range
    value = math.nan if allowed is None else float(getattr(allowed, end))
    return value if math.isfinite(value) else math.nan


def _shown(value: Any) -> Any:
    """Return a scalar as JavaScript reads it, other values as text."""
    if isinstance(value, bool):
        return value
    if isinstance(value, int):
        return float(value) if isinstance(exact(value), int) else str(value)
    return value if isinstance(value, (float, str)) else None


#: Names of the roles -> what they return of a row.
_ROLES: dict[str, Callable[[_Row], Any]] = {
    "name": lambda row: row.name,
    "group": lambda row: re.split(r"[./]", row.name)[0] if re.search(r"[./]", row.name) else "",
    "type": lambda row: row.descriptor.type.name.lower(),
    "value": lambda row: _shown(row.value),
    "text": lambda row: row.text,
    "description": lambda row: row.descriptor.description[:_LONGEST],
    "constraints": lambda row: row.descriptor.constraints[:_LONGEST],
    "readOnly": lambda row: row.descriptor.read_only or row.is_cut,
    "minimum": lambda row: _bound(row, "low"),
    "maximum": lambda row: _bound(row, "high"),
    "stepSize": lambda row: _bound(row, "step"),
    "choices": lambda row: row.choices,
    "pending": lambda row: row.pending > 0,
    "problem": lambda row: row.problem[:_LONGEST],
    "changed": lambda row: row.value != row.first,
    "external": lambda row: row.is_marked,
}


class NodeParameters(ParameterElement):
    """All parameters of a node. See its page in ``docs/controls``."""

    #: The node refused a value of a parameter, for this reason.
    rejected = Signal(str, str, arguments=["name", "reason"])

    #: Part of a name; only parameters whose names contain it are rows.
    filter = Writable(str, "", then="_show_rows")
    #: Number of parameters, and of the rows.
    total = ReadOnly(int, 0)
    count = ReadOnly(int, 0)
    #: The change that :meth:`undo` reverts, in words; empty without one.
    undoText = ReadOnly(str, "")

    _HOLDS = ("_known", "_history")

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        super().__init__(parent, runtime)
        self._known: dict[str, _Row] = {}
        #: Changes to undo: name, value before, value after.
        self._history: list[tuple[str, Any, Any]] = []
        self._rows = RowModel(self, list(_ROLES), lambda row, role: _ROLES[role](row))
        #: When the marks of parameters that other clients changed end.
        self._marked: dict[str, float] = {}

    rows = Property(QtCore.QObject, lambda self: self._rows, constant=True)

    @property
    def label(self) -> str:
        """The element's name in error messages."""
        return f"the parameters of {self.nodeName or 'a node'}"

    # Changing.

    @Slot(str, QJSValue)
    def setValue(self, name: str, value: QJSValue) -> None:
        """Ask the node to set a parameter; `problem` of its row says why it was refused."""
        try:
            self._write(name, plain_from_js(value))
        except ConversionError as error:
            self._refuse_row(name, str(error))

    @Slot(str, str)
    def setText(self, name: str, text: str) -> None:
        """Ask the node to set a parameter to the value in a text, as an operator enters it."""
        row = self._known.get(name)
        try:
            self._write(name, text if row is None else _parse(text, row))
        except ValueError as error:
            self._refuse_row(name, str(error))

    @Slot()
    def undo(self) -> None:
        """Revert the last change, unless another client has changed the parameter since."""
        if not self._history:
            return
        name, before, after = self._history.pop()
        row = self._known.get(name)
        self._show_undo()
        if row is None or not _is_same(row.value, after):
            self._refuse_row(name, "not reverted: it was changed by another client since")
        elif before is None:
            self._refuse_row(name, "not reverted: it had no value before")
        else:
            self._write(name, before, is_undo=True)

    @Slot()
    def refresh(self) -> None:
        """Read all parameters again at once."""
        if self._endpoint is not None:
            self._endpoint.read_soon()

    def _write(self, name: str, value: Any, is_undo: bool = False) -> None:
        link, config, row = self._endpoint, self._config, self._known.get(name)
        if link is None or config is None or row is None or not self.ready:
            why = self._problem or (
                "there is no such parameter" if link else "there is no node yet"
            )
            self._refuse_row(name, f"not set: {why}")
            return
        before, value = row.value, as_type(value, row.descriptor.type)
        row.pending, row.problem = row.pending + 1, ""
        self._rows.changed(name)

        def done(reason: str | Error) -> None:
            if not is_alive(self) or config is not self._config:
                return
            row.pending -= 1
            if reason:
                self._refuse_row(name, str(reason))
                return
            if not is_undo and not _is_same(before, value):
                self._history = [*self._history, (name, before, value)][-_MAX_UNDO:]
            row.value, row.is_marked = value, False
            self._rows.changed(name)
            self._show_undo()
            # The node may have set a different value.
            link.read_soon()

        link.write(name, value, done)

    def _refuse_row(self, name: str, reason: str) -> None:
        row = self._known.get(name)
        if row is not None:
            row.problem = reason
            self._rows.changed(name)
        self.rejected.emit(name, reason)

    def _show_undo(self) -> None:
        text = ""
        if self._history:
            name, before, _ = self._history[-1]
            text = f"{name}: {before!r:.60}"
        report(self, undoText=text)

    # Updates from the node.

    def _wanted(self) -> tuple[Node, str] | None:
        node = self.node
        if node is not None and self.nodeName:
            try:
                whole = self.nodeName == "/" and node.wire == "ros1"
                return node, "/" if whole else node.resolve(self.nodeName)
            except Error as error:
                self._set_problem(f"{self.label}: {error}")
        return None

    def _create_endpoint(self, wanted: tuple[Any, ...]) -> None:
        session = self._session
        assert session is not None
        node, name = wanted
        self._set_problem("")
        self._set_endpoint(ParameterLink.join_all(session, node, name, self, self._on_readings))

    def _on_closed(self, endpoint: ParameterLink | None) -> None:  # noqa: ARG002 - as above
        self._known, self._history = {}, []
        self._marked.clear()
        report(self, ready=False)
        self._show_rows()
        self._show_undo()

    @Slot()
    def _on_tick(self) -> None:
        super()._on_tick()
        now = self._steady()
        ended = [name for name, until in self._marked.items() if now >= until]
        for name in ended:
            del self._marked[name]
            if name in self._known:
                self._known[name].is_marked = False
        if ended:
            self._rows.refresh()

    def _on_readings(self, readings: dict[str, Reading], whole: bool) -> None:
        link = self._endpoint
        if not is_alive(self) or link is None:
            return
        appeared = changed = False
        for name, reading in readings.items():
            descriptor = reading.descriptor
            if descriptor is None:
                continue
            row = self._known.get(name)
            if row is None:
                made = _Row(name, reading.value, descriptor, reading.problem, reading.value)
                self._known[name], appeared = made, True
                continue
            changed |= self._update_row(row, reading.value, descriptor)
        if whole:
            gone = {name for name in self._known if readings.get(name) is None}
            gone |= {name for name, found in readings.items() if found.descriptor is None}
            appeared |= bool(gone & self._known.keys())
            for name in gone:
                self._known.pop(name, None)
        if appeared:
            self._show_rows()
        if changed:
            self._rows.refresh()
        if whole and is_alive(self) and link is self._endpoint:
            report(self, ready=link.ready, total=len(self._known))

    def _update_row(self, row: _Row, value: Any, descriptor: ParameterDescriptor) -> bool:
        same = _is_same(row.value, value)
        if same and descriptor == row.descriptor:
            return False
        if not same and not row.pending:
            self._marked[row.name], row.is_marked = self._steady() + _MARK_S, True
        row.value, row.descriptor = value, descriptor
        return True

    def _show_rows(self) -> None:
        wanted = self.filter.lower()
        rows = {name: row for name, row in sorted(self._known.items()) if wanted in name.lower()}
        self._rows.show(rows)
        report(self, count=len(rows), total=len(self._known))


def _is_same(one: Any, other: Any) -> bool:
    return type(one) is type(other) and (one == other or (one != one and other != other))  # noqa: PLR0124 - NaN


def _parse(text: str, row: _Row) -> Any:
    """Return the value that a text stands for; raises ValueError in words."""
    kind, given = row.descriptor.type, text.strip()
    if kind is ParameterType.STRING:
        return text
    if kind is ParameterType.BOOL:
        if given.lower() not in _TRUE | _FALSE:
            raise ValueError(f"{given!r:.80} is not true or false")
        return given.lower() in _TRUE
    if kind is ParameterType.INTEGER:
        if not re.fullmatch(r"[+-]?\d{1,20}", given):
            raise ValueError(f"{given!r:.80} is not an integer")
        return int(given)
    if kind is ParameterType.DOUBLE:
        try:
            return float(given)
        except ValueError:
            raise ValueError(f"{given!r:.80} is not a number") from None
    try:
        value = json.loads(given)
    except (ValueError, RecursionError):
        value = None
        if kind not in _ARRAYS and given:
            return text  # untyped: a text
    if kind in _ARRAYS and not isinstance(value, list):
        raise ValueError(f"{given!r:.80} is not a list, such as [1, 2]")
    if kind is ParameterType.BYTE_ARRAY:
        try:
            return bytes(value)
        except (TypeError, ValueError):
            raise ValueError(f"{given!r:.80} is not a list of numbers from 0 to 255") from None
    return value
