"""Finds the words that CONTRIBUTING.md's glossary replaces, and prints what to write instead.

    .venv/bin/python scripts/words.py

Prints a line for each, ``file:line: 'word': write ...``, and exits with 1 if there are any.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator

ROOT = Path(__file__).resolve().parents[1]
SEARCHED = ("README.md", "CONTRIBUTING.md", "CHANGELOG.md", "src", "docs", "examples")
SUFFIXES = {".md", ".py", ".qml", ".js", ".toml", ".c"}


def glossary(contributing: str) -> dict[str, str]:
    """Return what to write by word: the rows of the glossary's first table."""
    table = contributing.partition("### Glossary")[2].partition("\nThe script does not")[0]
    rows = re.findall(r"^\| (`.+?) \| (.+) \|$", table, re.MULTILINE)
    return {word: right for left, right in rows for word in re.findall(r"`(\w+)`", left)}


def lines(file: Path) -> Iterator[tuple[int, str]]:
    """Iterate over a file's numbered lines, without the glossary itself."""
    inside = False
    for number, line in enumerate(file.read_text(encoding="utf-8").splitlines(), 1):
        if line.startswith("##"):
            inside = line == "### Glossary"
        if not inside:
            yield number, line


def files() -> Iterator[Path]:
    for name in SEARCHED:
        found = [ROOT / name] if (ROOT / name).is_file() else sorted((ROOT / name).rglob("*"))
        for file in found:
            if file.suffix in SUFFIXES:
                yield file


def main() -> int:
    instead = glossary((ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8"))
    words = "|".join(sorted(instead, key=len, reverse=True))
    # Parts of names count: `_told`, `on_told`, `Farewells`.
    pattern = re.compile(rf"(?<![A-Za-z])({words})(?:s?)(?![a-z])", re.IGNORECASE)
    count = 0
    for file in files():
        for number, line in lines(file):
            for found in pattern.finditer(line):
                count += 1
                right = next(v for k, v in instead.items() if k.lower() == found[1].lower())
                print(f"{file.relative_to(ROOT)}:{number}: {found[0]!r}: write {right}")
    return 1 if count else 0


if __name__ == "__main__":
    sys.exit(main())
