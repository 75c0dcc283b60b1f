"""``rosglass param``: read and set the parameters of nodes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rosglass.cli.completion import complete
from rosglass.cli.connecting import add_connection_options, connect, settle
from rosglass.cli.output import Style, add_output_options, note, print_json, to_yaml
from rosglass.cli.subcommands import Subcommands

if TYPE_CHECKING:
    import argparse
    from collections.abc import Iterator

    from rosglass.comm import Node, ParameterClient, ParameterValue

__all__ = ["configure", "run"]


def configure(parser: argparse.ArgumentParser) -> None:
    """Declare what can be done with parameters."""
    add = Subcommands(parser).add
    sub = add("list", "list the parameters of a node, or of all nodes", _list)
    complete(sub.add_argument("node", nargs="?", help="default: all nodes"), "nodes")
    _finish(sub)
    sub = add("get", "print the value of a parameter", _get)
    complete(sub.add_argument("node"), "nodes")
    sub.add_argument("parameter")
    _finish(sub)
    sub = add("describe", "show what is known about a parameter", _describe)
    complete(sub.add_argument("node"), "nodes")
    sub.add_argument("parameter")
    _finish(sub)
    sub = add("set", "set a parameter", _set)
    complete(sub.add_argument("node"), "nodes")
    sub.add_argument("parameter")
    sub.add_argument("value", help="as in YAML: 1.5, true, hello, [1, 2]")
    _finish(sub)
    sub = add("delete", "take back a parameter that was set without being declared", _delete)
    complete(sub.add_argument("node"), "nodes")
    sub.add_argument("parameter")
    _finish(sub)
    sub = add("dump", "print all parameters of a node as a file for load", _dump)
    complete(sub.add_argument("node"), "nodes")
    sub.add_argument("-o", "--output", metavar="FILE", help="write into a file instead")
    _finish(sub)
    sub = add("load", "set the parameters of a node from a file", _load)
    complete(sub.add_argument("node"), "nodes")
    sub.add_argument("file", metavar="FILE.yaml")
    _finish(sub)


def run(args: argparse.Namespace) -> int:
    """Do it."""
    return int(args.handler(args))


def _finish(parser: argparse.ArgumentParser) -> None:
    add_output_options(parser)
    add_connection_options(parser)


def _list(args: argparse.Namespace) -> int:
    from rosglass.errors import Error

    style = Style(args)
    found: dict[str, list[str]] = {}
    failed = False
    with connect(args) as node:
        for name in [args.node] if args.node else _nodes(node):
            try:
                with node.create_parameter_client(name) as client:
                    found[client.node] = client.names(timeout=args.timeout)
            except Error as error:  # noqa: PERF203 - one silent node must not hide the others
                failed = True
                note(str(error))
    if args.json:
        print_json(found)
    else:
        for name, names in found.items():
            print(style(f"{name}:", "bold"))
            for parameter in names:
                print(f"  {parameter}")
    return 1 if failed and not found else 0


def _nodes(node: Node) -> Iterator[str]:
    """Yield the nodes that serve their parameters."""
    settle(node)
    for name in node.nodes():
        if node.service_servers(f"{name.full}/list_parameters"):
            yield name.full


def _get(args: argparse.Namespace) -> int:
    with connect(args) as node, node.create_parameter_client(args.node) as client:
        found = client.get([args.parameter], timeout=args.timeout)
        if found.get(args.parameter) is None:
            return _unknown(client, args)
    value = found[args.parameter]
    if args.json:
        print_json({args.parameter: value})
    else:
        print(to_yaml(list(value) if isinstance(value, bytes) else value).rstrip("\n"))
    return 0


def _describe(args: argparse.Namespace) -> int:
    from dataclasses import asdict

    with connect(args) as node, node.create_parameter_client(args.node) as client:
        found = client.describe([args.parameter], timeout=args.timeout).get(args.parameter)
        if found is None or not found.type:
            return _unknown(client, args)
    told: dict[str, Any] = asdict(found)
    told["type"] = found.type.name.lower()
    told["range"] = None if found.range is None else found.range._asdict()
    if args.json:
        print_json(told)
    else:
        print(to_yaml({key: value for key, value in told.items() if value}).rstrip("\n"))
    return 0


def _set(args: argparse.Namespace) -> int:
    from rosglass.ros2.parameter_files import parse_value

    # Nothing between quotes is an empty text, as for ros2.
    value = parse_value(args.value, f"the value {args.value!r}") if args.value else ""
    return _change(args, value, "set")


def _delete(args: argparse.Namespace) -> int:
    return _change(args, None, "delete")


def _change(args: argparse.Namespace, value: ParameterValue, what: str) -> int:
    with connect(args) as node, node.create_parameter_client(args.node) as client:
        result = client.set({args.parameter: value}, timeout=args.timeout)[args.parameter]
        name = client.node
    if args.json:
        print_json({"successful": result.successful, "reason": result.reason})
    elif result.successful:
        done = {"set": "is set", "delete": "is deleted"}[what]
        print(f"{name}: {args.parameter} {done}" + (f" ({result.reason})" * bool(result.reason)))
    else:
        note(f"{name} refuses to {what} {args.parameter}: {result.reason or 'it gives no reason'}")
    return 0 if result.successful else 1


def _dump(args: argparse.Namespace) -> int:
    from rosglass.ros2.parameter_files import dump, write

    with connect(args) as node, node.create_parameter_client(args.node) as client:
        values = {client.node: client.get(timeout=args.timeout)}
    if args.output:
        write(args.output, values)
    elif args.json:
        print_json(values)
    else:
        print(dump(values), end="")
    return 0


def _load(args: argparse.Namespace) -> int:
    with connect(args) as node, node.create_parameter_client(args.node) as client:
        names = client.load(args.file, timeout=args.timeout)
    if args.json:
        print_json(names)
    else:
        print(f"{len(names)} parameters of {client.node} set: {', '.join(names)}")
    return 0


def _unknown(client: ParameterClient, args: argparse.Namespace) -> int:
    import difflib

    names = client.names(timeout=args.timeout)
    close = difflib.get_close_matches(args.parameter, names, 3, 0.5)
    hint = f" Did you mean {' or '.join(close)}?" if close else ""
    note(f"{client.node} has no parameter {args.parameter}.{hint}")
    return 1
