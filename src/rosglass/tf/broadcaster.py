"""Tells others where frames are: moving ones again and again, static ones once."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, Any

from rosglass.comm.node import Handle
from rosglass.errors import InvalidArgumentException
from rosglass.tf.topics import DEPTH, TYPE, is_ros1, qos_of, topic_of
from rosglass.tf.transform import Transform

if TYPE_CHECKING:
    from collections.abc import Iterable

    from rosglass.comm.node import Node

__all__ = ["StaticTransformBroadcaster", "TransformBroadcaster"]


class _Broadcaster(Handle):
    _static = False

    def __init__(self, node: Node, namespace: str, depth: int) -> None:
        self._ros = 1 if is_ros1(node) else 2
        topic = topic_of(node, namespace, self._static)
        self.publisher = node.create_publisher(topic, TYPE, qos_of(self._static, depth))

    def __repr__(self) -> str:
        return f"<{type(self).__name__} on {self.publisher.topic}>"

    def close(self) -> None:
        """Send no more; safe to call twice."""
        self.publisher.close()

    def _publish(self, transforms: Iterable[Transform]) -> None:
        told: list[dict[str, Any]] = [transform.to_dict(self._ros) for transform in transforms]
        self.publisher.publish(transforms=told)


class TransformBroadcaster(_Broadcaster):
    """Publishes transforms that change with time, on ``/tf``.

    Args:
        node: Who publishes.
        namespace: Where ``tf`` is; as for :class:`TransformListener`.

    Attributes:
        publisher: The publisher.

    Raises:
        InvalidNameError: The namespace breaks ROS's rules.
        NodeClosedError: The node is closed.
    """

    def __init__(self, node: Node, namespace: str = "/") -> None:
        super().__init__(node, namespace, DEPTH)

    def send_transform(self, transforms: Transform | Iterable[Transform]) -> None:
        """Publish a transform, or several in one message.

        Raises:
            InvalidArgumentException: It is no transform, or a frame has no name; nothing is sent.
            ConversionError: A stamp does not fit into the message.
            NodeClosedError: The broadcaster is closed.
        """
        self._publish(_checked(transforms))


class StaticTransformBroadcaster(_Broadcaster):
    """Publishes transforms that never change, latched on ``/tf_static``.

    All that were sent are kept and sent together, so that who comes later gets every one.

    Args:
        node: Who publishes.
        namespace: Where ``tf_static`` is; as for :class:`TransformListener`.

    Attributes:
        publisher: The publisher.

    Raises:
        InvalidNameError: The namespace breaks ROS's rules.
        NodeClosedError: The node is closed.
    """

    _static = True

    def __init__(self, node: Node, namespace: str = "/") -> None:
        super().__init__(node, namespace, 1)
        self._lock = threading.Lock()
        self._sent: dict[str, Transform] = {}

    def send_transform(self, transforms: Transform | Iterable[Transform]) -> None:
        """Publish a transform, or several; one of a frame that was sent before takes its place.

        Errors as for :meth:`TransformBroadcaster.send_transform`.
        """
        new = {transform.child_frame_id: transform for transform in _checked(transforms)}
        # Two threads must not overtake each other: the last message counts.
        with self._lock:
            known = {**self._sent, **new}
            self._publish(known.values())
            self._sent = known


def _checked(transforms: Transform | Iterable[Transform]) -> list[Transform]:
    given: list[Any]
    try:
        given = [transforms] if isinstance(transforms, Transform) else list(transforms)
    except TypeError:
        given = [transforms]
    for transform in given:
        if not isinstance(transform, Transform):
            raise InvalidArgumentException(
                f"expected a rosglass.tf.Transform or several, got {transform!r}; "
                "Transform.from_message() makes one of a message"
            )
        if not transform.frame_id or not transform.child_frame_id:
            raise InvalidArgumentException(
                f"a transform needs both frame_id and child_frame_id, got {transform!r}"
            )
        if transform.frame_id == transform.child_frame_id:
            raise InvalidArgumentException(
                f"frame '{transform.frame_id}' cannot be placed in itself: give its parent as "
                "frame_id"
            )
    return given
