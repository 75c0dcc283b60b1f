"""The controls TopicTree and MessageView, and the rows that they show."""

from __future__ import annotations

from typing import Any

import pytest
from hands import clipboard, key
from rows import tree_rows

STRING, TWIST = "std_msgs/msg/String", "geometry_msgs/msg/Twist"
pytestmark = pytest.mark.both_qt


def test_topics_are_a_tree_by_namespace(controls: Any, wait: Any) -> None:
    for name in ("/arm/left/state", "/arm/state", "/odom", "/arm"):
        controls.robot.create_publisher(name, STRING)
    view = controls.show("TopicTree { filter: STRING }".replace("STRING", '"String"'))
    wait(lambda: len(tree_rows(controls, "key")) == 6)
    assert tree_rows(controls, "name", "depth") == [
        ("arm", 0), ("arm", 0), ("left", 1), ("state", 2), ("state", 1), ("odom", 0),
    ]  # fmt: skip
    assert tree_rows(controls, "topics")[1] == 2
    assert tree_rows(controls, "type")[0] == STRING
    assert tree_rows(controls, "publishers", "subscribers")[0] == (1, 0)
    assert "4 topics" in view.property("note")


def test_a_topic_that_appears_or_goes_changes_only_its_row(controls: Any, wait: Any) -> None:
    controls.robot.create_publisher("/a", STRING)
    controls.robot.create_publisher("/c", STRING)
    controls.show('TopicTree { ns: "/" }')
    wait(lambda: "/c" in tree_rows(controls, "key"))
    resets: list[None] = []
    model = controls.find("tree").property("model")
    count = lambda: resets.append(None)  # noqa: E731 - methods change metaobjects
    model.modelReset.connect(count)
    publisher = controls.robot.create_publisher("/b", STRING)
    wait(lambda: "/b" in tree_rows(controls, "key"))
    publisher.close()
    wait(lambda: "/b" not in tree_rows(controls, "key"))
    assert resets == []


def test_conflicts_are_in_words(controls: Any, wait: Any) -> None:
    from rosglass.comm import QoS

    other = controls.bench.world.connect(None, "viewer")
    controls.robot.create_publisher("/image", STRING, QoS.sensor_data())
    other.create_subscription("/image", STRING, qos=QoS())
    controls.robot.create_publisher("/speed", STRING)
    other.create_publisher("/speed", TWIST)
    controls.show("TopicTree {}")
    wait(lambda: len([text for text in tree_rows(controls, "conflict") if text]) == 2)
    found = dict(tree_rows(controls, "key", "conflict"))
    assert found["/image"] == (
        "/viewer may get nothing from /robot: reliability: reliable requested, best effort offered"
    )
    assert found["/speed"].startswith("types differ: /")
    assert f"/viewer has {TWIST}" in found["/speed"]


def test_only_unfolded_topics_are_received(controls: Any, wait: Any) -> None:
    publisher = controls.robot.create_publisher("/chat", STRING)
    view = controls.show('TopicTree { filter: "chat" }')
    wait(lambda: tree_rows(controls, "key") == ["/chat"])
    assert publisher.subscription_count() == 0
    tree = controls.find("tree")
    controls.find("rows").forceActiveFocus()
    key(controls, "Right")
    wait(publisher.subscription_count)

    def is_measured() -> bool:
        publisher.publish(data="hello")
        return "Hz" in controls.find("measured").property("text")

    wait(is_measured)
    assert view.property("selected") == "/chat"
    assert tree.property("current") == "/chat"
    key(controls, "Left")
    wait(lambda: publisher.subscription_count() == 0)


def test_topics_are_copied_by_keyboard(controls: Any, wait: Any) -> None:
    controls.robot.create_publisher("/arm/state", STRING)
    view = controls.show('TopicTree { filter: "arm" }')
    wait(lambda: len(tree_rows(controls, "key")) == 2)
    controls.find("rows").forceActiveFocus()
    key(controls, "Down")
    key(controls, "C", control=True)
    assert clipboard() == "/arm/state"
    key(controls, "Left")
    assert controls.find("tree").property("current") == "/arm/"
    key(controls, "Left")
    assert view.property("selected") == ""


def test_two_thousand_topics(controls: Any, wait: Any) -> None:
    made = [
        controls.robot.create_publisher(f"/robot{number % 50}/topic{number}", STRING)
        for number in range(2000)
    ]
    view = controls.show("TopicTree {}")
    wait(lambda: len(tree_rows(controls, "key")) >= 2050)
    # A list makes only what is in view.
    assert len(controls.find("rows").property("contentItem").childItems()) < 60
    view.setProperty("filter", "topic1999")
    wait(lambda: tree_rows(controls, "key") == ["/robot49/", "/robot49/topic1999"])
    assert len(made) == 2000


def test_a_lost_connection_is_said(controls: Any, wait: Any) -> None:
    from rosglass.comm import ConnectionState

    controls.robot.create_publisher("/chat", STRING)
    view = controls.show("TopicTree {}")
    wait(lambda: "/chat" in tree_rows(controls, "key"))
    controls.bench.session.node.set_status(ConnectionState.LOST, "no router")
    wait(lambda: "not connected" in view.property("status"))
    assert view.property("stale")
    assert "/chat" in tree_rows(controls, "key")
