"""``rosglass completion``: Tab completion of commands, options and names.

The ``argcomplete`` package (PyPI; ROS 2's own tools use it) talks to the shell and the parser; this
module provides the names in the graph and the library.
"""

from __future__ import annotations

import argparse
from functools import partial
from typing import TYPE_CHECKING

import argcomplete
from argcomplete.completers import FilesCompleter
from argcomplete.shell_integration import shellcode

import rosglass

if TYPE_CHECKING:
    from collections.abc import Iterator

__all__ = ["complete_names", "offer", "run"]

#: Seconds that completion may take to discover the graph.
_DISCOVERY_TIMEOUT_S = 1.5
#: Kind of the library's types that complete an argument, by its kind; None for all.
_TYPES = {"messages": "msg", "service_types": "srv", "action_types": "action", "interfaces": None}


def run(args: argparse.Namespace) -> int:
    """Print the script by which a shell enables completion."""
    print(shellcode(["rosglass"], shell=args.shell))
    return 0


def offer(parser: argparse.ArgumentParser) -> None:
    """Print the completions for the shell, and end the program."""
    for argument in _arguments(parser):
        what = getattr(argument, "completes", "")
        if what.startswith("*."):
            argument.completer = FilesCompleter(tuple(what.replace("*.", "").split()))  # type: ignore[attr-defined]
        elif what:
            argument.completer = partial(complete_names, what)  # type: ignore[attr-defined]
    argcomplete.autocomplete(parser)


def _arguments(parser: argparse.ArgumentParser) -> Iterator[argparse.Action]:
    """Yield the arguments of a parser and its subcommands."""
    for action in parser._actions:
        yield action
        if isinstance(action, argparse._SubParsersAction):
            for command in action.choices.values():
                yield from _arguments(command)


def complete_names(
    what: str, *, prefix: str, parsed_args: argparse.Namespace, **_: object
) -> list[str]:
    """Return the names that begin with `prefix`; none on any error.

    Args:
        what: As for :func:`rosglass.cli.parser.complete`.
        prefix: The text typed so far.
        parsed_args: The options typed so far.
    """
    try:
        return [name for name in _names(what, parsed_args) if name.startswith(prefix)]
    except Exception:  # noqa: BLE001 - nothing may be printed into the line that is being typed
        return []


def _names(what: str, args: argparse.Namespace) -> list[str]:
    # Options are completed without these.
    if what == "examples":
        from rosglass.cli import examples  # noqa: PLC0415

        return examples.names()
    from rosglass.cli.connecting import names_ros1, other_nodes, wait  # noqa: PLC0415
    from rosglass.cli.interface import type_names  # noqa: PLC0415
    from rosglass.cli.network import nearby_url  # noqa: PLC0415 - not for every command

    if what in _TYPES:
        return type_names(names_ros1(args), _TYPES[what])
    url = getattr(args, "url", "") or nearby_url() or None
    with rosglass.connect(url, own_services=False) as node:

        def look() -> list[str]:
            if what == "lifecycle_nodes":
                services = [name for name in node.services() if name.endswith("/get_state")]
                return [name.removesuffix("/get_state") for name in services]
            if what == "plot_paths":
                return [f"{name}:" for name in node.topics()]
            return other_nodes(node) if what == "nodes" else list(getattr(node, what)())

        return wait(node, look, _DISCOVERY_TIMEOUT_S)
