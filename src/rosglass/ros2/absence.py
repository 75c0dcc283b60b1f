"""Why nothing comes on a topic that somebody used to publish."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from rosglass.comm import ConnectionState
from rosglass.ros2.announced import nodes_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rosglass.comm import EndpointInfo
    from rosglass.ros2.core import Core

__all__ = ["Absence"]


class Absence:
    """Follows the publishers of one topic; what our own node publishes is missed by nobody."""

    def __init__(self, core: Core) -> None:
        self._core = core
        self._last = self._since = ""

    def follow(self, publishers: Sequence[EndpointInfo]) -> list[str]:
        """Take note of who publishes now; return what keeps everybody else away, in words."""
        others = [one for one in publishers if one.node != self._core.name]
        if publishers:
            self._last, self._since = nodes_of(others), ""
        elif self._last and not self._since:
            # No age: the text would be another one, and told again, every second.
            self._since = time.strftime("%H:%M:%S")
        problems = []
        if self._since:
            problems.append(f"nobody has published it since {self._since}, when {self._last} left")
        status = self._core.status()
        if self._last and status.state is ConnectionState.LOST:
            problems.append(status.detail)
        return problems
