"""Loggers of QML, and their levels."""
# ruff: noqa: N802 - the names of slots are QML's

from __future__ import annotations

import logging
from enum import IntEnum
from typing import TYPE_CHECKING

from rosglass.qml.log import log_from_qml
from rosglass.qt import QJSValue, QtCore, Slot

if TYPE_CHECKING:
    from rosglass.qml.runtime import Runtime

__all__ = ["Logger", "LoggerLevel"]


class LoggerLevel(QtCore.QObject):
    """The levels of ``Ros2LoggerLevel``; their numbers are those of ROS 2 and of Python."""

    @QtCore.QEnum
    class Level(IntEnum):
        """How important a message is."""

        Unset = logging.NOTSET
        Debug = logging.DEBUG
        Info = logging.INFO
        Warn = logging.WARNING
        Error = logging.ERROR
        Fatal = logging.CRITICAL


class Logger(QtCore.QObject):
    """What ``Ros2.getLogger(name)`` returns."""

    def __init__(self, runtime: Runtime, name: str, parent: QtCore.QObject) -> None:
        super().__init__(parent)
        self._runtime, self._name = runtime, name

    @Slot(QJSValue)
    def debug(self, message: QJSValue) -> None:
        """Log a message for developers."""
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
        """Log an error after which the program is of no use."""
        self._log(logging.CRITICAL, message)

    @Slot(int, result=bool)
    def setLoggerLevel(self, level: int) -> bool:
        """Log only messages of this level and above; false for a number that is no level."""
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
