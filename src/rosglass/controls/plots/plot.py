"""The elements ``PlotData`` and ``PlotSeries``: what a plot shows, and which part of it."""
# ruff: noqa: N802, N815 - the names of slots and signals are QML's

from __future__ import annotations

import logging
import math
import os
import tempfile
import threading
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from rosglass.controls.plots.axes import clock_text, number_text, time_ticks
from rosglass.errors import Error
from rosglass.qml.elements.element import DEFAULT_TIMEOUT_MS, Element
from rosglass.qml.engine.dialect import resolve_namespace, within_namespace
from rosglass.qml.engine.log import declared_at, log_from_qml
from rosglass.qml.engine.properties import ReadOnly, Writable, at_least, one_of, report
from rosglass.qml.engine.session import weak_callback
from rosglass.qt import QtCore, QtGui, Signal, Slot, is_alive

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from rosglass.comm.node import Node
    from rosglass.controls.plots.frame import PlotFrame, ShownLine
    from rosglass.controls.plots.recorded import RecordingReader
    from rosglass.controls.plots.samples import Samples
    from rosglass.controls.plots.series import FieldFeed, PlotReceiver, TopicFeed
    from rosglass.qml.engine.runtime import Runtime

__all__ = ["MAX_LINES", "PlotData", "PlotSeries"]

#: Lines of one plot.
MAX_LINES = 64
#: Milliseconds between two frames.
_FRAME_MS = 33
#: Shortest and longest window in seconds.
_MIN_WINDOW_S, _MAX_WINDOW_S = 0.001, 30 * 86400.0
#: Marks that are kept, and characters of one.
_MAX_MARKS, _MAX_MARK_TEXT = 1000, 80
#: Ticks of the session (ten a second) between two updates of the values in the legend.
_READING_TICKS = 3
#: Seconds by which topics' clocks may differ before it is reported.
_MAX_CLOCK_DIFFERENCE_S = 60.0
#: Nanoseconds by which the right end waits rather than to go back.
_MAX_JITTER_NS = 300_000_000
_LEFT, _RIGHT = 0, 1
#: Rows of a CSV file that are written at once.
_CSV_ROWS = 2000


def _positive(seconds: float) -> float:
    if not _MIN_WINDOW_S <= seconds <= _MAX_WINDOW_S:
        raise ValueError(f"is not from {_MIN_WINDOW_S:g} to {_MAX_WINDOW_S:.0f} seconds")
    return seconds


def _from_zero(seconds: float) -> float:
    if not 0 <= seconds < math.inf:
        raise ValueError("is not a number of seconds, 0 or more")
    return seconds


def _texts(values: Any) -> list[str]:
    if not all(isinstance(value, str) for value in values):
        raise ValueError('has an element that is not a text such as "/odom:pose.pose.position.x"')
    return list(values)


class PlotSeries(QtCore.QObject):
    """One series of a plot. See its page in ``docs/controls``."""

    path = Writable(str, "", then="_on_change")
    xPath = Writable(str, "", then="_on_change")
    axis = Writable(str, "left", one_of("left", "right"), then="_on_change")
    #: Transparent for the next colour of the theme.
    color = Writable(QtGui.QColor, QtGui.QColor(0, 0, 0, 0), then="_on_change")
    label = Writable(str, "", then="_on_change")
    shown = Writable(bool, True, then="_on_change")
    #: Latest value; NaN before the first one.
    value = ReadOnly(float, math.nan)
    unit = ReadOnly(str, "")
    problem = ReadOnly(str, "")

    changed = Signal()

    _path: str
    _xPath: str
    _axis: str
    _color: QtGui.QColor
    _label: str
    _shown: bool
    _value: float

    def _on_change(self) -> None:
        self.changed.emit()

    def _refuse(self, message: str) -> None:
        log_from_qml("", logging.ERROR, f"PlotSeries {message}", declared_at(self))


class _Entry:
    """One series, declared or out of a path."""

    def __init__(self, path: str, declared: PlotSeries | None) -> None:
        self.path, self.declared = path, declared
        self.x_path = declared._xPath if declared is not None else ""
        self.axis = _RIGHT if declared is not None and declared._axis == "right" else _LEFT
        self.label = (declared._label if declared is not None else "") or path
        self.shown = declared._shown if declared is not None else True
        self.feed: FieldFeed | None = None
        self.topic: TopicFeed | None = None
        self.problem = ""


class _Line(NamedTuple):
    """One line of a series; `samples` is None before the first one."""

    entry: _Entry
    samples: Samples | None
    x_samples: Samples | None
    name: str
    number: int

    @property
    def span(self) -> tuple[int, int] | None:
        """Times of the first and last sample."""
        return None if self.samples is None else self.samples.span


class _Mark(NamedTuple):
    time: int
    text: str


class PlotData(Element):
    """The samples, the visible time and the axes of a ``Plot``. See ``docs/controls``."""

    saved = Signal(str, arguments=["file"])
    saveFailed = Signal(str, arguments=["reason"])
    structureChanged = Signal()
    readingsChanged = Signal()
    axesChanged = Signal()
    viewChanged = Signal()
    marksChanged = Signal()

    series = Writable(list, [], then="_on_series")
    paths = Writable(list, [], _texts, then="_on_series")
    colors = Writable(list, [], then="_on_series")
    ns = Writable(str, read="_get_namespace", write="_set_namespace")
    window = Writable(float, 30.0, _positive, then="_on_view", unit="s")
    history = Writable(float, 600.0, _from_zero, then="_on_history", unit="s")
    paused = Writable(bool, False, then="_on_paused")
    stamps = Writable(bool, True, then="_on_series")
    #: Whether a recording is plotted as a whole, not only what was played.
    whole = Writable(bool, True, then="_on_series")
    gap = Writable(float, 0.0, _from_zero, then="redraw", unit="s")
    timeout = Writable(int, DEFAULT_TIMEOUT_MS, at_least(0), then="_update_stale", unit="ms")
    leftMin = Writable(float, math.nan, then="_on_axes")
    leftMax = Writable(float, math.nan, then="_on_axes")
    rightMin = Writable(float, math.nan, then="_on_axes")
    rightMax = Writable(float, math.nan, then="_on_axes")
    leftLog = Writable(bool, False, then="_on_axes")
    rightLog = Writable(bool, False, then="_on_axes")

    stale = ReadOnly(bool, True)
    age = ReadOnly(float, -1.0)
    received = ReadOnly(float, 0.0)
    lost = ReadOnly(float, 0.0)
    removed = ReadOnly(float, 0.0)
    #: Time at the right end, in seconds of the stamps' clock.
    end = ReadOnly(float, read=lambda self: self._end_ns / 1e9, notify="viewChanged")
    #: Seconds from the right end to the newest time.
    behind = ReadOnly(float, read=lambda self: self._behind(), notify="viewChanged")
    legend = ReadOnly(list, read=lambda self: self._legend, notify="structureChanged")
    readings = ReadOnly(list, read=lambda self: self._readings, notify="readingsChanged")
    leftTicks = ReadOnly(list, read=lambda self: self._ticks[_LEFT], notify="axesChanged")
    rightTicks = ReadOnly(list, read=lambda self: self._ticks[_RIGHT], notify="axesChanged")
    bottomTicks = ReadOnly(list, read=lambda self: self._bottom_ticks, notify="axesChanged")
    markCount = ReadOnly(int, read=lambda self: len(self._marks), notify="marksChanged")
    isXY = ReadOnly(bool, False)
    #: Share of a recording that was read; 1 if there is nothing to read.
    reading = ReadOnly(float, 1.0)
    #: Samples that are not kept, as they are between the extremes of a short time.
    merged = ReadOnly(float, 0.0)
    #: Time that is played, in seconds of the stamps' clock; NaN unless a recording is shown whole.
    moment = ReadOnly(float, read=lambda self: self._moment, notify="viewChanged")

    _HOLDS = (
        "_followed",
        "_feeds",
        "_entries",
        "_lines",
        "_shape",
        "_drawn",
        "_frame",
        "_view",
        "_receiver",
        "_recorded",
    )
    _series: list[Any]
    _paths: list[str]
    _colors: list[Any]
    _window: float
    _history: float
    _paused: bool
    _stamps: bool
    _whole: bool
    _gap: float
    _timeout: int
    _leftMin: float
    _leftMax: float
    _rightMin: float
    _rightMax: float
    _leftLog: bool
    _rightLog: bool
    _stale: bool
    _age: float
    _isXY: bool

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        super().__init__(parent, runtime)
        # Numpy takes 0.1 s, which interfaces without a plot need not wait for.
        from rosglass.controls.plots import frame as plot_frame  # noqa: PLC0415
        from rosglass.controls.plots import series as plot_series  # noqa: PLC0415

        self._frames, self._kit = plot_frame, plot_series
        self._namespace = ""
        self._followed: list[PlotSeries] = []
        self._entries: list[_Entry] = []
        self._lines: list[_Line] = []
        self._line_count = 0
        #: Samples and problems of the lines, as the legend shows them.
        self._shape: list[tuple[Samples | None, str]] = []
        self._feeds: dict[str, TopicFeed] = {}
        self._receiver: PlotReceiver | RecordingReader | None = None
        #: The receiver, if it reads a recording; and the window for the robot until then.
        self._recorded: RecordingReader | None = None
        self._window_before: float | None = None
        self._moment = math.nan
        self._drawn: list[ShownLine] = []
        self._frame: PlotFrame = plot_frame.PlotFrame()
        self._view: Any = None
        self._end_ns = 0
        #: URL of the robot whose samples are kept.
        self._url: str | None = None
        self._legend: list[dict[str, Any]] = []
        self._readings: list[str] = []
        self._ticks: list[list[dict[str, Any]]] = [[], []]
        self._bottom_ticks: list[dict[str, Any]] = []
        self._ticks_key: Any = None
        self._marks: list[_Mark] = []
        self._has_changed = True
        self._tick_number = 0
        self._gone = False
        self._timer = QtCore.QTimer(self)
        self._timer.setInterval(_FRAME_MS)
        self._timer.timeout.connect(self._on_frame)

    @property
    def label(self) -> str:
        """The element's name in error messages."""
        return "Plot"

    # -- the series ------------------------------------------------------------------------------

    def _get_namespace(self) -> str:
        return resolve_namespace(self.node, self._namespace)

    def _set_namespace(self, namespace: str) -> None:
        if namespace != self._namespace:
            self._namespace = namespace
            self.nsChanged.emit()  # type: ignore[attr-defined]
            self._on_series()

    @Slot()
    def _on_series(self) -> None:
        for one in self._series:
            if isinstance(one, PlotSeries) and one not in self._followed:
                self._followed.append(one)
                one.changed.connect(self._on_series)
        self._schedule()

    def _wanted(self) -> tuple[Node, bool] | None:
        node = self.node
        return None if node is None else (node, self._whole and hasattr(node, "playback"))

    def _factory(self, *wanted: Any) -> Callable[[], PlotReceiver | RecordingReader]:
        node, reads = wanted
        if reads:
            from rosglass.controls.plots.recorded import RecordingReader  # noqa: PLC0415 - numpy

            return lambda: RecordingReader(node)
        make = self._kit.PlotReceiver
        return lambda: make(node)

    def _on_created(self, endpoint: PlotReceiver | RecordingReader) -> None:
        url = self._session.url if self._session is not None else ""
        before, self._recorded = self._recorded, None
        if not isinstance(endpoint, self._kit.PlotReceiver):
            self._recorded = endpoint
            first, last = endpoint.span
            self._window_before = self._window
            self.window = min(max((last - first) / 1e9, _MIN_WINDOW_S), _MAX_WINDOW_S)
            self._end_ns = last
        if before is not self._recorded or (self._url is not None and url != self._url):
            # Another robot, whose values must not be taken for those of the one before.
            for feed in self._feeds.values():
                feed.clear()
        self._url = url
        for feed in self._feeds.values():
            feed.arrived = None
        self._receiver = endpoint
        self._sync()
        self._update_readings()
        self._update_stale()

    def _on_closed(self, endpoint: Any) -> None:  # noqa: ARG002 - the base class's signature
        self._receiver = None
        self._gone = True
        if self._recorded is not None and self._window_before is not None:
            self.window, self._moment = self._window_before, math.nan
            self._window_before = None
        self._update_stale()

    def _update(self) -> None:
        super()._update()
        self._sync()

    def _sync(self) -> None:
        """Receive what the series need, and show their lines."""
        entries = [_Entry(one._path, one) for one in self._series if is_alive(one) and one._path]
        entries += [_Entry(path, None) for path in self._paths if path]
        feeds: dict[str, TopicFeed] = {}
        fields: dict[str, list[FieldFeed]] = {}
        for entry in entries:
            try:
                self._attach_feed(entry, feeds, fields)
            except Error as error:  # noqa: PERF203 - a few
                entry.problem = str(error)
        for topic, feed in feeds.items():
            feed.history_ns = round(self._history * 1e9)
            feed.set_fields(tuple(fields[topic]), use_stamps=self._stamps)
        self._entries, self._feeds = entries, feeds
        if self._receiver is not None:
            self._receiver.set_feeds(feeds)
        self._frame.x_axis.forget()
        report(self, isXY=any(entry.x_path and not entry.problem for entry in entries))
        self._lines = []
        self._rebuild(force=True)
        self._report_problem()
        self._start_frames()

    def _attach_feed(
        self, entry: _Entry, feeds: dict[str, TopicFeed], fields: dict[str, list[FieldFeed]]
    ) -> None:
        """Find or create what receives a series."""
        name, field = self._kit.split_path(entry.path)
        node = self.node
        if node is None:
            topic = name
        else:
            topic = node.resolve(within_namespace(self._namespace, name))
        x_field = ""
        if entry.x_path:
            x_topic, x_field = self._kit.split_path(entry.x_path)
            if x_topic != name:
                raise Error(
                    f"xPath is of {x_topic}, and path of {name}: both must be of one topic, whose "
                    "messages have both values"
                )
        feed = feeds.get(topic)
        if feed is None:
            feed = feeds[topic] = self._feeds.get(topic) or self._kit.TopicFeed(topic)
        known = (*fields.get(topic, ()), *feed.fields)
        found = next((one for one in known if (one.field, one.x_field) == (field, x_field)), None)
        found = found or self._kit.FieldFeed(field, x_field)
        own = fields.setdefault(topic, [])
        if found not in own:
            own.append(found)
        entry.feed, entry.topic = found, feed

    def _rebuild(self, *, force: bool = False) -> None:
        """Follow the numbers of lines, which arrays decide."""
        lines = [line for entry in self._entries for line in _lines_of(entry)][:MAX_LINES]
        shape = [(line.samples, _reason_of(line.entry)) for line in lines]
        if shape == self._shape and not force:
            return
        self._shape = shape
        self._line_count = sum(len(entry.feed.lines) for entry in self._entries if entry.feed)
        self._lines = lines
        colors = [self._color_of(at, line) for at, line in enumerate(lines)]
        self._drawn = [
            self._frames.ShownLine(
                line.samples, line.x_samples, line.entry.axis, color.rgb() & 0xFFFFFFFF
            )
            for line, color in zip(lines, colors, strict=True)
            if line.samples is not None and line.entry.shown
        ]
        self._legend = [
            {
                "name": line.name,
                "color": color,
                "axis": "right" if line.entry.axis else "left",
                "unit": line.entry.feed.unit if line.entry.feed else "",
                "path": line.entry.path,
                "problem": _reason_of(line.entry),
            }
            for line, color in zip(lines, colors, strict=True)
        ]
        self._has_changed = True
        self.structureChanged.emit()
        self._update_readings()

    def _color_of(self, at: int, line: _Line) -> QtGui.QColor:
        declared = line.entry.declared
        if declared is not None and is_alive(declared) and declared._color.alpha():
            return QtGui.QColor(declared._color)
        if not self._colors:
            return QtGui.QColor(128, 128, 128)
        return QtGui.QColor(self._colors[at % len(self._colors)])

    # -- the view --------------------------------------------------------------------------------

    def attach(self, view: Any) -> None:
        """Have an item draw the lines."""
        self._view = view
        self.redraw()

    def detach(self, view: Any) -> None:
        """End what :meth:`attach` began."""
        if self._view is view:
            self._view = None

    @Slot()
    def redraw(self) -> None:
        """Draw everything again with the next frame."""
        self._has_changed = True
        self._ticks_key = None
        self._start_frames()

    def _start_frames(self) -> None:
        if not self._timer.isActive():
            self._timer.start()

    def _on_view(self) -> None:
        self._has_changed = True
        self.viewChanged.emit()

    def _on_paused(self) -> None:
        self._ticks_key = None
        self._on_view()

    def _on_axes(self) -> None:
        left, right = self._frame.axes
        left.given, left.logarithmic = (self._leftMin, self._leftMax), self._leftLog
        right.given, right.logarithmic = (self._rightMin, self._rightMax), self._rightLog
        left.forget()
        right.forget()
        self.redraw()

    def _on_history(self) -> None:
        for feed in self._feeds.values():
            feed.history_ns = round(self._history * 1e9)

    def _newest_ns(self) -> int | None:
        """Return the time of the newest sample of all lines."""
        spans = [line.span for line in self._lines]
        return max((span[1] for span in spans if span), default=None)

    def _behind(self) -> float:
        newest = self._newest_ns()
        return 0.0 if newest is None else max(0.0, (newest - self._end_ns) / 1e9)

    def _follow(self) -> None:
        """Move the right end to the newest time, which passes in silence, too."""
        if self._recorded is not None:
            self._follow_recording(self._recorded)
            return
        now, ends = self._steady(), []
        for line in self._lines:
            span, topic = line.span, line.entry.topic
            if span is not None and topic is not None and topic.arrived is not None:
                ends.append(span[1] + round(max(0.0, now - topic.arrived) * 1e9))
        end = max(ends, default=self._end_ns)
        if not self._end_ns - _MAX_JITTER_NS < end < self._end_ns:
            self._end_ns = end

    def _follow_recording(self, recorded: RecordingReader) -> None:
        """Show all of a recording; the time that is played in the middle, if a part is shown."""
        first, last = recorded.span
        window = round(self._window * 1e9)
        middle = recorded.moment + window // 2
        self._end_ns = min(last, max(first + window, middle)) if window < last - first else last

    @Slot()
    def _on_frame(self) -> None:
        self.draw()

    def draw(self) -> None:
        """Draw what has changed, at once."""
        view = self._view
        if not is_alive(view):
            self._timer.stop()
            return
        width, height = view.pixels
        if width < 2 or height < 2:
            return
        if sum(len(entry.feed.lines) for entry in self._entries if entry.feed) != self._line_count:
            self._rebuild()
        if not self._paused or self._recorded is not None:
            before = self._end_ns, self._moment
            if not self._paused:
                self._follow()
            if self._recorded is not None:
                self._moment = self._recorded.moment / 1e9
            if (self._end_ns, self._moment) != before:
                self.viewChanged.emit()
                if not is_alive(self) or not is_alive(view):
                    return
        force, self._has_changed = self._has_changed, False
        if self._frame.draw(
            view,
            self._drawn,
            self._end_ns,
            round(self._window * 1e9),
            round(self._gap * 1e9),
            force=force,
        ):
            self._ticks_key = None
        self._update_ticks(width / view.ratio, height / view.ratio)

    def _update_ticks(self, width: float, height: float) -> None:
        key = (width, height, self._window, self._isXY)
        relative = not self._paused and self._recorded is None
        if not relative:
            key += (self._end_ns,)  # type: ignore[assignment]
        if key == self._ticks_key:
            return
        self._ticks_key = key
        for at, axis in enumerate(self._frame.axes):
            used = any(line.entry.axis == at for line in self._lines) or at == _LEFT
            self._ticks[at] = _as_js(axis.ticks(height)) if used else []
        if self._isXY:
            self._bottom_ticks = _as_js(self._frame.x_axis.ticks(width / 2))
        else:
            start = self._end_ns / 1e9 - self._window
            self._bottom_ticks = _as_js(time_ticks(start, self._window, width, relative=relative))
        self.axesChanged.emit()

    # -- for QML ---------------------------------------------------------------------------------

    @Slot(float, float)
    def zoomBy(self, factor: float, at: float) -> None:
        """Enlarge the time, and keep the one at the share `at` of the width."""
        if not (0 < factor < math.inf and math.isfinite(at)):
            return
        window = min(max(self._window / factor, _MIN_WINDOW_S), _MAX_WINDOW_S)
        if self._paused:
            self._end_ns += round((window - self._window) * (1 - at) * 1e9)
        self.window = window

    @Slot(float)
    def scroll(self, seconds: float) -> None:
        """Pause, and show what is as many seconds later (earlier, if negative)."""
        if not math.isfinite(seconds):
            return
        newest = self._newest_ns()
        if newest is None:
            return
        spans = [line.span for line in self._lines]
        oldest = min(span[0] for span in spans if span)
        target = self._end_ns + round(max(min(seconds, 1e8), -1e8) * 1e9)
        # Until nothing but the first or the last sample is left in the window.
        self._end_ns = min(
            max(target, oldest + round(self._window * 1e8)), max(newest, self._end_ns)
        )
        if not self._paused:
            self.paused = True
        self._on_view()

    @Slot()
    def toOldest(self) -> None:
        """Pause, and show the first samples."""
        spans = [line.span for line in self._lines]
        oldest = min((span[0] for span in spans if span), default=None)
        if oldest is not None:
            self._end_ns = oldest + round(self._window * 1e9)
            self.paused = True
            self._on_view()

    @Slot(float, float)
    def zoomValuesBy(self, factor: float, at: float) -> None:
        """Enlarge the values of both axes around the share `at` of the height."""
        if not (0 < factor < math.inf and math.isfinite(at)):
            return
        for axis, names in zip(
            self._frame.axes, (("leftMin", "leftMax"), ("rightMin", "rightMax")), strict=True
        ):
            low, high = (axis.value(at + (end - at) / factor) for end in (0.0, 1.0))
            if low < high:
                setattr(self, names[0], low)
                setattr(self, names[1], high)

    @Slot()
    def fit(self) -> None:
        """Have the data decide the ranges of the values again."""
        self.leftMin = self.leftMax = self.rightMin = self.rightMax = math.nan
        self._on_axes()

    @Slot(str)
    def mark(self, text: str) -> None:
        """Mark the present time with a text."""
        newest = self._newest_ns() if self._paused else self._end_ns
        now = newest or time.time_ns()
        self._marks = [*self._marks, _Mark(now, text[:_MAX_MARK_TEXT])][-_MAX_MARKS:]
        self._has_changed = True
        self.marksChanged.emit()

    @Slot(int, result="QVariant")
    def markAt(self, index: int) -> Any:
        """Return time in seconds and text of a mark."""
        if not 0 <= index < len(self._marks):
            return None
        mark = self._marks[index]
        return {"time": mark.time / 1e9, "text": mark.text}

    @Slot(float, result="QVariant")
    def valuesAt(self, at: float) -> Any:
        """Return time and values at a share of the width, for the cursor."""
        if self._isXY or not math.isfinite(at):
            return {"time": "", "values": []}
        moment = self._end_ns - round(self._window * (1 - at) * 1e9)
        values = []
        for line in self._lines:
            text = ""
            if line.samples is not None:
                found = line.samples.before(moment + self._frame.columns.step)
                gap = round(self._gap * 1e9) or line.samples.gap_ns
                if found is not None and moment - found[0] <= gap:
                    text = number_text(found[1])
            values.append(text)
        return {"time": clock_text(moment / 1e9), "values": values}

    @Slot(str)
    def saveCsv(self, file: str) -> None:
        """Write all samples to a file in the background; a signal reports the end."""
        url = QtCore.QUrl(file)
        path = url.toLocalFile() if url.isLocalFile() else file
        # A view on the present samples; what arrives while they are written is not among them.
        lines = [
            (line.name, line.samples, line.x_samples)
            for line in self._lines
            if line.samples is not None
        ]
        marks = list(self._marks)
        session = self._session
        if session is None or not path:
            self.saveFailed.emit(
                "there is no file name" if not path else f"{path}: there is no robot yet"
            )
            return

        executor, done = session.executor, weak_callback(self._on_saved)

        def write() -> None:
            problem = ""
            try:
                _write_csv(Path(path), lines, marks)
            except OSError as error:
                problem = f"{path}: {error.strerror or error}"
            executor.post(lambda: done(path, problem))

        # Not the session's worker, which creates endpoints: it may take a minute.
        threading.Thread(target=write, name="plot to CSV", daemon=True).start()

    def _on_saved(self, path: str, problem: str) -> None:
        if is_alive(self) and problem:
            self.saveFailed.emit(problem)
        elif is_alive(self):
            self.saved.emit(path)

    # -- what is wrong ---------------------------------------------------------------------------

    @Slot()
    def _on_connection(self) -> None:
        if self._session is not None and self._session.state != "connected":
            self._gone = True
        self._update_stale()

    @Slot()
    def _on_tick(self) -> None:
        self._tick_number += 1
        self._update_stale()
        if self._tick_number % _READING_TICKS == 0:
            self._rebuild()
            self._update_readings()
            self._report_problem()
            self._report_counts()

    def _update_stale(self) -> None:
        arrivals = [feed.arrived for feed in self._feeds.values() if feed.arrived is not None]
        age = max(0.0, self._steady() - max(arrivals)) if arrivals else -1.0
        session = self._session
        connected = session is not None and session.state == "connected"
        if connected and 0 <= age < 1:
            self._gone = False
        old = age < 0 or self._gone or not connected
        old = old or (self._timeout > 0 and age > self._timeout / 1000)
        if self._recorded is not None:
            # Of a recording, all times are shown at once, and none of them is now.
            age, old = 0.0, not connected
        report(self, age=age, stale=old)

    def _update_readings(self) -> None:
        readings = []
        for line in self._lines:
            feed = line.entry.feed
            value = (
                feed.latest[line.number] if feed and line.number < len(feed.latest) else math.nan
            )
            if self._recorded is not None and line.samples is not None:
                found = line.samples.before(self._recorded.moment)
                value = found[1] if found is not None else math.nan
            declared = line.entry.declared
            if declared is not None and is_alive(declared) and line.number == 0:
                report(
                    declared,
                    value=value,
                    unit=feed.unit if feed else "",
                    problem=_reason_of(line.entry),
                )
            is_empty = line.span is None
            readings.append("" if is_empty else number_text(float(f"{value:.5g}")))
        if readings != self._readings:
            self._readings = readings
            self.readingsChanged.emit()

    def _report_problem(self) -> None:
        problems = list(dict.fromkeys(filter(None, map(_problem_of, self._entries))))
        lines = sum(len(entry.feed.lines) for entry in self._entries if entry.feed)
        if lines > MAX_LINES:
            problems.append(f"{lines} lines are too many, and the first {MAX_LINES} are shown")
        if any(entry.x_path for entry in self._entries) and not all(
            entry.x_path for entry in self._entries
        ):
            problems.append("series with xPath and without need plots of their own")
        problems += self._clock_problems()
        for entry in self._entries:
            declared = entry.declared
            if declared is not None and is_alive(declared) and entry.problem:
                report(declared, problem=entry.problem)
        self._set_problem("; ".join(problems))

    def _clock_problems(self) -> Iterator[str]:
        """Name topics whose stamps are of different clocks, so that one is out of sight."""
        live = [feed for feed in self._feeds.values() if feed.arrived is not None]
        if len(live) < 2:
            return
        first = min(live, key=lambda feed: feed.offset_ns)
        last = max(live, key=lambda feed: feed.offset_ns)
        difference = (last.offset_ns - first.offset_ns) / 1e9
        if difference > _MAX_CLOCK_DIFFERENCE_S:
            yield (
                f"the stamps of {last.topic} are {difference:.0f} s ahead of those of "
                f"{first.topic}: set stamps: false to plot both by the time of reception"
            )

    def _report_counts(self) -> None:
        received = lost = malformed = 0
        for feed in self._feeds.values():
            received += feed.received
            malformed += feed.malformed
            lost += feed.lost
        removed = sum(line.samples.removed for line in self._lines if line.samples is not None)
        report(self, received=float(received), lost=float(lost + malformed), removed=float(removed))
        report(
            self,
            reading=round(self._recorded.progress, 2) if self._recorded is not None else 1.0,
            merged=float(sum(one.samples.merged for one in self._lines if one.samples is not None)),
        )


def _lines_of(entry: _Entry) -> Iterable[_Line]:
    feed = entry.feed
    if feed is None:
        return
    if not feed.lines:
        yield _Line(entry, None, None, entry.label, 0)
        return
    for index, samples in enumerate(list(feed.lines)):
        x_samples = feed.x_lines[index] if index < len(feed.x_lines) else None
        name = _element_name(entry.label, index) if feed.indexed else entry.label
        yield _Line(entry, samples, x_samples, name, index)


def _element_name(label: str, index: int) -> str:
    return label.replace("[*]", f"[{index}]") if "[*]" in label else f"{label}[{index}]"


def _problem_of(entry: _Entry) -> str:
    feed, topic = entry.feed, entry.topic
    if entry.problem or feed is None or topic is None:
        return entry.problem
    field = feed.problem or feed.value_problem
    if field:
        return f"{topic.topic}: {field}"
    if topic.problem:
        return f"{topic.topic}: {topic.problem}"
    problem = topic.subscription.problem if topic.subscription is not None else ""
    # Some begin with the topic: "/odom has two types".
    return problem if not problem or topic.topic in problem else f"{topic.topic}: {problem}"


def _reason_of(entry: _Entry) -> str:
    """Return why a series has no values, even if that is not a problem yet."""
    topic, reason = entry.topic, _problem_of(entry)
    if (
        not reason
        and topic is not None
        and topic.arrived is None
        and topic.subscription is not None
    ):
        reason = topic.subscription.hint
    return reason


def _as_js(ticks: list[tuple[float, str]]) -> list[dict[str, Any]]:
    return [{"at": at, "text": text} for at, text in ticks]


def _seconds(nanoseconds: int) -> str:
    sign = "-" if nanoseconds < 0 else ""
    whole, part = divmod(abs(nanoseconds), 1_000_000_000)
    return f"{sign}{whole}.{part:09d}"


def _quoted(text: str) -> str:
    if set(text) & set(',"\n\r'):
        return '"' + text.replace('"', '""') + '"'
    return text


def _write_csv(
    file: Path, lines: list[tuple[str, Samples, Samples | None]], marks: list[_Mark]
) -> None:
    """Write samples and marks: ``run,time,series,value``; the file is complete, or as before."""
    handle, name = tempfile.mkstemp(dir=file.parent, prefix=f".{file.name}.")
    try:
        with os.fdopen(handle, "w", encoding="utf-8", newline="") as out:
            out.write("run,time,series,value\r\n")
            for label, samples, x_samples in lines:
                _write_rows(out, _quoted(label), samples)
                if x_samples is not None:
                    _write_rows(out, _quoted(f"{label} (x)"), x_samples)
            for mark in marks:
                out.write(f",{_seconds(mark.time)},mark,{_quoted(mark.text)}\r\n")
        Path(name).replace(file)
    except OSError:
        Path(name).unlink(missing_ok=True)
        raise


def _write_rows(out: Any, label: str, samples: Samples) -> None:
    for run, (times, values) in enumerate(samples.runs()):
        for at in range(0, len(times), _CSV_ROWS):
            part = slice(at, at + _CSV_ROWS)
            out.write(
                "".join(
                    f"{run},{_seconds(time_ns)},{label},{value!r}\r\n"
                    for time_ns, value in zip(
                        times[part].tolist(), values[part].tolist(), strict=True
                    )
                )
            )
            time.sleep(0)  # let the interface draw
