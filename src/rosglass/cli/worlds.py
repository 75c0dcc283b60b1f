"""Differences of ROS 1 and ROS 2 in the output and arguments of commands."""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import argparse

    from rosglass.comm import Node
    from rosglass.ros1.node import Ros1Node

__all__ = ["as_ros1", "is_hidden", "is_ros1", "names_ros1", "spelled"]


def is_ros1(node: Node) -> bool:
    """Return whether a node is in a ROS 1 graph."""
    return node.wire == "ros1"


def as_ros1(node: Node) -> Ros1Node | None:
    """Return a node of a ROS 1 graph with its own class; None for any other node."""
    found: Any = node
    return found if is_ros1(node) else None


def names_ros1(args: argparse.Namespace) -> bool:
    """Return whether the options, or else the environment, name a ROS 1 master."""
    import os

    from rosglass.connection import default_url
    from rosglass.errors import Error

    url = getattr(args, "url", "")
    with suppress(Error):
        url = url or default_url(os.environ)
    return str(url).lower().startswith("ros1:")


def is_hidden(node: Node, name: str) -> bool:
    """Return whether lists leave a name out; ROS 1 hides none."""
    from rosglass.comm.names import hidden

    return not is_ros1(node) and hidden(name)


def spelled(node: Node, text: str) -> str:
    """Return a type's name, or a text that has some, as the node's ROS version spells them."""
    from rosglass.interfaces.names import spelled_ros1

    return spelled_ros1(text) if is_ros1(node) else text
