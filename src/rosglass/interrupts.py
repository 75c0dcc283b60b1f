"""Ctrl-C while modules in C are imported, which swallow it or abort the process."""

from __future__ import annotations

# Built in: importing `signal` takes milliseconds, in which Ctrl-C would be lost.
import _signal as signal  # type: ignore[import-not-found]
import sys

# For the same reason; type checkers know this name.
TYPE_CHECKING = False
if TYPE_CHECKING:
    from types import FrameType, TracebackType

__all__ = ["InterruptsDeferred", "end_at_once", "is_interrupt"]


class InterruptsDeferred:
    """Context manager that defers Ctrl-C to its end, and then exits the program; for imports.

    Works in the main thread of programs that have Python's own handler, which is restored
    afterwards. A second Ctrl-C is raised at once.

    Raises:
        SystemExit: Ctrl-C was pressed (code 130); KeyboardInterrupt in an interactive session.
    """

    def __init__(self) -> None:
        self._received = False

    def __enter__(self) -> None:
        if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
            try:
                signal.signal(signal.SIGINT, self._on_interrupt)
            except ValueError:
                # Not the main thread: signals raise nothing here.
                return

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if signal.getsignal(signal.SIGINT) == self._on_interrupt:
            signal.signal(signal.SIGINT, signal.default_int_handler)
        if self._received:
            raise KeyboardInterrupt if hasattr(sys, "ps1") else SystemExit(130)

    def _on_interrupt(self, number: int, frame: FrameType | None) -> None:
        if self._received:
            signal.default_int_handler(number, frame)
        self._received = True


def end_at_once(*_: object) -> None:
    """End the process as by Ctrl-C; a signal handler."""
    import os  # noqa: PLC0415

    os._exit(130)


def is_interrupt(error: BaseException | None) -> bool:
    """Return whether Ctrl-C caused an error: C extensions report it as an ImportError."""
    while error is not None:
        if isinstance(error, KeyboardInterrupt):
            return True
        error = error.__cause__ or error.__context__
    return False
