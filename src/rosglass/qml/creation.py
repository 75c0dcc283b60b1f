"""Making what a QML file describes so that other threads of Python live on meanwhile."""

from __future__ import annotations

import ctypes
from functools import cache
from typing import TYPE_CHECKING, Any

from rosglass.qt import QT6, QtCore, QtQml, address

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = ["create"]

_LIBRARY = "libQt6Qml.so.6" if QT6 else "libQt5Qml.so.5"
#: QQmlComponent::completeCreate(), as the Itanium C++ ABI has it.
_COMPLETE = "_ZN13QQmlComponent14completeCreateEv"


@cache
def _completion() -> Callable[[QtQml.QQmlComponent], object]:
    """Return what completes what a component has begun, without Python's lock where it can."""
    try:
        # The one that the binding has loaded already.
        complete: Any = ctypes.CDLL(_LIBRARY)[_COMPLETE]
    except (OSError, AttributeError):
        return QtQml.QQmlComponent.completeCreate
    complete.restype = None
    return lambda component: complete(ctypes.c_void_p(address(component)))


def create(component: QtQml.QQmlComponent, engine: QtQml.QQmlEngine) -> QtCore.QObject | None:
    """Make what a component describes; None with errors, which the component tells.

    QQmlComponent.create keeps Python's lock, while first bindings and ``Component.onCompleted``
    run: one that never ends could not be ended.
    """
    if component.isError():
        return None
    root = component.beginCreate(engine.rootContext())
    if root is None:
        return None
    _completion()(component)
    if component.isError():
        root.deleteLater()
        return None
    return root
