"""Registers the QML module ``RosCockpit 1.0``."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

from rosglass.cockpit.depth_image_processor import DepthImageProcessor, has_multimedia
from rosglass.cockpit.icon_font import IconFontFile
from rosglass.cockpit.plugin_loader import PluginLoader
from rosglass.controls import modules as controls
from rosglass.qml.run.modules import register_class

if TYPE_CHECKING:
    from rosglass.qt import QtCore

__all__ = ["TYPES", "register"]

#: The types that are written in Python; ``imports/RosCockpit`` has those that are written in QML.
TYPES: dict[str, type[QtCore.QObject]] = {
    "IconFontFile": IconFontFile,
    "PluginLoader": PluginLoader,
}


@cache
def register() -> None:
    """Register the types, and those of the controls that they use; only the first call does it."""
    controls.register()
    for name, kind in TYPES.items():
        register_class(kind, "RosCockpit", name)
    if has_multimedia():
        register_class(DepthImageProcessor, "RQml.DefaultPlugins", "DepthImageProcessor")
