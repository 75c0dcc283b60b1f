"""Recording topics into a file: MCAP, or a ROS 1 bag."""

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
from typing import TYPE_CHECKING, Any

from rosglass.bags.recording_file import create
from rosglass.comm import IMMEDIATE, Handle, QoS
from rosglass.comm.names import similar
from rosglass.errors import BagError, Error, NodeClosedError
from rosglass.messages import OpaqueType

if TYPE_CHECKING:
    import os
    from collections.abc import Iterable

    from rosglass.comm import Node, Promise, Sample, Subscription
    from rosglass.messages import MessageType

__all__ = ["Recorder", "RecordingStatus"]

_log = logging.getLogger("rosglass.bags")
#: Seconds between two writes of the chunk in progress: half of what a crash may cost, as a busy
#: machine comes late.
_FLUSH_INTERVAL_S = 0.5
#: Samples that a subscription keeps while the writer is busy.
_DEPTH = 1000
#: Seconds that the robot may take to tell a definition, and that closing still waits for it.
_FETCH, _LAST_FETCH = 5.0, 2.0
#: Seconds that closing waits for what was received to be written.
_PATIENCE = 60.0


@dataclass(frozen=True, slots=True)
class RecordingStatus:
    """How a recording is doing.

    Attributes:
        topics: Messages written, by topic.
        dropped: Messages that came faster than they could be written.
        size: Bytes in the file so far.
        duration: Seconds since the start.
        problems: What keeps topics from being recorded, in words, by topic.
    """

    topics: dict[str, int]
    dropped: int
    size: int
    duration: float
    problems: dict[str, str]

    @property
    def messages(self) -> int:
        """Messages written in all."""
        return sum(self.topics.values())


class Recorder(Handle):
    """Writes topics into a file, each as its publishers offer it, until it is closed.

    Messages are stored as received, with the definitions of their types, so that the file can be
    played anywhere; types that nobody can describe are stored by name and hash. Messages of a type
    that the robot has to be asked for wait for its answer. What the file holds is complete up to a
    second before the program is killed; rosbag wants a ROS 1 bag reindexed then.

    Args:
        node: Where to listen.
        path: File to write; it must not exist. From ROS 1, a name that ends with ``.bag`` makes a
            ROS 1 bag; any other makes an MCAP file.
        topics: Names of topics, absolute or relative; empty for all that there are and that
            appear later, hidden ones excepted.
        include: Regular expression; topics whose whole name matches are recorded as well.
        exclude: Regular expression; topics whose whole name matches are never recorded.
        hidden: Whether hidden topics (of actions, say) are among "all".
        compression: ``zstd`` (MCAP only), ``lz4``, ``bz2`` (ROS 1 bags only) or ``none``; empty for
            ``zstd`` in MCAP, and none in ROS 1 bags, as ``rosbag record`` has it.
        memory: Bytes of messages that may wait for the disk, or for their type; what comes beyond
            is dropped, counted and logged.

    Raises:
        BagError: The file cannot be written, or an argument makes no sense.
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
    ) -> None:
        if isinstance(topics, str):
            raise BagError(f"topics are given as a list, e.g. [{topics!r}]")
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
        self._failure = ""
        self._started = time.monotonic()
        self._subscriptions: dict[tuple[str, str], Subscription] = {}
        self._begun: set[tuple[str, str]] = set()
        self._failed: dict[str, str] = {}
        self._counts: dict[str, int] = {}
        self._channels: dict[tuple[str, str, str, bytes], int] = {}
        #: Definitions that the robot is asked for, and the messages that wait for them.
        self._fetches: dict[tuple[str, str], Promise[Any]] = {}
        self._held: dict[tuple[str, str], list[tuple[str, Sample]]] = {}
        self._closed = False
        self._file = create(self.path, node.wire, compression)
        self._thread = threading.Thread(target=self._work, name="recorder", daemon=True)
        self._thread.start()
        self._graph = node.on_graph_change(self._follow)
        self._follow()

    def status(self) -> RecordingStatus:
        """Return counts as of now.

        Raises:
            BagError: The disk is full, or the file cannot be written for another reason; nothing
                more is recorded.
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
                # Each of several is told that the others are there.
                told = types[topic] > 1 and subscription.type is not None
                if subscription.problem and not told:
                    problems[topic] = subscription.problem
            for topic in sorted(self._topics - types.keys() - problems.keys()):
                problems[topic] = f"nobody publishes it{self._guess(topic)}"
            counts = {topic: self._counts.get(topic, 0) for topic in sorted(types)}
            duration = time.monotonic() - self._started
            return RecordingStatus(counts, self._dropped, self._size, duration, problems)

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
        self._thread.join(_PATIENCE)
        if self._thread.is_alive():
            raise BagError(f"{self.path} is cut short: the disk does not take it")
        if self._failure:
            raise BagError(self._failure)

    def _follow(self) -> None:
        try:
            found = self._node.topics()
        except NodeClosedError:
            return
        for topic in sorted(found):
            if not self._wants(topic):
                continue
            types = {p.type for p in self._node.publishers(topic)}
            # In ROS 1, a connection says what is sent, and the master may not know.
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

    def _guess(self, topic: str) -> str:
        with suppress(NodeClosedError):
            known = [name for name in self._node.topics() if self._node.publishers(name)]
            return similar(topic, known)
        return ""

    def _subscribe(self, topic: str, type_name: str) -> None:
        with self._lock:
            # Two changes of the graph may be looked at at once.
            if self._closed or (topic, type_name) in self._begun:
                return
            self._begun.add((topic, type_name))
        try:
            subscription = self._open(topic, type_name or None)
            if subscription.type is None and type_name:
                # Its definition is not here: what comes until the robot has told it counts, too.
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
            if self._failure:
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
                        lambda: self._queue or self._closed or self._told(),
                        flush_at - time.monotonic(),
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
                    wait([self._fetches[key] for key in self._held], _LAST_FETCH)
                for key in self._told() if not closed or batch else list(self._held):
                    self._release(key)
                if lost:
                    told = ", ".join(f"{count} of {topic}" for topic, count in lost.items())
                    _log.warning("%s: too much for the disk, lost %s", self.path, told)
                if time.monotonic() >= flush_at:
                    self._file.flush()
                    flush_at = time.monotonic() + _FLUSH_INTERVAL_S
                self._size = self._file.size()
                if closed and not batch:
                    break
            self._file.finish()
            self._file.close()  # writes what is buffered
        except Exception as error:
            reason = getattr(error, "strerror", None) or error
            self._failure = f"{self.path} cannot be written: {reason}; nothing more is recorded"
            _log.error(self._failure, exc_info=not isinstance(error, OSError))
            with suppress(OSError):  # the disk is still full
                self._file.close()

    def _hold(self, topic: str, sample: Sample) -> bool:
        """Keep a message whose type is not known yet; returns whether that was necessary."""
        kind = sample.type
        # ROS 1's publishers have told their definitions already, or never will.
        if not isinstance(kind, OpaqueType) or not self._ros2:
            return False
        key = (kind.name, kind.rihs01)
        if self._key(topic, sample) in self._channels:
            return False
        if key not in self._fetches:
            try:
                self._fetches[key] = self._node.fetch_type_async(
                    kind.name, hash=kind.rihs01, timeout=_FETCH
                )
            except Error as error:
                self._failed[topic] = f"recorded as bytes: {error}"
                return False
        with self._lock:
            self._held.setdefault(key, []).append((topic, sample))
        return True

    def _told(self) -> list[tuple[str, str]]:
        """Return the types that messages wait for no longer."""
        return [key for key in self._held if self._fetches[key].done()]

    def _release(self, key: tuple[str, str]) -> None:
        """Write the messages that waited for a type, which may have remained unknown."""
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
        """Return what a channel of the file has in common."""
        kind = sample.type
        told = kind.rihs01 if self._ros2 else kind.md5
        return topic, kind.name, told, sample.publisher if self._file.by_publisher else b""

    def _offered(self, topic: str, sample: Sample) -> list[QoS]:
        """Return the quality of service of those who may have sent a message."""
        publishers = self._node.publishers(topic)
        if self._file.by_publisher:
            name = sample.publisher.decode(errors="replace")
            publishers = [end for end in publishers if end.node.full == name]
        return [end.qos for end in publishers]


def _expression(text: str, what: str) -> re.Pattern[str] | None:
    try:
        return re.compile(text) if text else None
    except re.error as error:
        raise BagError(f"{what} {text!r} is no regular expression: {error}") from error
