"""Image transports: topics, message types and decoders.

Topic names follow ROS's image_transport: raw images on the camera's base topic, and each other
transport on a subtopic of its name.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

from rosglass.comm.time import Time
from rosglass.errors import UnsupportedError
from rosglass.images.compressed import decompress, decompress_depth
from rosglass.images.encodings import RawImage
from rosglass.images.video import FfmpegDecoder, TheoraDecoder

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from rosglass.comm.inbox import Sample
    from rosglass.messages import MessageType

__all__ = [
    "TRANSPORTS",
    "Choice",
    "PictureReader",
    "Transport",
    "camera_info_topic",
    "choose",
]

_UNSUPPORTED = ("zstd", "draco")


class _Decoder(Protocol):
    """Decodes a stream; the arguments of `read` are the stamp and the transport's fields."""

    @property
    def read(self) -> Callable[..., RawImage | None]:
        """Decode an image."""

    def lost(self) -> None:
        """Record that packets are missing."""


@dataclass(frozen=True, slots=True)
class _Still:
    """Decodes still images."""

    read: Callable[..., RawImage]

    def lost(self) -> None:
        """Do nothing: still images are independent."""


@dataclass(frozen=True, slots=True)
class Transport:
    """An image transport.

    Attributes:
        name: Name as in ROS's image_transport.
        type: Message type.
        fields: Paths of the message's fields that the decoder needs.
        decoder: Creates the decoder of a stream.
        video: Whether packets depend on earlier ones, so that all must be decoded.
    """

    name: str
    type: str
    fields: tuple[str, ...]
    decoder: Callable[[], _Decoder]
    video: bool = False

    def topic(self, base: str) -> str:
        """Return the topic for the images of a camera with base topic `base`."""
        return base if self.name == "raw" else f"{base}/{self.name}"

    def reader(self, type: MessageType, wire: str) -> PictureReader:
        """Create a reader for the samples of a stream."""
        return PictureReader(self, type, wire)


class PictureReader:
    """Reads the images of a stream from its samples, without copying where possible.

    Args:
        transport: The transport.
        type: Type of the samples.
        wire: Wire format of the samples.
    """

    def __init__(self, transport: Transport, type: MessageType, wire: str) -> None:
        # The fields of a time have other names in ROS 1.
        stamp = ("secs", "nsecs") if type.ros == 1 else ("sec", "nanosec")
        header = [*(f"header.stamp.{part}" for part in stamp), "header.frame_id"]
        self._get = type.path(*header, *transport.fields, wire=wire)
        self._decoder = transport.decoder()
        self._publisher, self._sequence = b"", -1

    def __call__(self, sample: Sample) -> RawImage | None:
        """Return the image of a sample; None if the next sample is needed first.

        Raises:
            DecodeError: The sample is malformed.
            NoPictureError: A video needs its next key frame first.
            UnsupportedError: The image is not supported.
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
        """Record that samples were left out before the next one."""
        self._decoder.lost()


@dataclass(frozen=True, slots=True)
class Choice:
    """The topic and transport of a camera's images.

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


#: All supported transports, the cheapest to decode first.
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


def camera_info_topic(topic: str) -> str:
    """Return the topic of the ``CameraInfo`` that belongs to an image topic.

    Args:
        topic: The camera's base topic, or that of a transport: ``/front/image_raw/compressed``.
    """
    base, _, last = topic.rpartition("/")
    if last in TRANSPORTS:
        base = base.rpartition("/")[0]
    return f"{base}/camera_info"


def choose(topic: str, preferred: str, published: Mapping[str, list[str]]) -> Choice | None:
    """Choose the transport of a camera: the preferred one, or else another one that is published.

    Args:
        topic: The camera's base topic, or the topic of a transport such as ``.../compressed``.
        preferred: Name of the preferred transport.
        published: Topics with publishers, with their types.

    Returns:
        The choice; None if the camera does not publish yet.

    Raises:
        UnsupportedError: `preferred` is unknown, or the camera has unsupported transports only.
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
    others = [name for name in _UNSUPPORTED if f"{topic}/{name}" in published]
    if others:
        raise UnsupportedError(
            f"{topic} is only sent as {', '.join(others)}; "
            f"images can be received as: {', '.join(TRANSPORTS)}"
        )
    if topic in published:
        raise UnsupportedError(
            f"{topic} carries {', '.join(published[topic])}, not images "
            f"({', '.join(dict.fromkeys(t.type for t in TRANSPORTS.values()))})"
        )
    return None
