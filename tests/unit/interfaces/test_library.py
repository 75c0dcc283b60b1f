"""Looking definitions up: names, sources, conflicts, hashes, threads."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, Any

import pytest

from rosglass.errors import (
    CyclicTypeError,
    DefinitionConflictError,
    DefinitionError,
    InvalidNameError,
    TypeNotFoundError,
    UnsupportedError,
)
from rosglass.interfaces import (
    Definition,
    Distributions,
    Library,
    MemoryProvider,
    full_text,
    join_name,
    md5,
    parse_message,
    rihs01,
    ros1_name,
    split_name,
)

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

TEMPERATURE = "std_msgs/Header header\nfloat32 temperature\nfloat64 variance"


def message(library: Library, name: str, ros: int = 2) -> Definition:
    definition = library.definition(name, ros)
    assert isinstance(definition, Definition)
    return definition


def test_nested_is_complete_at_every_level(library: Library) -> None:
    pose = message(library, "geometry_msgs/PoseStamped")
    assert set(pose.nested) == {
        "std_msgs/msg/Header",
        "builtin_interfaces/msg/Time",
        "geometry_msgs/msg/Pose",
        "geometry_msgs/msg/Point",
        "geometry_msgs/msg/Quaternion",
    }
    assert set(pose.nested["std_msgs/msg/Header"].nested) == {"builtin_interfaces/msg/Time"}
    with pytest.raises(TypeError):
        pose.nested["x"] = pose  # type: ignore[index]


def test_one_object_per_type(library: Library) -> None:
    pose = message(library, "geometry_msgs/PoseStamped")
    assert library.definition("geometry_msgs/msg/PoseStamped") is pose
    assert library.definition("std_msgs/msg/Header") is pose.nested["std_msgs/msg/Header"]


@pytest.mark.parametrize(
    "name", ["Pose", "a/b/C", "geometry_msgs::msg::dds_::Pose_", "", "../x/Y", 5, None, ["a/B"]]
)
def test_bad_names(library: Library, name: object) -> None:
    with pytest.raises(InvalidNameError):
        library.definition(name)  # type: ignore[arg-type]


def test_spellings_of_names() -> None:
    assert split_name("a/msg/B") == ("a", "msg", "B")
    assert split_name("a/B") == ("a", "", "B")
    assert join_name("a/B") == "a/msg/B"
    assert join_name("a/B", "srv") == "a/srv/B"
    assert ros1_name("a/msg/B") == ros1_name("a/B") == "a/B"


def test_invalid_ros_version_is_rejected(library: Library) -> None:
    with pytest.raises(UnsupportedError, match="ros must be 1 or 2, got 3"):
        library.definition("std_msgs/String", 3)


@pytest.mark.parametrize(
    ("name", "ros", "words"),
    [
        ("geometry_msgs/PoseStampd", 2, "Did you mean geometry_msgs/msg/PoseStamped"),
        ("geometry_msgs/msg/twist", 2, "Did you mean geometry_msgs/msg/Twist? "),
        ("GEOMETRY_msgs/TWIST", 2, "Did you mean geometry_msgs/msg/Twist? "),
        ("geometry_msg/msg/Twist", 2, "Did you mean geometry_msgs/msg/Twist"),
        ("std_srv/srv/Trigger", 2, "std_srvs/srv/Trigger"),
        ("std_msgs/Strin", 1, "Did you mean std_msgs/String? "),
        ("std_msgs/msg/Strin", 1, "Did you mean std_msgs/msg/String? "),
        ("bond/Status", 2, "ROS 1 has it."),
        ("missing_msgs/Knows", 2, "looked in distribution sets (jazzy, kilted"),
        ("missing_msgs/Knows", 1, "looked in distribution sets (noetic)"),
        ("missing_msgs/Knows", 1, "Library.add_path('missing_msgs')"),
    ],
)
def test_unknown_types(library: Library, name: str, ros: int, words: str) -> None:
    with pytest.raises(TypeNotFoundError) as caught:
        library.definition(name, ros)
    assert words in str(caught.value)


def test_errors_about_names_stay_short() -> None:
    for name in ("x" * 100_000, f"pkg/{'-' * 100_000}"):
        with pytest.raises(InvalidNameError) as caught:
            join_name(name)
        assert len(str(caught.value)) < 300


@pytest.mark.parametrize("wrong", ["std_msgs/String", 3, None])
def test_arguments_of_another_kind(library: Library, wrong: Any) -> None:
    for attempt in (library.add, md5, rihs01, full_text):
        with pytest.raises(UnsupportedError, match="a definition is expected, as Library"):
            attempt(wrong)
    with pytest.raises(TypeNotFoundError, match="folder"):
        library.add_path(wrong)


def test_unknown_type_is_found_once_it_is_added(library: Library) -> None:
    with pytest.raises(TypeNotFoundError):
        library.definition("my_msgs/Odd")
    library.add_text("my_msgs/Odd", "int32 x")
    assert message(library, "my_msgs/Odd").fields[0].name == "x"


def test_no_providers_at_all() -> None:
    with pytest.raises(TypeNotFoundError, match="looked in nothing: there are no providers"):
        Library(MemoryProvider("mine")).definition("std_msgs/String")


def test_field_of_unknown_type(library: Library) -> None:
    library.add_text("my_msgs/Odd", "int32 x\n  geometry_msgs/Piont p", source="wire /odd")
    with pytest.raises(DefinitionError) as caught:
        library.definition("my_msgs/Odd")
    assert "<my_msgs/Odd from wire /odd>:2:3: field p has the type geometry_msgs/msg/Piont" in str(
        caught.value
    )
    assert "Did you mean geometry_msgs/msg/Point" in str(caught.value)


def test_field_of_a_type_that_is_a_service(library: Library) -> None:
    library.add_text("my_msgs/Odd", "std_srvs/Trigger x")
    with pytest.raises(DefinitionError, match="std_srvs/msg/Trigger, which is unknown"):
        library.definition("my_msgs/Odd")


@pytest.mark.parametrize(
    ("texts", "chain"),
    [
        ({"A": "A a"}, "my_msgs/msg/A -> my_msgs/msg/A"),
        (
            {"A": "int8 x\nB[] b", "B": "C[<=3] c", "C": "B[2] b"},
            "my_msgs/msg/B -> my_msgs/msg/C -> my_msgs/msg/B",
        ),
    ],
)
def test_cycles(library: Library, texts: dict[str, str], chain: str) -> None:
    for name, text in texts.items():
        library.add_text(f"my_msgs/{name}", text)
    with pytest.raises(CyclicTypeError) as caught:
        library.definition("my_msgs/A")
    assert str(caught.value).endswith(f"the type contains itself: {chain}")
    assert caught.value.line == 1


def test_failed_type_does_not_affect_others(library: Library) -> None:
    library.add_text("my_msgs/A", "B b\nMissing m")
    library.add_text("my_msgs/B", "geometry_msgs/Point p")
    with pytest.raises(DefinitionError):
        library.definition("my_msgs/A")
    assert message(library, "my_msgs/B").nested
    library.add_text("my_msgs/Missing", "int8 x")
    assert set(message(library, "my_msgs/A").nested) == {
        "my_msgs/msg/B",
        "my_msgs/msg/Missing",
        "geometry_msgs/msg/Point",
    }


def test_joined_definitions_bring_their_types_along(library: Library) -> None:
    text = "Inner x\n===\nMSG: my_msgs/Inner\nint32 y"
    library.add_text("my_msgs/Outer", text, ros=1, source="wire /outer")
    assert message(library, "my_msgs/Outer", 1).nested["my_msgs/msg/Inner"].fields[0].name == "y"
    assert library.source("my_msgs/Inner", 1).provider == "wire /outer"


def test_ros_1_and_ros_2_types_are_separate(library: Library) -> None:
    library.add_text("my_msgs/Odd", "int32 x", ros=1)
    with pytest.raises(TypeNotFoundError, match="ROS 1 has it"):
        library.definition("my_msgs/Odd")


def test_add_a_parsed_definition(library: Library) -> None:
    library.add(parse_message("int32 x", "my_msgs/Odd", provider="mine"))
    assert library.source("my_msgs/Odd").provider == "mine"


def test_add_text_in_other_encodings(library: Library) -> None:
    idl = "module my_msgs { module msg { struct Odd { long x; }; }; };"
    library.add_text("my_msgs/Odd", idl, encoding="idl")
    assert str(message(library, "my_msgs/Odd").fields[0].type) == "int32"
    library.add_text("my_msgs/Do", "---\nint8 x", encoding="srv")
    assert library.definition("my_msgs/Do").name == "my_msgs/srv/Do"
    with pytest.raises(UnsupportedError, match="encoding 'xml' can't be read; known: msg, srv"):
        library.add_text("my_msgs/Odd", "", encoding="xml")


def test_names(library: Library) -> None:
    library.add_text("aaa_msgs/Odd", "int32 x")
    names = library.names()
    assert names[0] == "aaa_msgs/msg/Odd"
    assert names == sorted(set(names))
    assert "std_srvs/srv/Trigger" in names
    assert {name.split("/")[1] for name in names} == {"msg", "srv", "action"}
    assert {name.split("/")[1] for name in library.names(kind="srv")} == {"srv"}
    assert "bond/msg/Status" in library.names(ros=1)
    with pytest.raises(UnsupportedError, match="kind must be one of msg, srv, action, got 'foo'"):
        library.names(kind="foo")
    with pytest.raises(UnsupportedError, match="ros must be 1 or 2"):
        library.names(ros=3)


# Definitions that differ.


def test_received_and_local_definition_differ(library: Library) -> None:
    library.add_text("sensor_msgs/Temperature", TEMPERATURE, source="wire /temperature")
    with pytest.raises(DefinitionConflictError) as caught:
        library.definition("sensor_msgs/Temperature")
    text = str(caught.value)
    assert "wire /temperature and distribution rosbags jazzy" in text
    assert "the first has 'float32 temperature' where the second has 'float64 temperature'" in text
    assert "Library.prefer('wire') or Library.prefer('distribution')" in text


def test_nested_type_that_differs_is_reported(library: Library) -> None:
    text = "std_msgs/Header header\n===\nMSG: std_msgs/Header\nstring frame_id"
    library.add_text("my_msgs/Odd", text)
    with pytest.raises(DefinitionConflictError, match="two sources define std_msgs/msg/Header"):
        library.definition("my_msgs/Odd")


def test_received_definitions_differ(library: Library) -> None:
    library.add_text("my_msgs/Odd", "int32 x", source="wire /a")
    library.add_text("my_msgs/Odd", "# same\nint32 x # really", source="wire /b")
    with pytest.raises(DefinitionConflictError) as caught:
        library.add_text("my_msgs/Odd", "int32 x\nint32 y", source="wire /c")
    assert "wire /a and wire /c differ: only the second has 'int32 y'" in str(caught.value)


def test_received_definition_differs_from_the_one_in_use(library: Library) -> None:
    used = library.definition("sensor_msgs/Temperature")
    with pytest.raises(DefinitionConflictError, match="differs from the definition in use"):
        library.add_text("sensor_msgs/Temperature", TEMPERATURE)
    assert library.definition("sensor_msgs/Temperature") is used


def test_constants_matter_in_ros1_only(library: Library) -> None:
    for ros in (1, 2):
        library.add_text("my_msgs/A", "int8 X=1\nint8 x", ros)
    library.add_text("my_msgs/A", "int8 X=2\nint8 x", 2)
    with pytest.raises(DefinitionConflictError, match=r"'int8 X=1'.*'int8 X=2'"):
        library.add_text("my_msgs/A", "int8 X=2\nint8 x", 1)


@pytest.mark.parametrize(
    ("name", "one", "other", "words"),
    [
        ("my_msgs/srv/Do", "---\nint8 x", "int8 x\n---\nint8 x", "in the request only the second"),
        ("my_msgs/action/Do", "---\n---\nint8 x", "---\n---\nint9 x".replace("9", "16"),
         "in the feedback the first has 'int8 x' where the second has 'int16 x'"),
    ],
)  # fmt: skip
def test_services_and_actions_that_differ(
    library: Library, name: str, one: str, other: str, words: str
) -> None:
    library.add_text(name, one)
    with pytest.raises(DefinitionConflictError, match=words):
        library.add_text(name, other)


@pytest.mark.parametrize(("preferred", "kind"), [("wire", "float32"), ("distribution", "float64")])
def test_prefer(library: Library, preferred: str, kind: str) -> None:
    library.add_text("sensor_msgs/Temperature", TEMPERATURE)
    library.prefer(preferred)
    assert message(library, "sensor_msgs/Temperature").fields[1].type.name == kind


def test_prefer_from_the_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROSGLASS_PREFER_DEFINITIONS", "folders, wire")
    library = Library()
    library.add_text("sensor_msgs/Temperature", TEMPERATURE)
    assert message(library, "sensor_msgs/Temperature").fields[1].type.name == "float32"


def test_prefer_from_the_environment_is_checked(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROSGLASS_PREFER_DEFINITIONS", "workspace")
    Library(MemoryProvider("mine"))  # for the standard chain only
    monkeypatch.setenv("ROSGLASS_PREFER_DEFINITIONS", "robot")
    with pytest.raises(UnsupportedError, match="ROSGLASS_PREFER_DEFINITIONS has 'robot'; it takes"):
        Library()


def test_prefer_received_definitions_over_the_one_in_use(library: Library) -> None:
    library.definition("sensor_msgs/Temperature")
    library.prefer("wire")
    library.add_text("sensor_msgs/Temperature", TEMPERATURE)
    assert message(library, "sensor_msgs/Temperature").fields[1].type.name == "float32"


def test_unknown_source_cannot_be_preferred(library: Library) -> None:
    with pytest.raises(UnsupportedError, match="there are: wire, workspace, folders, distribution"):
        library.prefer("robot")


def test_variants_of_distributions_do_not_conflict(
    library: Library, write: Callable[..., Path]
) -> None:
    """A sourced Humble workspace has a Gid that differs from Jazzy's, and is right."""
    root = write({"rmw_dds_common/msg/Gid.msg": "char[24] data"})
    library.add_path(root)
    assert message(library, "rmw_dds_common/Gid").fields[0].type.size == 24
    assert library.source("rmw_dds_common/Gid").provider.startswith("folders ")


# Definitions by hash.


def test_definition_by_hash_from_another_distribution(library: Library) -> None:
    wanted = rihs01(Library(distribution="humble").definition("rmw_dds_common/Gid"))
    found = library.definition("rmw_dds_common/Gid", hash=wanted)
    assert isinstance(found, Definition)
    assert found.fields[0].type.size == 24
    assert message(library, "rmw_dds_common/Gid").fields[0].type.size == 16
    assert library.definition("rmw_dds_common/Gid", hash=wanted) is found


def test_definition_by_hash_settles_a_conflict(library: Library) -> None:
    library.add_text("sensor_msgs/Temperature", TEMPERATURE)
    wanted = rihs01(Library().definition("sensor_msgs/Temperature"))
    found = library.definition("sensor_msgs/Temperature", hash=wanted)
    assert isinstance(found, Definition)
    assert found.fields[1].type.name == "float64"


def test_definition_by_hash_that_is_the_usual_one(library: Library) -> None:
    usual = message(library, "std_msgs/String", 1)
    assert library.definition("std_msgs/String", 1, hash=md5(usual)) is usual
    assert library.definition("std_msgs/String", 1, hash="*") is usual


def test_unknown_hash_is_a_conflict(library: Library) -> None:
    with pytest.raises(DefinitionConflictError) as caught:
        library.definition("std_msgs/String", hash="RIHS01_00")
    assert "has the hash RIHS01_00 that the peer announces: rosbags jazzy has RIHS01_df66" in str(
        caught.value
    )


def test_errors_of_definitions_by_hash(library: Library) -> None:
    with pytest.raises(TypeNotFoundError):
        library.definition("my_msgs/Odd", hash="RIHS01_00")
    library.add_text("my_msgs/Odd", "Missing x")
    with pytest.raises(DefinitionError, match="which is unknown"):
        library.definition("my_msgs/Odd", hash="RIHS01_00")


def test_custom_chain() -> None:
    mine = MemoryProvider("mine")
    mine.add(parse_message("int32 x", "my_msgs/Odd"))
    library = Library(mine, Distributions(), prefer="mine")
    assert message(library, "my_msgs/Odd").fields[0].name == "x"
    assert message(library, "std_msgs/String").fields


def test_add_path_to_a_custom_chain(write: Callable[..., Path]) -> None:
    library = Library(MemoryProvider("mine"))
    library.add_path(write({"my_msgs/msg/Odd.msg": "int32 x"}))
    assert message(library, "my_msgs/Odd").fields[0].name == "x"


def test_threads() -> None:
    """Many threads load and add at once; each type is one object for all of them."""
    library = Library()
    names = library.names(kind="msg")
    found: dict[str, set[int]] = {name: set() for name in names}
    problems: list[BaseException] = []
    start = threading.Barrier(8)

    def load(offset: int) -> None:
        try:
            start.wait()
            for index in range(len(names)):
                name = names[(index + offset) % len(names)]
                found[name].add(id(library.definition(name)))
                library.add_text(f"thread_msgs/T{offset}x{index}", "geometry_msgs/Pose pose")
                library.definition(f"thread_msgs/T{offset}x{index}")
        except BaseException as error:
            problems.append(error)

    threads = [threading.Thread(target=load, args=(25 * n,)) for n in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert problems == []
    assert all(len(ids) == 1 for ids in found.values())
