"""``rosglass router``: run a Zenoh router until Ctrl-C or SIGTERM."""

from __future__ import annotations

import os
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
    source = args.config or os.environ.get("ZENOH_ROUTER_CONFIG_URI") or None
    with Router(args.listen, source) as router:
        risk = ""
        if not (router.is_local or router.is_restricted):
            risk = "anyone who reaches it can steer the robot"
        elif not (router.is_local or router.is_encrypted):
            risk = "its users are checked, but anyone on the way can read and change messages"
        if risk:
            text = f"rosglass: warning: {router.listen} is open to the network; {risk}"
            print(f"{text} (docs/security.md)", file=sys.stderr)
        place = f"{router.listen}, as {source} says" if source else router.listen
        url = f"; connect with {router.url}" if router.url else ""
        print(f"Zenoh router at {place}{url}", flush=True)
        # In slices: Windows delivers no signal to a thread that waits for ever.
        while not ended.wait(0.5):
            pass
    print("Zenoh router ended", flush=True)
    return 0
