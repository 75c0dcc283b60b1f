"""What a recording holds, whichever format it has."""

from __future__ import annotations

import os
from abc import abstractmethod
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from rosglass.comm import Handle, QoS
from rosglass.errors import BagError, DefinitionError, Error
from rosglass.messages import MessageType, OpaqueType, load

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator

    from rosglass.interfaces import Library

__all__ = ["Bag", "BagMessage", "Channel", "open_bag"]

#: How an MCAP file begins, whatever its name.
_MCAP = b"\x89MCAP0\r\n"


@dataclass(frozen=True)
class Channel:
    """One topic of a recording, with one type.

    Attributes:
        topic: Absolute topic name.
        type_name: ``pkg/msg/Type``.
        wire: Format of the messages, ``cdr`` or ``ros1``.
        text: The definition with all that it needs, as the recording has it; may be empty.
        encoding: Language of `text`: ``msg`` or ``idl``.
        type_hash: RIHS01 hash of the type, in ROS 1 its md5 sum; empty when the recording has none.
        offered: Quality of service of the publishers that were recorded.
        count: Messages, -1 when that is not known before reading them.
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
        """Return the type: from the recording, or else from `library`; opaque if nobody has it.

        Raises:
            DefinitionError: The definition in the recording has an error.
        """
        ros = 1 if self.wire == "ros1" else 2
        if self.text and self.encoding == "msg":
            return self._by_text(ros)
        try:
            wanted = self.type_hash if ros == 1 else ""
            known = load(self.type_name, ros=ros, library=library, hash=wanted)
        except Error as error:
            if ros == 1 and not self.type_hash:
                raise
            reason = f"the recording has no definition of it, and {error}"
            return OpaqueType(self.type_name, self.type_hash, reason, ros=ros)
        assert isinstance(known, MessageType)
        return known

    def _by_text(self, ros: int) -> MessageType:
        try:
            found = MessageType.from_text(self.type_name, self.text, ros=ros)
        except DefinitionError as error:
            if ros == 2 or not self.type_hash:
                raise
            reason = str(error)
        else:
            if ros == 2 or self.type_hash in ("", "*", found.md5):
                return found
            reason = f"the recording says md5 {self.type_hash}, its definition has {found.md5}"
        # In ROS 1, a message can be passed on with whatever its publisher sent for a definition.
        return OpaqueType(self.type_name, self.type_hash, reason, text=self.text, ros=1)

    def profile(self) -> QoS:
        """Return a profile that serves whoever subscribed to the recorded publishers."""
        if not self.offered:
            return QoS()
        return QoS.best_available(max(qos.depth for qos in self.offered)).for_subscription(
            self.offered
        )


class BagMessage(NamedTuple):
    """A recorded message.

    Attributes:
        channel: What it belongs to.
        time: When it was received, in nanoseconds since the Unix epoch.
        data: Its bytes, in the channel's wire format.
    """

    channel: Channel
    time: int
    data: bytes


class Bag(Handle):
    """A recording that is open for reading; made by :func:`open_bag`.

    Attributes:
        path: Where it is.
        channels: What it holds, sorted by topic.
        start: Time of the first message, in nanoseconds since the Unix epoch.
        end: Time of the last message.
        problem: What is wrong with the recording though it can be read; empty when nothing is.
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
            channels: Which; None for all.
            start: Time of the first one, in nanoseconds; None from the beginning.
            end: Time before which to stop; None for the end.

        Raises:
            BagError: The file is damaged.
        """


def open_bag(path: str | os.PathLike[str]) -> Bag:
    """Open a recording: an MCAP file, a ROS 2 bag (folder, ``.mcap`` or ``.db3``), a ROS 1 bag.

    Raises:
        BagError: It does not exist, is damaged, or is none of these.
    """
    if not isinstance(path, (str, os.PathLike)):
        raise BagError(f"a recording is given by its path, not by {path!r:.80}")
    found = Path(path).expanduser()
    if not found.exists():
        raise BagError(f"{found} does not exist; name an MCAP file, a ROS 2 bag or a ROS 1 bag")
    if found.is_file() and (found.suffix == ".mcap" or _starts_with(found, _MCAP)):
        from rosglass.bags.mcap_bag import McapBag  # noqa: PLC0415 - the library is an extra

        return McapBag(found)
    from rosglass.bags.ros1_cut_bag import MAGIC, Ros1CutBag  # noqa: PLC0415 - for few files
    from rosglass.bags.rosbags_bag import RosbagsBag  # noqa: PLC0415 - slow to import

    try:
        return RosbagsBag(found)
    except BagError:
        if not (found.is_file() and _starts_with(found, MAGIC)):
            raise
    return Ros1CutBag(found)


def _starts_with(path: Path, magic: bytes) -> bool:
    try:
        with path.open("rb") as file:
            return file.read(len(magic)) == magic
    except OSError as error:
        raise BagError(f"{path} cannot be read: {error.strerror}") from error
