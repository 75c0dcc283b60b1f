"""A node's registrations with the master, and the polling of the graph.

The master does not notify nodes when it was restarted and has lost all registrations, nor when its
calls fail: it is polled once a second. A node that could not unregister when it was closed does so
in the background.
"""

from __future__ import annotations

import logging
import threading
import time
from collections import deque
from contextlib import suppress
from typing import TYPE_CHECKING

from rosglass.comm import ConnectionState, EndpointKind, Status
from rosglass.comm.core import NodeMember
from rosglass.comm.handle import guarded
from rosglass.comm.log_limits import LogOnce
from rosglass.errors import ConnectionLostError, Error, MasterError
from rosglass.wires.tcpros.address import explain_unreachable, own_address, parse_uri
from rosglass.wires.tcpros.core import NAME_TAKEN
from rosglass.wires.tcpros.master import Master

if TYPE_CHECKING:
    from collections.abc import Iterable

    from rosglass.wires.tcpros.core import TcprosCore

__all__ = ["Member", "Registrations", "unregister_later"]


_log = logging.getLogger("rosglass.ros1")
#: Seconds between polls of the master.
_POLL_S = 1.0
#: Seconds that closing waits for the master, and then for the calls that it aborted.
_UNREGISTER_TIMEOUT_S, _ABORT_TIMEOUT_S = 1.5, 0.5
#: Polls with a publisher that is not connected until the subscription is registered again.
_MAX_MISSED_POLLS = 2


class Member(NodeMember):
    """A member of a node that is registered with the master.

    Attributes:
        endpoint: Its kind and name in the master's graph: it is registered again if it is missing
            there. None for members that the graph does not show.
        lists_node: Whether the master lists the node under its name once this is registered: only
            calls with the node's URI take the name from another node.
        must_register_again: Whether to register it with the next poll, for the master's answer; set
            by any thread.
    """

    endpoint: tuple[EndpointKind, str] | None = None
    lists_node = False
    must_register_again = False

    def register(self, master: Master) -> None:
        """Register it; called on a thread that may wait, again after the master's restart.

        Raises:
            ConnectionLostError: The master does not answer; this is retried.
            MasterError: The master refuses.
        """

    def unregister(self, master: Master) -> None:
        """Unregister it; called on a thread that may wait."""

    def successor(self) -> Member | None:
        """Return the member that has its name by now, and takes over the registration."""
        return None

    def misses_publishers(self, count: int) -> bool:  # noqa: ARG002 - of subscriptions only
        """Return whether it is connected with fewer publishers than the master lists."""
        return False


class Registrations:
    """Registers a node's members with the master, on a thread of its own.

    Args:
        core: The node.
    """

    def __init__(self, core: TcprosCore) -> None:
        self._core = core
        #: Wakes the thread: there is something to register, or the node is closed.
        self._wanted = threading.Event()
        self._closing = False
        #: Members that are registered, and those that may be.
        self._registered: set[Member] = set()
        self._tried: set[Member] = set()
        self._leaving: deque[Member] = deque()
        self._log_once = LogOnce()
        self._answered = False
        #: The master's process id, as of the last poll.
        self._process: object = None
        #: Why other nodes may not reach this one, and the address that was checked.
        self._unreachable_reason, self._checked_host = "", ""
        #: Consecutive polls with a publisher that is not connected, by topic.
        self._missed: dict[str, int] = {}
        self._thread = threading.Thread(
            target=self._work, name=f"{core.name.name} master", daemon=True
        )

    @property
    def is_current(self) -> bool:
        """True in its own thread."""
        return self._thread is threading.current_thread()

    def start(self) -> None:
        """Start polling the master, first for the members that the loop's jobs are adding."""
        self._wanted.clear()
        self._thread.start()
        # A node that is connected has its name: a later one of that name ends it, not the reverse.
        self._core.loop.call(self._wanted.set)

    def wake(self) -> None:
        """Register new members soon; from any thread."""
        self._wanted.set()

    def forget(self, member: Member) -> None:
        """Unregister a closed member soon; from any thread."""
        self._leaving.append(member)
        self._wanted.set()

    def close(self) -> None:
        """Unregister all members, and end the thread; takes up to 2 s if the master is silent.

        The rest is unregistered in the background once the master answers.
        """
        self._closing = True
        known = bool(self._tried)
        self._wanted.set()
        if self.is_current:
            self._leave()
        elif known:
            self._thread.join(_UNREGISTER_TIMEOUT_S)
        self._core.master.close()
        if not self.is_current and self._thread.is_alive():
            self._thread.join(_ABORT_TIMEOUT_S)
        if left := self._tried.copy():
            unregister_later(self._core, left)

    # -- the thread ------------------------------------------------------------------------------

    def _work(self) -> None:
        self._wanted.wait()
        while True:
            self._wanted.clear()
            if self._closing:
                break
            with guarded(_log, "%s failed", self._thread.name):
                self._poll()
            self._wanted.wait(_POLL_S)
        self._leave()

    def _poll(self) -> None:
        core = self._core
        changed = False
        try:
            if self._check_master():
                core.shut_down(core.master.uri, NAME_TAKEN)
                return
            if not core.options.address and core.set_host(own_address(core.master.reached_from)):
                # The machine has changed network: the registrations carry the new address.
                self._registered.clear()
            self._unregister()
            refused = self._register()
            changed = core.graph.refresh(core.master)
            self._compare()
        except (ConnectionLostError, MasterError) as error:
            self._on_failure(str(error))
        else:
            self._answered = True
            self._check_address()
            problems = [problem for problem in (*refused, self._unreachable_reason) if problem]
            core.set_status(Status(ConnectionState.CONNECTED, "; ".join(problems)))
        if changed:
            core.wake()

    def _check_master(self) -> bool:
        """Detect a restart of the master; return whether another node took this one's name."""
        core = self._core
        process, uri = core.master.call("getPid"), ""
        # Until then, the master may list a node that was killed under this name.
        listed = any(member.lists_node for member in self._registered)
        if self._registered:
            # The name is unknown if the master has lost all registrations.
            with suppress(MasterError):
                uri = core.master.call("lookupNode", core.name.full)
            # A new master may list the node after another call, without its registrations.
            if not uri or process != self._process:
                self._registered.clear()
                self._tried.clear()
                self._leaving.clear()
        self._process = process
        return listed and bool(uri) and uri not in core.uris

    def _unregister(self) -> None:
        while self._leaving:
            member = self._leaving[0]
            if member in self._tried:
                successor = member.successor()
                if successor is not None:
                    # It may leave before it was ever registered itself.
                    self._tried.add(successor)
                else:
                    with suppress(MasterError):  # it is not registered there
                        member.unregister(self._core.master)
                self._tried.discard(member)
                self._registered.discard(member)
            self._leaving.popleft()

    def _register(self) -> list[str]:
        """Register members that are not; return why the master refuses some."""
        refused = []
        for member in self._core.members():
            if not isinstance(member, Member):
                continue
            if member in self._registered and not member.must_register_again:
                continue
            member.must_register_again = False
            # First: the master may know the member although its answer gets lost, and close()
            # looks at these after it has set `_closing`.
            self._tried.add(member)
            if self._closing:
                self._tried.discard(member)
                break
            try:
                member.register(self._core.master)
                self._registered.add(member)
            except ConnectionLostError:
                raise
            except Error as error:
                refused.append(str(error))
                if self._log_once.is_first((member, str(error))):
                    _log.warning("%s: %s", member, error)
        return refused

    def _compare(self) -> None:
        """Compare the graph with the members, and register again what is missing in it."""
        core = self._core
        for member in list(self._registered):
            if member.endpoint is None:
                continue
            kind, name = member.endpoint
            missing = core.name not in {end.node for end in core.graph.endpoints(kind, name)}
            if kind is EndpointKind.SUBSCRIPTION and not missing:
                missing = self._has_missed_publishers(member, name)
            if missing:
                self._registered.discard(member)
                self._wanted.set()

    def _has_missed_publishers(self, member: Member, topic: str) -> bool:
        """Return whether a subscription has missed the master's calls, and must register again."""
        count = len(self._core.graph.endpoints(EndpointKind.PUBLISHER, topic))
        if not member.misses_publishers(count):
            self._missed.pop(topic, None)
            return False
        # At first, the master's call or the publisher's answer may be on its way.
        polls = self._missed[topic] = self._missed.get(topic, 0) + 1
        return polls == _MAX_MISSED_POLLS or polls % (10 * _MAX_MISSED_POLLS) == 0

    def _check_address(self) -> None:
        host = self._core.address[0]
        if host != self._checked_host:
            self._checked_host, self._unreachable_reason = host, ""
            self._core.pool.run(lambda: self._look_up_address(host))

    def _look_up_address(self, host: str) -> None:
        """Check whether other nodes reach an address; may wait for a name server."""
        core = self._core
        master, _ = parse_uri(core.master.uri, "master")
        found = explain_unreachable(host, core.options.source, master)
        if found and host == self._checked_host:
            self._unreachable_reason = found
            _log.warning("%s: %s", core.url, found)
            self._wanted.set()

    def _on_failure(self, reason: str) -> None:
        core = self._core
        reason = reason.removeprefix(f"{core.url}: ")
        if self._closing:
            return
        state = ConnectionState.LOST if self._answered else ConnectionState.CONNECTING
        if core.status().state is ConnectionState.CONNECTED:
            _log.warning("%s: %s", core.url, reason)
        core.set_status(Status(state, f"{reason}; trying again every second"))

    def _leave(self) -> None:
        core = self._core
        with suppress(ConnectionLostError):  # close() unregisters the rest later
            for member in [*self._leaving, *self._tried]:
                if member in self._tried:
                    _unregister_member(member, core.master)
                    self._tried.discard(member)


#: Seconds for which a master that does not answer is called again, and between two calls.
_RETRY_LIMIT_S, _RETRY_PAUSE_S = 60.0, 1.0


def unregister_later(core: TcprosCore, members: Iterable[Member]) -> None:
    """Unregister a closed node in the background, once its master answers within a minute.

    Args:
        core: The node.
        members: Members that the master may list.
    """
    threading.Thread(
        target=_unregister, args=(core, list(members)), name="rosglass unregister", daemon=True
    ).start()


def _unregister(core: TcprosCore, members: list[Member]) -> None:
    master = Master(core.master.uri, core.name.full)
    left, again = list(members), True
    until = time.monotonic() + _RETRY_LIMIT_S
    while time.monotonic() < until:
        try:
            while left:
                _unregister_member(left[-1], master)
                left.pop()
            if not again or _has_forgotten(master, core):
                break
            # A registration from before the master hung was processed after its end. Once is
            # enough: after that, another node on the same ports has this name and address.
            left, again = list(members), False
        except ConnectionLostError as error:
            _log.debug("%s is closed, but its master does not know: %s", core.name, error)
        time.sleep(_RETRY_PAUSE_S)
    else:
        _log.info(
            "%s does not answer, and may still list %s when it does: remove it then by "
            "'rosglass node cleanup'",
            master.uri,
            core.name,
        )
    master.close()


def _unregister_member(member: Member, master: Master) -> None:
    """Unregister a member; raises ConnectionLostError, and logs what the master refuses."""
    try:
        member.unregister(master)
    except ConnectionLostError:
        raise
    except Error as error:
        _log.debug("%s: %s", member, error)


def _has_forgotten(master: Master, core: TcprosCore) -> bool:
    try:
        return master.call("lookupNode", core.name.full) not in core.uris
    except MasterError:
        return True
