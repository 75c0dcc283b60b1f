"""The fields of a plot, read from a whole recording instead of received while it is played."""

from __future__ import annotations

import logging
import threading
from typing import TYPE_CHECKING

from rosglass.bags import open_bag
from rosglass.comm.inbox import Sample
from rosglass.controls.plots.series import TopicFeed
from rosglass.errors import Error

if TYPE_CHECKING:
    from rosglass.bags import Channel, ReplayNode
    from rosglass.controls.plots.series import FieldFeed

__all__ = ["RecordingReader"]

_log = logging.getLogger("rosglass.qml")
#: Samples of one line that are kept, about; of more, the extremes of short times. About 6 MB.
_MAX_SAMPLES = 1 << 18
#: Messages, and their bytes, that are read at once.
_MAX_BATCH, _MAX_BATCH_BYTES = 1000, 8 << 20
#: Seconds that the thread waits between two batches, so that the interface can draw.
_PAUSE_S = 0.001
#: Nanoseconds by which stamps must be off the times of reception to count as another clock.
_OTHER_CLOCK_NS = 60_000_000_000


class RecordingReader:
    """Reads the plotted fields of all messages of a recording, on a thread of its own.

    Args:
        node: The node that plays the recording.

    Attributes:
        progress: Share of the recording that was read, 1 at the end.
        offset_ns: How far stamps are ahead of the times of reception, if they are of another clock.
    """

    def __init__(self, node: ReplayNode) -> None:
        self._playback = node.playback
        self.progress = 1.0
        self.offset_ns = 0
        self._feeds: dict[str, TopicFeed] = {}
        #: Fields that were read, and whether by their stamps.
        self._done: dict[FieldFeed, bool] = {}
        #: Guards what is above; notified when there is something to read.
        self._changed = threading.Condition()
        self._closed = False
        self._thread: threading.Thread | None = None

    @property
    def span(self) -> tuple[int, int]:
        """Times of the beginning and end of the recording, in nanoseconds of the stamps' clock."""
        start = self._playback.start + self.offset_ns
        return start, start + round(self._playback.duration * 1e9)

    @property
    def moment(self) -> int:
        """The time that is played, in nanoseconds of the stamps' clock."""
        return self._playback.moment + self.offset_ns

    def set_feeds(self, feeds: dict[str, TopicFeed]) -> None:
        """Read these topics as well, unless that was done; from the GUI thread."""
        with self._changed:
            self._feeds = dict(feeds)
            wanted = {field for feed in feeds.values() for field in feed.fields}
            self._done = {field: by for field, by in self._done.items() if field in wanted}
            if self._thread is None and feeds and not self._closed:
                self._thread = threading.Thread(target=self._work, name="plot", daemon=True)
                self._thread.start()
            self._changed.notify_all()

    def close(self) -> None:
        """Stop reading; safe to call twice."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()
        thread = self._thread
        if thread is not None and thread is not threading.current_thread():
            thread.join(2.0)

    def _unread(self) -> dict[TopicFeed, tuple[FieldFeed, ...]]:
        found = {}
        for feed in self._feeds.values():
            fields = tuple(one for one in feed.fields if self._done.get(one) != feed.use_stamps)
            if fields:
                found[feed] = fields
        return found

    def _work(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._closed or self._unread())
                if self._closed:
                    return
                unread = self._unread()
                self._done.update(
                    (field, feed.use_stamps) for feed, fields in unread.items() for field in fields
                )
            try:
                self._read(unread)
            except Exception as error:  # noqa: BLE001 - damaged files must not end the thread
                if not isinstance(error, Error):
                    _log.exception("plot of %s", self._playback.path)
                for feed in unread:
                    feed.problem = str(error) or repr(error)
            self.progress = 1.0

    def _read(self, unread: dict[TopicFeed, tuple[FieldFeed, ...]]) -> None:
        for fields in unread.values():
            for field in fields:
                field.clear()
                field.merge_within(0)
        by_topic = {feed.topic: feed for feed in unread}
        with open_bag(self._playback.path) as bag:
            channels = [one for one in bag.channels if one.topic in by_topic]
            for topic in by_topic.keys() - {one.topic for one in channels}:
                by_topic[topic].problem = f"{bag.path.name} has no such topic"
            readers = {}
            for channel in channels:
                reader = readers[channel] = _ChannelReader(channel, by_topic[channel.topic])
                reader.feed.set_fields(unread[reader.owner], use_stamps=reader.owner.use_stamps)
                if not 0 <= channel.count <= _MAX_SAMPLES:
                    bin_ns = max(1, (bag.end - bag.start) * 2 // _MAX_SAMPLES)
                    for field in unread[reader.owner]:
                        field.merge_within(bin_ns)
            count = size = 0
            length = max(1, bag.end - bag.start)
            for message in bag.messages(channels) if channels else ():
                readers[message.channel].add(message.time, message.data)
                count, size = count + 1, size + len(message.data)
                if count < _MAX_BATCH and size < _MAX_BATCH_BYTES:
                    continue
                self._take(readers.values())
                count = size = 0
                self.progress = min(1.0, max(0.0, (message.time - bag.start) / length))
                with self._changed:
                    self._changed.wait_for(lambda: self._closed, _PAUSE_S)
                    if self._closed or not self._are_wanted(unread):
                        return
            self._take(readers.values())

    def _are_wanted(self, unread: dict[TopicFeed, tuple[FieldFeed, ...]]) -> bool:
        """Return whether fields are still plotted, by the same times."""
        return any(
            self._feeds.get(feed.topic) is feed
            and field in feed.fields
            and self._done.get(field) == feed.use_stamps
            for feed, fields in unread.items()
            for field in fields
        )

    def _take(self, readers: object) -> None:
        for reader in readers:  # type: ignore[attr-defined]
            reader.take()
            offset = reader.feed.offset_ns
            if abs(offset) > _OTHER_CLOCK_NS and not self.offset_ns:
                self.offset_ns = offset


class _ChannelReader:
    """Reads the fields of one channel.

    Attributes:
        feed: Reads the fields that are new.
        owner: The topic of the plot, which counts.
    """

    def __init__(self, channel: Channel, owner: TopicFeed) -> None:
        self.owner, self.feed = owner, TopicFeed(channel.topic)
        self._type, self._wire = channel.type(), channel.wire
        self._waiting: list[Sample] = []

    def add(self, time: int, data: bytes) -> None:
        """Add a message, which is read by the next :meth:`take`."""
        self._waiting.append(Sample(data, self._wire, self._type, time))

    def take(self) -> None:
        """Read what was added."""
        waiting, self._waiting = self._waiting, []
        if not waiting:
            return
        before = self.feed.malformed
        self.feed.read(self._type, self._wire, waiting)
        self.owner.received += len(waiting)
        self.owner.malformed += self.feed.malformed - before
        for field in self.feed.fields:
            field.forget(-1 << 62)
