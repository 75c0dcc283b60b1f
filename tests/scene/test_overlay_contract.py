"""The object ``rviz`` over a ``SceneView``: see :mod:`overlay_contract`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest
from overlay_contract import *  # noqa: F403 - the tests
from overlay_contract import Over, Qml

import rosglass.scene

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path


class OverScene(Over):
    """A ``SceneView`` with overlays."""

    def __init__(self, bench: Any, folder: Path) -> None:
        from rosglass.scene.access import access_of

        self.bench, self._folder, self.wait = bench, folder, bench.wait
        self.view = bench.load()
        self.access = access_of(self.view)
        self.access.displays.add("rviz/Grid")
        self._count = 0

    def qml(self, text: str = "Item {}", **options: Any) -> Qml:
        self._count += 1
        file = self._folder / f"overlays{self._count}" / "Overlay.qml"
        file.parent.mkdir()
        file.write_text("import QtQuick 2.15\n" + text)
        made = rosglass.scene.add_overlay(self.view, file, **options)
        self.frames(1)
        return Qml(made, self.wait)

    def remove(self, overlay: Any) -> None:
        overlay.close()

    def frames(self, count: int) -> None:
        for _ in range(count):
            drawn = self.view.pictures_drawn()
            self.view.update()
            self.wait(lambda drawn=drawn: self.view.pictures_drawn() > drawn)

    @property
    def size(self) -> tuple[float, float]:
        return self.view.width(), self.view.height()

    @property
    def own_displays(self) -> list[str]:
        return []


@pytest.fixture
def over(bench: Any, tmp_path: Path) -> Iterator[OverScene]:
    return OverScene(bench, tmp_path)
