"""The process around interfaces: its display, its signals, and no network for QML.

Qt Quick fetches images, fonts, QML files and modules from any address in QML or rich text. It
uses its own threads for this, which must not call Python: such a thread would wait for the GIL, and
the GUI thread, which holds the GIL, for that thread. So Qt gets a proxy that refuses every request.
Qt uses no proxy for addresses of this machine (``localhost``). For the same reason, Python cannot
decide which files Qt may open. Qt's own switches disable JavaScript's access to files, and requests
of media players, which bypass proxies.
"""

from __future__ import annotations

import ctypes
import logging
import os
import signal
import socket
import sys
import threading
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

from rosglass.errors import UnsupportedError
from rosglass.qt import QT6, QtCore, optional

if TYPE_CHECKING:
    from collections.abc import Callable
    from types import TracebackType


__all__ = [
    "NETWORK_HINT",
    "QuitOnSignal",
    "close_network",
    "end_process",
    "end_process_within",
    "is_network_closed",
    "quiet_qt",
    "require_display",
]

_ADVICE = (
    "run it where there is a screen, over `ssh -X`, or on a virtual screen: "
    "xvfb-run -s '-screen 0 1280x800x24' rosglass ..."
)


#: Rules for messages of Qt that are of no use to users: its media backends name each library that
#: they look for.
_QUIET_RULES = """
qt.multimedia.symbolsresolver=false
qt.multimedia.ffmpeg*=false
qt.qpa.theme*=false
"""


def quiet_qt() -> None:
    """Hide such messages of Qt in programs that this package creates; QT_LOGGING_RULES decides."""
    if QT6:
        QtCore.QLoggingCategory.setFilterRules(_QUIET_RULES)


def require_display() -> Callable[[], None]:
    """Check that Qt can open a window.

    Returns:
        A function to call once Qt is connected. Until then a connection stays open: a virtual
        screen resets when its last client disconnects, and refuses clients during the reset.

    Raises:
        UnsupportedError: There is no display, or a library that Qt needs for it is missing; the
            message contains instructions.
    """
    wanted = os.environ.get("QT_QPA_PLATFORM", "").partition(":")[0].partition(";")[0]
    if not QT6 and wanted == "offscreen" and not os.environ.get("DISPLAY"):
        # Without a display, Qt 5 would crash while looking for OpenGL.
        os.environ.setdefault("QT_QUICK_BACKEND", "software")
    if not sys.platform.startswith("linux") or wanted not in {"", "xcb", "wayland"}:
        return _nothing
    if _wayland_answers() and wanted != "xcb":
        probe = _X11Probe()
        if not wanted and not probe.answers:
            os.environ["QT_QPA_PLATFORM"] = "wayland"
        return probe.close
    display = os.environ.get("DISPLAY", "")
    if not display:
        raise UnsupportedError(f"there is no display (DISPLAY is not set): {_ADVICE}")
    probe = _X11Probe()
    if not probe.answers:
        raise UnsupportedError(f"the display {display} does not answer: {_ADVICE}")
    _require_x11_plugin()
    return probe.close


def _nothing() -> None:
    pass


def _wayland_answers() -> bool:
    name = os.environ.get("WAYLAND_DISPLAY", "")
    if not name:
        return False
    path = Path(os.environ.get("XDG_RUNTIME_DIR", "/")) / name
    try:
        with socket.socket(socket.AF_UNIX) as probe:
            probe.connect(str(path))
    except OSError:
        return False
    return True


class _X11Probe:
    """A connection to the X server with the same authorisation as Qt's.

    Attributes:
        answers: Whether the server answered; true if this cannot be tested.
    """

    def __init__(self) -> None:
        self.answers = False
        self._xcb: ctypes.CDLL | None = None
        if not os.environ.get("DISPLAY"):
            return
        try:
            xcb = ctypes.CDLL("libxcb.so.1")
        except OSError:
            self.answers = True
            return
        xcb.xcb_connect.restype = ctypes.c_void_p
        xcb.xcb_connection_has_error.argtypes = xcb.xcb_disconnect.argtypes = [ctypes.c_void_p]
        self._xcb = xcb
        self._connection = xcb.xcb_connect(None, None)
        self.answers = not xcb.xcb_connection_has_error(self._connection)

    def close(self) -> None:
        """Disconnect."""
        if self._xcb is not None:
            self._xcb.xcb_disconnect(self._connection)
            self._xcb = None


def _require_x11_plugin() -> None:
    """Load Qt's X11 plugin for a clear error: Qt's names neither the library nor the package."""
    if not QT6:
        return
    plugins = QtCore.QLibraryInfo.path(QtCore.QLibraryInfo.LibraryPath.PluginsPath)
    plugin = Path(plugins, "platforms", "libqxcb.so")
    if not plugin.exists():
        return
    try:
        ctypes.CDLL(str(plugin))
    except OSError as error:
        library = str(error).partition(":")[0]
        raise UnsupportedError(
            f"Qt cannot use the display: the library {library} is missing; on Debian and Ubuntu: "
            "apt install libxcb-cursor0 libxkbcommon-x11-0 libxcb-icccm4 libxcb-keysyms1 "
            "libxcb-image0 libxcb-render-util0 libxcb-shape0 libegl1 libgl1"
        ) from None


#: Seconds that the program may take to end cleanly.
_QUIT_TIMEOUT_S = 4.0
#: The signals that end a program, and Python's default handlers.
_DEFAULTS: dict[int, Any] = {
    signal.SIGINT: signal.default_int_handler,
    signal.SIGTERM: signal.SIG_DFL,
}
#: Sent when the terminal is closed or its connection is lost; ignored under nohup.
_HANGUP: int | None = getattr(signal, "SIGHUP", None)
if _HANGUP is not None:
    _DEFAULTS[_HANGUP] = signal.SIG_DFL


def end_process_within(seconds: float, code: int) -> None:
    """End the process with an exit code after `seconds`, unless it has already ended."""

    def end() -> None:
        try:
            # Not time.sleep(), which fails if the clock is changed (libfaketime).
            threading.Event().wait(seconds)
        finally:
            os._exit(code)

    threading.Thread(target=end, name="end", daemon=True).start()


def end_process(code: int) -> NoReturn:
    """End the process with an exit code, after everything is closed.

    The interpreter's own end takes seconds: it destroys the objects of Qt, OpenGL and Zenoh one by
    one, and waits for their threads.
    """
    logging.shutdown()
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError, ValueError, AttributeError):  # its reader is gone; there is none
            stream.flush()
    os._exit(code)


class QuitOnSignal:
    """Calls `quit` when a signal asks the process to end; ends the process if it then hangs.

    Python runs signal handlers only between two Python instructions; a C++ event loop, or QML that
    hangs, would delay them forever. A thread notices signals immediately.

    Args:
        quit: Called in this thread with the signal's number.
        timeout_s: Seconds that the program has to end cleanly.
        keep_handlers: Ignore signals that the program ignores or handles itself.
    """

    def __init__(
        self,
        quit: Callable[[int], None],
        timeout_s: float = _QUIT_TIMEOUT_S,
        *,
        keep_handlers: bool = False,
    ) -> None:
        self._quit, self._timeout_s = quit, timeout_s
        self._signals = [
            n for n in _DEFAULTS if not ((keep_handlers or n == _HANGUP) and _is_programs_own(n))
        ]
        self._reader, self._writer = os.pipe()
        self._ended = threading.Event()
        self._before: dict[int, Any] = {}
        self._wakeup = -1
        self._thread = threading.Thread(target=self._watch, name="signals", daemon=True)

    def __enter__(self) -> QuitOnSignal:
        if sys.platform != "win32":
            os.set_blocking(self._writer, False)
        self._wakeup = signal.set_wakeup_fd(self._writer, warn_on_full_buffer=False)
        for number in self._signals:
            self._before[number] = signal.signal(number, _note)
        self._thread.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._ended.set()
        for number, handler in self._before.items():
            # Python cannot restore a handler that was installed from C.
            signal.signal(number, _DEFAULTS[number] if handler is None else handler)
        signal.set_wakeup_fd(self._wakeup)
        os.close(self._writer)
        # The thread must not keep the objects that `quit` refers to alive.
        self._thread.join()

    def _watch(self) -> None:
        ending = {int(number) for number in self._signals}
        while received := os.read(self._reader, 1):
            if received[0] not in ending:
                # Forward to the previous descriptor, e.g. asyncio's, which needs it.
                with suppress(OSError):  # full, or closed
                    os.write(self._wakeup, received)
            else:
                self._quit(received[0])
                if not self._ended.wait(self._timeout_s):
                    sys.stderr.write("rosglass: the interface does not react; ending it\n")
                    sys.stderr.flush()
                    os._exit(128 + received[0])
        os.close(self._reader)


def _note(*_: object) -> None:
    """Ignore a signal here: :class:`QuitOnSignal` handles it in its thread."""


def _is_programs_own(number: int) -> bool:
    """Return whether a signal's handler is neither Python's default nor this package's."""
    handler = signal.getsignal(number)
    if handler in (signal.SIG_DFL, _DEFAULTS[number]):
        return False
    return str(getattr(handler, "__module__", "")).partition(".")[0] != "rosglass"


_log = logging.getLogger("rosglass.qml")
#: Appended to Qt's messages about refused requests.
NETWORK_HINT = "; the network is closed to interfaces: start with --allow-network to open it"
#: Environment variables for Qt, set unless they already are.
_CLOSED = {
    # Unlike Qt 6, Qt 5 lets an XMLHttpRequest read and write any file unless this forbids it.
    "QML_XHR_ALLOW_FILE_READ": "0",
    "QML_XHR_ALLOW_FILE_WRITE": "0",
    # FFmpeg, which plays videos for Qt 6, prints this list when it refuses an address.
    "QT_FFMPEG_PROTOCOL_WHITELIST": "file,others with --allow-network",
}


@cache
def close_network() -> None:
    """Block network access for everything that Qt loads in this process from now on.

    This also stops JavaScript from reading and writing files. A proxy that the program has set is
    kept.
    """
    for name, value in _CLOSED.items():
        os.environ.setdefault(name, value)
    network: Any = optional("QtNetwork")
    if network is None:
        _log.warning(
            "the network is open to interfaces, as Qt's QtNetwork is missing; on Debian: "
            "sudo apt install python3-pyside2.qtnetwork"
        )
        return
    proxy = network.QNetworkProxy
    kinds = proxy.ProxyType
    if proxy.applicationProxy().type() in (kinds.DefaultProxy, kinds.NoProxy):
        proxy.setApplicationProxy(proxy(kinds.Socks5Proxy, "127.0.0.1", _refusing_port()[1]))


def is_network_closed() -> bool:
    """Return whether :func:`close_network` was called."""
    return close_network.cache_info().currsize > 0


@cache
def _refusing_port() -> tuple[socket.socket, int]:
    """Return a local port that refuses all connections, and the socket that reserves it."""
    closed = socket.socket()
    # The socket never listens, and while it is bound, no other can listen on the port.
    closed.bind(("127.0.0.1", 0))
    return closed, closed.getsockname()[1]
