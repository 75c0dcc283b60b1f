"""The 3D view: RViz's job in QML, for ROS 2 and ROS 1, wherever PySide6 runs.

Interfaces say ``import RosScene 1.0``; programs that load QML themselves call :func:`register`
before their first window.
"""

from __future__ import annotations

import sys
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rosglass.scene.app.modules import register
    from rosglass.scene.configs.rviz_config import RvizConfig
    from rosglass.scene.configs.settings import Setting
    from rosglass.scene.data.meshes import load_mesh_cached
    from rosglass.scene.data.urdf import parse_urdf
    from rosglass.scene.displays.display import Display
    from rosglass.scene.displays.scene import Scene
    from rosglass.scene.displays.topic_display import TopicDisplay
    from rosglass.scene.overlays.scene_overlay import SceneOverlay, add_overlay
    from rosglass.scene.tools.pointer_event import PointerEvent
    from rosglass.scene.tools.tool import Tool
    from rosglass.scene.view.scene_view import SceneView

__all__ = [
    "Display",
    "PointerEvent",
    "RvizConfig",
    "Scene",
    "SceneOverlay",
    "SceneView",
    "Setting",
    "Tool",
    "TopicDisplay",
    "add_overlay",
    "load_mesh_cached",
    "parse_urdf",
    "register",
]

_HOMES = {
    "Display": "displays.display",
    "PointerEvent": "tools.tool",
    "RvizConfig": "configs.rviz_config",
    "Scene": "displays.scene",
    "SceneOverlay": "overlays.scene_overlay",
    "SceneView": "view.scene_view",
    "Setting": "configs.settings",
    "Tool": "tools.tool",
    "TopicDisplay": "displays.topic_display",
    "add_overlay": "overlays.scene_overlay",
    "load_mesh_cached": "data.meshes",
    "parse_urdf": "data.urdf",
    "register": "app.modules",
}
#: Former modules that programs import, and where their names are now.
_FORMER = {
    "drawing": (
        "render.drawing",
        "render.scene_tree",
        "render.mesh_shapes",
        "render.matrices",
        "render.arrays",
    ),
    "meshes": ("data.meshes",),
    "rviz_config": ("configs.rviz_config",),
    "settings": ("configs.settings",),
    "urdf": ("data.urdf",),
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


def _former_module(name: str, homes: tuple[str, ...]) -> ModuleType:
    """Return a module whose names are those of others, imported on first use."""
    module = ModuleType(f"{__name__}.{name}", f"The names of {', '.join(homes)}.")

    def find(attribute: str) -> object:
        if attribute.startswith("__"):  # which debuggers ask of all modules
            raise AttributeError(attribute)
        for home in homes:
            found = import_module(f"{__name__}.{home}")
            if hasattr(found, attribute):
                return getattr(found, attribute)
        raise AttributeError(f"module {module.__name__!r} has no attribute {attribute!r}")

    vars(module)["__getattr__"] = find
    return module


for _name, _homes in _FORMER.items():
    globals()[_name] = sys.modules[f"{__name__}.{_name}"] = _former_module(_name, _homes)
