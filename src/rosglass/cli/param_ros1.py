"""``rosglass param`` in ROS 1, where one server has the parameters of all nodes."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from rosglass.cli.connecting import as_ros1
from rosglass.cli.messages import print_json, to_yaml
from rosglass.cli.output import note
from rosglass.errors import Error, UnsupportedError
from rosglass.ros1.rosparam_files import dump, parse_value

if TYPE_CHECKING:
    import argparse

    from rosglass.comm import Node
    from rosglass.ros1.parameter_server import ParameterServer

__all__ = ["run"]


def run(what: str, node: Node, args: argparse.Namespace) -> int:
    """Run a subcommand: ``list``, ``get``, ``set``, ``delete``, ``dump`` or ``load``.

    Raises:
        UnsupportedError: ROS 1 lacks the feature.
        ParameterError: A parameter is not set, or a value is not valid for one.
    """
    if what not in _HANDLERS:
        name = _name(args, args.parameter)
        raise UnsupportedError(
            f"ROS 1 knows nothing of a parameter but its value: rosglass param get {name}"
        )
    _HANDLERS[what](_server(node), args)
    return 0


def _server(node: Node) -> ParameterServer:
    ros1 = as_ros1(node)
    assert ros1 is not None
    return ros1.parameter_server


def _name(args: argparse.Namespace, parameter: str | None) -> str:
    """Return an absolute name, given in full or as node and parameter, as in ROS 2."""
    whole = args.node if parameter is None else f"{args.node}/{parameter}"
    return "/" + whole.strip("/")


def _list(server: ParameterServer, args: argparse.Namespace) -> None:
    namespace = "/" + (args.node or "").strip("/")
    names = server.names(namespace, timeout=args.timeout)
    if not names and namespace != "/":
        # Raises, with similar names, unless it is a parameter itself, or an empty namespace.
        if not isinstance(server.get(namespace, timeout=args.timeout), dict):
            names = [namespace]
        else:
            note(f"the namespace {namespace} is empty")
    elif not names:
        note("no parameters are set")
    if args.json:
        print_json(names)
    else:
        print("".join(f"{name}\n" for name in names), end="")


def _get(server: ParameterServer, args: argparse.Namespace) -> None:
    name = _name(args, args.parameter)
    value = server.get(name, timeout=args.timeout)
    if args.json:
        print_json({name: value})
    else:
        print(to_yaml(list(value) if isinstance(value, bytes) else value).rstrip("\n"))


def _set(server: ParameterServer, args: argparse.Namespace) -> None:
    parameter, text = args.parameter, args.value
    if text is None:
        parameter, text = None, parameter
    if text is None:
        raise Error(f"say to what value {args.node} shall be set: rosglass param set NAME VALUE")
    name = _name(args, parameter)
    # Empty quotes are an empty text.
    value = parse_value(text, f"the value {text!r}") if text else ""
    server.set(name, value, timeout=args.timeout)
    _print_done(args, name, "set")


def _delete(server: ParameterServer, args: argparse.Namespace) -> None:
    name = _name(args, args.parameter)
    server.delete(name, timeout=args.timeout)
    _print_done(args, name, "deleted")


def _dump(server: ParameterServer, args: argparse.Namespace) -> None:
    namespace = "/" + (args.node or "").strip("/")
    if args.output:
        server.save(args.output, namespace, timeout=args.timeout)
        return
    value = server.get(namespace, timeout=args.timeout)
    if args.json:
        print_json(value)
    else:
        print(dump(value), end="")


def _load(server: ParameterServer, args: argparse.Namespace) -> None:
    file, namespace = _file(args)
    names = server.load(file, namespace, timeout=args.timeout)
    if args.json:
        print_json(names)
    else:
        print(f"{len(names)} parameters set: {', '.join(names)}")


def _file(args: argparse.Namespace) -> tuple[str, str]:
    """Distinguish a file and a namespace: ``FILE``, ``FILE NAMESPACE`` or ``NODE FILE``."""
    first, second = args.node, args.file
    if second is None:
        return first, "/"
    if Path(first).is_file() and not Path(second).is_file():
        first, second = second, first
    return second, "/" + first.strip("/")


def _print_done(args: argparse.Namespace, name: str, done: str) -> None:
    if args.json:
        print_json({"successful": True, "reason": ""})
    else:
        print(f"{name} is {done}")


_HANDLERS = {
    "list": _list,
    "get": _get,
    "set": _set,
    "delete": _delete,
    "dump": _dump,
    "load": _load,
}
