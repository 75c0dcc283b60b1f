"""What ROS 1 nodes ask each other, for tests that ask it themselves."""

from __future__ import annotations

import xmlrpc.client
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rosglass.ros1.node import Ros1Node


def publisher_address(node: Ros1Node, topic: str) -> tuple[str, int]:
    """Return where a node lets subscribers of a topic that it publishes connect."""
    with xmlrpc.client.ServerProxy(node.master_uri) as master:
        _, _, uri = master.lookupNode("/test", f"{node.namespace.rstrip('/')}/{node.name}")
    with xmlrpc.client.ServerProxy(str(uri)) as api:
        _, _, (_, host, port) = api.requestTopic("/raw", topic, [["TCPROS"]])
    return str(host), int(port)
