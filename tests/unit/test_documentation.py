"""Shell commands in the documentation: every command of rosglass and make is accepted."""

from __future__ import annotations

import re
import shlex
import sys
from pathlib import Path

import pytest

from rosglass.cli.program import parse

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted(ROOT.glob("docs/**/*.md"))]
BLOCK = re.compile(r"^```(?:sh|console)\n(.*?)^```", re.MULTILINE | re.DOTALL)


def commands(program: str) -> list[tuple[str, list[str]]]:
    """Return the documented calls of a program: page and line, arguments."""
    found = []
    for page in PAGES:
        text = page.read_text(encoding="utf-8")
        for block in BLOCK.finditer(text):
            first = text.count("\n", 0, block.start(1)) + 1
            is_console = block[0].startswith("```console")
            for number, line in enumerate(block[1].replace("\\\n", "  ").splitlines(), first):
                if is_console and not line.startswith("$ "):
                    continue
                words = shlex.split(line.removeprefix("$ ").rstrip(" &"), comments=True)
                for index, word in enumerate(words):
                    if word.rpartition("/")[2] == program and "=" not in word:
                        place = f"{page.relative_to(ROOT)}:{number}"
                        found.append((place, until_operator(words[index + 1 :])))
                        break
    return found


def until_operator(words: list[str]) -> list[str]:
    ends = [n for n, word in enumerate(words) if word in {"|", "&&", ";", ">", "&"}]
    return words[: ends[0]] if ends else words


ROSGLASS = commands("rosglass")
MAKE = commands("make")


def test_there_are_examples() -> None:
    assert len(ROSGLASS) > 50
    assert len(MAKE) > 3


@pytest.mark.parametrize(
    "arguments", [a for _, a in ROSGLASS], ids=[f"{p} {' '.join(a[:2])}" for p, a in ROSGLASS]
)
def test_commands_are_accepted(
    arguments: list[str], capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(ROOT)
    with pytest.raises(SystemExit) as end:
        sys.exit(0 if parse(arguments) else 1)
    assert end.value.code == 0, capsys.readouterr().err


@pytest.mark.parametrize("arguments", [a for _, a in MAKE], ids=[p for p, _ in MAKE])
def test_make_targets_exist(arguments: list[str]) -> None:
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    targets = [word for word in arguments if "=" not in word and not word.startswith("-")]
    assert targets
    for target in targets:
        assert re.search(rf"^{re.escape(target)}:", makefile, re.MULTILINE), target


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.name)
def test_named_examples_exist(page: Path) -> None:
    named = re.findall(r"(?<![\w/])examples/[\w/]+\.\w+", page.read_text(encoding="utf-8"))
    assert [name for name in named if not (ROOT / name).is_file()] == []
