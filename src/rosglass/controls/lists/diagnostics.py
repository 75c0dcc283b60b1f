"""The element ``DiagnosticsTopic``: the newest diagnostics of all parts of a robot."""
# ruff: noqa: N815 - the names of slots and signals are QML's

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rosglass.controls.lists.merged_topic import MergedTopic
from rosglass.controls.lists.texts import bounded
from rosglass.qml.engine.properties import ReadOnly, Writable, report, within
from rosglass.qt import Signal, Slot

if TYPE_CHECKING:
    from rosglass.messages import Message
    from rosglass.qml.engine.runtime import Runtime
    from rosglass.qt import QtCore

__all__ = ["DiagnosticsTopic"]

OK, WARN, ERROR, STALE = range(4)
#: How bad a level is: a part that is silent may be worse than one with a warning.
RANK = (0, 1, 3, 2)
#: Parts that are kept; further ones are counted.
_MAX_PARTS = 5000
#: Keys and values that are kept, of a part and of a message; further ones are counted.
_MAX_VALUES, _MAX_MESSAGE_VALUES = 200, 10_000


class DiagnosticsTopic(MergedTopic):
    """Merges ``diagnostic_msgs/DiagnosticArray``. See its page in ``docs/controls``."""

    ROLES = ("name", "hardware", "level", "text", "values", "more", "silent", "open")

    #: Emitted after each change of the rows.
    merged = Signal()

    #: Seconds without a report after which a part counts as silent.
    silentAfter = Writable(float, 5.0, within(0.1, 86_400, "seconds"), then="_arrange")
    #: Shows only parts whose name, hardware or text has it; empty for all.
    filter = Writable(str, "", then="_arrange")
    #: Number of parts that are ok, have a warning or an error, are stale or silent; and of all.
    oks = ReadOnly(int, 0)
    warnings = ReadOnly(int, 0)
    errors = ReadOnly(int, 0)
    stales = ReadOnly(int, 0)
    total = ReadOnly(int, 0)
    #: Reports of parts that are not kept, because there are too many.
    omitted = ReadOnly(int, 0)

    _filter: str
    _omitted: int

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        super().__init__(parent, runtime)
        self._types = ["diagnostic_msgs/msg/DiagnosticArray"]

    def _merge(self, message: Message, now: float) -> None:
        rows, room = self._rows, _MAX_MESSAGE_VALUES
        # Beyond that, most would be the same parts again.
        refused = max(0, len(message.status) - _MAX_PARTS)
        for status in message.status[:_MAX_PARTS] if refused else message.status:
            key = (status.name, status.hardware_id)
            row = rows.get(key)
            if row is None:
                if len(rows) >= _MAX_PARTS:
                    refused += 1
                    continue
                row = rows[key] = {
                    "name": bounded(status.name) or "?",
                    "hardware": bounded(status.hardware_id),
                    "open": False,
                }
            level = status.level
            if isinstance(level, bytes):
                level = level[0]
            text = bounded(status.message, 2000, lines=True)
            if not OK <= level <= STALE:
                text, level = f"level {level}: {text}", ERROR
            values, row["said"], row["text"], row["at"] = status.values, level, text, now
            kept = min(len(values), _MAX_VALUES, room)
            row["more"] = len(values) - kept
            room -= kept
            row["values"] = [
                {"key": bounded(pair.key, 200), "value": bounded(pair.value, 2000, lines=True)}
                for pair in (values[:kept] if row["more"] else values)
            ]
        if refused:
            report(self, omitted=self._omitted + refused)

    def _order(self, now: float) -> dict[Any, dict[str, Any]]:
        counts, limit = [0, 0, 0, 0], self.silentAfter
        for row in self._rows.values():
            age = now - row["at"]
            row["silent"] = round(age) if age > limit else -1
            level = row["level"] = STALE if age > limit else row["said"]
            counts[level] += 1
        self._report_counts(counts)
        found, wanted = list(self._rows.items()), self._filter.casefold()
        if wanted:
            found = [
                (key, row)
                for key, row in found
                if any(wanted in row[role].casefold() for role in ("name", "hardware", "text"))
            ]
        found.sort(key=lambda one: (-RANK[one[1]["level"]], one[0]))
        return dict(found)

    def _report_counts(self, counts: list[int]) -> None:
        oks, warnings, errors, stales = counts
        total = sum(counts)
        report(self, oks=oks, warnings=warnings, errors=errors, stales=stales, total=total)

    def _arrange(self) -> None:
        super()._arrange()
        self.merged.emit()

    def _forget(self) -> None:
        super()._forget()
        report(self, omitted=0)

    def parts(self) -> list[tuple[tuple[str, str], dict[str, Any]]]:
        """Return key and row of each part."""
        return list(self._rows.items())

    @Slot(int)
    def toggle(self, at: int) -> None:
        """Unfold or fold the keys and values of a row."""
        if 0 <= at < len(self._model.rows):
            row = self._model.rows[at]
            row["open"] = not row["open"]
            self._model.changed(self._model.keys[at])
