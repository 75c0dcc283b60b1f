"""The command line's outer manners; what each command does is tested where it lives."""

from __future__ import annotations

import pytest

import rosglass
from rosglass.cli import COMMANDS, _split, main


def test_version(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="0"):
        main(["--version"])
    assert capsys.readouterr().out == f"rosglass {rosglass.__version__}\n"


def test_help_lists_every_command(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="0"):
        main(["--help"])
    out = capsys.readouterr().out
    assert all(name in out and summary in out for name, (_, summary) in COMMANDS.items())


@pytest.mark.parametrize("command", COMMANDS)
def test_each_command_has_help(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="0"):
        main([command, "--help"])
    assert f"usage: rosglass {command}" in capsys.readouterr().out


@pytest.mark.parametrize("arguments", [[], ["fly"], ["robot", "--no-such-option"]])
def test_wrong_usage_exits_with_2(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="2"):
        main(arguments)
    assert "usage: rosglass" in capsys.readouterr().err


def test_missing_extra_names_the_fix(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def no_module(name: str) -> object:
        raise ModuleNotFoundError(f"No module named {name!r}", name="zenoh")

    monkeypatch.setattr("rosglass.cli.import_module", no_module)
    assert main(["router"]) == 1
    assert 'pip install "rosglass[zenoh]"' in capsys.readouterr().err


@pytest.mark.parametrize(
    ("line", "ours", "told", "rest"),
    [
        ("run a.qml", "run a.qml", "", ""),
        ("run a.qml -- -x --ros-args", "run a.qml", "", "-x --ros-args"),
        ("run a.qml --ros-args -r a:=b", "run a.qml", "--ros-args -r a:=b", ""),
        ("run --ros-args -r a:=b -- a.qml -- x", "run a.qml", "--ros-args -r a:=b --", "x"),
        ("x --ros-args -- --ros-args -p b:=1", "x", "--ros-args -- --ros-args -p b:=1", ""),
    ],
)
def test_ros_args_and_the_arguments_of_others_are_set_apart(
    line: str, ours: str, told: str, rest: str
) -> None:
    assert _split(line.split()) == (ours.split(), told.split(), rest.split())


def test_bad_ros_args_are_named(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["robot", "--url", "zenoh://127.0.0.1:9", "--ros-args", "-r", "a"]) == 1
    assert "rosglass: --ros-args, argument 3: 'a' has no ':='" in capsys.readouterr().err


def test_commands_that_are_no_nodes_take_no_ros_args(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as exit_info:
        main(["router", "--ros-args", "-r", "a:=b"])
    assert exit_info.value.code == 2
    assert "router takes no --ros-args" in capsys.readouterr().err
