"""Requests between ROS 1 nodes, for tests that send them themselves."""

from __future__ import annotations

import xmlrpc.client
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rosglass.ros1.node import Ros1Node
    from rosglass.wires.tcpros.topic_subscription import PublisherLink
    from rosglass.wires.tcpros.topics import Topics


def node_uri(node: Ros1Node) -> str:
    """Return the URI of a node's API, as the master gives it to others."""
    with xmlrpc.client.ServerProxy(node.master_uri) as master:
        _, _, uri = master.lookupNode("/test", f"{node.namespace.rstrip('/')}/{node.name}")
    return str(uri)


def publisher_address(node: Ros1Node, topic: str) -> tuple[str, int]:
    """Return where a node lets subscribers of a topic that it publishes connect."""
    with xmlrpc.client.ServerProxy(node_uri(node)) as api:
        _, _, (_, host, port) = api.requestTopic("/raw", topic, [["TCPROS"]])
    return str(host), int(port)


def topics_of(node: Ros1Node) -> Topics:
    """Return what a node publishes and subscribes to, as its wire knows it."""
    return node._topics


def publisher_links(node: Ros1Node, topic: str) -> list[PublisherLink]:
    """Return a node's connections to the publishers of a topic that it subscribes to."""
    return topics_of(node).subscribed()[topic].links()
