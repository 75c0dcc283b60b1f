"""Definitions that are wanted from other nodes, and how far getting them has come."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, TypeAlias

from rosglass.interfaces.names import KINDS, split_name
from rosglass.ros2.type_descriptions import ACTION_PARTS

if TYPE_CHECKING:
    from collections.abc import Callable, Container, Sequence

    from rosglass.comm import EndpointInfo, Promise
    from rosglass.messages import ActionType, MessageType, ServiceType
    from rosglass.ros2.type_lookup import Lookup

__all__ = ["AnyType", "Ask", "Trial", "Want", "spelled"]

AnyType: TypeAlias = "MessageType | ServiceType | ActionType"


class Ask:
    """A question on its way to a node."""

    def __init__(self, server: EndpointInfo, name: str) -> None:
        self.server, self.name = server, name
        self.started = time.monotonic()


class Trial:
    """What came of asking a node, and when to ask it again."""

    def __init__(self, node: str, reason: str, count: int, again: float) -> None:
        self.node, self.reason, self.count, self.again = node, reason, count, again


class Want:
    """A definition that is wanted, and how far getting it has come.

    Args:
        name: Its type's name.
        type_hash: The hash that was announced for it; empty takes the one that is in the graph.
        node: Full name of the node whose version is meant; empty for any.

    Attributes:
        endpoints: Who uses it.
        listeners: Told when it has come, or cannot be had.
        promises: Fulfilled when it has come.
        since: When it was wanted first, and `used` last; monotonic seconds.
        asks: Questions on their way, by the server's identity.
        tried: What came of earlier ones, by the same.
        problem: Why it cannot be had; empty while there is hope.
        looked: Whether the library was asked for the version that the graph has.
        stored: Whether the cache on disk was.
        lookup: What the middleware itself was asked.
    """

    def __init__(self, name: str, type_hash: str, node: str) -> None:
        self.name, self.hash, self.node = name, type_hash, node
        self.endpoints: Sequence[EndpointInfo] = ()
        self.listeners: list[Callable[[], None]] = []
        self.promises: list[Promise[AnyType]] = []
        self.since = self.used = time.monotonic()
        self.asks: dict[bytes | str, Ask] = {}
        self.tried: dict[bytes | str, Trial] = {}
        self.problem = ""
        self.looked = self.stored = False
        self.lookup: Lookup | None = None

    @property
    def key(self) -> tuple[str, str, str]:
        """What tells it from other ones."""
        return self.name, self.hash, self.node


def spelled(name: str, known: Container[str]) -> list[str]:
    """Return the full names that a type's name may stand for, of those that are known.

    Args:
        name: Full, or ``pkg/Type``.
        known: Full names. An action's is implied by those of its parts.
    """
    package, kind, base = split_name(name)
    full = [f"{package}/{folder}/{base}" for folder in ((kind,) if kind else KINDS)]
    return [
        each
        for each in full
        if each in known
        or (each.split("/")[1] == "action" and any(each + part in known for part in ACTION_PARTS))
    ]
