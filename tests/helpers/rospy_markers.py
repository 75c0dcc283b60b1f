"""A real server of interactive markers of ROS 1, beside a test."""

from __future__ import annotations

import json
import subprocess
import threading
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rosmaster import RosMaster

INSTALLED = Path("/usr/lib/python3/dist-packages/interactive_markers").exists()
_PROGRAM = Path(__file__).parents[1] / "scene" / "rospy_interactive_markers.py"


class RospyServer:
    """Debian's server of interactive markers, as a process.

    Attributes:
        lines: What it has printed: the feedback that it received.
    """

    def __init__(self, master: RosMaster) -> None:
        self.lines: list[str] = []
        # It must not outlive tests that are killed.
        command = ["setpriv", "--pdeathsig", "KILL", "/usr/bin/python3", str(_PROGRAM)]
        pipe = subprocess.PIPE
        self._process = subprocess.Popen(
            command, env=master.env(), stdin=pipe, stdout=pipe, text=True, bufsize=1
        )
        assert self._process.stdout is not None
        self._output = self._process.stdout
        assert self._output.readline() == "ready\n"
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self) -> None:
        self.lines.extend(self._output)

    def send(self, line: str) -> None:
        assert self._process.stdin is not None
        self._process.stdin.write(f"{line}\n")

    def insert(self, *markers: dict[str, Any]) -> None:
        """Insert markers, as fields of their messages."""
        self.send(f"markers {json.dumps(markers)}")

    def feedback(self, marker: str, event: int) -> list[list[str]]:
        """Return the feedback of a marker: x, y and menu entry of each event."""
        start = f"feedback {marker} {event} "
        return [one.removeprefix(start).split() for one in self.lines if one.startswith(start)]

    def kill(self) -> None:
        self._process.kill()
        self._process.wait()
