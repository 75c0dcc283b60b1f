"""Zenoh sessions and routers: their settings, chosen as rmw_zenoh's defaults are.

On one machine, a session is a peer that connects to a router, listens on the loopback interface
only, and learns of other peers from those it is linked with (gossip), never by multicast. To a
router on another machine it is a client.
"""

from __future__ import annotations

import json
import logging
import os
import re
import secrets
import threading
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

import zenoh

from rosglass.errors import ArgumentError, UnsupportedError
from rosglass.wires.zenoh.options import ZenohOptions, locator

__all__ = [
    "check_process",
    "close_session",
    "is_local",
    "open_session",
    "reason",
    "router_config",
    "session_config",
]

_log = logging.getLogger("rosglass.ros2")
#: Seconds that closing a session may take; it has taken minutes with 100 nodes in one process.
_PATIENCE = 5.0
#: Pause between two attempts to connect, in milliseconds: first, and at most.
_RETRY = {"period_init_ms": 250, "period_max_ms": 500, "period_increase_factor": 2}
#: Longest time for opening a link, in milliseconds: closing a session waits for an attempt under
#: way, and three round trips over a satellite have to fit.
_OPEN_TIMEOUT_MS = 3000
#: How many parts of 64 kB of a message wait for a link of this machine to take them. Zenoh's own 2
#: make sender and link wait for each other: a 6 MB picture takes a fifth longer, and is dropped
#: where other programs need the processor. Elsewhere what waits grows old.
_WAITING = 8
#: Of two peers only one opens the link, so that their attempts do not cross (rmw_zenoh's choice).
_STRATEGY = {"peer": {"to_router": "always", "to_peer": "greater-zid"}}


def session_config(options: ZenohOptions) -> tuple[zenoh.Config, str]:
    """Return the configuration of a session, and the addresses it connects to in words.

    Raises:
        ArgumentError: The configuration file cannot be read, or Zenoh rejects it.
    """
    settings: dict[str, Any] = {
        # Opening returns at once; linking goes on in the background.
        "open/return_conditions/connect_scouted": False,
        "open/return_conditions/declares": False,
        # The cache of transient local publishers needs time stamps.
        "timestamping/enabled": True,
        # Sets the id, so that the tokens are known before the session is open. Zenoh drops
        # leading zeros.
        "id": "f" + secrets.token_hex(16)[1:],
    }
    if options.config_file is None:
        config = zenoh.Config()
        settings["mode"] = options.mode or ("peer" if is_local(options.host) else "client")
        settings["listen/endpoints"] = ["tcp/127.0.0.1:0"] if settings["mode"] == "peer" else []
        if is_local(options.host):
            settings["transport/link/tx/queue/size/data"] = _WAITING
        settings["scouting/multicast/enabled"] = False
        settings["scouting/gossip/enabled"] = True
        settings["scouting/gossip/autoconnect_strategy"] = _STRATEGY
        settings["connect/retry"] = _RETRY
        settings["transport/unicast/open_timeout"] = _OPEN_TIMEOUT_MS
        if settings["mode"] == "client":
            settings["connect/timeout_ms"] = _OPEN_TIMEOUT_MS
        settings["transport/shared_memory/enabled"] = bool(options.shared_memory)
        host = options.host or "127.0.0.1"
    else:
        config = _read(options.config_file)
        if options.mode is not None:
            settings["mode"] = options.mode
        if options.shared_memory is not None:
            settings["transport/shared_memory/enabled"] = options.shared_memory
        host = options.host or ""
    if host:
        settings["connect/endpoints"] = [locator(host, options.port)]
    for key, value in settings.items():
        config.insert_json5(key, json.dumps(value))
    return config, _endpoints(config)


def router_config(listen: str) -> zenoh.Config:
    """Return the configuration of a router that listens at a locator such as ``tcp/[::]:7447``."""
    config: zenoh.Config = zenoh.Config()
    settings: dict[str, Any] = {
        "mode": "router",
        "listen/endpoints": [listen],
        "listen/exit_on_failure": True,
        "connect/endpoints": [],
        "scouting/multicast/enabled": False,
        "scouting/gossip/enabled": True,
        "timestamping/enabled": True,
        "open/return_conditions/connect_scouted": False,
    }
    for key, value in settings.items():
        config.insert_json5(key, json.dumps(value))
    return config


def is_local(host: str | None) -> bool:
    """Return whether a host is this machine, by its name or loopback address.

    Peers on other machines listen for this machine's alone, as they do in ROS 2, and a router hands
    on nothing between peers: only a client gets anything from there.
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
            "Zenoh does not work in a fork of a process that used it: its threads did not come "
            'along; start the process anew, e.g. with multiprocessing.get_context("spawn"), or '
            "fork before connecting"
        )


#: The process that used Zenoh, and none of its forks.
_processes: set[int] = set()


def close_session(session: zenoh.Session, pause: float = 0.0) -> None:
    """Close a session, whatever state it is in; waits for that 5 s at most.

    A thread of Zenoh's own, which closing waits for, does not wait at all.

    Args:
        session: What to close.
        pause: Seconds to wait first.
    """

    def close() -> None:
        time.sleep(pause)
        _close(session)

    closing = threading.Thread(target=close, name="Zenoh closes", daemon=True)
    try:
        closing.start()
    except RuntimeError:  # the interpreter ends, and starts no more threads
        _close(session)
        return
    if isinstance(threading.current_thread(), threading._DummyThread):
        return
    closing.join(pause + _PATIENCE)
    if closing.is_alive():
        _log.warning("Zenoh still closes a session after %.0f s; it goes on without us", _PATIENCE)


def _close(session: zenoh.Session) -> None:
    with suppress(zenoh.ZError):  # one that is broken already is closed enough
        session.close()  # type: ignore[no-untyped-call]


def reason(error: zenoh.ZError) -> str:
    """Return Zenoh's words without the places in its own source."""
    return re.sub(r" at /\S+?\.rs:\d+\.?", "", str(error)).strip()


def _read(file: str) -> zenoh.Config:
    path = Path(file.removeprefix("file://"))
    try:
        config: zenoh.Config = zenoh.Config.from_file(path)
    except zenoh.ZError as error:
        raise ArgumentError(
            "ZENOH_SESSION_CONFIG_URI",
            file,
            f"a Zenoh configuration file that can be read ({path}: {reason(error)})",
        ) from error
    return config


def _endpoints(config: zenoh.Config) -> str:
    endpoints = json.loads(config.get_json("connect/endpoints"))
    if isinstance(endpoints, dict):
        endpoints = endpoints.get(json.loads(config.get_json("mode")) or "peer", [])
    return ", ".join(map(str, endpoints)) or "any address (none is configured)"
