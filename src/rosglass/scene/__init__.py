"""The 3D view: RViz's job in QML, for ROS 2 and ROS 1, wherever PySide6 runs.

Interfaces say ``import RosScene 1.0``; programs that load QML themselves call :func:`register`
before their first window.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rosglass.scene.display import Display, TopicDisplay
    from rosglass.scene.modules import register
    from rosglass.scene.overlay import SceneOverlay, add_overlay
    from rosglass.scene.scene import Scene
    from rosglass.scene.scene_view import SceneView
    from rosglass.scene.tools import PointerEvent, Tool

__all__ = [
    "Display",
    "PointerEvent",
    "Scene",
    "SceneOverlay",
    "SceneView",
    "Tool",
    "TopicDisplay",
    "add_overlay",
    "register",
]

_HOMES = {
    "Display": "display",
    "PointerEvent": "tools",
    "Scene": "scene",
    "SceneOverlay": "overlay",
    "SceneView": "scene_view",
    "Tool": "tools",
    "TopicDisplay": "display",
    "add_overlay": "overlay",
    "register": "modules",
}


def __getattr__(name: str) -> object:
    # Imported on first use: files of robots and configs are read without Qt.
    if name not in _HOMES:
        raise AttributeError(f"module 'rosglass.scene' has no attribute {name!r}")
    value: object = getattr(import_module(f"rosglass.scene.{_HOMES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
