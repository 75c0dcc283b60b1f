"""Why nothing comes on a topic that somebody used to publish."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from rosglass.comm import ConnectionState

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from rosglass.comm import EndpointInfo, NodeName, Status

__all__ = ["Absence"]


class Absence:
    """Follows the publishers of one topic; what our own node publishes is missed by nobody.

    Args:
        own: Our own node's name.
        status: Returns the state of the node's connection.
    """

    def __init__(self, own: NodeName, status: Callable[[], Status]) -> None:
        self._own, self._status = own, status
        self._last = self._since = ""

    def follow(self, publishers: Sequence[EndpointInfo]) -> list[str]:
        """Take note of who publishes now; return what keeps everybody else away, in words."""
        others = {one.node.full for one in publishers if one.node != self._own}
        if publishers:
            self._last, self._since = ", ".join(sorted(others)), ""
        elif self._last and not self._since:
            # No age: the text would be another one, and told again, every second.
            self._since = time.strftime("%H:%M:%S")
        problems = []
        if self._since:
            problems.append(f"nobody has published it since {self._since}, when {self._last} left")
        status = self._status()
        if self._last and status.state is ConnectionState.LOST:
            problems.append(status.detail)
        return problems
