"""Rotations as unit quaternions (x, y, z, w), the arithmetic that transforms are made of.

Plain tuples: a robot has some ten links, and numpy needs longer for one than Python for all.
"""

from __future__ import annotations

import math
from typing import TypeAlias

__all__ = ["Quaternion", "Vector", "conjugate", "multiply", "rotate", "slerp"]

#: x, y, z in metres.
Vector: TypeAlias = tuple[float, float, float]
#: x, y, z, w.
Quaternion: TypeAlias = tuple[float, float, float, float]


def multiply(a: Quaternion, b: Quaternion) -> Quaternion:
    """Return the rotation that does `b` first and `a` then."""
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by + ay * bw + az * bx - ax * bz,
        aw * bz + az * bw + ax * by - ay * bx,
        aw * bw - ax * bx - ay * by - az * bz,
    )


def conjugate(q: Quaternion) -> Quaternion:
    """Return the opposite rotation."""
    return (-q[0], -q[1], -q[2], q[3])


def rotate(q: Quaternion, v: Vector) -> Vector:
    """Return `v` rotated; like tf2, a quaternion that is not quite of length 1 scales it."""
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
    """Return the rotation `ratio` of the shorter way from `a` to `b` (0 to 1)."""
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
