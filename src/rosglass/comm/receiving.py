"""Telling the threads that receive, which must not wait for what only they could bring."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

from rosglass.errors import UnsupportedError

if TYPE_CHECKING:
    from types import FrameType

__all__ = ["check_may_wait"]

#: Where the threads begin that receive, follow the graph and keep time.
_BEGINNINGS = (
    "rosglass.ros2.dds.",
    "rosglass.ros2.zenoh.",
    "rosglass.ros1.io_loop",
    "rosglass.comm.worker",
    "rosglass.comm.timers",
)


def check_may_wait(name: str) -> None:
    """Raise UnsupportedError in a callback that runs in a thread that receives.

    Args:
        name: The service or action that is about to be waited for.
    """
    # Zenoh's threads are not Python's, and marking them would cost something with every sample.
    frame: FrameType | None = sys._getframe()
    first = ""
    while frame is not None:
        module = frame.f_globals.get("__name__", "")
        first = first if module == "threading" else module
        frame = frame.f_back
    if first.startswith(_BEGINNINGS):
        raise UnsupportedError(
            f"{name}: this callback runs in a thread that receives (executor=IMMEDIATE, or "
            "add_done_callback()), where what it waits for could never arrive; take call_async(), "
            "get_async() or the like here, or let it run elsewhere: on_done(), or another executor"
        )
