"""``rosglass record``: write topics into an MCAP file or a ROS 1 bag."""

from __future__ import annotations

import logging
import math
import shutil
import sys
import time
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

from rosglass.bags import Recorder
from rosglass.cli.connecting import End, connect
from rosglass.cli.output import CLEAR_LINE, ProblemReports, note
from rosglass.comm import ConnectionState
from rosglass.errors import Error

if TYPE_CHECKING:
    import argparse

    from rosglass.bags import RecordingStatus
    from rosglass.comm import Node

__all__ = ["run"]

#: Seconds that a problem must last before it is printed.
_REPORT_DELAY_S = 2.0


def run(args: argparse.Namespace) -> int:
    """Record until Ctrl-C, SIGTERM or the end of the duration."""
    path = Path(args.output or f"recording_{datetime.now():%Y-%m-%d_%H-%M-%S}")
    if path.suffix not in (".mcap", ".bag"):
        path = path.with_name(f"{path.name}.mcap")
    if args.all and args.topics:
        raise Error("--all and names of topics exclude each other")
    if not args.verbose:
        # This command prints the problems of topics itself, once.
        logging.getLogger("rosglass.comm").setLevel(logging.ERROR)
    with connect(args, wait_for_start=True) as node:
        recorder = Recorder(
            node,
            path,
            args.topics,
            include=args.regex,
            exclude=args.exclude,
            hidden=args.hidden,
            compression=args.compression,
        )
        end = End(once=True)
        try:
            note(f"recording into {path}; Ctrl-C ends it")
            _watch(node, recorder, end, args)
        finally:
            recorder.close()
        status = recorder.status()
    if not status.messages:
        path.unlink()
        note("nothing was recorded, and no file is left")
        return 1
    print(f"{path}: {_summary(status)}, {path.stat().st_size / 1e6:.1f} MB")
    for topic, count in status.topics.items():
        print(f"  {count:8} {topic}")
    return 0


def _watch(node: Node, recorder: Recorder, end: End, args: argparse.Namespace) -> None:
    until = math.inf if args.duration is None else time.monotonic() + args.duration
    shown = not args.quiet and sys.stderr.isatty()
    # A search or replacement in progress is not a problem yet.
    reports = ProblemReports(_REPORT_DELAY_S, over_status=shown)
    while not end.wait(max(0.0, min(0.5, until - time.monotonic()))):
        if time.monotonic() >= until:
            break
        status = recorder.status()
        reports.update(_problems(node, status))
        if shown:
            columns = shutil.get_terminal_size().columns
            print(
                f"{CLEAR_LINE}{_summary(status)[: columns - 1]}",
                end="",
                file=sys.stderr,
                flush=True,
            )
    reports.update(_problems(node, recorder.status()), last=True)
    if shown:
        print(file=sys.stderr)


def _problems(node: Node, status: RecordingStatus) -> dict[str, str]:
    """Return topic -> problem; if the connection is lost, only that."""
    state = node.status()
    problems = dict(status.problems)
    if state.state is ConnectionState.LOST:
        problems = {node.url: state.detail}
    if status.dropped:
        problems["disk"] = "it is too slow: messages are lost"
    return problems


def _summary(status: RecordingStatus) -> str:
    lost = f", {status.dropped} LOST" if status.dropped else ""
    topics = f"{len(status.topics)} topics"
    return f"{status.messages} messages of {topics} in {status.duration:.1f} s{lost}"
