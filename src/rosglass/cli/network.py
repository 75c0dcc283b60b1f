"""Checks of this machine's network, and of the addresses of routers and masters."""

from __future__ import annotations

import os
import socket
import struct
import sys
from contextlib import suppress
from importlib.util import find_spec
from typing import TYPE_CHECKING, NamedTuple
from urllib.parse import urlsplit

from rosglass.connection import default_url
from rosglass.errors import Error
from rosglass.wires.tcpros import address
from rosglass.wires.zenoh.options import ZenohOptions

if sys.platform == "linux":
    import fcntl

if TYPE_CHECKING:
    from rosglass.ros1.options import Ros1Options

__all__ = [
    "Interface",
    "interfaces",
    "is_loopback",
    "nearby_url",
    "refused",
    "ros1_options",
    "ros1_url",
    "router_problem",
    "start_master",
]

#: Seconds to wait for a refused connection.
_CONNECT_TIMEOUT_S = 1.0
#: The request for an interface's flags, and some of these (Linux, netdevice(7)).
_GET_FLAGS = 0x8913
_UP, _LOOPBACK, _MULTICAST = 0x1, 0x8, 0x1000
_PORT = 7447


class Interface(NamedTuple):
    """A network interface that is up."""

    name: str
    is_loopback: bool
    has_multicast: bool


def interfaces() -> list[Interface] | None:
    """Return the network interfaces that are up; None if that is unknown (not on Linux)."""
    if sys.platform != "linux":
        return None
    found = []
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        for _, name in socket.if_nameindex():
            request = struct.pack("16sH14x", name.encode()[:15], 0)
            try:
                answer = fcntl.ioctl(probe, _GET_FLAGS, request)
            except OSError:  # it has just disappeared
                continue
            flags = struct.unpack("16sH14x", answer)[1]
            if flags & _UP:
                found.append(Interface(name, bool(flags & _LOOPBACK), bool(flags & _MULTICAST)))
    return found


def is_loopback(url: str) -> bool:
    """Return whether a URL names this machine, or no host."""
    host = urlsplit(url).hostname or ""
    return not host or address.is_loopback(host)


def nearby_url() -> str:
    """Return the URL of a Zenoh router or ROS 1 master on this machine; empty for none.

    For commands without a setting for the robot's URL; also empty if there is one.
    """
    with suppress(Error):  # no URL is set, or an unknown middleware is
        default_url(os.environ)
        return ""
    if os.environ.get("RMW_IMPLEMENTATION"):  # an unknown one
        return ""
    for port, url in ((_PORT, "zenoh://127.0.0.1:7447"), (11311, "ros1://127.0.0.1:11311")):
        if url.startswith("zenoh:") and find_spec("zenoh") is None:
            continue
        with suppress(OSError):  # nothing listens there
            socket.create_connection(("127.0.0.1", port), _CONNECT_TIMEOUT_S).close()
            return url
    return ""


def ros1_options(url: str) -> Ros1Options:
    """Return the options of a ``ros1://`` URL; raises ArgumentError."""
    from rosglass.ros1.options import Ros1Options  # noqa: PLC0415 - loads all of ROS 1

    return Ros1Options.parse(url)


def ros1_url() -> str:
    """Return the URL of the ROS 1 master that the environment selects; empty for none."""
    url = ""
    with suppress(Error):  # connecting to it reports what is wrong
        if default_url(os.environ) == "ros1://":
            url = "ros1://"
            url += ros1_options(url).master.removeprefix("http://")
    return url


def start_master(host: str, port: int) -> str:
    """Return how to start a ROS 1 master that does not run."""
    start = "start it: roscore" + ("" if port == 11311 else f" -p {port}")
    return start if address.is_loopback(host) else f"on {host}, {start}; or correct the address"


def refused(url: str) -> tuple[str, str] | None:
    """Return the problem and its fix if nothing listens at a URL, or a router refuses; else None.

    None as well without any answer: that takes longer to distinguish from a slow network.
    """
    if url.startswith("zenoh:"):
        refusal = _refusal(url, _CONNECT_TIMEOUT_S)
        if refusal is not None:
            return refusal
    if url.startswith("ros1:"):
        host, port = address.parse_uri(ros1_options(url).master, "master")
    elif url.startswith("zenoh:") and (
        urlsplit(url).hostname or not os.environ.get("ZENOH_SESSION_CONFIG_URI")
    ):
        host, port = urlsplit(url).hostname or "127.0.0.1", urlsplit(url).port or _PORT
    else:
        return None
    try:
        socket.create_connection((host, port), _CONNECT_TIMEOUT_S).close()
    except ConnectionRefusedError:
        pass
    except OSError:
        return None
    else:
        return None
    if url.startswith("zenoh:"):
        return router_problem(url, _CONNECT_TIMEOUT_S)
    text = f"no master runs: {host} is there, but nothing listens on its port {port}"
    return text, start_master(host, port)


def _refusal(url: str, timeout: float) -> tuple[str, str] | None:
    """Return why the router of a ``zenoh://`` URL refuses sessions, and the fix; None otherwise."""
    # An extra that the node has loaded.
    from rosglass.wires.zenoh.refusal import find_refusal  # noqa: PLC0415

    return find_refusal(ZenohOptions.parse(url, os.environ), timeout)


def router_problem(url: str, timeout: float) -> tuple[str, str]:
    """Connect to the port of a ``zenoh://`` URL; return the problem and its fix.

    For a URL where Zenoh got no answer.
    """
    parts = urlsplit(url)
    host, port = parts.hostname or "127.0.0.1", parts.port or _PORT
    here = is_loopback(url)
    command = "rosglass router" if here else "rosglass router --open"
    if port != _PORT:
        command = f"rosglass router --listen tcp/{'127.0.0.1' if here else '[::]'}:{port}"
    where = "" if here else f" on {host}"
    start = f"start a router{where}: ros2 run rmw_zenoh_cpp rmw_zenohd, or {command}"
    try:
        with socket.create_connection((host, port), timeout):
            text = f"something listens at {host}:{port}, but does not answer as a Zenoh router does"
            return text, f"look what it is (sudo ss -ltnp), and {start}"
    except ConnectionRefusedError:
        text = f"{host} is there, but nothing listens on its port {port}"
        return text, f"{start}, or correct the port"
    except socket.gaierror:
        text = f"no computer is called {host}"
        return text, f"correct the name, or use the address, as in zenoh://192.168.1.5:{port}"
    except TimeoutError:
        text = f"{host} does not answer on port {port}"
        fix = f"check the address (ping {host}), and let the firewall pass TCP port {port}"
        return text, fix
    except OSError as error:
        text = f"{host} cannot be reached: {error.strerror or error}"
        return text, "connect this machine to the robot's network (ip addr shows where it is)"
