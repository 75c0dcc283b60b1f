"""Recordings of programs that are killed, and on disks that fill up."""

from __future__ import annotations

import random
import shutil
import struct
import subprocess
import sys
import time
from itertools import pairwise
from pathlib import Path

import pytest
from mcap.exceptions import EndOfFile
from mcap.reader import NonSeekingReader
from waiting import at_rate, eventually

from rosglass.bags import Recorder, open_bag
from rosglass.comm import QoS

PEER = Path(__file__).parent / "peers" / "recording_peer.py"
#: Seconds of a recording that may be lost.
LOST = 1.0
#: Seconds between two lines of the peer's; where it takes longer, the machine was busy.
PERIOD = 0.05
KILLS = 3
#: The bytes of a message's number: after the header and an empty layout.
NUMBER = slice(16, 24)


def numbers(path):
    """Return the numbers of the messages that the ``mcap`` package reads, in the file's order.

    The file must be cut short.
    """
    found = []
    with path.open("rb") as file:
        try:
            for _, _, message in NonSeekingReader(file).iter_messages(log_time_order=False):
                found.append(int.from_bytes(message.data[NUMBER], "little"))
        except (EndOfFile, struct.error):  # by where the last record is cut
            return found
    raise AssertionError("it was not cut short")


def check(path, events, ended):
    """See that what was recorded is there, in one piece, but for the end."""
    found = numbers(path)
    first = next(at for at, number in enumerate(found) if number)
    assert found[first:] == list(range(1, found[-1] + 1)), "one piece"
    times = [event["at"] for event in events] + [ended]
    held_up = max(later - earlier for earlier, later in pairwise(times)) - PERIOD
    due = max(event["came"] for event in events if event["at"] < ended - LOST - held_up)
    assert found[-1] >= due > 0
    with open_bag(path) as bag:
        assert "not closed properly" in bag.problem
        assert len(list(bag.messages())) == len(found)
    return len(found)


def test_a_killed_recording_is_readable_but_for_its_last_second(start, router, tmp_path):
    read = []
    for kill in range(KILLS):
        path = tmp_path / f"{kill}.mcap"
        peer = start(str(PEER), router.url, str(path), "2000")
        events = []
        while not events or events[-1]["at"] - events[0]["at"] < LOST + 2 + 0.34 * kill:
            events.append(peer.event("state"))
        ended = time.monotonic()
        peer.popen.kill()
        peer.popen.wait()
        read.append(check(path, events, ended))
    assert len(read) == KILLS


def test_rare_messages_are_in_the_file_within_a_second(connect, tmp_path):
    robot, panel = connect("robot"), connect("panel")
    publisher = robot.create_publisher("/numbers", "std_msgs/msg/ByteMultiArray", QoS.latched())
    path = tmp_path / "rare.mcap"

    def publish(number):
        publisher.publish(data=number.to_bytes(8, "little"))
        return time.monotonic()

    with Recorder(panel, path, ["/numbers"]):
        publish(0)
        eventually(lambda: 0 in numbers(path))  # just written
        sent = publish(1)
        time.sleep(0.9)
        publish(2)
        eventually(lambda: 1 in numbers(path))
        # Half a second is usual; not a second after the last that came.
        assert time.monotonic() - sent < 1.6


def on_a_full_disk(start_program, router, tmp_path, disk):
    """Start the peer where the file system is full after 3 MB; return it and its file's copy."""
    path, arguments = tmp_path / "full.mcap", [sys.executable, str(PEER), router.url]
    if disk == "limit":
        return start_program(*arguments, str(path), "2000", "3000000"), path
    place = tmp_path / "disk"
    place.mkdir()
    mount = f"mount -t tmpfs -o size=3m none {place}"
    namespace = [shutil.which("unshare") or "unshare", "-m", "sh", "-c"]
    if subprocess.run([*namespace, mount], capture_output=True, check=False).returncode:
        pytest.skip("a small disk needs a mount namespace of its own: run this as root")
    copy = f'{mount} && "$@"; cp {place}/full.mcap {path}.part; mv {path}.part {path}'
    command = [*namespace, copy, "sh", *arguments, str(place / "full.mcap"), "2000"]
    return start_program(*command), path


@pytest.mark.parametrize("disk", ["limit", "tmpfs"])
def test_a_full_disk_is_said_and_costs_the_last_second(start_program, router, tmp_path, disk):
    peer, path = on_a_full_disk(start_program, router, tmp_path, disk)
    events = []
    while not peer.event("error", 0.01, otherwise=""):
        event = peer.event("state", 0.2, otherwise=None)
        events += [event] if event else []
    ended = time.monotonic()
    closed = peer.event("closed")
    why = "File too large" if disk == "limit" else "No space left on device"
    assert f"full.mcap cannot be written: {why}; nothing more is recorded" in closed
    eventually(path.exists)
    peer.popen.wait()
    assert check(path, events, ended) > 500
    assert not any("Traceback" in line for line in peer.output), peer.output


def test_the_command_ends_with_the_reason_on_a_full_disk(connect, router, tmp_path):
    node = connect("robot")
    publisher = node.create_publisher("/noise", "std_msgs/msg/ByteMultiArray", qos=1000)
    path = tmp_path / "full.mcap"
    code = (
        "import resource, sys; from rosglass.cli import main; "
        "resource.setrlimit(resource.RLIMIT_FSIZE, (500_000, resource.RLIM_INFINITY)); "
        f"sys.exit(main(['record', '--output', {str(path)!r}, '/noise', '--url', {router.url!r}]))"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    try:
        generator = random.Random(1)
        for _ in at_rate(0.01):
            publisher.publish(data=generator.randbytes(20_000))
            if process.poll() is not None:
                break
    finally:
        process.kill()
        _, said = process.communicate()
    assert process.returncode == 1, said
    assert f"rosglass: {path} cannot be written: File too large; nothing more is recorded" in said
    assert "Traceback" not in said
    assert path.stat().st_size <= 500_000
