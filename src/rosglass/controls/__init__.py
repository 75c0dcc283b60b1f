"""Controls for operator screens: the QML module ``RosControls 1.0``.

The QML files, one for each control, are in ``imports/RosControls``; the modules here are the
elements that are written in Python. ``rosglass run``, :class:`rosglass.qml.Application` and
overlays register them when a file imports the module; a program with its own QML engine calls
:func:`register`.
"""

__all__ = ["register"]


def register() -> None:
    """Register the types with Qt; only the first call has an effect."""
    # The modules without Qt also serve the command line.
    from rosglass.controls import modules  # noqa: PLC0415

    modules.register()
