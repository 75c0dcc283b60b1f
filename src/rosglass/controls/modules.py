"""Registers the QML module ``RosControls 1.0``."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

from rosglass.controls.lists.alarms import Alarms
from rosglass.controls.lists.diagnostics import DiagnosticsTopic
from rosglass.controls.lists.graph_layout import GraphLayout
from rosglass.controls.lists.joints import JointTopic
from rosglass.controls.lists.log_topic import LogTopic
from rosglass.controls.lists.message_fields import MessageFields
from rosglass.controls.lists.message_rows import MessageRows
from rosglass.controls.lists.node_parameters import NodeParameters
from rosglass.controls.lists.tf_rows import TfRows
from rosglass.controls.lists.topic_rows import TopicRows
from rosglass.controls.maps.camera import MapCamera
from rosglass.controls.maps.geo_scene import GeoScene
from rosglass.controls.maps.marks import MapArrow, MapMarks
from rosglass.controls.maps.scene import MapScene
from rosglass.controls.plots.lines import PlotLines
from rosglass.controls.plots.plot import PlotData, PlotSeries
from rosglass.controls.steering.gamepad import Gamepad
from rosglass.controls.steering.twist_command import TwistCommand
from rosglass.controls.steering.window_keys import WindowKeys
from rosglass.controls.topics.graph_watch import GraphWatch
from rosglass.controls.topics.live_topic import LiveTopic
from rosglass.controls.topics.live_value import LiveValue
from rosglass.controls.topics.topic_recorder import TopicRecorder
from rosglass.qml.run.modules import register_class

if TYPE_CHECKING:
    from rosglass.qt import QtCore

__all__ = ["TYPES", "register"]

#: The types that are written in Python; ``imports/RosControls`` has those that are written in QML.
TYPES: dict[str, type[QtCore.QObject]] = {
    "Alarms": Alarms,
    "JointTopic": JointTopic,
    "DiagnosticsTopic": DiagnosticsTopic,
    "GraphLayout": GraphLayout,
    "Gamepad": Gamepad,
    "GraphWatch": GraphWatch,
    "LiveTopic": LiveTopic,
    "TwistCommand": TwistCommand,
    "LiveValue": LiveValue,
    "LogTopic": LogTopic,
    "NodeParameters": NodeParameters,
    "GeoScene": GeoScene,
    "MapArrow": MapArrow,
    "MapCamera": MapCamera,
    "MapMarks": MapMarks,
    "MapScene": MapScene,
    "WindowKeys": WindowKeys,
    "MessageFields": MessageFields,
    "MessageRows": MessageRows,
    "TfRows": TfRows,
    "TopicRows": TopicRows,
    "PlotData": PlotData,
    "PlotLines": PlotLines,
    "PlotSeries": PlotSeries,
    "TopicRecorder": TopicRecorder,
}


@cache
def register() -> None:
    """Register the types with Qt; only the first call has an effect."""
    for name, kind in TYPES.items():
        register_class(kind, "RosControls", name)
