"""``rosglass new``: write an interface to start from."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import rosglass
from rosglass.errors import Error

if TYPE_CHECKING:
    import argparse

__all__ = ["run"]

_TEMPLATES = Path(rosglass.__file__).parent / "controls" / "templates"


def run(args: argparse.Namespace) -> int:
    """Write a template to a new file; returns the exit code.

    Raises:
        Error: The file exists already, is not a QML file, or cannot be written.
    """
    file = Path(args.file)
    if file.suffix != ".qml":
        raise Error(f"{file}: the name of an interface ends in .qml: rosglass new {file.stem}.qml")
    if not file.parent.is_dir():
        raise Error(f"{file}: there is no folder {file.parent}: create it first")
    text = (_TEMPLATES / f"{args.template}.qml").read_text(encoding="utf-8")
    try:
        with file.open("x", encoding="utf-8") as target:
            target.write(text)
    except FileExistsError:
        raise Error(f"{file} exists already, and is left as it is: give another name") from None
    except OSError as error:
        raise Error(f"{file} cannot be written: {error}") from None
    print(f"wrote {file} ({args.template})")
    print(f"run it: rosglass run {file} --watch")
    print("without a robot, first start the simulated one: rosglass router & rosglass robot &")
    return 0
