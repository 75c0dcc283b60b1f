"""The options of a ``zenoh://`` URL; does not import Zenoh."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING
from urllib.parse import parse_qsl, unquote, urlsplit

from rosglass.errors import ArgumentError

if TYPE_CHECKING:
    from collections.abc import Mapping

__all__ = ["DEFAULT_PORT", "ZenohOptions", "locator", "shown_url"]

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
    "tls": {"true": True, "false": False},
}
_FILES = ("ca", "cert", "key")
#: Also a password with characters that end the host's part of a URL, unless it may be the port.
_PASSWORD = re.compile(r"(//[^/?#@]*?:)(?:[^/?#]*|(?!\d+(?:[/?#]|$)).*)@")


@dataclass(frozen=True)
class ZenohOptions:
    """Options for joining a domain over Zenoh.

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
        user: Name and password for a router that asks for them; None for those of `config_file`.
        tls: Whether to connect by TLS; None for how `config_file` connects, or plain TCP.
        ca: File with the certificates that the router's is checked by; None for that of
            `config_file`, or the web's authorities.
        cert: File with this program's certificate, for a router that asks for one.
        key: File with the private key of `cert`.
    """

    host: str | None = None
    port: int = DEFAULT_PORT
    domain: int = 0
    mode: str | None = None
    humble: bool = False
    shared_memory: bool | None = None
    config_file: str | None = None
    user: tuple[str, str] | None = field(default=None, repr=False)
    tls: bool | None = None
    ca: str | None = None
    cert: str | None = None
    key: str | None = None

    @classmethod
    def parse(cls, url: str, env: Mapping[str, str]) -> ZenohOptions:
        """Parse `url`, with defaults from the environment `env`.

        Raises:
            ArgumentError: A part of the URL, or ROS_DOMAIN_ID, is not valid.
        """
        example = "as in zenoh://127.0.0.1:7447?domain=0"
        given_url, url = url, shown_url(url)
        try:
            parts = urlsplit(given_url)
            host = parts.hostname
        except ValueError:
            raise ArgumentError("url", url, f"a URL {example}") from None
        if parts.path not in ("", "/") or parts.fragment:
            # Also where a password has a character that ends the host's part of a URL.
            hint = "; in a password, write / as %2F, ? as %3F, # as %23, @ as %40"
            raise ArgumentError(
                "url", url, f"nothing but host, port and options, {example}{hint * ('@' in url)}"
            )
        user = None
        if parts.username is not None:
            if not parts.username or not parts.password:
                raise ArgumentError("user", url, "a name and a password, zenoh://NAME:PASSWORD@...")
            user = (unquote(parts.username), unquote(parts.password))
        if host is not None and not _HOST.match(host):
            raise ArgumentError("host", host, "a host name or an address", url)
        try:
            port = DEFAULT_PORT if parts.port is None else parts.port
        except ValueError:
            port = 0
        if port == 0 or (host is None and parts.netloc):
            where = parts.netloc.rpartition("@")[2]
            raise ArgumentError("address", where, f"host:port, port 1 to 65535, {example}", url)
        given = parse_qsl(parts.query, keep_blank_values=True)
        options = dict(given)
        known = ("domain", *_CHOICES, *_FILES)
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
        tls = _parse_tls(options, url)
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
            user=user,
            tls=tls,
            **{name: options.get(name) for name in _FILES},
        )


def locator(host: str, port: int, protocol: str = "tcp") -> str:
    """Return the Zenoh locator of an address, with brackets around IPv6 addresses."""
    return f"{protocol}/[{host}]:{port}" if ":" in host else f"{protocol}/{host}:{port}"


def shown_url(url: str) -> str:
    """Return a URL as it may be shown and logged: without its password."""
    return _PASSWORD.sub(r"\1***@", url)


def _parse_tls(options: Mapping[str, str], url: str) -> bool | None:
    tls = _parse_choice(options, "tls", url)
    files = [name for name in _FILES if name in options]
    for name in files:
        if not options[name]:
            raise ArgumentError(name, "", "a file", url)
        if tls is False:
            raise ArgumentError(name, options[name], "no file without TLS: remove tls=false", url)
    if ("cert" in options) != ("key" in options):
        missing = "key" if "cert" in options else "cert"
        raise ArgumentError(missing, "", "a file: a certificate needs its key, cert and key", url)
    return True if files else None if tls is None else bool(tls)


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
