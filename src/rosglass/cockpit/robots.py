"""Finds the robots that answer, and what each of them offers."""

from __future__ import annotations

import os
import threading
import time
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import rosglass
from rosglass.comm import ConnectionState, anonymous_name
from rosglass.connection import default_url
from rosglass.errors import Error
from rosglass.extras import explain_missing

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from rosglass.comm import Node

__all__ = ["USUAL_URLS", "FoundRobot", "RobotSearch", "addresses"]

#: Addresses that are searched unless one is given: the router, domain 0, the master.
USUAL_URLS = ("zenoh://127.0.0.1:7447", "dds://", "ros1://127.0.0.1:11311")
#: Seconds that an address has to answer, and that its graph has to stay unchanged.
_ANSWER_S, _QUIET_S, _LONGEST_S = 2.0, 0.7, 6.0
#: Seconds between two looks.
_LOOK_S = 0.1


@dataclass(frozen=True)
class FoundRobot:
    """The result of a search at one address.

    Attributes:
        url: The address.
        topics: Topics of others, and their types.
        nodes: Full names of other nodes.
        problem: Why nothing was found, in words; empty if something was.
    """

    url: str
    topics: Mapping[str, Sequence[str]] = field(default_factory=dict)
    nodes: tuple[str, ...] = ()
    problem: str = ""

    @property
    def answers(self) -> bool:
        """True if there is a robot: a node other than this program."""
        return bool(self.nodes)


def addresses(environment: Mapping[str, str] = os.environ) -> list[str]:
    """Return the addresses to look at: that of the environment, as `rosglass doctor` reads it."""
    try:
        return [default_url(environment)]
    except Error:
        return list(USUAL_URLS)


class RobotSearch:
    """Looks for robots at several addresses at once, each on a thread of its own.

    Args:
        urls: The addresses.
        on_found: Called with each result, on the thread of that address.
    """

    def __init__(self, urls: list[str], on_found: Callable[[FoundRobot], None]) -> None:
        self.urls, self._on_found = urls, on_found
        self._ended = threading.Event()
        for url in urls:
            threading.Thread(
                target=self._look, args=[url], name=f"look for a robot at {url}", daemon=True
            ).start()

    def close(self) -> None:
        """End the search: nothing is reported any more. Safe to call twice."""
        self._ended.set()

    def _look(self, url: str) -> None:
        found = look(url, self._ended)
        if not self._ended.is_set():
            self._on_found(found)


def look(url: str, ended: threading.Event | None = None) -> FoundRobot:
    """Return what is at an address, within about six seconds.

    Args:
        url: The address.
        ended: Set to return early.
    """
    ended = ended or threading.Event()
    try:
        node = rosglass.connect(url, name=anonymous_name("rosglass_cockpit"), own_services=False)
    except ModuleNotFoundError as error:
        return FoundRobot(url, problem=explain_missing(error) or str(error))
    except (Error, OSError) as error:
        return FoundRobot(url, problem=str(error))
    with node:
        deadline = time.monotonic() + _ANSWER_S
        while node.status().state is not ConnectionState.CONNECTED:
            if time.monotonic() > deadline:
                return FoundRobot(url, problem=node.status().detail or "there is no answer")
            if ended.wait(_LOOK_S):
                return FoundRobot(url, problem="the search was ended")
        _await_quiet(node, ended)
        return _explore(url, node)


def _await_quiet(node: Node, ended: threading.Event) -> None:
    """Wait until the graph does not change any more and every program has named its nodes."""
    began = changed_at = time.monotonic()

    def on_change() -> None:
        nonlocal changed_at
        changed_at = time.monotonic()

    with node.on_graph_change(on_change):
        while time.monotonic() < began + _LONGEST_S and not ended.wait(_LOOK_S):
            if time.monotonic() > changed_at + _QUIET_S and not node.unnamed_programs():
                return


def _explore(url: str, node: Node) -> FoundRobot:
    me = node.resolve(node.name)
    nodes = tuple(sorted(name.full for name in node.nodes() if name.full != me))
    if not nodes:
        return FoundRobot(url, problem="it answers, but there is no node")
    return FoundRobot(url, node.topics(), nodes)
