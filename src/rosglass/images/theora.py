"""The transport ``theora``: Ogg Theora without Ogg, as theora_image_transport sends it.

Bitstream: Theora Specification (Xiph.Org), sections 6 and 7. The stream begins with three header
packets; its colours span the full range of values, as OpenCV's YCrCb.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from rosglass.errors import DecodeError, NoPictureError
from rosglass.images.encodings import MAX_PIXELS
from rosglass.images.video import VideoDecoder

if TYPE_CHECKING:
    from rosglass.comm.time import Time
    from rosglass.images.frame import RawImage

__all__ = ["TheoraDecoder"]

_TYPE = "theora_image_transport/msg/Packet"
_HEADER, _INTER, _FIRST = 0x80, 0x40, 0x80
_IDENTIFICATION_SIZE = 42


class TheoraDecoder:
    """Decodes the packets of one Theora stream."""

    def __init__(self) -> None:
        self._headers: dict[int, bytes] = {}
        self._decoder: VideoDecoder | None = None
        self._number = -1
        self._last: RawImage | None = None

    def lost(self) -> None:
        """Tell that packets are missing before the next one."""
        self._last = None
        if self._decoder is not None:
            self._decoder.lost()

    def read(
        self, stamp: Time | None, frame_id: str, data: Any, packet_number: int
    ) -> RawImage | None:
        """Decode a packet.

        Returns:
            The picture; None for headers.

        Raises:
            NoPictureError: The headers or a key frame have not come yet.
            DecodeError: The packet is corrupt.
            UnsupportedError: PyAV is not installed.
        """
        view = memoryview(data).cast("B")
        if len(view) and view[0] & _HEADER:
            self._read_header(bytes(view))
            self._number = packet_number
            return None
        if self._decoder is None:
            raise NoPictureError(
                "waiting for the headers of the Theora stream; they are sent when it begins: if "
                "none come, restart the publisher"
            )
        if packet_number != self._number + 1 and self._number > 2:
            self.lost()
        self._number = packet_number
        if not len(view):
            # An empty packet repeats the picture.
            self._last = self._last and replace(self._last, stamp=stamp, frame_id=frame_id)
            return self._last
        self._last, last = None, None
        last = self._decoder.decode(view, not view[0] & _INTER, stamp, frame_id)
        self._last = last
        return last

    def _read_header(self, data: bytes) -> None:
        kind = data[0]
        if data[1:7] != b"theora" or kind not in {0x80, 0x81, 0x82}:
            raise DecodeError(_TYPE, "the header is not one of Theora's", "data", 0)
        if self._headers.get(kind) == data and self._decoder is not None:
            return
        if kind == _FIRST:
            self._check(data)
            self._headers.clear()
        self._decoder, self._last = None, None
        self._headers[kind] = data
        if len(self._headers) == 3:
            self._decoder = VideoDecoder(
                _TYPE, ("theora",), _lace([self._headers[k] for k in (0x80, 0x81, 0x82)]), True
            )

    @staticmethod
    def _check(data: bytes) -> None:
        """Refuse sizes that fill memory before any decoder sees them."""
        if len(data) < _IDENTIFICATION_SIZE:
            raise DecodeError(_TYPE, "the identification header is cut off", "data", len(data))
        width = 16 * int.from_bytes(data[10:12], "big")
        height = 16 * int.from_bytes(data[12:14], "big")
        if not 0 < width * height <= MAX_PIXELS:
            raise DecodeError(
                _TYPE, f"{width}x{height} pixels cannot be shown, {MAX_PIXELS} at most", "data", 10
            )


def _lace(headers: list[bytes]) -> bytes:
    """Join packets with Xiph lacing (Matroska, RFC 9559, section 10.3.2)."""
    sizes = bytearray([len(headers) - 1])
    for header in headers[:-1]:
        sizes += b"\xff" * (len(header) // 255) + bytes([len(header) % 255])
    return bytes(sizes) + b"".join(headers)
