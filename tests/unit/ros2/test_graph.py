from __future__ import annotations

import pytest

from rosglass.comm import EndpointInfo, EndpointKind, NodeName
from rosglass.ros2 import Graph

TALKER, LISTENER = NodeName("/", "talker"), NodeName("/arm", "listener")
PUBLISHER, SUBSCRIPTION = EndpointKind.PUBLISHER, EndpointKind.SUBSCRIPTION
SERVER, CLIENT = EndpointKind.SERVICE_SERVER, EndpointKind.SERVICE_CLIENT


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


def test_node_is_in_the_graph_by_its_endpoints_alone(graph):
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


def test_only_real_changes_are_notified(graph, changes):
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


def test_services_are_apart_from_topics(graph):
    graph.put_endpoint(1, endpoint(SERVER, "/add", "p/srv/Add"))
    graph.put_endpoint(2, endpoint(CLIENT, "/sub", "p/srv/Sub", LISTENER))
    graph.put_endpoint(3, endpoint(PUBLISHER, "/add", "p/msg/A"))
    assert graph.services() == {"/add": ["p/srv/Add"], "/sub": ["p/srv/Sub"]}
    assert graph.topics() == {"/add": ["p/msg/A"]}
    assert [e.node for e in graph.endpoints(CLIENT, "/sub")] == [LISTENER]


def test_actions_show_by_their_parts(graph):
    graph.put_endpoint(1, endpoint(SERVER, "/arm/fib/_action/send_goal", "p/action/Fib_SendGoal"))
    graph.put_endpoint(2, endpoint(SERVER, "/arm/fib/_action/get_result", "p/action/Fib_GetResult"))
    graph.put_endpoint(
        3, endpoint(PUBLISHER, "/turn/_action/feedback", "p/action/Turn_FeedbackMessage")
    )
    graph.put_endpoint(
        4, endpoint(PUBLISHER, "/x/_action/status", "action_msgs/msg/GoalStatusArray")
    )
    graph.put_endpoint(5, endpoint(SERVER, "/y/_action/send_goal", "p/srv/Other"))
    assert graph.actions() == {"/arm/fib": ["p/action/Fib"], "/turn": ["p/action/Turn"]}


def test_hidden_names_are_there_unless_they_are_not_wanted(graph):
    graph.put_endpoint(1, endpoint(PUBLISHER, "/fib/_action/status"))
    graph.put_endpoint(2, endpoint(PUBLISHER, "/open_"))
    graph.put_endpoint(3, endpoint(SERVER, "/_secret", "p/srv/S"))
    assert list(graph.topics()) == ["/fib/_action/status", "/open_"]
    assert list(graph.topics(hidden=False)) == ["/open_"]
    assert (list(graph.services()), graph.services(hidden=False)) == (["/_secret"], {})


def test_endpoints_are_listed_by_node(graph):
    graph.put_endpoint(1, endpoint(PUBLISHER, "/a"))
    graph.put_endpoint(2, endpoint(SERVER, "/s", "p/srv/S"))
    graph.put_endpoint(3, endpoint(PUBLISHER, "/b", node=LISTENER))
    assert [e.name for e in graph.endpoints_of(TALKER)] == ["/a", "/s"]
    graph.put_endpoint(1, endpoint(PUBLISHER, "/a", node=LISTENER))
    graph.remove(2)
    assert graph.endpoints_of(TALKER) == []
    assert [e.name for e in graph.endpoints_of(LISTENER)] == ["/b", "/a"]
    assert graph.nodes() == [LISTENER]
