"""Videos: decodes one stream's packets with PyAV; waits for key frames after losses."""

from __future__ import annotations

from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np

from rosglass.errors import DecodeError, NoPictureError, UnsupportedError
from rosglass.images.encodings import MAX_PIXELS
from rosglass.images.frame import RawImage

if TYPE_CHECKING:
    from rosglass.comm.time import Time

__all__ = ["VideoDecoder", "pyav"]

#: Pictures whose stamp is remembered until the decoder has put them in order.
_MAX_REORDERED = 64
#: Colour spaces (ITU-T H.273) that displays assume: unspecified, BT.470BG, SMPTE 170M.
_STANDARD = {2, 5, 6}
_FULL_RANGE = 2


@cache
def pyav() -> Any:
    """Return PyAV; imported late because it takes its time.

    Raises:
        UnsupportedError: It is not installed.
    """
    try:
        return import_module("av")
    except ImportError:
        raise UnsupportedError(
            "this video needs PyAV, which is not installed; "
            'install it with: pip install "rosglass[video]", or choose another image transport'
        ) from None


class VideoDecoder:
    """Decodes the packets of one video stream.

    Starts at a key frame, and again after a loss: what decoders make up for missing packets looks
    like a live picture and is none.

    Args:
        type_name: Message type, for errors.
        codecs: FFmpeg's names of decoders; the first that exists is used.
        extradata: What the codec must know before the first packet.
        full_range: Whether luma spans 0..255 although the stream does not say so.

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
            # Threads that work on several pictures at once would delay each of them.
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
        """Tell that packets are missing before the next one."""
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
            key: Whether decoding can start here.
            stamp: When the picture was taken.
            frame_id: Coordinate frame of the camera.

        Returns:
            The newest picture that is complete; None when the next packet is needed first.

        Raises:
            NoPictureError: Nothing can be shown before the next key frame.
            DecodeError: The packet is corrupt.
        """
        if self._waiting and not key:
            raise NoPictureError(
                f"{self._waiting}; if it takes long, let the publisher send them more often"
            )
        if not len(data):
            # To a decoder it would be the end of the stream.
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
            # What came before may have upset the decoder: a key frame needs nothing of it.
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
                raise DecodeError(self._type, "the picture is damaged", "data")
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
