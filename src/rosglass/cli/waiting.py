"""Reports why no messages are received."""

from __future__ import annotations

import logging
import time
from typing import TYPE_CHECKING

from rosglass.cli.output import note, require_reader
from rosglass.cli.worlds import spelled
from rosglass.comm import ConnectionState
from rosglass.comm.names import similar

if TYPE_CHECKING:
    import argparse

    from rosglass.comm import Node, Subscription

__all__ = ["Reasons"]

#: Seconds without messages that are not reported.
_QUIET_S = 2.0
#: How many times the usual pause between messages counts as silence.
_PAUSES = 5


class Reasons:
    """Prints why no messages, or no more messages, are received; each reason once.

    Args:
        node: The subscribing node.
        subscription: The subscription; closed at the end.
        args: The command's options.
    """

    def __init__(self, node: Node, subscription: Subscription, args: argparse.Namespace) -> None:
        self._node, self._subscription = node, subscription
        self._command = f"rosglass topic {args.what} {args.topic}"
        self._began = self._received_at = time.monotonic()
        self._received = 0
        self._pause = 0.0
        self._printed = ""
        self._log = logging.getLogger("rosglass.comm")
        self._quiet = not args.verbose

    def __enter__(self) -> Reasons:
        self._log.addFilter(self._passes)
        return self

    def __exit__(self, *_: object) -> None:
        self._subscription.close()
        self._log.removeFilter(self._passes)

    def on_count(self, count: int) -> None:
        """Update the number of messages received so far."""
        if count == self._received:
            return
        now = time.monotonic()
        self._pause = (now - self._began) / count
        self._received, self._received_at, self._printed = count, now, ""

    def report(self, *, last: bool = False) -> str:
        """Print the reason if it is new, and return it; empty if there is none.

        Args:
            last: Whether this is the last report, before the command ends.

        Raises:
            BrokenPipeError: The reader of the output has exited.
        """
        require_reader()
        silent = time.monotonic() - self._received_at
        if silent < _QUIET_S and not last:
            return ""
        reason = self._reason(silent)
        if reason and reason != self._printed:
            self._printed = reason
            # Conflicting definitions take pages.
            shown = reason.partition("\n")[0].rstrip() if self._quiet else reason
            note(f"{self._subscription.topic}: {spelled(self._node, shown)}")
        return reason

    def _reason(self, silent: float) -> str:
        found = self._subscription
        status = self._node.status()
        if status.state is not ConnectionState.CONNECTED and not self._node.url.startswith("dds:"):
            return status.detail
        publishers = self._node.publishers(found.topic)
        types = sorted({end.type for end in publishers})
        if len(types) > 1 and found.type is None:
            return f"published with several types, say which: {self._command} {types[0]}"
        if not publishers:
            if self._received:
                return "it has no publisher any more"
            return f"it has no publisher{self._guess()}"
        if found.problem or found.hint:
            return found.problem or found.hint
        if not self._received:
            return "published, but nothing has been received yet"
        if self._received > 1 and silent > max(_QUIET_S, _PAUSES * self._pause):
            return "no more messages, although it is still advertised"
        return ""

    def _guess(self) -> str:
        known = [name for name in self._node.topics() if self._node.publishers(name)]
        return similar(self._subscription.topic, known)

    def _passes(self, record: logging.LogRecord) -> bool:
        """Drop log messages that this class prints."""
        ours = record.getMessage().startswith(f"{self._subscription.topic}: ")
        return not (ours and self._quiet and record.levelno == logging.WARNING)
