"""Which type a subscription receives, and every definition of it that publishers announce."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rosglass.errors import Error
from rosglass.ros2.announced import nodes_of

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from rosglass.comm import EndpointInfo
    from rosglass.comm.types import Types
    from rosglass.messages import MessageType

__all__ = ["TopicTypes"]

#: Unknown definitions that are named, of publishers that announce nothing.
_MAX_STRANGERS = 16


class TopicTypes:
    """The type of one topic, as it was asked for and as publishers announce it.

    Asked for by name, or not at all, every version is understood that the library has or the robot
    sends. What nobody can define becomes opaque, where bytes are welcome.

    Args:
        topic: For messages.
        types: Finds definitions.
        wanted: A type, which stays; a type's name; or None to take what is published.
        known: The type of that name, if the library has it.
        opaque: Whether bytes are welcome that cannot be decoded.
        changed: Called, from any thread, when it is worth calling :meth:`follow` again.

    Attributes:
        type: The type to receive; None while it is open.
        accepted: The type for each hash that samples may have; the empty one stands for samples
            of publishers that have none.
        problems: What :meth:`follow` found to be wrong, in words.
    """

    def __init__(
        self,
        topic: str,
        types: Types,
        wanted: MessageType | str | None,
        known: MessageType | None,
        opaque: bool,
        changed: Callable[[], None],
    ) -> None:
        self._topic, self._types, self._changed = topic, types, changed
        self._opaque = opaque
        self._fixed = wanted is not None and not isinstance(wanted, str)
        self._given = _full_name(wanted) if isinstance(wanted, str) else ""
        self._hash = ""
        #: Whether the type is opaque only for want of a definition.
        self._makeshift = False
        self._failures: dict[tuple[str, str], _Failure] = {}
        #: Hashes that samples came with and nobody announced.
        self._strangers: set[str] = set()
        #: Hashes that are accepted as opaque, for want of a definition.
        self._undefined: set[str] = set()
        self.type: MessageType | None = None
        self.accepted: dict[str, MessageType] = {}
        self.problems: list[str] = []
        if known is not None:
            self._take(known)

    def accepts(self, endpoint: EndpointInfo) -> bool:
        """Return whether the samples of a publisher can be handed on, as far as it says."""
        ours = self.type
        if ours is None or endpoint.type != ours.name:
            return False
        return not self._hash or endpoint.type_hash in self.accepted

    def find_type(self, type_hash: str) -> MessageType | None:
        """Return the type for samples with an unknown hash; from any thread, at once."""
        ours = self.type
        if ours is not None and not self._hash:
            # Opaque without hash: any will do, and is kept for passing the samples on.
            if len(self.accepted) <= _MAX_STRANGERS:
                self.accepted[type_hash] = self._types.opaque(
                    ours.name, type_hash, getattr(ours, "reason", "")
                )
            return self.accepted.get(type_hash, ours)
        if type_hash not in self._strangers and len(self._strangers) < _MAX_STRANGERS:
            self._strangers.add(type_hash)
            self._changed()
        return None

    def follow(self, publishers: Sequence[EndpointInfo], retry: bool) -> bool:
        """Follow what is published now.

        Args:
            publishers: The topic's publishers.
            retry: Whether to look again for definitions that were not found before.

        Returns:
            Whether :attr:`type` is another one now.
        """
        self.problems = []
        before = self.type
        name = self._name(publishers)
        if name and not self._fixed:
            of_name = [p for p in publishers if p.type == name]
            self._choose(name, of_name, retry)
            self._add_versions(name, of_name, retry)
        self._compare(publishers)
        return self.type is not before

    def _name(self, publishers: Sequence[EndpointInfo]) -> str:
        """Return the name of the type to receive, empty while that is open."""
        if self._given:
            return self._given
        ours = "" if self.type is None else self.type.name
        types = sorted({publisher.type for publisher in publishers})
        if self._fixed or ours in types or not types:
            return ours
        if len(types) == 1:
            return types[0]
        told = ", ".join(f"{t} by {nodes_of(p for p in publishers if p.type == t)}" for t in types)
        example = f"create_subscription({self._topic!r}, {types[0]!r})"
        self.problems.append(f"published with several types ({told}); choose one, e.g. {example}")
        return ours

    def _choose(self, name: str, publishers: Sequence[EndpointInfo], retry: bool) -> None:
        """Take the version that is published; the library's own when there are several."""
        hashes = sorted({p.type_hash for p in publishers if p.type_hash})
        ours = self.type if self.type is not None and self.type.name == name else None
        if ours is not None and not self._makeshift and (len(hashes) != 1 or self._hash in hashes):
            return
        if ours is None and not publishers:
            return
        versions = hashes if len(hashes) == 1 else ["", *hashes]
        for version in versions:
            found = self._load(name, version, publishers, retry)
            if found is not None:
                self._take(found)
                return
        failure = self._failures[name, versions[0]]
        if ours is not None and not self._makeshift:
            return  # what cannot be had is named below
        as_bytes = self._opaque and not failure.pending
        self.problems.append(failure.told(nodes_of(publishers), name, as_bytes))
        if as_bytes:
            self._take_opaque(name, versions[0] if len(versions) == 1 else "", failure.reason)

    def _add_versions(self, name: str, publishers: Sequence[EndpointInfo], retry: bool) -> None:
        """Accept every other version that can be had."""
        if self.type is None or self.type.name != name or self._makeshift:
            return
        announced = {p.type_hash for p in publishers if p.type_hash}
        for version in sorted(announced | self._strangers):
            if version in self.accepted and version not in self._undefined:
                continue
            found = self._load(name, version, publishers, retry)
            if found is not None:
                self.accepted[version] = found
                self._strangers.discard(version)
                self._undefined.discard(version)
            elif self._opaque and not self._given:
                failure = self._failures[name, version]
                if not failure.pending and version not in self._undefined:
                    self._undefined.add(version)
                    self.accepted[version] = self._types.opaque(name, version, failure.reason)

    def _load(
        self, name: str, version: str, publishers: Sequence[EndpointInfo], retry: bool
    ) -> MessageType | None:
        failed = self._failures.get((name, version))
        if failed is not None and not failed.pending and not retry:
            return None
        try:
            found = self._types.message(name, version)
        except Error as error:
            reason = self._types.request(name, version, publishers, self._changed)
            self._failures[name, version] = _Failure(str(error), reason)
            return None
        self._failures.pop((name, version), None)
        return found

    def _take(self, found: MessageType) -> None:
        self._makeshift = False
        self._strangers.clear()
        self._undefined.clear()
        self.type, self._hash = found, found.type_hash
        self.accepted = {"": found, self._hash: found}

    def _take_opaque(self, name: str, type_hash: str, reason: str) -> None:
        made = self._types.opaque(name, type_hash, reason)
        if self.type != made:
            self._take(made)
        self._makeshift = True

    def _compare(self, publishers: Sequence[EndpointInfo]) -> None:
        """Say whose samples are not understood."""
        ours = self.type
        if ours is None:
            return
        others = [p for p in publishers if p.type != ours.name]
        if others:
            types = ", ".join(sorted({p.type for p in others}))
            self.problems.append(f"{nodes_of(others)} publishes {types} here, not {ours.name}")
        if not self._hash:
            return
        strangers = dict.fromkeys(self._strangers - self.accepted.keys(), "")
        for publisher in publishers:
            unknown = publisher.type_hash not in self.accepted or (
                publisher.type_hash in self._undefined
            )
            if publisher.type == ours.name and unknown:
                strangers[publisher.type_hash] = f" of {publisher.node}"
        for version, who in sorted(strangers.items()):
            failure = self._failures.get((ours.name, version))
            if version in self._undefined:
                effect = "its samples are handed on as bytes"
            elif failure is not None and failure.pending:
                effect = "its samples are refused until that is fetched from the robot"
            else:
                effect = "its samples are refused; add the robot's definition to the library"
            self.problems.append(
                f"the publisher{who} has another definition of {ours.name} ({version}, ours is "
                f"{self._hash}): {effect}"
            )


class _Failure:
    """Why a definition could not be had."""

    def __init__(self, error: str, reason: str) -> None:
        self.pending = not reason
        self.reason = f"{error}; {reason}"

    def told(self, who: str, name: str, as_bytes: bool) -> str:
        if self.pending:
            return f"{who} publishes {name}, whose definition is being fetched from the robot"
        effect = "it is handed on as bytes, and " if as_bytes else ""
        return (
            f"{who} publishes {name}, which cannot be decoded: {self.reason}; {effect}this is "
            "tried again until a definition is found"
        )


def _full_name(name: str) -> str:
    from rosglass.interfaces import join_name  # noqa: PLC0415 - not needed to connect

    return join_name(name)
