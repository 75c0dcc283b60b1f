"""ROS 1 services between our own nodes, and against servers and clients that misbehave."""

from __future__ import annotations

import concurrent.futures
import socket
import struct
import threading
from contextlib import suppress
from urllib.parse import urlsplit

import pytest
from waiting import nothing_happens

import rosglass
from rosglass.interfaces import Library
from rosglass.wires.tcpros.connection import encode_header, parse_header
from rosglass.wires.tcpros.service_requester import ServiceLink, TcprosRequester

ADD, TRIGGER, BOOL = "rospy_tutorials/AddTwoInts", "std_srvs/Trigger", "std_srvs/SetBool"
MD5 = "6a2e34150c00229791cc89ff309fff21"
TELLS = {"callerid": "/robot", "md5sum": MD5, "type": ADD}


def add(request):
    return {"sum": request.a + request.b}


def receive(sock, count):
    data = b""
    while len(data) < count:
        more = sock.recv(count - len(data))
        if not more:
            raise ConnectionResetError
        data += more
    return data


def receive_header(sock):
    return parse_header(receive(sock, struct.unpack("<I", receive(sock, 4))[0]))


def receive_request(sock):
    return receive(sock, struct.unpack("<I", receive(sock, 4))[0])


def response(total=3):
    data = rosglass.load(ADD, ros=1).response.encode({"sum": total})
    return b"\1" + struct.pack("<I", len(data)) + data


class Robot:
    """Serves /add on a socket: `serve(sock, header)` does what the test wants after the headers.

    Attributes:
        headers: What clients sent, probes left out.
        reply: Its own connection header.
    """

    def __init__(self, serve, reply=TELLS):
        self.serve, self.reply, self.headers = serve, reply, []
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port = self._listener.getsockname()[1]
        self._open = [self._listener]
        threading.Thread(target=self._accept, daemon=True).start()

    def _accept(self):
        while True:
            try:
                sock, _ = self._listener.accept()
            except OSError:
                return
            self._open.append(sock)
            threading.Thread(target=self._run, args=(sock,), daemon=True).start()

    def _run(self, sock):
        try:
            header = receive_header(sock)
            is_probe = header.get("probe") == "1"
            if not is_probe:
                self.headers.append(header)
            sock.sendall(encode_header(self.reply))
            if not is_probe:
                self.serve(sock, header)
        except OSError:
            pass
        finally:
            sock.close()

    def close(self):
        for sock in self._open:
            with suppress(OSError):
                sock.shutdown(socket.SHUT_RDWR)
            sock.close()


@pytest.fixture
def start_robot(master):
    robots = []

    def start_robot(serve=None, reply=TELLS):
        def answer(sock, _):
            receive_request(sock)
            sock.sendall(response())

        robots.append(Robot(serve or answer, reply))
        master.offer("/add", robots[-1].port)
        return robots[-1]

    yield start_robot
    for robot in robots:
        robot.close()


@pytest.fixture
def node(connect):
    return connect("console")


@pytest.fixture(params=[False, True], ids=["each call", "persistent"])
def persistent(request):
    return request.param


@pytest.fixture
def client(node, persistent):
    return node.create_service_client("/add", ADD, persistent=persistent)


@pytest.fixture
def dial(master, eventually):
    """Connect to who offers a service with a header; returns the socket, and what was answered."""

    def dial(offered="/add", **header):
        uri = eventually(lambda: master.services.get(offered))[1]
        sock = socket.create_connection(("127.0.0.1", urlsplit(uri).port), 5)
        sock.sendall(encode_header(header))
        return sock, receive_header(sock)

    return dial


# -- calling -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("options", "message"),
    [({"qos": 10}, "/x: qos: expected"), ({"persistent": "no"}, "/x: persistent: expected")],
)
def test_options_of_another_kind_are_refused(node, options, message):
    with pytest.raises(rosglass.ConversionError, match=message):
        node.create_service_client("/x", ADD, **options)


def test_fifty_calls_are_answered_in_parallel(connect, node):
    client = node.create_service_client("/add", ADD)
    together, promises = threading.Event(), []

    def later(request):
        promise = concurrent.futures.Future()
        promises.append((promise, request.a))
        if len(promises) == 50:
            together.set()
        return promise

    connect("robot").create_service_server("/add", ADD, later)
    calls = [client.call_async({"a": value}) for value in range(50)]
    assert together.wait(30)
    assert client.pending == 50
    for promise, value in reversed(promises):
        promise.set_result({"sum": value})
    assert [call.result(30).sum for call in calls] == list(range(50))


def test_persistent_client_uses_one_connection_and_others_one_for_each_call(
    client, persistent, start_robot
):
    def answer(sock, _):
        while True:
            receive_request(sock)
            sock.sendall(response())

    robot = start_robot(answer)
    assert [client.call().sum for _ in range(5)] == [3] * 5
    assert len(robot.headers) == (1 if persistent else 5)
    expected = {"callerid": "/console", "md5sum": MD5, "service": "/add", "type": ADD}
    assert robot.headers[0] == expected | ({"persistent": "1"} if persistent else {})


def test_server_that_keeps_no_connections_serves_persistent_clients_too(
    client, start_robot, eventually
):
    start_robot()
    for _ in range(3):
        assert client.call().sum == 3
        eventually(lambda: not client._requester.has_connections)


# -- types ---------------------------------------------------------------------------------------


def test_type_unknown_here_is_reported_with_the_fix(node, start_robot, eventually):
    start_robot(reply=TELLS | {"type": "acme_srvs/Dance"})
    client = node.create_service_client("/add")
    eventually(lambda: "acme_srvs" in client.problem)
    assert "/robot offers it as acme_srvs/srv/Dance" in client.problem
    assert "Library.add_path('acme_srvs')" in client.problem
    assert not client.ready
    with pytest.raises(rosglass.ServiceUnavailableError, match="acme_srvs/srv/Dance"):
        client.call(timeout=0.1)


def test_definition_that_is_added_later_is_taken(master, connect, start_robot, tmp_path):
    definition = tmp_path / "acme_srvs" / "srv" / "Dance.srv"
    definition.parent.mkdir(parents=True)
    (tmp_path / "acme_srvs" / "package.xml").write_text("<package><name>acme_srvs</name></package>")
    library = Library()
    definition.write_text("int64 a\nint64 b\n---\nint64 sum\n")
    start_robot(reply=TELLS | {"type": "acme_srvs/Dance"})
    client = connect("late", library=library).create_service_client("/add")
    call = client.call_async({"a": 1})
    assert not client.wait_for_server(0.3)
    library.add_path(tmp_path)
    assert call.result(30).sum == 3
    assert client.type.name == "acme_srvs/srv/Dance"


def test_version_that_the_server_has_is_used_where_it_is_known(
    master, connect, start_robot, tmp_path
):
    library = Library()
    folder = tmp_path / "rospy_tutorials" / "srv"
    folder.mkdir(parents=True)
    (folder.parent / "package.xml").write_text("<package><name>rospy_tutorials</name></package>")
    (folder / "AddTwoInts.srv").write_text("string a\n---\nint64 sum\n")
    library.add_path(tmp_path)
    start_robot()
    client = connect("two", library=library).create_service_client("/add")
    assert client.call({"a": 1}).sum == 3
    assert client.type.md5 == MD5


def test_another_md5_is_refused_naming_both(connect, node, persistent, eventually):
    robot = connect("robot")
    server = robot.create_service_server("/add", TRIGGER, lambda _: {"success": True})
    client = node.create_service_client("/add", ADD, persistent=persistent)
    trigger = rosglass.load(TRIGGER, ros=1)
    with pytest.raises(rosglass.ServiceError) as caught:
        client.call(timeout=30)
    for text in (ADD.replace("/", "/srv/"), MD5, "std_srvs/srv/Trigger", trigger.md5, "int64 a"):
        assert text in str(caught.value)
    assert not isinstance(caught.value, rosglass.ServiceUnavailableError)
    assert not client.ready
    assert trigger.md5 in client.problem
    assert MD5 in client.problem
    assert "/console calls it as rospy_tutorials/AddTwoInts" in server.problem
    # It is called again once it is what was wanted.
    server.close()
    robot.create_service_server("/add", ADD, add)
    eventually(lambda: client.ready)
    assert client.problem == ""


def test_server_of_any_type_is_called(node, start_robot):
    start_robot(reply=TELLS | {"md5sum": "*", "type": "*"})
    assert node.create_service_client("/add", ADD).call().sum == 3
    unknown = node.create_service_client("/add")
    assert not unknown.wait_for_server(0.5)
    assert "does not announce its type" in unknown.problem


def test_types_of_services_are_listed_once_probed(node, start_robot, connect, eventually):
    start_robot()
    connect("other").create_service_server("/go", TRIGGER, dict)
    # The nodes' own services, for their loggers, may be there by now.
    eventually(lambda: {"/add", "/go"} <= set(node.services()))
    full = {"/add": ["rospy_tutorials/srv/AddTwoInts"], "/go": ["std_srvs/srv/Trigger"]}
    eventually(lambda: full.items() <= node.services().items())
    (info,) = node.service_servers("/add")
    assert (info.type, info.type_hash, info.node.full) == (full["/add"][0], MD5, "/robot")
    assert [e.type for e in node.endpoints("/other") if e.name == "/go"] == full["/go"]
    assert node.service_clients("/add") == []


def test_graph_changes_when_types_become_known(node, start_robot, eventually):
    start_robot()
    seen = []
    node.on_graph_change(lambda: seen.append(node.services().get("/add")))
    node.services()
    eventually(lambda: ["rospy_tutorials/srv/AddTwoInts"] in seen)


def test_types_of_a_hundred_services_are_listed(node, connect, eventually):
    robot = connect("robot")
    for number in range(100):
        robot.create_service_server(f"/s{number}", (ADD, BOOL)[number % 2], dict)
    eventually(lambda: len(node.services()) >= 100)
    eventually(lambda: all(node.services().values()), timeout=30)
    found = node.services()
    assert found["/s8"] == ["rospy_tutorials/srv/AddTwoInts"]
    assert found["/s9"] == ["std_srvs/srv/SetBool"]


def test_servers_are_not_probed_without_interest_in_types(node, master, start_robot, eventually):
    start_robot()
    # The first of these looks may have begun before the service was there.
    looks = master.calls.count("getSystemState")
    eventually(lambda: master.calls.count("getSystemState") >= looks + 3)
    assert "lookupService" not in master.calls


# -- who is there --------------------------------------------------------------------------------


def test_unreachable_master_is_reported(connect, free_port):
    node = connect("alone", url=f"ros1://127.0.0.1:{free_port}?ip=127.0.0.1")
    client = node.create_service_client("/add", ADD)
    with pytest.raises(rosglass.ServiceUnavailableError, match=f"127.0.0.1:{free_port}"):
        client.call(timeout=0.5)


def test_unknown_host_is_reported(node, master):
    master.offer("/add", 1234, host="robot.invalid")
    client = node.create_service_client("/add", ADD)
    with pytest.raises(rosglass.ServiceUnavailableError, match="ROS_HOSTNAME") as caught:
        client.call(timeout=3)
    assert "rosrpc://robot.invalid:1234" in str(caught.value)


@pytest.mark.parametrize("uri", ["rosrpc://127.0.0.1", "nonsense", "rosrpc://127.0.0.1:99999"])
def test_invalid_uri_is_reported(node, master, uri):
    master.services["/add"] = ("/robot", uri, "http://127.0.0.1:1")
    client = node.create_service_client("/add", ADD)
    with pytest.raises(rosglass.ServiceUnavailableError, match="the master's answer for /add"):
        client.call(timeout=1)


def test_server_that_was_killed_is_explained(client, node, master, free_port, eventually):
    master.offer("/add", free_port)
    eventually(lambda: node.service_servers("/add"))
    master.calls.clear()
    with pytest.raises(rosglass.ServiceUnavailableError) as caught:
        client.call(timeout=0.6)
    assert f"/robot offers it at rosrpc://127.0.0.1:{free_port}" in str(caught.value)
    assert "Connection refused" in str(caught.value)
    assert "rosnode cleanup" in str(caught.value)
    assert not client.ready
    lookups = master.calls.count("lookupService")
    assert 0 < lookups < 20, "the master is asked again, but not without pause"


def test_problem_of_a_server_that_left_before_the_graph_noticed(
    client, master, free_port, eventually
):
    state = master.getSystemState("/test")
    master.answers["getSystemState"] = lambda _: state
    master.offer("/add", free_port)
    with pytest.raises(rosglass.ServiceUnavailableError, match="a node offers it"):
        client.call(timeout=1)
    del master.services["/add"]
    eventually(lambda: "no server offers /add" in client.problem)


def test_server_that_comes_back_on_another_port_is_called_there(client, start_robot):
    first = start_robot(lambda sock, _: (receive_request(sock), sock.sendall(response(1))))
    assert client.call().sum == 1
    first.close()
    start_robot(lambda sock, _: (receive_request(sock), sock.sendall(response(2))))
    assert client.call().sum == 2


def test_calls_go_on_while_the_master_is_away(client, master, start_robot):
    start_robot()
    assert client.call().sum == 3
    master.stop()
    nothing_happens(1.2)  # what it said last is not taken for its present word any more
    assert client.call(timeout=30).sum == 3
    master.start()


def test_service_that_moved_to_another_node_is_called_there(connect, client, eventually):
    old, new = connect("old"), connect("new")
    first = old.create_service_server("/add", ADD, lambda _: {"sum": 1})
    assert client.call().sum == 1
    second = new.create_service_server("/add", ADD, lambda _: {"sum": 2})
    eventually(lambda: client.call().sum == 2)
    eventually(lambda: "/new offers /add now" in first.problem)
    assert second.problem == ""
    new.close()
    eventually(lambda: first.problem == "")
    eventually(lambda: client.call().sum == 1)


def test_call_uses_no_closing_connection(connect, eventually, monkeypatch):
    old, new = connect("old"), connect("new")
    client = connect("caller").create_service_client("/add", ADD, persistent=True)
    calls, looked, ending = [], threading.Event(), threading.Event()
    caller = threading.Thread(target=lambda: calls.append(client.call_async()))
    fits, end = TcprosRequester._fits, ServiceLink.end

    def fits_and_wait(*given):
        found = fits(*given)
        if threading.current_thread() is caller:
            looked.set()
            assert ending.wait(30)
        return found

    def end_after_the_call(link, reason=""):
        ending.set()
        caller.join(30)
        end(link, reason)

    old.create_service_server("/add", ADD, lambda _: {"sum": 1})
    assert client.call().sum == 1
    monkeypatch.setattr(TcprosRequester, "_fits", fits_and_wait)
    monkeypatch.setattr(ServiceLink, "end", end_after_the_call)
    caller.start()
    assert looked.wait(30)
    new.create_service_server("/add", ADD, lambda _: {"sum": 2})
    eventually(lambda: calls)
    assert calls[0].result(30).sum == 2


# -- servers that misbehave ----------------------------------------------------------------------


def silent(sock, _):
    receive_request(sock)
    sock.recv(1)


def gone(sock, _):
    receive_request(sock)


def garbage(data):
    def serve(sock, _):
        receive_request(sock)
        sock.sendall(data)
        sock.recv(1)

    return serve


def test_silent_server_times_out_and_may_still_execute(client, start_robot):
    seen = []

    def answer(sock, _):
        seen.append(receive_request(sock))
        if len(seen) > 2:
            sock.sendall(response())
        sock.recv(1)

    start_robot(answer)
    with pytest.raises(rosglass.TimeoutError, match="may still carry it out") as caught:
        client.call(timeout=0.5)
    assert "/robot was sent the request" in str(caught.value)
    call = client.call_async(timeout=0.3)
    with pytest.raises(rosglass.TimeoutError):
        call.result(5)
    assert client.pending == 0
    # Given up, not in the way of the next one.
    assert client.call(timeout=30).sum == 3


def test_call_ends_at_once_if_its_server_leaves(client, start_robot):
    start_robot(gone)
    with pytest.raises(rosglass.ConnectionLostError, match="may have carried it out or not"):
        client.call(timeout=30)


@pytest.mark.parametrize(
    ("data", "error", "message"),
    [
        (b"\1\xff\xff\xff\xff", rosglass.ConnectionLostError, "4294967295"),
        (b"\1\3\0\0\0abc", rosglass.ServiceError, "not a rospy_tutorials"),
        (b"\1\x09\0\0\0" + b"123456789", rosglass.ServiceError, "1 bytes left over"),
        (b"\0\4\0\0\0oops", rosglass.ServiceError, "the call of /add failed: oops"),
        (b"\0\0\0\0\0", rosglass.ServiceError, "reports a failure without a reason"),
        (b"\0\2\0\0\0\xff\xfe", rosglass.ServiceError, "failed: "),
    ],
    ids=["endless", "short", "long", "failure", "silent failure", "no UTF-8"],
)
def test_invalid_and_failing_responses_are_reported(client, start_robot, data, error, message):
    start_robot(garbage(data))
    with pytest.raises(error, match=message) as caught:
        client.call(timeout=30)
    assert type(caught.value) is error
    assert client.pending == 0


def test_unrequested_response_ends_a_persistent_connection(node, start_robot):
    def twice(sock, _):
        while True:
            receive_request(sock)
            sock.sendall(response(1) + response(2))

    client = node.create_service_client("/add", ADD, persistent=True)
    start_robot(twice)
    assert [client.call().sum for _ in range(3)] == [1, 1, 1]


@pytest.mark.parametrize(
    "reply", [{"callerid": "/robot"}, {"type": ADD}], ids=["no md5sum", "type only"]
)
def test_incomplete_header_is_reported(client, start_robot, reply, eventually):
    start_robot(reply=reply)

    def reported():
        with pytest.raises(rosglass.ServiceUnavailableError) as caught:
            client.call(timeout=0.6)
        return "no md5sum" in str(caught.value)

    eventually(reported)


def test_refusal_of_a_server_is_quoted(client, start_robot):
    start_robot(reply={"error": "not today"})
    with pytest.raises(
        rosglass.ServiceError, match=r"refuses the call of /add.*not today"
    ) as caught:
        client.call(timeout=30)
    assert not isinstance(caught.value, rosglass.ServiceUnavailableError)


def test_server_that_closes_before_its_header_gets_no_request(client, master):
    with socket.create_server(("127.0.0.1", 0)) as listener:
        master.offer("/add", listener.getsockname()[1])

        def shut():
            with suppress(OSError):
                while True:
                    listener.accept()[0].close()

        threading.Thread(target=shut, daemon=True).start()
        with pytest.raises(rosglass.ServiceUnavailableError, match="nothing was sent"):
            client.call(timeout=0.6)
        listener.shutdown(socket.SHUT_RDWR)


# -- giving up and closing -----------------------------------------------------------------------


def test_cancelled_call_stops_waiting(client, start_robot):
    waiting = client.call_async()
    assert waiting.cancel()
    assert client.pending == 0
    taken = threading.Event()

    def answer(sock, _):
        receive_request(sock)
        if taken.is_set():
            sock.sendall(response())
        taken.set()
        sock.recv(1)

    start_robot(answer)
    sent = client.call_async()
    assert taken.wait(30)
    assert sent.cancel()
    assert client.call(timeout=30).sum == 3


def test_closing_while_connecting_leaves_nothing(master, connect, eventually):
    with socket.create_server(("127.0.0.1", 0)) as listener:
        master.offer("/add", listener.getsockname()[1])
        node = connect("hasty")
        client = node.create_service_client("/add", ADD)
        call = client.call_async()
        sock, _ = listener.accept()
        client.close()
        with pytest.raises(rosglass.NodeClosedError):
            call.result(30)
        sock.settimeout(5)
        while sock.recv(4096):
            pass  # until it is closed


def test_hundreds_of_clients_and_servers_leave_no_files_and_threads(connect, eventually):
    robot, node = connect("robot"), connect("console")
    open_files = lambda: len(__import__("os").listdir("/proc/self/fd"))  # noqa: E731
    before = None
    for turn in range(300):
        server = robot.create_service_server("/add", ADD, lambda _, t=turn: {"sum": t})
        client = node.create_service_client("/add", ADD, persistent=turn % 2 == 0)
        if turn % 30 == 0:
            assert client.call(timeout=30).sum == turn
        client.close()
        server.close()
        if turn == 60:
            before = open_files(), threading.active_count()
    eventually(lambda: "/add" not in node.services())
    eventually(lambda: open_files() <= before[0] + 5)
    eventually(lambda: threading.active_count() <= before[1] + 5)


# -- serving -------------------------------------------------------------------------------------


def test_probe_receives_the_type_and_its_parts(connect, dial):
    robot = connect("robot")
    robot.create_service_server("/add", ADD, add)
    sock, header = dial(callerid="/me", service="/add", md5sum="*", probe="1")
    assert header == {
        "callerid": "/robot",
        "md5sum": MD5,
        "request_type": f"{ADD}Request",
        "response_type": f"{ADD}Response",
        "service": "/add",
        "type": ADD,
    }
    assert sock.recv(1) == b"", "a probe is not a call: the connection is closed"


@pytest.mark.parametrize(
    ("header", "reason"),
    [
        ({"service": "/add", "callerid": "/me"}, "md5sum is missing"),
        ({"service": "/sub", "callerid": "/me", "md5sum": MD5}, "/robot does not offer /sub"),
        ({"callerid": "/me", "md5sum": MD5}, "neither topic nor service"),
        (
            {"service": "/add", "callerid": "/me", "md5sum": "0" * 32, "type": "x/Y"},
            f"/add is {ADD} with md5 {MD5} on /robot, but /me calls it as x/Y with md5 {'0' * 32}",
        ),
    ],
    ids=["md5", "name", "service", "another md5"],
)
def test_refused_connection_receives_the_reason(connect, dial, header, reason):
    robot = connect("robot")
    robot.create_service_server("/add", ADD, add)
    sock, answer = dial(**header)
    assert set(answer) == {"error"}
    assert reason in answer["error"]
    assert sock.recv(1) == b""


@pytest.mark.parametrize("md5", ["*", MD5])
def test_clients_of_the_wire_are_served_in_order(connect, dial, md5):
    robot = connect("robot")
    robot.create_service_server("/add", ADD, add)
    sock, _ = dial(callerid="/me", service="/add", md5sum=md5, persistent="1")
    kind = rosglass.load(ADD, ros=1)
    requests = [kind.request.encode({"a": value, "b": 1}) for value in range(200)]
    sock.sendall(b"".join(struct.pack("<I", len(data)) + data for data in requests))
    for value in range(200):
        assert receive(sock, 5) == b"\1\x08\0\0\0"
        assert kind.response.decode(receive(sock, 8)).sum == value + 1
    sock.close()
    once, _ = dial(callerid="/me", service="/add", md5sum=md5)
    once.sendall(struct.pack("<I", 16) + requests[7])
    assert receive(once, 13) == response(8)
    assert once.recv(1) == b"", "without persistent=1, one call is all"


def test_requests_that_are_not_read_yet_wait_outside(connect, dial):
    """A client that sends without end must not fill the server's memory."""
    robot = connect("robot")
    promise = concurrent.futures.Future()
    seen = []

    def slow(request):
        seen.append(request.a)
        return promise

    robot.create_service_server("/add", ADD, slow)
    sock, _ = dial(callerid="/me", service="/add", md5sum=MD5, persistent="1")
    sock.settimeout(0.5)
    data = (struct.pack("<I", 16) + bytes(16)) * 1000
    sent = 0
    with suppress(TimeoutError):
        while sent < 64e6:
            sent += sock.send(data)
    assert seen == [0]
    assert sent < 64e6
    sock.close()
    promise.set_result(None)


def test_client_that_does_not_read_responses_is_paused(connect, dial, eventually):
    robot = connect("robot")
    seen = []

    def answer(request):
        seen.append(request.data)
        return {"success": True, "message": "x" * 10_000_000}

    robot.create_service_server("/big", BOOL, answer)
    sock, _ = dial(
        "/big",
        callerid="/me",
        service="/big",
        md5sum=rosglass.load(BOOL, ros=1).md5,
        persistent="1",
    )
    sock.sendall((struct.pack("<I", 1) + b"\1") * 20)
    eventually(lambda: seen)
    nothing_happens(0.5)
    assert len(seen) == 1
    for _ in range(20):
        ok, size = struct.unpack("<BI", receive(sock, 5))
        assert ok
        receive(sock, size)
    assert len(seen) == 20
    sock.close()


@pytest.mark.parametrize(
    ("fails", "message"),
    [
        (ValueError("no arm"), "error processing request: no arm"),
        (KeyError(), "error processing request: KeyError"),
        (rosglass.ServiceError("not homed"), "service cannot process request: not homed"),
    ],
)
def test_exception_is_reported_to_the_caller(connect, client, fails, message, caplog):
    def callback(_):
        raise fails

    connect("robot").create_service_server("/add", ADD, callback)
    with pytest.raises(rosglass.ServiceError, match=f"the call of /add failed: {message}$"):
        client.call()
    logged = [record for record in caplog.records if record.levelname == "ERROR"]
    assert bool(logged) != isinstance(fails, rosglass.ServiceError)


def test_malformed_request_is_refused(connect, dial):
    robot = connect("robot")
    seen = []
    robot.create_service_server("/add", ADD, seen.append)
    sock, _ = dial(callerid="/me", service="/add", md5sum=MD5)
    sock.sendall(struct.pack("<I", 3) + b"abc")
    ok, size = struct.unpack("<BI", receive(sock, 5))
    assert not ok
    assert b"the request is not a rospy_tutorials" in receive(sock, size)
    assert seen == []


def test_service_has_one_server_in_a_node(node):
    first = node.create_service_server("/add", ADD, add)
    with pytest.raises(rosglass.ServiceError, match="/console offers /add already"):
        node.create_service_server("/add", ADD, add)
    first.close()
    node.create_service_server("/add", ADD, add).close()


def test_server_that_is_recreated_at_once_stays_registered(node, master, eventually):
    """The background unregistration of the old one must not remove the new one."""
    for _ in range(20):
        server = node.create_service_server("/add", ADD, add)
        eventually(lambda: "/add" in master.services)
        server.close()
    node.create_service_server("/add", ADD, add)
    eventually(lambda: "/add" in master.services)
    # What waits for the master is done before this.
    node.create_service_server("/last", ADD, add)
    eventually(lambda: "/last" in master.services)
    assert "/add" in master.services


def test_closing_withdraws_the_service(connect, master, eventually):
    robot = connect("robot")
    servers = [robot.create_service_server(name, ADD, add) for name in ("/one", "/two")]
    eventually(lambda: set(master.services) == {"/one", "/two"})
    servers[0].close()
    servers[0].close()
    assert servers[0].problem == "the server is closed"
    eventually(lambda: set(master.services) == {"/two"})
    robot.close()
    assert master.services == {}


def test_service_is_registered_again_after_the_master_was_restarted(
    connect, master, client, eventually
):
    connect("robot").create_service_server("/add", ADD, add)
    assert client.call({"a": 1}).sum == 1
    master.stop()
    master.start()
    eventually(lambda: "/add" in master.services)
    assert client.call({"a": 2}).sum == 2


def test_request_of_a_client_that_left_is_not_executed(connect, dial):
    robot = connect("robot")
    seen, begun, go = [], threading.Event(), threading.Event()

    def callback(request):
        seen.append(request.a)
        begun.set()
        go.wait(30)

    robot.create_service_server("/add", ADD, callback)
    kind = rosglass.load(ADD, ros=1).request
    socks = [dial(callerid="/me", service="/add", md5sum=MD5)[0] for _ in range(2)]

    def probe():
        """Connect once more: what came before on other connections is read by then."""
        dial(callerid="/probe", service="/add", md5sum="*", probe="1")[0].close()

    for number, sock in enumerate(socks):
        sock.sendall(struct.pack("<I", 16) + kind.encode({"a": number}))
        assert begun.wait(30)
        probe()
    socks[1].close()
    probe()
    go.set()
    socks[0].settimeout(10)
    assert receive(socks[0], 13) == response(0)
    assert seen == [0]
