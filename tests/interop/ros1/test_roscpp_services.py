"""The log, log levels and simulated time: ours against ROS 1's commands and nodes."""

from __future__ import annotations

import logging
from pathlib import Path

import pytest
from waiting import eventually

#: The node that roscore starts beside the master.
ROSOUT = "/usr/lib/rosout/rosout"


@pytest.fixture
def node(connect):
    node = connect("cockpit", "/ops")
    eventually(lambda: "/ops/cockpit/set_logger_level" in node.services())
    return node


def test_rostopic_echo_shows_what_we_log(node, start_tool):
    echo = start_tool("rostopic", "echo", "/rosout")

    def is_shown():
        node.logger.warning("battery at %d %%: Grüße", 5)
        return "---\n" in echo.output

    eventually(is_shown, timeout=20, what=lambda: "".join(echo.output))
    printed = "".join(echo.output)
    assert "level: 4\n" in printed
    assert 'name: "/ops/cockpit"\n' in printed
    assert "battery at 5 %: Gr" in printed
    assert f'file: "{__file__}"\n' in printed
    assert 'function: "is_shown"\n' in printed
    assert "topics: \n  - /rosout\n" in printed


def test_the_first_message_is_not_lost(connect, start_rospy, master):
    listener = start_rospy("listener")
    listener.call("subscribe", topic="/rosout", type="rosgraph_msgs/Log")
    node = connect("early", wait=False)
    node.logger.info("one")
    node.logger.info("two")
    heard: list[str] = []
    while heard[-1:] != ["two"]:
        value = listener.event("received")["value"]
        if value["name"] == "/early":
            heard.append(value["msg"])
    assert heard == ["one", "two"]


def test_rosservice_and_rosconsole_see_and_set_our_levels(node, tool):
    node.logger.getChild("gripper")
    loggers = tool("rosservice", "call", "/ops/cockpit/get_loggers")
    assert 'name: "ros.ops.cockpit"\n    level: "info"' in loggers
    assert "ros.ops.cockpit.gripper" in tool("rosconsole", "list", "/ops/cockpit")
    tool("rosconsole", "set", "/ops/cockpit", "ros.ops.cockpit.gripper", "debug")
    assert node.logger.getChild("gripper").isEnabledFor(logging.DEBUG)
    assert not node.logger.isEnabledFor(logging.DEBUG)
    assert "debug" in tool("rosconsole", "get", "/ops/cockpit", "ros.ops.cockpit.gripper")
    refused = tool(
        "rosservice", "call", "/ops/cockpit/set_logger_level", "unused", "info", status=None
    )
    assert "no logger 'unused'; one of ros.ops.cockpit" in refused


@pytest.mark.parametrize(
    ("kind", "logger", "plan"), [("rospy", "rosout", {"level": "info"}), ("roscpp", "ros", {})]
)
def test_log_and_levels_of_other_nodes_are_received(node, request, kind, logger, plan):
    peer = request.getfixturevalue(f"{kind}_peer")
    heard: list = []
    node.create_subscription("/rosout", None, heard.append, 100)

    def hears(text: str) -> bool:
        peer.call("log", text=text, **plan)
        return any(m.msg == text and m.name == f"/{kind}_peer" for m in heard)

    eventually(lambda: hears("hello"))
    first = next(m for m in heard if m.msg == "hello")
    assert first.level == 2
    assert first.file.endswith((".py", ".cpp"))
    assert first.line > 0
    ask = node.create_service_client(f"/{kind}_peer/get_loggers")
    loggers = {entry.name: entry.level.lower() for entry in ask.call(timeout=30).loggers}
    assert loggers[logger] == "info"


def test_we_set_the_levels_of_others(node, rospy_peer):
    # Not of a roscpp node: Debian 12's dies of it (SIGSEGV), with any caller.
    change = node.create_service_client("/rospy_peer/set_logger_level", "roscpp/SetLoggerLevel")
    change.call({"logger": "rosout", "level": "DEBUG"}, timeout=30)
    assert rospy_peer.call("log_level") == "DEBUG"
    change.call({"logger": "rosout", "level": "INFO"}, timeout=30)
    assert rospy_peer.call("log_level") == "INFO"


@pytest.mark.parametrize("start", ["start_rospy", "start_roscpp"])
def test_our_clock_follows_and_theirs_follows_ours(start_master, connect, request, start):
    master = start_master()
    start_peer = request.getfixturevalue(start)
    node = connect("cockpit", url=master.url)
    before = node.clock.is_simulated
    master.call("setParam", "/use_sim_time", True)
    eventually(lambda: node.clock.is_simulated)
    assert not before
    clock = node.create_publisher("/clock", "rosgraph_msgs/Clock")
    peer = start_peer(f"follower_{start}", master=master)
    eventually(lambda: clock.subscription_count() == 2)
    clock.publish(clock={"secs": 100, "nsecs": 500_000_000})
    eventually(lambda: node.now().seconds == 100.5)
    stamp = 100.5 if start == "start_roscpp" else {"secs": 100, "nsecs": 500_000_000}
    eventually(lambda: peer.call("now") == stamp)


def test_a_rospy_publisher_of_clock_drives_our_timers(start_master, connect, start_rospy):
    master = start_master()
    master.call("setParam", "/use_sim_time", True)
    node = connect("cockpit", url=master.url)
    eventually(lambda: node.clock.is_simulated)
    jumps: list = []
    node.clock.on_jump(jumps.append)
    fired: list[float] = []
    gazebo = start_rospy("gazebo", master=master)
    gazebo.call("publish", topic="/clock", type="rosgraph_msgs/Clock")

    def tick(secs: float) -> None:
        value = {"clock": {"secs": int(secs), "nsecs": int(secs % 1 * 1e9)}}
        gazebo.call("publish", topic="/clock", type="rosgraph_msgs/Clock", value=value)
        eventually(lambda: node.now().seconds == secs)

    eventually(lambda: gazebo.call("connections", topic="/clock") == 2)
    tick(10)
    node.create_timer(1.0, lambda: fired.append(node.now().seconds))
    tick(10.5)
    tick(11)
    eventually(lambda: fired == [11.0])
    tick(5)
    eventually(lambda: any(jump.delta.seconds < 0 for jump in jumps))
    gazebo.end()  # the simulation is killed: time stands still
    assert node.now().seconds == 5.0


def test_roscores_own_node_collects_our_log(start_master, start_program, connect):
    master = start_master()
    if not Path(ROSOUT).exists():
        pytest.skip("the node rosout is not installed: sudo apt-get install rosout")
    start_program(ROSOUT, "__name:=rosout", env=master.env())
    eventually(lambda: ["/rosout", ["/rosout"]] in master.call("getSystemState")[1])
    node = connect("cockpit", url=master.url)
    listener = node.create_subscription("/rosout_agg", None)

    def knock() -> bool:
        node.logger.info("knock")
        return listener.wait(0.2) is not None

    eventually(knock)
    node.logger.error("motor stalled")
    message = listener.wait(30).message()
    while message.msg == "knock":
        message = listener.wait(30).message()
    assert (message.name, message.msg, message.level) == ("/cockpit", "motor stalled", 8)
    assert message.file == __file__
