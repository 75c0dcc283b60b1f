"""The object ``rviz`` over RViz: see :mod:`overlay_contract`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest
from overlay_contract import *  # noqa: F403 - the tests
from overlay_contract import Over, Qml

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator


class OverRviz(Over):
    """RViz with overlays."""

    def __init__(self, app: Any, wait: Any, show: Callable[..., Qml]) -> None:
        self._app, self.wait, self.qml = app, wait, show  # type: ignore[method-assign]
        self.access = app.rviz

    def qml(self, text: str = "Item {}", **options: Any) -> Qml:
        raise NotImplementedError

    def remove(self, overlay: Any) -> None:
        self._app.overlays.remove(overlay)

    def frames(self, count: int) -> None:
        self.wait.frames(count)

    @property
    def size(self) -> tuple[float, float]:
        panel = self._app.window.panel
        return panel.width(), panel.height()

    @property
    def own_displays(self) -> list[str]:
        return [overlay.name for overlay in self._app.overlays]


@pytest.fixture
def over(app: Any, wait: Any, displays: Any, qml: Callable[..., Qml]) -> Iterator[OverRviz]:
    made = OverRviz(app, wait, qml)
    yield made
    app.rviz.view.track("")
    app.rviz.view.settings.load({})
    app.rviz.fixed_frame = "map"
