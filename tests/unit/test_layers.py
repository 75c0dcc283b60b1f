"""Imports point downwards only, and the map in docs/architecture.md shows the folders there are."""

from __future__ import annotations

import ast
import importlib.util
import re
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

import rosglass

if TYPE_CHECKING:
    from collections.abc import Sequence

ROOT = Path(rosglass.__file__).parent
RANK = {
    "errors": 0,
    "interrupts": 0,
    "extras": 0,
    "interfaces": 1,
    "messages": 2,
    "comm": 3,
    "wires/tcpros": 4,
    "ros1": 5,
    "ros2": 5,
    "wires": 6,
    "connection": 8,
    "bags": 7,
    "bridge": 6,
    "tf": 6,
    "images": 6,
    "qt": 6,
    "qml": 9,
    "controls": 10,
    "overlay": 11,
    # RViz's view and rosglass's own: neither knows the other.
    "rviz": 12,
    "scene": 12,
    "cockpit": 13,
    "cli": 15,
    "demo": 14,
}
#: The folders of a large package, from the lowest; each imports itself and those before it.
ROOMS = {
    "qml": ["engine", "elements", "run"],
    "controls": ["topics", "lists", "steering", "maps", "plots"],
}
QT = {"PySide6", "PySide2", "PyQt5", "PyQt6", "shiboken6", "shiboken2"}
MODULES = sorted(ROOT.rglob("*.py"))


def imports(path: Path) -> set[str]:
    names = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}:{node.lineno}: relative import"
            names.add(node.module or "")
            if node.module == "rosglass":
                names |= {f"rosglass.{alias.name}" for alias in node.names}
    return names


def room_of(parts: Sequence[str]) -> str:
    # ROS 1's protocols stand above their wire, which all of them know.
    return "wires/tcpros" if tuple(parts[:2]) == ("wires", "tcpros") else parts[0]


@pytest.mark.parametrize("path", MODULES, ids=lambda p: p.relative_to(ROOT).as_posix())
def test_imports_point_downwards(path: Path) -> None:
    room = room_of(path.relative_to(ROOT).with_suffix("").parts)
    if room in {"__init__", "__main__"}:
        return
    assert room in RANK, f"{room} is not in RANK, nor on the map in docs/architecture.md"
    for name in imports(path):
        parts = name.split(".")
        if parts[0] in QT:
            assert room in {"qt", "rviz"} or RANK[room] >= RANK["qml"], f"{path} imports {name}"
        if parts[0] != "rosglass" or len(parts) == 1 or parts[1] not in RANK:
            continue
        other = room_of(parts[1:])
        assert other == room or RANK[other] < RANK[room], f"{path} imports {name}"


@pytest.mark.parametrize("package", ROOMS)
def test_imports_between_rooms_point_one_way(package: str) -> None:
    rooms = ROOMS[package]
    folders = {file.parent.name for file in (ROOT / package).glob("*/__init__.py")}
    assert folders == set(rooms)
    for path in (ROOT / package).glob("*/**/*.py"):
        own = path.relative_to(ROOT / package).parts[0]
        for name in imports(path):
            parts = name.split(".")
            if parts[:2] != ["rosglass", package]:
                continue
            room = parts[2] if len(parts) > 2 else ""
            assert room in rooms, f"{path} imports {name}, which is for users"
            assert rooms.index(room) <= rooms.index(own), f"{path} imports {name}"


@pytest.mark.parametrize("package", ROOMS)
def test_package_with_rooms_has_few_modules_outside_them(package: str) -> None:
    assert len(list((ROOT / package).glob("*.py"))) <= 4


@pytest.fixture(scope="module")
def milestones() -> Any:
    place = Path(__file__).parents[2] / "scripts" / "milestones.py"
    spec = importlib.util.spec_from_file_location("milestones", place)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_displays_are_derived_from_four_classes_at_most(milestones: Any) -> None:
    line = milestones.inheritance(milestones.read(ROOT / "scene"), "Display")
    assert len(line) <= 4, " <- ".join(line)


def test_modules_import_each_other_in_two_pairs_at_most(milestones: Any) -> None:
    # Imports for type checkers only and those in functions are counted, too.
    graph = milestones.import_graph(ROOT, milestones.read(ROOT))
    assert milestones.cycles(graph) == (0, 0)
    assert milestones.circles(graph) <= 2


def test_map_shows_the_folders_of_the_source_tree() -> None:
    page = Path(__file__).parents[2] / "docs" / "architecture.md"
    shown = page.read_text(encoding="utf-8").split("src/rosglass/\n")[1].split("tests/\n")[0]
    folders = {folder for folder in RANK if (ROOT / folder).is_dir()}
    folders |= {f"wires/{file.parent.name}" for file in ROOT.glob("wires/*/__init__.py")}
    drawn = re.findall(r"^  (  )?([\w.]+?)(/?)  ", shown, re.MULTILINE)
    assert {f"wires/{name}" if deep else name for deep, name, slash in drawn if slash} == folders
    packages = {file.parent.name for file in ROOT.glob("*/__init__.py")}
    assert packages == {folder for folder in folders if "/" not in folder}
    files = {f"{folder}.py" for folder in RANK if (ROOT / f"{folder}.py").is_file()}
    assert {name for _, name, slash in drawn if not slash} == files


def run(code: str) -> str:
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60
    )
    return done.stdout.strip()


def test_3d_view_loads_nothing_of_rviz() -> None:
    pytest.importorskip("PySide6")
    loaded = run(
        "import rosglass.scene, sys\n"
        "import rosglass.scene.access, rosglass.scene.app.program\n"
        "rosglass.scene.register()\n"
        "print([name for name in sys.modules if name.startswith('rosglass.rviz')])"
    )
    assert loaded == "[]"


def test_import_is_light() -> None:
    heavy = "{'numpy', 'PySide6', 'PySide2', 'zenoh', 'cv2', 'rosbags', 'yaml'}"
    assert run(f"import rosglass, sys; print(sorted({heavy} & set(sys.modules)))") == "[]"


def test_public_names_are_all_there() -> None:
    assert [name for name in rosglass.__all__ if getattr(rosglass, name, None) is None] == []
    assert dir(rosglass) == sorted(rosglass.__all__)
    with pytest.raises(AttributeError, match="no attribute 'conect'"):
        rosglass.conect  # noqa: B018


@pytest.mark.parametrize("package", ["comm", "interfaces", "ros2", "tf"])
def test_public_names_of_a_package_are_all_there(package: str) -> None:
    found = importlib.import_module(f"rosglass.{package}")
    assert [name for name in found.__all__ if getattr(found, name, None) is None] == []
    with pytest.raises(AttributeError, match="no attribute 'Nod'"):
        found.Nod  # noqa: B018


def test_names_of_nodes_are_valid_or_not_without_a_node() -> None:
    # Ros2.init() asks before the first frame, on the thread that draws.
    code = "import sys, rosglass.comm.names; print('rosglass.comm.events' in sys.modules)"
    assert run(code) == "False"


def test_packages_are_attributes() -> None:
    assert run("import rosglass; print(rosglass.comm.IMMEDIATE is not None)") == "True"


@pytest.mark.parametrize(
    ("module", "name"),
    [
        ("drawing", "Shape"),
        ("drawing", "Group"),
        ("drawing", "Points"),
        ("drawing", "check_numbers"),
        ("drawing", "instance_matrix"),
        ("meshes", "load_mesh_cached"),
        ("rviz_config", "RvizConfig"),
        ("settings", "Setting"),
        ("urdf", "parse_urdf"),
    ],
)
def test_former_modules_of_scene_have_their_public_names(module: str, name: str) -> None:
    pytest.importorskip("PySide6")
    code = f"from rosglass.scene.{module} import {name}; print({name}.__name__)"
    assert run(code) == name
