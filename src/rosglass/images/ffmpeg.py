"""The transport ``ffmpeg``: H.264, HEVC, AV1 and others, as ffmpeg_image_transport sends them.

The ``encoding`` field begins with a codec (``hevc;yuv420p;bgr8;bgr8``), or, from older publishers,
is the name of FFmpeg's encoder (``h264_nvenc``).
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from rosglass.errors import DecodeError, UnsupportedError
from rosglass.images.video import VideoDecoder

if TYPE_CHECKING:
    from rosglass.comm.time import Time
    from rosglass.images.frame import RawImage

__all__ = ["FfmpegDecoder"]

_TYPE = "ffmpeg_image_transport_msgs/msg/FFMPEGPacket"
#: What codec and encoder names contain -> FFmpeg's decoders for them, the best first.
_CODECS = {
    "264": ("h264",),
    "hevc": ("hevc",),
    "265": ("hevc",),
    "av1": ("libdav1d", "libaom-av1", "av1"),
    "vp9": ("libvpx-vp9", "vp9"),
    "vp8": ("vp8",),
    "libvpx": ("vp8",),
    "mjpeg": ("mjpeg",),
    "mpeg4": ("mpeg4",),
}
_KEY = 1
#: Packets numbered in steps of one before a gap in the numbers is taken for a loss.
_TRUST = 4
_START_CODE = re.compile(rb"\x00\x00\x01(.)", re.DOTALL)
#: Parameter sets come first in a key frame.
_SEARCHED = 512


def _decoders(encoding: str) -> tuple[str, ...]:
    name = encoding.partition(";")[0].strip().lower()
    for part, decoders in _CODECS.items():
        if part in name:
            return decoders
    raise UnsupportedError(
        f"video encoding {encoding[:40]!r} cannot be shown; these can: "
        "h264, hevc, av1, vp9, vp8, mjpeg, mpeg4"
    )


def _is_key(decoders: tuple[str, ...], flags: int, view: memoryview) -> bool:
    """Tell whether decoding can start at a packet.

    Some publishers leave the flags empty: NAL unit types of H.264 (table 7-1) and HEVC (7-1) tell.
    """
    if flags & _KEY:
        return True
    types = [found[1][0] for found in _START_CODE.finditer(view[:_SEARCHED])]
    if decoders[0] == "h264":
        return any(unit & 31 in {5, 7} for unit in types)
    if decoders[0] == "hevc":
        return any(unit >> 1 & 63 in {*range(16, 22), 32, 33, 34} for unit in types)
    return decoders[0] == "mjpeg"


class FfmpegDecoder:
    """Decodes the packets of one stream."""

    def __init__(self) -> None:
        self._encoding = ""
        self._codecs: tuple[str, ...] = ()
        self._decoder: VideoDecoder | None = None
        self._number, self._steps = -1, 0

    def lost(self) -> None:
        """Tell that packets are missing before the next one."""
        if self._decoder is not None:
            self._decoder.lost()

    def read(
        self,
        stamp: Time | None,
        frame_id: str,
        encoding: str,
        number: int,
        flags: int,
        data: Any,
    ) -> RawImage | None:
        """Decode a packet.

        Args:
            stamp: When the picture was taken.
            frame_id: Coordinate frame of the camera.
            encoding: The codec.
            number: The codec's presentation time.
            flags: FFmpeg's packet flags; 1 marks key frames.
            data: The packet.

        Returns:
            The newest complete picture; None when the next packet is needed first.

        Raises:
            NoPictureError: No key frame has come yet.
            DecodeError: The packet is corrupt.
            UnsupportedError: The codec is unknown, or PyAV is not installed.
        """
        view = memoryview(data).cast("B")
        if not len(view):
            raise DecodeError(_TYPE, "the packet is empty", "data", 0)
        if self._decoder is None or encoding != self._encoding:
            self._decoder = None
            codecs = _decoders(encoding)
            self._decoder = VideoDecoder(_TYPE, codecs)
            self._encoding, self._codecs = encoding, codecs
            self._number, self._steps = -1, 0
        self._follow(number)
        key = _is_key(self._codecs, flags, view)
        return self._decoder.decode(view, key, stamp, frame_id)

    def _follow(self, number: int) -> None:
        """Notice missing packets: H.264 and AV1 decoders smear over them without a word.

        The publisher numbers pictures by one; times and reordered pictures look different.
        """
        if number == self._number + 1:
            self._steps += 1
        else:
            if self._steps >= _TRUST:
                self.lost()
            self._steps = 0
        self._number = number
