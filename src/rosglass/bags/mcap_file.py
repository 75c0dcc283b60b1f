"""MCAP recordings (https://mcap.dev/spec), written with the ``mcap`` package.

Profiles and metadata: https://mcap.dev/spec/registry, and what rosbag2 and the ``mcap`` command
write when they convert a ROS 1 bag.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, BinaryIO

from mcap.writer import CompressionType, Writer

import rosglass
from rosglass.bags.qos_text import write_profiles
from rosglass.bags.recording_file import RecordingFile
from rosglass.comm import Durability
from rosglass.interfaces import full_text, ros1_name
from rosglass.messages import OpaqueType

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rosglass.comm import QoS, Sample
    from rosglass.messages import MessageType

__all__ = ["McapFile"]

_COMPRESSIONS = {
    "none": CompressionType.NONE,
    "lz4": CompressionType.LZ4,
    "zstd": CompressionType.ZSTD,
}


class McapFile(RecordingFile):
    """An MCAP file with messages of one world.

    Args:
        file: Where to write; closed at the end.
        wire: ``cdr`` or ``ros1``.
        compression: ``none``, ``lz4`` or ``zstd``.
    """

    def __init__(self, file: BinaryIO, wire: str, compression: str) -> None:
        self._file, self._wire = file, wire
        self.by_publisher = wire == "ros1"
        self._writer: Any = Writer(file, compression=_COMPRESSIONS[compression])
        profile = "ros1" if wire == "ros1" else "ros2"
        self._writer.start(profile=profile, library=f"rosglass {rosglass.__version__}")

    def channel(
        self, topic: str, kind: MessageType, offered: Sequence[QoS], publisher: bytes
    ) -> int:
        """Announce messages of a topic; see :meth:`RecordingFile.channel`."""
        ros1 = self._wire == "ros1"
        name, language = (ros1_name(kind.name), "ros1msg") if ros1 else (kind.name, "ros2msg")
        text = kind.text if isinstance(kind, OpaqueType) else full_text(kind.definition)
        schema = self._writer.register_schema(name, language if text else "", text.encode())
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
        """Return how many bytes the file has by now."""
        return self._file.tell()

    def finish(self) -> None:
        """Write the summary."""
        self._writer.finish()

    def close(self) -> None:
        """Close the file."""
        self._file.close()
