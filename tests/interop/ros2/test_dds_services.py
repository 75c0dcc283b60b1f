"""Services over DDS with peers of every kind, each in its own process, as client and as server."""

from __future__ import annotations

import importlib.util
import json
import logging
import os
import signal
import threading
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest

import rosglass
from rosglass.interfaces import Library

pytest.importorskip("cyclonedds", reason='needs pip install "rosglass[dds]"')

from waiting import eventually

from rosglass.wires.dds import cyclone_identity
from rosglass.wires.dds.services import DdsReplier, DdsRequester

PEERS = Path(__file__).parent / "peers"
ADD, BLOB = "example_interfaces/srv/AddTwoInts", "blob_interfaces/srv/Blob"
DEFINITIONS = {
    ADD: "int64 a\nint64 b\n---\nint64 sum\n",
    BLOB: "uint8[] data\n---\nuint8[] data\n",
}
KINDS = ["cyclone", "fastdds", "dora", "rosglass"]
#: A killed participant is gone after its lease, which is 10 s without this.
SHORT_LEASE = (
    "<CycloneDDS><Domain><Discovery><LeaseDuration>1s</LeaseDuration></Discovery></Domain>"
    "</CycloneDDS>"
)
BIG = 1_000_000
#: Requests that peers on rosglass answer on demand.
LATER = -2

pytestmark = pytest.mark.peers


@pytest.fixture(scope="module")
def prefix(tmp_path_factory):
    """A prefix such as ROS installs, with the types of the services."""
    prefix = tmp_path_factory.mktemp("services")
    for name, text in DEFINITIONS.items():
        package, kind, base = name.split("/")
        folder = prefix / "share" / package / kind
        folder.mkdir(parents=True)
        (folder / f"{base}.srv").write_text(text)
        (prefix / "share" / package / "package.xml").write_text(
            f'<package format="3"><name>{package}</name><version>1.0.0</version><description/>'
            '<maintainer email="a@example.org">a</maintainer><license>MIT</license></package>'
        )
    return prefix


@pytest.fixture(scope="module")
def start_services(start, dds_domain, prefix, request):
    """Start a peer of a kind with both services, or with those given."""

    def start_services(kind: str, name: str, serve: Any = ("add", "blob"), config: str = "") -> Any:
        if kind == "dora" and importlib.util.find_spec("dora") is None:
            pytest.skip('dora-rs is not installed: pip install "rosglass[peers]"')
        plan = {"kind": kind, "domain": dds_domain, "name": name, "serve": serve}
        plan["interfaces"] = str(prefix)
        if kind == "fastdds":
            plan["fastdds"] = str(request.getfixturevalue("fastdds_program"))
        env = os.environ | {"AMENT_PREFIX_PATH": str(prefix)}
        if config:
            env["CYCLONEDDS_URI"] = config
        process = start(str(PEERS / "dds_services_peer.py"), json.dumps(plan), env=env)
        process.event("ready")
        return process

    return start_services


@pytest.fixture(scope="module", params=KINDS)
def peer(request, start_services):
    process = start_services(request.param, f"{request.param}_peer")
    process.kind, process.name = request.param, f"{request.param}_peer"
    yield process
    process.end()


@pytest.fixture(scope="module")
def types(prefix):
    library = Library()
    library.add_path(prefix)
    return {name: rosglass.load(name, library=library) for name in (ADD, BLOB)}


@pytest.fixture(scope="module")
def node(dds_domain):
    """Our node: one for all tests, as another program takes a second or two to know a new one."""
    made = rosglass.connect(f"dds://?domain={dds_domain}", "cockpit")
    yield made
    made.close()


def ready(client: Any) -> Any:
    assert client.wait_for_server(30), client.problem
    return client


def blob(size: int) -> bytes:
    return bytes(range(251)) * (size // 251) + bytes(size % 251)


def call_us(peer: Any, service: str, **requests: Any) -> list[Any]:
    """Let a peer call a service; returns its answers."""
    peer.ask(call=service, **requests)
    return peer.event("answers")


# -- every kind, both ways -----------------------------------------------------------------------


def test_we_call_a_peer(peer, node, types):
    client = ready(node.create_service_client(f"/{peer.name}/add", types[ADD]))
    assert client.problem == ""
    assert [client.call({"a": n, "b": 1}).sum for n in range(5)] == [1, 2, 3, 4, 5]


def test_we_call_a_peer_many_times_at_once(peer, node, types):
    client = ready(node.create_service_client(f"/{peer.name}/add", types[ADD]))
    calls = [client.call_async({"a": n, "b": 100}) for n in range(100)]
    assert [call.result(30).sum for call in calls] == list(range(100, 200))
    assert client.pending == 0


def test_we_call_a_peer_with_a_megabyte_each_way(peer, node, types):
    client = ready(node.create_service_client(f"/{peer.name}/blob", types[BLOB]))
    # RustDDS's replies that need several packets are malformed: Cyclone DDS drops those.
    for size in (0, 1000) if peer.kind == "dora" else (0, 1000, BIG):
        answer = client.call({"data": blob(size)}, timeout=30)
        assert bytes(answer.data) == blob(size)[::-1]


def test_a_peer_calls_us(peer, node, types):
    with node.create_service_server("/add", types[ADD], lambda r: {"sum": r.a - r.b}) as server:
        sums = call_us(peer, "/add", sums=[[n, 5] for n in range(100)])
        assert sums == [n - 5 for n in range(100)]
        assert server.problem == ""


def test_a_peer_calls_us_with_a_megabyte_each_way(peer, node, types):
    with node.create_service_server("/blob", types[BLOB], lambda r: {"data": r.data[::-1]}):
        for size in (1000, BIG):
            assert call_us(peer, "/blob", size=size) == [True]


def test_a_peer_that_calls_us_is_killed(start_services, peer, node, types):
    """Its reply is dropped, and the others' arrive."""
    requests: list[Any] = []

    def serve(request: Any) -> Any:
        if request.a >= 0:
            return {"sum": request.a}
        promised: Future[Any] = Future()
        requests.append(promised)
        return promised

    with node.create_service_server("/slow", types[ADD], serve):
        doomed = start_services(peer.kind, "doomed", ())
        doomed.ask(call="/slow", sums=[[-1, 0]])
        eventually(lambda: requests)
        doomed.end()
        requests[0].set_result({"sum": 0})
        own = ready(node.create_service_client("/slow", types[ADD]))
        assert own.call({"a": 7}).sum == 7
        assert call_us(peer, "/slow", sums=[[8, 0]]) == [8]


# -- several at once -----------------------------------------------------------------------------


def test_the_first_request_of_a_new_rclpy_client_is_answered(start_rclpy, node):
    # Fast DDS announces a client's writer at the moment when it sends the first request.
    got: list[int] = []

    def answer(_: Any) -> dict[str, Any]:
        got.append(1)
        return {"success": True}

    server = node.create_service_server("/trigger", "std_srvs/srv/Trigger", answer)
    clients = start_rclpy("rclpy_clients", "/trigger", "100")
    assert clients.stdout is not None
    ends = [clients.stdout.readline().strip() for _ in range(100)]
    server.close()
    assert "lost" not in ends
    assert ends.count("answered") == len(got)
    assert ends.count("answered") >= 95


def test_clients_of_all_kinds_at_one_server_get_their_own_replies(
    start_services, node, dds_connect, types
):
    node.create_service_server("/mixed", types[ADD], lambda r: {"sum": r.a + r.b})
    peers = [start_services(kind, f"{kind}_client", ()) for kind in KINDS]
    client = ready(dds_connect("other").create_service_client("/mixed", types[ADD]))
    for number, peer in enumerate(peers):
        peer.ask(call="/mixed", sums=[[1000 * number, n] for n in range(100)])
    calls = [client.call_async({"a": -1000, "b": n}) for n in range(100)]
    assert [call.result(30).sum for call in calls] == [n - 1000 for n in range(100)]
    for number, peer in enumerate(peers):
        assert peer.event("answers") == [1000 * number + n for n in range(100)], KINDS[number]


def test_replies_have_an_identity_as_soon_as_another_vendors_participant_is_known(
    start_services, node, types, monkeypatch
):
    # dora's clients fail on one without: by multicast they get it before they are discovered here.
    identities: list[Any] = []
    write = cyclone_identity.write_reply

    def write_reply(writer: Any, identity: Any, parts: Any) -> bool:
        identities.append(identity)
        return write(writer, identity, parts)

    monkeypatch.setattr(cyclone_identity, "write_reply", write_reply)
    bystander = start_services("dora", "bystander", ())
    with node.create_service_server("/sum", types[ADD], lambda r: {"sum": r.a + r.b}):
        client = start_services("cyclone", "header_client", ())
        # The participant counts, not its node, which is announced later.
        eventually(
            lambda: call_us(client, "/sum", sums=[[2, 1]]) == [3] and identities,
            what="dora's participant",
        )
        identities.clear()
        assert call_us(client, "/sum", sums=[[n, 1] for n in range(5)]) == [1, 2, 3, 4, 5]
    assert len(identities) == 5
    client.end()
    bystander.end()


def test_two_of_our_clients_in_one_process_get_their_own_replies(node, dds_connect, types, peer):
    one = ready(node.create_service_client(f"/{peer.name}/add", types[ADD]))
    two = ready(dds_connect("other").create_service_client(f"/{peer.name}/add", types[ADD]))
    calls = [
        (c.call_async({"a": a, "b": n}), a + n)
        for n in range(50)
        for c, a in ((one, 0), (two, 500))
    ]
    assert [call.result(30).sum for call, _ in calls] == [wanted for _, wanted in calls]


def test_samples_taken_during_reception_do_not_stay(start_services, node, types, monkeypatch):
    """The library keeps its samples until they are taken again, and keeps only some."""
    readers = cyclone_identity.readers
    before = set(readers)
    taken: list[bool] = []
    for end in (DdsRequester, DdsReplier):

        def count(self: Any, *sample: Any, original: Any = end._on_received) -> bool:
            taken.append(original(self, *sample))
            return taken[-1]

        monkeypatch.setattr(end, "_on_received", count)
    node.create_service_server("/kept", types[ADD], lambda r: {"sum": r.a + r.b})
    peer = start_services("rosglass", "keeper", ["add"])
    client = ready(node.create_service_client("/keeper/add", types[ADD]))
    peer.ask(call="/kept", sums=[[n, 1] for n in range(200)])
    calls = [client.call_async({"a": n, "b": 1}) for n in range(200)]
    # Requests that wait for each other, some in another thread, and those on their way.
    with ThreadPoolExecutor(2) as pool:
        for each in range(100):
            others = [pool.submit(client.call, {"a": each, "b": n}) for n in range(2)]
            assert [other.result(30).sum for other in others] == [each, each + 1]
    assert [call.result(30).sum for call in calls] == [n + 1 for n in range(200)]
    assert peer.event("answers") == [n + 1 for n in range(200)]
    kept = [readers[new] for new in readers.keys() - before]
    assert len(kept) >= 2
    eventually(
        lambda: len(taken) >= 600 and not any(each.recorded for each in kept), what="the taking"
    )
    assert taken.count(True) > 100
    peer.end()


def test_servers_that_exclude_each_other_are_named(start_services, node, types):
    """Fast DDS's way and Cyclone DDS's cannot both be served by one request."""
    first = start_services("cyclone", "twice", ["add"])
    client = ready(node.create_service_client("/twice/add", types[ADD]))
    assert client.call({"a": 1, "b": 2}).sum == 3
    second = start_services("fastdds", "twice", ["add"])
    eventually(lambda: "exclude each other" in client.problem, what="the conflict")
    assert "(Fast DDS)" in client.problem
    assert client.call({"a": 3, "b": 4}).sum == 7
    assert second.event("got") == [3, 4]
    first.end()
    second.end()


# -- what goes wrong -----------------------------------------------------------------------------


@pytest.fixture
def impatient(monkeypatch):
    """Give servers that left a tenth of a second to answer all the same."""
    monkeypatch.setattr("rosglass.comm.service_client._GRACE_S", 0.1)


def cut_off(server: Any, until: Any) -> None:
    """Let a program say nothing, as when its link is down, until something holds."""
    os.kill(server.pid, signal.SIGSTOP)
    try:
        eventually(until, what="its absence")
    finally:
        os.kill(server.pid, signal.SIGCONT)


def test_a_server_that_was_cut_off_in_a_call_and_is_back(start_services, node, types, impatient):
    """Its answer may have been lost in the meantime: the call must not wait for it for ever."""
    server = start_services("cyclone", "away", ["add"], config=SHORT_LEASE)
    client = ready(node.create_service_client("/away/add", types[ADD]))
    call = client.call_async({"a": -1}, timeout=None)
    assert server.event("got") == [-1, 0]
    cut_off(server, lambda: not client.ready)
    with pytest.raises(rosglass.ConnectionLostError, match="may have carried it out or not"):
        call.result(30)
    assert ready(client).call({"a": 1, "b": 2}).sum == 3
    server.end()


def test_a_server_that_was_cut_off_shortly_still_answers(start_services, node, types):
    server = start_services("rosglass", "slow", ["add"], config=SHORT_LEASE)
    client = ready(node.create_service_client("/slow/add", types[ADD]))
    call = client.call_async({"a": LATER, "b": 1}, timeout=None)
    assert server.event("got") == [LATER, 1]
    cut_off(server, lambda: not client.ready)
    ready(client)
    server.ask(finish=True)
    assert call.result(30).sum == LATER + 1
    server.end()


def test_a_call_goes_on_as_long_as_one_of_its_servers_stays(start_services, node, types, impatient):
    one, two = (start_services("cyclone", "both", ["add"], config=SHORT_LEASE) for _ in range(2))
    client = node.create_service_client("/both/add", types[ADD])
    eventually(lambda: len(node.service_servers("/both/add")) == 2, what="two servers")
    eventually(lambda: "offer" in client.problem, what="two servers")
    ready(client)
    call = client.call_async({"a": -1}, timeout=None)
    assert one.event("got") == two.event("got") == [-1, 0]
    cut_off(one, lambda: len(node.service_servers("/both/add")) == 1)
    eventually(lambda: len(node.service_servers("/both/add")) == 2, what="the return of the first")
    with pytest.raises(rosglass.TimeoutError):
        call.result(1.5)
    # The one that is back never asked again: the call ends with the other.
    two.end()
    with pytest.raises(rosglass.ConnectionLostError):
        call.result(30)
    one.end()


@pytest.mark.parametrize("kind", ["cyclone", "rosglass"])
def test_server_killed_in_a_call_is_reported_and_its_successor_called(
    start_services, node, types, impatient, kind
):
    # How long it takes to be noticed is up to the server's participant: its lease.
    name = f"mortal_{kind}"
    server = start_services(kind, name, ["add"], config=SHORT_LEASE)
    client = ready(node.create_service_client(f"/{name}/add", types[ADD]))
    call = client.call_async({"a": -1}, timeout=None)
    assert server.event("got") == [-1, 0]
    server.end()
    with pytest.raises(rosglass.ConnectionLostError, match="may have carried it out or not"):
        call.result(30)
    waiting = client.call_async({"a": 5, "b": 6}, timeout=30)
    server = start_services(kind, name, ["add"])
    assert waiting.result(30).sum == 11
    server.end()


def test_a_call_ends_when_another_server_has_replaced_its_killed_one(
    start_services, node, types, impatient
):
    config = SHORT_LEASE.replace("1s", "120s")
    server = start_services("rosglass", "replaced", ["add"], config=config)
    client = ready(node.create_service_client("/replaced/add", types[ADD]))
    call = client.call_async({"a": -1}, timeout=None)
    assert server.event("got") == [-1, 0]
    server.end()
    successor = start_services("rosglass", "replaced", ["add"])
    with pytest.raises(rosglass.ConnectionLostError, match="may have carried it out or not"):
        call.result(60)
    assert client.call({"a": 5, "b": 6}, timeout=30).sum == 11
    successor.end()


def test_rubbish_is_logged_once_and_does_not_affect_others(node, types, caplog, start, dds_domain):
    plan = {"domain": dds_domain, "requests": "/strict", "replies": "/odd"}
    server = node.create_service_server("/strict", types[ADD], lambda r: {"sum": r.a + r.b})
    client = node.create_service_client("/odd", types[ADD])
    with caplog.at_level(logging.WARNING, "rosglass"):
        rubbish = start(str(PEERS / "dds_rubbish_peer.py"), json.dumps(plan))
        rubbish.event("sent")
        eventually(lambda: "too short for its header" in caplog.text)
        own = ready(node.create_service_client("/strict", types[ADD]))
        assert own.call({"a": 1, "b": 2}).sum == 3
        call = client.call_async({"a": 1}, timeout=1)
        with pytest.raises(rosglass.TimeoutError):
            call.result(5)
        eventually(lambda: "ignoring a reply" in caplog.text)
    messages = [record.getMessage() for record in caplog.records]
    assert sum("ignoring a request" in text for text in messages) == 1
    assert sum("ignoring a reply" in text for text in messages) == 1
    assert server.problem == ""
    rubbish.end()


def test_unrequested_replies_are_ignored(node, types, start, dds_domain):
    plan = {"domain": dds_domain, "service": "/foreign", "foreign": 50}
    peer = start(str(PEERS / "dds_foreign_replies_peer.py"), json.dumps(plan))
    client = ready(node.create_service_client("/foreign", types[ADD]))
    for number in range(20):
        assert client.call({"a": number, "b": 1}, timeout=30).sum == number + 1
    assert max(peer.event("sent") for _ in range(20)) == 20 * 50
    peer.end()


def test_a_reply_from_the_main_thread_goes_out(node, types, peer):
    """A signal's exception in the main thread must not end up in Cyclone DDS."""
    waiting: list[Any] = []

    def serve(request: Any) -> Any:
        promised: Future[Any] = Future()
        waiting.append((promised, request.a))
        return promised

    with node.create_service_server("/patient", types[ADD], serve):
        peer.ask(call="/patient", sums=[[41, 0]])
        eventually(lambda: waiting)
        promised, a = waiting[0]
        assert threading.current_thread() is threading.main_thread()
        promised.set_result({"sum": a + 1})
        assert peer.event("answers") == [42]
