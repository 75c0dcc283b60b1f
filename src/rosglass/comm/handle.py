"""Base classes for handles and executors, guards of code that may fail, checks of arguments."""

from __future__ import annotations

import sys
import threading
from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, NoReturn, TypeVar

from rosglass.errors import ArgumentError, UnsupportedError

if TYPE_CHECKING:
    import logging
    from collections.abc import Callable
    from types import FrameType, TracebackType

__all__ = [
    "Executor",
    "Handle",
    "Unique",
    "check_flag",
    "check_may_wait",
    "guarded",
    "reraise_exit",
    "undo_on_error",
]

_H = TypeVar("_H", bound="Handle")
#: Modules that start the receiving threads.
_RECEIVING = ("rosglass.wires.dds.", "rosglass.wires.zenoh.", "rosglass.wires.tcpros.io_loop")
#: Modules that start the threads that follow the graph and run timers.
_FOLLOWING = ("rosglass.comm.timers",)


class Unique:
    """Base of objects that cannot be copied, as a copy would share threads and sockets."""

    def __reduce_ex__(self, _: object) -> NoReturn:
        # Called by copy.copy, copy.deepcopy and pickle.
        raise UnsupportedError(
            f"{self!r} can neither be copied nor pickled: it lives in this process, and exists "
            "once; hand on the object itself, or create another one"
        )


class Executor(ABC):
    """Runs callbacks: on a thread, in an event loop, or at once in the wire's thread."""

    @abstractmethod
    def post(self, job: Callable[[], None]) -> None:
        """Run `job` soon; called from any thread, returns without waiting."""


class Handle(Unique, ABC):
    """Something that was started or registered; closed explicitly or as a context manager."""

    @abstractmethod
    def close(self) -> None:
        """Close it; safe to call twice."""

    def __enter__(self: _H) -> _H:  # noqa: PYI019 - typing.Self needs 3.11
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()


class guarded:  # noqa: N801 - it reads as a statement, and a generator costs a call 1 us
    """Log any error of the body, and go on after it.

    For bodies that others must not be lost with: a callback of the user's, one of many members,
    samples or jobs, on a thread that must not end. Errors that end the program, SystemExit and
    KeyboardInterrupt, are raised in the main thread.

    It has no state: what runs for each sample makes one, and enters it every time.

    Args:
        log: The logger to write to.
        text: What has failed, as for :meth:`logging.Logger.exception`.
        args: Its arguments.
    """

    __slots__ = ("_args", "_log", "_text")

    def __init__(self, log: logging.Logger, text: str, *args: object) -> None:
        self._log, self._text, self._args = log, text, args

    def __enter__(self) -> None:
        pass

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> bool | None:
        if error is None:
            return None
        reraise_exit(error)  # sys.exit() must not end a thread that others need
        self._log.error(self._text, *self._args, exc_info=error)
        return True


class undo_on_error:  # noqa: N801 - as above
    """Call `undo` if the body raises anything, Ctrl-C included, and raise that again."""

    __slots__ = ("_undo",)

    def __init__(self, undo: Callable[[], object]) -> None:
        self._undo = undo

    def __enter__(self) -> None:
        pass

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> None:
        if error is not None:
            self._undo()


def reraise_exit(error: BaseException) -> None:
    """Raise an error that ends the program in the main thread; it must not end other threads."""
    if not isinstance(error, Exception) and threading.current_thread() is threading.main_thread():
        raise error


def check_flag(value: object, name: str, where: str = "") -> bool:
    """Return a boolean option; raises ArgumentError.

    Any nonempty string is true in Python, including "no" and "false".
    """
    if value is not True and value is not False:
        raise ArgumentError(name, value, "True or False", where)
    return value


def check_may_wait(name: str, *, following: bool = False) -> None:
    """Raise UnsupportedError if the calling thread receives, and so must not wait.

    Args:
        name: The service, action or topic that the caller is about to wait for.
        following: Whether threads that follow the graph and run timers may wait.
    """
    # Recognized by the stack: Zenoh's threads are not Python's, and marking them would add a cost
    # per sample.
    frame: FrameType | None = sys._getframe()
    first = ""
    while frame is not None:
        module = frame.f_globals.get("__name__", "")
        first = first if module == "threading" else module
        frame = frame.f_back
    if first.startswith(_RECEIVING if following else (*_RECEIVING, *_FOLLOWING)):
        raise UnsupportedError(
            f"{name}: this callback runs in a thread that receives (executor=IMMEDIATE, or "
            "add_done_callback()), where what it waits for could never arrive; take call_async(), "
            "get_async() or the like here, or let it run elsewhere: on_done(), or another executor"
        )
