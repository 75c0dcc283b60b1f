"""Fills a buffer from ``/tf`` and ``/tf_static``."""

from __future__ import annotations

import logging
import threading
from typing import TYPE_CHECKING

from rosglass.comm.executor import IMMEDIATE
from rosglass.comm.handle import Handle
from rosglass.errors import Error
from rosglass.tf.buffer import TransformBuffer
from rosglass.tf.topics import DEPTH, TYPE, qos_of, topic_of

if TYPE_CHECKING:
    from rosglass.comm.clock import Jump
    from rosglass.comm.inbox import Sample
    from rosglass.comm.node import Node
    from rosglass.comm.subscription import Subscription
    from rosglass.tf.cache import Entry

__all__ = ["UNKNOWN_PUBLISHER", "TransformListener"]

_log = logging.getLogger("rosglass.tf")
_NS = 1_000_000_000
#: The authority of what came from a node that is gone, or that the world does not name.
UNKNOWN_PUBLISHER = "unknown_publisher"
#: Publishers that are remembered at most; a peer may make new ones all the time.
_MOST = 256


class TransformListener(Handle):
    """Subscribes to transforms and keeps them in a buffer.

    Works in ROS 1 and ROS 2. When the node's clock jumps back, as when a simulation is restarted
    or a recording begins anew, or changes between system and simulated time, all transforms but
    the static ones are forgotten.

    Args:
        node: Where to subscribe.
        buffer: What to fill; None for a new buffer of 10 s.
        namespace: Where ``tf`` and ``tf_static`` are: ``/`` as usual, ``/robot1`` for a robot that
            has its own, relative ones below the node's namespace, empty for that itself. A remapped
            ``/tf`` is heard where it is remapped to.

    Attributes:
        node: As given.
        buffer: The buffer.
        subscriptions: Of the moving and of the static transforms; their `problem`, `hint` and
            `statistics()` tell how they are doing.

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
        self._lock = threading.Lock()
        self._origins: dict[tuple[str, bytes], _Origin] = {}
        self._jumps = node.clock.on_jump(self._on_jump, executor=IMMEDIATE)
        made: list[Subscription] = []
        try:
            for static in (False, True):
                made.append(self._subscribe(topic_of(node, namespace, static), static))  # noqa: PERF401
        except BaseException:
            self._jumps.close()
            for subscription in made:
                subscription.close()
            raise
        self.subscriptions: tuple[Subscription, ...] = tuple(made)

    def __repr__(self) -> str:
        topics = " and ".join(subscription.topic for subscription in self.subscriptions)
        return f"<TransformListener on {topics}>"

    def close(self) -> None:
        """Stop listening; the buffer keeps what it has. Safe to call twice.

        A buffer that the listener made is closed, too: nothing will come that is waited for.
        """
        self._jumps.close()
        for subscription in self.subscriptions:
            subscription.close()
        if self._own:
            self.buffer.close()

    def _subscribe(self, topic: str, static: bool) -> Subscription:
        def take(sample: Sample) -> None:
            self.buffer.set_many(transforms_in(sample), self._origin(topic, sample), static)

        # In the thread that receives: who waits for a transform in a callback gets it all the same.
        return self.node.create_subscription(
            topic, TYPE, qos=qos_of(static, DEPTH), raw_callback=take, executor=IMMEDIATE
        )

    def _origin(self, topic: str, sample: Sample) -> _Origin:
        key = (topic, sample.publisher)
        origin = self._origins.get(key)
        if origin is None:
            with self._lock:
                if len(self._origins) >= _MOST:
                    self._origins.clear()
                origin = self._origins.setdefault(key, _Origin(self.node, topic, sample))
        return origin

    def _on_jump(self, jump: Jump) -> None:
        _log.info("%s: time jumped by %.3f s: transforms are forgotten", self, jump.delta.seconds)
        self.buffer.clear()


def transforms_in(sample: Sample) -> list[tuple[str, int, Entry]]:
    """Return the transforms in a ``tf2_msgs/TFMessage``, as the buffer takes them."""
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
    """A publisher of transforms; its text is its node's full name, looked up when asked for."""

    def __init__(self, node: Node, topic: str, sample: Sample) -> None:
        self._node, self._topic, self._publisher = node, topic, sample.publisher
        # ROS 1 says who it is with the connection.
        self._name = sample.publisher.decode() if sample.wire == "ros1" else ""

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Origin) and self._publisher == other._publisher

    def __hash__(self) -> int:
        return hash(self._publisher)

    def __str__(self) -> str:
        if self._name:
            return self._name
        try:
            for endpoint in self._node.publishers(self._topic):
                if endpoint.gid and endpoint.gid == self._publisher:
                    self._name = endpoint.node.full
                    break
        except Error:  # the node is closed: nobody knows any more
            pass
        return self._name or UNKNOWN_PUBLISHER
