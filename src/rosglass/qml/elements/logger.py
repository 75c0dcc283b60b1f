"""Loggers and their levels in QML: ``Ros2.getLogger()`` and ``Ros.console``."""
# ruff: noqa: N802, N815 - the names of slots and signals are QML's

from __future__ import annotations

import logging
from enum import IntEnum
from typing import TYPE_CHECKING

from rosglass.qml.engine.log import log_from_qml
from rosglass.qt import Property, QJSValue, QtCore, Slot

if TYPE_CHECKING:
    from rosglass.qml.engine.runtime import Runtime


__all__ = [
    "DEFAULT_LOGGER",
    "Console",
    "ConsoleLevels",
    "InitOptions",
    "Logger",
    "LoggerLevel",
    "short_logger",
]


class LoggerLevel(QtCore.QObject):
    """The levels of ``Ros2LoggerLevel``, numbered as in ROS 2 and Python."""

    @QtCore.QEnum
    class Level(IntEnum):
        """Severity of a message."""

        Unset = logging.NOTSET
        Debug = logging.DEBUG
        Info = logging.INFO
        Warn = logging.WARNING
        Error = logging.ERROR
        Fatal = logging.CRITICAL


class Logger(QtCore.QObject):
    """The logger that ``Ros2.getLogger(name)`` returns."""

    def __init__(self, runtime: Runtime, name: str, parent: QtCore.QObject) -> None:
        super().__init__(parent)
        self._runtime, self._name = runtime, name

    @Slot(QJSValue)
    def debug(self, message: QJSValue) -> None:
        """Log a debug message."""
        self._log(logging.DEBUG, message)

    @Slot(QJSValue)
    def info(self, message: QJSValue) -> None:
        """Log a message."""
        self._log(logging.INFO, message)

    @Slot(QJSValue)
    def warn(self, message: QJSValue) -> None:
        """Log a warning."""
        self._log(logging.WARNING, message)

    @Slot(QJSValue)
    def error(self, message: QJSValue) -> None:
        """Log an error."""
        self._log(logging.ERROR, message)

    @Slot(QJSValue)
    def fatal(self, message: QJSValue) -> None:
        """Log a fatal error."""
        self._log(logging.CRITICAL, message)

    @Slot(int, result=bool)
    def setLoggerLevel(self, level: int) -> bool:
        """Log only messages of this level and above; return false for an invalid level."""
        if level not in set(LoggerLevel.Level):
            log_from_qml(
                self._name,
                logging.ERROR,
                f"setLoggerLevel: {level} is not one of Ros2LoggerLevel",
                self._runtime.caller(),
            )
            return False
        self._runtime.session.set_logger_level(self._name, level)
        return True

    def _log(self, level: int, message: QJSValue) -> None:
        log_from_qml(self._name, level, message.toString(), self._runtime.caller())


#: The default logger of interfaces, named as in the reference plugin.
DEFAULT_LOGGER = "ros.qml_ros_plugin"
_LEVELS = (logging.DEBUG, logging.INFO, logging.WARNING, logging.ERROR, logging.CRITICAL)


class ConsoleLevels(QtCore.QObject):
    """The levels of ``RosConsoleLevels``."""

    @QtCore.QEnum
    class Level(IntEnum):
        """Severity of a message; ``Count`` is the number of levels."""

        Debug = 0
        Info = 1
        Warn = 2
        Error = 3
        Fatal = 4
        Count = 5


class InitOptions(QtCore.QObject):
    """The options of ``RosInitOptions``, which can be combined with ``|``."""

    @QtCore.QEnum
    class Option(IntEnum):
        """The options for creating the node."""

        NoSigintHandler = 1
        AnonymousName = 2
        NoRosout = 4


class Console(QtCore.QObject):
    """Logger names and levels of ``Ros.console``."""

    def __init__(self, runtime: Runtime, parent: QtCore.QObject) -> None:
        super().__init__(parent)
        self._runtime = runtime

    defaultName = Property(str, lambda self: DEFAULT_LOGGER, constant=True)  # noqa: ARG005

    @Slot(str, int, result=bool)
    def setLoggerLevel(self, name: str, level: int) -> bool:
        """Log only messages of this level and above; return false for an invalid level."""
        if not 0 <= level < len(_LEVELS):
            log_from_qml(
                "",
                logging.ERROR,
                f"Ros.console.setLoggerLevel: {level} is not one of RosConsoleLevels",
                self._runtime.caller(),
            )
            return False
        self._runtime.session.set_logger_level(short_logger(name), _LEVELS[level])
        return True


def short_logger(name: str) -> str:
    """Return a logger's name without the common prefix; empty for the default logger."""
    rest = name.removeprefix(DEFAULT_LOGGER)
    return rest.removeprefix(".") if rest != name else name.removeprefix("ros.")
