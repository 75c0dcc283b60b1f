"""Transforms on ``/tf`` and ``/tf_static``: listener and broadcasters."""

from __future__ import annotations

import logging
import threading
from operator import itemgetter
from typing import TYPE_CHECKING, Any

from rosglass.comm import ConnectionState
from rosglass.comm.executor import IMMEDIATE
from rosglass.comm.handle import Handle, undo_on_error
from rosglass.comm.names import hidden
from rosglass.comm.qos import QoS
from rosglass.comm.statistics import StampMonitor
from rosglass.errors import Error, InvalidArgumentException, InvalidNameError, NodeClosedError
from rosglass.tf.buffer import TransformBuffer
from rosglass.tf.transform import Transform

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from rosglass.comm.clock import Jump
    from rosglass.comm.inbox import Sample
    from rosglass.comm.node import Node
    from rosglass.comm.subscription import Subscription
    from rosglass.tf.frames import Entry

__all__ = [
    "DEPTH",
    "TYPE",
    "UNKNOWN_PUBLISHER",
    "StaticTransformBroadcaster",
    "TransformBroadcaster",
    "TransformListener",
    "is_ros1",
    "qos_of",
    "topic_of",
]


TYPE = "tf2_msgs/msg/TFMessage"
#: Depth as in tf2_ros.
DEPTH = 100


def topic_of(node: Node, namespace: str, static: bool) -> str:
    """Return the topic in a namespace; an empty one is that of the node.

    Raises:
        InvalidNameError: The namespace breaks ROS's rules.
    """
    if not isinstance(namespace, str):
        raise InvalidNameError(f"the namespace of tf is a text such as /robot1, got {namespace!r}")
    name = "tf_static" if static else "tf"
    if namespace:
        name = f"{namespace.rstrip('/')}/{name}"
    return node.resolve(name)


def qos_of(static: bool, depth: int) -> QoS:
    """Return the QoS profile; static transforms are latched."""
    return QoS.latched(depth) if static else QoS(depth)


def is_ros1(node: Node) -> bool:
    """Return whether a node is in ROS 1, whose stamps have other field names."""
    return node.wire == "ros1"


_log = logging.getLogger("rosglass.tf")
_NS = 1_000_000_000
#: The authority of transforms whose publisher has left or is unknown.
UNKNOWN_PUBLISHER = "unknown_publisher"
#: Number of cached publishers; a peer may create any number.
_MAX_ORIGINS = 256
#: Characters of a frame's name by which its delays are known.
_MAX_SOURCE = 100


class TransformListener(Handle):
    """Subscribes to transforms and stores them in a buffer.

    When the node's clock jumps back, as when a simulation is restarted or a recording starts again,
    or changes between system and simulated time, the buffer is cleared except for static
    transforms.

    Args:
        node: Node that subscribes.
        buffer: Buffer to fill; None for a new one of 10 s.
        namespace: Namespace of ``tf`` and ``tf_static``: usually ``/``; ``/robot1`` for a robot
            with its own; relative to that of the node; empty for that of the node. Remapping rules
            for ``/tf`` apply.

    Attributes:
        node: As given.
        buffer: The buffer.
        subscriptions: Subscriptions to the dynamic and the static transforms, with their `problem`,
            `hint` and `statistics()`.

    Raises:
        InvalidNameError: The namespace breaks ROS's rules.
        NodeClosedError: The node is closed.
    """

    def __init__(
        self, node: Node, buffer: TransformBuffer | None = None, namespace: str = "/"
    ) -> None:
        self.node = node
        self._own = buffer is None
        self.buffer = TransformBuffer() if buffer is None else buffer
        self._origins: dict[tuple[str, bytes], _Origin] = {}
        self._stamps = StampMonitor()
        self._jumps = node.clock.on_jump(self._on_jump, executor=IMMEDIATE)
        self.subscriptions: tuple[Subscription, ...] = ()
        with undo_on_error(self.close):
            for static in (False, True):
                self.subscriptions += (self._subscribe(topic_of(node, namespace, static), static),)

    def __repr__(self) -> str:
        topics = " and ".join(subscription.topic for subscription in self.subscriptions)
        return f"<TransformListener on {topics}>"

    def close(self) -> None:
        """Unsubscribe; the buffer keeps its transforms. Safe to call twice.

        A buffer that the listener created is closed, too, which fails waiting lookups.
        """
        self._jumps.close()
        for subscription in self.subscriptions:
            subscription.close()
        if self._own:
            self.buffer.close()

    def _subscribe(self, topic: str, static: bool) -> Subscription:
        def on_sample(sample: Sample) -> None:
            items = transforms_in(sample)
            late = 0.0 if static else self._lateness(sample, items)
            self.buffer.set_many(items, self._origin(topic, sample), static, late)

        # On the receiving thread, so that a callback can wait for a transform.
        return self.node.create_subscription(
            topic, TYPE, qos=qos_of(static, DEPTH), raw_callback=on_sample, executor=IMMEDIATE
        )

    def _lateness(self, sample: Sample, items: Sequence[tuple[str, int, Entry]]) -> float:
        """Return the seconds by which dynamic transforms were delayed on their way."""
        if not items or self.node.has_simulated_stamps:
            return 0.0
        # Some frames are stamped ahead, by AMCL for a second; a bridge passes all of them on.
        frame, newest, _ = max(items, key=itemgetter(1))
        source = sample.publisher + frame[:_MAX_SOURCE].encode()
        return self._stamps.add(source, sample.received_ns, newest)

    def _origin(self, topic: str, sample: Sample) -> _Origin:
        key = (topic, sample.publisher)
        origin = self._origins.get(key)
        if origin is None:
            if len(self._origins) >= _MAX_ORIGINS:
                self._origins.clear()
            origin = self._origins.setdefault(key, _Origin(self.node, topic, sample))
        return origin

    def _on_jump(self, jump: Jump) -> None:
        _log.info("%s: time jumped by %.3f s: the buffer is cleared", self, jump.delta.seconds)
        self.buffer.clear()


def transforms_in(sample: Sample) -> list[tuple[str, int, Entry]]:
    """Return the transforms of a ``tf2_msgs/TFMessage``, for :meth:`TransformBuffer.set_many`."""
    message = sample.type.decode_all(sample.data, wire=sample.wire)
    found: list[tuple[str, int, Entry]] = []
    old = sample.wire == "ros1"
    for item in message.transforms:
        header, transform = item.header, item.transform
        stamp, p, q = header.stamp, transform.translation, transform.rotation
        time = stamp.secs * _NS + stamp.nsecs if old else stamp.sec * _NS + stamp.nanosec
        entry = (header.frame_id, p.x, p.y, p.z, q.x, q.y, q.z, q.w)
        found.append((item.child_frame_id, time, entry))
    return found


class _Origin:
    """A publisher of transforms, as a string its node's full name, looked up when needed."""

    def __init__(self, node: Node, topic: str, sample: Sample) -> None:
        self._node, self._topic, self._publisher = node, topic, sample.publisher
        # A ROS 1 publisher sends its name when it connects.
        self._name = sample.publisher.decode() if sample.wire == "ros1" else ""

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Origin) and self._publisher == other._publisher

    def __hash__(self) -> int:
        return hash(self._publisher)

    def __str__(self) -> str:
        # Over DDS, names of nodes arrive after their publishers; until then, they are hidden ones.
        if self._name and not hidden(self._name):
            return self._name
        try:
            for endpoint in self._node.publishers(self._topic):
                if endpoint.gid and endpoint.gid == self._publisher:
                    self._name = endpoint.node.full
                    break
        except Error:  # the node is closed
            pass
        return self._name or UNKNOWN_PUBLISHER


class TransformBroadcaster(Handle):
    """Publishes dynamic transforms on ``/tf``.

    Args:
        node: Node that publishes.
        namespace: Namespace of ``tf``; as for :class:`TransformListener`.

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
        """Stop publishing; safe to call twice."""
        self.publisher.close()

    def send_transform(self, transforms: Transform | Iterable[Transform]) -> None:
        """Publish a transform, or several in one message.

        Raises:
            InvalidArgumentException: Not a transform, or a frame has no name; nothing is sent.
            ConversionError: A stamp does not fit into the message.
            NodeClosedError: The broadcaster is closed.
        """
        self.publisher.publish(_fields(_checked(transforms), self._ros))


class _StaticPublisher:
    """The publisher that a node's static broadcasters share, with all transforms sent.

    In ROS 1, a new subscriber receives only the last latched message of a node.

    Args:
        node: Node that publishes.
        topic: Absolute topic name.

    Attributes:
        users: Number of broadcasters that share it.
    """

    def __init__(self, node: Node, topic: str) -> None:
        self.publisher = node.create_publisher(topic, TYPE, qos_of(True, 1))
        self._ros = 1 if is_ros1(node) else 2
        #: Guards the state below; not held while a message is sent.
        self._lock = threading.Lock()
        self._sent: dict[str, Transform] = {}
        #: The message to send next, by the thread that is sending.
        self._next: bytes | None = None
        self._sending = False
        self.users = 0

    def send(self, transforms: Iterable[Transform]) -> None:
        new = {transform.child_frame_id: transform for transform in transforms}
        wire = "ros1" if self._ros == 1 else "cdr"
        with self._lock:
            known = {**self._sent, **new}
            data = self.publisher.type.encode(_fields(known.values(), self._ros), wire=wire)
            self._sent, self._next = known, data
            # One thread sends at a time, so that the newest message is the last.
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
        """Return the message to send next, or None to stop sending."""
        with self._lock:
            data, self._next = self._next, None
            self._sending = data is not None
        return data


#: Guards the publishers that nodes share.
_shared_lock = threading.Lock()


def _shared(node: Node) -> dict[str, _StaticPublisher]:
    """Return the shared publishers of a node by topic; stored in the node, to live as long."""
    found: dict[str, _StaticPublisher] = vars(node).setdefault("_static_transforms", {})
    return found


class StaticTransformBroadcaster(Handle):
    """Publishes static transforms, latched on ``/tf_static``.

    Each message has all static transforms of the node, so that a new subscriber receives them all.
    The node's static broadcasters share one publisher.

    Args:
        node: Node that publishes.
        namespace: Namespace of ``tf_static``; as for :class:`TransformListener`.

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
                topics[topic] = _StaticPublisher(node, topic)
            self._statics = topics[topic]
            self._statics.users += 1
        self._topics, self._closed = topics, False
        self.publisher = self._statics.publisher

    def __repr__(self) -> str:
        return f"<{type(self).__name__} on {self.publisher.topic}>"

    def close(self) -> None:
        """Stop publishing; safe to call twice.

        New subscribers receive its transforms until the node's last static broadcaster is closed.
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
        """Publish a transform, or several; each replaces an earlier one of its frame.

        Errors as for :meth:`TransformBroadcaster.send_transform`.
        """
        checked = _checked(transforms)
        if self._closed:
            raise NodeClosedError(f"{self!r} is closed; create another one")
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
                "Transform.from_message() creates one from a message"
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
