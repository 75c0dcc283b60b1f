"""Frames and transforms: buffer, listener and broadcasters for ROS 1 and ROS 2."""

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
