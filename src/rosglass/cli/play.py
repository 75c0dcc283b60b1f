"""``rosglass play``: publish the messages of a recording."""

from __future__ import annotations

import contextlib
import json
import logging
import os
import select
import shutil
import sys
from datetime import datetime
from typing import TYPE_CHECKING, Any

from rosglass.bags import Player, open_bag
from rosglass.cli.arguments import PLAY_KEYS
from rosglass.cli.connecting import End, connect
from rosglass.cli.output import CLEAR_LINE, note
from rosglass.errors import Error
from rosglass.interfaces import ros1_name

if sys.platform != "win32":
    import termios
    import tty

if TYPE_CHECKING:
    import argparse
    from collections.abc import Iterator

    from rosglass.bags import Bag, Channel

__all__ = ["run"]

#: Key codes of terminals, in order of matching.
_JUMPS = {"\033[D": -10.0, "\033[C": 10.0}


def run(args: argparse.Namespace) -> int:
    """Play until the end, Ctrl-C or SIGTERM."""
    file, renamed = _arguments(args)
    with open_bag(file) as bag:
        if args.list:
            print(json.dumps(_summary(bag), indent=2) if args.json else _listing(bag))
            return 0
        if not args.verbose:
            # This command prints what is not played, and why.
            logging.getLogger("rosglass.bags").setLevel(logging.CRITICAL)
        with (
            connect(args, wait_for_start=True) as node,
            Player(
                node,
                bag,
                topics=args.topics,
                exclude=args.exclude,
                remap=renamed,
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
                f"playing {topics} topics of {file} ({bag.duration:.1f} s) to {node.url}",
                flush=True,
            )
            if not any(channel.count for channel in player.channels):
                note(f"{file} holds no messages" + (" of these" if args.topics else ""))
            printed: dict[str, str] = {}
            try:
                _watch(player, bag, end, printed, keys=not args.no_keys)
            finally:
                _print_problems(player, printed, last=True)
                sent = player.status().sent
                print(f"{sent} messages sent", flush=True)
            return end.code or (0 if sent else 1)


def _arguments(args: argparse.Namespace) -> tuple[str, dict[str, str]]:
    """Return FILE and the new names; behind ``-t`` or ``-m``, FILE is the last of their values."""
    file, names, new = args.file, args.topics, args.remap
    if file is None and new and ":=" not in new[-1]:
        file = new.pop()
    elif file is None and len(names) > 1:
        file = names.pop()
    if file is None:
        raise Error("FILE is missing: rosglass play FILE [OPTIONS]")
    renamed = {}
    for text in new:
        before, separator, after = text.partition(":=")
        if not (before and separator and after):
            raise Error(f"--remap {text!r} is not of the form /old:=/new")
        renamed[before] = after
    return file, renamed


def _print_problems(player: Player, printed: dict[str, str], *, last: bool = False) -> None:
    """Print topics that are not played, once; and skipped messages at the end."""
    for topic, problem in list(player.problems.items()):
        if topic and printed.get(topic) != problem and (last or topic not in printed):
            printed[topic] = problem
            note(f"{topic}: {problem}")


def _watch(player: Player, bag: Bag, end: End, printed: dict[str, str], *, keys: bool) -> None:
    interactive = keys and sys.stdin is not None and sys.stdin.isatty() and sys.stdout.isatty()
    if interactive:
        print(PLAY_KEYS)
    with _unbuffered_keys() if interactive else contextlib.nullcontext():
        while not end.is_set() and not player.wait(0.0 if interactive else 0.2):
            _print_problems(player, printed)
            if not interactive:
                continue
            if select.select([sys.stdin], [], [], 0.2)[0] and not _on_keys(player, bag):
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


def _on_keys(player: Player, bag: Bag) -> bool:
    """Handle pressed keys; return False to end."""
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
def _unbuffered_keys() -> Iterator[None]:
    """Read keys one by one; Ctrl-C still ends the program."""
    before = termios.tcgetattr(sys.stdin)
    tty.setcbreak(sys.stdin)
    try:
        yield
    finally:
        termios.tcsetattr(sys.stdin, termios.TCSADRAIN, before)


def _summary(bag: Bag) -> dict[str, Any]:
    return {
        "file": str(bag.path),
        "start": bag.start / 1e9,
        "end": bag.end / 1e9,
        "duration": bag.duration,
        "problem": bag.problem,
        "topics": [
            {"topic": c.topic, "type": _type_name(c), "wire": c.wire, "messages": c.count}
            for c in bag.channels
        ],
    }


def _type_name(channel: Channel) -> str:
    return ros1_name(channel.type_name) if channel.wire == "ros1" else channel.type_name


def _listing(bag: Bag) -> str:
    began = datetime.fromtimestamp(bag.start / 1e9).astimezone()
    lines = [f"{bag.path}: {bag.duration:.1f} s from {began:%Y-%m-%d %H:%M:%S %Z}"]
    if bag.problem:
        lines.append(f"  {bag.problem}")
    for channel in bag.channels:
        count = "?" if channel.count < 0 else channel.count
        lines.append(f"  {count:>8} {channel.topic} [{_type_name(channel)}]")
    return "\n".join(lines)
