from __future__ import annotations

import pytest

from rosglass.comm import EndpointInfo, EndpointKind, NodeName
from rosglass.ros2 import Graph

TALKER, LISTENER = NodeName("/", "talker"), NodeName("/arm", "listener")
PUBLISHER, SUBSCRIPTION = EndpointKind.PUBLISHER, EndpointKind.SUBSCRIPTION


def endpoint(kind, name="/t", type="p/msg/A", node=TALKER):
    return EndpointInfo(kind, name, type, node)


@pytest.fixture
def changes():
    return []


@pytest.fixture
def graph(changes):
    return Graph(lambda: changes.append(1))


def test_nodes_are_sorted_and_named_once(graph):
    graph.put_node("b", LISTENER)
    graph.put_node("a", TALKER)
    graph.put_node("c", TALKER)
    assert graph.nodes() == [TALKER, LISTENER]
    graph.remove("a")
    assert graph.nodes() == [TALKER, LISTENER]
    graph.remove("c")
    assert graph.nodes() == [LISTENER]


def test_a_node_shows_by_its_endpoints_alone(graph):
    graph.put_endpoint("a", endpoint(PUBLISHER, node=LISTENER))
    assert graph.nodes() == [LISTENER]


def test_topics_with_their_types(graph):
    graph.put_endpoint(1, endpoint(PUBLISHER, "/b"))
    graph.put_endpoint(2, endpoint(SUBSCRIPTION, "/b", "p/msg/B"))
    graph.put_endpoint(3, endpoint(SUBSCRIPTION, "/a"))
    graph.put_endpoint(4, endpoint(EndpointKind.SERVICE_SERVER, "/s"))
    assert graph.topics() == {"/a": ["p/msg/A"], "/b": ["p/msg/A", "p/msg/B"]}
    assert list(graph.topics()) == ["/a", "/b"]


def test_endpoints_of_a_topic(graph):
    graph.put_endpoint(1, endpoint(PUBLISHER))
    graph.put_endpoint(2, endpoint(SUBSCRIPTION, node=LISTENER))
    assert [e.node for e in graph.endpoints(SUBSCRIPTION, "/t")] == [LISTENER]
    assert graph.endpoints(PUBLISHER, "/other") == []
    graph.remove(2)
    assert graph.endpoints(SUBSCRIPTION, "/t") == []


def test_only_real_changes_are_told(graph, changes):
    graph.put_node("n", TALKER)
    graph.put_endpoint("e", endpoint(PUBLISHER))
    assert len(changes) == 2
    graph.put_node("n", TALKER)
    graph.put_endpoint("e", endpoint(PUBLISHER))
    graph.remove("unknown")
    assert len(changes) == 2
    graph.put_endpoint("e", endpoint(PUBLISHER, "/renamed"))
    assert len(changes) == 3
    assert graph.endpoints(PUBLISHER, "/t") == []
    assert len(graph.endpoints(PUBLISHER, "/renamed")) == 1


def test_clearing_forgets_everything(graph, changes):
    graph.put_node("n", TALKER)
    graph.put_endpoint("e", endpoint(PUBLISHER))
    graph.clear()
    assert (graph.nodes(), graph.topics(), graph.endpoints(PUBLISHER, "/t")) == ([], {}, [])
    assert len(changes) == 3
