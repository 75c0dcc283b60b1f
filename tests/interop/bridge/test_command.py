"""``rosglass bridge``, as a user runs it."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from waiting import eventually

STRING = "std_msgs/msg/String"
COMMAND = (sys.executable, "-m", "rosglass.cli", "bridge")


def run(*arguments, status=0):
    done = subprocess.run(
        [*COMMAND, *arguments], capture_output=True, text=True, timeout=60, check=False
    )
    assert done.returncode == status, done.stdout + done.stderr
    return done


def test_it_relays_until_it_is_ended(master, router, connect, start_program):
    one, two = connect("ros1", "cli_one"), connect("ros2", "cli_two")
    talker = one.create_publisher("/cli", STRING)
    listener = two.create_subscription("/cli", STRING)
    command = (*COMMAND, master.url, router.url, "--topic", "/cli->")
    process = start_program(*command, "--statistics", "0.5", env=dict(os.environ))

    def heard():
        talker.publish(data="from ROS 1")
        return listener.wait(0.1)

    assert eventually(heard, timeout=30).message().data == "from ROS 1"
    eventually(lambda: any("1 topic, 0 services" in line for line in process.output))
    process.popen.send_signal(signal.SIGINT)
    assert process.popen.wait(30) == 130
    process.end()
    assert any("/cli -> [std_msgs/String]" in line for line in process.output)


def test_it_lists_what_maps(master, router, connect):
    one, two = connect("ros1", "list_one"), connect("ros2", "list_two")
    one.create_publisher("/list/logs", "rosgraph_msgs/Log")
    two.create_publisher("/list/markers", "visualization_msgs/msg/Marker")
    two.create_service_server("/list/go", "std_srvs/srv/Trigger", lambda _: {})
    eventually(lambda: one.topics().get("/list/logs"))
    urls = (master.url, router.url)
    asked = ("--list", "--topic", "/list/*", "--service", "/list/*")
    found = {one["name"]: one for one in json.loads(run(*urls, *asked, "--json").stdout)}
    assert found["/list/logs"]["other_type"] == "rcl_interfaces/msg/Log"
    assert found["/list/logs"]["direction"] == "->"
    assert "mesh_file" in found["/list/markers"]["notes"][0]
    assert found["/list/go"]["kind"] == "service"
    text = run(*urls, *asked).stdout
    assert "left out: header.frame_id, topics" in text


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((), "nothing is to be relayed"),
        (("--all", "--topic", "/a"), "exclude each other"),
        (("--topic", "/a b"), "is not the name of a topic"),
        (("--topic", "/a", "--qos", "best"), "expected one of default"),
        (("--topic", "/a", "--type", "/a:=nowhere_msgs/Thing"), "nowhere_msgs"),
    ],
)
def test_nonsense(arguments, message):
    done = run("ros1://127.0.0.1", "zenoh://127.0.0.1", *arguments, status=1)
    assert message in done.stderr


def test_topic_without_publisher_is_reported(master, router, connect, start_program):
    two = connect("ros2", "two")
    two.create_publisher("/odometry", STRING)
    command = (*COMMAND, master.url, router.url, "--topic", "/odometri")
    process = start_program(*command, env=dict(os.environ))
    message = "/odometri ->: no publisher; did you mean /odometry?"
    eventually(lambda: any(message in line for line in process.output))
    two.create_publisher("/odometri", STRING)
    eventually(lambda: any("/odometri ->: well again" in line for line in process.output))


def test_bridge_without_master_times_out(router, free_port):
    url = f"ros1://127.0.0.1:{free_port}"
    done = run(url, router.url, "--all", "--timeout", "1", status=1)
    assert url in done.stderr


def test_the_documented_program(master, router):
    page = (Path(__file__).parents[3] / "docs" / "bridge.md").read_text(encoding="utf-8")
    (code,) = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    code = code.replace("ros1://robot:11311", master.url)
    code = code.replace("zenoh://127.0.0.1:7447", router.url)
    code += "robot.close()\noffice.close()\n"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=False
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("0 topics, 0 services")
