"""Qt 5's modules as RViz's process has them; untyped, for their types would be Qt 6's."""

from __future__ import annotations

from typing import Any

from rosglass.qt import QtCore as _QtCore
from rosglass.qt import QtGui as _QtGui
from rosglass.qt import QtQuick as _QtQuick
from rosglass.qt import optional

__all__ = ["QtCore", "QtGui", "QtQuick", "QtWidgets"]

QtCore: Any = _QtCore
QtGui: Any = _QtGui
QtQuick: Any = _QtQuick
QtWidgets: Any = optional("QtWidgets")
