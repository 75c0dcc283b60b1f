"""A scene's camera, moved by robots of ROS 1 and ROS 2: see :mod:`view_contract`.

What its display, its keys and its files do is in ``test_view_controller.py``.
"""

from __future__ import annotations

import os
import subprocess
import sys
from contextlib import closing
from typing import TYPE_CHECKING, Any

import pytest
from rosmaster import RosMaster
from view_contract import *  # noqa: F403 - the tests
from view_contract import Camera, use_through_restarts

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    from conftest import SceneBench


class SceneCamera(Camera):
    """The camera of a ``SceneView``."""

    def __init__(self, bench: SceneBench) -> None:
        from qt_waiting import QtWaiting

        from rosglass.scene.access import access_of
        from rosglass.scene.overlays.view_control import control_of

        self._bench, self.session = bench, bench.session
        self._scene_view = bench.load("ViewControllerDisplay { animationDuration: 0.2 }")
        self._access = access_of(self._scene_view)
        self.view, self._control = self._access.view, control_of(self._scene_view)
        self.wait = QtWaiting(self._access.before_frame)
        self.view.reset()
        self.wait(lambda: self._control.services and self.services.is_open)

    @property
    def services(self) -> Any:
        return self._control.services

    def eye(self) -> tuple[float, float, float]:
        x, y, z = self._scene_view.camera().eye
        return x, y, z

    def set_fixed_frame(self, frame: str) -> None:
        self._access.fixed_frame = frame

    def set_property(self, name: str, value: Any) -> None:
        controller = self._scene_view.controller
        name, _, axis = name.partition("/")
        if axis:
            parts = dict(zip("XYZ", controller.get(name), strict=True))
            value = {**parts, axis: value}
        controller.set(name, value)

    def select_view(self, class_id: str) -> None:
        self._scene_view.select_view(class_id)

    def save_config(self, file: Path) -> None:
        self._scene_view.save_config(file)

    def load_config(self, file: Path) -> None:
        assert self._scene_view.load_config(file) == []

    def connect(self) -> None:
        self.session.init("view")


@pytest.fixture(scope="module")
def ros_master(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RosMaster]:
    with RosMaster(tmp_path_factory.mktemp("ros_home")) as master:
        yield master


@pytest.fixture(scope="module")
def master(ros_master: RosMaster) -> str:
    return ros_master.uri


@pytest.fixture
def camera(make_bench: Callable[[str], SceneBench], ros_master: RosMaster) -> Iterator[SceneCamera]:
    bench = make_bench(ros_master.url)
    yield SceneCamera(bench)
    bench.close()


CONFIG = """
Visualization Manager:
  Displays:
    - {Class: rosglass/ViewController, Name: View Controller, Enabled: true}
  Global Options: {Fixed Frame: map}
"""


def test_the_command_offers_it_also_to_another_master(app: Any, tmp_path: Path) -> None:
    config = tmp_path / "robot.rviz"
    config.write_text(CONFIG)
    with RosMaster(tmp_path / "ros") as own_master, (tmp_path / "log").open("w") as log:
        command = [sys.executable, "-m", "rosglass", "view", str(config), "--name", "rviz"]
        process = subprocess.Popen(
            [*command, "--url", own_master.url],
            env={**os.environ, "QT_QUICK_BACKEND": ""},
            stdout=log,
            stderr=log,
        )
        try:
            use_through_restarts(own_master, "/rviz/hector_view_controller")
            assert process.poll() is None
        finally:
            process.kill()
            process.wait()


def test_one_of_two_views_with_the_same_names_waits_for_the_other(
    make_bench: Callable[[str], SceneBench], ros_master: RosMaster
) -> None:
    from rosglass.scene.overlays.view_control import control_of

    with closing(make_bench(ros_master.url)) as bench:
        first = bench.load(
            "ViewControllerDisplay { }\n"
            'SceneView { objectName: "second"; width: 100; height: 100; ViewControllerDisplay { } }'
        )
        second = first.findChild(type(first), "second")
        bench.wait(lambda: first.scene.displays and second.scene.displays)
        controls = [control_of(view) for view in (first, second)]

        def find(condition: Callable[[Any], bool]) -> list[int]:
            return [
                at for at, one in enumerate(controls) if one.services and condition(one.services)
            ]

        bench.wait(lambda: find(lambda one: one.is_open) and find(lambda one: bool(one.problem)))
        (opened,), (waiting,) = find(lambda one: one.is_open), find(lambda one: bool(one.problem))
        views = (first, second)
        (display,) = views[waiting].scene.displays
        assert "Robots: " in display.statusText
        assert "/view/hector_view_controller/" in display.statusText
        # As when an interface is reloaded, which makes the new one first.
        (before,) = views[opened].scene.displays
        views[opened].scene.remove(before)
        bench.wait(lambda: find(lambda one: one.is_open) == [waiting])
        assert display.statusLevel == "ok"
