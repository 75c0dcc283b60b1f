"""Registers the QML module ``RosScene 1.0``."""

from __future__ import annotations

import os
from functools import cache
from typing import TYPE_CHECKING, Any

from PySide6.QtQml import qmlRegisterType

from rosglass.scene.display_configs import GroupDisplay
from rosglass.scene.displays.effort import EffortDisplay
from rosglass.scene.displays.geometry import (
    AccelStampedDisplay,
    PointStampedDisplay,
    PolygonDisplay,
    RangeDisplay,
    TwistStampedDisplay,
    WrenchStampedDisplay,
)
from rosglass.scene.displays.grid import AxesDisplay, GridDisplay
from rosglass.scene.displays.image import CameraDisplay, CameraView, ImageDisplay, PictureItem
from rosglass.scene.displays.interactive_marker import InteractiveMarkersDisplay
from rosglass.scene.displays.map import GridCellsDisplay, MapDisplay
from rosglass.scene.displays.marker import MarkerArrayDisplay, MarkerDisplay
from rosglass.scene.displays.point_cloud import (
    DepthCloudDisplay,
    FluidPressureDisplay,
    IlluminanceDisplay,
    LaserScanDisplay,
    PointCloud2Display,
    PointCloudDisplay,
    RelativeHumidityDisplay,
    TemperatureDisplay,
)
from rosglass.scene.displays.pose import (
    OdometryDisplay,
    PathDisplay,
    PoseArrayDisplay,
    PoseDisplay,
    PoseWithCovarianceDisplay,
)
from rosglass.scene.displays.qml_overlay import OverlayElement, QmlOverlayDisplay
from rosglass.scene.displays.robot_model import RobotModelDisplay
from rosglass.scene.displays.tf import TFDisplay
from rosglass.scene.displays.view_controller import ViewControllerDisplay
from rosglass.scene.panel_models import DisplaysModel
from rosglass.scene.publishing_tools import (
    Nav2GoalTool,
    PublishPointTool,
    SetGoalTool,
    SetInitialPoseTool,
)
from rosglass.scene.scene import Scene
from rosglass.scene.scene_view import SceneView
from rosglass.scene.tools import Tool, Tools
from rosglass.scene.view_tools import (
    FocusCameraTool,
    InteractTool,
    MeasureTool,
    MoveCameraTool,
    SelectTool,
)

if TYPE_CHECKING:
    from rosglass.qt import QtCore

__all__ = ["DISPLAYS", "TOOLS", "TYPES", "register"]

#: The displays; in QML, each has the name of its class.
DISPLAYS = (
    AccelStampedDisplay,
    AxesDisplay,
    CameraDisplay,
    DepthCloudDisplay,
    EffortDisplay,
    FluidPressureDisplay,
    GridCellsDisplay,
    GridDisplay,
    IlluminanceDisplay,
    ImageDisplay,
    InteractiveMarkersDisplay,
    LaserScanDisplay,
    MapDisplay,
    MarkerArrayDisplay,
    MarkerDisplay,
    OdometryDisplay,
    PathDisplay,
    PointCloud2Display,
    PointCloudDisplay,
    PointStampedDisplay,
    PolygonDisplay,
    PoseArrayDisplay,
    PoseDisplay,
    PoseWithCovarianceDisplay,
    RangeDisplay,
    RelativeHumidityDisplay,
    RobotModelDisplay,
    TFDisplay,
    TemperatureDisplay,
    TwistStampedDisplay,
    ViewControllerDisplay,
    WrenchStampedDisplay,
)
Scene.TYPES[QmlOverlayDisplay.TYPE] = QmlOverlayDisplay
Scene.TYPES.update({display.TYPE: display for display in (*DISPLAYS, GroupDisplay)})
#: The tools, likewise; ``Tool`` is the base of own ones.
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
#: The types by their names in QML; ``qml/imports6/RosScene`` has those that are written in QML.
TYPES: dict[str, type[QtCore.QObject]] = {
    **{
        kind.__name__: kind
        for kind in (SceneView, CameraView, PictureItem, Tool, DisplaysModel, *DISPLAYS, *TOOLS)
    },
    "SceneOverlay": OverlayElement,
}


@cache
def register() -> None:
    """Register the types with Qt; only the first call has an effect.

    Call it before the first window: with Qt's threaded render loop, Python code in the GUI thread
    that waits for the render thread would wait for ever, as that needs the GIL.
    """
    os.environ.setdefault("QSG_RENDER_LOOP", "basic")
    # PySide takes texts for names, which its hints do not say.
    register_type: Any = qmlRegisterType
    for name, kind in TYPES.items():
        register_type(kind, "RosScene", 1, 0, name)
