"""What a node tells those who ask its API: ``rosnode``, ``rqt_graph``, the master, subscribers.

Formats: ROS wiki, "ROS/Slave_API", and what rosgraph's ``graph.py``, rosnode and rospy make of it.
"""

from __future__ import annotations

import reprlib
from typing import TYPE_CHECKING, Any

from rosglass.interfaces import ros1_name

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.ros1.core import Core
    from rosglass.ros1.topics import Topics

__all__ = ["Answers"]

_PROTOCOL = "TCPROS"
#: What rospy, too, says where nobody counts.
_UNKNOWN = -1
#: XML-RPC has 32 bits for a number.
_MOST = 2**31 - 1


class Answers:
    """Answers the slave API.

    Args:
        core: The node.
        topics: Its topics.
        parameter_changed: Called with the name of a parameter that was subscribed to.
    """

    def __init__(
        self, core: Core, topics: Topics, parameter_changed: Callable[[str], None]
    ) -> None:
        self._core, self._topics, self._parameter_changed = core, topics, parameter_changed

    def bus_info(self) -> list[list[Any]]:
        """Return the connections, as ``rosnode info`` shows them."""
        found: list[list[Any]] = []
        for topic, publication in self._topics.published().items():
            for link in publication.links():
                peer = link.header.get("callerid", link.peer)
                found.append([len(found) + 1, peer, "o", _PROTOCOL, topic, True, link.info])
        for topic, shared in self._topics.subscribed().items():
            for source in shared.links():
                # The publisher's URI: rosnode and rqt_graph find the node by it.
                told = [len(found) + 1, source.uri, "i", _PROTOCOL, topic, source.connected]
                found.append([*told, source.info])
        return found

    def bus_stats(self) -> list[Any]:
        """Return statistics of publishers, subscriptions and services."""
        publishers = [
            [topic, _UNKNOWN, [[n, _UNKNOWN, _UNKNOWN, True] for n, _ in enumerate(p.links(), 1)]]
            for topic, p in self._topics.published().items()
        ]
        subscriptions = [
            [
                topic,
                [
                    [n, min(source.received, _MOST), _UNKNOWN, _UNKNOWN, source.connected]
                    for n, source in enumerate(shared.links(), 1)
                ],
            ]
            for topic, shared in self._topics.subscribed().items()
        ]
        return [publishers, subscriptions, []]

    def master_uri(self) -> str:
        """Return the master's URI."""
        return self._core.master.uri

    def published(self) -> list[list[str]]:
        """Return topic and type of all that is published."""
        return [[t, ros1_name(p.type.name)] for t, p in sorted(self._topics.published().items())]

    def subscribed(self) -> list[list[str]]:
        """Return topic and type of all that is subscribed."""
        return [[t, i.type_name] for t, i in sorted(self._topics.subscribed().items())]

    def shut_down(self, caller: str, reason: str) -> None:
        """End the node, because somebody else says so: another one has its name now."""
        self._core.shut_down(caller, reason)

    def parameter_changed(self, name: str, value: Any) -> None:  # noqa: ARG002 - it may be old
        """Look at a parameter that was subscribed to."""
        self._parameter_changed(name)

    def publishers_changed(self, topic: str, uris: list[str]) -> None:
        """Take the publishers that a topic has now."""
        shared = self._topics.subscribed().get(topic)
        if shared is not None:
            shared.on_publishers_changed(uris)

    def request_topic(self, topic: str, protocols: list[Any]) -> list[Any]:
        """Return how to connect to a published topic.

        Raises:
            KeyError: It is not published here.
            ValueError: None of the protocols is TCPROS.
        """
        if not self._topics.serves(topic):
            raise KeyError(f"{self._core.name} does not publish {topic}")
        asked = [one[0] if isinstance(one, list) and one else one for one in protocols]
        if _PROTOCOL not in asked:
            names = ", ".join(one if isinstance(one, str) else reprlib.repr(one) for one in asked)
            raise ValueError(
                f"{self._core.name} speaks {_PROTOCOL} only, not {names or 'nothing'}; "
                "let the subscriber ask for it, too"
            )
        return [_PROTOCOL, *self._core.address]
