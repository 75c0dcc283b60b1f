"""Ctrl-C while Qt's binding is at work, which swallows KeyboardInterrupt or aborts the process."""

from __future__ import annotations

import _thread
import enum
import signal
import threading
import time
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from types import FrameType

__all__ = ["defer_interrupts"]

#: Seconds after which Ctrl-C is looked at again, and for which it is put off at most.
_RETRY_S, _LONGEST_S = 0.02, 3.0
#: Parts of file names of Python code that C code calls which cannot take an exception: the import
#: system with the bindings' hook in it, and the enums that the bindings make when they are used.
_UNSAFE = ("<frozen importlib", "shibokensupport", "shiboken2", "shiboken6", enum.__file__)


def defer_interrupts() -> None:
    """Have Python raise KeyboardInterrupt only where Qt's binding does not lose it.

    Only in programs that have no handler of their own; in the main thread.
    """
    in_main_thread = threading.current_thread() is threading.main_thread()
    if in_main_thread and signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, _Deferred().on_interrupt)


class _Deferred:
    def __init__(self) -> None:
        #: When the one that is put off came, seconds of the monotonic clock.
        self._since: float | None = None

    def on_interrupt(self, number: int, frame: FrameType | None) -> None:
        now = time.monotonic()
        since = now if self._since is None else self._since
        if _is_unsafe(frame) and now - since < _LONGEST_S:
            self._since = since
            again = threading.Timer(_RETRY_S, _thread.interrupt_main)
            again.daemon = True
            again.start()
            return
        self._since = None
        signal.default_int_handler(number, frame)


def _is_unsafe(frame: FrameType | None) -> bool:
    while frame is not None:
        if any(part in frame.f_code.co_filename for part in _UNSAFE):
            return True
        frame = frame.f_back
    return False
