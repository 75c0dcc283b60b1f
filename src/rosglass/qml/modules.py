"""Making the QML modules known to Qt and to an engine."""

from __future__ import annotations

import os
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rosglass.errors import Error
from rosglass.qml import ros1, ros2
from rosglass.qml.runtime import Runtime, runtime_of
from rosglass.qt import QT6, QtQml

if TYPE_CHECKING:
    from rosglass.qml.session import Session

__all__ = ["IMPORT_PATHS", "install", "register"]

#: The directories to put on a QML import path: what all Qt versions share, and what is written
#: differently for this one. The types also need :func:`register`.
IMPORT_PATHS = tuple(
    Path(__file__).with_name(name) for name in ("imports", "imports6" if QT6 else "imports5")
)


@cache
def register() -> None:
    """Register the types with Qt, once per process."""
    # Qt lets 5 ms pass before it draws what has changed, in the hope that more will: a third of
    # what a picture needs from the robot to the screen.
    os.environ.setdefault("QT_QPA_UPDATE_IDLE_TIME", "0")
    register_type: Any = QtQml.qmlRegisterType
    for uri, module in (("Ros", ros1), ("Ros2", ros2)):
        for name, native in module.NATIVE.items():
            register_type(native, f"{uri}.Native", 1, 0, name)
        for name, kind in module.TYPES.items():
            register_type(kind, uri, 1, 0, name)


def install(engine: QtQml.QQmlEngine, session: Session | None = None) -> Session:
    """Make ``import Ros 1.0`` and ``import Ros2 1.0`` work in an engine.

    Args:
        engine: The engine, before it loads anything that imports the module.
        session: The node it talks through; None for the application's own, which all such engines
            share.

    Returns:
        The session.

    Raises:
        Error: The engine was given another session before.
    """
    register()
    for path in IMPORT_PATHS:
        engine.addImportPath(str(path))
    if session is None:
        found = runtime_of(engine)
        assert found is not None
        return found.session
    if engine.findChild(Runtime) is not None:
        raise Error("this QML engine has a session already; install() it only once")
    Runtime(engine, session)
    return session
