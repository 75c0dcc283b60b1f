"""RViz's roscpp node, initialized before RViz would do it, its master, and the overlays' own node.

RViz would initialize roscpp with a random node name and a Ctrl-C handler that replaces Python's; it
does not if roscpp is initialized already. roscpp has no Python bindings, so this module calls its
C++ functions by their mangled names (Itanium C++ ABI, libstdc++'s ``std::string``;
https://docs.ros.org/en/noetic/api/roscpp/html/init_8h.html).
"""

from __future__ import annotations

import ctypes
import logging
import os
import socket
import threading
import time
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit

from rosglass.comm import anonymous_name
from rosglass.connection import connect
from rosglass.errors import ConnectionLostError, Error, InvalidNameError
from rosglass.qml.engine.session import GuiExecutor
from rosglass.qt import QtCore, Signal, run_event_loop
from rosglass.rviz.host import cpp_function
from rosglass.rviz.qt5 import QtWidgets
from rosglass.wires.tcpros.master import call_node

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from rosglass.comm.node import Node
    from rosglass.ros1.options import Ros1Options

__all__ = [
    "MasterWatch",
    "connect_beside_rviz",
    "initialize",
    "is_initialized",
    "is_running",
    "name_node",
    "node_name",
    "set_log_level",
    "shared_arguments",
    "shut_down",
    "wait_for_master",
]

_log = logging.getLogger("rosglass.rviz")
_STRING = "NSt7__cxx1112basic_stringIcSt11char_traitsIcESaIcEEE"
_INIT = f"_ZN3ros4initERiPPcRK{_STRING}j"
_SET_LEVEL = f"_ZN3ros7console16set_logger_levelERK{_STRING}NS0_6levels5LevelE"
#: ros/init.h, "init_options".
_NO_SIGINT_HANDLER = 1
#: Python's levels and ros/console.h, "levels".
_LEVELS = ((logging.DEBUG, 0), (logging.INFO, 1), (logging.WARNING, 2), (logging.ERROR, 3))
_FATAL = 4


class _String(ctypes.Structure):
    """A ``std::string``."""

    _fields_ = (
        ("data", ctypes.c_char_p),
        ("size", ctypes.c_size_t),
        ("local", ctypes.c_char * 16),
    )


def _string(text: str) -> _String:
    data = text.encode()
    return _String(data, len(data))


def is_initialized() -> bool:
    """Return whether roscpp is initialized in this process."""
    return bool(cpp_function("libroscpp", "_ZN3ros13isInitializedEv", ctypes.c_bool)())


def is_running() -> bool:
    """Return whether the roscpp node is running; e.g. another node of its name shuts it down."""
    return bool(cpp_function("libroscpp", "_ZN3ros2okEv", ctypes.c_bool)())


def initialize(name: str, arguments: Sequence[str]) -> None:
    """Initialize RViz's node, without a request to the master.

    roscpp ends the process if an argument is invalid.

    Args:
        name: Base name of the node.
        arguments: Remapping arguments such as ``old:=new`` and ``__ns:=...``.
    """
    words = [b"rviz", *(argument.encode() for argument in arguments)]
    argv = (ctypes.c_char_p * (len(words) + 1))(*words)
    count = ctypes.c_int(len(words))
    init = cpp_function("libroscpp", _INIT)
    init(ctypes.byref(count), argv, ctypes.byref(_string(name)), _NO_SIGINT_HANDLER)


def node_name() -> str:
    """Return the full name of RViz's node."""
    get = cpp_function("libroscpp", "_ZN3ros9this_node7getNameB5cxx11Ev", ctypes.POINTER(_String))
    return str(get().contents.data.decode())


def set_log_level(level: int) -> None:
    """Set RViz's log level to a level of Python's logging."""
    cpp_function("librosconsole", "_ZN3ros7console10initializeEv")()
    set_level = cpp_function("librosconsole", _SET_LEVEL)
    cpp_level = next((ours for theirs, ours in _LEVELS if level <= theirs), _FATAL)
    set_level(ctypes.byref(_string("ros")), cpp_level)
    cpp_function("librosconsole", "_ZN3ros7console25notifyLoggerLevelsChangedEv")()


def shut_down() -> None:
    """Shut RViz's node down, which unregisters it from the master."""
    cpp_function("libroscpp", "_ZN3ros8shutdownEv")()


def name_node(name: str, options: Ros1Options) -> None:
    """Initialize RViz's node, unless the program has initialized roscpp.

    Args:
        name: Its name; empty for ``rviz`` with a unique suffix.
        options: Its master and remappings.
    """
    # RViz's plugins may read it, too.
    os.environ["ROS_MASTER_URI"] = options.master
    if not is_initialized():
        set_log_level(_log.getEffectiveLevel())
        initialize(name or anonymous_name("rviz"), shared_arguments(options))


def shared_arguments(options: Ros1Options) -> list[str]:
    """Return the remapping arguments of both nodes, without the name."""
    remappings = options.arguments
    words = [f"{old}:={new}" for old, new in remappings.rules]
    words += [f"_{key}:={value}" for key, value in remappings.parameters.items()]
    words += [f"__ns:={remappings.namespace}"] if remappings.namespace else []
    words += [f"__hostname:={options.address}"] if options.address else []
    return words


def connect_beside_rviz(
    url: str | None, name: str, namespace: str, arguments: Sequence[str] = ()
) -> Node:
    """Return the overlays' node; like :func:`rosglass.connect`.

    Raises:
        InvalidNameError: The name is that of RViz's own node.
    """
    full = f"{namespace.rstrip('/')}/{name}"
    if full == node_name():
        raise InvalidNameError(
            f"{full} is RViz's own node, which a second node of its name would shut down; "
            "give the overlays' node or RViz another name"
        )
    return connect(url, name, namespace, arguments=arguments)


#: Seconds between requests to the master while waiting and while RViz runs, and their timeout.
_WAIT_PERIOD_S, _WATCH_PERIOD_S, _TIMEOUT_S = 0.25, 2.0, 2.0
#: Milliseconds of waiting after which a window is shown.
_WINDOW_DELAY_MS = 700
#: The default port of roscore.
_DEFAULT_PORT = 11311


class _MasterPoller:
    """Requests a master's process id periodically, in its own thread.

    Args:
        uri: The master's URI.
        period: Seconds between two requests.
        on_reply: Called in the GUI thread with the process id or an Error.
    """

    def __init__(self, uri: str, period: float, on_reply: Callable[[Any], None]) -> None:
        self._uri, self._period, self._on_reply = uri, period, on_reply
        self._executor = GuiExecutor()
        self._end = threading.Event()
        self._thread = threading.Thread(target=self._run, name="master", daemon=True)
        self._thread.start()

    def _run(self) -> None:
        while not self._end.is_set():
            answer: Any
            try:
                answer = call_node(self._uri, "getPid", "/rviz", timeout=_TIMEOUT_S)
            except Error as error:
                answer = error
            self._executor.post(lambda answer=answer: self._deliver(answer))  # type: ignore[misc]
            self._end.wait(self._period)

    def _deliver(self, answer: Any) -> None:
        if not self._end.is_set():
            self._on_reply(answer)

    def close(self) -> None:
        """Stop the requests; safe to call twice."""
        self._end.set()
        self._thread.join(_TIMEOUT_S / 4)
        self._executor.close()


def wait_for_master(uri: str, timeout: float | None, is_cancelled: Callable[[], bool]) -> bool:
    """Wait until a master answers; show a window if it takes long.

    Args:
        uri: The master's URI.
        timeout: Seconds to wait; None waits forever.
        is_cancelled: Returns whether to stop waiting because the program ends.

    Returns:
        Whether the master answered; False if the program ends or the user cancels.

    Raises:
        ConnectionLostError: The master did not answer in time.
    """
    started = time.monotonic()
    loop = QtCore.QEventLoop()
    window: list[Any] = []
    outcome: list[Any] = []
    problems: list[str] = []

    def finish(result: Any) -> None:
        outcome.append(result)
        loop.quit()

    def on_answer(answer: Any) -> None:
        if not isinstance(answer, Error):
            finish(True)
            return
        problem = f"{answer}; {_advice(uri)}"
        if timeout is not None and time.monotonic() - started >= timeout:
            finish(ConnectionLostError(problem))
        elif problem not in problems:
            problems.append(problem)
            _log.warning("waiting for the ROS master: %s", problem)

    def on_timeout() -> None:
        if is_cancelled():
            finish(False)
        elif problems and not window and time.monotonic() - started > _WINDOW_DELAY_MS / 1000:
            window.append(_waiting_window(uri, problems[-1], lambda: finish(False)))

    asker = _MasterPoller(uri, _WAIT_PERIOD_S, on_answer)
    timer = QtCore.QTimer()
    timer.timeout.connect(on_timeout)
    timer.start(50)
    run_event_loop(loop)
    timer.stop()
    asker.close()
    for box in window:
        box.blockSignals(True)
        box.close()
    if isinstance(outcome[0], Error):
        raise outcome[0]
    return bool(outcome[0])


def _advice(uri: str) -> str:
    """Return advice for a master that does not answer."""
    address = urlsplit(uri)
    port = "" if address.port in (None, _DEFAULT_PORT) else f" -p {address.port}"
    host = address.hostname or ""
    if host in ("localhost", "::1", socket.gethostname()) or host.startswith("127."):
        return f"start one: roscore{port}"
    return f"check the address, or start one on {host}: roscore{port}"


def _waiting_window(uri: str, problem: str, cancel: Callable[[], None]) -> Any:
    box = QtWidgets.QMessageBox()
    box.setWindowTitle("RViz")
    box.setText(f"Waiting for the ROS master at {uri}")
    box.setInformativeText(f"RViz starts as soon as it answers. {problem}")
    box.setStandardButtons(QtWidgets.QMessageBox.Cancel)
    box.rejected.connect(cancel)
    box.finished.connect(lambda _: cancel())
    box.show()
    return box


class MasterWatch(QtCore.QObject):
    """Detects the loss and the restart of a running RViz's master."""

    #: :attr:`problem` has changed. Argument: the new text.
    problem_changed = Signal(str)

    def __init__(self, uri: str) -> None:
        super().__init__()
        self._uri, self._problem = uri, ""
        #: The master's process id; -1 before its first answer.
        self.pid = -1
        #: Whether another master has replaced it, at which RViz is not registered.
        self.replaced = False
        self._poller = _MasterPoller(uri, _WATCH_PERIOD_S, self.on_answer)

    @property
    def problem(self) -> str:
        """Error text; empty if the master answers."""
        return self._problem

    @property
    def advice(self) -> str:
        """Advice on the problem in one line; empty without a problem."""
        if not self._problem:
            return ""
        if self.replaced:
            return "The ROS master was restarted: restart RViz, its displays find no new topics"
        return "No answer from the ROS master: check the network, or restart roscore and RViz"

    def close(self) -> None:
        """Stop watching."""
        self._poller.close()

    def on_answer(self, answer: Any) -> None:
        """Handle the master's process id, or the Error of the request."""
        problem = ""
        self.replaced = not isinstance(answer, Error) and self.pid not in (-1, answer)
        if isinstance(answer, Error):
            problem = f"{answer}; existing connections stay, but new topics are not found"
        elif self.replaced:
            problem = (
                f"the ROS master at {self._uri} was restarted, without this RViz's registrations: "
                "its displays find no new topics until RViz is restarted"
            )
        else:
            self.pid = answer
        if problem != self._problem:
            self._problem = problem
            if problem:
                _log.error("%s", problem)
            else:
                _log.warning("the ROS master at %s answers again", self._uri)
            self.problem_changed.emit(problem)
