"""Definitions that peers sent on request live beside local ones, each under its hash."""

from __future__ import annotations

import pytest

import rosglass
from rosglass.errors import DefinitionConflictError, TypeNotFoundError, UnsupportedError
from rosglass.interfaces import (
    ActionDefinition,
    Definition,
    InterfaceDefinition,
    Library,
    ServiceDefinition,
    parse_message,
    parse_type_description,
    rihs01,
    type_description,
)


def sent(name: str, text: str, *needs: tuple[str, str], by: str = "/talker") -> InterfaceDefinition:
    """A definition, complete, as a node sends it."""
    elsewhere = Library(prefer="wire")
    for other, definition in needs:
        elsewhere.add_text(other, definition, source="test")
    elsewhere.add_text(name, text, source="test")
    return parse_type_description(
        type_description(elsewhere.definition(name)), provider=f"wire {by}"
    )


def test_found_by_hash_and_by_name(library: Library) -> None:
    definition = sent("my_msgs/msg/State", "uint8 state")
    with pytest.raises(TypeNotFoundError):
        library.definition("my_msgs/msg/State")
    type_hash = library.add_version(definition)
    assert type_hash == rihs01(definition)
    for name in ("my_msgs/msg/State", "my_msgs/State"):
        assert library.definition(name) is definition
        assert library.definition(name, hash=type_hash) is definition
    assert library.source("my_msgs/msg/State").provider == "wire /talker"
    assert "my_msgs/msg/State" in library.names(kind="msg")
    with pytest.raises(TypeNotFoundError):
        library.definition("my_msgs/msg/State", hash="RIHS01_" + "0" * 64)
    with pytest.raises(TypeNotFoundError):
        library.definition("my_msgs/State", ros=1)


def test_versions_live_side_by_side(library: Library) -> None:
    old = sent("my_msgs/msg/State", "uint8 state", by="/old")
    new = sent("my_msgs/msg/State", "uint8 state\nstring reason", by="/new")
    first, second = library.add_version(old), library.add_version(new)
    assert library.definition("my_msgs/msg/State", hash=first) is old
    assert library.definition("my_msgs/msg/State", hash=second) is new
    assert library.definition("my_msgs/msg/State") is new
    # The type that load() makes follows.
    assert rosglass.load("my_msgs/msg/State", library=library).rihs01 == second
    library.add_version(sent("my_msgs/msg/State", "uint8 state", by="/old_again"))
    assert library.definition("my_msgs/msg/State") is old
    made = rosglass.load("my_msgs/msg/State", library=library)
    assert made.rihs01 == first
    assert rosglass.load("my_msgs/msg/State", library=library) is made


def test_local_definitions_stay_as_they_are(library: Library) -> None:
    robot = sent("std_msgs/msg/String", "string data\nuint8 urgency")
    local = library.definition("std_msgs/msg/String")
    type_hash = library.add_version(robot)
    assert library.definition("std_msgs/msg/String") is local
    assert library.definition("std_msgs/msg/String", hash=rihs01(local)) is local
    assert library.definition("std_msgs/msg/String", hash=type_hash) is robot
    # Nested in something local, the local one counts, too.
    library.add_text("my_msgs/msg/Two", "std_msgs/String one", source="test")
    two = library.definition("my_msgs/msg/Two")
    assert isinstance(two, Definition)
    assert len(two.nested["std_msgs/msg/String"].fields) == 1


def test_parts_of_a_version_are_added_with_it(library: Library) -> None:
    definition = sent("my_msgs/msg/State", "my_msgs/Part[] parts", ("my_msgs/msg/Part", "int8 a"))
    library.add_version(definition)
    part = library.definition("my_msgs/msg/Part")
    assert library.definition("my_msgs/msg/Part", hash=rihs01(part)) is part
    assert part.source.provider == "wire /talker"


def test_nested_versions_are_those_that_were_sent(library: Library) -> None:
    """A robot of another distribution: same names, other fields."""
    definition = sent(
        "my_msgs/msg/State", "std_msgs/Header header", ("std_msgs/msg/Header", "uint32 seq")
    )
    type_hash = library.add_version(definition)
    found = library.definition("my_msgs/msg/State", hash=type_hash)
    assert isinstance(found, Definition)
    assert [f.name for f in found.nested["std_msgs/msg/Header"].fields] == ["seq"]


def test_services_are_announced_by_the_hash_of_their_request_too(library: Library) -> None:
    definition = sent("my_msgs/srv/Ask", "string question\n---\nint8 answer")
    assert isinstance(definition, ServiceDefinition)
    library.add_version(definition)
    local = library.definition("std_srvs/srv/SetBool")
    assert isinstance(local, ServiceDefinition)
    for service in (definition, local):
        for part in (service, service.request, service.response):
            assert library.definition(service.name, hash=rihs01(part)) is service
        with pytest.raises((TypeNotFoundError, DefinitionConflictError)):
            library.definition(service.name, hash="RIHS01_" + "0" * 64)


@pytest.mark.parametrize("suffix", ["_Request", "_Response", "_Event"])
def test_types_implied_by_services_have_versions(library: Library, suffix: str) -> None:
    definition = sent("my_msgs/srv/Ask", "string question\n---\nmy_msgs/Part[] answer",
                      ("my_msgs/msg/Part", "int8 a"))  # fmt: skip
    assert isinstance(definition, ServiceDefinition)
    library.add_version(definition)
    found = library.definition(f"my_msgs/srv/Ask{suffix}")
    assert library.definition(f"my_msgs/srv/Ask{suffix}", hash=rihs01(found)) is found
    with pytest.raises(TypeNotFoundError):
        library.definition(f"my_msgs/srv/Ask{suffix}", hash="RIHS01_" + "0" * 64)


@pytest.mark.parametrize(
    "suffix",
    ["_SendGoal", "_GetResult", "_FeedbackMessage", "_SendGoal_Request", "_GetResult_Event"],
)
def test_types_implied_by_actions_have_versions(library: Library, suffix: str) -> None:
    definition = sent("my_msgs/action/Go", "int8 where\n---\nmy_msgs/Part p\n---\nfloat32 done",
                      ("my_msgs/msg/Part", "int8 a"))  # fmt: skip
    assert isinstance(definition, ActionDefinition)
    library.add_version(definition)
    found = library.definition(f"my_msgs/action/Go{suffix}")
    assert library.definition(f"my_msgs/action/Go{suffix}", hash=rihs01(found)) is found


def test_only_complete_ros2_definitions(library: Library) -> None:
    with pytest.raises(UnsupportedError, match="ROS 1"):
        library.add_version(parse_message("int8 a", "my_msgs/State", ros=1))
    with pytest.raises(UnsupportedError, match="a definition is expected"):
        library.add_version("my_msgs/msg/State")  # type: ignore[arg-type]
    with pytest.raises(rosglass.Error, match="not resolved"):
        library.add_version(parse_message("my_msgs/Part part", "my_msgs/State"))
    with pytest.raises(TypeNotFoundError):
        library.definition("my_msgs/msg/State")


def test_unknown_hash_is_reported_with_the_known_versions(library: Library) -> None:
    library.add_version(sent("std_msgs/msg/String", "string data\nuint8 urgency"))
    with pytest.raises(DefinitionConflictError, match="rosbags jazzy"):
        library.definition("std_msgs/msg/String", hash="RIHS01_" + "0" * 64)
