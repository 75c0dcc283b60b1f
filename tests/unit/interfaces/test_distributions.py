"""The standard sets: complete, equal to rosbags', and quick to load."""

from __future__ import annotations

import subprocess
import sys
from typing import TYPE_CHECKING, Any

import pytest

from rosglass.errors import UnsupportedError
from rosglass.interfaces import (
    DISTRIBUTIONS,
    ArrayKind,
    Definition,
    Distributions,
    Library,
)

if TYPE_CHECKING:
    from rosglass.interfaces import FieldType

ALL = [(ros, name) for ros, names in DISTRIBUTIONS.items() for name in names]
PLACEHOLDER = "structure_needs_at_least_one_member"
TIME = {"builtin_interfaces/msg/Time": "time", "builtin_interfaces/msg/Duration": "duration"}
NODES = {ArrayKind.FIXED: 3, ArrayKind.BOUNDED: 4, ArrayKind.UNBOUNDED: 4}


def as_rosbags(kind: FieldType, ros: int) -> Any:
    """Return a field type in rosbags' form."""
    names = {short: full for full, short in TIME.items()} if ros == 1 else {}
    name = names.get(kind.name, kind.name)
    inner: Any = (2, name) if "/" in name else (1, (name, kind.string_bound or 0))
    if kind.array is ArrayKind.NONE:
        return inner
    return (NODES[kind.array], (inner, kind.size or 0))


@pytest.mark.parametrize(("ros", "distribution"), ALL)
def test_bundles_equal_rosbags(ros: int, distribution: str) -> None:
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores(f"ros{ros}_{distribution}")).fielddefs
    library = Library(Distributions(distribution))
    expected = {name: parts for name, parts in store.items() if ros == 2 or name not in TIME}
    for name, (constants, fields) in expected.items():
        definition = library.definition(name, ros)
        assert isinstance(definition, Definition)
        assert [(f.name, as_rosbags(f.type, ros)) for f in definition.fields] == [
            field for field in fields if field[0] != PLACEHOLDER
        ]
        assert [(c.name, c.type, c.value) for c in definition.constants] == constants


def test_every_definition_loads(standard: Library) -> None:
    for ros in (1, 2):
        names = standard.names(ros)
        assert len(names) > 200
        for name in names:
            assert standard.definition(name, ros).name == name


def test_bundles_are_what_the_script_writes(tmp_path: Any) -> None:
    import importlib.util
    from pathlib import Path

    root = Path(__file__).parents[3]
    spec = importlib.util.spec_from_file_location("bundle", root / "scripts/bundle_definitions.py")
    assert spec is not None
    assert spec.loader is not None
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    script.TARGET = tmp_path
    script.ROOT = tmp_path
    script.main()
    for ros in (1, 2):
        name = f"ros{ros}.txt"
        shipped = root / "src/rosglass/interfaces/distributions" / name
        assert (tmp_path / name).read_text() == shipped.read_text()


def test_defaults_and_units_that_rosbags_lacks(standard: Library) -> None:
    quaternion = standard.definition("geometry_msgs/Quaternion")
    assert isinstance(quaternion, Definition)
    assert [field.default for field in quaternion.fields] == [0.0, 0.0, 0.0, 1.0]
    twist = standard.definition("geometry_msgs/Twist", ros=1)
    assert isinstance(twist, Definition)
    assert [field.unit for field in twist.fields] == ["m/s", "rad/s"]
    ros1 = standard.definition("geometry_msgs/Quaternion", ros=1)
    assert isinstance(ros1, Definition)
    assert all(field.default is None for field in ros1.fields)


@pytest.mark.parametrize(
    ("name", "distribution"),
    [
        ("std_msgs/String", "jazzy"),
        ("nav_msgs/Goals", "kilted"),  # not in Jazzy
        ("rosgraph_msgs/Graph", "lyrical"),
        ("rcl_interfaces/IntraProcessMessage", "eloquent"),
    ],
)
def test_jazzy_first_then_the_others(standard: Library, name: str, distribution: str) -> None:
    assert standard.source(name).provider == f"rosbags {distribution}"


def gid_size(library: Library) -> int | None:
    definition = library.definition("rmw_dds_common/Gid")
    assert isinstance(definition, Definition)
    return definition.fields[0].type.size


def test_preferred_distribution(monkeypatch: pytest.MonkeyPatch) -> None:
    assert gid_size(Library()) == 16
    assert gid_size(Library(distribution="humble")) == 24
    monkeypatch.setenv("ROS_DISTRO", "humble")
    assert gid_size(Library()) == 24
    monkeypatch.setenv("ROS_DISTRO", "rolling")  # unknown ones are not an error
    assert gid_size(Library()) == 16
    with pytest.raises(UnsupportedError, match="no definitions of a distribution 'hydro'; known:"):
        Library(distribution="hydro")


def test_loading_needs_neither_numpy_nor_rosbags() -> None:
    program = (
        "import sys, rosglass.interfaces as i\n"
        "i.Library().definition('sensor_msgs/msg/Image')\n"
        "print([m for m in ('numpy', 'rosbags', 'yaml', 'pathlib', 'hashlib') if m in sys.modules])"
    )
    run = subprocess.run(
        [sys.executable, "-I", "-c", program], capture_output=True, text=True, check=True
    )
    assert run.stdout.strip() in ("[]", "['pathlib']")  # editable installs import pathlib
