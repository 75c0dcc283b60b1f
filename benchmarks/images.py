"""Measures how long images take to become showable, against the least that OpenCV needs.

    python benchmarks/images.py [--quick]

The peer is what a viewer built on OpenCV does with the same bytes: `cv2.cvtColor` into memory that
exists already, or `cv2.imdecode`. Both make RGBA; images of the encodings marked as shared are
handed on untouched where the display takes them.
"""

from __future__ import annotations

import argparse
import struct
import sys
import timeit
from pathlib import Path
from typing import TYPE_CHECKING, Any

import cv2
import numpy as np

sys.path.insert(0, str(Path(__file__).parent.parent / "src"))

from rosglass.images import ANY_FORMAT, DepthColors, RawImage, convert, decompress
from rosglass.images.compressed import decompress_depth

if TYPE_CHECKING:
    from collections.abc import Callable

SIZES = ((640, 480), (1920, 1080))
#: Encoding -> bytes per row of pixels and column, rows per row, OpenCV's conversion.
ENCODINGS: dict[str, tuple[int, float, str]] = {
    "rgb8": (3, 1, "RGB2RGBA"),
    "bgr8": (3, 1, "BGR2RGBA"),
    "rgba8": (4, 1, ""),
    "mono8": (1, 1, "GRAY2RGBA"),
    "mono16": (2, 1, ""),
    "yuv422": (2, 1, "YUV2RGBA_UYVY"),
    "yuv422_yuy2": (2, 1, "YUV2RGBA_YUY2"),
    "nv12": (1, 1.5, "YUV2RGBA_NV12"),
    "nv21": (1, 1.5, "YUV2RGBA_NV21"),
    "nv24": (1, 3, ""),
    "bayer_rggb8": (1, 1, "BayerRGGB2RGBA"),
    "bayer_rggb16": (2, 1, "BayerRGGB2RGBA"),
    "rgb16": (6, 1, "RGB2RGBA"),
    "32FC1": (4, 1, ""),
}


def best(quick: bool, *works: Callable[[], Any]) -> list[float]:
    """Return the fastest run of each, milliseconds; in turns, so that noise meets all alike."""
    fastest = [float("inf")] * len(works)
    number, repeat = (2, 3) if quick else (5, 15)
    for _ in range(repeat):
        for index, work in enumerate(works):
            seconds = timeit.timeit(work, number=number) / number
            fastest[index] = min(fastest[index], seconds * 1000)
    return fastest


def line(name: str, size: str, times: list[float], note: str = "") -> None:
    ours, peer = times[0], times[1] if len(times) > 1 else None
    ratio = "" if peer is None else f"{peer:8.2f} {ours / peer:6.2f}x"
    print(f"{name:28} {size:>10} {ours:8.3f} {ratio:17} {note}", flush=True)


def encodings(width: int, height: int, quick: bool) -> None:
    rng = np.random.default_rng(1)
    memory = np.empty((height, width, 4), np.uint8)
    size = f"{width}x{height}"
    for name, (per_pixel, rows, code) in ENCODINGS.items():
        shape = (int(height * rows), width * per_pixel)
        data = rng.integers(0, 255, shape, np.uint8)
        if name == "32FC1":
            data = rng.uniform(0.3, 5, (height, width)).astype(np.float32).view(np.uint8)
        image = RawImage(width, height, name, width * per_pixel, data.reshape(-1))
        works: list[Callable[[], Any]] = [
            lambda: convert(image, frozenset(), None, lambda *_: memory)  # noqa: B023
        ]
        if code:
            deep = name.endswith("16")
            pixels = (data.view(np.uint16) if deep else data).reshape(data.shape[0], width, -1)
            number = getattr(cv2, f"COLOR_{code}")
            out = memory if not deep else None
            works.append(lambda: cv2.cvtColor(pixels, number, dst=out))  # noqa: B023
        direct = convert(image, ANY_FORMAT)
        shared = any(np.may_share_memory(plane, data) for plane in direct.planes)
        note = "shared where the display takes it" if shared else ""
        line(name, size, best(quick, *works), note)


def depths(width: int, height: int, quick: bool) -> None:
    size = f"{width}x{height}"
    ramp = np.linspace(300, 5000, width * height).reshape(height, width)
    noise = np.random.default_rng(2).integers(0, 40, (height, width))
    millimetres = (ramp + noise).astype(np.uint16)
    for name, pixels in (("16UC1", millimetres), ("32FC1", (ramp / 1000).astype(np.float32))):
        image = RawImage(width, height, name, width * pixels.itemsize, pixels.reshape(-1))
        colors = DepthColors("turbo", 0.3, 5.0)
        scale = 255 / 4.7 / (1000 if name == "16UC1" else 1)

        def by_opencv(pixels: Any = pixels, scale: float = scale) -> None:
            grey = cv2.convertScaleAbs(pixels, alpha=scale)
            cv2.cvtColor(cv2.applyColorMap(grey, cv2.COLORMAP_TURBO), cv2.COLOR_BGR2RGBA)

        times = best(quick, lambda: colors.convert(image), by_opencv)  # noqa: B023
        line(f"{name} in colours", size, times)
    png = cv2.imencode(".png", millimetres)[1].tobytes()
    message = struct.pack("<iff", 0, 0.0, 0.0) + png
    array = np.frombuffer(png, np.uint8)
    times = best(
        quick,
        lambda: decompress_depth(message, "16UC1; compressedDepth png"),
        lambda: cv2.imdecode(array, cv2.IMREAD_UNCHANGED),
    )
    line("compressedDepth png", size, times)
    photo = cv2.GaussianBlur(
        np.random.default_rng(3).integers(0, 255, (height, width, 3), np.uint8), (0, 0), 3
    )
    jpeg = cv2.imencode(".jpg", photo)[1].tobytes()
    coded = np.frombuffer(jpeg, np.uint8)
    times = best(
        quick,
        lambda: decompress(jpeg, "bgr8; jpeg compressed bgr8"),
        lambda: cv2.imdecode(coded, cv2.IMREAD_UNCHANGED),
    )
    line("compressed jpeg", size, times)


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--quick", action="store_true", help="fewer runs")
    quick = parser.parse_args().quick
    print(f"{'':28} {'pixels':>10} {'ours ms':>8} {'cv2 ms':>8} ratio")
    for width, height in SIZES:
        encodings(width, height, quick)
        depths(width, height, quick)
    return 0


if __name__ == "__main__":
    sys.exit(main())
