"""Finds words and sentences that CONTRIBUTING.md replaces, and prints what to write instead.

    .venv/bin/python scripts/words.py
    .venv/bin/python scripts/words.py --patterns [PATH ...]

Prints a line for each, ``file:line: 'word': write ...``. Without options it searches for the words
of the glossary and exits with 1 if there are any: part of the gate. ``--patterns`` also searches
tests, benchmarks and scripts, for the glossary and for the patterns below, in the given files and
folders or in all; it ends with the counts of each folder, and exits with 0.
"""

from __future__ import annotations

import argparse
import ast
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
SEARCHED = ("README.md", "CONTRIBUTING.md", "CHANGELOG.md", "src", "docs", "examples")
SEARCHED_FOR_PATTERNS = (*SEARCHED, "tests", "benchmarks", "scripts")
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
    documented = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            if node.name.startswith("test_"):
                yield node.lineno, TEST_NAME, node.name
        elif not isinstance(node, ast.Module):
            continue
        docstring = ast.get_docstring(node)
        if docstring:
            at = node.body[0].lineno
            documented.add(at)
            yield at, OPENING, docstring.partition("\n")[0]
    after_doc_comment = -1  # the line of the last ``#:`` comment
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        row = token.start[0]
        if token.type == tokenize.COMMENT:
            text = token.string.lstrip("#: ")
            if token.string.startswith("#:"):
                if after_doc_comment != row - 1:
                    yield row, DOC_COMMENT, text
                after_doc_comment = row
            yield row, PROSE, text
        elif tokenize.tok_name[token.type] in {"STRING", "FSTRING_MIDDLE"}:
            part = PROSE if row in documented else STRING
            for offset, line in enumerate(token.string.splitlines()):
                if " " in line.strip():
                    yield row + offset, part, line


def _folder(file: Path) -> str:
    """Return the folder that a file is counted for: of a package, of a group of tests."""
    path = file.relative_to(ROOT).parts
    return "/".join(path[: 3 if path[0] in {"src", "tests"} else 1][: max(1, len(path) - 1)])


def list_patterns(names: Iterable[str]) -> None:
    """Print the finds in the given files and folders, and the counts of each folder."""
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
    columns = ["glossary", *(pattern.name for pattern in PATTERNS)]
    width = max([len("all"), *map(len, counts)])
    print(f"\n{'':{width}}", *columns, "all", sep="  ")
    total = sum(counts.values(), Counter())
    for folder, count in [*sorted(counts.items()), ("all", total)]:
        cells = [f"{count[name]:{len(name)}}" for name in columns]
        print(f"{folder:{width}}", *cells, f"{count.total():3}", sep="  ")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--patterns", nargs="*", metavar="PATH", help="list the patterns in files and folders"
    )
    options = parser.parse_args()
    if options.patterns is not None:
        given = [Path(name).resolve() for name in options.patterns]
        for path in given:
            if not path.exists() or not path.is_relative_to(ROOT):
                parser.error(f"{path} is not a file or folder of {ROOT}")
        names = [str(path.relative_to(ROOT)) for path in given]
        list_patterns(names or SEARCHED_FOR_PATTERNS)
        return 0
    words = Glossary()
    count = 0
    for file in files(SEARCHED):
        for number, line in lines(file):
            for word, write in words.finds(line):
                count += 1
                print(f"{file.relative_to(ROOT)}:{number}: {word!r}: write {write}")
    return 1 if count else 0


if __name__ == "__main__":
    sys.exit(main())
