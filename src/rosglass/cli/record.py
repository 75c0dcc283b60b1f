"""``rosglass record``: write topics into an MCAP file."""

from __future__ import annotations

import signal
import sys
import threading
import time
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

from rosglass.cli.connecting import add_connection_options, connect, seconds

if TYPE_CHECKING:
    import argparse

    from rosglass.bags import Recorder, RecordingStatus

__all__ = ["configure", "run"]


def configure(parser: argparse.ArgumentParser) -> None:
    """Declare the command's options."""
    parser.add_argument(
        "topics", nargs="*", metavar="TOPIC", help="topics to record; none: all, new ones included"
    )
    parser.add_argument(
        "-o",
        "--output",
        metavar="FILE.mcap",
        type=Path,
        help="file to write; default: recording_<date>_<time>.mcap",
    )
    parser.add_argument(
        "-e", "--regex", default="", metavar="REGEX", help="record topics that match as well"
    )
    parser.add_argument(
        "-x", "--exclude", default="", metavar="REGEX", help="never record topics that match"
    )
    parser.add_argument(
        "--hidden", action="store_true", help="record hidden topics, too, e.g. those of actions"
    )
    parser.add_argument(
        "-d", "--duration", type=seconds, metavar="SECONDS", help="end by itself after so long"
    )
    parser.add_argument(
        "--compression",
        choices=("zstd", "lz4", "none"),
        default="zstd",
        help="how the file is compressed (default: %(default)s)",
    )
    parser.add_argument("-q", "--quiet", action="store_true", help="show no progress")
    add_connection_options(parser)
    parser.epilog = "Ctrl-C ends the recording. Play it with rosglass play FILE.mcap."


def run(args: argparse.Namespace) -> int:
    """Record until Ctrl-C, SIGTERM or the end of the duration."""
    from rosglass.bags import Recorder

    path = args.output or Path(f"recording_{datetime.now():%Y-%m-%d_%H-%M-%S}.mcap")
    end = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: end.set())
    with connect(args) as node:
        recorder = Recorder(
            node,
            path,
            args.topics,
            include=args.regex,
            exclude=args.exclude,
            hidden=args.hidden,
            compression=args.compression,
        )
        try:
            print(f"recording into {path}; Ctrl-C ends it", file=sys.stderr, flush=True)
            _watch(recorder, end, args.duration, args.quiet)
        finally:
            status = recorder.status()
            recorder.close()
    size = path.stat().st_size
    print(f"{path}: {_summary(status)}, {size / 1e6:.1f} MB")
    for topic, count in status.topics.items():
        print(f"  {count:8} {topic}")
    for topic, problem in status.problems.items():
        print(f"rosglass: {topic}: {problem}", file=sys.stderr)
    if not status.messages:
        print("rosglass: nothing was recorded", file=sys.stderr)
    return 0 if status.messages else 1


def _watch(recorder: Recorder, end: threading.Event, duration: float | None, quiet: bool) -> None:
    until = None if duration is None else time.monotonic() + duration
    shown = not quiet and sys.stderr.isatty()
    while not end.is_set():
        left = 0.5 if until is None else min(0.5, until - time.monotonic())
        if left <= 0 or end.wait(left):
            break
        status = recorder.status()
        if shown:
            print(f"\r\033[K{_summary(status)}", end="", file=sys.stderr, flush=True)
    if shown:
        print(file=sys.stderr)


def _summary(status: RecordingStatus) -> str:
    lost = f", {status.dropped} LOST" if status.dropped else ""
    topics = f"{len(status.topics)} topics"
    return f"{status.messages} messages of {topics} in {status.duration:.1f} s{lost}"
