"""Calling and offering services, on every wire."""

from __future__ import annotations

import asyncio
import concurrent.futures
import gc
import threading
import weakref
from concurrent.futures import Future
from contextlib import contextmanager, suppress

import pytest
from executors import Failing, Manual

import rosglass
from rosglass.comm import IMMEDIATE, Dispatcher

TRIGGER = "std_srvs/srv/Trigger"


def add(request):
    return {"sum": request.a + request.b}


@pytest.fixture
def client(console, topic, wire):
    return console.create_service_client(topic, wire.add)


@pytest.fixture
def offer(robot, topic, wire, client):
    """Offer the service in the robot; returns its server, which the client has found."""

    def offer(callback=add, **options):
        server = robot.create_service_server(topic, wire.add, callback, **options)
        assert client.wait_for_server(30), client.problem
        return server

    return offer


@pytest.mark.parametrize("way", ["call", "call_async", "await"])
def test_service_is_called_and_answered(offer, client, way, topic, wire, eventually):
    server = offer()
    request = {"a": 1, "b": 2}
    if way == "call":
        response = client.call(request, timeout=30)
    elif way == "call_async":
        response = client.call_async(request).result(30)
    else:

        async def call():
            return await client.call_async(request)

        response = asyncio.run(call())
    assert response.sum == 3
    assert client.problem == server.problem == ""
    assert client.ready
    # The thread that received the response removes the call just after the result is there.
    eventually(lambda: client.pending == 0)
    full = rosglass.load(wire.add, ros=1 if wire.is_ros1 else 2).name
    assert repr(client) == f"<ServiceClient {topic} [{full}]>"
    assert repr(server) == f"<ServiceServer {topic} [{full}]>"


def test_names_are_resolved(connect, wire):
    arm = connect("arm", "/left")
    assert arm.create_service_client("add", wire.add).name == "/left/add"
    assert arm.create_service_server("~/add", wire.add, add).name == "/left/arm/add"


def test_end_of_a_call_is_reported_on_an_executor(offer, client, eventually):
    offer()
    seen = []
    call = client.call_async({"a": 1})
    call.on_done(lambda c: seen.append((c, threading.current_thread().name)))
    elsewhere = Dispatcher("elsewhere")
    call.on_done(lambda c: seen.append((c, threading.current_thread().name)), elsewhere)
    eventually(lambda: len(seen) == 2)
    assert sorted(name for _, name in seen) == ["console callbacks", "elsewhere"]
    assert {each for each, _ in seen} == {call}
    elsewhere.close()
    with pytest.raises(rosglass.ConversionError, match="callback"):
        call.on_done(None)


def test_message_is_a_request_too(offer, client, wire):
    offer()
    ros = 1 if wire.is_ros1 else 2
    request = rosglass.load(wire.add, ros=ros).request.create(a=2, b=3)
    assert client.call(request, timeout=30).sum == 5
    assert client.call(timeout=30).sum == 0


def test_client_without_type_takes_the_servers(robot, console, topic, wire):
    client = console.create_service_client(topic)
    assert client.type is None
    assert "type not known yet" in repr(client)
    request = {"a": 20, "b": 22}
    early, wrong = client.call_async(request), client.call_async({"a": "text"})
    request["a"] = 100
    with pytest.raises(rosglass.ConversionError, match="a message or a dict"):
        client.call_async(7)
    with pytest.raises(rosglass.ServiceUnavailableError, match=f"no server offers {topic} on"):
        client.call(timeout=0.02)
    robot.create_service_server(topic, wire.add, add)
    assert early.result(30).sum == 42
    assert client.type == rosglass.load(wire.add, ros=1 if wire.is_ros1 else 2)
    with pytest.raises(rosglass.ConversionError, match="a: expected an integer"):
        wrong.result(30)
    assert console.create_service_client(topic).wait_for_server(30)


def test_node_calls_its_own_service(robot, topic, wire, offer):
    offer()
    with robot.create_service_client(topic, wire.add) as client:
        assert client.wait_for_server(30), client.problem
        assert client.call({"a": 1, "b": 1}, timeout=30).sum == 2


def test_calls_wait_for_the_server_as_they_were_made(robot, client, topic, wire):
    request = {"a": 1, "b": 2}
    calls = [client.call_async(request) for _ in range(3)]
    request["a"] = 100
    assert not client.ready
    assert client.pending == 3
    robot.create_service_server(topic, wire.add, add)
    assert [call.result(30).sum for call in calls] == [3, 3, 3]


def test_blocking_call_waits_for_the_server_too(robot, client, topic, wire):
    offer = lambda: robot.create_service_server(topic, wire.add, add)  # noqa: E731
    threading.Timer(0.05, offer).start()
    assert client.call({"a": 1, "b": 2}, timeout=30).sum == 3


@pytest.mark.parametrize("timeout", [0, 0.1])
def test_without_a_server_a_call_ends_after_its_time_and_names_the_service(client, topic, timeout):
    with pytest.raises(rosglass.ServiceUnavailableError, match=f"{topic}.*nothing was sent"):
        client.call(timeout=timeout)
    with pytest.raises(rosglass.ServiceUnavailableError, match=f"{topic}.*nothing was sent"):
        client.call_async(timeout=timeout).result(30)
    assert client.pending == 0


def test_missing_service_is_explained_with_similar_names(robot, client, topic, wire, eventually):
    robot.create_service_server(f"/base{topic}", wire.add, add)
    eventually(lambda: f"did you mean /base{topic}?" in client.problem, lambda: client.problem)
    assert f"no server offers {topic} [{client.type.name}] on {wire.url}" in client.problem


@pytest.mark.parametrize("way", ["call", "call_async"])
def test_call_of_a_silent_server_times_out(offer, client, way):
    answers: list[Future] = []

    def never(_):
        answers.append(Future())
        return answers[-1] if len(answers) == 1 else {"sum": 3}

    offer(never)
    call = {
        "call": lambda: client.call(timeout=0.5),
        "call_async": lambda: client.call_async(timeout=0.5).result(30),
    }[way]
    with pytest.raises(rosglass.TimeoutError, match=r"was sent the request.*may still carry it"):
        call()
    assert client.pending == 0
    # Given up, not in the way of the next one.
    assert client.call(timeout=30).sum == 3


def test_waiting_for_a_call_ends_without_ending_the_call(offer, client, topic):
    answer = Future()
    offer(lambda _: answer)
    call = client.call_async(timeout=None)
    with pytest.raises(rosglass.TimeoutError, match=rf"{topic} has not answered.* within 0\.01 s"):
        call.result(0.01)
    with pytest.raises(TimeoutError):
        call.exception(0.01)
    with pytest.raises(rosglass.ConversionError, match="timeout"):
        call.result("soon")
    answer.set_result({"sum": 3})
    assert call.result(30).sum == 3
    assert call.exception() is None


def test_hundreds_of_calls_at_once_are_all_answered(offer, client):
    offer()
    calls = [client.call_async({"a": number, "b": 1}) for number in range(300)]
    assert [call.result(30).sum for call in calls] == list(range(1, 301))


@pytest.fixture
def ordered_client(console, topic, wire):
    """A client whose requests come one after the other; in ROS 1 it has one connection."""
    options = {"persistent": True} if wire.is_ros1 else {}
    return console.create_service_client(topic, wire.add, **options)


def test_requests_come_in_the_order_of_the_calls(robot, ordered_client, topic, wire):
    seen = []
    for value in range(50):
        ordered_client.call_async({"a": value}, timeout=30)
    robot.create_service_server(topic, wire.add, lambda request: seen.append(request.a))
    for value in range(50, 100):
        ordered_client.call_async({"a": value}, timeout=30)
    ordered_client.call({"a": 100}, timeout=30)
    assert seen == list(range(101))


@pytest.mark.parametrize("kept", [False, True], ids=["any connection", "one connection"])
def test_calls_end_with_their_server_and_the_next_server_is_called(
    robot, client, ordered_client, topic, wire, kept, eventually, monkeypatch
):
    monkeypatch.setattr("rosglass.comm.service_client._GRACE_S", 0.1)  # 3 s, for a router's restart
    used, begun = ordered_client if kept else client, threading.Event()
    server = robot.create_service_server(topic, wire.add, lambda _: begun.set() or Future())
    call = used.call_async(timeout=30)
    assert begun.wait(30)
    server.close()
    server.close()
    assert server.problem == "the server is closed"
    with pytest.raises(rosglass.ConnectionLostError):
        call.result(30)
    eventually(lambda: f"no server offers {topic}" in used.problem, lambda: used.problem)
    assert not used.ready
    robot.create_service_server(topic, wire.add, lambda _: {"sum": 9})
    assert used.call(timeout=30).sum == 9


def test_server_only_limits_the_wait_for_a_server_alone(robot, client, topic, wire):
    with pytest.raises(rosglass.ServiceUnavailableError, match="nothing was sent"):
        client.call_async(timeout=0.1, server_only=True).result(30)
    answer = Future()
    robot.create_service_server(topic, wire.add, lambda _: answer)
    assert client.wait_for_server(30)
    held = client.call_async(timeout=0.1, server_only=True)
    with pytest.raises(rosglass.TimeoutError):
        client.call_async(timeout=0.3).result(30)
    assert not held.done()
    answer.set_result({"sum": 3})
    assert held.result(30).sum == 3


def test_calls_from_many_threads(offer, client):
    offer()
    with concurrent.futures.ThreadPoolExecutor(8) as pool:
        found = pool.map(lambda a: client.call({"a": a, "b": 1}, timeout=30).sum, range(40))
    assert list(found) == list(range(1, 41))
    assert client.pending == 0


@pytest.mark.parametrize("way", ["call", "call_async"])
@pytest.mark.parametrize(
    ("request_", "timeout", "reason"),
    [
        ({"a": "x"}, 1, "a: expected an integer"),
        ({"c": 1}, 1, "c"),
        ("text", 1, "expected"),
        ({}, -1, "timeout: expected seconds, at least 0, or None for no limit, got -1"),
        ({}, "soon", "timeout: expected seconds"),
        ({}, True, "timeout: expected seconds"),
        ({}, float("nan"), "timeout: expected seconds"),
    ],
)
def test_invalid_request_is_refused_and_not_sent(offer, client, way, request_, timeout, reason):
    seen = []
    offer(lambda request: seen.append(request.a))
    with pytest.raises(rosglass.ConversionError, match=reason):
        getattr(client, way)(request_, timeout=timeout)
    assert client.pending == 0
    client.call({"a": 7}, timeout=30)
    assert seen == [7]


@pytest.mark.parametrize("name", ["a b", ""])
@pytest.mark.parametrize("create", ["create_service_client", "create_service_server"])
def test_bad_names_are_refused(robot, wire, create, name):
    more = (add,) if create.endswith("server") else ()
    with pytest.raises(rosglass.InvalidNameError):
        getattr(robot, create)(name, wire.add, *more)


@pytest.mark.parametrize("create", ["create_service_client", "create_service_server"])
def test_invalid_service_type_is_refused(robot, wire, create):
    more = (add,) if create.endswith("server") else ()
    other = rosglass.load(TRIGGER, ros=2 if wire.is_ros1 else 1)
    for kind, error, reason in (
        ("nowhere_msgs/srv/Nothing", rosglass.TypeNotFoundError, "nowhere_msgs"),
        ("std_msgs/msg/String", rosglass.TypeNotFoundError, "is not a service type"),
        (7, rosglass.TypeNotFoundError, "7 is not a service type"),
        (other, rosglass.UnsupportedError, f"ROS {2 if wire.is_ros1 else 1}'s"),
    ):
        with pytest.raises(error, match=reason):
            getattr(robot, create)("/x", kind, *more)


async def serve(_):
    return None


@pytest.mark.parametrize(
    ("callback", "executor", "reason"),
    [
        (None, None, "callback: expected something that can be called, got None"),
        (add, "gui", "executor: expected a rosglass.comm.Executor"),
        (serve, None, "created inside a running event loop"),
        (serve, IMMEDIATE, "no executor beside a coroutine function"),
    ],
)
def test_callbacks_that_cannot_run_are_refused_at_creation(
    robot, wire, topic, callback, executor, reason
):
    with pytest.raises(rosglass.ConversionError, match=f"{topic}: .*{reason}"):
        robot.create_service_server(topic, wire.add, callback, executor=executor)
    robot.create_service_server(topic, wire.add, add)  # nothing is left of the others


def test_response_is_a_message_a_dict_or_nothing(robot, console, topic, wire):
    kind = rosglass.load(TRIGGER, ros=1 if wire.is_ros1 else 2)
    done = {"success": True, "message": "done"}
    for number, response in enumerate((kind.response.create(**done), done, None)):
        name = f"{topic}_{number}"
        robot.create_service_server(name, kind, lambda _, r=response: r)
        found = console.create_service_client(name, TRIGGER).call(timeout=30).to_dict()
        assert found == (done if response else {"success": False, "message": ""})


@pytest.mark.parametrize("end", ["result", "exception", "cancel", "misfit"])
def test_response_may_come_later(offer, client, wire, eventually, end):
    answers: list[Future] = []

    def later(_):
        answers.append(Future())
        return answers[-1]

    offer(later)
    call = client.call_async({"a": 1, "b": 2}, timeout=30 if end == "result" else patience(wire))
    eventually(lambda: answers)
    assert not call.done()
    if end == "result":
        answers[0].set_result({"sum": 7})
        assert call.result(30).sum == 7
        return
    if end == "exception":
        answers[0].set_exception(ValueError("broken"))
    elif end == "cancel":
        answers[0].cancel()
    else:
        answers[0].set_result({"sum": "x"})
    reason = {"exception": "broken", "cancel": "cancelled", "misfit": "no valid response: "}[end]
    with refused(wire, reason):
        call.result(30)


def patience(wire):
    """Return in how many seconds an error of the server comes; over DDS, none does."""
    return 0.5 if wire.name == "dds" else 30


@contextmanager
def refused(wire, reason):
    """Expect that a call ends with an error of its server; over DDS, nothing can be said."""
    if wire.name == "dds":
        with pytest.raises(rosglass.TimeoutError):
            yield
    else:
        with pytest.raises(rosglass.ServiceError, match=reason):
            yield


def test_callback_that_fails_ends_the_call_with_an_error(offer, client, wire, topic, caplog):
    answers = iter([ValueError("of the user's"), {"sum": 1}])

    def fail(_):
        answer = next(answers)
        if isinstance(answer, Exception):
            raise answer
        return answer

    offer(fail)
    with refused(wire, "of the user's"):
        client.call(timeout=patience(wire))
    assert f"{topic}: the callback failed on a request of /console; it " in caplog.text
    assert "ValueError: of the user's" in caplog.text
    assert client.call(timeout=30).sum == 1


class Failed(dict):
    """A response whose own code fails."""

    def items(self):
        raise ZeroDivisionError("in the response")

    __getitem__ = __iter__ = __len__ = keys = get = items


def leave(_):
    raise SystemExit("of the callback")


def respond_later(_):
    answer = Future()
    answer.set_result(Failed())
    return answer


@pytest.mark.parametrize(
    ("callback", "reason"),
    [
        (leave, "of the callback"),
        (lambda _: Failed(), "in the response"),
        (respond_later, "in the response"),
    ],
)
def test_no_error_of_a_callback_or_response_leaves_the_client_waiting(
    offer, client, wire, caplog, callback, reason
):
    offer(callback)
    with refused(wire, reason):
        client.call(timeout=patience(wire))
    # The client is named once the graph has it.
    assert "the callback failed on a request of " in caplog.text
    assert reason in caplog.text


def test_service_error_of_a_callback_refuses_the_request(offer, client, wire, caplog):
    def refuse(_):
        raise rosglass.ServiceError("not homed")

    offer(refuse)
    with refused(wire, "the call of .* failed: .*not homed$"):
        client.call(timeout=patience(wire))
    errors = [record for record in caplog.records if record.levelname == "ERROR"]
    assert bool(errors) != wire.is_ros1, "as with rospy, only the client gets the error"


@pytest.mark.parametrize(
    ("response", "reason"), [({"sum": "x"}, "sum: expected"), ({"total": 1}, "total"), (7, "7")]
)
def test_response_that_does_not_fit_is_logged(
    robot, offer, client, wire, caplog, eventually, response, reason
):
    offer(lambda _: response)
    if not wire.is_ros1:  # there, the request itself names its client
        eventually(
            lambda: [str(e.node) for e in robot.service_clients(client.name)] == ["/console"]
        )
    with refused(wire, f"the server returned no valid response: .*{reason}"):
        client.call(timeout=patience(wire))
    assert "the callback's response to /console does not fit" in caplog.text
    assert reason in caplog.text


def test_plain_function_that_returns_a_coroutine_is_an_error(offer, client, wire, caplog):
    offer(lambda _: serve(None))
    with refused(wire, "must be an async def"):
        client.call(timeout=patience(wire))
    assert "must be an async def" in caplog.text


def test_server_whose_executor_raises_fails_the_request(offer, client, wire, caplog):
    broken = Failing()
    broken.failing = True
    offer(executor=broken)
    with refused(wire, "cannot schedule new futures"):
        client.call(timeout=patience(wire))
    assert "cannot schedule new futures" in caplog.text


def test_executors_of_servers(offer, client, eventually):
    executor = Manual()
    offer(executor=executor)
    call = client.call_async({"a": 1})
    eventually(lambda: executor.jobs)
    assert not call.done()
    executor.run()
    assert call.result(30).sum == 1


def test_slow_callback_blocks_neither_other_services_nor_the_graph(
    robot, console, topic, wire, eventually
):
    begun, go = threading.Event(), threading.Event()

    def slow(_):
        begun.set()
        go.wait(30)

    robot.create_service_server(f"{topic}_slow", TRIGGER, slow)
    robot.create_service_server(topic, wire.add, add, executor=IMMEDIATE)
    held = console.create_service_client(f"{topic}_slow", TRIGGER).call_async(timeout=30)
    assert begun.wait(30)
    client = console.create_service_client(topic, wire.add)
    assert client.call({"a": 1, "b": 2}, timeout=30).sum == 3
    go.set()
    held.result(30)


# -- threads that may not wait -------------------------------------------------------------------


def test_callback_that_would_wait_for_itself_is_refused(robot, console, topic, wire, eventually):
    client = robot.create_service_client(topic, wire.add)
    robot.create_service_server(topic, wire.add, add)
    assert client.wait_for_server(30), client.problem
    refusals = []

    def twice(request):
        try:
            client.call({"a": request.a}, timeout=1)
        except rosglass.UnsupportedError as error:
            refusals.append(str(error))

    robot.create_service_server(f"{topic}_twice", wire.add, twice)
    console.create_service_client(f"{topic}_twice", wire.add).call({"a": 1}, timeout=30)
    assert "this callback would wait for itself" in refusals[0]
    assert client.call({"a": 2}, timeout=30).sum == 2


def test_event_loop_is_not_blocked_by_a_call_of_its_own_service(robot, topic, wire):
    async def slowly(request):
        return {"sum": request.a}

    async def main():
        with robot.create_service_server(topic, wire.add, slowly):
            client = robot.create_service_client(topic, wire.add)
            with pytest.raises(rosglass.UnsupportedError, match="would wait for itself"):
                client.call({"a": 1}, timeout=1)
            return (await client.call_async({"a": 1}, timeout=30)).sum

    assert asyncio.run(main()) == 1


def test_callback_may_call_what_runs_elsewhere(robot, console, topic, wire):
    own = Dispatcher("own")
    client = robot.create_service_client(topic, wire.add)
    robot.create_service_server(topic, wire.add, add, executor=own)
    robot.create_service_server(
        f"{topic}_twice", wire.add, lambda r: client.call({"a": r.a, "b": r.a}, timeout=30)
    )
    outer = console.create_service_client(f"{topic}_twice", wire.add)
    assert outer.call({"a": 4}, timeout=30).sum == 8
    own.close()


def test_callback_of_a_client_may_call_and_wait(
    robot, console, offer, client, topic, wire, eventually
):
    """The response does not need the thread that waits for it."""
    offer()
    sums = []
    other = console.create_service_client(f"{topic}_other", wire.add)
    other.on_ready_change(
        lambda ready: ready and sums.append(client.call({"a": 5}, timeout=30).sum)
    )
    robot.create_service_server(f"{topic}_other", wire.add, add)
    eventually(lambda: sums == [5], lambda: (sums, other.problem))


def test_callback_in_the_receiving_thread_may_not_wait(offer, client, wire):
    if wire.name == "local":
        pytest.skip("no thread receives: the response comes in the one that the server answers in")
    # The response comes after the callback was added: else it runs in this thread, which may wait.
    added, failed = threading.Event(), Future()
    offer(lambda _: {"sum": int(added.wait(30))})

    def callback(_):
        try:
            client.call()
        except rosglass.UnsupportedError as error:
            failed.set_result(str(error))
        else:
            failed.set_result("it waited")

    client.call_async(timeout=30).add_done_callback(callback)
    added.set()
    assert "runs in a thread that receives" in failed.result(30)


def test_coroutine_functions_serve_in_their_loop(robot, console, topic, wire):
    async def slow_add(request):
        await asyncio.sleep(0.01)
        return {"sum": request.a + request.b}

    class Callable:
        async def __call__(self, request):
            return {"sum": 7}

    async def main():
        with (
            robot.create_service_server(topic, wire.add, slow_add),
            robot.create_service_server(f"{topic}_seven", wire.add, Callable()),
        ):
            client = console.create_service_client(topic, wire.add)
            calls = [client.call_async({"a": 3, "b": value}) for value in range(5)]
            sums = [message.sum for message in await asyncio.gather(*calls)]
            seven = await console.create_service_client(f"{topic}_seven", wire.add).call_async()
            return sums, seven.sum

    assert asyncio.run(asyncio.wait_for(main(), 30)) == ([3, 4, 5, 6, 7], 7)


def test_closing_a_server_cancels_its_coroutines(robot, console, topic, wire):
    begun, ended = threading.Event(), threading.Event()

    async def slow(_):
        try:
            begun.set()
            await asyncio.sleep(60)
        finally:
            ended.set()

    async def main():
        server = robot.create_service_server(topic, wire.add, slow)
        console.create_service_client(topic, wire.add).call_async()
        assert await asyncio.to_thread(begun.wait, 30)
        server.close()
        assert await asyncio.to_thread(ended.wait, 30)
        assert server.problem == "the server is closed"
        server.close()

    asyncio.run(main())


def test_readiness_changes_are_reported(offer, client, eventually):
    seen = []
    client.on_ready_change(seen.append)
    assert not client.wait_for_server(0.02)
    assert not client.wait_for_server(0)
    server = offer()
    eventually(lambda: seen == [True], lambda: seen)
    assert client.wait_for_server()
    server.close()
    eventually(lambda: seen == [True, False], lambda: seen)
    assert not client.ready
    with pytest.raises(rosglass.ConversionError, match="callback"):
        client.on_ready_change("callback")


def test_client_is_notified_when_server_leaves_immediately(offer, console, topic, wire, eventually):
    for _ in range(3):
        server, seen = offer(), []
        late = console.create_service_client(topic, wire.add)
        late.on_ready_change(seen.append)
        assert late.wait_for_server(30)
        server.close()
        eventually(lambda seen=seen: seen and not seen[-1], lambda seen=seen: seen)
        late.close()


def test_closing_ends_waiting_for_the_server(client):
    threading.Timer(0.05, client.close).start()
    with pytest.raises(rosglass.NodeClosedError, match="is closed"):
        client.wait_for_server()


def test_ended_call_is_freed_without_the_garbage_collector(client, offer, eventually):
    offer()
    gc.disable()
    try:
        call = client.call_async({"a": 1})
        assert call.result(30).sum == 1
        ended = weakref.ref(call)
        del call
        eventually(lambda: ended() is None)
    finally:
        gc.enable()


def test_cancelled_call_ends_at_once(client, offer):
    held = threading.Event()
    offer(lambda _: held.wait(30) and {})
    call = client.call_async({"a": 1})
    assert call.cancel()
    held.set()
    with pytest.raises((concurrent.futures.CancelledError, rosglass.Error)):
        call.result(30)


@pytest.mark.parametrize("what", ["client", "node"])
@pytest.mark.parametrize("sent", [False, True], ids=["waiting", "sent"])
def test_closing_ends_pending_calls(offer, client, console, what, sent, eventually):
    begun, go = threading.Event(), threading.Event()
    if sent:
        offer(lambda _: begun.set() or (go.wait(30) and {}))
    calls = [client.call_async(timeout=None) for _ in range(2)]
    assert not sent or begun.wait(30)
    seen = []
    calls[0].add_done_callback(seen.append)
    (client if what == "client" else console).close()
    go.set()
    for call in calls:
        with pytest.raises(rosglass.NodeClosedError, match="was closed during a call"):
            call.result(0)
    assert seen == [calls[0]]
    client.close()
    assert (client.ready, client.pending, client.problem) == (False, 0, "the client is closed")
    for use in (
        client.call,
        client.call_async,
        client.wait_for_server,
        lambda: client.on_ready_change(print),
    ):
        with pytest.raises(rosglass.NodeClosedError):
            use()


@pytest.mark.parametrize("create", ["create_service_client", "create_service_server"])
def test_nothing_is_created_from_a_closed_node(console, topic, wire, create):
    console.close()
    more = (add,) if create.endswith("server") else ()
    with pytest.raises(rosglass.NodeClosedError):
        getattr(console, create)(topic, wire.add, *more)


def test_empty_requests_and_responses(robot, console, topic):
    robot.create_service_server(topic, TRIGGER, lambda _: {"success": True, "message": "done"})
    client = console.create_service_client(topic, TRIGGER)
    assert client.wait_for_server(30), client.problem
    response = client.call(timeout=30)
    assert (response.success, response.message) == (True, "done")


def test_calls_that_enter_while_another_thread_closes_the_client_end(console, topic, wire):
    def enter_calls(client, calls, entered):
        with suppress(rosglass.NodeClosedError):
            while True:
                calls.append(client.call_async(timeout=None))
                entered.set()

    for _ in range(20):
        client, calls, entered = (
            console.create_service_client(topic, wire.add),
            [],
            threading.Event(),
        )
        thread = threading.Thread(target=enter_calls, args=(client, calls, entered))
        thread.start()
        assert entered.wait(30)
        client.close()
        thread.join(30)
        assert not thread.is_alive()
        assert {type(call.exception(30)) for call in calls} == {rosglass.NodeClosedError}
        assert client.pending == 0
