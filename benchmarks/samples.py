"""The eleven sample messages of the codec benchmark, and accessors generated for each library.

Sizes are those of the figures that we compare with: a 1920x1080 image, a cloud of 65,536
points, 30 joints, 50 transforms, 100 markers of 10 points, a 1000x1000 map, 1000 poses, 20 times
10 diagnostic values, a scan of 1080 rays.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

if TYPE_CHECKING:
    from collections.abc import Callable

Value = dict[str, Any]


@dataclass(frozen=True)
class Sample:
    """A sample message.

    Attributes:
        name: Short name, e.g. ``Image``.
        type: Full type name.
        leaf: Path of the one field that the single-field benchmarks read.
        make: Builds the value as a nested dict; the argument is the ROS version.
    """

    name: str
    type: str
    leaf: str
    make: Callable[[int], Value]


@dataclass(frozen=True)
class Field:
    """A field as rosbags describes it; `array` is "", "numbers", "strings" or "messages"."""

    name: str
    base: str
    array: str = ""


@cache
def store(ros: int) -> Any:
    """The rosbags type store whose definitions are used by every library."""
    known = get_typestore(Stores.ROS1_NOETIC if ros == 1 else Stores.ROS2_JAZZY)
    if ros == 1:
        # rosbags' Noetic set lacks tf2_msgs.
        transforms = "geometry_msgs/TransformStamped[] transforms"
        known.register(get_types_from_msg(transforms, "tf2_msgs/msg/TFMessage"))
    return known


@cache
def fields(type_name: str, ros: int) -> tuple[Field, ...]:
    """The fields of a type; ``/`` in a base marks a message."""
    result = []
    for name, (node, detail) in store(ros).fielddefs[type_name][1]:
        if node in {Nodetype.ARRAY, Nodetype.SEQUENCE}:
            (inner, base), _ = detail
            if inner == Nodetype.NAME:
                result.append(Field(name, base, "messages"))
            else:
                kind = "strings" if base[0] == "string" else "numbers"
                result.append(Field(name, base[0], kind))
        else:
            result.append(Field(name, detail if node == Nodetype.NAME else detail[0]))
    return tuple(result)


def definition(type_name: str, ros: int) -> str:
    """The definition with everything it needs, in the form bags and connections carry."""
    text: str = store(ros).generate_msgdef(type_name, ros_version=ros)[0]
    return text


def walker(type_name: str, ros: int, stamp: tuple[str, str] = ("sec", "nanosec")) -> Any:
    """A function that reads every scalar and string of a message by attribute.

    A numeric array counts as one value (its length and last element). `stamp` are the names of
    a time's two parts in the library.
    """
    lines = ["def walk(m):"]
    counter = iter(range(10_000))

    def visit(variable: str, name: str, indent: str) -> None:
        for field in fields(name, ros):
            access = f"{variable}.{field.name}"
            inner = f"v{next(counter)}"
            if field.array == "messages":
                lines.append(f"{indent}for {inner} in {access}:")
                visit(inner, field.base, indent + " ")
            elif field.array == "strings":
                lines.append(f"{indent}for {inner} in {access}: {inner}")
            elif field.array:
                lines.append(f"{indent}{inner} = {access}")
                lines.append(f"{indent}if len({inner}): {inner}[-1]")
            elif field.base.startswith("builtin_interfaces/"):
                lines.append(f"{indent}{inner} = {access}")
                lines.extend(f"{indent}{inner}.{part}" for part in stamp)
            elif "/" in field.base:
                lines.append(f"{indent}{inner} = {access}")
                visit(inner, field.base, indent)
            else:
                lines.append(f"{indent}{access}")

    visit("m", type_name, " ")
    return _define("\n".join(lines), {}, "walk")


def build_any(types: Any, type_name: str, value: Value) -> Any:
    """Build a rosbags message of any type from a nested dict, by its table of fields.

    rosbags has no such function; this is what a program writes that learns its types at run time.
    """
    arguments = {}
    for name, (node, detail) in types.fielddefs[type_name][1]:
        item = value[name]
        if node == Nodetype.NAME:
            item = build_any(types, detail, item)
        elif node in {Nodetype.ARRAY, Nodetype.SEQUENCE} and detail[0][0] == Nodetype.NAME:
            item = [build_any(types, detail[0][1], element) for element in item]
        arguments[name] = item
    return types.types[type_name](**arguments)


def builder(type_name: str, ros: int, class_of: Callable[[str], Any]) -> Any:
    """A function that builds a library's objects from a nested dict of one known type.

    It is what a user would write by hand for the type, constructor by constructor.
    """
    lines: list[str] = []
    names: dict[str, Any] = {}

    def add(name: str) -> str:
        flat = name.replace("/", "_")
        if flat in names:
            return f"make_{flat}"
        names[flat] = class_of(name)
        arguments = []
        for field in fields(name, ros):
            access = f"d[{field.name!r}]"
            if field.array == "messages":
                arguments.append(f"[{add(field.base)}(e) for e in {access}]")
            else:
                arguments.append(f"{add(field.base)}({access})" if "/" in field.base else access)
        lines.append(f"def make_{flat}(d):\n return {flat}({', '.join(arguments)})")
        return f"make_{flat}"

    main = add(type_name)
    return _define("\n".join(lines), names, main)


def _define(source: str, names: dict[str, Any], main: str) -> Any:
    exec(compile(source, f"<{main}>", "exec"), names)
    return names[main]


def _header(ros: int, frame: str, index: int = 0) -> Value:
    value: Value = {"seq": index} if ros == 1 else {}
    value["stamp"] = {"sec": 1_700_000_000 + index, "nanosec": 123_456_789}
    value["frame_id"] = frame
    return value


def _xyz(*xyz: float) -> Value:
    return dict(zip("xyz", xyz, strict=True))


def _pose(index: int) -> Value:
    return {
        "position": _xyz(0.1 * index, -0.2 * index, 0.3),
        "orientation": {"x": 0.0, "y": 0.0, "z": 0.6, "w": 0.8},
    }


def _image(ros: int) -> Value:
    pixels = np.random.default_rng(1).integers(0, 256, 1920 * 1080 * 3, np.uint8)
    return {
        "header": _header(ros, "camera_optical_frame"),
        "height": 1080,
        "width": 1920,
        "encoding": "rgb8",
        "is_bigendian": 0,
        "step": 5760,
        "data": pixels,
    }


def _cloud(ros: int) -> Value:
    points = np.random.default_rng(2).integers(0, 256, 65_536 * 16, np.uint8)
    channels = [
        {"name": name, "offset": 4 * i, "datatype": 7, "count": 1}
        for i, name in enumerate(("x", "y", "z", "intensity"))
    ]
    return {
        "header": _header(ros, "lidar_link"),
        "height": 1,
        "width": 65_536,
        "fields": channels,
        "is_bigendian": False,
        "point_step": 16,
        "row_step": 65_536 * 16,
        "data": points,
        "is_dense": True,
    }


def _pose_stamped(ros: int) -> Value:
    return {"header": _header(ros, "map"), "pose": _pose(3)}


def _twist(_ros: int) -> Value:
    return {"linear": _xyz(0.5, 0.0, 0.0), "angular": _xyz(0.0, 0.0, -0.25)}


def _joints(ros: int) -> Value:
    return {
        "header": _header(ros, "robot_base"),
        "name": [f"arm_joint_{i}" for i in range(30)],
        "position": np.linspace(-1.0, 1.0, 30),
        "velocity": np.linspace(-0.1, 0.1, 30),
        "effort": np.linspace(0.0, 10.0, 30),
    }


def _transforms(ros: int) -> Value:
    return {
        "transforms": [
            {
                "header": _header(ros, "chassis", i),
                "child_frame_id": f"frame{i:02d}",
                "transform": {
                    "translation": _pose(i)["position"],
                    "rotation": _pose(i)["orientation"],
                },
            }
            for i in range(50)
        ]
    }


def _markers(ros: int) -> Value:
    return {"markers": [_marker(ros, i) for i in range(100)]}


def _marker(ros: int, index: int) -> Value:
    value = {
        "header": _header(ros, "map", index),
        "ns": "markers",
        "id": index,
        "type": 4,
        "action": 0,
        "pose": _pose(index),
        "scale": _xyz(0.1, 0.2, 0.3),
        "color": {"r": 1.0, "g": 0.5, "b": 0.25, "a": 1.0},
        "lifetime": {"sec": 1, "nanosec": 500_000_000},
        "frame_locked": False,
        "points": [_xyz(0.1 * i, 0.2 * i, 0.0) for i in range(10)],
        "colors": [],
        "text": "",
        "mesh_resource": "",
        "mesh_use_embedded_materials": False,
    }
    if ros == 2:
        empty = np.zeros(0, np.uint8)
        value["texture_resource"] = ""
        value["texture"] = {"header": _header(2, ""), "format": "", "data": empty}
        value["uv_coordinates"] = []
        value["mesh_file"] = {"filename": "", "data": empty}
    return {field.name: value[field.name] for field in fields("visualization_msgs/msg/Marker", ros)}


def _grid(ros: int) -> Value:
    cells = np.random.default_rng(3).integers(-1, 101, 1_000_000, np.int8)
    return {
        "header": _header(ros, "map"),
        "info": {
            "map_load_time": {"sec": 1_600_000_000, "nanosec": 1},
            "resolution": 0.0625,
            "width": 1000,
            "height": 1000,
            "origin": _pose(1),
        },
        "data": cells,
    }


def _path(ros: int) -> Value:
    return {
        "header": _header(ros, "map"),
        "poses": [{"header": _header(ros, "map", i), "pose": _pose(i)} for i in range(1000)],
    }


def _diagnostics(ros: int) -> Value:
    return {
        "header": _header(ros, ""),
        "status": [
            {
                "level": i % 3,
                "name": f"/sensors/lidar_{i:02d}/driver",
                "message": "everything is as it should",
                "hardware_id": f"{i:04d}",
                "values": [
                    {"key": f"measured_{k:02d}", "value": f"{i + k / 7:.6f} V"} for k in range(10)
                ],
            }
            for i in range(20)
        ],
    }


def _scan(ros: int) -> Value:
    rng = np.random.default_rng(4)
    return {
        "header": _header(ros, "laser"),
        "angle_min": -2.25,
        "angle_max": 2.25,
        "angle_increment": 0.0078125,
        "time_increment": 0.0,
        "scan_time": 0.0625,
        "range_min": 0.125,
        "range_max": 30.0,
        "ranges": rng.random(1080, np.float32),
        "intensities": rng.random(1080, np.float32),
    }


SAMPLES = (
    Sample("Image", "sensor_msgs/msg/Image", "header.stamp.sec", _image),
    Sample("PointCloud2", "sensor_msgs/msg/PointCloud2", "header.stamp.sec", _cloud),
    Sample("PoseStamped", "geometry_msgs/msg/PoseStamped", "pose.position.x", _pose_stamped),
    Sample("Twist", "geometry_msgs/msg/Twist", "linear.x", _twist),
    Sample("JointState", "sensor_msgs/msg/JointState", "position[3]", _joints),
    Sample(
        "TFMessage", "tf2_msgs/msg/TFMessage", "transforms[3].transform.translation.x", _transforms
    ),
    Sample(
        "MarkerArray", "visualization_msgs/msg/MarkerArray", "markers[3].pose.position.x", _markers
    ),
    Sample("OccupancyGrid", "nav_msgs/msg/OccupancyGrid", "info.resolution", _grid),
    Sample("Path", "nav_msgs/msg/Path", "poses[3].pose.position.x", _path),
    Sample(
        "DiagnosticArray", "diagnostic_msgs/msg/DiagnosticArray", "status[3].message", _diagnostics
    ),
    Sample("LaserScan", "sensor_msgs/msg/LaserScan", "range_max", _scan),
)
