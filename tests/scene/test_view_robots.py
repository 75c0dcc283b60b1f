"""A scene's camera, moved by robots of ROS 1 and ROS 2: see :mod:`view_contract`.

What its display, its keys and its files do is in ``test_view_controller.py``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest
from rosmaster import RosMaster
from view_contract import *  # noqa: F403 - the tests
from view_contract import Camera

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    from conftest import SceneBench


class SceneCamera(Camera):
    """The camera of a ``SceneView``."""

    def __init__(self, bench: SceneBench) -> None:
        from qt_waiting import QtWaiting

        from rosglass.scene.access import access_of
        from rosglass.scene.view_control import control_of

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
