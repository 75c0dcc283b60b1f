"""Log messages on the terminal, of programs that have not said where they log to."""

from __future__ import annotations

import logging
import sys

from rosglass.errors import escape_controls

__all__ = ["show_on_terminal", "warn_on_terminal"]


class _TerminalHandler(logging.Handler):
    """Does what `logging.lastResort` does, which says nothing once there is any handler.

    There always is: what is logged goes to /rosout as well.

    Args:
        logger: The logger that it is for.
        level: Least severe level that it shows.
    """

    def __init__(self, logger: logging.Logger, level: int) -> None:
        super().__init__(level)
        self._logger = logger
        self.setFormatter(logging.Formatter("%(levelname)s %(name)s: %(message)s"))

    def emit(self, record: logging.LogRecord) -> None:
        """Write a record to stderr, unless the program has made its own arrangements."""
        if logging.lastResort is None or logging.getLogger().handlers:
            return
        if any(isinstance(handler, logging.StreamHandler) for handler in self._logger.handlers):
            return
        try:
            sys.stderr.write(f"{escape_controls(self.format(record))}\n")
        except Exception:
            self.handleError(record)


_handler = _TerminalHandler(logging.getLogger("rosglass"), logging.WARNING)


def show_on_terminal(logger: logging.Logger) -> None:
    """Show what a node's logger logs, as ROS does, where `logging` has not been configured."""
    logger.addHandler(_TerminalHandler(logger, logging.NOTSET))


def warn_on_terminal(formatter: logging.Formatter | None = None) -> None:
    """Have warnings of the library be seen where `logging` has not been configured.

    Args:
        formatter: How they look; as before, or with level and logger, by default.
    """
    if formatter is not None:
        _handler.setFormatter(formatter)
    logging.getLogger("rosglass").addHandler(_handler)
