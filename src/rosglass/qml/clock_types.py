"""The enumeration ``Ros2ClockTypes``."""

from __future__ import annotations

from enum import IntEnum

from rosglass.qt import QtCore

__all__ = ["ClockTypes"]


class ClockTypes(QtCore.QObject):
    """Kinds of clocks; their numbers are rcl's (``rcl_clock_type_t``)."""

    @QtCore.QEnum
    class Type(IntEnum):
        """Where a time comes from."""

        Uninitialized = 0
        Ros = 1
        System = 2
        Steady = 3
