"""Base of elements that collect rows from all messages of a topic."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any, ClassVar

from rosglass.comm.qos import QoS, Reliability
from rosglass.controls.live_topic import LiveTopic
from rosglass.controls.row_model import RowModel
from rosglass.qml.engine.properties import ReadOnly, report
from rosglass.qt import QtCore, Slot, is_valid

if TYPE_CHECKING:
    from rosglass.comm.inbox import Sample
    from rosglass.messages import Message
    from rosglass.qml.engine.runtime import Runtime

__all__ = ["MergedTopic"]

#: Seconds between two looks at rows that have become old.
_REVIEW_S = 0.5


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
    model = ReadOnly(QtCore.QObject)
    #: Messages that were not merged, as more came than could be shown.
    lost = ReadOnly(int, 0)

    _model: RowModel

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        super().__init__(parent, runtime)
        self._rows: dict[Any, dict[str, Any]] = {}
        self._model = RowModel(self.ROLES, self._rows, self)
        #: Whether the rows are those of a former robot; whether they differ from what is shown.
        self._former = self._dirty = False
        self._reviewed = 0.0
        rows = self._rows
        self.destroyed.connect(lambda *_: rows.clear())

    def _merge(self, message: Message, now: float) -> None:
        """Put the content of a message into the rows."""
        raise NotImplementedError

    def _order(self, now: float) -> list[Any]:
        """Return the keys of the rows to show, in their order, after a look at their age."""
        raise NotImplementedError

    def _forget(self) -> None:
        """Remove all rows."""
        self._rows.clear()
        self._dirty = True

    def _arrange(self) -> None:
        """Show the rows as they are now."""
        self._reviewed, self._dirty = time.monotonic(), False
        self._model.arrange(self._order(self._reviewed))

    def _show(self, sample: Sample, held: float) -> None:
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
        super()._deliver()
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

    def _clear_shown(self) -> None:
        super()._clear_shown()
        self._forget()
        self._arrange()

    def _refresh(self) -> None:
        super()._refresh()
        if self._endpoint is not None:
            report(self, lost=self._endpoint.statistics().dropped)
