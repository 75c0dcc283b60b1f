"""MCAP recordings (https://mcap.dev/spec), read and written with the ``mcap`` package.

Profiles and metadata: https://mcap.dev/spec/registry, and what rosbag2 and the ``mcap`` command
write when they convert a ROS 1 bag.
"""

from __future__ import annotations

import io
import logging
import struct
from contextlib import contextmanager
from importlib.metadata import version
from typing import TYPE_CHECKING, Any, BinaryIO

from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.reader import SeekingReader
from mcap.records import Channel as ChannelRecord
from mcap.records import Chunk, ChunkIndex, Message, Schema
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType, Writer

from rosglass.bags.bag import (
    Channel,
    RecordingFile,
    ScannedBag,
    by_time,
    decompress,
    merge_chunks,
    read_profiles,
    write_profiles,
)
from rosglass.comm import Durability, QoS
from rosglass.comm.handle import undo_on_error
from rosglass.errors import BagError, InvalidNameError
from rosglass.interfaces import ros1_name, schema_text
from rosglass.interfaces.names import join_name
from rosglass.messages import OpaqueType

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Sequence
    from pathlib import Path

    from rosglass.comm import Sample
    from rosglass.messages import MessageType

__all__ = ["McapBag", "McapFile"]


_log = logging.getLogger("rosglass.bags")
_WIRES = {"cdr": "cdr", "ros1": "ros1"}
#: The headers of a record (opcode, length) and of a message (channel, sequence, two times).
_record_header = struct.Struct("<BQ")
_message_header = struct.Struct("<HIQQ")
#: The header of the index of one channel's messages in a chunk (channel, bytes of the entries).
_index_header = struct.Struct("<HI")
#: Bytes of the index of a chunk.
_MAX_INDEX = 64 * 2**20
#: rosbag2 writes "unknown" and no text for a type whose definition it did not find.
_LANGUAGES = {"ros2msg": "msg", "ros1msg": "msg", "ros2idl": "idl", "unknown": "msg"}


class McapBag(ScannedBag):
    """An MCAP file with ROS 1 or ROS 2 messages.

    Topics in other encodings (JSON, Protobuf) are left out and named in :attr:`problem`.

    Raises:
        BagError: It cannot be read.
    """

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        try:
            self._file = path.open("rb")
        except OSError as error:
            raise BagError(f"{path} cannot be read: {error.strerror}") from error
        self._foreign: dict[str, str] = {}
        self._chunks: list[ChunkIndex] = []
        self._problems = ""
        with undo_on_error(self._file.close):
            self._index()
        self._merge_channels()
        if self._foreign:
            names = ", ".join(f"{topic} ({what})" for topic, what in sorted(self._foreign.items()))
            self._add_problem(f"these topics are not ROS messages and are left out: {names}")

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def _index(self) -> None:
        summary = None
        try:
            summary = SeekingReader(self._file).get_summary()
        except Exception:  # noqa: BLE001 - damaged data may raise anything
            self._add_problem("it was not closed properly: its end is missing or damaged")
        if summary is not None and summary.statistics is not None and summary.channels:
            # A damaged index may name a chunk several times.
            chunks = {index.chunk_start_offset: index for index in summary.chunk_indexes}
            self._chunks = sorted(
                chunks.values(), key=lambda c: (c.message_start_time, c.chunk_start_offset)
            )
            counts = summary.statistics.channel_message_counts
            for number, channel in summary.channels.items():
                schema = summary.schemas.get(channel.schema_id)
                self._add(number, channel, schema, counts.get(number, 0))
            self.start = summary.statistics.message_start_time
            self.end = summary.statistics.message_end_time
            return
        first = last = -1
        for _, time, _ in self._scan():
            first = time if first < 0 else min(first, time)
            last = max(last, time)
        self.start, self.end = max(first, 0), max(last, 0)
        if not self._known and not self._foreign and last < 0 and not self.problem:
            self._add_problem("it holds no messages")

    def times(self) -> Iterator[tuple[Channel, Sequence[int]]]:
        """Yield the times of all messages; see :meth:`Bag.times`."""
        if not self._chunks or any(not one.message_index_offsets for one in self._chunks):
            yield from super().times()
            return
        with self.path.open("rb") as file:
            for chunk in self._chunks:
                for number, times in self._message_index(file, chunk):
                    if number in self._known:
                        yield self._known[number], times

    def _message_index(
        self, file: BinaryIO, chunk: ChunkIndex
    ) -> Iterator[tuple[int, Sequence[int]]]:
        """Yield the channels of a chunk, and the times of their messages."""
        with self._damage_left_out(chunk.chunk_start_offset):
            file.seek(min(chunk.message_index_offsets.values()))
            data = file.read(min(chunk.message_index_length, _MAX_INDEX))
            place = 0
            while place < len(data):
                opcode, size = _record_header.unpack_from(data, place)
                place += _record_header.size
                if opcode != Opcode.MESSAGE_INDEX or place + size > len(data):
                    raise BagError("the index of a chunk's messages is damaged")
                number, length = _index_header.unpack_from(data, place)
                first = place + _index_header.size
                entries = struct.unpack_from(f"<{length // 16 * 2}Q", data, first)
                yield number, entries[::2]
                place += size

    def _read(
        self, wanted: Collection[int], start: int | None, end: int | None
    ) -> Iterator[tuple[int, int, bytes]]:
        if not self._chunks:
            yield from by_time(self._scan())
            return
        # Each pass opens the file, as passes may overlap.
        with self.path.open("rb") as file:
            yield from merge_chunks(
                (index.message_start_time, self._indexed(file, index, wanted))
                for index in self._chunks
                if (start is None or index.message_end_time >= start)
                and (end is None or index.message_start_time < end)
                and not (
                    index.message_index_offsets
                    and index.message_index_offsets.keys().isdisjoint(wanted)
                )
            )

    def _indexed(
        self, file: BinaryIO, index: ChunkIndex, wanted: Collection[int]
    ) -> Iterator[tuple[int, int, bytes]]:
        """Yield the messages of the wanted channels in an indexed chunk."""
        with self._damage_left_out(index.chunk_start_offset):
            file.seek(index.chunk_start_offset)
            chunk = next(StreamReader(file, skip_magic=True, emit_chunks=True).records)
            if not isinstance(chunk, Chunk):
                raise BagError("the index names a chunk, and there is none")
            for record in self._unpacked(chunk, index.chunk_start_offset, wanted):
                if isinstance(record, tuple):
                    yield record

    def _scan(self) -> Iterator[tuple[int, int, bytes]]:
        """Read messages and channels from the start, up to the end or the first damage."""
        schemas: dict[int, Any] = {}
        with self.path.open("rb") as file:
            try:
                # The reader checks magic numbers and lengths, and raises for a truncated record.
                for record in self._record_headers(file):
                    if isinstance(record, tuple):
                        yield record
                    elif isinstance(record, Schema):
                        schemas[record.id] = record
                    elif record.id not in self._known:
                        self._add(record.id, record, schemas.get(record.schema_id), -1)
            except Exception as error:  # damaged data may raise anything
                if not self._known and not self._foreign:
                    raise BagError(
                        f"{self.path} is not an MCAP file, or damaged at its beginning: {error}"
                    ) from error

    def _record_headers(
        self, file: BinaryIO
    ) -> Iterator[Schema | ChannelRecord | tuple[int, int, bytes]]:
        """Yield schemas, channels and messages in the order of the file."""
        offset = file.tell()
        for record in StreamReader(file, emit_chunks=True).records:
            if isinstance(record, Chunk):
                yield from self._unpacked(record, offset)
            elif isinstance(record, Message):
                yield record.channel_id, record.log_time, record.data
            elif isinstance(record, (Schema, ChannelRecord)):
                yield record
            offset = file.tell()

    def _unpacked(
        self, chunk: Chunk, offset: int, wanted: Collection[int] | None = None
    ) -> Iterator[Schema | ChannelRecord | tuple[int, int, bytes]]:
        """Yield the content of a chunk, up to the first damage; of all channels by default.

        The package's own reader trusts declared sizes, and lists all records in memory.
        """
        with self._damage_left_out(offset):
            data = decompress(chunk.compression, chunk.data, chunk.uncompressed_size)
            place = 0
            while place < len(data):
                opcode, size = _record_header.unpack_from(data, place)
                place += _record_header.size
                end = place + size
                if not opcode or end > len(data):
                    raise BagError(
                        f"no record is at byte {place - _record_header.size} of its content"
                    )
                if opcode == Opcode.MESSAGE:
                    number, _, time, _ = _message_header.unpack_from(data, place)
                    if wanted is None or number in wanted:
                        yield number, time, data[place + _message_header.size : end]
                elif opcode == Opcode.SCHEMA:
                    yield Schema.read(ReadDataStream(io.BytesIO(data[place:end])))
                elif opcode == Opcode.CHANNEL:
                    yield ChannelRecord.read(ReadDataStream(io.BytesIO(data[place:end])))
                place = end

    def _add(self, number: int, channel: Any, schema: Any, count: int) -> None:
        wire = _WIRES.get(channel.message_encoding)
        language = "" if schema is None else _LANGUAGES.get(schema.encoding, "")
        if wire is None or schema is None or (schema.encoding and not language):
            what = channel.message_encoding or "no encoding"
            if schema is not None and schema.encoding:
                what += f" described by {schema.encoding}"
            self._foreign[channel.topic] = what
            return
        try:
            name = join_name(schema.name)
        except InvalidNameError:
            self._foreign[channel.topic] = f"type {schema.name!r:.80}"
            return
        metadata = channel.metadata
        offered: tuple[QoS, ...]
        if wire == "ros1":
            offered = (QoS.latched(),) if metadata.get("latching", "") in ("1", "true") else ()
        else:
            offered = read_profiles(metadata.get("offered_qos_profiles", ""))
        self._known[number] = Channel(
            channel.topic,
            name,
            wire,
            schema.data.decode("utf-8", "replace"),
            language or "msg",
            metadata.get("md5sum" if wire == "ros1" else "topic_type_hash", ""),
            offered,
            count,
        )

    def _add_problem(self, problem: str) -> None:
        self._problems = f"{self._problems}; {problem}" if self._problems else problem
        _log.warning("%s: %s", self.path, problem)
        self._update_problem()

    @contextmanager
    def _damage_left_out(self, offset: int) -> Iterator[None]:
        """Leave out what is left of a chunk after the first error."""
        try:
            yield
        except Exception as error:  # noqa: BLE001 - damaged data may raise anything
            self._left_out.add(f"at byte {offset}", error)
            self._update_problem()

    def _update_problem(self) -> None:
        self.problem = "; ".join(filter(None, (self._problems, self._left_out.words())))


_COMPRESSIONS = {
    "none": CompressionType.NONE,
    "lz4": CompressionType.LZ4,
    "zstd": CompressionType.ZSTD,
}


class McapFile(RecordingFile):
    """An MCAP file that is being written, with messages of one ROS.

    Args:
        file: File to write; closed at the end.
        wire: ``cdr`` or ``ros1``.
        compression: ``none``, ``lz4`` or ``zstd``.
    """

    def __init__(self, file: BinaryIO, wire: str, compression: str) -> None:
        self._file, self._wire = file, wire
        self.by_publisher = wire == "ros1"
        self._writer: Any = Writer(file, compression=_COMPRESSIONS[compression])
        profile = "ros1" if wire == "ros1" else "ros2"
        self._writer.start(profile=profile, library=f"rosglass {version('rosglass')}")

    def channel(
        self, topic: str, kind: MessageType, offered: Sequence[QoS], publisher: bytes
    ) -> int:
        """Add a channel; see :meth:`RecordingFile.channel`."""
        ros1 = self._wire == "ros1"
        name = ros1_name(kind.name) if ros1 else kind.name
        if isinstance(kind, OpaqueType):
            language, text = "msg", kind.text
        else:
            language, text = schema_text(kind.definition)
        encoding = f"{'ros1' if ros1 else 'ros2'}{language}" if text else ""
        schema = self._writer.register_schema(name, encoding, text.encode())
        metadata: dict[str, Any] = {}
        if ros1:
            latched = any(qos.durability is Durability.TRANSIENT_LOCAL for qos in offered)
            metadata = {"topic": topic, "md5sum": kind.md5, "latching": "1" if latched else "0"}
            metadata["callerid"] = publisher.decode(errors="replace")
        else:
            metadata["offered_qos_profiles"] = write_profiles(dict.fromkeys(offered))
            metadata["topic_type_hash"] = kind.rihs01
        return int(self._writer.register_channel(topic, self._wire, schema, metadata))

    def write(self, channel: int, sample: Sample) -> None:
        """Write a message."""
        self._writer.add_message(
            channel,
            log_time=sample.received_ns,
            data=bytes(sample.data),
            publish_time=sample.received_ns if sample.sent_ns is None else sample.sent_ns,
            sequence=max(0, sample.sequence) & 0xFFFFFFFF,
        )

    def flush(self) -> None:
        """Write the chunk in progress."""
        self._writer.flush()

    def size(self) -> int:
        """Return the size of the file in bytes."""
        return self._file.tell()

    def finish(self) -> None:
        """Write the summary."""
        self._writer.finish()

    def close(self) -> None:
        """Close the file."""
        self._file.close()
