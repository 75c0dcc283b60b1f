"""Under which address others reach this node.

Rules: ROS wiki, "ROS/EnvironmentVariables" and "ROS/NetworkSetup": ROS_HOSTNAME, else ROS_IP,
else found out.
"""

from __future__ import annotations

import re
import socket
from typing import TYPE_CHECKING

from rosglass.errors import ArgumentError

if TYPE_CHECKING:
    from collections.abc import Mapping

__all__ = ["bracketed", "check_host", "doubt", "given_address", "is_loopback", "own_address"]
__all__ += ["parse_uri"]

#: Outside of every network here: only the route there matters, nothing is sent.
_ELSEWHERE = "192.0.2.1"
_HOST = re.compile(r"[A-Za-z0-9]([A-Za-z0-9._-]*[A-Za-z0-9.])?\Z|[0-9A-Fa-f:.]*:[0-9A-Fa-f:.]*\Z")


def given_address(env: Mapping[str, str]) -> tuple[str, str]:
    """Return the host name or address that the environment says to announce, and which variable.

    Raises:
        ArgumentError: The variable's value is no host.
    """
    for variable in ("ROS_HOSTNAME", "ROS_IP"):
        if value := env.get(variable, "").strip():
            return check_host(value, variable), variable
    return "", ""


def check_host(value: str, what: str) -> str:
    """Return a host or address; raises ArgumentError, which names `what`, for anything else."""
    # One colon separates a port, more are an address of IPv6.
    if not _HOST.match(value) or value.count(":") == 1:
        raise ArgumentError(what, value, "a host or address only, without port")
    return value


def own_address(reached_from: str = "") -> str:
    """Return the address to announce when nobody has said which.

    Args:
        reached_from: This machine's address towards the master: the robot's network is the one
            that counts on machines with several. Not known before the master answers.
    """
    address = reached_from.removeprefix("::ffff:")
    if not address or is_loopback(address):
        address = _route_elsewhere()
    return address or "127.0.0.1"


def doubt(address: str, source: str, master: str) -> str:
    """Return why others may not reach this node under an address; empty for no reason.

    Args:
        address: What is announced.
        source: Who said so, such as ``ROS_IP``; empty when it was found out.
        master: The master's host.
    """
    shown = f"{source}={address}" if source else f"the own address {address}"
    if is_loopback(address):
        if is_loopback(master) or _is_own(master):
            return ""
        fix = f"set {source} right, or unset it" if source else "set ROS_IP"
        return f"{shown} is known to this machine only, and the master is at {master}: {fix}"
    if source and not _is_own(address):
        return (
            f"{shown} is no address of this machine: others may not reach this node, and its "
            "topics stay silent for them; set it right, or unset it"
        )
    return ""


def is_loopback(host: str) -> bool:
    """Return whether a host is this machine and cannot be reached from others."""
    return host in ("localhost", "::1") or host.startswith("127.")


def bracketed(host: str) -> str:
    """Return a host as URIs have it."""
    return f"[{host}]" if ":" in host else host


def parse_uri(uri: str, what: str) -> tuple[str, int]:
    """Return host and port of an XML-RPC or ``rosrpc://`` URI; raises ArgumentError.

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
        raise ArgumentError(what, uri, "scheme, host and port, as in http://robot:11311")
    return host, port


def _route_elsewhere() -> str:
    """Return the own address towards the rest of the world; empty if there is no way."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect((_ELSEWHERE, 9))
            address = str(probe.getsockname()[0])
        except OSError:
            return ""
    return "" if is_loopback(address) else address


def _is_own(host: str) -> bool:
    """Return whether a host is this machine; may wait for a name server."""
    try:
        found = socket.getaddrinfo(host, 0, type=socket.SOCK_DGRAM)
    except (OSError, UnicodeError):
        return False
    for family, kind, protocol, _, place in found:
        try:
            with socket.socket(family, kind, protocol) as probe:
                probe.bind(place)
                return True
        except OSError:  # noqa: PERF203 - each address may be another machine's
            continue
    return False
