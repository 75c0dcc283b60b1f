"""The command that installs an extra names where rosglass came from: PyPI does not have it."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from rosglass.extras import explain_missing, install_command

if TYPE_CHECKING:
    from collections.abc import Iterator

ROOT = Path(__file__).parents[2]
WHEEL = "file:///tmp/rosglass-0.1.0-py3-none-any.whl"
GIT = "https://example.org/rosglass.git"


class Installed:
    """Stands for importlib.metadata's Distribution."""

    record: str | None = None

    def read_text(self, name: str) -> str | None:
        assert name == "direct_url.json"
        return self.record


@pytest.fixture
def installed(monkeypatch: pytest.MonkeyPatch) -> Iterator[Installed]:
    installed = Installed()
    monkeypatch.setattr("importlib.metadata.distribution", lambda name: installed)
    return installed


@pytest.mark.parametrize(
    ("record", "requirement"),
    [
        ({"dir_info": {"editable": True}, "url": "file:///home/a%20b/rg"}, "/home/a b/rg[zenoh]"),
        ({"dir_info": {}, "url": "file:///src/rosglass"}, "/src/rosglass[zenoh]"),
        ({"archive_info": {}, "url": WHEEL}, f"rosglass[zenoh] @ {WHEEL}"),
        ({"vcs_info": {"vcs": "git"}, "url": GIT}, f"rosglass[zenoh] @ git+{GIT}"),
        (None, f"{ROOT}[zenoh]"),
        ("broken {", f"{ROOT}[zenoh]"),
        ([], f"{ROOT}[zenoh]"),
    ],
)
def test_command_names_the_origin(installed: Installed, record: Any, requirement: str) -> None:
    if record is not None:
        installed.record = record if isinstance(record, str) else json.dumps(record)
    assert install_command("zenoh") == f'pip install "{requirement}"'


def test_command_of_this_installation_names_a_folder_that_pip_can_build() -> None:
    command = re.fullmatch(r'pip install "(.*)\[completion\]"', install_command("completion"))
    assert command is not None
    assert (Path(command[1]) / "pyproject.toml").is_file()


def test_unknown_module_has_no_extra() -> None:
    assert explain_missing(ModuleNotFoundError("x", name="left_pad")) == ""
    assert install_command("zenoh") in explain_missing(ModuleNotFoundError("x", name="zenoh"))


@pytest.mark.parametrize(
    "page", [ROOT / "README.md", *sorted(ROOT.glob("docs/**/*.md"))], ids=lambda p: p.name
)
def test_no_page_installs_a_name_that_pypi_lacks(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    assert re.findall(r"pip install [^`\n]*\brosglass\[[^]]*\](?! @ )", text) == []
    assert re.findall(r"pip install (?:-\S+ )*\"?rosglass\b(?![-[])", text) == []
