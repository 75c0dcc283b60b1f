"""The addresses of machines that are named as peers.

Cyclone DDS ends the whole process when it is given a name that nobody knows, so it is given none.
"""

from __future__ import annotations

import socket
import threading
import time
from typing import TYPE_CHECKING

from rosglass.errors import ConnectionLostError

if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = ["addresses"]

#: Seconds that looking up the names may take together.
_PATIENCE = 3.0


def addresses(peers: Sequence[str]) -> list[str]:
    """Return the IPv4 addresses of peers, each with its ``:port`` when it was given one.

    Raises:
        ConnectionLostError: A name is unknown, or nobody answers for it within 3 s.
    """
    found: dict[str, str] = {}
    problems: dict[str, str] = {}

    def look(peer: str) -> None:
        host, colon, port = peer.partition(":")
        try:
            infos = socket.getaddrinfo(host, None, socket.AF_INET, socket.SOCK_DGRAM)
        except (OSError, UnicodeError) as error:
            problems[peer] = str(getattr(error, "strerror", None) or error)
        else:
            found[peer] = f"{infos[0][4][0]}{colon}{port}"

    threads = [threading.Thread(target=look, args=(peer,), daemon=True) for peer in peers]
    until = time.monotonic() + _PATIENCE
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(max(0.0, until - time.monotonic()))
    for peer in peers:
        if peer not in found:
            reason = problems.get(peer, f"no answer within {_PATIENCE:.0f} s")
            raise ConnectionLostError(
                f"cannot find the address of peer {peer!r} ({reason}): write its IPv4 address, or "
                "mend the name"
            )
    return [found[peer] for peer in peers]
