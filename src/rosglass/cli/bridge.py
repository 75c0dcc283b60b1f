"""``rosglass bridge``: relay topics, services and actions between two graphs."""

from __future__ import annotations

import logging
import math
import secrets
import shutil
import sys
import time
from contextlib import suppress
from typing import TYPE_CHECKING

from rosglass.bridge import Bridge, Direction, Rule, survey
from rosglass.bridge.side import BRIDGE_NAME
from rosglass.cli.connecting import End, await_graph, join, spelled
from rosglass.cli.messages import print_json
from rosglass.cli.output import CLEAR_LINE, ProblemReports, Style, note, table
from rosglass.comm import QoS
from rosglass.errors import Error, TypeNotFoundError
from rosglass.messages import load

if TYPE_CHECKING:
    import argparse

    from rosglass.bridge import BridgeStatus
    from rosglass.comm import Node

__all__ = ["run"]

#: Seconds that a problem must last before it is printed.
_REPORT_DELAY_S = 3.0


def run(args: argparse.Namespace) -> int:
    """Relay until Ctrl-C, SIGTERM or the end of the duration."""
    rules = _rules(args)
    qos = QoS.preset(args.qos) if args.qos else None
    for _, type_name in args.type:
        _check_known(type_name)
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


def _check_known(type_name: str) -> None:
    """Raise TypeNotFoundError if neither ROS's definition of a type is known here."""
    with suppress(TypeNotFoundError):  # ROS 2's may be known
        load(type_name, 1)
        return
    load(type_name, 2)


def _rules(args: argparse.Namespace) -> list[list[Rule]]:
    """Return the rules for topics, services and actions."""
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
    await_graph(first)
    await_graph(second)
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
        note("nothing is there that could be relayed; rosglass doctor finds out why")
    return 0


def _watch(args: argparse.Namespace, bridge: Bridge, end: End, nodes: tuple[Node, Node]) -> int:
    until = math.inf if args.duration is None else time.monotonic() + args.duration
    period = args.statistics or math.inf
    due = time.monotonic() + period
    shown = sys.stderr.isatty()
    reports = _Reports(shown)
    try:
        while not end.wait(max(0.0, min(0.5, until - time.monotonic()))):
            now = time.monotonic()
            status = bridge.status()
            reports.update(status)
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
            relay = f"{one.name} {one.direction}" + (f" {one.other}" * (one.other != one.name))
            type_name = spelled(nodes[one.direction == "<-"], one.type)
            print(f"  {one.count:8} {relay} [{type_name or '?'}]")
    return end.code


class _Reports:
    """Prints failures and losses when they begin, and when they end."""

    def __init__(self, on_terminal: bool) -> None:
        self._problems = ProblemReports(_REPORT_DELAY_S, over_status=on_terminal)
        self._noted: set[tuple[str, str]] = set()

    def update(self, status: BridgeStatus) -> None:
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
                self._problems.note(f"{one.name} {one.direction} [{one.type}]: {notes}")
        self._problems.update(problems)
