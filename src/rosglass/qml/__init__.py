"""QML modules for robots: ``import Ros2 1.0``.

A program that has a QML engine of its own calls :func:`install`; ``rosglass run`` does it for QML
files.
"""

from rosglass.qml.executor import GuiExecutor
from rosglass.qml.modules import IMPORT_PATHS, install
from rosglass.qml.session import Session

__all__ = ["IMPORT_PATHS", "GuiExecutor", "Session", "install"]
