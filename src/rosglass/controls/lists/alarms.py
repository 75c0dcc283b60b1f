"""The element ``Alarms``: alarms that stay until they are acknowledged."""
# ruff: noqa: N815 - the names of slots and signals are QML's

from __future__ import annotations

import logging
import time
from typing import TYPE_CHECKING, Any

from rosglass.controls.lists.diagnostics import ERROR, RANK, STALE, WARN, DiagnosticsTopic
from rosglass.controls.lists.row_model import RowModel
from rosglass.controls.lists.texts import bounded
from rosglass.qml.engine.log import declared_at, log_from_qml
from rosglass.qml.engine.properties import ReadOnly, Writable, one_of, report
from rosglass.qt import QtCore, Signal, Slot, is_alive, optional

if TYPE_CHECKING:
    from collections.abc import Hashable, Iterable

__all__ = ["Alarms"]

#: Alarms that are kept; further ones are counted.
_MAX_ALARMS = 1000


class Alarms(QtCore.QObject):
    """A list of alarms, from diagnostics and from QML. See its page in ``docs/controls``.

    An alarm stays until it is both over and acknowledged. An alarm that comes while all others are
    acknowledged is marked as the first; so are others of the same message.
    """

    ROLES = ("name", "text", "level", "active", "acknowledged", "first", "began", "ended", "times")

    label = "Alarms"
    reportsChanged = Signal()
    #: An alarm was added, came again, or became worse.
    raised = Signal(str, arguments=["name"])

    #: The DiagnosticsTopic whose parts raise alarms; null for none.
    reports = Writable(QtCore.QObject, read=lambda self: self._reports, write="_set_reports")
    #: From which level on a part raises one: "error" or "warning". A silent part always does.
    minLevel = Writable(str, "error", one_of("error", "warning"), then="_review")
    rows = ReadOnly(QtCore.QObject, read=lambda self: self._model)
    #: Alarms that are not over, that are not acknowledged, and of both kinds together.
    active = ReadOnly(int, 0)
    unacknowledged = ReadOnly(int, 0)
    total = ReadOnly(int, 0)
    #: Alarms that are not listed, because there are too many.
    omitted = ReadOnly(int, 0)
    #: Level of the worst alarm: 0 without one, 1 warning, 2 error, 3 silent.
    worst = ReadOnly(int, 0)

    _minLevel: str
    _omitted: int

    def __init__(self, parent: QtCore.QObject | None = None) -> None:
        super().__init__(parent)
        self._reports: DiagnosticsTopic | None = None
        self._rows: dict[Hashable, dict[str, Any]] = {}
        self._model = RowModel(self, self.ROLES)
        #: Whether the alarms that are being added are the first.
        self._first = False
        self._look = lambda: self._review() if is_alive(self) else None
        rows = self._rows
        self.destroyed.connect(lambda *_: rows.clear())

    def _refuse(self, message: str) -> None:
        log_from_qml("", logging.ERROR, message, declared_at(self))

    def _schedule(self) -> None:
        """Do nothing: properties take effect at once."""

    def _set_reports(self, reports: QtCore.QObject | None) -> None:
        if reports is not None and not isinstance(reports, DiagnosticsTopic):
            self._refuse("Alarms: reports is not a DiagnosticsTopic")
            return
        if reports is self._reports:
            return
        if self._reports is not None and is_alive(self._reports):
            self._reports.merged.disconnect(self._look)
        self._reports = reports
        if reports is not None:
            reports.merged.connect(self._look)
        self.reportsChanged.emit()
        self._review()

    # Raising.

    def _review(self) -> None:
        """Compare the alarms with the parts of the diagnostics."""
        reports = self._reports
        parts = reports.parts() if reports is not None and is_alive(reports) else []
        least = RANK[WARN if self._minLevel == "warning" else ERROR]
        present: set[Hashable] = set()
        raised: list[str] = []
        self._first = self._is_quiet()
        for part, row in parts:
            key = ("part", part)
            level = row["level"]
            if level != STALE and RANK[level] < least:
                continue
            present.add(key)
            raised += self._raise(key, row["name"], row["text"], level)
        over = [
            key
            for key, row in self._rows.items()
            if row["active"] and isinstance(key, tuple) and key not in present
        ]
        self._end(over)
        self._arrange(raised)

    @Slot(str, str, str, int)
    def update(self, key: str, name: str, text: str, level: int) -> None:
        """Set an alarm of another source.

        Args:
            key: Identifies the alarm.
            name: What it is about.
            text: What is wrong.
            level: 1 warning, 2 error, 3 silent; 0 if it is over.
        """
        self._first = self._is_quiet()
        raised = []
        if level > 0:
            raised = self._raise(key, bounded(name), bounded(text, 2000), min(level, STALE))
        elif key in self._rows:
            self._end([key])
        self._arrange(raised)

    def _is_quiet(self) -> bool:
        return all(row["acknowledged"] for row in self._rows.values())

    def _raise(self, key: Hashable, name: str, text: str, level: int) -> list[str]:
        """Raise an alarm, or go on with it; return its name in a list if it is news."""
        row = self._rows.get(key)
        if row is None:
            if len(self._rows) >= _MAX_ALARMS:
                report(self, omitted=self._omitted + 1)
                return []
            row = self._rows[key] = {"name": name, "times": 0, "active": False, "level": 0}
        news = not row["active"] or RANK[level] > RANK[row["level"]]
        if not row["active"]:
            row["times"] += 1
            row["began"], row["ended"] = time.strftime("%H:%M:%S"), ""
        if news:
            row["acknowledged"] = False
            row["first"] = self._first
        row["active"], row["level"], row["text"] = True, level, text
        return [name] if news else []

    def _end(self, keys: Iterable[Hashable]) -> None:
        """Note that alarms are over; acknowledged ones go."""
        for key in list(keys):
            row = self._rows[key]
            if not row["active"]:
                continue
            row["active"], row["ended"] = False, time.strftime("%H:%M:%S")
            if row["acknowledged"]:
                del self._rows[key]

    # Acknowledging.

    @Slot(int)
    def acknowledge(self, at: int) -> None:
        """Acknowledge the alarm in a row."""
        keys = self._model.keys
        if 0 <= at < len(keys):
            self._accept([keys[at]])

    @Slot()
    def acknowledgeAll(self) -> None:  # noqa: N802 - QML's name
        """Acknowledge all alarms."""
        self._accept(list(self._rows))

    def _accept(self, keys: Iterable[Hashable]) -> None:
        for key in keys:
            row = self._rows[key]
            row["acknowledged"] = True
            if not row["active"]:
                del self._rows[key]
        self._arrange([])

    @Slot(result=bool)
    def beep(self) -> bool:
        """Sound the desktop's bell; return whether this machine can."""
        widgets = optional("QtWidgets")
        if widgets is None:
            return False
        widgets.QApplication.beep()
        return True

    # Showing.

    def _arrange(self, raised: list[str]) -> None:
        def order(key: Hashable) -> tuple[Any, ...]:
            row = self._rows[key]
            return (row["acknowledged"], not row["first"], not row["active"], -RANK[row["level"]])

        # The order of adding decides among equals: the oldest is above.
        self._model.show({key: self._rows[key] for key in sorted(self._rows, key=order)})
        self._model.refresh()
        rows = list(self._rows.values())
        if not report(
            self,
            active=sum(row["active"] for row in rows),
            unacknowledged=sum(not row["acknowledged"] for row in rows),
            total=len(rows),
            worst=max((row["level"] for row in rows), key=lambda level: RANK[level], default=0),
            omitted=self._omitted if len(rows) >= _MAX_ALARMS else 0,
        ):
            return
        for name in raised:
            self.raised.emit(name)
