"""The command line's outer manners; what each command does is tested where it lives."""

from __future__ import annotations

import pytest

import rosglass
from rosglass.cli import COMMANDS, main


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
