"""One graph on each wire, and nodes in it.

What is tested here holds for every wire, and is written against the public API alone. What one wire
has besides is tested beside that wire.
"""

from __future__ import annotations

import importlib.util
import itertools
import random
import socket
import subprocess
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from ports import free_port
from waiting import eventually

import rosglass

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from rosglass import Node

_ROSMASTER = Path("/usr/bin/rosmaster")
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
        """Whether ROS 1 talks over this wire."""
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
        with _RosMaster(tmp_path_factory.mktemp("master")) as url:
            yield Wire("tcpros", url)


def _need(module: str, extra: str) -> None:
    if importlib.util.find_spec(module) is None:
        pytest.skip(f'needs pip install "rosglass[{extra}]"')


class _RosMaster:
    """A ROS 1 master, as Debian has it, on a free port."""

    def __init__(self, home: Path) -> None:
        if not _ROSMASTER.exists():
            pytest.skip("ROS 1 is not installed: sudo apt-get install python3-rosmaster")
        self._home = home

    def __enter__(self) -> str:
        port = free_port()
        home = str(self._home)
        env = {"PATH": "/usr/bin:/bin", "HOME": home, "ROS_HOME": home, "ROS_IP": "127.0.0.1"}
        command = [str(_ROSMASTER), "--core", "-p", str(port)]
        with (self._home / "output").open("wb") as output:
            self._process = subprocess.Popen(command, env=env, stdout=output, stderr=output)

        def answers() -> bool:
            with suppress(OSError), socket.create_connection(("127.0.0.1", port), 1):
                return True
            return False

        eventually(answers, (self._home / "output").read_text)
        return f"ros1://127.0.0.1:{port}?ip=127.0.0.1"

    def __exit__(self, *_: object) -> None:
        self._process.kill()
        self._process.wait()


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
