from __future__ import annotations

import itertools

import pytest

from rosglass.comm import EndpointInfo, EndpointKind, NodeName, QoS
from rosglass.ros2 import Graph
from rosglass.wires.dds.cyclone import Discovered
from rosglass.wires.dds.graph import (
    PARTICIPANT_USER_DATA,
    DdsGraph,
    NodeEntities,
    ParticipantEntities,
)

PUBLISHER, SUBSCRIPTION = EndpointKind.PUBLISHER, EndpointKind.SUBSCRIPTION
SERVER, CLIENT = EndpointKind.SERVICE_SERVER, EndpointKind.SERVICE_CLIENT
STRING = "std_msgs::msg::dds_::String_"
TALKER, LISTENER = NodeName("/", "talker"), NodeName("/arm", "listener")
OWN = b"\x01\x10" + bytes(10) + b"\x00\x00\x01\xc1"


class Domain:
    """A domain with participants that come and go, as reported by discovery."""

    def __init__(self) -> None:
        self.changes = 0
        #: The nodes after each change, and which of them there were twice.
        self.seen: list[tuple[list[NodeName], dict[str, int]]] = []
        self.graph = Graph(self._changed)
        self.dds = DdsGraph(self.graph, OWN)
        self.dds.put_participants([Discovered(True, OWN, 0, OWN, PARTICIPANT_USER_DATA)])
        self._numbers = itertools.count(1)

    def _changed(self) -> None:
        self.changes += 1
        self.seen.append((self.graph.nodes(), self.graph.duplicate_nodes()))

    def join(self, user_data=b"enclave=/;", **properties):
        prefix = b"\x01\x0f" + next(self._numbers).to_bytes(10, "big")
        found = self.participant(prefix, user_data, **properties)
        self.dds.put_participants([found])
        return prefix

    def participant(self, prefix, user_data=b"", **properties):
        guid = prefix + b"\x00\x00\x01\xc1"
        texts = tuple((f"__{name}", text) for name, text in properties.items())
        return Discovered(True, guid, 1, guid, user_data, properties=texts)

    def leave(self, prefix):
        guid = prefix + b"\x00\x00\x01\xc1"
        self.dds.put_participants([Discovered(False, guid, 1, guid)])

    def add(self, prefix, topic, type_name=STRING, *, reader=False, user_data=b"", qos=None):
        guid = prefix + next(self._numbers).to_bytes(3, "big") + (b"\x04" if reader else b"\x03")
        self.change(guid, topic, type_name, reader=reader, user_data=user_data, qos=qos)
        return guid

    def change(self, guid, topic, type_name=STRING, *, reader=False, user_data=b"", qos=None):
        participant = guid[:12] + b"\x00\x00\x01\xc1"
        found = Discovered(True, guid, 1, participant, user_data, topic, type_name, qos or QoS())
        self.dds.put_endpoint(found, reader=reader)

    def drop(self, guid):
        self.dds.put_endpoint(Discovered(False, guid, 1), reader=guid[-1] == 4)

    def announce(self, prefix, *nodes, humble=False):
        gid = prefix + b"\x00\x00\x01\xc1"
        return self.dds.put_entities(ParticipantEntities(gid, nodes, humble))


@pytest.fixture
def domain():
    return Domain()


def writers(node, *guids):
    return NodeEntities(node, (), guids)


def readers(node, *guids):
    return NodeEntities(node, guids, ())


@pytest.mark.parametrize("order", ["endpoint first", "node first"])
def test_endpoints_and_nodes_are_joined_in_any_order(domain, order):
    robot = domain.join()
    guid = robot + b"\x00\x00\x05\x03"
    announced = lambda: domain.announce(robot, writers(TALKER, guid), readers(LISTENER))  # noqa: E731
    if order == "node first":
        announced()
    domain.change(guid, "rt/chatter", user_data=b"typehash=RIHS01_ab;", qos=QoS.latched(3))
    if order == "endpoint first":
        announced()
    assert domain.graph.nodes() == [TALKER, LISTENER]
    assert domain.graph.endpoints(PUBLISHER, "/chatter") == [
        EndpointInfo(
            PUBLISHER, "/chatter", "std_msgs/msg/String", TALKER, QoS.latched(3), "RIHS01_ab", guid
        )
    ]


def test_components_that_come_and_go_leave_the_others_where_they_are(domain):
    base, front, lidar = (NodeName("/", name) for name in ("base", "front", "lidar"))
    container = domain.join()
    domain.announce(container, writers(base), writers(front), writers(lidar))
    domain.seen.clear()
    domain.announce(container, writers(base), writers(lidar))
    assert domain.seen == [([base, lidar], {})]
    domain.seen.clear()
    domain.announce(container, writers(front), writers(base), writers(lidar))
    assert domain.seen == [([base, front, lidar], {})]
    domain.leave(container)
    assert domain.graph.nodes() == []


def test_two_nodes_of_one_name_in_a_participant_are_counted(domain):
    container = domain.join()
    domain.announce(container, writers(TALKER), writers(TALKER))
    assert domain.graph.duplicate_nodes() == {"/talker": 2}
    domain.announce(container, writers(TALKER))
    assert domain.graph.nodes() == [TALKER]
    assert domain.graph.duplicate_nodes() == {}


def test_endpoint_of_no_announced_node_belongs_to_the_only_node(domain):
    robot = domain.join()
    domain.announce(robot, writers(TALKER))
    domain.add(robot, "rt/chatter", reader=True)
    assert domain.graph.endpoints(SUBSCRIPTION, "/chatter")[0].node == TALKER
    domain.announce(robot, writers(TALKER), readers(LISTENER))
    assert domain.graph.endpoints(SUBSCRIPTION, "/chatter")[0].node.namespace == "/_dds"


@pytest.mark.parametrize(
    ("properties", "name"),
    [
        (
            {"ProcessName": "/usr/bin/my-bridge", "Pid": "42", "Hostname": "pc.local"},
            "my_bridge_42_pc_local",
        ),
        ({}, "010f00000000000000000001"),
        ({"Hostname": "pc"}, "010f00000000000000000001"),
    ],
)
def test_endpoints_of_unknown_nodes_show_under_their_process(domain, properties, name):
    robot = domain.join(b"", **properties)
    guid = domain.add(robot, "rt/chatter")
    assert domain.graph.endpoints(PUBLISHER, "/chatter")[0].node == NodeName("/_dds", name)
    domain.announce(robot, writers(TALKER, guid))
    assert domain.graph.nodes() == [TALKER]


def test_endpoint_may_come_before_its_participant(domain):
    prefix = b"\x01\x0f" + bytes(10)
    domain.add(prefix, "rt/chatter")
    assert domain.graph.nodes() == [NodeName("/_dds", prefix.hex())]
    domain.dds.put_participants([domain.participant(prefix, ProcessName="bridge", Pid="7")])
    assert domain.graph.nodes() == [NodeName("/_dds", "bridge_7")]
    assert not domain.announce(b"\x09" * 12, writers(TALKER))
    assert domain.announce(prefix, writers(TALKER))


def test_nodes_come_go_and_change_their_names(domain):
    robot = domain.join()
    domain.announce(robot, writers(TALKER), readers(LISTENER))
    domain.announce(robot, readers(LISTENER))
    assert domain.graph.nodes() == [LISTENER]
    domain.announce(robot)
    assert domain.graph.nodes() == []


def test_one_participant_may_have_two_nodes_of_one_name(domain):
    robot = domain.join()
    domain.announce(robot, writers(TALKER), writers(TALKER))
    domain.announce(robot, writers(TALKER))
    assert domain.graph.nodes() == [TALKER]


def test_everything_goes_with_the_participant(domain):
    robot, other = domain.join(), domain.join()
    guid = domain.add(robot, "rt/chatter")
    domain.announce(robot, writers(TALKER, guid))
    domain.announce(other, readers(LISTENER))
    assert domain.dds.peers == 2
    domain.leave(robot)
    domain.drop(guid)
    assert domain.graph.nodes() == [LISTENER]
    assert domain.graph.topics() == {}
    assert domain.dds.peers == 1
    assert domain.dds.participant(guid) is None
    domain.leave(robot)
    domain.drop(guid)


def test_participant_that_left_and_returned_between_two_polls_keeps_its_nodes(domain):
    robot = domain.join()
    domain.announce(robot, writers(TALKER))
    back = domain.participant(robot, b"enclave=/;")
    gone = Discovered(False, back.guid, 1, back.guid)
    domain.dds.put_participants([gone, back])
    assert domain.graph.nodes() == [TALKER]


ADD = (
    ("rq/addRequest", "p::srv::dds_::Add_Request_"),
    ("rr/addReply", "p::srv::dds_::Add_Response_"),
)


@pytest.mark.parametrize("server", [True, False])
@pytest.mark.parametrize("request_first", [True, False])
def test_service_is_in_the_graph_once_both_topics_are(domain, server, request_first):
    robot = domain.join()
    domain.announce(robot, writers(TALKER))
    (request, request_type), (reply, reply_type) = ADD

    def add_request():
        return domain.add(
            robot, request, request_type, reader=server, user_data=b"clientid=1;typehash=RIHS01_s;"
        )

    def add_reply():
        return domain.add(robot, reply, reply_type, reader=not server)

    one = add_request() if request_first else add_reply()
    assert domain.graph.services() == {}
    two = add_reply() if request_first else add_request()
    kind = SERVER if server else CLIENT
    guid, other = (one, two) if request_first else (two, one)
    assert domain.graph.endpoints(kind, "/add") == [
        EndpointInfo(kind, "/add", "p/srv/Add", TALKER, QoS(), "RIHS01_s", guid)
    ]
    assert domain.graph.topics() == {}
    domain.drop(other)
    assert domain.graph.services() == {}
    domain.drop(guid)
    assert domain.graph.nodes() == [TALKER]


def test_service_shows_the_hash_of_its_response_too(domain):
    robot = domain.join()
    (request, request_type), (reply, reply_type) = ADD
    hashed = {"user_data": b"typehash=RIHS01_q;"}
    domain.add(robot, request, request_type, reader=True, **hashed)

    def response_hash():
        return [end.response_hash for end in domain.graph.endpoints(SERVER, "/add")]

    first = domain.add(robot, reply, reply_type, user_data=b"typehash=RIHS01_r;")
    assert response_hash() == ["RIHS01_r"]
    other = domain.add(robot, reply, reply_type, user_data=b"typehash=RIHS01_x;")
    assert response_hash() == [""]  # ambiguous: either reply may belong to the request
    domain.drop(other)
    assert response_hash() == ["RIHS01_r"]
    domain.drop(first)
    domain.add(robot, reply, reply_type, **hashed)
    assert response_hash() == [""]  # one hash for the whole service


def test_topics_of_two_participants_make_no_service(domain):
    (request, request_type), (reply, reply_type) = ADD
    domain.add(domain.join(), request, request_type, reader=True)
    domain.add(domain.join(), reply, reply_type)
    assert domain.graph.services() == {}


def test_actions_show(domain):
    robot = domain.join()
    base = "x/_action/send_goal"
    domain.add(robot, f"rq/{base}Request", "p::action::dds_::Go_SendGoal_Request_", reader=True)
    domain.add(robot, f"rr/{base}Reply", "p::action::dds_::Go_SendGoal_Response_")
    assert domain.graph.services() == {"/x/_action/send_goal": ["p/action/Go_SendGoal"]}
    assert domain.graph.actions() == {"/x": ["p/action/Go"]}


def test_topics_outside_ros_are_ignored(domain):
    robot = domain.join(b"")
    before = domain.changes
    for topic in ("Square", "ros_discovery_info", "rt", "rq/x", "", "rtps/x"):
        domain.drop(domain.add(robot, topic, "ShapeType"))
    assert domain.changes == before
    domain.add(robot, "rt/shapes", "ShapeType")
    assert domain.graph.topics() == {"/shapes": ["ShapeType"]}


def test_our_own_endpoints_show_at_once_and_stay_as_they_were_created(domain):
    domain.announce(OWN[:12], writers(TALKER))
    guid = OWN[:12] + b"\x00\x00\x05\x04"
    ours = EndpointInfo(SUBSCRIPTION, "/chatter", "std_msgs/msg/String", TALKER, QoS(3), "", guid)
    domain.dds.put_own(ours)
    assert domain.graph.endpoints(SUBSCRIPTION, "/chatter") == [ours]
    domain.change(guid, "rt/chatter", reader=True, qos=QoS(64))
    assert domain.graph.endpoints(SUBSCRIPTION, "/chatter") == [ours]
    domain.drop(guid)
    assert domain.graph.topics() == {}


def test_width_of_identities_follows_other_implementations(domain):
    assert not domain.dds.humble
    wide = domain.join()
    domain.announce(wide, writers(TALKER), humble=True)
    assert domain.dds.humble
    ours = domain.join(PARTICIPANT_USER_DATA)
    domain.announce(ours, writers(LISTENER))
    assert domain.dds.humble
    narrow = domain.join()
    domain.announce(narrow, writers(LISTENER))
    assert not domain.dds.humble
    domain.leave(narrow)
    assert domain.dds.humble


def test_repeated_announcements_of_a_thousand_endpoints_change_only_new_ones(domain):
    robot = domain.join()
    guids = [domain.add(robot, f"rt/t{number}") for number in range(1000)]
    domain.announce(robot, writers(TALKER, *guids[:-1]), writers(LISTENER))
    before = domain.changes
    domain.announce(robot, writers(TALKER, *guids[:-1]), writers(LISTENER, guids[-1]))
    assert domain.changes == before + 1
    domain.announce(robot, writers(TALKER, *guids[:-1]), writers(LISTENER, guids[-1]))
    assert domain.changes == before + 1
    assert len(domain.graph.endpoints_of(TALKER)) == 999


@pytest.mark.parametrize(
    ("representations", "reader", "foreign"),
    [
        ((), False, False),
        ((0,), False, False),
        ((2,), False, True),
        ((0, 2), False, False),
        ((2, 0), False, True),  # a writer sends in the first one
        ((2, 0), True, False),
        ((2,), True, True),
    ],
)
def test_endpoints_that_do_not_speak_our_encoding_are_known(
    domain, representations, reader, foreign
):
    guid = domain.join() + b"\0\0\1" + (b"\4" if reader else b"\3")
    found = Discovered(
        True, guid, 1, guid, b"", "rt/t", STRING, QoS(), representations=representations
    )
    domain.dds.put_endpoint(found, reader=reader)
    assert domain.dds.is_foreign(guid) is foreign
    domain.drop(guid)
    assert not domain.dds.is_foreign(guid)


def test_vendors_follow_the_participants(domain):
    assert domain.dds.vendors == {b"\x01\x10"}
    first, second = domain.join(), domain.join()
    assert domain.dds.vendors == {b"\x01\x10", b"\x01\x0f"}
    domain.leave(first)
    assert b"\x01\x0f" in domain.dds.vendors
    domain.leave(second)
    assert domain.dds.vendors == {b"\x01\x10"}
