"""Ctrl-C and SIGTERM while Qt's event loop runs."""

from __future__ import annotations

import os
import signal
import sys
import threading
from contextlib import suppress
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable
    from types import TracebackType

__all__ = ["QuitOnSignal", "end_process_within"]

#: Seconds that the program has to end in good order.
_PATIENCE = 4.0
#: The signals that end a program, with Python's own handlers.
_DEFAULTS: dict[int, Any] = {
    signal.SIGINT: signal.default_int_handler,
    signal.SIGTERM: signal.SIG_DFL,
}


def end_process_within(seconds: float, code: int) -> None:
    """End the process after some time with an exit code, unless it has ended by then."""

    def end() -> None:
        try:
            # Not time.sleep(), which fails where a clock is set under it (libfaketime).
            threading.Event().wait(seconds)
        finally:
            os._exit(code)

    threading.Thread(target=end, name="end", daemon=True).start()


class QuitOnSignal:
    """Calls `quit` when the process is told to end, and ends it itself when that does not help.

    Python runs its signal handlers only between two instructions of Python; an event loop in C++,
    or QML that hangs, would put that off for ever. A thread is told at once.

    Args:
        quit: Called in that thread with the signal's number.
        patience: Seconds that the program has to end in good order.
        keep_handlers: Leave signals alone that the program ignores or has a handler of its own for.
    """

    def __init__(
        self,
        quit: Callable[[int], None],
        patience: float = _PATIENCE,
        *,
        keep_handlers: bool = False,
    ) -> None:
        self._quit, self._patience = quit, patience
        self._signals = [n for n in _DEFAULTS if not (keep_handlers and _is_programs_own(n))]
        self._reader, self._writer = os.pipe()
        self._ended = threading.Event()
        self._before: dict[int, Any] = {}
        self._wakeup = -1
        self._thread = threading.Thread(target=self._watch, name="signals", daemon=True)

    def __enter__(self) -> QuitOnSignal:
        if sys.platform != "win32":
            os.set_blocking(self._writer, False)
        self._wakeup = signal.set_wakeup_fd(self._writer, warn_on_full_buffer=False)
        for number in self._signals:
            self._before[number] = signal.signal(number, _note)
        self._thread.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._ended.set()
        for number, handler in self._before.items():
            # One that was installed from C cannot be put back from Python.
            signal.signal(number, _DEFAULTS[number] if handler is None else handler)
        signal.set_wakeup_fd(self._wakeup)
        os.close(self._writer)
        # What `quit` refers to must not outlive this in a thread.
        self._thread.join()

    def _watch(self) -> None:
        ending = {int(number) for number in self._signals}
        while received := os.read(self._reader, 1):
            if received[0] not in ending:
                # As asyncio's, which learns of its signals by it.
                with suppress(OSError):
                    os.write(self._wakeup, received)
            else:
                self._quit(received[0])
                if not self._ended.wait(self._patience):
                    sys.stderr.write("rosglass: the interface does not react; ending it\n")
                    sys.stderr.flush()
                    os._exit(128 + received[0])
        os.close(self._reader)


def _note(*_: object) -> None:
    """Take a signal that :class:`QuitOnSignal` answers in its thread."""


def _is_programs_own(number: int) -> bool:
    """Return whether a signal's handler is neither Python's own nor one of this package."""
    handler = signal.getsignal(number)
    if handler in (signal.SIG_DFL, _DEFAULTS[number]):
        return False
    return str(getattr(handler, "__module__", "")).partition(".")[0] != "rosglass"
