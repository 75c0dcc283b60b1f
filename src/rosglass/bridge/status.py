"""How a bridge is doing."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["BridgeStatus", "RelayStatus"]


@dataclass(frozen=True, slots=True)
class RelayStatus:
    """How a topic, a service or an action is relayed one way.

    Attributes:
        kind: ``topic``, ``service`` or ``action``.
        name: Its name where it comes from: where the topic is published, the service offered.
        other: Its name in the other world.
        direction: ``->`` when it comes from the first world, ``<-`` from the second.
        type: Its type where it comes from; empty while it is not known.
        other_type: Its type in the other world; empty while it is not known.
        count: Messages sent on, calls answered, or goals whose end was told.
        size: Bytes of these messages.
        dropped: Messages that made room for newer ones, because the other world is slow.
        refused: Messages, calls or goals that failed.
        notes: What gets lost or is added on the way, in words.
        problem: Why it is not relayed, or only in part, in words; empty when all is well.
    """

    kind: str
    name: str
    other: str
    direction: str
    type: str = ""
    other_type: str = ""
    count: int = 0
    size: int = 0
    dropped: int = 0
    refused: int = 0
    notes: tuple[str, ...] = ()
    problem: str = ""


@dataclass(frozen=True, slots=True)
class BridgeStatus:
    """How a bridge is doing.

    Attributes:
        relays: What is relayed.
        worlds: The state of the connection to each world, in words; empty when all is well.
    """

    relays: tuple[RelayStatus, ...]
    worlds: tuple[str, str]

    @property
    def count(self) -> int:
        """Messages and calls in all."""
        return sum(relay.count for relay in self.relays)

    def line(self) -> str:
        """Return a line for people."""
        well = [r for r in self.relays if r.type or not r.problem]
        topics, services, actions = (
            {(r.name, r.direction) for r in well if r.kind == kind}
            for kind in ("topic", "service", "action")
        )
        dropped, refused = (sum(getattr(r, a) for r in self.relays) for a in ("dropped", "refused"))
        told = f"{_many(len(topics), 'topic')}, {_many(len(services), 'service')}"
        told += f", {_many(len(actions), 'action')}: " if actions else ": "
        told += f"{_many(sum(r.count for r in self.relays if r.kind == 'topic'), 'message')}, "
        told += f"{sum(r.size for r in self.relays) / 1e6:.1f} MB, "
        told += _many(sum(r.count for r in self.relays if r.kind == "service"), "call")
        if actions:
            goals = sum(r.count for r in self.relays if r.kind == "action")
            told += f", {_many(goals, 'goal')}"
        if dropped:
            told += f", {dropped} DROPPED"
        if refused:
            told += f", {refused} REFUSED"
        return told


def _many(count: int, word: str) -> str:
    return f"{count} {word}{'' if count == 1 else 's'}"
