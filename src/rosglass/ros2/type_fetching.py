"""Getting definitions that nobody here has from the nodes that use the types.

Nodes since ROS 2 Iron answer ``~/get_type_description`` (REP 2016). What comes is believed only if
it has the hash that was announced; then it is in the library, and kept on disk for when nobody
answers.
"""

from __future__ import annotations

import logging
import threading
import time
from collections import deque
from contextlib import suppress
from typing import TYPE_CHECKING

from rosglass.comm import EndpointKind, Promise
from rosglass.comm.promise import check_timeout
from rosglass.errors import (
    DefinitionConflictError,
    Error,
    InvalidNameError,
    NodeClosedError,
    TypeNotFoundError,
)
from rosglass.interfaces import (
    TypeCache,
    adding_definitions,
    announced_hashes,
    cache_folder,
    rihs01,
    split_name,
)
from rosglass.ros2.announced import nodes_of
from rosglass.ros2.core import Member
from rosglass.ros2.type_clients import TypeClients
from rosglass.ros2.type_descriptions import (
    ACTION_PARTS,
    SERVICE,
    WrongHashError,
    compose_action,
    is_hash,
    read_answer,
)
from rosglass.ros2.type_lookup import Lookup
from rosglass.ros2.type_wants import Ask, Trial, Want, spelled

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from concurrent.futures import Future
    from typing import Any

    from rosglass.comm import EndpointInfo
    from rosglass.interfaces import InterfaceDefinition
    from rosglass.ros2.core import Core
    from rosglass.ros2.type_wants import AnyType

    Users = Mapping[str, Sequence[EndpointInfo]]

__all__ = ["TypeFetcher"]

_log = logging.getLogger("rosglass.ros2")

#: Seconds that a node has to answer, and after which the next one is asked meanwhile.
_TIMEOUT, _HEDGE = 5.0, 1.0
#: Seconds that the graph has to become complete: a node's service may show after its publishers.
_GRACE = 1.0
#: The same while programs are there that have not said which nodes they have: Fast DDS takes 1 to
#: 4 s, and until then its services belong to no node that could be asked.
_INTRODUCTION_S = 8.0
#: Seconds until a node that did not answer is asked again: at first, and at most (it doubles).
_AGAIN, _RARELY = 5.0, 60.0
#: Seconds for which a definition that nobody asks for any more is still fetched.
_INTEREST = 30.0
#: Questions on their way at once, and definitions fetched in all: more come only from a graph gone
#: wild.
_MAX_ASKED, _MAX_FETCHED = 16, 2000


class TypeFetcher(Member):
    """Fetches definitions for one node.

    All decisions are made in rounds on the node's own dispatcher; what the graph, timers and
    answers bring only asks for the next round.

    Args:
        core: The node.
    """

    def __init__(self, core: Core) -> None:
        self._core = core
        self._lock = threading.Lock()
        self._wants: dict[tuple[str, str, str], Want] = {}
        self._answers: deque[tuple[Want, bytes | str, Future[Any]]] = deque()
        self._clients = TypeClients(core)
        self._cache = TypeCache(cache_folder())
        self._posted = self._closed = False
        self._since = time.monotonic()
        self._asked = self._fetched = 0
        self._told: set[tuple[str, str]] = set()
        core.types.fetcher = self
        core.add(self)

    # -- what others ask for ---------------------------------------------------------------------

    def __call__(
        self,
        name: str,
        hash: str,
        endpoints: Sequence[EndpointInfo],
        on_done: Callable[[], None],
    ) -> str:
        """Start fetching; see :meth:`rosglass.comm.types.Types.request`."""
        if hash and self._core.types.library.version(name, hash) is not None:
            return ""
        want = self._want(name, hash, "")
        if want is None:
            return "the node is closed"
        want.endpoints, want.used = tuple(endpoints), time.monotonic()
        if on_done not in want.listeners:
            want.listeners.append(on_done)
        self._kick()
        return want.problem

    def knows(self, name: str) -> bool:
        """Return whether somebody in the graph uses a type."""
        return bool(spelled(name, self._core.graph.users()))

    def fetch(
        self, name: str, *, hash: str = "", node: str = "", timeout: float | None = 5.0
    ) -> Promise[AnyType]:
        """Fetch a type; see :meth:`rosglass.comm.Node.fetch_type_async`."""
        split_name(name)
        timeout = check_timeout(timeout, f"fetching {name}")
        if hash and not is_hash(hash):
            raise InvalidNameError(
                f"{hash!r:.90} is no type hash of {name}; write RIHS01_ and 64 hexadecimal digits"
            )
        promise: Promise[AnyType] = Promise(
            f"{name} has not come", self._core.dispatcher, cancellable=True
        )
        if hash:
            with suppress(Error):
                promise.fulfil(self._load(name, hash))
                return promise
        want = self._want(name, hash, "" if hash else node)
        if want is None:
            promise.fail(NodeClosedError(f"node {self._core.name} is closed; connect again"))
            return promise
        want.since = time.monotonic()
        want.promises.append(promise)
        if timeout is not None:
            timer = self._core.timers.after(timeout, lambda: self._expire(want, promise, timeout))
            promise.add_done_callback(lambda _: timer.close())
        self._kick()
        return promise

    def follow(self, moved: bool, idle: bool) -> None:  # noqa: ARG002 - time passes, too
        """Follow the graph: somebody to ask may have appeared."""
        if self._wants or self._clients:
            self._kick()

    def close(self) -> None:
        """End all fetching; safe to call twice."""
        with self._lock:
            if self._closed:
                return
            self._closed = True
            wants, self._wants = list(self._wants.values()), {}
        for want in wants:
            for promise in want.promises:
                promise.fail(NodeClosedError(f"node {self._core.name} was closed"))
            if want.lookup is not None:
                want.lookup.join()
        self._clients.close()
        self._core.remove(self)

    def _want(self, name: str, type_hash: str, node: str) -> Want | None:
        with self._lock:
            if self._closed:
                return None
            return self._wants.setdefault((name, type_hash, node), Want(name, type_hash, node))

    def _load(self, name: str, type_hash: str) -> AnyType:
        from rosglass.messages import load  # noqa: PLC0415 - numpy

        return load(name, ros=2, library=self._core.types.library, hash=type_hash)

    def _expire(self, want: Want, promise: Promise[AnyType], timeout: float) -> None:
        if promise.done():
            return
        reason = want.problem or (
            f"{nodes_of(ask.server for ask in list(want.asks.values()))} did not answer yet"
            if want.asks
            else f"nobody in the graph uses {'this version of it' if want.hash else 'it'}"
        )
        promise.fail(
            TypeNotFoundError(f"no definition of {want.name} within {timeout:g} s: {reason}")
        )

    # -- rounds ----------------------------------------------------------------------------------

    def _kick(self) -> None:
        with self._lock:
            if self._posted or self._closed:
                return
            self._posted = True
        self._core.own_dispatcher.post(self._round)

    def _round(self) -> None:
        with self._lock:
            self._posted = False
            wants = list(self._wants.values())
        while self._answers:
            self._take(*self._answers.popleft())
        users = self._core.graph.users()
        now = time.monotonic()
        for want in wants:
            want.promises = [promise for promise in want.promises if not promise.done()]
            if not want.promises and now - want.used > _INTEREST:
                self._drop(want)
            elif self._wants.get(want.key) is want:
                try:
                    self._advance(want, users, now)
                except NodeClosedError:
                    return
                except Exception:
                    _log.exception("fetching %s failed", want.name)
        self._clients.close_idle(now)

    def _advance(self, want: Want, users: Users, now: float) -> None:
        """Do what can be done now to get a definition."""
        name = next(iter(spelled(want.name, users)), want.name)
        if name.split("/")[1] == "action" and name not in users and not want.hash:
            self._advance_action(want, name, users, now)
            return
        if want.hash:
            found = self._core.types.library.version(name, want.hash)
            if found is None:
                self._ask_next(want, name, users, now)
            else:
                self._arrived(want, found)
            return
        announced = self._announced(want, name, users, now)
        if announced:
            self._hand_over(want, name, announced, users, now)

    def _hand_over(self, want: Want, name: str, announced: str, users: Users, now: float) -> None:
        """Go on with the version that was found to be meant."""
        if not want.looked:
            want.looked = True  # the library may have it all along
            with suppress(Error):
                self._arrived(want, self._core.types.library.definition(name, hash=announced))
                return
        target = self._want(name, announced, "")
        if target is None:
            return
        target.used = now
        target.endpoints = target.endpoints or want.endpoints
        target.promises += want.promises
        want.promises = []
        target.listeners += [each for each in want.listeners if each not in target.listeners]
        self._advance(target, users, now)
        changed, want.problem = want.problem != target.problem, target.problem
        if not want.listeners or self._wants.get(target.key) is not target:
            self._drop(want)
        elif changed:
            for listener in list(want.listeners):
                listener()

    def _announced(self, want: Want, name: str, users: Users, now: float) -> str:
        """Return the one hash that the graph has for a type, empty when there is none (yet)."""
        known: dict[str, set[str]] = {}
        for user in users.get(name, ()):
            if user.type_hash and want.node in ("", user.node.full):
                known.setdefault(user.type_hash, set()).add(user.node.full)
        if len(known) == 1:
            return next(iter(known))
        if known:
            told = "; ".join(f"{key} of {', '.join(sorted(of))}" for key, of in known.items())
            problem = f"the graph has several versions ({told}); choose one by its hash or node"
            self._settle(want, DefinitionConflictError(f"{name}: {problem}"), problem)
        elif want.promises and now - self._since > _GRACE and self._fulfil(want, name, ""):
            pass  # nobody announces another version: what the library has is right
        elif (name in users or want.endpoints) and not self._looked_up(want, name, users):
            self._give_up(
                want,
                f"{nodes_of(users.get(name, want.endpoints))} announces no type hash and sends no "
                "definitions (ROS 2 Humble and older, or a program that is not built on rcl)"
                f"{_told(want)}; {adding_definitions(want.name, 2)}",
                now,
            )
        return ""

    def _advance_action(self, want: Want, name: str, users: Users, now: float) -> None:
        """Put an action together: only its parts are in the graph with their hashes."""
        parts: dict[str, InterfaceDefinition] = {}
        problems: list[str] = []
        for suffix in ACTION_PARTS:
            part = self._want(name + suffix, "", want.node)
            if part is None:
                return
            if self._kick not in part.listeners:
                part.listeners.append(self._kick)
            part.used, part.endpoints = now, users.get(part.name, want.endpoints)
            announced = self._announced(part, part.name, users, now)
            found = announced and self._core.types.library.version(part.name, announced)
            if found:
                parts[suffix] = found
                self._drop(part)
            elif part.problem:
                problems.append(f"{part.name}: {part.problem}")
        if len(parts) == len(ACTION_PARTS):
            try:
                action = compose_action(name, parts)
                self._core.types.library.add_version(action)
                self._arrived(want, action)
            except Error as error:
                self._settle(want, error, str(error))
        elif problems:
            self._give_up(want, "; ".join(problems), now)
        elif want.promises and now - self._since > _GRACE and name + ACTION_PARTS[0] not in users:
            self._fulfil(want, name, "")

    # -- asking ----------------------------------------------------------------------------------

    def _ask_next(self, want: Want, name: str, users: Users, now: float) -> None:
        """Ask the next node, or say why none is left."""
        if any(now - ask.started < _HEDGE for ask in want.asks.values()):
            return
        same = [user for user in users.get(name, ()) if user.type_hash == want.hash]
        own = self._core.name
        nodes = dict.fromkeys(u.node for u in (*want.endpoints, *same) if u.node != own)
        servers: dict[bytes | str, EndpointInfo] = {}
        mute: list[str] = []
        for node in nodes:
            kind, service = EndpointKind.SERVICE_SERVER, f"{node.full}/{SERVICE}"
            found = [s for s in self._core.graph.endpoints(kind, service) if s.node == node]
            servers.update((server.gid or node.full, server) for server in found)
            if not found:
                mute.append(node.full)
        # One that was restarted is asked again.
        want.tried = {key: trial for key, trial in want.tried.items() if key in servers}
        for key, server in servers.items():
            trial = want.tried.get(key)
            if key not in want.asks and (trial is None or now >= trial.again):
                if self._asked < _MAX_ASKED:
                    self._ask(want, key, server, name)
                return
        if want.asks:
            return
        if not want.stored:
            want.stored = True
            stored = self._cache.get(name, want.hash)
            if stored is not None:
                self._core.types.library.add_version(stored)
                self._arrived(want, stored)
                return
        if not self._looked_up(want, name, users):
            self._give_up(want, self._reasons(want, mute), now)

    def _looked_up(self, want: Want, name: str, users: Users) -> bool:
        """Ask the middleware itself; returns whether it has answered well, or may still do so."""
        if want.lookup is None or want.lookup.age > _RARELY:
            endpoints = (*want.endpoints, *users.get(name, ()))
            want.lookup = Lookup(self._core.middleware, name, endpoints, self._kick)
        found = want.lookup.found
        if want.lookup.done and found is not None:
            if found.name == name and want.hash in ("", *announced_hashes(found)):
                self._core.types.library.add_version(found)
                self._arrived(want, found)
                return True
            want.lookup.found = None
            want.lookup.problem = f"TypeLookup tells of {found.name} with the hash {rihs01(found)}"
        return not want.lookup.done

    def _reasons(self, want: Want, mute: Sequence[str]) -> str:
        reasons = [f"{trial.node}: {trial.reason}" for trial in want.tried.values()]
        if mute:
            reasons.append(
                f"{', '.join(mute)} has no {SERVICE} service (ROS 2 Humble or older, a node "
                "started with start_type_description_service:=false, or a program that is not "
                "built on rcl)"
            )
        if not reasons:
            return "no other node in the graph uses this version of it"
        told = f"asked for its definition: {'; '.join(reasons)}{_told(want)}"
        if self._core.middleware.announces_requests and "/msg/" not in want.name:
            told += (
                ". Over DDS, ROS 2 nodes announce a service by the hash of its request, and do not "
                "find its type by that when asked"
            )
        return f"{told}; {adding_definitions(want.name, 2)}"

    def _ask(self, want: Want, key: bytes | str, server: EndpointInfo, name: str) -> None:
        ask = Ask(server, name)
        if self._fetched >= _MAX_FETCHED:
            self._failed(want, key, ask, f"not asked: {_MAX_FETCHED} types were fetched already")
            return
        request = {"type_name": name, "type_hash": want.hash, "include_type_sources": True}
        try:
            call = self._clients.get(server.name).call_async(request, timeout=_TIMEOUT)
        except NodeClosedError:
            raise
        except Error as error:
            self._failed(want, key, ask, str(error))
            return
        want.asks[key] = ask
        self._asked += 1
        self._core.timers.after(_HEDGE, self._kick)
        call.add_done_callback(lambda done: self._on_answer(want, key, done))

    def _on_answer(self, want: Want, key: bytes | str, call: Future[Any]) -> None:
        """Take an answer in the thread that brings it, to look at it in the next round."""
        self._answers.append((want, key, call))
        self._kick()

    def _take(self, want: Want, key: bytes | str, call: Future[Any]) -> None:
        self._asked -= 1
        ask = want.asks.pop(key, None)
        if ask is None or call.cancelled() or self._wants.get(want.key) is not want:
            return
        node = ask.server.node.full
        try:
            found = read_answer(call.result(), ask.name, want.hash, node)
            self._core.types.library.add_version(found)
        except WrongHashError as error:
            self._failed(want, key, ask, str(error), believable=False)
            if (node, want.name) not in self._told:
                self._told.add((node, want.name))
                _log.warning("%s is not believed: %s; it is not used", node, error)
        except Error as error:
            self._failed(want, key, ask, str(error))
        else:
            self._fetched += 1
            self._arrived(want, found)
            self._cache.put(found, want.hash)

    def _failed(
        self,
        want: Want,
        key: bytes | str,
        ask: Ask,
        reason: str,
        *,
        believable: bool = True,
    ) -> None:
        """Remember why a node did not help, and ask it again later, or never."""
        before = want.tried.get(key)
        count = 1 if before is None else before.count + 1
        pause = min(_AGAIN * 2.0 ** (count - 1), _RARELY) if believable else float("inf")
        again = time.monotonic() + pause
        want.tried[key] = Trial(ask.server.node.full, reason, count, again)
        self._kick()

    # -- endings ---------------------------------------------------------------------------------

    def _arrived(self, want: Want, found: InterfaceDefinition) -> None:
        """Tell everybody that the library has a definition now."""
        self._drop(want)
        self._fulfil(want, found.name, rihs01(found))
        for listener in list(want.listeners):
            listener()

    def _fulfil(self, want: Want, name: str, type_hash: str) -> bool:
        """Keep the promises, if the library has a type; returns whether it has."""
        try:
            found = self._load(name, type_hash)
        except Error as error:
            if type_hash:
                self._fail(want, error)
            return False
        for promise in want.promises:
            promise.fulfil(found)
        return True

    def _give_up(self, want: Want, reason: str, now: float) -> None:
        """Say why nothing will come, unless the graph may not be complete yet."""
        limit = _INTRODUCTION_S if self._core.middleware.unnamed() else _GRACE
        left = max(want.since, self._since) + limit - now
        if left > 0:
            self._core.timers.after(min(left, _GRACE) + 0.01, self._kick)
        else:
            self._settle(want, TypeNotFoundError(f"no definition of {want.name}: {reason}"), reason)

    def _settle(self, want: Want, error: Error, reason: str) -> None:
        self._fail(want, error)
        changed, want.problem = want.problem != reason, reason
        if changed:
            for listener in list(want.listeners):
                listener()
        if not want.listeners:
            self._drop(want)

    def _fail(self, want: Want, error: Error) -> None:
        for promise in want.promises:
            promise.fail(error)

    def _drop(self, want: Want) -> None:
        with self._lock:
            if self._wants.get(want.key) is want:
                del self._wants[want.key]


def _told(want: Want) -> str:
    problem = "" if want.lookup is None else want.lookup.problem
    return f"; {problem}" if problem else ""
