"""The watchdog of the GUI thread: reports a frozen screen, and ends JavaScript that blocks it."""

from __future__ import annotations

import ctypes
import logging
import os
import struct
import sys
import sysconfig
import threading
import time
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from rosglass.qml.log import Caller, log_from_qml, plain_path
from rosglass.qt import QT6, QtCore, QtQml, Slot, address, is_alive

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from types import FrameType

    from rosglass.qml.session import Session


__all__ = ["JsStack", "Watchdog"]

#: Bytes from the start of QJSEngine to its pointer to QV4::ExecutionEngine, whose first member is
#: the pointer to the innermost QV4::CppStackFrame: Qt's own JIT relies on that.
_ENGINE = 2 * ctypes.sizeof(ctypes.c_void_p)
#: Bytes from the start of a frame to its caller, its QV4::Function, and its place in the code.
_CALLER, _FUNCTION, _POSITION = (0, 8, 20) if QT6 else (16, 24, 52)
#: Bytes from the start of a QV4::Function to its QV4::CompiledData::Function; inside of that.
_COMPILED = 8
_NAME, _TABLES, _COUNTS, _LOCATION = 8, 24, 28, 40
#: Bytes of an entry of the table of lines.
_ENTRY = 12 if QT6 else 8
_MAGIC = b"qv4cdata"
#: Bytes from the start of a compiled file within which its functions are looked for.
_LONGEST = 1 << 24
_PAGE = 4096
#: Stack frames that are reported.
_MOST = 12
#: Bytes from the number of a compiled file's strings to that of the string with its name.
_FILE = 124
_PROBE, _PROBE_FILE, _PROBE_LINE = "rosglassProbe", "/rosglass/probe", 3
_SCRIPT = f"(function {_PROBE}(probe) {{\n\n probe.look() }})"


class _Layout(NamedTuple):
    """Where in a compiled file something is; differs between versions of Qt.

    Attributes:
        strings: Bytes from its start to the number of its strings, which is before their place.
        text: Bytes from the start of a string to its characters.
    """

    strings: int
    text: int


class _Memory:
    """This process's memory, of which nothing that is read can do harm."""

    def __init__(self) -> None:
        try:
            self._file = os.open("/proc/self/mem", os.O_RDONLY)
        except OSError:
            self._file = -1

    def read(self, address: int, size: int) -> bytes:
        """Return bytes; raises OSError when they are not there."""
        if self._file < 0 or not 0 < address < 1 << 62:
            raise OSError(f"no such address: {address:#x}")
        found = os.pread(self._file, size, address)
        if len(found) < size:
            raise OSError(f"nothing at {address:#x}")
        return found

    def number(self, address: int, size: int = 4) -> int:
        """Return an unsigned number."""
        return int.from_bytes(self.read(address, size), "little")

    def close(self) -> None:
        """Give the file back."""
        if self._file >= 0:
            os.close(self._file)
            self._file = -1


class _Probe(QtCore.QObject):
    """Looks at the stack of a function that is known."""

    def __init__(self, stack: JsStack, parent: QtCore.QObject) -> None:
        super().__init__(parent)
        self._stack = stack
        self.frame = 0
        self.layout: _Layout | None = None

    @Slot()
    def look(self) -> None:
        """Look; JavaScript calls this."""
        self.frame = self._stack.frame
        with suppress(OSError, struct.error):
            self.layout = self._stack.find_layout()


class JsStack:
    """The stack of JavaScript in an engine.

    Qt tells nothing of it while JavaScript runs, so it is read from Qt's memory. That is private to
    Qt: it is tried with a function that is known, and what does not hold is not used.

    Args:
        engine: The engine, which must live as long as this is asked; in the GUI thread.
    """

    def __init__(self, engine: QtQml.QQmlEngine) -> None:
        engine_v4 = ctypes.c_void_p.from_address(address(engine) + _ENGINE).value or 0
        #: Where Qt keeps :attr:`frame`, for those in a hurry.
        self.pointer = ctypes.c_void_p.from_address(engine_v4)
        self._memory = _Memory()
        self._layout: _Layout | None = None
        before = self.frame
        probe = _Probe(self, engine)
        script: Any = engine.evaluate(_SCRIPT, _PROBE_FILE)
        script.call([engine.newQObject(probe)])
        #: Whether it is known when JavaScript runs.
        self.is_known = probe.frame not in {0, before} and self.frame == before
        self._layout = probe.layout if self.is_known else None
        probe.deleteLater()

    @property
    def frame(self) -> int:
        """The identity of the innermost function that runs; 0 while none does."""
        return self.pointer.value or 0

    def handler(self, waiting: int) -> tuple[int, int]:
        """Return the frame of the function that was called first, and the function; 0 for none.

        Args:
            waiting: A frame that is not part of it any more, but waits for its end; 0 for none.
        """
        outermost = function = 0
        with suppress(OSError):
            for frame in self._frames():
                if frame == waiting:
                    break
                function, outermost = self._memory.number(frame + _FUNCTION, 8), frame
        return outermost, function

    @staticmethod
    def function_of(frame: int) -> ctypes.c_void_p:
        """Return where Qt keeps the function of a frame, for those in a hurry."""
        return ctypes.c_void_p.from_address(frame + _FUNCTION)

    def callers(self) -> list[Caller]:
        """Return where it is, the innermost function first; empty when that cannot be known.

        Of a deep stack, the innermost functions and the outermost one.

        To be called from another thread while JavaScript runs: what is read while it changes is
        left out.
        """
        if self._layout is None:
            return []
        found: list[Caller] = []
        with suppress(OSError, struct.error, UnicodeDecodeError):
            layout = self._layout
            frames = list(self._frames())
            frames[_MOST - 1 : -1] = []
            found.extend(self._caller(frame, layout) for frame in frames)
        return found

    def close(self) -> None:
        """Look no more; safe to call twice."""
        self.pointer = ctypes.c_void_p()
        self._layout = None
        self._memory.close()

    def find_layout(self) -> _Layout | None:
        """Return the layout of compiled files, given that the function that is known runs."""
        memory = self._memory
        compiled = memory.number(memory.number(self.frame + _FUNCTION, 8) + _COMPILED, 8)
        unit, name = self._unit(compiled), memory.number(compiled + _NAME)
        for strings in range(24, 160, 4):
            for text in (4, 24):
                layout = _Layout(strings, text)
                with suppress(OSError, UnicodeDecodeError):
                    if self._string(unit, name, layout) == _PROBE:
                        right = Caller(_PROBE_FILE, _PROBE_LINE, _PROBE)
                        return layout if self._caller(self.frame, layout) == right else None
        return None

    def _frames(self) -> Iterator[int]:
        frame = self.frame
        while frame:
            yield frame
            before, frame = frame, self._memory.number(frame + _CALLER, 8)
            # The stack grows downwards, so it is a caller's, or has changed since.
            if frame <= before:
                return

    def _caller(self, frame: int, layout: _Layout) -> Caller:
        memory = self._memory
        compiled = memory.number(memory.number(frame + _FUNCTION, 8) + _COMPILED, 8)
        unit = self._unit(compiled)
        name = self._string(unit, memory.number(compiled + _NAME), layout)
        file = self._string(unit, memory.number(unit + layout.strings + _FILE), layout)
        line = memory.number(compiled + _LOCATION) & 0xFFFFF
        counts = memory.number(compiled + _COUNTS)
        table = compiled + memory.number(compiled + _TABLES) + 4 * (counts & 0xFFFF)
        position = memory.number(frame + _POSITION)
        for number in range(min(counts >> 16, 10_000)):
            offset, at = struct.unpack("<Ii", memory.read(table + number * _ENTRY, 8))
            if offset >= position:
                break
            line = abs(at)
        return Caller(plain_path(file), line, name)

    def _unit(self, compiled: int) -> int:
        """Return where the compiled file begins that a function is in."""
        # What is before the file may not be there, but a page is there as a whole.
        page, end = compiled & -_PAGE, compiled
        while compiled - page < _LONGEST:
            # The magic word may lie across two pages.
            at = self._memory.read(page, end - page).rfind(_MAGIC)
            if at >= 0:
                return page + at
            page, end = page - _PAGE, page + len(_MAGIC)
        raise OSError("this is no function")

    def _string(self, unit: int, number: int, layout: _Layout) -> str:
        memory = self._memory
        count, table = struct.unpack("<II", memory.read(unit + layout.strings, 8))
        if not number < count < 1 << 20:
            return ""
        start = unit + memory.number(unit + table + 4 * number)
        size = memory.number(start if layout.text == 4 else start + 4)
        if size > 4096:
            return ""
        return memory.read(start + layout.text, 2 * size).decode("utf-16-le")


_log = logging.getLogger("rosglass.qml")
#: Milliseconds between two signs of life of the GUI thread.
_BEAT = 250
#: Seconds between two looks at them; and between two looks at what it does while there are none.
_LOOK, _CLOSE_LOOK = 0.5, 0.1
#: Seconds for which JavaScript stays interrupted, one after the other: until it has ended, for it
#: continues where it is when the interruption ends; and not longer, for it would end the next
#: handler, too. At first no other thread runs Python, which could keep this one from noticing.
_HOLDS = (0.0005,) * 6
#: The same while others may: JavaScript that calls Python cannot end before.
_SHARED_HOLDS = (0.001, 0.001, 0.004, 0.004, 0.016, 0.032)
#: Seconds after which a thread lets others run Python, in either case.
_NEVER, _AT_ONCE = 1.0, 1e-5
#: How often that is tried, and the seconds before: a thread that has slept is not kept waiting.
_TRIES, _REST = 60, 0.002
#: Seconds within which it is seen whether the GUI thread computes right now.
_GLANCE = 50e-6
#: Seconds between two looks above which the whole process stood still.
_GAP = 1.0
#: The part of its time that a thread computes at least, when it does not wait for something.
_BUSY = 0.05
#: On an overloaded machine, JavaScript may take up to this many times as long.
_LOAD_FACTOR = 4
#: Seconds within which the next function of JavaScript does not begin.
_LATE = 30e-6
_OURS = str(Path(__file__).parents[1])
_LIBRARIES = (sysconfig.get_paths()["stdlib"], *{sysconfig.get_paths()[p] for p in ("purelib",)})
_ADVICE = "let it end, or do its work in pieces by a Timer"
_AND_OTHERS = "; the machine is busy, so what came right after it may have ended early, too"


class _Watched(NamedTuple):
    """An engine.

    Attributes:
        engine: The engine.
        stack: Its stack.
        tell: Called on the GUI thread with what was done to the engine.
        waiting: What was the innermost function when the event loop was last seen to run; others
            than 0 wait for something in an event loop of their own.
    """

    engine: QtQml.QQmlEngine
    stack: JsStack
    tell: Callable[[str], None]
    waiting: list[int]

    @property
    def is_running(self) -> bool:
        """Whether JavaScript runs, or something in C++ or Python that it has called."""
        return self.stack.is_known and self.stack.frame != self.waiting[0]

    def hold(self, wanted: tuple[int, int], seconds: float) -> float:
        """Interrupt JavaScript until its function has ended, or until some seconds have passed.

        Args:
            wanted: The :attr:`handler` to end.
            seconds: How long.

        Returns:
            For how many seconds at most the interruption outlasted the function: it may have ended
            the next one, too.
        """
        outermost, handler = wanted
        if self.handler != wanted:
            return 0.0
        frame, waiting = self.stack.pointer, self.waiting[0] or None
        # The next one may have begun already when it is looked whether any runs.
        function = self.stack.function_of(outermost)
        tell, clock = self.engine.setInterrupted, time.perf_counter
        seen = now = clock()
        until = now + seconds
        tell(True)
        try:
            # Each part of a microsecond that this takes counts.
            while frame.value != waiting and function.value == handler and now < until:
                seen, now = now, clock()
        finally:
            tell(False)
        return clock() - seen

    @property
    def handler(self) -> tuple[int, int]:
        """The frame and the function that was called first; 0 while none runs."""
        return self.stack.handler(self.waiting[0])


class _Use(NamedTuple):
    """What a thread did until now.

    Attributes:
        computed: Seconds that it computed.
        ready: Seconds that it would have computed, if other programs had not.
        runs: Whether it is at it now.
    """

    computed: float
    ready: float
    runs: bool


class Watchdog(QtCore.QObject):
    """Watches the GUI thread for a session, as long as it is given engines.

    Lives on the GUI thread, which gives signs of life by a timer. A thread of its own looks for
    them. While there are none it adds up for how long the GUI thread has computed in JavaScript,
    and ends that when it is longer than :attr:`Session.longest_script`; native code and Python are
    only reported.

    JavaScript that runs while a function of Qt keeps Python's lock cannot be ended, for no thread
    of Python runs then: QObject.setProperty, QQmlComponent.create (for which there is
    ``creation.py``), QJSValue.call (for which there is :class:`JsCalls`). The event loop, signals
    and QMetaObject.invokeMethod give it back.

    Args:
        session: Whose interfaces it watches.
    """

    def __init__(self, session: Session) -> None:
        super().__init__()
        self._session = session
        self._watched: dict[int, _Watched] = {}
        self._main, self._number = threading.get_ident(), threading.get_native_id()
        self._clock = _thread_clock(self._main)
        self._use = _watch_thread(self._number, self._clock)
        affinity = getattr(os, "sched_getaffinity", None)
        self._alone = affinity is not None and len(affinity(0)) == 1
        #: When the event loop was last seen to run, and in which frame of Python; whether it is
        #: known to run at all.
        self._beaten = time.monotonic()
        self._loop: tuple[int, object] | None = None
        self._lives = False
        #: When the thread last looked, and seconds in which it could not.
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
        """Return the watchdog of a session, made if need be."""
        found = session.shared.get(cls)
        if not isinstance(found, Watchdog):
            found = session.shared[cls] = Watchdog(session)
        return found

    def watch(self, engine: QtQml.QQmlEngine, tell: Callable[[str], None]) -> None:
        """Watch an engine, too.

        Args:
            engine: The engine; :meth:`forget` it before it goes.
            tell: Called on the GUI thread with what was done to the engine, or why nothing was.
        """
        stack = JsStack(engine)
        self._watched[id(engine)] = _Watched(engine, stack, tell, [stack.frame])
        if self._thread is None:
            self._beaten = self._looked = time.monotonic()
            self._lives = False
            self._end.clear()
            self._timer.start()
            self._thread = threading.Thread(
                target=self._run, args=(self._end,), name="watchdog", daemon=True
            )
            self._thread.start()

    def forget(self, engine: QtQml.QQmlEngine) -> None:
        """Watch an engine no longer; safe to call twice."""
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
        lived, self._lives = self._lives, True
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
        # It is unknown whether the event loop will run once more.
        self._lives = False

    # The thread that watches.

    def _run(self, end: threading.Event) -> None:
        while not end.wait(_LOOK):
            self._look()
            if self._looked - self._beaten > 2 * _LOOK:
                try:
                    self._look_closely(end)
                except Exception:
                    _log.exception("internal error: the screen is watched no longer")
                    return

    def _look(self) -> float:
        """Say that the thread looks; returns the seconds since, 0 when it could not look."""
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
                # What it did is unknown.
                continue
            still += passed
            running = [watched for watched in tuple(self._watched.values()) if watched.is_running]
            # The stack grows downwards: what is called last is lowest.
            innermost = min(running, key=lambda watched: watched.stack.frame, default=None)
            if innermost is not None and (used.runs or computed > _BUSY * passed):
                last, handler = handler, innermost.handler
                script = (script if handler == last else 0.0) + computed + ready / _LOAD_FACTOR
                if script < limit:
                    continue
                if self._beaten == beaten and self._end_script(innermost, script):
                    return
            if self._lives and still >= limit and not self._report and self._beaten == beaten:
                self._tell_still(still, innermost)

    def _end_script(self, watched: _Watched, seconds: float) -> bool:
        """Have JavaScript end that runs now; returns whether it did."""
        callers, handler = watched.stack.callers(), watched.handler
        ended, late, alone, shared = False, 0.0, list(_HOLDS), list(_SHARED_HOLDS)
        for _ in range(_TRIES):
            time.sleep(_REST)
            ended = watched.handler != handler
            if ended:
                break
            # Interrupted while it waits for this thread's processor, it would not be seen to end.
            if not self._computes() and self._use().runs:
                continue
            if not shared:
                break
            # Asked again: what calls Python all the time computes only now and then.
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
            self._tell_ended(watched, callers, seconds, late)
        return ended

    def _computes(self) -> bool:
        """Return whether the GUI thread computes right now, beside this one."""
        if self._alone:
            return True
        began, before = time.perf_counter(), self._clock()
        while time.perf_counter() < began + _GLANCE:
            pass
        return self._clock() - before > _GLANCE / 5

    def _tell_ended(
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

    def _tell_still(self, seconds: float, watched: _Watched | None) -> None:
        """Report a blocked GUI thread that does not run JavaScript; it can only be waited for."""
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
                watched.tell(text)

        self._session.executor.post(show)


def _place(caller: Caller) -> str:
    name = caller.function.removeprefix("expression for ")
    return f"{caller.place}{f' ({name})' if name else ''}"


def _identity(frame: FrameType) -> tuple[int, object]:
    """Return the identity of a frame, without keeping its objects."""
    return id(frame), frame.f_code


def _python_place(frame: FrameType) -> str:
    """Return where Python is, in the program's own files if it is called from there."""
    found: FrameType | None = frame
    while found is not None and found.f_code.co_filename.startswith((_OURS, *_LIBRARIES, "<")):
        found = found.f_back
    shown = found or frame
    return f"{shown.f_code.co_filename}:{shown.f_lineno} ({shown.f_code.co_name})"


def _thread_clock(ident: int) -> Callable[[], float]:
    """Return a function for the seconds of processor time of a thread."""
    of_thread: Any = getattr(time, "pthread_getcpuclockid", None)
    if of_thread is None:
        # On Windows, other threads than this one hardly ever compute while nothing is drawn.
        return time.process_time
    clock = of_thread(ident)
    return lambda: time.clock_gettime(clock)


def _watch_thread(number: int, clock: Callable[[], float]) -> Callable[[], _Use]:
    """Return a function for the present activity of a thread.

    Args:
        number: Of the thread, the system's.
        clock: Tells for how many seconds it has computed.
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
