"""The choice of the topic that a camera's images are received from."""

from __future__ import annotations

import numpy as np
import pytest

import rosglass
from rosglass.comm import Sample
from rosglass.errors import UnsupportedError
from rosglass.images import choose
from rosglass.images.transports import camera_info_topic

RAW, COMPRESSED = "sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage"
BOTH = {"/cam": [RAW], "/cam/compressed": [COMPRESSED]}


@pytest.mark.parametrize(
    ("topic", "preferred", "published", "expected"),
    [
        ("/cam", "compressed", BOTH, "/cam/compressed"),
        ("/cam", "raw", BOTH, "/cam"),
        ("/cam", "compressed", {"/cam": [RAW]}, "/cam"),
        ("/cam", "raw", {"/cam/compressed": [COMPRESSED]}, "/cam/compressed"),
        ("/cam/compressed", "compressed", BOTH, "/cam/compressed"),
        ("/cam/compressed", "raw", BOTH, "/cam/compressed"),
        ("/cam", "raw", {"/cam": ["std_msgs/msg/String", RAW]}, "/cam"),
    ],
)
def test_choice(topic: str, preferred: str, published: dict, expected: str) -> None:
    choice = choose(topic, preferred, published)
    assert choice is not None
    assert choice.topic == expected
    assert choice.base == "/cam"


def test_missing_publisher_is_not_an_error() -> None:
    assert choose("/cam", "raw", {"/other": [RAW]}) is None


@pytest.mark.parametrize(
    ("preferred", "published", "reason"),
    [
        ("teleport", BOTH, "'teleport' is unknown; known are: raw, compressed"),
        ("raw", {"/cam/zstd": ["zstd_image_transport/msg/Packet"]}, "only sent as zstd"),
        ("raw", {"/cam": ["std_msgs/msg/String"]}, "carries std_msgs/msg/String, not images"),
    ],
)
def test_unusable_transport_is_reported(preferred: str, published: dict, reason: str) -> None:
    with pytest.raises(UnsupportedError, match=reason):
        choose("/cam", preferred, published)


def test_images_stay_where_they_were_received() -> None:
    choice = choose("/cam", "raw", BOTH)
    assert choice is not None
    kind = rosglass.load(RAW)
    pixels = np.arange(60_000, dtype=np.uint8)
    fields = {"height": 200, "width": 300, "step": 300, "encoding": "mono8"}
    block = bytearray(kind.encode(data=pixels, **fields))
    read = choice.transport.reader(kind, "cdr")
    picture = read(Sample(memoryview(block).toreadonly(), "cdr", kind, 1))
    assert np.shares_memory(np.asarray(picture.data), np.frombuffer(block, np.uint8))
    assert np.array_equal(picture.data, pixels)


@pytest.mark.parametrize(
    ("topic", "info"),
    [
        ("/front/image_raw", "/front/camera_info"),
        ("/front/image_raw/compressed", "/front/camera_info"),
        ("/image", "/camera_info"),
    ],
)
def test_camera_info_is_beside_the_image(topic: str, info: str) -> None:
    assert camera_info_topic(topic) == info
