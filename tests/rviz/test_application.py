"""RViz from Python: its config files, full screen, menus, and screenshots."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from rosglass.errors import Error

if TYPE_CHECKING:
    from pathlib import Path

CONTENT = 'import QtQuick 2.15\nItem { Rectangle { width: 50; height: 40; color: "red" } }\n'


def test_config_files_are_saved_and_loaded(app: Any, tmp_path: Path) -> None:
    signals: list[Any] = []
    app.window.config_loading.connect(lambda: signals.append("loading"))
    app.window.config_loaded.connect(signals.append)
    app.fixed_frame = "odom"
    app.save_config(tmp_path / "a.rviz")
    assert signals == []
    app.fixed_frame = "base"
    app.load_config(tmp_path / "a.rviz")
    assert app.fixed_frame == "odom"
    assert signals == ["loading", str(tmp_path / "a.rviz")]
    assert app.window.config == str(tmp_path / "a.rviz")
    # Without a name, where it came from.
    app.fixed_frame = "arm"
    app.save_config()
    assert "Fixed Frame: arm" in (tmp_path / "a.rviz").read_text()
    assert not app.window.modified


@pytest.mark.parametrize("content", ["a: [1,\n b: }", "hello", "", "Panels: []"])
def test_broken_config_files_change_nothing(app: Any, tmp_path: Path, content: str) -> None:
    file = tmp_path / "broken.rviz"
    file.write_text(content)
    before = app.window.config, app.fixed_frame
    with pytest.raises(Error, match=r"broken\.rviz"):
        app.load_config(file)
    assert (app.window.config, app.fixed_frame) == before


def test_config_files_that_cannot_be_written(app: Any, tmp_path: Path) -> None:
    with pytest.raises(Error, match=r"none/a\.rviz: RViz could not save"):
        app.save_config(tmp_path / "none" / "a.rviz")


@pytest.mark.parametrize("frame", ["", "/map", " map"])
def test_names_that_no_frame_has(app: Any, frame: str) -> None:
    with pytest.raises(Error, match="expected the name of a frame"):
        app.fixed_frame = frame


def test_full_screen(app: Any, wait: Any) -> None:
    changes: list[bool] = []
    app.window.fullscreen_changed.connect(changes.append)
    app.window.fullscreen = True
    wait(lambda: app.window.fullscreen)
    assert not app.window.widget.menuBar().isVisible()
    app.window.fullscreen = False
    wait(lambda: not app.window.fullscreen)
    assert changes == [True, False]


def whole_view(app: Any) -> bool:
    """Return whether the 3D view fills the window."""
    return bool(app.window.panel.size() == app.window.widget.size())


def test_the_3d_view_alone(app: Any, wait: Any, hand: Any, tmp_path: Path) -> None:
    window = app.window
    app.save_config(tmp_path / "a.rviz")
    wait(lambda: window.widget.menuBar().isVisible() and not whole_view(app))
    window.bare.on = True
    wait(lambda: whole_view(app))
    assert not window.modified
    # It is saved as it was: another RViz is to have its menus and panels.
    app.save_config(tmp_path / "b.rviz")
    assert (tmp_path / "b.rviz").read_text() == (tmp_path / "a.rviz").read_text()
    app.load_config(tmp_path / "b.rviz")
    wait(lambda: whole_view(app))
    window.fullscreen = True
    wait(lambda: window.fullscreen)
    window.fullscreen = False
    wait(lambda: not window.fullscreen)
    wait(lambda: whole_view(app))
    # A problem with the master is shown all the same.
    window.bare.warn(True)
    wait(lambda: window.widget.statusBar().isVisible() and not whole_view(app))
    window.bare.warn(False)
    wait(lambda: whole_view(app))
    hand.click(300, 300)
    hand.key("F10")
    wait(lambda: window.widget.menuBar().isVisible() and not window.bare.on)
    assert window.widget.statusBar().isVisible()
    app.save_config(tmp_path / "c.rviz")
    assert (tmp_path / "c.rviz").read_text() == (tmp_path / "a.rviz").read_text()


def test_menus_in_the_menu_bar(app: Any) -> None:
    menu = app.window.menu("&Robot")
    menu.addAction("Dock")
    assert app.window.menu("Robot") is menu
    shown = [action.text().replace("&", "") for action in app.window.widget.menuBar().actions()]
    assert shown[0] == "File"
    assert shown[-2:] == ["Robot", "Help"]
    assert "Quit" in [a.text().replace("&", "") for a in app.window.menu("File").actions()]


def test_the_master_url_has_its_host_name(app: Any, master: str) -> None:
    assert app.session.url == master.replace("http:", "ros1:").rstrip("/")


def test_overlays_get_names_of_their_own(app: Any, tmp_path: Path) -> None:
    file = tmp_path / "Panel.qml"
    file.write_text(CONTENT)
    assert [app.add_qml(file).name for _ in range(3)] == ["Panel", "Panel 2", "Panel 3"]
    with pytest.raises(Error, match="there is an overlay 'Panel' already"):
        app.add_qml(file, "Panel")
    assert len(list(app.overlays)) == 3


def test_screenshots_of_the_window(app: Any, grab: Any, tmp_path: Path) -> None:
    from rosglass.qt import QtGui

    file = tmp_path / "Panel.qml"
    file.write_text(CONTENT)
    app.add_qml(file)
    grab()
    app.screenshot(tmp_path / "a.png")
    picture = QtGui.QImage(str(tmp_path / "a.png"))
    window, view = app.window.widget, app.window.panel
    assert (picture.width(), picture.height()) == (window.width(), window.height())
    corner = view.mapTo(window, view.rect().topLeft())
    assert picture.pixelColor(corner.x() + 10, corner.y() + 10).name() == "#ff0000"
    with pytest.raises(Error, match=r"a\.nothing"):
        app.screenshot(tmp_path / "a.nothing")


def test_exceptions_in_slots_of_rviz_are_logged(app: Any, caplog: Any) -> None:
    from rosglass.rviz.host import pyqt

    core = pyqt()

    class Sender(core.QObject):  # type: ignore[misc]
        sent = core.pyqtSignal()

    def fails() -> None:
        raise ValueError("in a slot")

    sender = Sender()
    sender.sent.connect(fails)
    sender.sent.emit()
    assert "ValueError: in a slot" in caplog.text


def test_a_second_rviz_is_refused(app: Any) -> None:
    with pytest.raises(Error, match="cannot be restarted"):
        type(app)()


def test_closing_the_window_can_be_cancelled(
    app: Any, wait: Any, rviz_notices_changes: Any
) -> None:
    from rosglass.qt import QtCore
    from rosglass.rviz.qt5 import QtWidgets

    closings: list[int] = []
    app.window.closing.connect(lambda: closings.append(1))
    asked: list[str] = []

    def say_no() -> None:
        box = app.qt.activeModalWidget()
        asked.append(box.text())
        box.button(QtWidgets.QMessageBox.Cancel).click()

    wait(rviz_notices_changes)  # RViz takes nothing for a change within a second after loading
    app.window.widget.setWindowModified(True)
    QtCore.QTimer.singleShot(300, say_no)
    assert not app.window.widget.close()
    assert asked == ["There are unsaved changes."]
    assert app.window.widget.isVisible()
    assert closings == []
    app.window.widget.setWindowModified(False)
