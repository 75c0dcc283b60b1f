"""Transforms and rotations, as unit quaternions (x, y, z, w).

Plain tuples: a robot has some ten links, and numpy takes longer for one than Python for all.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeAlias

from rosglass.comm.time import Time
from rosglass.errors import InvalidArgumentException

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rosglass.messages import Message

__all__ = ["Quaternion", "Transform", "Vector", "conjugate", "multiply", "rotate", "slerp"]


#: x, y, z in metres.
Vector: TypeAlias = tuple[float, float, float]
#: x, y, z, w.
Quaternion: TypeAlias = tuple[float, float, float, float]


def multiply(a: Quaternion, b: Quaternion) -> Quaternion:
    """Return the rotation by `b` and then by `a`."""
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by + ay * bw + az * bx - ax * bz,
        aw * bz + az * bw + ax * by - ay * bx,
        aw * bw - ax * bx - ay * by - az * bz,
    )


def conjugate(q: Quaternion) -> Quaternion:
    """Return the inverse rotation."""
    return (-q[0], -q[1], -q[2], q[3])


def rotate(q: Quaternion, v: Vector) -> Vector:
    """Rotate a vector; as in tf2, a quaternion that is not exactly of length 1 scales it."""
    x, y, z, w = q
    a, b, c = v
    keep = w * w - x * x - y * y - z * z
    along = 2.0 * (x * a + y * b + z * c)
    turn = 2.0 * w
    return (
        keep * a + along * x + turn * (y * c - z * b),
        keep * b + along * y + turn * (z * a - x * c),
        keep * c + along * z + turn * (x * b - y * a),
    )


def slerp(a: Quaternion, b: Quaternion, ratio: float) -> Quaternion:
    """Interpolate on the shorter way from `a` (ratio 0) to `b` (ratio 1)."""
    dot = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]
    sign = -1.0 if dot < 0 else 1.0
    lengths = math.sqrt(sum(x * x for x in a) * sum(x * x for x in b))
    angle = math.acos(max(-1.0, min(1.0, sign * dot / lengths)))
    if angle == 0.0:
        return a
    whole = math.sin(angle)
    s = math.sin((1.0 - ratio) * angle) / whole
    t = sign * math.sin(ratio * angle) / whole
    return (
        a[0] * s + b[0] * t,
        a[1] * s + b[1] * t,
        a[2] * s + b[2] * t,
        a[3] * s + b[3] * t,
    )


@dataclass(frozen=True, slots=True)
class Transform:
    """The pose of the frame `child_frame_id` in the frame `frame_id`.

    It transforms points from the child frame to the other one: a lookup from a source to a target
    returns the target as `frame_id` and the source as `child_frame_id`.

    Attributes:
        translation: Origin of the child frame, x, y, z in metres.
        rotation: Orientation of the child frame, a quaternion x, y, z, w.
        stamp: Time at which it is valid; zero if it always is.
        frame_id: The parent frame.
        child_frame_id: The child frame.

    Raises:
        InvalidArgumentException: A number is missing or not finite, or a name is not a string.
    """

    translation: Vector = (0.0, 0.0, 0.0)
    rotation: Quaternion = (0.0, 0.0, 0.0, 1.0)
    stamp: Time = Time()  # noqa: RUF009 - immutable
    frame_id: str = ""
    child_frame_id: str = ""

    def __post_init__(self) -> None:
        for name, length in (("translation", 3), ("rotation", 4)):
            object.__setattr__(self, name, _numbers(name, getattr(self, name), length))
        if not isinstance(self.stamp, Time):
            raise InvalidArgumentException(
                f"the stamp of a transform is a rosglass.Time, got {self.stamp!r}"
            )
        for name in ("frame_id", "child_frame_id"):
            if not isinstance(getattr(self, name), str):
                raise InvalidArgumentException(
                    f"{name} of a transform is a frame's name, got {getattr(self, name)!r}"
                )

    @classmethod
    def from_message(cls, message: Message | dict[str, Any]) -> Transform:
        """Create a transform from a ``geometry_msgs/TransformStamped`` of ROS 1 or ROS 2.

        Args:
            message: A message, or a dict with all its fields.

        Raises:
            InvalidArgumentException: It is something else, or its numbers are not finite.
        """
        try:
            header, transform = message["header"], message["transform"]
            stamp, p, q = header["stamp"], transform["translation"], transform["rotation"]
            old = "secs" in stamp
            return cls(
                (p["x"], p["y"], p["z"]),
                (q["x"], q["y"], q["z"], q["w"]),
                Time.from_parts(
                    stamp["secs" if old else "sec"], stamp["nsecs" if old else "nanosec"]
                ),
                header["frame_id"],
                message["child_frame_id"],
            )
        except (LookupError, TypeError, AttributeError) as error:
            raise InvalidArgumentException(
                f"expected a geometry_msgs/TransformStamped, got {type(message).__name__}: {error}"
            ) from None

    def to_dict(self, ros: int = 2) -> dict[str, Any]:
        """Return the fields of a ``geometry_msgs/TransformStamped``.

        Args:
            ros: ROS version, 1 or 2; the field names of stamps differ.
        """
        sec, nanosec = ("secs", "nsecs") if ros == 1 else ("sec", "nanosec")
        stamp = {sec: self.stamp.sec, nanosec: self.stamp.nanosec}
        return {
            "header": {"stamp": stamp, "frame_id": self.frame_id},
            "child_frame_id": self.child_frame_id,
            "transform": {
                "translation": dict(zip("xyz", self.translation, strict=True)),
                "rotation": dict(zip("xyzw", self.rotation, strict=True)),
            },
        }

    def inverse(self) -> Transform:
        """Return the pose of the parent frame in the child frame."""
        back = conjugate(self.rotation)
        x, y, z = self.translation
        moved = rotate(back, (-x, -y, -z))
        return Transform(moved, back, self.stamp, self.child_frame_id, self.frame_id)

    def compose(self, other: Transform) -> Transform:
        """Return the pose of the child of `other` in this parent frame; same as ``a @ b``.

        Args:
            other: A transform whose `frame_id` is this one's child. The result has this one's
                stamp.

        Raises:
            InvalidArgumentException: The frames do not match.
        """
        if not isinstance(other, Transform):
            raise InvalidArgumentException(f"expected a rosglass.tf.Transform, got {other!r}")
        if self.child_frame_id != other.frame_id:
            raise InvalidArgumentException(
                f"the transform of '{self.child_frame_id}' in '{self.frame_id}' cannot be followed "
                f"by one in '{other.frame_id}': take one whose frame_id is '{self.child_frame_id}'"
            )
        return Transform(
            self.apply_point(other.translation),
            multiply(self.rotation, other.rotation),
            self.stamp,
            self.frame_id,
            other.child_frame_id,
        )

    def __matmul__(self, other: Transform) -> Transform:
        return self.compose(other)

    def apply_point(self, point: Sequence[float]) -> Vector:
        """Transform a point from the child frame to the parent frame, in metres."""
        x, y, z = self.apply_vector(point)
        a, b, c = self.translation
        return (x + a, y + b, z + c)

    def apply_vector(self, vector: Sequence[float]) -> Vector:
        """Transform a direction or velocity from the child frame to the parent frame."""
        x, y, z = _numbers("vector", vector, 3)
        return rotate(self.rotation, (x, y, z))

    def apply_pose(
        self, position: Sequence[float], orientation: Sequence[float]
    ) -> tuple[Vector, Quaternion]:
        """Transform a position and orientation from the child frame to the parent frame."""
        x, y, z, w = _numbers("orientation", orientation, 4)
        return self.apply_point(position), multiply(self.rotation, (x, y, z, w))


def _numbers(name: str, value: Sequence[float], length: int) -> tuple[float, ...]:
    try:
        numbers = tuple(float(number) for number in value)
    except (TypeError, ValueError):
        numbers = ()
    if len(numbers) != length or not all(map(math.isfinite, numbers)):
        raise InvalidArgumentException(
            f"{name}: expected {length} finite numbers ({'xyzw'[:length]}), got {value!r}"
        )
    return numbers
