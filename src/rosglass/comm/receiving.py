"""Telling the threads that receive, which must not wait for what only they could bring."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

from rosglass.errors import UnsupportedError

if TYPE_CHECKING:
    from types import FrameType

__all__ = ["check_may_wait"]

#: Where the threads begin that receive.
_RECEIVING = ("rosglass.wires.dds.", "rosglass.wires.zenoh.", "rosglass.ros1.io_loop")
#: Where those begin that follow the graph and keep time; some of their jobs may wait for a moment.
_FOLLOWING = ("rosglass.comm.worker", "rosglass.comm.timers")


def check_may_wait(name: str, *, following: bool = False) -> None:
    """Raise UnsupportedError in a callback that runs in a thread that receives.

    Args:
        name: The service, action or topic that is about to be waited for.
        following: Whether threads that follow the graph and keep time may wait.
    """
    # Zenoh's threads are not Python's, and marking them would cost something with every sample.
    frame: FrameType | None = sys._getframe()
    first = ""
    while frame is not None:
        module = frame.f_globals.get("__name__", "")
        first = first if module == "threading" else module
        frame = frame.f_back
    if first.startswith(_RECEIVING if following else (*_RECEIVING, *_FOLLOWING)):
        raise UnsupportedError(
            f"{name}: this callback runs in a thread that receives (executor=IMMEDIATE, or "
            "add_done_callback()), where what it waits for could never arrive; take call_async(), "
            "get_async() or the like here, or let it run elsewhere: on_done(), or another executor"
        )
