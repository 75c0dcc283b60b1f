"""The control TfTree."""

from __future__ import annotations

from typing import Any

import pytest
from hands import clipboard, key
from rows import tree_rows

from rosglass.tf import StaticTransformBroadcaster, Transform, TransformBroadcaster

pytestmark = pytest.mark.both_qt


def transform(node: Any, parent: str, child: str) -> Transform:
    return Transform(stamp=node.now(), frame_id=parent, child_frame_id=child)


def test_frames_are_a_tree_with_ages(controls: Any, wait: Any) -> None:
    robot = controls.robot
    moving, static = TransformBroadcaster(robot), StaticTransformBroadcaster(robot)
    view = controls.show("TfTree {}")
    wait(moving.publisher.subscription_count)
    static.send_transform(transform(robot, "base", "laser"))
    moving.send_transform(transform(robot, "odom", "base"))
    wait(lambda: tree_rows(controls, "key") == ["odom", "base", "laser"])
    found = {
        row[0]: row[1:] for row in tree_rows(controls, "key", "depth", "isStatic", "age", "isOld")
    }
    assert found["odom"] == (0, False, -1.0, False)
    assert found["laser"][:3] == (2, True, -1.0)
    assert found["base"][2] >= 0
    assert "3 frames" in view.property("note")
    view.setProperty("timeout", 200)
    wait(lambda: dict(tree_rows(controls, "key", "isOld"))["base"])
    assert "1 old" in view.property("note")


def test_two_parents_are_in_words(controls: Any, wait: Any) -> None:
    other = controls.bench.world.connect(None, "amcl")
    wheels, amcl = TransformBroadcaster(controls.robot), TransformBroadcaster(other)
    view = controls.show("TfTree {}")
    wait(lambda: wheels.publisher.subscription_count() and amcl.publisher.subscription_count())

    def send() -> str:
        wheels.send_transform(transform(controls.robot, "odom", "base"))
        amcl.send_transform(transform(other, "map", "base"))
        return dict(tree_rows(controls, "key", "fault")).get("base", "")

    wait(send)
    assert "from /robot" in send()
    assert "from /amcl" in send()
    assert "1 wrong" in view.property("note")


def test_a_cycle_is_in_words(controls: Any, wait: Any) -> None:
    robot = controls.robot
    moving = TransformBroadcaster(robot)
    controls.show("TfTree {}")
    wait(moving.publisher.subscription_count)
    moving.send_transform(transform(robot, "a", "b"))
    wait(lambda: tree_rows(controls, "key") == ["a", "b"])
    moving.send_transform(transform(robot, "b", "a"))
    wait(lambda: "a in b in a" in dict(tree_rows(controls, "key", "fault"))["a"])


def test_frames_are_filtered_with_their_parents(controls: Any, wait: Any) -> None:
    robot = controls.robot
    static = StaticTransformBroadcaster(robot)
    view = controls.show("TfTree {}")
    for number in range(5):
        static.send_transform(transform(robot, "base", f"wheel{number}"))
    wait(lambda: len(tree_rows(controls, "key")) == 6)
    view.setProperty("filter", "WHEEL3")
    assert tree_rows(controls, "key") == ["base", "wheel3"]
    controls.find("rows").forceActiveFocus()
    key(controls, "End")
    key(controls, "C", control=True)
    assert clipboard() == "wheel3"
    assert view.property("selected") == "wheel3"


def test_without_frames_there_is_no_data_yet(controls: Any) -> None:
    assert controls.show("TfTree {}").property("status") == "NO DATA YET"


def test_a_deep_tree_is_shown(controls: Any, wait: Any) -> None:
    static = StaticTransformBroadcaster(controls.robot)
    controls.show("TfTree {}")
    static.send_transform(
        [transform(controls.robot, f"f{at:03}", f"f{at + 1:03}") for at in range(900)]
    )
    wait(lambda: len(tree_rows(controls, "key")) == 901)
    assert tree_rows(controls, "depth")[-1] == 900
