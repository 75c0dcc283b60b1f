"""The ``rosglass`` command: one module per subcommand, imported only when it is used."""

# Nothing is imported before main() can answer Ctrl-C; type checkers know this name.
TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = ["main"]


def main(argv: "Sequence[str] | None" = None) -> int:
    """Run the command line.

    Returns:
        The exit code: 0 done, 1 failed, 2 wrong usage, 130 ended by Ctrl-C, 143 by SIGTERM, 141
        when whoever read the output went away.
    """
    try:
        from rosglass.cli.program import run

        return run(argv)
    except KeyboardInterrupt:
        import signal

        # Whatever still ends now can be cut short by pressing it again.
        signal.signal(signal.SIGINT, signal.SIG_DFL)
        return 130
