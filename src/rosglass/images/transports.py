"""Image transports: under which topic and type a camera's pictures travel.

Topic names follow ROS's image_transport: the camera's base topic carries raw pictures, and each
other transport a subtopic named after it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from rosglass.comm.time import Time
from rosglass.errors import UnsupportedError
from rosglass.images.compressed import decompress
from rosglass.images.frame import RawImage

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from rosglass.comm.sample import Sample
    from rosglass.messages import MessageType

__all__ = ["TRANSPORTS", "Choice", "Transport", "choose"]

_KNOWN_ELSEWHERE = ("compressedDepth", "theora", "ffmpeg", "zstd", "draco")


@dataclass(frozen=True, slots=True)
class Transport:
    """One way pictures are sent.

    Attributes:
        name: Its name, as ROS's image_transport knows it.
        type: Message type.
        fields: Paths of the message's fields that `read` needs.
        read: Makes a picture from the two parts of the stamp and those fields.
    """

    name: str
    type: str
    fields: tuple[str, ...]
    read: Callable[..., RawImage]

    def topic(self, base: str) -> str:
        """Return the topic that carries the pictures of the camera `base`."""
        return base if self.name == "raw" else f"{base}/{self.name}"

    def reader(self, type: MessageType, wire: str) -> Callable[[Sample], RawImage]:
        """Return a function that reads a picture out of a received sample without copying it.

        The function raises DecodeError for malformed samples and UnsupportedError for pictures
        that cannot be shown.
        """
        # ROS 1 has other names for the two parts of a time.
        stamp = ("secs", "nsecs") if type.ros == 1 else ("sec", "nanosec")
        header = [f"header.stamp.{part}" for part in stamp]
        get = type.path(*header, *self.fields, wire=wire)
        read = self.read
        return lambda sample: read(*get(sample.data))


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


def _stamp(sec: int, nanosec: int) -> Time | None:
    return Time.from_parts(sec, nanosec) if sec or nanosec else None


def _read_raw(
    sec: int,
    nanosec: int,
    frame_id: str,
    height: int,
    width: int,
    encoding: str,
    big_endian: int,
    step: int,
    data: Any,
) -> RawImage:
    return RawImage(
        width, height, encoding, step, data, bool(big_endian), _stamp(sec, nanosec), frame_id
    )


def _read_compressed(sec: int, nanosec: int, frame_id: str, format: str, data: Any) -> RawImage:
    return decompress(data, format, _stamp(sec, nanosec), frame_id)


#: Every transport that can be shown.
TRANSPORTS = {
    "raw": Transport(
        "raw",
        "sensor_msgs/msg/Image",
        ("header.frame_id", "height", "width", "encoding", "is_bigendian", "step", "data"),
        _read_raw,
    ),
    "compressed": Transport(
        "compressed",
        "sensor_msgs/msg/CompressedImage",
        ("header.frame_id", "format", "data"),
        _read_compressed,
    ),
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
            f"({', '.join(t.type for t in TRANSPORTS.values())})"
        )
    return None
