"""The runtime of one QML engine: its session, JavaScript helpers and value conversions."""

from __future__ import annotations

import logging
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rosglass.comm.names import similar
from rosglass.errors import ConversionError, Error
from rosglass.qml.engine.dialect import Dialect
from rosglass.qml.engine.from_js import elements_from_js, numpy
from rosglass.qml.engine.js_values import fraction, number_from_text, qos_parts
from rosglass.qml.engine.log import Caller, context_of, explain, log_from_qml, plain_path
from rosglass.qml.engine.session import Session
from rosglass.qml.engine.to_js import MessageConverter
from rosglass.qt import QT6, QJSValue, QtCore, QtQml, Signal, Slot, is_alive

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from rosglass.comm.qos import QoS
    from rosglass.comm.time import Duration, Time
    from rosglass.messages.schema import Schema


__all__ = ["UNPREPARED", "Host", "JsCalls", "Runtime", "own_runtime", "runtime_of"]

_NS = 1_000_000_000
#: The file of a caller that is not QML.
_NO_FILE = "<python>"
#: Largest number of whole seconds that a double holds exactly, in nanoseconds.
_LONGEST = 2**53 * _NS


class Host(QtCore.QObject):
    """Serves the scripts of one engine.

    Args:
        runtime: The engine's runtime; also the parent, so that JavaScript does not collect it.
    """

    def __init__(self, runtime: Runtime) -> None:
        super().__init__(runtime)
        self._runtime = runtime
        self._types: list[tuple[Schema, Dialect]] = []
        #: Locations and names of missing fields that have been logged.
        self.named: set[tuple[str, int, str]] = set()

    @Slot(str, str, "QStringList")
    def missing(self, type: str, name: str, known: list[str]) -> None:
        """Log that QML reads a field that a message does not have, once per location.

        A name unlike any field may be read to test for its existence, so this is not a warning.
        Errors that result from it are explained.
        """
        caller = self._runtime.caller()
        if not caller.line:
            return  # read by Python
        hint = similar(name, known)
        text = f"{type} has no field {name!r:.80}{hint or '; it has ' + ', '.join(known[:20])}"
        explain(caller, text)
        place = (caller.file, caller.line, name)
        if place not in self.named:
            self.named.add(place)
            level, end = (logging.WARNING, "") if hint else (logging.INFO, ".")
            log_from_qml("", level, f"{text}{end} It is undefined here.", caller)

    def know(self, schema: Schema, dialect: Dialect) -> int:
        """Register a type; return its number for scripts."""
        self._types.append((schema, dialect))
        return len(self._types) - 1

    @Slot(int, result=QJSValue)
    def empty(self, number: int) -> QJSValue:
        """Return a message of a type with every field at its default."""
        if not 0 <= number < len(self._types):
            return QJSValue()
        schema, dialect = self._types[number]
        return self._runtime.message(schema.type.create(), dialect)

    @Slot(float, float, float, result=QJSValue)
    def multiply(self, sec: float, nanosec: float, factor: float) -> QJSValue:
        """Return a duration times a number, rounded to nanoseconds, as seconds and nanoseconds."""
        total = round(fraction(factor) * (int(sec) * _NS + int(nanosec)))
        return self._runtime.value(list(divmod(total, _NS)))

    @Slot(str, int, result=QJSValue)
    def parts(self, text: str, digits: int) -> QJSValue:
        """Return the seconds and nanoseconds of a decimal number.

        Args:
            text: The number.
            digits: Its unit, as a power of ten: 0 for seconds, 9 for nanoseconds.
        """
        try:
            found = number_from_text(text) * _NS / 10**digits
            if abs(found) > _LONGEST:
                raise ConversionError("", text, "a time that JavaScript can hold")
        except Error as error:
            self._runtime.throw(str(error))
            return QJSValue()
        return self._runtime.value(list(divmod(round(found), _NS)))

    @Slot(str, QJSValue, result="QVariant")
    def pack(self, kind: str, values: QJSValue) -> QtCore.QByteArray | None:
        """Pack 64-bit integers, given as numbers or decimal text, into bytes."""
        np = numpy()
        try:
            whole: list[Any] = elements_from_js(values, kind)
            packed = np.array(whole, np.dtype(kind)).tobytes()
        except (Error, OverflowError, TypeError, ValueError) as error:
            self._runtime.throw(f"these are not {kind}: {error}")
            return None
        return QtCore.QByteArray(packed)


_log = logging.getLogger("rosglass.qml")
_FOLDER = Path(__file__).parent
_NAME = "rosglass.runtime"
#: Our own scripts, which are never reported as the location of a message.
_OWN_SCRIPTS = tuple(str(_FOLDER / name) for name in ("times.js", "arrays.js", "helpers.js"))
#: Error for an object in an engine without a runtime.
UNPREPARED = "call rosglass.qml.install(engine) before the QML engine loads anything"
#: Names of the functions that helpers.js returns.
_HELPERS = (
    "build",
    "buildWithNan",
    "shape",
    "makeTime",
    "createTime",
    "timeParts",
    "clock",
    "makeQos",
    "makeOptions",
)
_CALL_SCRIPT = """(function (calls, jobs) {
    function thrown(value) {
        return Object.assign(new Error(String(value)), { fileName: undefined })
    }
    calls.asked.connect(function (number) {
        const job = jobs[number]
        try {
            job.result = job.callee.apply(undefined, job.passed)
        } catch (error) {
            job.result = error instanceof Error ? error : thrown(error)
        }
        job.done = true
    })
})"""
_ENDED = "new Error('the function was ended because it blocked the interface')"
_PROMISE = """(function () {
    let made = {}
    made.promise = new Promise(function (resolve, reject) {
        made.resolve = resolve
        made.reject = function (text) { reject(new Error(text)) }
    })
    return made
})"""


class JsCalls(QtCore.QObject):
    """Calls JavaScript functions in the thread of their engine, without holding the GIL.

    QJSValue.call holds the GIL until the function returns, so that the watchdog could not end an
    endless function. Sending a signal releases the GIL.

    Args:
        engine: The engine.
    """

    asked = Signal(int)

    def __init__(self, engine: QtQml.QQmlEngine) -> None:
        super().__init__(engine)
        self._engine = engine
        self._jobs, self._number = engine.newObject(), 0
        script: Any = engine.evaluate(_CALL_SCRIPT)
        script.call([engine.newQObject(self), self._jobs])

    def call(self, function: QJSValue, arguments: Sequence[QJSValue]) -> QJSValue:
        """Return the function's result; a JavaScript error if it threw or was ended."""
        self._number = (self._number + 1) % 2**31
        name = str(self._number)
        job, passed = self._engine.newObject(), self._engine.newArray(len(arguments))
        for index, argument in enumerate(arguments):
            passed.setProperty(index, argument)
        job.setProperty("callee", function)
        job.setProperty("passed", passed)
        self._jobs.setProperty(name, job)
        try:
            self.asked.emit(self._number)
        finally:
            self._jobs.deleteProperty(name)
        result: Any = job.property("result")
        if not job.property("done").toBool():
            result = self._engine.evaluate(_ENDED)
        value: QJSValue = result
        return value


class Runtime(QtCore.QObject):
    """State of one engine; a child of the engine, found by :func:`runtime_of`.

    Args:
        engine: The engine.
        session: The session that its QML uses.
    """

    def __init__(self, engine: QtQml.QQmlEngine, session: Session) -> None:
        super().__init__(engine)
        self.setObjectName(_NAME)
        engine.rootContext().setContextProperty(_NAME, self)
        self.session = session
        self._engine = engine
        #: Objects that JavaScript has not let go yet.
        self.kept: set[QtCore.QObject] = set()
        self.host = Host(self)
        #: Returns a message as a JavaScript value; see :meth:`MessageConverter.convert`.
        self.message = MessageConverter(self, engine).convert

    @cached_property
    def helpers(self) -> dict[str, QJSValue]:
        """Functions of our scripts; loaded for the first value, after the first frame."""
        parts = [self._script(name) for name in ("times.js", "arrays.js")]
        host = self._engine.newQObject(self.host)
        made = self._script("helpers.js").call([*parts, host, QJSValue(not QT6)])
        found = {name: made.property(name) for name in _HELPERS}
        for name, helper in found.items():
            if not helper.isCallable():
                raise Error(f"helpers.js: {name}: {made.toString()}")
        found["makePromise"] = _evaluate(self._engine, _PROMISE)
        return found

    @cached_property
    def _calls(self) -> JsCalls:
        return JsCalls(self._engine)

    def call(self, function: QJSValue, arguments: Sequence[QJSValue]) -> QJSValue:
        """Call a QML function; return its result, or the error that it throws.

        Raises:
            Error: The engine no longer exists.
        """
        if self.engine is None:
            raise Error("the QML engine of this function is gone")
        return self._calls.call(function, arguments)

    def errors_of(self, emit: Callable[[], None]) -> list[str]:
        """Emit a signal; return the errors that QML's handlers of it threw, with file and line.

        Errors of bindings that change while a handler runs are not among them.
        """
        found: list[str] = []

        def note(warnings: Sequence[QtQml.QQmlError]) -> None:
            if self.caller().file == _NO_FILE:  # no handler is running: it has been left
                found.extend(warning.toString() for warning in warnings)

        engine = self.engine
        if engine is None:
            return found
        engine.warnings.connect(note)
        try:
            emit()
        finally:
            if is_alive(engine):
                engine.warnings.disconnect(note)
        return found

    @property
    def engine(self) -> QtQml.QQmlEngine | None:
        """The engine; None if it no longer exists."""
        return self._engine if is_alive(self._engine) else None

    def throw(self, message: str) -> None:
        """Throw a JavaScript Error from the running slot."""
        engine = self.engine
        if engine is not None:
            engine.throwError(message)

    def caller(self) -> Caller:
        """Return the QML line that called the running slot."""
        engine = self.engine
        stack = "" if engine is None else _evaluate(engine, "new Error().stack").toString()
        for frame in stack.splitlines()[1:]:
            function, _, place = frame.partition("@")
            file, _, line = place.rpartition(":")
            path = plain_path(file)
            if line.lstrip("-").isdigit() and not path.startswith(_OWN_SCRIPTS):
                return Caller(path, max(int(line), 0), function)
        return Caller(_NO_FILE, 0, "")

    def keep(self, item: QtCore.QObject) -> QtCore.QObject:
        """Transfer the ownership of an object to JavaScript's garbage collector."""
        QtQml.QQmlEngine.setObjectOwnership(
            item, QtQml.QQmlEngine.ObjectOwnership.JavaScriptOwnership
        )
        self.kept.add(item)
        kept = self.kept
        item.destroyed.connect(lambda: kept.discard(item))
        return item

    def value(self, value: Any) -> QJSValue:
        """Convert a plain value (None, bool, number, text, list, dict) for JavaScript."""
        engine = self.engine
        if engine is None or value is None:
            return QJSValue()
        if isinstance(value, str):
            return QJSValue(value)
        if isinstance(value, (bool, int, float)):
            # QJSValue's constructors truncate numbers to 32 bits, and PySide2's to integers.
            plain = value if isinstance(value, bool) else float(value)
            script: Any = engine.toScriptValue(plain)
            scalar: QJSValue = script
            return scalar
        if isinstance(value, dict):
            made = engine.newObject()
            for key, inner in value.items():
                made.setProperty(key, self.value(inner))
            return made
        made = engine.newArray(len(value))
        for index, inner in enumerate(value):
            made.setProperty(index, self.value(inner))
        return made

    def promise(self) -> tuple[QJSValue, QJSValue, QJSValue]:
        """Return a JavaScript promise, and the functions that resolve and reject it."""
        made = self.call_helper("makePromise", [])
        return made.property("promise"), made.property("resolve"), made.property("reject")

    def time(self, time: Time, dialect: Dialect = Dialect.ROS2) -> QJSValue:
        """Return a time in the style of the module's messages: with seconds() or toSec()."""
        return self._make_time(dialect, "time", time.sec, time.nanosec)

    def duration(self, duration: Duration, dialect: Dialect = Dialect.ROS2) -> QJSValue:
        """Return a duration in the style of the module's messages: milliseconds in ``Ros 1.0``."""
        return self._make_time(dialect, "duration", *divmod(duration.nanoseconds, 10**9))

    def _make_time(self, dialect: Dialect, kind: str, sec: int, nanosec: int) -> QJSValue:
        return self.call_helper(
            "makeTime", [self.value(v) for v in (dialect.ros, kind, sec, nanosec)]
        )

    def create_time(
        self, dialect: Dialect, kind: str, first: QJSValue, second: QJSValue
    ) -> QJSValue:
        """Create a time or duration for ``Ros2.time()`` and similar functions.

        Returns:
            The value; a JavaScript error if the arguments are invalid.
        """
        arguments = [self.value(dialect.ros), self.value(kind), first, second]
        result: QJSValue = self.helpers["createTime"].call(arguments)
        return result

    def clock(self, number: int) -> QJSValue:
        """Return the JavaScript object of a clock type, by rcl's number."""
        return self.call_helper("clock", [self.value(number)])

    def options(self) -> QJSValue:
        """Return an empty set of init options."""
        return self.call_helper("makeOptions", [])

    def qos(self, qos: QoS) -> QJSValue:
        """Return a profile that QML can change and pass to publishers and subscriptions."""
        return self.call_helper("makeQos", [self.value(part) for part in qos_parts(qos)])

    def _script(self, name: str) -> QJSValue:
        file = _FOLDER / name
        result = _evaluate(self._engine, file.read_text(encoding="utf-8"), str(file))
        if result.isError():
            raise Error(f"{file}:{result.property('lineNumber').toString()}: {result.toString()}")
        return result

    def call_helper(self, name: str, arguments: list[QJSValue]) -> QJSValue:
        """Call a function of helpers.js; return undefined, and log the error, if it throws."""
        if self.engine is None:
            return QJSValue()
        return self.checked(name, self.helpers[name].call(arguments))

    def checked(self, name: str, result: QJSValue) -> QJSValue:
        """Return the result of a helper; undefined, with the error logged, if it threw."""
        if result.isError():
            _log.error("internal error: %s: %s", name, result.toString())
            return QJSValue()
        return result


def runtime_of(item: QtCore.QObject) -> Runtime | None:
    """Return the runtime of an object's engine; None for an engine without one.

    If `item` is itself an engine without a runtime, it gets one with the application's own session.
    """
    if isinstance(item, QtQml.QQmlEngine):
        child = item.findChild(Runtime, _NAME)
        return child if isinstance(child, Runtime) else Runtime(item, Session.default())
    context = context_of(item)
    # Not from the context's engine: PySide2 would treat the context as its owner and destroy it.
    found = context.contextProperty(_NAME) if context is not None else None
    return found if isinstance(found, Runtime) else None


def own_runtime(item: QtCore.QObject) -> Runtime:
    """Return the runtime of the engine that created an object.

    Raises:
        Error: The engine has no runtime.
    """
    runtime = runtime_of(item)
    if runtime is None:
        raise Error(f"{type(item).__name__} cannot be used yet: {UNPREPARED}")
    return runtime


def _evaluate(engine: QtQml.QQmlEngine, script: str, file: str = "") -> QJSValue:
    result: Any = engine.evaluate(script, file)
    value: QJSValue = result
    return value
