"""Bridges between two ROS graphs, their rules, and a survey of what they would relay."""

from __future__ import annotations

import logging
import re
import threading
import time
from contextlib import ExitStack
from dataclasses import dataclass
from enum import Enum
from fnmatch import fnmatchcase, translate
from typing import TYPE_CHECKING, Any

from rosglass.bridge.relays import (
    ActionRelay,
    BridgeStatus,
    RelayStatus,
    ServiceRelay,
    TopicRelay,
    service_notes,
    topic_notes,
)
from rosglass.bridge.side import Routes, Side
from rosglass.comm import IMMEDIATE, ConnectionState, Handle, Node, QoS, Worker
from rosglass.comm.names import similar
from rosglass.comm.promise import check_timeout
from rosglass.errors import (
    ArgumentError,
    Error,
    InvalidNameError,
    NodeClosedError,
    UnsupportedError,
)
from rosglass.messages import (
    ActionTranslation,
    ActionType,
    MessageType,
    OpaqueType,
    ServiceTranslation,
    Translation,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Mapping

    from rosglass.comm import ActionClient, Publisher, ServiceClient, Subscription
    from rosglass.messages import ServiceType

__all__ = ["Bridge", "Direction", "Rule", "Rules", "SurveyEntry", "survey"]

_SIGN = re.compile(r":=|<->|->|<-")
_WILD = frozenset("*?[")
#: The built-in topics and services of nodes, which ``*`` does not match.
_BUILTIN = re.compile(
    r"/parameter_events|/rosout_agg"
    r"|.*/(get_loggers|set_logger_level|describe_parameters|get_parameter_types|get_parameters"
    r"|list_parameters|set_parameters|set_parameters_atomically|get_type_description"
    r"|get_logger_levels|set_logger_levels|bridge_routes|rosglass_bridge[^/]*/statistics)"
)


class Direction(Enum):
    """The direction of a relay."""

    BOTH = "<->"
    #: From the first graph to the second.
    THERE = "->"
    #: From the second graph to the first.
    BACK = "<-"


@dataclass(frozen=True, slots=True)
class Rule:
    """Topics, services or actions to relay.

    Attributes:
        name: Absolute name in the first graph, or a pattern: ``*`` matches any characters,
            slashes included, ``?`` matches one.
        other: Name in the second graph; for a pattern, the same.
        direction: The direction; that of a service is from its server to its clients.
    """

    name: str
    other: str
    direction: Direction = Direction.BOTH

    @classmethod
    def parse(cls, text: str) -> Rule:
        """Parse ``/scan``, ``/scan->``, ``/scan<-``, ``/scan:=/other``, ``/a->/b`` or ``/a<-/b``.

        Raises:
            InvalidNameError: It is none of these.
        """
        if not isinstance(text, str):
            raise InvalidNameError(f"what to relay is given by its name, not by {text!r:.80}")
        parts = _SIGN.split(text)
        sign = _SIGN.search(text)
        name = parts[0].strip()
        other = parts[1].strip() if len(parts) == 2 else ""
        direction = Direction.BOTH
        if sign is not None and sign.group() != ":=":
            direction = Direction(sign.group())
        if len(parts) > 2 or not name or (sign is not None and sign.group() == ":=" and not other):
            raise InvalidNameError(
                f"{text!r} does not say what to relay; write /name, /name:=/other_name, "
                "/name->, /name<-, or /name->/other_name"
            )
        if not _is_pattern(name):
            name, other = _absolute_name(name), _absolute_name(other or name)
            return cls(name, other, direction)
        if other:
            raise InvalidNameError(f"{text!r}: what a pattern stands for keeps its name")
        return cls(name, name, direction)

    @property
    def is_pattern(self) -> bool:
        """True if it can match several names."""
        return _is_pattern(self.name)

    def applies(self, side: int) -> bool:
        """Return whether it relays from the first (0) or the second (1) graph."""
        return self.direction is not (Direction.BACK if side == 0 else Direction.THERE)


class Rules:
    """The rules for topics, services or actions.

    Args:
        rules: Rules, or texts for :meth:`Rule.parse`.
        exclude: Regular expression; full names that match are never relayed.

    Raises:
        InvalidNameError: A text is invalid.
        ArgumentError: `exclude` is not a regular expression.
    """

    def __init__(self, rules: Iterable[str | Rule], exclude: str = "") -> None:
        if isinstance(rules, str):
            raise InvalidNameError(f"what to relay is given as a list, e.g. [{rules!r}]")
        self.rules = tuple(r if isinstance(r, Rule) else Rule.parse(r) for r in rules)
        try:
            self._exclude = re.compile(exclude) if exclude else None
        except re.error as error:
            what = f"a regular expression ({error})"
            raise ArgumentError("exclude", exclude, what, "Bridge") from None

    def __bool__(self) -> bool:
        return bool(self.rules)

    def other_name(self, side: int, name: str) -> str:
        """Return the other graph's name for `name` in graph `side`; empty if it is not relayed."""
        if self._exclude is not None and self._exclude.fullmatch(name):
            return ""
        for rule in self.rules:
            if not rule.is_pattern and rule.applies(side):
                ours, other = (rule.name, rule.other) if side == 0 else (rule.other, rule.name)
                if ours == name:
                    return other
        if any(name in (rule.name, rule.other) for rule in self.rules if not rule.is_pattern):
            return ""  # a rule of its own excludes this direction
        hidden = any(part.startswith("_") for part in name.split("/"))
        for rule in self.rules:
            if rule.is_pattern and rule.applies(side) and fnmatchcase(name, rule.name):
                usual = hidden or _BUILTIN.fullmatch(name)
                if not (usual and rule.name.strip("/") in ("*", "**")):
                    return name
        return ""

    def named(self, side: int) -> list[str]:
        """Return the names in graph `side` that are relayed from there, without patterns."""
        return [
            rule.name if side == 0 else rule.other
            for rule in self.rules
            if not rule.is_pattern and rule.applies(side)
        ]


def _is_pattern(name: str) -> bool:
    if not _WILD & set(name):
        return False
    try:
        re.compile(translate(name))
    except re.error:
        raise InvalidNameError(
            f"{name!r} is not a valid pattern; * stands for any characters"
        ) from None
    return True


def _absolute_name(name: str) -> str:
    if not re.fullmatch(r"/?[A-Za-z_][A-Za-z0-9_]*(/[A-Za-z_][A-Za-z0-9_]*)*", name):
        raise InvalidNameError(
            f"{name!r} is not the name of a topic or service; write /name or /namespace/name"
        )
    return name if name.startswith("/") else f"/{name}"


_log = logging.getLogger("rosglass.bridge")
#: Seconds between two updates when no graph changes.
_UPDATE_INTERVAL_S = 0.5
#: Seconds that a relay is kept without sources, for nodes that restart.
_RESTART_TIME_S = 3.0
#: Seconds between two messages on ``~/statistics``.
_STATISTICS_INTERVAL_S = 5.0
_STRING = "std_msgs/msg/String"
#: The topics of an action in ROS 1.
_PARTS = ("goal", "cancel", "status", "result", "feedback")


class Bridge(Handle):
    """Relays topics, services and actions between two ROS graphs, until it is closed.

    Messages published in one graph are published in the other as long as it has subscribers;
    services and actions offered in one can be used in the other. Between ROS 1 and ROS 2, messages
    are translated. The bridge does not relay its own messages back, nor those of other bridges
    between the same two graphs: of several, one relays a topic, and another takes over when it
    ends. They recognize each other by their nodes: both nodes of a bridge have the same base name,
    which no other node has. If bridges form a ring, the one that would relay something back to a
    graph where it has been does not relay it, and reports that as a problem.

    Both nodes may lose and regain their connections. The bridge does not close them.

    Args:
        node_a: A node in the first graph.
        node_b: A node in the second graph.
        topics: Topics to relay: ``/scan`` (in both directions, from where it is published),
            ``/scan->`` (from the first graph to the second), ``/cmd_vel<-``,
            ``/scan:=/front/scan`` (renamed in the second graph), patterns such as ``/camera/*``,
            ``*`` for all.
        services: The same for services; ``->`` is for those offered in the first graph.
        actions: The same for actions, whose topics in ROS 1 are not relayed as topics then.
        exclude: Regular expression; full names that match are left out.
        types: Types of topics, services or actions that have no publisher or server yet. Such a
            topic is relayed from the start, so that its first message is not lost.
        qos: Profile at both ends of each topic; None for compatible ones.
        keep: Whether to subscribe to topics even without subscribers in the other graph.
        timeout: Seconds that servers have to answer, and to accept goals.
        memory: Queue size of each topic in bytes while the other graph is slow; beyond it, the
            oldest messages are dropped and counted.

    Raises:
        InvalidNameError: A name or pattern is invalid, nothing is to be relayed, or the nodes have
            different names.
        ArgumentError: Another argument is invalid.
        NodeClosedError: A node is closed.
    """

    def __init__(
        self,
        node_a: Node,
        node_b: Node,
        topics: Iterable[str | Rule] = (),
        services: Iterable[str | Rule] = (),
        actions: Iterable[str | Rule] = (),
        *,
        exclude: str = "",
        types: Mapping[str, str] | None = None,
        qos: QoS | None = None,
        keep: bool = False,
        timeout: float = 10.0,
        memory: int = 64 * 2**20,
    ) -> None:
        for name, node in (("node_a", node_a), ("node_b", node_b)):
            if not isinstance(node, Node):
                raise ArgumentError(name, node, "a node of rosglass.connect()", "Bridge")
        if node_a is node_b:
            raise ArgumentError("node_b", node_b, "another node than node_a", "Bridge")
        if node_a.name != node_b.name:
            raise InvalidNameError(
                f"both nodes of a bridge need the same name, by which other bridges recognize "
                f"them; these are {node_a.name} and {node_b.name}"
            )
        if node_a.url == node_b.url:
            raise ArgumentError("node_b", node_b.url, "another graph than node_a's", "Bridge")
        check_timeout(timeout, "Bridge")
        if isinstance(memory, bool) or not isinstance(memory, int) or memory < 1:
            raise ArgumentError("memory", memory, "a number of bytes", "Bridge")
        self._topics = Rules(topics, exclude)
        #: The rules for services and actions.
        self._offers = {"action": Rules(actions, exclude), "service": Rules(services, exclude)}
        every = (self._topics, *self._offers.values())
        if not any(every):
            raise InvalidNameError('nothing is to be relayed; name topics, or "*" for all')
        self._types = {_absolute(name): kind for name, kind in (types or {}).items()}
        unknown = [
            name
            for name in self._types
            if not any(rules.other_name(0, name) or rules.other_name(1, name)
                       for rules in every)
        ]  # fmt: skip
        if unknown:
            raise InvalidNameError(f"a type is given for {unknown[0]}, which is not relayed")
        self._qos, self._keep, self._timeout, self._memory = qos, keep, timeout, memory
        self._sides = (Side(node_a, 0), Side(node_b, 1))
        self._sides[0].other, self._sides[1].other = self._sides[1], self._sides[0]
        #: Guards the relays and refusals, which the bridge's thread changes.
        self._lock = threading.Lock()
        self._relays: dict[tuple[int, str], TopicRelay] = {}
        #: By kind, number of the graph and name.
        self._callable: dict[tuple[str, int, str], ServiceRelay | ActionRelay] = {}
        self._missed: dict[tuple[str, int, str], float] = {}
        #: Problems of names that cannot be relayed, by kind, number of the graph and name.
        self._refused: dict[tuple[str, int, str], RelayStatus] = {}
        self._missing: set[tuple[str, int, str]] = set()
        self._statistics: list[Publisher] = []
        self._published_at = 0.0
        self._closed = False
        for side in self._sides:
            # Other bridges recognize this one by this topic.
            publisher = side.node.create_publisher(
                f"{side.name.full}/statistics", _STRING, QoS.latched()
            )
            self._statistics.append(publisher)
        self._worker = Worker("bridge", self._update, _UPDATE_INTERVAL_S)
        for side in self._sides:
            side.routes = Routes(side.node, self._worker.wake)
        self._handles = []
        for side in self._sides:
            self._handles += [
                side.node.on_graph_change(self._worker.wake, IMMEDIATE),
                side.node.on_status_change(lambda _: self._worker.wake(), IMMEDIATE),
            ]
        self._worker.wake()

    def status(self) -> BridgeStatus:
        """Return the status of the bridge and its relays."""
        with self._lock:
            relays: list[Any] = [*self._relays.values(), *self._callable.values()]
            refused = list(self._refused.values())
        found = sorted((r.status() for r in relays), key=lambda r: (r.kind != "topic", r.name))
        worlds = []
        for side in self._sides:
            state = side.node.status()
            bad = state.state is not ConnectionState.CONNECTED
            worlds.append((state.detail or state.state.value) if bad else "")
        return BridgeStatus((*found, *refused), (worlds[0], worlds[1]))

    def close(self) -> None:
        """Stop relaying; safe to call twice."""
        if self._closed:
            return
        self._closed = True
        for handle in self._handles:
            handle.close()
        self._worker.close()
        with self._lock:
            relays: list[Any] = [*self._relays.values(), *self._callable.values()]
            self._relays.clear()
            self._callable.clear()
        for relay in relays:
            relay.close()
        for publisher in self._statistics:
            publisher.close()
        for side in self._sides:
            if side.routes is not None:
                side.routes.close()

    # -- on the worker's thread ------------------------------------------------------------------

    def _update(self, _: bool) -> None:
        if self._closed:
            return
        try:
            for side in self._sides:
                side.update()
            for side in self._sides:
                side.follow_routes()
            for side in self._sides:
                self._follow_topics(side)
                for kind in self._offers:
                    self._follow_servers(side, kind)
            for side in self._sides:
                side.publish_routes()
            self._report_missing("topic", self._topics, self._relays)
            for kind, rules in self._offers.items():
                there = {key[1:] for key in self._callable if key[0] == kind}
                self._report_missing(kind, rules, there)
            self._publish_statistics()
        except NodeClosedError:
            return  # the node was closed first

    def _follow_topics(self, side: Side) -> None:
        names = {*side.node.topics(), *self._topics.named(side.number)}
        names |= {name for number, name in self._relays if number == side.number}
        parts = self._action_topics(side)
        for name in sorted(names - parts):
            other = self._topics.other_name(side.number, name)
            if not other:
                continue
            publishers = side.node.publishers(name)
            key = side.number, name
            relay = self._relays.get(key)
            kind = self._type_of(side, name, other)
            wanted = bool(kind or side.sources(publishers) or (relay is not None and relay.alive))
            if not wanted and relay is not None and not side.connected:
                wanted = True  # the graph is unknown: keep what works
            wanted = self._debounce("topic", key, wanted, relay is not None)
            self._refuse("topic", key, other, side.find_circle(publishers))
            side.add_route(f"topic {other}", publishers)
            if self._is_standby(side, other, relay) or (relay is not None and relay.outdated):
                wanted = False
            if not wanted:
                if relay is not None:
                    with self._lock:
                        del self._relays[key]
                    relay.close()
                continue
            if relay is None:
                relay = TopicRelay(
                    side,
                    side.other,
                    name,
                    other,
                    kind=kind,
                    qos=self._qos,
                    keep=self._keep,
                    memory=self._memory,
                    wake=self._worker.wake,
                )
                with self._lock:
                    self._relays[key] = relay
            sources = side.sources(publishers)
            relay.ignored = frozenset(
                identity
                for end in publishers
                if end not in sources
                for identity in (end.gid, end.node.full.encode())
            )
            back = self._relays.get((side.other.number, other))
            relay.follow(1 if back is not None and back.subscribed else 0)

    def _is_standby(self, side: Side, other: str, relay: TopicRelay | None) -> bool:
        """Return whether another bridge between the two graphs relays a topic already."""
        parallel = side.other.parallel(side.other.node.publishers(other))
        if relay is None:
            return bool(parallel) or not side.other.known
        return any(end.node < side.other.name for end in parallel)

    def _action_topics(self, side: Side) -> set[str]:
        """Return the topics of relayed actions in ROS 1."""
        rules = self._offers["action"]
        if not rules or side.node.wire != "ros1":
            return set()
        # Relayed from the other graph, they have the names given by the rules.
        names = {name for name in side.offered("action") if rules.other_name(side.number, name)}
        for name in side.other.offered("action"):
            names.add(rules.other_name(side.other.number, name))
        return {f"{name}/{part}" for name in names - {""} for part in _PARTS}

    def _follow_servers(self, side: Side, kind: str) -> None:
        rules = self._offers[kind]
        if not rules:
            return
        names = {*side.offered(kind), *rules.named(side.number)}
        names |= {
            name for what, number, name in self._callable if (what, number) == (kind, side.number)
        }
        for name in sorted(names):
            other = rules.other_name(side.number, name)
            if not other:
                continue
            key, offer = (side.number, name), (kind, side.number, name)
            relay = self._callable.get(offer)
            offers = side.servers(kind, name)
            side.add_route(side.other.route_key(kind, other), offers)
            servers = side.sources(offers)
            wanted = bool(servers) or (relay is not None and not side.connected)
            wanted = self._debounce(kind, key, wanted, relay is not None)
            there = side.other.servers(kind, other)
            if relay is None and (side.other.parallel(there) or not side.other.known):
                # In ROS 1, the last server of a service replaces the others.
                wanted = False
            elif any(end.node < side.other.name for end in side.other.parallel(there)):
                wanted = False
            rivals = side.other.sources(there)
            problem = side.find_circle(offers)
            if wanted and rivals:
                problem = f"{rivals[0].node} offers it there already"
                wanted = False
            self._refuse(kind, key, other, problem)
            if not wanted:
                if relay is not None:
                    with self._lock:
                        del self._callable[offer]
                    relay.close()
                continue
            if relay is None:
                make = ActionRelay if kind == "action" else ServiceRelay
                type_name = self._type_of(side, name, other)
                relay = make(side, side.other, name, other, kind=type_name, timeout=self._timeout)
                with self._lock:
                    self._callable[offer] = relay
            relay.follow(self._worker.wake)

    def _report_missing(self, kind: str, rules: Rules, there: Collection[tuple[int, str]]) -> None:
        """Report names that exist in neither graph, with similar names."""
        if not all(side.known for side in self._sides):
            return
        for rule in rules.rules:
            names = (rule.name, rule.other)
            places = [(side, names[side.number]) for side in self._sides]
            asked = [place for place in places if rule.applies(place[0].number)]
            missing = not rule.is_pattern and not any(
                side.servers(kind, name) or (side.number, name) in there for side, name in asked
            )
            guess = ""
            if missing:
                known = {
                    n for side, _ in asked for n in side.offered(kind) if side.servers(kind, n)
                }
                guess = similar(asked[0][1], sorted(known))
            problem = f"no {'publisher' if kind == 'topic' else 'server'}{guess}"
            key = asked[0][0].number, asked[0][1]
            if missing:
                self._missing.add((kind, *key))
                self._refuse(kind, key, names[1 - key[0]], problem)
            elif (kind, *key) in self._missing:
                self._missing.discard((kind, *key))
                self._refuse(kind, key, names[1 - key[0]], "")

    def _refuse(self, kind: str, key: tuple[int, str], other: str, problem: str) -> None:
        """Set or clear the reason why something is not relayed."""
        refusal = kind, *key
        if not problem and refusal not in self._refused:
            return
        with self._lock:
            if problem:
                sign = "->" if key[0] == 0 else "<-"
                self._refused[refusal] = RelayStatus(kind, key[1], other, sign, problem=problem)
            else:
                del self._refused[refusal]

    def _debounce(self, kind: str, key: tuple[int, str], wanted: bool, there: bool) -> bool:
        """Return whether something is wanted, or was a moment ago: its node may be restarting."""
        if wanted or not there:
            self._missed.pop((kind, *key), None)
            return wanted
        since = self._missed.setdefault((kind, *key), time.monotonic())
        return time.monotonic() - since < _RESTART_TIME_S

    def _type_of(self, side: Side, name: str, other: str) -> str:
        """Return the type given for a topic, service or action."""
        first, second = (name, other) if side.number == 0 else (other, name)
        return self._types.get(first) or self._types.get(second, "")

    def _publish_statistics(self) -> None:
        now = time.monotonic()
        if now - self._published_at < _STATISTICS_INTERVAL_S:
            return
        self._published_at = now
        line = self.status().line()
        for publisher in self._statistics:
            publisher.publish(data=line)


def _absolute(name: str) -> str:
    return name if name.startswith("/") else f"/{name}"


@dataclass(frozen=True, slots=True)
class SurveyEntry:
    """A topic, service or action that a bridge would relay.

    Attributes:
        kind: ``topic``, ``service`` or ``action``.
        name: Name in the source graph, with the publishers or the server.
        other: Name in the target graph.
        direction: ``->`` from the first graph to the second, ``<-`` from the second to the first.
        type: Type in the source graph.
        other_type: Type in the target graph; empty if it cannot be relayed.
        notes: What is lost or added in translation.
        problem: Why it cannot be relayed; empty if it can.
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
    """Return the relays that a bridge with these arguments would create; see :class:`Bridge`.

    Waits for unknown types up to `timeout` seconds.
    """
    sides = Side(node_a, 0), Side(node_b, 1)
    sides[0].other, sides[1].other = sides[1], sides[0]
    for side in sides:
        side.update()
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
        known = side.offered(kind)
        problem = end.problem or "its type is unknown, and no node describes it"
        return SurveyEntry(kind, name, other, sign, ", ".join(known.get(name, [])), problem=problem)
    if side.node.wire == side.other.node.wire:
        return SurveyEntry(kind, name, other, sign, found.name, found.name)
    try:
        other_type, losses = _translated(found)
    except Error as error:
        return SurveyEntry(kind, name, other, sign, found.name, problem=str(error))
    return SurveyEntry(kind, name, other, sign, found.name, other_type, losses)


def _translated(kind: MessageType | ServiceType | ActionType) -> tuple[str, tuple[str, ...]]:
    if isinstance(kind, OpaqueType):
        raise UnsupportedError(f"its type {kind.name} cannot be translated: {kind.reason}")
    if isinstance(kind, MessageType):
        made = Translation(kind)
        return made.type.name, topic_notes(made)
    if isinstance(kind, ActionType):
        action = ActionTranslation(kind)
        return action.type.name, service_notes(action, ActionRelay.PARTS)
    service = ServiceTranslation(kind)
    return service.type.name, service_notes(service, ServiceRelay.PARTS)
