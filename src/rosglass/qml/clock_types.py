"""The singleton ``Ros2ClockTypes``."""

from __future__ import annotations

from rosglass.qml.runtime import own_runtime
from rosglass.qt import Property, QJSValue, QtCore

__all__ = ["ClockTypes"]


class ClockTypes(QtCore.QObject):
    """Kinds of clocks; their numbers are rcl's (``rcl_clock_type_t``).

    They are what ``clockType`` of a time is, as property (Qt 5's plugin) and as function (Qt 6's).
    """

    def _get(self, number: int) -> QJSValue:
        return own_runtime(self).clock(number)

    Uninitialized = Property(QJSValue, lambda self: self._get(0), constant=True)
    Ros = Property(QJSValue, lambda self: self._get(1), constant=True)
    System = Property(QJSValue, lambda self: self._get(2), constant=True)
    Steady = Property(QJSValue, lambda self: self._get(3), constant=True)
