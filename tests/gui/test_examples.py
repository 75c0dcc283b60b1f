"""Every example in QML runs as its reader would start it, beside a robot, and leaves a picture."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from ports import free_port

if TYPE_CHECKING:
    from collections.abc import Iterator

pytestmark = pytest.mark.xvfb

EXAMPLES = Path(__file__).parents[2] / "examples"
#: The paper's figures, and the programs that they are shown beside.
PARTNERS = {"figure4": "pose_prediction.py", "figure5": "humanoid.py"}
FILES = [
    file
    for pattern in ("*.qml", "ros1/*.qml", "paper/figure*.qml")
    for file in sorted(EXAMPLES.glob(pattern))
]


@pytest.fixture(scope="module")
def world() -> Iterator[str]:
    """A router and the simulated robot; gives the URL."""
    from rosglass.wires.zenoh.router import Router

    with Router(f"tcp/127.0.0.1:{free_port()}") as router:
        command = [sys.executable, "-m", "rosglass.cli", "robot", "--url", router.url, "--leash"]
        robot = subprocess.Popen(
            command, text=True, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=sys.stderr
        )
        assert robot.stdout is not None
        assert any("connected" in line for line in robot.stdout)
        yield router.url
        robot.kill()
        robot.wait(10)


@pytest.fixture
def partner(request: Any, world: str) -> Iterator[None]:
    """The program that an example needs besides the robot."""
    name = PARTNERS.get(request.getfixturevalue("file").stem)
    if name is None:
        yield
        return
    command = [sys.executable, str(EXAMPLES / "paper" / name), world]
    program = subprocess.Popen(command, text=True, stdout=subprocess.PIPE, stderr=sys.stderr)
    assert program.stdout is not None
    assert any("ready" in line for line in program.stdout)
    yield
    program.kill()
    program.wait(10)


@pytest.fixture(params=FILES, ids=lambda file: file.stem)
def file(request: Any) -> Path:
    """An example."""
    made: Path = request.param
    return made


@pytest.mark.usefixtures("partner")
def test_it_runs(file: Path, world: str, screen: str, start: Any, tmp_path: Path) -> None:
    from rosglass.qt import QtGui

    target = tmp_path / "picture.png"
    arguments = ["run", file, "--url", world, "--screenshot", target, "--after", "2"]
    program = start(*arguments, display=screen)
    code = program.end(60)
    told = [line for line in program.lines if "WARNING" in line or "ERROR" in line]
    assert (code, told) == (0, []), program.text
    picture = QtGui.QImage(str(target))
    assert (picture.width(), picture.height()) >= (300, 200)
    colours = {
        picture.pixel(x, y)
        for x in range(0, picture.width(), 3)
        for y in range(0, picture.height(), 3)
    }
    assert len(colours) > 10
