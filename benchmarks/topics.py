"""Measure topics over Zenoh against the bare zenoh package and other ROS 2 clients, in one run.

    python benchmarks/topics.py [--quick] [--case WORD] [--json FILE]

Publisher, subscriber and router are three processes on the loopback interface. "bare" puts and
receives the same bytes on the same key with the package zenoh; "raw" is publish_serialized() and a
raw callback; "message" is publish() of a message and a callback that reads one field, on the node's
dispatcher; "native" is a zenoh subscriber whose samples are never taken: Zenoh's own share.
"dora" and "sdk" are the subscriptions of dora-rs and zenoh-ros2-sdk to our publisher. A latency
starts before the publisher's call and ends when the bytes, or the message, are in the callback's
hands.
The ways run in turns, several times, and the better run of each counts, as other programs disturb.
Exits 1 when a target is missed or something got lost.
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import statistics
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parent))
import zenoh_peers as peers
from publishing import finish, measure, send_for

STRING, IMAGE = "std_msgs/msg/String", "sensor_msgs/msg/Image"
POSE = "geometry_msgs/msg/PoseStamped"
TOPIC = peers.TOPIC
#: Samples left out of latencies at the start of a run.
_FIRST = 5
#: Seconds before a CPU share is measured: a reader chooses its way of receiving once a second.
_SETTLE = 3.0
#: Maximum ratio to bare zenoh of the medians of small samples, and of images.
LATENCY_RATIO, IMAGE_RATIO = 1.3, 1.2
#: Median for an image of 6.2 MB through shared memory, in milliseconds.
SHARED_MS = 3.0
#: At least this part of bare zenoh's rate of small samples.
RATE_RATIO = 0.8
#: Maximum share of a core for 1 kHz of unread PoseStamped ...
UNREAD_CPU = 0.03
#: ... or, where Zenoh alone takes as much already, so much more than that.
UNREAD_EXTRA = 0.02


@dataclass(frozen=True)
class Case:
    """A measurement.

    Attributes:
        name: For people.
        type: Message type.
        hz: Rate of publishing, 0 for as fast as possible.
        ways: How to publish and to receive, of each way.
        size: Width and height of images.
        shm: Whether shared memory is allowed.
        measures: ``latency``, ``rate`` or ``unread``.
    """

    name: str
    type: str
    hz: float
    ways: dict[str, tuple[str, str]]
    size: tuple[int, int] = (0, 0)
    shm: bool = False
    measures: str = "latency"


def _alike(*ways: str) -> dict[str, tuple[str, str]]:
    return {way: (way, way) for way in ways}


FULL_HD = (1920, 1080)
CASES = (
    Case("64 B at 200 Hz", STRING, 200, _alike("bare", "raw")),
    Case("900 KB at 30 Hz", IMAGE, 30, _alike("bare", "raw", "message"), (640, 480)),
    Case("6.2 MB at 30 Hz", IMAGE, 30, _alike("bare", "raw", "message"), FULL_HD),
    Case("6.2 MB at 30 Hz, shm", IMAGE, 30, _alike("bare", "raw", "message"), FULL_HD, True),
    Case(
        "6.2 MB at 10 Hz, to other clients",
        IMAGE,
        10,
        {"message": ("message", "message"), "sdk": ("message", "sdk"), "dora": ("message", "dora")},
        FULL_HD,
    ),
    Case("64 B back to back", STRING, 0, _alike("bare", "raw"), measures="rate"),
    Case(
        "1 kHz of unread PoseStamped",
        POSE,
        1000,
        {"native": ("bare", "native"), "bare": ("bare", "bare"), "ours": ("bare", "unread")},
        measures="unread",
    ),
)  # fmt: skip


def payload(plan: dict[str, Any]) -> bytes:
    import rosglass

    if plan["type"] == STRING:
        return rosglass.load(STRING).encode({"data": "x" * 55})  # 64 bytes in all
    if plan["type"] == POSE:
        return rosglass.load(POSE).encode({"header": {"frame_id": "map"}})
    width, height = plan["size"]
    value = {"height": height, "width": width, "encoding": "rgb8", "step": 3 * width}
    return rosglass.load(IMAGE).encode(value | {"data": bytes(3 * width * height)})


def connect(plan: dict[str, Any], name: str) -> Any:
    import rosglass

    shm = "true" if plan["shm"] else "false"
    return rosglass.connect(f"zenoh://127.0.0.1:{plan['port']}?domain=0&shm={shm}", name)


class Notes:
    """A subscriber's notes: times of reception and of sending, in nanoseconds."""

    def __init__(self) -> None:
        self.got: list[int] = []
        self.sent: list[int] = []

    def __call__(self, sent: int) -> None:
        """Note that a sample came."""
        self.got.append(time.time_ns())
        self.sent.append(sent)

    def figures(self) -> dict[str, Any]:
        """Return what came of it; latencies in milliseconds."""
        count = len(self.got)
        span = (self.got[-1] - self.got[0]) / 1e9 if count > 1 else 0.0
        figures = {"count": count, "rate": (count - 1) / span if span else 0.0}
        pairs = zip(self.got, self.sent, strict=True)
        # The first messages also pay for code that is made once for each type.
        latencies = sorted((got - sent) / 1e6 for got, sent in list(pairs)[_FIRST:])
        if latencies:
            figures["median"] = statistics.median(latencies)
            figures["p99"] = latencies[int(0.99 * len(latencies))]
        return figures


def subscriber(plan: dict[str, Any]) -> None:
    """Receive until standard input closes; print what was measured."""
    notes = Notes()
    subscription: Any = None
    if plan["receive"] in ("bare", "native"):
        subscription = peers.bare_subscriber(plan, notes)
    elif plan["receive"] == "dora":
        subscription = peers.dora_subscriber(plan, notes)
    elif plan["receive"] == "sdk":
        subscription = peers.sdk_subscriber(plan, notes)
    else:
        subscription = own_subscriber(plan, notes)
    print("ready", flush=True)
    sys.stdin.readline()
    if plan["measures"] == "unread":
        time.sleep(_SETTLE)
    before, began = time.process_time(), time.monotonic()
    sys.stdin.readline()
    cpu = (time.process_time() - before) / (time.monotonic() - began)
    figures = notes.figures() | {"cpu": cpu}
    if plan["receive"] == "unread":
        figures["count"] = subscription.statistics().received
    print(json.dumps(figures), flush=True)


def own_subscriber(plan: dict[str, Any], notes: Notes) -> Any:
    import rosglass
    from rosglass.comm import IMMEDIATE

    def raw(sample: Any) -> None:
        notes(sample.sent_ns)

    def message(m: Any) -> None:
        stamp = m.header.stamp
        notes(stamp.sec * 1_000_000_000 + stamp.nanosec)

    arguments: dict[str, dict[str, Any]] = {
        "raw": {"raw_callback": raw, "executor": IMMEDIATE},
        "message": {"callback": message},
        "unread": {},
    }
    qos = rosglass.QoS(depth=100_000 if plan["measures"] == "rate" else 10)
    node = connect(plan, "subscriber")
    return node.create_subscription(TOPIC, plan["type"], qos=qos, **arguments[plan["receive"]])


def publisher(plan: dict[str, Any]) -> None:
    """Publish for a while at the plan's rate."""
    data = payload(plan)
    if plan["publish"] == "bare":
        put = peers.bare_publisher(plan, data)
    else:
        import rosglass
        from rosglass.comm import History

        made = connect(plan, "publisher").create_publisher(
            TOPIC, plan["type"], rosglass.QoS(history=History.KEEP_ALL)
        )
        if plan["publish"] == "raw":

            def put() -> None:
                made.publish_serialized(data)
        else:
            value = made.type.decode(data)
            stamp = value.header.stamp

            def put() -> None:
                stamp.sec, stamp.nanosec = divmod(time.time_ns(), 1_000_000_000)
                made.publish(value)

    time.sleep(0.5)
    send_for(put, plan["seconds"] + (_SETTLE if plan["measures"] == "unread" else 0), plan["hz"])


def best(case: Case, common: dict[str, Any], turns: int) -> dict[str, Any]:
    """Run each way several times, in turns; returns the best run of each."""
    figure, top = {"latency": ("median", False), "rate": ("rate", True), "unread": ("cpu", False)}[
        case.measures
    ]
    found: dict[str, Any] = {}
    for _ in range(turns):
        for way, (publish, receive) in case.ways.items():
            module = {"dora": "dora", "sdk": "zenoh_ros2_sdk"}.get(way)
            if module and importlib.util.find_spec(module) is None:
                continue
            plan = common | {"publish": publish, "receive": receive}
            plan |= {
                name: getattr(case, name) for name in ("type", "hz", "size", "shm", "measures")
            }
            figures = measure(__file__, plan, 0.0 if case.measures == "unread" else 0.5)
            known = found.get(way)
            if known is None or (figures[figure] > known[figure]) is top:
                found[way] = figures
    return found


def judge(case: Case, found: dict[str, Any]) -> list[str]:
    """Print what was found of a case; returns the targets missed."""
    missed: list[str] = []
    print(case.name)
    base = found.get("bare", found.get("message"))
    assert base is not None
    for way, figures in found.items():
        line = f"  {way:8}"
        if case.measures == "latency":
            line += f" median {figures['median']:7.3f} ms  p99 {figures['p99']:7.3f} ms"
            line += f"  x{figures['median'] / base['median']:.2f}"
            line += f"  received {figures['count']}/{figures['sent']}"
            if figures["count"] < figures["sent"] and way not in ("dora", "sdk"):
                missed.append(f"{case.name}, {way}: {figures['sent'] - figures['count']} lost")
        elif case.measures == "rate":
            line += f" {figures['rate']:9.0f}/s  x{figures['rate'] / base['rate']:.2f}"
            line += f"  cpu of subscriber {figures['cpu']:.0%}"
        else:
            line += f" {figures['cpu']:.1%} of a core"
        print(line, flush=True)
    if case.measures == "rate":
        if found["raw"]["rate"] < RATE_RATIO * base["rate"]:
            missed.append(f"{case.name}: less than {RATE_RATIO} of bare zenoh's rate")
    elif case.measures == "unread":
        limit = max(UNREAD_CPU, found["native"]["cpu"] + UNREAD_EXTRA)
        if found["ours"]["cpu"] > limit:
            missed.append(f"{case.name}: {found['ours']['cpu']:.1%}, at most {limit:.1%}")
    elif case.shm:
        if found["raw"]["median"] > SHARED_MS:
            missed.append(f"{case.name}: {found['raw']['median']:.2f} ms, at most {SHARED_MS} ms")
    elif "bare" in found:
        limit = LATENCY_RATIO if case.type == STRING else IMAGE_RATIO
        ratio = found["raw"]["median"] / base["median"]
        if ratio > limit:
            missed.append(f"{case.name}: {ratio:.2f} times bare zenoh's latency, at most {limit}")
    else:
        missed += [
            f"{case.name}: {way} is faster"
            for way, figures in found.items()
            if figures["median"] < base["median"]
        ]
    return missed


def run(cases: list[Case], seconds: float, turns: int) -> tuple[dict[str, Any], list[str]]:
    """Run all cases; returns the figures and the targets missed."""
    from rosglass.wires.zenoh.router import Router

    results: dict[str, Any] = {}
    missed: list[str] = []
    with Router("tcp/127.0.0.1:0") as router:
        common = {"port": int(router.listen.rpartition(":")[2]), "seconds": seconds}
        for case in cases:
            found = results[case.name] = best(case, common, turns)
            missed += judge(case, found)
    return results, missed


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--quick", action="store_true", help="two short turns instead of four")
    parser.add_argument("--case", default="", help="only cases with this word in their names")
    parser.add_argument("--json", type=Path, help="write the figures to this file")
    parser.add_argument("--role", choices=["subscriber", "publisher"], help=argparse.SUPPRESS)
    parser.add_argument("--plan", type=json.loads, help=argparse.SUPPRESS)
    args = parser.parse_args()
    if args.role:
        (subscriber if args.role == "subscriber" else publisher)(args.plan)
        return 0
    cases = [case for case in CASES if args.case in case.name]
    results, missed = run(cases, 2.0 if args.quick else 3.0, 2 if args.quick else 4)
    return finish(results, missed, args.json)


if __name__ == "__main__":
    sys.exit(main())
