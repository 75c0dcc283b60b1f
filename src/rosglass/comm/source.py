"""What fills a subscription: the side of it that every world makes its own."""

from __future__ import annotations

__all__ = ["Source"]


class Source:
    """What a subscription asks of its world; a world overrides what it can do."""

    def publisher_count(self) -> int:
        """Return how many publishers match now."""
        return 0

    def hint(self) -> str:
        """Return what a person could do about a topic without publishers, empty if nothing."""
        return ""

    def attend(self) -> None:
        """Hand on samples as they come from now on, if :attr:`Subscription.watched`."""

    def refresh(self) -> None:
        """Deliver, in the calling thread, what waits to be delivered."""

    def inform(self) -> None:
        """Look at the subscription soon, without waiting: listeners or patience are new."""

    def lost(self) -> int:
        """Return how many samples were sent and have not arrived."""
        return 0
