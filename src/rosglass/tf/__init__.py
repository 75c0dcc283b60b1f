"""Where every frame of a robot is, and was: buffer, listener and broadcasters for both worlds."""

from rosglass.tf.broadcaster import StaticTransformBroadcaster, TransformBroadcaster
from rosglass.tf.buffer import Transformable, TransformBuffer
from rosglass.tf.frames import FrameInfo, FrameTree
from rosglass.tf.listener import UNKNOWN_PUBLISHER, TransformListener
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
