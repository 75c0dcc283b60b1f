"""By way of which bridges topics and services came into a world, so that nothing goes in circles.

Each bridge tells, in both worlds, what it brings there from other bridges, and by way of which; who
would take it to where one of these is already does not: it would come back, and go round for ever.
"""

from __future__ import annotations

import json
import logging
import threading
import time
from typing import TYPE_CHECKING

from rosglass.comm import IMMEDIATE, EndpointKind, QoS

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    from rosglass.comm import EndpointInfo, Node, NodeName, Subscription
    from rosglass.messages import Message

__all__ = ["TOPIC", "Routes", "key_of"]

_log = logging.getLogger("rosglass.bridge")
#: Private topic on which a bridge tells its routes, as JSON: ``{"topic /scan": ["bridge_1"]}``.
TOPIC = "bridge_routes"
_STRING = "std_msgs/msg/String"
#: Seconds after which a bridge that tells nothing counts as one that knows nothing of routes.
_SILENT = 5.0
#: Seconds between telling that something is taken from another bridge, and taking it.
_NOTICE = 1.0


class Routes:
    """What bridges tell in one world, and what we do.

    Args:
        node: Our node in that world.
        wake: Called when another bridge tells something new.
    """

    def __init__(self, node: Node, wake: Callable[[], None]) -> None:
        self._node, self._wake = node, wake
        self._lock = threading.Lock()
        self._told: dict[str, list[str]] = {}
        self._known: dict[NodeName, dict[str, frozenset[str]]] = {}
        self._since: dict[NodeName, float] = {}
        self._readers: dict[NodeName, Subscription] = {}
        self._taken: dict[tuple[NodeName, str], float] = {}
        self._publisher = node.create_publisher(f"~/{TOPIC}", _STRING, QoS.latched())
        self._publisher.publish(data="{}")

    def follow(self, bridges: Iterable[NodeName]) -> None:
        """Listen to these bridges; to others no more."""
        bridges = set(bridges)
        for node in self._readers.keys() - bridges:
            self._readers.pop(node).close()
            with self._lock:
                self._known.pop(node, None)
                self._since.pop(node, None)
            self._taken = {key: at for key, at in self._taken.items() if key[0] != node}
        for node in bridges - self._readers.keys():
            self._since[node] = time.monotonic()
            self._readers[node] = self._node.create_subscription(
                f"{node.full}/{TOPIC}",
                _STRING,
                lambda message, node=node: self._hear(node, message),  # type: ignore[misc]
                qos=QoS.latched(),
                executor=IMMEDIATE,
            )

    def path(self, end: EndpointInfo) -> frozenset[str] | None:
        """Return the base names of the bridges by way of which a bridge got what it offers.

        None while it has not told.
        """
        with self._lock:
            known = self._known.get(end.node)
            if known is None:
                silent = time.monotonic() - self._since.get(end.node, time.monotonic())
                return frozenset({end.node.name}) if silent > _SILENT else None
        return known.get(key_of(end), frozenset()) | {end.node.name}

    def take(self, end: EndpointInfo) -> bool:
        """Return whether what a bridge offers may be taken: all have had time to learn of it."""
        now = time.monotonic()
        return now - self._taken.setdefault((end.node, key_of(end)), now) > _NOTICE

    def leave(self, end: EndpointInfo) -> None:
        """Take note that what a bridge offers is not taken."""
        self._taken.pop((end.node, key_of(end)), None)

    def tell(self, routes: Mapping[str, Iterable[str]]) -> None:
        """Tell by way of which bridges what we bring has come; what is ours alone is left out."""
        told = {key: sorted(path) for key, path in sorted(routes.items()) if path}
        if told != self._told:
            self._publisher.publish(data=json.dumps(told))
            self._told = told

    def close(self) -> None:
        """Tell nothing more; safe to call twice."""
        self.follow(())
        self._publisher.close()

    def _hear(self, node: NodeName, message: Message) -> None:
        try:
            told = json.loads(message.data)
            known = {str(key): frozenset(map(str, path)) for key, path in told.items()}
        except (ValueError, TypeError, AttributeError) as error:
            _log.warning("%s tells no routes that can be read: %s", node, error)
            return
        with self._lock:
            self._known[node] = known
        self._wake()


def key_of(end: EndpointInfo) -> str:
    """Return the name under which routes are told, e.g. ``topic /scan``."""
    return f"{'topic' if end.kind is EndpointKind.PUBLISHER else 'service'} {end.name}"
