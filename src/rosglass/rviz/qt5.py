"""The modules of Qt 5 for RViz's process, typed as Any because the type stubs are Qt 6's."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from rosglass.qt import QT6, optional
from rosglass.qt import QtCore as _QtCore
from rosglass.qt import QtGui as _QtGui
from rosglass.qt import QtQuick as _QtQuick

__all__ = ["QtCore", "QtGui", "QtQuick", "QtWidgets", "shiboken"]

QtCore: Any = _QtCore
QtGui: Any = _QtGui
QtQuick: Any = _QtQuick
QtWidgets: Any = optional("QtWidgets")
shiboken: Any = import_module("shiboken6" if QT6 else "shiboken2")
