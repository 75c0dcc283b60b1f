"""The paper's Figure 1 as one command: master, robot, and RViz with its dashboard."""

from __future__ import annotations

import os
import shutil
import signal
import socket
import subprocess
import sys
import time
from argparse import ArgumentParser
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import TYPE_CHECKING

from rosglass.demo.processes import LEASH, Child, VirtualScreen, start_robot
from rosglass.errors import Error

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

__all__ = ["main", "run_station"]

_FOLDER = Path(__file__).parents[3] / "examples/rviz"
_SIZE = (1280, 800)
_MASTER_TIMEOUT_S = 20.0


def main(seconds: float | None = None, screenshot: Path | None = None) -> int:
    """Run it until RViz is closed; without a display, for 20 s and with a screenshot.

    Args:
        seconds: Seconds until it ends by itself; None to run until RViz is closed.
        screenshot: File for a screenshot at that time.

    Returns:
        RViz's exit code.

    Raises:
        Error: ROS's master is missing, or does not start.
    """
    files = (str(_FOLDER / "figure1.rviz"), "--overlay", str(_FOLDER / "Dashboard.qml"))
    command = ["rviz", *files, "--bare"]
    return run_station("RViz", command, _start_master, seconds, screenshot, Path("rviz-demo.png"))


def run_station(
    name: str,
    command: Sequence[str],
    start_graph: Callable[[ExitStack], str],
    seconds: float | None,
    screenshot: Path | None,
    default: Path,
) -> int:
    """Run a robot and a program that shows it, until that is closed.

    Args:
        name: Name of the program, in messages.
        command: Command of rosglass, without ``--url``.
        start_graph: Starts what both connect to; returns its URL.
        seconds: Seconds until it ends by itself; None to run until it is closed.
        screenshot: File for a screenshot at that time.
        default: That file where there is no display.

    Returns:
        The program's exit code.

    Raises:
        Error: Something that is needed is missing, or does not start.
    """
    headless = not os.environ.get("DISPLAY")
    if headless:
        seconds, screenshot = seconds or 20.0, screenshot or default
    with ExitStack() as stack:
        received = _note_signals(stack)
        if headless:
            screen = VirtualScreen(*_SIZE)
            stack.callback(screen.close)
            os.environ.update(DISPLAY=screen.display, QT_QPA_PLATFORM="xcb")
            print(f"no display: {name} runs {seconds:g} s on a virtual screen", flush=True)
        url = start_graph(stack)
        mode = ("--mode", "autonomous") if headless else ()
        robot = start_robot(url, ("--equipped", "--fps", "15", *mode))
        stack.callback(robot.close)
        ending = []
        if seconds is not None:
            ending = [
                "--screenshot",
                str(screenshot or default),
                "--after",
                str(seconds),
            ]
        whole = [*LEASH, sys.executable, "-m", "rosglass", *command, "--url", url, *ending]
        program = Child(whole, name)
        # Both at once: the user has closed the program, and waits.
        stack.callback(_close, program, robot)
        code = _wait(program, received)
        if ending and code == 0:  # it fails without a screenshot
            print(f"screenshot of {name}: {Path(ending[1]).resolve()}")
        return code


def _note_signals(stack: ExitStack) -> list[int]:
    """Return the signals to end received from now on; KeyboardInterrupt would lose a program."""
    received: list[int] = []
    for number in (signal.SIGINT, signal.SIGTERM):
        before = signal.signal(number, lambda got, _: received.append(got))
        stack.callback(signal.signal, number, before)
    return received


def _start_master(stack: ExitStack) -> str:
    program = shutil.which("rosmaster", path="/usr/bin:" + os.environ.get("PATH", ""))
    if program is None:
        raise Error("ROS's master is not installed; install it with: apt install python3-rosmaster")
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    os.environ["ROS_IP"] = "127.0.0.1"
    # Debian's own program, on Debian's own Python.
    environment = {**os.environ, "PATH": "/usr/bin:/bin"}
    environment.pop("PYTHONPATH", None)
    master = subprocess.Popen(
        [*LEASH, program, "--core", "-p", str(port)],
        env=environment,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    stack.callback(_end, master)
    until = time.monotonic() + _MASTER_TIMEOUT_S
    while time.monotonic() < until and master.poll() is None:
        with suppress(OSError), socket.create_connection(("127.0.0.1", port), 1.0):  # not yet
            print(f"started ROS's master on port {port}", flush=True)
            return f"ros1://127.0.0.1:{port}"
        time.sleep(0.05)
    raise Error(f"ROS's master ({program}) did not start within {_MASTER_TIMEOUT_S:g} s")


def _close(*children: Child) -> None:
    with ThreadPoolExecutor() as pool:
        for child in children:
            pool.submit(child.close)


def _end(process: subprocess.Popen[bytes]) -> None:
    process.kill()
    process.wait()


def _wait(program: Child, received: list[int]) -> int:
    """Wait for the program, or for a signal to end."""
    while (code := program.poll()) is None and not received:
        time.sleep(0.05)
    return 128 + received[0] if received else int(code or 0)


if __name__ == "__main__":
    ArgumentParser(description=__doc__).parse_args()  # it has no options
    try:
        sys.exit(main())
    except Error as error:
        sys.exit(f"rosglass: {error}")
