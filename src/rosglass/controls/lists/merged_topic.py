"""Base of elements that collect rows from all messages of a topic."""

from __future__ import annotations

import math
import time
from collections import deque
from typing import TYPE_CHECKING, Any, ClassVar

from rosglass.comm.qos import QoS, Reliability
from rosglass.controls.lists.row_model import RowModel
from rosglass.controls.topics.live_topic import LiveTopic
from rosglass.qml.elements.element import single_shot
from rosglass.qml.engine.properties import ReadOnly, report
from rosglass.qt import QtCore, Slot, is_valid

if TYPE_CHECKING:
    from rosglass.comm.inbox import Sample
    from rosglass.messages import Message
    from rosglass.qml.engine.runtime import Runtime

__all__ = ["MergedTopic"]

#: Seconds between two looks at rows that have become old.
_REVIEW_S = 0.5
#: Seconds of the GUI thread that the messages of one turn may take; further ones wait for the next.
_TURN_S = 0.015
#: Seconds that messages wait; all but the newest are lost after that.
_MOST_WAITED_S = 1.0
#: Milliseconds until the next turn while messages wait.
_NEXT_TURN_MS = 50


class MergedTopic(LiveTopic):
    """Receives every message of a topic, of all its publishers, into rows with keys.

    Messages are merged at ``throttleRate``; up to the depth of the queue wait for that, and
    ``lost`` counts those beyond.
    """

    _TAKES_ALL = True
    _DEFAULT_QOS = QoS(depth=100, reliability=Reliability.BEST_AVAILABLE)
    _HOLDS = (*LiveTopic._HOLDS, "_rows", "_model")
    #: Names of the roles.
    ROLES: ClassVar[tuple[str, ...]] = ()

    #: The rows, for a ListView.
    rows = ReadOnly(QtCore.QObject, read=lambda self: self._model)
    #: Messages that were not merged, as more came than could be shown.
    lost = ReadOnly(int, 0)

    _model: RowModel

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        super().__init__(parent, runtime)
        self._rows: dict[Any, dict[str, Any]] = {}
        self._model = RowModel(self, self.ROLES)
        #: When the present turn ends.
        self._turn_end = math.inf
        #: Messages that wait for the next turn, with the times when they arrived; and how many had
        #: to make room for newer ones.
        self._backlog: deque[tuple[Sample, float]] = deque()
        self._left_out = 0
        self._next_turn = single_shot(self, self._deliver)
        #: Whether the rows are those of a former robot; whether they differ from what is shown.
        self._former = self._dirty = False
        self._reviewed = 0.0
        rows = self._rows
        self.destroyed.connect(lambda *_: rows.clear())

    def _merge(self, message: Message, now: float) -> None:
        """Put the content of a message into the rows."""
        raise NotImplementedError

    def _order(self, now: float) -> dict[Any, dict[str, Any]]:
        """Return the rows to show, in their order, after a look at their age."""
        raise NotImplementedError

    def _forget(self) -> None:
        """Remove all rows."""
        self._rows.clear()
        self._dirty = True

    def _arrange(self) -> None:
        """Show the rows as they are now."""
        self._reviewed, self._dirty = time.monotonic(), False
        self._model.show(self._order(self._reviewed))
        self._model.refresh()

    def _show(self, sample: Sample, held: float) -> None:
        begin = time.monotonic()
        if begin > self._turn_end:
            self._backlog.append((sample, begin - held))
            if len(self._backlog) > self._profile.depth:
                self._backlog.popleft()
                self._left_out += 1
            return
        self._turn_end = min(self._turn_end, begin + _TURN_S)
        super()._show(sample, held)
        if not is_valid(self) or self._sample is not sample or self._refuses_type():
            return
        if self._former:
            self._former = False
            self._forget()
        self._dirty = True
        message = self._message
        assert message is not None
        # A link may have kept it for a while.
        self._merge(message, time.monotonic() - held - max(0.0, self._late))

    @Slot()
    def _deliver(self) -> None:
        self._turn_end = math.inf
        backlog, self._backlog = self._backlog, deque()
        while backlog:
            sample, arrival = backlog.popleft()
            waited = time.monotonic() - arrival
            if waited > _MOST_WAITED_S and backlog:
                self._left_out += 1
            else:
                self._show(sample, waited)
        super()._deliver()
        if is_valid(self) and self._backlog:
            self._next_turn.start(_NEXT_TURN_MS)
        if is_valid(self) and self._dirty:
            self._arrange()

    @Slot()
    def _on_tick(self) -> None:
        super()._on_tick()
        if self._dirty or (self._rows and time.monotonic() - self._reviewed > _REVIEW_S):
            self._arrange()

    def _on_created(self, endpoint: Any) -> None:
        self._former = True
        super()._on_created(endpoint)

    def _on_closed(self, endpoint: Any) -> None:
        self._backlog.clear()
        super()._on_closed(endpoint)

    def _clear_shown(self) -> None:
        self._backlog.clear()
        super()._clear_shown()
        self._forget()
        self._arrange()

    def _refresh(self) -> None:
        super()._refresh()
        if self._endpoint is not None:
            report(self, lost=self._endpoint.statistics().dropped + self._left_out)
