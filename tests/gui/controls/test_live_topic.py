"""The element LiveTopic, and subscriptions that are renamed."""

from __future__ import annotations

from typing import Any

import pytest

from rosglass.comm import QoS

pytestmark = pytest.mark.both_qt


@pytest.mark.parametrize("ns", ["/", "/robot1"])
def test_namespace_that_changes_nothing_keeps_data_fresh(controls: Any, wait: Any, ns: str) -> None:
    topic = f"{ns.rstrip('/')}/battery"
    publisher = controls.robot.create_publisher(topic, "std_msgs/msg/Float64", QoS.latched())
    publisher.publish(data=0.5)
    live = controls.show(
        """Item {
            property real shown: live.message ? live.message.data : 0
            property alias stale: live.stale; property alias topic: live.topic
            property alias ns: live.ns
            LiveTopic { id: live; topic: "TOPIC"; qos: Ros2.QoS().reliable().transient_local() }
        }""".replace("TOPIC", topic)
    )
    wait(lambda: live.property("shown") == 0.5)
    live.setProperty("ns", ns)
    # A latched message is received again, although the topic is the same.
    live.setProperty("topic", "battery")
    assert live.property("shown") == 0
    wait(lambda: live.property("shown") == 0.5)
    publisher.publish(data=0.25)
    wait(lambda: live.property("shown") == 0.25)
    assert not live.property("stale")


def test_topic_found_by_type_stays_fresh_in_its_namespace(controls: Any, wait: Any) -> None:
    publisher = controls.robot.create_publisher("/battery", "sensor_msgs/msg/BatteryState")
    battery = controls.show("Battery {}")
    wait(publisher.subscription_count)
    publisher.publish(percentage=0.5)
    wait(lambda: not battery.property("stale"))
    battery.setProperty("ns", "/")
    wait.settled(controls.engine_session)

    def is_fresh() -> bool:
        publisher.publish(percentage=0.5)
        return not battery.property("stale")

    wait(is_fresh)


def test_scale_of_the_theme_is_not_refused(controls: Any, wait: Any, caplog: Any) -> None:
    controls.show("Item { Component.onCompleted: { Theme.scale = 1.6; Theme.scale = 1 } }")
    assert "Theme.scale" not in caplog.text
