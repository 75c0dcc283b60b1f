"""The common interface of all recording formats, and what their readers share."""

from __future__ import annotations

import bz2
import heapq
import io
import itertools
import logging
import sys
from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from importlib import import_module
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

import yaml

from rosglass.comm import Durability, Duration, Handle, History, Liveliness, QoS, Reliability
from rosglass.comm.text_files import load_yaml
from rosglass.errors import BagError, DefinitionError, Error
from rosglass.messages import MessageType, OpaqueType, load
from rosglass.messages.types import mend

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator, Sequence
    from pathlib import Path

    from rosglass.comm import Sample
    from rosglass.interfaces import Library

__all__ = [
    "CHUNK_LIMIT",
    "Bag",
    "BagMessage",
    "Channel",
    "LeftOut",
    "RecordingFile",
    "ScannedBag",
    "by_time",
    "decompress",
    "merge_chunks",
    "parse_profile",
    "read_profiles",
    "write_profiles",
]


@dataclass(frozen=True)
class Channel:
    """A topic of a recording, with one type.

    Attributes:
        topic: Absolute topic name.
        type_name: ``pkg/msg/Type``.
        wire: Format of the messages, ``cdr`` or ``ros1``.
        text: The recorded definition with those that it refers to; may be empty.
        encoding: Language of `text`: ``msg`` or ``idl``.
        type_hash: RIHS01 hash of the type, in ROS 1 its md5 sum; empty when the recording has none.
        offered: QoS profiles of the recorded publishers.
        count: Number of messages, -1 if it is unknown until they are read.
    """

    topic: str
    type_name: str
    wire: str
    text: str = ""
    encoding: str = "msg"
    type_hash: str = ""
    offered: tuple[QoS, ...] = ()
    count: int = -1

    def type(self, library: Library | None = None) -> MessageType:
        """Return the type, from the recording or else from `library`; opaque if neither has it.

        If the recorded definition cannot be used, a definition in `library` with the recorded hash
        replaces it.

        Raises:
            DefinitionError: The recorded definition has an error, and there is no hash.
        """
        ros = 1 if self.wire == "ros1" else 2
        known = "" if self.type_hash == "*" else self.type_hash
        reason = "the recording has no definition of it"
        if self.text:
            try:
                found = MessageType.from_text(
                    self.type_name, self.text, ros, encoding=self.encoding
                )
            except DefinitionError as error:
                if not known:
                    raise
                reason = str(error)
            else:
                if ros == 2 or known in ("", found.md5):
                    return found
                reason = f"the recording says md5 {known}, its definition has {found.md5}"
        try:
            loaded = load(self.type_name, ros=ros, library=library, hash=known)
        except Error as error:
            if ros == 1 and not known:
                raise
            mended = mend(self.type_name, self.text, known, library) if ros == 1 else None
            if mended is not None:
                return mended
            # Its messages can still be forwarded with the definition that their publisher sent.
            text = self.text if ros == 1 else ""
            reason = f"{reason}, and {error}"
            return OpaqueType(self.type_name, known, reason, text=text, ros=ros)
        assert isinstance(loaded, MessageType)
        return loaded

    def profile(self) -> QoS:
        """Return a profile compatible with all subscriptions to the recorded publishers."""
        if not self.offered:
            return QoS()
        return QoS.best_available(max(qos.depth for qos in self.offered)).for_subscription(
            self.offered
        )


class BagMessage(NamedTuple):
    """A recorded message.

    Attributes:
        channel: Its topic.
        time: Time of reception in nanoseconds since the Unix epoch.
        data: Payload in the channel's wire format.
    """

    channel: Channel
    time: int
    data: bytes


class Bag(Handle):
    """A recording that is open for reading; opened by :func:`rosglass.bags.open_bag`.

    Attributes:
        path: The file or folder.
        channels: Recorded topics, sorted by name.
        start: Time of the first message, in nanoseconds since the Unix epoch.
        end: Time of the last message.
        problem: Damage that does not prevent reading; empty if there is none.
    """

    path: Path
    channels: tuple[Channel, ...]
    start: int
    end: int
    problem: str = ""

    @property
    def duration(self) -> float:
        """Time from the first to the last message in seconds."""
        return (self.end - self.start) / 1e9

    @abstractmethod
    def messages(
        self,
        channels: Collection[Channel] | None = None,
        start: int | None = None,
        end: int | None = None,
    ) -> Iterator[BagMessage]:
        """Yield messages in order of time.

        Args:
            channels: Channels to read; None for all.
            start: First time in nanoseconds since the Unix epoch; None for the beginning.
            end: Time to stop before; None for the end.

        Raises:
            BagError: The file is damaged.
        """

    def times(self) -> Iterator[tuple[Channel, Sequence[int]]]:
        """Yield the times of all messages, in any order and in parts.

        Formats with an index read it instead of the messages.

        Raises:
            BagError: The file is damaged.
        """
        for message in self.messages():
            yield message.channel, (message.time,)


class RecordingFile(ABC):
    """A recording that is being written; used from one thread.

    Attributes:
        by_publisher: Whether the format stores the publisher of each message.
    """

    by_publisher = False

    @abstractmethod
    def channel(
        self, topic: str, kind: MessageType, offered: Sequence[QoS], publisher: bytes
    ) -> int:
        """Add a channel, and return its number.

        Args:
            topic: Absolute name.
            kind: Type of its messages; opaque if its definition is unknown.
            offered: QoS profiles of the topic's publishers.
            publisher: Name of the publishing node if the format is :attr:`by_publisher`.
        """

    @abstractmethod
    def write(self, channel: int, sample: Sample) -> None:
        """Write a message; raises OSError if the disk is full."""

    @abstractmethod
    def flush(self) -> None:
        """Write buffered messages to disk, so that they survive a crash of this program."""

    @abstractmethod
    def size(self) -> int:
        """Return the size of the file in bytes."""

    @abstractmethod
    def finish(self) -> None:
        """Write the index that completes the file."""

    @abstractmethod
    def close(self) -> None:
        """Close the file, complete or not; safe to call twice."""


_log = logging.getLogger("rosglass.bags")
#: Bytes of a chunk, or of a message that is compressed alone, after decompression.
CHUNK_LIMIT = 512 * 2**20
#: Bytes that lz4 is given room for at a time.
_PIECE = 16 * 2**20


def decompress(compression: str, data: bytes, size: int | None) -> bytes:
    """Return the content of a chunk, at most `size` bytes.

    Args:
        compression: ``zstd``, ``lz4`` or ``bz2``; ``none`` or empty for none.
        data: The chunk as stored in the file.
        size: Declared size of the content in bytes; None if it is unknown.

    Raises:
        BagError: It is damaged, or holds more bytes than declared or than :data:`CHUNK_LIMIT`.
    """
    if compression in ("", "none"):
        return data
    if compression not in _DECOMPRESSORS:
        raise BagError(f"its compression {compression!r:.40} is unknown")
    if size is not None and size > CHUNK_LIMIT:
        raise BagError(f"it declares {size} bytes, and {CHUNK_LIMIT} are the most")
    try:
        found = _DECOMPRESSORS[compression](data, CHUNK_LIMIT if size is None else size)
    except (ImportError, RuntimeError, OSError, EOFError, ValueError, MemoryError) as error:
        raise BagError(str(error) or type(error).__name__) from error
    if len(found) > (CHUNK_LIMIT if size is None else size):
        said = f"{CHUNK_LIMIT} bytes, the most" if size is None else f"the {size} bytes declared"
        raise BagError(f"it holds more than {said}")
    return found


def _zstd(data: bytes, size: int) -> bytes:
    library: Any = import_module("zstandard")  # with mcap; no types
    try:
        declared = library.frame_content_size(data)  # -1 when it is not in the frame
        if declared > size:
            raise BagError(
                f"its compressed data declares {declared} bytes, and {size} are the most"
            )
        # The library allocates no more than either size, and raises if there is more.
        return bytes(library.ZstdDecompressor().decompress(data, max_output_size=size))
    except library.ZstdError as error:
        raise BagError(str(error)) from error


def _lz4(data: bytes, size: int) -> bytes:
    library: Any = import_module("lz4.frame")  # with rosbags; no types
    unpacking = library.LZ4FrameDecompressor()
    parts, left = [], size + 1
    while left and not unpacking.eof:
        parts.append(unpacking.decompress(data, max_length=min(left, _PIECE)))
        data = b""
        if not parts[-1]:
            raise BagError("its compressed data ends too early")
        left -= len(parts[-1])
    return b"".join(parts)


def _bz2(data: bytes, size: int) -> bytes:
    with bz2.open(io.BytesIO(data)) as file:
        return bytes(file.read(size + 1))


_DECOMPRESSORS = {"zstd": _zstd, "lz4": _lz4, "bz2": _bz2}


class LeftOut:
    """The damaged parts of a recording that are skipped, each counted once.

    Args:
        path: The recording.
        part: Name of the parts, ``chunk`` or ``message``.
    """

    def __init__(self, path: Path, part: str) -> None:
        self._path, self._part = path, part
        self._places: set[str] = set()
        self._first = ""

    def add(self, place: str, error: Exception) -> None:
        """Count the part at a location in the recording, and log the first one."""
        if not self._places:
            self._first = f"{place}: {str(error) or type(error).__name__}"
            _log.warning("%s: a %s is left out, %s", self._path, self._part, self._first)
        self._places.add(place)

    def words(self) -> str:
        """Return the count, and the error of the first, as a text; empty if there are none."""
        if not self._places:
            return ""
        count = len(self._places)
        what = f"1 {self._part} is" if count == 1 else f"{count} {self._part}s are"
        return f"{what} damaged or too large and left out, the first {self._first}"


#: The number of its channel, the time of reception, and the payload of a message.
_Message: TypeAlias = tuple[int, int, bytes]
#: Number and bytes of the messages that are held to sort them.
_MAX_SORTED = 1000
_MAX_SORTED_BYTES = 256 * 2**20
#: Memory of a message in addition to its data, in bytes.
_OVERHEAD = 200


def merge_chunks(
    chunks: Iterable[tuple[int, Iterable[_Message]]], max_messages: int = sys.maxsize
) -> Iterator[_Message]:
    """Yield the messages of chunks, which may overlap, in order of time, in bounded memory.

    Args:
        chunks: The time of its first message, and the messages, of each; sorted by that time.
        max_messages: Number of messages to hold.
    """
    heap: list[tuple[int, int, int, bytes]] = []
    order, size = itertools.count(), 0

    def pop() -> _Message:
        nonlocal size
        time, _, number, data = heapq.heappop(heap)
        size -= len(data) + _OVERHEAD
        return number, time, data

    for start, messages in chunks:
        while heap and heap[0][0] < start:
            yield pop()
        for number, time, data in messages:
            size += len(data) + _OVERHEAD
            heapq.heappush(heap, (time, next(order), number, data))
            while len(heap) > max_messages or size > _MAX_SORTED_BYTES:
                yield pop()
    while heap:
        yield pop()


def by_time(messages: Iterable[_Message]) -> Iterator[_Message]:
    """Sort messages that are nearly in order of time, in bounded memory."""
    return merge_chunks([(0, messages)], _MAX_SORTED)


class ScannedBag(Bag):
    """A recording whose messages are read with their channels' numbers.

    Args:
        path: The file.
        part: What is left out where it is damaged, ``chunk`` or ``message``.
    """

    def __init__(self, path: Path, part: str = "chunk") -> None:
        self.path = path
        self._known: dict[int, Channel] = {}
        self._left_out = LeftOut(path, part)

    @abstractmethod
    def _read(
        self, wanted: Collection[int], start: int | None, end: int | None
    ) -> Iterator[_Message]:
        """Yield at least the messages of the wanted channels and times, in order of time."""

    def messages(
        self,
        channels: Collection[Channel] | None = None,
        start: int | None = None,
        end: int | None = None,
    ) -> Iterator[BagMessage]:
        """Yield messages in order of time; see :meth:`Bag.messages`."""
        wanted = {n: c for n, c in self._known.items() if channels is None or c in channels}
        if not wanted:
            return
        for number, time, data in self._read(wanted, start, end):
            late = end is not None and time >= end
            if number in wanted and not late and (start is None or time >= start):
                yield BagMessage(wanted[number], time, data)

    def _merge_channels(self) -> None:
        """Merge channels that differ only in their publisher."""
        groups: dict[Channel, list[int]] = {}
        for number, channel in self._known.items():
            groups.setdefault(replace(channel, count=0), []).append(number)
        for channel, numbers in groups.items():
            counts = [self._known[number].count for number in numbers]
            merged = replace(channel, count=-1 if -1 in counts else sum(counts))
            self._known.update(dict.fromkeys(numbers, merged))
        found = set(self._known.values())
        self.channels = tuple(sorted(found, key=lambda c: (c.topic, c.type_name, c.offered != ())))


_NS = 1_000_000_000
_INFINITE = {"sec": 9223372036, "nsec": 854775807}
#: Durations from this one on mean "infinite".
_CENTURY = 100 * 365 * 86400 * _NS
_HISTORY = {1: History.KEEP_LAST, 2: History.KEEP_ALL}
_RELIABILITY = {1: Reliability.RELIABLE, 2: Reliability.BEST_EFFORT}
_DURABILITY = {1: Durability.TRANSIENT_LOCAL, 2: Durability.VOLATILE}
_LIVELINESS = {1: Liveliness.AUTOMATIC, 3: Liveliness.MANUAL_BY_TOPIC}


def write_profiles(profiles: Iterable[QoS]) -> str:
    """Return rosbag2's YAML text ``offered_qos_profiles`` for publishers' profiles.

    Words since ROS 2 Iron, the numbers of ``rmw/types.h`` before.
    """
    return str(yaml.safe_dump([_profile_to_dict(qos) for qos in profiles], sort_keys=False))


def read_profiles(text: str) -> tuple[QoS, ...]:
    """Parse rosbag2's ``offered_qos_profiles``; unknown policies become the defaults."""
    try:
        documents = load_yaml(text or "[]")
    except yaml.YAMLError:
        return ()
    entries = documents[0] if documents else None
    if not isinstance(entries, list):
        return ()
    return tuple(parse_profile(entry) for entry in entries if isinstance(entry, dict))


def _profile_to_dict(qos: QoS) -> dict[str, Any]:
    return {
        "history": qos.history.value,
        "depth": qos.depth,
        "reliability": qos.reliability.value,
        "durability": qos.durability.value,
        "deadline": _duration_to_dict(qos.deadline),
        "lifespan": _duration_to_dict(qos.lifespan),
        "liveliness": qos.liveliness.value,
        "liveliness_lease_duration": _duration_to_dict(qos.lease_duration),
        "avoid_ros_namespace_conventions": False,
    }


def _duration_to_dict(duration: Duration | None) -> dict[str, int]:
    if duration is None:
        return dict(_INFINITE)
    seconds, rest = divmod(duration.nanoseconds, _NS)
    return {"sec": seconds, "nsec": rest}


def parse_profile(entry: dict[str, Any]) -> QoS:
    """Return the profile for one entry of rosbag2's ``offered_qos_profiles``."""
    depth = entry.get("depth")
    return QoS(
        depth=depth if isinstance(depth, int) and 0 < depth < 2**31 else 10,
        reliability=_parse_policy(entry, "reliability", _RELIABILITY, Reliability.RELIABLE),
        durability=_parse_policy(entry, "durability", _DURABILITY, Durability.VOLATILE),
        history=_parse_policy(entry, "history", _HISTORY, History.KEEP_LAST),
        deadline=_parse_duration(entry.get("deadline")),
        lifespan=_parse_duration(entry.get("lifespan")),
        liveliness=_parse_policy(entry, "liveliness", _LIVELINESS, Liveliness.AUTOMATIC),
        lease_duration=_parse_duration(entry.get("liveliness_lease_duration")),
    )


def _parse_policy(entry: dict[str, Any], key: str, numbers: dict[int, Any], default: Any) -> Any:
    value = entry.get(key)
    for number, member in numbers.items():
        if value in (number, member.value):
            return member
    return default


def _parse_duration(value: object) -> Duration | None:
    if not isinstance(value, dict):
        return None
    try:
        total = int(value.get("sec", 0)) * _NS + int(value.get("nsec", 0))
    except (TypeError, ValueError, OverflowError):
        return None
    return Duration(total) if 0 < total < _CENTURY else None
