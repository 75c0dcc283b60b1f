"""Reading Qt's stack of JavaScript: a stop pressed while the screen is frozen is sent."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest
from inside import root_of
from local_world import LocalWorld

from rosglass.qml import Session
from rosglass.qml.engine.js_stack import JsStack
from rosglass.qml.engine.log import Caller
from rosglass.qml.engine.watchdog import Watchdog
from rosglass.qml.run.runner import Runner
from rosglass.qt import QtCore, QtQml, Slot

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

pytestmark = pytest.mark.both_qt

UI = """import QtQuick 2.15
Item {
    property var done: []
    signal pressed()
    onPressed: {
        done = done.concat("stop")
        for (var i = 0; i < 9; i++) {}
        done = done.concat("sent")
    }
    function begin() { work.start() }
    Timer { id: work; interval: 1; onTriggered: { operator.press(); while (true) {} } }
}"""
LOOP = 11


class Operator(QtCore.QObject):
    """Presses a button of a frozen interface: the event waits until the screen responds."""

    root: Any = None

    @Slot()
    def press(self) -> None:
        QtCore.QMetaObject.invokeMethod(self.root, "pressed", QtCore.Qt.QueuedConnection)


@pytest.fixture
def runner(app: Any, tmp_path: Path, caplog: Any, wait: Callable[..., None]) -> Iterator[Runner]:
    caplog.set_level("INFO", "rosglass.qml")
    file = tmp_path / "Main.qml"
    file.write_text(UI)
    session = Session(connect=LocalWorld().connect)
    session.longest_script = 0.5
    runner = Runner(file, session)
    runner.operator = Operator()
    runner.engine.rootContext().setContextProperty("operator", runner.operator)
    runner.load()
    runner.operator.root = root_of(runner)
    # Until the event loop is known to run, only JavaScript is looked at.
    wait(lambda: session.shared[Watchdog].lives)
    yield runner
    runner.close()
    session.close()


def done(runner: Runner) -> list[str]:
    value: Any = runner.operator.root.property("done")
    return list(value.toVariant() if hasattr(value, "toVariant") else value)


def test_stop_pressed_while_javascript_loops_is_sent(
    runner: Runner, wait: Callable[..., None], caplog: Any
) -> None:
    QtCore.QMetaObject.invokeMethod(runner.operator.root, "begin")
    wait(lambda: "computed for" in caplog.text)
    wait(lambda: done(runner))
    assert done(runner) == ["stop", "sent"]
    (record,) = [r for r in caplog.records if "computed for" in r.getMessage()]
    assert f"{record.pathname}:{record.lineno}" == f"{runner.file}:{LOOP}"


def test_stop_pressed_while_no_javascript_runs_is_sent(
    runner: Runner, wait: Callable[..., None], caplog: Any
) -> None:
    def stand_still() -> None:
        runner.operator.press()
        QtCore.QThread.msleep(2500)

    QtCore.QTimer.singleShot(0, stand_still)
    wait(lambda: done(runner))
    assert done(runner) == ["stop", "sent"]
    wait(lambda: "stood still for" in caplog.text)


def test_stack_has_files_lines_and_functions(app: Any) -> None:
    class Looks(QtCore.QObject):
        @Slot()
        def look(self) -> None:
            found.extend(stack.callers())

    found: list[Caller] = []
    engine, looks = QtQml.QQmlEngine(), Looks()
    stack = JsStack(engine)
    assert stack.is_known
    assert (stack.frame, stack.callers()) == (0, [])
    script: Any = engine.evaluate(
        "(function outer(looks) {\n function inner() {\n looks.look() }\n inner() })", "/a.js", 7
    )
    script.call([engine.newQObject(looks)])
    assert found == [Caller("/a.js", 9, "inner"), Caller("/a.js", 10, "outer")]
    assert stack.frame == 0
    stack.close()
