"""Warnings on the terminal, of programs that have not said where they log to."""

from __future__ import annotations

import logging
import sys

from rosglass.errors import escape_controls

__all__ = ["warn_on_terminal"]


class _TerminalHandler(logging.Handler):
    """Does what `logging.lastResort` does, which says nothing once there is any handler.

    There always is: what is logged goes to /rosout as well.
    """

    def __init__(self) -> None:
        super().__init__(logging.WARNING)
        self.setFormatter(logging.Formatter("%(levelname)s %(name)s: %(message)s"))

    def emit(self, record: logging.LogRecord) -> None:
        """Write a record to stderr, unless the program has made its own arrangements."""
        own = logging.getLogger("rosglass").handlers
        if logging.lastResort is None or logging.getLogger().handlers:
            return
        if any(isinstance(handler, logging.StreamHandler) for handler in own):
            return
        try:
            sys.stderr.write(f"{escape_controls(self.format(record))}\n")
        except Exception:
            self.handleError(record)


_handler = _TerminalHandler()


def warn_on_terminal(formatter: logging.Formatter | None = None) -> None:
    """Have warnings of the library be seen where `logging` has not been configured.

    Args:
        formatter: How they look; as before, or with level and logger, by default.
    """
    if formatter is not None:
        _handler.setFormatter(formatter)
    logging.getLogger("rosglass").addHandler(_handler)
