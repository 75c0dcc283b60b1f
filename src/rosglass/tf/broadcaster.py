"""Tells others where frames are: moving ones again and again, static ones once."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, Any

from rosglass.comm import ConnectionState
from rosglass.comm.handle import Handle
from rosglass.errors import InvalidArgumentException, NodeClosedError
from rosglass.tf.topics import DEPTH, TYPE, is_ros1, qos_of, topic_of
from rosglass.tf.transform import Transform

if TYPE_CHECKING:
    from collections.abc import Iterable

    from rosglass.comm.node import Node

__all__ = ["StaticTransformBroadcaster", "TransformBroadcaster"]


class TransformBroadcaster(Handle):
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
        self._ros = 1 if is_ros1(node) else 2
        topic = topic_of(node, namespace, static=False)
        self.publisher = node.create_publisher(topic, TYPE, qos_of(False, DEPTH))

    def __repr__(self) -> str:
        return f"<{type(self).__name__} on {self.publisher.topic}>"

    def close(self) -> None:
        """Send no more; safe to call twice."""
        self.publisher.close()

    def send_transform(self, transforms: Transform | Iterable[Transform]) -> None:
        """Publish a transform, or several in one message.

        Raises:
            InvalidArgumentException: It is no transform, or a frame has no name; nothing is sent.
            ConversionError: A stamp does not fit into the message.
            NodeClosedError: The broadcaster is closed.
        """
        self.publisher.publish(_fields(_checked(transforms), self._ros))


class _Statics:
    """What the broadcasters of one node have sent on a ``tf_static``, and their one publisher.

    Of a node that publishes several latched messages on a topic, ROS 1's subscribers may keep the
    last one only.

    Args:
        node: Who publishes.
        topic: Absolute topic name.
    """

    def __init__(self, node: Node, topic: str) -> None:
        self.publisher = node.create_publisher(topic, TYPE, qos_of(True, 1))
        self._ros = 1 if is_ros1(node) else 2
        self._lock = threading.Lock()
        self._sent: dict[str, Transform] = {}
        #: The newest message, until it is sent, by the thread that sends already if there is one.
        self._next: bytes | None = None
        self._sending = False
        #: How many broadcasters use it.
        self.users = 0

    def send(self, transforms: Iterable[Transform]) -> None:
        new = {transform.child_frame_id: transform for transform in transforms}
        wire = "ros1" if self._ros == 1 else "cdr"
        with self._lock:
            known = {**self._sent, **new}
            data = self.publisher.type.encode(_fields(known.values(), self._ros), wire=wire)
            self._sent, self._next = known, data
            # Two threads must not overtake each other: the last message counts.
            if self._sending:
                return
            self._sending = True
        try:
            while (newest := self._take_next()) is not None:
                self.publisher.publish_serialized(newest)
        except BaseException:
            with self._lock:
                self._sending = False
            raise

    def _take_next(self) -> bytes | None:
        """Return what is to be sent; who gets None sends no more."""
        with self._lock:
            data, self._next = self._next, None
            self._sending = data is not None
        return data


_shared_lock = threading.Lock()


def _shared(node: Node) -> dict[str, _Statics]:
    """Return what a node's broadcasters share, by topic; kept in the node, to go with it."""
    found: dict[str, _Statics] = vars(node).setdefault("_static_transforms", {})
    return found


class StaticTransformBroadcaster(Handle):
    """Publishes transforms that never change, latched on ``/tf_static``.

    All that were sent are kept and sent together, so that who comes later gets every one: also
    those of the node's other broadcasters of this kind, with which it shares the publisher.

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
        topic = topic_of(node, namespace, static=True)
        with _shared_lock:
            topics = _shared(node)
            if topic not in topics or node.status().state is ConnectionState.CLOSED:
                topics[topic] = _Statics(node, topic)
            self._statics = topics[topic]
            self._statics.users += 1
        self._topics, self._closed = topics, False
        self.publisher = self._statics.publisher

    def __repr__(self) -> str:
        return f"<{type(self).__name__} on {self.publisher.topic}>"

    def close(self) -> None:
        """Send no more; safe to call twice.

        What was sent can be had as long as another of the node's broadcasters is open.
        """
        with _shared_lock:
            if self._closed:
                return
            self._closed = True
            self._statics.users -= 1
            last = not self._statics.users
            if last and self._topics.get(self.publisher.topic) is self._statics:
                del self._topics[self.publisher.topic]
        if last:
            self.publisher.close()

    def send_transform(self, transforms: Transform | Iterable[Transform]) -> None:
        """Publish a transform, or several; one of a frame that was sent before takes its place.

        Errors as for :meth:`TransformBroadcaster.send_transform`.
        """
        checked = _checked(transforms)
        if self._closed:
            raise NodeClosedError(f"{self!r} is closed; make another one")
        self._statics.send(checked)


def _fields(transforms: Iterable[Transform], ros: int) -> dict[str, Any]:
    return {"transforms": [transform.to_dict(ros) for transform in transforms]}


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
