"""The scene's views against RViz's own: the same mouse events lead to the same camera."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest
import yaml

from rosglass.scene.view_controllers.events import Button, Drag, Modifier, Wheel
from rosglass.scene.view_controllers.views import VIEWS, create_view

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    from rosglass.scene.view_controllers.view_controller import ViewController

NONE, SHIFT = Modifier.NONE, Modifier.SHIFT
#: Button, modifiers, and how far the mouse goes in each of two events.
DRAGS = [
    (Button.LEFT, NONE, 17, 9),
    (Button.MIDDLE, NONE, -12, 8),
    (Button.LEFT, SHIFT, 10, -6),
    (Button.RIGHT, NONE, 2, -5),
    (Button.RIGHT, SHIFT, 2, 4),
    (Button.LEFT, NONE, -30, -14),
]


class Both:
    """RViz's current view and ours, with the same settings and the same mouse."""

    def __init__(self, app: Any, wait: Any, name: str) -> None:
        from PySide2 import QtCore, QtGui

        self._core, self._gui = QtCore, QtGui
        self._wait, self._panel = wait, app.window.panel
        self._rviz = app.window.manager.getViewManager().getCurrent
        self.view: ViewController = create_view(f"rviz/{name}")
        self._start()

    @property
    def size(self) -> tuple[float, float]:
        # RViz makes its window's width even.
        return float(self._panel.width() + self._panel.width() % 2), float(self._panel.height())

    @property
    def eye(self) -> tuple[float, ...]:
        return tuple(self.view.camera(*self.size).eye)

    def _start(self) -> None:
        """Set RViz's view to our defaults, and take over its numbers of 32 bits."""
        state: dict[str, Any] = {}
        for row in self.view.describe():
            path, value = row["path"], row["value"]
            if path == "Point towards":
                continue
            setting = self._rviz().subProp(path)
            if row["kind"] == "vector":
                for axis, number in value.items():
                    setting.subProp(axis).setValue(number)
                state[path] = {axis: setting.subProp(axis).getValue() for axis in "XYZ"}
            else:
                setting.setValue(value)
                state[path] = setting.getValue()
        assert self.view.restore(state) == []
        self._wait.frames(3)

    def drag(self, button: Button, held: Modifier, dx: int, dy: int) -> None:
        x, y = 150, 120
        self._send("MouseMove", x, y, Button.NONE, Button.NONE, held)
        self._send("MouseButtonPress", x, y, button, button, held)
        for _ in range(2):
            x, y = x + dx, y + dy
            self._send("MouseMove", x, y, Button.NONE, button, held)
            self.view.on_drag(Drag(x, y, dx, dy, button, held, self.size))
            # RViz moves its camera once for each frame.
            self._wait.frames(2)
        self._send("MouseButtonRelease", x, y, button, Button.NONE, held)

    def wheel(self, steps: int, held: Modifier) -> None:
        at = self._core.QPointF(300, 320)
        event = self._gui.QWheelEvent(
            at,
            self._core.QPointF(self._panel.mapToGlobal(at.toPoint())),
            self._core.QPoint(),
            self._core.QPoint(0, 120 * steps),
            self._core.Qt.NoButton,
            self._core.Qt.KeyboardModifiers(int(held)),
            self._core.Qt.NoScrollPhase,
            False,
        )
        self._core.QCoreApplication.sendEvent(self._panel, event)
        self.view.on_wheel(Wheel(steps, held))
        self._wait.frames(2)

    def _send(self, kind: str, x: int, y: int, button: Button, held: Button, keys: Any) -> None:
        qt, at = self._core.Qt, self._core.QPointF(x, y)
        event = self._gui.QMouseEvent(
            getattr(self._core.QEvent, kind),
            at,
            at,
            self._core.QPointF(self._panel.mapToGlobal(at.toPoint())),
            qt.MouseButton(int(button)),
            qt.MouseButtons(int(held)),
            qt.KeyboardModifiers(int(keys)),
        )
        self._core.QCoreApplication.sendEvent(self._panel, event)


@pytest.fixture
def both(app: Any, wait: Any) -> Iterator[Callable[[str], Both]]:
    tools = app.rviz.tools
    tool = tools.current
    tools.select(tools.find("rviz/MoveCamera"))
    # An RViz that has drawn nothing yet crashes when its view is replaced.
    wait.frames(2)

    def both(name: str) -> Both:
        app.rviz.views.kind = f"rviz/{name}"
        wait.frames(3)
        return Both(app, wait, name)

    yield both
    tools.select(tool)
    app.rviz.views.kind = "rviz/Orbit"
    wait.frames(2)


@pytest.mark.parametrize("name", [name for name in VIEWS if name != "FrameAligned"])
def test_the_same_mouse_leads_to_the_same_camera(
    both: Callable[[str], Both], eye: Any, name: str, app: Any
) -> None:
    from rosglass.rviz.camera import RvizCamera

    pair = both(name)
    # Ogre has rays in numbers of 32 bits: on the ground they are a millimetre off.
    within = 5e-3 if name in ("XYOrbit", "ThirdPersonFollower") else 1e-3
    for drag in DRAGS:
        pair.drag(*drag)
        assert eye() == pytest.approx(pair.eye, abs=within), drag
    for steps, held in ((1, NONE), (-1, NONE), (1, SHIFT)):
        pair.wheel(steps, held)
        assert eye() == pytest.approx(pair.eye, abs=within), steps
    camera, ours = RvizCamera(app.window), pair.view.camera(*pair.size)
    camera.update()
    for point in ((0, 0, 0), (30, -20, 0), (-0.5, 0.2, 0.3)):
        seen = pytest.approx(camera.project(point)[:2], rel=3e-3, abs=1, nan_ok=True)
        assert ours.project(point)[:2] == seen, point


def test_a_view_takes_over_as_rviz_s_does(
    app: Any, both: Callable[[str], Both], eye: Any, wait: Any
) -> None:
    pair = both("Orbit")
    pair.drag(*DRAGS[0])
    pair.drag(*DRAGS[1])
    view = pair.view
    for name in ("XYOrbit", "FPS", "Orbit"):
        app.rviz.views.kind = f"rviz/{name}"
        wait.frames(3)
        before, view = view, create_view(f"rviz/{name}")
        view.mimic(before)
        assert eye() == pytest.approx(tuple(view.camera(*pair.size).eye), abs=1e-3), name
    current = app.window.manager.getViewManager().getCurrent()
    for setting in ("Distance", "Pitch"):
        assert current.subProp(setting).getValue() == pytest.approx(view.get(setting), abs=1e-3)


def test_rviz_saves_the_settings_that_we_know(
    app: Any, both: Callable[[str], Both], tmp_path: Path
) -> None:
    for name in VIEWS:
        pair = both(name)
        file = tmp_path / f"{name}.rviz"
        app.save_config(file)
        saved = yaml.safe_load(file.read_text())["Visualization Manager"]["Views"]["Current"]
        assert pair.view.state().keys() == saved.keys() - {"Enable Stereo Rendering"}, name
