"""Names and texts of other nodes that would steer the terminal, or that ROS's rules forbid."""

from __future__ import annotations

import json
import logging
import re

import pytest
import zenoh
from waiting import eventually

#: ESC, C1's CSI, carriage return, bell and a right-to-left override, as a hostile node sends them.
HOSTILE = "evil\x1b[2J\x9b31m\r\x07\u202e"
TWIST = "geometry_msgs::msg::dds_::Twist_"
QOS = "::,10:,:,:,,"
COMMANDS = [
    "topic list -t", "topic list --json", "topic info /fine", "topic info /fine --json",
    "node list", "node list --json", "node info /robot", "service list -t", "action list -t",
    "param list", "doctor", "doctor --json",
]  # fmt: skip


def token(number: int, node: str, *endpoint: str) -> str:
    """Return a token as rmw_zenoh declares it."""
    kind = "MP" if endpoint else "NN"
    more = [endpoint[0].replace("/", "%"), endpoint[1], endpoint[2], QOS] if endpoint else []
    return "/".join(["@ros2_lv", "0", "0badc0de", "0", str(number), kind, "%", "%", node, *more])


@pytest.fixture
def hostile(router):
    """A Zenoh peer that announces hostile nodes, topics, types and hashes among good ones."""
    config = zenoh.Config()
    config.insert_json5("mode", '"client"')
    config.insert_json5("connect/endpoints", json.dumps([router.listen]))
    with zenoh.open(config) as session:
        keys = [
            token(1, "robot"),
            token(2, "robot", "/fine", TWIST, "TypeHashNotSupported"),
            token(3, HOSTILE),
            token(4, "two\nlines"),
            token(5, "robot", f"/{HOSTILE}", TWIST, "TypeHashNotSupported"),
            token(6, "robot", "/two\nlines", TWIST, "TypeHashNotSupported"),
            token(7, "robot", "/1digit", TWIST, "TypeHashNotSupported"),
            token(8, "robot", "/fine", f"pkg::msg::dds_::{HOSTILE}_", "TypeHashNotSupported"),
            token(9, HOSTILE, "/fine", TWIST, HOSTILE),
            token(10, "robot", "/fine", TWIST, HOSTILE),
        ]
        liveliness = session.liveliness()
        tokens = [liveliness.declare_token(key) for key in keys]
        yield tokens


@pytest.mark.parametrize("color", ["never", "always"])
def test_no_command_prints_what_steers_the_terminal(
    hostile, router, run_command, monkeypatch, color
):
    monkeypatch.setenv("ROSGLASS_URL", router.url)
    monkeypatch.setenv("ROS_DOMAIN_ID", "0")
    for command in COMMANDS:
        code, out, err = run_command(*command.split(), "--color", color)
        assert code == 0 or command == "param list", (command, err)
        said = re.sub("\x1b\\[([012]|3[1-6])m", "", out + err)
        assert all(c.isprintable() or c == "\n" for c in said), (command, said)
        if "--json" in command:
            json.loads(out)
        if command.startswith(("topic list", "node list")):
            assert "left out, for ROS's rules forbid such names: 7: " in err
            assert "evil\\x1b[2J" in err
        if command == "topic list -t":
            assert out.splitlines()[0].startswith("/fine")
            assert len(out.splitlines()) == 1
        if command == "node list":
            assert out == "/robot\n"
        if command.startswith("doctor"):
            assert "left out, for ROS's rules forbid such names: 7: " in out


def test_left_out_names_are_kept_apart_and_go_with_their_nodes(hostile, connect):
    node = connect("panel", "?domain=0")
    names = eventually(lambda: len(node.invalid_names()) == 7 and node.invalid_names())
    assert "/two\nlines [geometry_msgs/msg/Twist] of /robot" in names
    assert list(node.topics()) == ["/fine"]
    assert {name.full for name in node.nodes()} == {"/panel", "/robot"}
    for declared in hostile:
        declared.undeclare()
    eventually(lambda: not node.invalid_names())


def test_a_hostile_dds_topic_and_type_are_left_out_of_the_graph():
    from rosglass.comm import NodeName
    from rosglass.comm.graph import Graph
    from rosglass.wires.dds.cyclone import Discovered
    from rosglass.wires.dds.graph import DdsGraph, NodeEntities, ParticipantEntities

    graph = Graph(lambda: None)
    seen = DdsGraph(graph, b"own".ljust(12, b"\0"))
    prefix = b"evil".ljust(12, b"\0")
    seen.put_participants([Discovered(True, prefix + b"\0\0\x01\xc1", 1)])
    for number, topic in enumerate(("rt/fine", f"rt/{HOSTILE}", "rt/two\nlines", "rt//x")):
        guid = prefix + bytes((0, 0, number, 3))
        found = Discovered(True, guid, 2, prefix, f"typehash={HOSTILE};".encode(), topic, TWIST)
        seen.put_endpoint(found, reader=False)
    node = NodeEntities(NodeName("/", "two\nlines"), writers=(prefix + b"\0\0\0\3",))
    seen.put_entities(ParticipantEntities(prefix + b"\0\0\x01\xc1", (node,)))
    assert graph.topics() == {}
    assert graph.nodes() == []
    assert len(graph.invalid_names()) == 5
    seen.put_participants([Discovered(False, prefix + b"\0\0\x01\xc1", 1)])
    for number in range(4):
        seen.put_endpoint(Discovered(False, prefix + bytes((0, 0, number, 3)), 2), reader=False)
    assert graph.invalid_names() == []


def test_log_lines_and_errors_show_no_control_characters(capsys):
    from rosglass.comm.log import warn_on_terminal
    from rosglass.errors import ServiceError

    warn_on_terminal()
    root, before = logging.getLogger(), logging.getLogger().handlers[:]
    root.handlers[:] = []
    try:
        logging.getLogger("rosglass.comm").warning("a node is called %s", HOSTILE)
    finally:
        root.handlers[:] = before
    said = capsys.readouterr().err
    assert "a node is called evil\\u001b[2J\\u009b31m\\u000d\\u0007\\u202e" in said
    assert str(ServiceError(f"/reset: {HOSTILE}\n\tx")).endswith("\\u0007\\u202e\n\tx")
