"""Faults that both middlewares survive in the same way, and those of DDS; see test_zenoh_faults."""

from __future__ import annotations

import gc
import os
import random
import signal
import subprocess
import sys
import threading
import time
from operator import le
from pathlib import Path

import pytest
from usage import memory, native_threads, open_files
from waiting import eventually

import rosglass
from rosglass.comm import History, QoS, Reliability

PEERS = Path(__file__).parent / "peers"
ADD, TWIST = "example_interfaces/srv/AddTwoInts", "geometry_msgs/msg/Twist"
STRING, IMAGE = "std_msgs/msg/String", "sensor_msgs/msg/Image"
KEEP_ALL = QoS(history=History.KEEP_ALL)
#: A killed participant is gone after its lease, which is 10 s without this.
SHORT_LEASE = (
    "<CycloneDDS><Domain><Discovery><LeaseDuration>3s</LeaseDuration></Discovery></Domain>"
    "</CycloneDDS>"
)

pytestmark = pytest.mark.peers


@pytest.fixture(params=["zenoh", "dds"])
def url(request, router, dds_domain):
    """URL of the nodes of a test."""
    if request.param == "dds":
        pytest.importorskip("cyclonedds", reason='needs pip install "rosglass[dds]"')
        return f"dds://?domain={dds_domain}"
    return f"{router.url}?domain={dds_domain}"


@pytest.fixture
def node(url):
    with rosglass.connect(url, "cockpit") as node:
        yield node


def program(text: str, url: str, **env: str) -> subprocess.Popen[str]:
    """Start a program that prints when it has begun, and is `node` at `url` then."""
    head = f"print('begun', flush=True)\nimport time, rosglass\nnode = rosglass.connect({url!r})\n"
    process = subprocess.Popen(
        [sys.executable, "-c", head + text],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=os.environ | env,
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "begun\n"
    return process


def test_a_cable_that_is_unplugged_for_ten_seconds_over_dds(on_two_machines):
    seen = on_two_machines(PEERS / "two_machines_dds.py", "10", env={"CYCLONEDDS_URI": SHORT_LEASE})
    assert seen["lost"] < 8, "the operator sees it when the lease has ended"
    assert seen["states"] == ["LOST", "CONNECTED"]
    outage = seen["outage"]
    assert outage["status"].startswith("LOST: all other participants have left DDS domain")
    assert (outage["publishers"], outage["ready"]) == (0, False)
    assert "no server offers /add" in outage["server"]
    assert seen["call"].startswith("ConnectionLostError"), (
        "no call waits for an answer that cannot come"
    )
    assert seen["recovered"] < 20, (
        "a second until both announce themselves again, where nothing else runs"
    )
    assert seen["ordered"], "nothing comes twice, nothing old comes late"
    assert seen["maps"] == ["hall", "hall"], "what is latched comes again, and once only"
    assert (seen["before"], seen["after"], seen["publishers"]) == (3, 11, 1)
    assert seen["problems"] == ["", ""]
    assert seen["status"].startswith("CONNECTED")


def test_cameras_are_back_soon_after_a_link_has_lost_packets_over_dds(on_two_machines):
    """The rest of larger datagrams fills the kernel's memory for fragments for 30 s."""
    pytest.importorskip("cyclonedds", reason='needs pip install "rosglass[dds]"')
    seen = on_two_machines(PEERS / "bad_link_dds.py", "5", env={"CYCLONEDDS_URI": ""})
    if seen["missing"]:
        pytest.skip(f"TUN devices are not permitted here: {seen['missing']}")
    assert seen["ip_fragments"] == 0, "each datagram is one packet"
    assert seen["back"] < 15, "0.6 s where nothing else runs; 27 s with datagrams of 31 kB"


def test_a_peer_that_is_killed_in_the_middle_of_big_messages(url, node):
    text = f"""
publisher = node.create_publisher("/big", {IMAGE!r})
while True:
    publisher.publish(data=bytes(6_000_000))
"""
    subscription = node.create_subscription("/big", IMAGE)
    for _ in range(2):
        process = program(text, url)
        for _ in range(3):
            sample = subscription.wait(30)
            assert sample is not None, subscription.problem
            sample.type.validate(sample.data)
        process.kill()
        process.wait()
        while (sample := subscription.wait(0.3)) is not None:
            sample.type.validate(sample.data)
    own = node.create_publisher("/small", STRING)
    heard = node.create_subscription("/small", STRING)
    own.publish(data="still there")
    assert heard.wait(30).message().data == "still there"


def test_a_slow_consumer_costs_no_memory_over_dds(dds_connect, dds_domain):
    node = dds_connect("cockpit")
    text = f"""
publisher = node.create_publisher("/camera", {IMAGE!r}, rosglass.QoS.sensor_data())
picture = publisher.type.encode(width=640, height=480, step=1920, data=bytes(921_600))
while True:
    publisher.publish_serialized(picture)
    time.sleep(0.01)
"""
    camera = program(text, f"dds://?domain={dds_domain}")
    ready, seen = threading.Event(), []

    def look(message):
        seen.append(message.width)
        ready.wait(0.2)

    qos = QoS(3, reliability=Reliability.BEST_EFFORT)
    slow = node.create_subscription("/camera", IMAGE, look, qos)
    unread = node.create_subscription("/camera", IMAGE, qos=qos)
    eventually(lambda: slow.statistics().received > 20 and unread.statistics().received > 20)
    before, received = memory(), slow.statistics().received
    eventually(lambda: slow.statistics().received > received + 150, timeout=30)
    statistics = slow.statistics()
    # 140 MB have been received since, twice.
    assert memory() - before < 40e6
    assert len(seen) < 100
    assert 0 <= statistics.received - statistics.dropped - len(seen) <= 10
    statistics = unread.statistics()
    assert 0 <= statistics.received - statistics.dropped <= 10
    ready.set()
    camera.kill()
    camera.communicate()


def test_a_thousand_of_everything_leave_nothing_behind_over_dds(dds_connect):
    node, other = dds_connect("cockpit"), dds_connect("robot")

    def cycle() -> None:
        made = [
            node.create_publisher("/count", TWIST),
            node.create_subscription("/count", TWIST, id),
            node.create_service_server("/add", ADD, lambda r: {"sum": r.a + r.b}),
            node.create_service_client("/add", ADD),
        ]
        made[0].publish(linear={"x": 1.0})
        for one in made:
            one.close()

    def settled() -> bool:
        return not other.service_servers("/add") and not other.publishers("/count")

    def resources() -> tuple[int, int]:
        return native_threads(), open_files()

    for _ in range(60):
        cycle()
    eventually(settled)
    gc.collect()
    used, objects, before = resources(), len(gc.get_objects()), memory()
    for _ in range(250):
        cycle()
    eventually(settled)
    gc.collect()
    eventually(lambda: all(map(le, resources(), used)), what=f"no more than {used} in use")
    assert len(gc.get_objects()) < objects + 500
    assert memory() - before < 6e6


def test_last_messages_arrive_although_the_publisher_is_closed_at_once(url, node):
    subscription = node.create_subscription("/big", IMAGE, qos=KEEP_ALL)
    text = f"""
from rosglass.comm import History, QoS
publisher = node.create_publisher("/big", {IMAGE!r}, QoS(history=History.KEEP_ALL))
while not publisher.subscription_count():
    time.sleep(0.01)
time.sleep(0.3)
for number in range(3):
    publisher.publish(width=number, data=bytes(6_000_000))
publisher.close()
node.close()
"""
    process = program(text, url)
    samples = [subscription.wait(30) for _ in range(3)]
    assert [sample and sample.message().width for sample in samples] == [0, 1, 2]
    _, errors = process.communicate(timeout=60)
    assert (process.returncode, errors) == (0, "")


def test_closing_takes_a_second_at_most_when_the_peer_was_killed(dds_connect, dds_domain):
    topics = [f"/topic{number}" for number in range(5)]
    text = f"""
for topic in {topics}:
    node.create_subscription(topic, {STRING!r})
time.sleep(60)
"""
    peer = program(text, f"dds://?domain={dds_domain}")
    node = dds_connect("cockpit")
    publishers = [node.create_publisher(topic, STRING) for topic in topics]
    eventually(lambda: all(publisher.subscription_count() for publisher in publishers))
    time.sleep(0.5)
    peer.kill()
    peer.communicate()
    for publisher in publishers:
        publisher.publish(data="never received")
    began = time.monotonic()
    publishers[0].close()
    assert time.monotonic() - began < 0.9, "closing one does not wait for dead peers"
    node.close()
    assert time.monotonic() - began < 4.5, "all of them wait together"


BUSY = f"""
latched = rosglass.QoS.latched()
node.create_service_server("/add", {ADD!r}, lambda r: {{"sum": r.a + r.b}})
node.create_subscription("/count", {TWIST!r}, id)
node.create_subscription("/map", {TWIST!r}, id, latched)
publishers = [node.create_publisher("/count", {TWIST!r}),
              node.create_publisher("/map", {TWIST!r}, latched)]
client = node.create_service_client("/add", {ADD!r})
unread = node.create_subscription("/count")
while True:
    for publisher in publishers:
        publisher.publish()
    client.call({{"a": 1, "b": 2}}, timeout=30)
    unread.wait(0.001)
"""


def test_ctrl_c_at_any_moment_from_the_first_import_on(url):
    moments = [random.uniform(0, 2) for _ in range(10)]
    for moment in moments:
        process = program(BUSY, url)
        time.sleep(moment)
        process.send_signal(signal.SIGINT)
        sent = time.monotonic()
        try:
            _, errors = process.communicate(timeout=60)
        finally:
            process.kill()
        what = f"{moment:.3f} s after its begin: {errors}"
        # Less than 1 s where nothing else runs.
        assert time.monotonic() - sent < 20, what
        # Python forgets why it ends if another thread runs exec() at that time, as for dataclasses;
        # and up to 3.11 it wraps what interrupts the making of a class.
        assert process.returncode in (-signal.SIGINT, 130, 1), what
        assert errors.startswith("Traceback"), what
        assert "\nKeyboardInterrupt\n" in errors, what
        for strange in ("Exception ignored", "Exception in thread", "Fatal", "WARNING", "ERROR"):
            assert strange not in errors, what
