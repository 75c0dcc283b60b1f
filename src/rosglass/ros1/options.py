"""A ROS 1 node's options, from its ``ros1://`` URL, the environment and program arguments."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import TYPE_CHECKING
from urllib.parse import parse_qsl, unquote, urlsplit

from rosglass.comm import anonymous_name
from rosglass.errors import ArgumentError
from rosglass.ros1.names import absolute_namespace
from rosglass.ros1.remapping_arguments import NO_ARGUMENTS
from rosglass.wires.tcpros.address import bracketed, check_host, given_address, parse_uri
from rosglass.wires.tcpros.core import TcprosOptions

if TYPE_CHECKING:
    from collections.abc import Mapping

    from rosglass.ros1.remapping_arguments import Arguments

__all__ = ["Ros1Options"]

_PORT = 11311
_EXAMPLE = "a URL such as ros1://robot:11311?ip=192.168.1.5"
_OPTIONS = ("anonymous", "ip", "slave_port", "tcpros_port")


@dataclass(frozen=True)
class Ros1Options(TcprosOptions):
    """A node's options.

    Attributes:
        anonymous: Whether to append a suffix to the node's name that makes it unique.
        arguments: The program's ROS arguments.
    """

    anonymous: bool = False
    arguments: Arguments = NO_ARGUMENTS

    @classmethod
    def parse(
        cls,
        url: str,
        env: Mapping[str, str] = os.environ,
        arguments: Arguments = NO_ARGUMENTS,
    ) -> Ros1Options:
        """Read a URL, with the arguments and then the environment for what it leaves out.

        Args:
            url: ``ros1://host:port?ip=...``; without host, ROS_MASTER_URI, or this machine.
            env: ROS_MASTER_URI, ROS_IP and ROS_HOSTNAME are used.
            arguments: They override the environment; the URL overrides both.

        Raises:
            ArgumentError: A part of the URL or an environment variable is not valid.
        """
        try:
            parts = urlsplit(url)
            host, port = parts.hostname, parts.port
        except ValueError as error:
            raise ArgumentError("url", url, f"{_EXAMPLE} ({error})") from error
        host = unquote(host or "")
        if parts.path not in ("", "/") or parts.fragment or "@" in parts.netloc or port == 0:
            raise ArgumentError("url", url, _EXAMPLE)
        if " " in host or not host.isprintable():
            raise ArgumentError("url", url, f"{_EXAMPLE} ({host!r} is not a host)")
        options = _options(parts.query, url)
        if host or port:
            master = f"http://{bracketed(host or 'localhost')}:{port or _PORT}"
            source = "url"
        elif arguments.master:
            master, source = arguments.master, "__master"
        else:
            master, source = env.get("ROS_MASTER_URI", "").strip(), "ROS_MASTER_URI"
            master = master or f"http://localhost:{_PORT}"
        parse_uri(master, source)
        if not master.startswith("http://"):
            raise ArgumentError(source, master, "a URI such as http://robot:11311")
        if "ip" in options:
            address, given_by = check_host(options["ip"], "url option ip"), "ip"
        elif arguments.address:
            address, given_by = arguments.address, "__ip"
        else:
            address, given_by = given_address(env)
        return cls(
            master.rstrip("/"),
            address,
            given_by,
            _port(options, "tcpros_port") or arguments.tcpros_port,
            _port(options, "slave_port"),
            _flag(options, "anonymous"),
            arguments,
        )

    def node_name(self, name: str | None) -> str:
        """Return the node's base name.

        Args:
            name: The program's own choice, which ``__name`` replaces; None for a unique name: in
                ROS, a second node of the same name shuts the first one down.
        """
        if self.arguments.name:
            return self.arguments.name
        return anonymous_name(name or "rosglass") if name is None or self.anonymous else name

    def namespace(self, given: str | None, env: Mapping[str, str] = os.environ) -> str:
        """Return the node's namespace.

        Args:
            given: The program's own choice, which ``__ns`` replaces; None and ``/`` for
                ROS_NAMESPACE.
            env: ROS_NAMESPACE is used.

        Raises:
            InvalidNameError: The namespace breaks ROS's rules.
        """
        if self.arguments.namespace:
            return self.arguments.namespace
        if given not in (None, "/"):
            return absolute_namespace(given, "namespace", relative=False)
        return absolute_namespace(env.get("ROS_NAMESPACE", "").strip() or "/", "ROS_NAMESPACE")


def _options(query: str, url: str) -> dict[str, str]:
    found: dict[str, str] = {}
    for name, value in parse_qsl(query, keep_blank_values=True):
        if name not in _OPTIONS:
            raise ArgumentError(f"url option {name}", url, f"one of {', '.join(_OPTIONS)}")
        if name in found or not value:
            raise ArgumentError(f"url option {name}", url, "each option once, with a value")
        found[name] = value
    return found


def _port(options: Mapping[str, str], name: str) -> int:
    text = options.get(name, "0")
    if not (text.isascii() and text.isdecimal()) or int(text) > 65535:
        raise ArgumentError(f"url option {name}", text, "a port number from 0 to 65535")
    return int(text)


def _flag(options: Mapping[str, str], name: str) -> bool:
    text = options.get(name, "false").lower()
    if text not in ("true", "false"):
        raise ArgumentError(f"url option {name}", text, "true or false")
    return text == "true"
