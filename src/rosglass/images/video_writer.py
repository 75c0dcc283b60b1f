"""Writes frames to a video file, with PyAV, in a thread of its own."""

from __future__ import annotations

import logging
import queue
import threading
from contextlib import suppress
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from rosglass.errors import Error, UnsupportedError
from rosglass.extras import install_command
from rosglass.images.video import pyav

if TYPE_CHECKING:
    import os

    from numpy.typing import NDArray

__all__ = ["VideoStatus", "VideoWriter"]

_log = logging.getLogger("rosglass.images")
#: Encoders by the file's suffix, the first one that PyAV has; and their options, fast rather than
#: small: the interface needs the processor.
_H264 = {"preset": "veryfast", "tune": "zerolatency", "crf": "20", "g": "60"}
_VPX = {"deadline": "realtime", "cpu-used": "8", "crf": "20", "b": "8M", "g": "60"}
_ENCODERS: dict[str, tuple[tuple[str, dict[str, str]], ...]] = {
    ".mp4": (("libx264", _H264), ("libopenh264", {"b": "8M"}), ("mpeg4", {"q": "3"})),
    ".mkv": (("libx264", _H264), ("libopenh264", {"b": "8M"}), ("mpeg4", {"q": "3"})),
    ".webm": (("libvpx-vp9", _VPX), ("libvpx", _VPX)),
}
#: Frames that may wait for the encoder.
_MAX_WAITING = 4
#: Times are in milliseconds.
_TIME_BASE = Fraction(1, 1000)
#: Seconds that closing waits for the encoder, before and after its last frame.
_CLOSE_TIMEOUT_S = 1.5
#: The number of BT.709 in ITU-T H.273: the colours that players assume for frames of this size.
_BT709 = 1


class VideoStatus(NamedTuple):
    """The state of a recorded video.

    Attributes:
        frames: Frames in the file.
        dropped: Frames that were dropped because the encoder was busy.
        duration: Seconds from the first frame to the last, or to the end.
        problem: Why the file ends early; empty if it does not.
    """

    frames: int
    dropped: int
    duration: float
    problem: str


class _Frame(NamedTuple):
    time: float
    pixels: NDArray[np.uint8]
    format: str


class VideoWriter:
    """Writes a video file with a variable frame rate, in a thread of its own.

    The first frame sets the size; frames of other sizes are scaled to fit into it.

    Args:
        path: The file, ``.mp4`` or ``.mkv`` (H.264) or ``.webm`` (VP9); it must not exist.

    Raises:
        UnsupportedError: PyAV is missing, or has no encoder for the file.
        Error: The suffix is unknown, the file exists, or cannot be written.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.path = Path(path)
        suffix = self.path.suffix.lower()
        if suffix not in _ENCODERS:
            known = ", ".join(_ENCODERS)
            raise Error(f"{self.path}: the name of a video ends in one of {known}")
        self._encoder, self._options = _find_encoder(suffix)
        try:
            # Only a test: a video without frames leaves no file.
            with self.path.open("xb"):
                pass
            self.path.unlink()
        except FileExistsError:
            raise Error(f"{self.path} exists already; choose another name, or delete it") from None
        except OSError as error:
            raise Error(f"{self.path} cannot be written: {error.strerror}") from None
        self._queue: queue.Queue[_Frame | float] = queue.Queue(_MAX_WAITING)
        self._lock = threading.Lock()
        self._frames = self._dropped = 0
        self._first = self._last = 0.0
        self._problem = ""
        self._container: Any = None
        self._stream: Any = None
        self._frame: Any = None
        self._closed = False
        self._thread = threading.Thread(target=self._work, name="video", daemon=True)
        self._thread.start()

    @property
    def is_full(self) -> bool:
        """True if the encoder is busy, so that the next frame would be dropped."""
        return self._queue.full()

    def status(self) -> VideoStatus:
        """Return the present state of the recording."""
        with self._lock:
            duration = self._last - self._first
            return VideoStatus(self._frames, self._dropped, duration, self._problem)

    def add(self, pixels: NDArray[np.uint8], time: float, format: str = "rgba") -> bool:
        """Add a frame; it is dropped and counted while the encoder is busy.

        Args:
            pixels: Array of shape (height, width, 4) that is not changed afterwards.
            time: Seconds, by any clock; later than the previous frame's.
            format: ``rgba`` or ``bgra``.

        Returns:
            True if it was added, False if it was dropped.
        """
        if self._closed or self._problem:
            return False
        try:
            self._queue.put_nowait(_Frame(time, pixels, format))
        except queue.Full:
            with self._lock:
                self._dropped += 1
            return False
        return True

    def count_dropped(self) -> None:
        """Count a frame that was not even read back, because of :attr:`is_full`."""
        with self._lock:
            self._dropped += 1

    def close(self, time: float | None = None) -> VideoStatus:
        """Write the waiting frames, and close the file; safe to call twice.

        Args:
            time: Time in seconds at which the last frame ends; None for the frame's own time.

        Returns:
            The final status.
        """
        if not self._closed:
            self._closed = True
            if self._thread.is_alive():
                with suppress(queue.Full):  # the thread is stuck, as is reported below
                    self._queue.put(-1.0 if time is None else time, timeout=_CLOSE_TIMEOUT_S)
                self._thread.join(_CLOSE_TIMEOUT_S)
            if self._thread.is_alive():
                self._set_problem("the encoder did not end in time; the file may be incomplete")
        return self.status()

    # -- in the thread ---------------------------------------------------------------------------

    def _work(self) -> None:
        try:
            while isinstance(item := self._queue.get(), _Frame):
                self._encode(item)
            self._finish(item)
        except Exception as error:  # noqa: BLE001 - of the disk, PyAV or a codec; shown as the problem
            reason = getattr(error, "strerror", "") or str(error)
            _log.debug("%s", self.path, exc_info=True)
            self._set_problem(f"{self.path} cannot be written: {reason}")
            with suppress(Exception):  # it fails as writing did
                self._close_file()

    def _encode(self, item: _Frame) -> None:
        if self._container is None:
            self._open(item)
        frame = pyav().VideoFrame.from_ndarray(np.ascontiguousarray(item.pixels), item.format)
        self._frame = self._fit(frame)
        self._put(self._frame, item.time)

    def _open(self, item: _Frame) -> None:
        height, width, _ = item.pixels.shape
        container = self._container = pyav().open(str(self.path), "w")
        stream = self._stream = container.add_stream(self._encoder, options=dict(self._options))
        # Chroma has a sample for each 2 x 2 pixels.
        stream.width, stream.height = max(width // 2 * 2, 2), max(height // 2 * 2, 2)
        stream.pix_fmt = "yuv420p"
        context = stream.codec_context
        context.time_base = stream.time_base = _TIME_BASE
        context.colorspace = context.color_primaries = context.color_trc = _BT709
        self._first = item.time

    def _fit(self, frame: Any) -> Any:
        """Return a frame in the size and the colours of the file."""
        width, height = self._stream.width, self._stream.height
        if abs(frame.width - width) > 1 or abs(frame.height - height) > 1:
            share = min(width / frame.width, height / frame.height)
            inner = round(frame.width * share), round(frame.height * share)
            small = frame.reformat(*inner, format="rgb24").to_ndarray()
            whole = np.zeros((height, width, 3), np.uint8)
            left, top = (width - inner[0]) // 2, (height - inner[1]) // 2
            whole[top : top + inner[1], left : left + inner[0]] = small
            frame = pyav().VideoFrame.from_ndarray(whole, "rgb24")
        return frame.reformat(width, height, format="yuv420p", dst_colorspace=_BT709)

    def _put(self, frame: Any, time: float) -> None:
        before = self._stream_time(self._last) if self._frames else -1
        frame.pts, frame.time_base = max(self._stream_time(time), before + 1), _TIME_BASE
        frame.pict_type = 0
        for packet in self._stream.encode(frame):
            self._container.mux(packet)
        with self._lock:
            self._frames += 1
            self._last = max(time, self._last)

    def _stream_time(self, time: float) -> int:
        return round((time - self._first) / _TIME_BASE)

    def _finish(self, end: float) -> None:
        if self._container is None:
            return
        if end > self._last + float(_TIME_BASE):
            # Otherwise the video would end with the last change.
            self._put(self._frame, end)
        for packet in self._stream.encode():
            self._container.mux(packet)
        self._close_file()

    def _close_file(self) -> None:
        container, self._container = self._container, None
        if container is not None:
            container.close()

    def _set_problem(self, problem: str) -> None:
        with self._lock:
            self._problem = self._problem or problem


def _find_encoder(suffix: str) -> tuple[str, dict[str, str]]:
    try:
        av = pyav()
    except UnsupportedError:
        raise UnsupportedError(
            f"recording a video needs PyAV: {install_command('video')}"
        ) from None
    for name, options in _ENCODERS[suffix]:
        with suppress(av.codec.codec.UnknownCodecError):  # not in this build of FFmpeg
            av.codec.Codec(name, "w")
            return name, options
    names = ", ".join(name for name, _ in _ENCODERS[suffix])
    raise UnsupportedError(f"PyAV has no encoder for {suffix} here; it would need one of {names}")
