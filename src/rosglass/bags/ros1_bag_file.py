"""ROS 1 bags (ROS wiki, "Bags/Format/2.0"): writing, and reading those that were not closed.

Complete bags are read by :class:`rosglass.bags.rosbags_bag.RosbagsBag`. ``rosbag reindex`` repairs
most others where ROS 1 is installed; here they are read from the start, up to the first damage.
"""

from __future__ import annotations

import io
import logging
import struct
from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING, Any, BinaryIO, NamedTuple

from rosbags.rosbag1 import Writer

from rosglass.bags.bag import Channel, RecordingFile, ScannedBag, by_time, decompress
from rosglass.comm import Durability, QoS
from rosglass.errors import BagError, InvalidNameError
from rosglass.interfaces import full_text
from rosglass.interfaces.names import join_name
from rosglass.messages import OpaqueType

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

    from rosglass.comm import Sample
    from rosglass.messages import MessageType

__all__ = ["MAGIC", "Ros1BagFile", "Ros1CutBag"]


_log = logging.getLogger("rosglass.bags")
MAGIC = b"#ROSBAG V2.0\n"
_length = struct.Struct("<I")
_time = struct.Struct("<II")
_MESSAGE, _CHUNK, _CONNECTION = 2, 5, 7
#: Longest record in bytes; a longer one is damaged.
_MAX_RECORD = 2**31


class _Record(NamedTuple):
    kind: int
    fields: dict[bytes, bytes]
    data: bytes
    #: Position in the file.
    offset: int


class _EndError(Exception):
    """The end of the file, or of its undamaged part."""


class Ros1CutBag(ScannedBag):
    """A ROS 1 bag without index, read from its start.

    Args:
        path: The file.

    Raises:
        BagError: The file is not a ROS 1 bag, or nothing in it can be read.
    """

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        # By number: a connection may stand behind its messages.
        found: dict[int, tuple[int, int, int]] = {}
        for number, time, _ in self._scan():
            count, first, last = found.get(number, (0, time, time))
            found[number] = count + 1, min(first, time), max(last, time)
        if not self._known:
            why = f": {self._left_out.words()}" if self._left_out.words() else ""
            raise BagError(
                f"{path} is a ROS 1 bag that ends, or is damaged, before its messages{why}"
            )
        for number, channel in self._known.items():
            self._known[number] = replace(channel, count=found.get(number, (0, 0, 0))[0])
        self._merge_channels()
        known = [found[number] for number in self._known if number in found]
        self.start = min((first for _, first, _ in known), default=0)
        self.end = max((last for _, _, last in known), default=0)
        cut = "it was not closed properly: its index is missing or damaged"
        self.problem = "; ".join(filter(None, (cut, self._left_out.words())))
        _log.warning("%s: %s", path, self.problem)

    def close(self) -> None:
        """Do nothing: the file is open only while it is read."""

    def _read(self, *_: Any) -> Iterator[tuple[int, int, bytes]]:
        return by_time(self._scan())

    def _scan(self) -> Iterator[tuple[int, int, bytes]]:
        """Yield messages and collect connections in the order of the file, up to damage."""
        with self.path.open("rb") as file:
            if file.read(len(MAGIC)) != MAGIC:
                return
            for record in _records(file):
                if record.kind == _CONNECTION:
                    self._add_connection(record)
                elif record.kind == _CHUNK:
                    yield from self._messages(record)

    def _messages(self, chunk: _Record) -> Iterator[tuple[int, int, bytes]]:
        try:
            compression = chunk.fields.get(b"compression", b"none").decode(errors="replace")
            size = max(0, _number(chunk.fields.get(b"size", b"")))
            data = decompress(compression, chunk.data, size)
        except BagError as error:
            self._left_out.add(f"at byte {chunk.offset}", error)
            return
        for record in _records(io.BytesIO(data)):
            if record.kind == _CONNECTION:
                self._add_connection(record)
            elif record.kind == _MESSAGE:
                number = _number(record.fields.get(b"conn", b""))
                time = record.fields.get(b"time", b"")
                if number >= 0 and len(time) == _time.size:
                    seconds, nanoseconds = _time.unpack(time)
                    yield number, seconds * 10**9 + nanoseconds, record.data

    def _add_connection(self, record: _Record) -> None:
        number = _number(record.fields.get(b"conn", b""))
        if number < 0 or number in self._known:
            return
        try:
            header = {
                k.decode(errors="replace"): v.decode(errors="replace")
                for k, v in _fields(record.data).items()
            }
        except _EndError:
            return
        topic = record.fields.get(b"topic", b"").decode(errors="replace")
        try:
            name = join_name(header.get("type", ""))
        except InvalidNameError:
            return
        self._known[number] = Channel(
            topic,
            name,
            "ros1",
            header.get("message_definition", ""),
            "msg",
            header.get("md5sum", ""),
            (QoS.latched(),) if header.get("latching") == "1" else (),
        )


def _records(file: BinaryIO) -> Iterator[_Record]:
    """Yield records up to the first one that is damaged or truncated."""
    try:
        while True:
            offset = file.tell()
            fields = _fields(_read_block(file))
            kind = fields.get(b"op", b"")
            yield _Record(kind[0] if kind else 0, fields, _read_block(file), offset)
    except _EndError:
        return


def _read_block(file: BinaryIO) -> bytes:
    size = _number(file.read(_length.size))
    data = file.read(size) if 0 <= size < _MAX_RECORD else b""
    if len(data) != size:
        raise _EndError
    return data


def _fields(data: bytes) -> dict[bytes, bytes]:
    found, place = {}, 0
    while place < len(data):
        size = _number(data[place : place + _length.size])
        place += _length.size
        name, separator, value = data[place : place + size].partition(b"=")
        if size < 0 or place + size > len(data) or not separator:
            raise _EndError
        found[name] = value
        place += size
    return found


def _number(data: bytes) -> int:
    return int(_length.unpack(data)[0]) if len(data) == _length.size else -1


#: Bytes of the header's fields (op, index_pos, conn_count, chunk_count), and of these with padding.
_FIELDS, _HEADER = 69, 4096


class Ros1BagFile(RecordingFile):
    """A ROS 1 bag that is being written as by ``rosbag record``.

    Args:
        path: The file, which exists.
        file: The same, open and empty.
        compression: ``none``, ``lz4`` or ``bz2``.
    """

    by_publisher = True

    def __init__(self, path: Path, file: BinaryIO, compression: str) -> None:
        file.close()
        path.unlink()  # rosbags creates it
        self._writer: Any = Writer(path)
        if compression != "none":
            self._writer.set_compression(Writer.CompressionFormat[compression.upper()])
        self._writer.open()
        self._path = path
        # Other versions of rosbags may write the full header.
        opened: Any = self._writer.bio
        self._needs_padding = opened.tell() == len(MAGIC) + _HEADER
        if self._needs_padding:
            _pad(opened)
        self._connections: list[Any] = []
        self._indexed = 0

    def channel(
        self, topic: str, kind: MessageType, offered: Sequence[QoS], publisher: bytes
    ) -> int:
        """Add a connection for a topic and a node; see :meth:`RecordingFile.channel`."""
        latched = any(qos.durability is Durability.TRANSIENT_LOCAL for qos in offered)
        text = kind.text if isinstance(kind, OpaqueType) else full_text(kind.definition)
        self._connections.append(
            self._writer.add_connection(
                topic,
                kind.name,
                msgdef=text,
                md5sum=kind.md5,
                callerid=publisher.decode(errors="replace"),
                latching=int(latched),
            )
        )
        return len(self._connections) - 1

    def write(self, channel: int, sample: Sample) -> None:
        """Write a message."""
        self._writer.write(self._connections[channel], sample.received_ns, sample.data)
        self._release_index()

    def flush(self) -> None:
        """Write the chunk in progress; its index follows at the end, or by ``rosbag reindex``."""
        self._writer.write_chunk(self._writer.chunks[-1])
        self._release_index()
        self._writer.bio.flush()

    def size(self) -> int:
        """Return the size of the file in bytes."""
        return int(self._writer.bio.tell()) if self._writer.bio is not None else 0

    def finish(self) -> None:
        """Write the index."""
        self._writer.close()
        if self._needs_padding:
            with self._path.open("r+b") as file:
                _pad(file)

    def close(self) -> None:
        """Close the file."""
        with suppress(OSError):  # what is incomplete is not read anyway
            self._writer.abort()

    def _release_index(self) -> None:
        """Keep only the number of messages of written chunks, which is all that the index needs.

        rosbags keeps the position of each message to the end, some 200 bytes per message.
        """
        chunks = self._writer.chunks
        while self._indexed < len(chunks) - 1:
            places = chunks[self._indexed].connections
            for number in places:
                places[number] = range(len(places[number]))
            self._indexed += 1


def _pad(file: Any) -> None:
    """Pad the file's header to rosbag's length: 4096 bytes without the lengths of its two parts.

    The rosbags package includes these. ``rosbag reindex`` rewrites the header in its own length,
    and would overwrite the first chunk.
    """
    file.seek(len(MAGIC) + _length.size + _FIELDS)
    file.write(_length.pack(_HEADER - _FIELDS))
    file.write(b" " * (_HEADER - _FIELDS))
