"""A ROS 1 master in this process, and nodes that know it."""

from __future__ import annotations

import itertools
import socketserver
import threading
import xmlrpc.client
import xmlrpc.server
from contextlib import suppress
from typing import TYPE_CHECKING, Any

import pytest

import rosglass

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from rosglass.ros1 import Ros1Node

_pids = itertools.count(1)


class _Server(socketserver.ThreadingMixIn, xmlrpc.server.SimpleXMLRPCServer):
    daemon_threads = True
    block_on_close = False
    allow_reuse_address = True


class FakeParameters:
    """The master's parameter API; each method returns the whole answer.

    Attributes:
        tree: All parameters, as nested dicts.
        followers: The API's URI of each node that follows a name, by name and node.
        notifies: Whether subscribers are notified of changes.
    """

    def __init__(self) -> None:
        self.tree: dict[str, Any] = {}
        self.followers: dict[str, dict[str, str]] = {}
        self.notifies = True

    def getParam(self, _: str, name: str) -> Any:  # noqa: N802 - the API's name
        try:
            return [1, "", self._at(name)]
        except KeyError:
            return [-1, f"Parameter [{name}] is not set", 0]

    def hasParam(self, _: str, name: str) -> Any:  # noqa: N802
        return [1, name, self.getParam("", name)[0] == 1]

    def getParamNames(self, _: str) -> Any:  # noqa: N802
        return [1, "", list(self._names(self.tree, ""))]

    def setParam(self, node: str, name: str, value: Any) -> Any:  # noqa: N802
        *spaces, last = name.strip("/").split("/")
        place = self.tree
        for space in spaces:
            if not isinstance(place.get(space), dict):
                place[space] = {}
            place = place[space]
        place[last] = value
        self._notify_followers(name, value, node)
        return [1, "", 0]

    def deleteParam(self, _: str, name: str) -> Any:  # noqa: N802
        space, _, last = name.rpartition("/")
        try:
            del self._at(space)[last]
        except KeyError:
            return [-1, f"Parameter [{name}] is not set", 0]
        self._notify_followers(name, {}, "")
        return [1, "", 0]

    def searchParam(self, node: str, name: str) -> Any:  # noqa: N802
        first, _, rest = name.partition("/")
        space = node
        while True:
            if self.hasParam("", f"{space}/{first}")[2]:
                return [1, "", f"{space}/{first}" + (f"/{rest}" if rest else "")]
            if not space:
                return [-1, f"Cannot find parameter [{name}]", ""]
            space = space.rpartition("/")[0]

    def subscribeParam(self, node: str, api: str, name: str) -> Any:  # noqa: N802
        self.followers.setdefault(name, {})[node] = api
        code, _, value = self.getParam("", name)
        return [1, "", value if code == 1 else {}]

    def unsubscribeParam(self, node: str, _: str, name: str) -> Any:  # noqa: N802
        self.followers.get(name, {}).pop(node, None)
        return [1, "", 1]

    def _notify_followers(self, name: str, value: Any, node: str) -> None:
        # Like rosmaster, by the name that has changed, with a slash at its end.
        for followed, apis in self.followers.items():
            if self.notifies and f"{name}/".startswith(f"{followed}/"):
                for api in [apis[other] for other in apis if other != node]:
                    arguments = (api, f"{name}/", value)
                    threading.Thread(target=_update_parameter, args=arguments, daemon=True).start()

    def _at(self, name: str) -> Any:
        found: Any = self.tree
        for part in [part for part in name.split("/") if part]:
            if not isinstance(found, dict):
                raise KeyError(name)
            found = found[part]
        return found

    def _names(self, tree: dict[str, Any], space: str) -> Any:
        for key, value in tree.items():
            if isinstance(value, dict):
                yield from self._names(value, f"{space}/{key}")
            else:
                yield f"{space}/{key}"


class FakeMaster(FakeParameters):
    """The part of the master's API that registers topics and services.

    Attributes:
        port: Where it listens, also after it was stopped and started again.
        publishers: Node, its API's URI and the type of each publisher, by topic and node.
        services: Node, service URI and the node's API's URI, by service.
        calls: Names of all methods that were called.
        answers: Functions that answer methods instead, by name; they return the whole answer.
        running: Cleared, it answers nothing until it is set again, as a process that is stopped.
    """

    def __init__(self) -> None:
        self.port = 0
        self.calls: list[str] = []
        self.answers: dict[str, Callable[..., Any]] = {}
        self.running = threading.Event()
        self.running.set()
        self._lock = threading.Lock()
        self.start()

    def start(self, tree: dict[str, Any] | None = None) -> None:
        """Start without registered nodes, and without parameters but those of `tree`."""
        FakeParameters.__init__(self)
        self.tree = tree or {}
        self.publishers: dict[str, dict[str, str]] = {}
        self.subscribers: dict[str, dict[str, str]] = {}
        self.types: dict[str, str] = {}
        self.services: dict[str, tuple[str, str, str]] = {}
        self.pid = next(_pids)
        self._server = _Server(("127.0.0.1", self.port), logRequests=False, allow_none=True)
        self.port = self._server.server_address[1]
        self._server.register_instance(self)
        run = self._server.serve_forever
        self._thread = threading.Thread(target=run, args=(0.02,), daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Stop answering."""
        self._server.shutdown()
        self._server.server_close()
        self._thread.join(5)

    @property
    def url(self) -> str:
        """As :func:`rosglass.connect` takes it."""
        return f"ros1://127.0.0.1:{self.port}?ip=127.0.0.1"

    def offer(self, service: str, port: int, node: str = "/robot", host: str = "127.0.0.1") -> None:
        """Register a service that a test serves itself."""
        self.services[service] = (node, f"rosrpc://{host}:{port}", f"http://{host}:1/")

    def _dispatch(self, method: str, arguments: tuple[Any, ...]) -> Any:
        self.running.wait(60)
        self.calls.append(method)
        if method in self.answers:
            return self.answers[method](*arguments)
        with self._lock:
            return getattr(self, method)(*arguments)

    def getPid(self, _: str) -> Any:  # noqa: N802 - the API's name
        return [1, "", self.pid]

    def getSystemState(self, _: str) -> Any:  # noqa: N802
        return [
            1,
            "",
            [
                [[topic, list(nodes)] for topic, nodes in self.publishers.items() if nodes],
                [[topic, list(nodes)] for topic, nodes in self.subscribers.items() if nodes],
                [[name, [entry[0]]] for name, entry in self.services.items()],
            ],
        ]

    def getTopicTypes(self, _: str) -> Any:  # noqa: N802
        return [1, "", [[topic, kind] for topic, kind in self.types.items()]]

    def lookupNode(self, _: str, node: str) -> Any:  # noqa: N802
        topics = [
            *self.publishers.values(),
            *self.subscribers.values(),
            *self.followers.values(),
        ]
        found = [nodes[node] for nodes in topics if node in nodes]
        found += [api for name, _, api in self.services.values() if name == node]
        return [1, "", found[0]] if found else [-1, f"unknown node [{node}]", ""]

    def registerService(self, node: str, name: str, uri: str, api: str) -> Any:  # noqa: N802
        self.services[name] = (node, uri, api)
        return [1, "", 1]

    def unregisterService(self, _: str, name: str, uri: str) -> Any:  # noqa: N802
        if self.services.get(name, ("", ""))[1] == uri:
            del self.services[name]
            return [1, "", 1]
        return [1, "", 0]

    def lookupService(self, _: str, name: str) -> Any:  # noqa: N802
        if name not in self.services:
            return [-1, "no provider", ""]
        return [1, "", self.services[name][1]]

    def registerPublisher(self, node: str, topic: str, kind: str, api: str) -> Any:  # noqa: N802
        self.publishers.setdefault(topic, {})[node] = api
        self.types[topic] = kind
        self._tell(topic)
        return [1, "", list(self.subscribers.get(topic, {}).values())]

    def unregisterPublisher(self, node: str, topic: str, _: str) -> Any:  # noqa: N802
        found = self.publishers.get(topic, {}).pop(node, None)
        self._tell(topic)
        return [1, "", int(found is not None)]

    def registerSubscriber(self, node: str, topic: str, kind: str, api: str) -> Any:  # noqa: N802
        self.subscribers.setdefault(topic, {})[node] = api
        self.types.setdefault(topic, kind)
        return [1, "", list(self.publishers.get(topic, {}).values())]

    def unregisterSubscriber(self, node: str, topic: str, _: str) -> Any:  # noqa: N802
        found = self.subscribers.get(topic, {}).pop(node, None)
        return [1, "", int(found is not None)]

    def _tell(self, topic: str) -> None:
        publishers = list(self.publishers.get(topic, {}).values())
        for api in list(self.subscribers.get(topic, {}).values()):
            threading.Thread(target=_update, args=(api, topic, publishers), daemon=True).start()


def _update(api: str, topic: str, publishers: list[str]) -> None:
    with suppress(OSError, xmlrpc.client.Error), xmlrpc.client.ServerProxy(api) as proxy:
        proxy.publisherUpdate("/master", topic, publishers)


def _update_parameter(api: str, name: str, value: Any) -> None:
    with suppress(OSError, xmlrpc.client.Error), xmlrpc.client.ServerProxy(api) as proxy:
        proxy.paramUpdate("/master", name, value)


@pytest.fixture
def master() -> Iterator[FakeMaster]:
    """A master of the test's own."""
    made = FakeMaster()
    yield made
    made.stop()


@pytest.fixture
def connect(master: FakeMaster) -> Iterator[Callable[..., Ros1Node]]:
    """Connect a node to the master; it is closed at the end."""
    nodes: list[Any] = []

    def connect(name: str, namespace: str = "/", url: str = "", **more: Any) -> Any:
        nodes.append(rosglass.connect(url or master.url, name, namespace, **more))
        return nodes[-1]

    yield connect
    for node in nodes:
        node.close()
