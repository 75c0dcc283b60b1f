"""Base classes of all QML elements: session, properties, and the endpoint on the node."""

from __future__ import annotations

import logging
import math
import time
from abc import abstractmethod
from contextlib import suppress
from typing import TYPE_CHECKING, Any, ClassVar

from rosglass.comm.names import similar
from rosglass.errors import Error, TypeNotFoundError
from rosglass.qml.engine.dialect import Dialect, resolve_namespace, within_namespace
from rosglass.qml.engine.from_js import fields_from_js
from rosglass.qml.engine.log import Caller, RateLimit, declared_at, log_from_qml
from rosglass.qml.engine.properties import ReadOnly, report
from rosglass.qml.engine.runtime import UNPREPARED, runtime_of
from rosglass.qml.engine.session import weak_callback
from rosglass.qt import QtCore, Signal, Slot, is_alive

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.comm.handle import Handle
    from rosglass.comm.node import Node
    from rosglass.comm.promise import Promise
    from rosglass.messages import MessageType
    from rosglass.qml.engine.runtime import Runtime
    from rosglass.qml.engine.session import GuiExecutor, Session
    from rosglass.qt import QJSValue


__all__ = [
    "CONNECTION_TIMEOUT_MS",
    "DEFAULT_TIMEOUT_MS",
    "RETRY_MS",
    "ClientElement",
    "Element",
    "Pace",
    "TopicElement",
    "given_fields",
    "named",
    "single_shot",
]

#: Milliseconds without a peer after which the topic's name may be misspelt.
NO_PEER_MS = 5000
#: Milliseconds until a missing type is looked up again.
RETRY_MS = 1000
#: Milliseconds without new data after which an element is stale.
DEFAULT_TIMEOUT_MS = 3000


def single_shot(parent: QtCore.QObject, on_timeout: Callable[[], None]) -> QtCore.QTimer:
    """Return a timer that fires once per start."""
    timer = QtCore.QTimer(parent)
    timer.setSingleShot(True)
    timer.timeout.connect(on_timeout)
    return timer


class Pace:
    """Turns at a rate, which is kept although timers fire late and in whole milliseconds.

    All times are in seconds of one clock.
    """

    def __init__(self) -> None:
        self._turn = -math.inf

    def wait(self, interval: float, now: float) -> float:
        """Return the time until the next turn; 0 or less if it is due.

        Args:
            interval: Wanted time between two turns.
            now: The current time.
        """
        return self._turn + interval - now

    def take(self, interval: float, now: float) -> None:
        """Begin a turn: one that is less than an interval late does not delay the next."""
        due = self._turn + interval
        self._turn = due if abs(now - due) < interval else now

    def take_ms(self, rate: float) -> int:
        """Begin a turn; return the whole milliseconds until the next one, for a timer.

        Args:
            rate: Turns per second, above 0.
        """
        interval, now = 1 / rate, time.monotonic()
        self.take(interval, now)
        return max(0, round(self.wait(interval, now) * 1000))


#: Milliseconds until an object without an engine is one that will not be destroyed.
_UNPREPARED_MS = 1000


class Element(QtCore.QObject):
    """A QML object that uses the session's node, usually through one endpoint.

    Properties may be set in any order and before there is a node: every change only schedules
    :meth:`_update`, which runs from the event loop. If :meth:`_wanted` returns other arguments than
    those of the current endpoint, it closes that endpoint, and the worker thread calls the function
    that :meth:`_factory` returns.

    Args:
        parent: The parent object.
        runtime: The engine's runtime, for objects returned by a function called from QML.
    """

    #: The module whose spelling of values and types applies.
    DIALECT: ClassVar[Dialect] = Dialect.ROS2
    #: Attributes with messages and images, deleted when QML destroys the object: PySide 6.11
    #: never frees the Python half of an object created by QML.
    _HOLDS: tuple[str, ...] = ()
    #: Arguments of the endpoint that exists or is being created; None without one.
    _config: tuple[Any, ...] | None = None
    #: The endpoint; None until it is created.
    _endpoint: Any = None
    #: Returns the time in seconds by which ages are measured: the session's, once that is known.
    _steady: Callable[[], float] = staticmethod(time.monotonic)

    problemChanged = Signal()  # noqa: N815 - QML's name
    #: Error text for the user; empty without a problem.
    problem = ReadOnly(str, read="_get_problem")

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        super().__init__(parent)
        self._runtime = runtime
        #: The QML line that called the function that returned this object.
        self._origin = runtime.caller() if runtime is not None else None
        self._session: Session | None = None
        self._scheduled = False
        #: Whether it has found no engine once.
        self._is_unprepared = False
        self._problem = self._announced_problem = ""
        self._limit = RateLimit()
        self._retry: QtCore.QTimer | None = None
        #: Functions to call when QML destroys the object, by name.
        self._cleanup: dict[str, Callable[[], None]] = {}
        self._schedule()

    @property
    def label(self) -> str:
        """The element's name in error messages."""
        return type(self).__name__.removeprefix("Ros")

    @property
    def node(self) -> Node | None:
        """The node, if it exists."""
        return self._session.node if self._session is not None else None

    @property
    def _executor(self) -> GuiExecutor:
        """The executor of the GUI thread; available only once there is a node."""
        assert self._session is not None
        return self._session.executor

    # -- the endpoint ----------------------------------------------------------------------------

    def _wanted(self) -> tuple[Any, ...] | None:
        """Return the arguments for :meth:`_factory`; None while no endpoint is wanted."""
        return None

    def _factory(self, *wanted: Any) -> Callable[[], Any]:
        """Return a function that creates the endpoint, for the worker thread.

        An endpoint has a ``close`` method, unless :meth:`_dispose` closes it in another way.
        """
        raise NotImplementedError

    def _on_created(self, endpoint: Any) -> None:
        """Start using a new endpoint."""

    def _on_create_failed(self, error: Error) -> None:
        """Show why there is no endpoint; retry an unknown type after a while."""
        self._set_problem(f"{self.label}: {error}")
        if isinstance(error, TypeNotFoundError):
            if self._retry is None:
                self._retry = single_shot(self, self._create_again)
            self._retry.start(RETRY_MS)

    def _on_closed(self, endpoint: Any) -> None:
        """Stop using an endpoint that is being closed; None if it was still being created."""

    def _dispose(self, session: Session, endpoint: Any) -> None:
        """Close an endpoint."""
        session.background(endpoint.close)

    def _update(self) -> None:
        """Create, replace or close the endpoint as the properties require."""
        wanted = self._wanted()
        if wanted == self._config:
            return
        self._close_endpoint()
        self._config = wanted
        if wanted is not None:
            self._create_endpoint(wanted)

    def _create_endpoint(self, wanted: tuple[Any, ...]) -> None:
        session = self._session
        assert session is not None

        def done(result: Any) -> None:
            if not is_alive(self) or self._config is not wanted:
                if not isinstance(result, Error):
                    self._dispose(session, result)
            elif isinstance(result, Error):
                self._on_create_failed(result)
            else:
                self._set_endpoint(result)

        session.background(self._factory(*wanted), done)

    def _set_endpoint(self, endpoint: Any) -> None:
        session = self._session
        assert session is not None
        self._endpoint = endpoint
        self._cleanup["endpoint"] = lambda: self._dispose(session, endpoint)
        self._on_created(endpoint)

    @Slot()
    def _create_again(self) -> None:
        if self._config is not None and self._endpoint is None:
            self._create_endpoint(self._config)

    def _close_endpoint(self) -> None:
        if self._retry is not None:
            self._retry.stop()
        if self._config is None:
            return
        endpoint, self._endpoint, self._config = self._endpoint, None, None
        dispose = self._cleanup.pop("endpoint", None)
        if dispose is not None:
            dispose()
        self._on_closed(endpoint)

    # -- the session -----------------------------------------------------------------------------

    @Slot()
    def _schedule(self) -> None:
        if not self._scheduled:
            self._scheduled = True
            QtCore.QTimer.singleShot(0, self._run_update)

    @Slot()
    def _run_update(self) -> None:
        if not is_alive(self):
            return
        self._scheduled = False
        if self._session is None and not self._find_session():
            return
        self._update()

    def _find_session(self) -> bool:
        runtime = self._find_runtime()
        if runtime is None:
            if self._is_unprepared:
                self._set_problem(f"{type(self).__name__} cannot be used yet: {UNPREPARED}")
            else:
                # It may have no engine any more: a Repeater destroys what it has just made if its
                # model changes. It is gone before the next attempt then.
                self._is_unprepared = True
                QtCore.QTimer.singleShot(_UNPREPARED_MS, self._schedule)
            return False
        session = self._session = runtime.session
        self._steady = session.steady
        cleanup = self._cleanup
        cleanup["signals"] = session.attach(
            self,
            node_changed=self._on_node,
            connection_changed=self._on_connection,
            graph_changed=self._on_graph,
            tick=self._on_tick,
        )
        session.use_ticks(True)
        cleanup["ticks"] = lambda: session.use_ticks(False)

        state, held = self.__dict__, self._HOLDS

        def end() -> None:
            # At the end of the program the session may be destroyed before the last element.
            for job in list(cleanup.values()) if is_alive(session) else ():
                job()
            cleanup.clear()
            for name in ("_endpoint", "_config", *held):
                state.pop(name, None)

        self.destroyed.connect(end)
        return True

    def _find_runtime(self) -> Runtime | None:
        if self._runtime is None:
            self._runtime = runtime_of(self)
        return self._runtime

    @Slot()
    def _on_node(self) -> None:
        """Update immediately if the node is gone, so that it is no longer used."""
        if self._session is None or self._session.node is None:
            self._run_update()
        else:
            self._schedule()

    @Slot()
    def _on_connection(self) -> None:
        """Handle a change of the session's connection state."""

    @Slot()
    def _on_graph(self) -> None:
        """Handle a change of the ROS graph."""

    @Slot()
    def _on_tick(self) -> None:
        """Handle the session's tick, ten times per second."""

    def _disconnected(self) -> str:
        """Return in words that the robot is not connected; empty if it is."""
        session = self._session
        if session is not None and self.node is not None and session.state == "connected":
            return ""
        detail = session.detail if session is not None else ""
        return f"the robot is not connected{f': {detail}' if detail else ''}"

    # -- problems --------------------------------------------------------------------------------

    def _get_problem(self) -> str:
        return self._problem

    def _set_problem(self, problem: str, level: int = logging.WARNING) -> None:
        """Set the problem and log it; log the same problem at most every 5 s."""
        problem = self.DIALECT.spelled(problem)
        if problem == self._problem:
            return
        self._problem = problem
        self._log(problem, level)
        self._announce_problem()

    def _announce_problem(self) -> None:
        """Emit problemChanged if the result of :meth:`_get_problem` has changed."""
        problem = self._get_problem()
        if problem != self._announced_problem:
            self._announced_problem = problem
            self.problemChanged.emit()

    def _log(self, text: str, level: int) -> None:
        """Log a message without a QML line of its own, with the place that declares the object."""
        if text and self._limit.allows((text, level)):
            log_from_qml("", level, text, self._origin or declared_at(self))

    def _refuse(self, message: str) -> None:
        """Log that a property was set to an invalid value, with the QML line."""
        log_from_qml("", logging.ERROR, message, self._caller())

    def _caller(self) -> Caller:
        """Return the QML line that is running; where the object is declared if there is none."""
        runtime = self._find_runtime()
        caller = runtime.caller() if runtime is not None else None
        # A property that is set to a constant runs no JavaScript.
        return caller if caller is not None and caller.line else declared_at(self)


class TopicElement(Element):
    """An element that receives a topic and detects stale data."""

    staleChanged = Signal()  # noqa: N815 - QML's name
    #: Whether there is no data, or only data that is out of date.
    stale = ReadOnly(bool, True)

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        super().__init__(parent, runtime)
        self._topic, self._resolved = "", ""
        #: Namespace of relative topic names, for elements with such a property; and as resolved.
        self._namespace = self._shown_namespace = ""
        #: Whether the data shown is from a publisher or connection that is gone.
        self._outdated = False
        self._publishers = 0
        #: GIDs of the present publishers, or of the last ones; empty where the graph has none.
        self._gids: set[bytes] = set()
        #: GID of the publisher of the data shown, if the graph lost it before the data arrived.
        self._lost_gid = b""
        #: Names the publishers of the topic that cannot be distinguished; empty for none.
        self._mixing = ""
        self._no_publisher = single_shot(self, self._log_no_publisher)

    def _topic_in_logs(self) -> str:
        """Return the topic, after what else the log has to name."""
        return self._resolved

    def _expect_publishers(self) -> None:
        """Log a topic that still has no publisher after a while."""
        self._no_publisher.start(NO_PEER_MS)

    @Slot()
    def _log_no_publisher(self) -> None:
        node, session = self.node, self._session
        connected = session is not None and session.state == "connected"
        if node is None or not connected or self._count_publishers():
            return
        with suppress(Error):  # the node may just have been closed
            hint = similar(self._resolved, node.topics())
            level = logging.WARNING if hint else logging.INFO
            self._log(f"{self._topic_in_logs()}: this topic has no publisher{hint}", level)

    def _resolve(self, topic: str) -> str:
        """Return the absolute name of a topic; empty, with a problem set, for an invalid name."""
        node = self.node
        if node is None or not topic:
            return ""
        try:
            return node.resolve(within_namespace(self._namespace, topic))
        except Error as error:
            self._set_problem(str(error))
            return ""

    def _get_topic(self) -> str:
        return self._resolved or self._topic

    def _set_topic(self, topic: str) -> None:
        if topic == self._topic:
            return
        self._topic = topic
        if topic == self._resolved:
            return  # the topic is the same, but no longer depends on the node's namespace
        self._resolved = ""
        # A paused image would stay on the screen under the new topic's name.
        self._begin_again()
        self.topicChanged.emit()  # type: ignore[attr-defined]

    def _set_resolved(self, topic: str) -> None:
        if topic != self._resolved:
            self._resolved = topic
            self.topicChanged.emit()  # type: ignore[attr-defined]

    def _get_namespace(self) -> str:
        return resolve_namespace(self.node, self._namespace)

    def _set_namespace(self, namespace: str) -> None:
        if namespace != self._namespace:
            self._namespace, self._resolved = namespace, ""
            self._shown_namespace = self._get_namespace()
            self._begin_again()
            self.nsChanged.emit()  # type: ignore[attr-defined]

    def _begin_again(self) -> None:
        """Subscribe again, even if the new name is resolved to the same topic.

        The data shown is cleared, and a latched message is received only once.
        """
        self._close_endpoint()
        self._clear_shown()
        self._schedule()

    def _clear_shown(self) -> None:
        """Clear the data shown, which belongs to another topic."""

    def _count_publishers(self) -> int:
        node = self.node
        if node is None or not self._resolved:
            return 0
        try:
            publishers = node.publishers(self._resolved)
        except Error:
            return 0
        self._gids = {one.gid for one in publishers if one.gid} or self._gids
        return len(publishers)

    def _judge_publisher(self, gid: bytes) -> None:
        """Set whether data that has just arrived is out of date: the graph may overtake it."""
        is_lost = not self._publishers and gid in self._gids
        self._lost_gid = gid if is_lost else b""
        self._outdated = is_lost

    def _update(self) -> None:
        before, self._shown_namespace = self._shown_namespace, self._get_namespace()
        if before != self._shown_namespace and hasattr(self, "nsChanged"):
            self.nsChanged.emit()
        super()._update()
        if self._config is None and is_alive(self):
            self._outdated = True
            self._update_stale()

    @Slot()
    def _on_connection(self) -> None:
        if self._session is not None and self._session.state != "connected":
            self._outdated = True
        else:
            self._recheck_outdated()
        self._update_stale()

    @Slot()
    def _on_graph(self) -> None:
        before, self._publishers = self._publishers, self._count_publishers()
        if before and not self._publishers:
            # The robot is disconnected: the data on the screen is out of date, however recent.
            self._outdated = True
        elif self._publishers and self._lost_gid and self._lost_gid in self._gids:
            self._judge_publisher(self._lost_gid)
        else:
            self._recheck_outdated()
        self._update_stale()

    def _recheck_outdated(self) -> None:
        """Clear :attr:`_outdated` if the graph shows that the data shown is still valid."""

    @Slot()
    def _on_tick(self) -> None:
        mixing = self._session.mixing(self._resolved) if self._session is not None else ""
        if mixing != self._mixing:
            self._mixing = mixing
            self._announce_problem()
        self._update_stale()

    def _update_stale(self) -> None:
        report(self, stale=self._outdated or self._is_old())

    def _is_old(self) -> bool:
        """Return whether there is no data, or none that is newer than the timeout."""
        raise NotImplementedError


#: Milliseconds that requests wait for a server.
CONNECTION_TIMEOUT_MS = 10_000
#: Milliseconds to find a server before its absence is logged as a warning.
_SEARCH_MS = 2000
#: Ticks (a tenth of a second) between two looks at why there is no server.
_PROBLEM_TICKS = 10


class ClientElement(Element):
    """An element with a client of a service or an action while there is a node.

    Args:
        runtime: The engine's runtime.
        name: Name of the service or action, as in QML.
        type_name: Full type name; empty uses the server's.
        dialect: The module whose spelling of values applies.
    """

    def __init__(self, runtime: Runtime, name: str, type_name: str, dialect: Dialect) -> None:
        super().__init__(None, runtime)
        self._name, self._type, self._dialect = name, type_name, dialect
        self._watch: Handle | None = None
        self._ticks = 0

    @property
    def label(self) -> str:
        """The element's name in error messages."""
        return self._name

    @abstractmethod
    def _submit_waiting(self) -> None:
        """Send the requests that waited for the client's type."""

    @abstractmethod
    def _fail_all(self, error: Error) -> None:
        """Fail every request that has no reply yet."""

    def _wanted(self) -> tuple[Node] | None:
        return None if self.node is None else (self.node,)

    def _on_create_failed(self, error: Error) -> None:
        problem = f"{self._name}: {error}"
        if isinstance(error, TypeNotFoundError) and self.node is not None:
            # Logged if the robot does not send it, either.
            self._set_problem(problem, logging.DEBUG)
            self._fetch_type(self.node)
        else:
            self._set_problem(problem)
            self._fail_all(error)

    def _fetch_type(self, node: Node) -> None:
        """Request a type without a local definition from the robot."""

        def again() -> None:
            if is_alive(self) and self.node is node:
                self._create_again()

        def fetched(got: Promise[Any]) -> None:
            if got.exception() is None:
                again()
            else:
                missed()

        def missed() -> None:
            if is_alive(self):
                self._log(self._problem, logging.WARNING)
                _later(again)

        try:
            promise = node.fetch_type_async(self._type)
        except Error:
            missed()
        else:
            promise.on_done(fetched, self._executor)

    def _on_created(self, endpoint: Any) -> None:
        self._watch = endpoint.on_ready_change(weak_callback(self._on_ready), self._executor)
        # A new client has not yet had the time to find its server.
        self._set_problem(endpoint.problem, logging.DEBUG)
        QtCore.QTimer.singleShot(_SEARCH_MS, lambda: self._warn(endpoint))
        self._on_ready(endpoint.ready)
        self._submit_waiting()

    def _warn(self, client: Any) -> None:
        """Log why there is no server, unless one has been found in the meantime."""
        if not is_alive(self) or self._endpoint is not client:
            return
        if self._session is None or self._session.state != "connected":
            # Servers are found after that.
            QtCore.QTimer.singleShot(_SEARCH_MS, lambda: self._warn(client))
            return
        self._log(self._problem, logging.WARNING)

    @Slot()
    def _on_tick(self) -> None:
        self._ticks += 1
        client = self._endpoint
        # Why there is no server changes without a signal, e.g. when its type cannot be fetched.
        if client is not None and self._ticks % _PROBLEM_TICKS == 0 and not client.ready:
            self._set_problem(client.problem, logging.DEBUG)

    def _on_ready(self, ready: bool) -> None:
        if not is_alive(self) or self._endpoint is None:
            return
        self._set_problem(self._endpoint.problem)
        self._submit_waiting()
        self._set_ready(ready)

    def _set_ready(self, ready: bool) -> None:
        """Set whether a server is connected, and notify QML of a change."""
        report(self, ready=ready)

    def _on_closed(self, endpoint: Any) -> None:
        watch, self._watch = self._watch, None
        if watch is not None:
            watch.close()
        if endpoint is not None:
            self._fail_all(Error(f"{self._name}: the node was shut down"))
        self._set_ready(False)


def named(name: str, error: BaseException) -> str:
    """Return an error's text, including the name of its topic, service or action."""
    text = str(error)
    return text if name in text else f"{name}: {text}"


def given_fields(value: QJSValue, type: MessageType, dialect: Dialect) -> dict[str, object]:
    """Return the fields of a request or goal from QML; raises like :func:`fields_from_js`."""
    if value.isUndefined() or value.isNull():
        return {}
    return fields_from_js(value, type, dialect=dialect)


def _later(job: Callable[[], None]) -> None:
    QtCore.QTimer.singleShot(RETRY_MS, job)
