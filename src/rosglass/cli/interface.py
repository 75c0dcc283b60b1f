"""``rosglass interface``: inspect types of messages, services and actions."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rosglass.cli.completion import complete
from rosglass.cli.connecting import add_connection_options, add_definitions_option, connect, settle
from rosglass.cli.output import Style, add_output_options, note, print_json, template
from rosglass.cli.subcommands import Subcommands
from rosglass.cli.worlds import names_ros1

if TYPE_CHECKING:
    import argparse

    from rosglass.messages import ActionType, MessageType, ServiceType

__all__ = ["configure", "run"]


def configure(parser: argparse.ArgumentParser) -> None:
    """Declare the subcommands for types."""
    add = Subcommands(parser).add
    sub = add("show", "show the definition of a type, fetched from the robot if necessary", _show)
    complete(sub.add_argument("type", help="e.g. geometry_msgs/msg/Twist"), "interfaces")
    sub.add_argument("--no-comments", action="store_true", help="omit comments")
    sub.add_argument(
        "--template", action="store_true", help="print a message with all defaults, as YAML"
    )
    _finish(sub)
    sub = add("list", "list the types available on this machine", _list)
    sub.add_argument("text", nargs="?", default="", help="only names that contain this text")
    sub.add_argument("--kind", choices=("msg", "srv", "action"), help="only this kind")
    sub.add_argument("--ros1", action="store_true", help="list ROS 1 types")
    add_definitions_option(sub)
    add_output_options(sub)
    sub.set_defaults(url="")


def run(args: argparse.Namespace) -> int:
    """Run the subcommand."""
    args.ros1 = args.ros1 or names_ros1(args)
    return int(args.handler(args))


def _finish(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--ros1",
        action="store_true",
        help="the ROS 1 type; implied by --url ros1://...",
    )
    add_output_options(parser)
    add_connection_options(parser, timeout=5.0)


def _list(args: argparse.Namespace) -> int:
    from rosglass.interfaces import ros1_name
    from rosglass.messages import default_library

    names = default_library().names(1 if args.ros1 else 2, args.kind)
    if args.ros1:
        names = [ros1_name(name) for name in names]
    found = [name for name in names if args.text.lower() in name.lower()]
    if args.json:
        print_json(found)
        return 0
    for name in found:
        print(name)
    if not found:
        note(f"no type's name contains {args.text!r}")
    return 0 if found else 1


def _show(args: argparse.Namespace) -> int:
    from rosglass.interfaces import ros1_name

    found = _find(args)
    definition = found.definition
    source = definition.source
    parts = getattr(found, "parts", {"": found})
    if args.template:
        for name, part in parts.items():
            print(f"# {name}\n{template(part)}" if name else template(part))
        return 0
    if args.json:
        print_json(
            {
                "name": ros1_name(found.name) if found.ros == 1 else found.name,
                "ros": found.ros, "text": definition.text,
                "hash": found.md5 if found.ros == 1 else found.rihs01,
                "source": {"provider": source.provider, "file": source.file},
                "fields": {name: _fields(part) for name, part in parts.items()},
            }
        )  # fmt: skip
        return 0
    style = Style(args)
    shown = f"{ros1_name(found.name)}, md5 {found.md5}" if found.ros == 1 else found.name
    print(style(f"# {shown}, from {source.provider}", "dim"))
    for line in definition.text.rstrip("\n").split("\n"):
        code, mark, comment = line.partition("#")
        if args.no_comments:
            if code.strip():
                print(code.rstrip())
        else:
            print(code + style(mark + comment, "dim"))
    return 0


def _fields(part: MessageType) -> list[dict[str, str]]:
    return [
        {"name": f.name, "type": str(f.type), "unit": f.unit, "comment": f.comment}
        for f in part.fields
    ]


def _find(args: argparse.Namespace) -> MessageType | ServiceType | ActionType:
    import os

    from rosglass.errors import TypeNotFoundError, UnsupportedError
    from rosglass.interfaces import ros1_name
    from rosglass.messages import default_library, load

    hint = ""
    if "/" not in args.type:
        names = default_library().names(1 if args.ros1 else 2)
        close = [name for name in names if name.rpartition("/")[2].lower() == args.type.lower()]
        close = [ros1_name(name) for name in close] if args.ros1 else close
        example = "std_msgs/Bool" if args.ros1 else "std_msgs/msg/Bool"
        hint = f"Did you mean {' or '.join(close)}?" if close else f"Write e.g. {example}"
        raise TypeNotFoundError(f"{args.type!r} names no package. {hint}")
    try:
        return load(args.type, 1 if args.ros1 else 2)
    except TypeNotFoundError as error:
        _, mark, close_ones = str(error).partition("Did you mean ")
        hint = f"{mark}{close_ones.partition('?')[0]}?" if mark else ""
        if not (args.url or names_ros1(args) or os.environ.get("ROSGLASS_URL")):
            where = "or say where the robot is: --url zenoh://robot:7447"
            raise TypeNotFoundError(f"{error}; {where}") from error
    try:
        with connect(args) as node:
            settle(node)  # the node with the type may not be discovered yet
            return node.fetch_type(args.type, timeout=args.timeout)
    except (TypeNotFoundError, UnsupportedError) as error:
        raise TypeNotFoundError(f"{args.type}: {error}. {hint}".rstrip(". ")) from error
