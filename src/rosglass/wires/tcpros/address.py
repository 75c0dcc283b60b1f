"""The address under which other nodes reach this one, and the URIs of nodes.

Rules: ROS wiki, "ROS/EnvironmentVariables" and "ROS/NetworkSetup": ROS_HOSTNAME, else ROS_IP,
else the address of the route to the master.
"""

from __future__ import annotations

import ipaddress
import re
import socket
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

from rosglass.errors import ArgumentError

if TYPE_CHECKING:
    from collections.abc import Mapping

__all__ = [
    "bracketed",
    "check_host",
    "explain_unreachable",
    "given_address",
    "interface_of",
    "is_loopback",
    "own_address",
]
__all__ += ["parse_uri"]

#: Reserved for documentation (RFC 5737): only the route there matters, nothing is sent.
_REMOTE_ADDRESS = "192.0.2.1"
_HOST = re.compile(r"[A-Za-z0-9]([A-Za-z0-9._-]*[A-Za-z0-9.])?\Z|[0-9A-Fa-f:.]*:[0-9A-Fa-f:.]*\Z")


def given_address(env: Mapping[str, str]) -> tuple[str, str]:
    """Return the host or address to announce by the environment, and the variable's name.

    Raises:
        ArgumentError: The variable's value is not a host.
    """
    for variable in ("ROS_HOSTNAME", "ROS_IP"):
        if value := env.get(variable, "").strip():
            return check_host(value, variable), variable
    return "", ""


def check_host(value: str, what: str) -> str:
    """Return `value`; raises ArgumentError, which names `what`, unless it is a host or address."""
    # One colon separates a port, several are part of an IPv6 address.
    if not _HOST.match(value) or value.count(":") == 1:
        raise ArgumentError(what, value, "a host or address only, without port")
    return value


def own_address(reached_from: str = "") -> str:
    """Return the address to announce when the user gives none.

    Args:
        reached_from: This machine's address towards the master, which is on the robot's network;
            empty before the master answers.
    """
    address = reached_from.removeprefix("::ffff:")
    if not address or is_loopback(address):
        address = _route_elsewhere()
    return address or "127.0.0.1"


def explain_unreachable(address: str, source: str, master: str) -> str:
    """Return why other nodes may not reach this one under an address; empty if they can.

    Args:
        address: The announced address.
        source: Where it was given, such as ``ROS_IP``; empty when it was detected.
        master: The master's host.
    """
    shown = f"{source}={address}" if source else f"the own address {address}"
    if is_loopback(address):
        if is_loopback(master) or _is_own(master):
            return ""
        fix = f"correct {source}, or unset it" if source else "set ROS_IP"
        return f"{shown} reaches this machine only, and the master is at {master}: {fix}"
    if source and not _is_own(address):
        return (
            f"{shown} is not an address of this machine: other nodes may not reach this one, and "
            "receive nothing from it; correct or unset it"
        )
    return ""


def is_loopback(host: str) -> bool:
    """Return whether a host is the loopback interface, which other machines cannot reach."""
    return host in ("localhost", "::1") or host.startswith("127.")


def interface_of(host: str) -> str:
    """Return the address to listen on for connections to an announced host.

    Loopback only, if that is announced, and one address of this machine only, if it is; else all
    interfaces: other machines may know a name, or an address outside a container, as another one.
    """
    if host == "localhost":
        return "127.0.0.1"
    six = ":" in host
    every = "::" if six else "0.0.0.0"
    try:
        # Not a name: other machines may resolve it to another address.
        with socket.socket(socket.AF_INET6 if six else socket.AF_INET, socket.SOCK_DGRAM) as probe:
            probe.bind((str(ipaddress.ip_address(host)), 0))
    except (OSError, ValueError):
        return every
    return host


def bracketed(host: str) -> str:
    """Return a host as it is written in URIs, IPv6 addresses in brackets."""
    return f"[{host}]" if ":" in host else host


def parse_uri(uri: str, what: str) -> tuple[str, int]:
    """Return host and port of an XML-RPC or ``rosrpc://`` URI; raises ArgumentError.

    Args:
        uri: Such as ``http://robot:11311/``.
        what: The owner of the URI, for the error.
    """
    try:
        parts = urlsplit(uri)
        host, port = parts.hostname, parts.port
    except ValueError:
        host = port = None
    if not host or not port:
        raise ArgumentError(what, uri, "scheme, host and port, as in http://robot:11311")
    return host, port


def _route_elsewhere() -> str:
    """Return this machine's address on its default route; empty if it has none."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect((_REMOTE_ADDRESS, 9))
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
