"""Plugins of RQml in install spaces and in source trees."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from rosglass.cockpit.rqml import FoundPlugins, find_plugins

if TYPE_CHECKING:
    from pathlib import Path

PACKAGE = "robot_panels"
ONE = """plugins:
  - id: robot_panels.lamp
    name: "Lamp"
    group: "Light"
    path: "share/@PROJECT_NAME@/qml/Lamp.qml"
    single_instance: false
"""


def installed(prefix: Path, text: str, package: str = PACKAGE, names: str = "Lamp.qml") -> Path:
    share = prefix / "share" / package / "qml"
    share.mkdir(parents=True, exist_ok=True)
    for name in names.split():
        (share / name).write_text("import QtQuick\nItem {}\n")
    resources = prefix / "share/ament_index/resource_index/rqml_plugin"
    resources.mkdir(parents=True, exist_ok=True)
    (resources / package).write_text(text.replace("@PROJECT_NAME@", package))
    return resources / package


def source(tree: Path, text: str, package: str = PACKAGE, file: str = "qml/Lamp.qml") -> Path:
    (tree / file).parent.mkdir(parents=True, exist_ok=True)
    (tree / file).write_text("import QtQuick\nItem {}\n")
    (tree / "package.xml").write_text(
        f'<?xml version="1.0"?>\n<package><name>{package}</name></package>'
    )
    (tree / "rqml_plugins.yaml.in").write_text(text)
    return tree / "rqml_plugins.yaml.in"


def find(*prefixes: Path, folders: tuple[Path, ...] = ()) -> FoundPlugins:
    return find_plugins({"AMENT_PREFIX_PATH": ":".join(map(str, prefixes))}, folders)


def test_installed_plugins_are_found(tmp_path: Path) -> None:
    file = installed(tmp_path, ONE)
    found = find(tmp_path / "none", tmp_path)
    assert found.problems == ()
    (plugin,) = found.plugins
    assert plugin.id == "robot_panels.lamp"
    assert (plugin.name, plugin.group, plugin.single_instance) == ("Lamp", "Light", False)
    assert plugin.path == tmp_path / "share/robot_panels/qml/Lamp.qml"
    assert plugin.source == "package://robot_panels/qml/Lamp.qml"
    assert (plugin.package, plugin.declared) == (PACKAGE, f"{file}:2")


def test_plugins_in_a_source_tree_are_found(tmp_path: Path) -> None:
    file = source(tmp_path / "src/lamps", ONE)
    installed(tmp_path / "src/install", ONE)  # a copy in the workspace
    found = find(folders=(tmp_path / "src",))
    assert found.problems == ()
    (plugin,) = found.plugins
    assert plugin.path == tmp_path / "src/lamps/qml/Lamp.qml"
    assert plugin.source == str(plugin.path)
    assert (plugin.package, plugin.declared) == (PACKAGE, f"{file}:2")


def test_a_folder_may_be_installed_under_another_name(tmp_path: Path) -> None:
    source(tmp_path, ONE, file="panels/parts/Lamp.qml")
    found = find(folders=(tmp_path,))
    assert [plugin.path for plugin in found.plugins] == [tmp_path / "panels/parts/Lamp.qml"]


def test_sources_and_overlays_replace_a_package(tmp_path: Path) -> None:
    installed(tmp_path / "under", ONE)
    installed(tmp_path / "over", ONE.replace('"Lamp"', '"Lamp 2"'))
    found = find(tmp_path / "over", tmp_path / "under")
    assert [plugin.name for plugin in found.plugins] == ["Lamp 2"]
    source(tmp_path / "src", ONE.replace('"Lamp"', '"Lamp 3"'))
    found = find(tmp_path / "over", tmp_path / "under", folders=(tmp_path / "src",))
    assert ([plugin.name for plugin in found.plugins], found.problems) == (["Lamp 3"], ())


def test_they_are_sorted_by_group_and_name(tmp_path: Path) -> None:
    rows = [("b", "zeta", "Video"), ("c", "Alpha", "video"), ("d", "Beta", ""), ("e", "Arm", "Arm")]
    text = "plugins:\n" + "".join(
        f"  - {{id: {key}, name: {name}, group: '{group}', path: share/{PACKAGE}/qml/Lamp.qml}}\n"
        for key, name, group in rows
    )
    installed(tmp_path, text)
    assert [plugin.name for plugin in find(tmp_path).plugins] == ["Beta", "Arm", "Alpha", "zeta"]


@pytest.mark.parametrize(
    ("text", "line", "said"),
    [
        ("plugins:\n  - id: [\n", ":3:1: this is not YAML", ""),
        ("panels: []\n", ":1: expected a list under the key 'plugins'", ""),
        ("plugins: lamp\n", ":1: expected a list under the key 'plugins'", ""),
        ("", ":1: expected a list under the key 'plugins'", ""),
        ("plugins:\n  - lamp\n", ":2: expected a plugin with id, name", ""),
        ("plugins:\n  - name: Lamp\n    path: x\n", ":2: the plugin has no id", ""),
        ("plugins:\n  - {id: '', name: Lamp}\n", ":2: the plugin has no id and no path", ""),
        (ONE + "    colour: red\n", ":7: 'colour' is not a key of a plugin", "Lamp"),
        (ONE + "    nam: red\n", ":7: 'nam' is not a key of a plugin; did you mean name?", "Lamp"),
        (ONE.replace("false", "maybe"), ":2: single_instance: expected true or false", ""),
        (ONE.replace('"Light"', "[a]"), ":4: group: expected a text", ""),
        (ONE.replace("Lamp.qml", "Lump.qml"), ":2: robot_panels.lamp: there is no file ", ""),
    ],
)
def test_faults_name_file_and_line(tmp_path: Path, text: str, line: str, said: str) -> None:
    file = installed(tmp_path, text)
    found = find(tmp_path)
    assert [problem for problem in found.problems if problem.startswith(f"{file}{line}")]
    assert [plugin.name for plugin in found.plugins] == ([said] if said else [])
    source(tmp_path / "src", text)
    assert find(folders=(tmp_path / "src",)).problems[0].startswith(f"{tmp_path}/src/rqml_plugins")


def test_a_wrong_plugin_leaves_the_others(tmp_path: Path) -> None:
    installed(
        tmp_path, ONE + "  - {id: x}\n  - {id: y, name: Y, path: share/robot_panels/qml/Lamp.qml}"
    )
    found = find(tmp_path)
    assert [plugin.id for plugin in found.plugins] == ["y", "robot_panels.lamp"]
    assert len(found.problems) == 1


def test_a_duplicate_names_both_places(tmp_path: Path) -> None:
    file = installed(tmp_path, ONE)
    other = installed(tmp_path, ONE, package="spare_panels")
    found = find(tmp_path)
    assert [plugin.package for plugin in found.plugins] == [PACKAGE]
    (problem,) = found.problems
    assert problem.startswith(f"{other}:2: the id 'robot_panels.lamp' is declared at {file}:2")


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (b"\xff\xfe", ": this is not text in UTF-8"),
        (b"#" * ((1 << 20) + 1), ": larger than 1 MiB"),
        (b"a: &a [1]\nb: &b [*a, *a, *a]\n" + b"".join(
            b"%c: &%c [*%c, *%c, *%c, *%c, *%c, *%c, *%c, *%c]\n" % (99 + n, 99 + n, *[98 + n] * 8)
            for n in range(8)
        ), "this is not YAML"),
        (b"[" * 5000, "this is not YAML"),
    ],
)  # fmt: skip
def test_hostile_declarations_are_refused(tmp_path: Path, data: bytes, said: str) -> None:
    installed(tmp_path, "").write_bytes(data)
    found = find(tmp_path)
    assert found.plugins == ()
    assert said in found.problems[0]


def test_a_missing_folder_is_named(tmp_path: Path) -> None:
    found = find(folders=(tmp_path / "gone",))
    assert found.problems == (f"{tmp_path / 'gone'}: there is no such folder",)
