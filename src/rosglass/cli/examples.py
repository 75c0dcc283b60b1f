"""``rosglass examples``: list the examples, and copy one, or all, to start from."""

from __future__ import annotations

import re
import shutil
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import rosglass
from rosglass.comm.names import similar
from rosglass.errors import Error

if TYPE_CHECKING:
    import argparse

__all__ = ["Example", "find_examples", "names", "run"]

_PACKAGE = Path(rosglass.__file__).parent
#: The examples in the wheel, and in a clone.
_EXAMPLES = (_PACKAGE / "examples", _PACKAGE.parents[1] / "examples")
_CONTROLS = _PACKAGE / "controls" / "imports" / "RosControls"
#: Folders that are copied as a whole: a description, and how to run what is in it.
_FOLDERS = {
    "cockpit": ("The cockpit of rosglass demo.", "rosglass run cockpit/main.qml --watch"),
    "paper": (
        "The interfaces of the paper; humanoid.py and pose_prediction.py are their robots.",
        "rosglass run paper/figure5.qml --watch",
    ),
    "ros1": (
        "The module Ros 1.0, with the names of ROS 1.",
        "rosglass run ros1/panel.qml --url ros1://127.0.0.1:11311 --watch",
    ),
    "rviz": (
        "An operator station over RViz's 3D view: the paper's Figure 1.",
        "rosglass rviz rviz/figure1.rviz --overlay rviz/Dashboard.qml --watch",
    ),
    "view": (
        "A 3D view whose displays, camera and tools Python chooses.",
        "python view/scene.py",
    ),
}


#: Examples that do not say what they are.
_OTHERS = {"remote_control": "Drives the robot by a stick, with its camera behind."}


class Example(NamedTuple):
    """A file or folder to copy.

    Attributes:
        name: Its name on the command line, e.g. ``controls/battery``.
        path: The file or folder.
        summary: A line that says what it shows.
        command: How the copy is run.
    """

    name: str
    path: Path
    summary: str
    command: str


def run(args: argparse.Namespace) -> int:
    """List the examples, or copy some; returns the exit code.

    Raises:
        Error: There is no such example, a copy exists already, or it cannot be written.
    """
    if args.all is not None:
        if args.names:
            raise Error("--all copies every example: leave out the names")
        return _copy_all(Path(args.all))
    found = find_examples()
    if not args.names:
        width = max(len(one.name) for one in found)
        for one in found:
            print(f"{one.name:{width}}  {one.summary}")
        print("\ncopy one to this folder: rosglass examples NAME")
        return 0
    wanted = [_named(name, found) for name in args.names]
    files = {file.name: file for one in wanted for file in _files(one)}
    _copy(files)
    print(f"copied {', '.join(sorted(files))} to this folder")
    for one in wanted:
        print(f"run it: {one.command}")
    print("without a robot, first start the simulated one: rosglass router & rosglass robot &")
    return 0


def names() -> list[str]:
    """Return the names of all examples."""
    return [one.name for one in find_examples()]


def find_examples() -> list[Example]:
    """Return all examples, sorted by name; those of controls last.

    Raises:
        Error: This installation has none.
    """
    folder = _folder()
    found = []
    for file in sorted(folder.iterdir()):
        if file.suffix in (".qml", ".py"):
            starts = "rosglass run" if file.suffix == ".qml" else "python"
            watch = " --watch" if file.suffix == ".qml" else ""
            # Some have a program beside them, of the same name.
            name = file.stem if file.suffix == ".qml" else file.name
            found.append(Example(name, file, _summary(file), f"{starts} {file.name}{watch}"))
    for name, (summary, command) in _FOLDERS.items():
        path = _PACKAGE / "demo" / "cockpit" if name == "cockpit" else folder / name
        found.append(Example(name, path, summary, command))
    for file in sorted((folder / "controls").glob("*.qml")):
        command = f"rosglass run {file.name} --watch"
        found.append(Example(f"controls/{file.stem}", file, _summary(file), command))
    return found


def _folder() -> Path:
    source = next((place for place in _EXAMPLES if place.is_dir()), None)
    if source is None:
        raise Error(f"this installation has no examples: {_EXAMPLES[0]} is missing; reinstall it")
    return source


def _summary(file: Path) -> str:
    """Return the first sentence of a file, or that of the control that it shows."""
    text = file.read_text(encoding="utf-8")
    first = re.match(r'(?:// .*\n)+|"""[^"\n]+', text)
    if first is not None:
        words = " ".join(first[0].replace("// ", "").replace('"""', "").split())
        return re.split(r"(?<=[.?!]) ", words)[0]
    title = re.search(r'^ *(?:property string )?title: "(.+)"', text, re.M)
    control = _CONTROLS / f"{title[1]}.qml" if title else None
    if control is not None and control.is_file():
        return _summary(control)
    return f"The element {title[1]}." if title else _OTHERS.get(file.stem, "")


def _named(name: str, found: list[Example]) -> Example:
    """Return the example of a name: with or without folder and ``.qml``."""
    wanted = name.removeprefix("examples/").removesuffix(".qml").rstrip("/")
    for one in found:
        if wanted == one.name:
            return one
    for one in found:
        if wanted == one.name.rpartition("/")[2]:
            return one
    known = [one.name for one in found]
    short = [one.rpartition("/")[2] for one in known]
    raise Error(
        f"there is no example {name}{similar(wanted, [*known, *short])}; "
        "rosglass examples lists all"
    )


def _files(example: Example) -> list[Path]:
    """Return an example, and the files beside it that it names, and those that these name."""
    found = [example.path]
    if example.path.is_dir():
        return found
    beside = [file for file in example.path.parent.iterdir() if file.is_file()]
    for one in found:
        if one.suffix in (".qml", ".py"):
            text = one.read_text(encoding="utf-8")
            found += [file for file in beside if file not in found and file.name in text]
    return found


def _copy(sources: dict[str, Path]) -> None:
    for name in sources:
        if Path(name).exists():
            raise Error(
                f"{name} exists already, and nothing was copied: rename it, or change to another "
                "folder"
            )
    try:
        for name, source in sources.items():
            if source.is_dir():
                shutil.copytree(source, name, ignore=shutil.ignore_patterns("__pycache__"))
            else:
                shutil.copyfile(source, name)
    except OSError as error:
        raise Error(f"the example cannot be copied to {Path.cwd()}: {error}") from None


def _copy_all(folder: Path) -> int:
    if folder.exists():
        raise Error(f"{folder} exists already: name a new folder: rosglass examples --all FOLDER")
    ignored = shutil.ignore_patterns("__pycache__")
    try:
        shutil.copytree(_folder(), folder, ignore=ignored)
        shutil.copytree(_PACKAGE / "demo" / "cockpit", folder / "cockpit", ignore=ignored)
    except OSError as error:
        raise Error(f"the examples cannot be copied to {folder.absolute()}: {error}") from None
    print(f"copied {len(list(folder.rglob('*.qml')))} QML files and their programs to {folder}")
    print(f"open one: rosglass run {folder / 'remote_control.qml'} --watch")
    print(f"the cockpit of rosglass demo: rosglass run {folder / 'cockpit' / 'main.qml'} --watch")
    return 0
