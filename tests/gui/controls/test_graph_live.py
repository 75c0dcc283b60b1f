"""The controls that show the graph, over real middlewares."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest
from rows import tree_rows

from rosglass.tf import Transform, TransformBroadcaster

if TYPE_CHECKING:
    from rosglass.comm import Node

pytestmark = pytest.mark.both_qt
STRING = "std_msgs/msg/String"


def test_topics_and_their_rates(live_controls: Any, wait: Any) -> None:
    publisher = live_controls.robot.create_publisher("/arm/state", STRING)
    live_controls.show('TopicTree { filter: "arm" }')
    wait(lambda: tree_rows(live_controls, "key") == ["/arm/", "/arm/state"])
    assert tree_rows(live_controls, "publishedBy")[1] == "/robot"
    live_controls.find("tree").toggled.emit("/arm/state")

    def is_measured() -> bool:
        publisher.publish(data="hello")
        return "Hz" in live_controls.find("measured").property("text")

    wait(is_measured)
    publisher.close()
    wait(
        lambda: (
            not tree_rows(live_controls, "key") or tree_rows(live_controls, "publishers")[1] == 0
        )
    )


def test_latched_message_is_shown_and_published_back(live_controls: Any, wait: Any) -> None:
    from rosglass.comm import QoS

    publisher = live_controls.robot.create_publisher("/mode", STRING, QoS.latched())
    publisher.publish(data="idle")
    received: list[Any] = []
    live_controls.robot.create_subscription("/mode", STRING, received.append)
    view = live_controls.show('MessageView { topic: "/mode"; editable: true }')
    wait(lambda: tree_rows(live_controls, "value") == ["idle"])
    view.edit_()
    rows_of = live_controls.find("tree").property("model").parent()
    assert rows_of.setText("data", "drive")
    view.publish_()
    wait(lambda: "drive" in [one.data for one in received])


def test_frames_of_two_nodes(live_controls: Any, wait: Any) -> None:
    robot: Node = live_controls.robot
    moving = TransformBroadcaster(robot)
    live_controls.show("TfTree {}")
    wait(moving.publisher.subscription_count)

    def is_shown() -> bool:
        stamp = robot.now()
        moving.send_transform(Transform(stamp=stamp, frame_id="odom", child_frame_id="base"))
        return tree_rows(live_controls, "key") == ["odom", "base"]

    wait(is_shown)
    wait(lambda: tree_rows(live_controls, "authority")[1] == "/robot")


def test_graph_of_nodes(live_controls: Any, wait: Any) -> None:
    from rosglass.controls.lists.graph_layout import GraphLayout

    live_controls.robot.create_publisher("/image", STRING)
    live_controls.robot.create_subscription("/image", STRING)
    live_controls.show('NodeGraph { filter: "image" }')
    items = live_controls.window.findChildren(GraphLayout)[0].property("items")
    keys = lambda: [items.value(row, "key") for row in range(items.rowCount())]  # noqa: E731
    wait(lambda: keys() == ["node /robot", "topic /image"])
