"""Big payloads go to the middleware in parts, so that their arrays are not copied on the way."""

from __future__ import annotations

from array import array

import numpy as np
import pytest

import rosglass

IMAGE, STRING = "sensor_msgs/msg/Image", "std_msgs/msg/String"
PIXELS = np.arange(300_000, dtype=np.uint8)


@pytest.fixture
def taking_parts(middleware, monkeypatch):
    """The parts that were sent, by a middleware that takes them."""
    sent = []
    made = middleware.create_writer

    def create_writer(*arguments):
        writer = made(*arguments)
        writer.write_parts = lambda parts: sent.append(list(parts))
        return writer

    monkeypatch.setattr(middleware, "create_writer", create_writer)
    return sent


def picture(**fields):
    return {"height": 300, "width": 1000, "step": 1000, "encoding": "mono8", **fields}


def test_arrays_of_big_messages_are_not_copied(node, middleware, taking_parts):
    publisher = node.create_publisher("/camera", IMAGE)
    for _ in range(3):
        publisher.publish(picture(data=PIXELS))
    assert len(middleware.writers[0].written) + len(taking_parts) == 3
    assert len(taking_parts) == 2, "the first shows that they are big"
    whole = b"".join(taking_parts[0])
    assert whole == middleware.writers[0].written[0] == publisher.type.encode(picture(data=PIXELS))
    assert any(np.shares_memory(np.frombuffer(p, "u1"), PIXELS) for p in taking_parts[1] if len(p))


def test_received_image_is_passed_on_as_it_is(node, middleware, taking_parts):
    publisher = node.create_publisher("/camera", IMAGE)
    data = publisher.type.encode(picture(data=PIXELS))
    publisher.publish_serialized(memoryview(data))
    (part,) = taking_parts[0]
    assert np.shares_memory(np.frombuffer(part, "u1"), np.frombuffer(data, "u1"))


def test_other_middlewares_get_one_payload(node, middleware):
    publisher = node.create_publisher("/camera", IMAGE)
    data = publisher.type.encode(picture(data=PIXELS))
    publisher.publish(picture(data=PIXELS))
    publisher.publish(picture(data=PIXELS))
    publisher.publish_serialized(memoryview(data))
    assert middleware.writers[0].written == [data] * 3


@pytest.mark.parametrize(
    "odd",
    [
        lambda data: memoryview(bytes(b for byte in data for b in (byte, 0)))[::2],
        lambda data: memoryview(array("I", data)),
        lambda data: memoryview(bytearray(data)).cast("b"),
    ],
)
def test_views_of_any_form_are_sent(node, middleware, odd):
    data = rosglass.load(STRING).encode(data="hello12")
    assert len(data) % 4 == 0
    node.create_publisher("/t", STRING).publish_serialized(odd(data))
    assert middleware.writers[0].written == [data]
