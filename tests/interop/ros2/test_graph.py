"""What a node offers and uses, as another one sees it: the same over DDS and Zenoh."""

from __future__ import annotations

import pytest
from waiting import eventually

from rosglass.comm import EndpointKind, NodeName, QoS
from rosglass.comm.names import hidden

STRING = "std_msgs/msg/String"
ADD, FIBONACCI = "example_interfaces/srv/AddTwoInts", "example_interfaces/action/Fibonacci"
ROBOT = NodeName("/arm", "robot")


@pytest.fixture(params=["dds", "zenoh"])
def nodes(request):
    """A robot's node and an operator's."""
    connect = request.getfixturevalue("dds_connect" if request.param == "dds" else "connect")
    return connect("robot", namespace="/arm"), connect("operator")


def test_topics_services_and_actions_with_the_nodes_they_belong_to(nodes):
    robot, operator = nodes
    robot.create_publisher("state", STRING, QoS.latched())
    robot.create_subscription("goal", STRING)
    robot.create_service_server("add", ADD, lambda request: {"sum": request.a + request.b})
    robot.create_service_client("/elsewhere", ADD)
    robot.create_action_server("count", FIBONACCI, lambda goal: None)
    named = {
        ("/arm/state", EndpointKind.PUBLISHER),
        ("/arm/goal", EndpointKind.SUBSCRIPTION),
        ("/arm/add", EndpointKind.SERVICE_SERVER),
        ("/elsewhere", EndpointKind.SERVICE_CLIENT),
        ("/arm/count/_action/send_goal", EndpointKind.SERVICE_SERVER),
        ("/arm/count/_action/status", EndpointKind.PUBLISHER),
    }
    eventually(lambda: named <= {(end.name, end.kind) for end in operator.endpoints(ROBOT)})
    for node in nodes:
        assert node.topics()["/arm/state"] == node.topics()["/arm/goal"] == [STRING]
        assert node.services()["/arm/add"] == node.services()["/elsewhere"] == [ADD]
        assert node.actions() == {"/arm/count": [FIBONACCI]}
        assert [end.node for end in node.service_servers("/arm/add")] == [ROBOT]
        assert [end.node for end in node.service_clients("/elsewhere")] == [ROBOT]
        assert node.service_servers("/elsewhere") == node.service_clients("/arm/add") == []
        (publisher,) = node.publishers("/arm/state")
        assert publisher.qos.durability is QoS.latched().durability
        assert len(publisher.gid) == 16
        assert node.endpoints("/arm/robot") == node.endpoints(ROBOT)
    assert [name for name in operator.topics() if not hidden(name) and "/arm/" in name] == [
        "/arm/goal",
        "/arm/state",
    ]
    (server,) = operator.service_servers("/arm/add")
    assert server.type_hash.startswith("RIHS01_")


def test_what_is_closed_is_gone(nodes):
    robot, operator = nodes
    publisher = robot.create_publisher("state", STRING)
    server = robot.create_service_server("add", ADD, lambda request: None)
    eventually(lambda: operator.publishers("/arm/state") and operator.service_servers("/arm/add"))
    publisher.close()
    server.close()
    for node in nodes:
        eventually(lambda node=node: not node.publishers("/arm/state"))
        eventually(lambda node=node: "/arm/add" not in node.services())
    assert ROBOT in operator.nodes()
    robot.close()
    eventually(lambda: ROBOT not in operator.nodes())
    eventually(lambda: not operator.endpoints(ROBOT))
