"""Whether the quality of service of a publisher and a subscription matches, and why not."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rosglass.comm.events import IncompatibleQoS

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from rosglass.comm.graph import EndpointInfo
    from rosglass.comm.qos import QoS
    from rosglass.wires.base import Middleware

    Conflicts = Mapping[EndpointInfo, Mapping[str, str]]

__all__ = ["conflict_events", "conflicts", "words"]


def conflicts(
    middleware: Middleware, endpoint: EndpointInfo, requested: QoS, offered: QoS
) -> dict[str, str]:
    """Say, policy by policy, what keeps a publisher and a subscription apart.

    Args:
        middleware: What connects them.
        endpoint: The one of the two that is not ours.
        requested: The subscription's profile.
        offered: The publisher's profile.
    """
    return {**requested.conflicts(offered), **middleware.conflicts(endpoint)}


def words(found: Mapping[str, str]) -> str:
    """Return the conflicts of policies as one line."""
    return "; ".join(f"{policy}: {reason}" for policy, reason in found.items())


def conflict_events(
    found: Conflicts,
) -> Callable[[EndpointInfo, int, int, int], IncompatibleQoS | None]:
    """Return what makes events of the endpoints in conflict, for :class:`comm.Appearances`."""

    def event(
        endpoint: EndpointInfo, change: int, _count: int, total: int
    ) -> IncompatibleQoS | None:
        if change < 0:
            return None
        policies = found[endpoint]
        return IncompatibleQoS(endpoint, tuple(policies), words(policies), total)

    return event
