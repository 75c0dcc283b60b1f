"""Fixtures for tests with real peers: other processes on this machine, loopback only."""

from __future__ import annotations

import json
import os
import queue
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence


class Process:
    """A process that prints one JSON object per line; everything else it prints is kept."""

    def __init__(self, command: Sequence[str], env: dict[str, str] | None = None) -> None:
        self.popen = subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            env=env,
        )
        self.pid = self.popen.pid
        self.output: list[str] = []
        self.events: queue.Queue[dict[str, Any]] = queue.Queue()
        self._skipped: list[dict[str, Any]] = []
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self) -> None:
        assert self.popen.stdout is not None
        for line in self.popen.stdout:
            if line.startswith("{"):
                self.events.put(json.loads(line))
            else:
                self.output.append(line)

    def event(self, key: str, timeout: float = 30.0, **otherwise: Any) -> Any:
        """Return the value of the next event that has `key`; other events wait for their turn.

        Without such an event the test fails, unless it says what to return `otherwise`.
        """
        deadline = time.monotonic() + timeout
        for event in self._skipped:
            if key in event:
                self._skipped.remove(event)
                return event[key]
        while True:
            try:
                event = self.events.get(timeout=max(0.01, deadline - time.monotonic()))
            except queue.Empty:
                if otherwise:
                    return otherwise["otherwise"]
                output = "".join(self.output[-40:])
                pytest.fail(f"no {key!r} from {self.popen.args} within {timeout} s:\n{output}")
            if key in event:
                return event[key]
            self._skipped.append(event)

    def ask(self, **request: Any) -> None:
        """Send a JSON object to its standard input."""
        assert self.popen.stdin is not None
        self.popen.stdin.write(json.dumps(request) + "\n")
        self.popen.stdin.flush()

    def end(self) -> None:
        """Kill it, this process only."""
        self.popen.kill()
        self.popen.wait()
        self._reader.join(5)


@pytest.fixture(scope="module")
def start_program() -> Iterator[Callable[..., Process]]:
    """Start a program with the given arguments; killed when the module's tests are done."""
    started: list[Process] = []

    def start_program(*command: str, env: dict[str, str] | None = None) -> Process:
        process = Process(command, env)
        started.append(process)
        return process

    yield start_program
    for process in started:
        process.end()


@pytest.fixture(scope="module")
def start(start_program: Callable[..., Process]) -> Callable[..., Process]:
    """Start Python with the given arguments; killed when the module's tests are done."""

    def start(*arguments: str, env: dict[str, str] | None = None) -> Process:
        return start_program(sys.executable, "-W", "ignore", *arguments, env=env)

    return start


@pytest.fixture(scope="session")
def on_two_machines() -> Callable[..., dict[str, Any]]:
    """Run a script in a network namespace of its own; return what it printed last, as JSON.

    Skips the test where namespaces are not permitted; fails it when the script fails. The script
    can import ``two_machines`` and ``waiting``.
    """

    def on_two_machines(
        script: Path, *arguments: str, env: Mapping[str, str] | None = None, timeout: float = 100.0
    ) -> dict[str, Any]:
        here = Path(__file__).parent
        places = (str(here), str(here.parent / "helpers"), os.environ.get("PYTHONPATH", ""))
        done = subprocess.run(
            [*_private_network(), sys.executable, "-W", "ignore", str(script), *arguments],
            capture_output=True,
            text=True,
            timeout=timeout,
            check=False,
            env={**os.environ, **(env or {}), "PYTHONPATH": os.pathsep.join(filter(None, places))},
        )
        assert done.returncode == 0, done.stderr
        seen: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
        return seen

    return on_two_machines


def _private_network() -> list[str]:
    """Return how to run something as root of a network namespace of its own."""
    for kind in ("-n", "-rn"):
        command = ["unshare", kind, "sh", "-c", "ip link set lo up && unshare -n true"]
        try:
            if not subprocess.run(command, capture_output=True, check=False).returncode:
                return ["unshare", kind]
        except FileNotFoundError:
            break
    pytest.skip("network namespaces (unshare, ip) are not permitted here")
