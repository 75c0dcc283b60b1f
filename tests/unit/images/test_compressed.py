"""Compressed images: right colours, errors for corrupt data, no trust in declared sizes."""

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
    """A plain image in OpenCV's order of channels (blue first)."""
    return np.full((16, 24, len(colour)), colour[2::-1] + colour[3:], dtype)


def shown(data: bytes, format: str) -> np.ndarray:
    frame = convert(decompress(data, format), frozenset())
    pixels = frame.planes[0].reshape(frame.height, frame.width, -1)
    return pixels[..., [2, 1, 0]] if frame.format.value == "bgra" else pixels[..., :3]


@pytest.mark.parametrize(
    "format",
    ["jpeg", "png", "rgb8; jpeg compressed bgr8", "bgr8; png compressed bgr8", "", "mono8; jpeg"],
)
@pytest.mark.parametrize("suffix", [".jpg", ".png", ".tiff"])
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


def noise(*shape: int) -> np.ndarray:
    return np.random.default_rng(1).integers(0, 255, shape, np.uint8)


def thumbnail() -> bytes:
    """Return an APP1 segment with a JPEG file of its own, as cameras write it."""
    inner = b"Exif\0\0" + encode(".jpg", noise(8, 8))
    return b"\xff\xe1" + struct.pack(">H", 2 + len(inner)) + inner


#: Bytes that cameras append to a complete image.
TAILS = {
    "nothing": b"",
    "padding to a block": bytes(4096),
    "fill": b"\xff" * 4096,
    "text": b"made by a camera\n" * 100,
    "a second image": encode(".jpg", noise(16, 24)),
    "a part of a second image": encode(".jpg", noise(16, 24))[:200],
}


@pytest.mark.parametrize("tail", TAILS)
@pytest.mark.parametrize("head", ["plain", "thumbnail", "fill bytes", "restarts", "progressive"])
def test_complete_jpegs_with_bytes_behind_their_end_are_shown(tail: str, head: str) -> None:
    pixels = noise(64, 64, 3)
    settings = {
        "restarts": [cv2.IMWRITE_JPEG_RST_INTERVAL, 1],
        "progressive": [cv2.IMWRITE_JPEG_PROGRESSIVE, 1],
    }
    data = cv2.imencode(".jpg", pixels, settings.get(head, []))[1].tobytes()
    if head == "thumbnail":
        data = data[:2] + thumbnail() + data[2:]
    elif head == "fill bytes":
        data = data[:-2] + b"\xff\xff\xff\xd9"
    wanted = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
    found = decompress(data + TAILS[tail])
    np.testing.assert_array_equal(np.reshape(found.data, wanted.shape), wanted)
    # Without its end, it is cut off, whatever stands behind.
    for length in (len(data) - 4, len(data) // 2):
        with pytest.raises(DecodeError):
            decompress(data[:length])
        if "second" not in tail:
            with pytest.raises(DecodeError, match="cut off"):
                decompress(data[:length] + TAILS[tail])


@pytest.mark.parametrize(
    "data",
    [b"\xff" * 10**7, b"\xff\xc4" * 5 * 10**6, b"\xff\xda\0\0" * 10**6, b"\xff\xe0\0\2" * 10**6],
)
def test_markers_without_end_take_no_time(data: bytes) -> None:
    good = encode(".jpg", noise(64, 64, 3))
    with pytest.raises(DecodeError, match="cut off"):
        decompress(good[:-2] + data)


@pytest.mark.parametrize("pattern", ["rggb", "bggr", "gbrg", "grbg"])
@pytest.mark.parametrize(("suffix", "dtype"), [(".jpg", np.uint8), (".png", np.uint16)])
def test_bayer_pattern_in_the_format_is_restored(pattern: str, suffix: str, dtype: type) -> None:
    scale = 257 if dtype is np.uint16 else 1
    mosaic = np.zeros((16, 24), dtype)
    for place, channel in enumerate(pattern):
        mosaic[place // 2 :: 2, place % 2 :: 2] = RED["rgb".index(channel)] * scale
    bits = 16 if dtype is np.uint16 else 8
    data, kind = encode(suffix, mosaic), suffix[1:].replace("jpg", "jpeg")
    for coded in (f"{kind} compressed ", f"{kind} compressed bayer_{pattern}{bits}"):
        for camera in (f"bayer_{pattern}8", f"bayer_{pattern}16"):
            text = f"{camera}; {coded}"
            assert decompress(data, text).encoding == f"bayer_{pattern}{bits}"
            middle = shown(data, text)[4:-4, 4:-4].astype(int)
            np.testing.assert_allclose(middle, np.broadcast_to(RED, middle.shape), atol=40)
    # The compressed image is not a Bayer mosaic.
    for text in (f"bayer_{pattern}8; {kind} compressed mono8", f"bayer_{pattern}8", "bayer; x"):
        assert decompress(data, text).encoding == f"mono{bits}"
    colors = encode(suffix, picture())
    assert decompress(colors, f"bayer_{pattern}8; {kind} compressed bgr8").encoding == "bgr8"


@pytest.mark.parametrize(
    ("dtype", "encoding"), [(np.uint8, "mono8"), (np.uint16, "mono16"), (np.float32, "32FC1")]
)
def test_tiff(dtype: type, encoding: str) -> None:
    pixels = np.arange(24 * 16).reshape(16, 24).astype(dtype)
    found = decompress(encode(".tiff", pixels), "32FC1; tiff compressed ")
    assert (found.encoding, found.width, found.height) == (encoding, 24, 16)
    np.testing.assert_array_equal(found.data.view(dtype).reshape(16, 24), pixels)


def tiff(order: str, fields: dict[int, tuple[int, int, int]], size: int = 100) -> bytes:
    """Return a TIFF file of zeros with fields: type, count and value by number."""
    data = (b"II*\0" if order == "<" else b"MM\0*") + struct.pack(f"{order}IH", 8, len(fields))
    for field, (kind, count, value) in fields.items():
        code = "H2x" if kind == 3 else "I"
        data += struct.pack(f"{order}HHI{code}", field, kind, count, value)
    return data + bytes(size)


@pytest.mark.parametrize("order", "<>")
@pytest.mark.parametrize(
    ("fields", "reason"),
    [
        ({256: (4, 1, 60_000), 257: (4, 1, 60_000)}, "declares 60000x60000 pixels"),
        ({256: (3, 1, 9), 257: (3, 1, 9), 322: (4, 1, 1 << 20), 323: (4, 1, 1 << 20)}, "in tiles"),
        ({256: (3, 1, 8000), 257: (3, 1, 8000), 258: (3, 1, 64), 277: (3, 1, 4)}, "of 4 times 64"),
        ({256: (3, 1, 9), 257: (3, 1, 0)}, "the image is 9x0 pixels"),
        ({256: (3, 1, 2000), 257: (3, 1, 2000)}, "cannot be an image of 2000x2000"),
        ({256: (3, 1, 9), 257: (3, 1, 9), 258: (3, 4, 1 << 15)}, "the TIFF file is cut off"),
        ({256: (3, 1, 9), 257: (3, 1, 9)}, "the tiff file is corrupt"),
    ],
)
def test_tiff_claiming_too_much_is_not_allocated(
    order: str, fields: dict[int, tuple[int, int, int]], reason: str
) -> None:
    tracemalloc.start()
    try:
        with pytest.raises(DecodeError, match=reason):
            decompress(tiff(order, fields))
        assert tracemalloc.get_traced_memory()[1] < 1_000_000
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize("suffix", [".jpg", ".png", ".tiff"])
def test_cut_off_files_are_refused_at_every_length(suffix: str) -> None:
    data = encode(suffix, noise(16, 24, 3))
    for length in range(0, len(data) - 16, 7):
        with pytest.raises((DecodeError, UnsupportedError)):
            decompress(data[:length])


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (b"", "the image is empty"),
        (b"GIF89a..", "starts with the bytes 47 49 46 38"),
        (b"\x89PNG\r\n\x1a\n" + bytes(40), "no complete header"),
        (b"\xff\xd8\xff\xe0" + bytes(40), "no marker"),
        (b"\xff\xd8\xff\xff", "cut off before its size"),
    ],
)
def test_other_files_are_reported(data: bytes, reason: str) -> None:
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
    with pytest.raises(DecodeError, match="cannot be an image of 65535x65535"):
        decompress(bytes(data))


def test_mutated_files_never_crash() -> None:
    rng = np.random.default_rng(7)
    suffixes = (".jpg", ".png", ".tiff")
    good = [encode(suffix, rng.integers(0, 255, (16, 24, 3), np.uint8)) for suffix in suffixes]
    refused = 0
    for round_ in range(450):
        data = bytearray(good[round_ % 3])
        for at in rng.integers(0, len(data), 4):
            data[at] = rng.integers(0, 256)
        try:
            convert(decompress(bytes(data)))
        except (DecodeError, UnsupportedError):
            refused += 1
    assert refused > 30
