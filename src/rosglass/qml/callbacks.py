"""Callbacks of own elements for QML."""

from rosglass.qml.engine.session import weak_callback

__all__ = ["weak_callback"]
