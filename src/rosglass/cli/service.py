"""``rosglass service``: inspect services, call them."""

from __future__ import annotations

import logging
import time
from typing import TYPE_CHECKING

from rosglass.cli.connecting import (
    await_graph,
    await_types,
    connect,
    create_typed,
    explained_wait,
    find,
    is_hidden,
    is_ros1,
    note_invalid_names,
    spelled,
    wait,
)
from rosglass.cli.endpoints import describe, print_names, short
from rosglass.cli.messages import (
    fields,
    parse_fields,
    print_json,
    split_type,
    template,
    to_json,
    to_yaml,
)
from rosglass.cli.output import Style, note
from rosglass.comm.names import similar
from rosglass.errors import ServiceUnavailableError

if TYPE_CHECKING:
    import argparse

    from rosglass.comm import EndpointInfo

__all__ = ["call", "info", "list_services"]


def list_services(args: argparse.Namespace) -> int:
    """Print the services."""
    with connect(args) as node:
        await_graph(node)
        note_invalid_names(node)
        if args.types or args.json:
            await_types(node, lambda: node.services().values(), args.timeout)
        found = {s: k for s, k in node.services().items() if args.hidden or not is_hidden(node, s)}
    print_names(args, node, "service", found)
    return 0


def info(args: argparse.Namespace) -> int:
    """Print the servers and clients of a service."""
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


def call(args: argparse.Namespace) -> int:
    """Call a service, and print the response."""
    type_name, text = split_type(args.rest)
    style = Style(args)
    deadline = time.monotonic() + args.timeout
    if not args.verbose:
        # This command prints the client's problem itself, once.
        logging.getLogger("rosglass.ros1").setLevel(logging.ERROR)
    with connect(args) as node:
        name = node.resolve(args.service)
        with create_typed(
            node, lambda: node.create_service_client(name, type_name), type_name, args.timeout
        ) as client:

            def settled() -> bool:
                # ROS 1's master reports at once that there is no such service.
                gone = is_ros1(node) and not node.service_servers(name)
                return client.type is not None or gone

            with explained_wait(lambda: client.problem):
                wait(node, settled, args.timeout)
            if client.type is None:
                raise ServiceUnavailableError(client.problem or f"no node offers {name}")
            request = client.type.request
            values = parse_fields(text, request.name, template(request))
            began = time.monotonic()
            with explained_wait(lambda: client.problem or f"{name} has not answered yet"):
                response = client.call(values, timeout=round(max(deadline - began, 1.0), 1))
            took = time.monotonic() - began
    found = fields(response, None if args.json else 100)
    if args.json:
        print(to_json(found))
        return 0
    print(to_yaml(found).rstrip("\n"))
    print(style(f"# {name} answered in {took * 1e3:.1f} ms", "dim"))
    return 0
