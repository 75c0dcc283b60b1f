"""Services on a wire that the test steers."""

from __future__ import annotations

import asyncio
import concurrent.futures
import gc
import threading
import weakref
from concurrent.futures import Future
from dataclasses import replace

import pytest
from inside import core_of

import rosglass
from rosglass.comm import (
    IMMEDIATE,
    EndpointInfo,
    EndpointKind,
    NodeName,
    Promise,
)
from rosglass.comm.wire import CALL_DROPPED, SERVER_LEFT, RequestId
from rosglass.interfaces import Library
from rosglass.ros2 import Ros2Node
from rosglass.ros2.core import RequestWindow
from rosglass.ros2.rmw_services import ActionServiceClient, ReplyPacer

pytestmark = pytest.mark.usefixtures("quick")

SERVER, CLIENT = EndpointKind.SERVICE_SERVER, EndpointKind.SERVICE_CLIENT
ADD, TRIGGER, SET = (
    "example_interfaces/srv/AddTwoInts",
    "std_srvs/srv/Trigger",
    "std_srvs/srv/SetBool",
)
OTHER_HASH = "RIHS01_" + "0" * 64


def add(request):
    return {"sum": request.a + request.b}


@pytest.fixture
def client(node):
    return node.create_service_client("/add", ADD)


@pytest.fixture
def requester(client, middleware):
    return middleware.requesters[0]


def answer(total=3):
    return rosglass.load(ADD).response.encode({"sum": total})


# -- calling -------------------------------------------------------------------------------------


def test_server_in_the_graph_is_called_once_it_is_linked(client, requester, middleware, eventually):
    requester.linked = False
    middleware.appear(SERVER, "/add", ADD, rosglass.load(ADD).rihs01)
    call = client.call_async({"a": 1})
    eventually(lambda: "/robot offers it, but is not linked yet" in client.problem)
    assert requester.sent == []
    requester.linked = True  # without news
    eventually(lambda: requester.sent)
    requester.reply(1, answer())
    assert call.result(30).sum == 3


def test_calls_in_flight_are_answered_in_any_order(client, requester):
    requester.linked = True
    calls = [client.call_async({"a": value}) for value in range(8)]
    assert client.pending == 8
    for number in range(8, 0, -1):
        requester.reply(number, answer(number))
    requester.reply(7, answer(0))  # twice, and one that was not requested
    requester.reply(99, answer(0))
    assert [call.result(0).sum for call in calls] == list(range(1, 9))
    assert client.pending == 0


def test_eight_requests_are_open_at_a_time_and_the_others_follow_in_order(client, requester):
    """A server of ROS 2 keeps 10 requests that it has not taken, and drops the oldest."""
    requester.linked = True
    calls = [client.call_async({"a": value}) for value in range(20)]
    assert len(requester.sent) == 8
    assert calls[10].cancel()
    requester.reply(3, answer())
    assert len(requester.sent) == 9
    calls[0].cancel()  # frees its slot
    assert len(requester.sent) == 10
    for number in range(1, 20):
        requester.reply(number, answer(number))
    asked = [int.from_bytes(data[4:12], "little") for data in requester.sent]
    assert asked == [value for value in range(20) if value != 10]
    assert all(call.done() for call in calls)


def test_clients_of_a_node_share_the_places_of_a_service(node, client, requester, middleware):
    other = node.create_service_client("/add", ADD)
    second = middleware.requesters[1]
    requester.linked = second.linked = True
    first_calls = [client.call_async() for _ in range(6)]
    calls = [other.call_async() for _ in range(6)]
    assert (len(requester.sent), len(second.sent)) == (6, 2)
    for number in range(1, 5):
        requester.reply(number, answer())
    assert len(second.sent) == 6
    assert not any(call.done() for call in calls)
    assert sum(call.done() for call in first_calls) == 4


def test_blocking_call_waits_for_room_in_the_window(client, requester, eventually):
    requester.linked = True
    with concurrent.futures.ThreadPoolExecutor(12) as pool:
        calls = [pool.submit(client.call, {"a": n}) for n in range(12)]
        for number in range(1, 13):
            eventually(lambda number=number: len(requester.sent) >= number)
            requester.reply(number, answer(number))
        assert sorted(call.result(30).sum for call in calls) == list(range(1, 13))


def test_call_that_found_no_room_in_the_window_reports_it(client, requester):
    requester.linked = True
    held = [client.call_async(timeout=None) for _ in range(8)]
    with pytest.raises(
        rosglass.ServiceUnavailableError, match=r"8 requests before it.*nothing was"
    ):
        client.call(timeout=0.05)
    assert len(requester.sent) == 8
    assert not any(call.done() for call in held)


def test_requests_that_a_server_holds_for_long_do_not_hold_up_others(eventually):
    window = RequestWindow(stall_s=0.1)
    assert all(window.enter(n, print) for n in range(8))
    assert not window.enter(8, print)
    eventually(lambda: window.enter(8, print))
    assert window.leave(0) == []  # it does not count any more
    assert all(window.enter(n, print) for n in range(9, 16))
    assert not window.enter(16, print)
    assert window.leave(8) == [print]


def test_requests_that_are_held_do_not_keep_their_places_while_others_move(eventually):
    window = RequestWindow(stall_s=0.2)
    assert all(window.enter(f"held {n}", print) for n in range(7))
    numbers = iter(range(10**9))

    def places():
        """Return how many places are free, as requests come and go."""
        entered = []
        while window.enter(number := next(numbers), print):
            entered.append(number)
        for number in entered:
            window.leave(number)
        return len(entered)

    assert places() == 1
    eventually(lambda: places() == 8)


def test_replies_to_one_client_come_in_bursts_that_it_can_keep(node, middleware, eventually):
    promises = []
    service = node.create_service_server("/add", ADD, lambda _: promises.append(Future()) or promises[-1])  # fmt: skip  # noqa: E501
    (replier,) = middleware.repliers
    data = rosglass.load(ADD).request.encode({})
    for number in range(30):
        replier.handle_request(RequestId(b"w" * 16, number), data)
    replier.handle_request(RequestId(b"x" * 16, 99), data)
    eventually(lambda: len(promises) == 31)
    for promise in promises:
        promise.set_result({})
    numbers = [request.sequence for request, _ in replier.replies]
    assert 99 in numbers  # another client's does not wait
    assert [n for n in numbers if n != 99] == list(range(len(numbers) - 1))
    assert len(numbers) < 31
    eventually(lambda: len(replier.replies) == 31)
    assert sorted(r.sequence for r, _ in replier.replies) == [*range(30), 99]
    service.close()


def test_no_reply_overtakes_one_that_waited(monkeypatch):
    class LaterByHand:
        def after(self, _, job):
            self.job = job

    later, sent = LaterByHand(), []
    pacer = ReplyPacer(later)
    monkeypatch.setattr("rosglass.ros2.rmw_services._BURST_S", 3600)
    for _ in range(10):
        pacer.on_request(b"w")
    for number in range(8):
        assert not pacer.on_reply(b"w")
        pacer.send_later(b"w", lambda number=number: sent.append(number))

    def send_ninth():
        assert not pacer.on_reply(b"w")
        pacer.send_later(b"w", lambda: sent.append(9))
        sent.append(8)

    pacer.send_later(b"w", send_ninth)
    assert sent == list(range(8))
    monkeypatch.setattr("rosglass.ros2.rmw_services._BURST_S", 0)
    later.job()
    assert sent == list(range(10))
    pacer.on_request(b"w")
    assert pacer.on_reply(b"w")


def test_middleware_receives_the_timeout_of_a_call(client, requester):
    requester.linked = True
    client.call_async(timeout=5)
    client.call_async(timeout=None)
    client.call_async(timeout=float("inf"))
    assert requester.timeouts[0] == pytest.approx(5, abs=0.5)
    assert requester.timeouts[1:] == [None, None]


# -- what does not come --------------------------------------------------------------------------


def test_cancelled_call_is_not_sent_or_its_reply_dropped(robot, client, node, middleware):
    waiting = client.call_async({"a": 1})
    assert waiting.cancel()
    requester = middleware.requesters[0]
    requester.linked = True
    sent = client.call_async({"a": 2})
    assert sent.cancel()
    assert sent.cancel()
    assert len(requester.sent) == 1
    assert requester.forgotten == [1]
    requester.reply(1, answer())
    with pytest.raises(concurrent.futures.CancelledError):
        sent.result(0)
    done = concurrent.futures.wait([waiting, sent], timeout=30).done
    assert done == {waiting, sent}
    assert client.pending == 0


def test_error_in_place_of_a_reply(client, requester):
    requester.linked = True
    call = client.call_async()
    requester.reply(1, None, "the arm is off")
    with pytest.raises(rosglass.ServiceError, match="call of /add failed: the arm is off"):
        call.result(0)


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (b"", "ADD_Response"),
        (b"\0\1\0\0abc", "at byte 4"),
        (b"\0\1\0\0" + bytes(40), "32 bytes left over"),
        (b"\7\7\0\0" + bytes(8), "ADD_Response"),
    ],
)
def test_reply_that_cannot_be_decoded(client, requester, middleware, data, reason):
    requester.linked = True
    middleware.appear(SERVER, "/add", ADD, rosglass.load(ADD).rihs01)
    call = client.call_async()
    requester.reply(1, data)
    reason = reason.replace("ADD", ADD)
    with pytest.raises(rosglass.ServiceError, match=reason) as caught:
        call.result(0)
    assert "/robot answered the call of /add with bytes that are no" in str(caught.value)


def test_empty_response_is_accepted_with_any_padding(node, middleware):
    client = node.create_service_client("/clear", "std_srvs/srv/Empty")
    middleware.requesters[0].linked = True
    for number, body in enumerate((b"", b"\0", b"\0\0\0\0"), 1):
        call = client.call_async()
        middleware.requesters[0].reply(number, b"\0\1\0\0" + body)
        assert call.result(0).type.name == "std_srvs/srv/Empty_Response"


def test_calls_end_soon_when_their_server_is_gone(client, requester, middleware, monkeypatch):
    monkeypatch.setattr("rosglass.comm.service_client._GRACE_S", 0.05)
    requester.linked = True
    key = middleware.appear(SERVER, "/add", ADD, rosglass.load(ADD).rihs01, gid=b"1" * 16)
    call = client.call_async(timeout=60)
    middleware.graph.remove(key)
    reason = (
        "server of /add went away before it answered the request sent .* may have carried it out"
    )
    with pytest.raises(rosglass.ConnectionLostError, match=reason):
        call.result(30)


def test_server_only_ends_a_call_without_server_and_no_other(
    client, requester, monkeypatch, eventually
):
    with pytest.raises(rosglass.ServiceUnavailableError, match=r"within 0\.3 s: no server offers"):
        client.call_async(timeout=0.3, server_only=True).result(30)
    requester.linked = True
    eventually(lambda: client.ready)
    calls = [client.call_async(timeout=0.05, server_only=True) for _ in range(10)]
    assert client.call_async(timeout=0.1).exception(30) is not None  # all are over their limit now
    assert requester.timeouts == [None] * 8
    assert not any(call.done() for call in calls)
    requester.reply(1, answer())
    assert calls[0].result(30).sum == 3
    eventually(lambda: len(requester.sent) == 9)
    monkeypatch.setattr("rosglass.comm.service_client._GRACE_S", 0.05)
    requester.linked = False
    assert isinstance(calls[9].exception(30), rosglass.ServiceUnavailableError)
    with pytest.raises(rosglass.TimeoutError, match="may still carry it out"):
        calls[1].result(30)
    eventually(lambda: client.pending == 0)


def follow(client) -> None:
    """Let a client look at what a discovered server has changed."""
    client._follow(True, False)


def test_server_only_keeps_waiting_while_a_server_is_away_for_a_moment(client, requester):
    requester.linked = True
    sent = client.call_async(timeout=0.0, server_only=True)
    follow(client)
    requester.linked = False  # as a restarted router hides all nodes
    waiting = client.call_async(timeout=0.0, server_only=True)
    follow(client)
    assert not sent.done()
    assert not waiting.done()
    requester.linked = True
    follow(client)
    assert len(requester.sent) == 2


def test_server_that_comes_back_soon_keeps_its_calls(client, requester, middleware, eventually):
    changes = []
    client.on_ready_change(changes.append)
    requester.linked = True
    where = ("/add", ADD, rosglass.load(ADD).rihs01)
    key = middleware.appear(SERVER, *where, gid=b"1" * 16)
    eventually(lambda: changes == [True])
    call = client.call_async(timeout=60)
    requester.linked = False
    middleware.graph.remove(key)
    eventually(lambda: changes == [True, False])
    middleware.appear(SERVER, *where, gid=b"1" * 16)
    requester.linked = True
    eventually(lambda: changes == [True, False, True])
    requester.reply(1, answer())
    assert call.result(0).sum == 3


def test_calls_end_when_their_server_was_away_and_is_back(
    client, requester, middleware, monkeypatch
):
    monkeypatch.setattr("rosglass.comm.service_client._GRACE_S", 0.05)
    requester.linked = True
    middleware.appear(SERVER, "/add", ADD, rosglass.load(ADD).rihs01, gid=b"1" * 16)
    calls = [client.call_async(timeout=None) for _ in range(2)]
    requester.abandoned.add(1)
    with pytest.raises(rosglass.ConnectionLostError, match="went away before it answered"):
        calls[0].result(30)
    requester.reply(2, answer())
    assert calls[1].result(0).sum == 3


def test_patient_calls_wait_for_their_server_to_be_back(node, middleware, monkeypatch):
    monkeypatch.setattr("rosglass.comm.service_client._GRACE_S", 0.05)
    client = ActionServiceClient(core_of(node), "/add", ADD, waits_for_reconnect=True)
    (requester,) = middleware.requesters
    key = middleware.appear(SERVER, "/add", ADD, rosglass.load(ADD).rihs01, gid=b"1" * 16)
    requester.linked = True
    call = client.call_async(timeout=None)
    requester.linked = False
    requester.abandoned.add(1)
    middleware.graph.remove(key)
    with pytest.raises(rosglass.TimeoutError):
        call.result(0.5)
    requester.linked = True
    with pytest.raises(rosglass.ConnectionLostError):
        call.result(30)


@pytest.mark.parametrize("reason", [SERVER_LEFT, CALL_DROPPED])
def test_call_ends_when_the_middleware_reports_a_lost_server(client, requester, reason):
    requester.linked = True
    call = client.call_async()
    requester.reply(1, None, reason)
    with pytest.raises(rosglass.ConnectionLostError, match="went away before it answered"):
        call.result(0)


def test_middleware_that_ends_the_call_of_a_server_that_left(client, requester, middleware):
    requester.linked = True
    key = middleware.appear(SERVER, "/add", ADD, rosglass.load(ADD).rihs01, gid=b"1" * 16)
    call = client.call_async()
    middleware.graph.remove(key)
    requester.reply(1, None, "somehow")
    with pytest.raises(rosglass.ConnectionLostError, match="went away before it answered"):
        call.result(0)


def test_middleware_that_cannot_send(client, requester, caplog):
    requester.linked = True
    for error, expected in (
        (rosglass.ConnectionLostError("no link"), rosglass.ConnectionLostError),
        (OSError("cable"), rosglass.ServiceError),
    ):

        def fail(*_, error=error):
            raise error

        requester.send = fail
        with pytest.raises(expected, match=r"no link|could not be sent: cable"):
            client.call()
    assert "/add: sending a request failed" in caplog.text


# -- types ---------------------------------------------------------------------------------------


def test_unavailable_type_is_reported(node, middleware, eventually):
    client = node.create_service_client("/x")
    middleware.appear(SERVER, "/x", "nowhere_msgs/srv/Nothing")
    eventually(
        lambda: "/robot has nowhere_msgs/srv/Nothing, which cannot be used" in client.problem
    )
    with pytest.raises(rosglass.ServiceUnavailableError, match="no definition of nowhere_msgs"):
        client.call(timeout=0.01)


def test_several_types_of_one_service_are_reported(node, middleware, eventually):
    middleware.appear(SERVER, "/x", ADD, node="one")
    middleware.appear(SERVER, "/x", TRIGGER, node="two")
    client = node.create_service_client("/x")
    assert f"several types ({ADD}, {TRIGGER}); choose one" in client.problem
    assert f"create_service_client('/x', '{ADD}')" in client.problem
    assert client.type is None


def test_server_with_another_type_is_reported(client, middleware, caplog, eventually):
    middleware.requesters[0].linked = True
    middleware.appear(SERVER, "/add", TRIGGER)
    problem = f"/robot offers {TRIGGER} here, not {ADD}: it cannot be called"
    assert client.problem == problem
    assert not client.ready
    with pytest.raises(rosglass.ServiceUnavailableError, match=problem):
        client.call(timeout=0.01)
    assert middleware.requesters[0].sent == []
    eventually(lambda: caplog.text.count(problem) == 1)


def test_server_with_another_definition_is_reported(client, middleware, eventually):
    middleware.requesters[0].linked = True
    middleware.appear(SERVER, "/add", ADD, OTHER_HASH)
    problem = (
        f"/robot has {ADD}, which cannot be used: no definition of {ADD} has the hash {OTHER_HASH}"
    )
    eventually(lambda: problem in client.problem)
    assert not client.ready


def test_version_that_the_server_announces_is_taken(middleware, tmp_path, eventually):
    text = "int64 a\nint64 b\nint64 c\n---\nint64 sum\n"
    folder = tmp_path / "example_interfaces" / "srv"
    folder.mkdir(parents=True)
    (folder / "AddTwoInts.srv").write_text(text)
    (folder.parent / "package.xml").write_text("<package><name>example_interfaces</name></package>")
    library = Library()
    newer = Library()
    newer.add_path(tmp_path)
    newer.prefer("folders")
    theirs = rosglass.load(ADD, library=newer)
    library.add_path(tmp_path)
    library.prefer("distribution")
    with Ros2Node(middleware, "fake://", "cockpit", library=library) as node:
        client = node.create_service_client("/add", ADD)
        fixed = node.create_service_client("/add", rosglass.load(ADD, library=library))
        assert client.type.rihs01 != theirs.rihs01
        call = client.call_async({"a": 1})
        middleware.appear(SERVER, "/add", ADD, theirs.rihs01)
        eventually(lambda: client.type.rihs01 == theirs.rihs01)
        old, new = middleware.requesters[0], middleware.requesters[-1]
        assert old.closed
        new.linked = True
        eventually(lambda: new.sent == [theirs.request.encode(a=1)])
        new.reply(1, theirs.response.encode(sum=4))
        assert call.result(30).sum == 4
        assert client.call_async({"c": 1}).cancel()
        assert f"/robot has another definition of {ADD} ({theirs.rihs01}, ours is" in fixed.problem
        assert "add the robot's definition to the library" in fixed.problem


def test_several_servers_are_named_and_called(client, connect, eventually, caplog):
    for name in ("one", "two"):
        connect(name).create_service_server("/add", ADD, add)
    warning = "/one, /two all offer /add: each executes every request"
    eventually(lambda: warning in client.problem)
    assert client.call({"a": 1}).sum == 1
    eventually(lambda: caplog.text.count(warning) == 1)


# -- readiness -----------------------------------------------------------------------------------


def test_change_that_only_the_middleware_sees_is_notified(client, requester, eventually):
    changes = []
    client.on_ready_change(changes.append)
    requester.linked = True
    requester.changed()
    eventually(lambda: changes == [True])


# -- threads and asyncio -------------------------------------------------------------------------


def test_giving_up_in_asyncio_cancels_the_call(client, requester, eventually):
    requester.linked = True

    async def main():
        await asyncio.wait_for(client.call_async(timeout=None), 0.02)

    with pytest.raises((asyncio.TimeoutError, TimeoutError)):
        asyncio.run(main())
    eventually(lambda: requester.forgotten == [1])


def test_threads_that_everything_waits_for_must_not_wait(node, robot, client, eventually):
    refused = []
    reason = "this callback runs in a thread that receives .* take call_async"

    def wait(*_):
        with pytest.raises(rosglass.UnsupportedError, match=f"/add: {reason}"):
            client.call(timeout=60)
        assert client.wait_for_server(60)  # it is there
        with pytest.raises(rosglass.UnsupportedError, match=f"/nothing: {reason}"):
            nothing.wait_for_server(60)
        refused.append(threading.current_thread())

    nothing = node.create_service_client("/nothing", ADD)
    client.on_ready_change(wait, IMMEDIATE)
    robot.create_service_server("/add", ADD, add)
    eventually(lambda: len(refused) == 1)
    nothing.call_async(timeout=0.2).add_done_callback(wait)
    eventually(lambda: len(refused) == 2)
    assert threading.main_thread() not in refused


def test_ctrl_c_gives_the_call_up(client, requester, monkeypatch):
    requester.linked = True

    def interrupt(self, timeout=None):
        raise KeyboardInterrupt

    monkeypatch.setattr(Promise, "result", interrupt)
    with pytest.raises(KeyboardInterrupt):
        client.call()
    assert client.pending == 0
    assert requester.forgotten == [1]


# -- serving -------------------------------------------------------------------------------------


def test_undecodable_requests_are_logged_once_per_client(robot, client, caplog):
    robot.create_service_server("/add", ADD, add)
    replier = robot.fake.repliers[0]
    for _ in range(3):
        for who in (b"a" * 16, b"b" * 16):
            replier.handle_request(RequestId(who, 1), b"\0\1\0\0rubbish")
    for number in range(200):
        replier.handle_request(RequestId(number.to_bytes(16, "big"), 1), b"")
    assert client.call({"a": 1}, timeout=30).sum == 1
    messages = [r.getMessage() for r in caplog.records if "refusing requests" in r.getMessage()]
    assert len(messages) == 100
    assert f"the request is not a {ADD}_Request: " in messages[0]
    assert len(replier.failures) == 206


def test_request_may_arrive_while_the_server_is_created(robot, monkeypatch):
    """A client that waits for a service may be quicker than who offers it."""
    create = robot.fake.create_replier
    data = rosglass.load(ADD).request.encode({"a": 1, "b": 2})

    def hasty(endpoint, on_request):
        replier = create(endpoint, on_request)
        replier.handle_request(RequestId(b"w" * 16, 1), memoryview(data))
        return replier

    monkeypatch.setattr(robot.fake, "create_replier", hasty)
    robot.create_service_server("/add", ADD, add, executor=rosglass.comm.IMMEDIATE)
    assert [request.sequence for request, _ in robot.fake.repliers[0].replies] == [1]


def test_flooding_client_cannot_fill_the_memory(robot, middleware, client, caplog):
    release = threading.Event()
    robot.create_service_server("/add", ADD, lambda _: release.wait(30) and None)
    replier = robot.fake.repliers[0]
    data = rosglass.load(ADD).request.encode()
    for number in range(1500):
        replier.handle_request(RequestId(b"w" * 16, number), data)
    release.set()
    assert 499 <= len(replier.failures) <= 500
    assert caplog.text.count("1000 requests are waiting for the callback") == 1


def test_another_version_of_the_response_alone_is_named_and_taken(middleware, eventually):
    theirs_only = Library()
    theirs_only.add_text(ADD, "int64 a\nint64 b\n---\nint64 sum\nbool overflow\n")
    theirs_only.prefer("wire")
    theirs, ours = rosglass.load(ADD, library=theirs_only), rosglass.load(ADD)
    assert theirs.request.rihs01 == ours.request.rihs01
    robot = NodeName("/", "robot")
    server = EndpointInfo(
        SERVER,
        "/add",
        ADD,
        robot,
        type_hash=ours.request.rihs01,
        response_hash=theirs.response.rihs01,
    )
    middleware.announces_requests = True  # as over DDS
    library = Library()
    with Ros2Node(middleware, "fake://", "cockpit", library=library) as node:
        client, fixed = (node.create_service_client("/add", given) for given in (ADD, ours))
        middleware.graph.put_endpoint("s", server)
        eventually(lambda: f"/robot has {ADD}, which cannot be used" in client.problem)
        assert f"has the hash {theirs.response.rihs01}" in client.problem
        hashes = f"(of its response: {theirs.response.rihs01}, ours is {ours.response.rihs01})"
        assert f"another definition of {ADD} {hashes}: it cannot be called" in fixed.problem
        assert not client.ready
        library.add_version(theirs.definition)
        eventually(lambda: client.type.rihs01 == theirs.rihs01)
        other = replace(server, type_hash=OTHER_HASH, response_hash=ours.response.rihs01)
        middleware.graph.put_endpoint("s", other)
        eventually(lambda: f"has the hash {OTHER_HASH}" in client.problem)


def test_second_server_and_incompatible_clients_are_reported(robot, middleware, caplog, eventually):
    server = robot.create_service_server("/add", ADD, add)
    theirs = robot.fake
    theirs.appear(SERVER, "/add", ADD, node="twin")
    assert "/twin offers /add, too" in server.problem
    theirs.appear(CLIENT, "/add", TRIGGER, node="lost")
    theirs.appear(CLIENT, "/add", ADD, OTHER_HASH, node="older")
    assert f"/lost calls {TRIGGER} here, not {ADD}: it is not served" in server.problem
    assert f"/older has another definition of {ADD} ({OTHER_HASH}" in server.problem
    eventually(lambda: "/twin offers /add, too" in caplog.text)
    eventually(lambda: caplog.text.count("/older has another definition") == 1)


# -- the end -------------------------------------------------------------------------------------


def test_closing_a_server(robot, client, eventually):
    started, futures = threading.Event(), []

    def callback(request):
        started.set()
        futures.append(concurrent.futures.Future())
        return futures[0]

    server = robot.create_service_server("/add", ADD, callback)
    call = client.call_async(timeout=2)
    assert started.wait(30)
    server.close()
    server.close()
    assert server.problem == "the server is closed"
    futures[0].set_result(None)  # too late, and no error
    robot.fake.repliers[0].on_request(RequestId(b"", 1), b"")  # on its way when it closed
    with pytest.raises(rosglass.Error):
        call.result(30)
    assert len(futures) == 1
    assert not client.ready


def test_ended_calls_are_forgotten_before_their_time_is_up(client, requester):
    requester.linked = True
    calls = []
    for number in range(1, 1001):
        calls.append(weakref.ref(client.call_async(timeout=60)))
        requester.reply(number, answer())
    gc.collect()
    assert sum(call() is not None for call in calls) < 200
