"""Calling and offering services, on every wire."""

from __future__ import annotations

import asyncio
import concurrent.futures
import threading
from concurrent.futures import Future

import pytest

import rosglass

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
def test_a_service_is_called_and_answered(offer, client, way):
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


def test_a_message_is_a_request_too(offer, client, wire):
    offer()
    ros = 1 if wire.is_ros1 else 2
    request = rosglass.load(wire.add, ros=ros).request.create(a=2, b=3)
    assert client.call(request, timeout=30).sum == 5
    assert client.call(timeout=30).sum == 0


def test_a_client_without_type_takes_the_servers(offer, console, topic, eventually):
    offer()
    with console.create_service_client(topic) as client:
        assert client.wait_for_server(30), client.problem
        assert client.call({"a": 20, "b": 22}, timeout=30).sum == 42


def test_the_node_calls_its_own_service(robot, topic, wire, offer):
    offer()
    with robot.create_service_client(topic, wire.add) as client:
        assert client.wait_for_server(30), client.problem
        assert client.call({"a": 1, "b": 1}, timeout=30).sum == 2


def test_a_call_waits_for_the_server(robot, client, topic, wire):
    call = client.call_async({"a": 1, "b": 2})
    assert not client.ready
    robot.create_service_server(topic, wire.add, add)
    assert call.result(30).sum == 3


def test_without_a_server_a_call_ends_after_its_time_and_names_the_service(client, topic):
    with pytest.raises(rosglass.ServiceUnavailableError, match=topic):
        client.call(timeout=0.1)
    with pytest.raises(rosglass.ServiceUnavailableError, match=topic):
        client.call_async(timeout=0.1).result(30)


def test_a_server_that_does_not_answer_is_given_up(offer, client):
    held = threading.Event()
    offer(lambda _: held.wait(30) and {})
    try:
        with pytest.raises(rosglass.TimeoutError):
            client.call(timeout=0.2)
    finally:
        held.set()


def test_fifty_calls_at_once_are_all_answered(offer, client):
    offer()
    calls = [client.call_async({"a": number, "b": 1}) for number in range(50)]
    assert [call.result(30).sum for call in calls] == list(range(1, 51))


def test_calls_from_many_threads(offer, client):
    offer()
    with concurrent.futures.ThreadPoolExecutor(8) as pool:
        found = pool.map(lambda a: client.call({"a": a, "b": 1}, timeout=30).sum, range(40))
    assert list(found) == list(range(1, 41))


def test_what_does_not_fit_is_refused_naming_the_field(offer, client):
    offer()
    with pytest.raises(rosglass.ConversionError, match="a"):
        client.call({"a": "one"}, timeout=30)
    with pytest.raises(rosglass.ConversionError, match="c"):
        client.call_async({"c": 1})


@pytest.mark.parametrize("name", ["a b", ""])
@pytest.mark.parametrize("create", ["create_service_client", "create_service_server"])
def test_bad_names_are_refused(robot, wire, create, name):
    more = (add,) if create.endswith("server") else ()
    with pytest.raises(rosglass.InvalidNameError):
        getattr(robot, create)(name, wire.add, *more)
    with pytest.raises(rosglass.TypeNotFoundError, match="nowhere_msgs"):
        getattr(robot, create)("/x", "nowhere_msgs/srv/Nothing", *more)


def test_a_response_may_come_later(offer, client):
    answers: list[Future] = []

    def later(_):
        answers.append(Future())
        return answers[-1]

    offer(later)
    call = client.call_async({"a": 1, "b": 2})
    for _ in range(3000):
        if answers or call.done():
            break
        threading.Event().wait(0.01)
    answers[0].set_result({"sum": 7})
    assert call.result(30).sum == 7


def test_a_callback_that_fails_ends_the_call_with_an_error(offer, client, caplog):
    def fail(_):
        raise ValueError("of the user's")

    offer(fail)
    with pytest.raises((rosglass.ServiceError, rosglass.TimeoutError)):
        client.call(timeout=1)
    assert "of the user's" in caplog.text


def test_coroutine_functions_serve_in_their_loop(robot, console, topic, wire):
    async def slow_add(request):
        await asyncio.sleep(0)
        return {"sum": request.a + request.b}

    async def serve():
        with robot.create_service_server(topic, wire.add, slow_add):
            client = console.create_service_client(topic, wire.add)
            return await client.call_async({"a": 3, "b": 4})

    assert asyncio.run(asyncio.wait_for(serve(), 30)).sum == 7


def test_readiness_changes_are_reported(offer, client, eventually):
    seen = []
    client.on_ready_change(seen.append)
    server = offer()
    eventually(lambda: seen[-1:] == [True], lambda: seen)
    server.close()
    eventually(lambda: seen[-1:] == [False], lambda: seen)
    assert not client.ready


def test_a_cancelled_call_ends_at_once(client, offer):
    held = threading.Event()
    offer(lambda _: held.wait(30) and {})
    call = client.call_async({"a": 1})
    assert call.cancel()
    held.set()
    with pytest.raises((concurrent.futures.CancelledError, rosglass.Error)):
        call.result(30)


@pytest.mark.parametrize("what", ["client", "node"])
def test_closing_ends_pending_calls(client, console, what):
    call = client.call_async({"a": 1})
    (client if what == "client" else console).close()
    with pytest.raises(rosglass.NodeClosedError):
        call.result(30)
    with pytest.raises(rosglass.NodeClosedError):
        client.call(timeout=1)


def test_empty_requests_and_responses(robot, console, topic):
    robot.create_service_server(topic, TRIGGER, lambda _: {"success": True, "message": "done"})
    client = console.create_service_client(topic, TRIGGER)
    assert client.wait_for_server(30), client.problem
    response = client.call(timeout=30)
    assert (response.success, response.message) == (True, "done")
