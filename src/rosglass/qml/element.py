"""The base of own elements for QML; see "Write your own element" in the documentation."""

from rosglass.qml.elements.element import Element

__all__ = ["Element"]
