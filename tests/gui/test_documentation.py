"""The QML of the documentation is loaded as printed; fragments get a file around them."""

from __future__ import annotations

import re
import shutil
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from rosglass.qt import QT6

if TYPE_CHECKING:
    from collections.abc import Iterator

pytestmark = [
    pytest.mark.xvfb,
    pytest.mark.skipif(not QT6, reason="the pages' imports have no version, which Qt 5 needs"),
]

DOCS = Path(__file__).parents[2] / "docs"
#: Run by tests of their own: over RViz, with Python, and beside a robot.
ELSEWHERE = {"rviz.md", "own_element.md", "qml.md"}
BLOCK = re.compile(r"^```qml\n(.*?)^```", re.MULTILINE | re.DOTALL)
HEAD = """import QtQuick
import QtQuick.Controls
import QtQuick.Layouts
"""
#: Objects that a page's snippets refer to.
GIVEN = {
    "scene.md": "SceneView { id: view } ListModel { id: marks }",
    "Time.md": 'Subscription { id: sub; topic: "/scan" }\nproperty color color',
    "ImageTransportSubscription.md": "ImageTransportSubscription { id: camera } Label { id: info }",
}


def snippets() -> Iterator[Any]:
    for page in sorted(DOCS.glob("**/*.md")):
        text = page.read_text(encoding="utf-8")
        for block in BLOCK.finditer(text):
            if page.name not in ELSEWHERE and "--8<--" not in block[1]:
                line = text.count("\n", 0, block.start(1)) + 1
                yield pytest.param(page.name, block[1], id=f"{page.name}:{line}")


def as_file(page: str, snippet: str) -> str:
    """Return the file that a reader would make of a snippet."""
    if "import QtQuick\n" in snippet:
        return snippet
    own = [line for line in snippet.splitlines() if line.startswith("import ")]
    body = "\n".join(line for line in snippet.splitlines() if not line.startswith("import "))
    ros = "Ros" if "Ros." in body else "Ros2"
    imports = [*own, "" if own else f"import {ros} 1.0"]
    if page == "scene.md":
        imports.append("import RosScene 1.0")
    if re.match(r"on[A-Z]\w*: ", body):
        body = f'Subscription {{ topic: "/scan"; function draw(x) {{}}\n{body} }}'
    given = GIVEN.get(page, "")
    if (DOCS / "controls" / page).exists():
        imports = [*imports, "import RosControls 1.0"]
    if "SceneView" in body:
        given = ""
    elif page == "scene.md" and re.search(r"Display|^Tool \{", body, re.MULTILINE):
        body = f"SceneView {{ {body} }}"
    return "\n".join([HEAD, *imports, f"Item {{ width: 640; height: 480\n{given}\n{body}\n}}"])


def make_package(folder: Path) -> dict[str, str]:
    """Make the package my_robot for ROS 1 and ROS 2; return the environment that has it."""
    share = folder / "install" / "share" / "my_robot"
    share.mkdir(parents=True)
    (share / "package.xml").write_text("<package><name>my_robot</name></package>")
    shutil.copy(DOCS / "images" / "cockpit.png", share / "logo.png")
    index = folder / "install" / "share" / "ament_index" / "resource_index" / "packages"
    index.mkdir(parents=True)
    (index / "my_robot").touch()
    prefix = str(folder / "install")
    return {"AMENT_PREFIX_PATH": prefix, "ROS_PACKAGE_PATH": f"{prefix}/share"}


@pytest.mark.parametrize(("page", "snippet"), list(snippets()))
def test_it_loads(page: str, snippet: str, start: Any, screen: str, tmp_path: Path) -> None:
    file = tmp_path / "snippet.qml"
    file.write_text(as_file(page, snippet), encoding="utf-8")
    (tmp_path / "dashboard.qml").write_text("import QtQuick\nItem {}", encoding="utf-8")
    arguments = ["run", file, "--url", "local://docs", "--screenshot", tmp_path / "shown.png"]
    program = start(*arguments, "--after", "0.3", display=screen, **make_package(tmp_path))
    code = program.end(60)
    problems = [line for line in program.lines if "WARNING" in line or "ERROR" in line]
    assert (code, problems) == (0, []), program.text
