"""Files that recordings are written into, as :class:`~rosglass.bags.Recorder` sees them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, BinaryIO

from rosglass.errors import BagError

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from rosglass.comm import QoS, Sample
    from rosglass.messages import MessageType

__all__ = ["DEFAULT_COMPRESSION", "RecordingFile", "create"]

#: What each format takes, and what it has unless told otherwise.
_COMPRESSIONS = {".mcap": ("zstd", "lz4", "none"), ".bag": ("none", "lz4", "bz2")}
DEFAULT_COMPRESSION = {".mcap": "zstd", ".bag": "none"}


class RecordingFile(ABC):
    """A recording that is being written; used from one thread."""

    @abstractmethod
    def channel(
        self, topic: str, kind: MessageType, offered: Sequence[QoS], publisher: bytes
    ) -> int:
        """Announce messages of a topic, and return a number for them.

        Args:
            topic: Absolute name.
            kind: Their type; opaque when nobody knows its definition.
            offered: Quality of service of the topic's publishers.
            publisher: Who sends them, where the format keeps that; see :attr:`by_publisher`.
        """

    #: Whether the format tells apart who published a message.
    by_publisher = False

    @abstractmethod
    def write(self, channel: int, sample: Sample) -> None:
        """Write a message; may raise OSError."""

    @abstractmethod
    def flush(self) -> None:
        """See to it that what was written so far survives a crash of this program."""

    @abstractmethod
    def size(self) -> int:
        """Return how many bytes the file has by now."""

    @abstractmethod
    def finish(self) -> None:
        """Write what makes the file complete."""

    @abstractmethod
    def close(self) -> None:
        """Close the file, complete or not; safe to call twice."""


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
        from rosglass.bags.ros1_bag_file import Ros1BagFile  # noqa: PLC0415 - slow to import

        return Ros1BagFile(path, file, compression)
    from rosglass.bags.mcap_file import McapFile  # noqa: PLC0415 - the library is an extra

    return McapFile(file, wire, compression)
