"""The ``rosglass`` command: one module per subcommand, imported only when it is used."""

# Nothing is imported before main() can answer Ctrl-C; type checkers know this name.
TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = ["is_interrupt", "main"]


def main(argv: "Sequence[str] | None" = None) -> int:
    """Run the command line.

    Returns:
        The exit code: 0 done, 1 failed, 2 wrong usage, 130 ended by Ctrl-C, 143 by SIGTERM, 141
        when whoever read the output went away.
    """
    try:
        from rosglass.cli.program import run

        return run(argv)
    except BaseException as error:
        if isinstance(error, SystemExit) or not is_interrupt(error):
            raise
        import signal

        # Whatever still ends now can be cut short by pressing it again.
        signal.signal(signal.SIGINT, signal.SIG_DFL)
        return 130


def is_interrupt(error: "BaseException | None") -> bool:
    """Return whether Ctrl-C is behind an error: modules in C tell it as an ImportError."""
    while error is not None:
        if isinstance(error, KeyboardInterrupt):
            return True
        error = error.__cause__ or error.__context__
    return False
