"""Measure round trips of service calls against the bare middlewares' Python packages, in one run.

    python benchmarks/services.py [--quick] [--json FILE]

The server is a process of its own. "bare" asks and answers with the package zenoh (a get, a
queryable) or cyclonedds (a request and a reply topic, with the number of the request in front), in
callbacks of the receiving thread. "ours" is call() and a server whose callback runs on the node's
dispatcher; "ours, at once" runs it in the receiving thread. The caller waits in its main thread in
all cases. "goal" is a whole action with one feedback, until its result. The ways take turns, and
the best turn of each counts, as other programs disturb.
Exits 1 when a ratio is missed.
"""
# Annotations stay objects: cyclonedds makes its types of them.

import argparse
import importlib.util
import json
import os
import random
import statistics
import subprocess
import sys
import threading
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import rosglass
from rosglass.comm import IMMEDIATE

sys.path.insert(0, str(Path(__file__).parent))

ADD, FIBONACCI = "example_interfaces/srv/AddTwoInts", "example_interfaces/action/Fibonacci"
REQUEST = {"a": 1, "b": 2}
#: At most so much slower than the bare middleware.
RATIO = 1.5
#: Calls before a turn is measured, and the pause between calls in seconds.
WARM, PAUSE = 20, 0.001
#: Keeps objects that end when nothing refers to them.
_kept: list[Any] = []


def add(request: Any) -> dict[str, int]:
    return {"sum": request.a + request.b}


def once(goal: Any) -> dict[str, list[int]]:
    goal.publish_feedback(sequence=[1])
    return {"sequence": [1]}


# -- bare Zenoh ----------------------------------------------------------------------------------


def zenoh_session(url: str) -> Any:
    import zenoh_peers

    return zenoh_peers.session({"port": int(url.rpartition(":")[2]), "shm": False})


def zenoh_server(url: str) -> Any:
    import zenoh

    session, data = zenoh_session(url), rosglass.load(ADD).response.encode({"sum": 3})

    def answer(query: Any) -> None:
        query.payload.to_bytes()
        query.reply(query.key_expr, data, attachment=query.attachment.to_bytes())
        query.drop()

    handler = zenoh.handlers.Callback(answer, indirect=False)
    return session, session.declare_queryable("bare", handler, complete=True)


def zenoh_client(url: str) -> Any:
    import zenoh

    session, data = zenoh_session(url), rosglass.load(ADD).request.encode(REQUEST)

    def call() -> None:
        done = threading.Event()

        def take(reply: Any) -> None:
            reply.ok.payload.to_bytes()
            done.set()

        session.get(
            "bare",
            zenoh.handlers.Callback(take, indirect=False),
            target=zenoh.QueryTarget.ALL_COMPLETE,
            consolidation=zenoh.ConsolidationMode.NONE,
            payload=data,
            attachment=bytes(33),
        )
        done.wait()

    return call


# -- bare DDS ------------------------------------------------------------------------------------


def dds_ends(url: str) -> Any:
    """Return a participant's topics of requests and of replies."""
    from cyclonedds.core import Policy, Qos
    from cyclonedds.domain import DomainParticipant
    from cyclonedds.idl import IdlStruct
    from cyclonedds.idl.types import int64, uint64
    from cyclonedds.topic import Topic

    @dataclass
    class Request(IdlStruct, typename="bare::Request"):
        client: uint64
        number: int64
        a: int64
        b: int64

    @dataclass
    class Reply(IdlStruct, typename="bare::Reply"):
        client: uint64
        number: int64
        sum: int64

    qos = Qos(Policy.Reliability.Reliable(10**9), Policy.History.KeepLast(10))
    participant = DomainParticipant(int(url.rpartition("=")[2]))
    topics = Topic(participant, "requests", Request, qos), Topic(participant, "replies", Reply, qos)
    return participant, *topics, Request, Reply, qos


def dds_server(url: str) -> Any:
    from cyclonedds.core import Listener
    from cyclonedds.pub import DataWriter
    from cyclonedds.sub import DataReader

    participant, requests, replies, _, reply, qos = dds_ends(url)
    writer = DataWriter(participant, replies, qos)

    class Answer(Listener):
        def on_data_available(self, reader: Any) -> None:
            for request in reader.take(10):
                writer.write(reply(request.client, request.number, request.a + request.b))

    return participant, writer, DataReader(participant, requests, qos, Answer())


def dds_client(url: str) -> Any:
    from cyclonedds.core import Listener
    from cyclonedds.pub import DataWriter
    from cyclonedds.sub import DataReader

    participant, requests, replies, request, _, qos = dds_ends(url)
    waiting: dict[int, threading.Event] = {}

    class Take(Listener):
        def on_data_available(self, reader: Any) -> None:
            for reply in reader.take(10):
                waiting.pop(reply.number).set()

    reader = DataReader(participant, replies, qos, Take())
    writer = DataWriter(participant, requests, qos)
    _kept.extend((participant, reader))
    numbers = iter(range(1 << 40))
    while not (writer.get_matched_subscriptions() and reader.get_matched_publications()):
        time.sleep(0.01)

    def call() -> None:
        number = next(numbers)
        done = waiting[number] = threading.Event()
        writer.write(request(7, number, 1, 2))
        done.wait()

    return call


# -- the run -------------------------------------------------------------------------------------


def serve(url: str) -> None:
    """Offer everything until standard input closes."""
    node = rosglass.connect(url, "server")  # first: its domain's settings are for both
    kept = [
        {"zenoh": zenoh_server, "dds": dds_server}[url.partition(":")[0]](url),
        node.create_service_server("/ours", ADD, add),
        node.create_service_server("/at_once", ADD, add, executor=IMMEDIATE),
        node.create_action_server("/goal", FIBONACCI, once),
    ]
    print("ready", len(kept), flush=True)
    sys.stdin.read()
    os._exit(0)


def ways(url: str, node: Any) -> dict[str, Any]:
    """Return a function for each way, which takes one round trip."""
    found = {"bare": {"zenoh": zenoh_client, "dds": dds_client}[url.partition(":")[0]](url)}
    for name, service in (("ours", "/ours"), ("ours, at once", "/at_once")):
        client = node.create_service_client(service, ADD)
        assert client.wait_for_server(10), client.problem
        found[name] = lambda c=client: c.call(REQUEST)
    actions = node.create_action_client("/goal", FIBONACCI)
    assert actions.wait_for_server(10), actions.problem
    found["goal"] = lambda: actions.send_goal().result(10)
    return found


def measure(url: str, turns: int, calls: int) -> dict[str, dict[str, float]]:
    """Return the best turn's median and 99th percentile of each way, in microseconds."""
    command = [sys.executable, __file__, "--serve", url]
    figures: dict[str, dict[str, float]] = {}
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as server:
        assert server.stdout is not None
        server.stdout.readline()
        with rosglass.connect(url, "client") as node:
            contenders = ways(url, node)
            for _ in range(turns):
                for name, call in contenders.items():
                    found = turn(call, calls)
                    if name not in figures or found["median"] < figures[name]["median"]:
                        figures[name] = found
        server.kill()
    return figures


def turn(call: Any, calls: int) -> dict[str, float]:
    for _ in range(WARM):
        call()
    taken = []
    for _ in range(calls):
        started = time.perf_counter()
        call()
        taken.append((time.perf_counter() - started) * 1e6)
        time.sleep(PAUSE)
    return {"median": statistics.median(taken), "p99": sorted(taken)[int(0.99 * len(taken))]}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--quick", action="store_true", help="a fifth of the calls")
    parser.add_argument("--json", help="write all figures to this file")
    parser.add_argument("--serve", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.serve:
        serve(options.serve)
    turns, calls = (2, 100) if options.quick else (6, 200)
    domain = random.SystemRandom().randint(1, 101)
    results: dict[str, Any] = {}
    failed = False
    for world, package in (("zenoh", "zenoh"), ("dds", "cyclonedds")):
        if importlib.util.find_spec(package) is None:
            print(f"{world}: {package} is not installed")
            continue
        if world == "zenoh":
            from rosglass.wires.zenoh.router import Router

            with Router("tcp/127.0.0.1:0") as router:
                found = measure(router.url, turns, calls)
        else:
            found = measure(f"dds://?domain={domain}", turns, calls)
        results[world] = found
        print(f"\n{world:16}{'median':>10}{'p99':>10}{'ratio':>8}")
        for name, figures in found.items():
            ratio = figures["median"] / found["bare"]["median"]
            missed = name == "ours" and ratio > RATIO
            failed |= missed
            print(
                f"{name:16}{figures['median']:8.0f}us{figures['p99']:8.0f}us{ratio:8.2f}"
                f"{f'  MISSED: at most {RATIO}' if missed else ''}"
            )
    if options.json:
        Path(options.json).write_text(json.dumps(results, indent=1))
    return failed


if __name__ == "__main__":
    sys.exit(main())
