"""A transform: where one frame is in another, at a time."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from rosglass.comm.time import Time
from rosglass.errors import InvalidArgumentException
from rosglass.tf.rotation import Quaternion, Vector, conjugate, multiply, rotate

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rosglass.messages import Message

__all__ = ["Transform"]


@dataclass(frozen=True, slots=True)
class Transform:
    """Where the frame `child_frame_id` is, seen from the frame `frame_id`.

    Applied to a point given in the child frame, it tells the point in the other one: what a lookup
    from a source to a target returns has the target as `frame_id` and the source as child.

    Attributes:
        translation: Origin of the child frame, x, y, z in metres.
        rotation: Orientation of the child frame, a quaternion x, y, z, w.
        stamp: Time at which it holds; zero for one that always does.
        frame_id: The frame it is seen from.
        child_frame_id: The frame that is placed.

    Raises:
        InvalidArgumentException: A number is missing or not finite, or a name is no text.
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
        """Return the transform in a ``geometry_msgs/TransformStamped`` of ROS 1 or ROS 2.

        Args:
            message: A message, or a dict with all of its fields.

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
            ros: 2, or 1 for ROS 1, whose stamps have other field names.
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
        """Return where the other frame is, seen from the child."""
        back = conjugate(self.rotation)
        x, y, z = self.translation
        moved = rotate(back, (-x, -y, -z))
        return Transform(moved, back, self.stamp, self.child_frame_id, self.frame_id)

    def compose(self, other: Transform) -> Transform:
        """Return where the child of `other` is in this one's frame; ``a @ b`` does the same.

        Args:
            other: Its `frame_id` is this one's child. Its stamp, the newer link's as a rule, is
                not looked at: the result has this one's.

        Raises:
            InvalidArgumentException: The frames do not meet.
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
        """Return a point of the child frame, seen from the other one; metres."""
        x, y, z = self.apply_vector(point)
        a, b, c = self.translation
        return (x + a, y + b, z + c)

    def apply_vector(self, vector: Sequence[float]) -> Vector:
        """Return a direction, a velocity or the like of the child frame, seen from the other."""
        x, y, z = _numbers("vector", vector, 3)
        return rotate(self.rotation, (x, y, z))

    def apply_pose(
        self, position: Sequence[float], orientation: Sequence[float]
    ) -> tuple[Vector, Quaternion]:
        """Return a pose given in the child frame as position and orientation in the other one."""
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
