"""The paper's dashboard over the 3D view: a Zenoh router, a ROS 2 robot, and ``rosglass view``."""

from __future__ import annotations

import socket
import sys
from argparse import ArgumentParser
from pathlib import Path
from typing import TYPE_CHECKING

from rosglass.demo.rviz import run_station
from rosglass.errors import Error
from rosglass.wires.zenoh.router import Router

if TYPE_CHECKING:
    from contextlib import ExitStack

__all__ = ["main"]

_FOLDER = Path(__file__).parents[3] / "examples/rviz"


def main(seconds: float | None = None, screenshot: Path | None = None) -> int:
    """Run it until the view is closed; without a display, for 20 s and with a screenshot.

    Args:
        seconds: Seconds until it ends by itself; None to run until the view is closed.
        screenshot: File for a screenshot at that time.

    Returns:
        The exit code of ``rosglass view``.

    Raises:
        Error: The router does not start.
    """
    command = ["view", str(_FOLDER / "figure1.rviz"), "--overlay", str(_FOLDER / "Dashboard.qml")]
    return run_station(
        "the view", command, _start_router, seconds, screenshot, Path("view-demo.png")
    )


def _start_router(stack: ExitStack) -> str:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    router = stack.enter_context(Router(f"tcp/127.0.0.1:{port}"))
    print(f"started a Zenoh router on port {port}", flush=True)
    return router.url


if __name__ == "__main__":
    ArgumentParser(description=__doc__).parse_args()  # it has no options
    try:
        sys.exit(main())
    except Error as error:
        sys.exit(f"rosglass: {error}")
