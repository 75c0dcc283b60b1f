"""The values that a plugin of RQml keeps in its ``context``."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rosglass.errors import Error
from rosglass.qt import QtCore, QtQml, Signal, Slot

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rosglass.qt import QJSValue

__all__ = ["PluginContext"]

_SCRIPT = Path(__file__).with_name("context_values.js")


class PluginContext(QtCore.QObject):
    """A property map: any name can be read in QML, is undefined until written, and notifies.

    Args:
        engine: The engine of the plugin.
        parent: Destroyed with it.
    """

    #: The plugin has written a value. Changes inside an object that it holds are not noticed.
    written = Signal()

    def __init__(self, engine: QtQml.QQmlEngine, parent: QtCore.QObject) -> None:
        super().__init__(parent)
        make: Any = getattr(QtQml.QQmlPropertyMap, "create", QtQml.QQmlPropertyMap)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)
            #: The map, for QML.
            self.map: Any = make(self)
        functions: Any = engine.evaluate(_SCRIPT.read_text(encoding="utf-8"), str(_SCRIPT))
        self._functions: QJSValue = functions.call([])
        # Otherwise JavaScript would own it, and collect it.
        QtQml.QQmlEngine.setObjectOwnership(self.map, QtQml.QQmlEngine.ObjectOwnership.CppOwnership)
        self._script_map: Any = engine.newQObject(self.map)
        self._engine = engine
        self._quiet = False
        self.map.valueChanged.connect(self._on_written)

    @Slot()
    def _on_written(self, *_: Any) -> None:
        if not self._quiet:
            self.written.emit()

    def write(self, values: QJSValue) -> Sequence[str]:
        """Replace all values; return the names that the map does not take, such as ``keys``.

        Args:
            values: A JavaScript object.

        Raises:
            Error: It is too large, or too deep.
        """
        self._quiet = True
        try:
            kept = {*values.toVariant()} if values.isObject() else set()
            for name in self._names():
                if name not in kept:
                    self.map.clear(name)
            return list(self._call("write", values).toVariant())
        finally:
            self._quiet = False

    def text(self) -> tuple[str, Sequence[str]]:
        """Return all values as text for QML, such as ``({ topic: "/scan" })``.

        Returns:
            The text, and the names of values that have none: functions and items.

        Raises:
            Error: They are too large, or too deep.
        """
        names: Any = self._engine.toScriptValue(self._names())
        found = self._call("read", names)
        return found.property("text").toString(), list(found.property("left").toVariant())

    def _names(self) -> list[str]:
        """Return the names of the values; PySide keeps one of its own, without which it fails."""
        names: list[str] = self.map.keys()
        return sorted(name for name in names if not name.startswith("_PySide"))

    def _call(self, name: str, argument: QJSValue) -> QJSValue:
        made: Any = self._functions.property(name).call([self._script_map, argument])
        if made.isError():
            raise Error(f"context: {made.property('message').toString()}")
        result: QJSValue = made
        return result
