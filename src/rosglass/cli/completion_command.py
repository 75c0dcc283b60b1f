"""``rosglass completion``: enable Tab completion of commands, options and names."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rosglass.cli.completion import SHELLS, script

if TYPE_CHECKING:
    import argparse

__all__ = ["configure", "run"]


def configure(parser: argparse.ArgumentParser) -> None:
    """Declare the command's options."""
    parser.add_argument("shell", choices=SHELLS, help="the shell")
    parser.epilog = (
        'For bash, put this into ~/.bashrc: eval "$(rosglass completion bash)". '
        "Topics, services, actions and nodes come from the robot at ROSGLASS_URL."
    )


def run(args: argparse.Namespace) -> int:
    """Print the shell's script."""
    print(script(args.shell))
    return 0
