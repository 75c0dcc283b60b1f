"""Client and server of REP 2016's service ``~/get_type_description``.

Nodes since ROS 2 Iron offer it. A received definition is accepted only if it has the announced
hash; then it is added to the library, and cached on disk. ``rcl``'s ``node.c`` looks up types by
hash alone, among those that its node uses; this server also describes the library's types.
"""

from __future__ import annotations

import logging
import math
import re
import threading
import time
from collections import deque
from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

from rosglass.comm import EndpointKind, Handle, Promise
from rosglass.comm.core import NodeMember
from rosglass.comm.handle import guarded
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
from rosglass.messages import ServiceType, load
from rosglass.ros2.announced import nodes_of
from rosglass.ros2.rmw_services import create_service_client, create_service_server

if TYPE_CHECKING:
    from collections.abc import Callable, Container, Iterable, Mapping, Sequence
    from concurrent.futures import Future

    from rosglass.comm import EndpointInfo, NodeName, ServiceClient
    from rosglass.comm.types import Types
    from rosglass.comm.wire import Middleware
    from rosglass.interfaces import Definition, InterfaceDefinition
    from rosglass.messages import ActionType, Message, MessageType
    from rosglass.ros2.core import Core

    AnyType: TypeAlias = MessageType | ServiceType | ActionType
    _Users: TypeAlias = Mapping[str, Sequence[EndpointInfo]]
    _NewRequest: TypeAlias = tuple[
        tuple[str, str, str],
        tuple[EndpointInfo, ...] | None,
        Callable[[], None] | None,
        Promise[AnyType] | None,
    ]

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
#: The service's name relative to the node's.
SERVICE = "get_type_description"
_TYPE = "type_description_interfaces/srv/GetTypeDescription"
#: The parts of an action that are in the graph, with hashes; the action itself is not.
ACTION_PARTS = ("_SendGoal", "_GetResult", "_FeedbackMessage")

_GOAL_PARTS = ("_Goal", "_Result", "_Feedback")
#: Key in ``extra_information`` of types whose source texts are original; see
#: :func:`rosglass.interfaces.add_type_sources`.
_VERBATIM = "rosglass"
_HASH = re.compile(r"RIHS[0-9]{2}_[0-9a-f]{64}")
#: Maximum size of an accepted answer in bytes; real types need less than a hundredth of it.
_MAX_ANSWER = 8 << 20


def service_type() -> ServiceType:
    """Return the type of the service, independent of the node's own library."""
    found = load(_TYPE)
    assert isinstance(found, ServiceType)
    return found


def is_hash(text: object) -> bool:
    """Return whether a value is a type hash as a string."""
    return isinstance(text, str) and _HASH.fullmatch(text) is not None


class TypeDescriptionServer(Handle):
    """The service server of a node's ``~/get_type_description``.

    Args:
        core: The node.
    """

    def __init__(self, core: Core) -> None:
        self._core = core
        self._server: Handle | None = None
        self._closed = False

    def open(self) -> None:
        """Create the server; raises NodeClosedError, or UnsupportedError without services."""
        core = self._core
        name = f"{core.name.full}/{SERVICE}"
        kind = service_type()
        server = create_service_server(core, name, kind, self._answer, executor=core.own_dispatcher)
        self._server = server
        if self._closed:
            server.close()

    def close(self) -> None:
        """Close the server; safe to call twice."""
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
    """Return the response of ``~/get_type_description``, as a dict.

    Args:
        types: The node's types.
        name: Name of the requested type; empty if only the hash is known.
        type_hash: Its hash, or for a service that of its request; empty for the definition in use
            here.
        sources: Whether to add the definitions' texts.

    Raises:
        Error: The type does not exist.
    """
    if type_hash and not is_hash(type_hash):
        raise DefinitionError(f"{type_hash!r:.90} is not a RIHS01 hash", "the request")
    definition = _find(types, name, type_hash)
    texts: list[dict[str, str]] = []
    if sources:
        texts = type_sources(definition)
        known = {text["type_name"] for text in texts}
        for owner, _ in derived_from(definition.name, 2):
            # Only the text of the action or service has the constants of its goal or request.
            with suppress(Error):  # it is known without them
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
    """Return the definition in a node's response.

    Args:
        answer: The response.
        name: Full name of the requested type.
        wanted: The announced hash.
        node: The node's name.

    Raises:
        WrongHashError: It sent another definition.
        Error: It sent none, or one that cannot be read.
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
    """Compose an action from the parts that are in the graph.

    Args:
        name: The action's full name.
        parts: The definition of each of :data:`ACTION_PARTS`.

    Raises:
        DefinitionError: They are not the parts of a single action.
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


#: Seconds that a node has to answer a query, and until the next node is queried in parallel.
_QUERY_TIMEOUT_S, _HEDGE_S = 5.0, 1.0
#: Seconds that the graph has to become complete: a node's service may appear after its publishers.
_GRACE_S = 1.0
#: The same while participants have not announced their nodes: Fast DDS takes 1 to 4 s, and until
#: then its services belong to no node that could be queried.
_INTRODUCTION_S = 8.0
#: Seconds until a node that did not answer is queried again: initially, and at most (it doubles).
_RETRY_S, _MAX_RETRY_S = 5.0, 60.0
#: Seconds after its last request for which a definition is still fetched.
_INTEREST_S = 30.0
#: Seconds for which an unused service client is kept.
_LINGER_S = 5.0
#: Maximum pending queries, and definitions fetched in total; only a faulty graph needs more.
_MAX_PENDING, _MAX_FETCHED = 16, 2000
#: Seconds that an endpoint has to answer a lookup, and the number of endpoints to look up.
_LOOKUP_TIMEOUT_S, _MAX_LOOKUPS = 2.0, 3
_TOPICS = (EndpointKind.PUBLISHER, EndpointKind.SUBSCRIPTION)


class TypeFetcher(NodeMember):
    """Fetches type definitions for a node from other nodes.

    All decisions are made in rounds on the node's own dispatcher. Events of the graph, timers and
    responses only schedule the next round: for all requests after a change of the graph, otherwise
    for those that are concerned.

    Args:
        core: The node.
    """

    def __init__(self, core: Core) -> None:
        self._core = core
        #: Changed in rounds only.
        self._requests: dict[tuple[str, str, str], TypeRequest] = {}
        #: Requests since the last round, from any thread: a type's key, the endpoints that use it,
        #: a listener and a promise.
        self._new: deque[_NewRequest] = deque()
        self._answers: deque[tuple[TypeRequest, bytes | str, Future[Any]]] = deque()
        #: Clients of ``get_type_description``, and monotonic times of their last use, by service.
        self._clients: dict[str, tuple[ServiceClient, float]] = {}
        #: Requests for the next round, from any thread, and those that wait for a pending query.
        self._due: deque[TypeRequest] = deque()
        self._waiting: dict[TypeRequest, None] = {}
        #: The endpoints of every type, as of a version of the graph.
        self._users: tuple[int, _Users] = -1, {}
        self._cache = TypeCache(cache_folder())
        self._scheduled = self._closed = self._all_due = False
        self._started = time.monotonic()
        self._pending = self._fetched = 0
        self._warned: set[tuple[str, str]] = set()
        core.types.fetcher = self
        core.add(self)

    # -- requests ----------------------------------------------------------------------------------

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
        self._add_request((key, tuple(endpoints), on_done, None))
        request = self._requests.get(key)
        if request is None or any(endpoint.node not in request.nodes for endpoint in endpoints):
            return ""  # the problem comes from nodes queried earlier
        return request.problem

    def knows(self, name: str) -> bool:
        """Return whether an endpoint in the graph uses a type."""
        return bool(find_full_names(name, self._core.graph.users()))

    def fetch(
        self, name: str, *, hash: str = "", node: str = "", timeout: float | None = 5.0
    ) -> Promise[AnyType]:
        """Fetch a type; see :meth:`rosglass.comm.Node.fetch_type_async`."""
        split_name(name)
        timeout = check_timeout(timeout, f"fetching {name}")
        if hash and not is_hash(hash):
            raise InvalidNameError(
                f"{hash!r:.90} is not a type hash of {name}; "
                "write RIHS01_ and 64 hexadecimal digits"
            )
        promise: Promise[AnyType] = Promise(
            f"{name} has not been received", self._core.dispatcher, cancellable=True
        )
        if hash:
            with suppress(Error):  # then it is fetched
                promise.set_result(self._load(name, hash))
                return promise
        if timeout is not None:
            timer = self._core.timers.after(timeout, lambda: self._expire(name, promise, timeout))
            promise.add_done_callback(lambda _: timer.close())
        self._add_request(((name, hash, "" if hash else node), None, None, promise))
        return promise

    def follow(self, moved: bool, idle: bool) -> None:  # noqa: ARG002 - it may move for others
        """Follow the graph: a node to query may have appeared."""
        if self._clients or (
            self._requests and (idle or self._users[0] != self._core.graph.version)
        ):
            self._schedule()

    def close(self) -> None:
        """Fail pending requests; safe to call twice. The clients are closed with the node."""
        self._closed = True
        self._fail_all()
        self._core.remove(self)

    def _fail_all(self) -> None:
        """Fail all promises; also called by a round that runs while the node closes."""
        promises = []
        while self._new:
            with suppress(IndexError):  # another thread took it
                promises.append(self._new.popleft()[-1])
        for request in self._requests.copy().values():
            promises += request.promises
            if request.lookup is not None:
                request.lookup.join()
        for promise in promises:
            if promise is not None:
                promise.set_exception(
                    NodeClosedError(f"node {self._core.name} is closed; connect again")
                )

    def _add_request(self, new: _NewRequest) -> None:
        self._new.append(new)
        if self._closed:
            self._fail_all()
        self._schedule()

    def _request(self, key: tuple[str, str, str]) -> TypeRequest:
        request = self._requests.get(key)
        if request is None:
            request = self._requests[key] = TypeRequest(*key, self._schedule)
        return request

    def _load(self, name: str, type_hash: str) -> AnyType:
        return load(name, ros=2, library=self._core.types.library, hash=type_hash)

    def _expire(self, name: str, promise: Promise[AnyType], timeout: float) -> None:
        if promise.done():
            return
        reason = "no node in the graph uses it"
        for request in self._requests.copy().values():
            if promise not in request.promises:
                continue
            if request.problem:
                reason = request.problem
            elif request.queries:
                servers = [query.server for query in request.queries.copy().values()]
                reason = f"{nodes_of(servers)} did not answer yet"
            elif request.hash:
                reason = "no node in the graph uses this version of it"
        promise.set_exception(
            TypeNotFoundError(f"no definition of {name} within {timeout:g} s: {reason}")
        )

    # -- rounds ------------------------------------------------------------------------------------

    def _schedule(self, request: TypeRequest | None = None) -> None:
        """Request a round for a request, or for all."""
        if request is None:
            self._all_due = True
        else:
            self._due.append(request)
        if not self._scheduled and not self._closed:
            self._scheduled = True
            self._core.own_dispatcher.post(self._round)

    def _round(self) -> None:
        self._scheduled = False  # first: requests from here on schedule another round
        version = self._core.graph.version
        if version != self._users[0]:
            self._users = version, self._core.graph.users()
            self._all_due = True
        due: dict[TypeRequest, None] = {}
        while self._new and not self._closed:
            key, endpoints, listener, promise = self._new.popleft()
            request = self._request(key)
            request.add(endpoints, listener, promise)
            due[request] = None
        if self._all_due:
            self._all_due = False
            due |= dict.fromkeys(self._requests.values())
        while self._answers:
            self._on_answer(*self._answers.popleft())
        while self._due:
            due[self._due.popleft()] = None
        for request in due:
            self._continue(request)
        while self._waiting and self._pending < _MAX_PENDING and not self._closed:
            request = next(iter(self._waiting))
            del self._waiting[request]
            self._continue(request)
        now = time.monotonic()
        for service, (client, used) in list(self._clients.items()):
            if not client.pending and now - used > _LINGER_S:
                del self._clients[service]
                client.close()
        if self._closed:
            self._fail_all()

    def _continue(self, request: TypeRequest) -> None:
        """Advance a request, or drop it if it is of no use any more."""
        now = time.monotonic()
        request.promises = [promise for promise in request.promises if not promise.done()]
        if not request.promises and now - request.used > _INTEREST_S:
            self._drop(request)
        elif self._requests.get(request.key) is request and not self._closed:
            with guarded(_log, "fetching %s failed", request.name):
                try:
                    self._advance(request, self._users[1], now)
                except NodeClosedError:
                    self._closed = True

    def _advance(self, request: TypeRequest, users: _Users, now: float) -> None:
        """Take the next possible steps to get a definition."""
        name = next(iter(find_full_names(request.name, users)), request.name)
        if name.split("/")[1] == "action" and name not in users and not request.hash:
            self._advance_action(request, name, users, now)
        elif request.hash:
            found = self._core.types.library.version(name, request.hash)
            if found is None:
                self._query_next(request, name, users, now)
            else:
                self._on_definition(request, found)
        elif announced := self._find_hash(request, name, users, now):
            self._continue_with_version(request, name, announced, users, now)

    def _continue_with_version(
        self, request: TypeRequest, name: str, announced: str, users: _Users, now: float
    ) -> None:
        """Continue with the request for the version in the graph."""
        if not request.searched_library:
            request.searched_library = True
            try:
                found = self._core.types.library.definition(name, hash=announced)
            except Error:
                pass  # unknown, or with a mistake: the one in the graph is fetched
            else:
                self._on_definition(request, found)
                return
        target = self._request((name, announced, ""))
        target.used = now
        target.endpoints = target.endpoints or request.endpoints
        target.promises += request.promises
        request.promises = []
        # The request continues with its target, as do those that wait for it.
        target.listeners += [
            each for each in (*request.listeners, request.wake) if each not in target.listeners
        ]
        self._advance(target, users, now)
        changed, request.problem = request.problem != target.problem, target.problem
        if not request.listeners or self._requests.get(target.key) is not target:
            self._drop(request)
        elif changed:
            request.notify()

    def _find_hash(self, request: TypeRequest, name: str, users: _Users, now: float) -> str:
        """Return the only hash that the graph has for a type; empty if it has none or several."""
        known: dict[str, set[str]] = {}
        for user in users.get(name, ()):
            if user.type_hash and request.node in ("", user.node.full):
                known.setdefault(user.type_hash, set()).add(user.node.full)
        if len(known) == 1:
            return next(iter(known))
        if known:
            versions = "; ".join(f"{key} of {', '.join(sorted(of))}" for key, of in known.items())
            problem = f"the graph has several versions ({versions}); choose one by its hash or node"
            self._settle(request, DefinitionConflictError(f"{name}: {problem}"), problem)
        elif (
            request.promises
            and now - self._started > _GRACE_S
            and self._fulfil_promises(request, name)
        ):
            pass  # no other version is announced: use the library's
        elif (name in users or request.endpoints) and not self._look_up(request, name, users):
            self._give_up(
                request,
                f"{nodes_of(users.get(name, request.endpoints))} announces no type hash and sends "
                "no definitions (ROS 2 Humble and older, or a program that is not built on rcl)"
                f"{request.lookup_problem}; {adding_definitions(request.name, 2)}",
                now,
            )
        return ""

    def _advance_action(self, request: TypeRequest, name: str, users: _Users, now: float) -> None:
        """Compose an action from its parts: only these are announced with hashes."""
        parts: dict[str, InterfaceDefinition] = {}
        problems: list[str] = []
        for suffix in ACTION_PARTS:
            part = self._request((name + suffix, "", request.node))
            part.add(users.get(name + suffix, request.endpoints), request.wake, None)
            announced = self._find_hash(part, part.name, users, now)
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
                self._on_definition(request, action)
            except Error as error:
                self._settle(request, error, str(error))
        elif problems:
            self._give_up(request, "; ".join(problems), now)
        elif (
            request.promises
            and now - self._started > _GRACE_S
            and name + ACTION_PARTS[0] not in users
        ):
            self._fulfil_promises(request, name)

    # -- queries -----------------------------------------------------------------------------------

    def _query_next(self, request: TypeRequest, name: str, users: _Users, now: float) -> None:
        """Query the next node, or give up when none is left."""
        if any(now - query.started < _HEDGE_S for query in request.queries.values()):
            return
        same = [user for user in users.get(name, ()) if user.type_hash == request.hash]
        own = self._core.name
        nodes = dict.fromkeys(u.node for u in (*request.endpoints, *same) if u.node != own)
        request.on_nodes(set(nodes), now)
        servers: dict[bytes | str, EndpointInfo] = {}
        without: list[str] = []
        for node in nodes:
            kind, service = EndpointKind.SERVICE_SERVER, f"{node.full}/{SERVICE}"
            found = [s for s in self._core.graph.endpoints(kind, service) if s.node == node]
            servers.update((server.gid or node.full, server) for server in found)
            if not found:
                without.append(node.full)
        # A node that was restarted is queried again.
        request.failed = {key: one for key, one in request.failed.items() if key in servers}
        for key, server in servers.items():
            failed = request.failed.get(key)
            if key not in request.queries and (failed is None or now >= failed.next_try):
                if self._pending < _MAX_PENDING:
                    self._query(request, key, server, name)
                else:
                    self._waiting[request] = None
                return
        if request.queries:
            return
        if not request.searched_cache:
            request.searched_cache = True
            stored = self._cache.get(name, request.hash)
            if stored is not None:
                self._core.types.library.add_version(stored)
                self._on_definition(request, stored)
                return
        if not self._look_up(request, name, users):
            self._give_up(request, self._reasons(request, without), now)

    def _query(
        self, request: TypeRequest, key: bytes | str, server: EndpointInfo, name: str
    ) -> None:
        query = PendingQuery(server, name, time.monotonic())
        if self._fetched >= _MAX_FETCHED:
            reason = f"not queried: {_MAX_FETCHED} types were fetched already"
            self._on_failure(request, key, query, reason)
            return
        fields = {"type_name": name, "type_hash": request.hash, "include_type_sources": True}
        try:
            known = self._clients.get(server.name)
            client = (
                create_service_client(self._core, server.name, service_type())
                if known is None
                else known[0]
            )
            self._clients[server.name] = client, query.started
            call = client.call_async(fields, timeout=_QUERY_TIMEOUT_S)
        except NodeClosedError:
            raise
        except Error as error:
            self._on_failure(request, key, query, str(error))
            return
        request.queries[key] = query
        self._pending += 1
        self._core.timers.after(_HEDGE_S, request.wake)

        def on_response(done: Future[Any]) -> None:
            self._answers.append((request, key, done))
            self._schedule(request)

        call.add_done_callback(on_response)

    def _on_answer(self, request: TypeRequest, key: bytes | str, call: Future[Any]) -> None:
        self._pending -= 1
        query = request.queries.pop(key, None)
        if query is None or call.cancelled() or self._requests.get(request.key) is not request:
            return
        node = query.server.node.full
        try:
            found = read_answer(call.result(), query.name, request.hash, node)
            self._core.types.library.add_version(found)
        except WrongHashError as error:
            self._on_failure(request, key, query, str(error), retry=False)
            if (node, request.name) not in self._warned:
                self._warned.add((node, request.name))
                _log.warning("a definition from %s is not used: %s", node, error)
        except Error as error:
            self._on_failure(request, key, query, str(error))
        else:
            self._fetched += 1
            self._on_definition(request, found)
            self._cache.put(found, request.hash)

    def _on_failure(
        self,
        request: TypeRequest,
        key: bytes | str,
        query: PendingQuery,
        reason: str,
        *,
        retry: bool = True,
    ) -> None:
        """Record why a node's query failed, and when to repeat it, if ever."""
        before = request.failed.get(key)
        attempts = 1 if before is None else before.attempts + 1
        pause = min(_RETRY_S * 2.0 ** (attempts - 1), _MAX_RETRY_S) if retry else math.inf
        next_try = time.monotonic() + pause
        request.failed[key] = QueryResult(query.server.node.full, reason, attempts, next_try)
        self._schedule(request)

    def _look_up(self, request: TypeRequest, name: str, users: _Users) -> bool:
        """Look up a message in the middleware; return whether that succeeded or is pending."""
        lookup = request.lookup
        if lookup is None or time.monotonic() - lookup.started > _MAX_RETRY_S:
            endpoints = (*request.endpoints, *users.get(name, ()))
            lookup = request.lookup = Lookup(self._core.middleware, name, endpoints, request.wake)
        found = lookup.found
        if lookup.done and found is not None:
            if found.name == name and request.hash in ("", *announced_hashes(found)):
                self._core.types.library.add_version(found)
                self._on_definition(request, found)
                return True
            lookup.found = None
            lookup.problem = f"TypeLookup has {found.name} with the hash {rihs01(found)}"
        return not lookup.done

    def _reasons(self, request: TypeRequest, without: Sequence[str]) -> str:
        reasons = [f"{failed.node}: {failed.reason}" for failed in request.failed.values()]
        if without:
            reasons.append(
                f"{', '.join(without)} has no {SERVICE} service (ROS 2 Humble or older, a node "
                "started with start_type_description_service:=false, or a program that is not "
                "built on rcl)"
            )
        if not reasons:
            return "no other node in the graph uses this version of it"
        text = f"asked for its definition: {'; '.join(reasons)}{request.lookup_problem}"
        if self._core.middleware.announces_requests and "/msg/" not in request.name:
            text += (
                ". Over DDS, ROS 2 nodes announce a service by the hash of its request, and do not "
                "find its type by that when asked"
            )
        return f"{text}; {adding_definitions(request.name, 2)}"

    # -- outcomes ----------------------------------------------------------------------------------

    def _on_definition(self, request: TypeRequest, found: InterfaceDefinition) -> None:
        """Complete a request whose definition is now in the library."""
        self._drop(request)
        self._fulfil_promises(request, found.name, rihs01(found))
        request.notify()

    def _fulfil_promises(self, request: TypeRequest, name: str, type_hash: str = "") -> bool:
        """Fulfil the promises if the library has the type; return whether it has."""
        try:
            found = self._load(name, type_hash)
        except Error as error:
            if type_hash:
                request.fail(error)
            return False
        for promise in request.promises:
            promise.set_result(found)
        return True

    def _give_up(self, request: TypeRequest, reason: str, now: float) -> None:
        """Fail a request, unless the graph may not be complete yet."""
        limit = _INTRODUCTION_S if self._core.middleware.unnamed() else _GRACE_S
        left = max(request.since, self._started) + limit - now
        if left > 0:
            self._core.timers.after(min(left, _GRACE_S) + 0.01, request.wake)
        else:
            error = TypeNotFoundError(f"no definition of {request.name}: {reason}")
            self._settle(request, error, reason)

    def _settle(self, request: TypeRequest, error: Error, reason: str) -> None:
        request.fail(error)
        changed, request.problem = request.problem != reason, reason
        if changed:
            request.notify()
        if not request.listeners:
            self._drop(request)

    def _drop(self, request: TypeRequest) -> None:
        if self._requests.get(request.key) is request:
            del self._requests[request.key]


class PendingQuery(NamedTuple):
    """A query that a node has not answered yet; `started` is a monotonic time."""

    server: EndpointInfo
    name: str
    started: float


class QueryResult(NamedTuple):
    """The failure of a node's last query, and the monotonic time of the next one."""

    node: str
    reason: str
    attempts: int
    next_try: float


class TypeRequest:
    """A requested definition, and the state of the search for it.

    Args:
        name: The type's name.
        type_hash: The announced hash; empty for the one in the graph.
        node: Full name of the node whose version is meant; empty for any.
        schedule: Has the fetcher continue with a request.

    Attributes:
        key: Identifies the request.
        wake: Has the fetcher continue with this request.
        endpoints: The endpoints that use it.
        listeners: Called when it is found, or cannot be.
        promises: Fulfilled when it is found.
        nodes: The nodes that have used it.
        since: Monotonic start of the time that the graph has to become complete.
        used: Monotonic time of the last request by an endpoint.
        queries: Pending queries, by the server's identity.
        failed: Failures of earlier queries, likewise.
        problem: Why it cannot be found; empty while it may be.
        searched_library: Whether the library was searched for the version in the graph.
        searched_cache: Whether the cache on disk was searched.
        lookup: The last lookup in the middleware.
    """

    def __init__(
        self, name: str, type_hash: str, node: str, schedule: Callable[[TypeRequest], None]
    ) -> None:
        self.name, self.hash, self.node = name, type_hash, node
        self.key = name, type_hash, node
        self.wake: Callable[[], None] = partial(schedule, self)
        self.endpoints: Sequence[EndpointInfo] = ()
        self.listeners: list[Callable[[], None]] = []
        self.promises: list[Promise[AnyType]] = []
        self.nodes: set[NodeName] = set()
        self.since = self.used = time.monotonic()
        self.queries: dict[bytes | str, PendingQuery] = {}
        self.failed: dict[bytes | str, QueryResult] = {}
        self.problem = ""
        self.searched_library = self.searched_cache = False
        self.lookup: Lookup | None = None

    @property
    def lookup_problem(self) -> str:
        """Why the lookup failed, to append to a reason; empty if it did not."""
        return f"; {self.lookup.problem}" if self.lookup is not None and self.lookup.problem else ""

    def add(
        self,
        endpoints: Sequence[EndpointInfo] | None,
        listener: Callable[[], None] | None,
        promise: Promise[AnyType] | None,
    ) -> None:
        """Add the endpoints, listener and promise of another caller."""
        now = time.monotonic()
        if endpoints is not None:
            self.endpoints, self.used = endpoints, now
            self.on_nodes({endpoint.node for endpoint in endpoints}, now)
        if listener is not None and listener not in self.listeners:
            self.listeners.append(listener)
        if promise is not None:
            self.since = now
            self.promises.append(promise)

    def on_nodes(self, nodes: set[NodeName], now: float) -> None:
        """Restart the search if another node uses the type."""
        if not nodes <= self.nodes:
            self.nodes |= nodes
            # Its service may appear later, and earlier failures do not apply to it.
            self.since, self.problem = now, ""

    def notify(self) -> None:
        """Call the listeners."""
        for listener in list(self.listeners):
            listener()

    def fail(self, error: Error) -> None:
        """Fail the promises."""
        for promise in self.promises:
            promise.set_exception(error)


def find_full_names(name: str, known: Container[str]) -> list[str]:
    """Return the known full names that a type's name may stand for.

    Args:
        name: Full name, or ``pkg/Type``.
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


class Lookup:
    """A lookup of a message's definition in the middleware, on its own thread.

    Args:
        middleware: The middleware.
        name: The message's name.
        endpoints: The endpoints that use it.
        on_done: Called on that thread at the end.

    Attributes:
        started: Monotonic time of its start.
        done: Whether it has ended.
        found: The definition, if there was one.
        problem: Why none was found although an endpoint announces one.
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
        self.started = time.monotonic()
        queried = [e for e in endpoints if e.kind in _TOPICS and e.type == name][:_MAX_LOOKUPS]
        self.done = not (queried and middleware.describes_types)
        self._thread = threading.Thread(
            target=self._run, args=(queried,), name=f"{name} lookup", daemon=True
        )
        if not self.done:
            self._thread.start()

    def join(self) -> None:
        """Wait for the thread, which takes a few seconds at most."""
        if self._thread.ident is not None and self._thread is not threading.current_thread():
            self._thread.join(_LOOKUP_TIMEOUT_S)

    def _run(self, endpoints: list[EndpointInfo]) -> None:
        for endpoint in endpoints:
            try:
                self.found = self._middleware.describe_type(endpoint, _LOOKUP_TIMEOUT_S)
            except Error as error:
                self.problem = f"{endpoint.node}: {error}"
            except Exception as error:  # noqa: BLE001 - the next endpoint may answer
                _log.exception("looking up the type of %s failed", endpoint.name)
                self.problem = f"{endpoint.node}: {error}"
            if self.found is not None:
                break
        self.done = True
        self._on_done()
