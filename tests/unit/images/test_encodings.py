"""Images of every encoding have the right colours; bad ones are rejected with a reason."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest

from rosglass.errors import DecodeError, UnsupportedError
from rosglass.images import ENCODINGS, PixelFormat, RawImage, convert

W, H = 8, 4
#: Red, green, blue of the test image: left half one colour, right half another.
LEFT, RIGHT = (200, 60, 20), (10, 90, 250)


def rgb() -> np.ndarray:
    picture = np.empty((H, W, 3), np.uint8)
    picture[:, : W // 2], picture[:, W // 2 :] = LEFT, RIGHT
    return picture


def shown(image: RawImage) -> np.ndarray:
    """Return what a display without YUV support shows, as rows x columns x RGB (or grey)."""
    frame = convert(image, frozenset())
    assert (frame.width, frame.height) == (image.width, image.height)
    if frame.format is PixelFormat.GRAY16:
        return frame.planes[0].copy().view(np.uint16)
    channels = 1 if frame.format is PixelFormat.GRAY8 else 4
    pixels = frame.planes[0].reshape(image.height, image.width, channels)
    if frame.format is PixelFormat.BGRA:
        pixels = pixels[..., [2, 1, 0, 3]]
    return pixels[..., :3] if channels == 4 else pixels[..., 0]


def image(encoding: str, pixels: np.ndarray, **more: object) -> RawImage:
    rows = pixels.reshape(pixels.shape[0], -1)
    fields = {"width": W, "height": H, "step": rows.strides[0], "data": rows.tobytes()} | more
    return RawImage(encoding=encoding, **fields)


def with_alpha(pixels: np.ndarray, value: int) -> np.ndarray:
    return np.dstack([pixels, np.full(pixels.shape[:2], value, pixels.dtype)])


RGB16 = rgb().astype(np.uint16) * 256 + 7
COLOUR_CASES = {
    "rgb8": rgb(),
    "bgr8": rgb()[..., ::-1],
    "8UC3": rgb()[..., ::-1],
    "rgba8": with_alpha(rgb(), 255),
    "bgra8": with_alpha(rgb()[..., ::-1], 255),
    "8UC4": with_alpha(rgb()[..., ::-1], 255),
    "rgb16": RGB16,
    "bgr16": RGB16[..., ::-1],
    "rgba16": with_alpha(RGB16, 65535),
    "bgra16": with_alpha(RGB16[..., ::-1], 65535),
}


@pytest.mark.parametrize("encoding", COLOUR_CASES)
def test_colours_are_exact(encoding: str) -> None:
    pixels = np.ascontiguousarray(COLOUR_CASES[encoding])
    np.testing.assert_array_equal(shown(image(encoding, pixels)), rgb())


@pytest.mark.parametrize("encoding", ["rgb16", "bgra16", "mono16"])
def test_byte_order_is_honoured(encoding: str) -> None:
    pixels = np.ascontiguousarray(COLOUR_CASES.get(encoding, RGB16[..., 0]))
    little = shown(image(encoding, pixels))
    swapped = pixels.astype(pixels.dtype.newbyteorder(">"))
    big = shown(image(encoding, swapped, big_endian=True))
    np.testing.assert_array_equal(little, big)
    assert len(np.unique(big)) > 1


def test_greys_are_exact() -> None:
    grey = rgb()[..., 0].copy()
    np.testing.assert_array_equal(shown(image("mono8", grey)), grey)
    np.testing.assert_array_equal(shown(image("8UC1", grey)), grey)
    deep = grey.astype(np.uint16) * 257
    np.testing.assert_array_equal(shown(image("mono16", deep)), deep)
    np.testing.assert_array_equal(shown(image("16UC1", deep)), deep)


def test_depth_in_metres_becomes_millimetres() -> None:
    metres = np.full((H, W), 2.5, np.float32)
    metres[0, :6] = [np.nan, np.inf, -1.0, 0.0, 1e9, 1e-9]
    out = shown(image("32FC1", metres))
    assert out[1, 1] == 2500
    assert out[0, :6].tolist() == [0, 0, 0, 0, 65535, 1]


def test_two_channels_show_both() -> None:
    out = shown(image("8UC2", np.ascontiguousarray(rgb()[..., :2])))
    np.testing.assert_array_equal(out[..., :2], rgb()[..., :2])
    assert not out[..., 2].any()


def luma_chroma(colour: tuple[int, int, int]) -> tuple[float, float, float]:
    """Studio-swing YCbCr of ITU-R BT.601."""
    r, g, b = colour
    y = 16 + 0.257 * r + 0.504 * g + 0.098 * b
    return y, 128 - 0.148 * r - 0.291 * g + 0.439 * b, 128 + 0.439 * r - 0.368 * g - 0.071 * b


def yuv_picture(encoding: str) -> np.ndarray:
    out: list[list[int]] = []
    halves = [luma_chroma(LEFT)] * (W // 2) + [luma_chroma(RIGHT)] * (W // 2)
    pairs = [tuple(round(v) for v in halves[x]) for x in range(0, W, 2)]
    if encoding in {"yuv422", "uyvy"}:
        out = [[v for y, u, w in pairs for v in (u, y, w, y)]] * H
    elif encoding in {"yuv422_yuy2", "yuyv"}:
        out = [[v for y, u, w in pairs for v in (y, u, y, w)]] * H
    elif encoding == "nv24":
        out = [[v for y, _, _ in pairs for v in (y, y)]] * H
        chroma = [v for _, u, w in pairs for v in (u, w, u, w)]
        out += [chroma[:W], chroma[W:]] * H
    else:
        out = [[v for y, _, _ in pairs for v in (y, y)]] * H
        order = (1, 2) if encoding == "nv12" else (2, 1)
        out += [[pair[i] for pair in pairs for i in order]] * (H // 2)
    return np.array(out, np.uint8)


YUV = {
    "yuv422": PixelFormat.UYVY,
    "uyvy": PixelFormat.UYVY,
    "yuv422_yuy2": PixelFormat.YUYV,
    "yuyv": PixelFormat.YUYV,
    "nv12": PixelFormat.NV12,
    "nv21": PixelFormat.NV21,
}


@pytest.mark.parametrize("encoding", YUV)
def test_yuv_is_passed_through_or_converted(encoding: str) -> None:
    picture = image(encoding, yuv_picture(encoding))
    np.testing.assert_allclose(shown(picture).astype(int), rgb(), atol=4)
    frame = convert(picture, frozenset(YUV.values()))
    assert frame.format is YUV[encoding]
    assert b"".join(plane.tobytes() for plane in frame.planes) == picture.data
    assert np.shares_memory(frame.planes[0], np.frombuffer(picture.data, np.uint8))


def test_chroma_of_every_pixel() -> None:
    picture = image("nv24", yuv_picture("nv24"))
    np.testing.assert_allclose(shown(picture).astype(int), rgb(), atol=4)
    # Rows of W + 2 bytes: rows of chroma are twice as long, padding included.
    wide = np.zeros((3 * H, W + 2), np.uint8)
    wide[:H, :W] = yuv_picture("nv24")[:H]
    wide[H:].reshape(H, -1)[:, : 2 * W] = yuv_picture("nv24")[H:].reshape(H, -1)
    padded = image("nv24", wide)
    np.testing.assert_array_equal(shown(padded), shown(picture))
    with pytest.raises(DecodeError, match="nv24 with step 8 needs 96 bytes, data has 95"):
        convert(image("nv24", yuv_picture("nv24"), data=bytes(95)))


@pytest.mark.parametrize("order", ["rggb", "bggr", "gbrg", "grbg"])
@pytest.mark.parametrize("bits", [8, 16])
def test_bayer_patterns(order: str, bits: int) -> None:
    colour = {"r": LEFT[0], "g": LEFT[1], "b": LEFT[2]}
    tile = np.array([[colour[order[0]], colour[order[1]]], [colour[order[2]], colour[order[3]]]])
    mosaic = np.tile(tile, (H // 2, W // 2)).astype(np.uint8 if bits == 8 else np.uint16)
    if bits == 16:
        mosaic = mosaic << 8
    out = shown(image(f"bayer_{order}{bits}", mosaic))
    np.testing.assert_array_equal(out[1:-1, 1:-1], np.broadcast_to(LEFT, (H - 2, W - 2, 3)))


def test_every_encoding_has_a_test() -> None:
    tested = set(COLOUR_CASES) | set(YUV)
    tested |= {"mono8", "8UC1", "mono16", "16UC1", "32FC1", "8UC2", "nv24"}
    assert {name for name in ENCODINGS if not name.startswith("bayer")} == tested


@pytest.mark.parametrize("encoding", ["rgb8", "rgba8", "mono8", "mono16"])
def test_rows_may_be_padded_but_not_the_last(encoding: str) -> None:
    pixels = np.ascontiguousarray(COLOUR_CASES.get(encoding, RGB16[..., 0]))
    if encoding == "mono8":
        pixels = rgb()[..., 0].copy()
    rows = pixels.reshape(H, -1).view(np.uint8)
    padded = np.zeros((H, rows.shape[1] + 6), np.uint8)
    padded[:, : rows.shape[1]] = rows
    data = padded.tobytes()
    for end in (len(data), len(data) - 6):
        frame = convert(RawImage(W, H, encoding, padded.shape[1], data[:end]))
        out = convert(image(encoding, pixels))
        assert [p.tobytes() for p in frame.planes] == [p.tobytes() for p in out.planes]


def test_colours_are_converted_into_the_display_s_memory() -> None:
    memory = np.zeros((H, W + 3, 4), np.uint8)[:, :W]
    frame = convert(image("rgb8", rgb()), allocate=lambda width, height: memory[:height, :width])
    np.testing.assert_array_equal(memory[..., :3], rgb())
    assert np.may_share_memory(frame.planes[0], memory)
    np.testing.assert_array_equal(frame.planes[0].reshape(H, W, 4)[..., :3], rgb())


@pytest.mark.parametrize(
    ("fields", "reason"),
    [
        ({"encoding": "rgb9"}, "'rgb9' cannot be shown"),
        ({"width": 0}, "0x4 pixels"),
        ({"height": 0}, "8x0 pixels"),
        ({"step": 23}, "need 24 bytes per row, step is 23"),
        ({"data": bytes(95)}, "needs 96 bytes, data has 95"),
        ({"height": 4_000_000_000}, "more than"),
        ({"width": 60_000, "height": 60_000, "step": 180_000}, "more than"),
        ({"width": 8000, "height": 8000, "step": 24_000}, "needs 192000000 bytes, data has 96"),
        ({"encoding": "yuv422", "width": 7}, "needs an even width and height"),
        ({"encoding": "nv12", "height": 3}, "needs an even width and height"),
    ],
)
def test_contradictions_are_named_without_allocating(fields: dict, reason: str) -> None:
    arguments = {"width": W, "height": H, "encoding": "rgb8", "step": 24, "data": bytes(96)}
    tracemalloc.start()
    try:
        with pytest.raises((DecodeError, UnsupportedError), match=reason):
            convert(RawImage(**arguments | fields))
        assert tracemalloc.get_traced_memory()[1] < 1_000_000
    finally:
        tracemalloc.stop()
