"""Types from the nodes that use them: definitions that are unknown here.

In ROS 1, publishers send the definition to their subscribers, and services' servers only name and
md5 sum. An action's server sends the definitions of results and feedback to its subscribers; that
of goals comes from the library, other clients, or servers in Python, which send it as subscribers.
"""

from __future__ import annotations

import re
import time
from contextlib import suppress
from typing import TYPE_CHECKING

from rosglass.comm import ConnectionState, EndpointKind, NodeName, Promise, QoS, Subscription
from rosglass.comm.promise import check_timeout
from rosglass.errors import (
    DefinitionConflictError,
    Error,
    InvalidNameError,
    NodeClosedError,
    TypeNotFoundError,
)
from rosglass.interfaces import adding_definitions, ros1_name, split_name
from rosglass.messages import load
from rosglass.ros1.actionlib import (
    FEEDBACK,
    GOAL,
    RESULT,
    ActionTypes,
    action_topic,
    actions,
    announced,
    assemble,
)
from rosglass.wires.tcpros.connection import ANY
from rosglass.wires.tcpros.graph import split
from rosglass.wires.tcpros.registrations import Member

if TYPE_CHECKING:
    from concurrent.futures import Future
    from typing import TypeAlias

    from rosglass.messages import ActionType, MessageType, ServiceType
    from rosglass.ros1.services import Services
    from rosglass.wires.tcpros.connection import Connection
    from rosglass.wires.tcpros.core import TcprosCore
    from rosglass.wires.tcpros.master import Master
    from rosglass.wires.tcpros.topics import Topics

    AnyType: TypeAlias = MessageType | ServiceType | ActionType

__all__ = ["ActionDiscovery", "fetch"]

_PUBLISHER = EndpointKind.PUBLISHER
_MD5 = re.compile("[0-9a-f]{32}")
#: Seconds that a publisher may take to answer, and that others may take after the first one.
_TIMEOUT_S, _GRACE_S = 5.0, 1.0
#: Seconds until a publisher that did not answer is asked again.
_RETRY_S = 5.0
#: Seconds that services may take to announce their types, while none is known to have this one.
_SETTLED_S = 2.0


def fetch(
    core: TcprosCore,
    topics: Topics,
    services: Services,
    name: str,
    hash: str,
    node: str,
    timeout: float | None,
) -> Promise[AnyType]:
    """Fetch a type; see :meth:`rosglass.comm.Node.fetch_type_async`.

    Args:
        core: The node that asks.
        topics: Its topics.
        services: Its services.
        name: The type's name.
        hash: Md5 sum of the version; empty for the version in use.
        node: Full name of the node whose version to fetch; empty for any.
        timeout: Seconds to wait in all; None for no limit.
    """
    split_name(name)
    timeout = check_timeout(timeout, f"fetching {name}")
    if hash and not (isinstance(hash, str) and _MD5.fullmatch(hash)):
        raise InvalidNameError(
            f"{hash!r:.90} is not an md5 sum of {name}; write 32 hexadecimal digits in lower case"
        )
    promise: Promise[AnyType] = Promise(
        f"{name} was not received", core.dispatcher, cancellable=True
    )
    if hash:
        with suppress(Error):  # then it is fetched
            promise.set_result(load(name, ros=1, library=core.types.library, hash=hash))
            return promise
    made = _Fetch(core, topics, services, name, hash, node, promise)
    if timeout is not None:
        timer = core.timers.after(timeout, lambda: made.expire(timeout))
        promise.add_done_callback(lambda _: timer.close())
    promise.add_done_callback(made.finish)
    core.add(made)
    return promise


class _Fetch(Member):
    """A type that is being fetched, from the endpoints in the graph.

    Args:
        core: The node that asks.
        topics: Its topics.
        services: Its services.
        name: The type's name.
        hash: Md5 sum of the version; empty for the version in use.
        node: Full name of the node whose version to fetch; empty for any.
        promise: Completed with the type.
    """

    def __init__(
        self,
        core: TcprosCore,
        topics: Topics,
        services: Services,
        name: str,
        hash: str,
        node: str,
        promise: Promise[AnyType],
    ) -> None:
        self._core, self._topics, self._services = core, topics, services
        self._name, self._hash, self._node, self._promise = name, hash, node, promise
        self._package, self._kind, self._base = split_name(name)
        #: The publishers' headers, by node; why others did not answer, and when. Written by the
        #: threads that ask, read by the node's own; every use is atomic.
        self._headers: dict[str, dict[str, str]] = {}
        self._failed: dict[str, tuple[str, float]] = {}
        self._asked: set[str] = set()
        self._began, self._first = time.monotonic(), 0.0
        self._discoveries: dict[str, ActionDiscovery] = {}
        #: Why it is not there yet, as far as is known.
        self._problem = ""

    def follow(self, moved: bool, idle: bool) -> None:  # noqa: ARG002 - answers count, too
        """Complete the promise if enough is known."""
        if self._promise.done():
            return
        try:
            found = self._find()
        except Error as error:
            self._promise.set_exception(error)
            return
        if found is not None:
            self._promise.set_result(found)

    def expire(self, timeout: float) -> None:
        """Fail: the time is over."""
        who = f"{self._node} does not use it" if self._node else "no node in the graph uses it"
        if self._core.status().state is not ConnectionState.CONNECTED:
            who = str(self._core.status())
        self._promise.set_exception(
            TypeNotFoundError(
                f"no definition of {self._name} within {timeout:g} s: {self._problem or who}"
            )
        )

    def finish(self, _: Future[AnyType]) -> None:
        """Leave the node: the promise is done."""
        self._core.remove(self)
        for discovery in list(self._discoveries.values()):
            discovery.close()

    def close(self) -> None:
        """Fail: the node is closed."""
        self._promise.set_exception(NodeClosedError(f"node {self._core.name} was closed"))

    # -- on the node's own thread ----------------------------------------------------------------

    def _find(self) -> AnyType | None:
        """Return the type once it is known; raises Error when it cannot be."""
        if self._core.status().state is not ConnectionState.CONNECTED:
            return None
        self._problem = ""
        users = self._publishers()
        if users:
            return self._message(users)
        servers = self._actions()
        if servers:
            return self._action(servers)
        offers, open_ = self._offers()
        if offers:
            return self._service(offers)
        if open_ and time.monotonic() - self._began < _SETTLED_S:
            self._problem = "services have not announced their types yet"
            return None
        # No node has another version: the library's is right.
        return None if self._node or self._hash else self._in_library()

    def _in_library(self) -> AnyType | None:
        with suppress(TypeNotFoundError):  # the library has none
            return load(self._name, ros=1, library=self._core.types.library)
        return None

    def _is_meant(self, node: str) -> bool:
        return self._node in ("", node)

    # -- messages --------------------------------------------------------------------------------

    def _publishers(self) -> dict[str, str]:
        """Return a topic of each node that publishes the type."""
        if self._kind not in ("", "msg"):
            return {}
        graph, full = self._core.graph, f"{self._package}/msg/{self._base}"
        found: dict[str, str] = {}
        for topic, types in graph.topics().items():
            if types == [full]:
                ends = graph.endpoints(_PUBLISHER, topic)
                found.update((e.node.full, topic) for e in ends if self._is_meant(e.node.full))
                if not ends:
                    self._problem = (
                        f"{topic} has only subscribers, and only publishers send definitions; "
                        f"{adding_definitions(full, 1)}"
                    )
        return found

    def _message(self, users: dict[str, str]) -> MessageType | None:
        now = time.monotonic()
        for node, topic in users.items():
            self._ask(node, topic, now)
        headers = {node: self._headers[node] for node in users if node in self._headers}
        waited = [node for node in users if node not in headers and node not in self._failed]
        failed = "; ".join(reason for reason, _ in self._failed.copy().values())
        if not headers:
            self._problem = failed or f"{', '.join(sorted(users))} did not answer yet"
            if not waited and now - self._began > _GRACE_S:
                raise TypeNotFoundError(f"no definition of {self._name}: {failed}")
            return None
        self._first = self._first or now
        if waited and now - self._first < _GRACE_S:
            return None
        return self._choose(headers)

    def _choose(self, headers: dict[str, dict[str, str]]) -> MessageType | None:
        versions: dict[str, list[str]] = {}
        for node, header in headers.items():
            versions.setdefault(header["md5sum"], []).append(node)
        if self._hash and self._hash not in versions:
            others = _listed(versions)
            self._problem = f"no node publishes this version, but there are others ({others})"
            return None
        if len(versions) > 1 and not self._hash:
            raise _conflict(self._name, versions)
        md5 = self._hash or next(iter(versions))
        texts = [headers[node].get("message_definition", "") for node in versions[md5]]
        name = f"{self._package}/{self._base}"
        return self._core.types.learn(name, md5, max(texts, key=lambda text: bool(text.strip())))

    def _ask(self, node: str, topic: str, now: float) -> None:
        """Ask a publisher for its definition, unless it was."""
        _, failed = self._failed.get(node, ("", -_RETRY_S))
        if node in self._asked or node in self._headers or now - failed < _RETRY_S:
            return
        self._asked.add(node)
        self._core.pool.run(lambda: self._request(node, topic))

    def _request(self, node: str, topic: str) -> None:
        try:
            self._headers[node] = self._topics.header(topic, NodeName(*split(node)), _TIMEOUT_S)
            self._failed.pop(node, None)
        except Error as error:
            self._failed[node] = str(error), time.monotonic()
        self._asked.discard(node)
        self._core.wake()

    # -- actions ---------------------------------------------------------------------------------

    def _actions(self) -> list[str]:
        """Return the names of the actions that have the type."""
        if self._kind not in ("", "action"):
            return []
        full = f"{self._package}/action/{self._base}"
        graph = self._core.graph
        found = []
        for action, types in actions(graph).items():
            servers = graph.endpoints(_PUBLISHER, f"{action}/status")
            if types == [full] and any(self._is_meant(server.node.full) for server in servers):
                found.append(action)
        return found

    def _action(self, names: list[str]) -> ActionType | None:
        found: dict[str, tuple[str, ActionType]] = {}
        for name in names:
            discovery = self._discoveries.get(name)
            if discovery is None:
                discovery = ActionDiscovery(self._core, self._topics, name)
                self._discoveries[name] = discovery
            if self._promise.done():  # by another thread, which may not have seen this one
                discovery.close()
                return None
            types = discovery.types()
            self._problem = self._problem or discovery.problem
            if types is not None and self._hash in ("", types.action.md5):
                found.setdefault(types.action.md5, (name, types.action))
        if not found:
            self._problem = self._problem or f"{', '.join(names)} did not announce it yet"
            return None
        if len(found) > 1:
            raise _conflict(self._name, {md5: [name] for md5, (name, _) in found.items()})
        (_, action) = next(iter(found.values()))
        with suppress(DefinitionConflictError):  # the library keeps its own
            self._core.types.library.add(action.definition)
        return action

    # -- services --------------------------------------------------------------------------------

    def _offers(self) -> tuple[dict[str, list[str]], bool]:
        """Return the md5 sums of services with the type, and their nodes; and whether to wait."""
        if self._kind not in ("", "srv"):
            return {}, False
        full = f"{self._package}/srv/{self._base}"
        graph, open_ = self._core.graph.services(), False
        found: dict[str, list[str]] = {}
        for service, types in self._services.listing().items():
            nodes = [node for node in graph.get(service, []) if self._is_meant(node)]
            open_ = open_ or (not types and bool(nodes))
            if types == [full] and nodes:
                found.setdefault(self._services.md5_of(service), []).extend(nodes)
        return found, open_

    def _service(self, offers: dict[str, list[str]]) -> ServiceType | None:
        known = {md5: sorted(set(nodes)) for md5, nodes in offers.items()}
        if self._hash and self._hash not in known:
            others = _listed(known)
            self._problem = f"no node offers this version, but there are others ({others})"
            return None
        sums = [md5 for md5 in known if md5 != ANY] or [ANY]
        if len(sums) > 1 and not self._hash:
            raise _conflict(self._name, known)
        full = f"{self._package}/srv/{self._base}"
        return self._core.types.announced_service(full, self._hash or sums[0])


def _listed(versions: dict[str, list[str]]) -> str:
    return "; ".join(f"{md5} of {', '.join(nodes)}" for md5, nodes in versions.items())


def _conflict(name: str, versions: dict[str, list[str]]) -> DefinitionConflictError:
    return DefinitionConflictError(
        f"{ros1_name(name)}: the graph has several versions ({_listed(versions)}); choose one by "
        "its hash or node"
    )


# -- actions -----------------------------------------------------------------------------------

#: Most subscribers that are kept waiting for a header.
_MAX_WAITING = 100
_LABELS = {GOAL: "ActionGoal", RESULT: "ActionResult", FEEDBACK: "ActionFeedback"}


class ActionDiscovery:
    """Subscribes to an action's topics until its type is known.

    Args:
        core: The node.
        topics: Its topics.
        name: Absolute action name.

    Attributes:
        problem: What the user has to fix, in words; empty while the type may still be announced.
    """

    def __init__(self, core: TcprosCore, topics: Topics, name: str) -> None:
        self._core, self._name = core, name
        self.problem = ""
        self._topics = topics
        self._goal_probe: GoalProbe | None = None
        self._probes: dict[str, Subscription] = {}
        for word in _LABELS:
            topic = core.resolve(action_topic(name, word))
            self._probes[word] = Subscription(topic, None, QoS(depth=1), core.dispatcher)
            topics.subscribe(self._probes[word], True)

    def types(self) -> ActionTypes | None:
        """Return the types of the action; None while they are unknown."""
        type_name = announced(self._core.graph, self._name)
        if not type_name:
            self.problem = ""
            return None
        known = {word: self._announced(word, type_name) for word in _LABELS}
        result, feedback = known[RESULT], known[FEEDBACK]
        if result is None or feedback is None:
            self.problem = ""
            return None
        fault = ""
        try:
            types = ActionTypes.of(self._core.types.action(type_name), self._core.types)
            if (types.result.md5, types.feedback.md5) == (result.md5, feedback.md5):
                return types
        except TypeNotFoundError:
            pass
        except Error as error:  # the server's definitions may serve
            fault = f"{error}; "
        goal = known[GOAL] or self._goal(type_name.replace("/action/", "/msg/") + "ActionGoal")
        if goal is None:
            short = ros1_name(type_name.replace("/action/", "/msg/"))
            self.problem = (
                f"{fault}no definition of {short}Goal is known, and the server of {self._name} "
                f"does not send it: {adding_definitions(type_name, 1)}"
            )
            return None
        action = assemble(type_name, goal, result, feedback)
        self.problem = ""
        return ActionTypes.of(action, self._core.types)

    def close(self) -> None:
        """Close the subscriptions; safe to call twice."""
        for probe in self._probes.values():
            probe.close()
        if self._goal_probe is not None:
            self._goal_probe.close()

    def _announced(self, word: str, type_name: str) -> MessageType | None:
        """Return the type that the topic's publisher announces, if it is one of this action."""
        found = self._probes[word].type
        name = type_name.replace("/action/", "/msg/") + _LABELS[word]
        return found if found is not None and found.name == name else None

    def _goal(self, name: str) -> MessageType | None:
        """Return the type of goals, from the library or the server."""
        with suppress(Error):  # as that of the action
            return self._core.types.message(name)
        if self._goal_probe is None:
            topic = self._core.resolve(action_topic(self._name, GOAL))
            self._goal_probe = GoalProbe(self._core, self._topics, topic, name)
        return self._goal_probe.type()


class GoalProbe(Member):
    """Registers as a publisher of goals until their type is known.

    Servers in Python send the definition when they connect to a publisher; those in C++ send the
    md5 sum only. A subscriber that connects gets its header from the next publisher.

    Args:
        core: The node.
        topics: Its topics.
        topic: The topic of the goals.
        name: Full name of their type.
    """

    lists_node = True

    def __init__(self, core: TcprosCore, topics: Topics, topic: str, name: str) -> None:
        self._core, self._topics, self._topic, self._name = core, topics, topic, name
        #: Replaced, never changed, and in the loop's thread only.
        self._waiting: list[tuple[Connection, dict[str, str]]] = []
        self._closed = False
        topics.set_subscriber_handler(topic, self._accept)
        core.add(self)

    def type(self) -> MessageType | None:
        """Return the type; None while it is unknown."""
        for _, header in self._waiting:
            text = header.get("message_definition", "")
            if header.get("type") == ros1_name(self._name) and text.strip():
                with suppress(Error):  # the next header may have a definition that fits
                    return self._core.types.learn(self._name, header.get("md5sum", ""), text)
        return None

    def _accept(self, link: Connection, header: dict[str, str]) -> str:
        waiting = [each for each in self._waiting[-_MAX_WAITING:] if not each[0].closed]
        self._waiting = [*waiting, (link, header)]
        self._core.wake()
        return ""

    def register(self, master: Master) -> None:
        """Register as a publisher of goals."""
        if self._topic not in self._topics.published():
            name = ros1_name(self._name)
            master.call("registerPublisher", self._topic, name, self._core.uri)

    def unregister(self, master: Master) -> None:
        """Unregister as a publisher of goals."""
        master.call("unregisterPublisher", self._topic, self._core.uri)

    def successor(self) -> Member | None:
        """Return the publication of the goals, if they are published by now."""
        return self._topics.published().get(self._topic)

    def close(self) -> None:
        """Hand the waiting subscribers over; safe to call twice."""
        if self._closed:
            return
        self._closed = True
        self._topics.set_subscriber_handler(self._topic, None)
        self._core.loop.call(self._hand_over)
        self._core.remove(self)

    def _hand_over(self) -> None:
        waiting, self._waiting = self._waiting, []
        for link, header in waiting:
            reason = "" if link.closed else self._topics.accept(link, header)
            if reason:
                link.send_header({"error": reason})
                link.finish(1.0)
