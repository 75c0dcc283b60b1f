"""The graph over DDS: others' nodes and endpoints as we see them, and ours as others see them."""

from __future__ import annotations

import importlib.util
import json
import os
import subprocess
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from waiting import eventually, nothing_happens

import rosglass
from rosglass.comm import ConnectionState, Durability, Duration, NodeName, QoS, Reliability

if TYPE_CHECKING:
    from collections.abc import Callable

PEERS = Path(__file__).parent / "peers"
STRING = "std_msgs/msg/String"
HASH = "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"
TALKER, ADDER = NodeName("/cyclone", "talker"), NodeName("/cyclone", "adder")
#: A killed participant is gone after its lease, which is 10 s without this.
SHORT_LEASE = "<Discovery><LeaseDuration>1s</LeaseDuration></Discovery>"
NODES: dict[str, Any] = {
    "topics": {"/chatter": "writer", "/heard": "reader"},
    "service": "/add",
    "hash": HASH,
    "foreign": "Square",
}

pytestmark = pytest.mark.peers


@pytest.fixture
def cyclone(start, dds_domain):
    """Start Cyclone DDS's own Python nodes in the module's domain; ended after the test."""
    started = []

    def cyclone(config: str = "", **plan: Any) -> Any:
        plan["domain"] = dds_domain
        env = os.environ | ({"CYCLONEDDS_URI": config} if config else {})
        process = start(str(PEERS / "cyclone_peer.py"), json.dumps(plan), env=env)
        started.append(process)
        process.event("ready")
        return process

    yield cyclone
    for process in started:
        process.ask(quit=True) if process.popen.poll() is None else None
    for process in started:
        process.popen.wait(30)


def event(process: Any, kind: str, wanted: Callable[[dict[str, Any]], bool]) -> dict[str, Any]:
    """Return the next event of a kind that is wanted."""
    deadline = time.monotonic() + 30
    while time.monotonic() < deadline:
        found = process.event(kind)
        if wanted(found):
            return found
    pytest.fail(f"no {kind} that is wanted")


def gids_of(info: dict[str, Any], name: str) -> dict[str, list[str]]:
    """Return the identities that ros_discovery_info lists for a node, none without the node."""
    named = [node for node in info["nodes"] if f"{node['namespace']}/{node['name']}" == name]
    return named[0] if named else {"readers": [], "writers": []}


def seen_of_cyclone(node: Any) -> set[str]:
    """Return what is left of the peer's topics and services."""
    return {"/chatter", "/heard", "/add"} & {*node.topics(), *node.services()}


@pytest.mark.parametrize("width", [16, 24])
def test_we_see_the_nodes_of_cyclone_dds(cyclone, dds_connect, width):
    node = dds_connect("cockpit")
    cyclone(width=width, **NODES)
    eventually(lambda: node.nodes() == [NodeName("/", "cockpit"), ADDER, TALKER], what=node.nodes())
    eventually(lambda: len(node.endpoints(TALKER)) == 2 and node.endpoints(ADDER))
    topics = node.topics()
    assert "Square" not in "".join(topics)
    assert (topics["/chatter"], topics["/heard"]) == ([STRING], [STRING])
    assert node.services()["/add"] == ["example_interfaces/srv/AddTwoInts"]
    (publisher,) = node.publishers("/chatter")
    assert (publisher.node, publisher.type_hash, len(publisher.gid)) == (TALKER, HASH, 16)
    assert publisher.qos.reliability is Reliability.RELIABLE
    assert publisher.qos.durability is Durability.VOLATILE
    assert publisher.qos.deadline == Duration.from_seconds(0.5)
    assert [end.node for end in node.subscriptions("/heard")] == [TALKER]
    assert [end.node for end in node.service_servers("/add")] == [ADDER]
    assert [end.name for end in node.endpoints("/cyclone/adder")] == ["/add"]


def test_participant_that_leaves_disappears_at_once(cyclone, dds_connect):
    node = dds_connect("cockpit")
    peer = cyclone(**NODES)
    eventually(lambda: node.publishers("/chatter"))
    assert node.status().state is ConnectionState.CONNECTED
    peer.ask(quit=True)
    eventually(lambda: node.status().state is ConnectionState.LOST)
    eventually(lambda: not seen_of_cyclone(node))
    assert node.nodes() == [NodeName("/", "cockpit")]


def test_participant_that_is_killed_disappears_with_its_lease(cyclone, dds_connect):
    node = dds_connect("cockpit")
    peer = cyclone(SHORT_LEASE, **NODES)
    eventually(lambda: node.publishers("/chatter"))
    peer.end()
    eventually(lambda: node.nodes() == [NodeName("/", "cockpit")])
    eventually(lambda: not seen_of_cyclone(node))
    assert node.status().state is ConnectionState.LOST


def test_others_see_our_nodes_by_plain_cyclone_dds(cyclone, dds_connect):
    observer = cyclone(observe=True)
    node = dds_connect("cockpit", namespace="/ours")
    publisher = node.create_publisher("chatter", STRING, QoS.latched())
    subscription = node.create_subscription("/heard", STRING)
    (writer,) = node.publishers("chatter")
    (reader,) = node.subscriptions("/heard")
    ours = {"writer": ("rt/ours/chatter", writer), "reader": ("rt/heard", reader)}
    for kind, (topic, endpoint) in ours.items():
        found = event(observer, kind, lambda found, topic=topic: found["topic"] == topic)
        assert found["type"] == "std_msgs::msg::dds_::String_"
        assert found["guid"] == endpoint.gid.hex()
        assert found["user_data"] == f"typehash={HASH};"
    participant = writer.gid[:12].hex() + "000001c1"
    found = event(observer, "participant", lambda found: found["guid"] == participant)
    assert found["user_data"] == "enclave=/;client=rosglass;"

    def wait_listed(**gids: bool) -> None:
        """Wait until ros_discovery_info lists, or does not list, the identities."""

        def wanted(info: dict[str, Any]) -> bool:
            listed = gids_of(info, "/ours/cockpit")
            there = {"reader": reader.gid.hex() in listed["readers"]}
            there["writer"] = writer.gid.hex() in listed["writers"]
            return info["gid"] == participant and there == gids

        event(observer, "info", wanted)

    wait_listed(reader=True, writer=True)
    publisher.close()
    wait_listed(reader=True, writer=False)
    subscription.close()
    wait_listed(reader=False, writer=False)
    eventually(lambda: not {"/ours/chatter", "/heard"} & set(node.topics()))


@pytest.mark.parametrize("kind", ["writer", "reader"])
def test_our_graph_topic_announces_the_type_hash_that_rclpy_announces(
    cyclone, dds_connect, start_rclpy, kind
):
    """rmw_cyclonedds warns of a ``ros_discovery_info`` without one."""
    start_rclpy("rclpy_peer", "real")
    node = dds_connect("cockpit")
    node.create_publisher("/chatter", STRING)
    ours = node.publishers("/chatter")[0].gid[:12].hex()
    observer = cyclone(observe=True)
    announced: dict[str, str] = {}

    def both(found: dict[str, Any]) -> bool:
        # Fast DDS's GUIDs begin with its number as a vendor.
        for who in (ours, "010f"):
            if found["topic"] == "ros_discovery_info" and found["guid"].startswith(who):
                announced[who] = found["user_data"]
        return len(announced) == 2

    event(observer, kind, both)
    assert announced[ours] == announced["010f"]
    assert announced[ours].startswith("typehash=RIHS01_")


@pytest.mark.parametrize("choice", ["as the others", "distro=humble"])
def test_humble_sees_our_nodes_too(cyclone, dds_connect, choice):
    options = "" if choice == "as the others" else f"&{choice}"
    topics = {"/chatter": "writer"} if choice == "as the others" else {}
    observer = cyclone(width=24, observe=True, topics=topics)
    node = dds_connect("cockpit", options)
    node.create_subscription("/heard", STRING)
    (reader,) = node.subscriptions("/heard")
    gid = reader.gid.hex() + "0" * 16
    event(observer, "info", lambda info: gid in gids_of(info, "//cockpit")["readers"])


def test_the_nodes_of_other_processes_change_without_asking(cyclone, dds_connect):
    node = dds_connect("cockpit")
    seen = []
    node.on_graph_change(lambda: seen.append(node.nodes()))
    cyclone(**NODES)
    eventually(lambda: any(TALKER in nodes for nodes in seen))


def test_rubbish_of_one_peer_is_logged_once_and_does_not_affect_others(
    cyclone, dds_connect, caplog
):
    node = dds_connect("cockpit")
    cyclone(rubbish=True)
    cyclone(**NODES)
    eventually(lambda: len(node.endpoints(TALKER)) == 2)
    eventually(lambda: [line for line in caplog.messages if "ignoring the nodes of" in line])
    nothing_happens(0.2)
    complaints = [line for line in caplog.messages if "ignoring the nodes of" in line]
    assert len(complaints) == 1
    assert "rmw_dds_common/msg/ParticipantEntitiesInfo" in complaints[0]


def test_without_multicast_the_programs_of_this_machine_find_each_other(start, dds_domain):
    # In a domain of its own: a process has one configuration for a domain.
    url = f"dds://?domain={dds_domain % 101 + 1}&range=localhost"
    code = (
        f"import rosglass, time; node = rosglass.connect({url!r}, 'peer'); "
        "print('{\"ready\": true}', flush=True); time.sleep(60)"
    )
    start("-c", code).event("ready")
    with rosglass.connect(url, "cockpit") as node:
        eventually(lambda: NodeName("/", "peer") in node.nodes())


def test_no_node_is_found_with_discovery_off(cyclone, dds_domain):
    cyclone(**NODES)
    # In a process of its own: a process has one configuration for a domain.
    code = (
        "import rosglass, time; "
        f"node = rosglass.connect('dds://?domain={dds_domain}&range=off', 'alone'); "
        "time.sleep(1); print([str(name) for name in node.nodes()], node.status())"
    )
    command = [sys.executable, "-c", code]
    output = subprocess.run(command, check=True, capture_output=True, text=True, timeout=30).stdout
    assert output.startswith("['/alone'] CONNECTING: no other participant in DDS domain")


@pytest.mark.skipif(importlib.util.find_spec("dora") is None, reason="dora-rs is not installed")
def test_we_see_the_node_of_dora(start, interfaces, dds_domain, dds_connect):
    plan = {"domain": dds_domain, "interfaces": str(interfaces)}
    plan |= {"publish": {"/from/string": STRING}, "subscribe": {"/to/string": STRING}}
    env = os.environ | {"ROS_DOMAIN_ID": str(dds_domain), "AMENT_PREFIX_PATH": str(interfaces)}
    start(str(PEERS / "dora_dds_peer.py"), json.dumps(plan), env=env).event("ready")
    node = dds_connect("cockpit")
    dora = NodeName("/dora", "dora_node")
    eventually(lambda: node.nodes() == [NodeName("/", "cockpit"), dora])
    eventually(lambda: [end.node for end in node.publishers("/from/string")] == [dora])
    eventually(lambda: [end.node for end in node.subscriptions("/to/string")] == [dora])
    assert node.topics()["/from/string"] == [STRING]
    eventually(lambda: "/dora/dora_node/get_parameters" in node.services())
    assert node.services()["/dora/dora_node/get_parameters"] == ["rcl_interfaces/srv/GetParameters"]
    assert [end.node for end in node.service_servers("/dora/dora_node/get_parameters")] == [dora]


@pytest.fixture
def fastdds(fastdds_program, start_program, dds_domain):
    """A Fast DDS process with a writer, a reader and a service server, but no ROS nodes."""
    process = start_program(str(fastdds_program), str(dds_domain))
    process.event("ready")
    string = "std_msgs::msg::dds_::String_"
    assert process.popen.stdin is not None
    for line in (
        f"pub one rt/from/fast {string} latched",
        f"sub two rt/to/fast {string} best_effort",
        "server three add example_interfaces::srv::dds_::AddTwoInts",
    ):
        process.popen.stdin.write(line + "\n")
        process.popen.stdin.flush()
        process.event("made")
    yield process
    process.end()


def test_endpoints_of_fast_dds_are_listed_under_their_participant(fastdds, dds_connect):
    node = dds_connect("cockpit")
    eventually(lambda: "/add" in node.services() and "/to/fast" in node.topics())
    eventually(lambda: node.publishers("/from/fast"))
    (publisher,) = node.publishers("/from/fast")
    (subscription,) = node.subscriptions("/to/fast")
    (server,) = node.service_servers("/add")
    assert {publisher.node, subscription.node, server.node} == {publisher.node}
    assert publisher.node == NodeName("/_dds", publisher.gid[:12].hex())
    assert (publisher.type, server.type) == (STRING, "example_interfaces/srv/AddTwoInts")
    assert publisher.qos.durability is Durability.TRANSIENT_LOCAL
    assert subscription.qos.reliability is Reliability.BEST_EFFORT
