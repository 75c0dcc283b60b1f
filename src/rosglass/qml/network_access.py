"""No network for interfaces: what a robot says must not make the operator's machine fetch anything.

Qt Quick fetches pictures, fonts, QML files and modules from any address that it finds, those in
rich text included. It does so in threads of its own, where nothing written in Python may be asked:
a thread that waits for Python's lock is waited for by the GUI thread, which has it. So Qt is given
a proxy that refuses everything. Qt asks no proxy for addresses of this machine (``localhost``).
"""

from __future__ import annotations

import logging
import socket
from functools import cache
from typing import Any

from rosglass.qt import optional

__all__ = ["NETWORK_HINT", "close_network"]

_log = logging.getLogger("rosglass.qml")
#: What Qt's messages about refused requests are followed by.
NETWORK_HINT = "; the network is closed to interfaces: start with --allow-network to open it"


@cache
def close_network() -> None:
    """Let nothing that Qt loads in this process reach a network, from now on.

    A proxy that the program has set itself is left alone.
    """
    network: Any = optional("QtNetwork")
    if network is None:
        _log.warning(
            "the network is open to interfaces, for Qt's QtNetwork is missing; on Debian: "
            "sudo apt install python3-pyside2.qtnetwork"
        )
        return
    proxy = network.QNetworkProxy
    kinds = proxy.ProxyType
    if proxy.applicationProxy().type() in (kinds.DefaultProxy, kinds.NoProxy):
        proxy.setApplicationProxy(proxy(kinds.Socks5Proxy, "127.0.0.1", _refusing_port()[1]))


@cache
def _refusing_port() -> tuple[socket.socket, int]:
    """Return a port of this machine that refuses all, and its socket, which keeps it that way."""
    closed = socket.socket()
    # It never listens, and nothing else can as long as it is bound.
    closed.bind(("127.0.0.1", 0))
    return closed, closed.getsockname()[1]
