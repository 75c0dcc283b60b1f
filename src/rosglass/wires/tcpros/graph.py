"""The ROS graph, as listed by the master."""

from __future__ import annotations

import re
import time
from typing import TYPE_CHECKING, NamedTuple

from rosglass.comm import EndpointInfo, EndpointKind, NodeName
from rosglass.errors import InvalidNameError
from rosglass.interfaces import join_name

if TYPE_CHECKING:
    from rosglass.wires.tcpros.master import Master

__all__ = ["Graph", "full_type", "split"]

_FULL_NAME = re.compile(r"/[A-Za-z0-9_/]+\Z")
_Offers = dict[str, list[str]]
#: The master's values for an unknown type.
_UNKNOWN = ("", "*")
#: Seconds between requests for types that were unknown the last time.
_TYPE_RETRY_S = 5.0


class _Seen(NamedTuple):
    """A snapshot of the graph.

    Attributes:
        publishers: Nodes by topic.
        subscribers: Nodes by topic.
        services: The node of each service, in a list.
        types: Type of each topic, as listed by the master.
        invalid: Names that are left out because they break ROS's rules.
    """

    publishers: _Offers
    subscribers: _Offers
    services: _Offers
    types: dict[str, str]
    invalid: frozenset[str] = frozenset()


_NOTHING = _Seen({}, {}, {}, {})


class Graph:
    """The publishers, subscribers and services of every node, polled from the master.

    All methods but :meth:`refresh` answer from the last snapshot, from any thread.
    """

    def __init__(self) -> None:
        self._seen = _NOTHING
        self._asked = 0.0

    def refresh(self, master: Master) -> bool:
        """Poll the master; return whether the graph has changed.

        Raises:
            ConnectionLostError: The master does not answer.
            MasterError: It refuses.
        """
        invalid: set[str] = set()
        publishers, subscribers, services = (
            _valid(part, invalid) for part in master.call("getSystemState")
        )
        known = self._seen
        types = known.types
        offers = (publishers, subscribers, services)
        missing = any(types.get(name, "") in _UNKNOWN for name in (*publishers, *subscribers))
        if offers != known[:3] or (missing and time.monotonic() - self._asked > _TYPE_RETRY_S):
            self._asked = time.monotonic()
            types = dict(master.call("getTopicTypes"))
        seen = _Seen(*offers, types, frozenset(invalid))
        self._seen = seen
        return seen != known

    def clear(self) -> None:
        """Empty the graph."""
        self._seen = _NOTHING

    def invalid_names(self) -> list[str]:
        """Return the names that are left out because they break ROS's rules, sorted."""
        return sorted(self._seen.invalid)

    def topics(self) -> dict[str, list[str]]:
        """Return every topic with its type; no type where it is unknown."""
        seen = self._seen
        found = {}
        for name in sorted(seen.publishers.keys() | seen.subscribers.keys()):
            kind = full_type(seen.types.get(name, ""))
            found[name] = [kind] if kind else []
        return found

    def type_of(self, topic: str) -> str:
        """Return a topic's type, ``pkg/msg/Type``; empty when it is unknown."""
        return full_type(self._seen.types.get(topic, ""))

    def services(self) -> dict[str, list[str]]:
        """Return every service with its servers' nodes."""
        return dict(self._seen.services)

    def nodes(self) -> list[NodeName]:
        """Return every node that has an endpoint, sorted."""
        found = {node for part in self._seen[:3] for nodes in part.values() for node in nodes}
        return sorted(NodeName(*split(node)) for node in found)

    def endpoints(self, kind: EndpointKind, name: str) -> list[EndpointInfo]:
        """Return the endpoints of a topic or service; the master lists no service clients."""
        parts = (EndpointKind.PUBLISHER, EndpointKind.SUBSCRIPTION, EndpointKind.SERVICE_SERVER)
        if kind not in parts:
            return []
        nodes = self._seen[:3][parts.index(kind)].get(name, [])
        type_name = "" if kind is EndpointKind.SERVICE_SERVER else self.type_of(name)
        return [EndpointInfo(kind, name, type_name, NodeName(*split(node))) for node in nodes]

    def endpoints_of(self, node: NodeName) -> list[EndpointInfo]:
        """Return a node's publishers, subscriptions and services."""
        found = []
        kinds = (EndpointKind.PUBLISHER, EndpointKind.SUBSCRIPTION, EndpointKind.SERVICE_SERVER)
        for kind, part in zip(kinds, self._seen[:3], strict=True):
            for name, nodes in sorted(part.items()):
                if node.full in nodes:
                    found += [e for e in self.endpoints(kind, name) if e.node == node]
        return found


def _valid(part: list[tuple[str, list[str]]], invalid: set[str]) -> _Offers:
    """Return the valid names with their nodes; the others are added to `invalid`."""
    found = {}
    for name, nodes in part:
        if not _FULL_NAME.match(name):
            invalid.add(name)
            continue
        found[name] = sorted(node for node in nodes if node.isprintable())
        invalid.update(node for node in nodes if not node.isprintable())
    return found


def full_type(name: str) -> str:
    """Return a message type's full name; empty for an unknown type."""
    if name in _UNKNOWN:
        return ""
    try:
        return join_name(name)
    except InvalidNameError:
        return name if name.isprintable() else ""


def split(full: str) -> tuple[str, str]:
    """Return namespace and base name of an absolute name."""
    namespace, _, name = full.rpartition("/")
    return namespace or "/", name
