"""``rosglass play``: publish the messages of a recording."""

from __future__ import annotations

import argparse
import contextlib
import json
import logging
import select
import shutil
import sys
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rosglass.cli.connecting import End, add_connection_options, connect, seconds
from rosglass.cli.output import CLEAR_LINE, note

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rosglass.bags import Bag, Channel, Player

__all__ = ["configure", "run"]

_KEYS = (
    "space pauses, s sends one message, left and right jump 10 s, + and - change the rate, q ends"
)
#: Key codes of terminals, in order of matching.
_JUMPS = {"\033[D": -10.0, "\033[C": 10.0}


def configure(parser: argparse.ArgumentParser) -> None:
    """Declare the command's options."""
    parser.add_argument("file", metavar="FILE", type=Path, help="MCAP file, ROS 2 bag or ROS 1 bag")
    parser.add_argument(
        "--list", action="store_true", help="list the contents of the recording and exit"
    )
    parser.add_argument("--json", action="store_true", help="with --list: as JSON")
    parser.add_argument(
        "-r", "--rate", type=float, default=1.0, help="2 is twice as fast (default: %(default)g)"
    )
    parser.add_argument("-l", "--loop", action="store_true", help="start over at the end")
    parser.add_argument(
        "--clock",
        nargs="?",
        type=float,
        const=40.0,
        default=0.0,
        metavar="HZ",
        help="publish /clock, for nodes with use_sim_time (default rate: 40 Hz)",
    )
    parser.add_argument(
        "-t", "--topics", nargs="+", default=[], metavar="TOPIC", help="play only these"
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
        "-m",
        "--remap",
        nargs="+",
        default=[],
        type=_rule,
        metavar="OLD:=NEW",
        help="publish a topic under another name",
    )
    parser.add_argument(
        "--start",
        "--start-offset",
        type=seconds,
        default=0.0,
        metavar="SECONDS",
        help="start at this time in the recording",
    )
    parser.add_argument(
        "--duration", "--playback-duration", type=seconds, metavar="SECONDS",
        help="play only this long",
    )  # fmt: skip
    parser.add_argument(
        "-d",
        "--delay",
        type=seconds,
        default=1.0,
        metavar="SECONDS",
        help="time for subscriptions to connect before the first message (default: %(default)g)",
    )
    parser.add_argument(
        "-p", "--paused", "--start-paused", action="store_true", help="start paused"
    )
    parser.add_argument(
        "--no-keys", "--disable-keyboard-controls", action="store_true", help="ignore keys"
    )
    add_connection_options(parser)
    parser.epilog = f"Keys during playback: {_KEYS}."


def run(args: argparse.Namespace) -> int:
    """Play until the end, Ctrl-C or SIGTERM."""
    from rosglass.bags import Player, open_bag

    with open_bag(args.file) as bag:
        if args.list:
            print(json.dumps(_table(bag), indent=2) if args.json else _listing(bag))
            return 0
        if not args.verbose:
            # This command prints what is not played, and why.
            logging.getLogger("rosglass.bags").setLevel(logging.CRITICAL)
        with (
            connect(args, patient=True) as node,
            Player(
                node,
                bag,
                topics=args.topics,
                exclude=args.exclude,
                remap=dict(args.remap),
                rate=args.rate,
                loop=args.loop,
                clock=args.clock,
                start=args.start,
                duration=args.duration,
                delay=args.delay,
                paused=args.paused,
            ) as player,
        ):
            end = End()
            topics = len({channel.topic for channel in player.channels})
            print(
                f"playing {topics} topics of {args.file} ({bag.duration:.1f} s) to {node.url}",
                flush=True,
            )
            printed: dict[str, str] = {}
            try:
                _watch(player, bag, end, printed, keys=not args.no_keys)
            finally:
                _print_problems(player, printed, last=True)
                sent = player.status().sent
                print(f"{sent} messages sent", flush=True)
            return end.code or (0 if sent else 1)


def _print_problems(player: Player, printed: dict[str, str], *, last: bool = False) -> None:
    """Print what is not played, once; and at the end, which messages were skipped."""
    for topic, problem in list(player.problems.items()):
        if topic and printed.get(topic) != problem and (last or topic not in printed):
            printed[topic] = problem
            note(f"{topic}: {problem}")


def _watch(player: Player, bag: Bag, end: End, printed: dict[str, str], *, keys: bool) -> None:
    interactive = keys and sys.stdin is not None and sys.stdin.isatty() and sys.stdout.isatty()
    if interactive:
        print(_KEYS)
    with _keys() if interactive else contextlib.nullcontext():
        while not end.is_set() and not player.wait(0.0 if interactive else 0.2):
            _print_problems(player, printed)
            if not interactive:
                continue
            if select.select([sys.stdin], [], [], 0.2)[0] and not _obey(player, bag):
                break
            status = player.status()
            lag = f", {status.lag:.1f} s behind" if status.lag > 0.5 else ""
            line = (
                f"{status.state.value} {status.position:.1f} of {bag.duration:.1f} s, "
                f"rate {status.rate:g}, {status.sent} messages{lag}"
            )
            # A line that wraps cannot be overwritten.
            shown = line[: shutil.get_terminal_size().columns - 1]
            print(f"{CLEAR_LINE}{shown}", end="", flush=True)
    if interactive:
        print()


def _obey(player: Player, bag: Bag) -> bool:
    """Handle pressed keys; return False to end."""
    import os

    typed = os.read(sys.stdin.fileno(), 16).decode(errors="replace")
    if typed in _JUMPS:
        player.seek(min(max(player.position + _JUMPS[typed], 0.0), bag.duration))
    for key in "" if typed.startswith("\033") else typed:
        if key == " ":
            (player.resume if player.is_paused else player.pause)()
        elif key == "s":
            player.step()
        elif key in "+-":
            factor = 1.25 if key == "+" else 0.8
            player.set_rate(min(max(player.status().rate * factor, 0.01), 100.0))
        elif key == "q":
            return False
    return True


@contextlib.contextmanager
def _keys() -> Iterator[None]:
    """Read keys one by one; Ctrl-C still ends the program."""
    import termios
    import tty

    before = termios.tcgetattr(sys.stdin)
    tty.setcbreak(sys.stdin)
    try:
        yield
    finally:
        termios.tcsetattr(sys.stdin, termios.TCSADRAIN, before)


def _rule(text: str) -> tuple[str, str]:
    old, separator, new = text.partition(":=")
    if not (separator and old and new):
        raise argparse.ArgumentTypeError(f"{text!r} is not of the form /old:=/new")
    return old, new


def _table(bag: Bag) -> dict[str, Any]:
    return {
        "file": str(bag.path),
        "start": bag.start / 1e9,
        "end": bag.end / 1e9,
        "duration": bag.duration,
        "problem": bag.problem,
        "topics": [
            {"topic": c.topic, "type": _kind(c), "wire": c.wire, "messages": c.count}
            for c in bag.channels
        ],
    }


def _kind(channel: Channel) -> str:
    from rosglass.interfaces import ros1_name

    return ros1_name(channel.type_name) if channel.wire == "ros1" else channel.type_name


def _listing(bag: Bag) -> str:
    began = datetime.fromtimestamp(bag.start / 1e9).astimezone()
    lines = [f"{bag.path}: {bag.duration:.1f} s from {began:%Y-%m-%d %H:%M:%S %Z}"]
    if bag.problem:
        lines.append(f"  {bag.problem}")
    for channel in bag.channels:
        count = "?" if channel.count < 0 else channel.count
        lines.append(f"  {count:>8} {channel.topic} [{_kind(channel)}]")
    return "\n".join(lines)
