"""Ends the process when its X server has exited or its window was destroyed.

When the connection to the X server breaks, Qt and Xlib call ``exit()``, which destroys objects that
other threads still use. When a window is destroyed, Mesa's software renderer ignores the error, and
draws with an uninitialised size over arbitrary memory. This module ends the process before either
happens.
"""

from __future__ import annotations

import atexit
import ctypes
import logging
import os
import select
import sys
import threading
import time
from typing import TYPE_CHECKING, Any

from rosglass.comm import Handle

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

__all__ = ["LostScreen"]

_log = logging.getLogger("rosglass.rviz")
#: Maximum seconds for unregistering, and seconds that the thread calling ``exit()`` is paused.
_UNREGISTER_TIMEOUT_S, _EXIT_PAUSE_S = 1.5, 4
#: Seconds that an exiting X server may take from closing windows to closing connections.
_SERVER_EXIT_S = 0.3
_EXIT_CODE = 1
#: xproto.h: XCB_CW_EVENT_MASK, XCB_EVENT_MASK_STRUCTURE_NOTIFY, XCB_DESTROY_NOTIFY.
_EVENT_MASK, _STRUCTURE_NOTIFY, _DESTROYED = 1 << 11, 1 << 17, 17
#: X.h, Xproto.h: BadDrawable, X_GetGeometry.
_BAD_DRAWABLE, _GET_GEOMETRY = 9, 14
_BROKEN_CONNECTION = "the connection to the X server (DISPLAY {display}) is broken: RViz exits"
_DESTROYED_WINDOW = (
    "RViz's window was destroyed by another program (xdotool windowclose, xkill), or by this one "
    "(e.g. in setWindowFlags()): RViz exits"
)


class _Timespec(ctypes.Structure):
    """A ``struct timespec``."""

    _fields_ = (("seconds", ctypes.c_long), ("nanoseconds", ctypes.c_long))


class _ErrorEvent(ctypes.Structure):
    """Xlib's ``XErrorEvent``."""

    _fields_ = (
        ("type", ctypes.c_int),
        ("display", ctypes.c_void_p),
        ("resource_id", ctypes.c_ulong),
        ("serial", ctypes.c_ulong),
        ("error_code", ctypes.c_ubyte),
        ("request_code", ctypes.c_ubyte),
        ("minor_code", ctypes.c_ubyte),
    )


_ErrorHandler = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.POINTER(_ErrorEvent))
_IoErrorHandler = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p)


class _Connection:
    """A separate connection to the X server that reports destroyed windows."""

    def __init__(self) -> None:
        xcb = ctypes.CDLL("libxcb.so.1")
        xcb.xcb_connect.restype = xcb.xcb_poll_for_event.restype = ctypes.c_void_p
        self._xcb, self._libc = xcb, ctypes.CDLL(None)
        self._ptr = ctypes.c_void_p(xcb.xcb_connect(None, None))
        self.file = int(xcb.xcb_get_file_descriptor(self._ptr))

    @property
    def is_broken(self) -> bool:
        """True once the X server has closed the connection."""
        return bool(self._xcb.xcb_connection_has_error(self._ptr))

    def watch(self, window: int) -> None:
        """Select the event for the destruction of a window."""
        mask = ctypes.c_uint32(_STRUCTURE_NOTIFY)
        self._xcb.xcb_change_window_attributes(
            self._ptr,
            ctypes.c_uint32(window),
            ctypes.c_uint32(_EVENT_MASK),
            ctypes.byref(mask),
        )
        self._xcb.xcb_flush(self._ptr)

    def destroyed(self) -> set[int]:
        """Return the windows destroyed since the last call, without blocking."""
        found = set()
        while event := self._xcb.xcb_poll_for_event(self._ptr):
            if ctypes.c_uint8.from_address(event).value & 0x7F == _DESTROYED:
                found.add(ctypes.c_uint32.from_address(event + 8).value)
            self._libc.free(ctypes.c_void_p(event))
        return found

    def close(self) -> None:
        self._xcb.xcb_disconnect(self._ptr)


class LostScreen(Handle):
    """Ends the process with exit code 1 when its X server or its window is lost.

    Args:
        windows: X window ids of RViz's windows.
        unregister: Functions to call before, each in its own thread, for at most 1.5 seconds.
    """

    def __init__(self, windows: Sequence[int], unregister: Sequence[Callable[[], object]]) -> None:
        self._windows, self._unregister = set(windows), list(unregister)
        self._connection = _Connection()
        for window in windows:
            self._connection.watch(window)
        self._lock = threading.Lock()
        self._closed = self._ending = False
        self._reader, self._writer = os.pipe()
        # Any thread may call exit() at any time. It then closes the pipe, which wakes our thread,
        # and sleeps until the process ends. The handlers are C functions: Python may be unusable.
        self._pause = _Timespec(_EXIT_PAUSE_S, 0)
        libc = ctypes.CDLL(None)
        before_exit = libc["__cxa_atexit"]
        before_exit(libc.nanosleep, ctypes.byref(self._pause), None)
        before_exit(libc.close, ctypes.c_void_p(self._writer), None)
        _kept_alive.append(self._pause)
        xlib = ctypes.CDLL("libX11.so.6")
        self._set_error, self._set_io_error = xlib.XSetErrorHandler, xlib.XSetIOErrorHandler
        self._set_error.restype = self._set_io_error.restype = ctypes.c_void_p
        self._error_handler = _ErrorHandler(self._on_error)
        self._io_error_handler = _IoErrorHandler(self._on_io_error)
        self._error_before = _ErrorHandler(self._set_error(self._error_handler))
        self._io_error_before = self._set_io_error(self._io_error_handler)
        self._thread = threading.Thread(target=self._run, name="screen", daemon=True)
        self._thread.start()
        atexit.register(self.close)

    def check(self) -> None:
        """Check windows before drawing; does not return if one was destroyed."""
        with self._lock:
            destroyed = not self._closed and self._windows & self._connection.destroyed()
        if destroyed:
            self._end()
        if self._ending:
            time.sleep(_EXIT_PAUSE_S)

    def close(self) -> None:
        """Stop watching, before RViz's windows are closed; safe to call twice."""
        with self._lock:
            closed, self._closed = self._closed, True
        if closed:
            return
        atexit.unregister(self.close)
        self._set_error(self._error_before)
        self._set_io_error(ctypes.c_void_p(self._io_error_before))
        self._pause.seconds = 0
        os.write(self._writer, b".")
        self._thread.join(_UNREGISTER_TIMEOUT_S)
        self._connection.close()

    def _run(self) -> None:
        poll = select.poll()
        poll.register(self._reader, select.POLLIN)
        poll.register(self._connection.file, select.POLLIN)
        while not self._closed:
            woken = dict(poll.poll())
            exiting = self._reader in woken and not os.read(self._reader, 1)
            self.check()
            with self._lock:
                broken = not self._closed and self._connection.is_broken
            if broken or exiting:
                self._end(broken=True)

    def _on_error(self, display: int, event: Any) -> int:
        error = event.contents
        # Mesa requests the size before each frame: the window was destroyed after the last check.
        if (error.error_code, error.request_code) == (_BAD_DRAWABLE, _GET_GEOMETRY):
            self._end()
        return int(self._error_before(display, event))

    def _on_io_error(self, *_: Any) -> int:
        self._end(broken=True)
        return 0

    def _end(self, *, broken: bool = False) -> None:
        """End the process; a second thread that calls this waits for it."""
        with self._lock:
            ending, self._ending = self._ending, True
        if ending:
            time.sleep(_EXIT_PAUSE_S)
        text = _BROKEN_CONNECTION if broken or self._is_server_exiting() else _DESTROYED_WINDOW
        text = text.format(display=os.environ.get("DISPLAY", ""))
        until = time.monotonic() + _UNREGISTER_TIMEOUT_S
        steps = [lambda: _log.error("%s", text), *self._unregister]
        threads = [threading.Thread(target=step, daemon=True) for step in steps]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join(max(0.0, until - time.monotonic()))
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(_EXIT_CODE)

    def _is_server_exiting(self) -> bool:
        """Return whether a window was destroyed because the X server is exiting."""
        until = time.monotonic() + _SERVER_EXIT_S
        while time.monotonic() < until:
            with self._lock:
                self._connection.destroyed()
                if self._connection.is_broken:
                    return True
            time.sleep(0.01)
        return False


#: Keeps memory alive that C reads after Python's exit.
_kept_alive: list[_Timespec] = []
