"""Whose habits a value or an element follows: those of ``Ros 1.0`` or of ``Ros2 1.0``."""

from __future__ import annotations

from enum import Enum

__all__ = ["Dialect"]


class Dialect(Enum):
    """The QML module that an interface imports; the robot may speak either ROS all the same.

    ``Ros 1.0`` shows times as ``{sec, nsec}`` with ``toSec()``, durations as milliseconds and types
    as ``pkg/Type``; ``Ros2 1.0`` shows ``{sec, nanosec}`` with ``seconds()``, and ``pkg/msg/Type``.
    """

    ROS1 = "Ros 1.0"
    ROS2 = "Ros2 1.0"
