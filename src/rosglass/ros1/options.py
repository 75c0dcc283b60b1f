"""What a ``ros1://`` URL, the environment and a program's arguments say about a node."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from typing import TYPE_CHECKING
from urllib.parse import parse_qsl, unquote, urlsplit

from rosglass.errors import ConversionError
from rosglass.ros1.address import own_address, parse_uri

if TYPE_CHECKING:
    from collections.abc import Mapping

__all__ = ["Ros1Options"]

_PORT = 11311


@dataclass(frozen=True)
class Ros1Options:
    """How a node takes part in a ROS 1 graph.

    Attributes:
        master: URI of the master.
        address: Host or address under which others reach this node.
        tcpros_port: Where connections are accepted; 0 for any free port.
        slave_port: Where the node's API is served; 0 for any free port.
        remappings: New absolute name for each absolute name.
    """

    master: str
    address: str
    tcpros_port: int = 0
    slave_port: int = 0
    remappings: Mapping[str, str] = field(default_factory=dict)

    @classmethod
    def parse(cls, url: str, env: Mapping[str, str] = os.environ) -> Ros1Options:
        """Return what a URL says, and the environment where it says nothing.

        Args:
            url: ``ros1://host:port?ip=...``; without host, ROS_MASTER_URI, or this machine.
            env: ROS_MASTER_URI, ROS_IP and ROS_HOSTNAME in it count.

        Raises:
            ConversionError: A part of the URL or an environment variable is not valid.
        """
        parts = urlsplit(url)
        try:
            host, port = parts.hostname, parts.port
        except ValueError as error:
            told = f"a URL such as ros1://robot:11311 ({error})"
            raise ConversionError("url", url, told) from error
        if parts.path not in ("", "/") or parts.fragment or parts.username:
            raise ConversionError("url", url, "a URL such as ros1://robot:11311?ip=192.168.1.5")
        options = dict(parse_qsl(parts.query, keep_blank_values=True))
        for name in options:
            if name not in ("ip", "tcpros_port", "slave_port"):
                raise ConversionError(
                    f"url option {name}", url, "one of ip, tcpros_port, slave_port"
                )
        master = env.get("ROS_MASTER_URI", "").strip()
        if host:
            shown = f"[{host}]" if ":" in host else host
            master = f"http://{unquote(shown)}:{port or _PORT}"
        elif not master:
            master = f"http://localhost:{port or _PORT}"
        master_host, _ = parse_uri(master, "ROS_MASTER_URI" if not host else "url")
        address = options.get("ip", "") or own_address(env, master_host)
        slave_port, tcpros_port = (
            _port(options.get(name, "0"), name) for name in ("slave_port", "tcpros_port")
        )
        return cls(master.rstrip("/"), address, tcpros_port, slave_port)

    def remapped(self, full: str) -> str:
        """Return what an absolute name is replaced with; itself, unless remapped."""
        return self.remappings.get(full, full)


def _port(text: str, name: str) -> int:
    if not text.isdigit() or int(text) > 65535:
        raise ConversionError(f"url option {name}", text, "a port number from 0 to 65535")
    return int(text)
