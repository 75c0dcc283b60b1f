"""QML modules for robots: ``import Ros 1.0`` and ``import Ros2 1.0``.

:class:`Application` is a whole program around a QML file, as ``rosglass run`` is; a program that
has a QML engine of its own calls :func:`install`.
"""

# Before anything that takes its time to import.
from rosglass.interrupts import InterruptsDeferred

with InterruptsDeferred():
    from rosglass.qml.modules import IMPORT_PATHS, install
    from rosglass.qml.session import GuiExecutor, Session

# Without `typing`; type checkers know this name.
TYPE_CHECKING = False
if TYPE_CHECKING:
    from rosglass.qml.application import Application

__all__ = ["IMPORT_PATHS", "Application", "GuiExecutor", "Session", "install"]


def __getattr__(name: str) -> object:
    # Programs with an engine of their own need none of it.
    if name == "Application":
        with InterruptsDeferred():
            from rosglass.qml.application import Application  # noqa: PLC0415

        return Application
    raise AttributeError(f"module 'rosglass.qml' has no attribute {name!r}")
