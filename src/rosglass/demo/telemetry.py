"""The simulated robot's state as fields of ROS messages.

Frames follow REP 105 and REP 103: ``map -> odom -> base_link``, and on the robot ``laser``,
``imu_link``, ``camera_link``, ``camera_optical_frame`` and one frame for each flipper. The robot's
localization is exact: ``map -> odom`` is the identity.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from rosglass.demo.scene import FOCAL, HEIGHT, MOUNT, WIDTH
from rosglass.demo.simulation import FLIPPERS, Limits, RobotState
from rosglass.demo.world import LaserScanner

if TYPE_CHECKING:
    import numpy.typing as npt

    from rosglass.comm import Time

__all__ = [
    "AXLES",
    "battery",
    "camera_info",
    "diagnostics",
    "imu",
    "joints",
    "moving_frames",
    "occupancy_grid",
    "odometry",
    "part",
    "scan",
    "static_frames",
]

Fields = dict[str, Any]
#: Positions of the flippers' axles: metres forward, left and up of the middle.
AXLES = {
    name: (0.26 * ahead, 0.32 * left, 0.14)
    for name, (ahead, left) in zip(FLIPPERS, ((1, 1), (1, -1), (-1, 1), (-1, -1)), strict=True)
}
# Constants of diagnostic_msgs/msg/DiagnosticStatus and sensor_msgs/msg/BatteryState.
_OK, _WARN, _ERROR = 0, 1, 2
_CHARGING, _DISCHARGING, _FULL = 1, 2, 4
_GRAVITY = 9.81


def header(stamp: Time, frame: str) -> Fields:
    """Return a ``std_msgs/msg/Header``."""
    return {"stamp": stamp, "frame_id": frame}


def _vector(x: float, y: float, z: float) -> Fields:
    return {"x": x, "y": y, "z": z}


def _quaternion(x: float, y: float, z: float, w: float) -> Fields:
    return {"x": x, "y": y, "z": z, "w": w}


def _rotation(roll: float, pitch: float, yaw: float) -> Fields:
    return _quaternion(*RobotState(roll=roll, pitch=pitch, yaw=yaw).orientation)


def _transform(
    stamp: Time, parent: str, child: str, translation: Fields, rotation: Fields
) -> Fields:
    return {
        "header": header(stamp, parent),
        "child_frame_id": child,
        "transform": {"translation": translation, "rotation": rotation},
    }


def odometry(state: RobotState, stamp: Time) -> Fields:
    """Return ``nav_msgs/msg/Odometry``."""
    small = np.zeros(36)
    small[[0, 7, 14, 21, 28, 35]] = 1e-4
    return {
        "header": header(stamp, "odom"),
        "child_frame_id": "base_link",
        "pose": {
            "pose": {
                "position": _vector(state.x, state.y, state.z),
                "orientation": _quaternion(*state.orientation),
            },
            "covariance": small,
        },
        "twist": {
            "twist": {
                "linear": _vector(state.speed, 0.0, 0.0),
                "angular": _vector(state.roll_rate, state.pitch_rate, state.turn),
            },
            "covariance": small,
        },
    }


def moving_frames(state: RobotState, stamp: Time) -> Fields:
    """Return ``tf2_msgs/msg/TFMessage`` with the moving frames."""
    body = _transform(
        stamp,
        "odom",
        "base_link",
        _vector(state.x, state.y, state.z),
        _quaternion(*state.orientation),
    )
    flippers = [
        # A flipper's frame turns about the y axis, where positive is nose down.
        _transform(
            stamp,
            "base_link",
            name,
            _vector(*axle),
            _rotation(0.0, -angle if axle[0] > 0 else angle, 0.0),
        )
        for (name, axle), angle in zip(AXLES.items(), state.flippers, strict=True)
    ]
    return {"transforms": [body, *flippers]}


def part(
    stamp: Time, name: str, place: tuple[float, float, float], turn: tuple[float, float, float]
) -> Fields:
    """Return the pose of a part on ``base_link``; `turn` is roll, pitch, yaw in radians."""
    return _transform(stamp, "base_link", name, _vector(*place), _rotation(*turn))


def static_frames(stamp: Time) -> Fields:
    """Return ``tf2_msgs/msg/TFMessage`` with the fixed frames."""
    upright = _rotation(0.0, 0.0, 0.0)
    forward, up, down = MOUNT
    return {
        "transforms": [
            _transform(stamp, "map", "odom", _vector(0.0, 0.0, 0.0), upright),
            _transform(stamp, "base_link", "laser", _vector(LaserScanner.mount, 0.0, 0.4), upright),
            _transform(stamp, "base_link", "imu_link", _vector(0.0, 0.0, 0.2), upright),
            _transform(
                stamp,
                "base_link",
                "camera_link",
                _vector(forward, 0.0, up),
                _rotation(0.0, down, 0.0),
            ),
            _transform(
                stamp,
                "camera_link",
                "camera_optical_frame",
                _vector(0.0, 0.0, 0.0),
                _rotation(-math.pi / 2, 0.0, -math.pi / 2),
            ),
        ]
    }


def imu(state: RobotState, stamp: Time) -> Fields:
    """Return ``sensor_msgs/msg/Imu``."""
    return {
        "header": header(stamp, "imu_link"),
        "orientation": _quaternion(*state.orientation),
        "angular_velocity": _vector(state.roll_rate, state.pitch_rate, state.turn),
        "linear_acceleration": _vector(
            state.acceleration - _GRAVITY * math.sin(state.pitch),
            state.speed * state.turn + _GRAVITY * math.sin(state.roll) * math.cos(state.pitch),
            _GRAVITY * math.cos(state.roll) * math.cos(state.pitch),
        ),
    }


def joints(state: RobotState, stamp: Time) -> Fields:
    """Return ``sensor_msgs/msg/JointState`` of the flippers."""
    return {
        "header": header(stamp, ""),
        "name": list(FLIPPERS),
        "position": list(state.flippers),
        "velocity": list(state.flipper_speeds),
    }


def battery(state: RobotState, stamp: Time) -> Fields:
    """Return ``sensor_msgs/msg/BatteryState``."""
    status = _DISCHARGING
    if state.charging:
        status = _FULL if state.charge >= 1.0 else _CHARGING
    capacity = 20.0
    return {
        "header": header(stamp, "base_link"),
        "voltage": state.voltage,
        "temperature": 24.0 + 0.4 * abs(state.current),
        "current": state.current,
        "charge": capacity * state.charge,
        "capacity": capacity,
        "design_capacity": capacity,
        "percentage": state.charge,
        "power_supply_status": status,
        "power_supply_health": 1,
        "power_supply_technology": 2,
        "present": True,
        "cell_voltage": [state.voltage / 6] * 6,
        "location": "hull",
        "serial_number": "SIM-0001",
    }


def scan(ranges: npt.NDArray[np.float32], stamp: Time) -> Fields:
    """Return ``sensor_msgs/msg/LaserScan``."""
    turn_time = 0.1
    return {
        "header": header(stamp, "laser"),
        "angle_min": LaserScanner.angle_min,
        "angle_max": LaserScanner.angle_min
        + LaserScanner.angle_increment * (LaserScanner.beams - 1),
        "angle_increment": LaserScanner.angle_increment,
        "time_increment": turn_time / LaserScanner.beams,
        "scan_time": turn_time,
        "range_min": LaserScanner.range_min,
        "range_max": LaserScanner.range_max,
        "ranges": ranges,
    }


def occupancy_grid(cells: npt.NDArray[np.int8], resolution: float, stamp: Time) -> Fields:
    """Return ``nav_msgs/msg/OccupancyGrid``; the map's frame lies in the middle of the cells."""
    rows, columns = cells.shape
    return {
        "header": header(stamp, "map"),
        "info": {
            "map_load_time": stamp,
            "resolution": resolution,
            "width": columns,
            "height": rows,
            "origin": {
                "position": _vector(-columns * resolution / 2, -rows * resolution / 2, 0.0),
                "orientation": _quaternion(0.0, 0.0, 0.0, 1.0),
            },
        },
        "data": cells.ravel(),
    }


def camera_info(stamp: Time, ros: int = 2) -> Fields:
    """Return ``sensor_msgs/msg/CameraInfo``: a camera without distortion; ROS 1's if `ros` is 1."""
    k = [FOCAL, 0.0, WIDTH / 2, 0.0, FOCAL, HEIGHT / 2, 0.0, 0.0, 1.0]
    matrices = {
        "d": [0.0] * 5,
        "k": k,
        "r": [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        "p": [FOCAL, 0.0, WIDTH / 2, 0.0, 0.0, FOCAL, HEIGHT / 2, 0.0, 0.0, 0.0, 1.0, 0.0],
    }
    return {
        "header": header(stamp, "camera_optical_frame"),
        "width": WIDTH,
        "height": HEIGHT,
        "distortion_model": "plumb_bob",
        # ROS 2 forbids capitals in field names.
        **({name.upper(): value for name, value in matrices.items()} if ros == 1 else matrices),
    }


def diagnostics(
    state: RobotState, stamp: Time, *, frames_per_second: float, render_time: float, rejected: int
) -> Fields:
    """Return ``diagnostic_msgs/msg/DiagnosticArray``.

    Args:
        state: The robot.
        stamp: Now.
        frames_per_second: The camera's rate.
        render_time: Time to render an image, seconds.
        rejected: Commands refused since the start.
    """
    if state.emergency_stop:
        drive = (_ERROR, "emergency stop latched")
    elif state.bumped:
        drive = (_WARN, "blocked by an obstacle")
    elif not state.commands_alive:
        drive = (_OK, "waiting for commands")
    else:
        drive = (_OK, "driving" if abs(state.speed) + abs(state.turn) > 0.01 else "holding")
    if state.charge <= 0.0:
        power = (_ERROR, "empty: motors off")
    elif state.charge < 0.2:
        power = (_WARN, "low")
    else:
        power = (_OK, "charging" if state.charging else "good")
    slope = math.degrees(max(abs(state.roll), abs(state.pitch)))
    steep = (_WARN, f"steep: {slope:.0f}°") if slope > 12 else (_OK, "level enough")
    camera = (_OK, "streaming") if frames_per_second > 5 else (_ERROR, "no images")
    commands = (_OK, "none refused") if not rejected else (_WARN, f"{rejected} refused as garbage")
    return {
        "header": header(stamp, ""),
        "status": [
            _status("drive", "tracks", *drive, speed=f"{state.speed:.2f} m/s"),
            _status("power", "battery", *power, charge=f"{100 * state.charge:.1f} %"),
            _status(
                "camera",
                "front camera",
                *camera,
                rate=f"{frames_per_second:.1f} Hz",
                rendering=f"{1000 * render_time:.1f} ms",
            ),
            _status("attitude", "imu", *steep, roll=f"{math.degrees(state.roll):.1f}°"),
            _status("commands", "/cmd_vel", *commands, watchdog=f"{Limits.watchdog:g} s"),
        ],
    }


def _status(name: str, hardware: str, level: int, message: str, **values: str) -> Fields:
    return {
        "level": level,
        "name": name,
        "message": message,
        "hardware_id": hardware,
        "values": [{"key": key, "value": value} for key, value in values.items()],
    }
