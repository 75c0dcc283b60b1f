"""Keeping one subscription fed: its type, its reader, and what stands in the way of its samples."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING

from rosglass.comm import Sample, Time
from rosglass.errors import Error
from rosglass.ros2.repeats import Repeats

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from rosglass.comm import EndpointInfo, Handle, NodeName, Subscription
    from rosglass.messages import MessageType
    from rosglass.ros2.middleware import Middleware

__all__ = ["Reading"]


class Reading:
    """Serves a subscription.

    Args:
        subscription: Whom to serve.
        wanted: The type it was created with, None to take what is published.
        middleware: Where samples come from.
        node: The node it belongs to.
        load: Finds a type by name; raises a rosglass error when it cannot.
        wake: Asks for an :meth:`update` soon.
    """

    def __init__(
        self,
        subscription: Subscription,
        wanted: MessageType | None,
        middleware: Middleware,
        node: NodeName,
        load: Callable[[str], MessageType],
        wake: Callable[[], None],
    ) -> None:
        self.subscription = subscription
        self._wanted = wanted
        self._middleware, self._node, self._load, self._wake = middleware, node, load, wake
        self._lock = threading.Lock()
        self._reader: Handle | None = None
        self._type: MessageType | None = None
        self._closed = False
        self._failed = ""
        self._failure = ""
        self._strangers: set[str] = set()

    def start(self) -> None:
        """Begin to receive, if the type is known already."""
        if self._wanted is not None:
            self._read(self._wanted)

    def update(self, publishers: Sequence[EndpointInfo], retry: bool) -> None:
        """Follow a change of the graph.

        Args:
            publishers: The topic's publishers.
            retry: Whether to look again for a definition that was not found before.
        """
        if self._closed:
            return
        problems = [] if self._wanted else self._discover(publishers, retry)
        if self._type is not None:
            problems += self._compare(self._type, publishers)
        self.subscription.set_problem("; ".join(problems))

    def close(self) -> None:
        """Stop receiving."""
        with self._lock:
            self._closed = True
            reader, self._reader = self._reader, None
        if reader is not None:
            reader.close()

    def _discover(self, publishers: Sequence[EndpointInfo], retry: bool) -> list[str]:
        by_type: dict[str, list[EndpointInfo]] = {}
        for publisher in publishers:
            by_type.setdefault(publisher.type, []).append(publisher)
        if not by_type or (self._type is not None and self._type.name in by_type):
            return []
        if len(by_type) > 1:
            told = ", ".join(f"{name} by {_nodes(who)}" for name, who in sorted(by_type.items()))
            example = f"create_subscription({self.subscription.topic!r}, {min(by_type)!r})"
            return [f"published with several types ({told}); choose one, e.g. {example}"]
        (name,) = by_type
        if name == self._failed and not retry:
            return [self._failure]
        try:
            found = self._load(name)
        except Error as error:
            self._failed = name
            self._failure = (
                f"{_nodes(by_type[name])} publishes {name}, which cannot be decoded: {error}; "
                "it is tried again until a definition is found"
            )
            return [self._failure]
        self._failed = ""
        self._read(found)
        return []

    def _compare(self, ours: MessageType, publishers: Sequence[EndpointInfo]) -> list[str]:
        problems = []
        others = [p for p in publishers if p.type != ours.name]
        if others:
            types = ", ".join(sorted({p.type for p in others}))
            problems.append(f"{_nodes(others)} publishes {types} here, not {ours.name}")
        strangers = dict.fromkeys(self._strangers, "")
        for publisher in publishers:
            if publisher.type == ours.name and not self._understands(ours, publisher.type_hash):
                strangers[publisher.type_hash] = f" of {publisher.node}"
        problems += [
            f"the publisher{who} has another definition of {ours.name} ({name}; ours is "
            f"{ours.rihs01}): its samples are refused; add the robot's definition to the library"
            for name, who in strangers.items()
        ]
        for publisher in publishers:
            conflict = self.subscription.qos.incompatibility(publisher.qos)
            if publisher.type == ours.name and conflict:
                so = (
                    "nothing is received from it"
                    if self._middleware.matches_qos
                    else "it is received without that guarantee"
                )
                problems.append(
                    f"quality of service of {publisher.node} does not match ({conflict}): {so}; "
                    "subscribe with what it offers"
                )
        return problems

    def _read(self, message_type: MessageType) -> None:
        name, type_hash = message_type.name, message_type.rihs01
        repeats = Repeats()
        deliver, strangers = self.subscription.deliver, self._strangers
        strangers.clear()

        def on_sample(
            data: bytes, received: int, sent: int | None, gid: bytes, sequence: int, hash: str
        ) -> None:
            if hash not in ("", type_hash):
                if hash not in strangers:
                    strangers.add(hash)
                    self._wake()
            elif not repeats.seen(gid, sequence, sent):
                stamp = None if sent is None else Time(sent)
                deliver(Sample(data, self.WIRE, message_type, Time(received), stamp, gid, sequence))

        self._type = message_type
        self.subscription.set_type(message_type)
        reader = self._middleware.create_reader(
            self._node, self.subscription.topic, name, type_hash, self.subscription.qos, on_sample
        )
        with self._lock:
            old, self._reader = self._reader, reader
            if self._closed:
                old, self._reader = reader, None
        if old is not None:
            old.close()

    WIRE = "cdr"

    @staticmethod
    def _understands(ours: MessageType, type_hash: str) -> bool:
        return type_hash in ("", ours.rihs01)


def _nodes(endpoints: Sequence[EndpointInfo]) -> str:
    return ", ".join(sorted({endpoint.node.full for endpoint in endpoints}))
