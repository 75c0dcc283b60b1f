"""Definitions in workspaces: sources, devel and install spaces of ROS 1 and ROS 2."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING

import pytest

from rosglass.errors import DefinitionConflictError, DefinitionError, TypeNotFoundError
from rosglass.interfaces import Definition, Library, ServiceDefinition, md5, provider

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    Write = Callable[[dict[str, str]], Path]


def package_xml(name: str, tool: str) -> str:
    return (
        f"<package><!-- <name>not_me</name> --><name> {name} </name>"
        f"<buildtool_depend>{tool}</buildtool_depend></package>"
    )


def first_field(library: Library, name: str, ros: int) -> str:
    definition = library.definition(name, ros)
    assert isinstance(definition, Definition)
    return definition.fields[0].name


def test_ament_install_space(write: Write, monkeypatch: pytest.MonkeyPatch) -> None:
    root = write(
        {
            "under/share/my_msgs/msg/A.msg": "int32 under\n",
            "under/share/my_msgs/msg/B.msg": "A a\n",
            "under/share/ament_index/resource_index/packages/my_msgs": "",
            "over/share/my_msgs/msg/A.msg": "int32 over\n",
            "over/share/my_msgs/msg/A.idl": "nonsense",
            "over/share/my_msgs/srv/Do.srv": "---\nA a\n",
            "over/share/my_msgs/action/Go.action": "A a\n---\n---\n",
        }
    )
    monkeypatch.setenv("AMENT_PREFIX_PATH", f"{root}/over:{root}/under:{root}/missing::")
    library = Library()
    assert first_field(library, "my_msgs/A", 2) == "over"  # overlays hide, as in ROS
    assert first_field(library, "my_msgs/B", 2) == "a"
    service = library.definition("my_msgs/Do")
    assert isinstance(service, ServiceDefinition)
    assert service.response.nested["my_msgs/msg/A"].fields[0].name == "over"
    source = library.source("my_msgs/B")
    assert source.provider == f"workspace {root}/under"
    assert source.file == f"{root}/under/share/my_msgs/msg/B.msg"
    assert {"my_msgs/msg/A", "my_msgs/srv/Do", "my_msgs/action/Go"} <= set(library.names())
    with pytest.raises(TypeNotFoundError):
        library.definition("my_msgs/A", ros=1)


def test_catkin_source_space(write: Write, monkeypatch: pytest.MonkeyPatch) -> None:
    root = write(
        {
            "src/group/folder_name/package.xml": package_xml("my_msgs", "catkin"),
            "src/group/folder_name/msg/A.msg": "Header header",
            "src/group/folder_name/action/Go.action": "A a\n---\n---\nint32 done",
            "src/group/folder_name/test/package.xml": package_xml("inner_msgs", "catkin"),
            "src/group/folder_name/test/msg/X.msg": "int8 x",
            "src/ros2/package.xml": package_xml("new_msgs", "ament_cmake"),
            "src/ros2/msg/X.msg": "int8 x",
            "src/ignored/CATKIN_IGNORE": "",
            "src/ignored/package.xml": package_xml("ignored_msgs", "catkin"),
            "src/ignored/msg/X.msg": "int8 x",
            "src/.hidden/package.xml": package_xml("hidden_msgs", "catkin"),
            "src/.hidden/msg/X.msg": "int8 x",
        }
    )
    monkeypatch.setenv("ROS_PACKAGE_PATH", f"{root}/src:/nonexistent")
    library = Library()
    assert first_field(library, "my_msgs/A", 1) == "header"
    assert first_field(library, "my_msgs/GoActionFeedback", 1) == "header"
    for name in ("inner_msgs/X", "new_msgs/X", "ignored_msgs/X", "hidden_msgs/X", "not_me/A"):
        with pytest.raises(TypeNotFoundError):
            library.definition(name, ros=1)
    with pytest.raises(TypeNotFoundError):
        library.definition("new_msgs/X", ros=2)


def test_catkin_devel_space(write: Write, monkeypatch: pytest.MonkeyPatch) -> None:
    root = write(
        {
            "src/my_msgs/package.xml": package_xml("my_msgs", "catkin"),
            "src/my_msgs/msg/A.msg": "int32 from_source",
            "devel/share/my_msgs/msg/GoGoal.msg": "int32 generated",
        }
    )
    (root / "devel/.catkin").write_text(f"{root}/src;{root}/gone")
    monkeypatch.setenv("CMAKE_PREFIX_PATH", f"{root}/devel:/nonexistent")
    library = Library()
    assert first_field(library, "my_msgs/A", 1) == "from_source"
    assert first_field(library, "my_msgs/GoGoal", 1) == "generated"


def test_catkin_install_space(write: Write, monkeypatch: pytest.MonkeyPatch) -> None:
    root = write({"opt/.catkin": "", "opt/share/my_msgs/msg/A.msg": "int32 x"})
    monkeypatch.setenv("CMAKE_PREFIX_PATH", f"{root}/opt")
    assert first_field(Library(), "my_msgs/A", 1) == "x"
    monkeypatch.delenv("CMAKE_PREFIX_PATH")
    monkeypatch.setenv("ROS_PACKAGE_PATH", f"{root}/opt/share")
    assert first_field(Library(), "my_msgs/A", 1) == "x"


def test_workspace_that_is_sourced_while_the_program_runs(
    write: Write, monkeypatch: pytest.MonkeyPatch
) -> None:
    old = write({"old/my_msgs/msg/A.msg": "int32 old"}) / "old"
    new = write({"new/my_msgs/msg/A.msg": "int32 new", "new/my_msgs/msg/B.msg": "A a"}) / "new"
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(old))
    library = Library()
    assert first_field(library, "my_msgs/A", 1) == "old"
    with pytest.raises(TypeNotFoundError, match=str(old)):
        library.definition("my_msgs/B", ros=1)
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(new))
    found = library.definition("my_msgs/B", ros=1)
    assert isinstance(found, Definition)
    assert found.nested["my_msgs/msg/A"].fields[0].name == "new"
    assert first_field(library, "my_msgs/A", 1) == "new"
    with pytest.raises(TypeNotFoundError, match=str(new)):
        library.definition("my_msgs/C", ros=1)


def test_workspace_that_has_the_hash_a_peer_announces(
    write: Write, monkeypatch: pytest.MonkeyPatch
) -> None:
    root = write({"old/my_msgs/msg/A.msg": "int32 old", "new/my_msgs/msg/A.msg": "int32 new"})
    monkeypatch.setenv("ROS_PACKAGE_PATH", f"{root}/new")
    wanted = md5(Library().definition("my_msgs/A", ros=1))
    monkeypatch.setenv("ROS_PACKAGE_PATH", f"{root}/old")
    library = Library()
    with pytest.raises(DefinitionConflictError):
        library.definition("my_msgs/A", ros=1, hash=wanted)
    monkeypatch.setenv("ROS_PACKAGE_PATH", f"{root}/new")
    assert md5(library.definition("my_msgs/A", ros=1, hash=wanted)) == wanted


def test_cmake_prefix_of_ros2(write: Write, monkeypatch: pytest.MonkeyPatch) -> None:
    root = write(
        {"opt/share/ament_index/x": "", "opt/share/my_msgs/msg/A.msg": "int32 x", "usr/share/x": ""}
    )
    monkeypatch.setenv("CMAKE_PREFIX_PATH", f"{root}/usr:{root}/opt")
    assert first_field(Library(), "my_msgs/A", 2) == "x"
    with pytest.raises(TypeNotFoundError):
        Library().definition("my_msgs/A", ros=1)


IDL = "module my_msgs { module msg { struct A { long x; }; struct B { A a; }; }; };"


def test_idl_in_an_install_space(write: Write, monkeypatch: pytest.MonkeyPatch) -> None:
    root = write({"share/my_msgs/msg/A.idl": IDL, "share/my_msgs/msg/B.idl": IDL})
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(root))
    library = Library()
    assert first_field(library, "my_msgs/B", 2) == "a"
    assert "my_msgs/msg/A" in library.names()


@pytest.mark.parametrize(
    "layout",
    [
        "",
        "my_msgs",
        "ws/src/group/my_msgs",
        "install/share/my_msgs",
        "install/my_msgs/share/my_msgs",
    ],
)
def test_folders_of_every_layout(write: Write, library: Library, layout: str) -> None:
    """A package itself, a tree of packages, an install space, an isolated install space."""
    root = write({f"base/{layout or 'my_msgs'}/msg/A.msg": "int32 x"})
    added = root / "base" / ("my_msgs" if not layout else layout.split("/", maxsplit=1)[0])
    library.add_path(added)
    for ros in (1, 2):  # without a package.xml it serves both
        assert first_field(library, "my_msgs/A", ros) == "x"


def test_folders_respect_what_packages_say(write: Write, library: Library) -> None:
    root = write(
        {
            "one/package.xml": package_xml("one_msgs", "catkin"),
            "one/msg/A.msg": "Header h",
            "two/package.xml": package_xml("two_msgs", "rosidl_default_generators"),
            "two/msg/A.msg": "int32 x 5",
            "both/package.xml": package_xml("both_msgs", "catkin") + "<d>ament_cmake</d>",
            "both/msg/A.msg": "int32 x",
        }
    )
    library.add_path(root)
    assert "one_msgs/msg/A" in library.names(1)
    assert "one_msgs/msg/A" not in library.names(2)
    assert "two_msgs/msg/A" in library.names(2)
    assert "two_msgs/msg/A" not in library.names(1)
    assert "both_msgs/msg/A" in set(library.names(1)) & set(library.names(2))


def test_workspace_that_overlays_a_standard_package(
    write: Write, monkeypatch: pytest.MonkeyPatch
) -> None:
    root = write(
        {
            "share/std_msgs/msg/String.msg": "string data\nint32 extra",
            "share/std_msgs/msg/Bool.msg": "# our own words\nbool data",
        }
    )
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(root))
    library = Library()
    assert library.source("std_msgs/Bool").provider == f"workspace {root}"
    with pytest.raises(Exception, match="two sources define std_msgs/msg/String") as caught:
        library.definition("std_msgs/String")
    assert f"{root}/share/std_msgs/msg/String.msg" in str(caught.value)
    assert "distribution rosbags jazzy" in str(caught.value)
    assert first_field(Library(prefer="workspace"), "std_msgs/String", 2) == "data"


def test_errors_in_files_name_the_file(write: Write, library: Library) -> None:
    root = write({"my_msgs/msg/A.msg": "int32 x\nint32 X"})
    library.add_path(root)
    with pytest.raises(DefinitionError) as caught:
        library.definition("my_msgs/A")
    assert str(caught.value).startswith(f"{root}/my_msgs/msg/A.msg:2:7: ")


def test_file_that_is_too_big(write: Write, library: Library) -> None:
    root = write({"my_msgs/msg/A.msg": "#" * (4 * 1024 * 1024 + 1)})
    library.add_path(root)
    with pytest.raises(DefinitionError, match="which is the limit"):
        library.definition("my_msgs/A")


def test_comments_that_are_not_utf8(tmp_path: Path, library: Library) -> None:
    folder = tmp_path / "my_msgs/msg"
    folder.mkdir(parents=True)
    (folder / "A.msg").write_bytes(b"int32 x # gr\xfc\xdfe\r\nstring X=\xfc\r\n")
    library.add_path(tmp_path)
    assert first_field(library, "my_msgs/A", 1) == "x"


def test_byte_order_mark(tmp_path: Path, library: Library) -> None:
    folder = tmp_path / "my_msgs/msg"
    folder.mkdir(parents=True)
    (folder / "A.msg").write_text("int32 x", encoding="utf-8-sig")
    library.add_path(tmp_path)
    assert first_field(library, "my_msgs/A", 1) == "x"


def test_folder_that_is_missing(library: Library, tmp_path: Path) -> None:
    with pytest.raises(TypeNotFoundError, match="is not a folder"):
        library.add_path(tmp_path / "nothing")


def test_links_in_a_circle(write: Write, library: Library) -> None:
    root = write({"ws/my_msgs/msg/A.msg": "int32 x"})
    (root / "ws/loop").symlink_to(root / "ws", target_is_directory=True)
    (root / "linked").symlink_to(root / "ws", target_is_directory=True)
    library.add_path(root)
    assert first_field(library, "my_msgs/A", 1) == "x"


def test_too_many_folders(
    write: Write,
    library: Library,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
) -> None:
    monkeypatch.setattr(provider, "_MAX_FOLDERS", 5)
    root = write({f"d{n}/x": "" for n in range(9)})
    library.add_path(root)
    with caplog.at_level(logging.WARNING), pytest.raises(TypeNotFoundError):
        library.definition("my_msgs/A")
    assert "stopped looking for packages" in caplog.text


def test_added_folder_counts_like_the_original(write: Write, library: Library) -> None:
    library.add_path(write({"std_msgs/msg/String.msg": "string data"}))
    assert md5(library.definition("std_msgs/String", 1)) == "992ce8a1687cec8c8bd883ec73ca41d1"
