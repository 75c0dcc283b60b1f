"""compressedDepth: what publishers encode comes back; corrupt data are refused with a reason."""

from __future__ import annotations

import struct
import tracemalloc

import cv2
import numpy as np
import pytest

from rosglass.errors import DecodeError, UnsupportedError
from rosglass.images import decompress_depth
from rosglass.images.compressed import decode_rvl

W, H = 37, 23


def depths(seed: int = 3) -> np.ndarray:
    """Millimetres with holes, steps and extremes."""
    rng = np.random.default_rng(seed)
    out = (1500 + 400 * np.sin(np.arange(W * H) / 40)).astype(np.uint16).reshape(H, W)
    out[rng.random((H, W)) < 0.2] = 0
    out[5:9, 4:20] = 65535
    out[0, :3] = [1, 65535, 1]
    out[-1, -5:] = 0
    return out


def encode_rvl(values: np.ndarray) -> bytes:
    """RVL as its paper describes it, one depth at a time."""
    digits: list[int] = []

    def put(number: int) -> None:
        while True:
            digit, number = number & 7, number >> 3
            digits.append(digit | (8 if number else 0))
            if not number:
                return

    flat, at, previous = values.ravel().tolist(), 0, 0
    while at < len(flat):
        start = at
        while at < len(flat) and flat[at] == 0:
            at += 1
        put(at - start)
        start = at
        while at < len(flat) and flat[at]:
            at += 1
        put(at - start)
        for value in flat[start:at]:
            delta = value - previous
            put(2 * delta if delta >= 0 else -2 * delta - 1)
            previous = value
    digits += [0] * (-len(digits) % 8)
    words = [
        sum(digit << 4 * (7 - i) for i, digit in enumerate(digits[n : n + 8]))
        for n in range(0, len(digits), 8)
    ]
    return struct.pack(f"<{len(words)}I", *words)


def body(kind: str, values: np.ndarray) -> bytes:
    if kind == "rvl":
        return struct.pack("<II", values.shape[1], values.shape[0]) + encode_rvl(values)
    ok, data = cv2.imencode(".png", values)
    assert ok
    return data.tobytes()


def message(kind: str, values: np.ndarray, a: float = 0.0, b: float = 0.0) -> bytes:
    return struct.pack("<iff", 0, a, b) + body(kind, values)


@pytest.mark.parametrize(
    ("format", "kind"),
    [
        ("16UC1; compressedDepth", "png"),
        ("16UC1; compressedDepth png", "png"),
        ("16UC1", "png"),
        ("16UC1; compressedDepth rvl", "rvl"),
        ("mono16; compressedDepth rvl", "rvl"),
    ],
)
def test_millimetres_are_exact(format: str, kind: str) -> None:
    image = decompress_depth(message(kind, depths()), format, frame_id="camera")
    assert (image.width, image.height, image.encoding) == (W, H, "16UC1")
    assert image.frame_id == "camera"
    np.testing.assert_array_equal(image.data.view(np.uint16).reshape(H, W), depths())


@pytest.mark.parametrize("kind", ["png", "rvl"])
def test_metres_come_back_as_finely_as_they_were_quantised(kind: str) -> None:
    quantum, most = 100.0, 10.0
    metres = np.linspace(0.5, 9.0, W * H, dtype=np.float32).reshape(H, W)
    metres[3, 3:9] = np.nan
    a = quantum * (quantum + 1)
    b = 1 - a / most
    inverse = np.where(np.isfinite(metres), a / metres + b, 0).astype(np.uint16)
    image = decompress_depth(message(kind, inverse, a, b), f"32FC1; compressedDepth {kind}")
    assert image.encoding == "32FC1"
    out = image.data.view(np.float32).reshape(H, W)
    np.testing.assert_array_equal(np.isnan(out), np.isnan(metres))
    np.testing.assert_allclose(out, metres, atol=0.01)
    assert np.nanmin(out) < 0.51


@pytest.mark.parametrize("seed", range(4))
def test_rvl_of_noise(seed: int) -> None:
    rng = np.random.default_rng(seed)
    noise = rng.integers(0, 65536, (H, W)).astype(np.uint16) * (rng.random((H, W)) < 0.5)
    np.testing.assert_array_equal(decode_rvl(encode_rvl(noise), W * H), noise.ravel())
    nothing = np.zeros((H, W), np.uint16)
    np.testing.assert_array_equal(decode_rvl(encode_rvl(nothing), W * H), nothing.ravel())


@pytest.mark.parametrize("kind", ["png", "rvl"])
def test_covered_camera_sends_nothing_but_zeros(kind: str) -> None:
    nothing = np.zeros((480, 640), np.uint16)
    image = decompress_depth(message(kind, nothing), f"16UC1; compressedDepth {kind}")
    assert (image.width, image.height) == (640, 480)
    assert not image.data.any()


@pytest.mark.parametrize("kind", ["png", "rvl"])
def test_cut_off_data_are_refused_at_every_length(kind: str) -> None:
    data = message(kind, depths())
    for length in range(0, len(data) - 16, 5):
        with pytest.raises((DecodeError, UnsupportedError)):
            decompress_depth(data[:length], f"16UC1; compressedDepth {kind}")


@pytest.mark.parametrize("kind", ["png", "rvl"])
@pytest.mark.parametrize("encoding", ["16UC1", "32FC1"])
def test_garbled_data_never_crash(kind: str, encoding: str) -> None:
    rng = np.random.default_rng(11)
    good = message(kind, depths(), 10.0, 1.0)
    refused = 0
    for _ in range(150):
        data = bytearray(good)
        for at in rng.integers(12, len(data), 3):
            data[at] = rng.integers(0, 256)
        try:
            decompress_depth(bytes(data), f"{encoding}; compressedDepth {kind}")
        except (DecodeError, UnsupportedError):
            refused += 1
    assert refused > 20


@pytest.mark.parametrize(
    ("data", "format", "reason"),
    [
        (bytes(40), "rgb8; jpeg", "'rgb8; jpeg' cannot be shown"),
        (bytes(40), "16UC1; compressedDepth zip", "zip' cannot be shown"),
        (bytes(12), "16UC1", "cut off: 12 bytes"),
        (bytes(15), "16UC1; compressedDepth rvl", "cut off before the image's size"),
        (bytes(40), "16UC1; compressedDepth rvl", "cannot be an image of 0x0"),
        (bytes(12) + b"\xff" * 28, "16UC1; compressedDepth rvl", "bytes cannot be an image of"),
        (message("png", depths().astype(np.uint8)), "16UC1", "16-bit grey, this is mono8"),
        (message("png", depths(), float("nan"), 0), "32FC1", "parameters nan, 0.0"),
        (message("png", depths(), 0.0, 0), "32FC1", "parameters 0.0, 0.0"),
    ],
)
def test_faulty_image_is_rejected_without_allocating(data: bytes, format: str, reason: str) -> None:
    tracemalloc.start()
    try:
        with pytest.raises((DecodeError, UnsupportedError), match=reason):
            decompress_depth(data, format)
        assert tracemalloc.get_traced_memory()[1] < 1_000_000
    finally:
        tracemalloc.stop()
