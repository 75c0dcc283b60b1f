"""What everything created from one ROS 1 node shares: master, connections, graph, threads."""

from __future__ import annotations

import atexit
import logging
import threading
from contextlib import suppress
from typing import TYPE_CHECKING

from rosglass.comm import ConnectionState, Handle, Status
from rosglass.comm.core import NodeCore, NodeMember
from rosglass.errors import Error
from rosglass.ros1.address import bracketed, own_address
from rosglass.ros1.door import Door, listen
from rosglass.ros1.errands import Errands
from rosglass.ros1.graph import Graph
from rosglass.ros1.io_loop import IoLoop
from rosglass.ros1.master import Master
from rosglass.ros1.names import expand
from rosglass.ros1.registrations import Registrations
from rosglass.ros1.slave import Slave
from rosglass.ros1.types import Types
from rosglass.ros1.unreachable import Unreachable

if TYPE_CHECKING:
    import socket
    from collections.abc import Callable

    from rosglass.comm import EndpointKind, NodeName
    from rosglass.interfaces import Library
    from rosglass.ros1.options import Ros1Options
    from rosglass.ros1.slave import SlaveApi

__all__ = ["Core", "Member"]

_log = logging.getLogger("rosglass.ros1")
#: Seconds that closing waits until listeners were told that somebody else has closed the node.
_TELLING = 1.0


class Member(NodeMember):
    """Something created from a node: it is registered with the master, and ends with the node.

    Attributes:
        place: As what the master shows it once it is registered, and under which name: it is
            registered again should it be missing there. None for what the master does not show.
    """

    place: tuple[EndpointKind, str] | None = None

    def register(self, master: Master) -> None:
        """Tell the master of it; called on a thread that may wait, again after its restart.

        Raises:
            ConnectionLostError: The master does not answer; this is called again then.
            MasterError: It refuses.
        """

    def unregister(self, master: Master) -> Member | None:  # noqa: ARG002 - some are not known
        """Tell the master that it is gone; called on a thread that may wait.

        Returns:
            Who has its name in this node by now, if anybody: the master was told nothing then, and
            what it knows is the other's.
        """
        return None

    def lacks(self, publishers: int) -> bool:  # noqa: ARG002 - most have none
        """Return whether it is connected with fewer publishers than the master knows."""
        return False


class Core(NodeCore[Handle]):
    """Holds what a node consists of, and keeps its members registered and informed.

    Args:
        name: The node's name.
        url: What it was connected with, for people to read.
        options: Master, own address, remappings.
        library: Where definitions come from; None for the shared library.

    Attributes:
        master: Called from threads that may wait.
        graph: What the master knew at the last look.
        types: Finds types.
        loop: Waits for all sockets.
        errands: Runs what waits for others.
        unreachable: Told of publishers that cannot be reached.
        lookups: Runs what calls of services wait for: they must not queue behind what topics wait
            for.
        uri: The node's own API.
        address: Host and port where connections are accepted.
        services: Who takes a connection to a service, by its name; see :class:`Server`.
        topics: Who takes a connection to a topic, by its name.

    Raises:
        ConnectionLostError: This machine cannot listen for connections.
    """

    wire = "ros1"
    graph: Graph
    types: Types

    def __init__(
        self, name: NodeName, url: str, options: Ros1Options, library: Library | None
    ) -> None:
        super().__init__(name, url, _log)
        self.options = options
        self._new_names = options.arguments.remappings(name.name, name.namespace)
        self.master = Master(options.master, name.full)
        self.graph, self.types = Graph(), Types(library, url)
        self.errands = Errands(f"{name.name} errands")
        self.lookups = Errands(f"{name.name} lookups")
        self.address, self.uri = ("", 0), ""
        self._doors: list[Door] = []
        self._api: Slave | None = None
        self._telling = threading.Lock()
        self._status = Status(ConnectionState.CONNECTING, f"looking for {options.master}")
        sockets: list[socket.socket] = []
        try:
            for port in (options.tcpros_port, options.slave_port):
                sockets += [listen(options.address, port, url)]
        except BaseException:
            for sock in sockets:
                sock.close()
            raise
        self._tcpros, self._slave = sockets
        #: All addresses that the node's own API has had.
        self.uris: set[str] = set()
        self.move(options.address or own_address())
        self.loop = IoLoop(f"{name.name} connections")
        self.unreachable = Unreachable(self.loop, self.errands)
        self._registrations = Registrations(self)
        self._worker = self._start_following()

    def start(self, api: SlaveApi, accept: Callable[[socket.socket, str], None]) -> None:
        """Begin to listen, and to look for the master.

        Args:
            api: What the master and others can ask.
            accept: Called in the loop's thread with each connection and its address.
        """
        self._api = Slave(api)
        self._doors = [
            Door(self.loop, self._tcpros, accept),
            Door(self.loop, self._slave, self._api.accept),
        ]
        for door in self._doors:
            self.loop.call(door.open)
        # Threads that hand on messages must not meet an interpreter that is being taken down.
        atexit.register(self.close)
        self._registrations.start()

    def move(self, host: str) -> bool:
        """Let the node be reached under another host name or address; return whether it is."""
        place = (host, self._tcpros.getsockname()[1])
        moved = place != self.address
        if moved:
            self.address = place
            self.uri = f"http://{bracketed(host)}:{self._slave.getsockname()[1]}/"
            self.uris.add(self.uri)
        return moved

    def runs_here(self) -> bool:
        """Return whether the calling thread is one of the node's own."""
        threads = (
            self._worker,
            self._registrations,
            self.dispatcher,
            self.own_dispatcher,
            self.loop,
        )
        return any(thread.is_current for thread in threads)

    def resolve(self, name: str) -> str:
        """Return the absolute name of a topic, service or parameter, which may be remapped.

        Raises:
            InvalidNameError: The name breaks ROS's rules.
        """
        full = self.expand(name)
        return self._new_names.get(full, full)

    def expand(self, name: str) -> str:
        """Return the absolute name of anything, not remapped; raises InvalidNameError."""
        return expand(name, self.name.name, self.name.namespace)

    def add(self, member: Handle, follow: Callable[[bool, bool], None] | None = None) -> None:
        """Register a member and let it follow the graph; raises NodeClosedError after closing."""
        super().add(member, follow)
        if isinstance(member, Member):
            self._registrations.wake()
        self.wake()

    def remove(self, member: Handle) -> None:
        """Unregister a member that was closed, soon."""
        with self._lock:
            known = self._members.pop(member, None) is not None
        if known and not self._closed and isinstance(member, Member):
            self._registrations.forget(member)

    def registrable(self) -> list[Member]:
        """Return the members that the master knows, or is to know."""
        return [member for member in self.members() if isinstance(member, Member)]

    def _state(self) -> Status:
        return self._status

    def tell(self, status: Status) -> None:
        """Take a new status, and tell it; one that comes after the end is ignored."""
        with self._telling:
            if status == self._status or self._status.state is ConnectionState.CLOSED:
                return
            self._status = status
        self.status_listeners.notify(status)

    def shut_down(self, caller: str, reason: str) -> None:
        """Close the node soon, because somebody else says so; from any thread.

        Args:
            caller: Who says so.
            reason: Why, in the caller's words.
        """
        threading.Thread(
            target=self._shut_down, args=(caller, reason), name="shutdown", daemon=True
        ).start()

    def _shut_down(self, caller: str, reason: str) -> None:
        told = f"closed by {caller}: {reason or 'no reason given'}"
        owner = ""
        with suppress(Error):
            owner = self._registrations.owner()
        if not owner and len(self.uris) > 1 and "same name" in reason:
            return  # who has the name now is this node, under its new address
        if owner and owner not in told:
            told += f"; {owner} has the name {self.name} now"
        _log.warning("%s: %s", self.name, told)
        self.close(told, killed=not owner and "same name" not in reason)

    def close(self, reason: str = "closed", *, killed: bool = False) -> None:
        """Close every member, leave the graph and end the threads; safe to call twice.

        Takes about two seconds when the master does not answer.

        Args:
            reason: What the status says from now on.
            killed: As of the status.
        """
        if self.forked:
            self._closed = True
            return  # the threads did not come along
        with self._lock:
            if self._closed:
                return
            self._closed = True
            members = list(self._members)
        atexit.unregister(self.close)
        self.clock.close()
        for member in reversed(members):
            try:
                member.close()
            except Exception:  # noqa: PERF203 - the others must be closed all the same
                _log.exception("%s cannot be closed", member)
        self.timers.close()
        self._registrations.close()
        self._worker.close()
        self.errands.close()
        self.lookups.close()
        for door in self._doors:
            self.loop.call(door.end)
        self.loop.close()
        if self._api is not None:
            self._api.close()
        self.graph.clear()
        self.tell(Status(ConnectionState.CLOSED, reason, killed))
        self.graph_listeners.clear()
        if reason != "closed":
            # Nobody here has asked for it: who listens must know.
            told = threading.Event()
            self.dispatcher.post(told.set)
            told.wait(_TELLING)
        else:
            self.status_listeners.clear()
        self.dispatcher.close()
        self.own_dispatcher.close()
