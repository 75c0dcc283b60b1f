"""Videos: frames come back in order with their stamps; losses never show a smeared frame."""

from __future__ import annotations

import re
import struct
from fractions import Fraction
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import rosglass
from rosglass.comm import Sample
from rosglass.errors import DecodeError, Error, NoPictureError, UnsupportedError
from rosglass.extras import install_command
from rosglass.images import TRANSPORTS, PixelFormat, RawImage, convert
from rosglass.images import video as video_module

av = pytest.importorskip("av", reason="needs PyAV (extra `video`)")

LEFT, RIGHT = (200, 60, 20), (10, 90, 250)
GOP = 4


def scene(number: int, width: int, height: int) -> np.ndarray:
    out = np.full((height, width, 3), LEFT, np.uint8)
    out[:, width // 2 :] = RIGHT
    out[4:12, 2 + 2 * number : 10 + 2 * number] = 240
    return out


CODECS = {
    "h264": ("libx264", {"preset": "ultrafast", "tune": "zerolatency"}),
    "h264_nvenc": ("libx264", {"preset": "medium", "bf": "2"}),
    "hevc;yuv420p;bgr8;bgr8": (
        "libx265",
        {"preset": "ultrafast", "tune": "zerolatency", "x265-params": "log-level=none"},
    ),
    "mjpeg": ("mjpeg", {}),
    "libvpx-vp9": ("libvpx-vp9", {"lag-in-frames": "0", "cpu-used": "8"}),
    "av1": ("libsvtav1", {"preset": "10", "svtav1-params": "pred-struct=1:lookahead=0"}),
    "hevc;gray;mono8;mono8": (
        "libx265",
        {"tune": "zerolatency", "x265-params": "log-level=none:lossless=1"},
    ),
}
W, H, COUNT = 64, 64, 12


@cache
def encode(encoding: str) -> list[tuple[int, int, bytes]]:
    """Return time stamp, flags and bytes of each packet."""
    codec, options = CODECS[encoding]
    try:
        context = av.CodecContext.create(codec, "w")
    except ValueError:
        pytest.skip(f"this PyAV was built without {codec}")
    context.width, context.height, context.time_base = W, H, Fraction(1, 25)
    grey = ";gray;" in encoding
    context.pix_fmt = "gray" if grey else "yuvj420p" if codec == "mjpeg" else "yuv420p"
    context.gop_size, context.options = GOP, options
    packets = []
    for number in range(COUNT):
        pixels = scene(number, W, H)
        picture = (
            av.VideoFrame.from_ndarray(pixels[..., 0].copy(), "gray")
            if grey
            else av.VideoFrame.from_ndarray(pixels, "rgb24")
        )
        picture.pts = number
        packets += context.encode(picture)
    packets += context.encode(None)
    return [(packet.pts, int(packet.is_keyframe), bytes(packet)) for packet in packets]


class Camera:
    """One end publishes, the other reads; the samples are those of a real robot."""

    def __init__(self, transport: str, ros: int = 2) -> None:
        self.transport = TRANSPORTS[transport]
        name = self.transport.type if ros == 2 else self.transport.type.replace("/msg/", "/")
        self.type = rosglass.load(name, ros=ros)
        self.wire = "cdr" if ros == 2 else "ros1"
        self.reader = self.transport.reader(self.type, self.wire)
        self.ros, self.sequence = ros, -1

    def read(self, stamp: int, **fields: Any) -> RawImage | None:
        parts = ("secs", "nsecs") if self.ros == 1 else ("sec", "nanosec")
        header = {"stamp": dict(zip(parts, (stamp, 5), strict=True)), "frame_id": "camera"}
        data = self.type.encode(header=header, **fields, wire=self.wire)
        sequence = self.sequence
        if sequence >= 0:
            self.sequence += 1
        return self.reader(Sample(data, self.wire, self.type, 1, None, b"a", sequence))

    def video(self, encoding: str, number: int) -> RawImage | None:
        pts, flags, data = encode(encoding)[number]
        return self.read(100 + pts, encoding=encoding, pts=pts, flags=flags, data=data)


def check(image: RawImage, number: int) -> None:
    assert image.stamp.nanoseconds == (100 + number) * 10**9 + 5
    assert image.frame_id == "camera"
    frame = convert(image, frozenset())
    assert frame.format is PixelFormat.RGBX
    out = frame.planes[0].reshape(frame.height, frame.width, 4)[..., :3].astype(int)
    expected = scene(number, image.width, image.height).astype(int)
    # Chroma bleeds over edges: look inside the areas.
    for y, x in ((20, 8), (20, image.width - 5), (8, 6 + 2 * number)):
        np.testing.assert_allclose(out[y, x], expected[y, x], atol=24)


ORDERED = ["h264", "hevc;yuv420p;bgr8;bgr8", "libvpx-vp9", "av1", "mjpeg"]


@pytest.mark.parametrize("ros", [1, 2])
@pytest.mark.parametrize("encoding", ORDERED)
def test_each_packet_gives_its_frame(encoding: str, ros: int) -> None:
    camera = Camera("ffmpeg", ros)
    for number in range(COUNT):
        image = camera.video(encoding, number)
        assert (image.width, image.height) == (W, H)
        check(image, number)


def test_reordered_frames_keep_their_stamps() -> None:
    camera = Camera("ffmpeg")
    images = [camera.video("h264_nvenc", number) for number in range(COUNT)]
    assert images[0] is None
    shown = [image for image in images if image is not None]
    assert len(shown) >= COUNT - 3
    for number, image in enumerate(shown):
        check(image, number)


def test_greys_stay_grey() -> None:
    image = Camera("ffmpeg").video("hevc;gray;mono8;mono8", 0)
    assert image.encoding == "mono8"
    np.testing.assert_array_equal(image.data.reshape(H, W), scene(0, W, H)[..., 0])


@pytest.mark.parametrize("encoding", ["h264", "hevc;yuv420p;bgr8;bgr8", "libvpx-vp9", "av1"])
def test_late_comers_wait_for_a_key_frame(encoding: str) -> None:
    camera = Camera("ffmpeg")
    for number in range(1, GOP):
        with pytest.raises(NoPictureError, match="waiting for the first key frame"):
            camera.video(encoding, number)
    for number in range(GOP, COUNT):
        check(camera.video(encoding, number), number)


@pytest.mark.parametrize("encoding", ["h264", "hevc;yuv420p;bgr8;bgr8", "libvpx-vp9", "av1"])
@pytest.mark.parametrize("known_by", ["presentation time", "sequence", "overflow"])
def test_after_a_loss_nothing_is_shown_before_the_next_key_frame(
    encoding: str, known_by: str
) -> None:
    camera = Camera("ffmpeg")
    camera.sequence = 40 if known_by == "sequence" else -1
    lost = 6 if known_by == "presentation time" else 2
    for number in range(lost):
        check(camera.video(encoding, number), number)
    if known_by == "sequence":
        camera.sequence += 1
    elif known_by == "overflow":
        camera.reader.lost()
    following = -(-(lost + 1) // GOP) * GOP
    for number in range(lost + 1, following):
        with pytest.raises(NoPictureError, match="was lost; waiting for the next key frame"):
            camera.video(encoding, number)
    for number in range(following, COUNT):
        check(camera.video(encoding, number), number)


def test_key_frames_are_known_without_flags() -> None:
    for encoding in ("h264", "hevc;yuv420p;bgr8;bgr8"):
        camera = Camera("ffmpeg")
        for number in range(1, GOP + 2):
            pts, _, data = encode(encoding)[number]
            fields = {"encoding": encoding, "pts": pts, "flags": 0, "data": data}
            if number < GOP:
                with pytest.raises(NoPictureError):
                    camera.read(100 + pts, **fields)
            else:
                check(camera.read(100 + pts, **fields), number)


def test_publisher_that_changes_its_codec() -> None:
    camera = Camera("ffmpeg")
    check(camera.video("h264", 0), 0)
    check(camera.video("hevc;yuv420p;bgr8;bgr8", 0), 0)
    with pytest.raises(NoPictureError, match="first key frame"):
        camera.video("h264", 1)


@pytest.mark.parametrize(
    "encoding", ["h264", "hevc;yuv420p;bgr8;bgr8", "libvpx-vp9", "av1", "mjpeg"]
)
def test_garbled_packets_never_crash_and_are_survived(encoding: str) -> None:
    rng = np.random.default_rng(3)
    camera = Camera("ffmpeg")
    for round_ in range(120):
        _, flags, data = encode(encoding)[round_ % COUNT]
        bad = bytearray(data[: rng.integers(1, len(data) + 1)])
        for at in rng.integers(0, len(bad), 3):
            bad[at] = rng.integers(0, 256)
        try:
            camera.read(1, encoding=encoding, pts=round_, flags=flags, data=bytes(bad))
        except Error:
            continue
    camera.reader.lost()
    image = camera.video(encoding, 0)
    later = [camera.video(encoding, number) for number in range(1, COUNT)]
    assert image is not None or any(picture is not None for picture in later)
    check(later[-1], COUNT - 1)


@pytest.mark.parametrize(
    ("fields", "error", "reason"),
    [
        ({"encoding": "wmv3"}, UnsupportedError, "'wmv3' cannot be shown; these can: h264"),
        ({"data": b""}, DecodeError, "the packet is empty"),
        ({"flags": 0}, NoPictureError, "first key frame"),
    ],
)
def test_bad_packets_are_reported(fields: dict, error: type[Error], reason: str) -> None:
    good = {"encoding": "vp8", "pts": 0, "flags": 1, "data": b"abcd"}
    with pytest.raises(error, match=reason):
        Camera("ffmpeg").read(1, **good | fields)


def test_videos_that_would_fill_memory_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(video_module, "MAX_PIXELS", 1000)
    with pytest.raises(DecodeError, match="corrupt"):
        Camera("ffmpeg").video("h264", 0)


@pytest.mark.parametrize("transport", ["theora", "ffmpeg"])
def test_without_pyav_the_fix_is_reported(monkeypatch: pytest.MonkeyPatch, transport: str) -> None:
    def absent(name: str) -> Any:
        raise ImportError(name)

    monkeypatch.setattr(video_module, "import_module", absent)
    video_module.pyav.cache_clear()
    camera = Camera(transport)

    def read() -> None:
        if transport == "ffmpeg":
            camera.video("h264", 0)
        for number in range(3):
            theora(camera, number)

    try:
        with pytest.raises(UnsupportedError, match=re.escape(install_command("video"))):
            read()
    finally:
        video_module.pyav.cache_clear()


# ---------------------------------------------------------------------------------------- Theora


@cache
def theora_packets() -> list[tuple[bytes, int, int, int]]:
    data = (Path(__file__).parent / "data" / "theora_40x24.packets").read_bytes()
    at, out = 0, []
    while at < len(data):
        size, begins, granule, number = struct.unpack_from("<IiqQ", data, at)
        at += 24
        out.append((data[at : at + size], begins, granule, number))
        at += size
    return out


def theora(camera: Camera, number: int, **fields: Any) -> RawImage | None:
    data, begins, granule, packet = theora_packets()[number]
    good = {"data": data, "b_o_s": begins, "granulepos": granule, "packetno": packet}
    return camera.read(97 + number, **good | fields)


@pytest.mark.parametrize("ros", [1, 2])
def test_theora(ros: int) -> None:
    camera = Camera("theora", ros)
    assert [theora(camera, number) for number in range(3)] == [None] * 3
    for number in range(9):
        image = theora(camera, number + 3)
        assert (image.width, image.height) == (40, 24)
        check(image, number)


def test_theora_without_headers_or_key_frame_waits() -> None:
    camera = Camera("theora")
    with pytest.raises(NoPictureError, match="waiting for the headers"):
        theora(camera, 3)
    for number in (0, 1, 2):
        theora(camera, number)
    with pytest.raises(NoPictureError, match="first key frame"):
        theora(camera, 5)
    check(theora(camera, 7), 4)
    # Repeated headers do not start a new stream.
    assert theora(camera, 2, packetno=7) is None
    check(theora(camera, 8), 5)


def test_theora_after_a_loss() -> None:
    camera = Camera("theora")
    for number in range(5):
        theora(camera, number)
    with pytest.raises(NoPictureError, match="was lost"):
        theora(camera, 6)
    check(theora(camera, 7), 4)
    # A publisher that starts again.
    for number in range(3):
        assert theora(camera, number) is None
    check(theora(camera, 3), 0)


def test_theora_repeats_frames_with_empty_packets() -> None:
    camera = Camera("theora")
    for number in range(4):
        theora(camera, number)
    again = camera.read(105, data=b"", packetno=4)
    assert again.stamp.nanoseconds == 105 * 10**9 + 5
    assert convert(again).planes[0].any()


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (b"\x80vorbis", "not one of Theora's"),
        (b"\x83theora" + bytes(60), "not one of Theora's"),
        (b"\x80theora\x03\x02\x01", "identification header is cut off"),
        (b"\x80theora\x03\x02\x01\xff\xff\xff\xff" + bytes(40), "1048560x1048560 pixels"),
        (b"\x80theora\x03\x02\x01" + bytes(40), "0x0 pixels"),
    ],
)
def test_bad_headers_are_reported(data: bytes, reason: str) -> None:
    with pytest.raises(DecodeError, match=reason):
        Camera("theora").read(1, data=data)


def test_garbled_theora_never_crashes_and_is_survived() -> None:
    rng = np.random.default_rng(9)
    camera = Camera("theora")
    for round_ in range(300):
        number = round_ % len(theora_packets())
        data = theora_packets()[number][0]
        bad = bytearray(data[: rng.integers(1, len(data) + 1)] if round_ % 2 else data)
        if round_ % 3:
            bad[rng.integers(0, len(bad))] = rng.integers(0, 256)
        try:
            theora(camera, number, data=bytes(bad))
        except Error:
            continue
    for number in range(4):
        image = theora(camera, number)
    check(image, 0)
