"""Every control has a page with its properties, and an example that runs."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

import rosglass.controls
from rosglass.controls.modules import TYPES

ROOT = Path(__file__).parents[3]
PAGES = {file.stem: file.read_text(encoding="utf-8") for file in ROOT.glob("docs/controls/*.md")}
MODULE = Path(rosglass.controls.__file__).parent / "imports/RosControls"
#: QML types and their files.
FILES = dict(
    re.findall(r"^(?:singleton )?(\w+) 1\.0 (\w+\.qml)$", (MODULE / "qmldir").read_text(), re.M)
)
#: Parts of controls, of which the page of Theme has the names only.
PARTS = {name for name in FILES if name.startswith("Theme") and name != "Theme"} | {
    "FocusRing",
    "PathDrop",
}
#: Parts of one control, whose page names them.
MAP_PARTS = {name for name in {*FILES, *TYPES} if name.startswith("Map") and name != "MapView"}
MAP_PARTS |= {"GeoScene"}
EXAMPLES = sorted(ROOT.glob("examples/controls/*.qml"))
_OWN = re.compile(
    r"^    (?:default |readonly )?(?:property (?:alias )?(?:[\w<>.]+ )?|signal |function )(\w+)",
    re.M,
)


def members(name: str) -> list[str]:
    """Return the properties, signals and functions of a type that users see."""
    if name in FILES:
        text = (MODULE / FILES[name]).read_text(encoding="utf-8")
        hidden = {"content", "body"}
        return [one for one in _OWN.findall(text) if not one.endswith("_") and one not in hidden]
    meta: Any = TYPES[name].staticMetaObject
    return [meta.property(at).name() for at in range(meta.propertyOffset(), meta.propertyCount())]


def test_qmldir_lists_the_files() -> None:
    assert sorted(FILES.values()) == sorted(file.name for file in MODULE.glob("*.qml"))


def test_no_file_beside_an_interface_has_the_name_of_a_control() -> None:
    """The module's type would be used instead: the demo's Lamp once was a gauge without a path."""
    files = [*ROOT.glob("examples/**/*.qml"), *ROOT.glob("src/rosglass/demo/**/*.qml")]
    assert [str(file) for file in files if file.stem in {*FILES, *TYPES}] == []


def test_every_control_has_a_page() -> None:
    assert {*FILES, *TYPES} - PARTS - MAP_PARTS - PAGES.keys() == set()


@pytest.mark.parametrize("name", sorted(PARTS))
def test_parts_are_named_on_the_page_of_the_theme(name: str) -> None:
    assert f"`{name}`" in PAGES["Theme"]


@pytest.mark.parametrize("name", sorted(MAP_PARTS))
def test_parts_are_named_on_the_page_of_the_map(name: str) -> None:
    assert f"`{name}`" in PAGES["MapView"]


@pytest.mark.parametrize("name", sorted({*FILES, *TYPES} - PARTS - MAP_PARTS))
def test_page_describes_the_members(name: str) -> None:
    described = set(re.findall(r"\w+", " ".join(re.findall(r"`([^`\n]+)`", PAGES[name]))))
    assert [one for one in members(name) if one not in described] == []


@pytest.mark.both_qt
@pytest.mark.parametrize("file", sorted(MODULE.glob("*.qml")), ids=lambda file: file.stem)
def test_imports_have_versions(file: Path) -> None:
    imports = re.findall(r"^import (?!\")(.*)$", file.read_text(encoding="utf-8"), re.M)
    assert [one for one in imports if not re.search(r" \d+\.\d+( as \w+)?$", one)] == []


@pytest.mark.parametrize("file", sorted(MODULE.glob("*.qml")), ids=lambda file: file.stem)
def test_values_are_filled_into_a_text_at_once(file: Path) -> None:
    """In a chain of arg(), a robot's text "%2" would be replaced by the next value."""
    text, before = file.read_text(encoding="utf-8"), ""
    while text != before:
        assert not re.search(r"\.arg<>\s*\.arg<>", text), "use Fields.fill()"
        text, before = re.sub(r"\([^()]*\)", "<>", text), text


@pytest.mark.parametrize("file", sorted(MODULE.glob("*.qml")), ids=lambda file: file.stem)
def test_controls_have_no_colours_of_their_own(file: Path) -> None:
    if file.stem != "Theme":
        assert re.findall(r"\"#[0-9a-fA-F]{3,8}\"", file.read_text(encoding="utf-8")) == []


@pytest.mark.both_qt
@pytest.mark.parametrize("file", EXAMPLES, ids=lambda file: file.stem)
def test_example_runs_without_a_robot(start: Any, file: Path, tmp_path: Path) -> None:
    shot = tmp_path / "shot.png"
    program = start(
        "run", file, "--url", "local://no_robot", "--screenshot", shot, "--after", "0.5"
    )
    assert program.end(60) == 0, program.text
    assert shot.stat().st_size > 0
    wrong = [line for line in program.lines if re.search(r"WARNING|ERROR|Error|TypeError", line)]
    assert wrong == []
