"""The control Battery."""

from __future__ import annotations

import math
from typing import Any

import pytest

TYPE = "sensor_msgs/msg/BatteryState"
pytestmark = pytest.mark.both_qt


def test_battery_finds_its_topic_by_type(controls: Any, wait: Any) -> None:
    publisher = controls.robot.create_publisher("/power/main", TYPE)
    battery = controls.show("Battery {}")
    wait(publisher.subscription_count)
    publisher.publish(percentage=0.62, voltage=24.0, current=-2.0, charge=4.0)
    wait(lambda: not battery.property("stale"))
    assert controls.find("share").property("text") == "62 %"
    assert battery.property("timeLeft") == pytest.approx(7200)
    assert battery.property("note") == "24.0 V"


def test_battery_without_a_percentage_says_so(controls: Any, wait: Any) -> None:
    publisher = controls.robot.create_publisher("/battery", TYPE)
    battery = controls.show('Battery { topic: "/battery" }')
    wait(publisher.subscription_count)
    publisher.publish(percentage=math.nan, charge=math.nan, current=math.nan, voltage=math.nan)
    wait(lambda: not battery.property("stale"))
    assert controls.find("share").property("text") == "? %"
    publisher.publish(percentage=math.nan, charge=1.0, capacity=4.0)
    wait(lambda: controls.find("share").property("text") == "25 %")


def test_battery_names_a_topic_of_another_type(controls: Any, wait: Any) -> None:
    publisher = controls.robot.create_publisher("/battery", "std_msgs/msg/String")
    battery = controls.show('Battery { topic: "/battery" }')
    wait(publisher.subscription_count)
    publisher.publish(data="full")
    wait(lambda: "std_msgs/msg/String, which is not" in battery.property("status"))
    # The heading has no room for it.
    wait(lambda: controls.find("wholeProblem").isVisible())
    assert controls.find("wholeProblem").property("text") == battery.property("status")
    assert not controls.find("wholeProblem").property("truncated")
    assert battery.property("stale")


def test_battery_without_data_says_so(controls: Any) -> None:
    battery = controls.show("Battery {}")
    assert battery.property("status") == "NO DATA YET"


def test_old_data_have_their_age_before_the_reason(controls: Any, wait: Any) -> None:
    publisher = controls.robot.create_publisher("/battery", TYPE)
    battery = controls.show('Battery { topic: "/battery"; width: 220 }')
    wait(publisher.subscription_count)
    publisher.publish(percentage=0.5)
    wait(lambda: not battery.property("stale"))
    publisher.close()
    wait(lambda: "no publisher since" in battery.property("status"))
    wait(lambda: controls.find("aside").property("text").startswith("OLD: "))
    assert battery.property("status") in controls.find("aside").property("text")
