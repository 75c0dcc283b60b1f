"""Details of the in-process graph beyond the contract of all wires."""

from __future__ import annotations

import contextlib
import threading
import uuid

import pytest

import rosglass
from rosglass.comm import EndpointInfo, EndpointKind, NodeName, QoS
from rosglass.comm.graph import Graph
from rosglass.errors import NodeClosedError
from rosglass.wires import local
from rosglass.wires.local import LocalMiddleware


def test_graph_ends_with_its_last_node():
    with pytest.raises(rosglass.InvalidNameError):
        rosglass.connect("local://unit", "a b")
    with rosglass.connect("local://unit", "one"), rosglass.connect("local://unit", "two"):
        assert "unit" in local.networks
    assert "unit" not in local.networks


@pytest.mark.parametrize("url", ["local://a?x=1", "local://a b", "local://a/b"])
def test_more_than_a_name_is_refused(url):
    with pytest.raises(rosglass.ConversionError, match="expected local://NAME"):
        rosglass.connect(url, "one")


NODE = NodeName("/", "one")
LATCHED = QoS.latched(10)


def publisher(qos=LATCHED):
    return EndpointInfo(EndpointKind.PUBLISHER, "/map", "std_msgs/msg/String", NODE, qos)


def subscription(qos=LATCHED):
    return EndpointInfo(EndpointKind.SUBSCRIPTION, "/map", "std_msgs/msg/String", NODE, qos)


@pytest.fixture
def join():
    """Join a graph of the test's own."""
    joined, url = [], f"local://{uuid.uuid4().hex}"

    def join(kind=LocalMiddleware, graph=None):
        joined.append(kind(url))
        joined[-1].open(graph or Graph(lambda: None), lambda: None)
        return joined[-1]

    yield join
    for middleware in joined:
        middleware.close()


class ClosedWhileOpening(LocalMiddleware):
    """Is closed by another thread just before something that it opens appears in the graph."""

    def add(self, end):
        super().add(end)
        self.close()


@pytest.mark.parametrize(
    "open_something",
    [
        lambda wire: wire.create_writer(publisher()),
        lambda wire: wire.create_reader(subscription(), lambda *_: None),
        lambda wire: wire.announce(NODE),
    ],
)
def test_endpoint_opened_while_closing_does_not_stay_in_the_graph(join, open_something):
    graph = Graph(lambda: None)
    join(graph=graph)
    wire = join(ClosedWhileOpening)
    with contextlib.suppress(NodeClosedError):
        open_something(wire)
    assert (graph.nodes(), graph.topics()) == ([], {})


def test_no_node_of_a_closed_connection_is_announced(join):
    graph = Graph(lambda: None)
    join(graph=graph)
    wire = join()
    wire.close()
    with pytest.raises(NodeClosedError):
        wire.announce(NODE)
    assert graph.nodes() == []


def test_endpoint_closed_while_a_node_joins_does_not_stay_in_its_graph(join):
    closing = []

    class CloseMeanwhile(Graph):
        def put_endpoint(self, key, endpoint):
            if not closing:
                closing.append(threading.Thread(target=writer.close))
                closing[0].start()
                closing[0].join(0.2)
            super().put_endpoint(key, endpoint)

    wire = join()
    writer = wire.create_writer(publisher())
    graph = CloseMeanwhile(lambda: None)
    join(graph=graph)
    closing[0].join()
    assert graph.topics() == {}


def test_samples_of_two_publishers_that_link_at_once_keep_their_order(join):
    """A newer sample must not overtake a kept one, which would then count as a repeat."""
    received = []
    first, second = threading.Event(), threading.Event()
    entered = threading.Semaphore(0)

    def on_sample(data, *_):
        if data in (b"first 1", b"second 1"):
            entered.release()
            assert (first if data == b"first 1" else second).wait(10)
        received.append(data)

    wire = join()
    writers = [wire.create_writer(publisher()) for _ in range(2)]
    for writer, data in zip(writers, (b"first 1", b"second 1"), strict=True):
        writer.write(data)
        writer.hide()
    wire.create_reader(subscription(), on_sample)
    linking = [threading.Thread(target=writer.show) for writer in writers]
    for thread in linking:
        thread.start()
        assert entered.acquire(timeout=10)
    writers[1].write(b"second 2")
    for event, thread in zip((first, second), linking, strict=True):
        event.set()
        thread.join(10)
    assert received == [b"first 1", b"second 1", b"second 2"]
