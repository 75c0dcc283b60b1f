"""Parameters: ours against rosmaster, rosparam, rospy and roscpp."""

from __future__ import annotations

import math
import time

import pytest
from waiting import eventually

from rosglass.comm import ParameterType
from rosglass.errors import ConnectionLostError, ParameterError


@pytest.fixture
def node(connect):
    return connect("cockpit", "/ops")


@pytest.fixture
def server(node):
    return node.parameter_server


@pytest.mark.parametrize(
    ("value", "printed"),
    [
        (True, "true"),
        (-(2**31), "-2147483648"),
        (1.5, "1.5"),
        (math.inf, ".inf"),
        ("Grüße <&>", '"Gr\\xFC\\xDFe <&>"'),
        ("", "''"),
        ([1, 2.5, "x", [True]], "- 1\n- 2.5\n- x\n- - true"),
        ({"a": {"b": 1}}, "a:\n  b: 1"),
    ],
)
def test_rosparam_reads_what_we_set(server, tool, value, printed):
    server.set("/t/value", value)
    assert tool("rosparam", "get", "/t/value").strip() == printed
    assert server.get("/t/value") == value


def test_rosparam_lists_and_deletes_ours_and_we_see_what_it_sets(server, tool):
    server.set("/l", {"a": 1, "b": {"c": 2}})
    assert tool("rosparam", "list", "/l").split() == ["/l/a", "/l/b/c"]
    assert server.names("/l") == ["/l/a", "/l/b/c"]
    notified: list[object] = []
    subscription = server.subscribe("/l", notified.append)
    assert subscription.wait(30)
    tool("rosparam", "set", "/l/b/c", "[1, 2]")
    eventually(lambda: notified and notified[-1] == {"a": 1, "b": {"c": [1, 2]}})
    tool("rosparam", "set", "/l", "5")
    eventually(lambda: notified[-1] == 5)
    tool("rosparam", "delete", "/l")
    eventually(lambda: notified[-1] is None)
    assert "not set" in tool("rosparam", "get", "/l", status=1)


def test_files_go_both_ways(server, tool, tmp_path):
    path = tmp_path / "robot.yaml"
    path.write_text(
        "speed: 1.5\nlimits: {low: deg(-90), high: rad(pi/2)}\nnames: [a, b]\n"
        "data: !!binary AP8=\n---\n_ns: sub\nx: yes\n"
    )
    tool("rosparam", "load", str(path), "/theirs")
    server.load(path, "/ours")
    assert server.get("/ours") == server.get("/theirs")
    server.save(path, "/ours")
    tool("rosparam", "load", str(path), "/again")
    assert server.get("/again") == server.get("/theirs")
    server.delete("/theirs/data")  # rosparam in Python 3 loads bytes, but cannot print them
    tool("rosparam", "dump", str(path), "/theirs")
    assert server.load(path, "/back")
    assert server.get("/back") == server.get("/theirs")


def test_rospy_reads_and_sets_with_us(server, node, rospy_peer):
    server.set("/py/a", 1)
    assert rospy_peer.call("get_param", name="/py/a", cached=True) == [1, "int"]
    server.set("/py/a", 2.0)
    eventually(lambda: rospy_peer.call("get_param", name="/py/a", cached=True) == [2.0, "float"])
    notified: list[object] = []
    subscription = server.subscribe("/py", notified.append)
    assert subscription.wait(30)
    rospy_peer.call("set_param", name="/py/b", value={"c": [True, "x"]})
    eventually(lambda: subscription.value == {"a": 2.0, "b": {"c": [True, "x"]}})
    rospy_peer.call("delete_param", name="/py/a")
    eventually(lambda: "a" not in subscription.value)
    server.set("/gain", {"p": 1})
    assert rospy_peer.call("search_param", name="gain/p") == server.search("gain/p") == "/gain/p"
    node.parameters.set({"mine": 5})
    assert rospy_peer.call("get_param", name="/ops/cockpit/mine") == [5, "int"]


def test_roscpp_reads_and_sets_with_us(server, roscpp_peer):
    server.set("/cpp/a", [1, 2.5, "x <&>"])
    assert roscpp_peer.call("get_param", name="/cpp/a") == (
        "<value><array><data><value><i4>1</i4></value><value><double>2.5</double></value>"
        "<value>x &lt;&amp;&gt;</value></data></array></value>"
    )
    server.set("/cpp/bytes", b"\0\xff")
    assert "<base64>AP8=" in roscpp_peer.call("get_param", name="/cpp/bytes")
    server.set("/cpp/b", 1)
    value = "<value><i4>{}</i4></value>"
    assert roscpp_peer.call("get_param", name="/cpp/b", cached=True) == value.format(1)
    server.set("/cpp/b", -7)
    eventually(
        lambda: roscpp_peer.call("get_param", name="/cpp/b", cached=True) == value.format(-7),
        timeout=20,
    )
    subscription = server.subscribe("/cpp/c")
    assert subscription.wait(30)
    roscpp_peer.call("set_param", name="/cpp/c", text="<Grüße>")
    eventually(lambda: subscription.value == "<Grüße>")
    roscpp_peer.call("set_param", name="/cpp/c", real=0.1)
    eventually(lambda: subscription.value == 0.1)
    roscpp_peer.call("set_param", name="/cpp/c", items=[3, 4])
    eventually(lambda: subscription.value == [3, 4])


def test_parameters_on_our_command_line_are_there_for_others(connect, rospy_peer):
    node = connect("arm", "/left", arguments=["prog", "_speed:=1.5", "_joints:=[a, b]", "x"])
    assert node.parameters.get("speed") == 1.5
    assert rospy_peer.call("get_param", name="/left/arm/joints") == [["a", "b"], "list"]


def test_another_nodes_parameters_are_seen_through_a_client(node, rospy_peer):
    rospy_peer.call("set_param", name="~speed", value=1.5)
    rospy_peer.call("set_param", name="~arm", value={"joints": ["a", "b"]})
    with node.create_parameter_client("/rospy_peer") as client:
        assert client.wait_for_server(30)
        assert client.names() == ["arm/joints", "speed"]
        assert client.get() == {"arm/joints": ["a", "b"], "speed": 1.5}
        assert client.describe()["arm/joints"].type is ParameterType.STRING_ARRAY
        events: list = []
        client.watch(events.append)
        eventually(lambda: node.parameter_server.subscribe("/rospy_peer").wait(30))
        assert client.set({"speed": 2.5})["speed"].successful
        # Values are read again when one has changed: two changes at once may be one event.
        eventually(lambda: events)
        assert rospy_peer.call("get_param", name="~speed") == [2.5, "float"]
        rospy_peer.call("delete_param", name="~arm")
        eventually(lambda: len(events) == 2)
        assert events[0].changed == {"speed": 2.5}
        assert events[1].deleted == ("arm/joints",)


def test_missing_parameter_is_reported_with_similar_names(server):
    server.set("/robot/max_speed", 1)
    with pytest.raises(ParameterError, match=r"did you mean /robot/max_speed\?"):
        server.get("/robot/max_sped")


def test_a_master_that_is_killed_and_one_that_follows(start_master, connect, start_rospy):
    master = start_master()
    node = connect("watcher", url=master.url)
    server = node.parameter_server
    server.set("/a", 1)
    notified: list[object] = []
    server.subscribe("/a", notified.append)
    eventually(lambda: notified == [1])
    master.kill()
    began = time.monotonic()
    with pytest.raises(ConnectionLostError, match=str(master.port)):
        server.get("/a")
    promise = server.set_async("/a", 2)
    with pytest.raises(ConnectionLostError):
        promise.result(30)
    assert time.monotonic() - began < 5
    assert notified == [1]
    master.start()
    eventually(lambda: notified == [1, None])
    start_rospy("setter", master=master).call("set_param", name="/a", value="new")
    eventually(lambda: notified == [1, None, "new"])
