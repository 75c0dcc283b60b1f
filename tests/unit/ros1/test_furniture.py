"""What every ROS 1 node has besides: log, log levels, simulated time."""

from __future__ import annotations

import logging
import threading

import pytest

import rosglass
from rosglass.comm.clock import ClockChange
from rosglass.comm.rosout import RosoutHandler
from rosglass.errors import ConversionError, ServiceError


@pytest.fixture
def log(connect):
    """What another node hears on /rosout."""
    heard: list = []
    listener = connect("listener", own_services=False)
    listener.create_subscription("/rosout", "rosgraph_msgs/Log", heard.append, 10_000)
    return heard


def test_messages_carry_file_function_line_topics_and_level(connect, log, eventually):
    node = connect("arm", "/left", own_services=False)
    node.create_publisher("speed", "std_msgs/Float64")
    logger = node.logger
    assert logger.name == "ros.left.arm"
    logger.debug("nobody hears this")
    logger.setLevel(logging.DEBUG)
    for name in ("debug", "info", "warning", "error", "critical"):
        getattr(logger, name)("%s it is", name)
    logger.getChild("gripper").log(25, "Grüße\0")
    try:
        raise ValueError("odd")
    except ValueError:
        logger.exception("it failed")
    eventually(lambda: len(log) == 7)
    assert [message.level for message in log] == [1, 2, 4, 8, 16, 2, 8]
    first = log[0]
    assert (first.name, first.msg) == ("/left/arm", "debug it is")
    assert first.file == __file__
    assert first.function == "test_messages_carry_file_function_line_topics_and_level"
    assert first.line > 20
    assert "/left/speed" in list(first.topics)
    assert first.header.stamp.secs > 1_600_000_000
    assert log[5].msg == "Grüße\\0"
    assert log[6].msg.startswith("it failed\nTraceback")
    assert log[6].msg.endswith("ValueError: odd")
    assert [m.header.seq for m in log] == list(range(log[0].header.seq, log[0].header.seq + 7))


def test_topics_can_be_left_out(connect, log, eventually, master):
    master.tree["rosout_disable_topics_generation"] = True
    node = connect("arm", own_services=False)
    logger = node.logger
    eventually(lambda: node._furniture._rosout._quiet.known)
    logger.info("short")
    eventually(lambda: log)
    assert list(log[0].topics) == []


def test_own_services_are_offered_or_not(connect, master, eventually):
    connect("shown", "/a")
    connect("hidden", "/b", own_services=False)
    eventually(lambda: len(master.services) == 2 and "/rosout" in master.publishers)
    assert sorted(master.services) == ["/a/shown/get_loggers", "/a/shown/set_logger_level"]
    assert list(master.publishers["/rosout"]) == ["/a/shown"]
    with pytest.raises(ConversionError, match="own_services"):
        connect("odd", own_services="no")


def test_log_levels_are_told_and_set(connect, eventually):
    node, other = connect("arm"), connect("other", own_services=False)
    node.logger.getChild("gripper.left")
    ask = other.create_service_client("/arm/get_loggers", "roscpp/GetLoggers")
    change = other.create_service_client("/arm/set_logger_level", "roscpp/SetLoggerLevel")
    assert change.wait_for_server(30)

    def levels():
        return {entry.name: entry.level for entry in ask.call(timeout=30).loggers}

    told = levels()
    assert told["ros.arm"] == told["ros.arm.gripper.left"] == "info"
    assert "rosglass.ros1" in told
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


def test_what_was_logged_last_is_sent_before_closing_and_nothing_after(connect, log, eventually):
    node = connect("arm", own_services=False)
    logger = node.logger
    logger.info("first")
    eventually(lambda: len(log) == 1)
    logger.info("last")
    node.close()
    eventually(lambda: [message.msg for message in log] == ["first", "last"])
    logger.info("too late")
    assert not [one for one in logger.handlers if isinstance(one, RosoutHandler)]
    assert node.logger is logger


def test_floods_are_cut_and_counted(connect, log, eventually):
    logger = connect("arm", own_services=False).logger
    for number in range(5000):
        logger.info("%d", number)
    eventually(lambda: any("were left out" in message.msg for message in log))
    assert len(log) < 5000


def test_warnings_of_the_library_reach_rosout(connect, log, eventually):
    node = connect("arm", own_services=False)
    assert node.logger

    def fail(_: object) -> None:
        raise RuntimeError("on purpose")

    node.create_subscription("/t", "std_msgs/String", fail)
    other = connect("other", own_services=False)
    other.create_publisher("/t", "std_msgs/String", rosglass.QoS.latched()).publish(data="x")
    eventually(lambda: any("on purpose" in message.msg for message in log))
    assert {message.name for message in log} == {"/arm"}


def test_the_clock_follows_the_parameter_and_the_topic(connect, master, eventually):
    node, simulator = connect("arm", own_services=False), connect("gazebo", own_services=False)
    jumps: list = []
    node.clock.on_jump(jumps.append)
    assert not node.clock.is_simulated
    simulator.parameter_server.set("/use_sim_time", True)
    eventually(lambda: node.clock.is_simulated)
    assert node.now().nanoseconds == 0
    clock = simulator.create_publisher("/clock", "rosgraph_msgs/Clock")
    eventually(lambda: clock.subscription_count() == 2)

    def tick(secs: int, nsecs: int = 0) -> None:
        clock.publish(clock={"secs": secs, "nsecs": nsecs})
        eventually(lambda: node.now().nanoseconds == secs * 10**9 + nsecs)

    tick(100, 5)
    fired = threading.Event()
    node.create_timer(2.0, fired.set)
    tick(101)
    assert not fired.wait(0.1)
    tick(102, 5)
    assert fired.wait(30)
    tick(50)
    eventually(lambda: any(jump.delta.nanoseconds < 0 for jump in jumps))
    clock.close()  # the simulation stands still
    assert node.now().nanoseconds == 50 * 10**9
    simulator.parameter_server.delete("/use_sim_time")
    eventually(lambda: not node.clock.is_simulated)
    eventually(lambda: jumps[-1].change is ClockChange.TO_SYSTEM)
    assert jumps[0].change is ClockChange.TO_SIMULATED


def test_the_clock_is_the_systems_again_once_a_new_master_says_so(connect, master, eventually):
    master.tree["use_sim_time"] = 1
    node = connect("arm", own_services=False)
    eventually(lambda: node.clock.is_simulated)
    master.stop()
    assert node.clock.is_simulated
    master.start()
    eventually(lambda: not node.clock.is_simulated)


def test_people_are_told_when_there_is_no_simulation(
    connect, master, eventually, monkeypatch, caplog
):
    monkeypatch.setattr("rosglass.ros1.sim_time._PATIENCE", 0.1)
    master.tree["use_sim_time"] = True
    connect("arm", own_services=False)
    eventually(lambda: "time stands still at zero" in caplog.text)
