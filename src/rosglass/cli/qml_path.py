"""``rosglass qml-path``: where the QML modules are, for editors and other programs."""

from __future__ import annotations

import configparser
import io
import os
from pathlib import Path
from typing import TYPE_CHECKING

from rosglass.errors import Error
from rosglass.qml import IMPORT_PATHS

if TYPE_CHECKING:
    import argparse

__all__ = ["run"]


def run(args: argparse.Namespace) -> int:
    """Print the import path, or write the settings; returns the exit code."""
    path = os.pathsep.join(map(str, IMPORT_PATHS))
    if not args.qmlls_ini:
        print(path)
        return 0
    file = Path(".qmlls.ini")
    file.write_text(_with_import_path(file, path), encoding="utf-8")
    print(f"wrote {file.absolute()}")
    return 0


def _with_import_path(file: Path, path: str) -> str:
    """Return the settings of a file with rosglass's folders among the import paths.

    Raises:
        Error: The file is not a settings file.
    """
    settings = configparser.ConfigParser(interpolation=None)
    # Qt is case-sensitive.
    settings.optionxform = str  # type: ignore[assignment, method-assign]
    try:
        settings.read(file, encoding="utf-8")
    except (configparser.Error, UnicodeDecodeError) as error:
        raise Error(f"{file}: {error}; mend or delete it first") from None
    if not settings.has_section("General"):
        settings.add_section("General")
    old = settings.get("General", "importPaths", fallback="").strip('"').split(os.pathsep)
    ours = path.split(os.pathsep)
    others = [folder for folder in old if folder and folder not in ours]
    settings.set("General", "importPaths", f'"{os.pathsep.join([*others, *ours])}"')
    # Otherwise it looks for a C++ project to build.
    settings["General"].setdefault("no-cmake-calls", "true")
    text = io.StringIO()
    settings.write(text, space_around_delimiters=False)
    return text.getvalue()
