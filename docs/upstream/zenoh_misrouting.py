"""Samples that arrive on another key after a link was interrupted: eclipse-zenoh alone.

    python zenoh_misrouting.py [CUTS [SECONDS [RUNS]]]

For Linux, as root or with user namespaces. RUNS runs at a time, each in a network namespace of its
own, have a router, three publishing peers of 10 keys each, and a subscribing peer, each in a
process. CUTS times, the loopback interface is down for about SECONDS. A payload begins with the
key that it was published on.
"""

from __future__ import annotations

import itertools
import json
import os
import random
import subprocess
import sys
import time

import zenoh

ROUTER = "tcp/127.0.0.1:7447"
#: Seconds after which the next cut follows.
PAUSE = 12.0


def open_session(mode: str) -> zenoh.Session:
    """Open a session; peers find each other by gossip, as those of rmw_zenoh do."""
    listen = {"router": [ROUTER], "peer": ["tcp/127.0.0.1:0"]}[mode]
    config = zenoh.Config()
    for key, value in {
        "mode": mode,
        "listen/endpoints": listen,
        "connect/endpoints": [] if mode == "router" else [ROUTER],
        "scouting/multicast/enabled": False,
        "scouting/gossip/autoconnect_strategy": {"peer": {"to_peer": "greater-zid"}},
    }.items():
        config.insert_json5(key, json.dumps(value))
    return zenoh.open(config)


def publish(prefix: str) -> None:
    """Publish on 10 keys, on two of them 60 kB."""
    session = open_session("peer")
    keys = [f"demo/{prefix}/{number}/String" for number in range(10)]
    publishers = [(key, session.declare_publisher(key)) for key in keys]
    for turn in itertools.count():
        random.shuffle(publishers)
        for key, publisher in publishers:
            number = int(key.split("/")[2])
            if number == 0 or turn % (number + 1) == 0:
                publisher.put(f"{key} " + "x" * (60_000 if number < 2 else 0))
        time.sleep(0.05)


def subscribe(seconds: float) -> None:
    """Subscribe to 18 of the keys, and compare."""
    session = open_session("peer")
    counts = {"right": 0, "wrong": 0}
    seen = set()

    def subscribe_to(wanted: str) -> object:
        def receive(sample: zenoh.Sample) -> None:
            published = sample.payload.to_string().partition(" ")[0]
            right = published == wanted
            counts["right" if right else "wrong"] += 1
            if not right and (wanted, published) not in seen:
                seen.add((wanted, published))
                print(f"subscriber of {wanted}: {sample.key_expr}, published on {published}")

        return session.declare_subscriber(wanted, receive)

    subscribers = [
        subscribe_to(f"demo/{prefix}/{number}/String")
        for prefix in "abc"
        for number in (0, 1, 3, 4, 7, 8)
    ]
    time.sleep(seconds)
    print(f"{len(subscribers)} subscribers: {counts}", flush=True)
    os._exit(0)


def run(cuts: int, seconds: float) -> None:
    """Run all of it in this network namespace."""

    def start(*command: object) -> subprocess.Popen[bytes]:
        return subprocess.Popen([sys.executable, __file__, *map(str, command)])

    others = [start("router")]
    time.sleep(2)
    others += [start("publish", prefix) for prefix in "abc"]
    time.sleep(3)
    subscriber = start("subscribe", 10 + cuts * (seconds + PAUSE))
    time.sleep(8)
    for cut in range(cuts):
        subprocess.run(["ip", "link", "set", "lo", "down"], check=True)
        time.sleep(seconds + (cut % 3 - 1) * 0.5)
        subprocess.run(["ip", "link", "set", "lo", "up"], check=True)
        time.sleep(PAUSE)
    subscriber.wait()
    for other in others:
        other.kill()


def main(cuts: int = 6, seconds: float = 10.0, runs: int = 4) -> None:
    """Start the runs, each in a network namespace of its own."""
    user = ["-r"] if os.geteuid() else []
    inside = f"ip link set lo up; exec {sys.executable} {__file__} run {cuts} {seconds}"
    started = [subprocess.Popen(["unshare", *user, "-n", "sh", "-c", inside]) for _ in range(runs)]
    for one in started:
        one.wait()


if __name__ == "__main__":
    arguments = sys.argv[2:]
    if sys.argv[1:2] == ["router"]:
        router = open_session("router")
        time.sleep(1e6)
    elif sys.argv[1:2] == ["publish"]:
        publish(*arguments)
    elif sys.argv[1:2] == ["subscribe"]:
        subscribe(float(arguments[0]))
    elif sys.argv[1:2] == ["run"]:
        run(int(arguments[0]), float(arguments[1]))
    else:
        main(*(kind(text) for kind, text in zip((int, float, int), sys.argv[1:], strict=False)))
