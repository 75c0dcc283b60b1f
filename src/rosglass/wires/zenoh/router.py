"""A Zenoh router, through which the nodes of a ROS 2 graph over rmw_zenoh discover each other."""

from __future__ import annotations

import atexit
import json
import os
import re
import socket
import time
from dataclasses import replace

import zenoh

from rosglass.comm import Handle
from rosglass.errors import ArgumentError, ConnectionLostError
from rosglass.wires.zenoh.endpoints import CHANNEL, Pump
from rosglass.wires.zenoh.options import ZenohOptions, locator
from rosglass.wires.zenoh.refusal import find_refusal
from rosglass.wires.zenoh.session import (
    DEFAULT_LISTEN,
    close_session,
    endpoints,
    limit_silence,
    open_session,
    reason,
    router_config,
    session_config,
)

__all__ = ["DEFAULT_LISTEN", "Router", "is_router_reachable"]

_LOCATOR = re.compile(
    r"(?P<protocol>tcp|tls)/"
    r"(?:\[(?P<six>[0-9A-Fa-f:.]+)\]|(?P<host>[A-Za-z0-9_.-]+)):(?P<port>\d+)"
)
_LOOPBACK = re.compile(r"localhost|127(?:\.\d+){3}|::1")
_ENCRYPTED = ("tls/", "quic/")
#: Settings that name a file, which Zenoh's errors do not.
_FILES = (
    "auth/usrpwd/dictionary_file",
    "link/tls/listen_certificate",
    "link/tls/listen_private_key",
    "link/tls/root_ca_certificate",
)


class Router(Handle):
    """A router in this process, running from creation to :meth:`close`.

    Args:
        listen: Address to listen on, ``tcp/HOST:PORT`` or ``tls/HOST:PORT``; port 0 chooses a free
            one. None for those of `config_file`, or ``tcp/127.0.0.1:7447`` without any.
        config_file: Zenoh configuration, as in ``ZENOH_ROUTER_CONFIG_URI``: users, certificates,
            access control; None for none.

    Attributes:
        listen: The addresses, with the actual port.
        url: URL for :func:`rosglass.connect`, without user; empty if there is none for the address.
        is_local: Whether only programs on this machine can connect.
        is_restricted: Whether programs on other machines need a password or a certificate to
            connect.
        is_encrypted: Whether all connections with other machines are encrypted.

    Raises:
        ArgumentError: `listen` is not an address, or `config_file` cannot be read.
        ConnectionLostError: The address is in use, or does not belong to this machine; or a file of
            the configuration is invalid.
    """

    def __init__(self, listen: str | None = None, config_file: str | None = None) -> None:
        if listen is not None:
            protocol, host, port = _parse(listen)
            listen = locator(host, port or _free_port(host), protocol)
        config = router_config(listen, config_file)
        addresses = endpoints(config, "listen")
        self.listen, self.url = ", ".join(addresses), _url(addresses)
        self.is_local = all(_is_loopback(address) for address in addresses)
        self.is_encrypted = all(
            address.startswith(_ENCRYPTED) or _is_loopback(address) for address in addresses
        )
        has_users = json.loads(config.get_json("transport/auth/usrpwd/dictionary_file"))
        has_certificates = json.loads(config.get_json("transport/link/tls/enable_mtls"))
        self.is_restricted = bool(has_users or (has_certificates and self.is_encrypted))
        self._files = [
            file
            for setting in _FILES
            if (file := json.loads(config.get_json(f"transport/{setting}")))
        ]
        self._session: zenoh.Session | None = None
        try:
            self._session = open_session(config)
        except zenoh.ZError as error:
            raise ConnectionLostError(self._explain(error)) from error
        self._pump = self._watch(self._session)
        # No Zenoh thread may call into an interpreter that is shutting down.
        atexit.register(self.close)

    def close(self) -> None:
        """Stop the router; safe to call twice."""
        session, self._session = self._session, None
        if session is None:
            return
        atexit.unregister(self.close)
        self._pump.undeclare()
        close_session(session)

    def _watch(self, session: zenoh.Session) -> Pump:
        """Disconnect programs whose network is lost, so that they can reconnect at once."""
        events = session.info.declare_transport_events_listener(CHANNEL, history=True)
        return Pump(events, lambda _: limit_silence(session), f"{self.listen} router links")

    def _explain(self, error: zenoh.ZError) -> str:
        problem = f"cannot run a router at {self.listen}"
        other = "choose another port with --listen tcp/127.0.0.1:PORT"
        text = reason(error)
        if "Missing TLS" in text:
            needed = "listen_certificate and listen_private_key in its transport.link.tls"
            return f"{problem}: {text.rstrip('.')}; give --config FILE with {needed}"
        if "in use" not in text:
            fix = "; name an address of this machine" if "ssign" in text else ""
            if self._files and ("file" in text or "keys" in text):
                fix = f" (its files: {', '.join(self._files)})"
            return f"{problem}: {text}{fix}"
        if self.url and is_router_reachable(self.url):
            return f"{problem}: a Zenoh router runs there already; use that one, or {other}"
        return f"{problem}: another program uses the port; {other}"


def is_router_reachable(url: str, timeout: float = 0.5) -> bool:
    """Return whether a Zenoh router answers at a ``zenoh://`` URL.

    Args:
        url: As for :func:`rosglass.connect`.
        timeout: Seconds to wait for an answer.

    Raises:
        ArgumentError: The URL is not valid.
    """
    options = ZenohOptions.parse(url, os.environ)
    host = options.host or "127.0.0.1"
    deadline = time.monotonic() + timeout
    try:
        # Fails faster than Zenoh where nothing listens.
        socket.create_connection((host, options.port), timeout).close()
    except OSError:
        return False
    config, _ = session_config(replace(options, host=host, mode="client"))
    remaining = max(1, int((deadline - time.monotonic()) * 1000))
    config.insert_json5("transport/unicast/open_timeout", str(remaining))
    config.insert_json5("connect/timeout_ms", str(remaining))
    try:
        session = open_session(config)
    except zenoh.ZError:
        # One that refuses this program is there, too.
        return find_refusal(options, timeout) is not None
    try:
        return bool(session.info.routers_zid())
    finally:
        close_session(session)


def _parse(listen: str) -> tuple[str, str, int]:
    match = _LOCATOR.fullmatch(listen) if isinstance(listen, str) else None
    if match is None or int(match["port"]) > 65535:
        raise ArgumentError(
            "listen",
            listen,
            "an address such as tcp/127.0.0.1:7447 or tls/[::]:7447, port 0 to 65535",
        )
    return match["protocol"], match["six"] or match["host"], int(match["port"])


def _url(addresses: list[str]) -> str:
    """Return the URL of the first address that a URL can name; empty for none."""
    for match in filter(None, map(_LOCATOR.fullmatch, addresses)):
        host = match["six"] or match["host"]
        reachable = {"0.0.0.0": "127.0.0.1", "::": "::1"}.get(host, host)
        tls = "?tls=true" if match["protocol"] == "tls" else ""
        return "zenoh://" + locator(reachable, int(match["port"])).removeprefix("tcp/") + tls
    return ""


def _is_loopback(address: str) -> bool:
    match = _LOCATOR.fullmatch(address)
    return match is not None and _LOOPBACK.fullmatch(match["six"] or match["host"]) is not None


def _free_port(host: str) -> int:
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    with socket.socket(family) as probe:
        probe.bind((host, 0))
        return int(probe.getsockname()[1])
