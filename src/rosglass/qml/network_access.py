"""No network for interfaces: what a robot says must not make the operator's machine fetch anything.

Qt Quick fetches pictures, fonts, QML files and modules from any address that it finds, those in
rich text included. It does so in threads of its own, where nothing written in Python may be asked:
a thread that waits for Python's lock is waited for by the GUI thread, which has it. So Qt is given
a proxy that refuses everything. Qt asks no proxy for addresses of this machine (``localhost``).

For the same reason, nothing here may be asked which files Qt may open. What its own switches close
is closed: JavaScript's access to files, and what films fetch past all proxies.
"""

from __future__ import annotations

import logging
import os
import socket
from functools import cache
from typing import Any

from rosglass.qt import optional

__all__ = ["NETWORK_HINT", "close_network"]

_log = logging.getLogger("rosglass.qml")
#: What Qt's messages about refused requests are followed by.
NETWORK_HINT = "; the network is closed to interfaces: start with --allow-network to open it"
#: What Qt is told by the environment, where that does not say otherwise.
_CLOSED = {
    # Qt 5 lets an XMLHttpRequest read and write any file unless it is told not to, unlike Qt 6.
    "QML_XHR_ALLOW_FILE_READ": "0",
    "QML_XHR_ALLOW_FILE_WRITE": "0",
    # FFmpeg, which plays the films of Qt 6, names this list when it refuses an address.
    "QT_FFMPEG_PROTOCOL_WHITELIST": "file,others with --allow-network",
}


@cache
def close_network() -> None:
    """Let nothing that Qt loads in this process reach a network, from now on.

    JavaScript cannot read or write files, either. A proxy that the program has set itself is left
    alone.
    """
    for name, value in _CLOSED.items():
        os.environ.setdefault(name, value)
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
