"""``rosglass completion``: Tab completion of commands, options and names.

The ``argcomplete`` package (PyPI; ROS 2's own tools use it) talks to the shell and the parser; this
module provides the names in the graph and the library.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import argcomplete
from argcomplete.shell_integration import shellcode

import rosglass

if TYPE_CHECKING:
    import argparse

__all__ = ["complete_names", "offer", "run"]

#: Seconds that completion may take to discover the graph.
_DISCOVERY_TIMEOUT_S = 1.5
#: What is completed from the library -> the kind of its types; None for all.
_TYPES = {"messages": "msg", "service_types": "srv", "action_types": "action", "interfaces": None}


def run(args: argparse.Namespace) -> int:
    """Print the script by which a shell enables completion."""
    print(shellcode(["rosglass"], shell=args.shell))
    return 0


def offer(parser: argparse.ArgumentParser) -> None:
    """Print the completions for the shell, and end the program."""
    argcomplete.autocomplete(parser)


def complete_names(what: str, prefix: str, args: argparse.Namespace) -> list[str]:
    """Return the names that begin with `prefix`; none on any error.

    Args:
        what: As for :func:`rosglass.cli.parser.complete`.
        prefix: What is typed so far.
        args: The options typed so far.
    """
    try:
        return [name for name in _names(what, args) if name.startswith(prefix)]
    except Exception:  # nothing may be printed into the line that is being typed
        return []


def _names(what: str, args: argparse.Namespace) -> list[str]:
    # Options are completed without these.
    from rosglass.cli.connecting import names_ros1, other_nodes, wait  # noqa: PLC0415
    from rosglass.cli.interface import type_names  # noqa: PLC0415
    from rosglass.cli.network import nearby_url  # noqa: PLC0415 - not for every command

    if what in _TYPES:
        return type_names(names_ros1(args), _TYPES[what])
    url = getattr(args, "url", "") or nearby_url() or None
    with rosglass.connect(url, own_services=False) as node:

        def look() -> list[str]:
            return other_nodes(node) if what == "nodes" else list(getattr(node, what)())

        return wait(node, look, _DISCOVERY_TIMEOUT_S)
