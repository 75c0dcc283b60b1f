"""``rosglass service``: inspect services, call them."""

from __future__ import annotations

import logging
import time
from typing import TYPE_CHECKING

from rosglass.cli.completion import complete
from rosglass.cli.connecting import (
    add_connection_options,
    await_types,
    connect,
    find,
    note_invalid_names,
    settle,
    telling,
    wait,
)
from rosglass.cli.endpoints import describe, short
from rosglass.cli.output import (
    Style,
    add_output_options,
    fields,
    note,
    print_json,
    template,
    to_json,
    to_yaml,
)
from rosglass.cli.subcommands import Subcommands
from rosglass.cli.values import parse_fields, split_type
from rosglass.cli.worlds import is_hidden, is_ros1, spelled
from rosglass.comm.names import similar

if TYPE_CHECKING:
    import argparse

    from rosglass.comm import EndpointInfo

__all__ = ["configure", "run"]


def configure(parser: argparse.ArgumentParser) -> None:
    """Declare the subcommands for services."""
    add = Subcommands(parser).add
    sub = add("list", "list services", _list)
    sub.add_argument("-t", "--types", "--show-types", action="store_true", help="show types")
    sub.add_argument(
        "--hidden", "--include-hidden-services", action="store_true",
        help="include those of actions",
    )  # fmt: skip
    _finish(sub)
    sub = add("info", "show the servers and clients of a service", _info)
    complete(sub.add_argument("service"), "services")
    _finish(sub)
    sub = add("call", "call a service and print its response", _call)
    complete(sub.add_argument("service"), "services")
    complete(
        sub.add_argument(
            "rest", nargs="*", metavar="[TYPE] VALUES", help="values as YAML: '{a: 1, b: 2}'"
        ),
        "service_types",
    )
    _finish(sub)


def run(args: argparse.Namespace) -> int:
    """Run the subcommand."""
    return int(args.handler(args))


def _finish(parser: argparse.ArgumentParser) -> None:
    add_output_options(parser)
    add_connection_options(parser)


def _list(args: argparse.Namespace) -> int:
    style = Style(args)
    with connect(args) as node:
        settle(node)
        note_invalid_names(node)
        if args.types or args.json:
            await_types(node, lambda: node.services().values(), args.timeout)
        found = {s: k for s, k in node.services().items() if args.hidden or not is_hidden(node, s)}
    if args.json:
        print_json([{"service": name, "types": [spelled(node, t) for t in types]}
                    for name, types in found.items()])  # fmt: skip
        return 0
    for name, types in found.items():
        print(
            name
            + (
                style(f" [{', '.join(spelled(node, t) for t in types)}]", "dim")
                if args.types
                else ""
            )
        )
    if not found:
        note("there are no services here; rosglass doctor looks why")
    return 0


def _info(args: argparse.Namespace) -> int:
    style = Style(args)
    with connect(args) as node:
        name = node.resolve(args.service)

        def look() -> list[EndpointInfo]:
            return [*node.service_servers(name), *node.service_clients(name)]

        find(node, look, args.timeout)
        await_types(node, lambda: [end.type for end in look()], args.timeout)
        ends = look()
        hint = similar(name, node.services()) or "; rosglass service list shows what there is"
    if not ends:
        note(f"no node offers or calls {name}{hint}")
        return 1
    if args.json:
        print_json({"service": name, "endpoints": [describe(node, end) for end in ends]})
        return 0
    print(f"{style(name, 'bold')} [{', '.join(sorted({spelled(node, end.type) for end in ends}))}]")
    for end in ends:
        print(f"  {end.kind.value} {style(end.node, 'cyan')}")
        for key, value in describe(node, end).items():
            # In ROS 1, the type is printed above.
            shown = ("md5",) if is_ros1(node) else ("type", "type_hash", "response_hash", "gid")
            if key in shown and value:
                print(f"    {key}: {short(value)}")
    return 0


def _call(args: argparse.Namespace) -> int:
    from rosglass.errors import ServiceUnavailableError

    type_name, text = split_type(args.rest)
    style = Style(args)
    deadline = time.monotonic() + args.timeout
    if not args.verbose:
        # This command prints the client's problem itself, once.
        logging.getLogger("rosglass.ros1").setLevel(logging.ERROR)
    with connect(args) as node:
        name = node.resolve(args.service)
        with node.create_service_client(name, type_name) as client:

            def settled() -> bool:
                # ROS 1's master reports at once that there is no such service.
                gone = is_ros1(node) and not node.service_servers(name)
                return client.type is not None or gone

            with telling(lambda: client.problem):
                wait(node, settled, args.timeout)
            if client.type is None:
                raise ServiceUnavailableError(client.problem or f"no node offers {name}")
            request = client.type.request
            values = parse_fields(text, request.name, template(request))
            began = time.monotonic()
            with telling(lambda: client.problem or f"{name} has not answered yet"):
                response = client.call(values, timeout=round(max(deadline - began, 1.0), 1))
            took = time.monotonic() - began
    found = fields(response, None if args.json else 100)
    if args.json:
        print(to_json(found))
        return 0
    print(to_yaml(found).rstrip("\n"))
    print(style(f"# {name} answered in {took * 1e3:.1f} ms", "dim"))
    return 0
