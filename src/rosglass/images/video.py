"""The video transports ``ffmpeg`` and ``theora``, decoded with PyAV.

In messages of ffmpeg_image_transport, the ``encoding`` field begins with a codec
(``hevc;yuv420p;bgr8;bgr8``), or, from older publishers, is the name of FFmpeg's encoder
(``h264_nvenc``).

theora_image_transport sends Ogg Theora without Ogg (Theora Specification, Xiph.Org, sections 6 and
7). The stream begins with three header packets; its colours have the full range, as OpenCV's YCrCb.
"""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np

from rosglass.errors import DecodeError, NoPictureError, UnsupportedError
from rosglass.extras import install_command
from rosglass.images.encodings import MAX_PIXELS, RawImage

if TYPE_CHECKING:
    from rosglass.comm.time import Time

__all__ = ["FfmpegDecoder", "TheoraDecoder", "VideoDecoder", "pyav"]


#: Number of frames whose stamp is kept until the decoder has reordered them.
_MAX_REORDERED = 64
#: Colour spaces (ITU-T H.273) that displays assume: unspecified, BT.470BG, SMPTE 170M.
_STANDARD = {2, 5, 6}
_FULL_RANGE = 2


@cache
def pyav() -> Any:
    """Import PyAV when it is first needed, and return it.

    Raises:
        UnsupportedError: It is not installed.
    """
    try:
        return import_module("av")
    except ImportError:
        raise UnsupportedError(
            "this video needs PyAV, which is not installed; "
            f"install it with: {install_command('video')}, or choose another image transport"
        ) from None


class VideoDecoder:
    """Decodes the packets of a video stream.

    Starts at a key frame, also after a loss: what decoders conceal for missing packets looks like a
    live image but is not.

    Args:
        type_name: Message type, for error texts.
        codecs: FFmpeg's names of decoders; the first available one is used.
        extradata: Codec configuration to set before the first packet.
        full_range: Whether luma has the range 0..255 although the stream does not declare it.

    Raises:
        UnsupportedError: PyAV is not installed, or has none of the decoders.
        DecodeError: The decoder refuses the extradata.
    """

    def __init__(
        self,
        type_name: str,
        codecs: tuple[str, ...],
        extradata: bytes = b"",
        full_range: bool = False,
    ) -> None:
        self._type, self._full_range = type_name, full_range
        self._codecs, self._extradata = codecs, extradata
        self._context = self._open()
        self._waiting = "waiting for the first key frame of the video"
        self._count = 0
        self._stamps: dict[int, tuple[Time | None, str]] = {}

    def _open(self) -> Any:
        av = pyav()
        for name in self._codecs:
            try:
                context = av.CodecContext.create(name, "r")
            except ValueError:
                continue
            # Frame threads would delay each frame.
            context.thread_type, context.thread_count = "SLICE", 0
            context.options = {"max_pixels": str(MAX_PIXELS), "flags": "low_delay"}
            if self._extradata:
                context.extradata = self._extradata
            try:
                context.open()
            except (av.error.FFmpegError, ValueError) as error:
                raise DecodeError(
                    self._type, f"{name} refuses the stream's headers: {error}", "data"
                ) from None
            return context
        raise UnsupportedError(f"the installed PyAV cannot decode {' or '.join(self._codecs)}")

    def lost(self) -> None:
        """Record that packets are missing before the next one."""
        if not self._waiting:
            self._wait("a packet of the video was lost; waiting for the next key frame")

    def _wait(self, why: str) -> None:
        self._waiting = why
        self._stamps.clear()
        self._context.flush_buffers()

    def decode(self, data: Any, key: bool, stamp: Time | None, frame_id: str) -> RawImage | None:
        """Decode a packet.

        Args:
            data: The packet.
            key: Whether it is a key frame.
            stamp: Time of the image.
            frame_id: Coordinate frame of the camera.

        Returns:
            The newest complete image; None if the next packet is needed first.

        Raises:
            NoPictureError: A key frame is needed first.
            DecodeError: The packet is corrupt.
        """
        if self._waiting and not key:
            raise NoPictureError(
                f"{self._waiting}; if it takes long, let the publisher send them more often"
            )
        if not len(data):
            # Decoders treat it as the end of the stream.
            raise DecodeError(self._type, "the packet is empty", "data")
        self._count += 1
        self._stamps[self._count] = (stamp, frame_id)
        while len(self._stamps) > _MAX_REORDERED:
            del self._stamps[next(iter(self._stamps))]
        try:
            picture = self._feed(data)
        except DecodeError:
            self._wait("a packet of the video was corrupt; waiting for the next key frame")
            if not key:
                raise
            # Earlier packets may have corrupted the decoder's state; a key frame needs none.
            self._context = self._open()
            self._stamps[self._count] = (stamp, frame_id)
            picture = self._feed(data)
        self._waiting = ""
        return picture

    def _feed(self, data: Any) -> RawImage | None:
        av = pyav()
        packet = av.Packet(data)
        packet.pts = self._count
        try:
            frames = self._context.decode(packet)
            if not frames:
                return None
            if frames[-1].is_corrupt:
                raise DecodeError(self._type, "the frame is damaged", "data")
            return self._picture(frames[-1])
        except (av.error.FFmpegError, ValueError, MemoryError) as error:
            raise DecodeError(self._type, f"the packet is corrupt: {error}", "data") from None

    def _picture(self, frame: Any) -> RawImage:
        name = frame.format.name
        ranges = {}
        if self._full_range:
            ranges = {"src_color_range": _FULL_RANGE, "dst_color_range": _FULL_RANGE}
        limited = not self._full_range and frame.color_range != _FULL_RANGE
        standard = limited and frame.colorspace in _STANDARD
        even = not (frame.width % 2 or frame.height % 2)
        if name == "gray":
            encoding, pixels = "mono8", frame.to_ndarray()
        elif name.startswith("gray"):
            encoding, pixels = "mono16", frame.reformat(format="gray16le").to_ndarray()
        elif name in {"yuv420p", "nv12"} and standard and even:
            encoding, pixels = "nv12", frame.reformat(format="nv12").to_ndarray()
        else:
            encoding, pixels = "rgb8", frame.reformat(format="rgb24", **ranges).to_ndarray()
        pixels = np.ascontiguousarray(pixels)
        stamp, frame_id = self._stamps.pop(frame.pts, (None, ""))
        return RawImage(
            frame.width,
            frame.height,
            encoding,
            pixels.strides[0],
            pixels.reshape(-1).view(np.uint8),
            stamp=stamp,
            frame_id=frame_id,
        )


_FFMPEG_TYPE = "ffmpeg_image_transport_msgs/msg/FFMPEGPacket"
#: Parts of codec and encoder names, with FFmpeg's decoders, the best first.
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
#: Number of consecutive packets after which a gap in the numbers counts as a loss.
_MIN_CONSECUTIVE = 4
_START_CODE = re.compile(rb"\x00\x00\x01(.)", re.DOTALL)
#: Number of bytes to search for parameter sets, which are first in a key frame.
_SEARCH_SIZE = 512


def _find_decoders(encoding: str) -> tuple[str, ...]:
    name = encoding.partition(";")[0].strip().lower()
    for part, decoders in _CODECS.items():
        if part in name:
            return decoders
    raise UnsupportedError(
        f"video encoding {encoding[:40]!r} cannot be shown; these can: "
        "h264, hevc, av1, vp9, vp8, mjpeg, mpeg4"
    )


def _is_key(decoders: tuple[str, ...], flags: int, view: memoryview) -> bool:
    """Return whether a packet is a key frame.

    Some publishers leave the flags empty; then the NAL unit types of H.264 (table 7-1) and HEVC
    (table 7-1) are used.
    """
    if flags & _KEY:
        return True
    types = [found[1][0] for found in _START_CODE.finditer(view[:_SEARCH_SIZE])]
    if decoders[0] == "h264":
        return any(unit & 31 in {5, 7} for unit in types)
    if decoders[0] == "hevc":
        return any(unit >> 1 & 63 in {*range(16, 22), 32, 33, 34} for unit in types)
    return decoders[0] == "mjpeg"


class FfmpegDecoder:
    """Decodes the packets of an ``ffmpeg`` stream."""

    def __init__(self) -> None:
        self._encoding = ""
        self._codecs: tuple[str, ...] = ()
        self._decoder: VideoDecoder | None = None
        self._number, self._steps = -1, 0

    def lost(self) -> None:
        """Record that packets are missing before the next one."""
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
            stamp: Time of the image.
            frame_id: Coordinate frame of the camera.
            encoding: The codec.
            number: The codec's presentation time.
            flags: FFmpeg's packet flags; 1 marks key frames.
            data: The packet.

        Returns:
            The newest complete image; None if the next packet is needed first.

        Raises:
            NoPictureError: A key frame is needed first.
            DecodeError: The packet is corrupt.
            UnsupportedError: The codec is unknown, or PyAV is not installed.
        """
        view = memoryview(data).cast("B")
        if not len(view):
            raise DecodeError(_FFMPEG_TYPE, "the packet is empty", "data", 0)
        if self._decoder is None or encoding != self._encoding:
            self._decoder = None
            codecs = _find_decoders(encoding)
            self._decoder = VideoDecoder(_FFMPEG_TYPE, codecs)
            self._encoding, self._codecs = encoding, codecs
            self._number, self._steps = -1, 0
        self._check_number(number)
        key = _is_key(self._codecs, flags, view)
        return self._decoder.decode(view, key, stamp, frame_id)

    def _check_number(self, number: int) -> None:
        """Detect missing packets, which H.264 and AV1 decoders conceal silently.

        Publishers number frames consecutively; times and reordered frames have other numbers.
        """
        if number == self._number + 1:
            self._steps += 1
        else:
            if self._steps >= _MIN_CONSECUTIVE:
                self.lost()
            self._steps = 0
        self._number = number


_THEORA_TYPE = "theora_image_transport/msg/Packet"
_HEADER, _INTER, _FIRST = 0x80, 0x40, 0x80
_IDENTIFICATION_SIZE = 42


class TheoraDecoder:
    """Decodes the packets of a ``theora`` stream."""

    def __init__(self) -> None:
        self._headers: dict[int, bytes] = {}
        self._decoder: VideoDecoder | None = None
        self._number = -1
        self._last: RawImage | None = None

    def lost(self) -> None:
        """Record that packets are missing before the next one."""
        self._last = None
        if self._decoder is not None:
            self._decoder.lost()

    def read(
        self, stamp: Time | None, frame_id: str, data: Any, packet_number: int
    ) -> RawImage | None:
        """Decode a packet.

        Returns:
            The image; None for headers.

        Raises:
            NoPictureError: The headers or a key frame are needed first.
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
            # An empty packet repeats the image.
            self._last = self._last and replace(self._last, stamp=stamp, frame_id=frame_id)
            return self._last
        self._last, last = None, None
        last = self._decoder.decode(view, not view[0] & _INTER, stamp, frame_id)
        self._last = last
        return last

    def _read_header(self, data: bytes) -> None:
        kind = data[0]
        if data[1:7] != b"theora" or kind not in {0x80, 0x81, 0x82}:
            raise DecodeError(_THEORA_TYPE, "the header is not one of Theora's", "data", 0)
        if self._headers.get(kind) == data and self._decoder is not None:
            return
        if kind == _FIRST:
            self._check(data)
            self._headers.clear()
        self._decoder, self._last = None, None
        self._headers[kind] = data
        if len(self._headers) == 3:
            self._decoder = VideoDecoder(
                _THEORA_TYPE,
                ("theora",),
                _lace([self._headers[k] for k in (0x80, 0x81, 0x82)]),
                True,
            )

    @staticmethod
    def _check(data: bytes) -> None:
        """Refuse sizes that would exhaust memory before decoding."""
        if len(data) < _IDENTIFICATION_SIZE:
            raise DecodeError(
                _THEORA_TYPE, "the identification header is cut off", "data", len(data)
            )
        width = 16 * int.from_bytes(data[10:12], "big")
        height = 16 * int.from_bytes(data[12:14], "big")
        if not 0 < width * height <= MAX_PIXELS:
            raise DecodeError(
                _THEORA_TYPE,
                f"{width}x{height} pixels cannot be shown, {MAX_PIXELS} at most",
                "data",
                10,
            )


def _lace(headers: list[bytes]) -> bytes:
    """Join packets with Xiph lacing (Matroska, RFC 9559, section 10.3.2)."""
    sizes = bytearray([len(headers) - 1])
    for header in headers[:-1]:
        sizes += b"\xff" * (len(header) // 255) + bytes([len(header) % 255])
    return bytes(sizes) + b"".join(headers)
