"""Frames and transforms: buffer, listener and broadcasters for ROS 1 and ROS 2."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rosglass.tf.buffer import Transformable, TransformBuffer
    from rosglass.tf.frames import FrameInfo, FrameTree
    from rosglass.tf.topics import (
        UNKNOWN_PUBLISHER,
        StaticTransformBroadcaster,
        TransformBroadcaster,
        TransformListener,
    )
    from rosglass.tf.transform import Transform

__all__ = [
    "UNKNOWN_PUBLISHER",
    "FrameInfo",
    "FrameTree",
    "StaticTransformBroadcaster",
    "Transform",
    "TransformBroadcaster",
    "TransformBuffer",
    "TransformListener",
    "Transformable",
]

_HOMES = {
    "buffer": (
        "Transformable",
        "TransformBuffer",
    ),
    "frames": (
        "FrameInfo",
        "FrameTree",
    ),
    "topics": (
        "UNKNOWN_PUBLISHER",
        "StaticTransformBroadcaster",
        "TransformBroadcaster",
        "TransformListener",
    ),
    "transform": ("Transform",),
}
_HOME_OF = {name: module for module, names in _HOMES.items() for name in names}


def __getattr__(name: str) -> object:
    # Imported on first use: before its first frame, a user interface needs rotations only.
    if name not in _HOME_OF:
        raise AttributeError(f"module 'rosglass.tf' has no attribute {name!r}")
    value: object = getattr(import_module(f"rosglass.tf.{_HOME_OF[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
