"""Nodes on a graph inside this process."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING

import pytest

from rosglass.ros2 import Ros2Node

from .steered import SteeredMiddleware

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

_numbers = itertools.count(1)


@pytest.fixture
def url() -> str:
    """The graph of one test."""
    return f"local://unit.{next(_numbers)}"


@pytest.fixture
def middleware(url: str) -> SteeredMiddleware:
    return SteeredMiddleware(url)


@pytest.fixture
def connect(url: str) -> Iterator[Callable[..., Ros2Node]]:
    """Connect another node to the graph; ``connect(name).fake`` is its middleware."""
    made: list[Ros2Node] = []

    def connect(name: str, namespace: str = "/") -> Ros2Node:
        middleware = SteeredMiddleware(url)
        node = Ros2Node(middleware, "fake://", name, namespace)
        node.fake = middleware
        made.append(node)
        return node

    yield connect
    for node in made:
        node.close()


@pytest.fixture
def robot(connect: Callable[..., Ros2Node]) -> Ros2Node:
    """Another node."""
    return connect("robot")


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Look ten times a second for what has no event."""
    monkeypatch.setattr("rosglass.comm.core._POLL_S", 0.1)


@pytest.fixture
def node(middleware: SteeredMiddleware) -> Iterator[Ros2Node]:
    made = Ros2Node(middleware, "fake://", "cockpit", "/arm")
    yield made
    made.close()
