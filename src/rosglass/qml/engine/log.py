"""Logging from QML through Python's logging, with the QML file and line."""

from __future__ import annotations

import copy
import logging
import math
import re
import threading
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from rosglass.comm.log import RosoutHandler
from rosglass.errors import Error
from rosglass.qml.engine.process import NETWORK_HINT
from rosglass.qt import QtCore, QtQml

if TYPE_CHECKING:
    from collections.abc import Hashable, Sequence

    from rosglass.comm.node import Node


__all__ = [
    "ROOT",
    "Caller",
    "LocationFormatter",
    "QmlRosout",
    "RateLimit",
    "declared_at",
    "explain",
    "forget_repeats",
    "install_message_handler",
    "log_engine_warnings",
    "log_from_qml",
    "logger_name",
    "plain_path",
]

#: The parent of all loggers for QML.
ROOT = "rosglass.qml"


class Caller(NamedTuple):
    """The location of an event in the QML files.

    Attributes:
        file: Local path, or URL.
        line: 1-based line.
        function: Name of the JavaScript function; empty for bindings.
    """

    file: str
    line: int
    function: str

    @property
    def place(self) -> str:
        """The location as ``file:line``, which editors understand."""
        return f"{self.file}:{self.line}"


def plain_path(url: str) -> str:
    """Return a file URL's path; other URLs unchanged."""
    local = QtCore.QUrl(url)
    return local.toLocalFile() if local.isLocalFile() else url


def context_of(item: QtCore.QObject) -> QtQml.QQmlContext | None:
    """Return an object's QML context; None without one, and after the end of its engine.

    Every use of a context crashes once the engine is destroyed, except for this question.
    """
    context = QtQml.QQmlEngine.contextForObject(item)
    return context if context is not None and context.isValid() else None


def declared_at(item: QtCore.QObject) -> Caller:
    """Return where QML declares an object, or the first one around it that QML has made.

    QML does not say the line. It is found in the file: by the type, if only one object is of it, or
    by its id; 0 otherwise.
    """
    while (context := context_of(item)) is None:
        above = item.parent()
        if above is None:
            return Caller("<python>", 0, "")
        item = above
    file, name = plain_path(context.baseUrl().toString()), context.nameForObject(item)
    # Types that are QML files have a suffix, and so have objects with properties of their own.
    made = item.metaObject().className().partition("_QML")[0]
    kind = getattr(type(item), "QML_NAME", made)
    try:
        text = Path(file).read_text(encoding="utf-8")
    except (OSError, ValueError):  # a file that is compiled in, or of a web server
        return Caller(file, 0, "")
    lines = [line.partition("//")[0] for line in text.splitlines()]
    starts = [n for n, line in enumerate(lines, 1) if re.search(rf"\b{kind}\s*\{{", line)]
    if len(starts) > 1 and name:
        found = re.compile(rf"\bid\s*:\s*{name}\b")
        at = next((n for n, line in enumerate(lines, 1) if found.search(line)), 0)
        starts = [n for n in starts if n <= at][-1:]
    return Caller(file, starts[0] if len(starts) == 1 else 0, "")


def logger_name(name: str) -> str:
    """Return the name of a QML logger's Python logger; an empty `name` means the node's own."""
    return f"{ROOT}.{name}" if name else ROOT


def log_from_qml(name: str, level: int, message: str, caller: Caller) -> None:
    """Log a message from QML.

    Args:
        name: Name of the QML logger; empty for the node's own.
        level: The level in Python's logging.
        message: The text.
        caller: The QML line that logged it.
    """
    logger = logging.getLogger(logger_name(name))
    if not logger.isEnabledFor(level):
        return
    file, line, function = caller
    record = logger.makeRecord(
        logger.name, level, file, line, "%s", (message,), None, function or None
    )
    logger.handle(record)


class RateLimit:
    """Allows one log line of each kind every `seconds`."""

    def __init__(self, seconds: float = 5.0) -> None:
        self._seconds = seconds
        self._last: dict[Hashable, float] = {}

    def allows(self, kind: Hashable) -> bool:
        """Return whether a line of this kind may be logged now."""
        now = time.monotonic()
        if now - self._last.get(kind, -self._seconds) < self._seconds:
            return False
        if len(self._last) > 100:
            self._last.clear()
        self._last[kind] = now
        return True


class LocationFormatter(logging.Formatter):
    """Formats records from QML as ``file:line: LEVEL text``, others as ``LEVEL logger: text``."""

    def __init__(self) -> None:
        super().__init__("%(levelname)s %(name)s: %(message)s")

    def format(self, record: logging.LogRecord) -> str:
        """Return a record as a line of text."""
        if not record.name.startswith(ROOT) or record.pathname.endswith((".py", "<python>")):
            return super().format(record)
        name = record.name.removeprefix(ROOT).lstrip(".")
        logger = f" {name}" if name else ""
        place = f"{record.pathname}:{record.lineno}" if record.lineno else record.pathname
        message = record.getMessage().removeprefix(f"{place}: ")
        return f"{place}: {record.levelname}{logger}: {message}"


_TYPES = {
    QtCore.QtMsgType.QtDebugMsg: logging.DEBUG,
    QtCore.QtMsgType.QtInfoMsg: logging.INFO,
    QtCore.QtMsgType.QtWarningMsg: logging.WARNING,
    QtCore.QtMsgType.QtCriticalMsg: logging.ERROR,
    QtCore.QtMsgType.QtFatalMsg: logging.CRITICAL,
}
_HINTS = {
    "ReferenceError: rviz is not defined": (
        "; only overlays of a 3D view have it: rosglass view --overlay FILE, or rosglass rviz"
    ),
    "XMLHttpRequest: Tried to use GET on a local file despite being disabled.": (
        " Set QML_XHR_ALLOW_FILE_READ to 1 to enable this feature."
    ),
    "XMLHttpRequest: Tried to use PUT on a local file despite being disabled.": (
        " Set QML_XHR_ALLOW_FILE_WRITE to 1 to enable this feature."
    ),
}
#: Qt's error when the proxy that refuses all requests cannot be reached.
_REFUSED = re.compile(r"\b[Pp]roxy\b")
_handling = threading.local()
#: Seconds until a repeated warning is logged again, with its count.
_REPEAT_S = 60.0
#: Maximum number of remembered warnings and locations.
_MOST = 1000


class _Repeats:
    """Limits repeated warnings of QML's engine: a binding repeats its own with every message.

    Each is logged on its 1st, 10th, 100th occurrence and so on, and once a minute.
    """

    def __init__(self) -> None:
        #: Location and text -> occurrences, and how often and when (monotonic) it was logged.
        self._seen: dict[tuple[Caller, str], tuple[int, int, float]] = {}
        #: Location -> cause of errors there.
        self._causes: dict[tuple[str, int], str] = {}

    def forget(self) -> None:
        self._seen.clear()
        self._causes.clear()

    def explain(self, caller: Caller, cause: str) -> None:
        if len(self._causes) >= _MOST:
            self._causes.clear()
        self._causes[caller.file, caller.line] = cause

    def cause(self, caller: Caller) -> str:
        return self._causes.get((caller.file, caller.line), "")

    def counted(self, caller: Caller, text: str) -> str:
        """Count a warning; return the text to log, empty for none."""
        now = time.monotonic()
        if len(self._seen) >= _MOST:
            self._seen.clear()
        count, logged, at = self._seen.get((caller, text), (0, 0, -math.inf))
        count += 1
        if str(count).strip("0") != "1" and now - at < _REPEAT_S:
            self._seen[caller, text] = count, logged, at
            return ""
        self._seen[caller, text] = count, count, now
        return f"{text} ({count - logged} more times)" if logged else text


_repeats = _Repeats()


def explain(caller: Caller, cause: str) -> None:
    """Add a cause to the errors that Qt reports for a QML line from now on."""
    _repeats.explain(caller, cause)


def forget_repeats() -> None:
    """Allow earlier warnings to be logged again, as the files may have changed."""
    _repeats.forget()


def _handle(mode: Any, context: Any, message: str) -> None:
    # A log handler that uses Qt may cause further messages from Qt.
    if getattr(_handling, "busy", False):
        return
    _handling.busy = True
    try:
        level = _TYPES.get(mode, logging.WARNING)
        category = context.category or "default"
        file = context.file or ""
        text = message.removeprefix(f"{file}:{context.line}: ") if file else message
        text = _with_hint(text)
        if not file:
            logging.getLogger(f"rosglass.qt.{category}").log(level, "%s", text)
            return
        # Authors expect to see console.log(), which Qt treats as a debug message.
        if category in {"qml", "js"} and level == logging.DEBUG:
            level = logging.INFO
        caller = Caller(plain_path(file), max(context.line, 0), context.function or "")
        if category == "default" and level == logging.WARNING:
            _log_warning(text, caller)
        else:
            log_from_qml("", level, text, caller)
    finally:
        _handling.busy = False


def _with_hint(text: str) -> str:
    return text + (NETWORK_HINT if _REFUSED.search(text) else _HINTS.get(text, ""))


def _log_warning(text: str, caller: Caller, prefix: str = "") -> None:
    """Log a warning of QML's engine, unless the same was logged recently."""
    cause = _repeats.cause(caller) if text.startswith("TypeError") else ""
    text = _repeats.counted(caller, f"{text}; {cause}" if cause else text)
    if text:
        log_from_qml("", logging.WARNING, prefix + text, caller)


def install_message_handler() -> None:
    """Redirect Qt's messages, QML warnings and ``console.log()`` to Python's logging."""
    QtCore.qInstallMessageHandler(_handle)


def log_engine_warnings(engine: QtQml.QQmlEngine) -> None:
    """Redirect an engine's warnings to Python's logging, with cause and count.

    Not if a Qt message handler is installed, ours or the program's: that receives them.
    """
    # Qt has no other way to get the current handler.
    handler = QtCore.qInstallMessageHandler(None)
    if handler is not None:
        QtCore.qInstallMessageHandler(handler)
        return
    engine.setOutputWarningsToStandardError(False)
    engine.warnings.connect(_on_warnings)


def _on_warnings(warnings: Sequence[QtQml.QQmlError]) -> None:
    for warning in warnings:
        caller = Caller(plain_path(warning.url().toString()), max(warning.line(), 0), "")
        # The program's own log format may not show the location.
        _log_warning(_with_hint(warning.description()), caller, f"{caller.place}: ")


class QmlRosout(logging.Handler):
    """Forwards log records from QML, with file and line, to ``/rosout`` until it is closed.

    Records of the elements themselves are forwarded only from WARNING on.

    Args:
        node: The node whose log is published.
    """

    def __init__(self, node: Node) -> None:
        super().__init__()
        self._node = node
        logger = logging.getLogger(ROOT)
        if logger.level == logging.NOTSET:
            # ROS's default level; Python's would drop the info messages of interfaces.
            logger.setLevel(logging.INFO)
        logger.addHandler(self)

    def emit(self, record: logging.LogRecord) -> None:
        """Forward a record."""
        if record.pathname.endswith(".py") and record.levelno < logging.WARNING:
            return
        try:
            logger = self._node.logger
        except Error:
            return
        if not (logger.isEnabledFor(record.levelno) or _has_level(record.name)):
            return
        copied = copy.copy(record)
        copied.name = logger.name + record.name.removeprefix(ROOT)
        # The record has already been printed; only publish it.
        for handler in logger.handlers:
            if isinstance(handler, RosoutHandler):
                handler.emit(copied)

    def close(self) -> None:
        """Stop forwarding; safe to call twice."""
        logging.getLogger(ROOT).removeHandler(self)
        super().close()


def _has_level(name: str) -> bool:
    """Return whether a named QML logger has its own level; its records have passed that level."""
    while name.startswith(f"{ROOT}."):
        if logging.getLogger(name).level != logging.NOTSET:
            return True
        name = name.rpartition(".")[0]
    return False
