"""``rosglass.qml.Application`` and :func:`install` in programs of their own, as documented."""

from __future__ import annotations

import re
import signal
from pathlib import Path
from typing import Any

import pytest

from rosglass.qt import BINDING, QT6

pytestmark = pytest.mark.both_qt

ROOT = Path(__file__).parents[2]
HEAD = "import sys\nfrom rosglass.qml import Application, Session, install\n"
WAITING = """import QtQuick 2.15
Item { Timer { running: true; interval: 100; onTriggered: console.warn("shown") } }"""


def test_context_own_types_import_paths_and_exit_code(python: Any, tmp_path: Path) -> None:
    module = tmp_path / "modules" / "Parts"
    module.mkdir(parents=True)
    (module / "qmldir").write_text("module Parts\nPart 1.0 Part.qml\n")
    (module / "Part.qml").write_text("import QtQml 2.15\nQtObject { property int n: 3 }")
    (tmp_path / "Main.qml").write_text(
        """import QtQuick 2.15
        import Mine 1.0
        import Parts 1.0
        Item {
            property var part: Part {}
            property var motor: Motor { speed: 4 }
            Component.onCompleted: {
                arm.move(part.n * motor.speed + offset)
                Qt.exit(arm.moved)
            }
        }"""
    )
    program = python(
        HEAD
        + f"""
from rosglass.qt import Property, QtCore, QtQml, Signal, Slot

class Motor(QtCore.QObject):
    changed = Signal()
    def __init__(self, parent=None):
        super().__init__(parent)
        self._speed = 0
    def _set(self, speed):
        self._speed = speed
    speed = Property(int, lambda self: self._speed, _set, notify=changed)

class Arm(QtCore.QObject):
    changed = Signal()
    by = 0
    @Slot(int)
    def move(self, by):
        self.by = by
    moved = Property(int, lambda self: self.by, notify=changed)

QtQml.qmlRegisterType(Motor, "Mine", 1, 0, "Motor")
app = Application({str(tmp_path / "Main.qml")!r}, context={{"arm": Arm(), "offset": 5}},
                  import_paths=[{str(tmp_path / "modules")!r}])
print("window before:", app.window)
app.load()
print("window after:", type(app.window).__name__, len(app.windows))
code = app.run()
print("code", code)
try:
    app.run()
except Exception as error:
    print(type(error).__name__, error)
sys.exit(code)
"""
    )
    assert program.end(40) == 17, program.text
    assert "window before: None" in program.text
    assert "window after: QQuickWindow 1" in program.text
    assert "code 17" in program.text
    assert "Error this application has been closed; make another one" in program.text


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_signals_return_from_run(python: Any, tmp_path: Path, number: int) -> None:
    (tmp_path / "Main.qml").write_text(WAITING)
    program = python(HEAD + f"print('ended', Application({str(tmp_path / 'Main.qml')!r}).run())")
    program.until("shown", 40)
    program.kill(number)
    assert program.end() == 0
    assert f"ended {128 + number}" in program.text


def test_errors_are_raised_with_their_place(python: Any, tmp_path: Path) -> None:
    (tmp_path / "Main.qml").write_text("import QtQuick 2.15\nItem { widht: 5 }")
    program = python(
        HEAD
        + f"""
import threading
from rosglass import Error
file = {str(tmp_path / "Main.qml")!r}
def attempt(job):
    try:
        job()
    except Error as error:
        print(type(error).__name__, error)
attempt(lambda: Application(file).run())
attempt(lambda: Application("none.qml"))
attempt(lambda: Application(file, context={{"Big": 1}}))
attempt(lambda: Application(file, session=Session(), url="zenoh://x"))
attempt(lambda: Application(file, import_paths=["nowhere"]))
thread = threading.Thread(target=attempt, args=[lambda: Application(file)])
thread.start()
thread.join()
"""
    )
    assert program.end(40) == 0, program.text
    for expected in (
        f"QmlError {tmp_path / 'Main.qml'}:2:8: ",
        "QmlError none.qml: there is no such file",
        "Error context: QML cannot use the name 'Big'",
        "Error give either a session, or url, name and ros_arguments",
        "QmlError nowhere: there is no such folder to import QML modules from",
        "Error a user interface must be made in the main thread",
    ):
        assert expected in program.text


def test_two_after_one_another_share_a_given_session(python: Any, tmp_path: Path) -> None:
    (tmp_path / "Main.qml").write_text(
        """import QtQuick 2.15
        import Ros2 1.0
        Item { Component.onCompleted: { Ros2.init("ui"); Qt.exit(3) } }"""
    )
    program = python(
        HEAD
        + f"""
from rosglass.qt import QtGui
qt = QtGui.QGuiApplication(sys.argv)
for _ in range(2):
    with Application({str(tmp_path / "Main.qml")!r}, url="zenoh://127.0.0.1:9") as app:
        assert app.qt is qt
        print("code", app.run(), app.session.is_initialized)
"""
    )
    assert program.end(40) == 0, program.text
    assert program.text.count("code 3 False") == 2


def test_it_fits_into_the_qt_application_there_is(python: Any, tmp_path: Path) -> None:
    (tmp_path / "Main.qml").write_text("import QtQuick 2.15\nItem {}")
    program = python(
        HEAD
        + f"""
from rosglass import Error
from rosglass.qt import QtCore, QtGui, run_event_loop
def attempt(job):
    try:
        print("result", job())
    except Error as error:
        print(error)
file = {str(tmp_path / "Main.qml")!r}
qt = QtGui.QGuiApplication([])
app = Application(file)
def later():
    app.load()
    attempt(app.run)
    attempt(lambda: app.grab().width() > 0)
    app.close()
    app.close()
    qt.exit(9)
QtCore.QTimer.singleShot(0, later)
print("code", run_event_loop(qt))
"""
    )
    assert program.end(40) == 0, program.text
    assert "Qt's event loop runs already: call load()" in program.text
    assert "result True" in program.text
    assert "code 9" in program.text
    plain = python(
        HEAD
        + f"""
from rosglass.qt import QtCore
qt = QtCore.QCoreApplication([])
Application({str(tmp_path / "Main.qml")!r})
"""
    )
    assert plain.end(40) == 1
    assert "can open no window: make a QGuiApplication" in plain.text


def examples(page: Path) -> list[str]:
    """Return the Python programs of a page of the documentation."""
    return re.findall(r"```python\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL)


def test_the_documented_programs_run(python: Any, tmp_path: Path) -> None:
    (tmp_path / "cockpit.qml").write_text(
        """import QtQuick 2.15
        import QtQuick.Window 2.15
        import Ros2 1.0
        Window { visible: true
            Component.onCompleted: { Ros2.init("ui"); console.warn("shown") }
            Timer { running: true; interval: 200; onTriggered: Qt.exit(0) }
        }"""
    )
    programs = [text for text in examples(ROOT / "docs" / "qml.md") if "cockpit.qml" in text]
    assert len(programs) == 2
    for text in programs:
        changes = {
            "robot.local:7447": "127.0.0.1:9",
            "PySide6": BINDING,
            ".exec()": ".exec()" if QT6 else ".exec_()",
            '"cockpit.qml"': repr(str(tmp_path / "cockpit.qml")),
        }
        runnable = text
        for old, new in changes.items():
            runnable = runnable.replace(old, new)
        program = python(runnable)
        program.until("shown", 40)
        assert program.end(40) == 0, program.text
        assert "Traceback" not in program.text


@pytest.mark.skipif(not QT6, reason="Qt 5's media backends print nothing")
def test_media_backends_of_qt_are_quiet(python: Any, tmp_path: Path) -> None:
    (tmp_path / "cockpit.qml").write_text(
        """import QtQuick
        import QtMultimedia
        Window { visible: true; VideoOutput { }
            Timer { running: true; interval: 300; onTriggered: Qt.exit(0) }
        }"""
    )
    file = str(tmp_path / "cockpit.qml")
    program = python(f"from rosglass.qml import Application\nApplication({file!r}).run()")
    assert program.end(40) == 0
    # Such as "qt.multimedia.symbolsresolver: Couldn't load pipewire-0.3 library".
    assert [line for line in program.lines if "Couldn't" in line or "qt.multimedia" in line] == []


TYPO = """import QtQuick 2.15
import Ros2 1.0
Item {
    Component.onCompleted: { Ros2.init("ui"); console.log("from JavaScript") }
    Subscription { id: odometry; topic: "/odom"; onNewMessage: counted.add() }
    property var shown: odometry.message ? odometry.message.pose.pose.positon.x : 0
}"""
FED = (
    HEAD
    + """
import rosglass
from rosglass.qt import QtCore, Slot
BEFORE

class Counted(QtCore.QObject):
    messages = 0
    @Slot()
    def add(self):
        self.messages += 1
        if self.messages == 30:
            app.quit()

app = Application("FILE", url="dds://?domain=DOMAIN", context={"counted": Counted()})
robot = rosglass.connect("dds://?domain=DOMAIN", "robot")
publisher = robot.create_publisher("/odom", "nav_msgs/msg/Odometry")
timer = QtCore.QTimer()
timer.timeout.connect(lambda: publisher.publish({"pose": {"pose": {"position": {"x": 1}}}}))
timer.start(20)
sys.exit(app.run())
"""
)


@pytest.mark.parametrize(
    ("before", "place"),
    [
        ("", "{file}:6: WARNING: TypeError"),
        ("import logging; logging.basicConfig()", "WARNING:rosglass.qml:{file}:6: TypeError"),
    ],
)
def test_a_warning_of_every_message_is_logged_with_its_cause_and_counted(
    before: str, place: str, python: Any, tmp_path: Path, ros_domains: list[int]
) -> None:
    file = tmp_path / "Main.qml"
    file.write_text(TYPO)
    text = FED.replace("BEFORE", before).replace("FILE", str(file))
    program = python(text.replace("DOMAIN", str(ros_domains[0])))
    assert program.end(120) == 0, program.text
    logged = [line for line in program.lines if "TypeError" in line]
    assert len(logged) == 2, program.text
    assert logged[0].startswith(place.format(file=file))
    assert "geometry_msgs/msg/Pose has no field 'positon'; did you mean position?" in logged[0]
    assert "(9 more times)" in logged[1]
    assert "qml: from JavaScript" in program.lines


def test_a_message_handler_of_the_program_gets_what_the_engine_warns_of(
    python: Any, tmp_path: Path, ros_domains: list[int]
) -> None:
    file = tmp_path / "Main.qml"
    file.write_text(TYPO)
    own = "QtCore.qInstallMessageHandler(lambda kind, where, text: print('own', text))"
    text = FED.replace("BEFORE", own).replace("FILE", str(file))
    program = python(text.replace("DOMAIN", str(ros_domains[0])))
    assert program.end(120) == 0, program.text
    logged = [line for line in program.lines if "TypeError" in line]
    assert len(logged) > 10, program.text
    assert all(line.startswith("own") for line in logged)
    assert "own from JavaScript" in program.lines
