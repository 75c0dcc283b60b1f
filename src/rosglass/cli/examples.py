"""``rosglass examples``: copy the examples, and the demo's cockpit, to start from."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import TYPE_CHECKING

import rosglass
from rosglass.errors import Error

if TYPE_CHECKING:
    import argparse

__all__ = ["run"]

_PACKAGE = Path(rosglass.__file__).parent
#: The examples in the wheel, and in a clone.
_EXAMPLES = (_PACKAGE / "examples", _PACKAGE.parents[1] / "examples")


def run(args: argparse.Namespace) -> int:
    """Copy the examples into a new folder; returns the exit code.

    Raises:
        Error: The folder exists already, or cannot be written.
    """
    folder = Path(args.folder)
    if folder.exists():
        raise Error(f"{folder} exists already: name a new folder: rosglass examples FOLDER")
    source = next((place for place in _EXAMPLES if place.is_dir()), None)
    if source is None:
        raise Error(f"this installation has no examples: {_EXAMPLES[0]} is missing; reinstall it")
    ignored = shutil.ignore_patterns("__pycache__")
    try:
        shutil.copytree(source, folder, ignore=ignored)
        shutil.copytree(_PACKAGE / "demo" / "cockpit", folder / "cockpit", ignore=ignored)
    except OSError as error:
        raise Error(f"the examples cannot be copied to {folder.absolute()}: {error}") from None
    print(f"copied {len(list(folder.rglob('*.qml')))} QML files and their programs to {folder}")
    print(f"open one: rosglass run {folder / 'remote_control.qml'} --watch")
    print(f"the cockpit of rosglass demo: rosglass run {folder / 'cockpit' / 'main.qml'} --watch")
    return 0
