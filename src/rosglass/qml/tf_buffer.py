"""``TfBuffer``: the transforms below one namespace; ``TfTransformListener``: the robot's own."""
# ruff: noqa: N815 - the names of signals are QML's

from __future__ import annotations

from typing import TYPE_CHECKING

from rosglass.errors import Error
from rosglass.qml.dialect import Dialect
from rosglass.qml.tf_queries import TfQueries
from rosglass.qt import Property, Signal, Slot, is_alive

if TYPE_CHECKING:
    from rosglass.comm.node import Node
    from rosglass.qml.runtime import Runtime
    from rosglass.qt import QtCore

__all__ = ["RosTfBuffer", "RosTfTransformListener", "TfBuffer", "TfTransformListener"]


class _Listening(TfQueries):
    """Receives transforms for as long as it exists."""

    #: Transforms came; many that come at once are told once.
    transformChanged = Signal()
    #: Frames came, went, or have another parent.
    framesChanged = Signal()
    #: The buffer is another one, or there is none any more.
    bufferChanged = Signal()
    problemChanged = Signal()

    _HOLDS = ("_link", "_have")

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        super().__init__(parent, runtime)
        self._have: tuple[Node, str] | None = None

    problem = Property(str, lambda self: self._problem, notify=problemChanged)

    @Slot()
    def clear(self) -> None:
        """Forget every transform but the static ones."""
        buffer = self.buffer
        if buffer is not None:
            buffer.clear()
            self.transformChanged.emit()

    def _namespace(self) -> str:
        return "/"

    def _update(self) -> None:
        node, session = self.node, self._session
        want = None if node is None else (node, self._namespace())
        if want == self._have or session is None:
            return
        self._leave()
        self._have = want
        if want is not None:
            from rosglass.qml.tf_link import TfLink  # noqa: PLC0415 - brings in the transforms

            link = self._link = TfLink.join(session, want[0], want[1], self)
            watches = [
                link.buffer.on_update(self._on_update, session.executor),
                link.buffer.on_tree_change(self._on_tree, session.executor),
            ]

            def end() -> None:
                for watch in watches:
                    watch.close()
                link.leave(self)

            self._at_end["link"] = end
        self.bufferChanged.emit()

    def _leave(self) -> None:
        self._link = None
        end = self._at_end.pop("link", None)
        if end is not None:
            end()

    def _on_update(self) -> None:
        if is_alive(self):
            self.transformChanged.emit()

    def _on_tree(self) -> None:
        if is_alive(self):
            self.framesChanged.emit()

    @Slot()
    def _on_tick(self) -> None:
        self._say(self._link.problem if self._link is not None else "")

    def _problem_changed(self) -> None:
        self.problemChanged.emit()


class TfTransformListener(_Listening):
    """The singleton ``TfTransformListener``: the transforms on ``/tf`` and ``/tf_static``."""

    @Slot()
    def initialize(self) -> None:
        """Listen; being mentioned is enough for that."""


class TfBuffer(_Listening):
    """Transforms below one namespace, apart from all others. See its page in ``docs/elements``."""

    nsChanged = Signal()

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        super().__init__(parent, runtime)
        self._ns = ""

    def _namespace(self) -> str:
        return self._ns or "/"

    def _set_ns(self, namespace: str) -> None:
        from rosglass.comm.names import expand  # noqa: PLC0415 - not needed at start-up

        namespace = namespace.rstrip("/")
        if namespace == self._ns:
            return
        try:
            if namespace:
                expand(namespace, "node", "/")
        except Error as error:
            self._refuse(f"TfBuffer: ns: {error}")
            return
        self._ns = namespace
        self.nsChanged.emit()
        self._schedule()

    ns = Property(str, lambda self: self._ns, _set_ns, notify=nsChanged)


class RosTfTransformListener(TfTransformListener):
    """The singleton ``TfTransformListener`` of ``Ros 1.0``."""

    DIALECT = Dialect.ROS1


class RosTfBuffer(TfBuffer):
    """The element ``TfBuffer`` of ``Ros 1.0``."""

    DIALECT = Dialect.ROS1
