"""Zenoh sessions: settings as rmw_zenoh's defaults, opening, closing, and dead links.

On one machine, a session is a peer that connects to a router, listens on the loopback interface
only, and discovers other peers by gossip, never by multicast. To a router on another machine it is
a client.

Zenoh drops a dead link after its lease: 10 s, and 60 s with the routers of ROS 2. Until then, an
operator would see the last image as if it were live. If the connection survives, it delivers old
commands when the network returns. While Zenoh closes a link on which data waits, it accepts a new
one to the same peer and numbers its keys as on the old one: messages arrive on other topics
(docs/upstream/zenoh_misrouting.md). So the system closes connections that acknowledge nothing.
"""

from __future__ import annotations

import ipaddress
import json
import logging
import os
import re
import secrets
import socket
import sys
import threading
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

import zenoh

from rosglass.errors import ArgumentError, UnsupportedError
from rosglass.wires.zenoh.options import DEFAULT_PORT, ZenohOptions, locator

__all__ = [
    "DEFAULT_LISTEN",
    "OPEN_TIMEOUT_S",
    "Heartbeat",
    "check_process",
    "close_session",
    "endpoints",
    "is_local",
    "limit_silence",
    "open_session",
    "reason",
    "router_config",
    "session_config",
]


#: The address at which a router listens by default.
DEFAULT_LISTEN = f"tcp/127.0.0.1:{DEFAULT_PORT}"

_log = logging.getLogger("rosglass.ros2")
#: Seconds that closing a session may take; it has taken minutes with 100 nodes in one process.
_CLOSE_TIMEOUT_S = 5.0
#: Pause between two attempts to connect, in milliseconds: first, and at most.
_RETRY = {"period_init_ms": 250, "period_max_ms": 500, "period_increase_factor": 2}
#: Timeout for opening a link in milliseconds: closing a session waits for a running attempt, and
#: three round trips over a satellite have to fit.
_OPEN_TIMEOUT_MS = 3000
#: Seconds within which an attempt to open a session ends; Zenoh's default for an address is 10.
OPEN_TIMEOUT_S = 12.0
#: Queue of a link on this machine in fragments of 64 kB. With Zenoh's default of 2, sender and link
#: wait for each other: a 6 MB image takes a fifth longer, and is dropped on a busy machine. On
#: other links, a longer queue would add latency.
_LOCAL_QUEUE_SIZE = 8
#: Only one of two peers opens the link, so that their attempts do not cross (as in rmw_zenoh).
_STRATEGY = {"peer": {"to_router": "always", "to_peer": "greater-zid"}}


def session_config(options: ZenohOptions) -> tuple[zenoh.Config, str]:
    """Return the configuration of a session, and the addresses it connects to as a text.

    Raises:
        ArgumentError: The configuration file cannot be read, or Zenoh rejects it.
    """
    settings: dict[str, Any] = {
        # Opening returns at once; links are opened in the background.
        "open/return_conditions/connect_scouted": False,
        "open/return_conditions/declares": False,
        # The cache of transient-local publishers needs timestamps.
        "timestamping/enabled": True,
        # A known id makes the tokens known before the session is open. Zenoh drops leading
        # zeros.
        "id": "f" + secrets.token_hex(16)[1:],
    }
    settings |= _credentials(options)
    if options.config_file is None:
        config = zenoh.Config()
        # Peers would link with each other without TLS and, with a user, not at all.
        alone = is_local(options.host) and options.user is None and not options.tls
        settings["mode"] = options.mode or ("peer" if alone else "client")
        settings["listen/endpoints"] = ["tcp/127.0.0.1:0"] if settings["mode"] == "peer" else []
        if is_local(options.host):
            settings["transport/link/tx/queue/size/data"] = _LOCAL_QUEUE_SIZE
        settings["scouting/multicast/enabled"] = False
        settings["scouting/gossip/enabled"] = True
        settings["scouting/gossip/autoconnect_strategy"] = _STRATEGY
        settings["connect/retry"] = _RETRY
        settings["transport/unicast/open_timeout"] = _OPEN_TIMEOUT_MS
        if settings["mode"] == "client":
            settings["connect/timeout_ms"] = 0  # one attempt: the middleware tries again
        settings["transport/shared_memory/enabled"] = bool(options.shared_memory)
        host = options.host or "127.0.0.1"
    else:
        config = _read(options.config_file, "ZENOH_SESSION_CONFIG_URI")
        if options.mode is not None:
            settings["mode"] = options.mode
        if options.shared_memory is not None:
            settings["transport/shared_memory/enabled"] = options.shared_memory
        host = options.host or ""
    if host:
        protocol = _protocol(config) if options.tls is None else "tls" if options.tls else "tcp"
        settings["connect/endpoints"] = [locator(host, options.port, protocol)]
    elif options.tls is not None:
        raise ArgumentError(
            "tls", options.tls, "a URL with the router's host: the addresses are those of the file",
            f"ZENOH_SESSION_CONFIG_URI={options.config_file}",
        )  # fmt: skip
    _apply(config, settings)
    return config, ", ".join(endpoints(config)) or "any address (none is configured)"


def router_config(listen: str | None, config_file: str | None = None) -> zenoh.Config:
    """Return the configuration of a router.

    Args:
        listen: Locator such as ``tcp/[::]:7447``; None for those of `config_file`, or one on this
            machine only if it has none, unlike Zenoh's default.
        config_file: Zenoh configuration to start from, as in ``ZENOH_ROUTER_CONFIG_URI``.

    Raises:
        ArgumentError: The configuration file cannot be read, or Zenoh rejects it.
    """
    settings: dict[str, Any] = {
        "mode": "router",
        "listen/exit_on_failure": True,
        "timestamping/enabled": True,
        "open/return_conditions/connect_scouted": False,
    }
    config: zenoh.Config
    if config_file is None:
        config = zenoh.Config()
        settings["connect/endpoints"] = []
        settings["scouting/multicast/enabled"] = False
        settings["scouting/gossip/enabled"] = True
    else:
        variable = "ZENOH_ROUTER_CONFIG_URI"
        config = _read(
            config_file, variable if os.environ.get(variable) == config_file else "config_file"
        )
    addresses = "listen/endpoints"
    if listen is None and config.get_json(addresses) == zenoh.Config().get_json(addresses):
        listen = DEFAULT_LISTEN
    if listen is not None:
        settings[addresses] = [listen]
    _apply(config, settings)
    return config


def _credentials(options: ZenohOptions) -> dict[str, Any]:
    """Return the settings for users and certificates; raises ArgumentError for a missing file."""
    settings: dict[str, Any] = {}
    if options.user is not None:
        user, password = options.user
        settings |= {"transport/auth/usrpwd/user": user, "transport/auth/usrpwd/password": password}
    for name, file, setting in (
        ("ca", options.ca, "root_ca_certificate"),
        ("cert", options.cert, "connect_certificate"),
        ("key", options.key, "connect_private_key"),
    ):
        if file is None:
            continue
        try:
            Path(file).open("rb").close()
        except OSError as error:  # Zenoh would connect for ever
            reason = f"a file that can be read ({error.strerror})"
            raise ArgumentError(name, file, reason, "zenoh:// URL") from None
        settings[f"transport/link/tls/{setting}"] = str(Path(file).resolve())
    if options.cert is not None:
        settings["transport/link/tls/enable_mtls"] = True
    return settings


def _protocol(config: zenoh.Config) -> str:
    """Return how a configuration connects: the protocol of its first address, or by its files."""
    for endpoint in endpoints(config):
        return endpoint.partition("/")[0]
    tls = json.loads(config.get_json("transport/link/tls"))
    return "tls" if tls["root_ca_certificate"] or tls["connect_certificate"] else "tcp"


def _apply(config: zenoh.Config, settings: dict[str, Any]) -> None:
    for key, value in settings.items():
        config.insert_json5(key, json.dumps(value))


def is_local(host: str | None) -> bool:
    """Return whether a host is this machine, by its name or loopback address.

    Peers of another machine listen on its loopback interface only, as in ROS 2, and a router does
    not forward between peers: only a client receives from there.
    """
    return host is None or host == "localhost" or host.startswith("127.") or host == "::1"


def open_session(config: zenoh.Config) -> zenoh.Session:
    """Open a session.

    Raises:
        UnsupportedError: This process is a fork of one that had a session.
        zenoh.ZError: It cannot be opened.
    """
    check_process()
    _processes.add(os.getpid())
    return zenoh.open(config)


def check_process() -> None:
    """Raise UnsupportedError in a fork of a process that had a session: Zenoh hangs there."""
    if _processes and os.getpid() not in _processes:
        raise UnsupportedError(
            "Zenoh does not work in a fork of a process that used it: its threads are missing; "
            'start a new process, e.g. with multiprocessing.get_context("spawn"), or '
            "fork before connecting"
        )


#: Ids of the process that uses Zenoh; a fork has another id.
_processes: set[int] = set()


def close_session(session: zenoh.Session, pause: float = 0.0) -> None:
    """Close a session, in any state, within 5 s.

    On a thread of Zenoh, it does not wait: closing waits for that thread.

    Args:
        session: The session.
        pause: Seconds to wait first.
    """

    def close() -> None:
        time.sleep(pause)
        _close(session)

    closing = threading.Thread(target=close, name="Zenoh closes", daemon=True)
    try:
        closing.start()
    except RuntimeError:  # the interpreter is shutting down, and starts no threads
        _close(session)
        return
    if isinstance(threading.current_thread(), threading._DummyThread):
        return
    closing.join(pause + _CLOSE_TIMEOUT_S)
    if closing.is_alive():
        _log.warning(
            "Zenoh is still closing a session after %.0f s; it continues in the background",
            _CLOSE_TIMEOUT_S,
        )


def _close(session: zenoh.Session) -> None:
    with suppress(zenoh.ZError):  # it is broken already
        session.close()  # type: ignore[no-untyped-call]


def reason(error: zenoh.ZError) -> str:
    """Return the text of a Zenoh error without the locations in Zenoh's source."""
    return re.sub(r" at /\S+?\.rs:\d+\.?", "", str(error)).strip()


def _read(file: str, source: str) -> zenoh.Config:
    path = Path(file.removeprefix("file://"))
    try:
        config: zenoh.Config = zenoh.Config.from_file(path)
    except zenoh.ZError as error:
        raise ArgumentError(
            source,
            file,
            f"a Zenoh configuration file that can be read ({path}: {reason(error)})",
        ) from error
    return config


def endpoints(config: zenoh.Config, use: str = "connect") -> list[str]:
    """Return a configuration's addresses, without their own settings.

    Args:
        config: The configuration.
        use: ``connect`` or ``listen``.
    """
    found = json.loads(config.get_json(f"{use}/endpoints"))
    if isinstance(found, dict):
        found = found.get(json.loads(config.get_json("mode")) or "peer") or []
    groups = [item["locators"] if isinstance(item, dict) else [item] for item in found]
    flat = [one for group in groups for one in group]
    return [re.split(r"[?#]", str(one))[0] for one in flat]


#: Seconds after which a router that does not answer counts as silent.
_SILENCE_TIMEOUT_S = 3.0
#: Timeout of a query to the router in seconds.
_QUERY_TIMEOUT_S = 10.0
#: Milliseconds after which the system closes a connection with unacknowledged data.
_USER_TIMEOUT_MS = 4000
_SOCKETS = Path("/proc/self/fd")
_LOCATOR = re.compile(r"(?:tcp|tls)/(?:\[([^\]]+)\]|([^:\[\]]+)):(\d+)")


class Heartbeat:
    """Detects a router that does not answer, with queries that have no result.

    Args:
        key: A token key that no token matches.

    Attributes:
        silent: Whether the router has not answered in time.
    """

    def __init__(self, key: str) -> None:
        self._key = key
        self._sent_at = self._received_at = 0.0
        self._query: Any = None
        self.silent = False

    def beat(self, session: zenoh.Session, now: float) -> None:
        """Check for the answer, and send the next query; called regularly, with the time."""
        if self._query is not None:
            try:
                over = self._query.try_recv() is not None  # an error: the timeout
            except zenoh.ZError:  # the end of the answer
                over = True
                # Closing a link ends its queries, too: only a prompt end is an answer.
                if now - self._sent_at <= _SILENCE_TIMEOUT_S:
                    self.silent = False
            if over:
                self._query = None
            elif now - max(self._sent_at, self._received_at) > _SILENCE_TIMEOUT_S:
                self.silent = True
        if self._query is None:
            with suppress(zenoh.ZError):  # the session is closed
                channel = zenoh.handlers.FifoChannel(4)
                self._query = session.liveliness().get(self._key, channel, timeout=_QUERY_TIMEOUT_S)
                self._sent_at = now

    def on_received(self, now: float) -> None:
        """Record that the router has sent something, which the answer may queue behind."""
        self._received_at = now

    def pause(self) -> None:
        """Stop until the next :meth:`beat`: there is no router, or it is sending the graph."""
        self._query, self.silent = None, False


def limit_silence(session: zenoh.Session) -> None:
    """Have the system close a session's connections whose data is not acknowledged.

    Zenoh has no setting for this. Only on Linux, and only for TCP and TLS.
    """
    links = getattr(session.info, "links", None)
    if links is None or not sys.platform.startswith("linux"):
        return
    try:
        ends = {end for link in links() if (end := _parse_locator(link.dst)) is not None}
    except zenoh.ZError:  # the session is closed
        return
    for entry in _SOCKETS.iterdir() if ends else ():
        with suppress(OSError):  # closed by now, or no socket
            _limit_socket(os.dup(int(entry.name)), ends)


def _limit_socket(own: int, ends: set[tuple[str, int]]) -> None:
    try:
        connection = socket.socket(fileno=own)
    except OSError:
        os.close(own)
        raise
    with connection:
        if connection.type is not socket.SOCK_STREAM or connection.family not in _INTERNET:
            return
        host, port = connection.getpeername()[:2]
        if (_normalize(host), port) in ends:
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, _USER_TIMEOUT_MS)


_INTERNET = (socket.AF_INET, socket.AF_INET6)


def _parse_locator(locator: str) -> tuple[str, int] | None:
    """Return address and port of a TCP or TLS locator; None for a name."""
    match = _LOCATOR.match(locator)
    if match is None:
        return None
    host = _normalize(match[1] or match[2])
    return None if host is None else (host, int(match[3]))


def _normalize(host: str) -> str | None:
    """Return an address in its shortest form; None for a name."""
    try:
        address = ipaddress.ip_address(host.partition("%")[0])
    except ValueError:
        return None
    return str(getattr(address, "ipv4_mapped", None) or address)
