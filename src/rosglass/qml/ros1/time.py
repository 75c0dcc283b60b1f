"""The singletons ``Time`` and ``WallTime`` of ``Ros 1.0``."""
# ruff: noqa: N802 - the names of slots are QML's

from __future__ import annotations

from rosglass.comm.time import Time as Moment
from rosglass.errors import UnsupportedError
from rosglass.qml.dialect import Dialect
from rosglass.qml.runtime import Runtime, own_runtime
from rosglass.qt import QJSValue, QtCore, Slot

__all__ = ["Time", "WallTime"]


class WallTime(QtCore.QObject):
    """What QML calls ``WallTime``: the time of the operator's machine."""

    @property
    def _runtime(self) -> Runtime:
        return own_runtime(self)

    @Slot(result=QJSValue)
    def now(self) -> QJSValue:
        """Return the system's time."""
        return self._runtime.time(Moment.now(), Dialect.ROS1)

    @Slot(QJSValue, result=QJSValue)
    @Slot(QJSValue, QJSValue, result=QJSValue)
    def create(self, first: QJSValue, second: QJSValue | None = None) -> QJSValue:
        """Return a time of seconds, or of whole seconds and nanoseconds."""
        runtime = self._runtime
        made = runtime.create_time(Dialect.ROS1, "time", first, second or QJSValue())
        if made.isError():
            name = type(self).__name__
            runtime.throw(f"{name}.create: {made.property('message').toString()}")
            return QJSValue()
        return made


class Time(WallTime):
    """What QML calls ``Time``: the time of the robot, which may be simulated."""

    def _now(self) -> Moment:
        session = self._runtime.session
        if session.node is not None:
            return session.node.now()
        # Asked for, but still connecting: nobody has said yet that time is simulated.
        return Moment.now() if session.is_initialized else Moment()

    @Slot(result=QJSValue)
    def now(self) -> QJSValue:
        """Return the time of the node's clock; zero before init, and before a simulation's."""
        return self._runtime.time(self._now(), Dialect.ROS1)

    @Slot(result=bool)
    def isSimTime(self) -> bool:
        """Return whether the time comes from a simulation."""
        node = self._runtime.session.node
        try:
            return node is not None and node.clock.is_simulated
        except UnsupportedError:
            return False

    @Slot(result=bool)
    def isSystemTime(self) -> bool:
        """Return whether the time is that of the operator's machine."""
        return not self.isSimTime()

    @Slot(result=bool)
    def isValid(self) -> bool:
        """Return whether there is a time: false before init, and before a simulation's first."""
        return self._now() != Moment()
