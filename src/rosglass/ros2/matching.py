"""What publishers and subscriptions say of each other's quality of service."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rosglass.comm import IncompatibleQoS

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from rosglass.comm import EndpointInfo

    Conflicts = Mapping[EndpointInfo, Mapping[str, str]]

__all__ = ["conflict_events", "words"]


def words(conflicts: Mapping[str, str]) -> str:
    """Return the conflicts of policies as one line."""
    return "; ".join(f"{policy}: {told}" for policy, told in conflicts.items())


def conflict_events(
    conflicts: Conflicts,
) -> Callable[[EndpointInfo, int, int, int], IncompatibleQoS | None]:
    """Return what makes events of the endpoints in conflict, for :class:`comm.Appearances`."""

    def event(
        endpoint: EndpointInfo, change: int, _count: int, total: int
    ) -> IncompatibleQoS | None:
        if change < 0:
            return None
        told = conflicts[endpoint]
        return IncompatibleQoS(endpoint, tuple(told), words(told), total)

    return event
