"""Finding out whether there is a screen before Qt does, which would end the program."""

from __future__ import annotations

import ctypes
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from rosglass.errors import UnsupportedError
from rosglass.qt import QT6, QtCore

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = ["require_display"]

_ADVICE = (
    "run it where there is a screen, over `ssh -X`, or on a virtual screen: "
    "xvfb-run -s '-screen 0 1280x800x24' rosglass ..."
)


def require_display() -> Callable[[], None]:
    """Make sure that Qt can open a window.

    Returns:
        A function to call once Qt is connected. Until then a connection stays open: a virtual
        screen starts over when its last client leaves, and refuses others meanwhile.

    Raises:
        UnsupportedError: There is no display, or a library is missing that Qt needs to use it; the
            message says what to do.
    """
    wanted = os.environ.get("QT_QPA_PLATFORM", "").partition(":")[0].partition(";")[0]
    if not QT6 and wanted == "offscreen" and not os.environ.get("DISPLAY"):
        # Qt 5 would look for OpenGL on a display that is not there, and crash.
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
    import socket  # noqa: PLC0415 - where there is no Wayland, starting up need not wait for it

    path = Path(os.environ.get("XDG_RUNTIME_DIR", "/")) / name
    try:
        with socket.socket(socket.AF_UNIX) as probe:
            probe.connect(str(path))
    except OSError:
        return False
    return True


class _X11Probe:
    """A connection to the X server, authorised as Qt's will be.

    Attributes:
        answers: Whether the server answered; true when it cannot be tried.
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
    """Load Qt's X11 plugin; its own error names neither the library nor the package."""
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
