"""Measure how long it takes to see a whole robot, and what seeing it costs afterwards.

    scripts/private_network.sh python benchmarks/discovery.py [--nodes 50] [--json FILE]

A robot of 50 nodes, each a DDS participant (or, over Zenoh, a node of one session) with 4 topics
and 6 services, is up in one process. Another one connects, and waits until every topic and service
shows, with the node it belongs to. "ours" is rosglass.connect(); "bare" does the same with the
middleware's own Python package: over DDS the builtin topics and ros_discovery_info read with
cyclonedds, over Zenoh a liveliness subscriber, both without making sense of what they get. Then
nothing happens for 5 s: what a core is busy with then is the cost of keeping up. "live" has the
observer first and starts the robot afterwards; it includes starting the robot.
Exits 1 when a target is missed.
"""

from __future__ import annotations

import argparse
import json
import random
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

STRING = "std_msgs/msg/String"
TOPICS, SERVICES = 4, 6
#: Seconds until everything must have been seen, and the share of a core afterwards.
SECONDS, CPU = 2.0, 0.02
_QUIET = 5.0
_TIMEOUT_S = 60.0


def topic(node: int, number: int) -> str:
    return f"/robot/node_{node}/topic_{number}"


def service(node: int, number: int) -> str:
    return f"/robot/node_{node}/service_{number}"


def struct(type_name: str, **fields: Any) -> Any:
    from cyclonedds.idl import make_idl_struct

    return make_idl_struct(type_name.rpartition("::")[2], type_name, fields)


def info_types() -> tuple[Any, Any, Any]:
    """Return the types of ros_discovery_info: an identity, a node, the nodes of a participant."""
    from cyclonedds.idl.types import array, bounded_str, sequence, uint8

    prefix = "rmw_dds_common::msg::dds_"
    gid = struct(f"{prefix}::Gid_", data=array[uint8, 16])
    node = struct(
        f"{prefix}::NodeEntitiesInfo_",
        node_namespace=bounded_str[256],
        node_name=bounded_str[256],
        reader_gid_seq=sequence[gid],
        writer_gid_seq=sequence[gid],
    )
    name = f"{prefix}::ParticipantEntitiesInfo_"
    return gid, node, struct(name, gid=gid, node_entities_info_seq=sequence[node])


def dds_robot(plan: dict[str, Any]) -> list[Any]:
    """Create the nodes with cyclonedds: 50 of our own would be busy with each other."""
    from cyclonedds.domain import DomainParticipant
    from cyclonedds.idl.types import int64
    from cyclonedds.pub import DataWriter
    from cyclonedds.qos import Policy, Qos
    from cyclonedds.sub import DataReader
    from cyclonedds.topic import Topic
    from cyclonedds.util import duration

    gid, node_info, participant_info = info_types()
    srv = "example_interfaces::srv::dds_::AddTwoInts"
    string = struct("std_msgs::msg::dds_::String_", data=str)
    request = struct(f"{srv}_Request_", a=int64, b=int64)
    response = struct(f"{srv}_Response_", sum=int64)
    plain = Policy.DataRepresentation(use_cdrv0_representation=True)
    qos = Qos(plain, Policy.Reliability.Reliable(duration(seconds=1)))
    latched = Qos(*qos, Policy.Durability.TransientLocal)

    def gid_of(entity: Any) -> Any:
        return gid(list(entity.guid.bytes))

    kept: list[Any] = []
    for node in range(plan["nodes"]):
        participant = DomainParticipant(plan["domain"], Qos(Policy.Userdata(b"enclave=/;")))
        writers, readers = [], []
        for number in range(TOPICS):
            named = Topic(participant, f"rt{topic(node, number)}", string)
            writers.append(DataWriter(participant, named, qos=qos))
        for number in range(SERVICES):
            name = service(node, number)
            named = Topic(participant, f"rq{name}Request", request)
            readers.append(DataReader(participant, named, qos=qos))
            named = Topic(participant, f"rr{name}Reply", response)
            writers.append(DataWriter(participant, named, qos=qos))
        teller = DataWriter(
            participant, Topic(participant, "ros_discovery_info", participant_info), qos=latched
        )
        gids = ([gid_of(reader) for reader in readers], [gid_of(writer) for writer in writers])
        info = node_info("/robot", f"node_{node}", *gids)
        teller.write(participant_info(gid_of(participant), [info]))
        kept += [participant, writers, readers, teller]
    return kept


def zenoh_robot(plan: dict[str, Any]) -> list[Any]:
    import zenoh

    import rosglass
    from rosglass.comm import EndpointInfo, EndpointKind, NodeName
    from rosglass.wires.zenoh.keys import Token
    from rosglass.wires.zenoh.options import ZenohOptions
    from rosglass.wires.zenoh.session import session_config

    config, _ = session_config(ZenohOptions(port=plan["port"]))
    session = zenoh.open(config)
    zid, tokens = str(session.zid()), []
    type_hash = rosglass.load(STRING).rihs01
    for node in range(plan["nodes"]):
        name = NodeName("/robot", f"node_{node}")
        ends: list[EndpointInfo | None] = [None]
        publisher, server = EndpointKind.PUBLISHER, EndpointKind.SERVICE_SERVER
        for number in range(TOPICS):
            end = EndpointInfo(publisher, topic(node, number), STRING, name, type_hash=type_hash)
            ends.append(end)
        for number in range(SERVICES):
            add = "example_interfaces/srv/AddTwoInts"
            ends.append(EndpointInfo(server, service(node, number), add, name))
        for number, end in enumerate(ends):
            key = Token(0, zid, str(node), str(number), name, end).key()
            tokens.append(session.liveliness().declare_token(key))
    return [session, tokens]


def ours(plan: dict[str, Any], seen: threading.Event) -> Any:
    import rosglass

    url = f"dds://?domain={plan['domain']}"
    if plan["world"] == "zenoh":
        url = f"zenoh://127.0.0.1:{plan['port']}?domain=0"
    node = rosglass.connect(url, "observer")
    # Its own threads and definitions come with the first use of a node, not with discovery.

    def look() -> None:
        robots = [name for name in node.nodes() if name.namespace == "/robot"]
        if len(robots) == plan["nodes"]:
            ends = [end for name in robots for end in node.endpoints(name)]
            if len(ends) == plan["nodes"] * (TOPICS + SERVICES):
                seen.set()

    node.on_graph_change(look)
    look()
    return node


def bare_dds(plan: dict[str, Any], seen: threading.Event) -> Any:
    from cyclonedds import builtin, core, domain, sub, topic
    from cyclonedds.qos import Policy, Qos
    from cyclonedds.util import duration

    participant = domain.DomainParticipant(plan["domain"])
    named = topic.Topic(participant, "ros_discovery_info", info_types()[2])
    latched = Qos(
        Policy.Reliability.Reliable(duration(seconds=1)),
        Policy.Durability.TransientLocal,
        Policy.History.KeepAll,
        Policy.DataRepresentation(use_cdrv0_representation=True),
    )
    readers = [
        builtin.BuiltinDataReader(participant, builtin.BuiltinTopicDcpsParticipant),
        builtin.BuiltinDataReader(participant, builtin.BuiltinTopicDcpsPublication),
        builtin.BuiltinDataReader(participant, builtin.BuiltinTopicDcpsSubscription),
        sub.DataReader(participant, named, latched),
    ]
    states = core.SampleState.Any | core.ViewState.Any | core.InstanceState.Any
    waitset = core.WaitSet(participant)
    for reader in readers:
        waitset.attach(core.ReadCondition(reader, states))
    nodes = plan["nodes"]
    wanted = [nodes, nodes * (TOPICS + SERVICES), nodes * SERVICES, nodes]

    def follow() -> None:
        names: list[set[Any]] = [set(), set(), set(), set()]
        while True:
            waitset.wait(duration(seconds=10))
            for reader, found in zip(readers, names, strict=True):
                for sample in reader.take(100):
                    if reader is readers[-1]:
                        found.add(len(found))
                    elif reader is readers[0] or sample.topic_name.startswith(
                        ("rt/", "rq/", "rr/")
                    ):
                        found.add(sample.key)
            if all(len(found) >= number for found, number in zip(names, wanted, strict=True)):
                seen.set()

    threading.Thread(target=follow, daemon=True).start()
    return readers


def bare_zenoh(plan: dict[str, Any], seen: threading.Event) -> Any:
    import zenoh

    from rosglass.wires.zenoh.options import ZenohOptions
    from rosglass.wires.zenoh.session import session_config

    config, _ = session_config(ZenohOptions(port=plan["port"]))
    session = zenoh.open(config)
    tokens: set[str] = set()

    def add(sample: Any) -> None:
        tokens.add(str(sample.key_expr))
        if len(tokens) >= plan["nodes"] * (1 + TOPICS + SERVICES):
            seen.set()

    return [
        session,
        session.liveliness().declare_subscriber("@ros2_lv/0/**", add, history=True),
    ]


ROBOTS = {"dds": dds_robot, "zenoh": zenoh_robot}
OBSERVERS = {("dds", "ours"): ours, ("dds", "bare"): bare_dds}
OBSERVERS |= {("zenoh", "ours"): ours, ("zenoh", "bare"): bare_zenoh}


def robot(plan: dict[str, Any]) -> None:
    kept = ROBOTS[plan["world"]](plan)
    print("ready", flush=True)
    sys.stdin.readline()
    del kept


def observer(plan: dict[str, Any]) -> None:
    """Connect on request; print how long it took to see everything, and the cost afterwards."""
    import rosglass

    rosglass.load(STRING)
    if plan["way"] == "bare":
        __import__({"dds": "cyclonedds.builtin", "zenoh": "zenoh"}[plan["world"]])
    seen = threading.Event()
    print("ready", flush=True)
    sys.stdin.readline()
    began, cpu = time.monotonic(), time.process_time()
    kept = OBSERVERS[plan["world"], plan["way"]](plan, seen)
    complete = seen.wait(_TIMEOUT_S)
    seconds, busy = time.monotonic() - began, time.process_time() - cpu
    time.sleep(0.5)
    before, start = time.process_time(), time.monotonic()
    time.sleep(_QUIET)
    share = (time.process_time() - before) / (time.monotonic() - start)
    figures = {"seconds": seconds if complete else None, "busy": busy, "cpu": share}
    print(json.dumps(figures), flush=True)
    sys.stdin.readline()
    del kept


class Process:
    """One of the two, which wait for a line on standard input."""

    def __init__(self, role: str, plan: dict[str, Any]) -> None:
        command = [sys.executable, "-W", "ignore", __file__, "--role", role]
        self._popen = subprocess.Popen(
            [*command, "--plan", json.dumps(plan)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def read(self, start: str) -> str:
        """Return the next line that begins so."""
        assert self._popen.stdout is not None
        for line in self._popen.stdout:
            if line.startswith(start):
                return line
        raise SystemExit(f"{self._popen.args} ended")

    def go(self) -> None:
        """Let it go on."""
        print(file=self._popen.stdin, flush=True)

    def end(self) -> None:
        """Kill it."""
        self._popen.kill()
        self._popen.wait()


def measure(plan: dict[str, Any]) -> dict[str, Any]:
    first, second = Process("robot", plan), Process("observer", plan)
    try:
        if plan["live"]:
            second.read("ready")
            second.go()
            first.read("ready")
        else:
            first.read("ready")
            second.read("ready")
            second.go()
        return json.loads(second.read("{"))
    finally:
        second.end()
        first.end()


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--role", choices=["robot", "observer"])
    parser.add_argument("--plan")
    parser.add_argument("--nodes", type=int, default=50)
    parser.add_argument("--json", type=Path)
    arguments = parser.parse_args()
    if arguments.role:
        {"robot": robot, "observer": observer}[arguments.role](json.loads(arguments.plan))
        return 0
    from rosglass.wires.zenoh.router import Router

    results = []
    missed = False
    print(f"{arguments.nodes} nodes, {arguments.nodes * TOPICS} topics, 2 processes")
    print(f"{'':18}{'all seen':>10}{'CPU until then':>16}{'CPU afterwards':>16}{'of bare':>10}")
    with Router("tcp/127.0.0.1:0") as router:
        port = int(router.listen.rpartition(":")[2])
        for world in ROBOTS:
            for live in (False, True):
                bare = None
                for way in ("bare",) * (not live) + ("ours",):
                    domain = random.SystemRandom().randint(1, 101)
                    plan = {"world": world, "way": way, "live": live, "nodes": arguments.nodes}
                    plan |= {"domain": domain, "port": port}
                    found = measure(plan)
                    results.append(plan | found)
                    name = f"{world}, {way}" + (", live" if live else "")
                    if found["seconds"] is None:
                        print(f"{name:18}never within {_TIMEOUT_S:.0f} s")
                        missed = True
                        continue
                    ratio = f"{found['seconds'] / bare:9.2f}x" if bare else ""
                    print(
                        f"{name:18}{found['seconds']:8.2f} s{found['busy']:14.2f} s"
                        f"{100 * found['cpu']:14.2f} %{ratio:>10}"
                    )
                    if way == "bare":
                        bare = found["seconds"]
                    elif not live and (found["seconds"] > SECONDS or found["cpu"] > CPU):
                        missed = True
    if arguments.json:
        arguments.json.write_text(json.dumps(results, indent=1))
    print(f"{'missed' if missed else 'met'}: all within {SECONDS:.0f} s, then {100 * CPU:.0f} %")
    return int(missed)


if __name__ == "__main__":
    sys.exit(main())
