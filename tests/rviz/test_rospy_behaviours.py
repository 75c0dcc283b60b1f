"""The example's buttons of behaviours against an action server of actionlib itself."""

from __future__ import annotations

import subprocess
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

import rosglass.interfaces
from rosglass.interfaces import Library

if TYPE_CHECKING:
    from collections.abc import Iterator

HERE = Path(__file__).parent
FOLDER = HERE.parents[1] / "examples/rviz"
PYTHON = "/usr/bin/python3"
ACTION = Path(rosglass.interfaces.__file__).parent / (
    "definitions/ros1/flexbe_msgs/action/BehaviorExecution.action"
)


@pytest.fixture(scope="session")
def messages(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with flexbe_msgs for rospy, made by ROS's own generators."""
    folder = tmp_path_factory.mktemp("flexbe")
    texts, package = folder / "msg", folder / "python/flexbe_msgs/msg"
    package.mkdir(parents=True)
    texts.mkdir()
    (package.parent / "__init__.py").touch()
    make = [PYTHON, "/usr/lib/actionlib_msgs/genaction.py", str(ACTION), "-o", str(texts)]
    subprocess.run(make, check=True, timeout=60, stdout=subprocess.DEVNULL)
    paths = [f"-Iflexbe_msgs:{texts}"]
    library = Library()
    for name in ("std_msgs/Header", "actionlib_msgs/GoalID", "actionlib_msgs/GoalStatus"):
        file = folder / f"{name}.msg"
        file.parent.mkdir(exist_ok=True)
        file.write_text(library.definition(name.replace("/", "/msg/"), ros=1).text)
        paths.append(f"-I{file.parent.name}:{file.parent}")
    generate = [PYTHON, "/usr/lib/genpy/genmsg_py.py", "-p", "flexbe_msgs", "-o", str(package)]
    for text in sorted(texts.glob("*.msg")):
        subprocess.run([*generate, *paths, str(text)], check=True, timeout=60)
    subprocess.run([*generate, "--initpy"], check=True, timeout=60)
    return folder / "python"


@pytest.fixture
def server(master: str, messages: Path, tmp_path: Path) -> Iterator[None]:
    env = {
        "PATH": "/usr/bin:/bin",
        "HOME": str(tmp_path),
        "PYTHONPATH": str(messages),
        "ROS_MASTER_URI": master,
        "ROS_IP": "127.0.0.1",
    }
    command = ["setpriv", "--pdeathsig", "KILL", PYTHON, str(HERE / "rospy_behaviours.py")]
    program = subprocess.Popen(command, env=env, stdout=subprocess.DEVNULL)
    yield
    program.kill()
    program.wait(30)


def test_goals_feedback_cancelling_and_failures(app: Any, wait: Any, server: None) -> None:
    root = app.add_qml(HERE / "Behaviours.qml").root
    behaviours = root.childItems()[0]

    def items() -> list[Any]:
        found = [root]
        for item in found:
            found.extend(item.childItems())
        return found

    def texts() -> set[str]:
        return {item.property("text") for item in items() if item.inherits("QQuickText")}

    def click(name: str) -> None:
        wait(lambda: behaviours.property("ready") and not behaviours.property("active"))
        named = [item for item in items() if item.property("text") == name]
        (button,) = [item for item in named if item.objectName().startswith("goal")]
        wait(button.isEnabled)
        button.clicked.emit()

    click("Look around")
    wait(lambda: {"Look around: done", "finished"} <= texts())
    click("Turn around")
    wait(lambda: {"Turn around: running", "turning"} <= texts())
    behaviours.cancel()
    wait(lambda: "Turn around: CANCELLED" in texts())
    click("Flippers up")
    wait(lambda: "Flippers up: FAILED" in texts(), texts)
    wait(lambda: any("the flippers are jammed" in text for text in texts()))
