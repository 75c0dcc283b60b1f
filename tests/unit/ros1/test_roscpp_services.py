"""The built-in parts of a ROS 1 node: log, log levels, simulated time."""

from __future__ import annotations

import logging

import pytest

from rosglass.errors import ConversionError, ServiceError


@pytest.fixture
def log(connect):
    """The messages that another node receives on /rosout."""
    heard: list = []
    listener = connect("listener", own_services=False)
    listener.create_subscription("/rosout", "rosgraph_msgs/Log", heard.append, 10_000)
    return heard


def test_messages_carry_levels_names_topics_and_numbers_of_ros_1(connect, log, eventually):
    node = connect("arm", "/left", own_services=False)
    node.create_publisher("speed", "std_msgs/Float64")
    logger = node.logger
    assert logger.name == "ros.left.arm"
    logger.setLevel(logging.DEBUG)
    for name in ("debug", "info", "warning", "error", "critical"):
        getattr(logger, name)("%s it is", name)
    logger.getChild("gripper").log(25, "open")
    eventually(lambda: len(log) == 6)
    assert [message.level for message in log] == [1, 2, 4, 8, 16, 2]
    assert {message.name for message in log} == {"/left/arm"}
    assert "/left/speed" in list(log[0].topics)
    assert log[0].header.stamp.secs > 1_600_000_000
    assert [m.header.seq for m in log] == list(range(log[0].header.seq, log[0].header.seq + 6))


def test_topics_can_be_left_out(connect, log, eventually, master):
    master.tree["rosout_disable_topics_generation"] = True
    node = connect("arm", own_services=False)

    def last_topics():
        node.logger.info("short")
        return [list(message.topics) for message in log[-1:]]

    eventually(lambda: last_topics() == [[]])


def test_own_services_are_offered_or_not(connect, master, eventually):
    connect("shown", "/a")
    connect("hidden", "/b", own_services=False)
    eventually(lambda: len(master.services) == 2 and "/rosout" in master.publishers)
    assert sorted(master.services) == ["/a/shown/get_loggers", "/a/shown/set_logger_level"]
    assert list(master.publishers["/rosout"]) == ["/a/shown"]
    with pytest.raises(ConversionError, match="own_services"):
        connect("odd", own_services="no")


def test_log_levels_are_listed_and_set(connect, eventually):
    node, other = connect("arm"), connect("other", own_services=False)
    node.logger.getChild("gripper.left")
    ask = other.create_service_client("/arm/get_loggers", "roscpp/GetLoggers")
    change = other.create_service_client("/arm/set_logger_level", "roscpp/SetLoggerLevel")
    assert change.wait_for_server(30)

    def levels():
        return {entry.name: entry.level for entry in ask.call(timeout=30).loggers}

    found = levels()
    assert found["ros.arm"] == found["ros.arm.gripper.left"] == "info"
    assert "rosglass.ros1" in found
    change.call({"logger": "ros.arm.gripper", "level": "Debug"}, timeout=30)
    assert levels()["ros.arm.gripper.left"] == "debug"
    assert node.logger.getChild("gripper.left").isEnabledFor(logging.DEBUG)
    assert not node.logger.isEnabledFor(logging.DEBUG)
    change.call({"logger": "", "level": "FATAL"}, timeout=30)
    assert levels()["ros.arm"] == "fatal"
    node.logger.setLevel(35)
    assert levels()["ros.arm"] == "warn"
    with pytest.raises(ServiceError, match="no level 'loud'; one of debug, info"):
        change.call({"logger": "ros.arm", "level": "loud"}, timeout=30)
    with pytest.raises(ServiceError, match=r"no logger 'rosout'; one of ros\.arm"):
        change.call({"logger": "rosout", "level": "info"}, timeout=30)


def test_clock_follows_a_new_master_back_to_system_time(connect, master, eventually):
    master.tree["use_sim_time"] = 1
    node = connect("arm", own_services=False)
    eventually(lambda: node.clock.is_simulated)
    master.stop()
    assert node.clock.is_simulated
    master.start()
    eventually(lambda: not node.clock.is_simulated)
