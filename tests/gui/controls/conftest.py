"""A bench whose engine has ``RosControls 1.0``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path


class ControlBench:
    """One control in a window, on a robot made of memory.

    Attributes:
        robot: The robot's node.
        engine: The QML engine.
        window: The window that shows the control.
        bench: The bench with the engine, its session, and the nodes in memory.
    """

    def __init__(self, running: Any, wait: Any) -> None:
        self.bench, self._wait = running, wait
        self.robot, self.engine, self.window = running.robot, running.engine, None
        self.engine_session = running.session

    def show(self, control: str, width: int = 400, height: int = 300, imports: str = "") -> Any:
        """Show a control, such as ``Battery { topic: "/battery" }``; return it."""
        self.window = self.bench.load(
            f"Window {{ width: {width}; height: {height}; visible: true; color: Theme.background\n"
            f"property Item control: made\nItem {{ anchors.fill: parent\n{named(control)} }} }}",
            f"import QtQuick 2.15\nimport QtQuick.Window 2.15\nimport RosControls 1.0\n{imports}",
        )
        self._wait(self.window.isExposed)
        return self.window.property("control")

    def find(self, name: str, item: Any = None) -> Any:
        """Return the item of the window with an ``objectName``."""
        waiting = [item or self.window.contentItem()]
        while waiting:
            one = waiting.pop()
            if one.objectName() == name:
                return one
            waiting += one.childItems()
        raise AssertionError(f"the window has no item {name!r}")

    def grab(self) -> Any:
        """Return what the window shows, as a QImage."""
        return self.window.grabWindow()


def named(control: str) -> str:
    """Return the declaration of an object with the id that :class:`ControlBench` looks for."""
    head, _, rest = control.partition("{")
    return f"{head}{{ id: made; {rest}"


@pytest.fixture
def controls(running: Any, wait: Callable[..., None], tmp_path: Path) -> Iterator[ControlBench]:
    """A bench to show controls on, connected to the robot."""
    from rosglass.controls import register

    register()
    return ControlBench(running, wait)


@pytest.fixture
def live_controls(live: Any, wait: Callable[..., None]) -> ControlBench:
    """A bench to show controls on, connected to the robot over a real middleware."""
    from rosglass.controls import register

    register()
    return ControlBench(live, wait)
