"""Widget overlays paint only their changed parts."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray


class Kept:
    """Makes an overlay keep the image that it drew last."""

    def draw(self) -> Any:
        drawn = super().draw()  # type: ignore[misc]
        if drawn is not None:
            self.pixels = drawn
        return drawn


@pytest.fixture
def lights(
    app: Any, wait: Callable[..., None], frames: Callable[[int], None]
) -> Callable[..., Any]:
    """Show three squares that count the pixels that they are asked to paint."""
    from rosglass.rviz import WidgetOverlay
    from rosglass.rviz.qt5 import QtGui, QtWidgets

    class Light(QtWidgets.QWidget):  # type: ignore[misc]
        colour, painted = "red", 0

        def paintEvent(self, event: Any) -> None:  # noqa: N802 - Qt's
            self.painted += sum(r.width() * r.height() for r in event.region().rects())
            painter = QtGui.QPainter(self)
            painter.fillRect(self.rect(), QtGui.QColor(self.colour))
            painter.end()

    class Lights(Kept, WidgetOverlay):
        def setup(self, root: Any) -> None:
            self.lights = [Light(root) for _ in range(3)]
            for light, place in zip(self.lights, ((10, 10), (300, 200), (20, 260)), strict=True):
                light.setGeometry(*place, 101, 51)
            self.label = QtWidgets.QLabel("shadow", root)
            self.label.setGeometry(150, 90, 90, 20)
            effect = QtWidgets.QGraphicsDropShadowEffect(self.label)
            effect.setBlurRadius(12)
            self.label.setGraphicsEffect(effect)
            self.combo = QtWidgets.QComboBox(root)
            self.combo.addItems(["one", "two", "three"])
            self.combo.move(150, 130)
            for child in (*self.lights, self.label, self.combo):
                child.show()

        def count(self) -> list[int]:
            frames(3)
            wait.frames(1)
            frames(2)
            counts = [light.painted for light in self.lights]
            for light in self.lights:
                light.painted = 0
            return counts

    def show(**options: Any) -> Any:
        overlay = app.add(Lights(**options))
        overlay.count()
        return overlay

    return show


def test_only_changed_parts_are_painted_and_compared(
    lights: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    from rosglass.rviz.layer import Layer

    overlay = lights()
    updates: list[Any] = []
    update = Layer.update
    monkeypatch.setattr(
        Layer, "update", lambda self, *a: updates.append((a[1], update(self, *a))) or updates[-1][1]
    )
    assert overlay.count() == [0, 0, 0]
    assert updates == []
    overlay.lights[1].colour = "blue"
    overlay.lights[1].update(10, 10, 8, 8)
    counts = overlay.count()
    # Qt adds a margin of a few pixels.
    assert 64 <= counts[1] <= 16 * 16
    assert counts[0] == counts[2] == 0
    within, uploaded = updates[-1]
    assert sum(rect.area for rect in within) <= 16 * 16
    assert 1 <= sum(rect.area for rect in uploaded) <= 24 * 24
    for light in overlay.lights[::2]:
        light.colour = "lime"
        light.update()
    counts = overlay.count()
    assert counts[0] >= 101 * 51
    assert counts[2] >= 101 * 51


@pytest.mark.parametrize("scale", [1.0, 0.7, 1.5])
def test_painting_in_parts_gives_the_same_frame(lights: Callable[..., Any], scale: float) -> None:
    overlay = lights(scale=scale)

    def picture() -> NDArray[np.uint32]:
        overlay.count()
        return np.array(overlay.pixels)

    def change_light() -> None:
        overlay.lights[0].colour = "blue"
        overlay.lights[0].update()

    steps: list[Callable[[], Any]] = [
        change_light,
        lambda: overlay.lights[1].move(33, 47),
        lambda: overlay.label.setText("other shadow"),
        lambda: overlay.label.move(140, 70),
        overlay.lights[2].hide,
        lambda: overlay.lights[2].setGeometry(200, 10, 33, 201),
        overlay.lights[2].show,
        overlay.combo.showPopup,
        overlay.combo.hidePopup,
        lambda: overlay.combo.setCurrentIndex(2),
        lambda: overlay.root.setStyleSheet("QLabel { background: #8000ff00; border-radius: 5px }"),
    ]
    before = picture()
    for step in steps:
        step()
        parts = picture()
        height, width = overlay.pixels.shape
        overlay.resize(width, height, scale)
        overlay.changed.emit()
        whole = picture()
        np.testing.assert_array_equal(parts, whole)
    assert (before != whole).any()


@pytest.mark.parametrize("scale", [4.0, 0.4])
def test_text_is_as_sharp_as_text_of_the_size_that_it_is_seen_in(
    app: Any, frames: Callable[[int], None], scale: float
) -> None:
    from rosglass.rviz import WidgetOverlay
    from rosglass.rviz.qt5 import QtGui, QtWidgets

    class Text(Kept, WidgetOverlay):
        pass

    def ink(size: float, scale: float) -> NDArray[np.float64]:
        label = QtWidgets.QLabel("Wik")
        font = QtGui.QFont()
        font.setPixelSize(round(size))
        font.setHintingPreference(QtGui.QFont.PreferNoHinting)
        label.setFont(font)
        root = QtWidgets.QWidget()
        label.setParent(root)
        label.setGeometry(0, 0, round(4 * size), round(2 * size))
        overlay = app.add(Text(root, "Text", scale=scale))
        frames(4)
        pixels = np.array(overlay.pixels >> 24, np.float64)
        app.overlays.remove(overlay)
        return pixels

    wanted = ink(64, 1.0)
    seen = ink(64 / scale, scale)
    plain = ink(64 / scale, 1.0)
    height, width = wanted.shape
    rows, columns = (np.minimum(np.arange(n) / scale, n - 1).astype(int) for n in (height, width))
    stretched = plain[np.ix_(rows, columns)]
    part = np.s_[: 2 * 64, : 4 * 64]
    assert wanted[part].max() == 255
    blur = np.abs(stretched[part] - wanted[part]).mean()
    assert np.abs(seen[part] - wanted[part]).mean() < 0.25 * blur
