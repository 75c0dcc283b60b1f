"""RViz's camera, moved by robots: see :mod:`view_contract`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest
from view_contract import *  # noqa: F403 - the tests
from view_contract import Camera

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path


class RvizCamera(Camera):
    """RViz's camera."""

    no_frames = ("", "nowhere_at_all")

    def __init__(self, app: Any, view: Any, wait: Any, eye: Callable[[], Any]) -> None:
        self._app, self.view, self.session, self.wait = app, view, app.session, wait
        self.eye = eye  # type: ignore[method-assign]
        self._manager = app.window.manager

    @property
    def services(self) -> Any:
        return self._app.view_services

    def eye(self) -> tuple[float, float, float]:
        raise NotImplementedError

    def set_fixed_frame(self, frame: str) -> None:
        self._manager.setFixedFrame(frame)

    def set_property(self, name: str, value: Any) -> None:
        found = self._manager.getViewManager().getCurrent()
        for part in name.split("/"):
            found = found.subProp(part)
        found.setValue(value)

    def select_view(self, class_id: str) -> None:
        self._manager.getViewManager().setCurrentViewControllerType(class_id)

    def save_config(self, file: Path) -> None:
        self._app.save_config(file)

    def load_config(self, file: Path) -> None:
        self._app.load_config(file)

    def connect(self) -> None:
        self._app.connect()


@pytest.fixture
def camera(app: Any, steered: Any, wait: Any, eye: Callable[[], Any]) -> RvizCamera:
    return RvizCamera(app, steered, wait, eye)
