"""``rosglass node``: inspect nodes; in ROS 1 also end them, and clean up after them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rosglass.cli import node_ros1
from rosglass.cli.completion import complete
from rosglass.cli.connecting import (
    add_connection_options,
    await_types,
    connect,
    find,
    note_invalid_names,
    settle,
)
from rosglass.cli.endpoints import DUPLICATES_FIX, describe, duplicates
from rosglass.cli.output import Style, add_output_options, note, print_json
from rosglass.cli.subcommands import Subcommands
from rosglass.cli.worlds import is_hidden, spelled

if TYPE_CHECKING:
    import argparse

    from rosglass.comm import Node

__all__ = ["configure", "run"]


def configure(parser: argparse.ArgumentParser) -> None:
    """Declare the subcommands for nodes."""
    commands = Subcommands(parser)
    add = commands.add
    _finish(add("list", "list nodes", _list))
    sub = add("info", "show the topics, services and actions of a node", _info)
    complete(sub.add_argument("node"), "nodes")
    sub.add_argument(
        "--hidden",
        "--include-hidden",
        action="store_true",
        help="include those of actions",
    )
    _finish(sub)
    node_ros1.configure(commands)


def run(args: argparse.Namespace) -> int:
    """Run the subcommand."""
    return int(args.handler(args))


def _finish(parser: argparse.ArgumentParser) -> None:
    add_output_options(parser)
    add_connection_options(parser)


def _others(node: Node) -> list[str]:
    """Return the names of all nodes except that of this command."""
    me = node.resolve(node.name)
    return [name.full for name in node.nodes() if name.full != me]


def _list(args: argparse.Namespace) -> int:
    with connect(args) as node:
        settle(node)
        note_invalid_names(node)
        found = _others(node)
        shared = node.duplicate_nodes()
    for name, count in shared.items():
        note(f"{duplicates(name, count)}; {DUPLICATES_FIX}")
    if args.json:
        print_json(found)
        return 0
    for name in found:
        print(name)
    if not found:
        note("there are no other nodes here; rosglass doctor looks why")
    return 0


def _info(args: argparse.Namespace) -> int:
    style = Style(args)
    with connect(args) as node:
        name = "/" + args.node.lstrip("/")
        if not find(node, lambda: name in _others(node), args.timeout):
            return _unknown(node, name)
        await_types(node, lambda: [end.type for end in node.endpoints(name)], args.timeout)
        ends = [end for end in node.endpoints(name) if args.hidden or not is_hidden(node, end.name)]
    if args.json:
        print_json({"node": name, "endpoints": [describe(node, end) for end in ends]})
        return 0
    print(style(name, "bold"))
    kinds: dict[str, list[str]] = {}
    for end in ends:
        shown = f" [{spelled(node, end.type)}]" if end.type else ""
        kinds.setdefault(end.kind.value, []).append(end.name + shown)
    for kind, lines in kinds.items():
        print(style(f"  {kind}s:", "cyan"))
        for line in sorted(set(lines)):
            print(f"    {line}")
    return 0


def _unknown(node: Node, name: str) -> int:
    import difflib

    names = _others(node)
    close = difflib.get_close_matches(name, names, 3, 0.5)
    hint = f"Did you mean {' or '.join(close)}?" if close else f"There are: {', '.join(names)}"
    note(f"there is no node {name}. {hint}")
    return 1
