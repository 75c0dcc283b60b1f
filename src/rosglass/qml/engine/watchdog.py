"""Watchdog of the GUI thread: reports a frozen screen and ends JavaScript that blocks it."""

from __future__ import annotations

import logging
import os
import sys
import sysconfig
import threading
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from rosglass.qml.engine.js_stack import JsStack
from rosglass.qml.engine.log import Caller, log_from_qml
from rosglass.qt import QtCore, QtQml, Signal, Slot, is_alive

if TYPE_CHECKING:
    from collections.abc import Callable
    from types import FrameType

    from rosglass.qml.engine.session import Session

__all__ = ["Watchdog"]

_log = logging.getLogger("rosglass.qml")
#: Milliseconds between two heartbeats of the GUI thread.
_BEAT = 250
#: Seconds between two checks of the heartbeat; and of the GUI thread while it has no heartbeat.
_LOOK, _CLOSE_LOOK = 0.5, 0.1
#: Seconds of successive interruptions. One must last until JavaScript has ended, which would
#: otherwise continue, but not longer, or it would also end the next handler. First attempts let no
#: other thread run Python, which could keep this thread from noticing the end.
_HOLDS = (0.0005,) * 6
#: The same while other threads may run Python: otherwise, JavaScript that calls Python cannot end.
_SHARED_HOLDS = (0.001, 0.001, 0.004, 0.004, 0.016, 0.032)
#: Python's switch interval in seconds, in either case.
_NEVER, _AT_ONCE = 1.0, 1e-5
#: Number of attempts, and seconds of sleep before each: the system runs a thread promptly after it
#: has slept.
_TRIES, _REST = 60, 0.002
#: Seconds to measure whether the GUI thread is computing.
_GLANCE = 50e-6
#: Seconds between two checks above which the whole process was stopped.
_GAP = 1.0
#: Minimum share of processor time of a thread that is not waiting.
_BUSY = 0.05
#: On an overloaded machine, JavaScript may take up to this many times the limit.
_LOAD_FACTOR = 4
#: Seconds within which the next JavaScript function cannot start.
_LATE = 30e-6
_OURS = str(Path(__file__).parents[2])
#: The URLs at which Qt's own QML files begin.
_QT_FILES = ("qrc:/qt-project.org/", "qrc:/qt/qml/")
_LIBRARIES = (sysconfig.get_paths()["stdlib"], *{sysconfig.get_paths()[p] for p in ("purelib",)})
_ADVICE = "let it end, or do its work in pieces by a Timer"
_AND_OTHERS = "; the machine is busy, so what came right after it may have ended early, too"


class _Watched(NamedTuple):
    """A watched engine.

    Attributes:
        engine: The engine.
        stack: Its JavaScript stack.
        report: Called on the GUI thread with a description of the interruption.
        waiting: Frame of the innermost function when the event loop was last seen to run; if not
            0, this function waits in its own event loop.
    """

    engine: QtQml.QQmlEngine
    stack: JsStack
    report: Callable[[str], None]
    waiting: list[int]

    @property
    def is_running(self) -> bool:
        """True while JavaScript runs, or C++ or Python code that it has called."""
        return self.stack.is_known and self.stack.frame != self.waiting[0]

    def hold(self, wanted: tuple[int, int], seconds: float) -> float:
        """Interrupt JavaScript until its function has ended, or until a timeout.

        Args:
            wanted: The :attr:`handler` to end.
            seconds: The timeout.

        Returns:
            Maximum seconds by which the interruption outlasted the function: it may also have ended
            the next one.
        """
        outermost, handler = wanted
        if self.handler != wanted:
            return 0.0
        frame, waiting = self.stack.pointer, self.waiting[0] or None
        # Compare the function, too: the next one may already have started.
        function = self.stack.function_of(outermost)
        interrupt, clock = self.engine.setInterrupted, time.perf_counter
        seen = now = clock()
        until = now + seconds
        interrupt(True)
        try:
            # Every fraction of a microsecond counts here.
            while frame.value != waiting and function.value == handler and now < until:
                seen, now = now, clock()
        finally:
            interrupt(False)
        return clock() - seen

    @property
    def handler(self) -> tuple[int, int]:
        """Frame and function of the outermost running function; 0 if none runs."""
        return self.stack.handler(self.waiting[0])


class _Use(NamedTuple):
    """Processor use of a thread.

    Attributes:
        computed: Seconds of processor time.
        ready: Seconds that it waited for a processor used by other programs.
        runs: Whether it is currently running or ready to run.
    """

    computed: float
    ready: float
    runs: bool


class Watchdog(QtCore.QObject):
    """Watches the GUI thread of a session while there are engines to watch.

    Lives on the GUI thread, where a timer is the heartbeat. A separate thread checks it. While it
    is missing, this thread adds up the processor time that the GUI thread spends in JavaScript, and
    ends the JavaScript after :attr:`Session.longest_script`. Native code, Python and rosglass's own
    QML are only reported.

    JavaScript cannot be ended while a function of Qt that called it holds the GIL, because then no
    other Python thread runs: QObject.setProperty, QQmlComponent.create (instead, use ``create`` of
    ``live_file.py``), QJSValue.call (instead, use :class:`JsCalls`). The event loop, signals and
    QMetaObject.invokeMethod release the GIL.

    Args:
        session: The session whose interfaces are watched.
    """

    #: JavaScript of an engine was ended: the engine, and the text that reports it.
    script_ended = Signal(QtCore.QObject, str)

    def __init__(self, session: Session) -> None:
        super().__init__()
        self._session = session
        self._watched: dict[int, _Watched] = {}
        self._main, self._number = threading.get_ident(), threading.get_native_id()
        self._clock = _thread_clock(self._main)
        self._use = _watch_thread(self._number, self._clock)
        affinity = getattr(os, "sched_getaffinity", None)
        self._alone = affinity is not None and len(affinity(0)) == 1
        #: When the event loop was last seen to run, and in which Python frame.
        self._beaten = time.monotonic()
        self._loop: tuple[int, object] | None = None
        #: Whether the event loop is known to run at all.
        self.lives = False
        #: Time of the thread's last check, and seconds in which it could not check.
        self._looked, self._blind = self._beaten, 0.0
        self._report = ""
        self._end = threading.Event()
        self._thread: threading.Thread | None = None
        self._timer = QtCore.QTimer(self)
        self._timer.setInterval(_BEAT)
        self._timer.timeout.connect(self._beat)
        session.call_ended.connect(self._on_call_ended)
        app = QtCore.QCoreApplication.instance()
        if app is not None:
            app.aboutToQuit.connect(self._on_quit)

    @classmethod
    def of(cls, session: Session) -> Watchdog:
        """Return the watchdog of a session, created if needed."""
        found = session.shared.get(cls)
        if not isinstance(found, Watchdog):
            found = session.shared[cls] = Watchdog(session)
        return found

    def watch(self, engine: QtQml.QQmlEngine, report: Callable[[str], None]) -> None:
        """Start watching an engine.

        Args:
            engine: The engine; call :meth:`forget` before it is destroyed.
            report: Called on the GUI thread with a description of the interruption, or why none was
                possible.
        """
        stack = JsStack(engine)
        self._watched[id(engine)] = _Watched(engine, stack, report, [stack.frame])
        if self._thread is None:
            self._beaten = self._looked = time.monotonic()
            self.lives = False
            self._end.clear()
            self._timer.start()
            self._thread = threading.Thread(
                target=self._run, args=(self._end,), name="watchdog", daemon=True
            )
            self._thread.start()

    def forget(self, engine: QtQml.QQmlEngine) -> None:
        """Stop watching an engine; safe to call twice."""
        watched = self._watched.pop(id(engine), None)
        if watched is not None:
            watched.stack.close()
        if not self._watched and self._thread is not None:
            self._timer.stop()
            self._end.set()
            self._end = threading.Event()
            self._thread.join(timeout=1.0)
            self._thread = None

    # The GUI thread.

    @Slot()
    def _beat(self) -> None:
        now = time.monotonic()
        still, self._beaten = now - self._beaten, now
        caller = sys._getframe().f_back
        self._loop = _identity(caller) if caller is not None else None
        for watched in self._watched.values():
            watched.waiting[0] = watched.stack.frame
        lived, self.lives = self.lives, True
        report, self._report = self._report, ""
        blind, self._blind = self._blind, 0.0
        limit = self._session.longest_script
        if not lived or not limit or still < limit:
            return
        if report:
            _log.warning("the screen stood still for %.1f s in all: %s", still, report)
        elif max(blind, now - self._looked) > limit / 2:
            _log.warning(
                "the screen stood still for %.1f s, and the whole program with it: the process was "
                "stopped, or a function in C++ kept Python's lock",
                still,
            )

    @Slot()
    def _on_call_ended(self) -> None:
        """Continue after a JavaScript function has waited."""
        self._beaten = time.monotonic()
        for watched in self._watched.values():
            watched.waiting[0] = 0

    @Slot()
    def _on_quit(self) -> None:
        # It is unknown whether the event loop will run again.
        self.lives = False

    # The watching thread.

    def _run(self, end: threading.Event) -> None:
        while not end.wait(_LOOK):
            self._look()
            if self._looked - self._beaten > 2 * _LOOK:
                try:
                    self._look_closely(end)
                except Exception:  # noqa: BLE001 - in a thread of its own
                    _log.exception("internal error: the watchdog has stopped")
                    return

    def _look(self) -> float:
        """Record a check; return the seconds since the last one, 0 if the thread could not run."""
        now = time.monotonic()
        passed, self._looked = now - self._looked, now
        if passed <= _GAP:
            return passed
        self._blind += passed
        return 0.0

    def _look_closely(self, end: threading.Event) -> None:
        """Inspect the GUI thread until it responds again."""
        beaten, before = self._beaten, self._use()
        still, script, handler = self._looked - beaten - self._blind, 0.0, (0, 0)
        while self._beaten == beaten and not end.wait(_CLOSE_LOOK):
            passed, used = self._look(), self._use()
            computed, ready = used.computed - before.computed, used.ready - before.ready
            before = used
            limit = self._session.longest_script
            if not limit:
                return
            if not passed:
                # Its activity in this time is unknown.
                continue
            still += passed
            running = [watched for watched in tuple(self._watched.values()) if watched.is_running]
            # The stack grows downwards: the innermost frame has the lowest address.
            innermost = min(running, key=lambda watched: watched.stack.frame, default=None)
            if innermost is not None and (used.runs or computed > _BUSY * passed):
                last, handler = handler, innermost.handler
                script = (script if handler == last else 0.0) + computed + ready / _LOAD_FACTOR
                if script < limit:
                    continue
                is_own = _are_own(innermost.stack.callers())
                if self._beaten == beaten and not is_own and self._end_script(innermost, script):
                    return
            if self.lives and still >= limit and not self._report and self._beaten == beaten:
                self._report_still(still, innermost)

    def _end_script(self, watched: _Watched, seconds: float) -> bool:
        """End the running JavaScript; return whether it ended."""
        callers, handler = watched.stack.callers(), watched.handler
        ended, late, alone, shared = False, 0.0, list(_HOLDS), list(_SHARED_HOLDS)
        for _ in range(_TRIES):
            time.sleep(_REST)
            ended = watched.handler != handler
            if ended:
                break
            # While it waits for this thread's processor, its end would not be noticed.
            if not self._computes() and self._use().runs:
                continue
            if not shared:
                break
            # Measure again: JavaScript that keeps calling Python computes only at times.
            interval = _NEVER if alone and self._computes() else _AT_ONCE
            before = sys.getswitchinterval()
            sys.setswitchinterval(interval)
            try:
                longest = (alone if interval == _NEVER else shared).pop(0)
                late = watched.hold(handler, longest) or late
            finally:
                sys.setswitchinterval(before)
        if ended:
            self._report = ""
            self._report_ended(watched, callers, seconds, late)
        return ended

    def _computes(self) -> bool:
        """Return whether the GUI thread is computing now, in parallel with this thread."""
        if self._alone:
            return True
        began, before = time.perf_counter(), self._clock()
        while time.perf_counter() < began + _GLANCE:
            pass
        return self._clock() - before > _GLANCE / 5

    def _report_ended(
        self, watched: _Watched, callers: list[Caller], seconds: float, late: float
    ) -> None:
        where = callers[0] if callers else Caller("<unknown>", 0, "")
        shown = dict.fromkeys(map(_place, [*callers[:3], *callers[-1:]]))
        chain = ", called at ".join(shown)
        text = (
            f"JavaScript computed for {seconds:.1f} s and blocked the interface; it was "
            f"ended{f' in {chain}' if chain else ''}: {_ADVICE}"
            f"{_AND_OTHERS if late > _LATE else ''}"
        )
        log_from_qml("", logging.ERROR, text, where)
        self._show(watched, text)

    def _report_still(self, seconds: float, watched: _Watched | None) -> None:
        """Report a blocked GUI thread that is not in JavaScript and cannot be interrupted."""
        frame = sys._current_frames().get(self._main)
        callers = watched.stack.callers() if watched is not None else []
        called = f", called at {_place(callers[0])}" if callers else ""
        if frame is None or _identity(frame) == self._loop:
            text = f"native code of Qt, RViz or a plugin is at work{called}"
        else:
            text = f"Python is at work in {_python_place(frame)}{called}"
        self._report = text
        _log.warning("the screen has stood still for %.1f s: %s", seconds, text)

    def _show(self, watched: _Watched, text: str) -> None:
        def show() -> None:
            if is_alive(watched.engine):
                watched.report(text)
                self.script_ended.emit(watched.engine, text)

        self._session.executor.post(show)


def _are_own(callers: list[Caller]) -> bool:
    """Return whether only rosglass's own QML runs, with Qt's, and nothing of the user's.

    It ends: Python or Qt is at work for it, and what came after it would be missing.
    """
    files = [caller.file for caller in callers]
    own = tuple(f"{_OURS}{separator}" for separator in {os.sep, "/"})
    return any(one.startswith(own) for one in files) and all(
        one.startswith((*own, *_QT_FILES)) for one in files
    )


def _place(caller: Caller) -> str:
    name = caller.function.removeprefix("expression for ")
    return f"{caller.place}{f' ({name})' if name else ''}"


def _identity(frame: FrameType) -> tuple[int, object]:
    """Return an identifier of a frame that does not keep its objects alive."""
    return id(frame), frame.f_code


def _python_place(frame: FrameType) -> str:
    """Return the current Python line, in the program's own files if they are on the stack."""
    found: FrameType | None = frame
    while found is not None and found.f_code.co_filename.startswith((_OURS, *_LIBRARIES, "<")):
        found = found.f_back
    shown = found or frame
    return f"{shown.f_code.co_filename}:{shown.f_lineno} ({shown.f_code.co_name})"


def _thread_clock(ident: int) -> Callable[[], float]:
    """Return a function that returns a thread's processor time in seconds."""
    of_thread: Any = getattr(time, "pthread_getcpuclockid", None)
    if of_thread is None:
        # For Windows: other threads hardly compute while nothing is drawn.
        return time.process_time
    clock = of_thread(ident)
    return lambda: time.clock_gettime(clock)


def _watch_thread(number: int, clock: Callable[[], float]) -> Callable[[], _Use]:
    """Return a function that returns a thread's processor use.

    Args:
        number: The system's thread id.
        clock: Returns the thread's processor time in seconds.
    """
    # Linux, Documentation/scheduler/sched-stats.rst and proc_pid_stat(5).
    times, state = (Path(f"/proc/self/task/{number}/{name}") for name in ("schedstat", "stat"))
    if not times.exists():
        return lambda: _Use(clock(), 0.0, False)

    def look() -> _Use:
        ready = int(times.read_bytes().split()[1]) / 1e9
        runs = state.read_bytes().rpartition(b")")[2].split()[0] == b"R"
        return _Use(clock(), ready, runs)

    return look
