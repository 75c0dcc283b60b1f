"""The part of a node's own threads in a subscription, for tests without a node."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rosglass.comm import Sample, Subscription
    from rosglass.comm.inbox import Inbox


def inbox_of(subscription: Subscription) -> Inbox:
    """Return what a subscription's feed puts samples into."""
    return subscription._inbox


def deliver(subscription: Subscription, *samples: Sample) -> None:
    """Let samples arrive, one after the other."""
    for sample in samples:
        inbox_of(subscription).put(sample)


def set_problem(subscription: Subscription, problem: str) -> None:
    """Report why nothing can be received; empty when all is well."""
    subscription._set_problem(problem)
