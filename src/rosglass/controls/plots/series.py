"""The messages of a plot: one subscription for each topic, which are read by field paths.

A thread takes the messages of all topics thirty times a second and reads only the plotted fields,
all of a message in one call, so that receiving costs a fraction of what callbacks cost. No message
is converted for QML, and each one is counted.
"""

from __future__ import annotations

import logging
import threading
import time
from itertools import groupby
from operator import itemgetter
from typing import TYPE_CHECKING, Any

import numpy as np

from rosglass.comm.qos import Durability, History, QoS, Reliability
from rosglass.controls.plots.samples import Samples
from rosglass.errors import Error, FieldPathError, TypeNotFoundError
from rosglass.interfaces.names import ros1_name
from rosglass.messages import parse_path, resolve_path

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from rosglass.comm.inbox import Sample
    from rosglass.comm.node import Node
    from rosglass.comm.subscription import Subscription
    from rosglass.controls.plots.samples import Times
    from rosglass.messages import MessageType

__all__ = ["MAX_ELEMENTS", "FieldFeed", "PlotReceiver", "TopicFeed", "split_path"]

_log = logging.getLogger("rosglass.qml")
#: Elements of an array that are plotted.
MAX_ELEMENTS = 64
#: Seconds between two looks at the topics.
_PERIOD_S = 1 / 30
#: Looks between two counts of lost messages.
_TURNS_PER_COUNT = 10
#: Bytes of one topic's messages that may wait for the thread, the oldest are dropped and counted.
_MAX_WAITING_BYTES = 64 << 20
#: Samples of one line that are kept at most: 160 MB.
_MAX_SAMPLES = 10_000_000
#: Restarts of time within some seconds after which the stamps count as those of several clocks.
_MAX_RESTARTS, _RESTARTS_WITHIN_S = 4, 10.0
#: Longest time in nanoseconds that a message waits to be taken; and seconds after which the offset
#: of a publisher's clock is measured again.
_MAX_WAIT_NS, _OFFSET_PERIOD_S = 200_000_000, 10.0
#: Publishers whose clocks are compared with this machine's.
_MAX_PUBLISHERS = 256
#: Every message, as reliable and as old as its publishers allow.
_QOS = QoS(
    history=History.KEEP_ALL,
    reliability=Reliability.BEST_AVAILABLE,
    durability=Durability.BEST_AVAILABLE,
)

_type_and_wire = itemgetter(2, 1)


def split_path(path: str) -> tuple[str, str]:
    """Return the topic and the field path of ``/odom:twist.twist.linear.x``.

    Raises:
        FieldPathError: It is not of this form.
    """
    topic, colon, field = path.partition(":")
    if not colon or not topic or not field:
        raise FieldPathError(
            f"{path[:200]!r} is not a topic and a field; write it like /odom:twist.twist.linear.x"
        )
    parse_path(field)
    return topic, field


class FieldFeed:
    """The lines of one field path: one, or one for each element that ``[*]`` selects.

    Attributes:
        field: The field path.
        x_field: The path of the values that are plotted along the horizontal axis; empty for time.
        lines: The samples of the lines.
        x_lines: The horizontal values of each line, with the same times; empty for time.
        indexed: Whether each line is an element of an array.
        unit: The unit that the field's comment names; empty if it names none.
        problem: Why values are missing; empty if none are.
        latest: Latest value of each line.
    """

    def __init__(self, field: str, x_field: str = "") -> None:
        self.field, self.x_field = field, x_field
        self.lines: list[Samples] = []
        self.x_lines: list[Samples] = []
        self.indexed = False
        self.unit = self.problem = ""
        self.latest: list[float] = []
        #: The problem of the last values, and that of the type.
        self.value_problem = ""
        self._bin_ns = 0

    def check(self, kind: MessageType) -> None:
        """Check the paths against a type, and set the unit.

        Raises:
            FieldPathError: A path does not exist, or its values are not numbers.
        """
        self.unit, self.indexed = _check_field(kind, self.field)
        if self.x_field:
            _, indexed = _check_field(kind, self.x_field)
            if indexed and not self.indexed:
                raise FieldPathError(
                    f"{self.x_field} is an array, and {self.field} is not: plot [*] against [*]"
                )

    def add(self, times: Times, values: Sequence[Any], x_values: Sequence[Any] | None) -> None:
        """Add the values of as many messages as there are times."""
        self.value_problem = ""
        table = self._table(values)
        x_table = None if x_values is None else self._table(x_values)
        while len(self.lines) < table.shape[1]:
            self.lines.append(Samples(self._bin_ns, extremes=not self.x_field))
            self.latest.append(np.nan)
            if x_table is not None:
                self.x_lines.append(Samples(self._bin_ns, extremes=False))
        # Elements that are missing now have a gap.
        for at, line in enumerate(self.lines):
            column = table[:, at] if at < table.shape[1] else np.full(len(times), np.nan)
            line.add(times, column)
            self.latest[at] = float(column[-1])
            if x_table is not None:
                place = min(at, x_table.shape[1] - 1)
                missing = place < 0 or (at >= x_table.shape[1] > 1)
                horizontal = np.full(len(times), np.nan) if missing else x_table[:, place]
                self.x_lines[at].add(times, horizontal)

    def forget(self, before: int) -> None:
        """Drop samples before a time, and those that are too many."""
        for line in (*self.lines, *self.x_lines):
            line.forget(before, _MAX_SAMPLES)

    def merge_within(self, bin_ns: int) -> None:
        """Keep the extremes of such times only, of further samples; of curves, the first."""
        self._bin_ns = bin_ns
        for line in (*self.lines, *self.x_lines):
            line.bin_ns = bin_ns

    def restart(self) -> None:
        """Begin new runs, as times are those of another clock from now on."""
        for line in (*self.lines, *self.x_lines):
            line.restart()

    def clear(self) -> None:
        """Drop all samples."""
        for line in (*self.lines, *self.x_lines):
            line.clear()
        self.latest = [np.nan] * len(self.lines)

    def _table(self, values: Sequence[Any]) -> NDArray[np.float64]:
        """Return the values as rows of numbers, one for each message."""
        if not any(hasattr(value, "__len__") for value in values):
            return np.array(values, np.float64).reshape(-1, 1)
        # A value that could not be read is one NaN.
        values = [value if hasattr(value, "__len__") else () for value in values]
        longest = max(map(len, values))
        if longest > MAX_ELEMENTS:
            self.value_problem = (
                f"{self.field} has {longest} elements, and the first {MAX_ELEMENTS} are plotted: "
                f"select fewer, e.g. [0:{MAX_ELEMENTS}] or [3]"
            )
        table = np.full((len(values), min(longest, MAX_ELEMENTS)), np.nan)
        for row, elements in enumerate(values):
            count = min(len(elements), MAX_ELEMENTS)
            table[row, :count] = elements[:count]
        return table


def _check_field(kind: MessageType, field: str) -> tuple[str, bool]:
    """Return the unit of a field's values, and whether they are arrays."""
    route = resolve_path(kind.create()._schema__, field)
    member, step = route[-1]
    slices = sum(isinstance(one, slice) for _, one in route)
    is_open = member.is_array and step is None
    if member.struct is not None:
        inner = ", ".join(one.name for one in member.struct.members[:6])
        raise FieldPathError(
            f"{field} of {_shown(kind)} is a {member.field.type.name}, not a number; "
            f"plot one of its fields: {inner}"
        )
    if member.number is None:
        raise FieldPathError(
            f"{field} of {_shown(kind)} is a {member.field.type.name}, not a number"
        )
    if slices + is_open > 1:
        raise FieldPathError(f"{field} selects arrays of arrays: give one of the two an index")
    return member.field.unit, bool(slices or is_open)


def _shown(kind: MessageType) -> str:
    return ros1_name(kind.name) if kind.ros == 1 else kind.name


class TopicFeed:
    """The plotted fields of one topic.

    Attributes:
        topic: Absolute name of the topic.
        fields: The fields.
        use_stamps: Whether times are those of the messages' headers, if they have any.
        subscription: The subscription; None before it is created.
        problem: Why nothing is received, or in which way the times are not as expected.
        received: Number of messages.
        malformed: Number of messages that could not be read.
        lost: Number of messages that were lost on their way, or dropped as they came too fast.
        arrived: The node's steady time when messages were last taken; None before the first.
        offset_ns: How far the times of samples are ahead of this machine's clock.
        history_ns: Nanoseconds that samples are kept; 0 for no limit.
    """

    def __init__(self, topic: str) -> None:
        self.topic = topic
        self.fields: tuple[FieldFeed, ...] = ()
        self.use_stamps, self.history_ns = True, 0
        self.subscription: Subscription | None = None
        self._node: Node | None = None
        self.problem = self._time_problem = ""
        self.received = self.malformed = self.lost = self.offset_ns = 0
        self.arrived: float | None = None
        self._readers: dict[Any, _Reader | None] = {}
        self._clocks: dict[bytes, list[float]] = {}
        self._mixes_clocks = False
        self._restarts, self._restarts_since = 0, 0.0

    def set_fields(self, fields: tuple[FieldFeed, ...], *, use_stamps: bool) -> None:
        """Replace the fields, from any thread."""
        if use_stamps != self.use_stamps:
            self.use_stamps = use_stamps
            self._mixes_clocks = False
            for field in fields:
                field.restart()
        if fields != self.fields:
            self.fields, self._readers = fields, {}

    def clear(self) -> None:
        """Drop all samples, and what was learned about the publishers' clocks."""
        self._clocks.clear()
        self._mixes_clocks, self._time_problem, self.arrived = False, "", None
        for field in self.fields:
            field.clear()

    def subscribe(self, node: Node) -> None:
        """Subscribe, unless that has been done."""
        if self.subscription is not None and self._node is node:
            return
        self.unsubscribe(self._node)
        self._node = node
        try:
            self.subscription = node.create_subscription(self.topic, None, qos=_QOS)
            self.subscription.set_inbox_limit(_MAX_WAITING_BYTES)
            self.problem = ""
        except Error as error:
            self.problem = str(error)

    def unsubscribe(self, node: Node | None) -> None:
        """Close the subscription, if it is one of a node; the samples stay."""
        if node is not self._node:
            return  # a new node has subscribed before the end of this one
        subscription, self.subscription = self.subscription, None
        if subscription is not None:
            subscription.close()

    def take(self, now: float) -> None:
        """Take and read what has arrived."""
        subscription = self.subscription
        if subscription is None:
            return
        samples = subscription.take_all()
        if not samples:
            return
        fields = self.fields
        for (kind, wire), group in groupby(samples, _type_and_wire):
            self._read(kind, wire, fields, list(group))
        # Not before: those that are counted can be read.
        self.received += len(samples)
        self.arrived = now
        self.problem = self._time_problem

    def count_lost(self) -> None:
        """Update the number of lost messages; not on the GUI thread: it receives what waits."""
        if self.subscription is not None:
            statistics = self.subscription.statistics()
            self.lost = statistics.dropped + statistics.lost

    def read(self, kind: MessageType, wire: str, samples: list[Sample]) -> None:
        """Read messages of one type."""
        self._read(kind, wire, self.fields, samples)

    def _read(
        self, kind: MessageType, wire: str, fields: tuple[FieldFeed, ...], samples: list[Sample]
    ) -> None:
        key = kind, wire, fields
        if key not in self._readers:
            if len(self._readers) > 8:
                self._readers.clear()  # types that alternate must not pile up
            self._readers[key] = _Reader.make(kind, wire, fields)
        reader = self._readers[key]
        if reader is None:
            return
        rows, kept = reader.read(samples)
        self.malformed += len(samples) - len(rows)
        if not rows:
            return
        columns = list(zip(*rows, strict=True))
        times = self._times(kept, columns[:2] if reader.has_stamp else None)
        reader.pass_on(columns, times)
        for field in reader.fields:
            if self.history_ns and field.lines:
                span = field.lines[0].span
                field.forget(span[1] - self.history_ns if span else 0)
        self._watch_restarts(reader.fields)

    def _times(self, samples: list[Sample], stamps: Any) -> Times:
        """Return the times of samples, in nanoseconds."""
        arrivals = self._arrivals(samples)
        if stamps is None or not self.use_stamps or self._mixes_clocks:
            self.offset_ns = 0
            return arrivals
        times = np.array(stamps[0], np.int64) * 1_000_000_000 + np.array(stamps[1], np.int64)
        missing = times <= 0
        if missing.any():
            times[missing] = arrivals[missing]
        self.offset_ns = int(times[-1]) - int(arrivals[-1])
        return times

    def _arrivals(self, samples: list[Sample]) -> Times:
        """Return when samples arrived.

        Those taken together have one time of reception. Where their publisher stamps them, they
        are spread by that, as the fastest of its samples arrived.
        """
        received = np.array([sample[3] for sample in samples], np.int64)
        for gid, group in groupby(range(len(samples)), lambda at: samples[at][5]):
            places = list(group)
            first, end = places[0], places[-1] + 1
            sent = [samples[at][4] for at in places]
            if None in sent:
                continue
            times = np.array(sent, np.int64)
            delay = int((received[first:end] - times).min())
            fastest = self._fastest(gid, delay)
            times += fastest
            np.minimum(times, received[first:end], out=times)
            received[first:end] = np.maximum(times, received[first:end] - _MAX_WAIT_NS)
        return received

    def _fastest(self, gid: bytes, delay: int) -> int:
        """Return the least delay of a publisher's samples lately, its clock's offset included."""
        now = time.monotonic()
        if gid not in self._clocks and len(self._clocks) >= _MAX_PUBLISHERS:
            self._clocks.clear()
        known = self._clocks.setdefault(gid, [delay, delay, now])
        if now - known[2] > _OFFSET_PERIOD_S:
            known[:] = [known[1], delay, now]
        known[0], known[1] = min(known[0], delay), min(known[1], delay)
        return int(known[0])

    def _watch_restarts(self, fields: Sequence[FieldFeed]) -> None:
        """Use times of reception where the stamps are those of several clocks."""
        total = sum(line.restarts for field in fields for line in field.lines[:1])
        now = time.monotonic()
        if now - self._restarts_since > _RESTARTS_WITHIN_S:
            self._restarts, self._restarts_since = total, now
        elif total - self._restarts > _MAX_RESTARTS * max(1, len(fields)):
            self._mixes_clocks = True
            self._restarts = total
            for field in fields:
                field.restart()
            self._time_problem = (
                "the stamps of its headers go back again and again, as those of several clocks do: "
                "the times of reception are used"
            )


class _Reader:
    """Reads the plotted fields of one type."""

    def __init__(
        self,
        fields: list[FieldFeed],
        read: Callable[[Any], tuple[Any, ...]],
        single: list[Callable[[Any], Any]],
        has_stamp: bool,
    ) -> None:
        self.fields, self.has_stamp = fields, has_stamp
        self._read, self._single = read, single

    @classmethod
    def make(cls, kind: MessageType, wire: str, fields: tuple[FieldFeed, ...]) -> _Reader | None:
        """Return the reader of a type; None, and problems set, if it has none of the fields."""
        good, paths = [], []
        has_stamp = False
        for field in fields:
            try:
                field.check(kind)
            except (FieldPathError, TypeNotFoundError) as error:
                field.problem = str(error)
                continue
            field.problem = ""
            good.append(field)
            paths += [field.field, *([field.x_field] if field.x_field else [])]
        if not good:
            return None
        if kind.has_header:
            has_stamp = True
            names = ("secs", "nsecs") if kind.ros == 1 else ("sec", "nanosec")
            paths = [f"header.stamp.{name}" for name in names] + paths
        single = [kind.path(path, wire=wire) for path in paths]
        read = kind.path(*paths, wire=wire) if len(paths) > 1 else lambda data: (single[0](data),)
        return cls(good, read, single, has_stamp)

    def read(self, samples: list[Sample]) -> tuple[list[tuple[Any, ...]], list[Sample]]:
        """Return the values of each sample, and the samples that could be read."""
        read = self._read
        try:
            rows = [read(sample[0]) for sample in samples]
        except Error:
            return self._read_each(samples)
        for field in self.fields:
            field.problem = ""
        return rows, samples

    def _read_each(self, samples: list[Sample]) -> tuple[list[tuple[Any, ...]], list[Sample]]:
        """Read the fields one by one, as some are missing: an index is beyond an array."""
        rows, kept, problems = [], [], [""] * len(self._single)
        for sample in samples:
            row = []
            for at, read in enumerate(self._single):
                try:
                    row.append(read(sample[0]))
                except FieldPathError as error:  # noqa: PERF203 - rare
                    row.append(np.nan)
                    problems[at] = str(error)
                except Error as error:
                    problems = [f"a malformed message was refused: {error}"] * len(problems)
                    break
            else:
                rows.append(tuple(row))
                kept.append(sample)
        at = 2 if self.has_stamp else 0
        for field in self.fields:
            width = 2 if field.x_field else 1
            field.problem = next(filter(None, problems[at : at + width]), "")
            at += width
        return rows, kept

    def pass_on(self, columns: list[tuple[Any, ...]], times: Times) -> None:
        """Add the values of messages to the lines of their fields."""
        at = 2 if self.has_stamp else 0
        for field in self.fields:
            values = columns[at]
            x_values = columns[at + 1] if field.x_field else None
            at += 2 if field.x_field else 1
            field.add(times, values, x_values)


class PlotReceiver:
    """The thread that receives the topics of one plot.

    Args:
        node: The node.
    """

    def __init__(self, node: Node) -> None:
        self._node = node
        self._feeds: dict[str, TopicFeed] = {}
        self._open: dict[str, TopicFeed] = {}
        #: Set when the thread has to end.
        self._end = threading.Event()
        self._thread: threading.Thread | None = None

    def set_feeds(self, feeds: dict[str, TopicFeed]) -> None:
        """Receive these topics from now on; from the GUI thread."""
        self._feeds = dict(feeds)
        if self._thread is None and feeds and not self._end.is_set():
            self._thread = threading.Thread(target=self._work, name="plot", daemon=True)
            self._thread.start()

    def close(self) -> None:
        """Stop receiving; safe to call twice."""
        self._end.set()
        thread = self._thread
        if thread is not None and thread is not threading.current_thread():
            thread.join(2.0)

    def _work(self) -> None:
        turn = 0
        try:
            while not self._end.wait(_PERIOD_S):
                turn += 1
                self._follow(self._feeds)
                now = self._node.steady()
                for feed in self._open.values():
                    try:
                        feed.take(now)
                        if turn % _TURNS_PER_COUNT == 0:
                            feed.count_lost()
                    except Exception as error:  # noqa: BLE001, PERF203 - peers must not end the thread
                        _log.exception("plot of %s", feed.topic)
                        feed.problem = f"its messages could not be read: {error!r}"
        finally:
            self._follow({})

    def _follow(self, feeds: dict[str, TopicFeed]) -> None:
        """Open and close subscriptions as the plot requires."""
        if feeds.keys() == self._open.keys() and all(
            feed.subscription is not None for feed in self._open.values()
        ):
            return
        for topic in self._open.keys() - feeds.keys():
            self._open.pop(topic).unsubscribe(self._node)
        for topic, feed in feeds.items():
            self._open[topic] = feed
            feed.subscribe(self._node)
