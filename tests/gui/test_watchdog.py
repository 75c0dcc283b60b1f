"""JavaScript without an end is ended and reported; slow code is not."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

import pytest
from inside import root_of
from local_world import LocalWorld

from rosglass.errors import Error
from rosglass.qml import Session
from rosglass.qml.engine.runtime import runtime_of
from rosglass.qml.engine.waiting import wait_for
from rosglass.qml.engine.watchdog import Watchdog
from rosglass.qml.run.runner import Runner
from rosglass.qt import Property, QtCore, Signal, Slot

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

pytestmark = pytest.mark.both_qt

UI = """import QtQuick 2.15
Item {
    property var done: []
    function begin() { work.start() }
    function loop() { %s }
    function after() { var n = 0; for (var i = 0; i < 9; i++) n += i; done = done.concat("after") }
    Timer { id: work; interval: 1; onTriggered: {
        done = ["begun"]
        loop()
        done = done.concat("went on")
    } }
    Timer { interval: 50; running: done.length > 0; onTriggered: after() }
}"""
#: The line of UI that loops.
LINE = 5


class Helper(QtCore.QObject):
    """The object that an application gives its QML."""

    changed = Signal()

    def __init__(self, session: Session) -> None:
        super().__init__()
        self._session = session

    one = Property(int, lambda _: 1, notify=changed)

    @Slot(float)
    def rest(self, seconds: float) -> None:
        time.sleep(seconds)

    @Slot(float)
    def compute(self, seconds: float) -> None:
        until = time.monotonic() + seconds
        while time.monotonic() < until:
            pass

    @Slot(int)
    def wait(self, milliseconds: int) -> None:
        """Wait in an event loop, as Service.call does."""
        wait_for(self._session, lambda ended: QtCore.QTimer.singleShot(milliseconds, ended))

    @Slot()
    def notify(self) -> None:
        self.changed.emit()


@pytest.fixture
def run(
    app: Any, tmp_path: Path, caplog: Any, wait: Callable[..., None]
) -> Iterator[Callable[..., Runner]]:
    caplog.set_level("INFO", "rosglass.qml")
    made: list[Runner] = []

    def run(code: str, limit: float) -> Runner:
        file = tmp_path / "Main.qml"
        file.write_text(UI % code)
        session = Session(connect=LocalWorld().connect)
        session.longest_script = limit
        runner = Runner(file, session)
        made.append(runner)
        runner.helper = Helper(session)
        runner.engine.rootContext().setContextProperty("helper", runner.helper)
        runner.load()
        runner.root = root_of(runner)
        # Until the event loop is known to run, only JavaScript is looked at.
        wait(lambda: session.shared[Watchdog].lives)
        return runner

    yield run
    for runner in made:
        runner.close()
        runner.session.close()


def done(runner: Runner) -> list[str]:
    value: Any = runner.root.property("done")
    return list(value.toVariant() if hasattr(value, "toVariant") else value)


def notes(runner: Runner, name: str = "text") -> list[str]:
    """Return a property of each line that the panel over the interface shows."""
    return [item.property(name) for item in runner._notice.items]


def panel(runner: Runner) -> str:
    return "\n".join(notes(runner))


@pytest.mark.parametrize(
    "code",
    [
        "while (true) {}",
        "while (helper.one == 1) {}",
        "[3, 2, 1].sort(function (a, b) { while (true) {} })",
        "function deeper(n) { return n ? deeper(n - 1) + deeper(n - 1) : 1 } deeper(99)",
        "try { while (true) {} } catch (error) { done = ['caught'] }",
    ],
)
def test_endless_loop_is_ended_and_reported_with_its_position(
    run: Callable[..., Runner], wait: Callable[..., None], caplog: Any, code: str
) -> None:
    runner = run(code, 0.5)
    QtCore.QMetaObject.invokeMethod(runner.root, "begin")
    wait(lambda: panel(runner))
    place = f"{runner.file}:{LINE}"
    # It ended in the middle, and what came later was not touched.
    wait(lambda: "after" in done(runner))
    assert done(runner) == ["begun", "after"]
    assert f"{place} (" in panel(runner)
    assert "called at" in panel(runner)
    assert "onTriggered" in panel(runner)
    (record,) = [r for r in caplog.records if "computed for" in r.getMessage()]
    assert f"{record.pathname}:{record.lineno}" == place
    assert record.getMessage() == panel(runner)
    assert notes(runner, "heading")[0].startswith("The interface below continues")


def test_a_handler_of_a_signal_from_python_is_ended_too(
    run: Callable[..., Runner], wait: Callable[..., None]
) -> None:
    runner = run("helper.changed.connect(function () { while (true) {} }); helper.notify()", 0.5)
    QtCore.QMetaObject.invokeMethod(runner.root, "begin")
    wait(lambda: panel(runner))
    assert f"{runner.file}:{LINE}" in panel(runner)


@pytest.mark.parametrize("slot", ["rest", "compute"])
def test_slow_python_function_is_reported_and_its_caller_goes_on(
    run: Callable[..., Runner], wait: Callable[..., None], caplog: Any, slot: str
) -> None:
    # What Python computes for JavaScript counts as its own, so there it must stay below the limit.
    runner = run(f"helper.{slot}({'2.5' if slot == 'rest' else '0.5'})", 1.0)
    QtCore.QMetaObject.invokeMethod(runner.root, "begin")
    wait(lambda: "after" in done(runner))
    assert done(runner) == ["begun", "went on", "after"]
    assert not panel(runner)
    if slot == "rest":
        wait(lambda: any("stood still for" in record.getMessage() for record in caplog.records))
        assert f"Python is at work in {__file__}" in caplog.text
        assert "(rest)" in caplog.text
        assert f"called at {runner.file}:{LINE} (loop)" in caplog.text


def test_qml_of_rosglass_itself_is_never_ended(
    run: Callable[..., Runner],
    wait: Callable[..., None],
    caplog: Any,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("rosglass.qml.engine.watchdog._OURS", str(tmp_path))
    runner = run("helper.compute(3)", 0.5)
    QtCore.QMetaObject.invokeMethod(runner.root, "begin")
    wait(lambda: "after" in done(runner))
    assert done(runner) == ["begun", "went on", "after"]
    assert not panel(runner)
    wait(lambda: "stood still for" in caplog.text)
    # A function of the user's that it calls is.
    other = tmp_path.parent / f"{tmp_path.name}_user"
    other.mkdir()
    (other / "User.qml").write_text(
        "import QtQuick 2.15\nItem { function loop() { while (true) {} } }\n"
    )
    source = f'"file:{other}/User.qml"'
    runner = run(f"var made = Qt.createComponent({source}).createObject(); made.loop()", 0.5)
    QtCore.QMetaObject.invokeMethod(runner.root, "begin")
    wait(lambda: "User.qml" in panel(runner))


def test_a_call_that_waits_while_the_screen_lives_is_not_ended(
    run: Callable[..., Runner], wait: Callable[..., None], caplog: Any
) -> None:
    runner = run("helper.wait(2500)", 0.5)
    QtCore.QMetaObject.invokeMethod(runner.root, "begin")
    wait(lambda: "went on" in done(runner))
    assert "stood still" not in caplog.text
    assert "computed for" not in caplog.text


def test_javascript_that_loops_after_a_call_that_waited_is_ended(
    run: Callable[..., Runner], wait: Callable[..., None]
) -> None:
    runner = run("helper.wait(700); while (true) {}", 0.5)
    QtCore.QMetaObject.invokeMethod(runner.root, "begin")
    wait(lambda: panel(runner))
    assert "went on" not in done(runner)


@pytest.mark.parametrize("limit", [0, 60])
def test_javascript_that_takes_long_but_not_too_long_is_left_alone(
    run: Callable[..., Runner], wait: Callable[..., None], caplog: Any, limit: float
) -> None:
    runner = run("var t = Date.now(); while (Date.now() - t < 2500) {}", limit)
    QtCore.QMetaObject.invokeMethod(runner.root, "begin")
    wait(lambda: "after" in done(runner))
    assert done(runner) == ["begun", "went on", "after"]
    assert "screen" not in caplog.text


def test_javascript_right_after_a_long_standstill_of_something_else_is_left_alone(
    run: Callable[..., Runner], wait: Callable[..., None], caplog: Any
) -> None:
    runner = run("var n = 0; for (var i = 0; i < 1000; i++) n += i", 0.5)

    def stand_still() -> None:
        time.sleep(2.5)
        runner.helper.compute(2.5)

    QtCore.QTimer.singleShot(0, stand_still)
    QtCore.QTimer.singleShot(0, lambda: QtCore.QMetaObject.invokeMethod(runner.root, "begin"))
    wait(lambda: "after" in done(runner))
    assert done(runner) == ["begun", "went on", "after"]
    assert not panel(runner)
    assert "(stand_still)" in caplog.text or "(compute)" in caplog.text


def test_a_function_that_python_calls_is_ended_and_is_an_error(
    run: Callable[..., Runner], wait: Callable[..., None]
) -> None:
    runner = run("", 0.5)
    runtime = runtime_of(runner.engine)
    looping: Any = runner.engine.evaluate("(function () { while (true) {} })", str(runner.file))
    result = runtime.call(looping, [])
    assert result.isError()
    assert "was ended" in result.toString()
    wait(lambda: panel(runner))
    assert f"{runner.file}:1" in panel(runner)
    adding: Any = runner.engine.evaluate("(function (a, b) { return a + b })")
    assert runtime.call(adding, [runtime.value(2), runtime.value(3)]).toNumber() == 5
    failing: Any = runner.engine.evaluate("(function () {\n throw new Error('no') })", "/f.js")
    error = runtime.call(failing, [])
    assert error.toString() == "Error: no"
    assert error.property("lineNumber").toInt() == 2


def test_whatever_a_function_throws_is_an_error(run: Callable[..., Runner]) -> None:
    runner = run("", 5.0)
    runtime = runtime_of(runner.engine)
    failing: Any = runner.engine.evaluate("(function () { throw 'not now' })", "/f.js")
    error = runtime.call(failing, [])
    assert error.isError()
    assert error.toString() == "Error: not now"
    assert error.property("fileName").isUndefined()


@pytest.mark.parametrize("limit", [-1, float("nan"), float("inf"), True, "5", None])
def test_invalid_limits_are_refused(app: Any, limit: Any) -> None:
    session = Session(connect=LocalWorld().connect)
    with pytest.raises(Error, match=r"Session\.longest_script: .* 0 for no limit"):
        session.longest_script = limit
    assert session.longest_script == 5.0
    session.longest_script = 2
    assert session.longest_script == 2.0
    session.close()


LOADING = """import QtQuick 2.15
Item {
    property var done: []
    property int first: { %s; return 1 }
    Component.onCompleted: {
        done = ["begun"]
        %s
        done = done.concat("went on")
    }
    Timer { interval: 50; running: true; onTriggered: done = done.concat("after") }
}"""


@pytest.mark.parametrize(
    ("line", "binding", "completed"), [(4, "while (true) {}", ""), (6, "", "while (true) {}")]
)
def test_a_loop_without_end_while_the_file_is_loaded_is_ended(
    run: Callable[..., Runner],
    wait: Callable[..., None],
    line: int,
    binding: str,
    completed: str,
) -> None:
    runner = run("", 0.5)
    runner.file.write_text(LOADING % (binding, completed))
    assert runner.reload()
    runner.root = root_of(runner)
    wait(lambda: panel(runner))
    assert f"{runner.file}:{line}" in panel(runner)
    wait(lambda: "after" in done(runner))
    lived_on = ["begun", "after"] if completed else ["begun", "went on", "after"]
    assert done(runner) == lived_on or "the machine is busy" in panel(runner)


def test_file_with_unset_required_properties_is_refused(
    run: Callable[..., Runner],
) -> None:
    runner = run("", 0.5)
    before = runner.root
    runner.file.write_text("import QtQuick 2.15\nItem { required property int number }")
    assert not runner.reload()
    assert "number was not initialized" in runner._errors.items[0].property("text")
    assert root_of(runner) is before


def test_uncertain_interruption_is_reported(
    run: Callable[..., Runner], wait: Callable[..., None], monkeypatch: Any
) -> None:
    # As if this thread had been kept from its processor.
    monkeypatch.setattr("rosglass.qml.engine.watchdog._LATE", -1.0)
    runner = run("while (true) {}", 0.5)
    QtCore.QMetaObject.invokeMethod(runner.root, "begin")
    wait(lambda: panel(runner))
    assert "what came right after it may have ended early, too" in panel(runner)
