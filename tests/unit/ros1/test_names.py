"""Names of ROS 1, what URL and environment say, and under which address others reach a node."""

from __future__ import annotations

import socket

import pytest
from ports import free_port

import rosglass
from rosglass import ConversionError, InvalidNameError
from rosglass.comm import anonymous_name
from rosglass.ros1.options import Ros1Options
from rosglass.wires.tcpros import address
from rosglass.wires.tcpros.graph import absolute_namespace, expand, validate_node_name

PLACE = "ros1://127.0.0.1:1"


@pytest.mark.parametrize(
    ("name", "namespace", "full"),
    [
        ("a", "/", "/a"),
        ("a/b", "/ns", "/ns/a/b"),
        ("/a", "/ns", "/a"),
        ("~a", "/ns", "/ns/node/a"),
        ("~/a", "/", "/node/a"),
        ("~", "/ns", "/ns/node"),
        ("a//b/", "/ns", "/ns/a/b"),
        ("/", "/ns", "/"),
        ("a_1/2b", "/", "/a_1/2b"),
    ],
)
def test_names_are_expanded_as_roscpp_does(name: str, namespace: str, full: str) -> None:
    assert expand(name, "node", namespace) == full


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("", "must be a non-empty string"),
        (None, "must be a non-empty string"),
        ("1a", "must begin with a letter"),
        ("_a", "must begin with a letter"),
        ("a b", "' ' at position 1"),
        ("a-b", "'-' at position 1"),
        ("/a/~b", "'~' at position 3"),
        ("~a~", "'~' at position 2"),
        ("é", "'é' at position 0"),
        ("a\n", r"'\\n' at position 1"),
        ("a{b}", "'{' at position 1"),
    ],
)
def test_bad_names_say_where(name: str, message: str) -> None:
    with pytest.raises(InvalidNameError, match=message):
        expand(name, "node", "/")
    with rosglass.connect(PLACE) as node, pytest.raises(InvalidNameError, match=message):
        node.create_subscription(name)


@pytest.mark.parametrize("name", ["", "a/b", "/a", "~a", "1a", "_a", "a b", "a.b", None, 5])
def test_bad_node_names_are_refused(name: str) -> None:
    with pytest.raises(InvalidNameError, match="node name"):
        validate_node_name(name)
    if name is not None:
        with pytest.raises(InvalidNameError, match="node name"):
            rosglass.connect(PLACE, name)


@pytest.mark.parametrize(
    ("text", "namespace"), [("/", "/"), ("/a/", "/a"), ("//a//b", "/a/b"), ("a", "/a")]
)
def test_namespaces_are_tidied(text: str, namespace: str) -> None:
    assert absolute_namespace(text, "ROS_NAMESPACE") == namespace


def test_namespaces_of_programs_are_absolute() -> None:
    with pytest.raises(InvalidNameError, match="namespace 'arm' is not absolute; write '/arm'"):
        rosglass.connect(PLACE, "node", "arm")
    with pytest.raises(InvalidNameError, match="namespace '/a b': ' ' at position 2"):
        rosglass.connect(PLACE, "node", "/a b")


def test_anonymous_names_are_valid_and_differ(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(socket, "gethostname", lambda: "my-robot.local")
    names = {anonymous_name("viewer") for _ in range(100)}
    assert len(names) == 100
    for name in names:
        validate_node_name(name)
        assert name.startswith("viewer_my_robot_local_")


@pytest.mark.parametrize(
    ("url", "env", "master"),
    [
        ("ros1://", {}, "http://localhost:11311"),
        ("ros1://", {"ROS_MASTER_URI": " http://robot:5/ "}, "http://robot:5"),
        ("ros1://panda", {"ROS_MASTER_URI": "http://robot:5"}, "http://panda:11311"),
        ("ros1://panda:7/", {}, "http://panda:7"),
        ("ros1://:7", {"ROS_MASTER_URI": "http://robot:5"}, "http://localhost:7"),
        ("ros1://[fe80::1]:7", {}, "http://[fe80::1]:7"),
    ],
)
def test_master(url: str, env: dict[str, str], master: str) -> None:
    assert Ros1Options.parse(url, env).master == master


@pytest.mark.parametrize(
    ("url", "message"),
    [
        ("ros1://robot:x", "url: expected a URL such as ros1://robot:11311"),
        ("ros1://robot:99999", "url: expected a URL"),
        ("ros1://robot:0", "url: expected a URL"),
        ("ros1://a b", "'a b' is not a host"),
        ("ros1://a%20b", "'a b' is not a host"),
        ("ros1://[::1", "url: expected a URL"),
        ("ros1://robot/path", "url: expected a URL"),
        ("ros1://user@robot", "url: expected a URL"),
        ("ros1://:pw@robot", "url: expected a URL"),
        ("ros1://robot#x", "url: expected a URL"),
        ("ros1://robot?domain=5", "url option domain: expected one of anonymous, ip, slave_port"),
        ("ros1://robot?ip=", "url option ip: expected each option once, with a value"),
        ("ros1://robot?ip=a&ip=b", "url option ip: expected each option once"),
        ("ros1://robot?ip=10.0.0.1:80", "url option ip: expected a host or address only"),
        ("ros1://robot?ip=http://a", "url option ip: expected a host or address only"),
        ("ros1://robot?tcpros_port=-1", "url option tcpros_port: expected a port number"),
        ("ros1://robot?slave_port=70000", "url option slave_port: expected a port number"),
        ("ros1://robot?slave_port=²", "url option slave_port: expected a port number"),
        ("ros1://robot?anonymous=maybe", "url option anonymous: expected true or false"),
    ],
)
def test_bad_urls_are_reported(url: str, message: str) -> None:
    with pytest.raises(ConversionError, match=message):
        rosglass.connect(url)


@pytest.mark.parametrize(
    ("variable", "value", "message"),
    [
        ("ROS_MASTER_URI", "robot:11311", "ROS_MASTER_URI: expected scheme, host and port"),
        ("ROS_MASTER_URI", "robot", "ROS_MASTER_URI: expected scheme, host and port"),
        ("ROS_MASTER_URI", "http://robot", "ROS_MASTER_URI: expected scheme, host and port"),
        ("ROS_MASTER_URI", "http://robot:x", "ROS_MASTER_URI: expected scheme, host and port"),
        ("ROS_MASTER_URI", "https://robot:1", "ROS_MASTER_URI: expected a URI such as http://"),
        ("ROS_IP", "10.0.0.1:80", "ROS_IP: expected a host or address only, without port"),
        ("ROS_HOSTNAME", "http://robot", "ROS_HOSTNAME: expected a host or address only"),
        ("ROS_HOSTNAME", "my robot", "ROS_HOSTNAME: expected a host or address only"),
    ],
)
def test_bad_variables_are_reported(variable: str, value: str, message: str) -> None:
    with pytest.raises(ConversionError, match=message):
        Ros1Options.parse("ros1://", {variable: value})


@pytest.mark.parametrize(
    ("url", "env", "expected"),
    [
        ("ros1://r", {}, ("", "")),
        ("ros1://r", {"ROS_IP": "10.0.0.1"}, ("10.0.0.1", "ROS_IP")),
        ("ros1://r", {"ROS_IP": "10.0.0.1", "ROS_HOSTNAME": "me"}, ("me", "ROS_HOSTNAME")),
        ("ros1://r?ip=10.0.0.2", {"ROS_IP": "10.0.0.1"}, ("10.0.0.2", "ip")),
        ("ros1://r", {"ROS_IP": "fe80::1"}, ("fe80::1", "ROS_IP")),
        ("ros1://r", {"ROS_IP": "  "}, ("", "")),
    ],
)
def test_own_address(url: str, env: dict[str, str], expected: tuple[str, str]) -> None:
    options = Ros1Options.parse(url, env)
    assert (options.address, options.source) == expected


def test_address_towards_the_master_is_announced() -> None:
    assert address.own_address("192.168.7.5") == "192.168.7.5"
    assert address.own_address("::ffff:192.168.7.5") == "192.168.7.5"
    # A master on this machine does not show how other machines reach it.
    assert address.own_address("127.0.0.1") == address.own_address("::1") == address.own_address()


@pytest.mark.parametrize(
    ("host", "interface"),
    [
        ("localhost", "127.0.0.1"),
        ("127.0.0.1", "127.0.0.1"),
        ("127.0.1.1", "127.0.1.1"),
        ("::1", "::1"),
        # What is not this machine's, or may be another address elsewhere.
        ("192.0.2.7", "0.0.0.0"),
        ("2001:db8::7", "::"),
        ("panel", "0.0.0.0"),
    ],
)
def test_node_listens_only_where_it_is_announced(host: str, interface: str) -> None:
    assert address.interface_of(host) == interface


def test_addresses_that_others_cannot_reach_are_doubted() -> None:
    # 192.0.2.0/24 is reserved for documentation (RFC 5737).
    message = address.explain_unreachable("192.0.2.7", "ROS_IP", "robot")
    assert message.startswith("ROS_IP=192.0.2.7 is not an address of this machine: other nodes may")
    message = address.explain_unreachable("127.0.0.1", "ROS_IP", "192.0.2.8")
    assert message.startswith("ROS_IP=127.0.0.1 reaches this machine only")
    assert address.explain_unreachable("127.0.0.1", "", "192.0.2.8").startswith(
        "the own address 127.0.0.1 "
    )
    assert address.explain_unreachable("127.0.0.1", "ROS_IP", "localhost") == ""
    assert address.explain_unreachable("localhost", "ROS_HOSTNAME", "127.0.0.1") == ""
    assert address.explain_unreachable(address.own_address(), "ROS_IP", "192.0.2.8") == "" or (
        address.own_address() == "127.0.0.1"
    )


def test_ports_that_are_taken_are_reported() -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        for option in ("tcpros_port", "slave_port"):
            with pytest.raises(
                rosglass.ConnectionLostError, match=f"cannot listen on port {port}: Address"
            ):
                rosglass.connect(f"{PLACE}?{option}={port}&ip=127.0.0.1")


def test_fixed_ports_can_be_had_again_at_once() -> None:
    port = free_port()
    for _ in range(5):
        with rosglass.connect(f"{PLACE}?slave_port={port}&ip=127.0.0.1") as node:
            assert node.status().state.value == "connecting"
