"""RViz with QML and widget overlays on its 3D view, and with a camera controlled by ROS services.

Requires RViz 1 with its Python bindings, and the Python they were built for: on Debian 12,
``/usr/bin/python3`` or a virtual environment of it with ``--system-site-packages``.
"""

from __future__ import annotations

import os
import sys
from importlib import import_module
from importlib.util import find_spec
from typing import TYPE_CHECKING

from rosglass.interrupts import InterruptsDeferred

if TYPE_CHECKING:
    from rosglass.overlay.overlay import Overlay
    from rosglass.rviz.application import Application
    from rosglass.rviz.overlay import register
    from rosglass.rviz.popup import Anchor, Button, Dialog, Popup, message
    from rosglass.rviz.qml_overlay import QmlOverlay
    from rosglass.rviz.widget_overlay import WidgetOverlay

__all__ = [
    "Anchor",
    "Application",
    "Button",
    "Dialog",
    "Overlay",
    "Popup",
    "QmlOverlay",
    "WidgetOverlay",
    "message",
    "register",
]

_MODULES = {
    "Anchor": "popup",
    "Application": "application",
    "Button": "popup",
    "Dialog": "popup",
    "Overlay": "overlay",
    "Popup": "popup",
    "QmlOverlay": "qml_overlay",
    "WidgetOverlay": "widget_overlay",
    "message": "popup",
    "register": "overlay",
}


def __getattr__(name: str) -> object:
    # Imported on first use, because modules without Qt must be importable without RViz.
    if name not in _MODULES:
        raise AttributeError(f"module 'rosglass.rviz' has no attribute {name!r}")
    if "rosglass.qt" not in sys.modules and find_spec("rviz") is not None:
        # RViz needs Qt 5. Without RViz, the error should be about RViz, not about Qt 5.
        os.environ.setdefault("ROSGLASS_QT", "pyside2")
    with InterruptsDeferred():
        value: object = getattr(import_module(f"rosglass.rviz.{_MODULES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
