"""Frames with two parents, and cycles, in words."""

from __future__ import annotations

import pytest

from rosglass.comm import Time
from rosglass.errors import InvalidArgumentException
from rosglass.tf import Transform, TransformBuffer


def put(
    buffer: TransformBuffer, parent: str, child: str, at: float, authority: str, **options: bool
) -> None:
    stamp = Time(int(at * 1e9))
    transform = Transform(stamp=stamp, frame_id=parent, child_frame_id=child)
    buffer.set_transform(transform, authority, **options)


def test_parents_that_alternate_are_a_fault() -> None:
    buffer = TransformBuffer()
    for at in range(3):
        put(buffer, "odom", "base", at + 0.1, "/wheels")
        put(buffer, "map", "base", at + 0.2, "/amcl")
    assert buffer.tree_faults() == {"base": "two parents: 'odom' from /wheels and 'map' from /amcl"}
    buffer.clear()
    assert buffer.tree_faults() == {}


def test_a_frame_that_moves_to_another_parent_has_no_fault() -> None:
    buffer = TransformBuffer()
    for at in range(5):
        put(buffer, "table", "cup", at, "/world")
    for at in range(5, 10):
        put(buffer, "gripper", "cup", at, "/world")
    assert buffer.tree_faults() == {}


def test_two_static_parents_are_a_fault() -> None:
    buffer = TransformBuffer()
    put(buffer, "base", "laser", 1, "/a", static=True)
    put(buffer, "mast", "laser", 1, "/b", static=True)
    assert buffer.tree_faults() == {"laser": "two parents: 'base' from /a and 'mast' from /b"}


def test_a_static_frame_that_its_publisher_moves_has_no_fault() -> None:
    buffer = TransformBuffer()
    put(buffer, "base", "laser", 1, "/a", static=True)
    put(buffer, "mast", "laser", 2, "/a", static=True)
    assert buffer.tree_faults() == {}


def test_a_refused_cycle_is_a_fault() -> None:
    buffer = TransformBuffer()
    put(buffer, "a", "b", 1, "/x")
    put(buffer, "b", "c", 1, "/x")
    with pytest.raises(InvalidArgumentException):
        put(buffer, "c", "a", 1, "/y")
    assert buffer.tree_faults() == {
        "a": "a cycle: a in c in b in a; the transform in 'c' from /y is ignored"
    }


def test_names_with_braces_and_percent_signs_are_text() -> None:
    buffer = TransformBuffer()
    put(buffer, "{}%s", "laser{0}", 1, "", static=True)
    put(buffer, "%", "laser{0}", 1, "/b{}", static=True)
    assert buffer.tree_faults() == {
        "laser{0}": "two parents: '{}%s' from an unknown node and '%' from /b{}"
    }


def test_faults_of_a_flooding_publisher_are_bounded() -> None:
    buffer = TransformBuffer()
    for number in range(1500):
        put(buffer, "a", f"f{number}", 1, "/a", static=True)
        put(buffer, "b", f"f{number}", 1, "/b", static=True)
    assert len(buffer.tree_faults()) == 1000
