"""Type descriptions that a node serves: ~/get_type_description."""

from __future__ import annotations

import gc
import re
from typing import TYPE_CHECKING, Any

import pytest
from inside import core_of

import rosglass
from rosglass.comm.types import Types
from rosglass.errors import NodeClosedError
from rosglass.interfaces import (
    ActionDefinition,
    Library,
    MemoryProvider,
    ServiceDefinition,
    add_type_sources,
    announced_hashes,
    parse_message,
    parse_type_description,
    rihs01,
    type_description,
)
from rosglass.messages import MessageType
from rosglass.ros2.action_types import ActionTypes
from rosglass.ros2.type_descriptions import TypeDescriptionServer, compose_action, describe

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

TRIGGER = "type_description_interfaces/srv/GetTypeDescription"
GO = "my_msgs/action/Go"
SUFFIXES = ("_SendGoal", "_GetResult", "_FeedbackMessage")


@pytest.fixture
def library() -> Library:
    library = Library()
    library.add_text("my_msgs/msg/Part", "uint8 KEPT=1 # yes\nint8 a")
    library.add_text("my_msgs/srv/Ask", "my_msgs/Part part\n---\nbool yes")
    library.add_text(GO, "uint8 FAST=1\nuint8 speed\n---\nint8 b\n---\nfloat32 left")
    return library


@pytest.fixture
def types(library: Library) -> Types:
    return Types(library, "fake://")


@pytest.fixture
def client_of(url: str, connect: Callable[..., Any]) -> Iterator[Callable[[Library], Any]]:
    """Connect a node with a library; returns a client that asks it, as other nodes do."""
    nodes = []

    def client_of(library: Library) -> Any:
        nodes.append(rosglass.connect(url, "robot", library=library))
        client = connect("asker").create_service_client("/robot/get_type_description", TRIGGER)
        client.node = nodes[0]
        return client

    yield client_of
    for node in nodes:
        node.close()


@pytest.fixture
def ask(client_of: Callable[[Library], Any], library: Library) -> Callable[..., Any]:
    """Ask a node over the local graph for a type's description."""
    client = client_of(library)

    def ask(name: str, type_hash: str = "", **more: Any) -> Any:
        return client.call({"type_name": name, "type_hash": type_hash, **more}, timeout=30)

    ask.client = client  # type: ignore[attr-defined]
    return ask


@pytest.mark.parametrize(
    "name", ["my_msgs/msg/Part", "my_msgs/Part", "my_msgs/srv/Ask", GO, f"{GO}_SendGoal"]
)
def test_by_name_and_by_hash(name: str, ask: Callable[..., Any], library: Library) -> None:
    definition = library.definition(name)
    for type_hash in ("", *announced_hashes(definition)):
        answer = ask(name, type_hash)
        assert answer.successful
        assert answer.failure_reason == ""
        description = answer.type_description.to_dict()
        assert description == type_description(definition)
        sources = [source.to_dict() for source in answer.type_sources]
        found = add_type_sources(parse_type_description(description), sources, verbatim=True)
        assert rihs01(found) == rihs01(definition)


def test_texts_come_when_they_are_asked_for(ask: Callable[..., Any]) -> None:
    assert ask("my_msgs/srv/Ask").type_sources[0].encoding == "srv"
    (text,) = (s for s in ask("my_msgs/srv/Ask").type_sources if s.type_name == "my_msgs/msg/Part")
    assert text.raw_file_contents == "uint8 KEPT=1 # yes\nint8 a"
    assert len(ask("my_msgs/srv/Ask", include_type_sources=False).type_sources) == 0
    # The constants of a goal are in the text of its action only.
    names = [s.type_name for s in ask(f"{GO}_SendGoal").type_sources]
    assert names.count(GO) == 1


def test_types_in_use_need_no_name(ask: Callable[..., Any]) -> None:
    """A type that no library has, given as an object; rcl is asked by the hash alone, too."""
    kind = MessageType(parse_message("int64 secret", "my_msgs/Secret"))
    assert not ask("", kind.rihs01).successful
    ask.client.node.create_publisher("/secret", kind)  # type: ignore[attr-defined]
    for name in ("", "my_msgs/msg/Secret", "other_msgs/msg/Spelling"):
        answer = ask(name, kind.rihs01)
        assert answer.successful
        assert answer.type_description.type_description.type_name == "my_msgs/msg/Secret"


def test_types_of_actions_that_come_and_go_are_kept_once(library: Library, types: Types) -> None:
    def use(count: int) -> int:
        """Look an action's types up as its servers and clients do; return how many are kept."""
        for _ in range(count):
            made = ActionTypes.of(types.action(GO), types)
            types.service(made.send_goal)
            types.message(made.feedback)
        del made
        gc.collect()
        found = (one for one in gc.get_objects() if isinstance(one, ServiceDefinition))
        return sum(one.name == f"{GO}_SendGoal" for one in found)

    before = use(5)
    assert use(20) <= before + 1
    for suffix in SUFFIXES[::2]:
        definition = library.definition(f"{GO}{suffix}")
        assert types.in_use(rihs01(definition)) is not None


@pytest.mark.parametrize(
    ("name", "type_hash", "reason"),
    [
        ("my_msgs/msg/Other", "", "/robot: no definition of my_msgs/msg/Other"),
        ("my_msgs/msg/Part", "RIHS01_" + "0" * 64, "/robot: no definition .* has the hash"),
        ("my_msgs/msg/Part", "md5:abc", "/robot: .* is not a RIHS01 hash"),
        ("../../etc/passwd", "", "/robot: .* is not a type name"),
        ("", "RIHS01_" + "0" * 64, "/robot: no type with the hash .* is in use"),
        ("", "", "/robot: neither a type's name nor its hash"),
    ],
)
def test_failures_have_a_reason(
    name: str, type_hash: str, reason: str, ask: Callable[..., Any]
) -> None:
    answer = ask(name, type_hash)
    assert not answer.successful
    assert re.match(reason, answer.failure_reason)
    assert answer.type_description.to_dict()["type_description"]["type_name"] == ""


def test_closing(ask: Callable[..., Any]) -> None:
    client = ask.client  # type: ignore[attr-defined]
    assert client.wait_for_server(30)
    client.node.close()
    assert not client.wait_for_server(0)
    with pytest.raises(rosglass.Error):
        client.call({"type_name": "my_msgs/msg/Part"}, timeout=0.05)
    with pytest.raises(NodeClosedError):
        TypeDescriptionServer(core_of(client.node)).open()


def test_bare_library_does_not_prevent_the_service(url: str, connect: Callable[..., Any]) -> None:
    """The node's own services need types that its library may not have."""
    client = connect("asker").create_service_client("/robot/get_type_description", TRIGGER)
    bare = Library(MemoryProvider())
    with rosglass.connect(url, "robot", library=bare, own_services=False) as server:
        TypeDescriptionServer(core_of(server)).open()
        asked = client.call({"type_name": "std_msgs/msg/String"}, timeout=30)
    assert "no definition" in asked.failure_reason


def test_every_part_of_an_action_is_checked(library: Library, types: Types) -> None:
    parts = {
        suffix: parse_type_description(
            describe(types, f"{GO}{suffix}", "", sources=False)["type_description"]
        )
        for suffix in SUFFIXES
    }
    action = compose_action(GO, parts)
    assert isinstance(action, ActionDefinition)
    assert rihs01(action) == rihs01(library.definition(GO))
    other = Library()
    other.add_text(GO, "uint8 speed\n---\nint8 b\n---\nfloat64 left")
    mixed = parts | {"_FeedbackMessage": other.definition(f"{GO}_GetResult")}
    with pytest.raises(rosglass.Error, match="do not mention my_msgs/action/Go_Feedback"):
        compose_action(GO, mixed)
    mixed = parts | {"_GetResult": other.definition("std_srvs/srv/Trigger")}
    with pytest.raises(rosglass.Error, match="do not mention my_msgs/action/Go_Result"):
        compose_action(GO, mixed)
