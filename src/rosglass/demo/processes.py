"""Programs that the demo starts, and that end with it: the robot, a virtual screen."""

from __future__ import annotations

import os
import select
import shutil
import subprocess
import sys
import time
from typing import TYPE_CHECKING

from rosglass.comm import Handle
from rosglass.errors import Error

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

__all__ = ["DUPLICATE_EXIT", "LEASH", "Child", "VirtualScreen", "start_robot"]

#: Exit code of ``rosglass robot`` if there is a robot of its name already.
DUPLICATE_EXIT = 3
#: Seconds that a program has to end by itself.
_EXIT_TIMEOUT_S = 3.0
#: Prefix of a command: the system ends it when this program ends, even if that is killed.
LEASH = ("setpriv", "--pdeathsig", "TERM") if shutil.which("setpriv") else ()


class Child(Handle):
    """A program that ends when this one does.

    Its standard input is a pipe without data; a program started with ``--leash`` ends when the pipe
    breaks, which the system ensures even if this program is killed.

    Args:
        command: Program and arguments.
        name: Name for messages.
        env: Variables of its environment beside this program's.

    Raises:
        Error: The program cannot be started.
    """

    def __init__(
        self, command: Sequence[str], name: str, env: Mapping[str, str] | None = None
    ) -> None:
        self.name = name
        try:
            # A session of its own: only this program gets Ctrl-C, and ends its children in order.
            self._process = subprocess.Popen(
                command,
                stdin=subprocess.PIPE,
                start_new_session=True,
                env={**os.environ, **(env or {})},
            )
        except OSError as error:
            raise Error(f"cannot start {name} ({command[0]}): {error}") from error

    @property
    def pid(self) -> int:
        """Its process id."""
        return self._process.pid

    def poll(self) -> int | None:
        """Return its exit code, negative for a signal; None while it runs."""
        return self._process.poll()

    def close(self) -> None:
        """Terminate it, or kill it after 3 s. Safe to call twice."""
        if self._process.stdin is not None:
            self._process.stdin.close()
        _terminate(self._process)


def start_robot(url: str, options: Sequence[str] = ()) -> Child:
    """Start ``rosglass robot`` in a process of its own.

    Args:
        url: URL of the graph.
        options: Further options of the command.
    """
    command = [sys.executable, "-m", "rosglass", "robot", "--leash", *options]
    # Not as an argument, which every user of this machine can read: it may have a password.
    return Child(command, "the robot", {"ROSGLASS_URL": url})


class VirtualScreen(Handle):
    """A screen in memory (Xvfb); :attr:`display` is its ``DISPLAY``.

    Args:
        width: Pixels.
        height: Pixels.

    Attributes:
        process: The screen's program.

    Raises:
        Error: Xvfb is missing or does not start; the message gives the fix.
    """

    def __init__(self, width: int = 1280, height: int = 800) -> None:
        program = shutil.which("Xvfb")
        if program is None:
            raise Error(
                "there is no display, and Xvfb, which would replace one, is not installed; "
                "install it with: apt install xvfb"
            )
        read, write = os.pipe()
        try:
            # It ends with this program if the system supports that, otherwise with its last window.
            self.process = subprocess.Popen(
                [
                    *LEASH,
                    program,
                    *("-displayfd", str(write)),
                    *("-screen", "0", f"{width}x{height}x24"),
                    *("-nolisten", "tcp", "-terminate"),
                ],
                pass_fds=(write,),
                stdin=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                start_new_session=True,
            )
            os.close(write)
            number = _read_line(read, 10.0)
        finally:
            os.close(read)
        if not number:
            self.close()
            raise Error(
                f"Xvfb ({program}) did not start within 10 s; try it by hand: Xvfb -displayfd 1"
            )
        self.display = f":{number}"

    def close(self) -> None:
        """End it; safe to call twice."""
        _terminate(self.process)


def _terminate(process: subprocess.Popen[bytes]) -> None:
    """Terminate a process unless it has ended, or kill it after a while."""
    if process.poll() is not None:
        return
    process.terminate()
    try:
        process.wait(_EXIT_TIMEOUT_S)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


def _read_line(descriptor: int, timeout: float) -> str:
    """Return the line received within `timeout` seconds; empty if there is none."""
    deadline = time.monotonic() + timeout
    text = b""
    while b"\n" not in text:
        left = max(0.0, deadline - time.monotonic())
        ready, _, _ = select.select([descriptor], [], [], left)
        part = os.read(descriptor, 64) if ready else b""
        if not part:
            return ""
        text += part
    return text.partition(b"\n")[0].decode().strip()
