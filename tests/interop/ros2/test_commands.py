"""The commands that look at a robot and talk to it, on real middleware."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import threading
import time
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from ports import free_port

import rosglass
from rosglass.comm import QoS
from rosglass.interfaces import Library

if TYPE_CHECKING:
    from rosglass.comm import Node, ServerGoal

FIBONACCI = "example_interfaces/action/Fibonacci"


BOTH = pytest.mark.parametrize("robot", ["zenoh", "dds"], indirect=True)


@pytest.fixture(scope="module")
def robot(request: pytest.FixtureRequest) -> Any:
    """A node with one of everything; yields it."""
    if getattr(request, "param", "zenoh") == "zenoh":
        url = request.getfixturevalue("router").url
    else:
        url = f"dds://?domain={request.getfixturevalue('dds_domain')}"
    with rosglass.connect(url, "robot", "/lab") as node:
        node.create_publisher("map", "nav_msgs/msg/OccupancyGrid", QoS.latched()).publish(
            info={"width": 500, "height": 2}, data=[7] * 1000
        )
        node.create_publisher("mixed", "std_msgs/msg/String")
        node.create_subscription("mixed", "std_msgs/msg/Bool", lambda _: None)
        node.create_publisher("weak", "std_msgs/msg/String", QoS.sensor_data())
        node.create_subscription("weak", "std_msgs/msg/String", lambda _: None)
        node.create_service_server(
            "add",
            "example_interfaces/srv/AddTwoInts",
            lambda request: {"sum": request.a + request.b},
        )

        def count(goal: ServerGoal) -> dict[str, Any]:
            for number in range(goal.goal.order):
                goal.publish_feedback(sequence=[number])
                if goal.wait_for_cancel(0.02):
                    break
            return {"sequence": list(range(goal.goal.order))}

        node.create_action_server("count", FIBONACCI, count)
        node.parameters.declare("speed", 1.5)
        end = threading.Event()
        chatter = node.create_publisher("chatter", "geometry_msgs/msg/PointStamped")
        plain = node.create_publisher("plain", "std_msgs/msg/Bool")

        def talk() -> None:
            number = 0
            while not end.wait(0.05):
                number += 1
                now = node.now()
                plain.publish(data=True)
                stamp = {"sec": now.nanoseconds // 10**9, "nanosec": now.nanoseconds % 10**9}
                chatter.publish(header={"stamp": stamp}, point={"x": number})

        thread = threading.Thread(target=talk)
        thread.start()
        yield node
        end.set()
        thread.join()


@pytest.fixture
def run(robot: Node, monkeypatch: pytest.MonkeyPatch, run_command: Any) -> Any:
    """Run a command that looks at the robot, in an environment with more in it."""

    def run(*arguments: str, **env: str) -> Any:
        for name, value in ({"ROSGLASS_URL": robot.url} | env).items():
            monkeypatch.setenv(name, value)
        return run_command(*arguments)

    return run


@pytest.fixture
def start_command(robot: Node, start_command_at: Any) -> Any:
    """Start a command as a process of its own."""
    return partial(start_command_at, robot.url)


@BOTH
def test_lists(run: Any) -> None:
    code, out, err = run("topic", "list", "-t")
    assert code == 0, err
    assert "/lab/map [nav_msgs/msg/OccupancyGrid]" in out
    assert "_action" not in out
    assert "/lab/count/_action/status" in run("topic", "list", "--hidden")[1]
    assert run("node", "list")[1].splitlines() == ["/lab/robot"]
    assert "/lab/add" in run("service", "list")[1].splitlines()
    assert json.loads(run("action", "list", "--json")[1]) == [
        {"action": "/lab/count", "types": [FIBONACCI]}
    ]


def test_mismatches_are_shown(run: Any) -> None:
    _, out, _ = run("topic", "info", "/lab/mixed")
    assert "types differ" in out
    _, out, _ = run("topic", "info", "/lab/weak")
    assert "reliability: reliable requested, best effort offered" in out
    found = json.loads(run("topic", "info", "/lab/map", "--json")[1])
    assert found["endpoints"][0]["qos"]["durability"] == "transient_local"
    code, _, err = run("topic", "info", "/lab/mapp", "--timeout", "0.5")
    assert code == 1
    assert "; did you mean /lab/map?" in err


@BOTH
def test_echo_cuts_long_arrays_and_gets_latched_messages(run: Any) -> None:
    code, out, _ = run("topic", "echo", "/lab/map", "--once")
    assert code == 0
    assert "'... 1000 in all'" in out
    assert out.count("7") < 100
    _, out, _ = run("topic", "echo", "/lab/map", "--once", "--full", "--json")
    assert json.loads(out)["data"] == [7] * 1000
    _, out, _ = run("topic", "echo", "/lab/map", "--once", "--csv")
    cells = out.strip().split(",")
    assert cells[-1000:] == ["7"] * 1000
    assert "in all" not in out
    _, out, _ = run("topic", "echo", "/lab/map", "--once", "--csv", "--truncate", "3")
    assert out.strip().endswith(",7,7,7,... 1000 in all")
    _, out, _ = run("topic", "echo", "/lab/chatter", "-f", "point.x", "-n", "2")
    first, second = map(float, out.split())
    assert second == first + 1
    _, out, _ = run("topic", "echo", "/lab/chatter", "--once", "--raw")
    assert out.startswith("00010000")


@pytest.mark.parametrize("what", ["hz", "bw", "delay"])
def test_measurements(run: Any, what: str) -> None:
    code, out, err = run("topic", what, "/lab/chatter", "-d", "1.5", "--json")
    assert code == 0, err
    found = json.loads(out.splitlines()[-1])
    if what == "hz":
        assert 10 < found["rate"] < 30
    elif what == "bw":
        assert 400 < found["bytes_per_second"] < 1600
    else:
        assert 0 <= found["mean"] < 1


@pytest.mark.parametrize("what", ["hz", "bw", "delay"])
def test_measurements_of_a_number_of_messages(run: Any, what: str) -> None:
    code, out, err = run("topic", what, "/lab/chatter", "-n", "5", "--json")
    assert code == 0, err
    found = [json.loads(line) for line in out.splitlines()]
    assert found[-1]["window"] == 5
    assert all(one["window"] <= 5 for one in found)


def test_delay_of_what_has_no_stamp(run: Any) -> None:
    code, _, err = run("topic", "delay", "/lab/plain", "-d", "1")
    assert code == 1
    assert "/lab/plain: its messages have no header.stamp" in err


def test_publishing(run: Any, robot: Node) -> None:
    heard = []
    with robot.create_subscription("/hello", "std_msgs/msg/String", lambda m: heard.append(m.data)):
        code, out, err = run("topic", "pub", "/hello", "{data: hi}", "--once")
        assert code == 0, err
        assert "hi" in out
        assert heard == ["hi"]
        code, _, err = run("topic", "pub", "/hello", "{data: [1]}", "--once")
        assert code == 1
        assert "data: expected" in err
        code, _, err = run("topic", "pub", "/hello", "nonsense", "--once")
        assert code == 1
        assert "YAML such as '{data: ''}'" in err
    code, _, err = run("topic", "pub", "/quiet", "std_msgs/msg/Bool", "--once", "--timeout", "3")
    assert code == 1
    assert err.startswith("rosglass: waiting: /quiet has no subscriber")
    assert "0 of 1 subscriptions" in err


@BOTH
def test_calling(run: Any) -> None:
    code, out, err = run("service", "call", "/lab/add", "{a: 2, b: 3}")
    assert code == 0, err
    assert out.startswith("sum: 5\n")
    kind = "example_interfaces/srv/AddTwoInts"
    _, out, _ = run("service", "call", "/lab/add", kind, "{a: 2}", "--json")
    assert json.loads(out) == {"sum": 2}
    code, _, err = run("service", "call", "/lab/add", "{c: 2}")
    assert code == 1
    assert "c: expected a field" in err
    for given in ([kind], []):
        code, _, err = run("service", "call", "/lab/ad", *given, "{}", "--timeout", "4")
        assert code == 1
        assert err.startswith("rosglass: waiting: no server offers /lab/ad")
        assert "; did you mean /lab/add?" in err.splitlines()[0]


@BOTH
def test_sending_goals(run: Any, start_command: Any) -> None:
    code, out, err = run("action", "send", "/lab/count", "{order: 3}", "--feedback")
    assert code == 0, err
    assert "feedback:\n  sequence: [2]" in out
    assert "result:\n  sequence: [0, 1, 2]" in out
    assert "succeeded" in out
    process = start_command("action", "send_goal", "/lab/count", "{order: 1000}", "--feedback")
    for line in process.stdout:
        if "sequence" in line:
            break
    process.send_signal(signal.SIGINT)
    out, _ = process.communicate(timeout=60)
    assert "canceled" in out
    assert process.returncode == 1


def test_a_type_that_only_the_robot_has_is_fetched(router: Any, start_command_at: Any) -> None:
    """However new the command's node is in the graph: often it did not know the server yet."""
    library = Library()
    library.add_text("moon_msgs/action/Dig", "int32 depth\n---\nint32 found\n---\n")
    library.add_text("moon_msgs/srv/Weigh", "string what\n---\nfloat64 mass\n")
    library.add_text("moon_msgs/msg/Dust", "int32 grains\n")
    with rosglass.connect(router.url, "digger", library=library) as node:
        node.create_action_server("dig", "moon_msgs/action/Dig", lambda goal: {"found": 7})
        node.create_service_server("weigh", "moon_msgs/srv/Weigh", lambda request: {"mass": 2.5})
        node.create_publisher("dust", "moon_msgs/msg/Dust", QoS.latched()).publish(grains=9)
        commands = (
            ("action", "send", "/dig", "moon_msgs/action/Dig", "{depth: 2}"),
            ("service", "call", "/weigh", "moon_msgs/srv/Weigh", "{what: stone}"),
            ("topic", "echo", "/dust", "moon_msgs/msg/Dust", "--once"),
        )
        for command, answer in zip(commands, ("found: 7", "mass: 2.5", "grains: 9"), strict=True):
            for _ in range(3):
                process = start_command_at(router.url, *command)
                out, err = process.communicate(timeout=60)
                assert (process.returncode, answer in out) == (0, True), err


def test_a_type_that_is_only_inside_of_others_is_shown(router: Any, start_command_at: Any) -> None:
    library = Library()
    library.add_text("moon_msgs/msg/Wheel", "float64 turns  # of the wheel\n")
    library.add_text("moon_msgs/msg/Axle", "Wheel[2] wheels\n")
    library.add_text("moon_msgs/srv/Drive", "Axle[] axles\n---\n")
    with rosglass.connect(router.url, "rover", library=library) as node:
        node.create_service_server("drive", "moon_msgs/srv/Drive", lambda request: {})
        shown = {"Wheel": "float64 turns  # of the wheel", "Axle": "Wheel[2] wheels"}
        for name, line in shown.items():
            process = start_command_at(router.url, "interface", "show", f"moon_msgs/msg/{name}")
            out, err = process.communicate(timeout=60)
            assert (process.returncode, line in out) == (0, True), err
        process = start_command_at(
            router.url, "interface", "show", "moon_msgs/msg/Crater", "--timeout", "1"
        )
        _, err = process.communicate(timeout=60)
        assert (process.returncode, "no node in the graph uses it" in err) == (1, True), err


@BOTH
def test_parameters(run: Any, robot: Node, tmp_path: Path) -> None:
    assert "  speed" in run("param", "list", "/lab/robot")[1]
    assert run("param", "get", "/lab/robot", "speed")[1] == "1.5\n"
    file = tmp_path / "robot.yaml"
    assert run("param", "dump", "/lab/robot", "-o", str(file))[0] == 0
    assert run("param", "set", "/lab/robot", "speed", "2.5")[0] == 0
    assert robot.parameters.get("speed") == 2.5
    code, _, err = run("param", "set", "/lab/robot", "speed", "3")
    assert code == 0, err
    assert (robot.parameters.get("speed"), type(robot.parameters.get("speed"))) == (3.0, float)
    assert "speed is declared otherwise: it is set to 3.0" in err
    code, _, err = run("param", "set", "/lab/robot", "speed", "fast")
    assert code == 1
    assert "refuses to set speed" in err
    code, _, err = run("param", "load", "/lab/robot", str(file))
    assert code == 0, err
    assert robot.parameters.get("speed") == 1.5
    code, _, err = run("param", "get", "/lab/robot", "sped")
    assert code == 1
    assert "; did you mean speed?" in err
    code, _, err = run("param", "list", "/lab/robott", "--timeout", "4")
    assert code == 1
    message = "rosglass: waiting: there is no node /lab/robott; did you mean /lab/robot?"
    assert err.splitlines()[0] == message


def test_doctor(run: Any) -> None:
    code, out, err = run("doctor", "--json")
    assert code == 0, out + err
    found = json.loads(out)
    texts = [finding["text"] for finding in found if finding["level"] == "warning"]
    assert any("types differ" in text for text in texts)
    code, out, _ = run("doctor", "--timeout", "0.5", ROSGLASS_URL="zenoh://127.0.0.1:1")
    assert code == 1
    assert "nothing listens on its port 1" in out
    assert "rosglass router --listen tcp/127.0.0.1:1" in out


def test_completion(start_command: Any, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    file = tmp_path / "offered"
    monkeypatch.setenv("_ARGCOMPLETE", "1")
    monkeypatch.setenv("_ARGCOMPLETE_STDOUT_FILENAME", str(file))
    for line, expected in (
        ("rosglass topic ec", "echo"),
        ("rosglass topic echo --once /lab/ma", "/lab/map"),
        ("rosglass interface show geometry_msgs/msg/Twi", "geometry_msgs/msg/Twist"),
        ("rosglass param list /lab/", "/lab/robot"),
    ):
        monkeypatch.setenv("COMP_LINE", line)
        monkeypatch.setenv("COMP_POINT", str(len(line)))
        # Names of the graph are looked for a second at most: a shell waits for them.
        for _ in range(5):
            start_command().wait(30)
            offered = [word.strip() for word in file.read_text().split("\v")]
            if expected in offered:
                break
        assert expected in offered


def test_waiting_says_for_what_and_ctrl_c_ends_it(start_command: Any) -> None:
    process = start_command("topic", "echo", "/lab/nothing")
    assert "it has no publisher" in process.stderr.readline()
    process.send_signal(signal.SIGINT)
    assert process.wait(30) == 130
    assert process.stderr.read() == ""


def test_echo_ends_with_its_reader(start_command: Any) -> None:
    process = start_command("topic", "echo", "/lab/map")
    process.stdout.readline()
    process.stdout.close()
    assert process.wait(30) == 141
    assert process.stderr.read() == ""


def test_a_robot_that_goes_is_missed(start_command: Any, robot: Node) -> None:
    with robot.create_publisher("/brief", "std_msgs/msg/String", QoS.latched()) as publisher:
        publisher.publish(data="here")
        process = start_command("topic", "echo", "/brief")
        assert process.stdout.readline() == "data: here\n"
    assert "/brief: it has no publisher any more" in process.stderr.readline()


def test_a_robot_that_is_not_there(run: Any) -> None:
    code, _, err = run("topic", "list", "--url", "zenoh://127.0.0.1:1", "--timeout", "0.3")
    assert code == 1
    assert "no answer within 0.3 s" in err
    code, _, err = run("topic", "list", "--url", "zenoh://127.0.0.1:1")
    assert (code, "nothing listens on its port 1; start a router" in err) == (1, True)
    began = time.monotonic()
    code, _, err = run("topic", "echo", "/lab/mapp", "--once", "--timeout", "0.3")
    assert code == 1
    assert "/lab/mapp: it has no publisher; did you mean /lab/map?" in err
    assert time.monotonic() - began < 20


def test_as_users_of_ros2_write_it(run: Any) -> None:
    code, out, err = run("topic", "echo", "--once", "/lab/map", "--field", "info", "--full-length")
    assert code == 0, err
    assert "width: 500" in out
    name = "std_msgs/msg/Bool"
    code, out, err = run("topic", "pub", "-1", "-w", "0", "/x", name, "{data: true}")
    assert code == 0, err
    assert out == "1: std_msgs/msg/Bool(data=True)\n"
    _, out, _ = run("topic", "pub", "/x", "-r", "100", name, "-t", "2", "--keep-alive", "0")
    assert out.count("\n") == 2
    _, out, _ = run("topic", "echo", "/lab/map", "--once", "--csv", "--qos-durability", "volatile",
                    "--qos-profile", "latched", "--timeout", "1")  # fmt: skip
    assert out == ""  # what was latched goes to those only who ask for it
    _, out, _ = run("topic", "echo", "/lab/map", "--once", "--csv", "-l", "2")
    assert out.endswith(",7,7,... 1000 in all\n")
    count = int(run("topic", "list", "--count-topics")[1])
    assert count > 5
    assert json.loads(run("topic", "list", "--count-topics", "--json")[1]) == {"count": count}
    assert run("param", "set", "/lab/robot", "speed", "-2.5")[0] == 0


# -- without a URL ---------------------------------------------------------------------------------


@pytest.fixture
def nothing_said(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("ROSGLASS_URL", "RMW_IMPLEMENTATION", "ROS_DISTRO", "ROS_DOMAIN_ID",
                 "ROS_MASTER_URI", "CYCLONEDDS_URI", "ZENOH_SESSION_CONFIG_URI"):  # fmt: skip
        monkeypatch.delenv(name, raising=False)


#: In a network of its own: others' commands must not find this router.
NEARBY = """
import rosglass
from rosglass.cli import main
from rosglass.wires.zenoh.router import Router

with Router("tcp/127.0.0.1:7447"), rosglass.connect("zenoh://127.0.0.1:7447", "robot") as node:
    node.create_publisher("/nearby", "std_msgs/msg/String")
    node.parameters.declare("speed", 1.5)
    assert main(["topic", "list"]) == main(["param", "get", "/robot", "speed"]) == 0
"""


@pytest.mark.usefixtures("nothing_said")
def test_the_router_of_this_machine_is_used() -> None:
    private = Path(__file__).parents[3] / "scripts/private_network.sh"
    done = subprocess.run(
        [str(private), sys.executable, "-c", NEARBY],
        check=True,
        capture_output=True,
        text=True,
        timeout=100,
    )
    assert "/nearby" in done.stdout.splitlines()
    assert done.stdout.endswith("1.5\n")
    expected = "rosglass: no URL is given: using zenoh://127.0.0.1:7447 (export"
    assert done.stderr.count(expected) == 2


@pytest.mark.usefixtures("nothing_said")
def test_invalid_environment_is_not_overruled(
    run_command: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("RMW_IMPLEMENTATION", "rmw_email_cpp")
    code, _, err = run_command("topic", "list")
    assert code == 1
    assert "RMW_IMPLEMENTATION=rmw_email_cpp is not known" in err


def test_a_robot_alone_names_what_it_waits_for(start_command_at: Any) -> None:
    port = free_port()
    url = f"zenoh://127.0.0.1:{port}"
    robot = start_command_at(url, "robot", "--url", url, "--fps", "1")
    line = robot.stderr.readline()
    assert line.startswith(f"rosglass: {url}: 127.0.0.1 is there, but nothing listens on its port")
    assert f"rosglass router --listen tcp/127.0.0.1:{port}" in line
    assert "Waiting for it" in line
