"""Elements that QML declares inside a ``SceneView``, with an error for those outside of one."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING, Any

from rosglass.qt import QtCore, QtQml, is_alive

if TYPE_CHECKING:
    from rosglass.qml.elements.element import Element

__all__ = ["expect_view", "find_view"]

#: Milliseconds after which what QML has made is at its place.
_PLACED_MS = 1000


def find_view(item: QtCore.QObject) -> Any:
    """Return the ``SceneView`` in which an object is declared; None for none."""
    view: Any = item.parent()
    while view is not None and not hasattr(view, "adopt_display"):
        view = view.parent()
    return view


def expect_view(item: Element, attribute: str) -> None:
    """Log an error if an object that QML has made is in no view, once it must be at its place.

    Args:
        item: The object.
        attribute: Name of an attribute that is not None once it is in a view, also by a program.
    """
    state = item.__dict__
    if "_expects_view" in state or QtQml.QQmlEngine.contextForObject(item) is None:
        return
    state["_expects_view"] = True

    def check() -> None:
        if not is_alive(item) or getattr(item, attribute) is not None:
            return
        if find_view(item) is None:
            text = f"{item.label} is in no view, and has no effect: put it into a SceneView {{ }}"
            item._log(text, logging.ERROR)
        else:
            item._schedule()

    QtCore.QTimer.singleShot(_PLACED_MS, item, check)
