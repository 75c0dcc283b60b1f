"""Recording topics to a file: MCAP, or a ROS 1 bag."""

from __future__ import annotations

import logging
import re
import threading
import time
from collections import Counter, deque
from concurrent.futures import wait
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

from rosglass.comm import IMMEDIATE, Handle, QoS, Sample
from rosglass.comm.names import similar
from rosglass.errors import BagError, Error, NodeClosedError
from rosglass.messages import MessageType, OpaqueType, load

if TYPE_CHECKING:
    import os
    from collections.abc import Iterable

    from rosglass.bags.bag import RecordingFile
    from rosglass.comm import Node, Promise, Subscription

__all__ = ["DEFAULT_COMPRESSION", "MARKS_TOPIC", "Recorder", "RecordingStatus", "create"]

#: Topic of the event marks in a recording, of type std_msgs/String.
MARKS_TOPIC = "/recording/marks"


#: The compressions of each format, and its default.
_COMPRESSIONS = {".mcap": ("zstd", "lz4", "none"), ".bag": ("none", "lz4", "bz2")}
DEFAULT_COMPRESSION = {".mcap": "zstd", ".bag": "none"}


def create(path: Path, wire: str, compression: str) -> RecordingFile:
    """Return a new recording: a ROS 1 bag for ``.bag``, MCAP for any other name.

    Args:
        path: The file; it must not exist.
        wire: Wire format of all messages, ``cdr`` or ``ros1``.
        compression: ``zstd`` (MCAP), ``lz4``, ``bz2`` (ROS 1 bags) or ``none``; empty for the
            format's own.

    Raises:
        BagError: The file cannot be written, or cannot hold such messages.
    """
    kind = ".bag" if path.suffix == ".bag" else ".mcap"
    compression = compression or DEFAULT_COMPRESSION[kind]
    if compression not in _COMPRESSIONS[kind]:
        raise BagError(
            f"{kind} files have no compression {compression!r}: {', '.join(_COMPRESSIONS[kind])}"
        )
    if kind == ".bag" and wire != "ros1":
        raise BagError(f"{path} would be a ROS 1 bag, and this is ROS 2: name it .mcap")
    try:
        file = path.open("xb")
    except OSError as error:
        hints = {
            FileExistsError: "; choose another name",
            FileNotFoundError: f": make the folder {path.parent} first",
        }
        hint = hints.get(type(error), "")
        raise BagError(f"{path} cannot be written: {error.strerror}{hint}") from error
    return _make(path, file, wire, compression)


def _make(path: Path, file: BinaryIO, wire: str, compression: str) -> RecordingFile:
    if path.suffix == ".bag":
        from rosglass.bags.ros1_bag_file import Ros1BagFile  # noqa: PLC0415 - rosbags is an extra

        return Ros1BagFile(path, file, compression)
    from rosglass.bags.mcap_file import McapFile  # noqa: PLC0415 - mcap is an extra

    return McapFile(file, wire, compression)


_log = logging.getLogger("rosglass.bags")
#: Seconds between two writes of the chunk in progress: half of the loss in a crash, as a busy
#: machine may be late.
_FLUSH_INTERVAL_S = 0.5
#: Samples that a subscription keeps while the writer is busy.
_DEPTH = 1000
#: Timeouts in seconds for fetching a definition from the robot, and the same while closing.
_FETCH_TIMEOUT_S, _LAST_FETCH_TIMEOUT_S = 5.0, 2.0
#: Seconds that closing waits for received messages to be written.
_CLOSE_TIMEOUT_S = 60.0
_LONGEST_MARK = 1000
_MARKS_PUBLISHER = b"/recorder"


@dataclass(frozen=True, slots=True)
class RecordingStatus:
    """The progress of a recording.

    Attributes:
        topics: Messages written, by topic.
        dropped: Messages that were received faster than they could be written.
        size: Size of the file in bytes.
        duration: Seconds since the start.
        problems: Why topics are not recorded, by topic.
        ended: Why nothing more is recorded: a limit was reached; empty while recording.
        marks: Number of event marks.
    """

    topics: dict[str, int]
    dropped: int
    size: int
    duration: float
    problems: dict[str, str]
    ended: str = ""
    marks: int = 0

    @property
    def messages(self) -> int:
        """Total number of messages written."""
        return sum(self.topics.values())


class Recorder(Handle):
    """Records topics to a file, with QoS profiles compatible with their publishers, until closed.

    Messages are stored as received, with the definitions of their types, so that the file can be
    played anywhere; types whose definition is unknown are stored by name and hash. Messages of a
    type whose definition is fetched from the robot are held until it answers. If the program is
    killed, the file lacks at most the last second; a ROS 1 bag needs ``rosbag reindex`` then.

    Args:
        node: Node that subscribes.
        path: File to write; it must not exist. In ROS 1, a name that ends with ``.bag`` creates a
            ROS 1 bag; any other creates an MCAP file.
        topics: Names of topics, absolute or relative; empty for all topics, present and future,
            except hidden ones.
        include: Regular expression; topics whose full name matches are recorded as well.
        exclude: Regular expression; topics whose full name matches are never recorded.
        hidden: Whether "all" includes hidden topics, such as those of actions.
        compression: ``zstd`` (MCAP only), ``lz4``, ``bz2`` (ROS 1 bags only) or ``none``; empty for
            ``zstd`` in MCAP and ``none`` in ROS 1 bags, as with ``rosbag record``.
        memory: Bytes of messages that may wait for the disk or for their type; further ones are
            dropped, counted and logged.
        max_size: Bytes of the file after which nothing more is recorded; exceeded by what is
            written at once, about a megabyte. 0 for no limit.
        max_duration: Seconds after which nothing more is recorded; 0 for no limit.

    Raises:
        BagError: The file cannot be written, or an argument is invalid.
        InvalidNameError: A topic's name breaks ROS's rules.
    """

    def __init__(
        self,
        node: Node,
        path: str | os.PathLike[str],
        topics: Iterable[str] = (),
        *,
        include: str = "",
        exclude: str = "",
        hidden: bool = False,
        compression: str = "",
        memory: int = 256 * 2**20,
        max_size: int = 0,
        max_duration: float = 0.0,
    ) -> None:
        if isinstance(topics, str):
            raise BagError(f"topics are given as a list, e.g. [{topics!r}]")
        for name, limit in (("max_size", max_size), ("max_duration", max_duration)):
            if not 0 <= limit < float("inf"):
                raise BagError(f"{name} must be a number from 0 (no limit), got {limit!r}")
        self.path = Path(path)
        self._node, self._memory, self._hidden = node, memory, hidden
        self._ros2 = node.wire == "cdr"
        self._topics = frozenset(node.resolve(topic) for topic in topics)
        self._include = _expression(include, "include")
        self._exclude = _expression(exclude, "exclude")
        self._lock = threading.Condition()
        self._queue: deque[tuple[str, Sample]] = deque()
        self._waiting = self._dropped = self._size = 0
        self._lost: dict[str, int] = {}
        self._failure = self._ended = ""
        self._max_size, self._max_duration = max_size, max_duration
        self._marks = 0
        self._started = time.monotonic()
        #: When it ended by itself.
        self._ended_at: float | None = None
        self._subscriptions: dict[tuple[str, str], Subscription] = {}
        self._begun: set[tuple[str, str]] = set()
        self._failed: dict[str, str] = {}
        self._counts: dict[str, int] = {}
        self._channels: dict[tuple[str, str, str, bytes], int] = {}
        #: Definitions being fetched from the robot, and the messages that wait for them.
        self._fetches: dict[tuple[str, str], Promise[Any]] = {}
        self._held: dict[tuple[str, str], list[tuple[str, Sample]]] = {}
        self._closed = False
        self._file = create(self.path, node.wire, compression)
        self._thread = threading.Thread(target=self._work, name="recorder", daemon=True)
        self._thread.start()
        self._graph = node.on_graph_change(self._on_graph_change)
        self._on_graph_change()

    def status(self) -> RecordingStatus:
        """Return the progress.

        Raises:
            BagError: The disk is full, or the file cannot be written for another reason; recording
                has stopped.
        """
        if self._failure:
            raise BagError(self._failure)
        with self._lock:
            problems = dict(self._failed) | {
                topic: f"its type {name} is being fetched from the robot; its messages wait for it"
                for (name, _), held in self._held.items()
                for topic, _ in held[:1]
            }
            types = Counter(topic for topic, _ in self._subscriptions)
            for (topic, _), subscription in self._subscriptions.items():
                # Where a topic has several types, each subscription reports the others as problem.
                is_one_of_several = types[topic] > 1 and subscription.type is not None
                if subscription.problem and not is_one_of_several:
                    problems[topic] = subscription.problem
            for topic in sorted(self._topics - types.keys() - problems.keys()):
                problems[topic] = f"no publisher{self._find_similar(topic)}"
            counts = {topic: self._counts.get(topic, 0) for topic in sorted(types)}
            counts.pop(MARKS_TOPIC, None)
            duration = (self._ended_at or time.monotonic()) - self._started
            return RecordingStatus(
                counts, self._dropped, self._size, duration, problems, self._ended, self._marks
            )

    def mark(self, text: str) -> None:
        """Write an event mark with the present time: a message of :data:`MARKS_TOPIC`.

        Args:
            text: Its text, at most 1000 characters.

        Raises:
            BagError: The text is too long, or nothing more is recorded.
        """
        if not isinstance(text, str) or len(text) > _LONGEST_MARK:
            raise BagError(f"a mark is a text of at most {_LONGEST_MARK} characters")
        if self._failure or self._ended or self._closed:
            raise BagError(self._failure or self._ended or f"{self.path} is complete")
        kind = load("std_msgs/msg/String", ros=2 if self._ros2 else 1)
        assert isinstance(kind, MessageType)
        now, wire = time.time_ns(), self._node.wire
        data = bytes(kind.encode({"data": text}, wire=wire))
        sample = Sample(data, wire, kind, now, now, _MARKS_PUBLISHER)
        with self._lock:
            self._marks += 1
            self._waiting += len(data)
            self._queue.append((MARKS_TOPIC, sample))
            self._lock.notify_all()

    def close(self) -> None:
        """Stop, write what was received, and complete the file; safe to call twice.

        Raises:
            BagError: The file could not be completed.
        """
        with self._lock:
            if self._closed:
                return
            self._closed = True
            subscriptions = list(self._subscriptions.values())
        self._graph.close()
        for subscription in subscriptions:
            subscription.close()
        with self._lock:
            self._lock.notify_all()
        self._thread.join(_CLOSE_TIMEOUT_S)
        if self._thread.is_alive():
            raise BagError(f"{self.path} is incomplete: the disk is too slow or blocked")
        if self._failure:
            raise BagError(self._failure)

    def _on_graph_change(self) -> None:
        try:
            found = self._node.topics()
        except NodeClosedError:
            return
        for topic in sorted(found):
            if not self._wants(topic):
                continue
            types = {p.type for p in self._node.publishers(topic)}
            # In ROS 1, the connection announces the type; the master may not know it.
            for type_name in sorted(types) if self._ros2 else ("",):
                self._subscribe(topic, type_name)

    def _wants(self, topic: str) -> bool:
        if self._exclude is not None and self._exclude.fullmatch(topic):
            return False
        if topic in self._topics:
            return bool(self._node.publishers(topic))
        if self._include is not None:
            chosen = bool(self._include.fullmatch(topic))
        else:
            hidden = self._ros2 and any(part.startswith("_") for part in topic.split("/"))
            chosen = not self._topics and (self._hidden or not hidden)
        return chosen and bool(self._node.publishers(topic))

    def _find_similar(self, topic: str) -> str:
        with suppress(NodeClosedError):  # then there is no hint
            known = [name for name in self._node.topics() if self._node.publishers(name)]
            return similar(topic, known)
        return ""

    def _subscribe(self, topic: str, type_name: str) -> None:
        with self._lock:
            # Graph changes may be handled concurrently.
            if self._closed or (topic, type_name) in self._begun:
                return
            self._begun.add((topic, type_name))
        try:
            subscription = self._open(topic, type_name or None)
            if subscription.type is None and type_name:
                # Record as bytes until the definition is fetched.
                subscription.close()
                subscription = self._open(topic, OpaqueType(type_name))
        except Error as error:
            if topic not in self._failed:
                _log.warning("%s is not recorded: %s", topic, error)
            self._failed[topic] = str(error)
            with self._lock:
                self._begun.discard((topic, type_name))
            return
        with self._lock:
            self._failed.pop(topic, None)
            self._subscriptions[topic, type_name] = subscription
            closed = self._closed
        if closed:
            subscription.close()

    def _open(self, topic: str, kind: str | MessageType | None) -> Subscription:
        return self._node.create_subscription(
            topic,
            kind,
            qos=QoS.best_available(_DEPTH),
            raw_callback=lambda sample: self._receive(topic, sample),
            executor=IMMEDIATE,
        )

    def _receive(self, topic: str, sample: Sample) -> None:
        size = len(sample.data)
        with self._lock:
            if self._failure or self._ended:
                return
            if self._waiting + size > self._memory and self._queue:
                self._dropped += 1
                self._lost[topic] = self._lost.get(topic, 0) + 1
                return
            self._waiting += size
            self._queue.append((topic, sample))
            self._lock.notify_all()

    def _work(self) -> None:
        flush_at = time.monotonic() + _FLUSH_INTERVAL_S
        try:
            while True:
                with self._lock:
                    self._lock.wait_for(
                        lambda: self._queue or self._closed or self._fetched_types(),
                        min(flush_at, self._ends_at()) - time.monotonic(),
                    )
                    batch, closed = list(self._queue), self._closed
                    self._queue.clear()
                    held = [len(sample.data) for each in self._held.values() for _, sample in each]
                    self._waiting = sum(held)
                    lost, self._lost = self._lost, {}
                for topic, sample in batch:
                    if not self._hold(topic, sample):
                        self._write(topic, sample, sample.type)
                if closed and not batch:
                    wait([self._fetches[key] for key in self._held], _LAST_FETCH_TIMEOUT_S)
                for key in self._fetched_types() if not closed or batch else list(self._held):
                    self._release(key)
                if lost:
                    counts = ", ".join(f"{count} of {topic}" for topic, count in lost.items())
                    _log.warning("%s: the disk is too slow, dropped %s", self.path, counts)
                if time.monotonic() >= flush_at:
                    self._file.flush()
                    flush_at = time.monotonic() + _FLUSH_INTERVAL_S
                self._size = self._file.size()
                self._check_limits()
                if closed and not batch:
                    break
            self._file.finish()
            self._file.close()  # writes what is buffered
        except Exception as error:  # noqa: BLE001 - of the disk or the format; shown as the failure
            reason = getattr(error, "strerror", None) or error
            self._failure = f"{self.path} cannot be written: {reason}; nothing more is recorded"
            _log.error(self._failure, exc_info=not isinstance(error, OSError))
            with suppress(OSError):  # the disk is still full
                self._file.close()

    def _ends_at(self) -> float:
        """Return the monotonic time of its end; infinite without a limit."""
        if not self._max_duration or self._ended:
            return float("inf")
        return self._started + self._max_duration

    def _check_limits(self) -> None:
        now, reason = time.monotonic(), ""
        if self._max_size and self._size >= self._max_size:
            reason = f"the limit of {self._max_size / 1e6:g} MB is reached"
        elif self._max_duration and now - self._started >= self._max_duration:
            reason = f"the limit of {self._max_duration:g} s is reached"
        if reason and not self._ended:
            with self._lock:
                self._ended, self._ended_at = reason, now
                self._queue.clear()

    def _hold(self, topic: str, sample: Sample) -> bool:
        """Hold a message whose definition is being fetched; return whether it is held."""
        kind = sample.type
        # ROS 1 publishers send their definition when they connect, or never.
        if not isinstance(kind, OpaqueType) or not self._ros2:
            return False
        key = (kind.name, kind.rihs01)
        if self._key(topic, sample) in self._channels:
            return False
        if key not in self._fetches:
            try:
                self._fetches[key] = self._node.fetch_type_async(
                    kind.name, hash=kind.rihs01, timeout=_FETCH_TIMEOUT_S
                )
            except Error as error:
                self._failed[topic] = f"recorded as bytes: {error}"
                return False
        with self._lock:
            self._held.setdefault(key, []).append((topic, sample))
        return True

    def _fetched_types(self) -> list[tuple[str, str]]:
        """Return the types whose fetch is done, and whose messages are held."""
        return [key for key in self._held if self._fetches[key].done()]

    def _release(self, key: tuple[str, str]) -> None:
        """Write the messages that were held for a type, whether it was fetched or not."""
        with self._lock:
            held = self._held.pop(key)
        fetch, known, reason = self._fetches[key], None, ""
        try:
            known = fetch.result(0)
        except Error as error:
            reason = f"recorded as bytes: {error}"
        for topic, sample in held:
            self._write(topic, sample, sample.type if known is None else known)
            if reason:
                self._failed[topic] = reason

    def _write(self, topic: str, sample: Sample, kind: MessageType) -> None:
        key = self._key(topic, sample)
        channel = self._channels.get(key)
        if channel is None:
            channel = self._channels[key] = self._file.channel(
                topic, kind, self._offered(topic, sample), key[-1]
            )
        self._file.write(channel, sample)
        self._counts[topic] = self._counts.get(topic, 0) + 1

    def _key(self, topic: str, sample: Sample) -> tuple[str, str, str, bytes]:
        """Return the key of a message's channel in the file."""
        kind = sample.type
        type_hash = kind.rihs01 if self._ros2 else kind.md5
        return topic, kind.name, type_hash, sample.publisher if self._file.by_publisher else b""

    def _offered(self, topic: str, sample: Sample) -> list[QoS]:
        """Return the QoS profiles of the publishers that may have sent a message."""
        publishers = self._node.publishers(topic)
        if self._file.by_publisher:
            name = sample.publisher.decode(errors="replace")
            publishers = [end for end in publishers if end.node.full == name]
        return [end.qos for end in publishers]


def _expression(text: str, what: str) -> re.Pattern[str] | None:
    try:
        return re.compile(text) if text else None
    except re.error as error:
        raise BagError(f"{what} {text!r} is not a regular expression: {error}") from error
