"""The ROS graph, as listed by the master, and the rules of its names.

Rules: ROS wiki, "Names"; where it and the clients differ, roscpp's ``names.cpp``.
"""

from __future__ import annotations

import re
import time
from typing import TYPE_CHECKING, NamedTuple

from rosglass.comm import EndpointInfo, EndpointKind, NodeName
from rosglass.errors import InvalidNameError
from rosglass.interfaces import join_name

if TYPE_CHECKING:
    from rosglass.wires.tcpros.master import Master

__all__ = ["Graph", "absolute_namespace", "expand", "full_type", "split", "validate_node_name"]

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


_FORBIDDEN = re.compile(r"[^A-Za-z0-9_/]")
_NODE_FORBIDDEN = re.compile(r"[^A-Za-z0-9_]")


def validate_node_name(name: str) -> None:
    """Raise InvalidNameError unless `name` can be a node's base name."""
    if not isinstance(name, str) or not name:
        raise InvalidNameError(f"a node name must be a non-empty string, got {name!r}")
    if not name[0].isalpha() and not _NODE_FORBIDDEN.match(name):
        raise InvalidNameError(f"node name {name!r} must begin with a letter")
    found = _NODE_FORBIDDEN.search(name)
    if found:
        hint = "; give the namespace separately" if found.group() == "/" else ""
        raise InvalidNameError(
            f"node name {name!r}: {found.group()!r} at position {found.start()}; only letters, "
            f"digits and '_' are allowed{hint}"
        )


def absolute_namespace(text: str, what: str, *, relative: bool = True) -> str:
    """Return a normalized namespace: absolute, without a slash at its end.

    Args:
        text: As written; ``arm`` means ``/arm``, as in ROS_NAMESPACE and ``__ns``.
        what: Where it was given, for the error.
        relative: Whether the first slash may be missing.

    Raises:
        InvalidNameError: It breaks ROS's rules.
    """
    if not isinstance(text, str) or not text:
        raise InvalidNameError(f"a {what} must be a non-empty string, got {text!r}")
    if not relative and not text.startswith("/"):
        raise InvalidNameError(f"{what} {text!r} is not absolute; write {'/' + text!r}")
    _check(what, text, text)
    return "/" + "/".join(part for part in text.split("/") if part)


def expand(name: str, node: str, namespace: str) -> str:
    """Return the absolute name that `name` means for a node.

    Args:
        name: ``/absolute``, ``relative`` to the namespace, or ``~private`` to the node.
        node: The node's base name.
        namespace: The node's absolute namespace.

    Raises:
        InvalidNameError: `name` breaks ROS's rules; the message names the place.
    """
    if not isinstance(name, str) or not name:
        raise InvalidNameError(f"a name must be a non-empty string, got {name!r}")
    rest = name[1:] if name.startswith("~") else name
    _check("name", rest, name)
    if not (name[0] in "~/" or name[0].isalpha()):
        raise InvalidNameError(f"name {name!r} must begin with a letter, '/' or '~'")
    prefix = namespace.rstrip("/")
    if name.startswith("~"):
        full = f"{prefix}/{node}/{rest}"
    elif name.startswith("/"):
        full = name
    else:
        full = f"{prefix}/{name}"
    clean = re.sub(r"/{2,}", "/", full)
    return clean.rstrip("/") or "/"


def _check(what: str, text: str, whole: str) -> None:
    found = _FORBIDDEN.search(text)
    if found:
        position = found.start() + len(whole) - len(text)
        raise InvalidNameError(
            f"{what} {whole!r}: {found.group()!r} at position {position}; only letters, digits, "
            "'_' and '/' are allowed"
        )
