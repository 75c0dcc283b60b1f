"""The built-in parts of every node: its log on ``/rosout`` and simulated time, on every wire."""

from __future__ import annotations

import logging
import threading

import pytest

import rosglass
from rosglass import QoS, Time
from rosglass.comm import ClockChange

TEXT = "std_msgs/msg/String"


@pytest.fixture
def log(robot, console, eventually):
    """The messages of the robot's log that the console receives; it is connected."""
    found = []
    console.create_subscription("/rosout", None, found.append, QoS(depth=10_000))

    def is_linked():
        robot.logger.info("link")
        return any(message.msg == "link" for message in found)

    eventually(is_linked)

    def after_the_link():
        return [message for message in found if message.msg != "link"]

    return after_the_link


# -- the log -----------------------------------------------------------------------------------


def test_messages_say_where_they_were_logged_and_how_severe_they_are(robot, log, eventually):
    logger = robot.logger
    logger.debug("below the level")
    logger.setLevel(logging.DEBUG)
    names = ("debug", "info", "warning", "error", "critical")
    for name in names:
        getattr(logger, name)("%s it is", name)
    eventually(lambda: len(log()) == 5, log)
    assert [message.msg for message in log()] == [f"{name} it is" for name in names]
    levels = [message.level for message in log()]
    assert levels == sorted(set(levels))
    first = log()[0]
    assert first.name.strip("/") == "robot"
    assert first.file == __file__
    assert first.function == ("test_messages_say_where_they_were_logged_and_how_severe_they_are")
    assert first.line > 20


def test_characters_that_a_string_cannot_hold_are_escaped(robot, log, eventually):
    robot.logger.getChild("gripper.left").error("Grüße\0\udc80")
    robot.logger.critical("x" * 100_000)
    try:
        raise ValueError("odd")
    except ValueError:
        robot.logger.exception("it failed")
    eventually(lambda: len(log()) == 3, log)
    odd, long, failure = (message.msg for message in log())
    assert odd == "Grüße\\0\\udc80"
    assert long.endswith("x... (cut; 100000 characters)")
    assert failure.startswith("it failed\nTraceback")
    assert failure.endswith("ValueError: odd")


def test_logging_never_raises(robot):
    robot.logger.propagate = False  # pytest's own handler does raise
    robot.logger.info("%d %d", "a")  # noqa: PLE1206 - that is the point
    robot.logger.info(object())
    robot.close()
    robot.logger.info("after closing")


def test_last_log_messages_are_sent_before_closing_and_none_after(robot, log, eventually):
    logger = robot.logger
    logger.info("last words")
    robot.close()
    eventually(lambda: [message.msg for message in log()] == ["last words"], log)
    logger.info("too late")
    assert robot.logger is logger
    assert [message.msg for message in log()] == ["last words"]


def test_flood_of_log_messages_is_limited_and_counted(robot, log, eventually):
    robot.logger.propagate = False
    for number in range(5000):
        robot.logger.info("%d", number)
    eventually(lambda: any("log messages were dropped" in m.msg for m in log()))
    assert len(log()) < 5000


def test_warnings_of_the_library_about_a_node_are_in_its_log(
    robot, console, log, topic, eventually
):
    def fail(_):
        raise RuntimeError("on purpose")

    robot.create_subscription(topic, TEXT, fail, QoS.latched())
    console.create_publisher(topic, TEXT, QoS.latched()).publish(data="x")
    logging.getLogger("rosglass.comm").warning("not about this node")
    eventually(lambda: any("on purpose" in message.msg for message in log()), log)
    assert not any("not about" in message.msg for message in log())


def test_other_nodes_find_what_is_built_in_unless_it_is_left_out(connect, console, eventually):
    connect("hidden", own_services=False)
    connect("shown")

    def builtin(node):
        return {end.name for end in console.endpoints(node)}

    eventually(lambda: "/rosout" in builtin("/shown") and len(builtin("/shown")) >= 3)
    assert builtin("/hidden") == set()
    with pytest.raises(rosglass.ConversionError, match="own_services"):
        connect("odd", own_services="no")


# -- simulated time ----------------------------------------------------------------------------


@pytest.fixture
def simulate(wire, robot, console, eventually):
    """Let the robot's clock follow /clock or not; the system's time is back after the test."""

    def simulate(wanted):
        if wire.is_ros1:
            console.parameter_server.set("/use_sim_time", wanted)
        else:
            robot.parameters.set({"use_sim_time": wanted})
        eventually(lambda: robot.clock.is_simulated == wanted)

    yield simulate
    simulate(False)


def test_clock_follows_the_simulation(robot, console, simulate, eventually):
    jumps = []
    robot.clock.on_jump(jumps.append)
    assert not robot.clock.is_simulated
    simulate(True)
    assert robot.now() == Time(0)
    clock = console.create_publisher("/clock", "rosgraph_msgs/msg/Clock")

    def tick(sec, nanosec=0):
        def is_taken():
            clock.publish(clock=Time.from_parts(sec, nanosec))
            return robot.now() == Time.from_parts(sec, nanosec)

        eventually(is_taken, robot.now)

    tick(100, 5)
    fired = threading.Event()
    robot.create_timer(2.0, fired.set)
    tick(101)
    assert not fired.is_set()
    tick(102, 5)
    assert fired.wait(30)
    tick(50)
    eventually(lambda: any(jump.delta.nanoseconds < 0 for jump in jumps))
    clock.close()  # the simulation stands still
    assert robot.now() == Time.from_parts(50, 0)
    simulate(False)
    assert robot.now().seconds > 1_600_000_000
    eventually(lambda: jumps[-1].change is ClockChange.TO_SYSTEM)
    assert jumps[0].change is ClockChange.TO_SIMULATED


def test_missing_clock_of_a_simulation_is_logged(simulate, eventually, monkeypatch, caplog):
    monkeypatch.setattr("rosglass.comm.builtin_services._FIRST_TIME_TIMEOUT_S", 0.1)
    simulate(True)
    eventually(lambda: "time stands still at zero" in caplog.text)
