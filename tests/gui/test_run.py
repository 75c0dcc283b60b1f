"""``rosglass run``: what it shows, what it says when something is wrong, how it ends."""

from __future__ import annotations

import signal
import time
from typing import TYPE_CHECKING, Any

import pytest
from waiting import nothing_happens

if TYPE_CHECKING:
    from pathlib import Path

GOOD = """import QtQuick 2.15
Rectangle {
    width: 200; height: 100; color: "#204060"
    Component.onCompleted: console.log("up", width, Qt.application.arguments.slice(1))
}
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "Main.qml"


@pytest.mark.both_qt
@pytest.mark.parametrize(
    ("text", "place", "message"),
    [
        ("import QtQuick 2.15\nItem {\n  widht: 5\n}", ":3:3", 'non-existent property "widht"'),
        ("import QtQuick 2.15\nItem {\n  width: 5 5\n}", ":3:12", "Expected token"),
        ("import QtQuick 2.15\nimport No.Such.Module 1.0\nItem {}", ":2:1", "No.Such.Module"),
        ("import QtQuick 2.15\nMissing {}", ":2:1", "Missing is not a type"),
        ("", "", "File is empty"),
    ],
)
def test_errors_are_listed_with_file_line_and_column(
    start: Any, file: Path, text: str, place: str, message: str
) -> None:
    file.write_text(text)
    program = start("run", file)
    assert program.end() == 1
    assert f"{file}{place}: " in program.text
    assert message in program.text


def test_a_text_for_a_camera_is_explained(start: Any, file: Path) -> None:
    pytest.importorskip("PySide6.QtMultimedia", reason="Qt 5's own VideoOutput says it itself")
    file.write_text(
        "import QtQuick 2.15\nimport Ros2 1.0\nItem { VideoOutput { source: 'front' } }"
    )
    program = start("run", file)
    line = program.until("VideoOutput:")
    assert "the id of a camera's element, without quotes; got front" in line
    program.kill(signal.SIGTERM)
    program.end()


@pytest.mark.both_qt
def test_errors_in_other_files_name_them(start: Any, file: Path) -> None:
    file.write_text("import QtQuick 2.15\nItem { Part {} }")
    file.with_name("Part.qml").write_text("import QtQuick 2.15\nItem {\n  oops: 1\n}")
    program = start("run", file)
    assert program.end() == 1
    assert f"{file.with_name('Part.qml')}:3:3: " in program.text


def test_a_missing_file(start: Any, tmp_path: Path) -> None:
    program = start("run", tmp_path / "none.qml")
    assert program.end() == 1
    assert program.text == f"{tmp_path / 'none.qml'}: there is no such file"


@pytest.mark.both_qt
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_signals_end_it(start: Any, file: Path, number: int) -> None:
    file.write_text(GOOD)
    program = start("run", file)
    program.until("up 200")
    started = time.monotonic()
    program.kill(number)
    assert program.end() == 128 + number
    assert time.monotonic() - started < 5
    assert "Traceback" not in program.text


@pytest.mark.both_qt
def test_ctrl_c_ends_an_interface_that_hangs(start: Any, file: Path) -> None:
    file.write_text(
        """import QtQuick 2.15
        Item {
            Timer {
                running: true; interval: 1
                onTriggered: { console.log("hanging"); while (true) ; }
            }
        }"""
    )
    program = start("run", file)
    program.until("hanging")
    program.kill(signal.SIGINT)
    assert program.end() == 130
    assert "does not react" in program.text


def test_arguments_exit_codes_and_runtime_warnings(start: Any, file: Path) -> None:
    file.write_text(
        GOOD.replace(
            "width: 200",
            "Timer { running: true; interval: 50; onTriggered: { nothing.here(); } }\n"
            "Timer { running: true; interval: 90; onTriggered: Qt.exit(7) }\nwidth: 200",
        )
    )
    program = start("run", file, "--", "--speed", "3")
    program.until("up 200 [--speed,3]")
    line = program.until("nothing is not defined")
    assert line.startswith(f"{file}:3: WARNING")
    assert program.end() == 7


@pytest.mark.both_qt
def test_no_display_is_said_before_qt_aborts(start: Any, file: Path) -> None:
    file.write_text(GOOD)
    program = start("run", file, display=None)
    assert program.end() == 1
    assert "there is no display" in program.text
    assert "xvfb-run" in program.text
    program = start("run", file, display=":3999")
    assert program.end() == 1
    assert "the display :3999 does not answer" in program.text


@pytest.mark.both_qt
@pytest.mark.xvfb
@pytest.mark.parametrize("root", ["item", "window"])
def test_screenshot(start: Any, file: Path, tmp_path: Path, screen: str, root: str) -> None:
    import cv2

    text = GOOD
    if root == "window":
        text = "import QtQuick.Window 2.15\n" + GOOD.replace("Rectangle", "Window")
        text = text.replace("200", "210")
    file.write_text(text)
    target = tmp_path / "shot.png"
    program = start("run", file, "--screenshot", target, "--after", "0.6", display=screen)
    assert program.end() == 0, program.text
    picture = cv2.imread(str(target))
    assert picture.shape[:2] == (100, 210 if root == "window" else 200)
    assert picture[50, 50].tolist() == [0x60, 0x40, 0x20]


def test_offscreen_without_any_display(start: Any, file: Path, tmp_path: Path) -> None:
    from rosglass.qt import QT6

    file.write_text(GOOD)
    target = tmp_path / "shot.png"
    command = ("run", file, "--screenshot", target, "--after", "0.1")
    program = start(*command, display=None, QT_QPA_PLATFORM="offscreen")
    if QT6:
        assert program.end() == 0, program.text
        assert target.exists()
    else:
        # Qt 5 draws nothing there, and would crash when it looks for OpenGL.
        assert program.end() == 1
        assert "use a virtual screen: xvfb-run" in program.text


def test_a_screenshot_that_cannot_be_written(start: Any, file: Path, tmp_path: Path) -> None:
    file.write_text(GOOD)
    for target, error in (
        (tmp_path / "no" / "x.png", "x.png': there is no folder '"),
        (tmp_path / "x.xyz", "x.xyz': the name of a screenshot ends in .png or .jpg"),
    ):
        program = start("run", file, "--screenshot", target)
        assert program.end() == 2
        assert error in program.text
    locked = tmp_path / "locked.png"
    locked.mkdir()
    program = start("run", file, "--screenshot", locked, "--after", "0.1")
    assert program.end() == 1
    assert "could not be written" in program.text


@pytest.mark.parametrize("ending", ["Qt.quit()", "Qt.exit(7)", "nothing"])
def test_a_screenshot_that_was_not_taken_is_missed(
    start: Any, file: Path, tmp_path: Path, ending: str
) -> None:
    target = tmp_path / "shot.png"
    quits = "" if ending == "nothing" else f"Timer {{ running: true; onTriggered: {ending} }}"
    file.write_text(GOOD.replace("width: 200", f"{quits} width: 200", 1))
    program = start("run", file, "--screenshot", target, "--after", "600")
    if ending == "nothing":
        program.until("up")
        program.kill(signal.SIGTERM)
    assert program.end() == {"Qt.quit()": 1, "Qt.exit(7)": 7, "nothing": 143}[ending]
    message = f"{target} was not written: the program was ended before 600 s were over (--after)"
    assert (message in program.text) == (ending == "Qt.quit()")
    assert not target.exists()


@pytest.mark.both_qt
def test_live_reload_keeps_the_last_good_interface(start: Any, file: Path) -> None:
    part = file.with_name("Part.qml")
    file.write_text(GOOD.replace("width: 200", "Part {}\nwidth: 200"))
    part.write_text('import QtQuick 2.15\nItem { Component.onCompleted: console.log("part 1") }')
    program = start("run", file, "--watch")
    program.until("part 1")
    part.write_text('import QtQuick 2.15\nItem { Component.onCompleted: console.log("part 2") }')
    program.until("part 2")
    program.until("reloaded")
    part.write_text("import QtQuick 2.15\nItem {\n  oops: 1\n}")
    assert f"{part}:3:3: " in program.until("oops")
    # Editors save by renaming a new file over the old one.
    new = part.with_suffix(".tmp")
    new.write_text('import QtQuick 2.15\nItem { Component.onCompleted: console.log("part 3") }')
    new.replace(part)
    program.until("part 3")
    program.until("reloaded")
    file.with_name("New.qml").write_text("import QtQuick 2.15\nItem { }")
    file.write_text(GOOD.replace("width: 200", "New {}\nwidth: 333"))
    program.until("up 333")
    program.kill(signal.SIGINT)
    assert program.end() == 130


def test_a_watched_file_may_have_errors_at_first(start: Any, file: Path) -> None:
    file.write_text("import QtQuick 2.15\nItem { oops: 1 }")
    program = start("run", file, "--watch")
    assert f"{file}:2:8: " in program.until("oops")
    file.write_text(GOOD)
    program.until("up 200")
    program.until("reloaded")
    program.kill(signal.SIGINT)
    assert program.end() == 130


def test_other_files_than_qml_are_refused(start: Any, tmp_path: Path) -> None:
    (tmp_path / "Main.qml").write_text(GOOD)
    program = start("run", tmp_path)
    assert program.end() == 1
    assert program.text == f"{tmp_path}: this is a folder; name a file in it: Main.qml"
    program = start("run", "package://nowhere/Main.qml")
    assert program.end() == 1
    assert "there is no package 'nowhere'" in program.text
    program = start("run", tmp_path / "Main.qml", "-I", tmp_path / "none")
    assert program.end() == 1
    assert "there is no such folder to import QML modules from" in program.text


@pytest.mark.both_qt
@pytest.mark.parametrize("number", [1, 2])
def test_closing_windows_ends_it(start: Any, file: Path, number: int) -> None:
    """The last of windows of equal rank counts; those that a window has opened do not."""
    file.write_text(
        """import QtQuick 2.15
        import QtQuick.Window 2.15
        import QtQml 2.15
        QtObject {
            property var first: Window {
                id: first
                visible: true
                Window { visible: true; title: "a dialog" }
            }
            property var second: Window { id: second; visible: NUMBER == 2 }
            property var one: Timer { running: true; interval: 300; onTriggered: first.close() }
            property var two: Timer {
                running: true; interval: 900
                onTriggered: { console.log("still here"); second.close() }
            }
        }""".replace("NUMBER", str(number))
    )
    program = start("run", file)
    assert program.end(40) == 0
    assert ("still here" in program.text) is (number == 2)


@pytest.mark.both_qt
@pytest.mark.xvfb
def test_a_kiosk_ignores_the_window_manager(start: Any, file: Path, screen: str) -> None:
    # What a window manager sends for Alt-F4 reaches Qt as a close event.
    file.write_text(
        """import QtQuick 2.15
        import QtQuick.Window 2.15
        Window {
            id: window
            visible: true
            Timer { running: true; interval: 200; onTriggered: window.close() }
            Timer {
                running: true; interval: 600
                onTriggered: console.log("open", window.visible, window.visibility)
            }
            Timer { running: true; interval: 900; onTriggered: Qt.quit() }
        }"""
    )
    program = start("run", file, "--kiosk", display=screen)
    assert program.until("open").endswith("open true 5")
    assert program.end() == 0


@pytest.mark.both_qt
@pytest.mark.xvfb
def test_fullscreen_fills_a_screen_without_a_window_manager(
    start: Any, file: Path, screen: str
) -> None:
    file.write_text(
        """import QtQuick 2.15
        import QtQuick.Window 2.15
        Window {
            visible: true; width: 320; height: 200
            Timer {
                running: true; interval: 600
                onTriggered: {
                    console.log("fills", width === Screen.width, height === Screen.height)
                    Qt.quit()
                }
            }
        }"""
    )
    program = start("run", file, "--fullscreen", display=screen)
    assert program.until("fills").endswith("fills true true")
    assert program.end() == 0


def test_without_watch_nothing_is_reloaded(start: Any, file: Path) -> None:
    file.write_text(GOOD)
    program = start("run", file)
    program.until("up 200")
    file.write_text(GOOD.replace("200", "201"))
    nothing_happens(0.5)
    assert "201" not in program.text


def test_address_without_a_listener_is_shown(start: Any, file: Path) -> None:
    file.write_text(
        """import QtQuick 2.15
        import Ros2 1.0
        Item {
            Component.onCompleted: Ros2.init("ui")
            Connections { target: Ros2; function onConnectionChanged() {
                console.log("state", Ros2.connectionState, Ros2.connectionDetail, Ros2.getName())
            } }
        }"""
    )
    program = start("run", file, "--url", "zenoh://127.0.0.1:9", "--name", "mine")
    line = program.until("state connecting no answer from tcp/127.0.0.1:9, trying again")
    assert line.endswith("mine")
    program.kill(signal.SIGINT)
    assert program.end() == 130
    assert "rosglass.qml: uninitialized" not in program.text, "who ends it knows"


def test_bad_urls_are_shown(start: Any, file: Path) -> None:
    file.write_text(
        """import QtQuick 2.15
        import Ros2 1.0
        Item {
            Component.onCompleted: Ros2.init("ui")
            property string s: Ros2.connectionState
            onSChanged: if (s == "failed") {
                console.log("failed:", Ros2.connectionDetail)
                Qt.exit(5)
            }
        }"""
    )
    program = start("run", file, "--url", "carrier-pigeon://loft")
    assert "unknown scheme" in program.until("failed:")
    assert program.end() == 5


@pytest.mark.parametrize(
    ("url", "reason"),
    [("zenho://robot", "did you mean zenoh?"), ("ros1://robot?anonymus=true", "anonymous")],
)
def test_a_url_that_can_never_work_ends_it(start: Any, file: Path, url: str, reason: str) -> None:
    file.write_text(
        """import QtQuick 2.15
        import Ros2 1.0
        Item { Component.onCompleted: Ros2.init("ui") }"""
    )
    program = start("run", file, "--url", url)
    assert program.end() == 1
    errors = [line for line in program.lines if url in line and "connecting to" not in line]
    assert len(errors) == 1, program.text
    assert reason in errors[0]


@pytest.mark.both_qt
def test_a_program_of_rosglass_reads_no_sources(python: Any) -> None:
    # PySide looks for its features in those of all modules.
    text = (
        "import linecache\n"
        "from rosglass.cli.run import load_qt\n"
        "load_qt()\n"
        "import rosglass.qml.run.application, rosglass.qml.elements.ros2\n"
        "print(sorted(file for file in linecache.cache if 'rosglass' in file))"
    )
    program = python(text)
    assert program.end() == 0
    assert program.text.strip() == "[]"
