"""Parameters of other nodes: another rosglass program's over Zenoh and DDS, and dora-rs's."""

from __future__ import annotations

import contextlib
import json
import os
import threading
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from waiting import eventually

import rosglass
from rosglass.comm import ParameterType, Range
from rosglass.errors import ConnectionLostError, Error, ServiceError
from rosglass.ros2.parameter_files import read

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from rosglass.comm import Node

PEERS = Path(__file__).parent / "peers"
SPEED, NAMES = "speed", "names"


@pytest.fixture(params=["zenoh", "dds"])
def join(request: pytest.FixtureRequest) -> Callable[[str], Node]:
    """Connect a node, over the one middleware or the other."""
    fixture = "connect" if request.param == "zenoh" else "dds_connect"
    return request.getfixturevalue(fixture)  # type: ignore[no-any-return]


@pytest.fixture
def start_robot(start: Any) -> Iterator[Any]:
    """Start the program that has parameters; ended with the test, as its name is the same."""
    started: list[Any] = []

    def start_robot(url: str, *arguments: str) -> Any:
        plan = {"url": url, "arguments": arguments}
        process = start(str(PEERS / "rcl_services_peer.py"), json.dumps(plan))
        started.append(process)
        process.event("ready")
        return process

    yield start_robot
    for process in started:
        process.end()


def test_another_programs_parameters(join: Any, start_robot: Any) -> None:
    node = join("cockpit")
    robot = start_robot(node.url, "-p", "speed:=2.0", "-r", "chatter:=talk")
    client = node.create_parameter_client("/arm/robot")
    events: list[Any] = []
    client.watch(events.append)
    assert client.wait_for_server(30)
    assert client.names(["limits"]) == ["limits.low"]
    values = client.get()
    assert values == {
        "blob": b"\x00\x01\xff",
        "limits.low": -(2**62),
        "names": ["left", "right"],
        "serial": "abc",
        "slow": 0,
        "speed": 2.0,
        "start_type_description_service": True,
        "use_sim_time": False,
    }
    described = client.describe([SPEED])[SPEED]
    assert (described.type, described.range) == (ParameterType.DOUBLE, Range(0.0, 5.0, 0.0))
    assert described.description == "m/s"
    results = client.set({SPEED: 3.5, NAMES: [], "serial": "x"})
    assert [result.successful for result in results.values()] == [True, True, False]
    assert client.set_atomically({SPEED: 4.0, NAMES: ["a"]}).successful
    refused = client.set_atomically({NAMES: ["b"], SPEED: 9.0})
    assert refused == (False, "parameter 'speed': 9.0 is outside 0.0 to 5.0")
    robot.ask(read=True)
    assert robot.event("speed") == 4.0
    robot.ask(set={SPEED: 0.5})
    eventually(lambda: [e for e in events if e.changed == {SPEED: 0.5}])
    changed = [event.changed for event in events if event.changed]
    assert changed == [
        {SPEED: 3.5},
        {NAMES: []},
        {SPEED: 4.0, NAMES: ["a"]},
        {SPEED: 0.5},
    ]


def test_a_program_killed_while_it_is_asked(join: Any, start_robot: Any) -> None:
    node = join("cockpit")
    robot = start_robot(node.url)
    client = node.create_parameter_client("/arm/robot")
    assert client.wait_for_server(30)
    errors: list[Error] = []

    def set_slow() -> None:
        try:
            client.set({"slow": 1}, timeout=2)
        except Error as error:
            errors.append(error)

    thread = threading.Thread(target=set_slow)
    thread.start()
    robot.event("setting")
    robot.end()
    thread.join(10)
    assert errors
    assert isinstance(errors[0], (ConnectionLostError, ServiceError, rosglass.TimeoutError))
    start_robot(node.url)

    def answer() -> dict[str, Any]:
        # Over DDS the dead one is missed only seconds later: until its successor is linked, too,
        # it is the dead one that is asked.
        with contextlib.suppress(rosglass.TimeoutError):
            return client.get([SPEED], timeout=1)
        return {}

    assert eventually(answer) == {SPEED: 1.0}


def test_doras_parameters(start: Any, dds_connect: Any, dds_domain: int, interfaces: Path) -> None:
    pytest.importorskip("dora", reason='needs pip install "rosglass[peers]"')
    given = {"speed": 1.5, "count": 3, "name": "x", "on": True, "names": ["a", "b"], "ints": [1]}
    plan = {"domain": dds_domain, "interfaces": str(interfaces), "parameters": given}
    env = os.environ | {"ROS_DOMAIN_ID": str(dds_domain), "AMENT_PREFIX_PATH": str(interfaces)}
    dora = start(str(PEERS / "dora_parameters_peer.py"), json.dumps(plan), env=env)
    dora.event("ready")
    node = dds_connect("cockpit")
    client = node.create_parameter_client("/dora/dora_node")
    events: list[Any] = []
    client.watch(events.append)
    assert client.wait_for_server(30)
    assert client.names() == sorted([*given, "use_sim_time"])
    assert client.names(["na"]) == ["name", "names"]  # dora takes beginnings for prefixes
    assert client.get(list(given)) == given
    assert client.get(["speed", "nix"]) == {"speed": 1.5, "nix": None}
    assert {n: d.type.name for n, d in client.describe(["on", "count", "ints"]).items()} == {
        "on": "BOOL",
        "count": "INTEGER",
        "ints": "INTEGER_ARRAY",
    }
    results = client.set({"speed": 2.5, "names": [], "count": "x", "nix": 1})
    assert [result.successful for result in results.values()] == [True, True, False, False]
    assert "type-stable" in results["count"].reason
    dora.ask(get="speed")
    assert dora.event("value") == 2.5
    # dora does not implement it, and says so in a list, which is not a response of that service.
    with pytest.raises(ServiceError, match="SetParametersAtomically_Response"):
        client.set_atomically({"speed": 3.5})
    dora.ask(set=["speed", 9.5])
    eventually(lambda: [event for event in events if event.changed == {"speed": 9.5}])
    assert {event.node for event in events} == {"/dora/dora_node"}


def test_a_parameter_file_with_a_list_of_mappings_starts_nodes(
    start_rclpy: Any, tmp_path: Path
) -> None:
    """rclpy reads names and values out of the list that are not in it; the rest is ours, too."""
    file = tmp_path / "arm.yaml"
    file.write_text(
        "arm:\n  ros__parameters:\n    speed: 1.5\n"
        "    sensors: [{name: a, ranges: [1, 2]}, {name: b, ranges: [3]}]\n    names: [u, v]\n"
    )
    theirs = json.loads(start_rclpy("rclpy_parameters", str(file)).stdout.readline())
    ours = read(file).for_node("/arm")
    assert ours == {"speed": 1.5, "names": ["u", "v"]}
    assert {name: value for name, value in theirs.items() if "sensors" not in name} == ours
    assert any(name.startswith("sensors") for name in theirs)
