"""Tab completion of options, and of names in the graph and the library.

The ``argcomplete`` package (PyPI; ROS 2's own tools use it) talks to the shell and the parser; this
module provides the names.
"""

from __future__ import annotations

import os
import sys
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import argparse
    from collections.abc import Iterable

    from rosglass.comm import Node

__all__ = ["SHELLS", "complete", "complete_files", "is_completing", "offer", "script"]

SHELLS = ("bash", "zsh", "fish", "tcsh")
#: Seconds that completion may take to discover the graph.
_DISCOVERY_TIMEOUT_S = 1.5


def complete(argument: argparse.Action, what: str) -> None:
    """Enable Tab completion of an argument.

    Args:
        argument: As returned by ``add_argument``.
        what: ``topics``, ``services``, ``actions``, ``nodes``, ``messages``, ``interfaces`` (all
            kinds of types), ``service_types`` or ``action_types``.
    """
    argument.completer = _Completer(what)  # type: ignore[attr-defined]


def complete_files(argument: argparse.Action, suffix: str) -> None:
    """Enable Tab completion with folders, and files whose name ends in `suffix`."""
    if is_completing():
        from argcomplete.completers import FilesCompleter

        argument.completer = FilesCompleter((suffix,))  # type: ignore[attr-defined]


def is_completing() -> bool:
    """Return whether the shell requests completions, instead of running a command."""
    return "_ARGCOMPLETE" in os.environ


def offer(parser: argparse.ArgumentParser) -> None:
    """Print the completions for the shell, and end the program."""
    try:
        import argcomplete
    except ModuleNotFoundError:
        sys.exit(1)  # nothing may be printed into the line that is being typed
    argcomplete.autocomplete(parser)


def script(shell: str) -> str:
    """Return the script by which a shell enables completion."""
    from argcomplete.shell_integration import shellcode

    return str(shellcode(["rosglass"], shell=shell))


class _Completer:
    def __init__(self, what: str) -> None:
        self._what = what

    def __call__(self, prefix: str, parsed_args: argparse.Namespace, **_: Any) -> Iterable[str]:
        """Return the matching names; none on any error."""
        try:
            return [name for name in self._names(parsed_args) if name.startswith(prefix)]
        except Exception:  # nothing may be printed into the line that is being typed
            return []

    def _names(self, args: argparse.Namespace) -> Iterable[str]:
        kinds = {"messages": "msg", "service_types": "srv", "action_types": "action"}
        if self._what in kinds or self._what == "interfaces":
            from rosglass.cli.worlds import names_ros1
            from rosglass.interfaces import ros1_name
            from rosglass.messages import default_library

            if names_ros1(args):
                return [
                    ros1_name(name) for name in default_library().names(1, kinds.get(self._what))
                ]
            return default_library().names(2, kinds.get(self._what))
        return self._ask(args)

    def _ask(self, args: argparse.Namespace) -> Iterable[str]:
        import rosglass
        from rosglass.cli.connecting import wait
        from rosglass.cli.network import nearby_url

        url = getattr(args, "url", "") or nearby_url() or None
        with rosglass.connect(url, own_services=False) as node:

            def others() -> list[str]:
                me = node.resolve(node.name)
                return [name for name in _look(node, self._what) if name != me]

            wait(node, others, _DISCOVERY_TIMEOUT_S)
            return others()


def _look(node: Node, what: str) -> Iterable[str]:
    if what == "topics":
        return node.topics()
    if what == "services":
        return node.services()
    if what == "actions":
        return node.actions()
    return [found.full for found in node.nodes()]
