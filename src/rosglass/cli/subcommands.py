"""Commands that consist of commands, such as ``rosglass topic list``."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import argparse
    from collections.abc import Callable

__all__ = ["Subcommands"]


class Subcommands:
    """What can be done with one kind of thing.

    Args:
        parser: The kind's own parser.
    """

    def __init__(self, parser: argparse.ArgumentParser) -> None:
        self._commands = parser.add_subparsers(metavar="WHAT", required=True)

    def add(
        self, name: str, summary: str, handler: Callable[[argparse.Namespace], int]
    ) -> argparse.ArgumentParser:
        """Add something that can be done, and return the parser of its options."""
        parser = self._commands.add_parser(
            name, help=summary, description=f"{summary[0].upper()}{summary[1:]}."
        )
        parser.set_defaults(handler=handler)
        return parser
