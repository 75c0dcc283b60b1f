"""``rosglass interface``: inspect types of messages, services and actions."""

from __future__ import annotations

import os
from contextlib import suppress
from typing import TYPE_CHECKING

from rosglass.cli.connecting import await_graph, connect, names_ros1
from rosglass.cli.messages import print_json, template
from rosglass.cli.output import Style, note
from rosglass.errors import Error, TypeNotFoundError, UnsupportedError
from rosglass.interfaces import join_name, ros1_name
from rosglass.messages import MessageType, default_library, load

if TYPE_CHECKING:
    import argparse

    from rosglass.comm import Node
    from rosglass.messages import ActionType, ServiceType

__all__ = ["list_types", "show", "type_names"]


def type_names(ros1: bool, kind: str | None = None) -> list[str]:
    """Return the names of the types available on this machine.

    Args:
        ros1: Whether to return the types of ROS 1, instead of ROS 2's.
        kind: Only ``msg``, ``srv`` or ``action``; None for all.
    """
    names = default_library().names(1 if ros1 else 2, kind)
    return [ros1_name(name) for name in names] if ros1 else list(names)


def list_types(args: argparse.Namespace) -> int:
    """Print the types available on this machine."""
    args.ros1 = args.ros1 or names_ros1(args)
    names = type_names(args.ros1, args.kind)
    found = [name for name in names if args.text.lower() in name.lower()]
    if args.json:
        print_json(found)
        return 0
    for name in found:
        print(name)
    if not found:
        note(f"no type's name contains {args.text!r}")
    return 0 if found else 1


def show(args: argparse.Namespace) -> int:
    """Print the definition of a type."""
    args.ros1 = args.ros1 or names_ros1(args)
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


def _nested(node: Node, args: argparse.Namespace) -> MessageType | None:
    """Return a type that nodes use only inside of others; None for others, and if none is known.

    Nodes send their types with all that these contain, but answer requests for them only. Types
    that are known on this machine are left out: what they contain is known as well.
    """
    name, ros = join_name(args.type), 1 if args.ros1 else 2
    graph = (node.topics(), node.services(), node.actions())
    used = set[str]()
    for found in graph:
        for one in {one for types in found.values() for one in types}:
            with suppress(Error):  # what peers announce may be anything
                used.add(join_name(one))
    if name in used:
        return None
    unknown = [one for one in used if not _is_known(one, ros)]
    # Types of one package contain each other most often.
    package = name.partition("/")[0]
    unknown.sort(key=lambda one: (one.partition("/")[0] != package, one))
    for promise in [node.fetch_type_async(one, timeout=args.timeout) for one in unknown]:
        with suppress(Error):  # another one may contain it
            outer = promise.result(args.timeout)
            for part in getattr(outer, "parts", {"": outer}).values():
                if name in part.definition.nested:
                    return MessageType(part.definition.nested[name])
    return None


def _is_known(name: str, ros: int) -> bool:
    with suppress(Error):  # or it has a mistake here, and the node's is shown
        load(name, ros)
        return True
    return False


def _fields(part: MessageType) -> list[dict[str, str]]:
    return [
        {"name": f.name, "type": str(f.type), "unit": f.unit, "comment": f.comment}
        for f in part.fields
    ]


def _find(args: argparse.Namespace) -> MessageType | ServiceType | ActionType:
    hint = ""
    if "/" not in args.type:
        names = type_names(args.ros1)
        close = [name for name in names if name.rpartition("/")[2].lower() == args.type.lower()]
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
            await_graph(node)  # the node with the type may not be discovered yet
            return _nested(node, args) or node.fetch_type(args.type, timeout=args.timeout)
    except (TypeNotFoundError, UnsupportedError) as error:
        raise TypeNotFoundError(f"{args.type}: {error}. {hint}".rstrip(". ")) from error
