"""The icons of entries in RViz's Displays panel, as RViz's binding has them."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any

from rosglass.rviz.host import pyqt

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = ["camera_icon", "overlay_icon"]


@cache
def overlay_icon() -> Any:
    """Return a pane over a view."""
    rect = pyqt().QRectF
    return _icon(lambda painter: painter.drawRoundedRect(rect(2, 2, 24, 20), 3, 3), 9, 11, 21, 19)


@cache
def camera_icon() -> Any:
    """Return a camera."""
    lens = [pyqt().QPointF(x, y) for x, y in ((17, 16), (29, 8), (29, 24))]
    return _icon(lambda painter: painter.drawPolygon(*lens), 2, 8, 19, 16)


def _icon(draw_grey: Callable[[Any], None], *blue: float) -> Any:
    """Return something grey with a blue pane before it.

    Args:
        draw_grey: Draws it, within 32x32 pixels.
        blue: Left, top, width and height of the pane.
    """
    core, gui = pyqt(), pyqt("QtGui")
    picture = gui.QPixmap(32, 32)
    picture.fill(core.Qt.transparent)
    painter = gui.QPainter(picture)
    painter.setRenderHint(gui.QPainter.Antialiasing)
    painter.setPen(gui.QPen(gui.QColor("#404850"), 2))
    painter.setBrush(gui.QColor("#a8b4c0"))
    draw_grey(painter)
    painter.setBrush(gui.QColor(33, 150, 243, 200))
    painter.drawRoundedRect(core.QRectF(*blue), 3, 3)
    painter.end()
    return gui.QIcon(picture)
