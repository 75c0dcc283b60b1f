"""The type of a service or action, in the version that its peers announce."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Generic, Protocol, TypeVar

from rosglass.comm.events import describe_mismatch
from rosglass.errors import DefinitionConflictError, Error
from rosglass.interfaces.hashes import announced_hashes

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from rosglass.comm import EndpointInfo
    from rosglass.interfaces.definition import InterfaceDefinition
    from rosglass.ros2.core import Core

__all__ = [
    "Announced",
    "choose_type_name",
    "duplicate_servers",
    "endpoint_id",
    "mismatches",
    "nodes_of",
    "request_definition",
]


class _Type(Protocol):
    name: str

    @property
    def definition(self) -> InterfaceDefinition: ...


_T = TypeVar("_T", bound=_Type)


class Announced(Generic[_T]):
    """A type in the version that peers announce by its hash.

    A version that the library does not have is fetched from the peers.

    Args:
        core: The node.
        load: Returns the type with a name and hash; raises an Error if there is none.
        given: The type that the user gave; None to use the one that peers announce.
        fixed: Whether the given type stays, whatever peers announce.

    Attributes:
        type: The type; None while it is unknown.
        hash: Its own hash, empty without type.
        hashes: The hashes by which peers announce it; see
            :func:`rosglass.interfaces.hashes.announced_hashes`.
        failure: Why the announced version is not available; empty if it is.
        pending: Whether it is being fetched.
    """

    def __init__(
        self, core: Core, load: Callable[[str, str], _T], given: _T | None, fixed: bool
    ) -> None:
        self._core, self._load, self._fixed = core, load, fixed
        self._failed: tuple[str, str] | None = None
        self.type: _T | None = None
        self.hash, self.hashes = "", frozenset[str]()
        self._response_hash = ""
        self.failure = ""
        self.pending = False
        if given is not None:
            self._set(given)

    def follow(self, name: str, peers: Sequence[EndpointInfo], retry: bool) -> bool:
        """Adopt the version of the type `name` that `peers` announce.

        Args:
            name: The type's name, as peers spell it.
            peers: The peers; those with another type are ignored.
            retry: Whether to search again for a definition that was not found before.

        Returns:
            Whether the type has changed.
        """
        if self._fixed:
            return False
        current = self.type if self.type is not None and self.type.name == name else None
        hashes = {self._version(peer) for peer in peers if peer.type == name} - {""}
        if current is not None and (len(hashes) != 1 or hashes <= self.hashes):
            self._clear()
            return False
        wanted = (name, hashes.pop() if len(hashes) == 1 else "")
        if wanted == self._failed and not retry:
            return False
        try:
            found = self._load(*wanted)
            self._check(found, peers)
        except Error as error:
            self.failure, self.pending = request_definition(self._core, *wanted, peers, error)
            self._failed = None if self.pending else wanted
            return False
        self._clear()
        self._set(found)
        return True

    def describe_difference(self, peer: EndpointInfo, verb: str) -> str:
        """Return in words how a peer's type or version differs; see :func:`mismatches`."""
        theirs, ours = peer.type_hash, self.hash
        if theirs in self.hashes and peer.response_hash:
            theirs, ours = f"of its response: {peer.response_hash}", self._response_hash
        name = "" if self.type is None else self.type.name
        return describe_mismatch(peer.node, verb, (peer.type, theirs), (name, ours))

    def is_compatible(self, peer: EndpointInfo) -> bool:
        """Return whether a peer uses this type in this version, as far as it announces them."""
        return (
            self.type is not None
            and peer.type == self.type.name
            and self.hashes.issuperset(filter(None, (peer.type_hash, peer.response_hash)))
        )

    def _version(self, peer: EndpointInfo) -> str:
        """Return a peer's hash to compare with ours: its response's if only that differs."""
        if peer.type_hash in self.hashes and peer.response_hash not in self.hashes:
            return peer.response_hash or peer.type_hash
        return peer.type_hash

    def _check(self, found: _T, peers: Sequence[EndpointInfo]) -> None:
        """Raise DefinitionConflictError for a version with the peers' response alone."""
        hashes = announced_hashes(found.definition)
        for peer in peers:
            if peer.response_hash in hashes and peer.type_hash not in hashes:
                raise DefinitionConflictError(
                    f"no definition has both its request ({peer.type_hash}) and its response "
                    f"({peer.response_hash})"
                )

    def _clear(self) -> None:
        self._failed, self.failure, self.pending = None, "", False

    def _set(self, found: _T) -> None:
        hashes = announced_hashes(found.definition)
        self.type, self.hash, self._response_hash = found, hashes[0], hashes[-1]
        accepted = hashes if self._core.middleware.announces_requests else hashes[:1]
        self.hashes = frozenset(accepted)


def request_definition(
    core: Core, name: str, hash: str, peers: Sequence[EndpointInfo], error: Error
) -> tuple[str, bool]:
    """Request a definition that the library does not have from peers.

    Args:
        core: The node; its members follow when the definition is received.
        name: The type's name.
        hash: The hash by which peers announce it, empty if they announce none.
        peers: The peers that use it.
        error: Why the library does not have it.

    Returns:
        The problem in words, and whether a response is pending.
    """
    having = [peer for peer in peers if peer.type.startswith(name)]
    nodes = nodes_of(having) or "the robot"
    reason = core.types.request(name, hash, having, core.wake)
    if not reason:
        return f"{nodes} has {name}, whose definition is being fetched from the robot", True
    return (
        f"{nodes} has {name}, which cannot be used: {error}; {reason}; this is tried again until a "
        "definition is found"
    ), False


def choose_type_name(names: Iterable[str], current: str, example: str) -> tuple[str, str]:
    """Return the name of the type to use, and the problem if peers announce several.

    Args:
        names: The names that peers announce.
        current: The name in use, empty if there is none.
        example: A call that gives the type, with ``{}`` for its name.
    """
    found = sorted(set(names))
    if current in found or not found:
        return current, ""
    if len(found) == 1:
        return found[0], ""
    call = example.format(repr(found[0]))
    return current, f"offered with several types ({', '.join(found)}); choose one, e.g. {call}"


def mismatches(
    announced: Announced[Any], peers: Sequence[EndpointInfo], verb: str, effect: str
) -> list[str]:
    """Return the mismatches between peers and a type, and their effect, one sentence each.

    Args:
        announced: Our type.
        peers: Servers or clients.
        verb: ``offers`` or ``calls``.
        effect: The effect, e.g. ``it cannot be called``.
    """
    problems: dict[str, None] = {}
    if announced.type is None:
        return []
    for peer in peers:
        if not announced.is_compatible(peer):
            known = peer.type == announced.type.name
            remedy = "; add the robot's definition to the library" if known else ""
            wrong = announced.describe_difference(peer, verb)
            problems[f"{wrong}: {effect}{remedy}"] = None
    return list(problems)


def duplicate_servers(servers: Sequence[EndpointInfo], name: str) -> list[str]:
    """Return the problem that several nodes offer the same service or action, if they do."""
    if len({server.node for server in servers}) < 2:
        return []
    effect = "each executes every request, and the first response is taken; stop all but one"
    return [f"{nodes_of(servers)} all offer {name}: {effect}"]


def endpoint_id(peer: EndpointInfo) -> bytes | str:
    """Return the identity of a peer; its successor has a different one."""
    return peer.gid or peer.node.full


def nodes_of(peers: Iterable[EndpointInfo]) -> str:
    """Return the names of the nodes that peers belong to, for messages."""
    return ", ".join(sorted({peer.node.full for peer in peers}))
