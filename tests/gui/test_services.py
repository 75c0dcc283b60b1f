"""Service clients and servers in QML, and what interfaces log, on real middleware."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, Any

import pytest

from rosglass.comm.graph import ConnectionState
from rosglass.errors import Error
from rosglass.qml.engine.callbacks import Answers

if TYPE_CHECKING:
    from conftest import Bench


EVERY_WIRE = pytest.mark.parametrize("url", ["zenoh", "dds", "ros1"], indirect=True, scope="module")


@pytest.mark.both_qt
def test_a_client(live: Bench, wait: Any) -> None:
    live.robot.create_service_server(
        "/lamp", "std_srvs/srv/SetBool", lambda request: {"message": f"{request.data}"}
    )
    root: Any = live.load("""
        QtObject {
            property var client: Ros2.createServiceClient("/lamp", "std_srvs/srv/SetBool")
            property string called
            property string promised
            property string refused
            function shown() {
                return [client.name, client.type, client.ready, client.pendingRequests,
                        client.connectionTimeout].join()
            }
            function send() {
                client.sendRequestAsync({data: true}, function (r) { called = r.message })
                client.call({data: false}).then(function (r) { promised = r.message })
                try { client.sendRequestAsync({data: "x"}, function () {}) }
                catch (error) { refused = String(error) }
            }
        }
    """)
    wait(lambda: ",true,0,10000" in root.shown())
    assert root.shown().startswith("/lamp,std_srvs/srv/SetBool")
    root.send()
    wait(lambda: (root.property("called"), root.property("promised")) == ("True", "False"))
    assert "data: expected" in root.property("refused")
    assert root.shown().endswith(",true,0,10000")


def test_requests_wait_for_a_server(live: Bench, wait: Any) -> None:
    root: Any = live.load("""
        QtObject {
            property var client: Ros2.createServiceClient("/late", "std_srvs/Trigger")
            property string answer
            Component.onCompleted:
                client.sendRequestAsync({}, function (r) { answer = r.message })
        }
    """)
    wait.settled(live.session)
    live.robot.create_service_server(
        "/late", "std_srvs/srv/Trigger", lambda request: {"message": "here"}
    )
    wait(lambda: root.property("answer") == "here")


def test_missing_server_is_reported_only_after_connecting(
    running: Bench, wait: Any, caplog: Any, monkeypatch: Any
) -> None:
    monkeypatch.setattr("rosglass.qml.elements.element._SEARCH_MS", 100)
    running.session.node.set_status(ConnectionState.CONNECTING, "no router yet")
    wait(lambda: running.session.state == "connecting")
    running.load("""QtObject {
        property var client: Ros2.createServiceClient("/humanoid/stand", "std_srvs/srv/SetBool")
    }""")
    wait.nothing_happens(0.3)
    assert "no server offers" not in caplog.text
    running.session.node.set_status(ConnectionState.CONNECTED, "")
    wait(lambda: "no server offers /humanoid/stand" in caplog.text)


def test_no_server(live: Bench, wait: Any, caplog: Any) -> None:
    root: Any = live.load("""
        QtObject {
            property var client: Ros2.createServiceClient("/none", "std_srvs/Trigger")
            property var called
            property string rejected
            Component.onCompleted: {
                client.connectionTimeout = 300
                client.sendRequestAsync({}, function (r) { called = r })
                client.call().catch(function (e) { rejected = e.message })
            }
        }
    """)
    wait(lambda: root.property("called") is False and root.property("rejected"))
    assert "/none" in root.property("rejected")
    assert "no server" in caplog.text


def test_a_request_does_not_outlast_its_server(live: Bench, wait: Any, monkeypatch: Any) -> None:
    """A request made to a server that is gone is not for the next one."""
    monkeypatch.setattr("rosglass.comm.service_client._GRACE_S", 0.1)
    go = threading.Event()
    server = live.robot.create_service_server(
        "/dock", "std_srvs/srv/Trigger", lambda _: go.wait(60)
    )
    root: Any = live.load("""
        QtObject {
            property var client: Ros2.createServiceClient("/dock", "std_srvs/Trigger")
            property var lost: Ros2.createServiceClient("/nowhere", "std_srvs/Trigger")
            property var rejected: []
            property string waited
            function ready() { return client.ready }
            function send() {
                client.connectionTimeout = lost.connectionTimeout = 100
                for (let i = 0; i < 10; ++i)
                    client.call().catch(function (e) { rejected = rejected.concat([e.message]) })
                lost.call().catch(function (e) { waited = e.message })
            }
        }
    """)
    wait(root.ready)
    root.send()
    wait(lambda: "no server" in root.property("waited"))
    # A server that is there may take as long as it likes.
    assert root.property("rejected").toVariant() == []
    assert root.property("client").property("pendingRequests") == 10
    server.close()
    wait(lambda: len(root.property("rejected").toVariant()) == 10)
    # Over ROS 2, some were not sent: a server's queue holds eight.
    endings = ("went away before it answered", "nothing was sent")
    rejected = root.property("rejected").toVariant()
    assert all(any(text in reason for text in endings) for reason in rejected), rejected
    assert root.property("client").property("pendingRequests") == 0
    go.set()


@pytest.mark.parametrize("offered", [True, False], ids=["sent", "waiting"])
def test_cancelled_requests_fail_and_are_not_counted(live: Bench, wait: Any, offered: bool) -> None:
    go = threading.Event()
    if offered:
        live.robot.create_service_server("/dock", "std_srvs/srv/Trigger", lambda _: go.wait(60))
    root: Any = live.load("""
        QtObject {
            property var client: Ros2.createServiceClient("/dock", "std_srvs/Trigger")
            property var answers: []
            property string rejected
            property var counted: []
            function ready() { return client.ready }
            function send() {
                client.sendRequestAsync({}, function (r) { answers = answers.concat([r]) })
                client.call().catch(function (e) { rejected = e.message })
                counted = [client.pendingRequests]
                client.cancelRequests()
                counted = counted.concat([client.pendingRequests])
            }
        }
    """)
    wait(lambda: root.ready() is offered)
    root.send()
    wait(lambda: root.property("answers").toVariant() == [False] and root.property("rejected"))
    assert "the request to /dock was given up" in root.property("rejected")
    assert root.property("counted").toVariant() == [2, 0]
    go.set()


def test_requests_fail_when_the_node_is_shut_down(live: Bench, wait: Any) -> None:
    go = threading.Event()
    live.robot.create_service_server("/dock", "std_srvs/srv/Trigger", lambda _: go.wait(60))
    root: Any = live.load("""
        QtObject {
            property var client: Ros2.createServiceClient("/dock", "std_srvs/Trigger")
            property string rejected
            function ready() { return client.ready }
            function send() { client.call().catch(function (e) { rejected = e.message }) }
        }
    """)
    wait(root.ready)
    root.send()
    live.session.shutdown()
    wait(lambda: "/dock: the node was shut down" in root.property("rejected"))
    assert root.property("client").property("pendingRequests") == 0
    go.set()


def test_the_robot_loses_its_server(live: Bench, wait: Any) -> None:
    server = live.robot.create_service_server("/add", "std_srvs/srv/Trigger", lambda request: None)
    root: Any = live.load(
        'QtObject { property var c: Ros2.createServiceClient("/add", "std_srvs/Trigger"); '
        "function ready() { return c.ready } }"
    )
    wait(root.ready)
    server.close()
    wait(lambda: not root.ready())


@pytest.mark.both_qt
@pytest.mark.parametrize(
    ("handler", "message"),
    [
        ("function (r) { return {success: r.data, message: 'at once'} }", "at once"),
        (
            "function (r) { return new Promise(function (ok) { ok({message: 'promised'}) }) }",
            "promised",
        ),
        ("function (r, respond) { Qt.callLater(respond, {message: 'later'}) }", "later"),
        ("function (r, respond) { respond({message: 'directly'}) }", "directly"),
        ("function () { }", ""),
    ],
)
def test_a_server(live: Bench, wait: Any, handler: str, message: str) -> None:
    live.load(f"""
        QtObject {{
            property ServiceServer server: ServiceServer {{
                name: "/lamp"; serviceType: "std_srvs/SetBool"; handler: {handler}
            }}
        }}
    """)
    client = live.robot.create_service_client("/lamp", "std_srvs/srv/SetBool")
    call = client.call_async({"data": True}, timeout=20)
    wait(call.done)
    assert call.result().message == message


@pytest.mark.parametrize(
    ("answer", "reason"),
    [
        ("handler: function (r) { throw new Error('no power') }", "no power"),
        ("handler: function (r) { return {sucess: true} }", "sucess"),
        ("handler: function (r) { return [1] }", "expected"),
        ("handler: function (r) { return 5 }", "expected"),
        ("handler: function (r) { return false }", "returned false"),
        ("handler: function (r) { return new Promise((a, no) => no('no bulb')) }", "bulb"),
        ("handler: null", "is not a function"),
        ("processRequest: function (r, id) { throw new Error('no power') }", "no power"),
        ("processRequest: function (r, id) { return {sucess: true} }", "sucess"),
        ("processRequest: function (r, id) { return [1] }", "expected"),
        ("processRequest: function (r, id) { return 5 }", "which is not a response"),
        ("processRequest: function (r, id) { return null }", "which is not a response"),
        ("processRequest: function (r, id) { return Promise.reject('no bulb') }", "bulb"),
        (
            "processRequest: function (r, id) { Qt.callLater(sendResponse, id, {sucess: true}) }",
            "sucess",
        ),
    ],
)
@EVERY_WIRE
def test_failing_handlers_are_answered_at_once(
    live: Bench, wait: Any, answer: str, reason: str, caplog: Any
) -> None:
    """They are logged; clients get the error if the wire can carry it, or a default response."""
    kind = "type" if answer.startswith("processRequest") else "serviceType"
    root: Any = live.load(f"""
        QtObject {{
            property ServiceServer server: ServiceServer {{
                name: "/lamp"; {kind}: "std_srvs/srv/SetBool"; {answer}
            }}
        }}
    """)
    caplog.set_level("INFO")
    client = live.robot.create_service_client("/lamp", "std_srvs/srv/SetBool")
    call = client.call_async({"data": True}, timeout=None)
    wait(call.done)
    if live.session.url.startswith("dds"):
        response = call.result()
        assert (response.success, response.message) == (False, "")
    else:
        with pytest.raises(Error, match=reason):
            call.result()
    wait(lambda: reason in caplog.text)
    assert root is not None


def test_open_requests_are_limited(live: Bench, wait: Any, monkeypatch: Any) -> None:
    monkeypatch.setattr("rosglass.qml.engine.callbacks._MAX_OPEN", 2)
    root: Any = live.load("""
        QtObject {
            property var open: []
            property ServiceServer server: ServiceServer {
                name: "/lamp"; type: "std_srvs/srv/SetBool"
                processRequest: function (request, id) { open = open.concat([id]) }
            }
        }
    """)
    client = live.robot.create_service_client("/lamp", "std_srvs/srv/SetBool")
    calls = [client.call_async({"data": True}, timeout=None) for _ in range(3)]
    wait(calls[2].done)
    with pytest.raises(Error, match="2 requests open"):
        calls[2].result()
    assert root.property("open").toVariant() == [1, 2]
    assert [call.done() for call in calls[:2]] == [False, False]


def test_queued_request_counts_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """It waits until its server exists, and is asked then."""
    monkeypatch.setattr("rosglass.qml.engine.callbacks._MAX_OPEN", 1)
    answers, queue = Answers(None, "the handler"), []
    answer = answers.later(queue, answers.open)
    queue.pop()()
    assert not answer.done()
    answers.give_up()
    assert "closed before it answered" in str(answer.exception())


@pytest.mark.both_qt
@EVERY_WIRE
def test_servers_in_the_way_of_qml6_ros2_plugin(live: Bench, wait: Any, caplog: Any) -> None:
    root: Any = live.load("""
        QtObject {
            id: root
            property var open: []
            property bool offered: first.advertised && second.advertised
            property ServiceServer first: ServiceServer {
                name: "/at_once"; type: "std_srvs/srv/SetBool"; qos: Ros2.ServicesQoS()
                processRequest: function (request, id) {
                    return {success: request.data, message: "number " + id}
                }
            }
            property ServiceServer second: ServiceServer {
                id: second
                name: "/later"; type: "std_srvs/srv/SetBool"
                processRequest: function (request, id) { root.open = root.open.concat([id]) }
                onAdvertisedChanged: console.log("advertised", advertised)
                onTypeChanged: console.log("type", type, serviceType)
            }
            property ServiceServer ours: ServiceServer {
                name: "/ours"; serviceType: "std_srvs/srv/SetBool"
                handler: function (request) { return {message: "ours"} }
            }
            function answer(at, text) { second.sendResponse(open[at], {message: text}) }
            function withdraw() { second.enabled = false }
        }
    """)
    clients = {
        name: live.robot.create_service_client(name, "std_srvs/srv/SetBool")
        for name in ("/at_once", "/later", "/ours")
    }
    at_once = clients["/at_once"].call_async({"data": True}, timeout=20)
    ours = clients["/ours"].call_async({"data": True}, timeout=20)
    wait(lambda: at_once.done() and ours.done())
    assert (at_once.result().success, at_once.result().message) == (True, "number 1")
    assert ours.result().message == "ours"
    assert root.property("offered")
    first, second, third = (
        clients["/later"].call_async({"data": True}, timeout=20) for _ in range(3)
    )
    wait(lambda: root.property("open").toVariant() == [1, 2, 3])
    root.answer(1, "second")
    root.answer(0, "first")
    wait(lambda: first.done() and second.done())
    assert [first.result().message, second.result().message] == ["first", "second"]
    root.answer(0, "again")
    wait(lambda: "there is no open request 1" in caplog.text)
    # A withdrawn server leaves no client waiting.
    assert not third.done()
    root.withdraw()
    wait(third.done)
    error = third.exception()
    assert third.result().message == "" if error is None else "closed" in str(error)


def test_misused_makers_throw(live: Bench) -> None:
    for script in (
        'Ros2.createServiceServer("/x", "std_srvs/Trigger", 5)',
        'Ros2.createServiceServer("no good", "std_srvs/Trigger", function () {})',
        'Ros2.createServiceClient("no good", "std_srvs/Trigger")',
        'Ros2.createServiceClient("/x", "std_srvs/Trigger").sendRequestAsync({}, 5)',
        'Ros2.waitForMessageAsync("/x", 100, 5)',
    ):
        text = live.run(f"try {{ {script} }} catch (e) {{ return String(e) }}; return ''")
        assert text.startswith("Error:"), script


def test_the_graph(live: Bench, wait: Any) -> None:
    live.robot.create_service_server("/reset", "std_srvs/srv/Empty", lambda request: None)
    live.robot.create_publisher("/mode", "std_msgs/msg/String")
    wait(lambda: live.run('return Ros2.queryServices("std_srvs/Empty")') == ["/reset"])
    wait(lambda: live.run('return Ros2.getPublishersInfo("/mode").length') == 1)
    info = live.run('return Ros2.getPublishersInfo("/mode")[0]')
    assert (info["node"], info["type"]) == ("/robot", "std_msgs/msg/String")
    assert "/robot" in live.run("return Ros2.queryNodes()")
    assert live.run('return Ros2.getServiceTypes("/reset")') == ["std_srvs/srv/Empty"]
    assert live.run("return Ros2.getServiceNamesAndTypes()")["/reset"] == ["std_srvs/srv/Empty"]
    wait(lambda: live.run('return Ros2.getNodeInfo("/robot").publishers')[0]["name"] == "/mode")
    live.module = "Ros 1.0"
    assert live.run('return Ros.getServiceTypes("/reset")') == ["std_srvs/Empty"]
    assert live.run('return Ros.queryTopicType("/mode")') == "std_msgs/String"


def test_logs_are_followed_on_rosout(live: Bench, wait: Any) -> None:
    heard: list[Any] = []
    live.robot.create_subscription("/rosout", None, heard.append)
    live.run('Ros2.getLogger("arm")')
    wait(
        lambda: (
            live.run('Ros2.info("ready to go"); return 1')
            and any(m.msg == "ready to go" for m in heard)
        )
    )
    found = next(m for m in heard if m.msg == "ready to go")
    assert found.name.strip("/").endswith("ui")
    assert found.file.endswith(".qml")
    assert found.line > 0


def test_a_server_answers_in_the_words_of_its_module(live: Bench, wait: Any) -> None:
    """Only ROS 1's headers have a counter, which an interface written for ROS 1 may set."""
    live.module = "Ros 1.0"
    live.load("""
        QtObject {
            property ServiceServer server: ServiceServer {
                name: "/plan"; serviceType: "nav_msgs/GetPlan"
                handler: function () { return {plan: {header: {seq: 7, frame_id: "map"}}} }
            }
        }
    """)
    client = live.robot.create_service_client("/plan", "nav_msgs/srv/GetPlan")
    call = client.call_async({}, timeout=20)
    wait(call.done)
    assert call.result().plan.header.frame_id == "map"
