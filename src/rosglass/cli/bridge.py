"""``rosglass bridge``: relay topics, services and actions between two graphs."""

from __future__ import annotations

import argparse
import logging
import math
import secrets
import shutil
import sys
import time
from contextlib import suppress
from typing import TYPE_CHECKING

from rosglass.cli.connecting import TIMEOUT, End, add_definitions_option, join, seconds, settle
from rosglass.cli.output import CLEAR_LINE, Style, add_output_options, note, print_json, table
from rosglass.cli.worlds import spelled
from rosglass.errors import Error

if TYPE_CHECKING:
    from rosglass.bridge import Bridge, BridgeStatus, Rule
    from rosglass.comm import Node

__all__ = ["configure", "run"]

#: Seconds that a problem must last before it is printed.
_REPORT_DELAY_S = 3.0


def configure(parser: argparse.ArgumentParser) -> None:
    """Declare the command's options."""
    parser.add_argument("first", metavar="URL", help="the first graph, e.g. ros1://robot:11311")
    parser.add_argument(
        "second", metavar="URL", help="the second graph, e.g. zenoh://127.0.0.1:7447"
    )
    parser.add_argument(
        "-t",
        "--topic",
        action="append",
        default=[],
        metavar="NAME",
        help="relay a topic in both directions; NAME:=OTHER renames it in the second graph, "
        "'NAME->' relays it only from the first to the second, 'NAME<-' only back; * matches "
        "any characters; may be repeated",
    )
    parser.add_argument(
        "-s",
        "--service",
        action="append",
        default=[],
        metavar="NAME",
        help="the same for a service; 'NAME->' is one offered in the first graph",
    )
    parser.add_argument(
        "--action",
        action="append",
        default=[],
        metavar="NAME",
        help="the same for an action: goals, feedback, results and cancel requests",
    )
    parser.add_argument(
        "-a",
        "--all",
        action="store_true",
        help="relay all topics, services and actions, except hidden ones and those of every node",
    )
    parser.add_argument(
        "-x",
        "--exclude",
        "--exclude-regex",
        default="",
        metavar="REGEX",
        help="exclude matching names",
    )
    parser.add_argument(
        "--one-way",
        action="store_true",
        help="relay only from the first graph to the second, unless an arrow says otherwise",
    )
    parser.add_argument(
        "--type",
        action="append",
        default=[],
        type=_type,
        metavar="NAME:=TYPE",
        help="the type of a topic without publishers yet: it is relayed from its first message",
    )
    parser.add_argument(
        "--qos",
        default="",
        metavar="PRESET",
        help="quality of service on both sides, e.g. sensor_data (default: matching)",
    )
    parser.add_argument(
        "--keep",
        action="store_true",
        help="subscribe even while the other graph has no subscriber",
    )
    parser.add_argument(
        "--service-timeout",
        type=seconds,
        default=10.0,
        metavar="SECONDS",
        help="time for servers to respond (default: %(default)g)",
    )
    parser.add_argument(
        "--list",
        "--dry-run",
        action="store_true",
        help="list what would be relayed, and how, and exit",
    )
    parser.add_argument(
        "--statistics",
        type=seconds,
        default=5.0,
        metavar="SECONDS",
        help="period of the statistics lines, 0 for none (default: %(default)g)",
    )
    parser.add_argument(
        "-d", "--duration", type=seconds, metavar="SECONDS", help="exit after this time"
    )
    parser.add_argument(
        "--node-name", default="", metavar="NAME", help="name of both nodes (default: a unique one)"
    )
    parser.add_argument(
        "--timeout",
        type=seconds,
        default=TIMEOUT,
        metavar="SECONDS",
        help="time to wait for each graph to answer (default: %(default)g)",
    )
    add_definitions_option(parser)
    add_output_options(parser)
    parser.epilog = (
        "Ctrl-C ends it. The mapping of types, and what is lost: docs/bridge.md in the source."
    )


def run(args: argparse.Namespace) -> int:
    """Relay until Ctrl-C, SIGTERM or the end of the duration."""
    from rosglass.bridge import Bridge
    from rosglass.bridge.side import BRIDGE_NAME
    from rosglass.comm import QoS

    rules = _rules(args)
    qos = QoS.preset(args.qos) if args.qos else None
    for _, kind in args.type:
        _check_known(kind)
    name = args.node_name or f"{BRIDGE_NAME}_{secrets.token_hex(4)}"
    if not args.verbose:
        # This command prints problems itself, once.
        logging.getLogger("rosglass").setLevel(logging.ERROR)
    with (
        join(args.first, name, args.timeout) as first,
        join(args.second, name, args.timeout) as second,
    ):
        if args.list:
            return _list(args, first, second, rules)
        with Bridge(
            first,
            second,
            *rules,
            exclude=args.exclude,
            types=dict(args.type),
            qos=qos,
            keep=args.keep,
            timeout=args.service_timeout,
        ) as bridge:
            end = End()
            note(f"relaying between {first.url} and {second.url}; Ctrl-C ends it")
            return _watch(args, bridge, end, (first, second))


def _check_known(kind: str) -> None:
    """Raise TypeNotFoundError if neither ROS's definition of a type is known here."""
    from rosglass.errors import TypeNotFoundError
    from rosglass.messages import load

    with suppress(TypeNotFoundError):
        load(kind, 1)
        return
    load(kind, 2)


def _rules(args: argparse.Namespace) -> list[list[Rule]]:
    """Return the rules for topics, services and actions."""
    from rosglass.bridge import Direction, Rule

    named = (args.topic, args.service, args.action)
    if args.all and any(named):
        raise Error("--all and names exclude each other; write --topic '*' or --service '*'")
    if not (args.all or any(named)):
        if not args.list:
            raise Error(
                "nothing is to be relayed: name it by --topic, --service or --action, or use --all"
            )
        args.all = True
    found = []
    for given in (["*"],) * 3 if args.all else named:
        rules = [Rule.parse(text) for text in given]
        if args.one_way:
            rules = [
                Rule(r.name, r.other, Direction.THERE) if r.direction is Direction.BOTH else r
                for r in rules
            ]
        found.append(rules)
    return found


def _list(args: argparse.Namespace, first: Node, second: Node, rules: list[list[Rule]]) -> int:
    from rosglass.bridge import survey

    settle(first)
    settle(second)
    found = survey(first, second, *rules, exclude=args.exclude)
    if args.json:
        print_json(
            [
                {
                    "kind": one.kind,
                    "name": one.name,
                    "other_name": one.other,
                    "direction": one.direction,
                    "type": spelled((first, second)[one.direction == "<-"], one.type),
                    "other_type": spelled((first, second)[one.direction == "->"], one.other_type),
                    "notes": list(one.notes),
                    "problem": one.problem,
                }
                for one in found
            ]
        )
        return 0
    style = Style(args)
    rows = []
    for one in found:
        ends = (first, second) if one.direction == "->" else (second, first)
        names = (one.name, one.other) if one.direction == "->" else (one.other, one.name)
        types = (spelled(ends[0], one.type), spelled(ends[1], one.other_type or "-"))
        left, right = types if one.direction == "->" else types[::-1]
        rows.append((one.kind, names[0], left or "?", one.direction, names[1], right or "?"))
    for line, one in zip(table(rows) if rows else (), found, strict=True):
        print(style(line, "red") if one.problem else line)
        for text in (*one.notes, *((f"not relayed: {one.problem}",) if one.problem else ())):
            print(style(f"    {text}", "dim"))
    if not found:
        note("nothing is there that could be relayed; rosglass doctor looks why")
    return 0


def _watch(args: argparse.Namespace, bridge: Bridge, end: End, nodes: tuple[Node, Node]) -> int:
    until = math.inf if args.duration is None else time.monotonic() + args.duration
    period = args.statistics or math.inf
    due = time.monotonic() + period
    shown = sys.stderr.isatty()
    news = _News(shown)
    try:
        while not end.wait(max(0.0, min(0.5, until - time.monotonic()))):
            now = time.monotonic()
            status = bridge.status()
            news.report(status)
            if shown:
                width = shutil.get_terminal_size().columns - 1
                print(f"{CLEAR_LINE}{status.line()[:width]}", end="", file=sys.stderr, flush=True)
            elif now >= due:
                due = now + period
                print(status.line(), flush=True)
            if now >= until:
                break
    finally:
        status = bridge.status()
        if shown:
            print(file=sys.stderr)
        print(status.line(), flush=True)
        for one in status.relays:
            sign = f"{one.name} {one.direction}" + (f" {one.other}" * (one.other != one.name))
            kind = spelled(nodes[one.direction == "<-"], one.type)
            print(f"  {one.count:8} {sign} [{kind or '?'}]")
    return end.code


class _News:
    """Prints what fails or gets lost, when that begins; and when it is over."""

    def __init__(self, on_terminal: bool) -> None:
        self._before = CLEAR_LINE if on_terminal else ""
        self._since: dict[str, tuple[str, float]] = {}
        self._reported: dict[str, str] = {}
        self._noted: set[tuple[str, str]] = set()

    def report(self, status: BridgeStatus) -> None:
        now = time.monotonic()
        problems = {
            f"{one.name} {one.direction}": one.problem for one in status.relays if one.problem
        }
        for number, problem in enumerate(status.worlds):
            if problem:
                problems[f"the {('first', 'second')[number]} graph"] = problem
        for one in status.relays:
            notes = "; ".join(one.notes)
            if notes and (one.type, notes) not in self._noted:
                self._noted.add((one.type, notes))
                self._note(f"{one.name} {one.direction} [{one.type}]: {notes}")
        for name, problem in problems.items():
            since = self._since.get(name, ("", now))
            self._since[name] = (problem, since[1] if since[0] == problem else now)
            if (
                self._reported.get(name) != problem
                and now - self._since[name][1] >= _REPORT_DELAY_S
            ):
                self._reported[name] = problem
                self._note(f"{name}: {problem}")
        for name in self._since.keys() - problems.keys():
            del self._since[name]
            if self._reported.pop(name, None) is not None:
                self._note(f"{name}: well again")

    def _note(self, text: str) -> None:
        print(f"{self._before}rosglass: {text}", file=sys.stderr, flush=True)


def _type(text: str) -> tuple[str, str]:
    name, separator, kind = text.partition(":=")
    if not (separator and name and kind):
        raise argparse.ArgumentTypeError(f"{text!r} is not of the form /topic:=package/Type")
    return name, kind
