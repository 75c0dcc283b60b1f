"""Parameters of ROS 1 nodes, on the server of a master in this process."""

from __future__ import annotations

import asyncio
import threading
import time
from contextlib import suppress

import pytest
from tcpros import node_uri

import rosglass
from rosglass.comm import IMMEDIATE, ParameterDescriptor, ParameterType, Range
from rosglass.errors import (
    ConnectionLostError,
    ConversionError,
    InvalidNameError,
    MasterError,
    NodeClosedError,
    ParameterError,
    RosArgumentError,
    UnsupportedError,
)


@pytest.fixture
def node(connect):
    return connect("arm", "/left", own_services=False)


@pytest.fixture
def server(node):
    return node.parameter_server


# -- the server ----------------------------------------------------------------------------------


def test_names_are_absolute_relative_or_private(server, master):
    server.set("/a", 1)
    server.set("a", 2)
    server.set("~a", {"b": 3})
    assert master.tree == {"a": 1, "left": {"a": 2, "arm": {"a": {"b": 3}}}}
    assert server.get("arm/a") == {"b": 3}
    assert server.get("/") == master.tree
    assert server.names() == ["/a", "/left/a", "/left/arm/a/b"]
    assert server.names("~") == ["/left/arm/a/b"]
    assert server.has("~a/b")
    assert not server.has("~b")


def test_search_goes_upwards(server):
    server.set("/gain/p", 1)
    assert server.search("gain") == "/gain"
    assert server.search("gain/i") == "/gain/i"
    server.set("/left/gain", 2)
    assert server.search("gain") == "/left/gain"
    assert server.search("nothing") is None
    assert server.search("/gain") == "/gain"
    assert server.search("~gain") is None


def test_unset_parameter_is_reported_with_similar_names(server):
    server.set("/robot_arm/speed_limit", 1)
    assert server.get("/robot_arm/sped_limit", 5) == 5
    assert server.get("/robot_arm/sped_limit", None) is None
    with pytest.raises(
        ParameterError, match=r"/robot_arm/sped_limit is not .*mean /robot_arm/speed_limit\?"
    ):
        server.get("/robot_arm/sped_limit")
    with pytest.raises(
        ParameterError, match=r"/robot_arn is not set on http://.*did you mean /robot_arm\?"
    ):
        server.get("/robot_arn")
    with pytest.raises(
        ParameterError, match=r"/robot_arm/speed_limi is not .*mean /robot_arm/speed_limit\?"
    ):
        server.delete("/robot_arm/speed_limi")


def test_deleting(server, master):
    server.set("/a/b", 1)
    server.delete("/a")
    assert master.tree == {}
    with pytest.raises(ParameterError, match=r"the root cannot be deleted; set it to {}"):
        server.delete("/")


def test_bad_names_and_values_are_refused_before_anything_is_sent(server, master):
    with pytest.raises(InvalidNameError):
        server.set("a b", 1)
    with pytest.raises(InvalidNameError):
        server.set("/a b", 1)
    with pytest.raises(InvalidNameError):
        server.get("")
    with pytest.raises(InvalidNameError):
        server.get(5)
    with pytest.raises(ParameterError, match="/a: 4294967296 is beyond the 32 bits"):
        server.set("/a", 2**32)
    with pytest.raises(ParameterError, match="the root is a namespace, got 5"):
        server.set("/", 5)
    with pytest.raises(ConversionError):
        server.get("/a", timeout="soon")
    assert not {"setParam", "getParam"} & set(master.calls)


def test_names_against_the_rules_that_are_there_can_be_read_and_deleted(server, master):
    master.tree["base-link"] = {"x y": 1}
    assert server.names() == ["/base-link/x y"]
    assert server.get("/base-link/x y") == 1
    server.delete("/base-link/x y")
    assert master.tree == {"base-link": {}}


def test_refusals_by_the_master_are_reported(server, master):
    master.answers["setParam"] = lambda *_: [-1, "read-only today", 0]
    with pytest.raises(ParameterError, match=r"parameter /a: .*read-only today"):
        server.set("/a", 1)
    master.answers["getParam"] = lambda *_: [-1, "not today", 0]
    master.answers["hasParam"] = lambda *_: [1, "", True]
    with pytest.raises(ParameterError, match=r"/a cannot be read: .*not today"):
        server.get("/a", 5)


def test_missing_or_silent_master_is_reported_in_time(server, master):
    hold = threading.Event()
    master.answers["getParam"] = lambda *_: [1, "", int(hold.wait(30))]
    began = time.monotonic()
    with pytest.raises(ConnectionLostError, match="no answer in time"):
        server.get("/a", timeout=0.3)
    assert time.monotonic() - began < 5
    hold.set()
    master.stop()
    with pytest.raises(ConnectionLostError, match="Connection refused"):
        server.get("/a")
    with pytest.raises(ConnectionLostError):
        server.set("/a", 1)
    master.start()


def test_promises_do_not_wait(server, node, master):
    hold = threading.Event()
    master.answers["setParam"] = lambda *_: [1, "", int(hold.wait(30))]
    began = time.monotonic()
    promise = server.set_async("/a", 1)
    assert time.monotonic() - began < 5
    assert not promise.done()
    hold.set()
    assert promise.result(10) is None
    del master.answers["setParam"]
    assert server.set_async("/b/c", 2).result(10) is None
    assert server.get_async("/b").result(30) == {"c": 2}
    assert server.get_async("/x", 7).result(30) == 7
    assert server.has_async("/b").result(30)
    assert server.names_async().result(30) == ["/b/c"]
    assert server.search_async("b").result(30) == "/b"
    assert server.delete_async("/b/c").result(10) is None
    with pytest.raises(ParameterError, match="/b/c is not set"):
        server.get_async("/b/c").result(10)
    with pytest.raises(ParameterError, match="beyond the 32 bits"):
        server.set_async("/a", 2**40)
    with pytest.raises(InvalidNameError):
        server.get_async("a b")

    async def ask() -> object:
        return await server.get_async("/x", 8)

    assert asyncio.run(ask()) == 8
    results: list[object] = []
    done = threading.Event()
    server.get_async("/x", 9).on_done(lambda p: (results.append(p.result()), done.set()))
    assert done.wait(30)
    assert results == [9]
    master.answers["getParam"] = lambda *_: [1, "", int(hold.wait(30))]
    hold.clear()
    waiting = server.get_async("/x")
    node.close()
    with pytest.raises(NodeClosedError):
        waiting.result(30)
    hold.set()


def test_promises_keep_their_order_and_fail_together(server, master):
    waiting = [server.set_async("/a", number) for number in range(50)]
    assert server.get_async("/a").result(30) == 49
    assert all(promise.done() for promise in waiting)
    release = threading.Event()
    master.answers["setParam"] = lambda *_: [1, "", int(release.wait(30))]
    first = server.set_async("/a", 1)
    given_up, rest = server.set_async("/a", 2), [server.get_async("/a") for _ in range(20)]
    assert given_up.cancel()
    began = time.monotonic()
    with pytest.raises(ConnectionLostError):
        first.result(30)
    for promise in rest:
        with pytest.raises(ConnectionLostError):
            promise.result(30)
    assert time.monotonic() - began < 10
    release.set()
    assert server.get_async("/a").result(30) == 49


def test_closed_node_sends_no_requests(node, server):
    node.close()
    for ask in (
        lambda: server.get("/a"),
        lambda: server.subscribe("/a"),
        lambda: server.get_async("/a"),
    ):
        with pytest.raises(NodeClosedError):
            ask()


def test_waiting_in_a_thread_that_receives_is_refused(node, server, eventually):
    raised: list[BaseException] = []

    def ask(_: object) -> None:
        try:
            server.get("/a")
        except UnsupportedError as error:
            raised.append(error)

    subscription = node.create_subscription("/t", "std_msgs/String", ask, executor=IMMEDIATE)
    eventually(lambda: subscription.publisher_count() >= 0)
    other = rosglass.connect(node.url, "other", own_services=False)
    try:
        publisher = other.create_publisher("/t", "std_msgs/String", rosglass.QoS.latched())
        publisher.publish(data="x")
        eventually(lambda: raised)
    finally:
        other.close()
    assert "thread that receives" in str(raised[0])


# -- following -----------------------------------------------------------------------------------


def test_subscription_is_notified_of_the_value_and_each_change(server, master, eventually):
    notified: list[object] = []
    subscription = server.subscribe("/a", notified.append)
    assert subscription.wait(30)
    eventually(lambda: notified == [None])
    assert not subscription.is_set
    master.setParam("/other", "/a/b", 1)
    eventually(lambda: notified[-1] == {"b": 1})
    assert subscription.value == {"b": 1}
    master.setParam("/other", "/a/b", 1)  # no change
    server.set("/a/c", 2)  # the master does not notify us of our own changes
    eventually(lambda: subscription.value == {"b": 1, "c": 2})
    master.deleteParam("/other", "/a")
    eventually(lambda: notified[-1] is None)
    assert notified == [None, {"b": 1}, {"b": 1, "c": 2}, None]
    assert "not set" in repr(subscription)


def test_subscriptions_of_one_name_share_a_registration(server, master, eventually):
    master.tree["a"] = 1
    one, two = server.subscribe("/a"), server.subscribe("/a")
    assert one.wait(30)
    assert two.wait(30)
    notified: list[object] = []
    three = server.subscribe("/a", notified.append)
    eventually(lambda: notified == [1])
    one.close()
    two.close()
    two.close()
    master.setParam("/other", "/a", 2)
    eventually(lambda: notified == [1, 2])
    assert one.value == 1
    three.close()
    eventually(lambda: not master.followers["/a"])
    four = server.subscribe("/a")
    assert four.wait(30)
    assert four.value == 2
    assert master.followers["/a"]


def test_closing_and_following_anew_at_once_stays_registered(server, master, eventually):
    for _ in range(30):
        server.subscribe("/a").close()
    last = server.subscribe("/a")
    assert last.wait(30)
    eventually(lambda: master.calls.count("subscribeParam") >= 2)
    master.setParam("/other", "/a", 5)
    eventually(lambda: last.value == 5)
    eventually(lambda: master.followers["/a"])


def test_master_that_was_restarted_is_queried_again(server, master, node, eventually):
    notified: list[object] = []
    server.set("/a", 1)
    subscription = server.subscribe("/a", notified.append)
    eventually(lambda: notified == [1])
    master.stop()
    assert subscription.value == 1
    master.start()
    eventually(lambda: notified == [1, None])
    master.setParam("/other", "/a", 3)
    eventually(lambda: notified == [1, None, 3])


def test_change_without_notification_is_found(server, master, eventually, monkeypatch):
    monkeypatch.setattr("rosglass.ros1.parameter_server._REREAD_S", 0.5)
    subscription = server.subscribe("/a")
    assert subscription.wait(30)
    master.notifies = False
    master.setParam("/other", "/a", 3)
    eventually(lambda: subscription.value == 3)


def test_callbacks_may_close_and_call(server, master, eventually):
    done: list[object] = []
    made = threading.Event()

    def callback(value: object) -> None:
        made.wait(30)
        subscription.close()
        done.append(server.get("/b", value))

    server.set("/b", 4)
    subscription = server.subscribe("/a", callback)
    made.set()
    eventually(lambda: done == [4])
    eventually(lambda: not master.followers["/a"])
    with pytest.raises(ConversionError):
        server.subscribe("/a", 5)


# -- the node's own ------------------------------------------------------------------------------


def test_declaring_takes_what_is_set_or_sets_the_default(node, master):
    master.tree = {"left": {"arm": {"speed": 2.5}}}
    own = node.parameters
    assert own.declare("speed", 1.5, ParameterDescriptor(description="In m/s.")) == 2.5
    assert own.declare("camera/exposure", 10) == 10
    assert own.declare("name") is None
    assert master.tree["left"]["arm"] == {"speed": 2.5, "camera": {"exposure": 10}}
    assert own.names() == ["camera/exposure", "name", "speed"]
    assert "speed" in own
    assert own.get("name") is None
    assert own.get("camera") == {"exposure": 10}
    assert own.describe("speed").description == "In m/s."
    assert own.describe("speed").type is ParameterType.DOUBLE
    assert own.describe("camera/exposure").type is ParameterType.INTEGER
    assert own.describe("name").type is ParameterType.NOT_SET
    with pytest.raises(ParameterError, match="'speed' is declared already"):
        own.declare("speed", 1.0)
    own.undeclare("speed")
    own.undeclare("name")
    assert master.tree["left"]["arm"] == {"camera": {"exposure": 10}}
    with pytest.raises(ParameterError, match="not set"):
        own.undeclare("speed")
    with pytest.raises(ParameterError, match="parameter 'exposure' is not set; did you mean"):
        own.get("exposure")


def test_setting_checks_all_before_anything_is_set(node, master):
    own = node.parameters
    own.set({"a": 1, "b/c": [1, 2.5]})
    assert master.tree == {"left": {"arm": {"a": 1, "b": {"c": [1, 2.5]}}}}
    with pytest.raises(ParameterError, match="beyond"):
        own.set({"a": 2, "d": 2**40})
    assert own.get("a") == 1
    own.set({"a": None, "never": None})
    assert own.names() == ["b/c"]
    with pytest.raises(ParameterError, match="set by a dict"):
        own.set("a")


def test_options_without_ros_1_counterpart_are_refused(node):
    own = node.parameters
    with pytest.raises(UnsupportedError, match="has no range"):
        own.declare("a", 1, ParameterDescriptor(range=Range(0, 5)))
    with pytest.raises(UnsupportedError, match="has no read-only parameters"):
        own.declare("a", 1, ParameterDescriptor(read_only=True))
    with pytest.raises(UnsupportedError, match="on_change"):
        own.on_set(lambda _: "")
    with pytest.raises(ParameterError, match="grouped with '/': 'camera/exposure'"):
        own.declare("camera.exposure", 1)
    with pytest.raises(ParameterError, match="leave '~' out"):
        own.get("~a")
    with pytest.raises(UnsupportedError, match="one parameter at a time"):
        node.create_parameter_client("/x").set_atomically({"a": 1, "b": 2})
    assert own.names() == []


def test_changes_by_others_are_reported_below_the_node(node, master, eventually):
    own, events = node.parameters, []
    own.set({"a": 1, "b": 1})
    own.on_change(events.append)
    with node.create_parameter_client("/left/arm") as client:
        client.watch(events.append)
        own.set({"a": 1.0})
        eventually(lambda: len(events) == 2)
    assert events[0] == events[1]
    assert (events[0].node, events[0].new, events[0].changed) == ("/left/arm", {}, {"a": 1.0})
    master.deleteParam("/other", "/left/arm/b")
    eventually(lambda: len(events) == 3)
    assert events[2].deleted == ("b",)
    master.setParam("/other", "/left/arm/c/d", True)
    eventually(lambda: len(events) == 4)
    assert events[3].new == {"c/d": True}


def test_client_subscribes_before_the_master_starts(master, connect, eventually):
    master.stop()
    node, events = connect("arm", own_services=False), []
    with node.create_parameter_client("/robot") as client:
        client.watch(events.append)
        assert not client.ready
        master.start()
        assert client.wait_for_server(30)

        def changed():
            client.set({"a": time.monotonic()})
            return events

        eventually(changed)


def test_parameters_of_the_start_win_once(master, eventually):
    from rosglass.ros1.node import Ros1Node
    from rosglass.ros1.options import Ros1Options

    master.tree = {"arm": {"speed": 1.0}}
    start = {"speed": 2.5, "gain": {"p": 1}}
    node = Ros1Node(Ros1Options.parse(master.url), master.url, "arm", parameters=start)
    try:
        assert node.parameters.get("speed") == 2.5
        eventually(lambda: master.tree["arm"] == {"speed": 2.5, "gain": {"p": 1}})
        node.parameters.set({"speed": 3.0})
        uri = node_uri(node)
        master.stop()
        master.start({"arm": {"speed": 4.0}})
        # Such a call may be under way: the new master knows the node then, but not all of it.
        master.subscribeParam("/arm", uri, "/arm/speed")
        eventually(lambda: master.tree["arm"] == {"speed": 4.0, "gain": {"p": 1}})
    finally:
        node.close()


def test_invalid_parameter_value_is_refused_on_the_command_line(connect):
    for argument in ("_speed:=99999999999", "_day:=2026-01-02", "_none:=null"):
        with pytest.raises(RosArgumentError, match=f"argument 1: '{argument}'"):
            connect("arm", arguments=[argument])


# -- other nodes' --------------------------------------------------------------------------------


def test_client_reads_and_sets_a_namespace(node, master):
    master.tree = {"robot": {"a": 1, "b": {"c": [1, 2], "d": {"e": "x"}}, "m": [1, 2.5]}, "z": 1}
    with node.create_parameter_client("/robot") as client:
        assert client.wait_for_server(30)
        assert client.ready
        assert client.names() == ["a", "b/c", "b/d/e", "m"]
        assert client.names(["b"]) == ["b/c", "b/d/e"]
        assert client.names("b", 1) == ["b/c"]
        assert client.names(depth=1) == ["a", "m"]
        assert client.get() == {"a": 1, "b/c": [1, 2], "b/d/e": "x", "m": [1, 2.5]}
        assert client.get(["a", "x", "b"]) == {
            "a": 1,
            "x": None,
            "b": {"c": [1, 2], "d": {"e": "x"}},
        }
        assert client.get("b/d/e") == {"b/d/e": "x"}
        descriptions = client.describe()
        assert descriptions["b/c"].type is ParameterType.INTEGER_ARRAY
        assert descriptions["m"].type is ParameterType.NOT_SET
        assert descriptions["m"].description == "A list."
        assert client.describe(["x"])["x"].type is ParameterType.NOT_SET
        assert client.set({"a": None, "n": 5})["n"].successful
        gone = client.set({"a": None})["a"]
        assert not gone.successful
        assert "/robot/a is not set" in gone.reason
        with pytest.raises(ParameterError, match="/robot/q: 1099511627776"):
            client.set({"n": 6, "q": 2**40})
        assert client.set_atomically({"n": 7}).successful
        assert client.get(["n"]) == {"n": 7}
        assert client.set_atomically({}).successful
    with node.create_parameter_client("/") as client:
        assert client.names(depth=1) == ["z"]
        assert client.get(["z"]) == {"z": 1}
    with pytest.raises(InvalidNameError):
        node.create_parameter_client("a b")


def test_files_are_loaded_whole_or_not_at_all(node, server, master, tmp_path):
    path = tmp_path / "robot.yaml"
    path.write_text(
        "a: 1\nb/c: [1, 2.5]\nb: {d: deg(180)}\n---\n_ns: sub\nx: y\n---\n_ns: /g\nz: 1\n"
    )
    assert server.load(path) == ["/left/a", "/left/b/c", "/left/b/d", "/left/sub/x", "/g/z"]
    assert master.tree["left"]["b"]["c"] == [1, 2.5]
    node.parameters.load(path)
    assert node.parameters.names() == ["a", "b/c", "b/d", "sub/x"]
    with node.create_parameter_client("/robot") as client:
        assert client.load(path) == ["a", "b/c", "b/d", "sub/x", "/g/z"]
        saved = tmp_path / "saved.yaml"
        client.save(saved)
        assert server.load(saved, "/copy")
        assert server.get("/copy") == server.get("/robot")
    server.save(saved, "/g")
    assert saved.read_text() == "z: 1\n"
    before = list(server.names())
    for text, message in (
        ("ok: 1\na: 99999999999", "robot.yaml: parameter /left/a: 99999999999 is beyond"),
        ("1: 2", "the name of a parameter in /left is 1; put it between quotes"),
        ("a:", "robot.yaml: parameter /left/a: .*got None"),
        ("day: 2026-01-02", "datetime.date"),
    ):
        path.write_text(text)
        with pytest.raises(ParameterError, match=message):
            server.load(path)
    path.write_text("5")
    with pytest.raises(ParameterError, match="names of parameters are missing"):
        server.load(path, "/")
    path.write_text("")
    assert server.load(path) == []
    with pytest.raises(ParameterError, match="has no parameters"):
        node.parameters.load(path)
    assert server.names() == before


def test_subscriber_of_a_namespace_is_notified_of_a_file_as_a_whole(server, tmp_path, eventually):
    path = tmp_path / "many.yaml"
    path.write_text("".join(f"p{number}: {number}\n" for number in range(50)))
    notified = []
    server.set("/many/old", True)
    with server.subscribe("/many", notified.append):
        eventually(lambda: notified)
        assert len(server.load(path, "/many")) == 50
        eventually(lambda: len(notified[-1]) == 51)
    assert [len(value) for value in notified] == [1, 51]


def test_other_refusals_are_master_errors(node, master):
    master.answers["getParamNames"] = lambda *_: [0, "broken", 0]
    with pytest.raises(MasterError, match="broken"):
        node.parameter_server.names()


def test_callback_of_a_call_may_call_the_master_again(server, master):
    server.set("/speed", 1.5)
    got = []
    done = threading.Event()

    def read_again(_):
        with suppress(UnsupportedError):
            got.append(server.get("/speed"))
        done.set()

    server.get_async("/speed").add_done_callback(read_again)
    assert done.wait(20)
    assert got == [1.5]
