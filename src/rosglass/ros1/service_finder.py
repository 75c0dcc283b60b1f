"""Finding a service's server for a client: where it is, which type it has, what is wrong."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Protocol

from rosglass.comm.names import similar
from rosglass.errors import ConnectionLostError, Error
from rosglass.ros1.service_probe import locate, probe
from rosglass.ros1.types import ANY

if TYPE_CHECKING:
    from rosglass.messages import ServiceType
    from rosglass.ros1.core import Core
    from rosglass.ros1.service_probe import Peer, Place
    from rosglass.ros1.service_requester import ServiceLink
    from rosglass.ros1.services import Services

__all__ = ["FinderOwner", "ServiceFinder"]

#: Seconds for which the master's word where a server is counts, when calls come one by one.
_TRUST = 1.0
#: Seconds between looks for a server while somebody waits for it.
_RETRY = 0.2
#: Seconds between looks whether the server lives: one that was killed stays with the master.
_CHECK, _CHECK_ABSENT = 3.0, 1.0


class FinderOwner(Protocol):
    """For whom a server is looked for; called in the loop's thread."""

    @property
    def waits(self) -> bool:
        """Whether somebody waits for the server."""

    @property
    def busy(self) -> bool:
        """Whether there are connections with it, which tell more than a probe."""

    def server_found(self, moved: bool) -> None:
        """Take that it is known where the server is, and whether that is another place now."""

    def server_changed(self) -> None:
        """Take that something else is known of the server."""


class ServiceFinder:
    """Knows what can be known of a service's server; in the loop's thread, unless said otherwise.

    Args:
        core: The node.
        services: The node's services.
        name: Absolute service name.
        wanted: The type, its name, or None for whatever type the server announces.
        owner: Told what is found.

    Attributes:
        type: The service type; None while it is not known.
        peer: What the server said of itself; None when there is none, as far as is known.
        place: Where it is, as far as is known.
        asked: Monotonic time at which the master was asked for the place; 0 when it has to be
            asked again.
    """

    def __init__(
        self,
        core: Core,
        services: Services,
        name: str,
        wanted: ServiceType | str | None,
        owner: FinderOwner,
    ) -> None:
        self.name = name
        self.type: ServiceType | None = None if wanted is None else core.types.service(wanted)
        self.peer: Peer | None = None
        self.place: Place | None = None
        self.asked = 0.0
        self._core, self._services, self._owner = core, services, owner
        self._discovers, self._fixed = wanted is None, not isinstance(wanted, (str, type(None)))
        self._looking = self._probing = self._retrying = self._closed = False
        #: When to see next whether the server lives.
        self._due = 0.0
        #: Why the server cannot be reached, or its type is not known; empty when that is not so.
        self._fault = self._type_fault = ""
        self._nodes: list[str] = []
        #: Type and md5 sum for which a definition was looked for last.
        self._tried: tuple[str, str] | None = None

    # -- what is known; from any thread ----------------------------------------------------------

    @property
    def ready(self) -> bool:
        """Whether a server is there that understands the requests."""
        return self.peer is not None and self.type is not None and not self.mismatch()

    @property
    def server(self) -> str:
        """The server, for people."""
        peer = self.peer
        return "its server" if peer is None else peer.node

    def mismatch(self) -> str:
        """Say that the server has another definition; empty when it has ours."""
        peer, ours = self.peer, self.type
        if peer is None or ours is None or peer.md5 in (ANY, ours.md5):
            return ""
        return (
            f"{peer.node} offers {self.name} as {peer.type or 'an unknown type'} with md5 "
            f"{peer.md5}, not as {ours.name} with md5 {ours.md5}: it cannot be called; add the "
            "robot's definition to the library, or leave out the type. Ours:\n"
            f"{self._core.types.text(ours).strip()}"
        )

    def conflict(self) -> str:
        """Say what a person has to mend; empty when nothing."""
        if self.peer is not None and self.type is None:
            return self._type_fault
        return self.mismatch()

    def absence(self) -> str:
        """Say why no server is there although nothing is wrong."""
        if self._fault:
            return self._fault
        known = self._core.graph.services()
        if self.name in known:
            return f"{' and '.join(known[self.name])} offers it, and is being asked for its type"
        kind = "" if self.type is None else f" [{self.type.name}]"
        return (
            f"no server offers {self.name}{kind} on {self._core.url} ({self._core.status()})"
            f"{similar(self.name, known)}"
        )

    # -- where it is -----------------------------------------------------------------------------

    def current(self) -> Place | None:
        """Return where the server is; None, and ask the master, if that was not known lately."""
        if self.place is None or time.monotonic() - self.asked > _TRUST:
            self.look()
            return None
        return self.place

    def look(self) -> None:
        """Ask the master where the server is, and the server for its type if need be."""
        if self._looking or self._retrying or self._closed:
            return
        self._looking = True
        self._services.errands.run(self._locate)

    def _locate(self) -> None:
        """Ask the master; on a thread that may wait."""
        place, fault = None, ""
        try:
            place = locate(self._core.master, self.name)
        except ConnectionLostError as error:
            fault = str(error)
        self._core.loop.call(lambda: self._located(place, fault))

    def _located(self, place: Place | None, fault: str) -> None:
        self._looking = False
        if self._closed:
            return
        self.asked = time.monotonic()
        if fault and self.peer is not None and self.place is not None:
            place = self.place  # only the master is away: the server is called where it was
        else:
            self._fault = fault
        if place is None:
            self._due = self.asked + _CHECK_ABSENT
            self.place = self.peer = None
            self._owner.server_changed()
            self._retry()
            return
        moved = self.place is None or self.place.uri != place.uri
        self.place = place
        self._owner.server_found(moved)
        wanted = self.peer is None or moved or self.asked >= self._due
        if wanted and not self._probing and not self._owner.busy:
            self._probe(place)

    def _retry(self) -> None:
        """Look again soon if somebody waits."""
        if self._owner.waits and not self._retrying:
            self._retrying = True
            self._core.loop.after(_RETRY, self._again)

    def _again(self) -> None:
        self._retrying = False
        if self._owner.waits:
            self.look()

    # -- what it says ----------------------------------------------------------------------------

    def _probe(self, place: Place) -> None:
        self._probing = True
        try:
            probe(self._core, self.name, place, lambda peer, why: self._probed(place, peer, why))
        except OSError as error:  # no more sockets
            self._probed(place, None, error.strerror or str(error))

    def _probed(self, place: Place, peer: Peer | None, why: str) -> None:
        self._probing = False
        if self._closed:
            return
        if peer is not None:
            self.on_server_header(peer)
        else:
            self.fail(place, why)

    def on_server_header(self, peer: Peer) -> None:
        """Take what the server says of itself."""
        if self._closed:
            return
        self._due = time.monotonic() + _CHECK
        self.peer, self._fault = peer, ""
        self._services.types.note(self.name, peer)
        key, ours = (peer.type, peer.md5), self.type
        fits = ours is not None and peer.md5 in (ANY, ours.md5)
        if self._discovers and fits and ours is not None:
            fits = peer.type in ("", ours.name)
        if fits:
            self._tried, self._type_fault = key, ""
        elif not self._fixed and (key != self._tried or self._type_fault):
            self._tried = key
            self._services.errands.run(lambda: self._learn(peer))
        self._owner.server_changed()

    def _learn(self, peer: Peer) -> None:
        """Find the definition that the server has; on a thread that may wait."""
        kind, fault = None, ""
        try:
            kind = self._core.types.announced_service(peer.type, peer.md5)
        except Error as error:
            fault = f"{peer.node} offers it as {peer.type or 'an unknown type'}: {error}"
        self._core.loop.call(lambda: self._learned(peer, kind, fault))

    def _learned(self, peer: Peer, kind: ServiceType | None, fault: str) -> None:
        if self._closed or self._tried != (peer.type, peer.md5):
            return
        same_name = self.type is None or kind is None or kind.name == self.type.name
        if kind is not None and (self._discovers or same_name):
            self.type = kind
        self._type_fault = fault
        self._owner.server_changed()
        self._owner.server_found(moved=False)

    def fail(self, place: Place, why: str) -> None:
        """Take that the server cannot be reached."""
        self._due = time.monotonic() + _CHECK_ABSENT
        if self.place in (None, place):
            nodes = self._core.graph.services().get(self.name, [])
            who = f"{' and '.join(nodes)} offers" if nodes else "somebody offers"
            self._fault = (
                f"{who} it at {place.uri}, says the master, but calling it there fails: {why}; if "
                "it was killed, start it again, or let 'rosnode cleanup' remove it"
            )
            self.peer = self.place = None
        self._owner.server_changed()
        self._retry()

    def lose(self, link: ServiceLink, reason: str) -> None:
        """Take that a connection has ended which should not have."""
        if link.peer is None and not link.refusal:
            self.fail(link.place, reason)
            return
        if self.place in (None, link.place):
            self.asked = self._due = 0.0
        self._owner.server_changed()
        if self._owner.waits:
            self._retry()
        else:
            self.look()

    # -- following the graph ---------------------------------------------------------------------

    def follow(self) -> None:
        """Look what the master says, and now and then whether the server lives."""
        if self._closed:
            return
        nodes = self._core.graph.services().get(self.name, [])
        if nodes != self._nodes:
            self._nodes, self._due = nodes, 0.0
            if not nodes and not self._owner.waits:
                self.place = self.peer = None
                self._fault = ""
        # The graph may lag behind: who has come and gone between two looks is in none of them.
        known = bool(nodes or self._fault) or self.peer is not None
        if (known and time.monotonic() >= self._due) or self._owner.waits:
            self.look()
        self._owner.server_changed()

    def close(self) -> None:
        """Look for nobody any more; from any thread."""
        self._closed = True
