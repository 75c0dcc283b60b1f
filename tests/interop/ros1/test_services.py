"""Services both ways with rospy, roscpp and the commands."""

from __future__ import annotations

import asyncio
import itertools
from concurrent.futures import Future

import pytest
from waiting import eventually

import rosglass

BOOL, EMPTY, TRIGGER = "std_srvs/SetBool", "std_srvs/Empty", "std_srvs/Trigger"
DONE = {"success": True, "message": "oo"}
_numbers = itertools.count(1)


@pytest.fixture(params=["rospy", "roscpp"])
def peer(request):
    return request.getfixturevalue(f"{request.param}_peer")


@pytest.fixture(params=["rospy", "roscpp"])
def start_peer(request):
    """Start a peer that the test may kill."""
    return request.getfixturevalue(f"start_{request.param}")


@pytest.fixture(params=[False, True], ids=["each call", "persistent"])
def persistent(request):
    return request.param


@pytest.fixture
def name():
    """A service name of the test's own: the peers live on."""
    return f"/service_{next(_numbers)}"


@pytest.fixture
def node(connect):
    return connect("console")


# -- calling theirs ------------------------------------------------------------------------------


@pytest.mark.parametrize("given", [True, False], ids=["type", "no type"])
def test_their_service_is_called(peer, node, name, persistent, given):
    peer.call("serve", service=name, type=BOOL, returns=DONE)
    client = node.create_service_client(name, BOOL if given else None, persistent=persistent)
    assert client.wait_for_server(30), client.problem
    for _ in range(3):
        answer = client.call({"data": True})
        assert (answer.success, answer.message) == (True, "oo")
        assert peer.event("served")["request"] in (True, {"data": True})
    assert client.type.name == "std_srvs/srv/SetBool"
    assert client.problem == ""


def test_services_without_fields_are_called(peer, node, name, persistent):
    peer.call("serve", service=name, type=EMPTY)
    client = node.create_service_client(name, persistent=persistent)
    assert [client.call().to_dict() for _ in range(3)] == [{}] * 3


def test_built_in_services_of_roscpp_nodes_are_called(start_roscpp, node):
    # In a node of its own: Debian's roscpp 1.15.15 crashes when it logs an error afterwards.
    start_roscpp("talkative")
    client = node.create_service_client("/talkative/get_loggers")
    assert "ros.roscpp" in [logger.name for logger in client.call().loggers]


def test_large_requests_and_responses_are_whole(rospy_peer, roscpp_peer, node):
    returned = {"map": {"info": {"width": 1000}, "data": [1, 2, 3] * 100_000}}
    rospy_peer.call("serve", service="/map", type="nav_msgs/GetMap", returns=returned)
    found = node.create_service_client("/map").call(timeout=30)
    assert found.map.data.tolist() == [1, 2, 3] * 100_000
    length = 6_000_000
    roscpp_peer.call("serve", service="/long", type=BOOL, length=length)
    assert node.create_service_client("/long").call(timeout=30).message == "o" * length
    goal = {"map": {"info": {"width": 7}, "data": [5] * 2_000_000}}
    rospy_peer.call("serve", service="/set", type="nav_msgs/SetMap", returns={"success": True})
    assert node.create_service_client("/set").call(goal, timeout=30).success


@pytest.mark.parametrize(
    ("which", "fails", "message"),
    [
        ("rospy", "exception", "error processing request: the arm is stuck"),
        ("rospy", "refusal", "service cannot process request: not homed"),
        ("rospy", "none", "service cannot process request: service handler returned None"),
        ("roscpp", "exception", "the arm is stuck"),
        ("roscpp", "false", "reports a failure without a reason"),
    ],
)
def test_failures_of_peers_are_reported(request, node, name, persistent, which, fails, message):
    peer = request.getfixturevalue(f"{which}_peer")
    peer.call("serve", service=name, type=BOOL, fails=fails)
    client = node.create_service_client(name, BOOL, persistent=persistent)
    for _ in range(2):
        with pytest.raises(rosglass.ServiceError, match=message) as caught:
            client.call()
        assert type(caught.value) is rosglass.ServiceError


def test_another_definition_is_refused_naming_both(peer, node, name):
    peer.call("serve", service=name, type=BOOL, returns=DONE)
    client = node.create_service_client(name, TRIGGER)
    with pytest.raises(rosglass.ServiceError) as caught:
        client.call()
    for kind in (BOOL, TRIGGER):
        assert kind.replace("/", "/srv/") in str(caught.value)
        assert rosglass.load(kind, ros=1).md5 in str(caught.value)
    assert not client.ready


def test_fifty_calls_of_theirs_run_at_once(peer, node, name):
    peer.call("serve", service=name, type=BOOL, returns=DONE, delay=0.02)
    client = node.create_service_client(name, BOOL)

    async def main():
        calls = [client.call_async({"data": True}, timeout=30) for _ in range(50)]
        return [(await call).message for call in calls]

    assert asyncio.run(main()) == ["oo"] * 50


def test_a_call_ends_when_its_time_is_over_and_others_go_on(peer, node, name, persistent):
    peer.call("serve", service=name, type=BOOL, returns=DONE, delay=1.5)
    client = node.create_service_client(name, BOOL, persistent=persistent)
    assert client.wait_for_server(30)
    with pytest.raises(rosglass.TimeoutError, match=r"_peer was sent the request 0\.\d s ago"):
        client.call(timeout=0.5)
    assert client.call(timeout=20).message == "oo"


def test_a_server_that_is_killed_in_mid_call_and_started_again(start_peer, node, name, persistent):
    node_name = f"fragile{next(_numbers)}"
    peer = start_peer(node_name)
    peer.call("serve", service=name, type=BOOL, returns=DONE, delay=60.0)
    client = node.create_service_client(name, BOOL, persistent=persistent)
    call = client.call_async(timeout=50)
    peer.event("served")
    peer.end()
    with pytest.raises(rosglass.ConnectionLostError, match="may have carried it out or not"):
        call.result(30)
    eventually(lambda: not client.ready, what=lambda: client.problem)
    eventually(lambda: f"/{node_name} offers it at rosrpc://" in client.problem)
    waiting = client.call_async({"data": True}, timeout=50)
    again = start_peer(node_name)
    again.call("serve", service=name, type=BOOL, returns=DONE)
    assert waiting.result(30).message == "oo"
    eventually(lambda: client.ready and client.problem == "", what=lambda: client.problem)


def test_readiness_follows_their_server(peer, node, name):
    client = node.create_service_client(name, BOOL)
    changes = []
    client.on_ready_change(changes.append)
    assert not client.wait_for_server(0.3)
    peer.call("serve", service=name, type=BOOL, returns=DONE)
    assert client.wait_for_server(30)
    peer.call("unserve", service=name)
    eventually(lambda: changes == [True, False], what=lambda: f"{changes} {client.problem}")
    eventually(lambda: f"no server offers {name}" in client.problem)  # unregistered, too


def test_the_graph_shows_services_with_types(peer, node, name):
    peer.call("serve", service=name, type=BOOL, returns=DONE)
    eventually(lambda: node.services().get(name) == ["std_srvs/srv/SetBool"])
    (info,) = node.service_servers(name)
    assert info.type_hash == rosglass.load(BOOL, ros=1).md5
    assert info.node.name.endswith("_peer")


# -- offering ours -------------------------------------------------------------------------------


@pytest.fixture
def ours(connect, name):
    """Offer a service of ours; returns its name and the requests it got."""
    robot, seen = connect("robot"), []

    def answer(request):
        seen.append(request.data)
        return {"success": request.data, "message": "oo"}

    with robot.create_service_server(name, BOOL, answer):
        yield name, seen


def test_our_service_is_called_by_them(peer, ours, persistent):
    name, seen = ours
    answers = peer.call(
        "call",
        service=name,
        type=BOOL,
        request={"data": True},
        data=True,
        persistent=persistent,
        count=5,
    )
    assert answers == [DONE] * 5
    assert seen == [True] * 5


def test_our_service_is_called_by_many_at_once(connect, name, rospy_peer):
    promises = []

    def answer(_):
        promises.append(Future())
        if len(promises) == 20:  # none is answered before all have asked
            for promise in promises:
                promise.set_result(DONE)
        return promises[-1]

    connect("robot").create_service_server(name, BOOL, answer)
    answers = rospy_peer.call("call", service=name, type=BOOL, count=20, together=True)
    assert answers == [DONE] * 20


@pytest.mark.parametrize("persistent", [False, True])
def test_our_failures_are_reported_to_peers(connect, name, peer, persistent):
    def answer(request):
        raise ValueError("the arm is stuck")

    with connect("robot").create_service_server(name, TRIGGER, answer):
        answers = peer.call("call", service=name, type=TRIGGER, persistent=persistent, count=2)
    if answers != [False, False]:  # roscpp logs the text, and its caller gets False only
        assert all("error processing request: the arm is stuck" in answer for answer in answers)


def test_peers_get_the_reason_of_a_definition_mismatch(ours, rospy_peer, roscpp_peer, node):
    name, _ = ours
    (message,) = rospy_peer.call("call", service=name, type=TRIGGER)
    for kind in (BOOL, TRIGGER):
        assert rosglass.load(kind, ros=1).md5 in message
    assert f"{name} is std_srvs/SetBool" in message
    assert roscpp_peer.call("call", service=name, type=TRIGGER) == [False]


def test_large_ones_of_ours_are_whole(connect, rospy_peer):
    data = list(range(-100, 100)) * 10_000
    robot = connect("robot")
    with robot.create_service_server(
        "/our_map", "nav_msgs/GetMap", lambda _: {"map": {"info": {"width": 9}, "data": data}}
    ):
        (found,) = rospy_peer.call("call", service="/our_map", type="nav_msgs/GetMap", timeout=30)
    assert found["map"]["info"]["width"] == 9
    assert found["map"]["data"] == data


def test_a_service_moves_from_us_to_them_and_back(connect, peer, node, name):
    robot = connect("robot")
    server = robot.create_service_server(
        name, BOOL, lambda _: {"success": False, "message": "ours"}
    )
    client = node.create_service_client(name, BOOL)
    assert client.call().message == "ours"
    peer.call("serve", service=name, type=BOOL, returns=DONE)
    eventually(lambda: client.call().message == "oo")
    eventually(lambda: f"offers {name} now" in server.problem, what=lambda: server.problem)
    peer.call("unserve", service=name)
    eventually(lambda: server.problem == "", what=lambda: server.problem)
    assert client.call(timeout=30).message == "ours"


# -- the commands --------------------------------------------------------------------------------


def test_rosservice_lists_describes_and_calls_ours(ours, tool):
    name, seen = ours
    eventually(lambda: name in tool("rosservice", "list").split())
    info = dict(line.split(": ", 1) for line in tool("rosservice", "info", name).splitlines())
    assert (info["Node"], info["Type"], info["Args"]) == ("/robot", BOOL, "data")
    assert info["URI"] == tool("rosservice", "uri", name).strip()
    assert info["URI"].startswith("rosrpc://127.0.0.1:")
    assert tool("rosservice", "type", name).strip() == BOOL
    assert tool("rosservice", "args", name).strip() == "data"
    assert name in tool("rosservice", "find", BOOL).split()
    assert 'message: "oo"' in tool("rosservice", "call", name, "true")
    assert seen == [True]


def test_rosservice_prints_our_failure(connect, tool, name):
    def answer(request):
        raise rosglass.ServiceError("not homed")

    with connect("robot").create_service_server(name, TRIGGER, answer):
        eventually(lambda: name in tool("rosservice", "list").split())
        output = tool("rosservice", "call", name, status=None)
    assert "service cannot process request: not homed" in output


def test_rosnode_shows_our_services(ours, tool):
    name, _ = ours
    eventually(lambda: f"* {name}" in tool("rosnode", "info", "/robot"))


def test_a_master_that_is_killed_and_started_again(start_master, start_rospy, connect):
    master = start_master()
    robot = connect("robot", url=master.url)
    console = connect("console", url=master.url)
    robot.create_service_server("/ours", BOOL, lambda _: {"message": "ours"})
    client = console.create_service_client("/ours", BOOL)
    assert client.call().message == "ours"
    master.kill()
    eventually(lambda: console.status().state.value == "lost")
    assert client.call(timeout=30).message == "ours", "it is called where it was"
    master.start()
    eventually(lambda: ["/ours", ["/robot"]] in master.call("getSystemState")[2])
    assert client.call(timeout=30).message == "ours"
    late = start_rospy("late", master=master)
    assert late.call("call", service="/ours", type=BOOL)[0]["message"] == "ours"
