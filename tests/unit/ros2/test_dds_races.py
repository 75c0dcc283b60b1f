"""Races over DDS, in the order that loses most; without other participants."""

from __future__ import annotations

import threading
from asyncio import CancelledError
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest

import rosglass
from rosglass.comm import EndpointInfo, EndpointKind, NodeName, QoS
from rosglass.comm.graph import Graph
from rosglass.errors import NodeClosedError
from rosglass.ros2 import Ros2Node

pytest.importorskip("cyclonedds", reason='needs pip install "rosglass[dds]"')

from rosglass.wires.dds import cyclone, endpoints, service_endpoints, services
from rosglass.wires.dds import middleware as dds_middleware
from rosglass.wires.dds.cyclone import Discovered, Event, qos_of
from rosglass.wires.dds.cyclone_identity import Identity, Origin, Origins
from rosglass.wires.dds.domain import DdsOptions, DiscoveryRange
from rosglass.wires.dds.middleware import DdsMiddleware
from rosglass.wires.dds.participant import Participant
from rosglass.wires.dds.service_endpoints import MatchedEndpoints, Outbox, ServiceEndpoints
from rosglass.wires.dds.services import DdsReplier

ADD = "example_interfaces/srv/AddTwoInts"
SERVICE = "/add"
#: A sample of a writer that is unknown here.
ELSEWHERE = Origin(b"\x00\x00\x12\x03", 1, None, bytes(12), taken=True)


@pytest.fixture
def ends(monkeypatch):
    """The ends of services, newest last, each with what takes what its reader receives.

    Their samples have the origin `stale`, if that is set, as if it had been left in the memory.
    """
    made = []

    class Haunted(Origins):
        stale: Origin | None = None

        def pop(self, serdata: int) -> Origin | None:
            return super().pop(serdata) if self.stale is None else self.stale

    class Kept(ServiceEndpoints):
        def __init__(self, participant, graph, endpoint, on_taken, on_matched) -> None:
            super().__init__(participant, graph, endpoint, on_taken, on_matched)
            self.on_taken = on_taken
            made.append(self)

    monkeypatch.setattr(service_endpoints, "Origins", Haunted)
    monkeypatch.setattr(services, "ServiceEndpoints", Kept)
    return made


@pytest.fixture
def participants(monkeypatch):
    """The participants of the nodes."""
    made = []

    def make(options: DdsOptions) -> Participant:
        made.append(Participant(options))
        return made[-1]

    monkeypatch.setattr(dds_middleware, "Participant", make)
    return made


@pytest.fixture
def middleware():
    return DdsMiddleware(DdsOptions(domain=58, discovery=DiscoveryRange.OFF))


@pytest.fixture
def node(participants, ends, middleware):
    made = Ros2Node(middleware, "dds://?domain=58&range=off", "here", own_services=False)
    yield made
    made.close()


@pytest.fixture
def participant(node, participants):
    (made,) = participants
    return made


@pytest.fixture
def server(node, ends, eventually):
    """A server with its writer, whose requests are in ``got``."""
    made = node.create_service_server(SERVICE, ADD, lambda r: made.got.append(r.a) or {"sum": r.b})
    made.got = []
    (made.ends,) = ends
    eventually(lambda: made.ends.writer is not None)
    return made


@pytest.fixture
def held(participant):
    """The participant's pump does nothing as long as this is entered."""

    class Held:
        def __enter__(self) -> None:
            self.free, stands = threading.Event(), threading.Event()
            self.entity = -1
            participant.pump.poll(self.entity, lambda: stands.set() or self.free.wait(30))
            assert stands.wait(30)

        def __exit__(self, *_: object) -> None:
            participant.pump.forget(self.entity)
            self.free.set()

    return Held()


def ready(client):
    assert client.wait_for_server(30), client.problem
    return client


def test_reply_is_ready_before_its_client_is_discovered(node, server, monkeypatch):
    unnoticed = {server.ends.reader.entity, server.ends.writer.entity}

    def hide(module: Any, name: str) -> None:
        status = getattr(module, name)

        def matched(entity: int) -> Any:
            return status(entity) and entity not in unnoticed

        monkeypatch.setattr(module, name, matched)

    hide(endpoints, "subscription_matched")
    hide(service_endpoints, "publication_matched")
    client = ready(node.create_service_client(SERVICE, ADD))
    assert client.call({"a": 1, "b": 2}, timeout=30).sum == 2


@pytest.mark.parametrize("noticed", [True, False])
def test_request_is_executed_although_its_client_left_at_once(
    node, server, held, eventually, noticed
):
    if noticed:
        client = ready(node.create_service_client(SERVICE, ADD))
    with held:
        if not noticed:
            client = ready(node.create_service_client(SERVICE, ADD))
        client.call_async({"a": 7})
        client.close()
    eventually(lambda: server.got == [7])


def test_nothing_is_sent_that_a_server_just_announced_may_take_for_arguments(
    node, server, middleware
):
    """Fast DDS's servers take the header that Cyclone DDS's ask for as their arguments."""
    client = ready(node.create_service_client(SERVICE, ADD))
    assert client.call({"a": 1, "b": 2}, timeout=30).sum == 2
    (here,) = node.service_servers(SERVICE)
    middleware.graph.put_endpoint("fast", replace(here, gid=b"\x01\x0f" + bytes(14)))
    with pytest.raises(rosglass.Error, match="/add"):
        client.call({"a": 2}, timeout=0.2)
    assert server.got == [1]
    # It is never matched: it only listens, or its profile does not fit.
    assert client.call({"a": 3, "b": 4}, timeout=30).sum == 4
    assert server.got == [1, 3]


def test_request_at_the_address_of_another_is_not_mistaken_for_it(node, server):
    server.ends.origins.stale = ELSEWHERE
    client = ready(node.create_service_client(SERVICE, ADD))
    assert client.call({"a": 1, "b": 2}, timeout=30).sum == 2


def test_reply_at_the_address_of_another_is_not_mistaken_for_it(node, server, ends):
    client = ready(node.create_service_client(SERVICE, ADD))
    ends[-1].origins.stale = ELSEWHERE
    assert client.call({"a": 1, "b": 2}, timeout=30).sum == 2


def test_repeated_request_is_executed_once(server, eventually):
    request = rosglass.load(ADD).request

    def receive(client: bytes, number: int, value: int) -> None:
        origin = Origin(b"\x00\x00\x12\x03", number, None, client)
        server.ends.on_taken([(request.encode({"a": value}), 0, 0, origin)])

    one, other = (b"\x01\x0f" + bytes(9) + last for last in (b"1", b"2"))  # Fast DDS's
    for number, value in ((1, 10), (2, 20), (1, 10), (2, 20)):
        receive(one, number, value)
    receive(other, 1, 11)
    receive(one, 3, 30)
    eventually(lambda: 30 in server.got)
    assert server.got == [10, 20, 11, 30]


def test_recorded_origins_are_dropped_with_their_reader():
    one, two = Origins(), Origins()
    one.follow(0x1000)
    one.recorded[0x2000] = ELSEWHERE
    # Another reader's type, where the first one's was.
    two.follow(0x1000)
    one.close()
    assert one.pop(0x2000) is None
    assert two.pop(0x2000) is None
    two.follow(0x1000)
    two.close()


def test_senders_guid_decides_whose_sample_it_is():
    whole = Origin(b"\x00\x00\x12\x03", 1, Identity(bytes(16), 1), b"p" * 12)
    part = Origin(b"\x00\x00\x12\x03", 1, None)
    guid = b"p" * 12 + b"\x00\x00\x12\x03"
    assert (whole.guid, part.guid) == (guid, b"")
    assert whole.may_be_of(guid)
    assert part.may_be_of(guid)
    assert not whole.may_be_of(b"q" + guid[1:])
    assert not part.may_be_of(guid[:-1] + b"\x04")


@pytest.mark.parametrize(("depth", "warnings"), [(2, 1), (100, 0)])
def test_requests_are_waited_for_no_longer_than_they_can_come(monkeypatch, caplog, depth, warnings):
    """The oldest are lost when too many wait; without that, several threads may receive some."""
    client = Discovered(False, b"\x01\x0f" + bytes(10) + b"\x00\x00\x12\x03", 0)  # Fast DDS's
    origins = [Origin(client.guid[12:], number, None, client.guid[:12]) for number in range(1, 7)]
    callbacks, got = [], []
    ends = SimpleNamespace(
        depth=depth,
        origins=SimpleNamespace(set_receiver=callbacks.append),
        reader=SimpleNamespace(guid=b""),
        writers=SimpleNamespace(by_guid={client.guid: client}),
        find_sender=lambda _, origin: (client, origin),
        start=lambda: None,
    )

    def make_ends(*arguments: Any) -> Any:
        callbacks.append(arguments[3])
        return ends

    monkeypatch.setattr(services, "ServiceEndpoints", make_ends)
    endpoint = EndpointInfo(EndpointKind.SERVICE_SERVER, SERVICE, ADD, NodeName("/", "here"))
    participant: Any = SimpleNamespace(pump=None)
    replier = DdsReplier(
        participant, Graph(lambda: None), endpoint, lambda request, _: got.append(request.sequence)
    )
    receive, on_received = callbacks
    for origin in origins[:4]:
        assert not on_received(origin, b"")
    replier.quick = True
    receive([(b"", 0, 0, Origin(client.guid[12:], 2, None, client.guid[:12]))])
    assert not on_received(origins[4], b"")  # it would overtake the four
    assert lost_requests(caplog) == []
    receive([(b"", 0, 0, origins[2])])
    lost = [f"/add: 2 requests are lost, as more than {depth} waited"] * warnings
    assert lost_requests(caplog) == lost
    receive([(b"", 0, 0, origins[3])])
    receive([(b"", 0, 0, origins[4])])
    assert on_received(origins[5], b"")
    assert got == [2, 3, 4, 5, 6]
    assert lost_requests(caplog) == lost


def lost_requests(caplog):
    return [record.getMessage() for record in caplog.records if "are lost" in record.getMessage()]


def test_slower_refresh_does_not_overwrite_a_newer_one(server):
    looked, go_on = threading.Event(), threading.Event()
    answers = [[1], [1, 2]]

    def handles(_: int) -> list[int]:
        found = answers.pop(0)
        if found == [1]:
            looked.set()
            assert go_on.wait(30)
        return found

    cyclone_dds = b"\x01\x10"
    matched = server.ends.writers = MatchedEndpoints(
        1, handles, lambda _, handle: SimpleNamespace(guid=cyclone_dds + bytes([handle]))
    )
    first = threading.Thread(target=server.ends.refresh)
    first.start()
    assert looked.wait(30)
    second = threading.Thread(target=server.ends.refresh)
    second.start()
    second.join(0.1)
    go_on.set()
    first.join(5)
    second.join(5)
    assert set(matched.by_guid) == {cyclone_dds + b"\1", cyclone_dds + b"\2"}


def test_departed_endpoints_are_remembered_up_to_a_limit(monkeypatch):
    monkeypatch.setattr("rosglass.wires.dds.service_endpoints._MAX_DEPARTED", 2)
    here = [1]
    matched = MatchedEndpoints(
        1, lambda _: here, lambda _, h: SimpleNamespace(guid=h) if h in here else None
    )
    for handle in (2, 3):
        matched.refresh()
        here[0] = handle
    matched.refresh()
    assert [matched.get(handle) is not None for handle in (1, 2, 3)] == [True, True, True]
    assert [found.guid for found in matched.all] == [3]
    here[0] = 4
    matched.refresh()
    assert [matched.get(handle) is not None for handle in (1, 2, 3, 4)] == [False] * 3 + [True]


def test_writing_after_the_end_raises(node, middleware):
    """The memory that this takes went with the node."""
    endpoint = EndpointInfo(
        EndpointKind.PUBLISHER, "/t", "std_msgs/msg/String", NodeName("/", "here")
    )
    writer = middleware.create_writer(endpoint)
    payload = b"\0\1\0\0\1\0\0\0\0"
    writer.write(payload)
    node.close()
    with pytest.raises(NodeClosedError, match="/t: the publisher is closed"):
        writer.write(payload)
    writer.close()


def test_closing_waits_for_operations_in_progress(node, participant):
    """Closing a node waits while its entities are in use; afterwards no more are created."""
    node_closed = threading.Thread(target=node.close)
    with participant.in_use():
        node_closed.start()
        node_closed.join(0.3)
        assert node_closed.is_alive()
        assert cyclone.guid(participant.entity) == participant.guid
        with pytest.raises(NodeClosedError), participant.in_use():
            pass
    node_closed.join(5)
    assert not node_closed.is_alive()
    with pytest.raises(NodeClosedError):
        cyclone.guid(participant.entity)


def test_unsendable_request_is_dropped_at_once(caplog):
    outbox, ended = Outbox(lambda _: None, in_order=True), []

    def fail() -> bool:
        raise ValueError("no such thing")

    outbox.put(fail, 100.0, lambda: ended.append(1), now=False)
    outbox.put(lambda: True, 100.0, lambda: ended.append(2), now=False)
    assert not outbox.retry()
    assert ended == [1]
    assert "what was to be sent is lost: no such thing" in caplog.text


@pytest.mark.parametrize("raised", [ValueError, SystemExit, CancelledError])
def test_failing_action_does_not_block_the_pump(participant, caplog, eventually, raised):
    topic = cyclone.create_topic(participant.entity, "rt/t", "T")
    policies = qos_of(QoS(), writer=False)
    reader = cyclone.create_reader(participant.entity, topic, policies, "topic /t")
    results: list[bool] = []

    def act() -> bool:
        results.append(not results)
        if results == [True]:
            raise raised("rubbish")
        return len(results) < 3

    participant.pump.watch(reader, Event.DATA_AVAILABLE, act)
    participant.pump.poll(reader, None)
    eventually(lambda: results == [True, False, False])
    assert "what arrived cannot be handed on" in caplog.text
