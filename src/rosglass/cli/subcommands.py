"""Commands with subcommands, such as ``rosglass topic list``."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any, NoReturn

from rosglass.cli.completion import is_completing

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = ["Parser", "Subcommands", "add_verbose"]


class Parser(argparse.ArgumentParser):
    """Accepts options before, after and between arguments, as ``ros2`` commands are written.

    argparse alone rejects ``pub --once /topic TYPE``, and ``echo /topic --once TYPE``.
    """

    _mixing = False

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """See argparse."""
        has_commands = any(action.nargs == argparse.PARSER for action in self._actions)
        if self._mixing or is_completing():
            return super().parse_known_args(args, namespace)
        if has_commands:
            found, unknown = super().parse_known_args(args, namespace)
        else:
            self._mixing = True
            try:
                found, unknown = self.parse_known_intermixed_args(args, namespace)
            finally:
                self._mixing = False
        if unknown:
            self._refuse(unknown)
        return found, unknown

    def _refuse(self, unknown: list[str]) -> NoReturn:
        """End with this command's own usage; argparse alone shows that of ``rosglass``."""
        from rosglass.comm.names import similar

        options = [one for action in self._actions for one in action.option_strings]
        hints = (similar(one.partition("=")[0], options) for one in unknown if one[:1] == "-")
        self.error(f"unrecognized arguments: {' '.join(unknown)}{next(filter(None, hints), '')}")


class Subcommands:
    """The subcommands of a command.

    Args:
        parser: Parser of the command.
    """

    def __init__(self, parser: argparse.ArgumentParser) -> None:
        self._commands = parser.add_subparsers(metavar="WHAT", required=True)

    def add(
        self,
        name: str,
        summary: str,
        handler: Callable[..., int],
        aliases: tuple[str, ...] = (),
    ) -> argparse.ArgumentParser:
        """Add a subcommand, and return the parser of its options."""
        parser = self._commands.add_parser(
            name,
            aliases=aliases,
            help=summary,
            description=f"{summary[0].upper()}{summary[1:]}.",
        )
        parser.set_defaults(handler=handler)
        add_verbose(parser)
        return parser


def add_verbose(parser: argparse.ArgumentParser) -> None:
    """Declare ``-v``, which may stand after each word of a command."""
    parser.add_argument(
        "-v",
        "--verbose",
        action="count",
        default=argparse.SUPPRESS,
        help="log more; -vv logs everything",
    )
