"""``rosglass router``: run a Zenoh router until Ctrl-C or SIGTERM."""

from __future__ import annotations

import signal
import sys
import threading
from typing import TYPE_CHECKING

from rosglass.wires.zenoh.router import Router

if TYPE_CHECKING:
    import argparse

__all__ = ["run"]


def run(args: argparse.Namespace) -> int:
    """Run the router; returns 0 after Ctrl-C or SIGTERM."""
    ended = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: ended.set())
    with Router(args.listen) as router:
        if not router.is_local:
            print(
                f"rosglass: warning: {router.listen} is open to the network; anyone who reaches it "
                "can steer the robot",
                file=sys.stderr,
            )
        print(f"Zenoh router at {router.listen}; connect with {router.url}", flush=True)
        # In slices: Windows delivers no signal to a thread that waits for ever.
        while not ended.wait(0.5):
            pass
    print("Zenoh router ended", flush=True)
    return 0
