"""Compressed pictures: right colours, honest about corruption, never fooled by sizes."""

from __future__ import annotations

import struct
import tracemalloc
import zlib

import cv2
import numpy as np
import pytest

from rosglass.errors import DecodeError, UnsupportedError
from rosglass.images import convert, decompress
from rosglass.images.compressed import read_header

RED = (220, 30, 10)


def encode(suffix: str, pixels: np.ndarray) -> bytes:
    ok, data = cv2.imencode(suffix, pixels)
    assert ok
    return data.tobytes()


def picture(colour: tuple[int, ...] = RED, dtype: type = np.uint8) -> np.ndarray:
    """A plain picture in OpenCV's order of channels (blue first)."""
    return np.full((16, 24, len(colour)), colour[2::-1] + colour[3:], dtype)


def shown(data: bytes, format: str) -> np.ndarray:
    frame = convert(decompress(data, format), frozenset())
    pixels = frame.planes[0].reshape(frame.height, frame.width, -1)
    return pixels[..., [2, 1, 0]] if frame.format.value == "bgra" else pixels[..., :3]


@pytest.mark.parametrize(
    "format",
    ["jpeg", "png", "rgb8; jpeg compressed bgr8", "bgr8; png compressed bgr8", "", "mono8; jpeg"],
)
@pytest.mark.parametrize("suffix", [".jpg", ".png"])
def test_colours(suffix: str, format: str) -> None:
    out = shown(encode(suffix, picture()), format)
    np.testing.assert_allclose(out.astype(int), np.broadcast_to(RED, out.shape), atol=4)


def test_publishers_that_do_not_swap_channels_are_understood() -> None:
    # Red-first pixels handed to the encoder as they are: it takes the first channel for blue.
    data = encode(".png", picture()[..., ::-1])
    out = shown(data, "rgb8; png compressed rgb8")
    np.testing.assert_array_equal(out, np.broadcast_to(RED, out.shape))


def test_alpha_and_deep_greys_are_kept() -> None:
    raw = decompress(encode(".png", picture((*RED, 128))))
    assert raw.encoding == "bgra8"
    assert convert(raw).has_alpha
    deep = np.arange(24 * 16, dtype=np.uint16).reshape(16, 24) * 100
    raw = decompress(encode(".png", deep), "16UC1; png compressed ")
    assert raw.encoding == "mono16"
    np.testing.assert_array_equal(convert(raw).planes[0].view(np.uint16), deep)


@pytest.mark.parametrize("suffix", [".jpg", ".png"])
def test_cut_off_files_are_refused_at_every_length(suffix: str) -> None:
    noise = np.random.default_rng(1).integers(0, 255, (16, 24, 3), np.uint8)
    data = encode(suffix, noise)
    for length in range(0, len(data) - 16, 7):
        with pytest.raises((DecodeError, UnsupportedError)):
            decompress(data[:length])


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (b"", "the picture is empty"),
        (b"GIF89a..", "starts with the bytes 47 49 46 38"),
        (b"\x89PNG\r\n\x1a\n" + bytes(40), "no complete header"),
        (b"\xff\xd8\xff\xe0" + bytes(40), "no marker"),
        (b"\xff\xd8\xff\xff", "cut off before its size"),
    ],
)
def test_other_files_are_named(data: bytes, reason: str) -> None:
    with pytest.raises((DecodeError, UnsupportedError), match=reason):
        decompress(data)


def png_claiming(width: int, height: int) -> bytes:
    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    chunk = b"IHDR" + header
    body = struct.pack(">I", 13) + chunk + struct.pack(">I", zlib.crc32(chunk))
    return b"\x89PNG\r\n\x1a\n" + body + bytes(40)


@pytest.mark.parametrize(("width", "height"), [(60_000, 60_000), (2**31, 1), (4000, 4000), (0, 9)])
def test_sizes_that_the_bytes_cannot_hold_are_not_allocated(width: int, height: int) -> None:
    tracemalloc.start()
    try:
        with pytest.raises(DecodeError, match="pixels"):
            decompress(png_claiming(width, height))
        assert tracemalloc.get_traced_memory()[1] < 1_000_000
    finally:
        tracemalloc.stop()


def test_jpeg_claiming_a_huge_size_is_refused() -> None:
    data = bytearray(encode(".jpg", picture()))
    at = data.index(b"\xff\xc0") + 5
    data[at : at + 4] = struct.pack(">HH", 65535, 65535)
    assert read_header(bytes(data)).width == 65535
    with pytest.raises(DecodeError, match="cannot be a picture of 65535x65535"):
        decompress(bytes(data))


def test_mutated_files_never_crash() -> None:
    rng = np.random.default_rng(7)
    good = [
        encode(suffix, rng.integers(0, 255, (16, 24, 3), np.uint8)) for suffix in (".jpg", ".png")
    ]
    refused = 0
    for round_ in range(300):
        data = bytearray(good[round_ % 2])
        for at in rng.integers(0, len(data), 4):
            data[at] = rng.integers(0, 256)
        try:
            convert(decompress(bytes(data)))
        except (DecodeError, UnsupportedError):
            refused += 1
    assert refused > 30
