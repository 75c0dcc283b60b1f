"""The core of a ROS 1 node: its master, addresses, graph, types and threads."""

from __future__ import annotations

import logging
import re
import threading
from collections import deque
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING

from rosglass.comm import ConnectionState, Status
from rosglass.comm.core import NodeCore
from rosglass.comm.handle import guarded
from rosglass.comm.types import Types
from rosglass.errors import (
    ConnectionLostError,
    DefinitionConflictError,
    DefinitionError,
    Error,
    TypeNotFoundError,
)
from rosglass.interfaces import adding_definitions, full_text, join_name, split_name
from rosglass.messages import MessageType, ServiceType, load
from rosglass.messages.types import mend
from rosglass.wires.tcpros.address import bracketed, interface_of, own_address
from rosglass.wires.tcpros.connection import ANY
from rosglass.wires.tcpros.graph import Graph
from rosglass.wires.tcpros.io_loop import IoLoop, listen
from rosglass.wires.tcpros.master import Master

if TYPE_CHECKING:
    import socket
    from collections.abc import Callable

    from rosglass.comm import NodeName
    from rosglass.interfaces import Library
    from rosglass.messages import ActionType

__all__ = ["NAME_TAKEN", "AnnouncedTypes", "BlockingPool", "TcprosCore", "TcprosOptions"]

_log = logging.getLogger("rosglass.ros1")
#: The master's reason when it ends a node because another one has registered under its name;
#: rosmaster puts the name before it: ``[/panel] Reason: new node registered with same name``.
NAME_TAKEN = "new node registered with same name"
_NAMED_REASON = re.compile(r"\[(/[^\]]*)\] Reason: ")
#: Seconds that the master may take to look up the node's name.
_OWNER_TIMEOUT_S = 1.0
#: Jobs in progress at once: calls of nodes that are gone, but still registered, time out, and
#: other calls must not wait for that.
_MAX_THREADS = 32
#: Seconds after which an idle thread ends.
_IDLE_TIMEOUT_S = 5.0


@dataclass(frozen=True)
class TcprosOptions:
    """A node's master, and the address and ports under which other nodes reach it.

    Attributes:
        master: URI of the master.
        address: Host or address under which other nodes reach this one; empty to detect it.
        source: Where the address was given, such as ``ROS_IP``; empty if it is detected.
        tcpros_port: Where connections are accepted; 0 for any free port.
        slave_port: Where the node's API is served; 0 for any free port.
    """

    master: str
    address: str = ""
    source: str = ""
    tcpros_port: int = 0
    slave_port: int = 0


class TcprosCore(NodeCore):
    """The shared state of a ROS 1 node's members: master, addresses, graph and threads.

    Args:
        name: The node's name.
        url: The URL it was connected with, for messages.
        options: Master, own address and ports.
        types: Finds types.

    Attributes:
        master: The master's API; called from threads that may wait.
        graph: The graph of the last poll of the master.
        types: Finds types.
        loop: The node's I/O loop.
        pool: Runs jobs that wait for other nodes.
        lookups: Runs the lookups that service calls wait for: they must not queue behind those of
            topics.
        uri: URI of the node's own API.
        uris: All URIs that the node's own API has had.
        address: Host and port where connections are accepted.

    Raises:
        ConnectionLostError: This machine cannot listen for connections.
    """

    wire = "ros1"
    graph: Graph
    types: AnnouncedTypes

    def __init__(
        self, name: NodeName, url: str, options: TcprosOptions, types: AnnouncedTypes
    ) -> None:
        super().__init__(name, url, _log)
        self.options = options
        self.master = Master(options.master, name.full)
        self.graph, self.types = Graph(), types
        self.pool = BlockingPool(f"{name.name} pool")
        self.lookups = BlockingPool(f"{name.name} lookups")
        self.address, self.uri = ("", 0), ""
        self._status = Status(ConnectionState.CONNECTING, f"looking for {options.master}")
        #: The listening sockets: for connections, and for the node's API.
        self._sockets: list[socket.socket] = []
        self._ports, self._interface = [options.tcpros_port, options.slave_port], ""
        self.uris: set[str] = set()
        self.set_host(options.address or own_address())
        self.loop = IoLoop(f"{name.name} connections")

    def set_host(self, host: str) -> bool:
        """Announce a host or address, and listen there; return whether it has changed.

        Raises:
            ConnectionLostError: This machine cannot listen for connections.
        """
        if host == self.address[0] and self._interface:
            return False
        interface = interface_of(host)
        if interface != self._interface:
            self._listen(interface)
        self.address = (host, self._ports[0])
        self.uri = f"http://{bracketed(host)}:{self._ports[1]}/"
        self.uris.add(self.uri)
        return True

    def _listen(self, interface: str) -> None:
        """Listen at an interface instead, at the same ports if they are free there."""
        self._close_sockets()
        for number, fixed in enumerate((self.options.tcpros_port, self.options.slave_port)):
            try:
                try:
                    sock = listen(interface, self._ports[number], self.url)
                except ConnectionLostError:
                    if fixed or not self._ports[number]:
                        raise
                    sock = listen(interface, 0, self.url)
            except ConnectionLostError:
                self._close_sockets()
                raise
            self._sockets.append(sock)
            self._ports[number] = int(sock.getsockname()[1])
        self._interface = interface

    def _close_sockets(self) -> None:
        """Stop listening."""
        for sock in self._sockets:
            sock.close()
        self._sockets, self._interface = [], ""

    def _state(self) -> Status:
        return self._status

    def set_status(self, status: Status) -> None:
        """Set the status and notify its listeners; ignored once the node is closed."""
        with self._lock:
            if status == self._status or self._status.state is ConnectionState.CLOSED:
                return
            self._status = status
        self.status_listeners.notify(status)

    def shut_down(self, caller: str, reason: str) -> None:
        """Close the node in the background, as another node requests; from any thread.

        Args:
            caller: The requesting node.
            reason: The caller's reason.
        """
        threading.Thread(
            target=self._shut_down, args=(caller, reason), name="shutdown", daemon=True
        ).start()

    def _shut_down(self, caller: str, reason: str) -> None:
        detail = f"closed by {caller}: {reason or 'no reason given'}"
        taken, owner = NAME_TAKEN in reason, ""
        with suppress(Error):  # then it stays unknown
            owner = str(self.master.call("lookupNode", self.name.full, timeout=_OWNER_TIMEOUT_S))
        if taken and self._is_out_of_date(reason, owner):
            _log.info("%s: ignored, as it has its name: %s", self.name, detail)
            return
        is_lost = bool(owner) and owner not in self.uris
        if is_lost:
            detail += f"; {owner} has the name {self.name} now"
        _log.warning("%s: %s", self.name, detail)
        self.close(detail, killed=not taken and not is_lost)

    def _is_out_of_date(self, reason: str, owner: str) -> bool:
        """Return whether a node's name was taken, but not this node's, or not any more.

        The master calls the URI under which a node was registered. By then, that may be the URI of
        another node that got its port, or this node may have registered again.

        Args:
            reason: The master's.
            owner: URI of the node that the master lists under this node's name; empty for none.
        """
        named = _NAMED_REASON.match(reason)
        if named and named[1] != self.name.full:
            return True
        # With several URIs, the new node is this one under its new address.
        return owner in self.uris or (not owner and len(self.uris) > 1)

    def _notify_closed(self, status: Status) -> None:
        self.set_status(status)


class BlockingPool:
    """Runs jobs that may take seconds on daemon threads, several at a time.

    Args:
        name: Name of the threads.
    """

    # Not concurrent.futures: that joins its threads at exit, and a program would wait up to 5 s
    # for a node that does not answer. The threads may wait for what other threads receive, unlike
    # those that begin in io_loop.py; see rosglass.comm.handle.check_may_wait.

    def __init__(self, name: str) -> None:
        self._name = name
        #: Guards the jobs, and wakes the threads.
        self._changed = threading.Condition()
        self._jobs: deque[Callable[[], None]] = deque()
        self._threads = self._idle = 0
        self._closed = False

    def run(self, job: Callable[[], None]) -> None:
        """Run `job` as soon as a thread is free; dropped after :meth:`close`."""
        with self._changed:
            if self._closed:
                return
            self._jobs.append(job)
            if self._idle >= len(self._jobs):
                self._changed.notify()
                return
            if self._threads == _MAX_THREADS:
                return
            self._threads += 1
            number = self._threads
        thread = threading.Thread(target=self._work, name=f"{self._name} {number}", daemon=True)
        try:
            thread.start()
        except RuntimeError as error:  # no more threads, or the interpreter is at its end
            with self._changed:
                self._threads -= 1
            _log.warning("%s: a job has to wait: %s", self._name, error)

    def close(self) -> None:
        """Drop the jobs that wait; those in progress end by their own timeouts."""
        with self._changed:
            self._closed = True
            self._jobs.clear()
            self._changed.notify_all()

    def _work(self) -> None:
        while True:
            with self._changed:
                self._idle += 1
                self._changed.wait_for(lambda: bool(self._jobs) or self._closed, _IDLE_TIMEOUT_S)
                self._idle -= 1
                if not self._jobs:
                    self._threads -= 1
                    return
                job = self._jobs.popleft()
            with guarded(_log, "%s: a job failed", self._name):
                job()


class AnnouncedTypes(Types):
    """Finds types for one node: in its library, or in the headers of publishers.

    Args:
        library: Library for definitions; None for the shared one.
        url: The node's URL, for messages.
    """

    def __init__(self, library: Library | None, url: str) -> None:
        super().__init__(library, url, ros=1)
        #: By name and md5 sum. Used by any thread; every use is atomic.
        self._learned: dict[tuple[str, str], MessageType] = {}
        self._texts: dict[MessageType | ServiceType, str] = {}

    def action(self, wanted: str | ActionType, hash: str = "") -> ActionType:
        """Return an action type; arguments and errors as in :meth:`message`.

        ROS 1's name of the whole action's message, ``pkg/TypeAction``, is accepted, too.
        """
        if isinstance(wanted, str) and wanted.endswith("Action"):
            package, kind, base = split_name(wanted)
            if kind != "action" and base != "Action":
                with suppress(TypeNotFoundError):  # a message may have this name
                    return super().action(f"{package}/action/{base.removesuffix('Action')}", hash)
        return super().action(wanted, hash)

    def learn(self, name: str, md5: str, text: str) -> MessageType:
        """Return the type that a publisher's connection header describes.

        Adds it to the library, unless that has another definition of the name: then only this
        node's subscriptions use it.

        Args:
            name: As in the header, ``pkg/Type``.
            md5: Its md5 sum.
            text: Its full definition; may be empty.

        Raises:
            TypeNotFoundError: The text is missing or does not match the sum, and no other source
                has the definition.
            DefinitionError: The text breaks a rule.
            InvalidNameError: `name` is not a type name.
        """
        full = join_name(name)
        found = self._learned.get((full, md5))
        if found is None:
            found = self._known(full, md5) or self._from_text(full, md5, text)
            found = self._learned.setdefault((full, md5), found)
        return found

    def announced_service(self, name: str, md5: str) -> ServiceType:
        """Return the service type that a server announces; servers send no definitions.

        Args:
            name: Full name, ``pkg/srv/Type``; empty when the server does not send it.
            md5: Its md5 sum, ``*`` for any.

        Raises:
            TypeNotFoundError: The definition is not found.
            DefinitionConflictError: The definitions that are found have other sums.
            DefinitionError: The definition breaks a rule.
            InvalidNameError: `name` is not a type name.
        """
        if not name:
            raise TypeNotFoundError("its server does not announce its type; give the type")
        hint = "ROS 1 servers send no definitions"
        try:
            found = load(name, ros=1, library=self._library, hash="" if md5 == ANY else md5)
        except (TypeNotFoundError, DefinitionConflictError) as error:
            raise type(error)(f"{error}. {hint}") from None
        if not isinstance(found, ServiceType):
            raise TypeNotFoundError(f"{name} is not a service type here. {hint}")
        return found

    def text(self, type: MessageType | ServiceType) -> str:
        """Return a type's definition with all that it needs, as connection headers carry it."""
        known = self._texts.get(type)
        if known is None:
            known = self._texts[type] = full_text(type.definition)
        return known

    def _known(self, full: str, md5: str) -> MessageType | None:
        with suppress(Error):  # then the publisher's own is used
            found = load(full, ros=1, library=self._library, hash=md5)
            if isinstance(found, MessageType):
                return found
        return None

    def _from_text(self, full: str, md5: str, text: str) -> MessageType:
        if not text.strip():
            raise TypeNotFoundError(
                f"{full}: its publisher sends no definition, and no other one with md5 {md5} is "
                f"known; {adding_definitions(full, 1)}"
            )
        try:
            found = MessageType.from_text(full, text, ros=1)
        except DefinitionError:
            mended = mend(full, text, md5, self.library)
            if mended is None:
                raise
            found = mended
        if found.md5 != md5:
            raise TypeNotFoundError(
                f"{full}: its publisher announces md5 {md5}, but the definition it sends has "
                f"{found.md5}; {adding_definitions(full, 1)}"
            )
        with suppress(DefinitionConflictError):  # the library keeps its own
            self.library.add(found.definition)
        return found
