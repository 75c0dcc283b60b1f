"""What a bridge between two worlds would relay, and as what, without relaying anything."""

from __future__ import annotations

import time
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING

from rosglass.bridge.action_relay import ActionRelay
from rosglass.bridge.offered_relay import notes as offered_notes
from rosglass.bridge.rules import Rules
from rosglass.bridge.service_relay import ServiceRelay
from rosglass.bridge.side import Side
from rosglass.bridge.topic_relay import notes
from rosglass.errors import Error, UnsupportedError
from rosglass.messages import (
    ActionTranslation,
    ActionType,
    MessageType,
    OpaqueType,
    ServiceTranslation,
    Translation,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from rosglass.bridge.rules import Rule
    from rosglass.comm import ActionClient, Node, ServiceClient, Subscription
    from rosglass.messages import ServiceType

__all__ = ["SurveyEntry", "survey"]


@dataclass(frozen=True, slots=True)
class SurveyEntry:
    """A topic, service or action that is there, and what becomes of it.

    Attributes:
        kind: ``topic``, ``service`` or ``action``.
        name: Its name where it is published, or offered.
        other: Its name in the other world.
        direction: ``->`` from the first world to the second, ``<-`` the other way.
        type: Its type there.
        other_type: Its type in the other world; empty when it cannot be relayed.
        notes: What gets lost or is added on the way, in words.
        problem: Why it cannot be relayed; empty when it can.
    """

    kind: str
    name: str
    other: str
    direction: str
    type: str
    other_type: str = ""
    notes: tuple[str, ...] = ()
    problem: str = ""


def survey(
    node_a: Node,
    node_b: Node,
    topics: Iterable[str | Rule] = ("*",),
    services: Iterable[str | Rule] = ("*",),
    actions: Iterable[str | Rule] = ("*",),
    *,
    exclude: str = "",
    timeout: float = 3.0,
) -> list[SurveyEntry]:
    """Return what of two worlds' graphs would be relayed; arguments as for :class:`Bridge`.

    Types that are not known here are asked for, for `timeout` seconds at most.
    """
    sides = Side(node_a, 0), Side(node_b, 1)
    sides[0].other, sides[1].other = sides[1], sides[0]
    for side in sides:
        side.look()
    rules = {
        "topic": Rules(topics, exclude),
        "service": Rules(services, exclude),
        "action": Rules(actions, exclude),
    }
    with ExitStack() as stack:
        asked: list[tuple[str, Side, str, str, Subscription | ServiceClient | ActionClient]] = []
        for side in sides:
            for name in sorted(side.node.topics()):
                other = rules["topic"].other_name(side.number, name)
                if other and side.sources(side.node.publishers(name)):
                    asked.append(("topic", side, name, other, _listen(side, name, stack)))
            for kind in ("service", "action"):
                for name in sorted(side.offered(kind) if rules[kind] else ()):
                    other = rules[kind].other_name(side.number, name)
                    if other and side.sources(side.servers(kind, name)):
                        make: Callable[[str], ServiceClient | ActionClient] = (
                            side.node.create_service_client
                            if kind == "service"
                            else side.node.create_action_client
                        )
                        client = make(name)
                        stack.callback(client.close)
                        asked.append((kind, side, name, other, client))
        deadline = time.monotonic() + timeout
        while any(one[4].type is None for one in asked) and time.monotonic() < deadline:
            time.sleep(0.05)
        return [_entry(*one) for one in asked]


def _listen(side: Side, name: str, stack: ExitStack) -> Subscription:
    made = side.node.create_subscription(name, raw_callback=lambda _: None)
    stack.callback(made.close)
    return made


def _entry(
    kind: str,
    side: Side,
    name: str,
    other: str,
    end: Subscription | ServiceClient | ActionClient,
) -> SurveyEntry:
    sign = "->" if side.number == 0 else "<-"
    found = end.type
    if found is None:
        told = ""
        with suppress(Error):
            told = end.problem
        known = side.offered(kind)
        problem = told or "its type is not known, and nobody tells it"
        return SurveyEntry(kind, name, other, sign, ", ".join(known.get(name, [])), problem=problem)
    if side.node.wire == side.other.node.wire:
        return SurveyEntry(kind, name, other, sign, found.name, found.name)
    try:
        other_type, told_notes = _translated(found)
    except Error as error:
        return SurveyEntry(kind, name, other, sign, found.name, problem=str(error))
    return SurveyEntry(kind, name, other, sign, found.name, other_type, told_notes)


def _translated(kind: MessageType | ServiceType | ActionType) -> tuple[str, tuple[str, ...]]:
    if isinstance(kind, OpaqueType):
        raise UnsupportedError(f"its type {kind.name} cannot be translated: {kind.reason}")
    if isinstance(kind, MessageType):
        made = Translation(kind)
        return made.type.name, notes(made)
    if isinstance(kind, ActionType):
        action = ActionTranslation(kind)
        return action.type.name, offered_notes(action, ActionRelay.PARTS)
    service = ServiceTranslation(kind)
    return service.type.name, offered_notes(service, ServiceRelay.PARTS)
