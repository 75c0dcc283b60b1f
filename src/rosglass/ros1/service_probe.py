"""Finding a service's server, and asking it what it offers, without calling it.

Protocol: ROS wiki, "ROS/Master_API" (lookupService) and "ROS/TCPROS" (``probe=1``): only the server
knows its service's type.
"""

from __future__ import annotations

import socket
from dataclasses import dataclass
from typing import TYPE_CHECKING

from rosglass.errors import ConnectionLostError, ConversionError, InvalidNameError, MasterError
from rosglass.interfaces import join_name
from rosglass.ros1.address import parse_uri
from rosglass.ros1.connection import Connection
from rosglass.ros1.master import reason_of
from rosglass.ros1.types import ANY

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from rosglass.ros1.core import Core
    from rosglass.ros1.master import Master

__all__ = ["Peer", "Place", "locate", "probe"]


@dataclass(frozen=True)
class Place:
    """Where a service's server is.

    Attributes:
        uri: As the master has it, ``rosrpc://host:port``.
        address: Resolved address and port.
    """

    uri: str
    address: tuple[str, int]


@dataclass(frozen=True)
class Peer:
    """What a service's server says of itself.

    Attributes:
        node: Its node's full name; its address where it does not tell.
        type: The service type, ``pkg/srv/Type``; empty when it does not tell.
        md5: The type's md5 sum, ``*`` for any.
    """

    node: str
    type: str
    md5: str

    @classmethod
    def of(cls, header: Mapping[str, str], place: Place) -> Peer:
        """Return what a connection header says.

        Raises:
            ConnectionLostError: It lacks the md5 sum, which every server tells.
        """
        node = header.get("callerid", "") or place.uri
        if "md5sum" not in header:
            raise ConnectionLostError(
                f"{node} answers, but not as a service does: its connection header has no md5sum"
            )
        name = header.get("type", ANY)
        try:
            full = "" if name == ANY else join_name(name, "srv")
        except InvalidNameError:
            full = name
        return cls(node, full, header["md5sum"])


def locate(master: Master, name: str) -> Place | None:
    """Ask the master where a service is; None when nobody offers it. Waits for the answer.

    Raises:
        ConnectionLostError: The master does not answer, or names a host that is not known here.
    """
    try:
        uri = str(master.call("lookupService", name))
    except MasterError:
        return None
    try:
        host, port = parse_uri(uri, f"the master's answer for {name}")
    except ConversionError as error:
        raise ConnectionLostError(str(error)) from error
    try:
        found = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)
    except (OSError, UnicodeError) as error:
        raise ConnectionLostError(
            f"{name} is at {uri}, but {reason_of(error)}: set ROS_IP or ROS_HOSTNAME for the node "
            "that offers it to what this machine knows, or add the name to /etc/hosts"
        ) from error
    return Place(uri, (str(found[0][4][0]), int(found[0][4][1])))


def probe(core: Core, name: str, place: Place, done: Callable[[Peer | None, str], None]) -> None:
    """Ask a server for its type; in the loop's thread.

    Args:
        core: The asking node.
        name: Absolute name of the service.
        place: Where its server is.
        done: Called once in the loop's thread: with what the server says, or None and why not.

    Raises:
        OSError: There can be no more sockets.
    """
    header = {"callerid": core.name.full, "md5sum": ANY, "probe": "1", "service": name}
    answered = False

    def finish(peer: Peer | None, reason: str) -> None:
        nonlocal answered
        if not answered:
            answered = True
            done(peer, reason)

    def on_header(fields: dict[str, str]) -> None:
        try:
            finish(Peer.of(fields, place), "")
        except ConnectionLostError as error:
            finish(None, str(error))
        link.end("")

    link = Connection.dial(
        core.loop,
        place.address,
        header,
        on_header,
        lambda _data, _lead: None,  # it was not called
        lambda reason: finish(None, reason),
        lead=1,
    )
