"""Objects that elements share are released when QML destroys them, also in the middle of a job."""

from __future__ import annotations

import gc
import threading
from types import FunctionType, ModuleType
from typing import TYPE_CHECKING, Any

import pytest

from rosglass.comm.handle import Handle
from rosglass.qml import Session
from rosglass.qml.elements.element import Element
from rosglass.qml.elements.goal_handle import GoalHandle, ServerGoalHandle
from rosglass.qml.elements.parameter import ParameterLink
from rosglass.tf import TransformBuffer

if TYPE_CHECKING:
    from conftest import Bench

pytestmark = pytest.mark.both_qt


class Watch(Handle):
    """A handle that counts itself among those that are open."""

    def __init__(self, handle: Handle, opened: list[Handle]) -> None:
        self._handle, self._open = handle, opened
        opened.append(self)

    def close(self) -> None:
        self._handle.close()
        if self in self._open:
            self._open.remove(self)


@pytest.fixture
def watches(monkeypatch: pytest.MonkeyPatch) -> list[Handle]:
    """The open listeners of changes of transforms."""
    opened: list[Handle] = []
    for name in ("on_change", "on_update", "on_tree_change"):
        plain = getattr(TransformBuffer, name)

        def counted(*arguments: Any, plain: Any = plain) -> Handle:
            return Watch(plain(*arguments), opened)

        monkeypatch.setattr(TransformBuffer, name, counted)
    return opened


def test_transforms_are_not_followed_any_more(
    running: Bench, watches: list[Handle], wait: Any
) -> None:
    """The listener, which all elements share, stays."""
    root: Any = running.load("""
        QtObject {
            property var listener: TfTransformListener
            property Component one: Component {
                QtObject {
                    property TfTransform tf: TfTransform { sourceFrame: "a"; targetFrame: "b" }
                    property TfBuffer buffer: TfBuffer { }
                }
            }
            property var made: []
            Component.onCompleted: {
                listener.initialize()
                for (let i = 0; i < 3; ++i) made.push(one.createObject(null))
            }
            function drop() { for (const item of made) item.destroy(); made = [] }
        }
    """)
    wait(lambda: len(watches) == 2 + 3 * 3)
    root.drop()
    wait(lambda: len(watches) == 2)


def test_element_that_leaves_at_once_leaves_no_listener(
    running: Bench, wait: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    from rosglass.qml.elements.tf_buffer import TfLink

    calls: list[str] = []

    class Listener:
        def __init__(self, *_: Any) -> None:
            calls.append("opened")

        def close(self) -> None:
            calls.append("closed")

    monkeypatch.setattr("rosglass.tf.TransformListener", Listener)
    session, node, done = running.session, running.session.node, threading.Event()
    assert node is not None
    TfLink.join(session, node, "/", "it").leave("it")
    session.background(done.set)
    wait(done.is_set)
    assert calls == ["opened", "closed"]


class SlowClient:
    """Is asked, and does not answer."""

    ready = True

    def __init__(self) -> None:
        self.asked, self.go = threading.Event(), threading.Event()
        self.closed_in: threading.Thread | None = None

    def watch(self, *_: Any) -> Handle:
        return self

    def get(self, names: list[str], timeout: float) -> dict[str, Any]:
        self.asked.set()
        assert self.go.wait(timeout)
        return dict.fromkeys(names)

    def describe(self, names: list[str], timeout: float) -> dict[str, Any]:
        return dict.fromkeys(names)

    def close(self) -> None:
        self.closed_in = threading.current_thread()


class Node:
    def __init__(self, client: SlowClient) -> None:
        self.client = client

    def create_parameter_client(self, name: str) -> SlowClient:
        return self.client


def test_a_question_on_its_way_holds_nothing_up(bench: Bench, wait: Any) -> None:
    """The client is closed, and not by the GUI thread, which would wait for the question."""
    client = SlowClient()
    node: Any = Node(client)
    link = ParameterLink.join(bench.session, node, "/arm", "it", "speed", print)
    wait(lambda: link.on_tick() or client.asked.is_set())
    link.leave("it")
    assert client.closed_in is None
    client.go.set()
    wait(lambda: client.closed_in is not None)
    assert client.closed_in is not threading.main_thread()


def reachable(root: object) -> list[object]:
    """Return what an object keeps alive, apart from the session and globals of functions."""
    found: dict[int, object] = {}
    waiting = [root]
    while waiting:
        one = waiting.pop()
        if id(one) in found or isinstance(one, (ModuleType, type, Session)):
            continue
        found[id(one)] = one
        if isinstance(one, FunctionType):
            waiting += [one.__closure__, one.__defaults__, one.__kwdefaults__]
        else:
            waiting += gc.get_referents(one)
    return list(found.values())


def test_the_node_keeps_no_elements(running: Bench, wait: Any) -> None:
    """Its threads would drop them, and PySide crash if the GUI thread deletes them just then."""
    running.robot.create_publisher("/chat", "std_msgs/msg/String")
    root: Any = running.load("""
        QtObject {
            property Subscription sub: Subscription { topic: "/chat" }
            property var both: SynchronizedSubscription { topics: ["/chat", "/chatter"] }
            property var server: ServiceServer {
                name: "/s"; serviceType: "std_srvs/Trigger"; handler: function () {}
            }
            property var actions: ActionServer {
                name: "/a"; actionType: "example_interfaces/Fibonacci"
                execute: function (goal, handle, later) {}
            }
            property var client: Ros2.createServiceClient("/s", "std_srvs/Trigger")
            property var sender: Ros2.createActionClient("/a", "example_interfaces/Fibonacci")
            property var goal
            property TfBuffer buffer: TfBuffer { }
            property TfTransform tf: TfTransform { sourceFrame: "a"; targetFrame: "b" }
            function ready() {
                return sub.subscribed && server.ready && actions.ready && client.ready
                    && sender.ready
            }
            function send() { goal = sender.sendGoalAsync({}) }
            function executes() { return actions.activeGoals === 1 && goal.isActive }
        }
    """)
    wait(root.ready)
    root.send()
    wait(root.executes)
    wait.nothing_happens(0.2)
    kinds = (Element, GoalHandle, ServerGoalHandle)
    assert [one for one in reachable(running.session.node) if isinstance(one, kinds)] == []
