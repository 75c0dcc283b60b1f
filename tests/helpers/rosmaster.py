"""A ROS 1 master for tests: Debian's rosmaster, as a process on a port of its own."""

from __future__ import annotations

import subprocess
import xmlrpc.client
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest
from ports import free_port
from waiting import eventually

_PROGRAM = Path("/usr/bin/rosmaster")


class RosMaster:
    """A rosmaster, which :meth:`start` or a with statement starts; the latter kills it.

    Skips the test where ROS 1 is not installed.

    Attributes:
        port: Where it listens, also after it was killed and started again.
        uri: As in ROS_MASTER_URI.
        url: As :func:`rosglass.connect` takes it.
        home: ROS_HOME of everything that runs with it: logs, pid files.
    """

    def __init__(self, home: Path, port: int = 0) -> None:
        if not _PROGRAM.exists():
            pytest.skip("ROS 1 is not installed: sudo apt-get install python3-rosmaster")
        self.port, self.home = port or free_port(), home
        self.uri = f"http://127.0.0.1:{self.port}"
        self.url = f"ros1://127.0.0.1:{self.port}?ip=127.0.0.1"
        self._process: subprocess.Popen[bytes] | None = None

    def __enter__(self) -> RosMaster:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.kill()

    def env(self, **more: str) -> dict[str, str]:
        """Return an environment that has nothing but ROS 1 and this master."""
        return {
            "PATH": "/usr/bin:/bin",
            "HOME": str(self.home),
            "ROS_HOME": str(self.home),
            "ROS_LOG_DIR": str(self.home / "log"),
            "ROS_MASTER_URI": self.uri,
            "ROS_IP": "127.0.0.1",
            "LANG": "C.UTF-8",
            "PYTHONUNBUFFERED": "1",
            **more,
        }

    def start(self) -> None:
        """Start it, and return when it answers."""
        self.home.mkdir(exist_ok=True)
        # It must not outlive tests that are killed.
        command = ["setpriv", "--pdeathsig", "KILL", str(_PROGRAM), "--core", "-p", str(self.port)]
        log = self.home / "rosmaster.log"
        with log.open("wb") as output:
            process = subprocess.Popen(command, env=self.env(), stdout=output, stderr=output)
        self._process = process

        def answers() -> bool:
            assert process.poll() is None, f"rosmaster does not start:\n{log.read_text()}"
            with suppress(OSError, xmlrpc.client.Error):
                self.call("getPid")
                return True
            return False

        eventually(answers, log.read_text)

    @property
    def pid(self) -> int:
        """The running process."""
        assert self._process is not None
        return self._process.pid

    def kill(self) -> None:
        """Kill it: nodes are not notified, and the next one has forgotten everything."""
        if self._process:
            self._process.kill()
            self._process.wait()

    def restart(self) -> None:
        """Kill it and start another one on the same port."""
        self.kill()
        self.start()

    def call(self, method: str, *arguments: Any, caller: str = "/test") -> Any:
        """Call its XML-RPC API as a node; return the value, fail the test without success."""
        with xmlrpc.client.ServerProxy(self.uri) as server:
            code, reason, value = getattr(server, method)(caller, *arguments)
        assert code == 1, f"{method}{arguments}: {reason}"
        return value
