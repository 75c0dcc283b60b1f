"""The node of a user interface; created, replaced and closed outside the GUI thread."""

from __future__ import annotations

import atexit
import gc
import importlib
import logging
import math
import numbers
import os
import re
import threading
import time
from collections import deque
from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING, Any, ClassVar, TypeVar, overload
from weakref import WeakMethod

from rosglass.comm.executor import Dispatcher, run_job
from rosglass.comm.graph import ConnectionState, Status
from rosglass.comm.handle import Executor, guarded
from rosglass.comm.names import validate_namespace, validate_node_name
from rosglass.errors import ConnectionLostError, Error, InvalidNameError
from rosglass.extras import explain_missing
from rosglass.qml.engine.log import QmlRosout, logger_name
from rosglass.qt import QtCore, Signal, Slot, is_alive
from rosglass.wires.zenoh.options import shown_url

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from rosglass.comm.handle import Handle
    from rosglass.comm.node import Node
    from rosglass.ros2.ros_arguments import Arguments


__all__ = ["NOT_INITIALIZED", "GuiExecutor", "ScriptLimit", "Session", "result_of", "weak_callback"]

_log = logging.getLogger("rosglass.qml")


class _Waker(QtCore.QObject):
    """Wakes the GUI thread, on which it lives, by a signal.

    A custom event would do the same, but PySide2 crashes: the posting thread accesses it again
    after it may have been delivered and deleted.
    """

    _asked = Signal()

    def __init__(self, job: Callable[[], None]) -> None:
        super().__init__()
        self._job, self._home = job, threading.get_ident()
        # The default is a queued connection between threads. Naming the type would make PySide load
        # all of Qt's enumerations, which takes longer than anything else here.
        self._asked.connect(self.run)

    def wake(self) -> None:
        """Run the job soon; thread-safe."""
        if threading.get_ident() == self._home:
            QtCore.QTimer.singleShot(0, self.run)
        else:
            self._asked.emit()

    @Slot()
    def run(self) -> None:
        """Run the job; Qt calls this on the GUI thread."""
        self._job()


class GuiExecutor(Executor):
    """Runs jobs on the thread that created it, which must run a Qt event loop.

    Jobs posted together share one event. Jobs posted while jobs run wait for the next event, so
    that a busy topic cannot keep the user interface from drawing.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._jobs: deque[Callable[[], None]] = deque()
        #: The jobs of the current event.
        self._turn: deque[Callable[[], None]] = deque()
        self._waker = _Waker(self._run)
        self._closed = False

    def post(self, job: Callable[[], None]) -> None:
        """Run `job` soon; dropped if the executor is closed."""
        with self._lock:
            if self._closed:
                return
            self._jobs.append(job)
            first = len(self._jobs) == 1
        if first:
            self._waker.wake()

    def close(self) -> None:
        """Drop waiting jobs and accept no more; safe to call twice."""
        with self._lock:
            self._closed = True
            self._jobs.clear()
            self._turn.clear()

    def resume(self) -> None:
        """Run the other jobs while the current one waits in an event loop."""
        self._waker.wake()

    def _run(self) -> None:
        with self._lock:
            self._turn.extend(self._jobs)
            self._jobs.clear()
        for _ in range(len(self._turn)):
            # While a job waited, others may have been run.
            if self._turn:
                run_job(self._turn.popleft())  # raises nothing through Qt's event loop


def result_of(work: Callable[[], _T], what: str) -> _T | Error:
    """Return the result of `work` or the error it raises, which is logged if it is one of ours.

    Args:
        work: May fail.
        what: Its name for the log.
    """
    try:
        return work()
    except Error as error:
        return error
    except Exception as error:  # noqa: BLE001 - its caller waits for a result, and shows the error
        _log.exception("%s failed", what)
        return Error(f"internal error: {error}")


def weak_callback(method: Callable[..., Any], otherwise: Any = None) -> Callable[..., Any]:
    """Return a callback for other threads that does not keep its QML object alive.

    PySide crashes if a thread drops the last reference to an object while the GUI thread deletes
    it.

    Args:
        method: A method of the object, called on the GUI thread.
        otherwise: Return value, or the error to raise, if the object no longer exists.
    """
    reference = WeakMethod(method)

    def call(*arguments: Any) -> Any:
        found = reference()
        if found is not None:
            return found(*arguments)
        if isinstance(otherwise, Error):
            raise otherwise
        return otherwise

    return call


class ScriptLimit:
    """A descriptor for a limit in seconds, 0 for no limit; invalid values raise Error.

    Args:
        seconds: The default.
    """

    def __init__(self, seconds: float) -> None:
        self._default = seconds

    def __set_name__(self, owner: type, name: str) -> None:
        self._name, self._key = f"{owner.__name__}.{name}", f"_{name}"

    @overload
    def __get__(self, item: None, owner: type) -> ScriptLimit: ...

    @overload
    def __get__(self, item: QtCore.QObject, owner: type) -> float: ...

    def __get__(self, item: QtCore.QObject | None, owner: type) -> ScriptLimit | float:
        if item is None:
            return self
        value: float = vars(item).get(self._key, self._default)
        return value

    def __set__(self, item: QtCore.QObject, seconds: float) -> None:
        real = isinstance(seconds, numbers.Real) and not isinstance(seconds, bool)
        if not real or not math.isfinite(seconds) or seconds < 0:
            raise Error(
                f"{self._name}: {seconds!r:.80} is not a number of seconds, 0 or more; 0 for no "
                "limit"
            )
        vars(item)[self._key] = float(seconds)


_T = TypeVar("_T")
#: Milliseconds between two updates of ages and rates.
TICK = 100
#: Seconds between two collections of all garbage, which take some 50 ms.
_FULL_COLLECTION_S = 60.0
#: Milliseconds until connecting is retried if this machine could not open a session.
_RETRY = 1000
#: Milliseconds that elements wait for a node before a missing init() is logged.
_FORGOTTEN = 3000
#: Error text before init(), with advice.
NOT_INITIALIZED = (
    'the interface has not called Ros2.init("name"), or Ros.init("name") with Ros 1.0; '
    "call it e.g. in Component.onCompleted"
)
#: Maximum delay of connecting; an interface without a window has no first frame.
_MAX_DEFER_MS = 1000
#: Seconds that the program's end waits for the node and all threads to finish.
_CLOSE_TIMEOUT_S = 1.2


def _connection() -> Any:
    """Return the module that makes nodes, which is not needed before the first frame."""
    from rosglass import connection  # noqa: PLC0415

    return connection


def _connect(url: str | None, name: str, namespace: str, arguments: Sequence[str] = ()) -> Node:
    node: Node = _connection().connect(url, name, namespace, arguments=arguments)
    return node


def _parse(arguments: Sequence[str], url: str) -> Arguments | None:
    """Parse the ROS arguments of a ROS 2 node; the ROS 1 client parses its own."""
    if not arguments or url.startswith("ros1:"):
        return None
    from rosglass.ros2.ros_arguments import Arguments  # noqa: PLC0415 - few programs have arguments

    return Arguments.parse(arguments)


class _GarbageCollection:
    """Collects cyclic garbage in the GUI thread alone, while there are sessions.

    Python collects in whichever thread allocates. Where garbage has Qt objects, that thread waits
    for the GIL while it holds a lock of Qt's signals; the GUI thread may hold the GIL and wait for
    this lock: the interface would be frozen for ever.
    """

    def __init__(self) -> None:
        self._thresholds = gc.get_threshold()
        self._full_at = 0.0
        #: Makes it collect, while there are sessions.
        self._timer: QtCore.QTimer | None = None
        self._sessions = 0

    def enter(self) -> None:
        """Begin, with the first session."""
        self._sessions += 1
        if self._timer is None:
            self._thresholds, self._full_at = gc.get_threshold(), time.monotonic()
            gc.set_threshold(0)
            self._timer = QtCore.QTimer(QtCore.QCoreApplication.instance())
            self._timer.setInterval(TICK)
            self._timer.timeout.connect(self._collect)
            self._timer.start()

    def leave(self) -> None:
        """End with the last session: Python collects by itself again."""
        self._sessions -= 1
        if not self._sessions and self._timer is not None:
            if is_alive(self._timer):
                self._timer.stop()
            self._timer = None
            gc.set_threshold(*self._thresholds)

    def _collect(self) -> None:
        """Collect the garbage that Python would have collected by now."""
        if not gc.isenabled():
            return
        now, counts = time.monotonic(), gc.get_count()
        due = [count > most > 0 for count, most in zip(counts, self._thresholds, strict=True)]
        if due[2] and now >= self._full_at:
            self._full_at = now + _FULL_COLLECTION_S
            gc.collect(2)
        elif due[1] or due[0]:
            gc.collect(1 if due[1] else 0)


_garbage_collection = _GarbageCollection()


class Session(QtCore.QObject):
    """One node, shared by all QML engines that use this session.

    Lives on the GUI thread. Connecting, creating and closing run on a worker thread, so that a
    robot that does not respond cannot freeze the screen.

    Args:
        url: Address of the robot; if empty, the environment is read when connecting.
        name: Node name that overrides the one from QML; empty for none.
        connect: Creates a node from URL, name and namespace; for tests and embedding.
        arguments: Arguments of the node, ``--ros-args`` included; see :func:`rosglass.connect`.

    Raises:
        RosArgumentError: One of `arguments` is not valid.
    """

    #: The node was requested; :attr:`is_initialized` is already true.
    initialized = Signal()
    #: The node is about to be closed, or was closed by others.
    about_to_shutdown = Signal()
    #: Another node asked this one to end, as ``rosnode kill`` does.
    killed = Signal()
    #: :attr:`node` was created or removed.
    node_changed = Signal()
    #: :attr:`state` or :attr:`detail` changed.
    connection_changed = Signal()
    url_changed = Signal()
    #: Nodes or endpoints appeared or disappeared.
    graph_changed = Signal()
    #: Emitted ten times per second while there are users, see :meth:`use_ticks`.
    tick = Signal()
    #: Elements have waited some seconds for a node, but init() was not called.
    forgotten = Signal()
    #: A waiting call from QML has ended and is about to return to QML.
    call_ended = Signal()
    #: An interface is about to be loaded again, which keeps the GUI thread busy.
    reloading = Signal()

    #: Seconds that JavaScript may compute without a break before it is ended; 0 for no limit.
    #: Invalid values raise Error.
    longest_script = ScriptLimit(5.0)

    _default: ClassVar[Session | None] = None

    def __init__(
        self,
        url: str = "",
        name: str = "",
        connect: Callable[..., Node] = _connect,
        arguments: Sequence[str] = (),
    ) -> None:
        super().__init__()
        self._arguments = tuple(arguments)
        self._asked: tuple[str, ...] = ()
        _parse(arguments, url)  # raises an error if they are invalid
        self.executor = GuiExecutor()
        #: The node; None before it is created and after it is closed.
        self.node: Node | None = None
        self.name, self.namespace = "", ""
        self.streams: dict[Any, Any] = {}
        #: Objects that elements share, except camera streams, by key.
        self.shared: dict[Any, Any] = {}
        #: While not 0, shutdown() from QML is ignored: its successor, or others, need the node.
        self.holding = 0
        #: Number of calls from QML that wait in their own event loop.
        self.waiting_calls = 0
        self._url, self._forced_name, self._connect = url, name, connect
        self._owns_node = True
        self._status = Status(ConnectionState.CLOSED)
        self._failed = False
        #: Full names shared by several nodes -> number of these nodes.
        self.duplicate_nodes: dict[str, int] = {}
        self._steady: tuple[Callable[[], float], float] = (time.monotonic, 0.0)
        self._generation = 0
        self._deferred = False
        self._closed = False
        self._handles: list[Handle] = []
        self._rosout: QmlRosout | None = None
        self._logger_level: int | None = None
        self._worker = Dispatcher("rosglass-qml")
        #: Callbacks on the GUI thread for the results of background jobs.
        self._done: dict[object, Callable[[Any], None]] = {}
        self._loaded: set[str] = set()
        self._ticking = 0
        self._ticker = QtCore.QTimer(self)
        self._ticker.setInterval(TICK)
        self._ticker.timeout.connect(self.tick)
        self._reminder: QtCore.QTimer | None = None
        #: Whether to report that elements wait for a node; not where the user starts it.
        self.reminds = True
        # Connected before the elements, which use the result.
        self.graph_changed.connect(self._find_duplicates)
        self._handlers: dict[str, dict[int, tuple[QtCore.QObject, Callable[[], None]]]] = {}
        for signal in ("node_changed", "connection_changed", "graph_changed", "tick"):
            handlers = self._handlers[signal] = {}
            getattr(self, signal).connect(lambda handlers=handlers: _call_all(handlers))
        app = QtCore.QCoreApplication.instance()
        self._collects = app is not None
        if app is not None:
            _garbage_collection.enter()
        # Not when the application quits: interfaces may send until they are destroyed.
        atexit.register(self.close)

    @classmethod
    def default(cls) -> Session:
        """Return the application's own session, shared by all engines without another one."""
        if cls._default is None:
            cls._default = cls()
        return cls._default

    @property
    def closed(self) -> bool:
        """True once the session was closed, as at the end of the program."""
        return self._closed

    @property
    def is_initialized(self) -> bool:
        """True from init() to the next shutdown."""
        return bool(self.name)

    @property
    def state(self) -> str:
        """``uninitialized``, ``connecting``, ``connected``, ``lost`` or ``failed``."""
        if not self.is_initialized:
            return "uninitialized"
        # A node shut down by others, e.g. by one of the same name in ROS 1, does not restart.
        if self._failed or self._status.state is ConnectionState.CLOSED:
            return "failed"
        return str(self._status.state.value)

    @property
    def detail(self) -> str:
        """One line about the connection: what was tried and what happens next."""
        return self._status.detail if self.is_initialized else ""

    @property
    def url(self) -> str:
        """Address of the robot."""
        return self._url

    @url.setter
    def url(self, url: str) -> None:
        if url == self._url:
            return
        self._url = url
        self.url_changed.emit()
        if self.is_initialized and self._owns_node:
            self._drop_node()
            self._start()

    @property
    def owns_node(self) -> bool:
        """True if it creates the node by :attr:`url`, False for an adopted node."""
        return self._owns_node

    def steady(self) -> float:
        """Return the time in seconds for measuring ages; thread-safe; see :meth:`Node.steady`.

        It never runs backwards, even if the node is replaced.
        """
        clock, ahead = self._steady
        return clock() + ahead

    def _follow(self, clock: Callable[[], float]) -> None:
        self._steady = (clock, self.steady() - clock())

    def init(
        self,
        name: str,
        namespace: str = "/",
        domain: int = -1,
        arguments: Sequence[str] = (),
    ) -> bool:
        """Request a node.

        Args:
            name: Base name.
            namespace: Absolute namespace.
            domain: ROS domain; -1 for the URL's or the environment's. If neither names a
                middleware, a domain selects DDS, as ROS_DOMAIN_ID does.
            arguments: Arguments of the node, in addition to those of the session.

        Returns:
            False if there already is a node, which stays unchanged.

        Raises:
            InvalidNameError: The name or namespace breaks ROS's rules.
            RosArgumentError: One of `arguments` is not valid.
            UnsupportedError: A domain is given, and the environment names an unknown middleware.
        """
        name = self._forced_name or name
        parsed = _parse((*self._arguments, *arguments), self._url)
        if parsed is not None:
            name = parsed.node_name(name)
            namespace = parsed.namespace(name, namespace)
        validate_node_name(name)
        validate_namespace(namespace)
        if self.is_initialized:
            if (name, namespace) != (self.name, self.namespace):
                _log.warning("init(%r) ignored: the node is already called %r", name, self.name)
            return False
        if domain >= 0:
            url = _with_domain(self._url, domain)
            if url != self._url:
                self._url = url
                self.url_changed.emit()
        self.name, self.namespace, self._asked = name, namespace, tuple(arguments)
        self._start()
        self.initialized.emit()
        return True

    def defer_connecting(self) -> None:
        """Delay connecting until :meth:`go_on`, by at most a second.

        Connecting keeps Python busy, which the interface's first frame needs, too.
        """
        if not self.is_initialized:
            self._deferred = True
            QtCore.QTimer.singleShot(_MAX_DEFER_MS, self.go_on)

    def go_on(self) -> None:
        """Connect now if connecting was deferred; safe to call at any time."""
        deferred, self._deferred = self._deferred, False
        if deferred and self.is_initialized and self._owns_node:
            self._start()

    def adopt(self, node: Node) -> None:
        """Use a node created in Python, and leave it open at the end.

        Raises:
            InvalidNameError: The session already has a node.
        """
        if self.is_initialized:
            raise InvalidNameError(f"this session already has the node {self.name!r}")
        self.name, self.namespace = node.name, node.namespace
        self._url, self._owns_node = node.url, False
        self._take_node(node)
        self.initialized.emit()

    def shutdown(self) -> None:
        """Close the node; everything that uses it stops until the next init."""
        if not self.is_initialized or self.holding:
            return
        if self._status.state is not ConnectionState.CLOSED:
            self.about_to_shutdown.emit()
        self.name = self.namespace = ""
        self._drop_node()
        self._owns_node = True
        self._set_status(Status(ConnectionState.CLOSED))

    def close(self) -> None:
        """Shut down and wait for the threads, little more than a second; safe to call twice."""
        if self._closed:
            return
        self._closed = True
        atexit.unregister(self.close)
        self.holding = 0
        until = time.monotonic() + _CLOSE_TIMEOUT_S
        streams = list(self.streams.values())
        self.shutdown()
        done = threading.Event()
        self._worker.post(done.set)
        for stream in streams:
            stream.close()
        for stream in streams:
            stream.stream.join(max(0.0, until - time.monotonic()))
        if not done.wait(max(0.0, until - time.monotonic())):
            _log.warning("the node is still closing after %.1f s", _CLOSE_TIMEOUT_S)
        self.executor.close()
        self._worker.close()
        if self._collects:
            _garbage_collection.leave()
        if Session._default is self:
            Session._default = None

    def background(
        self, work: Callable[[], _T], done: Callable[[_T | Error], None] | None = None
    ) -> None:
        """Run a job that may block on the worker thread; jobs run in the order of the calls.

        Args:
            work: The job.
            done: Called on the GUI thread with the result or the raised error.
        """
        key = object()
        if done is not None:
            # Kept here: the worker thread must not drop the last reference to QML's objects.
            self._done[key] = done

        def run() -> None:
            result = result_of(work, "a background job")
            if key in self._done:
                self.executor.post(lambda: self._done.pop(key)(result))

        self._worker.post(run)

    def is_loaded(self, module: str, then: Callable[[], object]) -> bool:
        """Return whether a module is imported; if not, import it on the worker thread.

        Args:
            module: Full name of a module that does not need Qt.
            then: Called on the GUI thread after the import.
        """
        if module in self._loaded:
            return True

        def done(_: object) -> None:
            self._loaded.add(module)
            then()

        self.background(lambda: importlib.import_module(module), done)
        return False

    def attach(self, item: QtCore.QObject, **handlers: Callable[[], None]) -> Callable[[], None]:
        """Connect handlers to signals for the lifetime of an object.

        The handlers are called directly: a signal connected to a method of an object that QML
        destroys or extends may still be delivered after its destruction, or not at all.

        Args:
            item: The object.
            handlers: Handlers by name of the signal.

        Returns:
            A function that disconnects them, to be called when the object is destroyed.
        """
        key = id(item)
        for name, handler in handlers.items():
            self._handlers[name][key] = (item, handler)

        def detach() -> None:
            for name in handlers:
                self._handlers[name].pop(key, None)

        return detach

    def use_ticks(self, wanted: bool) -> None:
        """Count a user of :attr:`tick` in or out; without users there are no ticks."""
        self._ticking += 1 if wanted else -1
        if wanted and self._reminder is None and not self.is_initialized:
            self._reminder = QtCore.QTimer(self)
            self._reminder.setSingleShot(True)
            self._reminder.timeout.connect(self._remind)
            self._reminder.start(_FORGOTTEN)
        if self._ticking > 0 and not self._ticker.isActive():
            self._ticker.start()
        elif self._ticking <= 0:
            self._ticker.stop()

    def _remind(self) -> None:
        """Log once that elements wait for a node but init() was not called."""
        waiting = self._ticking > 0 and not self._closed and not self.is_initialized
        if waiting and self.reminds:
            _log.warning("not connected: %s", NOT_INITIALIZED)
            self.forgotten.emit()

    def _start(self) -> None:
        self._generation += 1
        generation, connect = self._generation, self._connect
        url, name, namespace = self._url or None, self.name, self.namespace
        arguments = (*self._arguments, *self._asked)
        if arguments:
            connect = partial(connect, arguments=arguments)
        self._failed = False
        self._set_status(
            Status(ConnectionState.CONNECTING, f"connecting to {shown_url(url or 'the robot')}")
        )
        if self._deferred:
            return

        def work() -> Node:
            try:
                return connect(url, name, namespace)
            except ModuleNotFoundError as error:
                missing = explain_missing(error)
                if not missing:
                    raise
                raise Error(missing) from None

        def done(result: Node | Error) -> None:
            if generation != self._generation:
                if not isinstance(result, Error):
                    self.background(result.close)
                return
            if isinstance(result, Error):
                self._connect_failed(result, generation)
            else:
                self._take_node(result)

        self.background(work, done)

    def _connect_failed(self, error: Error, generation: int) -> None:
        retry = isinstance(error, ConnectionLostError)
        self._failed = not retry
        if retry:
            _log.error("%s", error)
        state = ConnectionState.CONNECTING if retry else ConnectionState.LOST
        self._set_status(Status(state, str(error)))
        if retry:
            QtCore.QTimer.singleShot(
                _RETRY, lambda: self._start() if generation == self._generation else None
            )

    def _take_node(self, node: Node) -> None:
        self.node = node
        self._follow(node.steady)
        # The command line may have renamed it.
        self.name, self.namespace = node.name, node.namespace
        self._handles = [
            node.on_status_change(self._on_status, self.executor),
            node.on_graph_change(self.graph_changed.emit, self.executor),
        ]
        self._rosout = QmlRosout(node)
        self._apply_logger_level()
        self._set_status(node.status())
        self.node_changed.emit()
        # Changes before the callback was registered are not reported again.
        self.graph_changed.emit()

    def _drop_node(self) -> None:
        self._generation += 1
        for handle in self._handles:
            handle.close()
        self._handles = []
        if self._rosout is not None:
            # QML's elements, which PySide keeps, hold this handler, which holds the whole node.
            self._rosout.close()
            self._rosout = None
        node, self.node = self.node, None
        self._follow(time.monotonic)
        if node is not None:
            self.node_changed.emit()
            self.graph_changed.emit()
            if self._owns_node:
                self.background(node.close)

    def mixing(self, topic: str) -> str:
        """Return the problem of a topic published by nodes of the same name; empty for none.

        Args:
            topic: Absolute name; an empty one has no problem.
        """
        if self.node is None or not self.duplicate_nodes or not topic:
            return ""
        with suppress(Error):  # a node that has just been closed
            senders = [one.node.full for one in self.node.publishers(topic)]
            for name, count in self.duplicate_nodes.items():
                if senders.count(name) > 1:
                    # It is unknown which of the nodes has which publisher.
                    what = f"{senders.count(name)} publishers of nodes called {name}, a name of"
                    return f"{topic}: {what} {count} nodes, are mixed"
        return ""

    @Slot()
    def _find_duplicates(self) -> None:
        found: dict[str, int] = {}
        if self.node is not None:
            with suppress(Error):  # a node that has just been closed
                found = self.node.duplicate_nodes()
        for name in found.keys() - self.duplicate_nodes.keys():
            _log.warning(
                "%d nodes are called %s: what they publish is mixed, and all obey commands; give "
                "each robot a namespace, or a domain or router of its own",
                found[name],
                name,
            )
        self.duplicate_nodes = found

    def _on_status(self, status: Status) -> None:
        if self.node is None:
            return
        closed = ConnectionState.CLOSED
        ended = status.state is closed and self._status.state is not closed
        self._set_status(status)
        if ended:
            self.about_to_shutdown.emit()
        # A handler may have requested another node.
        if ended and status.killed and self._status is status:
            self.killed.emit()

    def set_logger_level(self, name: str, level: int) -> None:
        """Set the level of a logger; the node's own logger follows on ``/rosout``.

        Args:
            name: Name of the QML logger; empty for the node's own.
            level: The level in Python's logging.
        """
        logging.getLogger(logger_name(name)).setLevel(level)
        if not name:
            self._logger_level = level
            self._apply_logger_level()

    def _apply_logger_level(self) -> None:
        level, node = self._logger_level, self.node
        if level is not None and node is not None:
            with suppress(Error):  # a recording has no log
                node.logger.setLevel(level or logging.INFO)

    def _set_status(self, status: Status) -> None:
        before = (self.state, self.detail)
        self._status = status
        if (self.state, self.detail) != before or not self.is_initialized:
            state, detail = self.state, self.detail
            text = detail if detail.startswith(state) else ": ".join(filter(None, (state, detail)))
            level = logging.INFO if self.is_initialized else logging.DEBUG
            _log.log(logging.ERROR if state == "failed" else level, "%s", text)
            self.connection_changed.emit()


def _call_all(handlers: dict[int, tuple[QtCore.QObject, Callable[[], None]]]) -> None:
    for item, handler in list(handlers.values()):
        # A handler may have destroyed other objects.
        if is_alive(item):
            with guarded(_log, "internal error in %s", type(item).__name__):
                handler()


def _with_domain(url: str, domain: int) -> str:
    """Return `url` with a ``domain`` option; an empty `url` becomes the default URL."""
    if not url:
        url = _connection().default_url({**os.environ, "ROS_DOMAIN_ID": str(domain)})
    base, _, query = url.partition("?")
    if base.partition(":")[0].lower() not in ("dds", "zenoh"):
        _log.warning("setDomainId(%d) is ignored: %s has no domains", domain, url)
        return url
    others = [part for part in query.split("&") if part and not re.match(r"domain=", part)]
    return f"{base}?{'&'.join([*others, f'domain={domain}'])}"
