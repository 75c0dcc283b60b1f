"""The parts that benchmarks of topics share: a publisher and a subscriber in two processes."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

__all__ = ["finish", "measure", "send_for"]


def send_for(send: Callable[[], object], seconds: float, hz: float) -> None:
    """Call `send` for a while at a rate (0 for as often as possible); print how often.

    It starts with the next line on standard input, and ends with the one after that.
    """
    print("ready", flush=True)
    sys.stdin.readline()
    due = time.monotonic()
    end, count = due + seconds, 0
    while time.monotonic() < end:
        send()
        count += 1
        if hz:
            due += 1 / hz
            time.sleep(max(0.0, due - time.monotonic()))
    print(json.dumps({"count": count}), flush=True)
    sys.stdin.readline()


def measure(script: str, plan: dict[str, Any], settle: float = 1.0) -> dict[str, Any]:
    """Run the roles `subscriber` and `publisher` of a script.

    Args:
        script: The script, which takes ``--role`` and ``--plan``.
        plan: What both are to do.
        settle: Seconds that the subscriber gets for what is on its way.

    Returns:
        The subscriber's figures, with what was `sent`.
    """
    processes = []
    for role in ("subscriber", "publisher"):
        process = subprocess.Popen(
            [sys.executable, "-W", "ignore", script, "--role", role, "--plan", json.dumps(plan)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        _read(process, "ready")
        processes.append(process)
    for process in processes:
        print(file=process.stdin, flush=True)
    receiving, sending = processes
    sent = json.loads(_read(sending, "{"))["count"]
    time.sleep(settle)
    print(file=receiving.stdin, flush=True)
    figures: dict[str, Any] = json.loads(_read(receiving, "{"))
    for process in processes:
        process.kill()
        process.wait()
    return figures | {"sent": sent}


def _read(process: subprocess.Popen[str], beginning: str) -> str:
    """Return the next line that begins so; peers print other things, too."""
    assert process.stdout is not None
    for line in process.stdout:
        if line.startswith(beginning):
            return line
    raise RuntimeError(f"{process.args} ended with {process.wait()}")


def finish(results: dict[str, Any], missed: list[str], file: Path | None) -> int:
    """Write the figures to a file, and print the targets missed; return the exit code."""
    if file:
        file.write_text(json.dumps(results, indent=2))
    for line in missed:
        print("MISSED", line)
    return 1 if missed else 0
