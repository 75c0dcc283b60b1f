"""What a ``dds://`` URL and ROS 2's environment variables say; needs no DDS."""

from __future__ import annotations

import logging
import re
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING
from urllib.parse import parse_qsl, urlsplit

from rosglass.errors import ArgumentError

if TYPE_CHECKING:
    from collections.abc import Mapping

__all__ = ["MAX_DOMAIN", "DdsOptions", "DiscoveryRange"]

_log = logging.getLogger("rosglass.ros2")
#: Last domain whose ports, 7400 + 250 * domain and some more, exist (RTPS 2.5, section 9.6.2).
MAX_DOMAIN = 232
_EXAMPLE = "as in dds://?domain=0 or dds://192.168.1.5?domain=0"
_HOST = re.compile(r"[A-Za-z0-9_.-]+\Z")
_PEER = re.compile(r"[A-Za-z0-9_.-]+(:[0-9]{1,5})?\Z")
_INTERFACE = re.compile(r"[A-Za-z0-9_.:@-]+\Z")
_SEPARATOR = re.compile(r"[;,]")
_DISTRIBUTIONS = ("humble", "iron", "jazzy", "kilted", "lyrical", "rolling")
_KNOWN = ("domain", "range", "peers", "interface", "distro")


class DiscoveryRange(Enum):
    """How far away others are looked for (ROS_AUTOMATIC_DISCOVERY_RANGE, Iron and newer)."""

    SUBNET = "subnet"
    LOCALHOST = "localhost"
    OFF = "off"
    SYSTEM_DEFAULT = "system_default"


@dataclass(frozen=True)
class DdsOptions:
    """How to join a domain over DDS.

    Attributes:
        domain: ROS domain.
        discovery: Where others are looked for without being named.
        peers: Machines that are asked besides, by host name or IPv4 address; with ``:port`` only
            the program there that listens on that port.
        interfaces: Network interfaces to use, by name or address; none lets Cyclone DDS choose.
        humble: Whether to write 24-byte identities into the graph, as ROS 2 Humble does; None
            follows the others in the domain.
        config: The user's own Cyclone DDS configuration, as in ``CYCLONEDDS_URI``.
        chosen: Names of the options that the URL itself gave.
    """

    domain: int = 0
    discovery: DiscoveryRange = DiscoveryRange.SUBNET
    peers: tuple[str, ...] = ()
    interfaces: tuple[str, ...] = ()
    humble: bool | None = None
    config: str = ""
    chosen: frozenset[str] = frozenset()

    @classmethod
    def parse(cls, url: str, env: Mapping[str, str]) -> DdsOptions:
        """Return what `url` says, completed by the environment `env`.

        The environment is read as ROS 2 documents it: ROS_DOMAIN_ID, ROS_LOCALHOST_ONLY (which
        wins over the next two), ROS_AUTOMATIC_DISCOVERY_RANGE, ROS_STATIC_PEERS, CYCLONEDDS_URI.

        Raises:
            ArgumentError: A part of the URL or a variable is not valid; it says which.
        """
        hosts, options = _split(url)
        peers = (*hosts, *_list(options, "peers", _PEER, "a host name or an IPv4 address", url))
        interfaces = _list(
            options, "interface", _INTERFACE, "an interface's name or address, e.g. eth0", url
        )
        if "domain" in options:
            domain = _domain(options["domain"], "domain", url)
        else:
            domain = _domain(env.get("ROS_DOMAIN_ID") or "0", "ROS_DOMAIN_ID", "environment")
        distro = options.get("distro")
        if distro is not None and distro not in _DISTRIBUTIONS:
            raise ArgumentError("distro", distro, f"one of {', '.join(_DISTRIBUTIONS)}", url)
        discovery, others = _range(options.get("range"), bool(peers), url, env)
        return cls(
            domain=domain,
            discovery=discovery,
            peers=tuple(dict.fromkeys((*peers, *others))),
            interfaces=tuple(dict.fromkeys(interfaces)),
            humble=None if distro is None else distro == "humble",
            config=env.get("CYCLONEDDS_URI", "").strip(),
            chosen=frozenset(options) | ({"peers"} if peers else set()),
        )


def _split(url: str) -> tuple[list[str], dict[str, str]]:
    try:
        parts = urlsplit(url)
        port = parts.netloc.rpartition(":")[2] if ":" in parts.netloc else ""
    except ValueError as error:
        raise ArgumentError("url", url, f"a URL {_EXAMPLE} ({error})") from error
    if parts.path not in ("", "/") or parts.fragment or "@" in parts.netloc:
        raise ArgumentError("url", url, f"nothing but peers and options, {_EXAMPLE}")
    if port.isdigit() and parts.netloc.count(":") == 1:
        raise ArgumentError(
            "address", parts.netloc, f"no port: DDS derives it from the domain, {_EXAMPLE}", url
        )
    hosts = [host for host in _SEPARATOR.split(parts.netloc) if host]
    for host in hosts:
        _check(host, "peer", _HOST, "a host name or an IPv4 address", url)
    given = parse_qsl(parts.query, keep_blank_values=True)
    options = dict(given)
    for key, value in given:
        if key not in _KNOWN:
            raise ArgumentError("option", key, f"one of {', '.join(_KNOWN)}", url)
        if options[key] != value:
            raise ArgumentError(key, value, f"to be given once, not also {options[key]}", url)
    return hosts, options


def _range(
    option: str | None, named: bool, url: str, env: Mapping[str, str]
) -> tuple[DiscoveryRange, list[str]]:
    """Return where to look, and the environment's peers."""
    words = ", ".join(kind.value for kind in DiscoveryRange)
    static = env.get("ROS_STATIC_PEERS", "")
    others = [peer.strip() for peer in static.split(";") if peer.strip()]
    localhost_only = env.get("ROS_LOCALHOST_ONLY", "")
    wanted = env.get("ROS_AUTOMATIC_DISCOVERY_RANGE", "")
    source = "ROS_AUTOMATIC_DISCOVERY_RANGE"
    if localhost_only not in ("", "0", "1"):
        raise ArgumentError("ROS_LOCALHOST_ONLY", localhost_only, "0 or 1", "environment")
    if option is not None:
        if option.lower() not in words.split(", "):
            raise ArgumentError("range", option, f"one of {words}", url)
        discovery, source = DiscoveryRange(option.lower()), "range"
    elif localhost_only == "1":
        discovery, source, others = DiscoveryRange.LOCALHOST, "ROS_LOCALHOST_ONLY", []
    elif wanted and wanted.lower() not in words.split(", "):
        raise ArgumentError(source, wanted, f"one of {words.upper()}", "environment")
    else:
        discovery = DiscoveryRange(wanted.lower() or "subnet")
    for peer in others:
        _check(peer, "ROS_STATIC_PEERS", _PEER, "host names or IPv4 addresses", "environment")
    if discovery in (DiscoveryRange.OFF, DiscoveryRange.SYSTEM_DEFAULT):
        reason = f"{source}={discovery.value} lets no peer be named"
        if named:
            raise ArgumentError(
                "peers", url, f"range=subnet or range=localhost beside them ({reason})"
            )
        if others:
            _log.warning("ignoring ROS_STATIC_PEERS=%s: %s", static, reason)
            others = []
    return discovery, others


def _list(
    options: Mapping[str, str], key: str, form: re.Pattern[str], expected: str, url: str
) -> list[str]:
    if key not in options:
        return []
    items = [item.strip() for item in _SEPARATOR.split(options[key]) if item.strip()]
    if not items:
        raise ArgumentError(key, options[key], expected, url)
    for item in items:
        _check(item, key, form, expected, url)
    return items


def _check(item: str, what: str, form: re.Pattern[str], expected: str, where: str) -> None:
    if not form.match(item):
        raise ArgumentError(what, item, expected, where)


def _domain(text: str, what: str, where: str) -> int:
    if not (text.isascii() and text.isdigit() and int(text[:12]) <= MAX_DOMAIN):
        raise ArgumentError(
            what, text, f"a ROS domain: 0 to {MAX_DOMAIN}, as DDS derives its ports from it", where
        )
    return int(text)
