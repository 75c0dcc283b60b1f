"""What a node is in every world."""

from __future__ import annotations

import pytest

from rosglass import UnsupportedError
from rosglass.comm import Node


class Bare(Node):
    """A node of a world that can do nothing but topics."""

    url, name, namespace, wire = "bare://", "cockpit", "/", "cdr"


Bare.__abstractmethods__ = frozenset()


@pytest.mark.parametrize(
    ("ask", "what"),
    [
        (lambda node: node.create_service_client("/s"), "service clients"),
        (lambda node: node.create_service_server("/s", "T", print), "service servers"),
        (lambda node: node.create_action_client("/a"), "action clients"),
        (lambda node: node.create_action_server("/a", "T", print), "action servers"),
        (lambda node: node.parameters, "parameters"),
        (lambda node: node.create_parameter_client("/n"), "parameters"),
        (lambda node: node.create_lifecycle_client("/n"), "lifecycle nodes"),
        (lambda node: node.logger, "a logger"),
        (lambda node: node.create_timer(1.0, print), "a clock"),
        (lambda node: node.services(), "a list of services"),
        (lambda node: node.actions(), "a list of actions"),
        (lambda node: node.service_servers("/s"), "a list of services"),
        (lambda node: node.service_clients("/s"), "a list of services"),
        (lambda node: node.endpoints("/n"), "a list of endpoints"),
        (lambda node: node.fetch_type("p/msg/T"), "fetching types"),
    ],
)
def test_what_a_world_cannot_do_is_said_at_once(ask, what):
    told = f"<Bare /cockpit on bare://> does not support {what}"
    with pytest.raises(UnsupportedError, match=told):
        ask(Bare())
