"""ROS 1 bags (ROS wiki, "Bags/Format/2.0"), written with the ``rosbags`` package."""

from __future__ import annotations

import struct
from contextlib import suppress
from typing import TYPE_CHECKING, Any, BinaryIO

from rosbags.rosbag1 import Writer

from rosglass.bags.recording_file import RecordingFile
from rosglass.bags.ros1_cut_bag import MAGIC
from rosglass.comm import Durability
from rosglass.interfaces import full_text
from rosglass.messages import OpaqueType

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from rosglass.comm import QoS, Sample
    from rosglass.messages import MessageType

__all__ = ["Ros1BagFile"]

_length = struct.Struct("<I")
#: Bytes of the header's fields (op, index_pos, conn_count, chunk_count), and of these with padding.
_FIELDS, _HEADER = 69, 4096


class Ros1BagFile(RecordingFile):
    """A ROS 1 bag, as ``rosbag record`` writes it.

    Args:
        path: The file, which was just made.
        file: The same, open and empty.
        compression: ``none``, ``lz4`` or ``bz2``.
    """

    by_publisher = True

    def __init__(self, path: Path, file: BinaryIO, compression: str) -> None:
        file.close()
        path.unlink()  # rosbags makes it itself
        self._writer: Any = Writer(path)
        if compression != "none":
            self._writer.set_compression(Writer.CompressionFormat[compression.upper()])
        self._writer.open()
        self._path = path
        # Another version of rosbags may do it by itself.
        opened: Any = self._writer.bio
        self._short = opened.tell() == len(MAGIC) + _HEADER
        if self._short:
            _pad(opened)
        self._connections: list[Any] = []
        self._indexed = 0

    def channel(
        self, topic: str, kind: MessageType, offered: Sequence[QoS], publisher: bytes
    ) -> int:
        """Announce messages of a topic from a node; see :meth:`RecordingFile.channel`."""
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
        self._forget()

    def flush(self) -> None:
        """Write the chunk in progress; its index comes at the end, ``rosbag reindex`` makes one."""
        self._writer.write_chunk(self._writer.chunks[-1])
        self._forget()
        self._writer.bio.flush()

    def size(self) -> int:
        """Return how many bytes the file has by now."""
        return int(self._writer.bio.tell()) if self._writer.bio is not None else 0

    def finish(self) -> None:
        """Write the index."""
        self._writer.close()
        if self._short:
            with self._path.open("r+b") as file:
                _pad(file)

    def close(self) -> None:
        """Close the file."""
        with suppress(OSError):
            self._writer.abort()

    def _forget(self) -> None:
        """Keep of chunks that are written what their index needs: how many messages they have.

        rosbags keeps the place of each message to the end, some 200 bytes a message.
        """
        chunks = self._writer.chunks
        while self._indexed < len(chunks) - 1:
            places = chunks[self._indexed].connections
            for number in places:
                places[number] = range(len(places[number]))
            self._indexed += 1


def _pad(file: Any) -> None:
    """Make the file's header as long as rosbag's: 4096 bytes without the lengths of its two parts.

    The rosbags package counts these, too. ``rosbag reindex`` writes a header anew in its own
    length, and would write over the first chunk.
    """
    file.seek(len(MAGIC) + _length.size + _FIELDS)
    file.write(_length.pack(_HEADER - _FIELDS))
    file.write(b" " * (_HEADER - _FIELDS))
