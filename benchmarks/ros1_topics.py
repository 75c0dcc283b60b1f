"""Measure topics of ROS 1 against rospy and roscpp doing the same, in the same run.

    python benchmarks/ros1_topics.py [--quick] [--only CASE] [--json FILE]

Each subscriber is a process of its own, and all but "raw" do what a user of rospy would write: a
callback gets a message and reads a field of it. "default" is that without asking for anything else,
on the node's dispatcher thread, and with rospy's unbounded queue; the targets are for it.
"immediate" is the same in the thread that receives, where rospy calls back, and "raw" a callback
there that gets bytes. rospy runs in /usr/bin/python3, with the larger buffer that its users give it
for images; roscpp is built here from the distribution's headers, with a spinner of its own. At a
given rate, a roscpp node publishes for all; back to back, a node of ours hands the same blocks of
messages to the socket again and again, as fast as the subscriber takes them and no faster: nothing
is lost on the way, and no ordinary publisher keeps a subscriber busy. A latency begins before the
call of publish() and ends when the callback has read the field. The ways take turns;
printed is each way's median run, and the median and spread of its ratios to the peer's run in the
same turn, as other programs disturb. Exits 1 when a target is missed.
"""

from __future__ import annotations

import argparse
import json
import os
import select
import shutil
import socket
import statistics
import subprocess
import sys
import tempfile
import time
import xmlrpc.client
from contextlib import suppress
from pathlib import Path
from typing import Any

from publishing import finish

PEERS = Path(__file__).parent / "ros1_peers"
TYPES = {
    "text": "std_msgs/String",
    "image": "sensor_msgs/Image",
    "point": "geometry_msgs/PointStamped",
    "pose": "geometry_msgs/PoseStamped",
}
OURS = ("default", "immediate", "raw", "unread")
#: Samples left out of latencies.
_FIRST = 5
#: At least so many times rospy's rate of 6.2 MB images, and of 64-byte messages.
IMAGE_RATIO, RATE_RATIO = 3.0, 2.0
#: At most so many times roscpp's median latency.
LATENCY_RATIO = 1.5
#: Maximum ratio to rospy's processor time for 1 kHz of unread PoseStamped.
UNREAD_RATIO = 0.2


class Notes:
    """A subscriber's notes: times of reception and of sending, in nanoseconds."""

    def __init__(self) -> None:
        self.got: list[int] = []
        self.sent: list[int] = []
        self.count = 0

    def touch_data(self, message: Any) -> None:
        """Count a message, or a sample, and look at its content."""
        if len(message.data):
            self.count += 1

    def touch_point(self, message: Any) -> None:
        """Count a message, and look at its content."""
        if message.point.x:
            self.count += 1

    def text(self, data: str) -> None:
        """Note a String, which begins with the time of sending."""
        self.got.append(time.time_ns())
        self.sent.append(int(data[:20]))

    def stamp(self, stamp: Any) -> None:
        """Note a message by its header's stamp."""
        self.got.append(time.time_ns())
        self.sent.append(stamp.secs * 1_000_000_000 + stamp.nsecs)

    def raw_text(self, sample: Any) -> None:
        """Note a String as bytes."""
        self.got.append(time.time_ns())
        self.sent.append(int(sample.data[4:24]))

    def raw_stamp(self, sample: Any) -> None:
        """Note a message with a header as bytes."""
        self.got.append(time.time_ns())
        secs, nsecs = sample.data[4:8], sample.data[8:12]
        self.sent.append(
            int.from_bytes(secs, "little") * 1_000_000_000 + int.from_bytes(nsecs, "little")
        )

    def figures(self) -> dict[str, Any]:
        """Return count, rate and latencies in milliseconds."""
        latencies = sorted((r - s) / 1e6 for r, s in zip(self.got, self.sent, strict=True))[_FIRST:]
        figures: dict[str, Any] = {"count": self.count or len(self.got)}
        if latencies:
            figures["median"] = statistics.median(latencies)
            figures["p99"] = latencies[int(0.99 * len(latencies))]
        return figures


def subscriber(url: str, kind: str, how: str, case: str) -> None:
    """Receive until the second line on standard input; print what was measured."""
    import rosglass
    from rosglass.comm import IMMEDIATE, History

    notes = Notes()
    node = rosglass.connect(url, "rosglass_subscriber")
    arguments: dict[str, Any] = {}
    if case == "rate" and how == "raw":
        arguments = {"raw_callback": notes.touch_data, "executor": IMMEDIATE}
    elif case == "rate":
        arguments = {"callback": notes.touch_point if kind == "point" else notes.touch_data}
    elif how == "raw":
        take = notes.raw_text if kind == "text" else notes.raw_stamp
        arguments = {"raw_callback": take, "executor": IMMEDIATE}
    elif how != "unread" and kind == "text":
        arguments = {"callback": lambda m: notes.text(m.data)}
    elif how != "unread":
        arguments = {"callback": lambda m: notes.stamp(m.header.stamp)}
    if how == "immediate":
        arguments["executor"] = IMMEDIATE
    qos = rosglass.QoS(history=History.KEEP_ALL) if how == "default" else rosglass.QoS()
    subscription = node.create_subscription("/bench", TYPES[kind], qos=qos, **arguments)
    print("ready", flush=True)
    sys.stdin.readline()
    before, began = time.process_time(), time.monotonic()
    sys.stdin.readline()
    cpu = (time.process_time() - before) / (time.monotonic() - began)
    figures = notes.figures() | {"cpu": cpu}
    if how == "unread":
        figures["count"] = subscription.statistics().received
    print(json.dumps(figures), flush=True)
    node.close()


def firehose(url: str, kind: str, seconds: float) -> None:
    """Publish as fast as the subscriber takes it; print how many messages that were."""
    import rosglass

    node = rosglass.connect(url, "rosglass_publisher")
    publisher = node.create_publisher("/bench", TYPES[kind])
    fields: dict[str, Any] = {"data": "0" * 60}
    if kind == "image":
        fields = {"width": 1920, "height": 1080, "step": 5760, "data": bytes(1920 * 1080 * 3)}
    elif kind == "point":
        fields = {"header": {"frame_id": "camera_depth_frame__left"}, "point": {"x": 1.0}}
    message = publisher.type.encode(fields)
    many = 1 if kind == "image" else 1000
    block = memoryview(many * (len(message).to_bytes(4, "little") + message))
    while not publisher.subscription_count():
        time.sleep(0.01)
    print("ready", flush=True)
    sys.stdin.readline()
    (link,) = publisher._writer.publication.links()
    sock = link._sock  # making and queueing messages is not what is measured
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 4 * 1024 * 1024)
    room = select.poll()
    room.register(sock, select.POLLOUT)
    began, count = time.monotonic(), 0
    end = began + seconds
    while time.monotonic() < end:
        left = block
        while left:
            with suppress(BlockingIOError):
                left = left[sock.send(left) :]
                continue
            room.poll()
        count += many
    print(count, time.monotonic() - began, flush=True)
    sys.stdin.readline()
    node.close()


class Bench:
    """A master, the roscpp programs, and runs between a publisher and a subscriber."""

    def __init__(self, folder: Path, seconds: float, turns: int) -> None:
        self._program = folder / "roscpp_peer"
        self._seconds, self._turns = seconds, turns
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            self._port = probe.getsockname()[1]
        self._uri = f"http://127.0.0.1:{self._port}"
        self._env = {
            "PATH": "/usr/bin:/bin",
            "HOME": str(folder),
            "ROS_HOME": str(folder),
            "ROS_MASTER_URI": self._uri,
            "ROS_IP": "127.0.0.1",
            "PYTHONUNBUFFERED": "1",
        }
        self._build()
        self._master = subprocess.Popen(
            ["/usr/bin/rosmaster", "--core", "-p", str(self._port)],
            env=self._env,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        for _ in range(200):
            with suppress(OSError), xmlrpc.client.ServerProxy(self._uri) as master:
                master.getPid("/bench")
                break
            time.sleep(0.05)

    def _build(self) -> None:
        flags = subprocess.run(
            ["pkg-config", "--cflags", "--libs", "roscpp"],
            check=True,
            capture_output=True,
            text=True,
        ).stdout.split()
        command = ["g++", "-std=c++17", "-O2", "-DBOOST_BIND_GLOBAL_PLACEHOLDERS"]
        command += [str(PEERS / "roscpp_peer.cpp"), "-o", str(self._program), *flags]
        subprocess.run([*command, "-lboost_thread", "-lboost_system", "-lpthread"], check=True)

    def close(self) -> None:
        """End the master."""
        self._master.kill()
        self._master.wait()

    def _start(self, command: list[str], ours: bool) -> subprocess.Popen[str]:
        env = {**os.environ, "ROS_IP": "127.0.0.1"} if ours else self._env
        return subprocess.Popen(
            command, env=env, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )

    def measure(self, kind: str, hz: float, how: str) -> dict[str, Any]:
        """Run one way; returns the subscriber's figures with what was `sent`."""
        case = "unread" if how.endswith("unread") else "latency" if hz else "rate"
        if how.startswith("rospy"):
            command = ["/usr/bin/python3", str(PEERS / "rospy_peer.py"), kind, case]
        elif how == "roscpp":
            command = [str(self._program), "subscribe", kind, case]
        else:
            url = f"ros1://127.0.0.1:{self._port}"
            command = [sys.executable, __file__, "--role", how, "--kind", kind, "--url", url]
            command += ["--case", case]
        receiving = self._start(command, how in OURS)
        _expect_ready(receiving)
        if hz:
            command = [str(self._program), "publish", kind, str(hz), str(self._seconds)]
        else:
            url = f"ros1://127.0.0.1:{self._port}"
            command = [sys.executable, __file__, "--role", "firehose", "--kind", kind]
            command += ["--url", url, "--seconds", str(self._seconds)]
        sending = self._start(command, ours=not hz)
        _expect_ready(sending)
        _ask(receiving if how != "roscpp" else None)
        began = time.monotonic()
        answer = _ask(sending, answer=True).split()
        sent, seconds = int(answer[0]), float(answer[1])
        time.sleep(0.3)
        figures: dict[str, Any] = json.loads(_ask(receiving, answer=True))
        if "cpu_s" in figures:
            figures["cpu"] = figures.pop("cpu_s") / (time.monotonic() - began)
        for process in (receiving, sending):
            process.communicate(timeout=10)  # they unregister, or later ones would look for them
        return figures | {"sent": sent, "rate": figures["count"] / seconds}

    def usual(
        self, kind: str, hz: float, ways: tuple[str, ...], figure: str, peer: str
    ) -> dict[str, Any]:
        """Run the ways in turns; returns the run of each whose `figure` is its median.

        With that comes its `ratio`, the median of those to the peer's run in the same turn, and
        their `spread`: other programs disturb neighbours in time alike, and hours differ.
        """
        runs: dict[str, list[dict[str, Any]]] = {way: [] for way in ways}
        for way in ways * self._turns:
            nothing = {"median": float("inf"), "p99": float("inf")}
            runs[way].append(nothing | self.measure(kind, hz, way))
        found: dict[str, Any] = {}
        for way, made in runs.items():
            ratios = sorted(
                one[figure] / other[figure] for one, other in zip(made, runs[peer], strict=True)
            )
            middle = sorted(made, key=lambda one: float(one[figure]))[len(made) // 2]
            found[way] = middle | {
                "ratio": ratios[len(ratios) // 2],
                "spread": (ratios[0], ratios[-1]),
            }
        return found


def _expect_ready(process: subprocess.Popen[str]) -> None:
    assert process.stdout is not None
    while (line := process.stdout.readline()) != "ready\n":
        if not line:
            sys.exit(f"{process.args} ended before it was ready")


def _ask(process: subprocess.Popen[str] | None, answer: bool = False) -> str:
    if process is None:
        return ""
    assert process.stdin is not None
    assert process.stdout is not None
    print(file=process.stdin, flush=True)
    return process.stdout.readline() if answer else ""


def table(found: dict[str, Any], figure: str, peer: str) -> None:
    """Print the figures of each way, with the ratio to a peer."""
    for way, one in found.items():
        print(
            f"  {way:10} "
            + (
                f"median {one['median']:7.3f}  p99 {one['p99']:7.3f} ms"
                if figure == "median"
                else f"{one['rate']:9.0f}/s  {one['cpu'] / one['rate'] * 1e6:8.2f} us each"
            )
            + f"  x{one['ratio']:.2f} of {peer} ({one['spread'][0]:.2f}-{one['spread'][1]:.2f})"
            f"  cpu {one['cpu']:5.1%}"
            f"  received {one['count']}/{one['sent']}"
        )


def run(bench: Bench, only: str) -> tuple[dict[str, Any], list[str]]:
    """Run the cases; returns the figures and the targets missed."""
    results: dict[str, Any] = {}
    missed: list[str] = []
    everybody = ("rospy", "roscpp", *OURS[:3])
    if "latency" in only:
        print("64 B at 300 Hz, one way", flush=True)
        found = results["latency"] = bench.usual("text", 300, everybody, "median", "roscpp")
        table(found, "median", "roscpp")
        ours, rospy = found["default"]["ratio"], found["rospy"]["ratio"]
        if ours >= rospy:
            missed.append(f"latency: {ours / rospy:.2f} of rospy's, less than 1")
        if ours > LATENCY_RATIO:
            missed.append(f"latency: {ours:.2f} of roscpp's, at most {LATENCY_RATIO}")
    for case, kind, limit, title in (
        ("image", "image", IMAGE_RATIO, "6.2 MB images back to back"),
        ("rate", "text", RATE_RATIO, "64 B back to back, std_msgs/String"),
        ("rate", "point", RATE_RATIO, "64 B back to back, geometry_msgs/PointStamped"),
    ):
        if case not in only:
            continue
        print(title, flush=True)
        found = results[f"{case} {kind}"] = bench.usual(kind, 0, everybody, "rate", "rospy")
        table(found, "rate", "rospy")
        ratio = found["default"]["ratio"]
        if ratio < limit:
            missed.append(f"{title}: {ratio:.2f} of rospy's rate, at least {limit}")
    if "unread" in only:
        print("1 kHz of unread PoseStamped, share of one core", flush=True)
        ways = ("rospy unread", "unread")
        found = results["unread"] = bench.usual("pose", 1000, ways, "cpu", ways[0])
        ratio, spread = found["unread"]["ratio"], found["unread"]["spread"]
        for way, one in found.items():
            print(f"  {way:12} {one['cpu']:.2%}")
        counts = f"{found['unread']['count']}/{found['unread']['sent']}"
        print(f"  x{ratio:.3f} ({spread[0]:.3f}-{spread[1]:.3f}), counted {counts}")
        if ratio > UNREAD_RATIO:
            missed.append(f"unread: {ratio:.2f} of rospy's processor time, at most {UNREAD_RATIO}")
        if found["unread"]["count"] != found["unread"]["sent"]:
            missed.append(
                f"unread: {found['unread']['sent'] - found['unread']['count']} not counted"
            )
    return results, missed


def main() -> int:
    cases = ("latency", "image", "rate", "unread")
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--quick", action="store_true", help="shorter runs, and fewer")
    parser.add_argument("--only", choices=cases, help="run this case only")
    parser.add_argument("--json", type=Path, help="write the figures to this file")
    roles = [*OURS, "firehose"]
    parser.add_argument("--role", choices=roles, help=argparse.SUPPRESS)
    parser.add_argument("--case", help=argparse.SUPPRESS)
    parser.add_argument("--seconds", type=float, help=argparse.SUPPRESS)
    parser.add_argument("--kind", choices=list(TYPES), help=argparse.SUPPRESS)
    parser.add_argument("--url", help=argparse.SUPPRESS)
    args = parser.parse_args()
    if args.role == "firehose":
        firehose(args.url, args.kind, args.seconds)
        return 0
    if args.role:
        subscriber(args.url, args.kind, args.role, args.case)
        return 0
    needed = ("/usr/bin/rosmaster", "/usr/bin/g++", "/usr/include/ros/ros.h")
    missing = [name for name in needed if not Path(name).exists()]
    if missing or shutil.which("pkg-config") is None:
        print(
            "needs ROS 1 (apt install python3-rosmaster python3-rospy libroscpp-dev "
            f"libsensor-msgs-dev libgeometry-msgs-dev g++ pkg-config); missing: {missing}"
        )
        return 1
    with tempfile.TemporaryDirectory() as folder:
        bench = Bench(Path(folder), 1.0 if args.quick else 3.0, 3 if args.quick else 5)
        try:
            results, missed = run(bench, args.only or " ".join(cases))
        finally:
            bench.close()
    return finish(results, missed, args.json)


if __name__ == "__main__":
    sys.exit(main())
