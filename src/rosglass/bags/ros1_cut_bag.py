"""ROS 1 bags that were not closed: without index, or cut short (wiki, "Bags/Format/2.0").

``rosbag reindex`` mends most such files where ROS 1 is installed; here they are read as they are,
from their start and for as far as they go.
"""

from __future__ import annotations

import io
import logging
import struct
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

from rosglass.bags.bag import Bag, BagMessage, Channel
from rosglass.bags.chunks import LeftOut, decompress
from rosglass.bags.nearly_sorted import by_time
from rosglass.comm import QoS
from rosglass.errors import BagError, InvalidNameError
from rosglass.interfaces.names import join_name

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator
    from pathlib import Path
    from typing import BinaryIO

__all__ = ["MAGIC", "Ros1CutBag"]

_log = logging.getLogger("rosglass.bags")
MAGIC = b"#ROSBAG V2.0\n"
_length = struct.Struct("<I")
_time = struct.Struct("<II")
_MESSAGE, _CHUNK, _CONNECTION = 2, 5, 7
#: Longest record in bytes that is believed.
_MOST = 2**31


class _Record(NamedTuple):
    kind: int
    fields: dict[bytes, bytes]
    data: bytes
    #: Where in the file it begins.
    offset: int


class _EndError(Exception):
    """The file ends here, or is damaged here."""


class Ros1CutBag(Bag):
    """A ROS 1 bag that is read from its start.

    Args:
        path: The file.

    Raises:
        BagError: It is no ROS 1 bag, or nothing in it can be read.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._known: dict[int, Channel] = {}
        self._left_out = LeftOut(path, "chunk")
        counts: dict[int, int] = {}
        first = last = -1
        for number, time, _ in self._scan():
            counts[number] = counts.get(number, 0) + 1
            first = time if first < 0 else min(first, time)
            last = max(last, time)
        if not self._known:
            why = f": {self._left_out.words()}" if self._left_out.words() else ""
            raise BagError(
                f"{path} is a ROS 1 bag that ends, or is damaged, before its messages{why}"
            )
        groups: dict[Channel, list[int]] = {}
        for number, channel in self._known.items():
            groups.setdefault(channel, []).append(number)
        for channel, numbers in groups.items():
            count = sum(counts.get(number, 0) for number in numbers)
            self._known.update(dict.fromkeys(numbers, replace(channel, count=count)))
        found = set(self._known.values())
        self.channels = tuple(sorted(found, key=lambda c: (c.topic, c.type_name, c.offered != ())))
        self.start, self.end = max(first, 0), max(last, 0)
        cut = "it was not closed properly: its index is missing or damaged"
        self.problem = "; ".join(filter(None, (cut, self._left_out.words())))
        _log.warning("%s: %s", path, self.problem)

    def messages(
        self,
        channels: Collection[Channel] | None = None,
        start: int | None = None,
        end: int | None = None,
    ) -> Iterator[BagMessage]:
        """Yield messages in order of time; see :meth:`Bag.messages`."""
        wanted = {n: c for n, c in self._known.items() if channels is None or c in channels}
        for number, time, data in by_time(self._scan()):
            late = end is not None and time >= end
            if number in wanted and not late and (start is None or time >= start):
                yield BagMessage(wanted[number], time, data)

    def close(self) -> None:
        """Do nothing: the file is open only while it is read."""

    def _scan(self) -> Iterator[tuple[int, int, bytes]]:
        """Yield what can be read, in the order of the file; learn its connections on the way."""
        with self.path.open("rb") as file:
            if file.read(len(MAGIC)) != MAGIC:
                return
            for record in _records(file):
                if record.kind == _CONNECTION:
                    self._learn(record)
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
                self._learn(record)
            elif record.kind == _MESSAGE:
                number = _number(record.fields.get(b"conn", b""))
                time = record.fields.get(b"time", b"")
                if number in self._known and len(time) == _time.size:
                    seconds, nanoseconds = _time.unpack(time)
                    yield number, seconds * 10**9 + nanoseconds, record.data

    def _learn(self, record: _Record) -> None:
        number = _number(record.fields.get(b"conn", b""))
        if number < 0 or number in self._known:
            return
        try:
            header = {k: v.decode(errors="replace") for k, v in _fields(record.data).items()}
        except _EndError:
            return
        told = {key.decode(errors="replace"): text for key, text in header.items()}
        topic = record.fields.get(b"topic", b"").decode(errors="replace")
        try:
            name = join_name(told.get("type", ""))
        except InvalidNameError:
            return
        self._known[number] = Channel(
            topic,
            name,
            "ros1",
            told.get("message_definition", ""),
            "msg",
            told.get("md5sum", ""),
            (QoS.latched(),) if told.get("latching") == "1" else (),
        )


def _records(file: BinaryIO) -> Iterator[_Record]:
    """Yield records up to the first one that is damaged or not there in full."""
    try:
        while True:
            offset = file.tell()
            fields = _fields(_block(file))
            kind = fields.get(b"op", b"")
            yield _Record(kind[0] if kind else 0, fields, _block(file), offset)
    except _EndError:
        return


def _block(file: BinaryIO) -> bytes:
    size = _number(file.read(_length.size))
    data = file.read(size) if 0 <= size < _MOST else b""
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
