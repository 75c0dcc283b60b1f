"""The options of a ``zenoh://`` URL; does not import Zenoh."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING
from urllib.parse import parse_qsl, urlsplit

from rosglass.errors import ArgumentError

if TYPE_CHECKING:
    from collections.abc import Mapping

__all__ = ["DEFAULT_PORT", "ZenohOptions", "locator"]

#: The port of rmw_zenoh's routers.
DEFAULT_PORT = 7447
#: Zenoh's keys allow any number; rcl stores 32 bits.
_MAX_DOMAIN = 2**32 - 2
_HOST = re.compile(r"[A-Za-z0-9_.:%-]+\Z")
_CHOICES: dict[str, dict[str, str | bool]] = {
    "mode": {"peer": "peer", "client": "client"},
    "distro": {
        "humble": True,
        **dict.fromkeys(("iron", "jazzy", "kilted", "lyrical", "rolling"), False),
    },
    "shm": {"true": True, "false": False},
}


@dataclass(frozen=True)
class ZenohOptions:
    """How to join a domain over Zenoh.

    Attributes:
        host: Router's host name or address; None for that of `config_file`, or this machine.
        port: Router's TCP port.
        domain: ROS domain.
        mode: ``peer`` links directly with discovered peers, ``client`` only with the router; None
            for that of `config_file`, or ``peer`` on one machine and ``client`` to another.
        humble: Whether to announce types without hash, as ROS 2 Humble does.
        shared_memory: Whether messages from 3 kB on use shared memory between programs of one
            machine that both allow it; None for that of `config_file`, or false.
        config_file: Zenoh configuration to start from, as in ``ZENOH_SESSION_CONFIG_URI``.
    """

    host: str | None = None
    port: int = DEFAULT_PORT
    domain: int = 0
    mode: str | None = None
    humble: bool = False
    shared_memory: bool | None = None
    config_file: str | None = None

    @classmethod
    def parse(cls, url: str, env: Mapping[str, str]) -> ZenohOptions:
        """Parse `url`, with defaults from the environment `env`.

        Raises:
            ArgumentError: A part of the URL, or ROS_DOMAIN_ID, is not valid.
        """
        example = "as in zenoh://127.0.0.1:7447?domain=0"
        try:
            parts = urlsplit(url)
            host = parts.hostname
        except ValueError as error:
            raise ArgumentError("url", url, f"a URL {example} ({error})") from error
        if parts.path not in ("", "/") or parts.fragment or parts.username is not None:
            raise ArgumentError("url", url, f"nothing but host, port and options, {example}")
        if host is not None and not _HOST.match(host):
            raise ArgumentError("host", host, "a host name or an address", url)
        try:
            port = DEFAULT_PORT if parts.port is None else parts.port
        except ValueError:
            port = 0
        if port == 0 or (host is None and parts.netloc):
            raise ArgumentError("address", parts.netloc, f"host:port, port 1 to 65535, {example}")
        given = parse_qsl(parts.query, keep_blank_values=True)
        options = dict(given)
        known = ("domain", *_CHOICES)
        for key, value in given:
            if key not in known:
                raise ArgumentError("option", key, f"one of {', '.join(known)}", url)
            if options[key] != value:
                raise ArgumentError(key, value, f"to be given once, not also {options[key]}", url)
        if "domain" in options:
            domain = _parse_domain(options["domain"], "domain", url)
        else:
            domain = _parse_domain(env.get("ROS_DOMAIN_ID") or "0", "ROS_DOMAIN_ID", "environment")
        mode = _parse_choice(options, "mode", url)
        return cls(
            host=host,
            port=port,
            domain=domain,
            mode=None if mode is None else str(mode),
            humble=bool(_parse_choice(options, "distro", url)),
            shared_memory=None
            if "shm" not in options
            else bool(_parse_choice(options, "shm", url)),
            config_file=env.get("ZENOH_SESSION_CONFIG_URI") or None,
        )


def locator(host: str, port: int) -> str:
    """Return the Zenoh locator of a TCP address, with brackets around IPv6 addresses."""
    return f"tcp/[{host}]:{port}" if ":" in host else f"tcp/{host}:{port}"


def _parse_domain(text: str, what: str, where: str) -> int:
    if not (text.isascii() and text.isdigit() and int(text[:12]) <= _MAX_DOMAIN):
        raise ArgumentError(what, text, "a ROS domain: a whole number, 0 or more", where)
    return int(text)


def _parse_choice(options: Mapping[str, str], key: str, url: str) -> str | bool | None:
    if key not in options:
        return None
    choices = _CHOICES[key]
    if options[key] not in choices:
        raise ArgumentError(key, options[key], f"one of {', '.join(choices)}", url)
    return choices[options[key]]
