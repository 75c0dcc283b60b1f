"""Files that robots and markers name, from where they are: this machine, web servers, the robot.

What RViz's ``resource_retriever`` fetches: ``http:`` and ``https:`` (libcurl), and in ROS 2 what a
node serves: ``/rviz/get_resource`` (Kilted) for URIs whose file is not here, and
``service://NAME:PATH`` (Lyrical). RViz waits for these in the GUI thread; here it is the scene's.
"""

from __future__ import annotations

import hashlib
import http.client
import logging
import os
import posixpath
import threading
import time
import urllib.error
import urllib.request
from collections import OrderedDict, deque
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple
from urllib.parse import quote, urlsplit, urlunsplit

from rosglass.errors import Error, UnsupportedError
from rosglass.interfaces.type_descriptions import system_cache_folder
from rosglass.qml.engine.process import NETWORK_HINT, is_network_closed
from rosglass.scene.data.meshes import read_mesh_file
from rosglass.scene.data.resources import ResourceError, forget_packages, locate_resource, make_room

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.comm.node import Node
    from rosglass.comm.service_client import ServiceClient

__all__ = ["ResourceRetriever"]

_log = logging.getLogger("rosglass.scene")

#: The service by which a robot with ROS 2 Kilted provides files, and its type.
_SERVICE, _SERVICE_TYPE = "/rviz/get_resource", "rviz_resource_interfaces/srv/GetResource"
#: ``status_code`` of its response.
_OK, _NOT_MODIFIED = 1, 2
#: Bytes of one file, and of all copies in the cache.
_MAX_BYTES, _MAX_CACHE_BYTES = 256 << 20, 512 << 20
#: Seconds for a connection or the next bytes, for a whole file, and for a server to appear.
_READ_TIMEOUT_S, _FETCH_TIMEOUT_S, _APPEAR_TIMEOUT_S = 5.0, 60.0, 2.0
#: Seconds for which the outcome for a URI is not asked for again, and how many are remembered.
_REMEMBER_S, _MAX_REMEMBERED = 60.0, 1000
#: Servers that may fail to answer within a minute until no others are tried; and seconds for which
#: such a server has kept the others waiting, unlike one that refuses the connection.
_MAX_FAILURES, _FAILURES_S, _SLOW_S = 3, 60.0, 1.0
#: Bytes of a file that are kept in memory until it is asked for again, e.g. by another link.
_MAX_KEPT_BYTES = 64 << 20
_MAX_CLIENTS = 8
_CHUNK_BYTES = 1 << 16
#: End of the reason where a server may answer later.
_LATER = "; it is retried later, or at once by Reset"


class _Unanswered(Exception):  # noqa: N818 - never leaves this file
    """A server did not answer, or not completely."""


class _NotOffered(_Unanswered):
    """No node offers the robot's service; few robots do, so that it counts as no failure."""


class _Outcome(NamedTuple):
    """The result of fetching a URI.

    Attributes:
        until: Time of the next attempt, by :func:`time.monotonic`.
        data: The bytes; None if they could not be fetched.
        error: The reason; empty if they were fetched.
    """

    until: float
    data: bytes | None
    error: str


class _Copies:
    """Files fetched before, with the servers' version of each; what fails only costs time."""

    def __init__(self) -> None:
        self._folder = Path(system_cache_folder("resources"))

    def _path(self, uri: str) -> Path:
        return self._folder / hashlib.blake2b(uri.encode(), digest_size=20).hexdigest()

    def etag(self, uri: str) -> str:
        """Return the version of a copy; empty without one."""
        try:
            with self._path(uri).open("rb") as file:
                return file.readline(2000).decode().rstrip("\n")
        except (OSError, UnicodeDecodeError):
            return ""

    def get(self, uri: str) -> bytes | None:
        """Return a copy; None without one."""
        path = self._path(uri)
        try:
            data = path.read_bytes()
            os.utime(path)  # the oldest files make room for new ones
        except OSError:
            return None
        return data.partition(b"\n")[2]

    def put(self, uri: str, etag: str, data: bytes) -> None:
        """Keep a file, if its server says which version it is."""
        if not etag or "\n" in etag or len(etag) > 1000:
            return
        path = self._path(uri)
        part = path.with_name(f"{path.name}.{os.getpid()}.{threading.get_ident()}")
        try:
            self._folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            make_room(self._folder, len(data), _MAX_CACHE_BYTES)
            # Other processes see either the whole file or none.
            part.write_bytes(etag.encode() + b"\n" + data)
            part.replace(path)
        except OSError as error:
            _log.info("files of robots are not kept in %s: %s", self._folder, error)
            with suppress(OSError):
                part.unlink()


class _Redirects(urllib.request.HTTPRedirectHandler):
    """Follows a web server to other web servers only."""

    def redirect_request(
        self, req: Any, fp: Any, code: int, msg: str, headers: Any, newurl: str
    ) -> Any:
        if urlsplit(newurl).scheme not in {"http", "https"}:
            raise ResourceError(f"the server redirects to {newurl}, which is not a web server")
        return super().redirect_request(req, fp, code, msg, headers, newurl)


class ResourceRetriever:
    """Finds the files that robots and markers name, and fetches those that are elsewhere.

    A file has 256 MiB at most and arrives within 60 s. The outcome is remembered for a minute, and
    after three servers without an answer no other is tried for a minute: all of them wait for each
    other in the scene's thread. :meth:`ask_again` asks those that have not answered.

    Args:
        node: Node whose graph has the services; None for no node.
    """

    def __init__(self, node: Node | None = None) -> None:
        self._node = node
        self._copies = _Copies()
        self._clients: OrderedDict[str, ServiceClient] = OrderedDict()
        self._outcomes: OrderedDict[str, _Outcome] = OrderedDict()
        self._failures: deque[float] = deque(maxlen=_MAX_FAILURES)
        #: URIs whose servers have not answered.
        self._unanswered: OrderedDict[str, None] = OrderedDict()
        #: Until when the robot's service is known to be missing, by :func:`time.monotonic`.
        self._missing_until = 0.0
        self._closed = self._retries = False

    def find(self, uri: str) -> Path | bytes:
        """Return the path of a file on this machine, or the bytes of one that is elsewhere.

        Waits for servers: not for the GUI thread.

        Args:
            uri: ``package://name/path``, ``file:///path``, ``http://...``, ``https://...``,
                ``service://name:path`` or a path.

        Raises:
            ResourceError: There is no such file, or it could not be fetched.
            UnsupportedError: The URI has another scheme, or the network is closed.
            ArgumentError: The URI is not a string, or is empty.
        """
        text = uri.strip() if isinstance(uri, str) else ""
        scheme = text.partition(":")[0].lower()
        if _is_web(text):
            if is_network_closed():
                raise UnsupportedError(f"{text}: it is not fetched{NETWORK_HINT}")
            return self._remembered(text, self._fetch)
        if scheme == "service":
            return self._remembered(text, self._call)
        try:
            return locate_resource(uri)
        except (ResourceError, UnsupportedError) as error:
            if self._node is None or "://" not in text or not self._has_services():
                raise
            try:
                return self._remembered(text, self._call)
            except ResourceError as other:
                reason = _plain(other, text)
                raise ResourceError(f"{error}; nor does the robot serve it: {reason}") from None

    def read(self, uri: str) -> bytes:
        """Return the bytes of a file, wherever it is; raises as :meth:`find` does, or MeshError."""
        found = self.find(uri)
        return found if isinstance(found, bytes) else read_mesh_file(os.fspath(found), uri)

    def retry(self) -> None:
        """Retry missing or unfetched files when they are next requested; from any thread."""
        self._retries = True
        forget_packages()

    @property
    def is_waiting(self) -> bool:
        """True while servers have not answered."""
        return bool(self._unanswered)

    def ask_again(self) -> list[str]:
        """Ask each server that has not answered for one of its files again.

        Waits for servers: not for the GUI thread.

        Returns:
            The URIs of all files of servers that answer now; they can be read again.
        """
        servers: dict[str, list[str]] = {}
        for uri in self._unanswered:
            servers.setdefault(_server_of(uri), []).append(uri)
        self._missing_until = 0.0
        found = []
        for uris in servers.values():
            first = uris[0]
            self._outcomes.pop(first, None)
            with suppress(ResourceError):
                self._remembered(first, self._fetch if _is_web(first) else self._call)
            if first not in self._unanswered:
                for uri in uris[1:]:
                    self._unanswered.pop(uri, None)
                    self._outcomes.pop(uri, None)
                found += uris
        return found

    def close(self) -> None:
        """Stop asking services; safe to call twice."""
        self._closed = True
        while self._clients:
            self._clients.popitem()[1].close()

    # -- outcomes --------------------------------------------------------------------------------

    def _remembered(self, uri: str, fetch: Callable[[str], bytes]) -> bytes:
        """Return a file, if need be after fetching it, or raise the error of the last attempt."""
        now = time.monotonic()
        if self._retries:
            self._retries, self._missing_until = False, 0.0
            self._unanswered.clear()
            for one in [one for one, found in self._outcomes.items() if found.data is None]:
                del self._outcomes[one]
        known = self._outcomes.get(uri)
        if known is None or known.until < now:
            known = self._attempt(uri, fetch)
            self._outcomes[uri] = known
            self._outcomes.move_to_end(uri)
            self._forget()
        if known.data is None:
            raise ResourceError(f"{uri}: {known.error}")
        return known.data

    def _attempt(self, uri: str, fetch: Callable[[str], bytes]) -> _Outcome:
        data, error = None, ""
        now = time.monotonic()
        self._unanswered[uri] = None
        if len(self._unanswered) > _MAX_REMEMBERED:
            self._unanswered.popitem(last=False)
        if len(self._failures) == _MAX_FAILURES and now - self._failures[0] < _FAILURES_S:
            error = (
                f"it is not requested: {_MAX_FAILURES} servers have not answered within the last "
                f"{_FAILURES_S:g} s{_LATER}"
            )
            return _Outcome(self._failures[0] + _FAILURES_S, None, error)
        try:
            data = fetch(uri)
        except _Unanswered as reason:
            if time.monotonic() - now > _SLOW_S and not isinstance(reason, _NotOffered):
                self._failures.append(time.monotonic())
            return _Outcome(time.monotonic() + _REMEMBER_S, None, f"{reason}{_LATER}")
        except (Error, ValueError) as reason:  # the latter for an invalid URL
            error = _plain(reason, uri)
        self._unanswered.pop(uri, None)
        return _Outcome(time.monotonic() + _REMEMBER_S, data, error)

    def _forget(self) -> None:
        kept = sum(len(one.data or b"") for one in self._outcomes.values())
        while len(self._outcomes) > 1 and (
            kept > _MAX_KEPT_BYTES or len(self._outcomes) > _MAX_REMEMBERED
        ):
            kept -= len(self._outcomes.popitem(last=False)[1].data or b"")

    # -- web servers -----------------------------------------------------------------------------

    def _fetch(self, uri: str) -> bytes:
        parts = urlsplit(uri)
        path = posixpath.normpath(parts.path) if "/.." in parts.path else parts.path
        url = quote(urlunsplit(parts._replace(path=path)), safe="%/:=&?~#+!$,;'@()*[]")
        request = urllib.request.Request(url, headers={"User-Agent": "rosglass"})
        etag = self._copies.etag(uri)
        if etag:
            request.add_header("If-None-Match", etag)
        try:
            opener = urllib.request.build_opener(_Redirects)
            with opener.open(request, timeout=_READ_TIMEOUT_S) as response:
                data = self._receive(response)
                self._copies.put(uri, response.headers.get("ETag", ""), data)
                return data
        except urllib.error.HTTPError as error:
            kept = self._copies.get(uri) if error.code == http.HTTPStatus.NOT_MODIFIED else None
            if kept is not None:
                return kept
            answer = f"the server answers {error.code} {error.reason}"
            if error.code >= http.HTTPStatus.INTERNAL_SERVER_ERROR:
                raise _Unanswered(answer) from None
            raise ResourceError(answer) from None
        except (TimeoutError, urllib.error.URLError) as error:
            reason = getattr(error, "reason", error)
            raise _Unanswered(f"the server cannot be reached: {reason}") from None
        except OSError as error:
            raise _Unanswered(f"the connection was lost: {error}") from None
        except (ValueError, http.client.HTTPException) as error:
            raise ResourceError(f"it cannot be fetched: {type(error).__name__}: {error}") from None

    def _receive(self, response: Any) -> bytes:
        size = int(response.headers.get("Content-Length") or 0)
        _check_size(size)
        deadline = time.monotonic() + _FETCH_TIMEOUT_S
        chunks, received = [], 0
        while chunk := response.read1(_CHUNK_BYTES):
            received += len(chunk)
            _check_size(received)
            if self._closed:
                raise ResourceError("the view was closed")
            if time.monotonic() > deadline:
                raise _Unanswered(f"only {received} bytes arrived within {_FETCH_TIMEOUT_S:g} s")
            chunks.append(chunk)
        if received < size:
            raise _Unanswered(f"the server sent {received} of {size} bytes")
        return b"".join(chunks)

    # -- services --------------------------------------------------------------------------------

    def _has_services(self) -> bool:
        """Return whether robots serve files: in ROS 2."""
        return self._node is not None and not hasattr(self._node, "parameter_server")

    def _call(self, uri: str) -> bytes:
        service, path, kind = _SERVICE, uri, _SERVICE_TYPE
        if uri.lower().startswith("service:"):
            # RViz takes the type of the package resource_retriever_interfaces.
            service, colon, path = uri.partition("://")[2].partition(":")
            kind = ""
            if not service or not colon or ":" in path:
                raise ResourceError("expected service://NAME:PATH")
        if not self._has_services():
            raise UnsupportedError("files of services are ROS 2's, and there is no such node")
        client = self._client(service, kind)
        etag = self._copies.etag(uri)
        try:
            response = client.call({"path": path, "etag": etag}, timeout=_FETCH_TIMEOUT_S)
        except Error as error:
            raise _Unanswered(str(error)) from None
        return self._take(uri, service, response)

    def _take(self, uri: str, service: str, response: Any) -> bytes:
        if not all(name in response for name in ("status_code", "error_reason", "etag", "body")):
            raise ResourceError(f"the service {service} is not of type GetResource")
        if response.status_code == _NOT_MODIFIED:
            kept = self._copies.get(uri)
            if kept is not None:
                return kept
        if response.status_code != _OK:
            reason = response.error_reason or f"status {response.status_code}"
            raise ResourceError(f"the service {service} does not have it: {reason}")
        data = bytes(response.body)
        _check_size(len(data))
        self._copies.put(uri, response.etag, data)
        return data

    def _client(self, service: str, kind: str) -> ServiceClient:
        """Return a client of a service that is there."""
        assert self._node is not None
        missing = f"no node offers the service {service}"
        if service == _SERVICE and time.monotonic() < self._missing_until:
            raise _NotOffered(missing)
        client = self._clients.get(service)
        if client is None:
            client = self._node.create_service_client(service, kind or None)
            self._clients[service] = client
            if len(self._clients) > _MAX_CLIENTS:
                self._clients.popitem(last=False)[1].close()
        if client.wait_for_server(_APPEAR_TIMEOUT_S):
            return client
        if service != _SERVICE:
            raise _Unanswered(missing)
        self._missing_until = time.monotonic() + _REMEMBER_S
        raise _NotOffered(missing)


def _is_web(uri: str) -> bool:
    return uri.lower().startswith(("http:", "https:"))


def _server_of(uri: str) -> str:
    """Return a name of the server that a file is asked of."""
    if _is_web(uri):
        return uri.partition("://")[2].partition("/")[0]
    return uri.split(":")[1] if uri.lower().startswith("service:") else _SERVICE


def _check_size(size: int) -> None:
    if size > _MAX_BYTES:
        raise ResourceError(f"{size} bytes; the limit is {_MAX_BYTES}")


def _plain(error: Exception, uri: str) -> str:
    """Return an error without the URI that it begins with."""
    return str(error).removeprefix(f"{uri}: ")
