"""Names, addresses and command lines, held against what rospy makes of the same."""

from __future__ import annotations

import pytest
from ports import free_port
from tcpros import publisher_address
from waiting import eventually

import rosglass

CASES = {
    "nothing": ([], {}),
    "__ns": (["__ns:=/arm"], {}),
    "relative __ns": (["__ns:=arm/left"], {}),
    "ROS_NAMESPACE": ([], {"ROS_NAMESPACE": "robot"}),
    "__ns over ROS_NAMESPACE": (["__ns:=/arm"], {"ROS_NAMESPACE": "/robot"}),
    "remapped": (["chatter:=talk"], {}),
    "remapped in a namespace": (["chatter:=talk", "__ns:=/arm"], {}),
    "remapped to private": (["chatter:=~talk", "/chatter:=elsewhere"], {}),
    "private remapped": (["~chatter:=/talk"], {"ROS_NAMESPACE": "robot"}),
    "last rule": (["chatter:=one", "chatter:=two"], {}),
    "__name": (["__name:=renamed", "~chatter:=talk"], {}),
    "not for ROS": (["--chatter:=talk", "10:=chatter"], {}),
}


@pytest.mark.parametrize("case", list(CASES))
def test_names_are_what_rospy_makes_of_them(case, connect, start_rospy, monkeypatch, master):
    arguments, env = CASES[case]
    peer = start_rospy("twin", *arguments, env=env)
    theirs = peer.call("names")
    peer.end()
    for name, value in env.items():
        monkeypatch.setenv(name, value)
    node = connect("twin", None, arguments=["program", *arguments])
    ours = [f"{node.namespace.rstrip('/')}/{node.name}"]
    ours += [node.resolve(name) for name in ("chatter", "/chatter", "~chatter")]
    assert ours == theirs


def test_remapped_topics_services_and_parameters_are_the_ones_that_others_see(
    connect, tool, master
):
    node = connect(
        "panel",
        arguments=["words:=/said", "reset:=again", "__ns:=/ops", "_speed:=1.5"],
    )
    publisher = node.create_publisher("words", "std_msgs/String", rosglass.QoS.latched())
    publisher.publish(data="hello")
    node.create_service_server("reset", "std_srvs/Empty", lambda _: None)
    eventually(lambda: "/ops/again" in node.services())
    assert tool("rostopic", "echo", "-n1", "-p", "/said").splitlines()[1].endswith(",hello")
    assert tool("rosservice", "call", "/ops/again").strip() == ""
    assert tool("rosnode", "list").split().count("/ops/panel") == 1
    eventually(lambda: "/ops/panel/speed" in tool("rosparam", "list"))
    assert tool("rosparam", "get", "/ops/panel/speed").strip() == "1.5"


def test_private_parameters_of_the_command_line_are_rospys(connect, start_rospy, master):
    values = {"a": "1", "b": "[1, two]", "c": "'1'", "d": "{x: {y: 1.5}}", "e": "true", "f/g": "x"}
    arguments = [f"_{name}:={value}" for name, value in values.items()]
    peer = start_rospy("theirs", *arguments)
    node = connect("ours", arguments=arguments)
    parameters = dict.fromkeys(values)
    eventually(lambda: master.call("hasParam", "/ours/f/g"))
    for name in parameters:
        assert master.call("getParam", f"/ours/{name}") == peer.call("private", name=name)
    assert node.status().detail == ""
    peer.end()


@pytest.mark.parametrize(
    ("arguments", "env", "host"),
    [
        (["__ip:=127.0.0.1"], {}, "127.0.0.1"),
        (["__hostname:=localhost"], {"ROS_IP": "127.0.0.3"}, "localhost"),
        ([], {"ROS_IP": "127.0.0.2"}, "127.0.0.2"),
        ([], {"ROS_HOSTNAME": "localhost", "ROS_IP": "127.0.0.2"}, "localhost"),
    ],
)
def test_we_are_reached_where_we_say(arguments, env, host, start_rospy, monkeypatch, master):
    for name in ("ROS_IP", "ROS_HOSTNAME"):
        monkeypatch.delenv(name, raising=False)
    for name, value in env.items():
        monkeypatch.setenv(name, value)
    with rosglass.connect(f"ros1://127.0.0.1:{master.port}", "placed", arguments=arguments) as node:
        publisher = node.create_publisher("/placed", "std_msgs/Int32", rosglass.QoS.latched())
        publisher.publish(data=4)
        eventually(lambda: node.publishers("/placed"))
        assert master.call("lookupNode", "/placed").startswith(f"http://{host}:")
        peer = start_rospy("visitor")
        peer.call("subscribe", topic="/placed", type="std_msgs/Int32")
        assert peer.event("received")["value"] == {"data": 4}
        peer.end()


def test_reachable_address_is_announced_without_configuration(start_rospy, monkeypatch, master):
    for name in ("ROS_IP", "ROS_HOSTNAME"):
        monkeypatch.delenv(name, raising=False)
    with rosglass.connect(f"ros1://127.0.0.1:{master.port}", "found") as node:
        publisher = node.create_publisher("/found", "std_msgs/Int32", rosglass.QoS.latched())
        publisher.publish(data=5)
        eventually(lambda: node.publishers("/found"))
        peer = start_rospy("visitor")
        peer.call("subscribe", topic="/found", type="std_msgs/Int32")
        assert peer.event("received")["value"] == {"data": 5}
        peer.end()


def test_the_master_of_the_command_line_and_fixed_ports(start_master):
    master = start_master()
    port, api = free_port(), free_port()
    node = rosglass.connect(
        f"ros1://?slave_port={api}&ip=127.0.0.1",
        "fixed",
        arguments=[f"__master:={master.uri}", f"__tcpros_server_port:={port}"],
    )
    with node:
        node.create_publisher("/fixed", "std_msgs/Empty")
        eventually(lambda: node.publishers("/fixed"))
        assert master.call("lookupNode", "/fixed") == f"http://127.0.0.1:{api}/"
        assert publisher_address(node, "/fixed") == ("127.0.0.1", port)


def test_nodes_without_a_name_do_not_end_each_other(connect, master):
    nodes = [connect(None) for _ in range(5)]
    for number, node in enumerate(nodes):
        node.create_publisher(f"/number{number}", "std_msgs/Empty")
    eventually(lambda: all(node.publishers(f"/number{n}") for n, node in enumerate(nodes)))
    assert [node.status().state.value for node in nodes] == ["connected"] * 5
