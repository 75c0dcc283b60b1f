"""Relaying topics, services and actions between two worlds."""

from __future__ import annotations

import logging
import threading
import time
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from rosglass.bridge.action_relay import ActionRelay
from rosglass.bridge.routes import Routes
from rosglass.bridge.rules import Rules
from rosglass.bridge.service_relay import ServiceRelay
from rosglass.bridge.side import Side
from rosglass.bridge.status import BridgeStatus, RelayStatus
from rosglass.bridge.topic_relay import TopicRelay
from rosglass.comm import IMMEDIATE, ConnectionState, Handle, Node, QoS, Worker
from rosglass.comm.names import similar
from rosglass.comm.promise import check_timeout
from rosglass.errors import ArgumentError, Error, InvalidNameError, NodeClosedError

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Mapping

    from rosglass.bridge.rules import Rule
    from rosglass.comm import Publisher

__all__ = ["Bridge"]

_log = logging.getLogger("rosglass.bridge")
#: Seconds between two looks when no graph changes.
_PAUSE = 0.5
#: Seconds that who has gone may take to come back: a restart keeps its relay.
_GONE = 3.0
#: Seconds between two words about itself.
_TELL = 5.0
_STRING = "std_msgs/msg/String"
#: The topics of an action in ROS 1.
_PARTS = ("goal", "cancel", "status", "result", "feedback")


class Bridge(Handle):
    """Relays topics, services and actions between two worlds, until it is closed.

    What is published in one world is published in the other as well, as long as somebody there
    subscribes to it; a service, or action, that is offered in one can be used in the other. Where
    one is ROS 1 and the other ROS 2, messages are translated. What the bridge publishes itself is
    never relayed back, nor is what another bridge between the same two worlds publishes: of
    several, one relays a topic, and another takes over when it ends. They know each other by their
    nodes: both have one base name, which nobody else has. Where bridges form a ring, the one that
    would take something back to a world where it has been says so, and does not.

    Both nodes may lose their connections and find them again. The bridge does not close them.

    Args:
        node_a: A node in the first world.
        node_b: A node in the second world.
        topics: What is relayed: ``/scan`` (both ways: wherever it is published), ``/scan->`` (from
            the first world to the second), ``/cmd_vel<-``, ``/scan:=/front/scan`` (called
            otherwise in the second world), patterns such as ``/camera/*``, ``*`` for all.
        services: The same for services; ``->`` is for those offered in the first world.
        actions: The same for actions. Their topics in ROS 1 are not relayed by themselves then.
        exclude: Regular expression; what matches as a whole is left out.
        types: Types of topics, services or actions that nobody publishes, or tells the type of,
            yet. Such
            a topic is relayed from the beginning, so that not even its first message is missed.
        qos: Profile at both ends of each topic; None for what fits.
        keep: Whether to subscribe to topics even while nobody in the other world does.
        timeout: Seconds that servers have to answer, and to accept goals.
        memory: Bytes of each topic that may wait while the other world is slow; beyond, the oldest
            messages are dropped and counted.

    Raises:
        InvalidNameError: A name, or pattern, makes no sense, nothing is to be relayed, or the nodes
            have two names.
        ArgumentError: Another argument makes no sense.
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
                f"both nodes of a bridge need one name, by which other bridges know them; these "
                f"are {node_a.name} and {node_b.name}"
            )
        if node_a.url == node_b.url:
            raise ArgumentError("node_b", node_b.url, "another world than node_a's", "Bridge")
        check_timeout(timeout, "Bridge")
        if isinstance(memory, bool) or not isinstance(memory, int) or memory < 1:
            raise ArgumentError("memory", memory, "a number of bytes", "Bridge")
        self._topics = Rules(topics, exclude)
        #: By kind: what has servers.
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
        self._lock = threading.Lock()
        self._relays: dict[tuple[int, str], TopicRelay] = {}
        #: By kind, world and name.
        self._callable: dict[tuple[str, int, str], ServiceRelay | ActionRelay] = {}
        self._missed: dict[tuple[str, int, str], float] = {}
        #: What cannot be relayed at all, by kind, world and name.
        self._refused: dict[tuple[str, int, str], RelayStatus] = {}
        self._missing: set[tuple[str, int, str]] = set()
        self._tellers: list[Publisher] = []
        self._told_at = 0.0
        self._closed = False
        for side in self._sides:
            # Shows the bridge to those beside it, too.
            teller = side.node.create_publisher(
                f"{side.name.full}/statistics", _STRING, QoS.latched()
            )
            self._tellers.append(teller)
        self._worker = Worker("bridge", self._follow, _PAUSE)
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
        """Return how it is doing."""
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
        """Stop relaying; safe to call twice, and with the worlds gone."""
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
        for teller in self._tellers:
            teller.close()
        for side in self._sides:
            if side.routes is not None:
                side.routes.close()

    # -- on the worker's thread ------------------------------------------------------------------

    def _follow(self, _: bool) -> None:
        if self._closed:
            return
        try:
            for side in self._sides:
                side.look()
            for side in self._sides:
                side.listen()
            for side in self._sides:
                self._follow_topics(side)
                for kind in self._offers:
                    self._follow_servers(side, kind)
            for side in self._sides:
                side.tell()
            self._miss("topic", self._topics, self._relays)
            for kind, rules in self._offers.items():
                there = {key[1:] for key in self._callable if key[0] == kind}
                self._miss(kind, rules, there)
            self._tell()
        except NodeClosedError:
            return  # the node went first

    def _follow_topics(self, side: Side) -> None:
        names = {*side.node.topics(), *self._topics.named(side.number)}
        names |= {name for number, name in self._relays if number == side.number}
        parts = self._parts_of_actions(side)
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
                wanted = True  # who is there is not known: what works goes on
            wanted = self._settled("topic", key, wanted, relay is not None)
            self._refuse("topic", key, other, side.ring(publishers))
            side.bring(f"topic {other}", publishers)
            if self._stands_by(side, other, relay) or (relay is not None and relay.outdated):
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

    def _stands_by(self, side: Side, other: str, relay: TopicRelay | None) -> bool:
        """Return whether another bridge between the two worlds relays a topic already."""
        beside = side.other.beside(side.other.node.publishers(other))
        if relay is None:
            return bool(beside) or not side.other.known
        return any(end.node < side.other.name for end in beside)

    def _parts_of_actions(self, side: Side) -> set[str]:
        """Return the topics of actions that are relayed as such."""
        rules = self._offers["action"]
        if not rules or side.node.wire != "ros1":
            return set()
        # In a world of ROS 1, they have the names that they have in the other.
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
            side.bring(side.other.key(kind, other), offers)
            servers = side.sources(offers)
            wanted = bool(servers) or (relay is not None and not side.connected)
            wanted = self._settled(kind, key, wanted, relay is not None)
            there = side.other.servers(kind, other)
            if relay is None and (side.other.beside(there) or not side.other.known):
                # In ROS 1 whoever offers a service last is called: nobody must be pushed aside.
                wanted = False
            elif any(end.node < side.other.name for end in side.other.beside(there)):
                wanted = False
            rivals = side.other.sources(there)
            told = side.ring(offers)
            if wanted and rivals:
                told = f"{rivals[0].node} offers it there already"
                wanted = False
            self._refuse(kind, key, other, told)
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

    def _miss(self, kind: str, rules: Rules, there: Collection[tuple[int, str]]) -> None:
        """Take note of what was asked for by its name, and is nowhere; and what may be meant."""
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
            told = f"nobody {'publishes' if kind == 'topic' else 'offers'} it{guess}"
            key = asked[0][0].number, asked[0][1]
            if missing:
                self._missing.add((kind, *key))
                self._refuse(kind, key, names[1 - key[0]], told)
            elif (kind, *key) in self._missing:
                self._missing.discard((kind, *key))
                self._refuse(kind, key, names[1 - key[0]], "")

    def _refuse(self, kind: str, key: tuple[int, str], other: str, problem: str) -> None:
        """Take note of why something is not relayed; no problem: it is."""
        refusal = kind, *key
        if not problem and refusal not in self._refused:
            return
        with self._lock:
            if problem:
                sign = "->" if key[0] == 0 else "<-"
                self._refused[refusal] = RelayStatus(kind, key[1], other, sign, problem=problem)
            else:
                del self._refused[refusal]

    def _settled(self, kind: str, key: tuple[int, str], wanted: bool, there: bool) -> bool:
        """Return whether something is wanted, or was until just now."""
        if wanted or not there:
            self._missed.pop((kind, *key), None)
            return wanted
        since = self._missed.setdefault((kind, *key), time.monotonic())
        return time.monotonic() - since < _GONE

    def _type_of(self, side: Side, name: str, other: str) -> str:
        """Return the type that was given for a topic or service."""
        first, second = (name, other) if side.number == 0 else (other, name)
        return self._types.get(first) or self._types.get(second, "")

    def _tell(self) -> None:
        now = time.monotonic()
        if now - self._told_at < _TELL:
            return
        self._told_at = now
        line = self.status().line()
        for teller in self._tellers:
            with suppress(Error):
                teller.publish(data=line)


def _absolute(name: str) -> str:
    return name if name.startswith("/") else f"/{name}"
