"""Show an RViz, a window of which is destroyed while a frame is drawn; for test_command.py."""

from __future__ import annotations

import ctypes
import sys
from typing import Any

#: Frames until there is a panel, until it floats, and until a window is destroyed.
ADDED, FLOATING, DESTROYED = 5, 10, 30


class Destroyer:
    """Another client of the X server, as xdotool windowclose is."""

    def __init__(self) -> None:
        self._xcb = ctypes.CDLL("libxcb.so.1")
        self._xcb.xcb_connect.restype = ctypes.c_void_p
        self._xcb.xcb_get_input_focus_reply.restype = ctypes.c_void_p
        self._connection = ctypes.c_void_p(self._xcb.xcb_connect(None, None))

    def destroy(self, window: int) -> None:
        self._xcb.xcb_destroy_window(self._connection, ctypes.c_uint32(window))
        # The server's reply to a later request: it has destroyed the window.
        request = self._xcb.xcb_get_input_focus(self._connection)
        self._xcb.xcb_get_input_focus_reply(self._connection, request, None)


def main() -> None:
    name, window = sys.argv[1:]
    from rosglass.rviz import Application
    from rosglass.rviz.qt5 import QtWidgets

    app = Application(name=name)
    destroyer, frames = Destroyer(), 0

    def panel() -> Any:
        found = QtWidgets.QApplication.allWidgets()
        return next(widget for widget in found if widget.windowTitle() == "Picture")

    def on_frame() -> None:
        nonlocal frames
        frames += 1
        if window != "RViz's" and frames == ADDED:
            app.rviz.displays.add("rviz/Image", "Picture")
        if window != "RViz's" and frames == FLOATING:
            panel().setFloating(True)
        if frames == DESTROYED:
            lost = app.window.widget if window == "RViz's" else panel()
            destroyer.destroy(int(lost.winId()))

    # Called after the slots of rosglass: only Ogre comes between this and its drawing.
    app.window.before_frame.connect(on_frame)
    app.run()


if __name__ == "__main__":
    main()
