"""Images survive compressing and decompressing."""

from __future__ import annotations

import numpy as np
import pytest

from rosglass.errors import UnsupportedError
from rosglass.images import decompress
from rosglass.images.compressed import compress

CHANNELS = {"rgb8": 3, "bgr8": 3, "rgba8": 4, "mono8": 1}
#: Encodings as they are decoded: what OpenCV gives, or what the message says.
DECODED = {"rgb8": ("rgb8", "bgr8"), "bgr8": ("bgr8",), "rgba8": ("rgba8", "bgra8")}


def picture(encoding: str) -> np.ndarray:
    shape = (24, 32, CHANNELS[encoding]) if CHANNELS[encoding] > 1 else (24, 32)
    made = np.zeros(shape, np.uint8)
    made[:12] = 200
    if made.ndim == 3:
        made[..., 0] = 90
    return made


@pytest.mark.parametrize("encoding", CHANNELS)
@pytest.mark.parametrize("kind", ["png", "jpeg"])
def test_there_and_back(encoding, kind):
    if (encoding, kind) == ("rgba8", "jpeg"):
        with pytest.raises(UnsupportedError, match="JPEG has no transparency"):
            compress(picture(encoding), encoding, kind)
        return
    given = picture(encoding)
    data, text = compress(given, encoding, kind, 95)
    assert text.startswith(f"{encoding}; {kind} compressed")
    raw = decompress(data, text)
    assert raw.encoding in DECODED.get(encoding, (encoding,))
    found = np.asarray(raw.data).reshape(given.shape)
    if raw.encoding[0] != encoding[0]:
        found = found[..., [2, 1, 0, 3][: given.shape[2]]]
    # JPEG blurs colours at edges.
    rows = slice(None) if kind == "png" else [4, 20]
    assert np.abs(found.astype(int) - given)[rows].max() <= (0 if kind == "png" else 12)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("yuv422",), "'yuv422' cannot be compressed here; these can: rgb8"),
        (("rgb8", "gif"), "'jpeg' or 'png', not 'gif'"),
        (("rgb8", "jpeg", 0), "1 to 100, not 0"),
    ],
)
def test_unsupported_arguments_are_refused(arguments, message):
    with pytest.raises(UnsupportedError, match=message):
        compress(picture("rgb8"), *arguments)
