"""Measure topics over Zenoh against the bare zenoh package doing the same, in the same run.

    python benchmarks/topics.py [--seconds S] [--json FILE]

Publisher, subscriber and router are three processes on the loopback interface. "bare" puts and
receives the same bytes on the same key; "raw" is publish_serialized() and a raw callback;
"message" is publish() of a message and a callback that reads one field, on the node's dispatcher.
A latency ends when the bytes are in the callback's hands. Every case runs bare and
ours in turns, twice, and takes the better median of each, as other programs disturb.
Exits 1 when a target is missed or something got lost.
"""

from __future__ import annotations

import argparse
import json
import statistics
import struct
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

STRING, IMAGE = "std_msgs/msg/String", "sensor_msgs/msg/Image"
TOPIC = "/bench"
#: Size of a picture's pixels in bytes: 640x480 rgb8.
PIXELS = 640 * 480 * 3
#: Samples left out of latencies at the start of a run.
_FIRST = 5
#: At most so much slower than bare zenoh: ratio of medians, plus a fixed cost in milliseconds.
LATENCY_RATIO, LATENCY_EXTRA_MS = 1.3, 0.1
#: At least this part of bare zenoh's rate of small samples.
RATE_RATIO = 0.3
#: At most this share of one core for 1 kHz of samples that nobody reads, beyond bare zenoh.
UNREAD_CPU = 0.1


def payload(type_name: str) -> bytes:
    import rosglass

    if type_name == STRING:
        # 64 bytes in all; the first of the text hold the time of sending.
        return rosglass.load(STRING).encode({"data": "x" * 55})
    value = {"height": 480, "width": 640, "encoding": "rgb8", "step": 1920, "data": bytes(PIXELS)}
    return rosglass.load(IMAGE).encode(value)


def key(type_name: str) -> str:
    import rosglass
    from rosglass.ros2.zenoh_keys import topic_key

    return topic_key(0, TOPIC, type_name, rosglass.load(type_name).rihs01)


def open_bare(port: int) -> Any:
    import zenoh

    from rosglass.ros2.zenoh_config import session_config
    from rosglass.ros2.zenoh_options import ZenohOptions

    return zenoh.open(session_config(ZenohOptions("127.0.0.1", port))[0])


def subscriber(plan: dict[str, Any]) -> None:
    """Receive until standard input closes; print what was measured."""
    got: list[int] = []
    sent: list[int] = []
    unread = plan["case"] == "unread"
    if plan["how"] == "bare":
        import zenoh

        def receive(sample: Any) -> None:
            data = sample.payload.to_bytes()
            note = sample.attachment.to_bytes()
            if data and not unread:
                got.append(time.time_ns())
                sent.append(struct.unpack_from("<q", note, 8)[0])

        session = open_bare(plan["port"])
        session.declare_subscriber(
            key(plan["type"]), zenoh.handlers.Callback(receive, indirect=False)
        )
    else:
        import rosglass
        from rosglass.comm import IMMEDIATE

        node = rosglass.connect(f"zenoh://127.0.0.1:{plan['port']}?domain=0", "subscriber")
        qos = rosglass.QoS(depth=100_000 if plan["case"] == "rate" else 10)
        arguments: dict[str, Any] = {}
        if plan["how"] == "raw" and not unread:

            def raw(sample: Any) -> None:
                got.append(time.time_ns())
                sent.append(sample.sent_ns)

            arguments = {"raw_callback": raw, "executor": IMMEDIATE}
        elif plan["how"] == "message":

            def message(m: Any) -> None:
                got.append(time.time_ns())
                stamp = m.header.stamp
                sent.append(stamp.sec * 1_000_000_000 + stamp.nanosec)

            arguments = {"callback": message}
        subscription = node.create_subscription(TOPIC, plan["type"], qos=qos, **arguments)
    print("ready", flush=True)
    sys.stdin.readline()
    before, began = time.process_time(), time.monotonic()
    sys.stdin.readline()
    cpu = (time.process_time() - before) / (time.monotonic() - began)
    # The first messages also pay for code that is made once for each type.
    latencies = [(r - s) / 1e6 for r, s in zip(got, sent, strict=True)][_FIRST:]
    count = len(got)
    if unread and plan["how"] != "bare":
        count = subscription.statistics().received
    span = (got[-1] - got[0]) / 1e9 if len(got) > 1 else 0.0
    figures = {"count": count, "cpu": cpu, "rate": (count - 1) / span if span else 0.0}
    if latencies:
        latencies.sort()
        figures["median"] = statistics.median(latencies)
        figures["p99"] = latencies[int(0.99 * len(latencies))]
    print(json.dumps(figures), flush=True)


def publisher(plan: dict[str, Any]) -> None:
    """Publish for a while at the plan's rate."""
    data = payload(plan["type"])
    put: Any
    if plan["how"] == "bare":
        import zenoh

        session = open_bare(plan["port"])
        bare = session.declare_publisher(
            key(plan["type"]), congestion_control=zenoh.CongestionControl.BLOCK
        )
        gid = bytes(16)
        number = iter(range(1, 1 << 40))

        def put() -> None:
            note = struct.pack("<qqB16s", next(number), time.time_ns(), 16, gid)
            bare.put(data, attachment=note)
    else:
        import rosglass
        from rosglass.comm import History

        node = rosglass.connect(f"zenoh://127.0.0.1:{plan['port']}?domain=0", "publisher")
        qos = rosglass.QoS(history=History.KEEP_ALL)
        made = node.create_publisher(TOPIC, plan["type"], qos)
        if plan["how"] == "raw":

            def put() -> None:
                made.publish_serialized(data)
        else:
            value = made.type.decode(data)
            stamp = value.header.stamp

            def put() -> None:
                stamp.sec, stamp.nanosec = divmod(time.time_ns(), 1_000_000_000)
                made.publish(value)

    time.sleep(0.5)
    print("ready", flush=True)
    sys.stdin.readline()
    end = time.monotonic() + plan["seconds"]
    count = 0
    due = time.monotonic()
    while time.monotonic() < end:
        put()
        count += 1
        if plan["hz"]:
            due += 1 / plan["hz"]
            time.sleep(max(0.0, due - time.monotonic()))
    print(json.dumps({"count": count}), flush=True)
    sys.stdin.readline()


def measure(plan: dict[str, Any]) -> dict[str, Any]:
    """Run one case; returns the subscriber's figures with what was `sent`."""
    processes = []
    for role in ("subscriber", "publisher"):
        process = subprocess.Popen(
            [sys.executable, __file__, "--role", role, "--plan", json.dumps(plan)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
        processes.append(process)
    receiving, sending = processes
    assert receiving.stdin is not None
    assert sending.stdin is not None
    assert receiving.stdout is not None
    assert sending.stdout is not None
    for process in processes:
        print(file=process.stdin, flush=True)
    sent = json.loads(sending.stdout.readline())["count"]
    time.sleep(0.5)
    print(file=receiving.stdin, flush=True)
    figures: dict[str, Any] = json.loads(receiving.stdout.readline())
    for process in processes:
        process.kill()
        process.wait()
    return figures | {"sent": sent}


def best(plan: dict[str, Any], ways: tuple[str, ...], figure: str, top: bool) -> dict[str, Any]:
    """Run each way twice, in turns; returns the run with the better `figure` of each."""
    found: dict[str, Any] = {}
    for way in ways * 2:
        figures = measure(plan | {"how": way})
        known = found.get(way)
        if known is None or (figures[figure] > known[figure]) is top:
            found[way] = figures
    return found


def run(seconds: float) -> tuple[dict[str, Any], list[str]]:
    """Run all cases; returns the figures and the targets missed."""
    from rosglass.ros2.router import Router

    results: dict[str, Any] = {}
    missed: list[str] = []
    with Router("tcp/127.0.0.1:0") as router:
        port = int(router.listen.rpartition(":")[2])
        common = {"port": port, "seconds": seconds}
        cases = (
            ("latency of 64 B at 200 Hz", STRING, 200, ("bare", "raw")),
            ("latency of 900 KB at 30 Hz", IMAGE, 30, ("bare", "raw", "message")),
        )
        for name, type_name, hz, ways in cases:
            plan = common | {"case": "latency", "type": type_name, "hz": hz}
            found = results[name] = best(plan, ways, "median", top=False)
            print(f"{name}, one way")
            for way, figures in found.items():
                ratio = figures["median"] / found["bare"]["median"]
                print(
                    f"  {way:8} median {figures['median']:7.3f} ms  p99 {figures['p99']:7.3f} ms"
                    f"  x{ratio:.2f}  received {figures['count']}/{figures['sent']}"
                )
                if figures["count"] != figures["sent"]:
                    missed.append(f"{name}, {way}: {figures['sent'] - figures['count']} lost")
                limit = LATENCY_RATIO * found["bare"]["median"] + LATENCY_EXTRA_MS
                if way == "raw" and figures["median"] > limit:
                    missed.append(f"{name}: {figures['median']:.3f} ms, limit {limit:.3f} ms")
        plan = common | {"case": "rate", "type": STRING, "hz": 0}
        found = results["rate"] = best(plan, ("bare", "raw"), "rate", top=True)
        ratio = found["raw"]["rate"] / found["bare"]["rate"]
        print("64 B back to back")
        for way, figures in found.items():
            print(f"  {way:8} {figures['rate']:9.0f}/s  cpu of subscriber {figures['cpu']:.0%}")
        print(f"  ratio    {ratio:.2f}")
        if ratio < RATE_RATIO:
            missed.append(f"rate: {ratio:.2f} of bare zenoh's, at least {RATE_RATIO}")
        plan = common | {"case": "unread", "type": STRING, "hz": 1000}
        found = results["unread"] = best(plan, ("bare", "raw"), "cpu", top=False)
        print("1 kHz of 64 B that nobody reads, share of one core")
        for way, figures in found.items():
            print(f"  {way:8} {figures['cpu']:.1%}")
        extra = found["raw"]["cpu"] - found["bare"]["cpu"]
        if extra > UNREAD_CPU:
            missed.append(f"unread: {extra:.1%} more than bare zenoh, at most {UNREAD_CPU:.0%}")
    return results, missed


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--seconds", type=float, default=3.0, help="length of each run")
    parser.add_argument("--json", type=Path, help="write the figures to this file")
    parser.add_argument("--role", choices=["subscriber", "publisher"], help=argparse.SUPPRESS)
    parser.add_argument("--plan", type=json.loads, help=argparse.SUPPRESS)
    args = parser.parse_args()
    if args.role:
        (subscriber if args.role == "subscriber" else publisher)(args.plan)
        return 0
    results, missed = run(args.seconds)
    if args.json:
        args.json.write_text(json.dumps(results, indent=2))
    for line in missed:
        print("MISSED", line)
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
