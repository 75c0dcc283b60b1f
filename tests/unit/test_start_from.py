"""``rosglass examples`` and ``rosglass new``: files to start from."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from rosglass.cli import main
from rosglass.cli.examples import find_examples

ROOT = Path(__file__).parents[2]


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty current folder."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_examples_are_listed_with_a_line_each(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["examples"]) == 0
    lines = capsys.readouterr().out.splitlines()
    found = dict(re.split(r" {2,}", line, maxsplit=1) for line in lines if "  " in line)
    for file in (ROOT / "examples").rglob("*.qml"):
        name = file.relative_to(ROOT / "examples").with_suffix("").as_posix()
        folder = name.partition("/")[0]
        assert name in found or folder in found, name
    assert found["subscription"] == "The messages of a topic, and whether they are live."
    assert found["controls/battery"].startswith("How much is left in a battery")
    assert all(len(line) > 5 for line in found.values())


@pytest.mark.parametrize("name", ["replay", "replay.qml", "examples/replay.qml"])
def test_an_example_is_copied_with_what_it_needs(
    name: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["examples", name]) == 0
    assert {file.name for file in folder.iterdir()} == {"replay.qml", "drive.mcap"}
    assert "rosglass run replay.qml --watch" in capsys.readouterr().out


def test_programs_come_with_their_partners(folder: Path) -> None:
    assert main(["examples", "action_client.py"]) == 0
    assert {file.name for file in folder.iterdir()} == {"action_client.py", "action_server.py"}


def test_examples_of_controls_have_short_names(folder: Path) -> None:
    assert main(["examples", "battery", "controls/tf_tree"]) == 0
    assert {file.name for file in folder.iterdir()} == {"battery.qml", "tf_tree.qml"}


@pytest.mark.parametrize("name", ["cockpit", "paper", "ros1", "rviz", "view"])
def test_folders_are_copied_as_a_whole(name: str, folder: Path) -> None:
    assert main(["examples", name]) == 0
    assert list((folder / name).glob("*.qml"))
    example = next(one for one in find_examples() if one.name == name)
    for file in re.findall(rf"{name}/[\w.]+", example.command):
        assert (folder / file).is_file(), file


def test_nothing_is_overwritten(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "drive.mcap").write_text("mine")
    assert main(["examples", "replay"]) == 1
    assert "drive.mcap exists already, and nothing was copied" in capsys.readouterr().err
    assert {file.name: file.read_text() for file in folder.iterdir()} == {"drive.mcap": "mine"}


def test_an_unknown_example_is_named(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["examples", "repaly"]) == 1
    error = capsys.readouterr().err
    assert "there is no example repaly; did you mean replay?" in error
    assert "rosglass examples lists all" in error


def test_all_examples_and_names_exclude_each_other(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["examples", "replay", "--all", "mine"]) == 1
    assert "leave out the names" in capsys.readouterr().err


@pytest.mark.parametrize("template", ["cockpit", "teleop", "fleet", "kiosk"])
def test_new_writes_a_template(
    template: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["new", "mine.qml", "--template", template]) == 0
    text = (folder / "mine.qml").read_text()
    assert "import RosControls 1.0" in text
    assert "rosglass run mine.qml --watch" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("file", "reason"),
    [
        ("there.qml", "exists already, and is left as it is"),
        ("mine.txt", "ends in .qml"),
        ("mine", "ends in .qml"),
        ("no/such/mine.qml", "there is no folder no/such"),
    ],
)
def test_new_refuses(
    file: str, reason: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (folder / "there.qml").write_text("mine")
    assert main(["new", file]) == 1
    assert reason in capsys.readouterr().err
    assert {one.name: one.read_text() for one in folder.iterdir()} == {"there.qml": "mine"}


def test_new_names_the_templates(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="2"):
        main(["new", "mine.qml", "--template", "tank"])
    assert "cockpit" in capsys.readouterr().err


def test_names_are_completed() -> None:
    from argparse import Namespace

    from rosglass.cli.completion import complete_names

    found = complete_names("examples", prefix="controls/b", parsed_args=Namespace())
    assert "controls/battery" in found
