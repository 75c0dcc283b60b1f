"""Measure many topics over Zenoh at once, against the bare zenoh package, in one run.

    python benchmarks/many_topics.py [--quick] [--case WORD] [--json FILE]

Publishers (one process, a Zenoh session for each robot), subscriber and router are three processes
on the loopback interface. "bare" reads the bytes and the time of sending of each message in a
callback of the package zenoh, on its receiving thread; "rosglass" reads one field of each decoded
message in a callback on the node's dispatcher; "native" is bare zenoh whose messages never reach
Python: Zenoh's own share.

The time of 400 subscriptions lasts from the first call until all of them have received a message;
the robots publish on their topics all the time. "bare" declares the same subscribers and tokens.
The ways run in turns, and the median counts. Exits 1 when a target is missed.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parent))
import zenoh_peers as peers
from publishing import finish

POSE = "geometry_msgs/msg/PoseStamped"
#: Seconds before the CPU is measured: a reader chooses its way of receiving once a second.
_SETTLE = 3.0
#: Longest wait in seconds for subscriptions to receive their first message.
_LONG = 60.0


@dataclass(frozen=True)
class Case:
    """A number of robots and topics.

    Attributes:
        name: Of the case.
        robots: Sessions that publish.
        topics: Topics of each robot.
        hz: Messages per second on each topic.
        measures: ``cpu``, as a share of a core; ``message``, the CPU time of a message in
            microseconds; or ``start``, the seconds until all subscriptions receive.
        target: Largest figure.
        ways: Of receiving.
    """

    name: str
    robots: int
    topics: int
    hz: float
    measures: str
    target: float
    ways: tuple[str, ...] = ("native", "bare", "rosglass")


CASES = (
    Case("20 topics at 1 kHz of 20 robots", 20, 1, 1000, "cpu", 0.30),
    Case("20 topics at 1 kHz of 2 robots", 2, 10, 1000, "cpu", 0.30),
    Case("4 topics at 10 Hz of 100 robots", 100, 4, 10, "message", 60.0),
    Case("400 subscriptions beside 100 robots", 100, 4, 10, "start", 1.0, ("bare", "rosglass")),
)
_UNITS = {"cpu": ("% of a core", 100.0), "message": ("us a message", 1.0), "start": ("s", 1.0)}


def topic(robot: int, number: int) -> str:
    return f"/robot{robot}/t{number}"


def key(name: str) -> str:
    import rosglass
    from rosglass.wires.zenoh.keys import topic_key

    return topic_key(0, name, POSE, rosglass.load(POSE).rihs01)


def names(plan: dict[str, Any]) -> list[str]:
    return [topic(r, n) for r in range(plan["robots"]) for n in range(plan["topics"])]


def publisher(plan: dict[str, Any]) -> None:
    """Publish with a session for each robot, until killed or left behind."""
    import struct

    import rosglass
    from rosglass.wires.zenoh.keys import gid_of

    data = rosglass.load(POSE).encode({"header": {"frame_id": "map"}})
    made = []
    for robot in range(plan["robots"]):
        session = peers.session(plan | {"mode": "peer"})
        for number in range(plan["topics"]):
            name = topic(robot, number)
            token = _token(session, name, number, f"robot{robot}", publishes=True)
            made.append((session.declare_publisher(key(name)), gid_of(token)))
            peers.keep(session, session.liveliness().declare_token(token))
    print("ready", flush=True)
    sequence, due, pause, parent = 0, time.monotonic(), 1 / plan["hz"], os.getppid()
    # Spread over the period, as robots are, in steps that a sleep can keep.
    steps = max(1, min(len(made), round(pause / 0.001)))
    while os.getppid() == parent:
        sequence += 1
        for step in range(steps):
            for sender, gid in made[step::steps]:
                note = struct.pack("<qqB16s", sequence, time.time_ns(), 16, gid)
                sender.put(data, attachment=note)
            due += pause / steps
            time.sleep(max(0.0, due - time.monotonic()))


def _token(session: Any, name: str, number: int, node: str, *, publishes: bool) -> str:
    import rosglass
    from rosglass.comm import EndpointInfo, EndpointKind, NodeName
    from rosglass.wires.zenoh.keys import Token

    kind = EndpointKind.PUBLISHER if publishes else EndpointKind.SUBSCRIPTION
    own = NodeName("/", node)
    endpoint = EndpointInfo(kind, name, POSE, own, rosglass.QoS(), rosglass.load(POSE).rihs01)
    return Token(0, str(session.info.zid()), "0", str(number), own, endpoint).key()


def subscriber(plan: dict[str, Any]) -> None:
    """Subscribe to all topics, and print what was measured."""
    counts = dict.fromkeys(names(plan), 0)
    began = time.monotonic()
    if plan["way"] == "rosglass":
        node = _connect(plan)
        began = time.monotonic()
        _subscribe(node, counts)
    else:
        session = peers.session(plan)
        _await_links(session, plan)
        began = time.monotonic()
        _declare(session, plan, counts)
    figures: dict[str, float] = {"made": time.monotonic() - began}
    if plan["measures"] == "start":
        while not all(counts.values()) and time.monotonic() < began + _LONG:
            time.sleep(0.005)
        figures["start"] = time.monotonic() - began
    else:
        time.sleep(_SETTLE)
        received, cpu, start = sum(counts.values()), time.process_time(), time.monotonic()
        time.sleep(plan["seconds"])
        span, used = time.monotonic() - start, time.process_time() - cpu
        messages = span * plan["hz"] * len(counts)
        if plan["way"] != "native":
            figures["received"] = (sum(counts.values()) - received) / messages
            messages *= figures["received"]
        figures |= {"cpu": used / span, "message": used / messages * 1e6}
    print(json.dumps(figures), flush=True)


def _connect(plan: dict[str, Any]) -> Any:
    import rosglass

    url = f"zenoh://127.0.0.1:{plan['port']}?domain=0&mode={plan['mode']}"
    node = rosglass.connect(url, "screen")
    wanted = plan["robots"] * plan["topics"]
    while len(node.topics()) < wanted:
        time.sleep(0.05)
    _await_links(node._core.middleware._session, plan)
    return node


def _await_links(session: Any, plan: dict[str, Any]) -> None:
    """Wait until a peer is linked with all robots: that is Zenoh's time, not the subscriptions'."""
    end = time.monotonic() + _LONG
    while plan["mode"] == "peer" and len(session.info.peers_zid()) < plan["robots"]:
        if time.monotonic() > end:
            raise RuntimeError(
                f"linked with {len(session.info.peers_zid())} robots after {_LONG} s"
            )
        time.sleep(0.1)
    time.sleep(1.0)


def _subscribe(node: Any, counts: dict[str, int]) -> None:
    def callback(name: str) -> Any:
        def receive(message: Any) -> None:
            _ = message.pose.position.x
            counts[name] += 1

        return receive

    for name in counts:
        node.create_subscription(name, POSE, callback(name))


def _declare(session: Any, plan: dict[str, Any], counts: dict[str, int]) -> None:
    import struct

    import zenoh

    def callback(name: str) -> Any:
        def receive(sample: Any) -> None:
            sample.payload.to_bytes()
            struct.unpack_from("<q", sample.attachment.to_bytes(), 8)
            counts[name] += 1

        return zenoh.handlers.Callback(receive, indirect=False)

    native = plan["way"] == "native"
    for number, name in enumerate(counts):
        handler = zenoh.handlers.RingChannel(1) if native else callback(name)
        token = _token(session, name, number, "screen", publishes=False)
        peers.keep(
            session.declare_subscriber(key(name), handler),
            session.liveliness().declare_token(token),
        )


def measure(plan: dict[str, Any]) -> dict[str, Any]:
    """Run one way of a case; returns the subscriber's figures."""
    processes = []
    try:
        for role in ("publisher", "subscriber"):
            command = [sys.executable, "-W", "ignore", __file__, "--role", role]
            process = subprocess.Popen(
                [*command, "--plan", json.dumps(plan)], stdout=subprocess.PIPE, text=True
            )
            processes.append(process)
            assert process.stdout is not None
            line = process.stdout.readline()
            if not line:
                raise RuntimeError(f"the {role} ended with {process.wait()}")
        figures: dict[str, Any] = json.loads(line)
    finally:
        for process in processes:
            process.kill()
            process.wait()
    return figures


def judge(case: Case, found: dict[str, list[dict[str, Any]]]) -> list[str]:
    """Print what was found of a case; returns the targets missed."""
    unit, factor = _UNITS[case.measures]
    median = {
        way: statistics.median(figures[case.measures] for figures in runs)
        for way, runs in found.items()
    }
    print(case.name)
    for way, figure in median.items():
        line = f"  {way:9} {figure * factor:8.2f} {unit}  x{figure / median['bare']:.2f}"
        received = [run["received"] for run in found[way] if "received" in run]
        if received:
            line += f"  received {min(received):.1%}"
        if case.measures == "start":
            line += (
                f"  of which {statistics.median(run['made'] for run in found[way]):.2f} s to make"
            )
        print(line, flush=True)
    if median["rosglass"] <= case.target:
        return []
    return [
        f"{case.name}: {median['rosglass'] * factor:.2f}, at most {case.target * factor:g} {unit}"
    ]


def main() -> int:
    from rosglass.wires.zenoh.router import Router

    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--quick", action="store_true", help="one short turn instead of three")
    parser.add_argument("--case", default="", help="only cases with this word in their names")
    parser.add_argument("--mode", choices=["peer", "client"], default="peer", help="of subscribers")
    parser.add_argument("--json", type=Path, help="write the figures to this file")
    parser.add_argument("--role", choices=["subscriber", "publisher"], help=argparse.SUPPRESS)
    parser.add_argument("--plan", type=json.loads, help=argparse.SUPPRESS)
    args = parser.parse_args()
    if args.role:
        (subscriber if args.role == "subscriber" else publisher)(args.plan)
        return 0
    results: dict[str, Any] = {}
    missed: list[str] = []
    for case in CASES:
        if args.case not in case.name:
            continue
        found: dict[str, list[dict[str, Any]]] = {way: [] for way in case.ways}
        for _ in range(1 if args.quick else 3):
            for way in case.ways:
                with Router("tcp/127.0.0.1:0") as router:
                    plan = {name: getattr(case, name) for name in ("robots", "topics", "hz")}
                    plan |= {"way": way, "measures": case.measures, "shm": False}
                    plan |= {"mode": args.mode, "seconds": 2.0 if args.quick else 4.0}
                    port = int(router.listen.rpartition(":")[2])
                    found[way].append(measure(plan | {"port": port}))
        results[case.name] = found
        missed += judge(case, found)
    return finish(results, missed, args.json)


if __name__ == "__main__":
    sys.exit(main())
