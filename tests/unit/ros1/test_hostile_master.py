"""Masters that lie, are slow or half closed, and names in their graph that ROS's rules forbid."""

from __future__ import annotations

import re
import socket
import threading
import time
import xmlrpc.client
from contextlib import suppress
from pathlib import Path
from xml.parsers.expat import ExpatError

import pytest
from waiting import at_rate

import rosglass
from rosglass import ros1
from rosglass.comm import ConnectionState
from rosglass.errors import ConnectionLostError, MasterError
from rosglass.wires.tcpros import master as client
from rosglass.wires.tcpros.master import Master, call_node

#: Characters that XML can carry and no terminal should get: C1's CSI, a right-to-left override.
HOSTILE = "/evil\x9b2J\u202e"


def deep(levels):
    """Return a list in a list in a list ..."""
    value = 0
    for _ in range(levels):
        value = [value]
    return value


#: Answers that a master may give instead of ROS 1's, with success claimed.
LIES = [None, 0, -1.5, "", "x", b"\0", True, [], [None], [[None, None]], [[[1, [2]]], [], []], {},
        {"a": None}, [["/a"]], [["/a", 5]], [[["/a", None]]] * 3, [["/a", ["/b"]]] * 3]  # fmt: skip


def calls(parameters):
    """Return everything that asks the parameter server, by what it asks."""
    return {
        "getParam": lambda: parameters.get("/a"),
        "hasParam": lambda: parameters.has("/a"),
        "getParamNames": parameters.names,
        "searchParam": lambda: parameters.search("a"),
        "setParam": lambda: parameters.set("/a", 1),
        "deleteParam": lambda: parameters.delete("/a"),
    }


def test_whatever_the_master_answers_only_our_errors_are_raised(master, connect):
    parameters = connect("panel", own_services=False).parameter_server
    lies, refused = 0, list[str]()
    for method in calls(parameters):
        for lie in LIES:
            master.answers[method] = lambda *_, lie=lie: [1, "", lie]
            try:
                calls(parameters)[method]()
            except rosglass.Error as error:
                refused.append(str(error))
            lies += 1
            del master.answers[method]
    assert lies == 6 * len(LIES)
    known = re.compile("not as ROS 1 does|is not set|cannot be read")
    assert [text for text in refused if not known.search(text)] == []
    assert len(refused) > 40


@pytest.mark.parametrize(
    "answer", [[1], [1, ""], ["1", "", 0], None, 5, [1, "", 0, 0], {}, [None] * 3]
)
def test_answers_of_another_form_are_refused_by_name(master, answer):
    master.answers["getPid"] = lambda *_: answer
    with pytest.raises(ConnectionLostError, match="answers, but not as ROS 1 does"):
        call_node(f"http://127.0.0.1:{master.port}", "getPid", "/x")


def test_parameters_of_any_depth_are_refused_or_returned(master, connect):
    parameters = connect("panel", own_services=False).parameter_server
    for levels in (0, 50, 99):
        master.tree["deep"] = deep(levels)
        assert parameters.get("/deep") == deep(levels)
    for levels in (100, 101, 2000):
        # Written out, for this process's own server would fail at it first.
        answer = [1, "", deep(0)]
        text = xmlrpc.client.dumps((answer,), methodresponse=True)
        inner = (
            "<array><data><value>" * levels + "<int>0</int>" + "</value></data></array>" * levels
        )
        body = text.replace("<int>0</int>", inner)
        port = serve(lambda sock, body=body: reply(sock, body.encode()))
        with pytest.raises(MasterError, match="at most 100 levels"):
            call_node(f"http://127.0.0.1:{port}", "getParam", "/x", "/deep")


def test_deep_parameter_is_refused_and_the_rest_of_the_node_goes_on(master, connect, eventually):
    """Some node has set it: the master is not at fault, and must not count as lost."""
    master.tree["deep"] = deep(120)
    node = connect("panel", own_services=False)
    asked = master.calls.count("subscribeParam")
    node.parameter_server.subscribe("/deep")
    eventually(lambda: master.calls.count("subscribeParam") > asked)
    node.create_publisher("/cmd_vel", "geometry_msgs/Twist")
    eventually(lambda: "/cmd_vel" in master.publishers)
    assert node.status().state is ConnectionState.CONNECTED


@pytest.mark.parametrize("method", ["getSystemState", "getTopicTypes", "getPid", "lookupNode"])
def test_node_survives_a_lying_master_and_recovers(master, connect, eventually, method):
    node = connect("panel", own_services=False)
    node.create_publisher("/words", "std_msgs/String")
    eventually(lambda: node.status().state is ConnectionState.CONNECTED)
    lies = 0
    for lie in (None, [None], [[None, None]], [[["/a", None]]] * 3, {"a": 1}, ""):
        if method == "lookupNode" and lie == "":
            continue
        master.answers[method] = lambda *_, lie=lie: [1, "", lie]
        # What is asked only when the graph has changed is asked now.
        master.publishers.setdefault(f"/t{lies}", {})["/other"] = "http://127.0.0.1:1/"
        asked = master.calls.count(method)
        eventually(lambda asked=asked: master.calls.count(method) > asked)
        eventually(lambda: "not as ROS 1 does" in node.status().detail)
        del master.answers[method]
        eventually(lambda: node.status().state is ConnectionState.CONNECTED)
        lies += 1
    assert lies >= 5


def test_forbidden_names_are_left_out_and_counted_and_the_others_stay(
    master, run_command, connect, eventually
):
    for number, topic in enumerate((HOSTILE, "/two\nlines", "relative", "/cam-left/image")):
        master.publishers[topic] = {f"/bad{number}": "http://127.0.0.1:1/"}
        master.types[topic] = "std_msgs/String"
    master.publishers["/fine"] = {"/robot": "http://127.0.0.1:1/", HOSTILE: "http://127.0.0.1:1/"}
    master.types["/fine"] = f"std_msgs/{HOSTILE[1:]}"
    node = connect("panel", own_services=False)
    eventually(lambda: "/fine" in node.topics())
    assert node.invalid_names() == sorted((HOSTILE, "/two\nlines", "relative", "/cam-left/image"))
    assert [end.node.full for end in node.publishers("/fine")] == ["/robot"]
    node.close()
    ran = 0
    for command in ("topic list -t", "topic list --json", "node list", "topic info /fine",
                    "service list", "action list", "param list", "doctor", "node info /robot",
                    "node cleanup --yes"):  # fmt: skip
        code, out, err = run_command(*command.split(), "--url", master.url)
        assert code == 0 or command in ("doctor", "node info /robot"), (command, err)
        assert all(c.isprintable() or c == "\n" for c in out + err), (command, out, err)
        if command.endswith(" list") and "param" not in command:
            assert "left out, for ROS's rules forbid such names: 4: " in err
        if command == "topic list -t":
            assert out == "/fine [unknown]\n"
        ran += 1
    assert ran == 10


# -- slow and half-closed ------------------------------------------------------------------------


def serve(talk):
    """Serve each connection by `talk(socket)` on a thread; return the port."""
    listener = socket.create_server(("127.0.0.1", 0))

    def accept():
        while True:
            try:
                sock, _ = listener.accept()
            except OSError:
                return
            threading.Thread(target=run, args=(sock,), daemon=True).start()

    def run(sock):
        with sock, suppress(OSError):
            talk(sock)

    threading.Thread(target=accept, daemon=True).start()
    return listener.getsockname()[1]


def read_call(sock):
    """Read one HTTP request."""
    data = b""
    while b"\r\n\r\n" not in data:
        data += sock.recv(65536)
    head, _, body = data.partition(b"\r\n\r\n")
    length = int(re.search(rb"(?i)content-length: (\d+)", head)[1])
    while len(body) < length:
        body += sock.recv(65536)


def reply(
    sock, body, head=b"HTTP/1.1 200 OK\r\nContent-Type: text/xml\r\nContent-Length: %d\r\n\r\n"
):
    """Answer one request."""
    read_call(sock)
    sock.sendall((head % len(body) if b"%d" in head else head) + body)


GOOD = xmlrpc.client.dumps(([1, "", 7],), methodresponse=True).encode()


def drip(sock, data):
    """Send a byte every 50 ms."""
    read_call(sock)
    for byte, _ in zip(data, at_rate(0.05), strict=False):
        sock.sendall(bytes((byte,)))


def endless(sock):
    """Answer with more and more."""
    read_call(sock)
    sock.sendall(b"HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n")
    chunk = b"100000\r\n" + b"x" * 2**20 + b"\r\n"
    while True:
        sock.sendall(chunk)


HEAD = b"HTTP/1.1 200 OK\r\nContent-Length: %d\r\n\r\n" % len(GOOD)
FAULTS = {
    "silent": lambda sock: (read_call(sock), sock.recv(1)),
    "closed at once": lambda _: None,
    "closed after the call": read_call,
    "half closed": lambda sock: (read_call(sock), sock.shutdown(socket.SHUT_WR), sock.recv(1)),
    "a header that never ends": lambda sock: drip(sock, b"HTTP/1.1 200 OK\r\n" + b"X: y\r\n" * 999),
    "a status line that drips": lambda sock: drip(sock, b"HTTP/1.1 " + b"2" * 9999),
    "a body that drips": lambda sock: drip(sock, HEAD + GOOD),
    "a body that ends early": lambda sock: reply(sock, GOOD[:-9], HEAD),
    "a length far beyond": lambda sock: reply(sock, b"x", HEAD.replace(b": ", b": 9999999")),
    "chunks without end": endless,
    "headers without end": lambda sock: reply(sock, b"X: " + b"y" * 10**7, b"HTTP/1.1 200 OK\r\n"),
    "no HTTP": lambda sock: reply(sock, b"\0\xff" * 5000, b""),
    "billion laughs": lambda sock: reply(sock, LAUGHS),
    "an external entity": lambda sock: reply(sock, EXTERNAL),
    "utf-16 with a document type": lambda sock: reply(sock, LAUGHS.decode().encode("utf-16")),
}  # fmt: skip
LAUGHS = (
    b'<?xml version="1.0"?><!DOCTYPE l [<!ENTITY a "' + b"x" * 1000 + b'">'
    + b"".join(b'<!ENTITY %c "%s">' % (98 + i, b"&%c;" % (97 + i) * 10) for i in range(8))
    + b"]><methodResponse><params><param><value><string>&i;</string></value></param></params>"
    b"</methodResponse>"
)  # fmt: skip
EXTERNAL = (
    b'<?xml version="1.0"?><!DOCTYPE l SYSTEM "file:///etc/passwd"><methodResponse><params><param>'
    b"<value><string>&l;</string></value></param></params></methodResponse>"
)


@pytest.mark.parametrize("fault", FAULTS)
def test_peer_that_answers_badly_costs_no_more_than_the_timeout(fault):
    port = serve(FAULTS[fault])
    began = time.monotonic()
    with pytest.raises(ConnectionLostError):
        call_node(f"http://127.0.0.1:{port}", "getPid", "/x", timeout=1.0)
    # Beside others this machine may need a while; what drips would go on for minutes.
    assert time.monotonic() - began < 20


@pytest.mark.parametrize("encoding", ["utf-8", "utf-16"])
def test_no_document_type_is_read_in_calls_or_answers(encoding):
    call = xmlrpc.client.dumps((), "getPid").replace("?>", "?><!DOCTYPE x [<!ENTITY a 'b'>]>")
    with pytest.raises(ExpatError, match="a document type"):
        client.parse_xml(call.encode(encoding))


@pytest.mark.parametrize("tag", ["<!--", "<a b='", "<?"])
def test_no_endless_tag_is_read(tag):
    # 60 MB of it are one step of the parser, for which all threads would wait 1.5 s.
    with pytest.raises(ExpatError, match="a tag or comment of more than"):
        client.parse_xml(b"<a>" + tag.encode() + b"x" * 2_000_000)


def test_call_answered_byte_by_byte_ends_when_the_node_is_closed():
    asked = threading.Event()

    def drip_on(sock):
        asked.set()
        FAULTS["a header that never ends"](sock)

    port = serve(drip_on)
    master = Master(f"http://127.0.0.1:{port}", "/panel")
    failed = threading.Event()

    def call():
        with suppress(ConnectionLostError):
            master.call("getPid", timeout=300)
        failed.set()

    threading.Thread(target=call, daemon=True).start()
    assert asked.wait(20)
    master.close()
    assert failed.wait(20)


def test_every_answer_that_is_used_has_its_form():

    used = set()
    folders = [Path(client.__file__).parent, Path(ros1.__file__).parent]
    for file in [file for folder in folders for file in folder.glob("*.py")]:
        used |= set(re.findall(r'(?:call|_call|_ask)\([^()]*?"([a-z]+[A-Z]\w+)"', file.read_text()))

    known = set(client.ANSWERS)
    assert {name for name in used if name.startswith(("get", "has", "lookup", "search"))} <= known
    assert {"subscribeParam", "registerSubscriber", "requestTopic"} <= known


def test_thousands_of_topics_of_a_master_are_listed(master, connect, eventually, run_command):
    for number in range(2_000):
        master.publishers[f"/t{number}"] = {"/flood": "http://127.0.0.1:1/"}
        master.types[f"/t{number}"] = "std_msgs/String"
    node = connect("panel", own_services=False)
    began = time.process_time()
    eventually(lambda: len(node.topics()) == 2_000)
    seen = master.calls.count("getSystemState")
    eventually(lambda: master.calls.count("getSystemState") >= seen + 3)
    # Of this process, which is the master, too; three looks more.
    assert time.process_time() - began < 6
    code, out, err = run_command("topic", "list", "--url", master.url)
    assert (code, out.count("\n")) == (0, 2_000), err
