"""The README agrees with the library."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

import rosglass

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def test_interface_shown_is_the_example() -> None:
    shown = re.search(r"```qml\n(.*?)```", README, re.DOTALL)
    example = (ROOT / "examples/operator_screen.qml").read_text(encoding="utf-8")
    assert shown is not None
    assert shown[1] == example
    assert len(example.splitlines()) <= 42


@pytest.mark.parametrize("link", re.findall(r"\]\((?!http)([^)#]+)\)", README))
def test_links_lead_somewhere(link: str) -> None:
    assert (ROOT / link).exists()


def test_make_targets_exist() -> None:
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    shown = set(re.findall(r"`?make ([a-z]+)\b[` ]", README))
    assert {"demo", "test"} <= shown
    assert all(re.search(rf"^{target}:", makefile, re.MULTILINE) for target in shown)


PEERS = (ROOT / "docs/peers.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("named", sorted(set(re.findall(r"`(test_\w+\.py(?:::\w+)?)`", PEERS))))
def test_every_test_that_the_table_of_peers_names_exists(named: str) -> None:
    file, _, test = named.partition("::")
    text = (ROOT / "tests/interop/ros2" / file).read_text(encoding="utf-8")
    assert (f"def {test}(" if test else "def test_") in text


def test_every_cell_of_the_table_of_peers_names_a_test_or_a_reason() -> None:
    # Other tables have figures.
    tables = [block for block in PEERS.split("\n\n") if block.startswith("| | ")]
    lines = "\n".join(tables).splitlines()
    rows = [line for line in lines if line.startswith("| ") and "---" not in line]
    assert len(rows) > 20
    cells = [cell.strip() for row in rows for cell in row.strip("| ").split(" | ")[1:]]
    named = ("test_", "the same", "both", "- none: ", "its writers", "ours to it only")
    headings = [cell for row in rows if row.startswith("| | ") for cell in row.split(" | ")]
    for cell in cells:
        assert any(word in cell for word in named) or cell in " ".join(headings), cell


def test_every_name_of_rosglass_in_the_documentation_is_there_after_importing_it() -> None:
    pages = "".join(page.read_text(encoding="utf-8") for page in (ROOT / "docs").rglob("*.md"))
    named = set(re.findall(r"(?<!-m )\brosglass\.([A-Za-z]\w*)\b", pages + README))
    errors = {f"rosglass.{name}" for name in rosglass.errors.__all__}
    program = "import rosglass\n" + "\n".join(sorted(errors | {f"rosglass.{n}" for n in named}))
    qt = "pyside6" if find_spec("PySide6") else "pyside2"
    environment = os.environ | {"ROSGLASS_QT": qt}
    subprocess.run([sys.executable, "-c", program], check=True, env=environment)
    assert set(rosglass.errors.__all__) <= set(rosglass.__all__)


def test_every_file_that_the_architecture_names_exists() -> None:
    page = (ROOT / "docs/architecture.md").read_text(encoding="utf-8").partition("\n## 8. ")[0]
    named = set(re.findall(r"`([\w/]+\.(?:py|js|qml))`", page))
    files = {f"/{file.relative_to(ROOT).as_posix()}" for file in ROOT.glob("[bst]*/**/*.*")}
    assert [name for name in sorted(named) if not any(f.endswith(f"/{name}") for f in files)] == []
