"""What the master knows of a node, kept true; and the graph, as the master tells it.

The master tells nobody when it was restarted and has forgotten everybody, or when its calls do not
get through: it is asked once a second. What it could not be told when a node was closed, it is told
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
from rosglass.comm.log_limits import LogOnce
from rosglass.errors import ConnectionLostError, Error, MasterError
from rosglass.wires.tcpros.address import doubt, own_address, parse_uri
from rosglass.wires.tcpros.master import Master

if TYPE_CHECKING:
    from collections.abc import Iterable

    from rosglass.wires.tcpros.core import TcprosCore

__all__ = ["Member", "Registrations", "unregister_later"]


_log = logging.getLogger("rosglass.ros1")
#: Seconds between looks at the master.
_POLL_S = 1.0
#: Seconds that closing waits for the master, and then for calls that were cut.
_UNREGISTER_TIMEOUT_S, _CUT_TIMEOUT_S = 1.5, 0.5
#: Looks at a publisher without connection until the master is asked about it.
_MISSED_LOOKS = 2
#: Seconds that the master may take to tell who has the node's name.
_OWNER_TIMEOUT_S = 1.0


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


class Registrations:
    """Registers a node's members with the master, on a thread of its own, which may wait.

    Args:
        core: The node.
    """

    def __init__(self, core: TcprosCore) -> None:
        self._core = core
        #: Wakes the thread: there is something to register, or the node is closed.
        self._wanted = threading.Event()
        self._closing = False
        #: Members that the master knows, and those that it may know.
        self._registered: set[Member] = set()
        self._tried: set[Member] = set()
        self._leaving: deque[Member] = deque()
        self._log_once = LogOnce()
        self._answered = False
        #: The master's process, as it last said.
        self._process: object = None
        #: Why others may not reach the node, for the address that was looked at.
        self._doubt, self._doubted = "", ""
        #: How many looks in a row missed a publisher, by topic.
        self._missed: dict[str, int] = {}
        self._thread = threading.Thread(
            target=self._work, name=f"{core.name.name} master", daemon=True
        )

    @property
    def is_current(self) -> bool:
        """Whether this is its own thread."""
        return self._thread is threading.current_thread()

    def start(self) -> None:
        """Begin to look for the master."""
        self._thread.start()

    def wake(self) -> None:
        """Look at the members soon; from any thread."""
        self._wanted.set()

    def forget(self, member: Member) -> None:
        """Unregister a member that is closed, soon; from any thread."""
        self._leaving.append(member)
        self._wanted.set()

    def close(self) -> None:
        """Unregister all, and end the thread; takes up to two seconds if the master is silent.

        What it could not be told then, it is told in the background when it answers again.
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
            self._thread.join(_CUT_TIMEOUT_S)
        if left := self._tried.copy():
            unregister_later(self._core, left)

    def owner(self) -> str:
        """Return the URI of the node that has this node's name; empty if it is this one, or nobody.

        Raises:
            ConnectionLostError: The master does not answer.
        """
        core = self._core
        try:
            uri = core.master.call("lookupNode", core.name.full, timeout=_OWNER_TIMEOUT_S)
        except MasterError:
            return ""
        return "" if uri in core.uris else str(uri)

    # -- the thread ------------------------------------------------------------------------------

    def _work(self) -> None:
        while True:
            self._wanted.clear()
            if self._closing:
                break
            try:
                self._look()
            except Exception:
                _log.exception("%s failed", self._thread.name)
            self._wanted.wait(_POLL_S)
        self._leave()

    def _look(self) -> None:
        core = self._core
        moved = False
        try:
            taker = self._find()
            if taker:
                core.shut_down(core.master.uri, f"{taker} has the name {core.name} now")
                return
            self._locate()
            self._unregister()
            refused = self._register()
            moved = core.graph.refresh(core.master)
            self._compare()
        except ConnectionLostError as error:
            self._lose(str(error))
        except MasterError as error:
            self._lose(str(error))
        else:
            self._answered = True
            self._look_at_address()
            problems = [problem for problem in (*refused, self._doubt) if problem]
            core.tell(Status(ConnectionState.CONNECTED, "; ".join(problems)))
        if moved:
            core.wake()

    def _find(self) -> str:
        """Notice a master that was restarted; return who has taken the node's name."""
        core = self._core
        process, uri = core.master.call("getPid"), ""
        if self._registered:
            with suppress(MasterError):  # nobody has the name: the master has forgotten everybody
                uri = core.master.call("lookupNode", core.name.full)
            # Another call may have made the node known to a new master, without all it consists of.
            if not uri or process != self._process:
                self._registered.clear()
                self._tried.clear()
                self._leaving.clear()
        self._process = process
        return "" if not uri or uri in core.uris else str(uri)

    def _locate(self) -> None:
        """Find out under which address others reach the node: it may have changed network."""
        core = self._core
        if not core.options.address and core.move(own_address(core.master.reached_from)):
            # The master gets the new address with the registrations.
            self._registered.clear()

    def _unregister(self) -> None:
        while self._leaving:
            member = self._leaving[0]
            if member in self._tried:
                heir = None
                with suppress(MasterError):
                    heir = member.unregister(self._core.master)
                self._tried.discard(member)
                self._registered.discard(member)
                if heir is not None:
                    # It may leave before it was ever registered itself.
                    self._tried.add(heir)
            self._leaving.popleft()

    def _register(self) -> list[str]:
        """Tell the master of members it does not know; return what it has against some."""
        refused = []
        for member in self._core.registrable():
            if member in self._registered:
                continue
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
        """Look whether the master shows the members as they are, and tell it again if not."""
        core = self._core
        for member in list(self._registered):
            if member.place is None:
                continue
            kind, name = member.place
            forgotten = core.name not in {end.node for end in core.graph.endpoints(kind, name)}
            if kind is EndpointKind.SUBSCRIPTION and not forgotten:
                forgotten = self._misses(member, name)
            if forgotten:
                self._registered.discard(member)
                self._wanted.set()

    def _misses(self, member: Member, topic: str) -> bool:
        """Return whether to ask about a topic's publishers: the master's calls may be lost."""
        there = len(self._core.graph.endpoints(EndpointKind.PUBLISHER, topic))
        if not member.lacks(there):
            self._missed.pop(topic, None)
            return False
        # At first it may be about to tell, or the publisher about to answer.
        looks = self._missed[topic] = self._missed.get(topic, 0) + 1
        return looks == _MISSED_LOOKS or looks % (10 * _MISSED_LOOKS) == 0

    def _look_at_address(self) -> None:
        host = self._core.address[0]
        if host != self._doubted:
            self._doubted, self._doubt = host, ""
            # A name server may take its time.
            self._core.pool.run(lambda: self._doubt_address(host))

    def _doubt_address(self, host: str) -> None:
        core = self._core
        master, _ = parse_uri(core.master.uri, "master")
        found = doubt(host, core.options.source, master)
        if found and host == self._doubted:
            self._doubt = found
            _log.warning("%s: %s", core.url, found)
            self._wanted.set()

    def _lose(self, reason: str) -> None:
        core = self._core
        if self._closing:
            return
        state = ConnectionState.LOST if self._answered else ConnectionState.CONNECTING
        if core.status().state is ConnectionState.CONNECTED:
            _log.warning("%s: %s", core.url, reason)
        core.tell(Status(state, f"{reason}; trying again every second"))

    def _leave(self) -> None:
        core = self._core
        with suppress(ConnectionLostError):
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
        members: What the master may know of it.
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
            # enough: whoever has this name and address then is another node, on the same ports.
            left, again = list(members), False
        except ConnectionLostError as error:
            _log.debug("%s is closed, but its master does not know: %s", core.name, error)
        time.sleep(_RETRY_PAUSE_S)
    else:
        _log.info(
            "%s does not answer, and may still list %s when it does: rosglass node cleanup "
            "removes what is gone",
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
