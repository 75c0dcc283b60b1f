"""Controls for operator screens: the QML module ``RosControls 1.0``.

The QML files, one for each control, are in ``imports/RosControls``; the modules here are the
elements that are written in Python. ``rosglass run``, :class:`rosglass.qml.Application` and
overlays register them when a file imports the module; a program with its own QML engine calls
:func:`register`.
"""

from rosglass.controls.modules import register

__all__ = ["register"]
