"""The object ``rviz`` in docs/rviz.md: every member is there, and every example runs."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from collections.abc import Callable

PAGE = (Path(__file__).parents[2] / "docs" / "rviz.md").read_text(encoding="utf-8")
GUIDE = PAGE[PAGE.index("## The rviz object") : PAGE.index("## Input")]
ROW = re.compile(r"^\| `(\w+)[^`]*` \| .+? \| `(.+)` \|$", re.MULTILINE)
#: The tables, by a member that only each has: the object, and its name in examples.
OBJECTS = {
    "isFullscreen": "rviz",
    "registerIntProperty": "rviz",
    "kindName": "speed",
    "toolClasses": "rviz.toolManager",
    "shortcutKey": "tool",
    "statusText": "grid",
    "point": "tracker",
    "moveEye": "rviz.view",
}
NAMES = """const grid = rviz.display("Grid"), tool = rviz.toolManager.tools[0],
    tracker = rviz.createPositionTracker(0, 0, 0),
    speed = rviz.registerFloatProperty("Speed", 1);"""


def tables() -> dict[str, dict[str, str]]:
    """Return the examples by member, by object."""
    found: dict[str, dict[str, str]] = {}
    for text in re.split(r"\n\n", GUIDE):
        rows = dict(ROW.findall(text))
        if rows:
            first = next(mark for mark in OBJECTS if mark in rows)
            found.setdefault(OBJECTS[first], {}).update(rows)
            # Every row of a table has an example.
            assert len(rows) == len(text.strip().splitlines()) - 2, text
    return found


TABLES = tables()
BLOCKS = re.findall(r"```qml\n(.*?)```", PAGE, re.DOTALL)
PROGRAMS = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
#: Members that notify of several properties' changes, are Python's, or are for RosRviz's own QML.
NOT_LISTED = {
    "objectName",
    "changed",
    "moved",
    "registered",
    "unregistered",
    "edited",
    "refuse",
    "warn",
}


@pytest.fixture
def run(app: Any, wait: Callable[..., None], show: Any, tmp_path: Path) -> Callable[[str], Any]:
    for display in app.rviz.displays.all:
        app.rviz.displays.remove(display)
    app.rviz.displays.add("rviz/Grid", "Grid")
    for class_id in ("rviz/Interact", "rviz/MoveCamera"):
        app.rviz.tools.add(class_id)
    show("Item {}")
    (overlay,) = app.overlays
    engine = overlay.engine
    engine.globalObject().setProperty("rviz", engine.newQObject(overlay.properties))

    def run(script: str) -> Any:
        text = f"{NAMES} {script.replace('/tmp/', f'{tmp_path}/')}; return ''"
        text = f"(function () {{ try {{ {text} }} catch (e) {{ return '' + e }} }})()"
        return engine.evaluate(text).toString()

    return run


@pytest.mark.parametrize("object_name", TABLES)
def test_the_examples_run(
    object_name: str, app: Any, run: Any, wait: Any, caplog: pytest.LogCaptureFixture
) -> None:
    said = {member: run(example) for member, example in TABLES[object_name].items()}
    assert {member: text for member, text in said.items() if text} == {}
    wait.frames(2)
    assert [r.getMessage() for r in caplog.records if "no member" in r.getMessage()] == []
    app.window.fullscreen = app.window.bare.on = False
    app.fixed_frame = "map"
    wait(lambda: not app.window.fullscreen)


@pytest.mark.parametrize("object_name", TABLES)
def test_every_member_is_documented(object_name: str, run: Any, app: Any) -> None:
    (overlay,) = app.overlays
    text = f"(function () {{ {NAMES} let all = []; for (const m in {object_name}) all.push(m);"
    text += "return JSON.stringify(all) })()"
    there = set(json.loads(overlay.engine.evaluate(text).toString()))
    there = {m for m in there if not m.startswith("_") and not m.endswith("Changed")} - NOT_LISTED
    listed = set(TABLES[object_name])
    assert there - listed == set()
    assert listed - there <= {"toolChanged"}


@pytest.mark.parametrize("number", range(len(BLOCKS)))
def test_interfaces_of_the_page_run(
    app: Any, tmp_path: Path, wait: Callable[..., None], number: int
) -> None:
    text = BLOCKS[number]
    if not text.startswith("import QtQuick"):
        imports, _, parts = text.partition("\n\n")
        text = f"import QtQuick 2.15\nimport QtQuick.Controls 2.15\n{imports}\n"
        text += f"Item {{ function stop() {{}}\n{parts} }}"
    file = tmp_path / "Example.qml"
    file.write_text(text)
    overlay = app.add_qml(file)
    wait.frames(3)
    assert overlay.problem == ""


def run_program(text: str, master: str, folder: Path) -> str:
    """Run a program of the page for a second, with interfaces of its names; return its errors."""
    text = text.replace("ros1://robot:11311", master.replace("http", "ros1"))
    quit_soon = "QtCore.QTimer.singleShot(1000, app.qt.quit)"
    text = re.sub(r"(\s+)((?:code = )?app\.run\(\))", rf"\1{quit_soon}\1\2", text)
    assert quit_soon in text
    needed = "from rosglass.rviz.qt5 import QtCore\ndock = print\n"
    (folder / "program.py").write_text(needed + text)
    for name in ("dashboard", "map_legend"):
        (folder / f"{name}.qml").write_text("import QtQuick 2.15\nText { text: 'ready' }")
    done = subprocess.run(
        [sys.executable, "program.py"],
        check=False,
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=100,
    )
    assert done.returncode == 0, done.stderr
    return done.stderr


@pytest.mark.parametrize("number", range(len(PROGRAMS)))
def test_python_of_the_page_runs(
    app: Any, master: str, tmp_path: Path, wait: Callable[..., None], number: int
) -> None:
    from rosglass.rviz.qt5 import QtWidgets

    text = PROGRAMS[number]
    if "app.run()" in text:
        # Without displays of other tests: RViz, whose own files name no overlays, reports those.
        shutil.copy(Path.home() / "found.rviz", tmp_path / "robot.rviz")
        errors = run_program(text, master, tmp_path)
        assert "Traceback" not in errors
        assert "ERROR" not in errors
        return
    my_widget = QtWidgets.QPushButton("Legend")
    if "package://my_robot" in text:
        (tmp_path / "look.qss").write_text("QPushButton { color: red }")
        text = text.replace("package://my_robot", str(tmp_path))
    exec(text, {"app": app, "my_widget": my_widget})
    wait.frames(3)
    assert [overlay.problem for overlay in app.overlays if overlay.problem] == []
