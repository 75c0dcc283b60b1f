"""Under which address others reach this node.

Rules: ROS wiki, "ROS/EnvironmentVariables" and "ROS/NetworkSetup": ROS_HOSTNAME, else ROS_IP,
else found out.
"""

from __future__ import annotations

import socket
from typing import TYPE_CHECKING

from rosglass.errors import ConversionError

if TYPE_CHECKING:
    from collections.abc import Mapping

__all__ = ["is_loopback", "own_address", "parse_uri"]

#: Outside of every network here: only the route there matters, nothing is sent.
_ELSEWHERE = "192.0.2.1"


def own_address(env: Mapping[str, str], master: str) -> str:
    """Return the host name or address to announce.

    Args:
        env: ROS_HOSTNAME or ROS_IP in it decide.
        master: The master's host. Without these variables, the address from which it is reached is
            taken: the robot's network is the one that counts on machines with several.
    """
    for variable in ("ROS_HOSTNAME", "ROS_IP"):
        if value := env.get(variable, "").strip():
            if "://" in value or (":" in value.replace("::", "") and not value.count(":") > 1):
                raise ConversionError(variable, value, "a host or address only, without port")
            return value
    for host in (master, _ELSEWHERE):
        address = _route_to(host)
        if address and not is_loopback(address):
            return address
    return "127.0.0.1"


def is_loopback(host: str) -> bool:
    """Return whether a host is this machine and cannot be reached from others."""
    return host in ("localhost", "::1") or host.startswith("127.")


def parse_uri(uri: str, what: str) -> tuple[str, int]:
    """Return host and port of an XML-RPC or ``rosrpc://`` URI; raises ConversionError.

    Args:
        uri: Such as ``http://robot:11311/``.
        what: What it is, for the error.
    """
    from urllib.parse import urlsplit  # noqa: PLC0415 - takes a while to import

    try:
        parts = urlsplit(uri)
        host, port = parts.hostname, parts.port
    except ValueError:
        host = port = None
    if not host or not port:
        raise ConversionError(what, uri, "scheme, host and port, as in http://robot:11311")
    return host, port


def _route_to(host: str) -> str:
    """Return the own address from which `host` is reached; empty if there is no way."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect((host, 9))
            return str(probe.getsockname()[0])
        except OSError:
            return ""
