"""Networks that vanish, routers that die, peers that send rubbish, programs that never tidy up."""

from __future__ import annotations

import gc
import itertools
import logging
import os
import re
import signal
import socket
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest
from usage import memory, open_files
from waiting import at_rate, eventually

import rosglass
from rosglass.comm import ConnectionState
from rosglass.errors import ConnectionLostError, ServiceError
from rosglass.wires.zenoh.keys import Attachment, topic_key

HERE = Path(__file__).parent
ADD, TWIST = "example_interfaces/srv/AddTwoInts", "geometry_msgs/msg/Twist"
IMAGE, STRING = "sensor_msgs/msg/Image", "std_msgs/msg/String"
#: Seconds within which everything works again after a router has come back; two are usual.
RECOVERY = 20.0


def test_a_cable_that_is_unplugged_for_ten_seconds(on_two_machines):
    seen = on_two_machines(HERE / "peers" / "two_machines_zenoh.py", "10")
    assert seen["lost"] < 8, "the operator sees it soon"
    assert seen["states"] == ["LOST", "LOST", "CONNECTED"], "silent, then given up, then back"
    assert seen["call"].startswith("ConnectionLostError"), (
        "no call waits for an answer that cannot come"
    )
    assert seen["recovered"] < RECOVERY
    assert seen["silence"] > 9
    assert seen["ordered"], "nothing comes twice, nothing old comes late"
    assert seen["maps"] == ["hall"]
    assert (seen["before"], seen["after"]) == (3, 11)
    assert seen["status"].startswith("CONNECTED")


def test_a_peer_notices_that_its_links_are_dead(on_two_machines):
    seen = on_two_machines(HERE / "peers" / "one_machine_zenoh.py", "10")
    assert seen["lost"] < 8, "before Zenoh's lease of 10 s"


@pytest.mark.parametrize("mode", ["peer", "client"])
def test_services_and_latched_topics_after_a_router_was_restarted(mode, start_router, connect):
    router = start_router()
    robot = connect("robot", f"?mode={mode}", url=start_router.url)
    cockpit = connect("cockpit", f"?mode={mode}", url=start_router.url)
    asked, answer = threading.Event(), threading.Event()

    def add(request):
        asked.set()
        answer.wait(30)
        return {"sum": request.a + request.b}

    robot.create_service_server("/add", ADD, add)
    robot.create_publisher("/map", STRING, rosglass.QoS.latched()).publish(data="hall")
    client = cockpit.create_service_client("/add", ADD)
    assert client.wait_for_server(30), client.problem
    call = client.call_async({"a": 1, "b": 2}, timeout=30)
    assert asked.wait(30)
    before = time.monotonic()
    router.end()
    if mode == "client":
        with pytest.raises(ConnectionLostError, match="went away before it answered"):
            call.result(30)
        assert time.monotonic() - before < 15
    answer.set()
    if mode == "peer":
        assert call.result(30).sum == 3, "peers go on without the router"
    time.sleep(0.3)
    start_router()
    returned = time.monotonic()
    assert client.call({"a": 3, "b": 4}, timeout=RECOVERY).sum == 7
    late = connect("late", f"?mode={mode}", url=start_router.url)
    subscription = late.create_subscription("/map", STRING, qos=rosglass.QoS.latched())
    assert subscription.wait(RECOVERY).message().data == "hall"
    assert time.monotonic() - returned < 2 * RECOVERY
    eventually(lambda: len(cockpit.service_servers("/add")) == 1)
    eventually(lambda: len(late.publishers("/map")) == 1)


@pytest.mark.parametrize("mode", ["peer", "client"])
def test_a_client_follows_its_servers_wherever_they_are(mode, start_router, connect):
    router = start_router()
    cockpit = connect("cockpit", f"?mode={mode}", url=start_router.url)
    client = cockpit.create_service_client("/add", ADD)

    def offer(name, where):
        node = connect(name, f"?mode={where}", url=start_router.url)
        node.create_service_server("/add", ADD, lambda r: {"sum": r.a + r.b})
        return node

    def answers():
        assert client.wait_for_server(30), client.problem
        return client.call({"a": 1, "b": 2}, timeout=30).sum == 3

    def servers(*names):
        eventually(lambda: {s.node.name for s in cockpit.service_servers("/add")} == set(names))

    assert not client.ready
    first = offer("first", "peer")
    assert answers()
    second = offer("second", "client")
    servers("first", "second")
    first.close()
    servers("second")
    assert answers(), "the other one serves"
    second.close()
    eventually(lambda: not client.ready)
    third = offer("third", "client")
    assert answers(), "the next one is found"
    router.end()
    eventually(lambda: not client.ready)
    start_router()
    assert answers(), "and again behind a new router"
    third.close()
    eventually(lambda: not client.ready)
    offer("third", "peer")
    assert answers(), "and when it is back by the same name, on another link"


CAMERA = """
import time, rosglass
node = rosglass.connect({url!r}, "camera")
publisher = node.create_publisher("/camera", {image!r}, rosglass.QoS.sensor_data())
picture = publisher.type.encode(width=640, height=480, step=1920, data=bytes(921_600))
while True:
    publisher.publish_serialized(picture)
    time.sleep(0.01)
"""


def test_messages_with_a_lifespan_are_dropped_if_a_stalled_link_delivers_them_late(
    start_router, connect
):
    router = start_router()
    robot, cockpit = (
        connect(name, "?mode=client", url=start_router.url) for name in ("robot", "cockpit")
    )
    brief = rosglass.QoS(1000, lifespan=rosglass.Duration.from_seconds(0.4))
    publishers = [
        robot.create_publisher("/mortal", TWIST, brief),
        robot.create_publisher("/immortal", TWIST, rosglass.QoS(1000)),
    ]
    ages = {"/mortal": [], "/immortal": []}
    for topic, seen in ages.items():
        cockpit.create_subscription(
            topic,
            TWIST,
            raw_callback=lambda s, seen=seen: seen.append((s.received_ns - s.sent_ns) / 1e9),
            qos=rosglass.QoS(1000),
        )
    eventually(lambda: all(p.subscription_count() for p in publishers))

    def publish(seconds):
        for _ in at_rate(0.02, round(seconds / 0.02)):
            for publisher in publishers:
                publisher.publish()

    publish(0.5)
    os.kill(router.pid, signal.SIGSTOP)
    publish(1.2)
    os.kill(router.pid, signal.SIGCONT)
    publish(0.3)
    eventually(lambda: max(ages["/immortal"]) > 0.9)
    assert max(ages["/mortal"]) < 0.6
    assert len(ages["/mortal"]) > 20
    assert ages["/mortal"][-1] < 0.3, "those that follow are fresh"


def test_commands_that_a_stalled_link_would_deliver_late_are_dropped_here(start_router, connect):
    router = start_router()
    robot, cockpit = (
        connect(name, "?mode=client", url=start_router.url) for name in ("robot", "cockpit")
    )
    publisher = cockpit.create_publisher("/cmd_vel", TWIST, rosglass.QoS.command())
    received = []
    robot.create_subscription(
        "/cmd_vel", TWIST, lambda m: received.append(m.linear.x), rosglass.QoS(1000)
    )
    eventually(publisher.subscription_count)
    count = 0

    def drive(seconds):
        nonlocal count
        for _ in at_rate(0.02, round(seconds / 0.02)):
            count += 1
            publisher.publish(linear={"x": float(count)})

    drive(0.5)
    eventually(lambda: len(received) + publisher.dropped == count)
    before = count - publisher.dropped
    os.kill(router.pid, signal.SIGSTOP)
    drive(2.0)
    eventually(lambda: "does not confirm" in publisher.problem)
    during = count
    os.kill(router.pid, signal.SIGCONT)
    drive(0.5)
    eventually(lambda: len(received) + publisher.dropped == count)
    old = [x for x in received if before < x <= during]
    assert len(old) < 40, "of 100; about 6 on a machine that is not busy"
    assert received[-1] == count, "those that follow are delivered"
    assert received == sorted(received)


def test_each_command_that_waits_behind_images_is_delivered_or_counted(start_router, connect):
    router = start_router()
    robot, cockpit = (
        connect(name, "?mode=client", url=start_router.url) for name in ("robot", "cockpit")
    )
    publisher = cockpit.create_publisher("/cmd_vel", TWIST, rosglass.QoS.command())
    camera = cockpit.create_publisher("/camera", IMAGE, rosglass.QoS.sensor_data())
    received, seen = [], []
    robot.create_subscription(
        "/cmd_vel", TWIST, lambda m: received.append(m.linear.x), rosglass.QoS(1000)
    )
    robot.create_subscription("/camera", IMAGE, seen.append, rosglass.QoS.sensor_data())
    eventually(publisher.subscription_count)
    eventually(camera.subscription_count)
    picture = camera.type.encode(data=bytes(4_000_000))
    eventually(lambda: camera.publish_serialized(picture) or seen)
    os.kill(router.pid, signal.SIGSTOP)
    for _ in range(5):  # more than the system takes
        camera.publish_serialized(picture)
    for number in range(20):
        publisher.publish(linear={"x": float(number)})
    os.kill(router.pid, signal.SIGCONT)
    eventually(lambda: len(received) + publisher.dropped == 20)


def test_a_slow_consumer_costs_no_memory(router, start, connect):
    node = connect("cockpit")
    camera = start("-c", CAMERA.format(url=router.url, image=IMAGE))
    ready = threading.Event()
    seen = []

    def look(message):
        seen.append(message.width)
        ready.wait(0.2)

    subscription = node.create_subscription("/camera", IMAGE, look, rosglass.QoS.sensor_data())
    eventually(lambda: subscription.statistics().received > 20)
    before, received = memory(), subscription.statistics().received
    eventually(lambda: subscription.statistics().received > received + 150)
    statistics = subscription.statistics()
    # 140 MB have been received since.
    assert memory() - before < 40e6
    assert len(seen) < 100
    assert 0 <= statistics.received - statistics.dropped - len(seen) <= 10
    ready.set()
    camera.end()


def test_rubbish_is_named_and_disturbs_nothing(router, connect, caplog):
    zenoh = pytest.importorskip("zenoh")
    node = connect("cockpit")
    good, received = connect("robot"), []
    qos = rosglass.QoS(1000)
    node.create_subscription("/count", TWIST, lambda m: received.append(m.linear.x), qos)
    server = node.create_service_server("/add", ADD, lambda r: {"sum": r.a + r.b})
    config = zenoh.Config()
    config.insert_json5("mode", '"client"')
    config.insert_json5("connect/endpoints", f'["{router.listen}"]')
    twist, add = rosglass.load(TWIST), rosglass.load(ADD)
    publisher = good.create_publisher("/count", TWIST)
    eventually(publisher.subscription_count)
    caplog.set_level(logging.WARNING)
    caplog.clear()
    with zenoh.open(config) as session:
        session_id = str(session.info.zid())
        tokens = [
            session.liveliness().declare_token(f"@ros2_lv/0/{session_id}/{rest}")
            for rest in ("x", "0/1/XX/%/%/node", "0/2/MP/%/%/node/%t/type", "0/3/MS/%/%/n/%t/a/b/c")
        ]
        key = f"0/count/geometry_msgs::msg::dds_::Twist_/{twist.rihs01}"
        service = f"0/add/example_interfaces::srv::dds_::AddTwoInts_/{add.rihs01}"
        for number in range(300):
            session.put(key, b"\x00\x01\x00\x00" + os.urandom(number % 40), attachment=b"?" * 33)
            session.put(key, os.urandom(number % 7))
            session.put(key + "/more", b"")
            if number % 10 == 0:
                publisher.publish(linear={"x": number})
        refused = [
            [reply.err is not None for reply in session.get(service, timeout=2, **request)]
            for request in (
                {},
                {"payload": b"no"},
                {"payload": b"\x00\x01\x00\x00", "attachment": b"x"},
            )
        ]
        assert refused == [[True], [True], [True]]
        eventually(lambda: 290 in received)
        del tokens
    assert [x for x in received if x in range(0, 300, 10)] == [*range(0, 300, 10)]
    client = good.create_service_client("/add", ADD)
    assert client.call({"a": 1, "b": 2}).sum == 3
    assert server.problem == ""
    messages = [record.getMessage() for record in caplog.records]
    for what in ("invalid graph token", "/count", "/add"):
        assert any(what in line for line in messages), what
    assert len(messages) < 20, messages


def test_a_server_that_answers_rubbish(router, connect, caplog):
    zenoh = pytest.importorskip("zenoh")
    node = connect("cockpit")
    config = zenoh.Config()
    config.insert_json5("mode", '"client"')
    config.insert_json5("connect/endpoints", f'["{router.listen}"]')
    add = rosglass.load(ADD)
    kind = f"example_interfaces::srv::dds_::AddTwoInts_/{add.rihs01}"
    replies = {"short": b"\x00", "empty": b"", "text": b"hello, robot"}
    with zenoh.open(config) as session:
        own = str(session.info.zid())
        kept = []
        for name, data in replies.items():

            def answer(query, data=data):
                query.reply(query.key_expr, data)
                query.drop()

            kept.append(session.declare_queryable(f"0/{name}/{kind}", answer, complete=True))
            token = f"@ros2_lv/0/{own}/0/{len(kept)}/SS/%/%/liar/%{name}/{kind}/::,10:,:,:,,"
            kept.append(session.liveliness().declare_token(token))
        for name in replies:
            client = node.create_service_client(f"/{name}", ADD)
            assert client.wait_for_server(30), client.problem
            with pytest.raises(ServiceError, match=f"/{name}"):
                client.call({"a": 1, "b": 2}, timeout=30)
        # One that lets the request go, without a word.
        kept.append(
            session.declare_queryable(f"0/silent/{kind}", lambda query: query.drop(), complete=True)
        )
        token = f"@ros2_lv/0/{own}/0/99/SS/%/%/liar/%silent/{kind}/::,10:,:,:,,"
        kept.append(session.liveliness().declare_token(token))
        client = node.create_service_client("/silent", ADD)
        assert client.wait_for_server(30), client.problem
        before = time.monotonic()
        with pytest.raises(ConnectionLostError, match="/silent"):
            client.call({"a": 1, "b": 2}, timeout=30)
        assert time.monotonic() - before < 15
        for one in kept:
            one.undeclare()


def test_a_thousand_of_everything_leave_nothing_behind(start_router, connect):
    start_router()
    node, other = (connect(name, url=start_router.url) for name in ("cockpit", "robot"))
    latched = rosglass.QoS.latched()
    other.create_publisher("/map", STRING, latched).publish(data="hall")
    subscription = other.create_subscription("/count", TWIST)

    def cycle(number):
        made = [
            node.create_publisher("/count", TWIST),
            node.create_subscription("/count", TWIST, callback=id),
            node.create_service_server("/add", ADD, lambda r: {"sum": r.a + r.b}),
            node.create_service_client("/add", ADD),
        ]
        if number % 10 == 0:  # these have threads of their own
            made.append(node.create_publisher("/own_map", STRING, latched))
            made.append(node.create_subscription("/map", STRING, callback=id, qos=latched))
        made[0].publish(linear={"x": 1.0})
        for one in made:
            one.close()

    def settled():
        return not other.service_servers("/add") and not other.publishers("/count")

    for number in range(100):
        cycle(number)
    eventually(settled)
    gc.collect()
    threads, files, objects, before = (
        threading.active_count(), open_files(), len(gc.get_objects()), memory(),
    )  # fmt: skip
    for number in range(250):
        cycle(number)
    eventually(settled)
    eventually(lambda: threading.active_count() <= threads)
    gc.collect()
    assert open_files() <= files + 2
    assert len(gc.get_objects()) < objects + 500
    assert memory() - before < 10e6
    assert subscription.statistics().lost == 0, "successive endpoints are distinguished"
    assert node.status().state is ConnectionState.CONNECTED


def test_nodes_that_call_each_other_leave_nothing_behind(router):
    def cycle():
        with (
            rosglass.connect(router.url, "one") as one,
            rosglass.connect(router.url, "two") as two,
        ):
            one.create_service_server("/add", ADD, lambda r: {"sum": r.a + r.b})
            subscription = two.create_subscription("/count", TWIST)
            client = two.create_service_client("/add", ADD)
            assert client.call({"a": 1, "b": 2}, timeout=30).sum == 3
            one.create_publisher("/count", TWIST).publish()
            client.call_async({"a": 1, "b": 2})  # left alone with its call
            subscription.wait(0.001)

    for _ in range(4):
        cycle()
    time.sleep(0.5)
    threads, files, before = threading.active_count(), open_files(), memory()
    for _ in range(12):
        cycle()
    eventually(lambda: threading.active_count() <= threads)
    eventually(lambda: open_files() <= files)
    assert memory() - before < 30e6


def test_nodes_that_come_and_go_beside_others_leave_no_links_behind(router, connect):
    stay = [connect(name) for name in ("cockpit", "robot", "arm")]

    def cycle():
        with rosglass.connect(router.url, "brief") as node:
            node.create_publisher("/count", TWIST).publish()

    cycle()
    eventually(lambda: all(len(node.nodes()) == 3 for node in stay))
    threads, files = threading.active_count(), open_files()
    for _ in range(20):
        cycle()
    eventually(lambda: all(len(node.nodes()) == 3 for node in stay))
    eventually(lambda: open_files() <= files)
    eventually(lambda: threading.active_count() <= threads)


BUSY = """
import sys, threading, time, rosglass
node = rosglass.connect({url!r}, "busy")
latched = rosglass.QoS.latched()
node.create_service_server("/add", {add!r}, lambda r: {{"sum": r.a + r.b}})
node.create_subscription("/count", {twist!r}, id)
node.create_subscription("/map", {twist!r}, id, latched)
publishers = [
    node.create_publisher("/count", {twist!r}), node.create_publisher("/map", {twist!r}, latched)
]
client = node.create_service_client("/add", {add!r})
try:
    print("busy", flush=True)
    while True:
        for publisher in publishers:
            publisher.publish()
        client.call({{"a": 1, "b": 2}})
        node.create_subscription("/count").wait(0.001)
except KeyboardInterrupt:
    print("interrupted", flush=True)
"""


@pytest.mark.parametrize("delay", [0.0, 0.02, 0.05, 0.1, 0.2, 0.5])
def test_ctrl_c_at_any_moment(delay, router):
    program = BUSY.format(url=router.url, add=ADD, twist=TWIST)
    process = subprocess.Popen(
        [sys.executable, "-c", program],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "busy\n"
    time.sleep(delay)
    process.send_signal(signal.SIGINT)
    out, errors = process.communicate(timeout=60)
    assert (process.returncode, out, errors) == (0, "interrupted\n", "")


@pytest.fixture
def other_session(router):
    """A Zenoh session without a node, for confusion that Zenoh itself causes only by chance."""
    zenoh = pytest.importorskip("zenoh")
    config = zenoh.Config()
    config.insert_json5("mode", '"client"')
    config.insert_json5("connect/endpoints", f'["{router.listen}"]')
    with zenoh.open(config) as session:
        yield session


def test_messages_on_the_wrong_topic_are_dropped_and_counted(connect, other_session, caplog):
    robot, cockpit = connect("robot"), connect("cockpit")
    publisher = robot.create_publisher("/flashlight/state", STRING)
    got = []
    subscription = cockpit.create_subscription("/emergency_stop/state", STRING, got.append)
    (other,) = eventually(lambda: cockpit.publishers("/flashlight/state"))
    string = rosglass.load(STRING)
    key = topic_key(0, "/emergency_stop/state", STRING, string.rihs01)
    numbers = itertools.count(1)

    def put(text, gid):
        number = next(numbers)
        note = Attachment(number, time.time_ns(), gid).encode()
        other_session.put(key, string.encode(data=text), attachment=note)
        return number

    def dropped(more_than):
        put("wrong", other.gid)
        found = re.match(r"(\d+) messages of other topics, such as /fla", subscription.problem)
        return found and int(found[1]) > more_than

    eventually(lambda: dropped(3))
    publisher.close()
    eventually(lambda: not cockpit.publishers("/flashlight/state"))
    number = put("wrong", other.gid)
    eventually(lambda: dropped(number), what="of a publisher that has left")
    # Publishers of dora-rs and others have identities that no token announces.
    eventually(lambda: put("right", bytes(range(16))) and got)
    assert {message.data for message in got} == {"right"}
    logged = [each for each in caplog.records if "dropping a message of /fla" in each.message]
    assert len(logged) == 1


def test_requests_to_the_wrong_service_are_refused(connect, other_session):
    robot, cockpit = connect("robot"), connect("cockpit")
    asked = []
    kind = rosglass.load("std_srvs/srv/Trigger")
    robot.create_service_server("/emergency_stop/reset", kind, asked.append)
    client = cockpit.create_service_client("/flashlight/toggle", kind)
    (endpoint,) = eventually(lambda: robot.service_clients("/flashlight/toggle"))
    key = topic_key(0, "/emergency_stop/reset", kind.name, kind.rihs01)

    def refused():
        note = Attachment(1, time.time_ns(), endpoint.gid).encode()
        data = kind.request.encode({})
        replies = list(other_session.get(key, payload=data, attachment=note))
        return [reply.err.payload.to_string() for reply in replies if reply.err is not None]

    (reason,) = eventually(refused)
    assert "to /emergency_stop/reset, not to /flashlight/toggle" in reason
    assert asked == []
    client.close()


#: Ends while its node waits for a router that accepts the connection and never answers. Python's
#: own end is made to last longer than that.
LEAVING = """
import sys, threading, time
import rosglass
from rosglass.wires.zenoh import middleware

opening, open_session = threading.Event(), middleware.open_session

def open_slowly(config):
    opening.set()
    return open_session(config)

class Last:
    def __del__(self, sleep=time.sleep):
        sleep(4)

middleware.open_session = open_slowly
sys.last_of_all = Last()
node = rosglass.connect("{url}?mode=client", "leaving", own_services=False)
assert opening.wait(20)
"""


def test_a_program_that_ends_while_it_connects_is_not_aborted():
    with socket.create_server(("127.0.0.1", 0)) as silent:
        url = f"zenoh://127.0.0.1:{silent.getsockname()[1]}"
        command = [sys.executable, "-c", LEAVING.format(url=url)]
        process = subprocess.run(command, check=False, capture_output=True, text=True, timeout=120)
    assert (process.returncode, process.stderr) == (0, "")
