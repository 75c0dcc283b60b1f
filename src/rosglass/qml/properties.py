"""Properties of own elements for QML."""

from rosglass.qml.engine.properties import ReadOnly, Writable, at_least, report

__all__ = ["ReadOnly", "Writable", "at_least", "report"]
