"""``rosglass param``: read and set the parameters of nodes."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rosglass.cli.connecting import as_ros1, await_graph, connect, explained_wait, names_ros1
from rosglass.cli.messages import print_json, to_yaml
from rosglass.cli.output import Style, note
from rosglass.comm import ParameterType
from rosglass.comm.names import similar
from rosglass.errors import Error, UnsupportedError
from rosglass.ros2.parameter_files import dump, parse_value, write

if TYPE_CHECKING:
    import argparse
    from collections.abc import Iterator
    from types import ModuleType

    from rosglass.comm import Node, ParameterClient, ParameterValue
    from rosglass.ros1.parameter_server import ParameterServer

__all__ = ["run"]

#: The required arguments in ROS 2.
_REQUIRED = {
    "list": (),
    "get": ("node", "parameter"),
    "describe": ("node", "parameter"),
    "set": ("node", "parameter", "value"),
    "delete": ("node", "parameter"),
    "dump": ("node",),
    "load": ("node", "file"),
}


def run(args: argparse.Namespace) -> int:
    """Run the subcommand."""
    if names_ros1(args):
        with connect(args) as node:
            return _run_ros1(node, args)
    for name in _REQUIRED[args.what]:
        if getattr(args, name) is None:
            usage = " ".join(needed.upper() for needed in _REQUIRED[args.what])
            raise Error(f"{name.upper()} is missing: rosglass param {args.what} {usage}")
    with connect(args) as node, explained_wait(lambda: _missing(node, args.node)):
        return _HANDLERS[args.what](node, args)


def _missing(node: Node, name: str | None) -> str:
    """Return why a node's parameters cannot be read; empty if they can."""
    full = "/" + (name or "").lstrip("/")
    if not name or node.service_servers(f"{full}/get_parameters"):
        return ""
    known = [other.full for other in node.nodes()]
    if full in known:
        return f"{full} does not serve its parameters"
    return f"there is no node {full}{similar(full, known)}"


def _list(node: Node, args: argparse.Namespace) -> int:
    style = Style(args)
    found: dict[str, list[str]] = {}
    failed = False
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
    await_graph(node)
    for name in node.nodes():
        if node.service_servers(f"{name.full}/list_parameters"):
            yield name.full


def _get(node: Node, args: argparse.Namespace) -> int:
    with node.create_parameter_client(args.node) as client:
        found = client.get([args.parameter], timeout=args.timeout)
        if found.get(args.parameter) is None:
            return _unknown(client, args)
    value = found[args.parameter]
    if args.json:
        print_json({args.parameter: value})
    else:
        print(to_yaml(list(value) if isinstance(value, bytes) else value).rstrip("\n"))
    return 0


def _describe(node: Node, args: argparse.Namespace) -> int:
    with node.create_parameter_client(args.node) as client:
        found = client.describe([args.parameter], timeout=args.timeout).get(args.parameter)
        if found is None or not found.type:
            return _unknown(client, args)
    shown: dict[str, Any] = asdict(found)
    shown["type"] = found.type.name.lower()
    shown["range"] = None if found.range is None else found.range._asdict()
    if args.json:
        print_json(shown)
    else:
        print(to_yaml({key: value for key, value in shown.items() if value}).rstrip("\n"))
    return 0


def _set(node: Node, args: argparse.Namespace) -> int:
    # Empty quotes are an empty text, as in ros2.
    value = parse_value(args.value, f"the value {args.value!r}") if args.value else ""
    with node.create_parameter_client(args.node) as client:
        fitting = _fitting(client, args, value)
    if repr(fitting) != repr(value):
        note(f"{args.parameter} is declared otherwise: it is set to {fitting!r}")
    return _change(node, args, fitting, "set")


def _fitting(
    client: ParameterClient, args: argparse.Namespace, value: ParameterValue
) -> ParameterValue:
    """Return a value as the parameter is declared: 5 may mean the double 5.0, or the text "5".

    In ROS 2, a parameter keeps its type, and refuses the integer 5 for 5.0. The node itself refuses
    values that do not fit.
    """
    if isinstance(value, str):
        return value
    known = client.describe([args.parameter], timeout=args.timeout).get(args.parameter)
    if known is None or known.dynamic_typing:
        return value
    if known.type is ParameterType.STRING:
        return str(args.value)
    if known.type is ParameterType.DOUBLE and type(value) is int:
        return _double(value)
    if known.type is ParameterType.DOUBLE_ARRAY and isinstance(value, list):
        return [_double(item) if type(item) is int else item for item in value]  # type: ignore[return-value]
    return value


def _double(value: int) -> float:
    if int(float(value)) != value:
        raise Error(f"{value} is not a double: the nearest one is {float(value)!r}")
    return float(value)


def _delete(node: Node, args: argparse.Namespace) -> int:
    return _change(node, args, None, "delete")


def _change(node: Node, args: argparse.Namespace, value: ParameterValue, what: str) -> int:
    with node.create_parameter_client(args.node) as client:
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


def _dump(node: Node, args: argparse.Namespace) -> int:
    with node.create_parameter_client(args.node) as client:
        values = {client.node: client.get(timeout=args.timeout)}
    if args.output:
        write(args.output, values)
    elif args.json:
        print_json(values)
    else:
        print(dump(values), end="")
    return 0


def _load(node: Node, args: argparse.Namespace) -> int:
    with node.create_parameter_client(args.node) as client:
        names = client.load(args.file, timeout=args.timeout)
    if args.json:
        print_json(names)
    else:
        print(f"{len(names)} parameters of {client.node} set: {', '.join(names)}")
    return 0


def _unknown(client: ParameterClient, args: argparse.Namespace) -> int:
    hint = similar(args.parameter, client.names(timeout=args.timeout))
    note(f"{client.node} has no parameter {args.parameter}{hint}")
    return 1


_HANDLERS = {
    "list": _list,
    "get": _get,
    "describe": _describe,
    "set": _set,
    "delete": _delete,
    "dump": _dump,
    "load": _load,
}


def _run_ros1(node: Node, args: argparse.Namespace) -> int:
    """Run a subcommand in ROS 1, where one server has the parameters of all nodes."""
    if args.what not in _ROS1_HANDLERS:
        name = _name(args, args.parameter)
        raise UnsupportedError(
            f"ROS 1 knows nothing of a parameter but its value: rosglass param get {name}"
        )
    _ROS1_HANDLERS[args.what](_server(node), args)
    return 0


def _server(node: Node) -> ParameterServer:
    ros1 = as_ros1(node)
    assert ros1 is not None
    return ros1.parameter_server


def _rosparam_files() -> ModuleType:
    from rosglass.ros1 import rosparam_files  # noqa: PLC0415 - loads all of ROS 1

    return rosparam_files


def _name(args: argparse.Namespace, parameter: str | None) -> str:
    """Return an absolute name, given in full or as node and parameter, as in ROS 2."""
    whole = args.node if parameter is None else f"{args.node}/{parameter}"
    return "/" + whole.strip("/")


def _list_ros1(server: ParameterServer, args: argparse.Namespace) -> None:
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


def _get_ros1(server: ParameterServer, args: argparse.Namespace) -> None:
    name = _name(args, args.parameter)
    value = server.get(name, timeout=args.timeout)
    if args.json:
        print_json({name: value})
    else:
        print(to_yaml(list(value) if isinstance(value, bytes) else value).rstrip("\n"))


def _set_ros1(server: ParameterServer, args: argparse.Namespace) -> None:
    parameter, text = args.parameter, args.value
    if text is None:
        parameter, text = None, parameter
    if text is None:
        raise Error(f"say to what value {args.node} shall be set: rosglass param set NAME VALUE")
    name = _name(args, parameter)
    # Empty quotes are an empty text.
    value = _rosparam_files().parse_value(text, f"the value {text!r}") if text else ""
    server.set(name, value, timeout=args.timeout)
    _print_done(args, name, "set")


def _delete_ros1(server: ParameterServer, args: argparse.Namespace) -> None:
    name = _name(args, args.parameter)
    server.delete(name, timeout=args.timeout)
    _print_done(args, name, "deleted")


def _dump_ros1(server: ParameterServer, args: argparse.Namespace) -> None:
    namespace = "/" + (args.node or "").strip("/")
    if args.output:
        server.save(args.output, namespace, timeout=args.timeout)
        return
    value = server.get(namespace, timeout=args.timeout)
    if args.json:
        print_json(value)
    else:
        print(_rosparam_files().dump(value), end="")


def _load_ros1(server: ParameterServer, args: argparse.Namespace) -> None:
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


_ROS1_HANDLERS = {
    "list": _list_ros1,
    "get": _get_ros1,
    "set": _set_ros1,
    "delete": _delete_ros1,
    "dump": _dump_ros1,
    "load": _load_ros1,
}
