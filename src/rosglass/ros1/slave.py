"""What a node answers the master and other nodes: the slave API.

API: ROS wiki, "ROS/Slave_API"; getBusStats and getBusInfo as ``rosnode info`` reads them.
"""

from __future__ import annotations

import logging
import os
import socketserver
import threading
import xmlrpc.server
from typing import TYPE_CHECKING, Any, Protocol

from rosglass.ros1.address import is_loopback

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = ["Slave", "SlaveApi"]

_log = logging.getLogger("rosglass.ros1")
_MOST_BYTES = 10_000_000


class SlaveApi(Protocol):
    """What is asked; called on threads of the server's."""

    def bus_info(self) -> list[list[Any]]:
        """Return a list for each connection."""

    def bus_stats(self) -> list[Any]:
        """Return statistics of publishers, subscriptions and services."""

    def master_uri(self) -> str:
        """Return the master's URI."""

    def published(self) -> list[list[str]]:
        """Return topic and type of all that is published."""

    def subscribed(self) -> list[list[str]]:
        """Return topic and type of all that is subscribed."""

    def shut_down(self, caller: str, reason: str) -> None:
        """End the node, because somebody else says so."""

    def parameter_changed(self, name: str, value: Any) -> None:
        """Take a parameter that was subscribed to."""

    def publishers_changed(self, topic: str, uris: list[str]) -> None:
        """Take the publishers that a topic has now."""

    def request_topic(self, topic: str, protocols: list[Any]) -> list[Any]:
        """Return how to connect to a published topic; raises KeyError when it is not."""


class _Handler(xmlrpc.server.SimpleXMLRPCRequestHandler):
    protocol_version = "HTTP/1.1"
    rpc_paths = ()
    timeout = 30

    def log_message(self, *_: Any) -> None:
        """Write nothing to standard error."""

    def do_POST(self) -> None:  # noqa: N802 - named by the standard library
        """Answer a call, unless it is of a length that no call has."""
        length = self.headers.get("content-length", "")
        if not length.isdigit() or int(length) > _MOST_BYTES:
            self.send_error(400, "no content length, or too large")
            self.close_connection = True
            return
        super().do_POST()


class _Server(socketserver.ThreadingMixIn, xmlrpc.server.SimpleXMLRPCServer):
    daemon_threads = True
    block_on_close = False
    request_queue_size = 128

    def handle_error(self, *_: Any) -> None:
        """Log, instead of writing to standard error: somebody went away, or sent garbage."""
        _log.debug("a call of the node's API failed", exc_info=True)


class Slave:
    """Serves the slave API on a port of its own, on daemon threads.

    Args:
        api: Who answers.
        address: Host under which others reach this node.
        port: To listen on; 0 for any.

    Attributes:
        uri: Where it is reached.
    """

    def __init__(self, api: SlaveApi, address: str, port: int = 0) -> None:
        self._api = api
        place = "127.0.0.1" if is_loopback(address) else ""
        self._server = _Server((place, port), _Handler, False, True, None)
        self.uri = f"http://{address}:{self._server.server_address[1]}/"
        for name, method in (
            ("getBusStats", lambda _: api.bus_stats()),
            ("getBusInfo", lambda _: api.bus_info()),
            ("getMasterUri", lambda _: api.master_uri()),
            ("getPid", lambda _: os.getpid()),
            ("getSubscriptions", lambda _: api.subscribed()),
            ("getPublications", lambda _: api.published()),
            ("shutdown", self._shutdown),
            ("paramUpdate", self._parameter_changed),
            ("publisherUpdate", self._publishers_changed),
            ("requestTopic", lambda _, topic, protocols: api.request_topic(topic, protocols)),
        ):
            self._server.register_function(_answering(name, method), name)
        self._thread = threading.Thread(
            target=self._server.serve_forever, kwargs={"poll_interval": 0.5}, daemon=True
        )
        self._thread.name = "slave API"
        self._thread.start()

    def close(self) -> None:
        """Answer nothing any more; safe to call twice."""
        # From another thread: one of the server's own may be the one that closes the node.
        threading.Thread(target=self._stop, daemon=True).start()

    def _stop(self) -> None:
        self._server.shutdown()
        self._server.server_close()

    def _shutdown(self, caller: str, reason: str = "") -> int:
        self._api.shut_down(str(caller), str(reason))
        return 0

    def _parameter_changed(self, _: str, name: str, value: Any) -> int:
        self._api.parameter_changed(str(name), value)
        return 0

    def _publishers_changed(self, _: str, topic: str, uris: list[str]) -> int:
        self._api.publishers_changed(str(topic), [str(uri) for uri in uris])
        return 0


def _answering(name: str, method: Callable[..., Any]) -> Callable[..., list[Any]]:
    """Return `method` with its answers as ROS has them."""

    def answer(*arguments: Any) -> list[Any]:
        try:
            return [1, "", method(*arguments)]
        except (TypeError, ValueError, KeyError) as error:
            return [-1, f"{name}: {error}", 0]
        except Exception as error:
            _log.exception("%s failed", name)
            return [0, f"{name} failed: {error}", 0]

    return answer
