"""Type descriptions between nodes: REP 2016's service ``~/get_type_description``, both ends of it.

Nodes since ROS 2 Iron answer it. A received definition is accepted only if it has the announced
hash; then it is added to the library, and cached on disk. ``rcl``'s ``node.c`` looks types up by
their hash alone, among those that its node uses; here the types of the library are described, too.
"""

from __future__ import annotations

import logging
import re
import threading
import time
from collections import deque
from contextlib import suppress
from typing import TYPE_CHECKING, Any, TypeAlias

from rosglass.comm import EndpointKind, Handle, Promise
from rosglass.comm.core import NodeMember
from rosglass.comm.promise import check_timeout
from rosglass.errors import (
    DefinitionConflictError,
    DefinitionError,
    Error,
    InvalidNameError,
    NodeClosedError,
    TypeNotFoundError,
)
from rosglass.interfaces import (
    ActionDefinition,
    TypeCache,
    add_type_sources,
    adding_definitions,
    announced_hashes,
    cache_folder,
    join_name,
    parse_type_description,
    rihs01,
    type_description,
    type_sources,
)
from rosglass.interfaces.definition import parts_of
from rosglass.interfaces.derived import derive, derived_from
from rosglass.interfaces.names import KINDS, split_name
from rosglass.ros2.announced import nodes_of
from rosglass.ros2.rmw_services import create_service_client, create_service_server

if TYPE_CHECKING:
    from collections.abc import Mapping

    from rosglass.comm.types import Types
    from rosglass.interfaces import Definition, InterfaceDefinition
    from rosglass.messages import Message, ServiceType
    from rosglass.ros2.core import Core

__all__ = [
    "ACTION_PARTS",
    "SERVICE",
    "TypeDescriptionServer",
    "TypeFetcher",
    "WrongHashError",
    "compose_action",
    "describe",
    "is_hash",
    "read_answer",
    "service_type",
]

_log = logging.getLogger("rosglass.ros2")
#: The service's name below the node's.
SERVICE = "get_type_description"
_TYPE = "type_description_interfaces/srv/GetTypeDescription"
#: What of an action is in the graph, with hashes; the action itself is not.
ACTION_PARTS = ("_SendGoal", "_GetResult", "_FeedbackMessage")

_GOAL_PARTS = ("_Goal", "_Result", "_Feedback")
#: Key in ``extra_information`` of those whose texts are as people wrote them; see
#: :func:`rosglass.interfaces.add_type_sources`.
_VERBATIM = "rosglass"
_HASH = re.compile(r"RIHS[0-9]{2}_[0-9a-f]{64}")
#: Largest answer that is read, in bytes; those of real types have less than a hundredth of it.
_MAX_ANSWER = 8 << 20


def service_type() -> ServiceType:
    """Return the type of the service, whatever the node's own library has."""
    from rosglass.messages import ServiceType, load  # noqa: PLC0415 - numpy

    found = load(_TYPE)
    assert isinstance(found, ServiceType)
    return found


def is_hash(text: object) -> bool:
    """Return whether something is a type hash, as a text."""
    return isinstance(text, str) and _HASH.fullmatch(text) is not None


class TypeDescriptionServer(Handle):
    """Offers ``~/get_type_description`` of a node.

    Args:
        core: The node.
    """

    def __init__(self, core: Core) -> None:
        self._core = core
        self._server: Handle | None = None
        self._closed = False

    def open(self) -> None:
        """Begin to offer it; raises NodeClosedError, or UnsupportedError without services."""
        core = self._core
        name = f"{core.name.full}/{SERVICE}"
        kind = service_type()
        server = create_service_server(core, name, kind, self._answer, executor=core.own_dispatcher)
        self._server = server
        if self._closed:
            server.close()

    def close(self) -> None:
        """Withdraw it; safe to call twice."""
        self._closed = True
        if self._server is not None:
            self._server.close()

    def _answer(self, request: Message) -> dict[str, Any]:
        try:
            return describe(
                self._core.types,
                request["type_name"],
                request["type_hash"],
                sources=request["include_type_sources"],
            )
        except Error as error:
            return {"successful": False, "failure_reason": f"{self._core.name}: {error}"}


def describe(types: Types, name: str, type_hash: str, *, sources: bool) -> dict[str, Any]:
    """Return what ``~/get_type_description`` answers, as a dict.

    Args:
        types: The node's types.
        name: Name of the asked type; empty when only the hash is known.
        type_hash: Its hash, or for a service that of its request; empty takes the definition in
            use here.
        sources: Whether to add the definitions' texts.

    Raises:
        Error: There is none; the text says why.
    """
    if type_hash and not is_hash(type_hash):
        raise DefinitionError(f"{type_hash!r:.90} is no RIHS01 hash", "the request")
    definition = _find(types, name, type_hash)
    texts: list[dict[str, str]] = []
    if sources:
        texts = type_sources(definition)
        known = {text["type_name"] for text in texts}
        for owner, _ in derived_from(definition.name, 2):
            # The constants of a goal or request are in the text of its action or service only.
            with suppress(Error):
                texts += [
                    text
                    for text in type_sources(types.library.definition(owner))[:1]
                    if owner not in known
                ]
    return {
        "successful": True,
        "type_description": type_description(definition),
        "type_sources": texts,
        "extra_information": [{"key": _VERBATIM, "value": "type_sources are verbatim"}],
    }


def _find(types: Types, name: str, type_hash: str) -> InterfaceDefinition:
    used = types.in_use(type_hash) if type_hash else None
    if used is not None:
        return used
    if not (name or type_hash):
        raise TypeNotFoundError("neither a type's name nor its hash was asked for")
    if not name:
        raise TypeNotFoundError(f"no type with the hash {type_hash} is in use here")
    return types.library.definition(join_name(name), hash=type_hash)


class WrongHashError(DefinitionConflictError):
    """A node sent a definition whose hash is not the announced one."""


def read_answer(answer: Message, name: str, wanted: str, node: str) -> InterfaceDefinition:
    """Return the definition that a node sent.

    Args:
        answer: The response.
        name: Full name of the type that it was asked for.
        wanted: The hash that was announced for it.
        node: The node's name.

    Raises:
        WrongHashError: It sent something else.
        Error: It sent nothing, or rubbish; the text says why.
    """
    size = len(answer.type.encode(answer))
    if size > _MAX_ANSWER:
        raise TypeNotFoundError(f"its answer has {size} bytes, the limit is {_MAX_ANSWER}")
    if not answer["successful"]:
        reason = "".join(sign if sign.isprintable() else " " for sign in answer["failure_reason"])
        raise TypeNotFoundError(f"it answered: {reason[:300].strip() or 'no'}")
    described = parse_type_description(
        answer["type_description"].to_dict(), provider=f"wire {node}"
    )
    extra = {entry["key"] for entry in answer["extra_information"]}
    sources = [source.to_dict() for source in answer["type_sources"]]
    found = add_type_sources(described, sources, verbatim=_VERBATIM in extra)
    if found.name != name or wanted not in announced_hashes(found):
        raise WrongHashError(
            f"it sent a definition of {found.name} with the hash {rihs01(found)}, where {wanted} "
            f"is announced for {name}"
        )
    return found


def compose_action(name: str, parts: Mapping[str, InterfaceDefinition]) -> ActionDefinition:
    """Put an action together from what the graph has of it.

    Args:
        name: The action's full name.
        parts: The definition of each of :data:`ACTION_PARTS`.

    Raises:
        DefinitionError: They are not the parts of one action.
    """
    nested: dict[str, Definition] = {}
    for part in parts.values():
        for message in parts_of(part):
            nested.update(message.nested)
    missing = [suffix for suffix in _GOAL_PARTS if name + suffix not in nested]
    if missing:
        raise DefinitionError(f"its parts do not mention {name}{missing[0]}", f"<{name}>")
    goal, result, feedback = (nested[name + suffix] for suffix in _GOAL_PARTS)
    text = "\n---\n".join(part.text for part in (goal, result, feedback))
    action = ActionDefinition(name, 2, goal, result, feedback, text, goal.source)
    for suffix, part in parts.items():
        derived = derive(action, suffix)
        if derived is None or rihs01(derived) != rihs01(part):
            raise DefinitionError(f"{part.name} is not what ROS 2 makes of it", f"<{name}>")
    return action


if TYPE_CHECKING:
    from collections.abc import Callable, Container, Iterable, Mapping, Sequence
    from concurrent.futures import Future

    from rosglass.comm import EndpointInfo, ServiceClient
    from rosglass.interfaces import Definition, InterfaceDefinition
    from rosglass.messages import ActionType, MessageType, ServiceType
    from rosglass.ros2.core import Core
    from rosglass.wires.base import Middleware

    AnyType: TypeAlias = MessageType | ServiceType | ActionType
    _Users: TypeAlias = Mapping[str, Sequence[EndpointInfo]]
    _Asked: TypeAlias = tuple[
        tuple[str, str, str],
        tuple[EndpointInfo, ...] | None,
        Callable[[], None] | None,
        Promise[AnyType] | None,
    ]


#: Seconds that a node has to answer, and after which the next one is asked meanwhile.
_TIMEOUT, _HEDGE = 5.0, 1.0
#: Seconds that the graph has to become complete: a node's service may show after its publishers.
_GRACE = 1.0
#: The same while programs are there that have not said which nodes they have: Fast DDS takes 1 to
#: 4 s, and until then its services belong to no node that could be asked.
_INTRODUCTION_S = 8.0
#: Seconds until a node that did not answer is asked again: at first, and at most (it doubles).
_AGAIN, _RARELY = 5.0, 60.0
#: Seconds for which a definition that nobody queries for any more is still fetched.
_INTEREST = 30.0
#: Questions on their way at once, and definitions fetched in all: more come only from a graph gone
#: wild.
_MAX_ASKED, _MAX_FETCHED = 16, 2000


class TypeFetcher(NodeMember):
    """Fetches definitions for one node.

    All decisions are made in rounds on the node's own dispatcher; what the graph, timers and
    answers bring only queries for the next round.

    Args:
        core: The node.
    """

    def __init__(self, core: Core) -> None:
        self._core = core
        #: Changed by rounds only.
        self._requests: dict[tuple[str, str, str], TypeRequest] = {}
        #: What was asked for since the last round, from any thread: a type's key, who uses it, who
        #: is told when it has come, and what it fulfils.
        self._asked_for: deque[_Asked] = deque()
        self._answers: deque[tuple[TypeRequest, bytes | str, Future[Any]]] = deque()
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
        if self._closed:
            return "the node is closed"
        key = name, hash, ""
        self._put((key, tuple(endpoints), on_done, None))
        request = self._requests.get(key)
        return "" if request is None else request.problem

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
                promise.set_result(self._load(name, hash))
                return promise
        if timeout is not None:
            timer = self._core.timers.after(timeout, lambda: self._expire(name, promise, timeout))
            promise.add_done_callback(lambda _: timer.close())
        self._put(((name, hash, "" if hash else node), None, None, promise))
        return promise

    def follow(self, moved: bool, idle: bool) -> None:  # noqa: ARG002 - time passes, too
        """Follow the graph: somebody to ask may have appeared."""
        if self._requests or self._clients:
            self._kick()

    def close(self) -> None:
        """End all fetching; safe to call twice."""
        self._closed = True
        self._end()
        self._clients.close()
        self._core.remove(self)

    def _end(self) -> None:
        """End what was asked for; the last round's business when it runs while the node closes."""
        promises = []
        while self._asked_for:
            with suppress(IndexError):  # the other one took it
                promises.append(self._asked_for.popleft()[-1])
        for request in self._requests.copy().values():
            promises += request.promises
            if request.lookup is not None:
                request.lookup.join()
        for promise in promises:
            if promise is not None:
                promise.set_exception(
                    NodeClosedError(f"node {self._core.name} is closed; connect again")
                )

    def _put(self, asked: _Asked) -> None:
        """PendingQuery for a type in the next round; from any thread."""
        self._asked_for.append(asked)
        if self._closed:
            self._end()
        self._kick()

    def _request(self, key: tuple[str, str, str]) -> TypeRequest:
        return self._requests.setdefault(key, TypeRequest(*key))

    def _load(self, name: str, type_hash: str) -> AnyType:
        from rosglass.messages import load  # noqa: PLC0415 - numpy

        return load(name, ros=2, library=self._core.types.library, hash=type_hash)

    def _expire(self, name: str, promise: Promise[AnyType], timeout: float) -> None:
        if promise.done():
            return
        reason = "nobody in the graph uses it"
        for request in self._requests.copy().values():
            if promise not in request.promises:
                continue
            if request.problem:
                reason = request.problem
            elif request.queries:
                servers = [query.server for query in request.queries.copy().values()]
                reason = f"{nodes_of(servers)} did not answer yet"
            elif request.hash:
                reason = "nobody in the graph uses this version of it"
        text = f"no definition of {name} within {timeout:g} s: {reason}"
        promise.set_exception(TypeNotFoundError(text))

    # -- rounds ----------------------------------------------------------------------------------

    def _kick(self) -> None:
        if not self._posted and not self._closed:
            self._posted = True
            self._core.own_dispatcher.post(self._round)

    def _round(self) -> None:
        self._posted = False  # first: what is asked for from here on has a round of its own
        while self._asked_for and not self._closed:
            self._take_up(*self._asked_for.popleft())
        requests = list(self._requests.values())
        while self._answers:
            self._take(*self._answers.popleft())
        users = self._core.graph.users()
        now = time.monotonic()
        for request in requests:
            request.promises = [promise for promise in request.promises if not promise.done()]
            if not request.promises and now - request.used > _INTEREST:
                self._drop(request)
            elif self._requests.get(request.key) is request:
                try:
                    self._advance(request, users, now)
                except NodeClosedError:
                    break
                except Exception:
                    _log.exception("fetching %s failed", request.name)
        self._clients.close_idle(now)
        if self._closed:
            self._end()

    def _take_up(
        self,
        key: tuple[str, str, str],
        endpoints: tuple[EndpointInfo, ...] | None,
        listener: Callable[[], None] | None,
        promise: Promise[AnyType] | None,
    ) -> None:
        """Begin to get a type that was asked for, or let one more wait for it."""
        request, now = self._request(key), time.monotonic()
        if endpoints is not None:
            request.endpoints, request.used = endpoints, now
        if listener is not None and listener not in request.listeners:
            request.listeners.append(listener)
        if promise is not None:
            request.since = now
            request.promises.append(promise)

    def _advance(self, request: TypeRequest, users: _Users, now: float) -> None:
        """Do what can be done now to get a definition."""
        name = next(iter(spelled(request.name, users)), request.name)
        if name.split("/")[1] == "action" and name not in users and not request.hash:
            self._advance_action(request, name, users, now)
            return
        if request.hash:
            found = self._core.types.library.version(name, request.hash)
            if found is None:
                self._query_next(request, name, users, now)
            else:
                self._arrived(request, found)
            return
        announced = self._announced(request, name, users, now)
        if announced:
            self._hand_over(request, name, announced, users, now)

    def _hand_over(
        self, request: TypeRequest, name: str, announced: str, users: _Users, now: float
    ) -> None:
        """Go on with the version that was found to be meant."""
        if not request.looked:
            request.looked = True  # the library may have it all along
            with suppress(Error):
                self._arrived(request, self._core.types.library.definition(name, hash=announced))
                return
        target = self._request((name, announced, ""))
        target.used = now
        target.endpoints = target.endpoints or request.endpoints
        target.promises += request.promises
        request.promises = []
        target.listeners += [each for each in request.listeners if each not in target.listeners]
        self._advance(target, users, now)
        changed, request.problem = request.problem != target.problem, target.problem
        if not request.listeners or self._requests.get(target.key) is not target:
            self._drop(request)
        elif changed:
            for listener in list(request.listeners):
                listener()

    def _announced(self, request: TypeRequest, name: str, users: _Users, now: float) -> str:
        """Return the one hash that the graph has for a type, empty when there is none (yet)."""
        known: dict[str, set[str]] = {}
        for user in users.get(name, ()):
            if user.type_hash and request.node in ("", user.node.full):
                known.setdefault(user.type_hash, set()).add(user.node.full)
        if len(known) == 1:
            return next(iter(known))
        if known:
            told = "; ".join(f"{key} of {', '.join(sorted(of))}" for key, of in known.items())
            problem = f"the graph has several versions ({told}); choose one by its hash or node"
            self._settle(request, DefinitionConflictError(f"{name}: {problem}"), problem)
        elif request.promises and now - self._since > _GRACE and self._fulfil(request, name, ""):
            pass  # nobody announces another version: what the library has is right
        elif (name in users or request.endpoints) and not self._looked_up(request, name, users):
            self._give_up(
                request,
                f"{nodes_of(users.get(name, request.endpoints))} announces no type hash and sends "
                "no definitions (ROS 2 Humble and older, or a program that is not built on rcl)"
                f"{_told(request)}; {adding_definitions(request.name, 2)}",
                now,
            )
        return ""

    def _advance_action(self, request: TypeRequest, name: str, users: _Users, now: float) -> None:
        """Put an action together: only its parts are in the graph with their hashes."""
        parts: dict[str, InterfaceDefinition] = {}
        problems: list[str] = []
        for suffix in ACTION_PARTS:
            part = self._request((name + suffix, "", request.node))
            if self._kick not in part.listeners:
                part.listeners.append(self._kick)
            part.used, part.endpoints = now, users.get(part.name, request.endpoints)
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
                self._arrived(request, action)
            except Error as error:
                self._settle(request, error, str(error))
        elif problems:
            self._give_up(request, "; ".join(problems), now)
        elif (
            request.promises and now - self._since > _GRACE and name + ACTION_PARTS[0] not in users
        ):
            self._fulfil(request, name, "")

    # -- asking ----------------------------------------------------------------------------------

    def _query_next(self, request: TypeRequest, name: str, users: _Users, now: float) -> None:
        """PendingQuery the next node, or say why none is left."""
        if any(now - query.started < _HEDGE for query in request.queries.values()):
            return
        same = [user for user in users.get(name, ()) if user.type_hash == request.hash]
        own = self._core.name
        nodes = dict.fromkeys(u.node for u in (*request.endpoints, *same) if u.node != own)
        servers: dict[bytes | str, EndpointInfo] = {}
        mute: list[str] = []
        for node in nodes:
            kind, service = EndpointKind.SERVICE_SERVER, f"{node.full}/{SERVICE}"
            found = [s for s in self._core.graph.endpoints(kind, service) if s.node == node]
            servers.update((server.gid or node.full, server) for server in found)
            if not found:
                mute.append(node.full)
        # One that was restarted is asked again.
        request.tried = {key: trial for key, trial in request.tried.items() if key in servers}
        for key, server in servers.items():
            trial = request.tried.get(key)
            if key not in request.queries and (trial is None or now >= trial.again):
                if self._asked < _MAX_ASKED:
                    self._query(request, key, server, name)
                return
        if request.queries:
            return
        if not request.stored:
            request.stored = True
            stored = self._cache.get(name, request.hash)
            if stored is not None:
                self._core.types.library.add_version(stored)
                self._arrived(request, stored)
                return
        if not self._looked_up(request, name, users):
            self._give_up(request, self._reasons(request, mute), now)

    def _looked_up(self, request: TypeRequest, name: str, users: _Users) -> bool:
        """Ask the middleware; returns whether it has answered well, or may still do so."""
        if request.lookup is None or request.lookup.age > _RARELY:
            endpoints = (*request.endpoints, *users.get(name, ()))
            request.lookup = Lookup(self._core.middleware, name, endpoints, self._kick)
        found = request.lookup.found
        if request.lookup.done and found is not None:
            if found.name == name and request.hash in ("", *announced_hashes(found)):
                self._core.types.library.add_version(found)
                self._arrived(request, found)
                return True
            request.lookup.found = None
            request.lookup.problem = (
                f"TypeLookup tells of {found.name} with the hash {rihs01(found)}"
            )
        return not request.lookup.done

    def _reasons(self, request: TypeRequest, mute: Sequence[str]) -> str:
        reasons = [f"{trial.node}: {trial.reason}" for trial in request.tried.values()]
        if mute:
            reasons.append(
                f"{', '.join(mute)} has no {SERVICE} service (ROS 2 Humble or older, a node "
                "started with start_type_description_service:=false, or a program that is not "
                "built on rcl)"
            )
        if not reasons:
            return "no other node in the graph uses this version of it"
        told = f"asked for its definition: {'; '.join(reasons)}{_told(request)}"
        if self._core.middleware.announces_requests and "/msg/" not in request.name:
            told += (
                ". Over DDS, ROS 2 nodes announce a service by the hash of its request, and do not "
                "find its type by that when asked"
            )
        return f"{told}; {adding_definitions(request.name, 2)}"

    def _query(
        self, request: TypeRequest, key: bytes | str, server: EndpointInfo, name: str
    ) -> None:
        query = PendingQuery(server, name)
        if self._fetched >= _MAX_FETCHED:
            self._failed(
                request, key, query, f"not asked: {_MAX_FETCHED} types were fetched already"
            )
            return
        fields = {"type_name": name, "type_hash": request.hash, "include_type_sources": True}
        try:
            call = self._clients.get(server.name).call_async(fields, timeout=_TIMEOUT)
        except NodeClosedError:
            raise
        except Error as error:
            self._failed(request, key, query, str(error))
            return
        request.queries[key] = query
        self._asked += 1
        self._core.timers.after(_HEDGE, self._kick)
        call.add_done_callback(lambda done: self._on_answer(request, key, done))

    def _on_answer(self, request: TypeRequest, key: bytes | str, call: Future[Any]) -> None:
        """Take an answer in the thread that brings it, to look at it in the next round."""
        self._answers.append((request, key, call))
        self._kick()

    def _take(self, request: TypeRequest, key: bytes | str, call: Future[Any]) -> None:
        self._asked -= 1
        query = request.queries.pop(key, None)
        if query is None or call.cancelled() or self._requests.get(request.key) is not request:
            return
        node = query.server.node.full
        try:
            found = read_answer(call.result(), query.name, request.hash, node)
            self._core.types.library.add_version(found)
        except WrongHashError as error:
            self._failed(request, key, query, str(error), believable=False)
            if (node, request.name) not in self._told:
                self._told.add((node, request.name))
                _log.warning("%s is not believed: %s; it is not used", node, error)
        except Error as error:
            self._failed(request, key, query, str(error))
        else:
            self._fetched += 1
            self._arrived(request, found)
            self._cache.put(found, request.hash)

    def _failed(
        self,
        request: TypeRequest,
        key: bytes | str,
        query: PendingQuery,
        reason: str,
        *,
        believable: bool = True,
    ) -> None:
        """Remember why a node did not help, and ask it again later, or never."""
        before = request.tried.get(key)
        count = 1 if before is None else before.count + 1
        pause = min(_AGAIN * 2.0 ** (count - 1), _RARELY) if believable else float("inf")
        again = time.monotonic() + pause
        request.tried[key] = QueryResult(query.server.node.full, reason, count, again)
        self._kick()

    # -- endings ---------------------------------------------------------------------------------

    def _arrived(self, request: TypeRequest, found: InterfaceDefinition) -> None:
        """Tell everybody that the library has a definition now."""
        self._drop(request)
        self._fulfil(request, found.name, rihs01(found))
        for listener in list(request.listeners):
            listener()

    def _fulfil(self, request: TypeRequest, name: str, type_hash: str) -> bool:
        """Keep the promises, if the library has a type; returns whether it has."""
        try:
            found = self._load(name, type_hash)
        except Error as error:
            if type_hash:
                self._fail(request, error)
            return False
        for promise in request.promises:
            promise.set_result(found)
        return True

    def _give_up(self, request: TypeRequest, reason: str, now: float) -> None:
        """Say why nothing will come, unless the graph may not be complete yet."""
        limit = _INTRODUCTION_S if self._core.middleware.unnamed() else _GRACE
        left = max(request.since, self._since) + limit - now
        if left > 0:
            self._core.timers.after(min(left, _GRACE) + 0.01, self._kick)
        else:
            self._settle(
                request, TypeNotFoundError(f"no definition of {request.name}: {reason}"), reason
            )

    def _settle(self, request: TypeRequest, error: Error, reason: str) -> None:
        self._fail(request, error)
        changed, request.problem = request.problem != reason, reason
        if changed:
            for listener in list(request.listeners):
                listener()
        if not request.listeners:
            self._drop(request)

    def _fail(self, request: TypeRequest, error: Error) -> None:
        for promise in request.promises:
            promise.set_exception(error)

    def _drop(self, request: TypeRequest) -> None:
        if self._requests.get(request.key) is request:
            del self._requests[request.key]


def _told(request: TypeRequest) -> str:
    problem = "" if request.lookup is None else request.lookup.problem
    return f"; {problem}" if problem else ""


class PendingQuery:
    """A question on its way to a node."""

    def __init__(self, server: EndpointInfo, name: str) -> None:
        self.server, self.name = server, name
        self.started = time.monotonic()


class QueryResult:
    """What came of asking a node, and when to ask it again."""

    def __init__(self, node: str, reason: str, count: int, again: float) -> None:
        self.node, self.reason, self.count, self.again = node, reason, count, again


class TypeRequest:
    """A definition that is wanted, and how far getting it has come.

    Args:
        name: Its type's name.
        type_hash: The hash that was announced for it; empty takes the one that is in the graph.
        node: Full name of the node whose version is meant; empty for any.

    Attributes:
        endpoints: Who uses it.
        listeners: Told when it has come, or cannot be had.
        promises: Fulfilled when it has come.
        since: When it was wanted first, and `used` last; monotonic seconds.
        queries: Questions on their way, by the server's identity.
        tried: What came of earlier ones, by the same.
        problem: Why it cannot be had; empty while there is hope.
        looked: Whether the library was asked for the version that the graph has.
        stored: Whether the cache on disk was.
        lookup: What the middleware itself was asked.
    """

    def __init__(self, name: str, type_hash: str, node: str) -> None:
        self.name, self.hash, self.node = name, type_hash, node
        self.endpoints: Sequence[EndpointInfo] = ()
        self.listeners: list[Callable[[], None]] = []
        self.promises: list[Promise[AnyType]] = []
        self.since = self.used = time.monotonic()
        self.queries: dict[bytes | str, PendingQuery] = {}
        self.tried: dict[bytes | str, QueryResult] = {}
        self.problem = ""
        self.looked = self.stored = False
        self.lookup: Lookup | None = None

    @property
    def key(self) -> tuple[str, str, str]:
        """What tells it from other ones."""
        return self.name, self.hash, self.node


def spelled(name: str, known: Container[str]) -> list[str]:
    """Return the full names that a type's name may stand for, of those that are known.

    Args:
        name: Full, or ``pkg/Type``.
        known: Full names. An action's is implied by those of its parts.
    """
    package, kind, base = split_name(name)
    full = [f"{package}/{folder}/{base}" for folder in ((kind,) if kind else KINDS)]
    return [
        each
        for each in full
        if each in known
        or (each.split("/")[1] == "action" and any(each + part in known for part in ACTION_PARTS))
    ]


#: Seconds for which an unused connection to a node is kept.
_LINGER = 5.0


class TypeClients:
    """One client of each ``get_type_description`` in use.

    Args:
        core: The node that queries.
    """

    def __init__(self, core: Core) -> None:
        self._core = core
        self._lock = threading.Lock()
        self._closed = False
        self._known: dict[str, tuple[ServiceClient, float]] = {}

    def __bool__(self) -> bool:
        return bool(self._known)

    def get(self, service: str) -> ServiceClient:
        """Return the client of a service; raises NodeClosedError, or what creating one raises."""
        known = self._known.get(service)
        if known is None:
            client = create_service_client(self._core, service, service_type())
        else:
            client = known[0]
        with self._lock:
            closed = self._closed
            if not closed:
                self._known[service] = (client, time.monotonic())
        if closed:
            client.close()
        return client

    def close_idle(self, now: float) -> None:
        """Close those that were not used for a while."""
        with self._lock:
            idle = [
                service
                for service, (client, used) in self._known.items()
                if not client.pending and now - used > _LINGER
            ]
            clients = [self._known.pop(service)[0] for service in idle]
        for client in clients:
            client.close()

    def close(self) -> None:
        """Close all of them."""
        with self._lock:
            self._closed = True
            clients, self._known = list(self._known.values()), {}
        for client, _ in clients:
            client.close()


_TOPICS = (EndpointKind.PUBLISHER, EndpointKind.SUBSCRIPTION)
#: Seconds that each endpoint has to answer, and how many are asked.
_LOOKUP_TIMEOUT_S, _MAX_LOOKED_UP = 2.0, 3


class Lookup:
    """Asks the middleware for a message's definition, on a thread that ends with the answer.

    Args:
        middleware: What to ask.
        name: The message's name.
        endpoints: Who uses it.
        on_done: Called in that thread when there is an answer.

    Attributes:
        done: Whether there is.
        found: The definition, if there was one.
        problem: Why there is none although an endpoint announced one.
    """

    def __init__(
        self,
        middleware: Middleware,
        name: str,
        endpoints: Iterable[EndpointInfo],
        on_done: Callable[[], None],
    ) -> None:
        self._middleware, self._on_done = middleware, on_done
        self.found: Definition | None = None
        self.problem = ""
        self._begun = time.monotonic()
        asked = [e for e in endpoints if e.kind in _TOPICS and e.type == name]
        self.done = not (asked and middleware.describes_types)
        self._thread = threading.Thread(
            target=self._work, args=(asked[:_MAX_LOOKED_UP],), name=f"{name} lookup", daemon=True
        )
        if not self.done:
            self._thread.start()

    @property
    def age(self) -> float:
        """Seconds since it was begun."""
        return time.monotonic() - self._begun

    def join(self) -> None:
        """Wait for the thread, which takes a few seconds at most."""
        if self._thread.ident is not None and self._thread is not threading.current_thread():
            self._thread.join(_LOOKUP_TIMEOUT_S)

    def _work(self, endpoints: list[EndpointInfo]) -> None:
        for endpoint in endpoints:
            try:
                self.found = self._middleware.describe_type(endpoint, _LOOKUP_TIMEOUT_S)
            except Error as error:
                self.problem = f"{endpoint.node}: {error}"
            except Exception as error:
                _log.exception("looking up the type of %s failed", endpoint.name)
                self.problem = f"{endpoint.node}: {error}"
            if self.found is not None:
                break
        self.done = True
        self._on_done()
