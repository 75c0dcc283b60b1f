"""Keeping one subscription fed: its type, its reader, and what stands in the way of its samples."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING

from rosglass.comm import EndpointKind, Sample
from rosglass.errors import Error, NodeClosedError
from rosglass.ros2.core import Member
from rosglass.ros2.repeats import Repeats

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rosglass.comm import EndpointInfo, Handle, Subscription
    from rosglass.messages import MessageType
    from rosglass.ros2.core import Core
    from rosglass.ros2.middleware import OnSample

__all__ = ["Reading"]

#: Unknown definitions that are named, of publishers that announce nothing.
_MAX_STRANGERS = 16


class Reading(Member):
    """Serves a subscription from its creation to its end.

    A subscription created with a type keeps it. One created with a type's name takes the version
    of it that the robot publishes, if the library has it; one created without takes the type that
    is published.

    Args:
        core: The node it belongs to.
        subscription: Whom to serve.
        wanted: Type or type name it was created with; None to take what is published.
    """

    def __init__(
        self, core: Core, subscription: Subscription, wanted: MessageType | str | None
    ) -> None:
        self.subscription = subscription
        self._core = core
        self._discovers = wanted is None
        self._fixed = not (wanted is None or isinstance(wanted, str))
        self._lock = threading.Lock()
        self._reader: Handle | None = None
        self._type: MessageType | None = None
        self._hash = ""
        self._closed = False
        self._failed: tuple[str, str] | None = None
        self._failure = ""
        self._strangers: set[str] = set()
        subscription.on_close = self.close
        if subscription.type is not None:
            self.read(subscription.type)
        core.add(self)
        core.wake()

    def read(self, message_type: MessageType) -> None:
        """Receive samples of `message_type` from now on, instead of any before."""
        self._strangers.clear()
        self._type, self._hash = message_type, message_type.rihs01
        self.subscription.set_type(message_type)
        reader = self._core.middleware.create_reader(
            self._core.name,
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

    def follow(self, moved: bool, idle: bool) -> None:  # noqa: ARG002 - types may be added, too
        """Follow the graph; now and then look again for a definition that was not found."""
        topic = self.subscription.topic
        try:
            self._update(self._core.graph.endpoints(EndpointKind.PUBLISHER, topic), idle)
        except NodeClosedError:
            raise
        except Error as error:
            self.subscription.set_problem(str(error))

    def close(self) -> None:
        """Stop receiving."""
        with self._lock:
            if self._closed:
                return
            self._closed = True
            reader, self._reader = self._reader, None
        self.subscription.close()
        if reader is not None:
            reader.close()
        self._core.remove(self)

    def _update(self, publishers: Sequence[EndpointInfo], retry: bool) -> None:
        if self._closed:
            return
        problems: list[str] = []
        name = self._name(publishers, problems)
        if name and not self._fixed:
            self._select(name, publishers, retry, problems)
        if self._type is not None:
            problems += self._compare(self._type, publishers)
        self.subscription.set_problem("; ".join(problems))

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
                found = self._core.types.message(*wanted)
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
                    if self._core.middleware.matches_qos
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
        # As Sample(...) does, in half the time.
        make, deliver, wire = tuple.__new__, self.subscription.deliver, "cdr"

        def receive(
            data: bytes | memoryview,
            received: int,
            sent: int | None,
            gid: bytes,
            sequence: int,
            hash: str,
        ) -> None:
            if hash not in ("", ours):
                if hash not in strangers and len(strangers) < _MAX_STRANGERS:
                    strangers.add(hash)
                    self._core.wake()
            elif not repeats.seen(gid, sequence, sent):
                deliver(make(Sample, (data, wire, message_type, received, sent, gid, sequence)))

        return receive


def _nodes(endpoints: Sequence[EndpointInfo]) -> str:
    return ", ".join(sorted({endpoint.node.full for endpoint in endpoints}))
