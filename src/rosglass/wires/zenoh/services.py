"""What both ends of a service over Zenoh share: requests are queries, servers are queryables.

Keys and attachments are rmw_zenoh's (its ``docs/design.md`` and released behaviour).
"""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING

from rosglass.wires.zenoh.keys import HUMBLE_HASH, topic_key

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from rosglass.comm import EndpointInfo
    from rosglass.wires.zenoh.options import ZenohOptions

__all__ = ["Service", "send"]

#: Bytes above which a payload is sent by a thread of its own: it may have to wait for the link.
_BIG = 32_000


class Service:
    """A service, as one of its ends knows it.

    Args:
        options: Of the session.
        endpoint: The end.

    Attributes:
        place: Name and type.
        keys: Its keys by the name of the type's definition, the preferred one first. Humble names
            no definition; the same is meant.
    """

    def __init__(self, options: ZenohOptions, endpoint: EndpointInfo) -> None:
        self.name, self.type, self.hash = endpoint.name, endpoint.type, endpoint.type_hash
        self.place = self.name, self.type
        names = [self.hash or HUMBLE_HASH, HUMBLE_HASH]
        if options.humble:
            names.reverse()
        self.keys = {known: topic_key(options.domain, *self.place, known) for known in names}

    def problem(self, endpoints: Sequence[EndpointInfo], effect: str) -> str:
        """Say which endpoints mean something else by this name, and to what effect."""
        problems: dict[str, None] = {}
        for endpoint in endpoints:
            if endpoint.type != self.type:
                told = f"{endpoint.node} has {endpoint.type} here, not {self.type}: {effect}"
                problems[told] = None
            elif (endpoint.type_hash or HUMBLE_HASH) not in self.keys:
                told = (
                    f"{endpoint.node} has another definition of {self.type} "
                    f"({endpoint.type_hash}, ours is {self.hash}): {effect}; add the robot's "
                    "definition to the library"
                )
                problems[told] = None
        return "; ".join(problems)


def send(job: Callable[[], None], size: int, name: str) -> None:
    """Send at once, or in a thread what is so big that it may have to wait for the link.

    Args:
        job: Sends.
        size: Bytes to be sent.
        name: The thread's name.
    """
    if size > _BIG:
        threading.Thread(target=job, name=name, daemon=True).start()
    else:
        job()
