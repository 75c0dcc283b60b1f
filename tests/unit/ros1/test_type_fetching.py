"""Types that exist on another node only: asked for, checked, used."""

from __future__ import annotations

import asyncio
import socket
import struct
import threading
import time
from typing import TYPE_CHECKING, Any

import pytest
from inside import core_of

import rosglass
from rosglass.errors import DefinitionConflictError, NodeClosedError, TypeNotFoundError
from rosglass.interfaces import Library
from rosglass.wires.tcpros.connection import encode_header

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from tests.unit.ros1.conftest import FakeMaster

STATE, ASK, GO = "my_msgs/msg/State", "my_msgs/srv/Ask", "my_msgs/action/Go"
STATE_TEXT = "# What it does.\nuint8 IDLE=0\nuint8 state\nPart[] parts\nstring name"


def robot_library(state: str = STATE_TEXT) -> Library:
    library = Library()
    for name, text in (
        ("my_msgs/msg/Part", "int8 a"),
        (STATE, state),
        (ASK, "Part part\n---\nbool yes"),
        (GO, "uint8 FAST=1\nuint8 speed\n---\nPart part\n---\nfloat32 left"),
    ):
        library.add_text(name, text, ros=1)
    return library


@pytest.fixture
def join(connect: Callable[..., Any]) -> Callable[..., Any]:
    """Connect a node with a library of its own."""

    def join(name: str, library: Library | None = None) -> Any:
        return connect(name, library=library or Library(), own_services=False)

    return join


def md5_of(name: str, library: Library | None = None) -> str:
    return rosglass.load(name, ros=1, library=library or robot_library()).md5


def test_message_definition_is_fetched_from_its_publisher(join: Callable[..., Any]) -> None:
    join("robot", robot_library()).create_publisher("/state", STATE)
    user = join("cockpit")
    with pytest.raises(TypeNotFoundError):
        user.create_publisher("/other", STATE)
    found = user.fetch_type(STATE, timeout=30)
    assert (found.name, found.md5) == (STATE, md5_of(STATE))
    assert found.definition.text.startswith("# What it does.")
    assert user.fetch_type("my_msgs/State") == found
    assert user.fetch_type(STATE, hash=found.md5, timeout=0) == found
    assert user.fetch_type(STATE, node="/robot") == found
    assert user.create_publisher("/other", STATE).type == found, "its name is enough from now on"


def test_service_is_found_in_the_library_by_md5(join: Callable[..., Any]) -> None:
    join("robot", robot_library()).create_service_server("/ask", ASK, lambda _: None)
    user = join("cockpit")
    with pytest.raises(TypeNotFoundError, match="ROS 1 servers send no definitions"):
        user.fetch_type(ASK, timeout=30)
    knowing = join("knowing", robot_library())
    assert knowing.fetch_type(ASK, timeout=30).md5 == md5_of(ASK)
    assert knowing.fetch_type("my_msgs/Ask", node="/robot", timeout=30).name == ASK
    other = Library()
    other.add_text(ASK, "---\nbool yes", ros=1)
    with pytest.raises(DefinitionConflictError, match=md5_of(ASK)):
        join("other", other).fetch_type(ASK, timeout=30)


def test_action_is_assembled_from_its_topics(
    join: Callable[..., Any], eventually: Callable[..., Any]
) -> None:
    robot = join("robot", robot_library())
    robot.create_action_server("/go", GO, lambda goal: None)
    user = join("cockpit")

    def is_refused() -> bool:
        with pytest.raises(TypeNotFoundError) as raised:
            user.fetch_type(GO, timeout=2)
        return "the server of /go does not send it" in str(raised.value)

    eventually(is_refused)
    join("desk", robot_library()).create_action_client("/go", GO)
    found = user.fetch_type(GO, timeout=30)
    assert found.name == GO
    assert found.md5 == md5_of(GO)
    assert dict(found.constants["goal"]) == {"FAST": 1}
    assert user.fetch_type("my_msgs/Go", timeout=30).md5 == found.md5


def test_broken_action_file_is_reported(
    join: Callable[..., Any], eventually: Callable[..., Any], tmp_path: Path
) -> None:
    folder = tmp_path / "my_msgs/action"
    folder.mkdir(parents=True)
    (folder / "Go.action").write_text("uint8\n---\n---\n")
    own = Library()
    own.add_path(tmp_path)
    join("robot", robot_library()).create_action_server("/go", GO, lambda goal: None)
    client = join("cockpit", own).create_action_client("/go")
    eventually(lambda: "Go.action:1:1: expected a type and a name" in client.problem)


def test_type_that_is_announced_later_is_awaited(join: Callable[..., Any]) -> None:
    user = join("cockpit")
    promise = user.fetch_type_async(STATE, timeout=30)

    async def fetch() -> Any:
        return await user.fetch_type_async(STATE, timeout=None)

    join("robot", robot_library()).create_publisher("/state", STATE)
    assert promise.result(30).md5 == md5_of(STATE)
    assert asyncio.run(fetch()).md5 == md5_of(STATE)


def test_local_types_serve_unless_a_node_announces_another(join: Callable[..., Any]) -> None:
    library = Library()
    user = join("cockpit", library)
    assert user.fetch_type("std_msgs/Bool", timeout=30) is rosglass.load(
        "std_msgs/Bool", ros=1, library=library
    )
    robot = Library(prefer="wire")
    robot.add_text("std_msgs/msg/String", "string data\nuint8 urgency", ros=1)
    join("robot", robot).create_publisher("/word", "std_msgs/String")
    promise = user.fetch_type_async("std_msgs/String", node="/robot", timeout=30)
    assert len(promise.result(30).fields) == 2
    assert len(user.create_publisher("/other", "std_msgs/String").type.fields) == 1


def test_several_versions_must_be_chosen(
    join: Callable[..., Any], eventually: Callable[..., Any]
) -> None:
    old, new = robot_library(), robot_library("int64 state")
    join("old", old).create_publisher("/a", STATE)
    join("new", new).create_publisher("/b", STATE)
    user = join("cockpit")
    eventually(lambda: user.topics().keys() >= {"/a", "/b"}, timeout=30)
    with pytest.raises(DefinitionConflictError, match=r"several versions .*of /old.*hash or node"):
        user.fetch_type(STATE, timeout=30)
    assert user.fetch_type(STATE, node="/old", timeout=30).md5 == md5_of(STATE, old)
    assert user.fetch_type(STATE, hash=md5_of(STATE, new), timeout=30).md5 == md5_of(STATE, new)
    with pytest.raises(TypeNotFoundError, match="but there are others"):
        user.fetch_type(STATE, hash="0" * 32, timeout=3)


def test_unused_type_is_not_found(
    join: Callable[..., Any], master: FakeMaster, eventually: Callable[..., Any]
) -> None:
    user = join("cockpit")
    eventually(lambda: user.status().state.value == "connected", timeout=30)
    with pytest.raises(TypeNotFoundError, match=r"within 0\.2 s: no node in the graph uses it"):
        user.fetch_type(STATE, timeout=0.2)
    with pytest.raises(TypeNotFoundError, match="/arm does not use it"):
        user.fetch_type("std_msgs/String", node="/arm", timeout=0.2)
    master.subscribers["/state"] = {"/arm": "http://127.0.0.1:1/"}
    master.types["/state"] = "my_msgs/State"
    eventually(lambda: "/state" in user.topics(), timeout=30)
    with pytest.raises(TypeNotFoundError, match="/state has only subscribers"):
        user.fetch_type(STATE, timeout=2)
    master.stop()
    with pytest.raises(TypeNotFoundError, match="does not answer"):
        join("early").fetch_type(STATE, timeout=2)
    master.start()


class Answering:
    """Publishers whose connections a test answers itself."""

    def __init__(self, master: FakeMaster, node: str, reply: bytes | None) -> None:
        self.server = socket.create_server(("127.0.0.1", 0))
        self.reply = reply
        threading.Thread(target=self._serve, daemon=True).start()
        port = self.server.getsockname()[1]
        from xmlrpc.server import SimpleXMLRPCServer

        self.api = SimpleXMLRPCServer(("127.0.0.1", 0), logRequests=False)
        self.api.register_function(
            lambda *_: [1, "", ["TCPROS", "127.0.0.1", port]], "requestTopic"
        )
        threading.Thread(target=self.api.serve_forever, args=(0.02,), daemon=True).start()
        api = f"http://127.0.0.1:{self.api.server_address[1]}/"
        master.publishers.setdefault("/state", {})[node] = api
        master.types["/state"] = "my_msgs/State"

    def _serve(self) -> None:
        while True:
            try:
                sock, _ = self.server.accept()
            except OSError:
                return
            sock.recv(4096)
            if self.reply is not None:
                sock.sendall(self.reply)
                sock.close()

    def close(self) -> None:
        self.server.shutdown(socket.SHUT_RDWR)
        self.server.close()
        self.api.shutdown()
        self.api.server_close()


@pytest.mark.parametrize(
    ("reply", "message"),
    [
        (encode_header({"error": "not on Sundays"}), "refuses: not on Sundays"),
        (encode_header({"callerid": "/odd", "type": "my_msgs/State"}), "has no md5sum"),
        (struct.pack("<I", 2**31), "claims to have 2147483648 bytes"),
        (b"\4\0\0\0\xff\xff\xff\xff", "a field is truncated"),
        (b"", "closed the connection"),
        (
            encode_header({"md5sum": "0" * 32, "type": "my_msgs/State", "message_definition": ""}),
            "its publisher sends no definition",
        ),
        (
            encode_header(
                {"md5sum": "0" * 32, "type": "my_msgs/State", "message_definition": "int8 a"}
            ),
            "but the definition it sends has",
        ),
    ],
)
def test_publishers_that_answer_nonsense_are_reported(
    reply: bytes, message: str, join: Callable[..., Any], master: FakeMaster
) -> None:
    odd = Answering(master, "/odd", reply)
    try:
        with pytest.raises(TypeNotFoundError, match=message):
            join("cockpit").fetch_type(STATE, timeout=30)
    finally:
        odd.close()


def test_one_that_answers_is_enough(join: Callable[..., Any], master: FakeMaster) -> None:
    silent = Answering(master, "/silent", None)
    try:
        join("robot", robot_library()).create_publisher("/state", STATE)
        user = join("cockpit")
        assert user.fetch_type(STATE, timeout=30).md5 == md5_of(STATE)
        ends = {end.node.full: end for end in user.ask_publishers("/state", 1.0)}
        assert ends["/robot"].type_hash == md5_of(STATE)
        assert ends["/silent"].type_hash == ""
    finally:
        silent.close()


def test_publishers_are_asked_for_sum_and_latching(
    join: Callable[..., Any], eventually: Callable[..., Any]
) -> None:
    robot = join("robot", robot_library())
    latched = robot.create_publisher("/state", STATE, rosglass.QoS.latched())
    latched.publish(state=3)
    user = join("cockpit")
    (known,) = eventually(lambda: user.publishers("/state"), timeout=30)
    assert known.type_hash == ""
    (asked,) = user.ask_publishers("/state", 30)
    assert asked.type_hash == md5_of(STATE)
    assert asked.qos == rosglass.QoS.latched()
    (own,) = eventually(lambda: robot.publishers("/state"), timeout=30)
    assert (own.type_hash, own.qos) == (asked.type_hash, asked.qos)
    assert user.ask_publishers("/nothing") == []
    with pytest.raises(rosglass.ConversionError):
        user.ask_publishers("/state", -1)


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        ({"name": "state"}, "not a type name"),
        ({"name": 3}, "not a type name"),
        ({"name": STATE, "hash": "abc"}, "not an md5 sum"),
        ({"name": STATE, "hash": "RIHS01_" + "0" * 64}, "not an md5 sum"),
        ({"name": STATE, "hash": 3}, "not an md5 sum"),
        ({"name": STATE, "timeout": -1}, "timeout"),
        ({"name": STATE, "timeout": "5"}, "timeout"),
        ({"name": STATE, "node": "a b"}, "a b"),
    ],
)
def test_bad_arguments(arguments: dict[str, Any], complaint: str, join: Callable[..., Any]) -> None:
    with pytest.raises(rosglass.Error, match=complaint):
        join("cockpit").fetch_type(**arguments)


def test_closing_ends_it_and_nothing_is_left(join: Callable[..., Any]) -> None:
    user = join("cockpit")
    open_ = user.fetch_type_async(STATE, timeout=None)
    given_up = user.fetch_type_async(STATE, timeout=None)
    before = len(core_of(user).members())
    assert given_up.cancel()
    assert len(core_of(user).members()) == before - 1
    began = time.monotonic()
    user.close()
    with pytest.raises(NodeClosedError):
        open_.result(30)
    assert time.monotonic() - began < 20
    with pytest.raises(NodeClosedError):
        user.fetch_type(STATE)
