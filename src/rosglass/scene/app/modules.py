"""Registers the QML module ``RosScene 1.0``.

The modules of displays are imported, and their QML types registered, when they are first used:
``rosglass view`` shows few of them. :func:`register` imports all.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING, Any

from PySide6.QtQml import qmlRegisterType

from rosglass.scene.app.panel_models import DisplaysModel
from rosglass.scene.displays.scene import Scene
from rosglass.scene.tools.publishing_tools import (
    Nav2GoalTool,
    PublishPointTool,
    SetGoalTool,
    SetInitialPoseTool,
)
from rosglass.scene.tools.tool import Tool
from rosglass.scene.tools.tool_manager import Tools
from rosglass.scene.tools.view_tools import (
    FocusCameraTool,
    InteractTool,
    MeasureTool,
    MoveCameraTool,
    SelectTool,
)
from rosglass.scene.view.scene_view import SceneView

if TYPE_CHECKING:
    from rosglass.qt import QtCore
    from rosglass.scene.displays.display import Display

__all__ = ["DISPLAYS", "TOOLS", "load_types", "register", "register_window"]

#: The module of each display, by its name in RViz; its class is the last word and "Display".
DISPLAYS = {
    "AccelStamped": "displays.geometry",
    "Axes": "displays.grid",
    "Camera": "displays.camera",
    "DepthCloud": "displays.depth_cloud",
    "Effort": "displays.effort",
    "FluidPressure": "displays.point_cloud",
    "Grid": "displays.grid",
    "GridCells": "displays.map",
    "Group": "view.display_configs",
    "Illuminance": "displays.point_cloud",
    "Image": "displays.image",
    "InteractiveMarkers": "displays.interactive_marker",
    "LaserScan": "displays.point_cloud",
    "Map": "displays.map",
    "Marker": "displays.marker",
    "MarkerArray": "displays.marker",
    "Odometry": "displays.pose",
    "Path": "displays.pose",
    "PointCloud": "displays.point_cloud",
    "PointCloud2": "displays.point_cloud",
    "PointStamped": "displays.geometry",
    "Polygon": "displays.geometry",
    "Pose": "displays.pose",
    "PoseArray": "displays.pose",
    "PoseWithCovariance": "displays.pose",
    "Range": "displays.geometry",
    "RelativeHumidity": "displays.point_cloud",
    "RobotModel": "displays.robot_model",
    "TF": "displays.tf",
    "Temperature": "displays.point_cloud",
    "TwistStamped": "displays.geometry",
    "WrenchStamped": "displays.geometry",
    "rosglass/QmlOverlay": "overlays.qml_overlay",
    "rosglass/ViewController": "overlays.view_controller",
}
#: Displays that are not types of QML.
_NOT_IN_QML = ("Group", "rosglass/QmlOverlay")
#: Types of QML that come with a module of displays, and their classes.
_ITEMS = {
    "displays.camera": {"CameraView": "CameraView"},
    "displays.image": {"PictureItem": "PictureItem"},
    "overlays.qml_overlay": {"SceneOverlay": "OverlayElement"},
}
#: Modules that come with another one: ``ImagePanel.qml`` has the types of both.
_PARTNERS = {"displays.camera": ("displays.image",), "displays.image": ("displays.camera",)}
#: The tools; in QML, each has the name of its class; ``Tool`` is the base of own ones.
TOOLS = (
    FocusCameraTool,
    InteractTool,
    MeasureTool,
    MoveCameraTool,
    Nav2GoalTool,
    PublishPointTool,
    SelectTool,
    SetGoalTool,
    SetInitialPoseTool,
)
Tools.TYPES.update({tool.TYPE: tool for tool in TOOLS})


def _class_name(display: str) -> str:
    return f"{display.rpartition('/')[2]}Display"


class _DisplayTypes(Mapping[str, "type[Display]"]):
    """Types of displays by their name in RViz; each module is imported with its first use."""

    def __getitem__(self, name: str) -> type[Display]:
        module = DISPLAYS[name]
        for one in (module, *_PARTNERS.get(module, ())):
            _load(one)
        found: type[Display] = getattr(_import(module), _class_name(name))
        return found

    def __iter__(self) -> Iterator[str]:
        return iter(DISPLAYS)

    def __len__(self) -> int:
        return len(DISPLAYS)


Scene.TYPES = _DisplayTypes()


def _import(module: str) -> Any:
    return import_module(f"rosglass.scene.{module}")


@cache
def _load(module: str) -> dict[str, type[QtCore.QObject]]:
    """Import a module of displays, and register and return its types of QML by their names."""
    shown = (name for name, home in DISPLAYS.items() if home == module and name not in _NOT_IN_QML)
    names = {name: name for name in map(_class_name, shown)} | _ITEMS.get(module, {})
    return _register({name: getattr(_import(module), kind) for name, kind in names.items()})


def _register(types: dict[str, type[QtCore.QObject]]) -> dict[str, type[QtCore.QObject]]:
    # PySide takes texts for names, which its hints do not say.
    register_type: Any = qmlRegisterType
    for name, kind in types.items():
        register_type(kind, "RosScene", 1, 0, name)
    return types


@cache
def register_window() -> dict[str, type[QtCore.QObject]]:
    """Register the types that the window of ``rosglass view`` uses; others follow when needed.

    As for :func:`register`; returns the types by their names in QML.
    """
    os.environ.setdefault("QSG_RENDER_LOOP", "basic")
    return _register({kind.__name__: kind for kind in (SceneView, Tool, DisplaysModel, *TOOLS)})


def load_types() -> dict[str, type[QtCore.QObject]]:
    """Register all types with Qt, and return them by their names in QML.

    ``qml/imports6/RosScene`` has those that are written in QML.
    """
    types = dict(register_window())
    for module in dict.fromkeys(DISPLAYS.values()):
        types |= _load(module)
    return types


@cache
def register() -> None:
    """Register all types with Qt; only the first call has an effect.

    Call it before the first window: with Qt's threaded render loop, Python code in the GUI thread
    that waits for the render thread would wait for ever, as that needs the GIL.
    """
    load_types()
