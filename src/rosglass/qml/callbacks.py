"""Callbacks of own elements for QML."""

from rosglass.qml.engine.callbacks import weak_callback

__all__ = ["weak_callback"]
