"""``Ros.console`` and the enums of ``Ros 1.0`` about logging and starting."""
# ruff: noqa: N802, N815 - the names of slots and properties are QML's

from __future__ import annotations

import logging
from enum import IntEnum
from typing import TYPE_CHECKING

from rosglass.qml.log import log_from_qml
from rosglass.qt import Property, QtCore, Slot

if TYPE_CHECKING:
    from rosglass.qml.runtime import Runtime

__all__ = ["DEFAULT_LOGGER", "Console", "ConsoleLevels", "InitOptions", "short_logger"]

#: The logger of interfaces, by the name that the reference gave it.
DEFAULT_LOGGER = "ros.qml_ros_plugin"
_LEVELS = (logging.DEBUG, logging.INFO, logging.WARNING, logging.ERROR, logging.CRITICAL)


class ConsoleLevels(QtCore.QObject):
    """The levels of ``RosConsoleLevels``."""

    @QtCore.QEnum
    class Level(IntEnum):
        """How important a message is; ``Count`` is their number."""

        Debug = 0
        Info = 1
        Warn = 2
        Error = 3
        Fatal = 4
        Count = 5


class InitOptions(QtCore.QObject):
    """The options of ``RosInitOptions``; can be combined with ``|``."""

    @QtCore.QEnum
    class Option(IntEnum):
        """How the node is made."""

        NoSigintHandler = 1
        AnonymousName = 2
        NoRosout = 4


class Console(QtCore.QObject):
    """Names and levels of loggers."""

    def __init__(self, runtime: Runtime, parent: QtCore.QObject) -> None:
        super().__init__(parent)
        self._runtime = runtime

    defaultName = Property(str, lambda self: DEFAULT_LOGGER, constant=True)  # noqa: ARG005

    @Slot(str, int, result=bool)
    def setLoggerLevel(self, name: str, level: int) -> bool:
        """Log only messages of this level and above; false for a number that is no level."""
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
    """Return a logger's name without the prefix that all of them have; empty for the default."""
    rest = name.removeprefix(DEFAULT_LOGGER)
    return rest.removeprefix(".") if rest != name else name.removeprefix("ros.")
