"""Widgets drawn over RViz's 3D view."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path


@pytest.fixture
def panel(app: Any, hand: Any) -> Any:
    """An overlay with a few widgets."""
    from rosglass.rviz import WidgetOverlay
    from rosglass.rviz.qt5 import QtCore, QtWidgets

    class Panel(WidgetOverlay):
        def setup(self, root: Any) -> None:
            self.clicks = 0
            layout = QtWidgets.QVBoxLayout(root)
            layout.setAlignment(QtCore.Qt.AlignTop | QtCore.Qt.AlignLeft)
            self.button = QtWidgets.QPushButton("Press")
            self.button.clicked.connect(self.count)
            self.first, self.second = QtWidgets.QLineEdit(), QtWidgets.QLineEdit()
            self.combo = QtWidgets.QComboBox()
            self.combo.addItems(["one", "two", "three"])
            self.text = QtWidgets.QPlainTextEdit("\n" * 200)
            self.slider = QtWidgets.QSlider(QtCore.Qt.Horizontal)
            self.label = QtWidgets.QLabel("only text")
            for widget in (
                self.button, self.first, self.second, self.combo, self.text, self.slider,
                self.label,
            ):  # fmt: skip
                widget.setFixedWidth(160)
                layout.addWidget(widget)
            self.text.setFixedHeight(80)

        def count(self) -> None:
            self.clicks += 1

    overlay = app.add(Panel())
    hand.wait.frames(6)
    return overlay


def middle(widget: Any) -> tuple[float, float]:
    at = widget.mapTo(widget.window(), widget.rect().center())
    return at.x(), at.y()


def test_widgets_are_operated_and_gaps_are_rvizs(hand: Any, panel: Any, view: Any) -> None:
    yaw, distance = view("Yaw"), view("Distance")
    hand.click(*middle(panel.button))
    assert panel.clicks == 1
    x, y = middle(panel.slider)
    hand.drag(x, y, x + 60, y)
    assert panel.slider.value() > 0
    hand.wheel(*middle(panel.text), up=False)
    assert panel.text.verticalScrollBar().value() > 0
    assert (view("Yaw"), view("Distance")) == (yaw, distance)
    hand.wheel(*middle(panel.label))
    assert view("Distance") < distance
    hand.drag(400, 300, 500, 300)
    assert view("Yaw") != yaw
    yaw = view("Yaw")
    x, y = middle(panel.label)
    hand.drag(x, y, x + 200, y)
    assert view("Yaw") != yaw


def test_keys_tab_and_focus(hand: Any, app: Any, panel: Any) -> None:
    hand.click(*middle(panel.first))
    assert panel.first.hasFocus()
    hand.key("m")
    hand.key("Tab")
    assert panel.second.hasFocus()
    hand.key("s")
    assert (panel.first.text(), panel.second.text()) == ("m", "s")
    hand.key("shift+Tab")
    assert panel.first.hasFocus()
    hand.click(400, 400)
    assert not panel.first.hasFocus()
    hand.key("m")
    assert panel.first.text() == "m"


def test_combo_box_opens_in_the_overlay(hand: Any, panel: Any) -> None:
    hand.click(*middle(panel.combo))
    hand.wait(lambda: panel.combo.view().isVisible())
    hand.key("Down", "Return")
    hand.wait(lambda: panel.combo.currentIndex() == 1)


def test_cursor_is_the_widgets(hand: Any, app: Any, panel: Any) -> None:
    from rosglass.rviz.qt5 import QtCore

    hand.move(*middle(panel.first))
    assert app.window.panel.cursor().shape() == QtCore.Qt.IBeamCursor
    hand.move(400, 400)
    assert app.window.panel.cursor().shape() != QtCore.Qt.IBeamCursor


def test_ignore_wheel_events(hand: Any, panel: Any, view: Any) -> None:
    distance = view("Distance")
    panel.text.setProperty("IgnoreWheelEvents", True)
    hand.wheel(*middle(panel.text))
    assert view("Distance") < distance


def test_nothing_is_painted_when_nothing_changed(app: Any, panel: Any, grab: Any) -> None:
    grab()
    drawn: list[Any] = []
    draw = panel.draw
    panel.draw = lambda: drawn.append(draw())
    grab()
    assert not drawn
    panel.slider.setValue(50)
    grab()
    assert drawn


@pytest.mark.parametrize("where", ["paintEvent", "slot"])
def test_errors_of_a_widget_are_reported(
    hand: Any, app: Any, grab: Any, where: str, caplog: pytest.LogCaptureFixture
) -> None:
    from rosglass.rviz import WidgetOverlay
    from rosglass.rviz.qt5 import QtWidgets

    class Bad(QtWidgets.QPushButton):  # type: ignore[misc]
        def paintEvent(self, event: Any) -> None:  # noqa: N802
            if where == "paintEvent":
                raise ValueError("cannot paint")
            super().paintEvent(event)

    def fail() -> None:
        raise ValueError("cannot do")

    button = Bad("x")
    button.clicked.connect(fail)
    overlay = app.add(WidgetOverlay(button, "Bad"))
    grab()
    hand.click(100, 100)
    assert "ValueError: cannot" in overlay.problem
    assert "test_widgets.py" in overlay.problem
    assert "overlay Bad" in caplog.text


def test_style_sheets(app: Any, panel: Any, wait: Callable[..., None], tmp_path: Path) -> None:
    from rosglass.rviz import WidgetOverlay
    from rosglass.rviz.qt5 import QtGui, QtWidgets

    def colour(label: Any) -> str:
        label.ensurePolished()
        name: str = label.palette().color(QtGui.QPalette.WindowText).name()
        return name

    panel.style_sheet = "QLabel { color: #ff0000 }"
    assert colour(panel.label) == "#ff0000"
    file = tmp_path / "look.qss"
    file.write_text("QLabel { color: #00ff00; image: url(a.png) }")
    label = QtWidgets.QLabel("styled")
    watching = app.add(WidgetOverlay(label, "Styled", style_sheet=str(file), watch=True))
    assert colour(label) == "#00ff00"
    assert f'url("{tmp_path}/a.png")' in label.styleSheet()
    file.write_text("QLabel { color: #0000ff }")
    wait(lambda: colour(label) == "#0000ff")
    file.write_text("QLabel { color: #0000ff")
    wait(lambda: "look.qss" in watching.problem)
    assert colour(label) == "#0000ff"
    watching.style_sheet = str(tmp_path / "none.qss")
    assert "none.qss" in watching.problem


def test_other_objects_than_widgets_are_refused(app: Any) -> None:
    from rosglass import Error
    from rosglass.rviz import WidgetOverlay
    from rosglass.rviz.qt5 import QtWidgets

    with pytest.raises(Error, match="is not a QWidget"):
        WidgetOverlay(lambda: 5, "Five")
    outer = QtWidgets.QWidget()
    with pytest.raises(Error, match="pass one without a parent"):
        WidgetOverlay(QtWidgets.QLabel(outer), "Inner")
    with pytest.raises(Error, match="No such file"):
        WidgetOverlay(QtWidgets.QLabel, style_sheet="none.qss".upper())
    shown = WidgetOverlay(outer, "Outer")
    with pytest.raises(Error, match="another overlay shows the widget already"):
        WidgetOverlay(outer, "Outer 2")
    shown.close()


def test_other_objects_than_overlays_are_refused(app: Any) -> None:
    from rosglass import Error
    from rosglass.rviz import Overlay, WidgetOverlay

    class Nameless(WidgetOverlay):
        def __init__(self) -> None:
            self.ready = True

    with pytest.raises(Error, match=r"overlay Nameless: its __init__ must call super\(\)"):
        app.add(Nameless())
    with pytest.raises(Error, match=r"got the class; create an instance: Nameless\(\)"):
        app.add(Nameless)
    with pytest.raises(Error, match=r"got 'panel'; use WidgetOverlay\(widget\)"):
        app.add("panel")
    for option in ("z", "scale", "opacity"):
        with pytest.raises(Error, match=f"overlay Top: {option} .*'high'"):
            Overlay("Top", **{option: "high"})


def test_errors_of_slots_are_reported_at_any_time(
    app: Any, wait: Callable[..., None], caplog: pytest.LogCaptureFixture
) -> None:
    from rosglass.rviz import WidgetOverlay
    from rosglass.rviz.qt5 import QtCore, QtWidgets

    class Clock(QtWidgets.QLabel):  # type: ignore[misc]
        def __init__(self) -> None:
            super().__init__("clock")
            self.timer = QtCore.QTimer()
            self.timer.timeout.connect(self.tick)

        def tick(self) -> None:
            raise ValueError("no time")

    class Panel(WidgetOverlay):
        def setup(self, root: Any) -> None:
            self.clock = Clock()
            QtWidgets.QVBoxLayout(root).addWidget(self.clock)
            self.clock.timer.timeout.connect(self.count)

        def count(self) -> None:
            raise KeyError("count")

    panel, other = app.add(Panel()), app.add(WidgetOverlay(QtWidgets.QLabel("x"), "Other"))
    panel.clock.timer.start(30)
    wait(lambda: "no time" in caplog.text and "KeyError" in caplog.text)
    assert "test_widgets.py" in panel.problem
    assert other.problem == ""
    panel.clock.timer.stop()

    def fail() -> None:
        raise RuntimeError("without overlay")

    QtCore.QTimer.singleShot(0, fail)
    wait(lambda: "RuntimeError: without overlay" in caplog.text)
    assert "test_widgets.py" in caplog.text.split("without overlay")[0].splitlines()[-1]
    assert other.problem == ""
