"""Real ROS 2 nodes: rclpy of Jazzy over Fast DDS, each way; docs/peers.md names these tests."""

from __future__ import annotations

import itertools
import os
import threading
import zlib
from concurrent.futures import Future
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from waiting import eventually

import rosglass
from rosglass.comm import GoalStatus, QoS, Reliability
from rosglass.interfaces import Library, rihs01

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from rosglass.comm import Node

NUMBERS = itertools.count(1)
PEER = Path(__file__).parent / "peers/rclpy_peer.py"
NAME = "/robot/real"
STRING, TWIST, IMAGE = "std_msgs/msg/String", "geometry_msgs/msg/Twist", "sensor_msgs/msg/Image"
SWITCH = "std_srvs/srv/SetBool"
#: Types that only the peer knows.
BASIC, ECHO = "test_msgs/msg/BasicTypes", "test_msgs/srv/BasicTypes"
#: Status of goals (action_msgs/msg/GoalStatus).
SUCCEEDED, CANCELED = 4, 5
FIBONACCI = "test_msgs/action/Fibonacci"

pytestmark = pytest.mark.peers
pytest.importorskip("cyclonedds", reason='needs pip install "rosglass[dds]"')


@pytest.fixture(scope="module")
def start_rclpy_peer(start_program, rclpy_python, dds_domain) -> Callable[..., Any]:
    def start(name: str) -> Any:
        env = os.environ | {"ROS_DOMAIN_ID": str(dds_domain)}
        process = start_program(str(rclpy_python), "-u", str(PEER), name, env=env)
        process.event("ready")
        return process

    return start


@pytest.fixture(scope="module")
def peer(start_rclpy_peer) -> Iterator[Any]:
    process = start_rclpy_peer("real")
    yield process
    process.end()


@pytest.fixture(scope="module")
def node(dds_domain) -> Iterator[Node]:
    """Our node, without any definition of test_msgs."""
    made = rosglass.connect(f"dds://?domain={dds_domain}", "cockpit", "/own")
    yield made
    made.close()


@pytest.fixture(scope="module")
def informed(dds_domain, rclpy_python) -> Iterator[Node]:
    """Our node, with the peer's definitions."""
    library = Library()
    library.add_path(rclpy_python.parents[1] / "share")
    made = rosglass.connect(f"dds://?domain={dds_domain}", "informed", "/own", library=library)
    yield made
    made.close()


def do(peer: Any, task: str, **arguments: Any) -> Any:
    """Have the peer run a task; return its result."""
    number = next(NUMBERS)
    peer.ask(do=task, number=number, **arguments)
    return peer.event(f"done {number}", 90)


# -- topics ----------------------------------------------------------------------------------------


def test_we_receive_what_rclpy_publishes(peer, node):
    do(peer, "advertise", topic="/chatter", type=STRING, depth=50)
    got: list[Any] = []
    with node.create_subscription("/chatter", STRING, got.append, QoS(50)) as subscription:
        eventually(subscription.publisher_count)
        values = [{"data": f"Grüße {n}"} for n in range(20)]
        do(peer, "publish", topic="/chatter", values=values)
        eventually(lambda: len(got) >= 20, timeout=30, what=lambda: got)
    assert [message.data for message in got] == [value["data"] for value in values]


def test_rclpy_receives_what_we_publish(peer, node):
    do(peer, "subscribe", topic="/cmd_vel", type=TWIST, depth=50)
    with node.create_publisher("/cmd_vel", TWIST, QoS(50)) as publisher:
        eventually(publisher.subscription_count)
        for n in range(20):
            publisher.publish({"linear": {"x": n / 2}, "angular": {"z": -n}})
        got = [peer.event("received /cmd_vel") for _ in range(20)]
    assert [value["linear"]["x"] for value in got] == [n / 2 for n in range(20)]
    assert [value["angular"]["z"] for value in got] == [-n for n in range(20)]


def test_latched_message_of_rclpy_is_received_late(peer, node):
    do(peer, "advertise", topic="/map_name", type=STRING, latched=True, depth=1)
    do(peer, "publish", topic="/map_name", values=[{"data": "a"}, {"data": "b"}], matched=0)
    got: list[Any] = []
    with node.create_subscription("/map_name", STRING, got.append, QoS.latched()):
        eventually(lambda: got)
    assert [message.data for message in got] == ["b"]


def test_our_latched_message_reaches_rclpy_late(peer, node):
    with node.create_publisher("/our_map", STRING, QoS.latched()) as publisher:
        for text in "ab":
            publisher.publish(data=text)
        do(peer, "subscribe", topic="/our_map", type=STRING, latched=True)
        assert peer.event("received /our_map") == {"data": "b"}


def test_best_effort_both_ways(peer, node):
    do(peer, "advertise", topic="/scan_name", type=STRING, best_effort=True)
    do(peer, "subscribe", topic="/our_scan", type=STRING, best_effort=True)
    got: list[Any] = []
    qos = QoS.sensor_data()
    with (
        node.create_subscription("/scan_name", STRING, got.append, qos) as subscription,
        node.create_publisher("/our_scan", STRING, qos) as publisher,
    ):
        eventually(lambda: subscription.publisher_count() and publisher.subscription_count())
        do(peer, "publish", topic="/scan_name", values=[{"data": "theirs"}] * 3, period=0.1)
        eventually(lambda: got)
        publisher.publish(data="ours")
        assert peer.event("received /our_scan") == {"data": "ours"}
    assert got[0].data == "theirs"


def test_profiles_that_do_not_match_are_named_here(peer, node):
    do(peer, "advertise", topic="/volatile", type=STRING, best_effort=True)
    with node.create_subscription("/volatile", STRING, print, QoS.latched()) as subscription:
        problem = eventually(lambda: subscription.problem)
    assert NAME in problem
    assert "reliab" in problem


@pytest.mark.parametrize("size", [100_000, 6_220_800])
def test_big_messages_both_ways(peer, node, size):
    picture = {"height": 1, "width": size // 3, "step": size, "encoding": "rgb8"}
    data = (bytes(range(251)) * (size // 251 + 1))[:size]
    got: list[Any] = []
    do(peer, "advertise", topic=f"/theirs{size}", type=IMAGE)
    do(peer, "subscribe", topic=f"/ours{size}", type=IMAGE)
    with (
        node.create_subscription(f"/theirs{size}", IMAGE, got.append) as subscription,
        node.create_publisher(f"/ours{size}", IMAGE) as publisher,
    ):
        eventually(lambda: subscription.publisher_count() and publisher.subscription_count())
        value = picture | {"data": {"fill": size}}
        do(peer, "publish", topic=f"/theirs{size}", values=[value])
        eventually(lambda: got)
        publisher.publish(picture | {"data": data})
        assert peer.event(f"received /ours{size}")["data"] == [size, zlib.crc32(data)]
    assert bytes(got[0].data) == data


@pytest.mark.parametrize(
    ("width", "height", "rate", "count", "depth"),
    # Where all processors are busy, rclpy stands still for a third of a second, and 93 MB a second
    # come late: none is displaced by the next ones.
    [(640, 480, 30, 120, 30), (1920, 1080, 15, 45, 45)],
)
def test_rclpy_receives_every_image(peer, node, width, height, rate, count, depth):
    """Its socket holds 208 kB by default; bursts of ours overran that again and again."""
    topic = f"/camera{width}"
    do(peer, "subscribe", topic=topic, type=IMAGE, quiet=True, depth=depth)
    picture = rosglass.load(IMAGE).create(
        height=height, width=width, encoding="rgb8", step=3 * width, data=bytes(3 * width * height)
    )
    with node.create_publisher(topic, IMAGE, QoS(depth)) as publisher:
        eventually(publisher.subscription_count)
        ended = threading.Event()
        sent: list[int] = []

        def publish() -> None:
            publisher.publish(picture)
            sent.append(1)
            if len(sent) == count:
                timer.close()
                ended.set()

        timer = node.create_timer(1 / rate, publish)
        assert ended.wait(120)
        arrived = iter(lambda: peer.event(f"received {topic}", 5, otherwise=None), None)
        assert sum(1 for _ in itertools.islice(arrived, count)) == count


def test_rclpy_answers_while_images_displace_each_other(start_rclpy_peer, node):
    """Fast DDS spun for ever after a GAP for an image that it had received in part."""
    peer = start_rclpy_peer("displaced")
    do(peer, "subscribe", topic="/displaced", type=IMAGE, quiet=True, depth=1)
    image = rosglass.load(IMAGE).create(
        height=1080, width=1920, encoding="rgb8", step=5760, data=bytes(1080 * 5760)
    )
    with node.create_publisher("/displaced", IMAGE, QoS(1)) as publisher:
        eventually(publisher.subscription_count)
        count = 0

        def publish() -> None:
            nonlocal count
            count += 1
            publisher.publish(image)

        with node.create_timer(0.01, publish):
            eventually(lambda: count > 200, timeout=60)
        assert peer.event("received /displaced")
        assert do(peer, "graph")["nodes"]
        assert publisher.dropped > 0
        eventually(lambda: publisher.problem.endswith("publish smaller ones, or fewer"))
    peer.end()


def test_publisher_of_lost_large_images_names_the_setting(on_two_machines, rclpy_python):
    """Fast DDS takes 40 MB/s in datagrams of one packet, the default if there is a network."""
    script = Path(__file__).parent / "peers/one_machine_fastdds.py"
    env = {"ROS_DOMAIN_ID": "0", "CYCLONEDDS_URI": ""}
    seen = on_two_machines(script, str(rclpy_python), env=env)
    assert seen["before"] == ""
    assert seen["dropped"] > 0
    assert seen["problem"].startswith("large messages are dropped here, as subscribers on Fast DDS")
    (finding,) = seen["doctor"]
    assert "/camera" in finding["text"]
    for text in (seen["problem"], finding["fix"]):
        assert "dds://?range=localhost" in text
        assert "CYCLONEDDS_URI='<General><MaxMessageSize>31000B<" in text
    assert seen["logged"] == [f"/camera: {seen['problem']}"]


# -- services --------------------------------------------------------------------------------------


def test_we_call_rclpy(peer, node):
    do(peer, "serve", service="/real/enable", type=SWITCH)
    with node.create_service_client("/real/enable", SWITCH) as client:
        assert client.wait_for_server(30), client.problem
        client.call({"data": True}, timeout=30)
        assert client.problem == ""
    assert peer.event("served /real/enable") == {"data": True}


def test_rclpy_calls_us(peer, node):
    got: list[bool] = []

    def switch(request: Any) -> dict[str, Any]:
        got.append(request.data)
        return {"success": request.data, "message": "done"}

    with node.create_service_server("/own/enable", SWITCH, switch) as server:
        requests = [{"data": n % 2 == 0} for n in range(10)]
        answers = do(peer, "call", service="/own/enable", type=SWITCH, requests=requests)
        assert server.problem == ""
    assert got == [n % 2 == 0 for n in range(10)]
    assert answers == [{"success": n % 2 == 0, "message": "done"} for n in range(10)]


def test_we_call_rclpy_a_hundred_times_at_once(peer, node):
    """A server of ROS 2 keeps 10 requests that it has not taken; the others used to be lost."""
    do(peer, "serve", service="/real/slow", type=SWITCH, delay=0.01)
    with (
        node.create_service_client("/real/slow", SWITCH) as client,
        node.create_service_client("/real/slow", SWITCH) as other,
    ):
        assert client.wait_for_server(30), client.problem
        calls = [end.call_async({"data": True}, timeout=60) for end in (client, other) * 50]
        given_up = calls[60]
        assert given_up.cancel()
        done = [call for call in calls if call is not given_up]
        assert all(call.result(60) for call in done)
    served = [peer.event("served /real/slow") for _ in done]
    assert len(served) == 99
    assert peer.event("served /real/slow", 0.5, otherwise=None) is None


def test_rclpy_gets_fifty_replies_that_are_ready_at_once(peer, node):
    """A client of ROS 2 keeps 10 replies that it has not taken; the others used to be lost."""
    promised: list[tuple[bool, Future[Any]]] = []

    def answer_all_when_all_have_asked(request: Any) -> Future[Any]:
        promised.append((request.data, Future()))
        if len(promised) == 50:
            for data, promise in promised:
                promise.set_result({"success": not data})
        return promised[-1][1]

    with node.create_service_server("/own/late", SWITCH, answer_all_when_all_have_asked):
        requests = [{"data": n % 3 == 0} for n in range(50)]
        for sent, request in enumerate(requests, 1):
            do(peer, "send_request", service="/own/late", type=SWITCH, request=request)
            # Its own writer keeps but 10 that have not arrived yet.
            eventually(lambda sent=sent: len(promised) == sent)
        answers = do(peer, "take_replies")
    assert [answer["success"] for answer in answers] == [n % 3 != 0 for n in range(50)]


def test_every_basic_type_both_ways(peer, informed):
    do(peer, "serve", service="/real/echo", type=ECHO)
    client = informed.create_service_client("/real/echo", ECHO)
    assert client.wait_for_server(30), client.problem
    values = {
        "bool_value": True, "byte_value": 255, "char_value": 97, "float32_value": 0.5,
        "float64_value": -1e300, "int8_value": -128, "uint8_value": 255, "int16_value": -32768,
        "uint16_value": 65535, "int32_value": -(2**31), "uint32_value": 2**32 - 1,
        "int64_value": -(2**63), "uint64_value": 2**64 - 1, "string_value": "Größe",
    }  # fmt: skip
    assert client.call(values, timeout=30).to_dict() == values

    with informed.create_service_server("/own/echo", ECHO, lambda request: request.to_dict()):
        request = values | {"byte_value": {"octet": 255}}
        assert do(peer, "call", service="/own/echo", type=ECHO, requests=[request]) == [values]


# -- actions ---------------------------------------------------------------------------------------


def test_we_send_goals_to_rclpy(peer, informed):
    do(peer, "act", action="/real/count")
    feedback: list[int] = []
    with informed.create_action_client("/real/count") as client:
        assert client.wait_for_server(30), client.problem
        goal = client.send_goal(
            {"order": 6}, on_feedback=lambda m: feedback.append(len(m.sequence))
        )
        status, result = goal.result(30)
        assert (status, list(result.sequence)) == (GoalStatus.SUCCEEDED, [0, 1, 1, 2, 3, 5])
        assert feedback == [3, 4, 5, 6]
        running = threading.Event()
        endless = client.send_goal({"order": 100_000}, on_feedback=lambda _: running.set())
        assert running.wait(30)
        endless.cancel()
        assert endless.result(30)[0] is GoalStatus.CANCELED
        assert client.problem == ""


def test_we_send_rclpy_thirty_goals_at_once(peer, informed):
    do(peer, "act", action="/real/many")
    with informed.create_action_client("/real/many") as client:
        assert client.wait_for_server(30), client.problem
        goals = [client.send_goal({"order": 4}, timeout=60) for _ in range(30)]
        ended = [goal.result(60) for goal in goals]
    assert {status for status, _ in ended} == {GoalStatus.SUCCEEDED}
    assert [list(result.sequence) for _, result in ended] == [[0, 1, 1, 2]] * 30


def test_rclpy_sends_us_goals(peer, informed):
    def count(goal: Any) -> dict[str, Any]:
        sequence = [0, 1]
        while len(sequence) < goal.goal.order and not goal.wait_for_cancel(0.02):
            sequence.append(min(sequence[-1] + sequence[-2], 1000))
            goal.publish_feedback(sequence=sequence)
        return {"sequence": sequence}

    with informed.create_action_server("/own/count", FIBONACCI, count):
        ended = do(peer, "send_goal", action="/own/count", order=6)
        assert ended == {
            "status": SUCCEEDED, "result": [0, 1, 1, 2, 3, 5], "feedback": [3, 4, 5, 6]
        }  # fmt: skip
        ended = do(peer, "send_goal", action="/own/count", order=100_000, cancel_after=3)
        assert ended["status"] == CANCELED


# -- parameters ------------------------------------------------------------------------------------


def test_we_set_parameters_of_rclpy(peer, node):
    with node.create_parameter_client(NAME) as client:
        changes: list[Any] = []
        client.watch(changes.append)
        assert client.wait_for_server(30)
        assert {"name", "speed"} <= set(client.names())
        assert client.get(["speed", "name"]) == {"speed": 0.5, "name": "rover"}
        results = client.set({"speed": 0.75, "name": 3})
        assert [result.successful for result in results.values()] == [True, False]
        assert "type" in results["name"].reason
        eventually(lambda: [change for change in changes if change.changed == {"speed": 0.75}])
    assert do(peer, "own_parameter", name="speed") == 0.75


def test_rclpy_sets_our_parameters(peer, node):
    node.parameters.declare("gain", 1.5)
    found = do(peer, "parameters", of="/own/cockpit", set={"gain": 2.5, "nix": 1})
    assert node.parameters.get("gain") == 2.5
    assert found["values"][0] == 2.5
    assert found["successful"] == [True, False]
    assert "gain" in found["names"]


# -- graph -----------------------------------------------------------------------------------------


def test_we_see_the_nodes_and_topics_of_rclpy(peer, node):
    do(peer, "advertise", topic="/seen", type=TWIST, best_effort=True)
    eventually(lambda: node.publishers("/seen"))
    eventually(lambda: NAME in [name.full for name in node.nodes()])
    (end,) = eventually(lambda: [e for e in node.publishers("/seen") if e.node.full == NAME])
    assert end.type == TWIST
    assert end.type_hash == rihs01(Library().definition(TWIST))
    assert end.qos.reliability is Reliability.BEST_EFFORT
    assert node.services()[f"{NAME}/get_parameters"] == ["rcl_interfaces/srv/GetParameters"]


def test_rclpy_sees_our_nodes_and_topics(peer, node):
    def seen() -> Any:
        found = do(peer, "graph")
        return found if "/shown" in found["topics"] and "/own/cockpit" in found["nodes"] else None

    def shown() -> Any:
        ends = do(peer, "endpoints", topic="/shown")  # it may not know yet whose they are
        return ends if ends and "UNKNOWN" not in ends[0]["node"] else None

    with (
        node.create_publisher("/shown", TWIST, QoS.latched()),
        node.create_service_server("/shown_service", SWITCH, lambda _: {}),
    ):
        found = eventually(seen)
        assert found["topics"]["/shown"] == [TWIST]
        assert found["services"]["/shown_service"] == [SWITCH]
        ends = eventually(shown)
        assert ends == [
            {
                "node": "/own/cockpit", "type": TWIST, "kind": "PUBLISHER",
                "reliability": "RELIABLE", "durability": "TRANSIENT_LOCAL",
                "hash": rihs01(Library().definition(TWIST)),
            }
        ]  # fmt: skip


# -- types that only the peer knows ----------------------------------------------------------------


def test_a_message_that_only_rclpy_knows(peer, node):
    do(peer, "advertise", topic="/basic", type=BASIC)
    got: list[Any] = []
    with node.create_subscription("/basic", None, got.append) as subscription:
        eventually(subscription.publisher_count)
        eventually(lambda: subscription.type, timeout=30, what=lambda: subscription.problem)
        do(peer, "publish", topic="/basic", values=[{"int32_value": 7, "float64_value": 0.1}])
        eventually(lambda: got)
    assert (got[0].int32_value, got[0].float64_value) == (7, 0.1)


def test_services_and_actions_that_only_rclpy_knows_are_refused_with_the_reason(peer, node):
    do(peer, "serve", service="/real/unknown", type=ECHO)
    with node.create_service_client("/real/unknown") as client:
        problem = eventually(lambda: "Over DDS" in client.problem and client.problem)
    assert ECHO in problem
    package = ECHO.partition("/")[0]
    assert f"ros2 pkg prefix --share {package} says where" in problem
    assert f"--definitions {package} on the command line" in problem


# -- commands: to each, a new participant, Fast DDS introduces itself after some seconds -----------


@pytest.fixture
def rosglass_command(run_command, dds_domain) -> Callable[..., tuple[int, str, str]]:
    def run(*arguments: str) -> tuple[int, str, str]:
        return run_command(*arguments, "--url", f"dds://?domain={dds_domain}")

    return run


@pytest.mark.parametrize("attempt", range(3))
def test_lists_wait_until_rclpy_has_introduced_itself(peer, rosglass_command, attempt):
    do(peer, "advertise", topic=f"/listed{attempt}", type=TWIST)
    assert NAME in rosglass_command("node", "list")[1].splitlines()
    topics = rosglass_command("topic", "list", "--verbose")[1]
    assert f"/listed{attempt}" in topics


@pytest.mark.parametrize("attempt", range(3))
def test_types_that_only_rclpy_knows_are_waited_for(peer, rosglass_command, attempt):
    do(peer, "advertise", topic=f"/unknown{attempt}", type=BASIC, latched=True)
    do(peer, "publish", topic=f"/unknown{attempt}", values=[{"int32_value": 7}], matched=0)
    code, output, error = rosglass_command("interface", "show", BASIC)
    assert (code, "float64 float64_value" in output) == (0, True), error
    echo = ("topic", "echo", "--once", "--qos", "latched", f"/unknown{attempt}")
    code, output, error = rosglass_command(*echo)
    assert (code, "int32_value: 7" in output) == (0, True), output + error
