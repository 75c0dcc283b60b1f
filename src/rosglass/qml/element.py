"""What all elements have in common: finding their session, and settling down after changes."""

from __future__ import annotations

import logging
import time
from contextlib import suppress
from typing import TYPE_CHECKING, ClassVar, Protocol, TypeVar

from rosglass.comm.names import similar
from rosglass.errors import Error
from rosglass.qml.dialect import Dialect
from rosglass.qml.log import Caller, RateLimit, log_from_qml, plain_path
from rosglass.qml.runtime import UNPREPARED, runtime_of
from rosglass.qt import QtCore, QtQml, Slot, is_alive

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.comm.node import Node
    from rosglass.qml.runtime import Runtime
    from rosglass.qml.session import Session

__all__ = ["DEFAULT_TIMEOUT", "RETRY", "Element", "TopicElement", "changed_enough"]


class _Closable(Protocol):
    def close(self) -> None: ...


_T = TypeVar("_T", bound=_Closable)
#: Milliseconds without anyone at the other end after which a topic's name may be a mistake.
LONELY_MS = 5000
#: Milliseconds until something that is missing is looked for again.
RETRY = 1000
#: Milliseconds without data after which it counts as stale.
DEFAULT_TIMEOUT = 3000


def changed_enough(before: float, after: float) -> bool:
    """Return whether a rate changed by more than 1 %, which is when the screen is told."""
    return abs(after - before) > 0.01 * abs(before) or (after == 0) != (before == 0)


class Element(QtCore.QObject):
    """A QML object that uses the session's node.

    Properties may be set in any order and before there is a node: every change only schedules
    :meth:`_update`, which runs once the event loop is reached and brings about what is wanted.

    Args:
        parent: The parent object.
        runtime: For objects made by a function of QML; elements find their own.
    """

    #: Whose habits its values follow.
    DIALECT: ClassVar[Dialect] = Dialect.ROS2
    #: Attributes with messages and pictures, let go when QML destroys the object: PySide 6.11 never
    #: frees the Python half of what QML has made.
    _HOLDS: tuple[str, ...] = ()

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        super().__init__(parent)
        self._runtime = runtime
        #: Where a function made it.
        self._origin = runtime.caller() if runtime is not None else None
        self._session: Session | None = None
        self._scheduled = False
        self._problem = ""
        self._limit = RateLimit()
        #: What is left to do when QML destroys the object, by name.
        self._at_end: dict[str, Callable[[], None]] = {}
        self._schedule()

    @property
    def node(self) -> Node | None:
        """The node; None while there is none."""
        return self._session.node if self._session is not None else None

    @Slot()
    def _schedule(self) -> None:
        if not self._scheduled:
            self._scheduled = True
            QtCore.QTimer.singleShot(0, self._settle)

    @Slot()
    def _settle(self) -> None:
        if not is_alive(self):
            return
        self._scheduled = False
        if self._session is None and not self._find_session():
            return
        self._update()

    def _steady(self) -> float:
        """Return the time by which ages are told, in seconds."""
        session = self._session
        return session.steady() if session is not None else time.monotonic()

    def _find_session(self) -> bool:
        runtime = self._find_runtime()
        if runtime is None:
            self._say(f"{type(self).__name__} cannot be used yet: {UNPREPARED}")
            return False
        session = self._session = runtime.session
        at_end = self._at_end
        at_end["signals"] = session.attach(
            self,
            node_changed=self._on_node,
            connection_changed=self._on_connection,
            graph_changed=self._on_graph,
            tick=self._on_tick,
        )
        session.use_ticks(True)
        at_end["ticks"] = lambda: session.use_ticks(False)

        state, held = self.__dict__, self._HOLDS

        def end() -> None:
            # At the end of the program the session may be gone before the last element.
            for job in list(at_end.values()) if is_alive(session) else ():
                job()
            at_end.clear()
            for name in held:
                state.pop(name, None)

        self.destroyed.connect(end)
        return True

    def _find_runtime(self) -> Runtime | None:
        if self._runtime is None:
            self._runtime = runtime_of(self)
        return self._runtime

    def _make(
        self,
        work: Callable[[], _T],
        is_wanted: Callable[[], bool],
        done: Callable[[_T | Error], None],
    ) -> None:
        """Make something that can be closed, on the worker.

        Args:
            work: Makes it.
            is_wanted: Whether it is wanted still; it is closed otherwise.
            done: Told what was made, or why it was not, on the GUI thread.
        """
        session = self._session
        assert session is not None

        def made(result: _T | Error) -> None:
            if is_alive(self) and is_wanted():
                done(result)
            elif not isinstance(result, Error):
                session.background(result.close)

        session.background(work, made)

    def _update(self) -> None:
        """Bring about what the properties ask for."""
        raise AssertionError("every element has its own")

    @Slot()
    def _on_node(self) -> None:
        """There is a node now, or none any more, which must not be used a moment longer."""
        if self._session is None or self._session.node is None:
            self._settle()
        else:
            self._schedule()

    @Slot()
    def _on_connection(self) -> None:
        """The session's connection state changed."""

    @Slot()
    def _on_graph(self) -> None:
        """Nodes or endpoints appeared or went."""

    @Slot()
    def _on_tick(self) -> None:
        """A tenth of a second has passed."""

    def _problem_changed(self) -> None:
        """Tell QML that the problem changed."""

    def _say(self, problem: str, level: int = logging.WARNING) -> None:
        """Set the problem; a new one is logged, the same one not more often than every 5 s."""
        problem = self.DIALECT.spelled(problem)
        if problem == self._problem:
            return
        self._problem = problem
        self._tell(problem, level)
        self._problem_changed()

    def _tell(self, text: str, level: int) -> None:
        """Log something that comes from no line of QML, with the file that the object is in."""
        if not text or not self._limit.allows((text, level)):
            return
        origin = self._origin
        if origin is None:
            context = QtQml.QQmlEngine.contextForObject(self)
            file = context.baseUrl().toString() if context is not None else ""
            origin = Caller(plain_path(file) or "<python>", 0, "")
        log_from_qml("", level, text, origin)

    def _refuse(self, message: str) -> None:
        """Log that a property was given an impossible value, with the QML place if there is one."""
        runtime = self._find_runtime()
        caller = runtime.caller() if runtime is not None else Caller("<unknown>", 0, "")
        log_from_qml("", logging.ERROR, message, caller)


class TopicElement(Element):
    """An element that receives a topic and knows whether what it shows is live."""

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        super().__init__(parent, runtime)
        self._topic, self._resolved = "", ""
        self._enabled = True
        self._stale = True
        self._suspect = False
        self._publishers = 0
        #: Which publishers of the topic cannot be told apart; empty for none.
        self._mixed = ""
        self._lonely = QtCore.QTimer(self)
        self._lonely.setSingleShot(True)
        self._lonely.timeout.connect(self._wonder)

    def _expect_publishers(self) -> None:
        """Tell it after a while if nobody publishes the topic."""
        self._lonely.start(LONELY_MS)

    @Slot()
    def _wonder(self) -> None:
        """Log that nobody publishes the topic, for who looks for a mistake in its name."""
        node, session = self.node, self._session
        connected = session is not None and session.state == "connected"
        if node is None or not connected or self._count_publishers():
            return
        # A node that has just been closed answers nothing.
        with suppress(Error):
            hint = similar(self._resolved, node.topics())
            level = logging.WARNING if hint else logging.INFO
            self._tell(f"{self._resolved}: nobody publishes this topic{hint}", level)

    def _resolve(self, topic: str) -> str:
        """Return the absolute name of a topic; empty, with a problem said, when it is invalid."""
        node = self.node
        if node is None or not topic:
            return ""
        try:
            return node.resolve(topic)
        except Error as error:
            self._say(str(error))
            return ""

    def _count_publishers(self) -> int:
        node = self.node
        if node is None or not self._resolved:
            return 0
        try:
            return len(node.publishers(self._resolved))
        except Error:
            return 0

    @Slot()
    def _on_connection(self) -> None:
        if self._session is not None and self._session.state != "connected":
            self._suspect = True
        else:
            self._trust_again()
        self._judge()

    @Slot()
    def _on_graph(self) -> None:
        before, self._publishers = self._publishers, self._count_publishers()
        if before and not self._publishers:
            # The robot is gone: what is on the screen is the past, however recent.
            self._suspect = True
        else:
            self._trust_again()
        self._judge()

    def _trust_again(self) -> None:
        """Take back a suspicion that the graph has disproved."""

    @Slot()
    def _on_tick(self) -> None:
        mixed = self._session.mixing(self._resolved) if self._session is not None else ""
        if mixed != self._mixed:
            self._mixed = mixed
            self._problem_changed()
        self._judge()

    def _judge(self) -> None:
        """Find out whether what is shown is live, and tell when that changed."""
        stale = self._suspect or self._is_old()
        if stale != self._stale:
            self._stale = stale
            self._stale_changed()

    def _is_old(self) -> bool:
        """Return whether there is nothing to show, or nothing new for too long."""
        raise AssertionError("every element has its own")

    def _stale_changed(self) -> None:
        """Tell QML that :attr:`_stale` changed."""
