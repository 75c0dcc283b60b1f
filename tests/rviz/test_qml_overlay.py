"""QML drawn over RViz's 3D view."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pathlib import Path


def test_translucent_colours_are_blended_right(app: Any, grab: Any, tmp_path: Path) -> None:
    file = tmp_path / "Blend.qml"
    file.write_text(
        "import QtQuick 2.15\n"
        'Item { Rectangle { x: 40; y: 30; width: 100; height: 60; color: "#800080ff" } }\n'
    )
    app.add_qml(file)
    picture = grab()
    seen = picture.pixelColor(90, 60)
    # Half of (0, 128, 255) and half of RViz's own grey; the reference gave (24, 56, 88).
    assert all(abs(a - b) <= 1 for a, b in zip(seen.getRgb()[:3], (24, 88, 152), strict=True))
    assert picture.pixelColor(30, 60).getRgb()[:3] == (48, 48, 48)
