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

from rosglass.cli.connecting import End, add_connection_options, connect, seconds
from rosglass.cli.output import CLEAR_LINE, note
from rosglass.comm import ConnectionState
from rosglass.errors import Error

if TYPE_CHECKING:
    import argparse

    from rosglass.bags import Recorder, RecordingStatus
    from rosglass.comm import Node

__all__ = ["configure", "run"]

#: Seconds that a problem must last before it is printed.
_REPORT_DELAY_S = 2.0


def configure(parser: argparse.ArgumentParser) -> None:
    """Declare the command's options."""
    parser.add_argument(
        "topics",
        nargs="*",
        metavar="TOPIC",
        help="topics to record (default: all, including new ones)",
    )
    parser.add_argument(
        "-o",
        "--output",
        metavar="FILE.mcap",
        type=Path,
        help="file to write; default: recording_<date>_<time>.mcap; from ROS 1 also FILE.bag",
    )
    parser.add_argument("-a", "--all", action="store_true", help="record all topics (default)")
    parser.add_argument(
        "-e", "--regex", default="", metavar="REGEX", help="also record matching topics"
    )
    parser.add_argument(
        "-x",
        "--exclude",
        "--exclude-regex",
        default="",
        metavar="REGEX",
        help="exclude matching topics",
    )
    parser.add_argument(
        "--hidden",
        "--include-hidden-topics",
        action="store_true",
        help="include hidden topics, e.g. those of actions",
    )
    parser.add_argument(
        "-d", "--duration", type=seconds, metavar="SECONDS", help="exit after this time"
    )
    parser.add_argument(
        "--compression",
        choices=("zstd", "lz4", "bz2", "none"),
        default="",
        help="compression of the file (default: zstd; .bag: none, lz4 or bz2, default none)",
    )
    parser.add_argument("-q", "--quiet", action="store_true", help="show no progress")
    add_connection_options(parser)
    parser.epilog = "Ctrl-C ends the recording. Play it with rosglass play FILE.mcap."


def run(args: argparse.Namespace) -> int:
    """Record until Ctrl-C, SIGTERM or the end of the duration."""
    from rosglass.bags import Recorder

    path = args.output or Path(f"recording_{datetime.now():%Y-%m-%d_%H-%M-%S}")
    if path.suffix not in (".mcap", ".bag"):
        path = path.with_name(f"{path.name}.mcap")
    if args.all and args.topics:
        raise Error("--all and names of topics exclude each other")
    if not args.verbose:
        # This command prints the problems of topics itself, once.
        logging.getLogger("rosglass.comm").setLevel(logging.ERROR)
    with connect(args, patient=True) as node:
        recorder = Recorder(
            node,
            path,
            args.topics,
            include=args.regex,
            exclude=args.exclude,
            hidden=args.hidden,
            compression=args.compression,
        )
        end = End(patient=True)
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
    news = _News(shown)
    while not end.wait(max(0.0, min(0.5, until - time.monotonic()))):
        if time.monotonic() >= until:
            break
        status = recorder.status()
        news.report(node, status)
        if shown:
            lines = shutil.get_terminal_size().columns
            print(
                f"{CLEAR_LINE}{_summary(status)[: lines - 1]}", end="", file=sys.stderr, flush=True
            )
    news.report(node, recorder.status(), last=True)
    if shown:
        print(file=sys.stderr)


class _News:
    """Prints problems when they begin, and when they are over."""

    def __init__(self, on_terminal: bool) -> None:
        self._before = CLEAR_LINE if on_terminal else ""
        self._seen: dict[str, tuple[str, float]] = {}
        self._reported: dict[str, str] = {}

    def report(self, node: Node, status: RecordingStatus, *, last: bool = False) -> None:
        now = time.monotonic()
        problems = dict(status.problems)
        state = node.status()
        if state.state is ConnectionState.LOST:
            problems = {node.url: state.detail}
        if status.dropped:
            problems["disk"] = "it is too slow: messages are lost"
        for topic, problem in problems.items():
            since = self._seen.get(topic, ("", now))
            self._seen[topic] = (problem, since[1] if since[0] == problem else now)
            if self._reported.get(topic) == problem:
                continue
            # A search or replacement in progress is not a problem yet.
            if last or now - self._seen[topic][1] > _REPORT_DELAY_S:
                self._reported[topic] = problem
                print(f"{self._before}rosglass: {topic}: {problem}", file=sys.stderr, flush=True)
        for topic in self._reported.keys() - problems.keys():
            del self._reported[topic]
            if not last:
                print(f"{self._before}rosglass: {topic}: well again", file=sys.stderr, flush=True)
        for topic in self._seen.keys() - problems.keys():
            del self._seen[topic]


def _summary(status: RecordingStatus) -> str:
    lost = f", {status.dropped} LOST" if status.dropped else ""
    topics = f"{len(status.topics)} topics"
    return f"{status.messages} messages of {topics} in {status.duration:.1f} s{lost}"
