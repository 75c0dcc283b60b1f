"""Links that come and go: routers and peers that appear, die and return."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import threading
import time
from contextlib import suppress
from pathlib import Path

import pytest
from ports import free_port
from usage import native_threads, open_files
from waiting import at_rate, eventually, nothing_happens

import rosglass
from rosglass.comm import IMMEDIATE, ConnectionState, NodeName
from rosglass.wires.zenoh.endpoints import Pump
from rosglass.wires.zenoh.router import Router, is_router_reachable

CONNECTING, CONNECTED = ConnectionState.CONNECTING, ConnectionState.CONNECTED
LOST, CLOSED = ConnectionState.LOST, ConnectionState.CLOSED
TWIST = "geometry_msgs/msg/Twist"
#: Seconds within which everything works again after a router has come back; two are usual.
RECOVERY = 20.0


class Receiver:
    """Notes each message's number and when it came."""

    def __init__(self, node, topic="/count"):
        self.numbers, self.times = [], []
        node.create_subscription(topic, TWIST, raw_callback=self._note, executor=IMMEDIATE)

    def _note(self, sample):
        self.numbers.append(sample.message().linear.x)
        self.times.append(time.monotonic())

    def assert_each_once(self):
        assert len(self.numbers) == len(set(self.numbers))
        assert self.numbers == sorted(self.numbers)


@pytest.fixture
def count():
    """Publish numbers at 100 Hz in a thread until the test ends."""
    stopping = threading.Event()
    threads = []

    def work(publisher):
        number = 0.0
        while not stopping.wait(0.01):
            publisher.publish(linear={"x": number})
            number += 1

    def count(node):
        thread = threading.Thread(target=work, args=(node.create_publisher("/count", TWIST),))
        threads.append(thread)
        thread.start()

    yield count
    stopping.set()
    for thread in threads:
        thread.join()


@pytest.mark.parametrize("mode", ["peer", "client"])
def test_node_connects_once_a_router_starts(mode, start_router, connect):
    before = time.monotonic()
    node = connect("early", f"?mode={mode}", url=start_router.url)
    assert time.monotonic() - before < 3, "connecting does not wait for a router"
    statuses = []
    node.on_status_change(statuses.append)
    address = start_router.url.removeprefix("zenoh://")
    status = node.status()
    assert status.state is CONNECTING
    assert status.detail == f"no answer from tcp/{address}, trying again every second"
    receiver = Receiver(node)
    publisher = node.create_publisher("/count", TWIST)
    publisher.publish(linear={"x": 0})
    time.sleep(1.2)
    start_router()
    appeared = time.monotonic()
    eventually(lambda: node.status().state is CONNECTED, timeout=RECOVERY)
    assert time.monotonic() - appeared < RECOVERY
    eventually(lambda: statuses)
    assert [status.state for status in statuses] == [CONNECTED]
    assert statuses[0].detail == f"router at tcp/{address}"
    other = connect("other", url=start_router.url)
    eventually(lambda: NodeName("/", "early") in other.nodes())
    eventually(lambda: other.subscriptions("/count"))
    other.create_publisher("/count", TWIST).publish(linear={"x": 7})
    eventually(lambda: 7 in receiver.numbers)


@pytest.mark.parametrize("mode", ["peer", "client"])
def test_unresponsive_router_does_not_block(mode, free_port):
    with socket.create_server(("127.0.0.1", free_port)):
        before = time.monotonic()
        node = rosglass.connect(f"zenoh://127.0.0.1:{free_port}?mode={mode}", "patient")
        node.create_publisher("/count", TWIST, rosglass.QoS.latched()).publish()
        node.create_subscription("/count", TWIST)
        assert time.monotonic() - before < 3
        nothing_happens(0.3)
        assert node.status().state is CONNECTING
        ticks = []
        ticking = threading.Timer(0.2, lambda: ticks.append(time.monotonic()))
        ticking.start()
        before = time.monotonic()
        node.close()
        assert time.monotonic() - before < 15
        ticking.join()
        assert ticks[0] - before < 2, "other threads go on while a session closes"


@pytest.mark.parametrize("mode", ["peer", "client"])
def test_a_router_that_dies_and_returns(mode, start_router, connect, count):
    router = start_router()
    talker = connect("talker", f"?mode={mode}", url=start_router.url)
    listener = connect("listener", f"?mode={mode}", url=start_router.url)
    statuses = []
    listener.on_status_change(statuses.append, IMMEDIATE)
    receiver = Receiver(listener)
    count(talker)
    eventually(lambda: len(receiver.numbers) > 20)
    router.end()
    if mode == "client":
        eventually(lambda: listener.status().state is LOST)
        assert "lost, trying again every second" in listener.status().detail
        eventually(lambda: listener.nodes() == [NodeName("/", "listener")])
    else:
        # Two peers are linked with each other already and go on without the router.
        eventually(lambda: "no router" in listener.status().detail)
        assert listener.status().state is CONNECTED
        heard = len(receiver.numbers)
        eventually(lambda: len(receiver.numbers) > heard + 20)
    time.sleep(1)
    start_router()
    returned = time.monotonic()
    eventually(lambda: "router at" in listener.status().detail, timeout=RECOVERY)
    eventually(
        lambda: receiver.times[-1] > returned and listener.publishers("/count"), timeout=RECOVERY
    )
    assert time.monotonic() - returned < RECOVERY
    heard = len(receiver.numbers)
    eventually(lambda: len(receiver.numbers) > heard + 20)
    receiver.assert_each_once()
    if mode == "client":
        assert [status.state for status in statuses][-2:] == [LOST, CONNECTED]


def test_latched_messages_come_once_through_a_router_that_dies(start_router, connect):
    router = start_router()
    # Clients lose each other with the router, and ask for the history again when it returns.
    talker = connect("talker", "?mode=client", url=start_router.url)
    listener = connect("listener", "?mode=client", url=start_router.url)
    publisher = talker.create_publisher("/map", TWIST, rosglass.QoS.latched(3))
    for number in range(5):
        publisher.publish(linear={"x": number})
    numbers = []
    listener.create_subscription(
        "/map", TWIST, lambda m: numbers.append(m.linear.x), rosglass.QoS.latched(3)
    )
    eventually(lambda: numbers == [2, 3, 4])
    router.end()
    eventually(lambda: listener.status().state is LOST)
    start_router()
    eventually(lambda: listener.publishers("/map"))
    eventually(publisher.subscription_count)
    publisher.publish(linear={"x": 5})
    eventually(lambda: 5 in numbers)
    nothing_happens(0.5)
    assert numbers == [2, 3, 4, 5]


def test_a_peer_that_is_killed_leaves_the_graph_at_once(router, start_peer, connect):
    node = connect("cockpit")
    changes = []
    node.on_graph_change(lambda: changes.append(1))
    peer = start_peer("rosglass", router, publish={"/count": TWIST})
    subscription = node.create_subscription("/count")
    assert subscription.wait(30) is not None
    eventually(lambda: NodeName("/own", "peer") in node.nodes())
    count = len(changes)
    os.kill(peer.pid, signal.SIGKILL)
    eventually(lambda: NodeName("/own", "peer") not in node.nodes())
    assert node.publishers("/count") == []
    eventually(lambda: len(changes) > count)
    assert node.status().state is CONNECTED
    eventually(lambda: "/own/peer left" in subscription.problem)
    again = start_peer("rosglass", router, publish={"/count": TWIST})
    subscription.take_latest()
    assert subscription.wait(RECOVERY) is not None
    eventually(lambda: subscription.problem == "")
    again.end()


def test_closing_after_the_peer_and_the_router_have_gone(start_router, start_peer, connect):
    router = start_router()
    node = connect("survivor", url=start_router.url)
    node.create_subscription("/count")
    node.create_publisher("/other", TWIST, rosglass.QoS.latched())
    router.end()
    before = time.monotonic()
    node.close()
    node.close()
    assert time.monotonic() - before < 10
    assert node.status().state is CLOSED


def test_ctrl_c_while_a_session_opens_leaves_no_thread_behind(router, monkeypatch):
    """One that waited in Zenoh while the interpreter ended aborted the program."""
    made = []

    class InterruptedPump(Pump):
        def __init__(self, *arguments):
            super().__init__(*arguments)
            made.append(arguments[-1])
            if len(made) == 2:
                raise KeyboardInterrupt

    monkeypatch.setattr("rosglass.wires.zenoh.middleware.Pump", InterruptedPump)
    with pytest.raises(KeyboardInterrupt) as interrupt:
        rosglass.connect(f"{router.url}?mode=peer", "interrupted")
    eventually(lambda: not {thread.name for thread in threading.enumerate()} & set(made))
    assert interrupt.traceback  # keeps the session, as that of a program's end does


def test_every_new_connection_receives(router, start_peer):
    peer = start_peer("rosglass", router, publish={"/count": TWIST}, period=0.02)
    for _ in range(40):
        with rosglass.connect(router.url, "visitor") as node:
            assert node.create_subscription("/count", TWIST).wait(30) is not None
    peer.end()


def test_nodes_leave_no_threads_and_no_descriptors_behind(router):
    def cycle():
        with rosglass.connect(router.url, "brief") as node:
            node.on_graph_change(lambda: None)
            node.create_subscription("/count", TWIST, callback=id)
            node.create_subscription("/any")
            node.create_publisher("/count", TWIST).publish()
            node.create_publisher("/map", TWIST, rosglass.QoS.latched()).publish()

    for _ in range(5):
        cycle()
    time.sleep(0.5)
    threads, native, descriptors = threading.active_count(), native_threads(), open_files()
    before = time.monotonic()
    for _ in range(40):
        cycle()
    # Undeclaring at a bad moment once stopped the whole interpreter for 10 s.
    assert time.monotonic() - before < 60
    eventually(lambda: threading.active_count() <= threads)
    # Zenoh's thread pools breathe a little.
    assert native_threads() < native + 20
    assert open_files() < descriptors + 20


def listening_addresses():
    """Return the addresses (hexadecimal) on which this process listens for TCP connections."""
    own = set()
    for link in Path("/proc/self/fd").iterdir():
        with suppress(OSError):
            own.add(str(link.readlink()))
    found = set()
    for table in ("/proc/self/net/tcp", "/proc/self/net/tcp6"):
        for line in Path(table).read_text().splitlines()[1:]:
            columns = line.split()
            if columns[3] == "0A" and f"socket:[{columns[9]}]" in own:
                found.add(columns[1].rpartition(":")[0])
    return found


def test_nothing_listens_beyond_loopback(router, connect):
    node = connect("shy")
    eventually(lambda: node.status().state is CONNECTED)
    assert listening_addresses() == {"0100007F"}


def test_a_stalled_link_drops_images_but_no_command(router, start_peer, connect):
    best_effort = rosglass.QoS.sensor_data()
    node = connect("robot")
    commands = node.create_publisher("/cmd_vel", TWIST)
    pictures = node.create_publisher("/camera", "sensor_msgs/msg/Image", best_effort)
    peer = start_peer(
        "rosglass",
        router,
        subscribe={"/cmd_vel": TWIST, "/camera": "sensor_msgs/msg/Image"},
        quiet=["/camera"],
        depth=1000,
    )
    eventually(lambda: commands.subscription_count() and pictures.subscription_count())
    picture = rosglass.load("sensor_msgs/msg/Image").encode(data=bytes(900_000))
    os.kill(peer.pid, signal.SIGSTOP)
    slowest = 0.0
    for number in at_rate(0.01, 60):
        before = time.monotonic()
        pictures.publish_serialized(picture)
        commands.publish(linear={"x": number})
        slowest = max(slowest, time.monotonic() - before)
    commands.publish(linear={"x": -1})
    os.kill(peer.pid, signal.SIGCONT)
    numbers = []
    while -1 not in numbers:
        numbers.append(peer.event("value")["linear"]["x"])
    assert numbers == [*range(60), -1]
    assert slowest < 1, "publishing does not wait for the link"
    peer.end()


def test_reachable_or_not(router, free_port):
    assert is_router_reachable(router.url)
    before = time.monotonic()
    assert not is_router_reachable(f"zenoh://127.0.0.1:{free_port}")
    assert time.monotonic() - before < 10


def test_port_of_another_program_is_not_reachable(free_port):
    with socket.create_server(("127.0.0.1", free_port)):
        before = time.monotonic()
        assert not is_router_reachable(f"zenoh://127.0.0.1:{free_port}", timeout=0.3)
        assert time.monotonic() - before < 10
        with pytest.raises(rosglass.ConnectionLostError, match="another program uses the port"):
            Router(f"tcp/127.0.0.1:{free_port}")


def test_a_second_router_says_that_one_is_there(router):
    with pytest.raises(rosglass.ConnectionLostError, match="router runs there already; use that"):
        Router(router.listen)


@pytest.mark.parametrize(
    "listen", ["127.0.0.1:7447", "udp/127.0.0.1:1", "tcp/127.0.0.1:99999", "tcp/:7447", "", "tcp/h"]
)
def test_router_refuses_invalid_addresses(listen):
    with pytest.raises(rosglass.ConversionError, match="listen: expected an address such as tcp/"):
        Router(listen)


def test_a_router_closes_twice_and_frees_its_port():
    with Router(f"tcp/127.0.0.1:{free_port()}") as first:
        assert is_router_reachable(first.url)
    first.close()
    assert not is_router_reachable(first.url)
    with Router(first.listen) as second:
        assert second.listen == first.listen


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_the_router_command_ends_cleanly(number, start_router):
    router = start_router()
    second = subprocess.run(
        router.popen.args,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert second.returncode == 1
    assert "a Zenoh router runs there already" in second.stderr
    router.popen.send_signal(number)
    assert router.popen.wait(30) == 0
    assert "Zenoh router ended\n" in router.output
