"""The model of ``PropertyForm.qml``: the properties of one panel, as fields to change.

The form changes nothing itself: what is entered becomes an expression of QML, which
:attr:`PropertyModel.edited` reports, and the editor changes the text of the layout.
"""
# ruff: noqa: N802 - the names of slots are QML's

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from rosglass.cockpit.panel_properties import PanelProperty
from rosglass.cockpit.panels import search
from rosglass.cockpit.qml_values import Code, from_qml, is_literal, quote, to_qml, translated
from rosglass.comm.names import expand, hidden
from rosglass.controls.lists.row_model import RowModel
from rosglass.errors import ArgumentError, Error
from rosglass.qml.elements.element import Element
from rosglass.qml.engine.properties import ReadOnly, Writable, report
from rosglass.qt import QtCore, QtGui, Signal, Slot

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from rosglass.cockpit.panels import Panel
    from rosglass.qml.engine.runtime import Runtime

__all__ = ["PropertyModel"]

_ROLES = ("name", "kind", "line", "unit", "low", "high", "choices", "types", "text", "checked",
          "fallback", "isComputed", "isSet", "isBound", "isReplacing", "expression",
          "problem")  # fmt: skip
#: Suggestions that are shown at once, and characters of a value.
_MAX_SUGGESTIONS, _MAX_TEXT = 50, 20_000
#: Kinds whose values are names in the ROS graph.
_NAMES = ("topic", "action", "service", "node", "namespace", "path")
_TEXTS = ("text", "choice", "frame", *_NAMES)
_THEME_COLOR = re.compile(r"Theme\.[a-z]\w*")
#: A reference to an object of the layout: ``command`` or ``robots.current``.
_REFERENCE = re.compile(r"[a-z]\w*(?:\.[a-z]\w*)*")
_FRAME = re.compile(r"[^\s/][^\s]*")
_HAND = "Set by hand in the file; the panel does not describe it."


@dataclass
class _Row:
    """A property as it is shown.

    Attributes:
        about: Its description.
        expression: The expression that the layout has; empty without one.
        problem: Why what was entered is not used; empty without a reason.
        is_replacing: Whether the operator has agreed to replace a binding.
    """

    about: PanelProperty
    expression: str = ""
    problem: str = ""
    is_replacing: bool = False

    @property
    def is_bound(self) -> bool:
        """True for an expression that a form cannot show as a value."""
        if not self.expression or self.about.kind == "value":
            return False
        if self.about.kind == "color" and _THEME_COLOR.fullmatch(self.expression):
            return False
        return not is_literal(self.expression)

    @property
    def text(self) -> str:
        """The value as it is edited; that of the default if it is not set."""
        return _shown(self.expression or self.about.default, self.about.kind)


def _shown(expression: str, kind: str) -> str:
    """Return an expression as it is edited: strings without their quotation marks."""
    try:
        value = from_qml(expression) if expression else ""
    except ArgumentError:
        return expression if kind in ("color", "value", "list") else ""
    return value if isinstance(value, str) and not isinstance(value, Code) else expression


class PropertyModel(Element):
    """The properties of a panel as fields; see :mod:`rosglass.cockpit.property_form`."""

    #: A property is to have this expression; an empty one removes it, so that its default applies.
    edited = Signal(str, str, arguments=["name", "expression"])

    #: Part of a name or meaning; only properties that it finds are shown, typos forgiven.
    filter = Writable(str, "", then="_arrange")
    #: Name, description and page of the panel; empty without one.
    title = ReadOnly(str, "")
    line = ReadOnly(str, "")
    page = ReadOnly(str, "")
    #: The fields, for a ListView.
    rows = ReadOnly(QtCore.QObject, read=lambda self: self._model)
    #: Properties that match, and all properties.
    count = ReadOnly(int, 0)
    total = ReadOnly(int, 0)
    #: Whether names of frames are needed for suggestions.
    hasFrames = ReadOnly(bool, False)  # noqa: N815 - QML's name

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        super().__init__(parent, runtime)
        self._rows: dict[str, _Row] = {}
        self._model = RowModel(self, _ROLES)

    # -- what is shown ---------------------------------------------------------------------------

    def show(self, panel: Panel | None, values: Mapping[str, str]) -> None:
        """Show the properties of a panel.

        Args:
            panel: The entry of the catalogue; None for no panel.
            values: Expressions of the properties that the layout sets, by name, without objects
                and handlers. Those that the panel does not describe are shown as well.
        """
        before, same = self._rows, panel is not None and panel.name == self.title
        known = panel.properties if panel is not None else ()
        self._rows = {one.name: _Row(one, values.get(one.name, "")) for one in known}
        for name, expression in values.items():
            if name not in self._rows and panel is not None:
                self._rows[name] = _Row(PanelProperty(name, "value", _HAND), expression)
        for name, row in self._rows.items():
            # What was refused stays readable while the rest of the layout changes.
            if same and name in before and before[name].expression == row.expression:
                row.problem, row.is_replacing = before[name].problem, before[name].is_replacing
        report(
            self,
            title=panel.name if panel is not None else "",
            line=panel.line if panel is not None else "",
            page=panel.page if panel is not None else "",
            total=len(self._rows),
            hasFrames=any(one.kind == "frame" for one in known),
        )
        self._arrange()

    def _arrange(self) -> None:
        rows = list(self._rows.values())
        lines = [row.about.line for row in rows]
        found = search(self.filter, [row.about.name for row in rows], lines)
        self._model.show({rows[at].about.name: _roles(rows[at]) for at in found})
        report(self, count=len(found))

    def _refresh(self, row: _Row, problem: str) -> None:
        row.problem = problem
        self._arrange()

    # -- changes ---------------------------------------------------------------------------------

    @Slot(str, str, result=bool)
    def setText(self, name: str, text: str) -> bool:
        """Set a property to what was entered; if it does not fit, the row says why."""
        row = self._editable(name)
        if row is None:
            return False
        try:
            expression = _expression(row.about, text, row.expression or row.about.default)
        except ValueError as error:
            self._refresh(row, str(error))
            return False
        self._report(row, expression)
        return True

    @Slot(str, bool)
    def setChecked(self, name: str, checked: bool) -> None:
        """Set a property that is true or false."""
        row = self._editable(name)
        if row is not None:
            self._report(row, "true" if checked else "false")

    @Slot(str)
    def reset(self, name: str) -> None:
        """Remove a property from the layout, so that its default applies.

        A binding is kept until :meth:`replace` was called.
        """
        row = self._editable(name)
        if row is not None:
            self._report(row, "")

    @Slot(str, bool)
    def replace(self, name: str, agreed: bool) -> None:
        """Agree to replace the binding of a property by a value, or change one's mind."""
        row = self._rows.get(name)
        if row is not None and row.is_bound:
            row.is_replacing = agreed
            self._refresh(row, "")

    def _editable(self, name: str) -> _Row | None:
        row = self._rows.get(name)
        return row if row is not None and (not row.is_bound or row.is_replacing) else None

    def _report(self, row: _Row, expression: str) -> None:
        row.is_replacing = False
        self._refresh(row, "")
        if expression != row.expression:
            self.edited.emit(row.about.name, expression)

    # -- suggestions -----------------------------------------------------------------------------

    @Slot(str, str, result="QVariantList")
    @Slot(str, str, "QStringList", result="QVariantList")
    def suggestions(
        self, name: str, typed: str, frames: list[str] | None = None
    ) -> list[dict[str, Any]]:
        """Return what a property can be set to, as the robot is now: ``{text, detail, suits}``.

        Names whose type suits the panel come first.

        Args:
            name: Name of the property.
            typed: What was typed so far; empty for all.
            frames: Names of the robot's frames.
        """
        row = self._rows.get(name)
        if row is None:
            return []
        kind, types = row.about.kind, row.about.types
        if kind == "frame":
            found: dict[str, str] = dict.fromkeys(frames or (), "")
        else:
            found = self._names(kind)
        if kind == "path" and ":" in typed:
            return []
        names = list(found)
        matching = [names[at] for at in search(typed, names)]
        rank = {kind_of: at for at, kind_of in enumerate(types)}
        if types:
            matching.sort(key=lambda one: rank.get(found[one].partition(", ")[0], len(rank)))
        return [
            {
                "text": f"{one}:" if kind == "path" else one,
                "detail": found[one].replace("/msg/", "/"),
                "suits": not types or found[one].partition(", ")[0] in rank,
            }
            for one in matching[:_MAX_SUGGESTIONS]
        ]

    def _names(self, kind: str) -> dict[str, str]:
        """Return the names of a kind that the graph has now, with their types."""
        node = self.node
        if node is None or kind not in _NAMES:
            return {}
        try:
            if kind == "node":
                return dict.fromkeys(sorted(one.full for one in node.nodes()), "")
            if kind == "action":
                return _joined(node.actions())
            if kind == "service":
                return _joined(node.services())
            topics = _joined(node.topics())
        except Error:  # the node has just been closed
            return {}
        if kind == "namespace":
            return dict.fromkeys(sorted({_namespace(one) for one in topics} - {""}), "")
        return {one: types for one, types in topics.items() if not hidden(one)}


def _joined(found: Mapping[str, Iterable[str]]) -> dict[str, str]:
    return {name: ", ".join(found[name]) for name in sorted(found)}


def _namespace(topic: str) -> str:
    return topic.rpartition("/")[0]


def _fallback(about: PanelProperty) -> str:
    """Return the default as a form shows it: a value, or the expression that computes it."""
    return _shown(about.default, about.kind) or about.default.replace('""', "")


def _roles(row: _Row) -> dict[str, Any]:
    about = row.about
    return {
        "name": about.name,
        "kind": about.kind,
        "line": about.line,
        "unit": about.unit,
        "low": math.nan if about.low is None else about.low,
        "high": math.nan if about.high is None else about.high,
        "choices": list(about.choices),
        "types": ", ".join(one.replace("/msg/", "/") for one in about.types),
        "text": row.text[:_MAX_TEXT],
        "checked": (row.expression or about.default) == "true",
        "fallback": "" if about.default.endswith("_") else _fallback(about),
        "isComputed": not is_literal(about.default or '""'),
        "isSet": row.expression != "",
        "isBound": row.is_bound,
        "isReplacing": row.is_replacing,
        "expression": row.expression[:_MAX_TEXT],
        "problem": row.problem,
    }


# -- what was entered, as an expression ------------------------------------------------------------


def _expression(about: PanelProperty, text: str, before: str) -> str:
    """Return the expression for what was entered; raises ValueError with the reason if it fails."""
    if len(text) > _MAX_TEXT:
        raise ValueError(f"{len(text):,} characters are too many; {_MAX_TEXT:,} fit")
    kind, given = about.kind, text.strip()
    if kind in ("number", "integer"):
        return _number(about, given)
    if kind == "color":
        return _color(given)
    if kind == "bool":
        if given not in ("true", "false"):
            raise ValueError(f"expected true or false, got {given!r:.60}")
        return given
    if kind in _TEXTS:
        used = text if kind == "text" else given
        _check(about, used)
        return f"qsTr({quote(used)})" if translated(before) and kind == "text" else quote(used)
    if kind == "list":
        return _literal(given, 'a list, such as [1, 2] or ["/a", "/b"]', list)
    if is_literal(given) or _REFERENCE.fullmatch(given):
        return given
    raise ValueError("expected a value or the id of an object; write expressions in the file")


def _number(about: PanelProperty, text: str) -> str:
    plain = text.removesuffix(about.unit).strip() if about.unit else text
    words = {"nan": math.nan, "inf": math.inf, "infinity": math.inf, "-inf": -math.inf}
    value: float | None = words.get(plain.lower())
    if value is None:
        try:
            value = int(plain) if about.kind == "integer" else float(plain)
        except ValueError:
            kind = "a whole number" if about.kind == "integer" else "a number"
            raise ValueError(f"expected {kind}, got {text!r:.60}") from None
    elif about.kind == "integer":
        raise ValueError(f"expected a whole number, got {text!r:.60}")
    unit = f" {about.unit}" if about.unit else ""
    if about.low is not None and value < about.low:
        raise ValueError(f"{plain}{unit} is less than {about.low:g}{unit}")
    if about.high is not None and value > about.high:
        raise ValueError(f"{plain}{unit} is more than {about.high:g}{unit}")
    if about.kind == "integer" and not -(2**31) <= value < 2**31:
        raise ValueError(f"{plain} does not fit into an int of QML")
    if about.choices and str(value) not in about.choices:
        raise ValueError(f"expected one of {', '.join(about.choices)}, got {plain}")
    return to_qml(value)


def _color(text: str) -> str:
    if _THEME_COLOR.fullmatch(text):
        return text
    if not QtGui.QColor(text).isValid():
        raise ValueError(f"{text!r:.60} is not a colour; write #rrggbb, a name or Theme.accent")
    return quote(text)


def _check(about: PanelProperty, text: str) -> None:
    """Raise ValueError if a name cannot be one of its kind."""
    kind = about.kind
    if kind == "choice" and text not in about.choices and text != _shown(about.default, kind):
        raise ValueError(f"expected one of {', '.join(about.choices)}, got {text!r:.60}")
    if not text:
        return
    if kind == "frame" and not _FRAME.fullmatch(text):
        raise ValueError(f"{text!r:.60} is not the name of a frame, such as base_link")
    if kind in ("topic", "action", "service", "node", "namespace"):
        _check_name(text.rstrip("/") if kind == "namespace" and text != "/" else text)
    elif kind == "path":
        topic, colon, field = text.partition(":")
        if not (topic and colon and field):
            raise ValueError("expected topic:field, such as /odom:twist.twist.linear.x")
        _check_name(topic)


def _check_name(name: str) -> None:
    try:
        # Relative names are resolved by the panel; "%1" is replaced by it.
        expand(name.replace("%1", "x"), "panel", "/") if name != "/" else None
    except Error as error:
        raise ValueError(str(error)) from None


def _literal(text: str, expected: str, kind: type) -> str:
    try:
        value = from_qml(text)
    except ArgumentError:
        value = None
    if not isinstance(value, kind):
        raise ValueError(f"expected {expected}")
    return text
