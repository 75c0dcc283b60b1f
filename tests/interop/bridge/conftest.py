"""Fixtures for tests of bridges: ROS 1 and ROS 2 with real peers, and bridges between them."""

from __future__ import annotations

import importlib.util
import secrets
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from ports import free_port

import rosglass
from rosglass.bridge import Bridge
from rosglass.wires.zenoh.router import Router

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from types import ModuleType

    from rosglass.comm import Node


def _fixtures_of(world: str) -> ModuleType:
    place = Path(__file__).parents[1] / world / "conftest.py"
    spec = importlib.util.spec_from_file_location(f"{world}_fixtures", place)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


_ros1, _ros2 = _fixtures_of("ros1"), _fixtures_of("ros2")
start_master, master = _ros1.start_master, _ros1.master
start_rospy, rospy_peer = _ros1.start_rospy, _ros1.rospy_peer
tool = _ros1.tool
interfaces, peer_values, start_peer = _ros2.interfaces, _ros2.peer_values, _ros2.start_peer
dds_domain = _ros2.dds_domain


@pytest.fixture(scope="module")
def router() -> Iterator[Router]:
    with Router(f"tcp/127.0.0.1:{free_port()}") as running:
        yield running


@pytest.fixture
def connect(master: Any, router: Router) -> Iterator[Callable[..., Node]]:
    """Connect to one side: ``connect("ros1", name)`` or ``connect("ros2", name)``."""
    nodes: list[Node] = []

    def connect(world: str, name: str, url: str = "", *, described: bool = False) -> Node:
        usual = master.url if world == "ros1" else router.url
        node = rosglass.connect(url or usual, name, own_services=described)
        nodes.append(node)
        return node

    yield connect
    for node in nodes:
        node.close()


@pytest.fixture
def bridge(connect: Callable[..., Node]) -> Iterator[Callable[..., Bridge]]:
    """Make a bridge from ROS 1 to ROS 2, or between two URLs; closed at the end of the test."""
    made: list[Bridge] = []

    def bridge(*arguments: Any, urls: tuple[str, str] = ("", ""), **more: Any) -> Bridge:
        name = f"rosglass_bridge_{secrets.token_hex(4)}"
        second = connect("ros2", name, urls[1], described=not urls[1].startswith("ros1"))
        nodes = connect("ros1", name, urls[0]), second
        made.append(Bridge(*nodes, *arguments, **more))
        return made[-1]

    yield bridge
    for one in made:
        one.close()
