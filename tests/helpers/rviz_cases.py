"""The scenes that the 3D view and RViz both show, for tests/scene/test_against_rviz.py."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from point_clouds import point_cloud2

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
_VIEW = {"Near Clip Distance": 0.01, "Target Frame": "<Fixed Frame>"}
_IN_BASE = {**_VIEW, "Target Frame": "base"}
VIEWS = {
    "Orbit": {
        **_VIEW,
        "Class": "rviz/Orbit",
        "Distance": 8.0,
        "Focal Point": {"X": 0.0, "Y": 0.0, "Z": 0.0},
        "Pitch": 0.7,
        "Yaw": 0.9,
    },
    "TopDownOrtho": {
        **_VIEW,
        "Class": "rviz/TopDownOrtho",
        "Angle": 0.0,
        "Scale": 70.0,
        "X": 0.0,
        "Y": 0.0,
    },
    "Orbit of a frame": {
        **_IN_BASE,
        "Class": "rviz/Orbit",
        "Distance": 7.0,
        "Field of View": 1.1,
        "Focal Point": {"X": 0.5, "Y": -0.3, "Z": 0.2},
        "Invert Z Axis": True,
        "Pitch": 0.5,
        "Yaw": 2.0,
    },
    "XYOrbit": {
        **_IN_BASE,
        "Class": "rviz/XYOrbit",
        "Distance": 6.0,
        "Focal Point": {"X": 0.5, "Y": 0.5, "Z": 0.0},
        "Pitch": 0.6,
        "Yaw": 4.0,
    },
    "ThirdPersonFollower": {
        **_IN_BASE,
        "Class": "rviz/ThirdPersonFollower",
        "Distance": 7.0,
        "Focal Point": {"X": 0.3, "Y": -0.4, "Z": 0.0},
        "Pitch": 0.5,
        "Yaw": 3.0,
    },
    "FPS": {
        **_IN_BASE,
        "Class": "rviz/FPS",
        "Pitch": 0.5,
        "Position": {"X": -4.0, "Y": -3.0, "Z": 3.0},
        "Roll": 0.2,
        "Yaw": 0.6,
    },
    "FrameAligned": {
        **_IN_BASE,
        "Class": "rviz/FrameAligned",
        "Pitch": 0.7,
        "Point towards": "arbitrary",
        "Position": {"X": -4.0, "Y": 0.0, "Z": 3.0},
        "Roll": 0.0,
        "Yaw": 0.1,
    },
    # Along x, as the camera: RViz's light comes from the view's side.
    "Orbit along x": {
        **_VIEW,
        "Class": "rviz/Orbit",
        "Distance": 4.0,
        "Focal Point": {"X": 0.0, "Y": 0.0, "Z": 1.5},
        "Pitch": 0.0,
        "Yaw": math.pi,
    },
    "TopDownOrtho of a frame": {
        **_IN_BASE,
        "Class": "rviz/TopDownOrtho",
        "Angle": 0.5,
        "Scale": 60.0,
        "X": 0.7,
        "Y": -0.4,
    },
}


class Message(NamedTuple):
    """A message, or several, that a topic publishes."""

    topic: str
    type: str
    fields: dict[str, Any]


@dataclass(frozen=True)
class Case:
    """Displays of a config, and the data that they show.

    Attributes:
        displays: As in a config.
        messages: What topics publish.
        views: Names of VIEWS.
        has_texts: Whether texts are drawn, which have another font in RViz.
        repeats: Whether messages are sent again until the images agree: RViz drops depth images
            before the first camera info, servers of markers say they are there, and images and
            efforts fade when they are not sent any more.
        panel: Name of the display whose panel is compared instead of the view.
        parameters: Of the parameter server.
    """

    displays: list[dict[str, Any]]
    messages: list[Message] = field(default_factory=list)
    views: tuple[str, ...] = ("Orbit", "TopDownOrtho")
    has_texts: bool = False
    repeats: bool = False
    panel: str = ""
    parameters: dict[str, str] = field(default_factory=dict)


#: Keys of topics in configs that are not "Topic".
_TOPIC_KEYS = {
    **dict.fromkeys(("Marker", "MarkerArray"), "Marker Topic"),
    **dict.fromkeys(("Camera", "Image"), "Image Topic"),
}


def display(kind: str, topic: str = "", **settings: Any) -> dict[str, Any]:
    """Return a display of a config; underscores stand for spaces."""
    found = {
        "Class": f"rviz/{kind}",
        "Name": f"{kind} {topic}".strip(),
        "Enabled": True,
        "Value": True,
    }
    if topic:
        found[_TOPIC_KEYS.get(kind, "Topic")] = topic
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


def repeated(topic: str, type: str, *fields: dict[str, Any]) -> list[Message]:
    """Return several messages of one topic."""
    return [Message(topic, type, one) for one in fields]


def covariance(*variances: float) -> Any:
    return np.diag(variances).reshape(-1)


#: The joints of the frames that are published.
JOINTS = """<robot name="judge">
  <link name="map"/><link name="base"/><link name="arm"/><link name="rail"/>
  <joint name="turn" type="revolute"><parent link="map"/><child link="base"/>
    <axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="10" velocity="1"/></joint>
  <joint name="swing" type="revolute"><parent link="base"/><child link="arm"/>
    <axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="20" velocity="1"/></joint>
  <joint name="lift" type="prismatic"><parent link="base"/><child link="rail"/>
    <limit lower="0" upper="1" effort="100" velocity="1"/></joint>
</robot>"""
MESHES = Path(__file__).parents[1] / "scene" / "meshes"
#: A robot in a strip of 8 m along x, of links of their own where one material is that of all.
ROBOT = """<robot name="rover">
  <material name="blue"><color rgba="0.1 0.1 1 1"/></material>
  <material name="green"><color rgba="0 0.8 0 0.6"/></material>
  <material name="cyan"><color rgba="0 0.9 0.9 1"/></material>
  <material name="magenta"><color rgba="1 0 1 1"/></material>
  <material name="checker"><texture filename="file://MESHES/checker.png"/></material>
  <link name="chassis">
    <visual><origin xyz="-3.5 0 0.2" rpy="0 0 0.4"/>
      <geometry><box size="0.8 0.6 0.4"/></geometry><material name="blue"/></visual>
    <visual><origin xyz="-2.6 0 0.3"/><geometry><sphere radius="0.4"/></geometry>
      <material name="green"/></visual>
    <visual><origin xyz="-1.7 0 0.3" rpy="0.5 0.4 0"/>
      <geometry><cylinder radius="0.25" length="0.8"/></geometry><material name="cyan"/></visual>
    <collision><origin xyz="-3.5 0 0.2"/><geometry><box size="0.9 0.7 0.5"/></geometry></collision>
    <collision><origin xyz="-2.2 0 0.2"/><geometry><sphere radius="0.5"/></geometry></collision>
  </link>
  <link name="plain">
    <visual><origin xyz="-0.8 -0.4 0"/><geometry><box size="0.5 0.5 0.5"/></geometry></visual>
    <visual><origin xyz="-0.8 0.4 0"/><geometry>
      <mesh filename="file://MESHES/wedge.stl" scale="0.6 0.6 0.6"/></geometry></visual>
    <collision><origin xyz="-0.8 0 0"/><geometry><cylinder radius="0.4" length="0.3"/></geometry>
      </collision>
  </link>
  <link name="files">
    <visual><origin xyz="0.2 -0.4 0"/><geometry>
      <mesh filename="file://MESHES/wedge.stl" scale="0.6 0.6 0.6"/></geometry>
      <material name="magenta"/></visual>
    <visual><origin xyz="0.2 0.4 0"/><geometry>
      <mesh filename="file://MESHES/materials.dae" scale="0.6 0.6 0.6"/></geometry></visual>
    <visual><origin xyz="1.1 -0.4 0"/><geometry>
      <mesh filename="file://MESHES/plain.dae" scale="0.6 0.6 0.6"/></geometry>
      <material name="cyan"/></visual>
    <visual><origin xyz="1.1 0.4 0"/><geometry>
      <mesh filename="file://MESHES/textured.dae" scale="0.6 0.6 0.6"/></geometry></visual>
    <visual><origin xyz="1.6 0 0"/><geometry>
      <mesh filename="file://MESHES/glass.dae" scale="0.4 -0.4 0.4"/></geometry></visual>
    <collision><origin xyz="0.2 0 0"/><geometry>
      <mesh filename="file://MESHES/materials.dae"/></geometry></collision>
    <collision><origin xyz="1.1 0 0"/><geometry>
      <mesh filename="file://MESHES/wedge.stl"/></geometry></collision>
  </link>
  <link name="textures">
    <visual><origin xyz="2.2 -0.4 0.2" rpy="0 0 0.3"/>
      <geometry><box size="0.5 0.6 0.4"/></geometry><material name="checker"/></visual>
    <visual><origin xyz="2.2 0.4 0.2"/><geometry><sphere radius="0.35"/></geometry>
      <material name="checker"/></visual>
    <visual><origin xyz="3.7 0 0.2"/><geometry><cylinder radius="0.3" length="0.6"/></geometry>
      <material name="checker"/></visual>
    <visual><origin xyz="3 -0.4 0"/><geometry>
      <mesh filename="file://MESHES/plain.dae" scale="0.6 0.6 0.6"/></geometry>
      <material name="checker"/></visual>
    <visual><origin xyz="3 0.4 0"/><geometry>
      <mesh filename="file://MESHES/wedge.obj" scale="0.6 0.6 0.6"/></geometry></visual>
  </link>
  JOINTS
</robot>"""
LINKS = ("chassis", "plain", "files", "textures")
ROBOT = ROBOT.replace("MESHES", str(MESHES)).replace(
    "JOINTS",
    "".join(
        f'<joint name="to_{link}" type="fixed">'
        f'<parent link="chassis"/><child link="{link}"/></joint>'
        for link in LINKS[1:]
    ),
)
#: Positions along y of the robots of these prefixes.
ROBOTS = {"": -2.0, "second/": 0.0, "third/": 2.0}
#: Settings of a TF display: robots and cameras are not shown.
FRAMES = {f"{prefix}{link}": {"Value": False} for prefix in ROBOTS for link in LINKS}
FRAMES["camera"] = {"Value": False}
#: The message of a camera at (-4, 0, 1.5) of the map, that looks along x and a little down.
CAMERA_INFO = {
    "header": {"frame_id": "camera"}, "width": 160, "height": 120,
    "K": [140.0, 0, 75, 0, 140.0, 62, 0, 0, 1], "R": [1.0, 0, 0, 0, 1, 0, 0, 0, 1],
    "P": [140.0, 0, 75, 0, 0, 140.0, 62, 0, 0, 0, 1, 0], "distortion_model": "plumb_bob",
}  # fmt: skip


def picture(encoding: str = "rgb8") -> dict[str, Any]:
    """Return an image of 160 x 120 pixels: a blue half and a green one, with a white bar."""
    pixels = np.zeros((120, 160, 3), np.uint8)
    pixels[:, :80], pixels[:, 80:] = (40, 40, 160), (40, 140, 40)
    pixels[20:30, 20:140] = 255
    rows: Any = pixels
    if encoding == "32FC1":
        rows = np.tile(np.linspace(1, 5, 160, dtype="<f4"), (120, 1))
    return {
        "header": {"frame_id": "camera"}, "width": 160, "height": 120, "encoding": encoding,
        "step": rows[0].nbytes, "data": np.ascontiguousarray(rows).tobytes(),
    }  # fmt: skip


def resource(number: int, file: str, at: Any, embedded: bool, colour: str | None = None) -> Any:
    """Return a marker of a mesh file."""
    found = {"mesh_resource": f"file://{MESHES / file}", "mesh_use_embedded_materials": embedded}
    if colour is None:
        found["color"] = {}
    return marker(number, 10, colour or "white", at, (1, 1, 1), **found)


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
CASES: dict[str, Case] = {
    "grids and axes": Case(
        [
            display("Grid"),
            display("Grid", Plane="XZ", Color=YELLOW, Alpha=1.0, Plane_Cell_Count=4,
                    Normal_Cell_Count=1, Cell_Size=0.5,
                    Line_Style={"Value": "Billboards", "Line Width": 0.05},
                    Offset={"X": 0.0, "Y": 2.0, "Z": 1.0}),
            display("Axes", Length=1.5, Radius=0.1),
        ],
    ),
    "frames": Case(
        [display("TF", Show_Names=False, Marker_Scale=3.0, Frames=FRAMES)],
    ),
    "paths": Case(
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
    "maps": Case(
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
    "marker shapes": Case(
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
    "marker lists": Case(
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
    "texts": Case(
        [
            display("TF", Show_Axes=False, Show_Arrows=False, Marker_Scale=2.0, Frames=FRAMES),
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
        has_texts=True,
    ),
    "translucent markers": Case(
        [display("Grid"), display("Marker", "/glass"), display("Marker", "/solid")],
        [
            Message("/solid", "visualization_msgs/Marker",
                    marker(0, 1, "green", pose(0, 0, 0), (1, 1, 1))),
            Message("/glass", "visualization_msgs/Marker",
                    marker(0, 1, "red", pose(0.5, 0.5, 0.5), (2, 2, 2),
                           color={"r": 1.0, "a": 0.4})),
        ],
    ),
    "poses": Case(
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
    "covariances": Case(
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
    "geometry": Case(
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
    "point styles": Case(
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
    "point colours": Case(
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
    "efforts": Case(
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
        parameters={"/robot_description": JOINTS}, repeats=True,
    ),
    "interactive markers": Case(
        [
            display("InteractiveMarkers", Update_Topic="/server/update", Show_Descriptions=False,
                    Enable_Transparency=False, Show_Axes=True),
        ],
        INTERACTIVE_MARKERS,
        repeats=True,
    ),
    "translucent interactive markers": Case(
        [display("InteractiveMarkers", Update_Topic="/server/update", Show_Descriptions=False)],
        INTERACTIVE_MARKERS,
        repeats=True,
    ),
    "depth images": Case(
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
        repeats=True,
    ),
    "occlusions": Case(
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
        repeats=True,
    ),
    "measured values": Case(
        [
            display("RelativeHumidity", "/humidity", Style="Spheres", **{"Size (m)": 0.5}),
            display("Illuminance", "/illuminance", Style="Boxes", **{"Size (m)": 0.5}),
            display("FluidPressure", "/pressure", **{"Size (m)": 0.5}),
            display("Temperature", "/temperature", Style="Squares", Use_rainbow=False,
                    Min_Color=BLUE, Max_Color=YELLOW, **{"Size (m)": 0.5}),
        ],
        [
            Message("/humidity", "sensor_msgs/RelativeHumidity",
                    {"header": {"frame_id": "base"}, "relative_humidity": 0.3}),
            Message("/illuminance", "sensor_msgs/Illuminance",
                    {"header": {"frame_id": "arm"}, "illuminance": 480.0}),
            Message("/pressure", "sensor_msgs/FluidPressure",
                    {"header": HEADER, "fluid_pressure": 100_000.0}),
            Message("/temperature", "sensor_msgs/Temperature",
                    {"header": {"frame_id": "third/plain"}, "temperature": 80.0}),
        ],
    ),
    "colour transformers": Case(
        [
            display("PointCloud2", "/cloud0", Color_Transformer="RGBF32", **{"Size (m)": 0.2}),
            display("PointCloud2", "/cloud1", Color_Transformer="MONO8", **{"Size (m)": 0.2}),
            display("PointCloud2", "/cloud2", Color_Transformer="Intensity", Style="Spheres",
                    Channel_Name="heat", Autocompute_Intensity_Bounds=False, Min_Intensity=5,
                    Max_Intensity=30, Invert_Rainbow=True, **{"Size (m)": 0.2}),
            display("PointCloud2", "/cloud3", Color_Transformer="AxisColor", Axis="X",
                    Use_Fixed_Frame=False, Style="Boxes", Alpha=0.6,
                    Autocompute_Value_Bounds={"Value": False, "Min Value": 0.2, "Max Value": 1.2},
                    **{"Size (m)": 0.2}),
            display("PointCloud2", "/cloud4", Position_Transformer="XYZ", **{"Size (m)": 0.2}),
            display("PointCloud", "/old", Color_Transformer="Intensity", Channel_Name="heat",
                    Use_rainbow=False, Min_Color=GREEN, Max_Color=MAGENTA, Style="Squares",
                    **{"Size (m)": 0.3}),
            display("LaserScan", "/scan", **{"Size (m)": 0.1}),
        ],
        [
            Message("/cloud0", "sensor_msgs/PointCloud2",
                    cloud(-3.5, -2.5, r=np.linspace(0, 1, 36, dtype=np.float32),
                          g=np.linspace(1, 0, 36, dtype=np.float32),
                          b=np.full(36, 0.2, np.float32))),
            Message("/cloud1", "sensor_msgs/PointCloud2",
                    cloud(-1.5, -2.5, rgb=(np.arange(36, dtype=np.uint32) * 7 << 16)
                          .view(np.float32))),
            Message("/cloud2", "sensor_msgs/PointCloud2",
                    cloud(0.5, -2.5, heat=np.arange(36, dtype=np.uint16))),
            Message("/cloud3", "sensor_msgs/PointCloud2",
                    {**cloud(0, 0), "header": {"frame_id": "base"}}),
            Message("/cloud4", "sensor_msgs/PointCloud2",
                    cloud(1.5, 0.2, rgba=0x80000000 + np.arange(36, dtype=np.uint32) * 0x010700)),
            Message("/old", "sensor_msgs/PointCloud",
                    {"header": HEADER, "points": points((-3, 0, 0), (-2.5, 0, 0), (-2, 0, 0)),
                     "channels": [{"name": "heat", "values": [1.0, 2.0, 3.0]}]}),
            Message("/scan", "sensor_msgs/LaserScan",
                    {"header": {"frame_id": "arm"}, "angle_min": -1.0, "angle_max": 1.0,
                     "angle_increment": 0.04, "range_min": 0.1, "range_max": 10.0,
                     "ranges": np.full(51, 1.5, np.float32),
                     "intensities": (np.arange(51) // 13).astype(np.float32)}),
        ],
    ),
    "robots": Case(
        [
            display("RobotModel", Robot_Description="rover"),
            display("RobotModel", Robot_Description="rover", Visual_Enabled=False,
                    Collision_Enabled=True, TF_Prefix="second"),
            display("RobotModel", Robot_Description="rover", Alpha=0.5, TF_Prefix="third",
                    Links={"All Links Enabled": True, "plain": {"Value": False}}),
        ],
        parameters={"/rover": ROBOT},
    ),
    "frames that are all hidden but one": Case(
        [
            display("TF", Show_Names=False, Marker_Scale=3.0,
                    Frames={"All Enabled": False, "base": {"Value": True}}),
        ],
    ),
    "settings of links": Case(
        [
            display("RobotModel", Robot_Description="rover",
                    Links={"All Links Enabled": True, "chassis": {"Value": True, "Alpha": 0.4},
                           "plain": {"Value": False}}),
            display("RobotModel", Robot_Description="rover", TF_Prefix="second",
                    Links={"All Links Enabled": False, "plain": {"Value": True}}),
        ],
        parameters={"/rover": ROBOT},
    ),
    "axes of links": Case(
        [
            display("RobotModel", Robot_Description="rover", TF_Prefix="second",
                    Links={"All Links Enabled": False,
                           "plain": {"Value": True, "Alpha": 0.0, "Show Axes": True}}),
        ],
        # From above they are too small to be compared.
        parameters={"/rover": ROBOT}, views=("Orbit",),
    ),
    "namespaces": Case(
        [
            display("MarkerArray", "/namespaces", Namespaces={"away": False, "here": True}),
        ],
        [
            Message("/namespaces", "visualization_msgs/MarkerArray", {"markers": [
                marker(0, 1, "red", pose(-1.5, -1, 0, 0.4), (1, 0.7, 0.5), ns="away"),
                marker(0, 3, "green", pose(1, -1, 0.5), (0.4, 0.4, 1), ns="here"),
                marker(0, 1, "yellow", pose(1.5, 1), (0.3, 1, 0.3), ns="new")]}),
        ],
    ),
    "mesh markers": Case(
        [display("MarkerArray", "/meshes")],
        [
            Message(
                "/meshes", "visualization_msgs/MarkerArray",
                {
                    "markers": [
                        resource(0, "materials.dae", pose(-3.3, -2, 0, 0.4), True),
                        resource(1, "materials.dae", pose(-1.9, -2), False, "blue"),
                        resource(2, "plain.dae", pose(-0.5, -2, 0, 0.4), True),
                        resource(3, "plain.dae", pose(0.9, -2), True, "yellow"),
                        resource(4, "textured.dae", pose(2.3, -2, 0, 0.4), True),
                        resource(5, "textured.dae", pose(-3.3, 0.3), False, "cyan"),
                        resource(6, "wedge.stl", pose(-1.9, 0.3), False, "magenta"),
                        resource(7, "wedge.stl", pose(-0.5, 0.3, 0, 0.4), True),
                        resource(8, "wedge.obj", pose(0.9, 0.3, 0, 0.4), True),
                        resource(9, "glass.dae", pose(2.3, 0.3), True),
                        {**resource(10, "wedge.stl", pose(-1.2, 2), False),
                         "color": {"g": 1.0, "a": 0.5}},
                        {**resource(11, "materials.dae", pose(0.2, 2), True),
                         "color": {"r": 1.0, "g": 1.0, "b": 1.0, "a": 0.5}},
                        {**resource(12, "textured.dae", pose(1.6, 2, 0, 0.4), True, "blue"),
                         "scale": {"x": 1, "y": -1, "z": 1}},
                    ]
                },
            )
        ],
    ),
    "markers of many colours": Case(
        [display("MarkerArray", "/coloured")],
        [
            Message(
                "/coloured", "visualization_msgs/MarkerArray",
                {
                    "markers": [
                        marker(n, kind, "white", pose(*at), scale,
                               points=points((0, 0, 0), (0.9, 0, 0.2), (0, 0.9, 0), (0.9, 0.9, 0.4),
                                             (0.3, 0.5, 0.8), (0.6, 0.2, 0.6)),
                               colors=[RGBA[name] for name in
                                       ("red", "green", "blue", "cyan", "magenta", "yellow")])
                        for n, (kind, scale, at) in enumerate([
                            (4, (0.08, 0, 0), (-3.4, -2)), (5, (0.08, 0, 0), (-2, -2)),
                            (6, (0.3, 0.2, 0.2), (-0.5, -2)), (7, (0.3, 0.3, 0.3), (1, -2)),
                            (8, (0.2, 0.2, 0), (2.4, -2)), (11, (1, 1, 1), (-3.4, 0.3)),
                        ])
                    ] + [
                        marker(6, 11, "white", pose(-1.7, 0.3), (1, 1, 1),
                               points=points((0, 0, 0), (0.9, 0, 0.2), (0, 0.9, 0), (0.9, 0.9, 0.4),
                                             (0.3, 0.5, 0.8), (0.6, 0.2, 0.6)),
                               colors=[RGBA["red"], RGBA["cyan"]]),
                        marker(7, 11, "green", pose(0, 0.3), (1, 1, 1),
                               color={"g": 1.0, "a": 0.5},
                               points=points((0, 0, 0), (1, 0, 0), (0, 1, 0.5))),
                        marker(8, 6, "blue", pose(1.5, 0.3), (0.4, 0.4, 0.4),
                               color={"b": 1.0, "a": 0.5},
                               points=points((0, 0, 0), (0.5, 0, 0), (1, 0.3, 0.3))),
                        marker(9, 2, "red", pose(-3, 2, 0, 0.4), (1, 0.5, 0.5),
                               color={"r": 1.0, "a": 0.5}),
                        marker(10, 0, "cyan", pose(-1.5, 2, 0, 0.4), (1, 0.2, 0.2),
                               color={"g": 1.0, "b": 1.0, "a": 0.5}),
                        marker(11, 4, "yellow", pose(0, 2), (0.2, 0, 0),
                               color={"r": 1.0, "g": 1.0, "a": 0.5},
                               points=points((0, 0, 0), (1, 0, 0), (1, 0.6, 0))),
                        marker(12, 1, "magenta", pose(0.5, 0), (0.4, 0.4, 0.4),
                               header={"frame_id": "arm"}, frame_locked=True),
                        *(
                            marker(n, kind, "white", pose(*at), (size, size, size),
                                   points=points((0, 0, 0), (0.7, 0, 0.2), (0, 0.7, 0)),
                                   colors=[{**RGBA[name], "a": 0.5}
                                           for name in ("red", "green", "blue")])
                            for n, (kind, size, at) in enumerate(
                                [(7, 0.4, (2.8, 0.3)), (8, 0.3, (1.2, 2)), (11, 1, (2.6, 2)),
                                 (4, 0.15, (-2.6, 1.2)), (6, 0.3, (-4.3, 0.6))], 13)
                        ),
                        *(
                            marker(n, 11, "white", pose(*at), (1, 1, 1),
                                   points=points((0, 0, 0), (0.7, 0, 0.2), (0, 0.7, 0)),
                                   color={"a": 0.5},
                                   colors=[{**RGBA[name], "a": alpha} for name in names])
                            for n, (alpha, names, at) in enumerate(
                                [(0.5, ("red", "green", "blue"), (1, 1.2)),
                                 (1, ("cyan", "yellow", "magenta"), (2, 1.2)),
                                 (1, ("green",), (3, 1.2))], 18)
                        ),
                    ]
                },
            )
        ],
    ),
    "covariances of all kinds": Case(
        [
            display("PoseWithCovariance", "/covariance", Color=RED, Shape="Axes", Axes_Length=0.7,
                    Covariance={"Value": True, "Position": {"Value": False}, "Orientation": {
                        "Value": True, "Frame": "Fixed", "Color Style": "RGB", "Offset": 0.8}}),
            display("PoseWithCovariance", "/covariance2", Color=CYAN, Alpha=0.5, Head_Length=0.2,
                    Head_Radius=0.2, Shaft_Length=0.6, Shaft_Radius=0.1,
                    Covariance={"Value": True, "Position": {"Value": True, "Color": GREEN,
                                "Alpha": 0.6, "Scale": 2.0}, "Orientation": {"Value": False}}),
            display("Odometry", "/odometry", Keep=3, Covariance={"Value": False}, Shape={
                "Value": "Axes", "Axes Length": 0.6, "Axes Radius": 0.06}),
            display("Pose", "/pose", Color=MAGENTA, Alpha=0.5, Shaft_Length=0.5, Head_Length=0.4,
                    Shaft_Radius=0.1, Head_Radius=0.25),
        ],
        [
            Message("/covariance", "geometry_msgs/PoseWithCovarianceStamped",
                    {"header": {"frame_id": "base"}, "pose": {
                        "pose": pose(-1, -2, 0, 0.5, 0.3),
                        "covariance": covariance(0.3, 0.1, 0.2, 0.04, 0.02, 0.1)}}),
            Message("/covariance2", "geometry_msgs/PoseWithCovarianceStamped",
                    {"header": {"frame_id": "base"}, "pose": {
                        "pose": pose(1.5, -2, 0, 0.5),
                        "covariance": covariance(0.1, 0.02, 0.05, 0.04, 0.04, 0.1)}}),
            *repeated("/odometry", "nav_msgs/Odometry", *(
                {"header": HEADER, "pose": {"pose": pose(x, 1.8, 0, yaw)}}
                for x, yaw in ((-2, 0.0), (-1, 0.4), (0, 0.8)))),
            Message("/pose", "geometry_msgs/PoseStamped",
                    {"header": {"frame_id": "arm"}, "pose": pose(0.5, 0.5, 0, 0.5, 0.2)}),
        ],
        repeats=True,
    ),
    "covariances without limits": Case(
        [
            display("PoseWithCovariance", "/flat", Color=RED, Alpha=0.5),
            display("PoseWithCovariance", "/whole", Color=CYAN, Alpha=0.5,
                    Covariance={"Value": True, "Position": {"Value": True, "Color": GREEN},
                                "Orientation": {"Value": True, "Color": MAGENTA, "Offset": 0.5,
                                                "Scale": 0.8}}),
        ],
        [
            Message("/flat", "geometry_msgs/PoseWithCovarianceStamped",
                    {"header": HEADER, "pose": {
                        "pose": pose(-1, -1.5), "covariance": covariance(0.2, 0.1, 0, 0, 0, 1e6)}}),
            Message("/whole", "geometry_msgs/PoseWithCovarianceStamped",
                    {"header": HEADER, "pose": {
                        "pose": pose(0.5, 1.5, 0, 0.5),
                        "covariance": covariance(0.3, 0.1, 0.2, 0.05, 0.05, 1e6)}}),
        ],
    ),
    "translucent displays": Case(
        [
            display("Axes", Length=0.8, Radius=0.1, Alpha=0.5, Reference_Frame="base"),
            # RViz 1.14 draws polygons and paths opaque, whatever their Alpha is.
            display("Polygon", "/polygon", Color=YELLOW),
            display("Path", "/path", Color=GREEN, Line_Style="Billboards",
                    Line_Width=0.15, Offset={"X": 0.0, "Y": 0.5, "Z": 0.2}, Pose_Style="Arrows",
                    Pose_Color=CYAN),
            display("GridCells", "/cells", Color=MAGENTA, Alpha=0.5),
            display("PoseArray", "/poses", Color=RED, Alpha=0.5, Shape="Arrow (3D)",
                    Shaft_Length=0.6, Shaft_Radius=0.1, Head_Length=0.3, Head_Radius=0.2),
            display("PointCloud2", "/cloud", Color_Transformer="FlatColor", Color=BLUE, Alpha=0.5,
                    Style="Spheres", **{"Size (m)": 0.3}),
            display("Grid", Alpha=0.3, Reference_Frame="arm", Plane="YZ", Plane_Cell_Count=4,
                    Cell_Size=0.4, Color=GREEN),
        ],
        [
            Message("/polygon", "geometry_msgs/PolygonStamped",
                    {"header": HEADER, "polygon": {
                        "points": points((0.5, -2.5, 0), (2.5, -2.5, 0), (2, -1, 0.5))}}),
            Message("/path", "nav_msgs/Path",
                    {"header": HEADER, "poses": [
                        {"header": HEADER, "pose": pose(x, y, 0, 0.7)}
                        for x, y in ((-3.5, -2.5), (-2.5, -2.0), (-1.5, -2.5), (-0.5, -2.3))]}),
            Message("/cells", "nav_msgs/GridCells",
                    {"header": HEADER, "cell_width": 0.4, "cell_height": 0.2,
                     "cells": points((1, 0.6, 0), (1.5, 0.6, 0), (2, 0.9, 0), (2.5, 0.7, 0.3))}),
            Message("/poses", "geometry_msgs/PoseArray",
                    {"header": HEADER, "poses": [pose(2.5, 1.5, 0, 1.0), pose(1, 1.5, 0, 0, 0.6)]}),
            Message("/cloud", "sensor_msgs/PointCloud2", cloud(-3.4, 0.8)),
        ],
    ),
    "histories": Case(
        [
            display("Range", "/range", Color=CYAN, Buffer_Length=2),
            display("PointStamped", "/point", Color=GREEN, Radius=0.3, Alpha=0.5, History_Length=2),
            display("WrenchStamped", "/wrench", Force_Color=RED, Torque_Color=BLUE, Alpha=0.5,
                    History_Length=2, Arrow_Width=0.8),
            display("TwistStamped", "/twist", Linear_Color=MAGENTA, Linear_Arrow_Scale=0.5,
                    Angular_Arrow_Scale=0.5),
            display("Path", "/path", Color=YELLOW, Buffer_Length=2),
        ],
        [
            *repeated("/range", "sensor_msgs/Range", *(
                {"header": {"frame_id": frame}, "field_of_view": 0.5, "min_range": 0.1,
                 "max_range": 4.0, "range": far} for frame, far in (("arm", 1.5), ("base", 0.8)))),
            *repeated("/point", "geometry_msgs/PointStamped", *(
                {"header": HEADER, "point": {"x": x, "y": -1.5}} for x in (-2.0, -2.3))),
            *repeated("/wrench", "geometry_msgs/WrenchStamped", *(
                {"header": HEADER, "wrench": {"force": {"x": 0.8, "z": z},
                                              "torque": {"y": -0.7, "z": 0.5}}}
                for z in (0.2, 0.7))),
            Message("/twist", "geometry_msgs/TwistStamped",
                    {"header": {"frame_id": "base"},
                     "twist": {"linear": {"x": 0.9}, "angular": {"y": 2.0}}}),
            *repeated("/path", "nav_msgs/Path", *(
                {"header": HEADER, "poses": [
                    {"header": HEADER, "pose": pose(x, y)} for x in (0.5, 2.5)]}
                for y in (-2.0, -1.5))),
        ],
        repeats=True,
    ),
    "map updates": Case(
        [
            display("Map", "/map", Alpha=0.7),
            display("Map", "/below", Alpha=1.0, Draw_Behind=True, Color_Scheme="costmap"),
            display("Grid", Plane_Cell_Count=4),
        ],
        [
            Message("/map", "nav_msgs/OccupancyGrid", occupancy(-1.5, -1.0)),
            Message("/map_updates", "map_msgs/OccupancyGridUpdate",
                    {"header": HEADER, "x": 3, "y": 4, "width": 10, "height": 8,
                     "data": np.full(80, 100, np.int8)}),
            Message("/below", "nav_msgs/OccupancyGrid",
                    {"header": {"frame_id": "base"},
                     "info": {"resolution": 0.5, "width": 8, "height": 5,
                              "origin": pose(0, 0, 0.5)},
                     "data": np.arange(40, dtype=np.int8) * 2}),
        ],
        repeats=True,
    ),
    "controls that the user draws": Case(
        [
            display("InteractiveMarkers", Update_Topic="/server/update", Show_Descriptions=True,
                    Show_Axes=False),
        ],
        [
            Message(
                "/server/update_full", "visualization_msgs/InteractiveMarkerInit",
                {
                    "server_id": "judge", "seq_num": 1,
                    "markers": [
                        {**controlled(f"mode {mode}", pose(x, y, 0, 0.4),
                                      {"interaction_mode": mode, "markers": [
                                          marker(0, kind, colour, pose(0.1, 0), (0.5, 0.3, 0.4),
                                                 header={})]}),
                         "description": f"mode {mode}" if mode == 7 else ""}
                        for mode, kind, colour, x, y in (
                            (0, 1, "red", -2.5, -1.5), (1, 2, "green", -1, -1.5),
                            (2, 3, "blue", 0.5, -1.5), (7, 1, "yellow", 2, -1.5),
                            (8, 2, "cyan", -1.5, 1), (9, 0, "magenta", 0.5, 1))
                    ],
                },
            ),
            Message("/server/update", "visualization_msgs/InteractiveMarkerUpdate",
                    {"server_id": "judge", "seq_num": 1}),
        ],
        repeats=True, has_texts=True,
    ),
    "images": Case(
        [display("Image", "/camera/rgb/image_raw")],
        [Message("/camera/rgb/image_raw", "sensor_msgs/Image", picture())],
        views=("Orbit",), repeats=True, panel="Image /camera/rgb/image_raw",
    ),
    "images of depths": Case(
        [display("Image", "/camera/depth/image_raw")],
        [Message("/camera/depth/image_raw", "sensor_msgs/Image", picture("32FC1"))],
        views=("Orbit",), repeats=True, panel="Image /camera/depth/image_raw",
    ),
    "cameras": Case(
        [
            display("Camera", "/camera/rgb/image_raw", Overlay_Alpha=0.4, Zoom_Factor=0.8,
                    Visibility={"Value": True, "Grid": False, "Axes": True}),
            display("Grid", Color=YELLOW, Alpha=1.0),
            display("Axes"),
            display("MarkerArray", "/boxes"),
        ],
        [
            Message("/camera/rgb/camera_info", "sensor_msgs/CameraInfo", CAMERA_INFO),
            Message("/camera/rgb/image_raw", "sensor_msgs/Image", picture()),
            Message("/boxes", "visualization_msgs/MarkerArray", {"markers": [
                marker(0, 1, "red", pose(0, -1, 0, 0.4), (1, 0.7, 0.5)),
                marker(1, 2, "magenta", pose(0, 1), (0.8, 0.8, 0.8))]}),
        ],
        views=("Orbit along x",), repeats=True, panel="Camera /camera/rgb/image_raw",
    ),
    "views": Case(
        [
            display("Grid", Alpha=1.0),
            display("MarkerArray", "/boxes"),
            display("PointStamped", "/point", Color=CYAN, Radius=0.3),
        ],
        [
            Message("/boxes", "visualization_msgs/MarkerArray", {"markers": [
                marker(0, 1, "red", pose(-1.5, -1, 0, 0.4), (1, 0.7, 0.5)),
                marker(1, 3, "green", pose(1, -1, 0.5), (0.4, 0.4, 1)),
                marker(2, 0, "magenta", pose(-1, 1.2, 0, 0.7), (1, 0.2, 0.2)),
                marker(3, 1, "yellow", pose(1.5, 1), (0.3, 1, 0.3))]}),
            Message("/point", "geometry_msgs/PointStamped",
                    {"header": {"frame_id": "base"}, "point": {"x": 1.0}}),
        ],
        views=("Orbit of a frame", "XYOrbit", "ThirdPersonFollower", "FPS", "FrameAligned",
               "TopDownOrtho of a frame"),
    ),
}  # fmt: skip
