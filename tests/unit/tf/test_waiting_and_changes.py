"""Lookups that wait, and callbacks that are notified of changes."""

from __future__ import annotations

import asyncio
import threading

import pytest

from rosglass.comm import Time
from rosglass.errors import (
    ConversionError,
    ExtrapolationException,
    InvalidArgumentException,
    LookupException,
    NodeClosedError,
    TimeoutError,  # noqa: A004
    TimeoutException,
)
from rosglass.tf import Transform, TransformBuffer


def put(buffer: TransformBuffer, parent: str, child: str, stamp: int = 5) -> None:
    buffer.set_transform(Transform(stamp=Time(stamp), frame_id=parent, child_frame_id=child))


def test_available_transform_is_returned_at_once() -> None:
    buffer = TransformBuffer()
    put(buffer, "map", "base")
    assert buffer.wait_for_transform("map", "base", timeout=0).stamp == Time(5)
    assert buffer.lookup_transform_async("map", "base").done()


def test_waiting_until_it_comes() -> None:
    buffer = TransformBuffer()
    promise = buffer.lookup_transform_async("map", "base", Time(7))
    later = threading.Timer(0.05, lambda: put(buffer, "map", "base", 9))
    put(buffer, "map", "base", 5)
    assert not promise.done()
    later.start()
    assert buffer.wait_for_transform("map", "base", Time(9), 10).stamp == Time(9)
    assert promise.result(0).stamp == Time(7)
    assert buffer.lookup_transform("map", "base", Time(7), timeout=30).stamp == Time(7)


def test_asyncio() -> None:
    buffer = TransformBuffer()

    async def main() -> Transform:
        promise = buffer.lookup_transform_async("map", "base")
        put(buffer, "map", "base")
        return await promise

    assert asyncio.run(main()).child_frame_id == "base"


def test_too_late() -> None:
    buffer = TransformBuffer()
    put(buffer, "map", "base")
    with pytest.raises(TimeoutException, match=r"arm.*within 0.01 s.*does not exist") as caught:
        buffer.wait_for_transform("map", "arm", timeout=0.01)
    assert isinstance(caught.value, TimeoutError)
    # As in tf2, a lookup raises the actual error.
    with pytest.raises(LookupException):
        buffer.lookup_transform("map", "arm", timeout=0.01)
    with pytest.raises(ExtrapolationException):
        buffer.lookup_transform("map", "base", Time(9), timeout=0.01)
    assert isinstance(buffer.can_transform("map", "arm", timeout=0.01).error, LookupException)
    full = buffer.lookup_transform_full_async("map", None, "arm", None, "map", timeout=0.01)
    with pytest.raises(TimeoutException):
        full.result(10)


def test_cancelled() -> None:
    buffer = TransformBuffer()
    promise = buffer.lookup_transform_async("map", "base", timeout=100)
    assert promise.cancel()
    put(buffer, "map", "base")
    assert promise.cancelled()


def test_waiting_for_what_can_never_be() -> None:
    buffer = TransformBuffer()
    with pytest.raises(InvalidArgumentException):
        buffer.wait_for_transform("/map", "base", timeout=30)
    with pytest.raises(InvalidArgumentException):
        buffer.lookup_transform_async("", "base")
    with pytest.raises(ConversionError, match="timeout"):
        buffer.lookup_transform("map", "base", timeout=-1)


def test_closing_ends_all_waiting() -> None:
    buffer = TransformBuffer()
    promise = buffer.lookup_transform_async("map", "base", timeout=100)
    buffer.close()
    buffer.close()
    with pytest.raises(NodeClosedError):
        promise.result(30)
    with pytest.raises(NodeClosedError):
        buffer.lookup_transform_async("map", "base")


def test_changes_between_two_frames() -> None:
    buffer = TransformBuffer()
    put(buffer, "map", "base")
    notified: list[str] = []
    handle = buffer.on_change("map", "hand", lambda: notified.append("hand"))
    buffer.on_change("map", "base", lambda: notified.append("base"))
    put(buffer, "map", "wheel")
    assert notified == []
    put(buffer, "base", "arm")
    assert notified == []
    put(buffer, "arm", "hand")  # connects them
    assert notified == ["hand"]
    put(buffer, "map", "base", 6)
    assert sorted(notified) == ["base", "hand", "hand"]
    notified.clear()
    buffer.clear()
    assert sorted(notified) == ["base", "hand"]
    notified.clear()
    handle.close()
    handle.close()
    put(buffer, "map", "base", 7)
    assert notified == ["base"]


def test_changes_of_the_tree() -> None:
    buffer = TransformBuffer()
    notified: list[str] = []
    buffer.on_tree_change(lambda: notified.append("tree"))
    buffer.on_update(lambda: notified.append("any"))
    put(buffer, "map", "base")
    assert notified == ["any", "tree"]
    put(buffer, "map", "base", 6)
    assert notified == ["any", "tree", "any"]
    put(buffer, "odom", "base", 7)
    assert notified[3:] == ["any", "tree"]


def test_callbacks_may_look_up_and_fill() -> None:
    buffer = TransformBuffer()
    found: list[Transform] = []

    def call() -> None:
        found.append(buffer.lookup_transform("map", "base"))
        if len(found) == 1:
            put(buffer, "map", "base", 9)

    buffer.on_change("map", "base", call)
    put(buffer, "map", "base")
    assert [transform.stamp for transform in found] == [Time(5), Time(9)]


def test_invalid_callback_is_rejected() -> None:
    buffer = TransformBuffer()
    with pytest.raises(ConversionError):
        buffer.on_change("map", "base", None)  # type: ignore[arg-type]
    with pytest.raises(ConversionError):
        buffer.on_update(print, executor="here")  # type: ignore[arg-type]
