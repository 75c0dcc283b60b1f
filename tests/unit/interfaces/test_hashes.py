"""md5 sums and type hashes against genmsg, rosbags, published values and other clients."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from rosglass.errors import DefinitionError, UnsupportedError
from rosglass.interfaces import (
    ActionDefinition,
    Definition,
    Library,
    ServiceDefinition,
    full_text,
    md5,
    parse_message,
    rihs01,
    type_description,
)

if TYPE_CHECKING:
    from collections.abc import Callable

HERE = Path(__file__).parent
DEBIAN_PYTHON = Path("/usr/bin/python3")
GENMSG = Path("/usr/lib/python3/dist-packages/genmsg")


def table(name: str) -> list[tuple[str, str]]:
    lines = (HERE / name).read_text().splitlines()
    pairs = [line.split() for line in lines if not line.startswith("#")]
    return [(pair[0], pair[1]) for pair in pairs]


@pytest.mark.parametrize(("name", "value"), table("official_type_hashes.txt"))
def test_published_type_hashes(standard: Library, name: str, value: str) -> None:
    assert rihs01(standard.definition(name)) == value


@pytest.mark.parametrize(("name", "value"), table("well_known_md5s.txt"))
def test_well_known_md5s(standard: Library, name: str, value: str) -> None:
    assert md5(standard.definition(name, ros=1)) == value


def test_hashes_of_an_action_that_rosidl_generated(library: Library) -> None:
    """Values from rosidl's C output (``fibonacci__description.c``) in a published install space.

    They cover every type that an action implies, so they prove the whole derivation.
    """
    name = "rob599_msgs/action/Fibonacci"
    library.add_text(name, "int64 number\n---\nint64[] sequence\n---\nint64 progress\n")
    expected = {
        "": "00bf40d6e8121f2f6fa89a9f8b78e28efc8c958cfc656f9cd7f51f223224e2a3",
        "_Goal": "834005bd2bbbb0ec2dbe2754ce54e9d8c4788812c743ba04dd1eadb29694b74d",
        "_Result": "cf622af2777e926c87a6cca9464ba4066f5a50d2683f6094c8913ae921623b51",
        "_Feedback": "c1b73edc4ddf4f9a6b24fefda63f307fa081a30ba3b6703ddc7bab28b66cdda6",
        "_SendGoal": "3d7412ff91ff9c5abfbf9f7f5dc2171a3f32cf6da2414b2c2c82f034d176fa01",
        "_SendGoal_Request": "f2b9a1cdae16d572911129a7206462218eb7ef274473133a5d92a8c10633ba62",
        "_SendGoal_Response": "d8af5e3d666fb61ed4635ec25692dd96e9343b1b51c4ed9843011b03adf8fccf",
        "_SendGoal_Event": "a92b9dccb195b51dfb8030965f60d36d1479667be6704c55936d5a5122d40308",
        "_GetResult": "8ebe968757e1b88d729ad53e9aca6d14e4b2f113272786f55541cfb26acc91fc",
        "_GetResult_Request": "c52bf1a28eeaf18da1fb98ee28d46abd2a42feeb28879fe66433734b73d91662",
        "_GetResult_Response": "256035c9d33604dd898e5a50a931ecfdda4f073be7710d881beabd8bfa104e78",
        "_GetResult_Event": "0404d58e6597bbe6dbaef508f0affd941624d8c93dcf59b5dce578ea9a6d0e2b",
        "_FeedbackMessage": "a941cc541674f910f08c54c0d6a8a5a63be0ee7697a74928f342b2583dcfa88a",
    }
    assert {
        suffix: rihs01(library.definition(f"{name}{suffix}")).removeprefix("RIHS01_")
        for suffix in expected
    } == expected


# rosbags gives char the id of IDL's char, but rosidl turns a .msg file's char into uint8 first:
# real nodes announce ours (std_msgs/Char and ServiceEventInfo are in official_type_hashes.txt).
ROSBAGS_CHAR = {
    "std_msgs/msg/Char",
    "service_msgs/msg/ServiceEventInfo",
    "rmw_dds_common/msg/Gid",
    "rmw_dds_common/msg/NodeEntitiesInfo",
    "rmw_dds_common/msg/ParticipantEntitiesInfo",
}


@pytest.mark.parametrize("distribution", ["iron", "jazzy", "kilted", "lyrical"])
def test_type_hashes_of_rosbags(distribution: str) -> None:
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores(f"ros2_{distribution}"))
    library = Library(distribution=distribution)
    different = {
        name
        for name in store.fielddefs
        if rihs01(library.definition(name)) != store.hash_rihs01(name)
    }
    assert different == ROSBAGS_CHAR & set(store.fielddefs)


def test_md5s_of_rosbags(standard: Library) -> None:
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC)
    names = [name for name in store.fielddefs if not name.startswith("builtin_interfaces/")]
    assert len(names) > 150
    assert [
        name for name in names
        if md5(standard.definition(name, ros=1)) != store.generate_msgdef(name)[1]
    ] == []  # fmt: skip


@pytest.mark.peers
@pytest.mark.parametrize(
    "name",
    ["example_interfaces/srv/AddTwoInts", "std_srvs/srv/SetBool", "nav_msgs/srv/LoadMap"],
)
def test_service_hashes_of_zenoh_ros2_sdk(standard: Library, name: str) -> None:
    from zenoh_ros2_sdk.utils import compute_service_type_hash

    service = standard.definition(name)
    assert isinstance(service, ServiceDefinition)
    parts = (service.request, service.response)
    needed = {
        nested: definition.text for part in parts for nested, definition in part.nested.items()
    }
    needed |= {
        nested: standard.definition(nested).text
        for nested in ("service_msgs/msg/ServiceEventInfo", "builtin_interfaces/msg/Time")
    }
    # It reads short names of the own package only without the package.
    assert rihs01(service) == compute_service_type_hash(
        name, service.request.text, service.response.text, needed
    )


ODD_ROS1 = {
    "Spaces.msg": "\n  int32   x   \n\nint32 y# glued\n   # c\nint32  A =  1 ## c\nbyte B=-1\r\n",
    "Strings.msg": "string A=  a # b  'c' \nstring B=\"x=y\"\nstring   C   =\nstring d\n",
    "Floats.msg": "float32 A=1.50\nfloat64 B=1e-9 # c\nbool C=True\nbool D=0\nchar E=200\n",
    "Arrays.msg": (
        "time[42] t\nduration[] d\nchar[3] c\nSpaces[2] s\nHeader[] h\nodd_msgs/Strings x\n"
    ),
    "Header.msg": "Header header\nstd_msgs/Header other\nint8 FIRST=1\nint8 last\n",
    "Empty.msg": "# nothing\n",
    "Service.srv": "# c\nint32 X=5\nSpaces s\n---\nHeader h # c\nstring A=b\n",
    "Silent.srv": "int32 x\n---\n",
    "Lonely.srv": "int32 x\n",
    "Dashes.srv": "int32 x\n----- answer\nint32 y\n",
}


@pytest.mark.genpy
@pytest.mark.skipif(
    not (DEBIAN_PYTHON.exists() and GENMSG.exists()), reason="needs Debian's python3-genmsg"
)
def test_md5s_of_genmsg(write: Callable[..., Path], standard: Library) -> None:
    """Every message and service of ROS 1 that we ship, and oddly written ones."""
    files = {f"odd_msgs/{Path(name).suffix[1:]}/{name}": text for name, text in ODD_ROS1.items()}
    for name in standard.names(ros=1):
        package, kind, base = name.split("/")
        if kind != "action":
            files[f"{package}/{kind}/{base}.{kind}"] = standard.definition(name, ros=1).text
    root = write(files)
    run = subprocess.run(
        [DEBIAN_PYTHON, HERE / "genmsg_md5.py", root], capture_output=True, text=True, check=True
    )
    expected = json.loads(run.stdout)
    assert len(expected) > 200
    library = Library()
    library.add_path(root)
    assert {name: md5(library.definition(name, ros=1)) for name in expected} == expected


def test_type_description_has_defaults_but_its_hash_ignores_them(library: Library) -> None:
    plain = parse_message("int32 x\nint8[2] y\nstring z\nbool b", "my_msgs/Odd")
    library.add_text("my_msgs/Odd", "int32 x 5\nint8[2] y [1,2]\nstring z 'a'\nbool b true")
    definition = library.definition("my_msgs/Odd")
    fields = type_description(definition)["type_description"]["fields"]
    assert [field["default_value"] for field in fields] == ["5", "(1, 2)", "a", "True"]
    assert rihs01(definition) == rihs01(plain)


def test_type_description_of_bounds(library: Library) -> None:
    library.add_text(
        "my_msgs/Odd",
        "string<=3 a\nwstring<=4[<=5] b\nstring[] c\nbyte[6] d\ngeometry_msgs/Point[<=7] e\n",
    )
    description = type_description(library.definition("my_msgs/Odd"))
    kinds = [field["type"] for field in description["type_description"]["fields"]]
    assert [tuple(kind.values()) for kind in kinds] == [
        (21, 0, 3, ""),
        (118, 5, 4, ""),
        (161, 0, 0, ""),
        (64, 6, 0, ""),
        (97, 7, 0, "geometry_msgs/msg/Point"),
    ]
    referenced = description["referenced_type_descriptions"]
    assert [part["type_name"] for part in referenced] == ["geometry_msgs/msg/Point"]


def test_empty_messages_are_described_with_their_placeholder(standard: Library) -> None:
    description = type_description(standard.definition("std_msgs/Empty"))
    assert [field["name"] for field in description["type_description"]["fields"]] == [
        "structure_needs_at_least_one_member"
    ]


@pytest.mark.parametrize(("function", "ros"), [(md5, 2), (rihs01, 1), (type_description, 1)])
def test_hashes_of_the_other_ros_version(
    standard: Library, function: Callable[[Definition], object], ros: int
) -> None:
    definition = standard.definition("std_msgs/String", ros)
    assert isinstance(definition, Definition)
    with pytest.raises(UnsupportedError, match=f"is a ROS {ros} definition"):
        function(definition)


@pytest.mark.parametrize(("function", "ros"), [(md5, 1), (rihs01, 2), (full_text, 1)])
def test_unresolved_definitions_have_no_hash(
    function: Callable[[Definition], object], ros: int
) -> None:
    definition = parse_message("other_msgs/Other x", "my_msgs/Odd", ros=ros, file="odd.msg")
    with pytest.raises(DefinitionError, match=r"odd\.msg:1:1: .*load it with Library"):
        function(definition)


def test_full_text_is_what_connection_headers_carry(standard: Library) -> None:
    definition = standard.definition("geometry_msgs/PoseStamped", ros=1)
    text = full_text(definition)
    assert text.count("=" * 80) == 4
    assert [line for line in text.splitlines() if line.startswith("MSG:")] == [
        "MSG: std_msgs/Header",
        "MSG: geometry_msgs/Pose",
        "MSG: geometry_msgs/Point",
        "MSG: geometry_msgs/Quaternion",
    ]
    alone = parse_message(text, "geometry_msgs/PoseStamped", ros=1)
    assert md5(alone) == md5(definition)


def test_full_text_of_services_and_actions(standard: Library) -> None:
    service = standard.definition("nav_msgs/srv/GetPlan", ros=1)
    action = standard.definition("move_base_msgs/action/MoveBase", ros=1)
    assert isinstance(action, ActionDefinition)
    assert "---" in full_text(service)
    assert full_text(service).count("MSG: geometry_msgs/PoseStamped") == 1
    assert "MSG: geometry_msgs/Quaternion" in full_text(action)
