"""MCAP recordings (https://mcap.dev/spec), read with the ``mcap`` package."""

from __future__ import annotations

import io
import logging
import struct
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.reader import SeekingReader
from mcap.records import Channel as ChannelRecord
from mcap.records import Chunk, ChunkIndex, Message, Schema
from mcap.stream_reader import StreamReader

from rosglass.bags.bag import Bag, BagMessage, Channel
from rosglass.bags.chunks import LeftOut, decompress
from rosglass.bags.nearly_sorted import by_time, merge_chunks
from rosglass.bags.qos_text import read_profiles
from rosglass.comm import QoS
from rosglass.errors import BagError, InvalidNameError
from rosglass.interfaces.names import join_name

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator
    from pathlib import Path
    from typing import BinaryIO

__all__ = ["McapBag"]

_log = logging.getLogger("rosglass.bags")
_WIRES = {"cdr": "cdr", "ros1": "ros1"}
#: Opcode and length of a record; channel, sequence and times of a message.
_record = struct.Struct("<BQ")
_message = struct.Struct("<HIQQ")
_LANGUAGES = {"ros2msg": "msg", "ros1msg": "msg", "ros2idl": "idl"}


class McapBag(Bag):
    """An MCAP file with ROS 1 or ROS 2 messages.

    Topics in other encodings (JSON, Protobuf) are left out, and named in :attr:`problem`.

    Raises:
        BagError: It cannot be read.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            self._file = path.open("rb")
        except OSError as error:
            raise BagError(f"{path} cannot be read: {error.strerror}") from error
        self._known: dict[int, Channel] = {}
        self._foreign: dict[str, str] = {}
        self._chunks: list[ChunkIndex] = []
        self._noted = ""
        self._left_out = LeftOut(path, "chunk")
        try:
            self._index()
        except BaseException:
            self._file.close()
            raise
        self._merge()
        found = set(self._known.values())
        self.channels = tuple(sorted(found, key=lambda c: (c.topic, c.type_name, c.offered != ())))
        if self._foreign:
            told = ", ".join(f"{topic} ({what})" for topic, what in sorted(self._foreign.items()))
            self._note(f"these topics are not ROS messages and are left out: {told}")

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
        if self._chunks:
            found = self._seek(wanted, start, end)
        else:
            found = by_time(self._scan())
        for number, time, data in found:
            late = end is not None and time >= end
            if number in wanted and not late and (start is None or time >= start):
                yield BagMessage(wanted[number], time, data)

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def _index(self) -> None:
        summary = None
        try:
            summary = SeekingReader(self._file).get_summary()
        except Exception:  # whatever the damage leads to
            self._note("it was not closed properly: its end is missing or damaged")
        if summary is not None and summary.statistics is not None and summary.channels:
            # However often an index names a chunk, it is read once.
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
            self._note("it holds no messages")

    def _seek(
        self, wanted: dict[int, Channel], start: int | None, end: int | None
    ) -> Iterator[tuple[int, int, bytes]]:
        # Opened anew for each pass, as passes may overlap.
        with self.path.open("rb") as file:
            yield from merge_chunks(
                (index.message_start_time, self._indexed(file, index))
                for index in self._chunks
                if (start is None or index.message_end_time >= start)
                and (end is None or index.message_start_time < end)
                and not (
                    index.message_index_offsets
                    and not wanted.keys() & index.message_index_offsets.keys()
                )
            )

    def _indexed(self, file: BinaryIO, index: ChunkIndex) -> Iterator[tuple[int, int, bytes]]:
        """Yield the messages of a chunk that the index names."""
        try:
            file.seek(index.chunk_start_offset)
            chunk = next(StreamReader(file, skip_magic=True, emit_chunks=True).records)
            if not isinstance(chunk, Chunk):
                raise BagError("the index names a chunk, and there is none")
        except Exception as error:  # whatever the damage leads to
            self._leave_out(index.chunk_start_offset, error)
            return
        for record in self._unpacked(chunk, index.chunk_start_offset):
            if isinstance(record, tuple):
                yield record

    def _scan(self) -> Iterator[tuple[int, int, bytes]]:
        """Read from the start for as far as the file goes, learning channels on the way."""
        schemas: dict[int, Any] = {}
        with self.path.open("rb") as file:
            try:
                # Magic numbers and lengths are checked by the reader; a cut record ends it.
                for record in self._records(file):
                    if isinstance(record, tuple):
                        yield record
                    elif isinstance(record, Schema):
                        schemas[record.id] = record
                    elif record.id not in self._known:
                        self._add(record.id, record, schemas.get(record.schema_id), -1)
            except Exception as error:  # whatever the damage leads to
                if not self._known and not self._foreign:
                    raise BagError(
                        f"{self.path} is no MCAP file, or damaged at its beginning: {error}"
                    ) from error

    def _records(self, file: BinaryIO) -> Iterator[Schema | ChannelRecord | tuple[int, int, bytes]]:
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
        self, chunk: Chunk, offset: int
    ) -> Iterator[Schema | ChannelRecord | tuple[int, int, bytes]]:
        """Yield what a chunk holds, up to where it is damaged.

        The package's own reader believes the sizes that are declared, and makes a list of all
        records, whatever the chunk expands to.
        """
        try:
            data = decompress(chunk.compression, chunk.data, chunk.uncompressed_size)
            place = 0
            while place < len(data):
                opcode, size = _record.unpack_from(data, place)
                place += _record.size
                end = place + size
                if not opcode or end > len(data):
                    raise BagError(f"no record is at byte {place - _record.size} of its content")
                if opcode == Opcode.MESSAGE:
                    number, _, time, _ = _message.unpack_from(data, place)
                    yield number, time, data[place + _message.size : end]
                elif opcode == Opcode.SCHEMA:
                    yield Schema.read(ReadDataStream(io.BytesIO(data[place:end])))
                elif opcode == Opcode.CHANNEL:
                    yield ChannelRecord.read(ReadDataStream(io.BytesIO(data[place:end])))
                place = end
        except Exception as error:  # whatever the damage leads to
            self._leave_out(offset, error)

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
        told = channel.metadata
        offered: tuple[QoS, ...]
        if wire == "ros1":
            offered = (QoS.latched(),) if told.get("latching", "") in ("1", "true") else ()
        else:
            offered = read_profiles(told.get("offered_qos_profiles", ""))
        self._known[number] = Channel(
            channel.topic,
            name,
            wire,
            schema.data.decode("utf-8", "replace"),
            language or "msg",
            told.get("md5sum" if wire == "ros1" else "topic_type_hash", ""),
            offered,
            count,
        )

    def _merge(self) -> None:
        """Make one channel of those that differ in nothing but who published."""
        groups: dict[Channel, list[int]] = {}
        for number, channel in self._known.items():
            groups.setdefault(replace(channel, count=0), []).append(number)
        for channel, numbers in groups.items():
            counts = [self._known[number].count for number in numbers]
            merged = replace(channel, count=-1 if -1 in counts else sum(counts))
            self._known.update(dict.fromkeys(numbers, merged))

    def _note(self, problem: str) -> None:
        self._noted = f"{self._noted}; {problem}" if self._noted else problem
        _log.warning("%s: %s", self.path, problem)
        self._judge()

    def _leave_out(self, offset: int, error: Exception) -> None:
        self._left_out.add(f"at byte {offset}", error)
        self._judge()

    def _judge(self) -> None:
        self.problem = "; ".join(filter(None, (self._noted, self._left_out.words())))
