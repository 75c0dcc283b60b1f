#!/usr/bin/env python3
"""Update the translations: ``src/rosglass/translations/rosglass_*.ts``, and ``.qm`` made of them.

With ``--write`` it writes the files: new texts come in as unfinished, those that are gone go out.
Without, it prints what is missing. A new language: ``--write --add fr``. Run it with PySide6.
"""

from __future__ import annotations

import argparse
import json
import re
import shutil
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import NamedTuple

from rosglass.cockpit.first_layout import words_of
from rosglass.cockpit.panels import GROUPS, controls
from rosglass.qml.engine.language import FOLDER

SOURCES = Path(__file__).parents[1] / "src" / "rosglass"
COMMAND = ".venv/bin/python scripts/translations.py --write"
#: Placeholders of Qt, and of Python's str.format().
_PLACEHOLDER = re.compile(r"%\d|\{\w*\}")


class Text(NamedTuple):
    """A text and its translation; `finished` is False until a person has translated it."""

    context: str
    source: str
    translation: str
    finished: bool


def texts(file: Path) -> list[Text]:
    """Return the texts of a ``.ts`` file."""
    found = []
    for context in ET.parse(file).getroot().iter("context"):
        name = context.findtext("name", "")
        for one in context.iter("message"):
            translation = one.find("translation")
            assert translation is not None
            finished = translation.get("type") is None and bool(translation.text)
            source = one.findtext("source", "")
            found.append(Text(name, source, translation.text or "", finished))
    return found


def problems(file: Path) -> list[str]:
    """Return the faults of a ``.ts`` file: unfinished texts, and placeholders that differ."""
    found = []
    for one in texts(file):
        where = f"{file.name}: {one.context}: {one.source!r}"
        if not one.finished:
            found.append(f"{where} is not translated")
        elif sorted(set(_PLACEHOLDER.findall(one.source))) != sorted(
            set(_PLACEHOLDER.findall(one.translation))
        ):
            found.append(f"{where} has other placeholders in {one.translation!r}")
    return found


def catalogue_texts() -> list[str]:
    """Return the texts of the cockpit's catalogue, which come from headings of QML files."""
    names = [words_of(one.name) for one in controls()]
    return list(dict.fromkeys([*GROUPS, *names, *(one.line for one in controls())]))


def updated(old: Path, folder: Path) -> Path:
    """Return a ``.ts`` file with the texts of the sources; what is translated stays.

    Args:
        old: The file so far; a language is added if there is none.
        folder: Where the new one is written.
    """
    file = folder / old.name
    if old.exists():
        shutil.copy(old, file)
    catalogue = file.with_name("Catalogue.js")
    catalogue.write_text(
        "".join(f"qsTranslate('Catalogue', {json.dumps(one)})\n" for one in catalogue_texts())
    )
    _run(
        "pyside6-lupdate", "-silent", "-extensions", "qml,js,py", "-no-obsolete",
        "-locations", "none",
        "-source-language", "en", "-target-language", file.stem.partition("_")[2],
        str(SOURCES), str(catalogue), "-ts", str(file),
    )  # fmt: skip
    # Comments on attributes of classes, which it takes for those of the next text.
    text = file.read_text(encoding="utf-8")
    text = re.sub(r"\s*<extracomment>.*?</extracomment>", "", text, flags=re.DOTALL)
    file.write_text(text, encoding="utf-8")
    return file


def compiled(file: Path, folder: Path) -> Path:
    """Return the ``.qm`` file made of a ``.ts`` file, in a folder."""
    made = folder / file.with_suffix(".qm").name
    _run("pyside6-lrelease", "-silent", "-nounfinished", str(file), "-qm", str(made))
    return made


def files() -> list[Path]:
    """Return the ``.ts`` files of all languages."""
    return sorted(FOLDER.glob("rosglass_*.ts"))


def _run(program: str, *words: str) -> None:
    beside = Path(sys.executable).with_name(program)
    subprocess.run([str(beside if beside.exists() else program), *words], check=True)


def main() -> int:
    """Write or compare the files; returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", action="store_true", help="write the files")
    parser.add_argument("--add", metavar="LANGUAGE", help="add a language, such as fr")
    args = parser.parse_args()
    wanted = files()
    if args.add:
        wanted.append(FOLDER / f"rosglass_{args.add}.ts")
    missing = []
    for file in wanted:
        with tempfile.TemporaryDirectory() as name:
            new = updated(file, Path(name))
            if args.write:
                shutil.copy(new, file)
                compiled(file, FOLDER)
            elif not file.exists() or new.read_bytes() != file.read_bytes():
                missing.append(f"{file.name} is not up to date: {COMMAND}")
            missing += problems(new)
    print("\n".join(missing) or f"{len(wanted)} languages are complete")
    return 1 if missing else 0


if __name__ == "__main__":
    sys.exit(main())
