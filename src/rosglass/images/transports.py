"""Image transports: under which topic and type a camera's pictures travel.

Topic names follow ROS's image_transport: the camera's base topic carries raw pictures, and each
other transport a subtopic named after it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

from rosglass.comm.time import Time
from rosglass.errors import UnsupportedError
from rosglass.images.compressed import decompress
from rosglass.images.compressed_depth import decompress_depth
from rosglass.images.ffmpeg import FfmpegDecoder
from rosglass.images.frame import RawImage
from rosglass.images.theora import TheoraDecoder

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from rosglass.comm.inbox import Sample
    from rosglass.messages import MessageType

__all__ = ["TRANSPORTS", "Choice", "PictureReader", "Transport", "choose"]

_KNOWN_ELSEWHERE = ("zstd", "draco")


class _Decoder(Protocol):
    """Decodes one stream; the arguments of `read` are the stamp and the transport's fields."""

    @property
    def read(self) -> Callable[..., RawImage | None]:
        """Make a picture."""

    def lost(self) -> None:
        """Tell that packets are missing."""


@dataclass(frozen=True, slots=True)
class _Still:
    """Decodes pictures that need no other."""

    read: Callable[..., RawImage]

    def lost(self) -> None:
        """Do nothing: the next picture is whole."""


@dataclass(frozen=True, slots=True)
class Transport:
    """One way pictures are sent.

    Attributes:
        name: Its name, as ROS's image_transport knows it.
        type: Message type.
        fields: Paths of the message's fields that the decoder needs.
        decoder: Makes a stream's decoder.
        video: Whether packets build upon earlier ones, so that each must be decoded.
    """

    name: str
    type: str
    fields: tuple[str, ...]
    decoder: Callable[[], _Decoder]
    video: bool = False

    def topic(self, base: str) -> str:
        """Return the topic that carries the pictures of the camera `base`."""
        return base if self.name == "raw" else f"{base}/{self.name}"

    def reader(self, type: MessageType, wire: str) -> PictureReader:
        """Return what reads the pictures of one stream out of its samples."""
        return PictureReader(self, type, wire)


class PictureReader:
    """Reads the pictures of one stream out of its samples, without copying where possible.

    Args:
        transport: How they are sent.
        type: The samples' type.
        wire: The samples' format.
    """

    def __init__(self, transport: Transport, type: MessageType, wire: str) -> None:
        # ROS 1 has other names for the two parts of a time.
        stamp = ("secs", "nsecs") if type.ros == 1 else ("sec", "nanosec")
        header = [*(f"header.stamp.{part}" for part in stamp), "header.frame_id"]
        self._get = type.path(*header, *transport.fields, wire=wire)
        self._decoder = transport.decoder()
        self._publisher, self._sequence = b"", -1

    def __call__(self, sample: Sample) -> RawImage | None:
        """Return the picture in a sample; None when the next sample is needed first.

        Raises:
            DecodeError: The sample is malformed.
            NoPictureError: A video cannot be shown before its next key frame.
            UnsupportedError: The picture cannot be shown.
        """
        if sample.sequence >= 0:
            follows = (self._publisher, self._sequence + 1) == (sample.publisher, sample.sequence)
            if self._sequence >= 0 and not follows:
                self._decoder.lost()
            self._publisher, self._sequence = sample.publisher, sample.sequence
        sec, nanosec, frame_id, *fields = self._get(sample.data)
        stamp = Time.from_parts(sec, nanosec) if sec or nanosec else None
        return self._decoder.read(stamp, frame_id, *fields)

    def lost(self) -> None:
        """Tell that samples were left out before the next one."""
        self._decoder.lost()


@dataclass(frozen=True, slots=True)
class Choice:
    """Where a camera's pictures are received from.

    Attributes:
        base: The camera's base topic.
        transport: The transport.
    """

    base: str
    transport: Transport

    @property
    def topic(self) -> str:
        """The topic to subscribe to."""
        return self.transport.topic(self.base)


def _read_raw(
    stamp: Time | None,
    frame_id: str,
    height: int,
    width: int,
    encoding: str,
    big_endian: int,
    step: int,
    data: Any,
) -> RawImage:
    return RawImage(width, height, encoding, step, data, bool(big_endian), stamp, frame_id)


def _read_compressed(stamp: Time | None, frame_id: str, format: str, data: Any) -> RawImage:
    return decompress(data, format, stamp, frame_id)


def _read_depth(stamp: Time | None, frame_id: str, format: str, data: Any) -> RawImage:
    return decompress_depth(data, format, stamp, frame_id)


#: Every transport that can be shown, those that need least to decode first.
TRANSPORTS = {
    transport.name: transport
    for transport in (
        Transport(
            "raw",
            "sensor_msgs/msg/Image",
            ("height", "width", "encoding", "is_bigendian", "step", "data"),
            lambda: _Still(_read_raw),
        ),
        Transport(
            "compressed",
            "sensor_msgs/msg/CompressedImage",
            ("format", "data"),
            lambda: _Still(_read_compressed),
        ),
        Transport(
            "compressedDepth",
            "sensor_msgs/msg/CompressedImage",
            ("format", "data"),
            lambda: _Still(_read_depth),
        ),
        Transport(
            "theora",
            "theora_image_transport/msg/Packet",
            ("data", "packetno"),
            TheoraDecoder,
            video=True,
        ),
        Transport(
            "ffmpeg",
            "ffmpeg_image_transport_msgs/msg/FFMPEGPacket",
            ("encoding", "pts", "flags", "data"),
            FfmpegDecoder,
            video=True,
        ),
    )
}


def choose(topic: str, preferred: str, published: Mapping[str, list[str]]) -> Choice | None:
    """Choose where to receive a camera's pictures from.

    The preferred transport is taken when it is published, otherwise one that is.

    Args:
        topic: The camera's base topic, or a transport's own topic such as ``.../compressed``.
        preferred: Name of the transport to prefer.
        published: The topics that have publishers, with their types.

    Returns:
        The choice; None when the camera publishes nothing yet.

    Raises:
        UnsupportedError: `preferred` is unknown, or the camera only offers unknown transports.
    """
    if preferred not in TRANSPORTS:
        raise UnsupportedError(
            f"image transport {preferred!r} is unknown; known are: {', '.join(TRANSPORTS)}"
        )
    base, _, last = topic.rpartition("/")
    if last in TRANSPORTS and TRANSPORTS[last].type in published.get(topic, ()):
        return Choice(base, TRANSPORTS[last])
    for name in (preferred, *TRANSPORTS):
        transport = TRANSPORTS[name]
        if transport.type in published.get(transport.topic(topic), ()):
            return Choice(topic, transport)
    others = [name for name in _KNOWN_ELSEWHERE if f"{topic}/{name}" in published]
    if others:
        raise UnsupportedError(
            f"{topic} is only sent as {', '.join(others)}; "
            f"pictures can be received as: {', '.join(TRANSPORTS)}"
        )
    if topic in published:
        raise UnsupportedError(
            f"{topic} carries {', '.join(published[topic])}, not pictures "
            f"({', '.join(dict.fromkeys(t.type for t in TRANSPORTS.values()))})"
        )
    return None
