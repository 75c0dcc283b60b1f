"""Finds words and sentences that CONTRIBUTING.md replaces, and prints what to write instead.

    .venv/bin/python scripts/words.py [PATH ...]

Searches the given files and folders, or all that the gate checks, for the words of the glossary and
for the patterns below. Prints a line for each find, ``file:line: 'word': write ...``, and their
counts by folder; exits with 1 if there are any.
"""

from __future__ import annotations

import argparse
import io
import re
import sys
import tokenize
from collections import Counter, defaultdict
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

ROOT = Path(__file__).resolve().parents[1]
SEARCHED = (
    *("README.md", "CONTRIBUTING.md", "CHANGELOG.md", "src", "docs", "examples"),
    *("tests", "benchmarks", "scripts"),
)
SUFFIXES = {".md", ".py", ".qml", ".js", ".toml", ".c"}

#: Parts of a file: comments and docstrings, other strings, the first lines of docstrings and of
#: ``#:`` comments, names of tests, and the whole line.
PROSE, STRING, OPENING, DOC_COMMENT = "prose", "string", "opening", "doc comment"
TEST_NAME, LINE = "test name", "line"


class Pattern(NamedTuple):
    """A pattern of words that native speakers do not write.

    Attributes:
        name: The name in the table of counts.
        expression: Matches it.
        parts: The parts of a file where it is searched.
        write: The replacement.
    """

    name: str
    expression: re.Pattern[str]
    parts: frozenset[str]
    write: str


def _pattern(name: str, expression: str, parts: Iterable[str], write: str) -> Pattern:
    return Pattern(name, re.compile(expression), frozenset(parts), write)


_TEXT = (PROSE, STRING)
_COMPARED = (
    "longer|more|less|later|earlier|sooner|faster|slower|better|worse|larger|smaller|different"
)
PATTERNS = (
    _pattern(
        "is none",
        r"\b(?<![Tt]here )(?:is|are|was|were|be) none\b(?! of\b)",
        _TEXT,
        "is missing, is invalid, is not an X",
    ),
    _pattern(
        "is no X",
        rf"\b(?<![Tt]here )(?:is|are|was|were|be) no (?!(?:{_COMPARED})\b)\w+",
        _TEXT,
        "is not an X, is missing, is invalid",
    ),
    _pattern(
        "opening",
        r"^(?:What|Whether|Of|Where|Who|Whose)\b(?!.*\?)",
        (OPENING,),
        'the noun: "The settings of a display."',
    ),
    _pattern(
        "#: opening",
        r"^(?:What|Of|Where|Who|Whose)\b",
        (DOC_COMMENT,),
        'the noun: "The settings of a display."',
    ),
    _pattern("those that", r"\bof those (?:that|which|who)\b", _TEXT, "their name"),
    _pattern("who has", r"\b(?<!one )(?<!anyone )who has\b", _TEXT, "the noun"),
    _pattern(
        "picture",
        r"(?<![\w/.`-])[Pp]ictures?\b(?![/.(:=_`-]\w|\w|\()",
        (PROSE, STRING),
        "image (a file, a message), frame (a rendering)",
    ),
    _pattern(
        "tell",
        r"(?<![A-Za-z.])[Tt](?:ell|ells|elling)(?![a-z(])(?! (?:\w+ )?apart)",
        (LINE,),
        "notify, report, say, show",
    ),
    _pattern("from afar", r"\b(?:gone wild|goes wild|from afar)\b", _TEXT, "flooding; remote"),
    _pattern(
        "test name",
        r"^test_(?:what|whether|who|whose|where|of)_|_who_|_gone_wild|_from_afar|"
        rf"(?<!there)_(?:is|are|was|be)_(?:none(?:_|$)|no_(?!{_COMPARED}))",
        (TEST_NAME,),
        "<subject>_<verb>: test_malformed_urdf_is_rejected",
    ),
)


def glossary(contributing: str) -> dict[str, str]:
    """Return the replacement by word: the rows of the glossary's first table."""
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


def files(names: Iterable[str]) -> Iterator[Path]:
    """Iterate over the files with text in the given files and folders of the checkout."""
    for name in names:
        found = [ROOT / name] if (ROOT / name).is_file() else sorted((ROOT / name).rglob("*"))
        for file in found:
            if file.suffix in SUFFIXES and file != Path(__file__).resolve():
                yield file


class Glossary:
    """The words of CONTRIBUTING.md's glossary."""

    def __init__(self) -> None:
        self._instead = glossary((ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8"))
        words = "|".join(sorted(self._instead, key=len, reverse=True))
        # Parts of names count: `_told`, `on_told`, `Farewells`.
        self._pattern = re.compile(rf"(?<![A-Za-z])({words})(?:s?)(?![a-z])", re.IGNORECASE)

    def finds(self, line: str) -> Iterator[tuple[str, str]]:
        """Iterate over the words in a line, with their replacement."""
        for found in self._pattern.finditer(line):
            yield (
                found[0],
                next(v for k, v in self._instead.items() if k.lower() == found[1].lower()),
            )


# -- the patterns ----------------------------------------------------------------------------


def parts(file: Path) -> Iterator[tuple[int, str, str]]:
    """Iterate over line number, part and text of a file's texts."""
    yield from ((number, LINE, line) for number, line in lines(file))
    if file.suffix == ".py":
        yield from _python_parts(file.read_text(encoding="utf-8"))
    elif file.suffix == ".md":
        yield from _markdown_parts(file)
    else:
        for number, line in lines(file):
            comment = re.search(r"(?:^|\s)(?://|#|/?\*)\s(.*)", line)
            if comment:
                yield number, PROSE, comment[1]
            code = line[: comment.start()] if comment else line
            for text in re.findall(r'"([^"]* [^"]*)"', code):
                yield number, STRING, text


def _markdown_parts(file: Path) -> Iterator[tuple[int, str, str]]:
    code = False
    for number, line in lines(file):
        if line.lstrip().startswith("```"):
            code = not code
        elif not code:
            yield number, PROSE, re.sub(r"`[^`]*`", "`x`", line)


def _python_parts(source: str) -> Iterator[tuple[int, str, str]]:
    after_doc_comment = -1  # the line of the last ``#:`` comment
    before = ""  # the last word or sign; empty at the beginning of a block, where docstrings are
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        row, kind = token.start[0], tokenize.tok_name[token.type]
        if kind == "COMMENT":
            text = token.string.lstrip("#: ")
            if token.string.startswith("#:"):
                if after_doc_comment != row - 1:
                    yield row, DOC_COMMENT, text
                after_doc_comment = row
            yield row, PROSE, text
        elif kind in {"STRING", "FSTRING_MIDDLE"}:
            part = STRING if before else PROSE
            if not before:
                yield row, OPENING, token.string.strip("rR\"' \n").partition("\n")[0].rstrip('"')
            for offset, line in enumerate(token.string.splitlines()):
                if " " in line.strip():
                    yield row + offset, part, line
        elif kind == "NAME" and before in {"def", "class"} and token.string.startswith("test_"):
            yield row, TEST_NAME, token.string
        if kind == "INDENT":
            before = ""
        elif kind not in {"COMMENT", "NL", "NEWLINE", "DEDENT"}:
            before = token.string


def _folder(file: Path) -> str:
    """Return the folder that a file is counted for: of a package, of a group of tests."""
    path = file.relative_to(ROOT).parts
    return "/".join(path[: 3 if path[0] in {"src", "tests"} else 1][: max(1, len(path) - 1)])


def search(names: Iterable[str]) -> int:
    """Print the finds in the given files and folders, and the counts of each folder.

    Returns:
        The number of finds.
    """
    words = Glossary()
    counts: defaultdict[str, Counter[str]] = defaultdict(Counter)
    for file in files(names):
        path = file.relative_to(ROOT)
        is_test = path.parts[0] == "tests"
        found = []
        for number, part, text in parts(file):
            if part == LINE:
                found += [(number, "glossary", *one) for one in words.finds(text)]
            for pattern in PATTERNS:
                # Strings of tests are also QML with pictures in it, and names of files.
                if part not in pattern.parts or (
                    pattern.name == "picture" and part == STRING and is_test
                ):
                    continue
                for match in pattern.expression.finditer(text):
                    found.append((number, pattern.name, match[0], pattern.write))
        for number, name, text, write in sorted(found):
            counts[_folder(file)][name] += 1
            print(f"{path}:{number}: {text!r}: write {write}")
    total = sum(counts.values(), Counter())
    if total:
        columns = ["glossary", *(pattern.name for pattern in PATTERNS)]
        width = max([len("all"), *map(len, counts)])
        print(f"\n{'':{width}}", *columns, "all", sep="  ")
        for folder, count in [*sorted(counts.items()), ("all", total)]:
            cells = [f"{count[name]:{len(name)}}" for name in columns]
            print(f"{folder:{width}}", *cells, f"{count.total():3}", sep="  ")
    return total.total()


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("paths", nargs="*", type=Path, metavar="PATH", help="files and folders")
    given = [path.resolve() for path in parser.parse_args().paths]
    for path in given:
        if not path.exists() or not path.is_relative_to(ROOT):
            parser.error(f"{path} is not a file or folder of {ROOT}")
    return 1 if search([str(path.relative_to(ROOT)) for path in given] or SEARCHED) else 0


if __name__ == "__main__":
    sys.exit(main())
