"""The ``rosglass`` command: a module per command, imported once the command line is parsed."""

# Nothing that takes time is imported before main() can handle Ctrl-C.
from rosglass.interrupts import end_at_once, is_interrupt

# Type checkers accept this name.
TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = ["main"]


def main(argv: "Sequence[str] | None" = None) -> int:
    """Run the command line.

    Returns:
        The exit code: 0 done, 1 failed, 2 wrong usage, 130 ended by Ctrl-C, 143 by SIGTERM, 141 if
        the reader of the output has exited. Ctrl-C while a command is still being loaded ends the
        process at once.
    """
    try:
        import signal  # noqa: PLC0415

        # Modules in C swallow the KeyboardInterrupt that is raised in them, or abort the process.
        # `run` restores it for commands that do not load Qt.
        replaced = signal.getsignal(signal.SIGINT) is signal.default_int_handler
        try:
            if replaced:
                signal.signal(signal.SIGINT, end_at_once)
        except ValueError:  # only the main thread may
            replaced = False
        try:
            from rosglass.cli.program import run  # noqa: PLC0415 - after Ctrl-C is handled

            return run(argv)
        finally:
            if replaced:
                signal.signal(signal.SIGINT, signal.default_int_handler)
    except BaseException as error:  # Ctrl-C may be the cause of any
        if isinstance(error, SystemExit) or not is_interrupt(error):
            raise
        import signal  # noqa: PLC0415

        # Pressing it again cuts short whatever still has to end.
        signal.signal(signal.SIGINT, signal.SIG_DFL)
        return 130
