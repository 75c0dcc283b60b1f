"""QML modules for robots: ``import Ros 1.0`` and ``import Ros2 1.0``.

:class:`Application` is a complete program around one QML file, like ``rosglass run``. A program
with its own QML engine calls :func:`install`.
"""

# First, because the other imports are slow.
from rosglass.interrupts import InterruptsDeferred

with InterruptsDeferred():
    from rosglass.qml.engine.session import GuiExecutor, Session
    from rosglass.qml.run.modules import IMPORT_PATHS, install

# Saves importing `typing`; type checkers recognise this name.
TYPE_CHECKING = False
if TYPE_CHECKING:
    from rosglass.qml.run.application import Application

__all__ = ["IMPORT_PATHS", "Application", "GuiExecutor", "Session", "install"]


def __getattr__(name: str) -> object:
    # Programs with their own engine do not need it.
    if name == "Application":
        with InterruptsDeferred():
            from rosglass.qml.run.application import Application  # noqa: PLC0415

        return Application
    raise AttributeError(f"module 'rosglass.qml' has no attribute {name!r}")
