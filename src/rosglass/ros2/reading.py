"""Keeping one subscription fed: its type, its reader, and what stands in the way of its samples."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, Protocol

from rosglass.comm import Sample, Time
from rosglass.errors import Error
from rosglass.ros2.repeats import Repeats

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from rosglass.comm import EndpointInfo, Handle, NodeName, Subscription
    from rosglass.messages import MessageType
    from rosglass.ros2.middleware import Middleware, OnSample

__all__ = ["LoadType", "Reading"]

#: Unknown definitions that are named, of publishers that announce nothing.
_MAX_STRANGERS = 16


class LoadType(Protocol):
    """Finds types by name."""

    def __call__(self, name: str, hash: str = "") -> MessageType:
        """Return the type `name`, in the version that has `hash` if one is given.

        Raises:
            Error: Nobody has it, or it has an error.
        """


class Reading:
    """Serves a subscription.

    A subscription created with a type keeps it. One created with a type's name takes the version
    of it that the robot publishes, if the library has it; one created without takes the type that
    is published.

    Args:
        subscription: Whom to serve.
        wanted: Type or type name it was created with; None to take what is published.
        middleware: Where samples come from.
        node: The node it belongs to.
        load: Finds types.
        wake: Asks for an :meth:`update` soon.
    """

    def __init__(
        self,
        subscription: Subscription,
        wanted: MessageType | str | None,
        middleware: Middleware,
        node: NodeName,
        load: LoadType,
        wake: Callable[[], None],
    ) -> None:
        self.subscription = subscription
        self._discovers = wanted is None
        self._fixed = not (wanted is None or isinstance(wanted, str))
        self._middleware, self._node, self._load, self._wake = middleware, node, load, wake
        self._lock = threading.Lock()
        self._reader: Handle | None = None
        self._type: MessageType | None = None
        self._hash = ""
        self._closed = False
        self._failed: tuple[str, str] | None = None
        self._failure = ""
        self._strangers: set[str] = set()

    def read(self, message_type: MessageType) -> None:
        """Receive samples of `message_type` from now on, instead of any before."""
        self._strangers.clear()
        self._type, self._hash = message_type, message_type.rihs01
        self.subscription.set_type(message_type)
        reader = self._middleware.create_reader(
            self._node,
            self.subscription.topic,
            message_type.name,
            self._hash,
            self.subscription.qos,
            self._receiver(message_type),
        )
        with self._lock:
            old, self._reader = self._reader, reader
            if self._closed:
                self._reader = None
        if old is not None:
            old.close()
        if self._reader is None:
            reader.close()

    def update(self, publishers: Sequence[EndpointInfo], retry: bool) -> None:
        """Follow a change of the graph.

        Args:
            publishers: The topic's publishers.
            retry: Whether to look again for a definition that was not found before.
        """
        if self._closed:
            return
        problems: list[str] = []
        name = self._name(publishers, problems)
        if name and not self._fixed:
            self._select(name, publishers, retry, problems)
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

    def _name(self, publishers: Sequence[EndpointInfo], problems: list[str]) -> str:
        """Return the name of the type to receive, empty while that is open."""
        ours = "" if self._type is None else self._type.name
        types = sorted({publisher.type for publisher in publishers})
        if not self._discovers or ours in types or not types:
            return ours
        if len(types) == 1:
            return types[0]
        told = ", ".join(f"{t} by {_nodes([p for p in publishers if p.type == t])}" for t in types)
        example = f"create_subscription({self.subscription.topic!r}, {types[0]!r})"
        problems.append(f"published with several types ({told}); choose one, e.g. {example}")
        return ours

    def _select(
        self, name: str, publishers: Sequence[EndpointInfo], retry: bool, problems: list[str]
    ) -> None:
        """Load and read the version of the type that publishers announce."""
        hashes = {p.type_hash for p in publishers if p.type == name and p.type_hash}
        ours = self._type if self._type is not None and self._type.name == name else None
        if ours is not None and (len(hashes) != 1 or self._hash in hashes):
            return
        wanted = (name, hashes.pop() if len(hashes) == 1 else "")
        if wanted != self._failed or retry:
            try:
                found = self._load(*wanted)
            except Error as error:
                self._failed = wanted
                who = _nodes([p for p in publishers if p.type == name])
                self._failure = (
                    f"{who} publishes {name}, which cannot be decoded: {error}; "
                    "this is tried again until a definition is found"
                )
            else:
                self._failed = None
                self.read(found)
                return
        if self._type is None:
            problems.append(self._failure)

    def _compare(self, ours: MessageType, publishers: Sequence[EndpointInfo]) -> list[str]:
        """Say what keeps publishers' samples away."""
        problems = []
        others = [p for p in publishers if p.type != ours.name]
        if others:
            types = ", ".join(sorted({p.type for p in others}))
            problems.append(f"{_nodes(others)} publishes {types} here, not {ours.name}")
        strangers = dict.fromkeys(self._strangers, "")
        for publisher in publishers:
            if publisher.type != ours.name:
                continue
            if publisher.type_hash not in ("", self._hash):
                strangers[publisher.type_hash] = f" of {publisher.node}"
            conflict = self.subscription.qos.incompatibility(publisher.qos)
            if conflict:
                effect = (
                    "nothing is received from it"
                    if self._middleware.matches_qos
                    else "it is received without that guarantee"
                )
                problems.append(
                    f"quality of service offered by {publisher.node} does not match ({conflict}): "
                    f"{effect}; ask for no more than it offers"
                )
        problems += [
            f"the publisher{who} has another definition of {ours.name} ({type_hash}, ours is "
            f"{self._hash}): its samples are refused; add the robot's definition to the library"
            for type_hash, who in sorted(strangers.items())
        ]
        return problems

    def _receiver(self, message_type: MessageType) -> OnSample:
        ours, strangers, repeats = self._hash, self._strangers, Repeats()
        deliver, wire = self.subscription.deliver, "cdr"

        def receive(
            data: bytes, received: int, sent: int | None, gid: bytes, sequence: int, hash: str
        ) -> None:
            if hash not in ("", ours):
                if hash not in strangers and len(strangers) < _MAX_STRANGERS:
                    strangers.add(hash)
                    self._wake()
            elif not repeats.seen(gid, sequence, sent):
                stamp = None if sent is None else Time(sent)
                deliver(Sample(data, wire, message_type, Time(received), stamp, gid, sequence))

        return receive


def _nodes(endpoints: Sequence[EndpointInfo]) -> str:
    return ", ".join(sorted({endpoint.node.full for endpoint in endpoints}))
