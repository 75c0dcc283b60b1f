"""The 3D view against real RViz: the same config and the same messages give the same picture."""

from __future__ import annotations

import json
import math
import os
import subprocess
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pytest
import yaml
from pictures import drawn, patches, unmatched
from point_clouds import point_cloud2
from rosmaster import RosMaster

from rosglass.comm.qos import QoS
from rosglass.demo.processes import VirtualScreen

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray
    from qt_waiting import QtWaiting

ROOT = Path(__file__).parents[2]
PYTHON = ROOT / ".venv-system" / "bin" / "python"
SIZE = (640, 480)
#: Seconds for messages to arrive in both, and for both to draw them.
TIMEOUT_S = 15.0
HEADER = {"frame_id": "map"}
RED, GREEN, BLUE = "255; 0; 0", "0; 255; 0", "0; 0; 255"
YELLOW, CYAN, MAGENTA = "255; 255; 0", "0; 255; 255", "255; 0; 255"
RGBA = {
    "red": {"r": 1.0, "a": 1.0},
    "green": {"g": 1.0, "a": 1.0},
    "blue": {"b": 1.0, "a": 1.0},
    "yellow": {"r": 1.0, "g": 1.0, "a": 1.0},
    "cyan": {"g": 1.0, "b": 1.0, "a": 1.0},
    "magenta": {"r": 1.0, "b": 1.0, "a": 1.0},
    "white": {"r": 1.0, "g": 1.0, "b": 1.0, "a": 1.0},
}
VIEWS = {
    "Orbit": {
        "Class": "rviz/Orbit",
        "Distance": 8.0,
        "Focal Point": {"X": 0.0, "Y": 0.0, "Z": 0.0},
        "Near Clip Distance": 0.01,
        "Pitch": 0.7,
        "Yaw": 0.9,
        "Target Frame": "<Fixed Frame>",
    },
    "TopDownOrtho": {
        "Class": "rviz/TopDownOrtho",
        "Angle": 0.0,
        "Scale": 70.0,
        "X": 0.0,
        "Y": 0.0,
        "Near Clip Distance": 0.01,
        "Target Frame": "<Fixed Frame>",
    },
}


class Message(NamedTuple):
    """What a topic publishes."""

    topic: str
    type: str
    fields: dict[str, Any]


def display(kind: str, topic: str = "", **settings: Any) -> dict[str, Any]:
    """Return a display of a config; underscores stand for spaces."""
    found = {"Class": f"rviz/{kind}", "Name": f"{kind} {topic}", "Enabled": True, "Value": True}
    if topic:
        found["Marker Topic" if kind.startswith("Marker") else "Topic"] = topic
    return found | {name.replace("_", " "): value for name, value in settings.items()}


def pose(x: float, y: float, z: float = 0.0, yaw: float = 0.0, pitch: float = 0.0) -> Any:
    cy, sy = math.cos(yaw / 2), math.sin(yaw / 2)
    cp, sp = math.cos(pitch / 2), math.sin(pitch / 2)
    turn = {"x": -sp * sy, "y": sp * cy, "z": cp * sy, "w": cp * cy}
    return {"position": {"x": x, "y": y, "z": z}, "orientation": turn}


def points(*places: tuple[float, float, float]) -> list[dict[str, float]]:
    return [{"x": x, "y": y, "z": z} for x, y, z in places]


def marker(number: int, kind: int, colour: str, at: Any, scale: Any, **fields: Any) -> Any:
    made = {
        "header": HEADER,
        "ns": "judge",
        "id": number,
        "type": kind,
        "pose": at,
        "scale": dict(zip("xyz", scale, strict=True)),
        "color": RGBA[colour],
    }
    return {**made, **fields}


def cloud(x: float, y: float, **channels: Any) -> dict[str, Any]:
    """Return a cloud of 6 x 6 points, 0.3 m from each other, that rises."""
    at = np.stack(np.meshgrid(np.arange(6) * 0.3, np.arange(6) * 0.3), axis=-1).reshape(-1, 2)
    at = at.astype(np.float32)
    columns = {"x": at[:, 0] + np.float32(x), "y": at[:, 1] + np.float32(y), "z": at.sum(1) * 0.3}
    columns["z"] = columns["z"].astype(np.float32)
    return {**point_cloud2({**columns, **channels}), "header": HEADER}


def occupancy(x: float, y: float) -> dict[str, Any]:
    """Return a map of 3 x 2 m with all values of a cell."""
    values = np.arange(-128, 128).astype(np.int8)
    data = np.tile(values, 3)[:600]
    info = {"resolution": 0.1, "width": 30, "height": 20, "origin": pose(x, y, yaw=0.2)}
    return {"header": HEADER, "info": info, "data": data}


def controlled(name: str, at: Any, *controls: dict[str, Any]) -> dict[str, Any]:
    """Return an interactive marker whose controls are shown without the tool Interact, too."""
    shown = [{"always_visible": True, **one, "name": f"{n}"} for n, one in enumerate(controls)]
    return {"header": HEADER, "name": name, "pose": at, "scale": 1.2, "controls": shown}


def covariance(*variances: float) -> Any:
    return np.diag(variances).reshape(-1)


#: The joints of the frames that are published.
URDF = """<robot name="judge">
  <link name="map"/><link name="base"/><link name="arm"/><link name="rail"/>
  <joint name="turn" type="revolute"><parent link="map"/><child link="base"/>
    <axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="10" velocity="1"/></joint>
  <joint name="swing" type="revolute"><parent link="base"/><child link="arm"/>
    <axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="20" velocity="1"/></joint>
  <joint name="lift" type="prismatic"><parent link="base"/><child link="rail"/>
    <limit lower="0" upper="1" effort="100" velocity="1"/></joint>
</robot>"""
#: Orientations whose x axes are z and y.
Z_UP, Y_UP = (
    pose(0, 0, 0, 0, -math.pi / 2)["orientation"],
    pose(0, 0, 0, math.pi / 2)["orientation"],
)
HALF = {"x": 0.5, "y": 0.5, "z": 0.5}
INTERACTIVE_MARKERS = [
    Message(
        "/server/update_full", "visualization_msgs/InteractiveMarkerInit",
        {
            "server_id": "judge", "seq_num": 1,
            "markers": [
                controlled("arrows", pose(-2.5, -1.5, 0, 0.4), {"interaction_mode": 3},
                           {"interaction_mode": 3, "orientation": Z_UP}),
                controlled("ring", pose(0, -1.5, 0, 0.4, 0.3),
                           {"interaction_mode": 5, "orientation": Z_UP}),
                controlled("fixed", pose(2.2, -1.5, 0, 0.4, 0.3),
                           {"interaction_mode": 4, "orientation": Y_UP,
                            "orientation_mode": 1}),
                controlled("pull", pose(-2, 1),
                           {"interaction_mode": 6, "orientation": Z_UP}),
                controlled("facing", pose(0.3, 1, 0, 0.5),
                           {"interaction_mode": 5, "orientation_mode": 2},
                           {"interaction_mode": 2, "markers": [
                               marker(0, 1, "yellow", pose(0.2, 0), (0.4, 0.2, 0.3),
                                      header={})]}),
                controlled("apart", pose(2, 1, 0, 0.5),
                           {"interaction_mode": 4, "orientation_mode": 2,
                            "independent_marker_orientation": True, "markers": [
                               marker(0, 1, "magenta", pose(0.2, 0), (0.6, 0.3, 0.3),
                                      header={})]}),
            ],
        },
    ),
    Message("/server/update", "visualization_msgs/InteractiveMarkerUpdate",
            {"server_id": "judge", "seq_num": 1}),
]  # fmt: skip
#: A wall, and then something before its middle; some pixels are not known.
OCCLUSIONS = np.full((2, 20, 30), 3000)
OCCLUSIONS[1, 5:15, 8:20] = 1200
OCCLUSIONS[1, 2:4] = 0
CASES: dict[str, tuple[list[dict[str, Any]], list[Message]]] = {
    "grids and axes": (
        [
            display("Grid"),
            display("Grid", Plane="XZ", Color=YELLOW, Alpha=1.0, Plane_Cell_Count=4,
                    Normal_Cell_Count=1, Cell_Size=0.5,
                    Line_Style={"Value": "Billboards", "Line Width": 0.05},
                    Offset={"X": 0.0, "Y": 2.0, "Z": 1.0}),
            display("Axes", Length=1.5, Radius=0.1),
        ],
        [],
    ),
    "frames": (
        [display("TF", Show_Names=False, Marker_Scale=3.0)],
        [],
    ),
    "paths": (
        [
            display("Path", "/path1", Color=GREEN, Line_Style="Lines"),
            display("Path", "/path2", Color=BLUE, Line_Style="Billboards", Line_Width=0.1,
                    Pose_Style="Arrows", Pose_Color=MAGENTA),
            display("Path", "/path3", Color=CYAN, Pose_Style="Axes", Length=0.4, Radius=0.04),
        ],
        [
            Message(
                f"/path{number}", "nav_msgs/Path",
                {
                    "header": HEADER,
                    "poses": [
                        {"header": HEADER, "pose": pose(x, 1.8 * number - 3.4, 0.1 * x, 0.5)}
                        for x in (-2.0, -1.0, 0.5, 2.0)
                    ],
                },
            )
            for number in (1, 2, 3)
        ],
    ),
    "maps": (
        [
            display("Map", "/map1", Alpha=1.0),
            display("Map", "/map2", Alpha=0.6, Color_Scheme="costmap"),
            display("Map", "/map3", Alpha=1.0, Color_Scheme="raw"),
            display("GridCells", "/cells", Color=MAGENTA),
        ],
        [
            Message("/map1", "nav_msgs/OccupancyGrid", occupancy(-3.5, -2.5)),
            Message("/map2", "nav_msgs/OccupancyGrid", occupancy(0.2, -2.5)),
            Message("/map3", "nav_msgs/OccupancyGrid", occupancy(-3.5, 0.2)),
            Message(
                "/cells", "nav_msgs/GridCells",
                {
                    "header": HEADER, "cell_width": 0.3, "cell_height": 0.3,
                    "cells": points((1, 1, 0), (1.5, 1, 0), (2, 2, 0), (2.5, 0.7, 0)),
                },
            ),
        ],
    ),
    "marker shapes": (
        [display("MarkerArray", "/shapes")],
        [
            Message(
                "/shapes", "visualization_msgs/MarkerArray",
                {
                    "markers": [
                        marker(0, 0, "red", pose(-3, -2, 0, 0.3), (1.5, 0.2, 0.3)),
                        marker(1, 1, "green", pose(0, -1.5, 0, 0.4, 0.3), (1, 0.7, 0.5)),
                        marker(2, 2, "blue", pose(2.5, -1.5), (1.2, 0.8, 1)),
                        marker(3, 3, "yellow", pose(-2.5, 1, 0, 0, 0.5), (0.8, 0.8, 1.2)),
                        marker(4, 0, "cyan", pose(0, 0.8), (0.15, 0.4, 0.0),
                               points=points((0, 0, 0), (0.8, 0.8, 0.5))),
                        marker(5, 0, "magenta", pose(1.5, 0.8), (0.2, 0.5, 0.6),
                               points=points((0, 0, 0), (1.2, 0.6, 0.2))),
                    ]
                },
            )
        ],
    ),
    "marker lists": (
        [display("MarkerArray", "/lists")],
        [
            Message(
                "/lists", "visualization_msgs/MarkerArray",
                {
                    "markers": [
                        marker(0, 4, "red", pose(-3, -2), (0.1, 0, 0),
                               points=points((0, 0, 0), (1, 0, 0.3), (1.5, 1, 0), (1.5, 1.5, 0.5))),
                        marker(1, 5, "green", pose(-1, -2), (0.05, 0, 0),
                               points=points((0, 0, 0), (1, 0, 0), (0, 0.5, 0), (1, 1, 1))),
                        marker(2, 6, "blue", pose(1, -2, 0, 0.4), (0.3, 0.2, 0.4),
                               points=points((0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0.5))),
                        marker(3, 7, "yellow", pose(-3, 0.5), (0.4, 0.4, 0.4),
                               points=points((0, 0, 0), (0.7, 0, 0), (0, 0.8, 0))),
                        marker(4, 8, "cyan", pose(-1, 0.5), (0.15, 0.15, 0),
                               points=points((0, 0, 0), (0.5, 0, 0), (0, 0.8, 0), (1, 1, 0.5))),
                        marker(5, 11, "magenta", pose(1, 0.5), (1, 1, 1),
                               points=points((0, 0, 0), (1, 0, 0), (0, 1, 0.5),
                                             (1.2, 0, 0), (1.8, 1.2, 0), (0.8, 1, 0.5))),
                    ]
                },
            )
        ],
    ),
    "texts": (
        [
            display("TF", Show_Axes=False, Show_Arrows=False, Marker_Scale=2.0),
            display("MarkerArray", "/texts"),
        ],
        [
            Message(
                "/texts", "visualization_msgs/MarkerArray",
                {
                    "markers": [
                        marker(0, 9, "red", pose(-1.5, -1.5), (0, 0, 0.5), text="Hello"),
                        marker(1, 9, "green", pose(1.5, 1.5), (0, 0, 0.3), text="two\nlines"),
                    ]
                },
            )
        ],
    ),
    "translucent markers": (
        [display("Grid"), display("Marker", "/glass"), display("Marker", "/solid")],
        [
            Message("/solid", "visualization_msgs/Marker",
                    marker(0, 1, "green", pose(0, 0, 0), (1, 1, 1))),
            Message("/glass", "visualization_msgs/Marker",
                    marker(0, 1, "red", pose(0.5, 0.5, 0.5), (2, 2, 2),
                           color={"r": 1.0, "a": 0.4})),
        ],
    ),
    "poses": (
        [
            display("Pose", "/pose", Color=RED),
            display("Pose", "/pose2", Shape="Axes", Axes_Length=1.0, Axes_Radius=0.08),
            display("PoseArray", "/poses", Color=CYAN, Arrow_Length=0.6),
            display("PoseArray", "/poses2", Color=MAGENTA, Shape="Arrow (3D)",
                    Shaft_Length=0.5, Shaft_Radius=0.05, Head_Length=0.2, Head_Radius=0.12),
            display("PoseArray", "/poses3", Shape="Axes", Axes_Length=0.5, Axes_Radius=0.05),
        ],
        [
            Message("/pose", "geometry_msgs/PoseStamped",
                    {"header": HEADER, "pose": pose(-2, -2, 0, 0.5, 0.2)}),
            Message("/pose2", "geometry_msgs/PoseStamped",
                    {"header": HEADER, "pose": pose(1, -2, 0, 0.5, 0.2)}),
            Message("/poses", "geometry_msgs/PoseArray",
                    {"header": HEADER, "poses": [pose(-2, 0, 0, 1.0), pose(-2, 1, 0, 0, 0.6)]}),
            Message("/poses2", "geometry_msgs/PoseArray",
                    {"header": HEADER, "poses": [pose(0, 0, 0, 1.0), pose(0, 1.5, 0, 0, 0.6)]}),
            Message("/poses3", "geometry_msgs/PoseArray",
                    {"header": HEADER, "poses": [pose(2, 0, 0, 1.0), pose(2, 1.5, 0, 0, 0.6)]}),
        ],
    ),
    "covariances": (
        [
            display("PoseWithCovariance", "/covariance", Color=RED),
            display("PoseWithCovariance", "/covariance2", Color=CYAN),
            display("Odometry", "/odometry", Shape={"Value": "Arrow", "Color": BLUE,
                    "Shaft Length": 0.6, "Head Length": 0.3}),
        ],
        [
            Message("/covariance", "geometry_msgs/PoseWithCovarianceStamped",
                    {"header": HEADER, "pose": {
                        "pose": pose(-2, -2, 0, 0.5),
                        "covariance": covariance(0.3, 0.1, 0, 0, 0, 0.1)}}),
            Message("/covariance2", "geometry_msgs/PoseWithCovarianceStamped",
                    {"header": HEADER, "pose": {
                        "pose": pose(1, -2, 0, 0.5),
                        "covariance": covariance(0.3, 0.1, 0.2, 0.04, 0.04, 0.1)}}),
            Message("/odometry", "nav_msgs/Odometry",
                    {"header": HEADER, "pose": {
                        "pose": pose(-1, 1, 0, 0.5),
                        "covariance": covariance(0.1, 0.2, 0, 0, 0, 0.04)}}),
        ],
    ),
    "geometry": (
        [
            display("PointStamped", "/point", Color=GREEN, Radius=0.4),
            display("Polygon", "/polygon", Color=YELLOW),
            display("Range", "/range", Color=CYAN),
            display("WrenchStamped", "/wrench", Force_Color=RED, Torque_Color=BLUE),
            display("TwistStamped", "/twist", Angular_Arrow_Scale=1.0, Linear_Arrow_Scale=1.0),
            display("AccelStamped", "/accel", Linear_Color=MAGENTA, Linear_Arrow_Scale=1.0,
                    Arrow_Width=1.0),
        ],
        [
            Message("/point", "geometry_msgs/PointStamped",
                    {"header": HEADER, "point": {"x": -2.0, "y": -1.5}}),
            Message("/polygon", "geometry_msgs/PolygonStamped",
                    {"header": HEADER, "polygon": {
                        "points": points((0.5, -2.5, 0), (2.5, -2.5, 0), (2, -1, 0.5))}}),
            Message("/range", "sensor_msgs/Range",
                    {"header": {"frame_id": "arm"}, "field_of_view": 0.5, "min_range": 0.1,
                     "max_range": 4.0, "range": 1.5}),
            Message("/twist", "geometry_msgs/TwistStamped",
                    {"header": {"frame_id": "base"},
                     "twist": {"linear": {"x": 1.0}, "angular": {"x": -0.3, "z": 0.8}}}),
            Message("/accel", "geometry_msgs/AccelStamped",
                    {"header": {"frame_id": "arm"},
                     "accel": {"linear": {"x": -1.0, "y": 0.5}, "angular": {"z": 0.8}}}),
            Message("/wrench", "geometry_msgs/WrenchStamped",
                    {"header": HEADER, "wrench": {"force": {"x": 0.8, "z": 0.2},
                                                  "torque": {"y": 0.7, "z": 0.5}}}),
        ],
    ),
    "point styles": (
        [
            display("PointCloud2", f"/cloud{number}", Style=style, Color=colour,
                    Color_Transformer="FlatColor", **{"Size (m)": 0.15, "Size (Pixels)": 5})
            for number, (style, colour) in enumerate(
                [("Points", RED), ("Squares", GREEN), ("Flat Squares", YELLOW),
                 ("Spheres", BLUE), ("Boxes", CYAN)]
            )
        ],
        [
            Message(f"/cloud{number}", "sensor_msgs/PointCloud2", cloud(*at))
            for number, at in enumerate([(-3, -2.5), (-1, -2.5), (1, -2.5), (-2, 0), (0.5, 0)])
        ],
    ),
    "point colours": (
        [
            display("PointCloud2", "/cloud0", Color_Transformer="Intensity",
                    Channel_Name="intensity", **{"Size (m)": 0.2}),
            display("PointCloud2", "/cloud1", Color_Transformer="Intensity", Use_rainbow=False,
                    Channel_Name="intensity", Min_Color=BLUE, Max_Color=YELLOW,
                    **{"Size (m)": 0.2}),
            display("PointCloud2", "/cloud2", Color_Transformer="RGB8", **{"Size (m)": 0.2}),
            display("PointCloud2", "/cloud3", Color_Transformer="AxisColor",
                    **{"Size (m)": 0.2}),
            display("PointCloud", "/old", Color_Transformer="FlatColor", Color=GREEN,
                    Style="Boxes", Alpha=0.5, **{"Size (m)": 0.2}),
            display("Temperature", "/temperature", Style="Spheres", **{"Size (m)": 0.4}),
            display("LaserScan", "/scan", Color_Transformer="FlatColor", Color=MAGENTA,
                    Style="Points", **{"Size (Pixels)": 4}),
        ],
        [
            *(
                Message(f"/cloud{number}", "sensor_msgs/PointCloud2",
                        cloud(*at, intensity=np.arange(36, dtype=np.float32)))
                for number, at in ((0, (-3, -2.5)), (1, (-1, -2.5)), (3, (-3, 0)))
            ),
            Message("/cloud2", "sensor_msgs/PointCloud2",
                    cloud(1, -2.5, rgb=(np.arange(36, dtype=np.uint32) * 0x04C1F7 & 0xFFFFFF)
                          .view(np.float32))),
            Message("/old", "sensor_msgs/PointCloud",
                    {"header": HEADER, "points": points((0, -0.5, 0), (0.5, -0.5, 0)),
                     "channels": []}),
            Message("/temperature", "sensor_msgs/Temperature",
                    {"header": {"frame_id": "base"}, "temperature": 40.0}),
            Message("/scan", "sensor_msgs/LaserScan",
                    {"header": HEADER, "angle_min": 0.2, "angle_max": 1.2,
                     "angle_increment": 0.02, "range_min": 0.1, "range_max": 10.0,
                     "ranges": np.full(51, 2.5, np.float32)}),
        ],
    ),
    "efforts": (
        [
            display("Effort", "/joint_states", Scale=2.5, Width=0.08),
            display("Effort", "/few_joint_states"),
        ],
        [
            Message("/joint_states", "sensor_msgs/JointState",
                    {"name": ["turn", "lift", "swing"], "effort": [3.0, 5.0, -25.0]}),
            Message("/few_joint_states", "sensor_msgs/JointState",
                    {"name": ["turn"], "effort": [-2.0]}),
        ],
    ),
    "interactive markers": (
        [
            display("InteractiveMarkers", Update_Topic="/server/update", Show_Descriptions=False,
                    Enable_Transparency=False, Show_Axes=True),
        ],
        INTERACTIVE_MARKERS,
    ),
    "translucent interactive markers": (
        [display("InteractiveMarkers", Update_Topic="/server/update", Show_Descriptions=False)],
        INTERACTIVE_MARKERS,
    ),
    "depth images": (
        [
            display("DepthCloud", Depth_Map_Topic="/camera/depth/image_raw",
                    Color_Image_Topic="/camera/rgb/image_raw"),
            display("DepthCloud", Depth_Map_Topic="/camera/depth/image_raw", Auto_Size=False,
                    Style="Boxes", Color_Transformer="FlatColor", Color=MAGENTA,
                    **{"Size (m)": 0.05}),
        ],
        [
            Message("/camera/depth/camera_info", "sensor_msgs/CameraInfo",
                    {"header": HEADER, "width": 30, "height": 20,
                     "K": [20.0, 0, 15, 0, 20.0, 10, 0, 0, 1],
                     "P": [20.0, 0, 15, 0, 0, 20.0, 10, 0, 0, 0, 1, 0]}),
            Message("/camera/rgb/image_raw", "sensor_msgs/Image",
                    {"header": HEADER, "width": 30, "height": 20, "encoding": "rgb8", "step": 90,
                     "data": bytes([*[255, 0, 0] * 15, *[0, 255, 0] * 15] * 20)}),
            Message("/camera/depth/image_raw", "sensor_msgs/Image",
                    {"header": HEADER, "width": 30, "height": 20, "encoding": "16UC1", "step": 60,
                     "data": (np.arange(600, dtype="<u2") % 30 * 40 + 1000).tobytes()}),
        ],
    ),
    "occlusions": (
        [
            display("DepthCloud", Depth_Map_Topic="/camera/depth/image_raw",
                    Color_Transformer="AxisColor",
                    Occlusion_Compensation={"Value": True, "Occlusion Time-Out": 30.0}),
        ],
        [
            Message("/camera/depth/camera_info", "sensor_msgs/CameraInfo",
                    {"header": HEADER, "width": 30, "height": 20,
                     "K": [20.0, 0, 15, 0, 20.0, 10, 0, 0, 1],
                     "P": [20.0, 0, 15, 0, 0, 20.0, 10, 0, 0, 0, 1, 0]}),
            *(
                Message("/camera/depth/image_raw", "sensor_msgs/Image",
                        {"header": HEADER, "width": 30, "height": 20, "encoding": "16UC1",
                         "step": 60, "data": depths.astype("<u2").tobytes()})
                for depths in OCCLUSIONS
            ),
        ],
    ),
}  # fmt: skip


class Pair:
    """An RViz in a process of its own, a view of ours, and a robot."""

    def __init__(self, wait: QtWaiting, folder: Path, master: RosMaster) -> None:
        from PySide6.QtQuick import QQuickView

        import rosglass
        from rosglass.qml import Session, install

        self.wait, self.folder, self._config = wait, folder, folder / "judge.rviz"
        self.robot = rosglass.connect(master.url, "robot")
        self.robot.parameter_server.set("robot_description", URDF)
        self.session = Session(master.url)
        self.window = QQuickView()
        install(self.window.engine(), self.session)
        self.session.init("view")
        wait(lambda: self.session.node is not None)
        file = folder / "View.qml"
        file.write_text("import RosScene 1.0\nSceneView {}")
        self.window.setResizeMode(QQuickView.ResizeMode.SizeRootObjectToView)
        self.window.resize(*SIZE)
        self.window.setSource(file.as_uri())
        self.view = self.window.rootObject()
        self.window.show()
        self._screen = VirtualScreen(SIZE[0] + 200, SIZE[1] + 200)
        self._log = (folder / "rviz.log").open("w")
        environment = {
            **master.env(),
            "DISPLAY": self._screen.display,
            "QT_QPA_PLATFORM": "xcb",
            "ROSGLASS_QT": "pyside2",
            "XDG_RUNTIME_DIR": str(folder),
        }
        self._rviz = subprocess.Popen(
            [PYTHON, Path(__file__).with_name("rviz_pictures.py"), *map(str, SIZE)],
            env=environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._log,
            text=True,
        )
        self._answer("READY")
        self._publish_frames()

    def _answer(self, expected: str) -> None:
        assert self._rviz.stdout is not None
        for line in self._rviz.stdout:
            if line.strip() == expected:
                return
        raise AssertionError((self.folder / "rviz.log").read_text()[-3000:])

    def _publish_frames(self) -> None:
        from rosglass.tf import StaticTransformBroadcaster, Transform

        self._frames = StaticTransformBroadcaster(self.robot)
        stamp = self.robot.now()
        turn = (0.0, 0.0, math.sin(0.3), math.cos(0.3))
        self._frames.send_transform(
            [
                Transform((-1.0, 0.5, 0.3), turn, stamp, "map", "base"),
                Transform((1.5, 0.5, 0.4), turn, stamp, "base", "arm"),
            ]
        )

    def show(self, displays: list[dict[str, Any]], view: dict[str, Any]) -> None:
        """Have both open a config."""
        config = {
            "Visualization Manager": {
                "Class": "",
                "Displays": displays,
                "Enabled": True,
                "Global Options": {
                    "Background Color": "48; 48; 48",
                    "Fixed Frame": "map",
                    "Frame Rate": 30,
                },
                "Name": "root",
                "Tools": [{"Class": "rviz/MoveCamera"}],
                "Value": True,
                "Views": {"Current": view, "Saved": None},
            }
        }
        self._config.write_text(yaml.safe_dump(config))
        notes = self.view.load_config(self._config)
        assert not notes
        self.theirs(load=True)

    def theirs(self, *, load: bool = False) -> NDArray[np.uint8]:
        """Return RViz's picture."""
        file = self.folder / "rviz.png"
        order = {"config": str(self._config) if load else "", "into": str(file)}
        assert self._rviz.stdin is not None
        self._rviz.stdin.write(json.dumps(order) + "\n")
        self._rviz.stdin.flush()
        self._answer("DONE")
        from PySide6.QtGui import QImage

        return _pixels(QImage(str(file)))

    def ours(self) -> NDArray[np.uint8]:
        """Return our picture."""
        from PySide6.QtCore import QCoreApplication

        QCoreApplication.processEvents()
        return _pixels(self.window.grabWindow())

    def close(self) -> None:
        from rosglass.qt import send_deferred_deletes

        self._rviz.kill()
        self._rviz.wait()
        self._log.close()
        self._screen.close()
        self.window.close()
        self.window.deleteLater()
        send_deferred_deletes()
        self.session.close()
        self.robot.close()


def _pixels(image: Any) -> NDArray[np.uint8]:
    from PySide6.QtGui import QImage

    image = image.convertToFormat(QImage.Format.Format_RGB888)
    rows = np.frombuffer(image.constBits(), np.uint8).reshape(image.height(), -1)
    return rows[:, : image.width() * 3].reshape(image.height(), image.width(), 3).copy()


@pytest.fixture(scope="module")
def pair(app: Any, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Pair]:
    from qt_waiting import QtWaiting

    if not PYTHON.exists() or not Path("/usr/lib/python3/dist-packages/rviz").exists():
        pytest.skip("RViz is not installed, or .venv-system not made: scripts/setup.sh test")
    folder = tmp_path_factory.mktemp("judge")
    with RosMaster(folder) as master:
        made = Pair(QtWaiting(), folder, master)
        yield made
        made.close()


def difference(
    ours: NDArray[np.uint8], theirs: NDArray[np.uint8], *, has_texts: bool = False
) -> dict[str, Any]:
    """Return in what two pictures differ; empty if they don't."""
    found: dict[str, Any] = {}
    # RViz draws its last row and column again and again.
    ours, theirs = ours[4:-4, 4:-4], theirs[4:-4, 4:-4]
    # Texts have another font.
    for name, one, other in (("ours", ours, theirs), ("theirs", theirs, ours)):
        count = int(drawn(one).sum())
        left = int(unmatched(one, other).sum())
        if not count or left / count > (1 if has_texts else 0.01):
            found[f"only {name}"] = f"{left} of {count} pixels"
    mine, its = patches(ours), patches(theirs)
    for hue in sorted(mine.keys() | its.keys()):
        one, two = mine.get(hue), its.get(hue)
        if one is None or two is None:
            found[hue] = f"ours {one}, theirs {two}"
            continue
        wide = max(4, 0.12 * (two.right - two.left)) if has_texts else 4
        if (
            max(abs(one.left - two.left), abs(one.right - two.right)) > wide
            or max(abs(one.top - two.top), abs(one.bottom - two.bottom)) > 4
        ):
            found[hue] = f"\n  ours   {one}\n  theirs {two}"
    return found


@pytest.mark.parametrize("case", CASES)
def test_pictures_are_those_of_rviz(pair: Pair, case: str) -> None:
    displays, messages = CASES[case]
    publishers = [
        pair.robot.create_publisher(one.topic, one.type, QoS.latched()) for one in messages
    ]
    for publisher, one in zip(publishers, messages, strict=True):
        publisher.publish(one.fields)
    try:
        failures = {}
        for name, view in VIEWS.items():
            pair.show(displays, view)
            # All interactive markers are received once.
            lasting = [one for one in publishers if not one.topic.endswith("/update_full")]
            pair.wait(lambda lasting=lasting: all(p.subscription_count() == 2 for p in lasting))
            until = time.monotonic() + TIMEOUT_S
            while True:
                # RViz drops depth images before the first camera info; servers say they are there;
                # efforts fade when they are not sent any more.
                if (
                    case in {"depth images", "efforts", "occlusions"}
                    or messages is INTERACTIVE_MARKERS
                ):
                    for publisher, one in zip(publishers, messages, strict=True):
                        publisher.publish(one.fields)
                ours, theirs = pair.ours(), pair.theirs()
                found = difference(ours, theirs, has_texts=case == "texts")
                if not found or time.monotonic() > until:
                    break
            keep(f"{case} {name}", ours, theirs)
            if found:
                failures[name] = found
        assert not failures, "\n".join(
            f"{view}: {what}: {text}"
            for view, found in failures.items()
            for what, text in found.items()
        )
    finally:
        for publisher in publishers:
            publisher.close()


def keep(name: str, ours: NDArray[np.uint8], theirs: NDArray[np.uint8]) -> None:
    """Save both pictures side by side, where JUDGE_PICTURES names a folder."""
    folder = os.environ.get("JUDGE_PICTURES")
    if folder:
        from PySide6.QtGui import QImage

        both = np.ascontiguousarray(np.concatenate([ours, theirs], axis=1))
        image = QImage(
            both.data, both.shape[1], both.shape[0], both.strides[0], QImage.Format.Format_RGB888
        )
        image.save(str(Path(folder, f"{name}.png")))
