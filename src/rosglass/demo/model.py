"""The robot's shape, for programs that draw it: its URDF and the frames of its parts."""

from __future__ import annotations

import math
from typing import Any

from rosglass.demo.scan import LaserScanner
from rosglass.demo.scene import MOUNT
from rosglass.demo.telemetry import AXLES

__all__ = ["PARTS", "urdf"]

#: Fixed parts: name, position and roll, pitch, yaw on ``base_link``.
PARTS: tuple[tuple[str, tuple[float, float, float], tuple[float, float, float]], ...] = (
    ("rear_camera_link", (-0.36, 0.0, 0.30), (0.0, 0.0, math.pi)),
    ("left_camera_link", (0.0, 0.24, 0.30), (0.0, 0.0, math.pi / 2)),
    ("right_camera_link", (0.0, -0.24, 0.30), (0.0, 0.0, -math.pi / 2)),
    ("thermal_camera_link", (-0.02, 0.0, 0.60), (0.0, MOUNT[2], 0.0)),
)
_COLOURS = {
    "hull": "0.17 0.19 0.22",
    "deck": "0.90 0.45 0.12",
    "track": "0.07 0.07 0.08",
    "wheel": "0.33 0.35 0.38",
    "flipper": "0.24 0.26 0.30",
    "metal": "0.62 0.66 0.70",
    "lens": "0.10 0.45 0.60",
}
_TRACK_X, _TRACK_Y, _TRACK_Z = 0.27, 0.255, 0.10


def urdf() -> str:
    """Return the robot's description, of boxes and cylinders only."""
    hull = [
        _box((0.62, 0.40, 0.14), (0, 0, 0.14), "hull"),
        _box((0.50, 0.36, 0.05), (0, 0, 0.235), "deck"),
        _box((0.16, 0.20, 0.03), (-0.18, 0, 0.275), "hull"),
        _cylinder(0.018, 0.24, (MOUNT[0] - 0.02, 0, 0.38), (0, 0, 0), "metal"),
    ]
    for side in (1, -1):
        y = side * _TRACK_Y
        hull.append(_box((2 * _TRACK_X, 0.10, 0.20), (0, y, _TRACK_Z), "track"))
        hull += [
            _cylinder(0.10, 0.10, (x, y, _TRACK_Z), (math.pi / 2, 0, 0), "track")
            for x in (_TRACK_X, -_TRACK_X)
        ]
        for k in range(-2, 3):
            at = (k * 0.13, y + side * 0.002, _TRACK_Z)
            hull.append(_cylinder(0.045, 0.104, at, (math.pi / 2, 0, 0), "wheel"))
    links = [_link("base_link", *hull)]
    for name, axle in AXLES.items():
        forward = 1 if axle[0] > 0 else -1
        links.append(
            _link(
                name,
                _cylinder(0.085, 0.09, (0, 0, 0), (math.pi / 2, 0, 0), "wheel"),
                _box((0.40, 0.08, 0.11), (forward * 0.21, 0, 0), "flipper"),
                _cylinder(0.05, 0.084, (forward * 0.41, 0, 0), (math.pi / 2, 0, 0), "wheel"),
            )
        )
        links.append(_joint(name, "revolute", axle, (0, 0, 0), axis=(0, -forward, 0)))
    scanner = _cylinder(0.055, 0.07, (0, 0, 0), (0, 0, 0), "lens")
    eye = _box((0.07, 0.13, 0.07), (0, 0, 0), "metal")
    glass = _cylinder(0.028, 0.02, (0.04, 0, 0), (0, math.pi / 2, 0), "lens")
    fixed = [
        ("laser", (LaserScanner.mount, 0.0, 0.4), (0.0, 0.0, 0.0), (scanner,)),
        ("camera_link", (MOUNT[0], 0.0, MOUNT[1]), (0.0, MOUNT[2], 0.0), (eye, glass)),
        *(
            (name, place, turn, (_box((0.04, 0.06, 0.04), (0, 0, 0), "metal"),))
            for name, place, turn in PARTS
        ),
    ]
    for name, place, turn, visuals in fixed:
        links += [_link(name, *visuals), _joint(name, "fixed", place, turn)]
    colours = [
        f'<material name="{name}"><color rgba="{rgb} 1"/></material>'
        for name, rgb in _COLOURS.items()
    ]
    body = "\n".join([*colours, *links])
    return f'<?xml version="1.0"?>\n<robot name="rosglass_robot">\n{body}\n</robot>\n'


def _numbers(values: Any) -> str:
    return " ".join(f"{value:.6g}" for value in values)


def _visual(shape: str, place: Any, turn: Any, colour: str) -> str:
    origin = f'<origin xyz="{_numbers(place)}" rpy="{_numbers(turn)}"/>'
    material = f'<material name="{colour}"/>'
    return f"<visual>{origin}<geometry>{shape}</geometry>{material}</visual>"


def _box(size: Any, place: Any, colour: str) -> str:
    return _visual(f'<box size="{_numbers(size)}"/>', place, (0, 0, 0), colour)


def _cylinder(radius: float, length: float, place: Any, turn: Any, colour: str) -> str:
    return _visual(f'<cylinder radius="{radius}" length="{length}"/>', place, turn, colour)


def _link(name: str, *visuals: str) -> str:
    return f'<link name="{name}">{"".join(visuals)}</link>'


def _joint(name: str, kind: str, place: Any, turn: Any, axis: Any = None) -> str:
    moving = ""
    if axis is not None:
        limit = '<limit lower="-1.4" upper="1.4" effort="50" velocity="1.2"/>'
        moving = f'<axis xyz="{_numbers(axis)}"/>{limit}'
    return (
        f'<joint name="{name}" type="{kind}"><parent link="base_link"/><child link="{name}"/>'
        f'<origin xyz="{_numbers(place)}" rpy="{_numbers(turn)}"/>{moving}</joint>'
    )
