"""The singleton ``Ros``: the node, and the makers of everything else."""
# ruff: noqa: N802 - the names of slots and signals are QML's

from __future__ import annotations

from typing import TYPE_CHECKING

from rosglass.errors import Error
from rosglass.qml.dialect import Dialect
from rosglass.qml.runtime import Runtime, runtime_of
from rosglass.qt import QtCore, Signal, Slot, is_alive

if TYPE_CHECKING:
    from rosglass.qml.session import Session

__all__ = ["Ros"]


class Ros(QtCore.QObject):
    """What QML calls ``Ros``; one per engine, all of a session sharing its node."""

    DIALECT = Dialect.ROS1

    initialized = Signal()
    shutdown = Signal()

    def __init__(self, parent: QtCore.QObject | None = None) -> None:
        super().__init__(parent)
        self._bound: Runtime | None = None
        # QML may only listen; without this, nothing would ever ask for the runtime.
        QtCore.QTimer.singleShot(0, self._bind)

    def _bind(self) -> None:
        if is_alive(self):
            _ = self._runtime

    @property
    def _runtime(self) -> Runtime:
        if self._bound is None:
            runtime = runtime_of(self)
            if runtime is None:
                raise Error("Ros belongs to no QML engine")
            self._bound = runtime
            runtime.session.initialized.connect(self.initialized)
            runtime.session.about_to_shutdown.connect(self.shutdown)
        return self._bound

    @property
    def _session(self) -> Session:
        return self._runtime.session

    @Slot(str)
    def init(self, name: str) -> None:
        """Ask for a node."""
        try:
            self._session.init(name)
        except Error as error:
            self._runtime.throw(f"Ros.init: {error}")

    @Slot(result=bool)
    def isInitialized(self) -> bool:
        """Return whether a node was asked for and not shut down again."""
        return self._session.is_initialized

    @Slot(result=bool)
    def ok(self) -> bool:
        """Return whether there is a node, or one is being made; false after a failure."""
        return self._session.state not in {"uninitialized", "failed"}

    @Slot(result=str)
    def getName(self) -> str:
        """Return the node's base name; empty before init."""
        return self._session.name

    @Slot(result=str)
    def getNamespace(self) -> str:
        """Return the node's namespace; empty before init."""
        return self._session.namespace
