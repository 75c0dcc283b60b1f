"""One graph on each wire, and nodes in it.

What is tested here holds for every wire, and is written against the public API alone. What one wire
has besides is tested beside that wire.
"""

from __future__ import annotations

import importlib.util
import itertools
import random
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import pytest
from ports import free_port
from rosmaster import RosMaster

import rosglass

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from rosglass import Node

_names = itertools.count(1)


@dataclass
class Wire:
    """A graph that a test can join.

    Attributes:
        name: ``local``, ``tcpros``, ``dds`` or ``zenoh``.
        url: What :func:`rosglass.connect` is given.
        add: A service's type that every ROS of this kind has: the sum of two integers.
        count: An action's type, likewise: counts up to a number.
    """

    name: str
    url: str

    @property
    def is_ros1(self) -> bool:
        """True if ROS 1 uses this wire."""
        return self.name == "tcpros"

    @property
    def add(self) -> str:
        """A service type that adds ``a`` and ``b`` to ``sum``."""
        return "rospy_tutorials/AddTwoInts" if self.is_ros1 else "example_interfaces/srv/AddTwoInts"

    @property
    def count(self) -> str:
        """An action type that counts to ``order`` in ``sequence``."""
        package = "actionlib_tutorials" if self.is_ros1 else "example_interfaces"
        return f"{package}/action/Fibonacci"


@pytest.fixture(scope="module", params=["local", "tcpros", "dds", "zenoh"])
def wire(
    request: pytest.FixtureRequest, ros_domains: list[int], tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Wire]:
    """A graph on each wire in turn, for the tests of a module."""
    if request.param == "local":
        yield Wire("local", f"local://contract{next(_names)}")
    elif request.param == "dds":
        _need("cyclonedds", "dds")
        yield Wire("dds", f"dds://?domain={random.SystemRandom().choice(ros_domains)}")
    elif request.param == "zenoh":
        _need("zenoh", "zenoh")
        from rosglass.wires.zenoh.router import Router

        with Router(f"tcp/127.0.0.1:{free_port()}") as router:
            yield Wire("zenoh", router.url)
    else:
        with RosMaster(tmp_path_factory.mktemp("master")) as master:
            yield Wire("tcpros", master.url)


def _need(module: str, extra: str) -> None:
    if importlib.util.find_spec(module) is None:
        pytest.skip(f'needs pip install "rosglass[{extra}]"')


@pytest.fixture
def connect(wire: Wire) -> Iterator[Callable[..., Node]]:
    """Connect a node to the graph; closed at the end of the test."""
    nodes: list[Node] = []

    def connect(name: str, namespace: str = "/", **options: Any) -> Node:
        nodes.append(rosglass.connect(wire.url, name, namespace, **options))
        return nodes[-1]

    yield connect
    for node in nodes:
        node.close()


@pytest.fixture
def robot(connect: Callable[..., Node]) -> Node:
    """The node that offers what the test uses."""
    return connect("robot")


@pytest.fixture
def console(connect: Callable[..., Node]) -> Node:
    """The node that uses it."""
    return connect("console")


@pytest.fixture
def topic(request: pytest.FixtureRequest) -> str:
    """A topic, service or action name that no other test has: graphs last longer than tests."""
    return f"/contract_{next(_names)}"
