"""Interfaces over RViz: QML and widgets drawn over its 3D view, and its camera steered from ROS.

Needs RViz 1 with its Python bindings, and the Python they are made for: on Debian 12,
``/usr/bin/python3`` or a virtual environment made from it with ``--system-site-packages``.
"""

from rosglass.rviz.application import Application
from rosglass.rviz.overlay import Overlay
from rosglass.rviz.qml_overlay import QmlOverlay

__all__ = ["Application", "Overlay", "QmlOverlay"]
