"""The element ``LogTopic``: the log messages of all nodes, filtered."""
# ruff: noqa: N815 - the names of slots and signals are QML's

from __future__ import annotations

import time
from bisect import bisect_left, bisect_right
from functools import lru_cache
from itertools import islice
from typing import TYPE_CHECKING, Any

from rosglass.comm.qos import Durability, QoS, Reliability
from rosglass.controls.lists.merged_topic import MergedTopic
from rosglass.controls.lists.texts import bounded
from rosglass.qml.engine.properties import ReadOnly, Writable, report, within
from rosglass.qt import QtGui, Slot

if TYPE_CHECKING:
    from rosglass.messages import Message
    from rosglass.qml.engine.runtime import Runtime
    from rosglass.qt import QtCore

__all__ = ["LogTopic"]

#: The levels of rcl_interfaces and of rosgraph_msgs, in the order of :data:`_NAMES`.
_ROS2, _ROS1 = (10, 20, 30, 40, 50), (1, 2, 4, 8, 16)
_NAMES = ("DEBUG", "INFO", "WARN", "ERROR", "FATAL")
#: Characters of a message that are kept.
_MOST_TEXT = 4000
#: Seconds below which a stamp is simulated time, which has no date.
_SIMULATED_S = 100_000_000


@lru_cache(16)
def _clock(seconds: int) -> str:
    if 0 <= seconds < _SIMULATED_S:
        return f"{seconds}"
    return time.strftime("%H:%M:%S", time.localtime(seconds))


class LogTopic(MergedTopic):
    """Receives ``Log`` of ``rcl_interfaces`` or ``rosgraph_msgs``. See its page."""

    ROLES = ("time", "level", "node", "text", "line", "where")
    # Nodes of ROS 2 keep their last messages for new subscriptions.
    _DEFAULT_QOS = QoS(
        depth=1000,
        reliability=Reliability.BEST_AVAILABLE,
        durability=Durability.BEST_AVAILABLE,
    )

    #: Least level that is shown: 0 debug, 1 info, 2 warn, 3 error, 4 fatal.
    minLevel = Writable(int, 1, within(0, 4), then="_apply_filters")
    #: Shows only nodes, and only texts, that have it; empty for all.
    nodeFilter = Writable(str, "", then="_apply_filters")
    textFilter = Writable(str, "", then="_apply_filters")
    #: Whether the rows stay as they are; messages are kept all the same.
    paused = Writable(bool, False, then="_apply_filters")
    #: Most messages that are kept.
    keep = Writable(int, 2000, within(10, 50_000), then="_arrange")
    #: Messages of each level since the last :meth:`clear`.
    counts = ReadOnly(list, [0, 0, 0, 0, 0])
    #: Messages that are kept, that arrived in the pause, and that had to make room for newer ones.
    kept = ReadOnly(int, 0)
    waiting = ReadOnly(int, 0)
    removed = ReadOnly(int, 0)

    _removed: int
    _paused: bool

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        super().__init__(parent, runtime)
        self._types = ["rcl_interfaces/msg/Log", "rosgraph_msgs/msg/Log"]
        # A robot that logs nothing is well.
        self._timeout = 0
        self._next = 0
        self._totals = [0] * len(_NAMES)
        #: Numbers of the messages to be shown that are new.
        self._new: list[int] = []
        self._arrived = 0

    def _merge(self, message: Message, now: float) -> None:  # noqa: ARG002 - of the base
        simple = "stamp" in message
        stamp = message.stamp if simple else message.header.stamp
        seconds, nanoseconds = (getattr(stamp, m.attr) for m in stamp._schema__.members)
        levels = _ROS2 if simple else _ROS1
        level = message.level
        if isinstance(level, bytes):
            level = level[0]
        text = bounded(message.msg, _MOST_TEXT, lines=True)
        at = bisect_left(levels, level)
        if levels[at : at + 1] != (level,):
            text, at = f"level {level}: {text}", max(0, bisect_right(levels, level) - 1)
        file = message.file
        where = f"{bounded(file, 200)}:{message.line} {bounded(message.function, 200)}"
        number = self._next = self._next + 1
        line = text if "\n" not in text else " ⏎ ".join(text.split("\n"))
        row = self._rows[number] = {
            "time": f"{_clock(seconds)}.{min(999, nanoseconds // 1_000_000):03d}",
            "level": at,
            "node": bounded(message.name, 200),
            "text": text,
            "line": line[:500],
            "where": where if file else "",
        }
        self._totals[at] += 1
        self._arrived += 1
        if self._fits(row):
            self._new.append(number)

    def _fits(self, row: dict[str, Any]) -> bool:
        wanted: Any = self
        return bool(
            row["level"] >= wanted._minLevel
            and (not wanted._nodeFilter or wanted._nodeFilter.casefold() in row["node"].casefold())
            and (not wanted._textFilter or wanted._textFilter.casefold() in row["text"].casefold())
        )

    def _arrange(self) -> None:
        self._reviewed, self._dirty = time.monotonic(), False
        rows = self._rows
        gone = list(islice(rows, max(0, len(rows) - self.keep)))
        for number in gone:
            del rows[number]
        if not self._paused:
            first = next(iter(rows), self._next + 1)
            new = {number: rows[number] for number in self._new if number >= first}
            self._model.slide(bisect_left(self._model.keys, first), new)
            self._new.clear()
            self._arrived = 0
        report(
            self,
            counts=list(self._totals),
            kept=len(rows),
            waiting=self._arrived,
            removed=self._removed + len(gone),
        )

    def _apply_filters(self) -> None:
        """Show what fits the filters, unless it is paused."""
        if self._paused:
            return
        self._new.clear()
        self._model.show({key: row for key, row in self._rows.items() if self._fits(row)})
        self._arrange()

    def _forget(self) -> None:
        super()._forget()
        self._new.clear()
        self._totals = [0] * len(_NAMES)
        self._arrived = 0
        report(self, removed=0)
        self._model.show({})

    @Slot()
    def clear(self) -> None:
        """Forget all messages and counts."""
        self._forget()
        self._arrange()

    @Slot(int, result="QVariant")
    def row(self, at: int) -> Any:
        """Return the values of a row by role, or None."""
        rows = self._model.rows
        return dict(rows[at]) if 0 <= at < len(rows) else None

    @Slot(int, result=str)
    @Slot(result=str)
    def copy(self, at: int = -1) -> str:
        """Copy a row, or all rows that are shown, to the clipboard; return the text."""
        rows = self._model.rows
        text = "\n".join(
            f"{row['time']} {_NAMES[row['level']]} [{row['node']}] {row['text']}"
            for row in (rows if at < 0 else rows[at : at + 1])
        )
        if text:
            QtGui.QGuiApplication.clipboard().setText(text)
        return text
