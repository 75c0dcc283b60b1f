"""The `rosglass` commands in a ROS 1 graph whose robot is a rospy node."""

from __future__ import annotations

import json
import re
import signal
import subprocess
import sys
import time
from functools import partial
from pathlib import Path
from typing import Any

import pytest

import rosglass

TWIST = "geometry_msgs/Twist"


@pytest.fixture(scope="module")
def robot(start_rospy, master) -> Any:
    """A rospy node with one of everything."""
    peer = start_rospy("robot")
    peer.call("publish", topic="/pose", type="geometry_msgs/PoseStamped")
    pose = {"header": {"frame_id": "map"}, "pose": {"position": {"x": 1.5}}}
    peer.call("publish", topic="/pose", type="geometry_msgs/PoseStamped", value=pose, rate=50,
              count=0)  # fmt: skip
    cells = {"info": {"width": 500, "height": 2}, "data": [7] * 1000}
    peer.call("publish", topic="/map", type="nav_msgs/OccupancyGrid", value=cells, latch=True)
    peer.call("subscribe", topic="/cmd_vel", type=TWIST)
    peer.call("serve", service="/robot/stop", type="std_srvs/Trigger",
              returns={"success": True, "message": "stöpped"})  # fmt: skip
    peer.call("action_server", name="/count")
    master.call("setParam", "/robot/speed", 1.5)
    return peer


@pytest.fixture
def run(robot: Any, master: Any, monkeypatch: pytest.MonkeyPatch, run_command: Any) -> Any:
    """Run a command in an environment that is set up for the robot."""
    for name in ("ROSGLASS_URL", "ROS_DISTRO", "ROS_DOMAIN_ID", "RMW_IMPLEMENTATION"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("ROS_IP", "127.0.0.1")
    monkeypatch.setenv("ROS_MASTER_URI", master.uri)
    return run_command


@pytest.fixture
def start_command(master: Any, start_command_at: Any) -> Any:
    """Start a command as a process of its own."""
    return partial(start_command_at, master.url)


def test_topic_list_and_info(run, master, monkeypatch):
    code, out, err = run("topic", "list", "-t")
    assert (code, err) == (0, "")
    assert "/pose [geometry_msgs/PoseStamped]" in out.splitlines()
    assert "/cmd_vel [geometry_msgs/Twist]" in out.splitlines()
    code, out, _ = run("topic", "info", "/pose")
    assert out == (
        "/pose [geometry_msgs/PoseStamped]\n  publisher /robot\n"
        "    md5: d3812c3cbc69362b77dc0b19b345f8f5\n"
    )
    assert "    latched: yes\n" in run("topic", "info", "/map")[1]
    code, out, _ = run("topic", "info", "/map", "--json")
    assert json.loads(out)["endpoints"][0]["latched"] is True
    code, out, _ = run("topic", "info", "/cmd_vel", "--json")
    assert json.loads(out)["endpoints"] == [
        {"kind": "subscription", "name": "/cmd_vel", "node": "/robot",
         "type": "geometry_msgs/Twist"}
    ]  # fmt: skip
    code, _, err = run("topic", "info", "/posse")
    assert code == 1
    assert "nothing publishes or subscribes to /posse; did you mean /pose?" in err
    monkeypatch.delenv("ROS_MASTER_URI")
    code, out, _ = run("topic", "list", "--url", master.url)
    assert code == 0
    assert "/pose" in out.splitlines()


def test_topic_echo(run):
    code, out, _ = run("topic", "echo", "/map", "-1")
    assert code == 0
    assert "  width: 500\n" in out
    assert "1000 in all" in out
    code, out, _ = run("topic", "echo", "pose", "-1", "-f", "pose.position.x")
    assert out == "1.5\n"
    code, out, _ = run("topic", "echo", "/pose", "geometry_msgs/PoseStamped", "-1", "--json")
    assert json.loads(out)["header"]["stamp"] == {"secs": 0, "nsecs": 0}
    code, _, err = run("topic", "echo", "/pose", "std_msgs/String", "-1", "--timeout", "3")
    assert code == 1
    assert "publishes /pose as geometry_msgs/PoseStamped with md5" in err
    assert err.count("\n") == 1
    code, _, err = run("topic", "echo", "/posse", "--timeout", "0.5")
    assert err == "rosglass: /posse: it has no publisher; did you mean /pose?\n"


def test_topic_hz_bw_delay(run, robot):
    code, out, _ = run("topic", "hz", "/pose", "-d", "2.5", "--json")
    assert code == 0
    assert 30 < json.loads(out.splitlines()[-1])["rate"] < 70
    code, out, _ = run("topic", "bw", "/pose", "-d", "1.5")
    assert "B/s  message mean 75 B" in out
    code, out, _ = run("topic", "delay", "/pose", "-d", "1.5", "--json")
    delay = json.loads(out.splitlines()[-1])["mean"]
    assert abs(delay - time.time()) < 10  # the robot stamps with zero
    assert run("topic", "delay", "/cmd_vel", "-d", "1.2")[0] == 1


@pytest.mark.parametrize("given", [[TWIST], ["geometry_msgs/msg/Twist"], []])
def test_topic_pub(run, robot, given):
    code, out, err = run("topic", "pub", "-1", "cmd_vel", *given, "{linear: {x: 0.5}}")
    assert (code, err) == (0, "")
    assert out.startswith("1: geometry_msgs/Twist(linear=(x=0.5")
    received = robot.event("received")
    assert received["value"]["linear"]["x"] == 0.5
    assert received["topic"] == "/cmd_vel"


def test_a_latched_topic_pub_stays_until_ctrl_c(start_command, tool):
    process = start_command("topic", "pub", "/plan", "std_msgs/String", "{data: left}", "-r",
                            "0.01", "--qos", "latched")  # fmt: skip
    assert process.stdout.readline().startswith("1: ")
    assert tool("rostopic", "echo", "-n1", "/plan") == 'data: "left"\n---\n'
    process.send_signal(signal.SIGINT)
    assert process.wait(30) == 130


def test_topic_pub_asks_for_a_missing_type(run):
    code, _, err = run("topic", "pub", "-1", "/unused", "{}", "--timeout", "0.5")
    assert (code, err) == (
        1, "rosglass: no node uses /unused yet: give its type, e.g. std_msgs/String\n",
    )  # fmt: skip


def test_types_are_spelled_as_in_ros1(run):
    outputs = [
        run("topic", "list", "--json"),
        run("topic", "pub", "-1", "cmd_vel", "{linear: {x: 0.5}}", "--json"),
        run("topic", "pub", "-1", "cmd_vel", "{linear: {x: fast}}"),
        run("topic", "pub", "-1", "cmd_vel", "geometry_msgs/msg/Twit", "{}"),
        run("service", "list", "--json"),
        run("service", "info", "/robot/stop", "--json"),
        run("action", "list", "--json"),
        run("action", "info", "/count", "--json"),
        run("node", "info", "/robot", "--json"),
        run("interface", "list", "twist", "--json"),
        run("interface", "show", "std_msgs/msg/String", "--json"),
    ]
    for code, out, err in outputs:
        assert (code == 0) == (err == ""), err
        assert not re.search(r"\w/(msg|srv|action)/\w", re.sub(r'"file": .*', "", out + err))
    assert "geometry_msgs/Twist: linear.x: expected" in outputs[2][2]


def test_missing_names_are_reported_with_similar_ones(run):
    twist, trigger = "geometry_msgs/Twist", "std_srvs/Trigger"
    for line, message in (
        (("topic", "pub", "-1", "/cmd_vell", "{}"), "uses /cmd_vell; did you mean /cmd_vel"),
        (("topic", "pub", "-1", "/cmd_vell", twist, "{}"), "; did you mean /cmd_vel?"),
        (("service", "call", "/robot/stopp", trigger, "{}"), "; did you mean /robot/stop?"),
        (("action", "send", "/countt", "{}"), "; did you mean /count?"),
        (("action", "send", "/countt", "actionlib/Test", "{}"), "; did you mean /count?"),
    ):
        code, _, err = run(*line, "--timeout", "3")
        assert code == 1
        first = err.splitlines()[0]
        assert first.startswith("rosglass: waiting: ")
        assert message in first


def test_unreachable_master_is_reported_at_once(run, start_command):
    url = "ros1://127.0.0.1:1"
    message = "no master runs: 127.0.0.1 is there, but nothing listens on its port 1; "
    code, _, err = run("topic", "list", "--url", url)
    assert (code, message in err) == (1, True)
    assert "roscore -p 1" in err
    process = start_command("topic", "echo", "/pose", "--url", url)
    assert message in process.stderr.readline()
    assert process.poll() is None


def test_service_commands(run):
    code, out, _ = run("service", "list", "-t")
    assert "/robot/stop [std_srvs/Trigger]" in out.splitlines()
    assert "/robot/get_loggers [roscpp/GetLoggers]" in out.splitlines()
    code, out, _ = run("service", "info", "/robot/stop")
    assert out.splitlines() == [
        "/robot/stop [std_srvs/Trigger]",
        "  service server /robot",
        "    md5: 937c9679a518e3a18d831e57125ea522",
    ]
    for given in ([], ["std_srvs/Trigger"], ["std_srvs/srv/Trigger", "{}"]):
        code, out, err = run("service", "call", "/robot/stop", *given, "--json")
        assert (code, err) == (0, "")
        assert json.loads(out) == {"success": True, "message": "stöpped"}
    code, _, err = run("service", "call", "/robot/stopp")
    assert code == 1
    assert "did you mean /robot/stop?" in err
    code, _, err = run("service", "call", "/robot/stop", "std_srvs/SetBool", "{data: true}")
    assert code == 1
    assert err.count("not as std_srvs/SetBool") == 1


def test_action_commands(run, start_command):
    code, out, _ = run("action", "list", "-t")
    assert out == "/count [actionlib/Test]\n"
    code, out, _ = run("action", "info", "/count")
    assert out.splitlines() == ["/count [actionlib/Test]", "  action server /robot"]
    code, out, _ = run("action", "send", "/count", "{goal: 5}", "--feedback", "--json")
    assert code == 0
    *feedback, end = map(json.loads, out.splitlines())
    assert [each["feedback"] for each in feedback] == [{"feedback": n} for n in range(5)]
    assert (end["status"], end["result"]) == ("succeeded", {"result": 5})
    code, out, _ = run("action", "send", "/count", "actionlib/Test", "{goal: -1}")
    assert code == 1
    assert "aborted" in out
    process = start_command("action", "send", "/count", "{goal: 10000}", "--feedback")
    while process.stdout.readline() != "feedback:\n":
        assert process.poll() is None
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=60)
    assert "cancelling the goal" in err
    assert "canceled" in out


def test_node_commands(run):
    code, out, _ = run("node", "list")
    assert "/robot" in out.splitlines()
    assert not any("rosglass" in line for line in out.splitlines())
    code, out, _ = run("node", "info", "/robot")
    assert "    /pose [geometry_msgs/PoseStamped]" in out.splitlines()
    assert "    /cmd_vel [geometry_msgs/Twist]" in out.splitlines()
    assert "    /robot/stop [std_srvs/Trigger]" in out.splitlines()
    code, _, err = run("node", "info", "/robott")
    assert (code, "Did you mean /robot?" in err) == (1, True)


def test_param_commands(run, master, tool, tmp_path):
    assert "/robot/speed" in run("param", "list")[1].splitlines()
    assert run("param", "list", "/robot") == (0, "/robot/speed\n", "")
    for given in (["/robot/speed"], ["/robot", "speed"], ["robot/speed"]):
        assert run("param", "get", *given) == (0, "1.5\n", "")
    assert run("param", "set", "/arm/limits", "{low: -1, high: [2.5, 3.0], name: grün}")[0] == 0
    assert run("param", "set", "/arm", "on", "true")[0] == 0
    assert master.call("getParam", "/arm/limits/high") == [2.5, 3.0]
    assert tool("rosparam", "get", "/arm/limits/low") == "-1\n"
    assert master.call("getParam", "/arm/on") is True
    file = tmp_path / "arm.yaml"
    assert run("param", "dump", "/arm", "-o", str(file)) == (0, "", "")
    assert run("param", "delete", "/arm") == (0, "/arm is deleted\n", "")
    assert run("param", "delete", "/arm")[0] == 1
    tool("rosparam", "load", str(file), "/left")
    assert run("param", "load", str(file), "/right")[0] == 0
    assert master.call("getParam", "/left") == master.call("getParam", "/right")
    code, out, err = run("param", "list", "/robott")
    assert (code, out) == (1, "")
    assert "parameter /robott is not set" in err
    assert "did you mean /robot?" in err
    assert run("param", "list", "/robot/speed") == (0, "/robot/speed\n", "")
    code, _, err = run("param", "get", "/robot/sped")
    assert (code, "did you mean /robot/speed?" in err) == (1, True)
    code, _, err = run("param", "describe", "/robot/speed")
    assert (code, "nothing of a parameter but its value" in err) == (1, True)
    code, _, err = run("param", "describe", "/robot", "speed")
    assert (code, "rosglass param get /robot/speed" in err) == (1, True)
    code, _, err = run("param", "set", "/robot/speed", "[1, 2")
    assert (code, "this is not YAML" in err) == (1, True)


def test_interface_commands(run):
    code, out, _ = run("interface", "show", "std_msgs/Header")
    assert code == 0
    assert out.startswith("# std_msgs/Header, md5 2176decaecbce78abc3b96ef049fabed, from ")
    assert "uint32 seq" in out
    assert "geometry_msgs/Twist" in run("interface", "list", "twist")[1].splitlines()


def test_a_type_that_only_the_robot_has_is_shown(run, connect):
    text = "uint8 LEVEL=3\nVault[] inner\n" + "=" * 80 + "\nMSG: secret_msgs/Vault\nint8 gold\n"
    kind = rosglass.MessageType.from_text("secret_msgs/Bank", text, ros=1)
    connect("bank").create_publisher("/bank", kind)
    code, out, err = run("interface", "show", "secret_msgs/Bank")
    assert (code, err) == (0, "")
    assert f"secret_msgs/Bank, md5 {kind.md5}" in out
    assert "Vault[] inner" in out
    code, _, err = run("interface", "show", "secret_msgs/Nothing")
    assert (code, "no node in the graph uses it" in err) == (1, True)


def test_doctor_finds_nothing_wrong(run, master):
    code, out, _ = run("doctor")
    assert code == 0
    assert f"a master answers at {master.uri}" in out
    assert "the master reaches this machine under it" in out
    assert "nodes: all can be reached" in out
    assert master.call("getParamNames") == [
        name for name in master.call("getParamNames") if "was_here" not in name
    ]


def test_doctor_finds_what_is_wrong(run, master, monkeypatch):
    far = "http://turtlebot.invalid:4567/"
    master.call("registerPublisher", "/far", "std_msgs/String", far)
    master.call("setParam", "/use_sim_time", True)
    try:
        code, out, _ = run("doctor")
        assert code == 1
        assert "/test can be reached under the name turtlebot.invalid only" in out
        assert "/use_sim_time is true, but /clock has no publisher" in out
    finally:
        master.call("deleteParam", "/use_sim_time")
        master.call("unregisterPublisher", "/far", far)
    gone = "http://127.0.0.1:9/"
    master.call("registerPublisher", "/gone", "std_msgs/String", gone)
    try:
        code, out, _ = run("doctor")
        assert code == 0
        assert "/test no longer run" in out
        assert "rosglass node cleanup" in out
    finally:
        master.call("unregisterPublisher", "/gone", gone)
    # An address that exists nowhere near.
    monkeypatch.setenv("ROS_IP", "192.0.2.77")
    code, out, _ = run("doctor")
    assert code == 1
    assert "ROS_IP=192.0.2.77 is not an address of this machine" in out
    assert "the master cannot reach this machine at 192.0.2.77" in out


@pytest.mark.parametrize(
    ("uri", "message"),
    [
        ("http://127.0.0.1:1", "no master runs: 127.0.0.1 is there"),
        ("http://robot.invalid:11311", "no computer is called robot.invalid"),
        ("http://127.0.0.1", "ROS_MASTER_URI"),
    ],
)
def test_doctor_explains_a_missing_master(run, monkeypatch, uri, message):
    monkeypatch.setenv("ROS_MASTER_URI", uri)
    code, out, _ = run("doctor", "--timeout", "1")
    assert code == 1
    assert message in out


def test_record_and_play_commands(run, robot, start_command, tmp_path, tool, master):
    bag = tmp_path / "drive.bag"
    process = start_command("record", "/map", "/pose", "-o", str(bag), "-d", "2")
    out, err = process.communicate(timeout=60)
    assert process.returncode == 0, err
    assert "1 /map" in out
    assert "/pose" in tool("rosbag", "info", str(bag))
    assert "1 /map [nav_msgs/OccupancyGrid]" in run("play", "--list", str(bag))[1]
    process = start_command("play", str(bag), "-m", "/map:=/replayed", "-t", "/map", "-d", "3",
                            "--clock")  # fmt: skip
    width = tool("rostopic", "echo", "-n1", "/replayed/info/width")
    assert width.endswith("500\n---\n")
    out, err = process.communicate(timeout=60)
    assert process.returncode == 0, err
    assert "1 messages sent" in out


# -- without a URL ---------------------------------------------------------------------------------

#: In a network of its own, with nothing of ROS 2: others' commands must not find this master.
NEARBY = """
import os, subprocess, sys, time, xmlrpc.client
import rosglass
from rosglass.cli import main
from rosglass.comm import QoS

home = {"HOME": sys.argv[1], "ROS_HOME": sys.argv[1], "PATH": "/usr/bin:/bin"}
command = ["/usr/bin/rosmaster", "--core", "-p", "11311"]
master = subprocess.Popen(command, env=home, stdout=subprocess.DEVNULL)
try:
    with xmlrpc.client.ServerProxy("http://127.0.0.1:11311") as server:
        for _ in range(600):
            try:
                server.setParam("/test", "/speed", 1.5)
                break
            except OSError:
                assert master.poll() is None
                time.sleep(0.1)
    with rosglass.connect("ros1://127.0.0.1:11311?ip=127.0.0.1", "robot") as node:
        node.create_publisher("/nearby", "std_msgs/String", QoS.latched()).publish(data="hello")
        node.create_service_server("/stop", "std_srvs/Trigger", lambda request: {"success": True})
        os.environ["ROS_IP"] = "127.0.0.1"
        for line in ("topic list", "topic echo --once /nearby", "node list", "service list",
                     "service call /stop std_srvs/Trigger", "param get /speed"):
            print(f"-- {line}", flush=True)
            assert main(line.split()) == 0, line
finally:
    master.kill()
    master.wait()
"""


def test_the_master_of_this_machine_is_used(master, tmp_path, monkeypatch):
    for name in ("ROSGLASS_URL", "RMW_IMPLEMENTATION", "ROS_DISTRO", "ROS_DOMAIN_ID", "ROS_IP",
                 "ROS_MASTER_URI", "CYCLONEDDS_URI", "ZENOH_SESSION_CONFIG_URI"):  # fmt: skip
        monkeypatch.delenv(name, raising=False)
    private = Path(__file__).parents[3] / "scripts/private_network.sh"
    done = subprocess.run(
        [str(private), sys.executable, "-c", NEARBY, str(tmp_path)],
        check=False,
        capture_output=True,
        text=True,
        timeout=100,
    )
    assert done.returncode == 0, done.stderr
    shown = dict(part.split("\n", 1) for part in done.stdout.split("-- ")[1:])
    assert "/nearby" in shown["topic list"].splitlines()
    assert "hello" in shown["topic echo --once /nearby"]
    assert "/robot" in shown["node list"].splitlines()
    assert "/stop" in shown["service list"].splitlines()
    assert "success: true" in shown["service call /stop std_srvs/Trigger"].lower()
    assert shown["param get /speed"] == "1.5\n"
    said = "rosglass: no URL is given: using ros1://127.0.0.1:11311 (export"
    assert done.stderr.count(said) == len(shown)
