"""Why a router that can be reached refuses a session: users, passwords, TLS and certificates.

Zenoh logs the reason at most, and tries again for ever. This connects once more, and looks at what
the router answers to the first message of a session without a user, or to a TLS handshake by
Python's own TLS.

Message formats: ``InitSyn``, ``InitAck`` and ``Close`` of Zenoh's transport protocol, version 9,
each with its length in two bytes.
"""

from __future__ import annotations

import json
import os
import re
import socket
import ssl
import time
from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import zenoh

from rosglass.wires.zenoh.session import close_session, endpoints, open_session, session_config

if TYPE_CHECKING:
    from rosglass.wires.zenoh.options import ZenohOptions

__all__ = ["find_refusal"]

_LOCATOR = re.compile(r"(tcp|tls)/(?:\[([^\]]+)\]|([^:\[\]]+)):(\d+)\Z")
_VERSION, _CLIENT_WITH_LONG_ID = 0x09, 0xF2
_INIT, _CLOSE, _MESSAGE = 0x01, 0x03, 0x1F
#: How a TLS alert begins.
_TLS_ALERT = b"\x15\x03"
#: Longest answer to read in bytes.
_MAX_ANSWER = 4096
_CA = "?ca=FILE, the certificate of its authority,"


_Refusal = tuple[str, str]
_WRONG_USER: _Refusal = "refuses the user", "correct the user's name or password"
#: Seconds that opening a session may take.
_OPEN_TIMEOUT_S = 3.0


def find_refusal(options: ZenohOptions, timeout: float, *, tries: bool = True) -> _Refusal | None:
    """Return why the routers of a session's configuration refuse it.

    Connects to each of its addresses.

    Args:
        options: The session's.
        timeout: Seconds to wait for each answer.
        tries: Whether to open a session to see if its password is right; false if sessions with it
            fail.

    Returns:
        The reason of the first router that refuses, and what to change; None if no router does, or
        if none can be reached.
    """
    config, _ = session_config(replace(options, mode="client"))
    for endpoint in endpoints(config):
        match = _LOCATOR.match(endpoint)
        if match is None:
            continue  # another protocol
        probe = _Probe(config, match[2] or match[3], int(match[4]), timeout)
        with suppress(OSError, UnicodeError):  # it cannot be reached
            found = probe.refusal_of_tls() if match[1] == "tls" else probe.refusal()
            if found is None or (found is _WRONG_USER and tries and not _is_rejected(config)):
                continue
            return f"the router at {endpoint} {found[0]}", found[1]
    return None


def _is_rejected(config: zenoh.Config) -> bool:
    """Return whether a session with the configuration's user is rejected: not late, not opened."""
    config.insert_json5("connect/timeout_ms", "0")  # one attempt
    config.insert_json5("transport/unicast/open_timeout", str(int(_OPEN_TIMEOUT_S * 1000)))
    began = time.monotonic()
    try:
        close_session(open_session(config))
    except zenoh.ZError:
        return time.monotonic() - began < 0.9 * _OPEN_TIMEOUT_S
    return False


class _Probe:
    """Connections to a router.

    Args:
        config: The session's configuration.
        host: The router's host.
        port: Its port.
        timeout: Seconds to wait for each answer.
    """

    def __init__(self, config: zenoh.Config, host: str, port: int, timeout: float) -> None:
        self._host, self._port, self._timeout = host, port, timeout
        self._user = json.loads(config.get_json("transport/auth/usrpwd/user")) or ""
        self._tls: dict[str, Any] = json.loads(config.get_json("transport/link/tls"))

    def refusal(self) -> _Refusal | None:
        """Return why the router refuses a session over TCP; None if it does not.

        Raises:
            OSError: It cannot be reached, or does not answer.
        """
        with self._connect() as sock:
            answer = self._begin_session(sock)
        if answer.startswith(_TLS_ALERT):
            return (
                "expects TLS",
                f"add {_CA} to the URL, or ?tls=true if it is a public authority's",
            )
        return self._explain(answer)

    def refusal_of_tls(self) -> _Refusal | None:
        """Return why the router refuses a session over TLS; None if it does not.

        Raises:
            OSError: It cannot be reached, or does not answer.
        """
        try:
            context = self._context()
        except ValueError as error:
            return f"is not reached, as a file is invalid: {error}", "correct the file"
        with self._connect() as sock:
            try:
                secured = context.wrap_socket(sock, server_hostname=self._host)
            except ssl.SSLCertVerificationError as error:
                return self._explain_certificate(error.verify_message.rstrip("."))
            except (TimeoutError, ssl.SSLError):
                # A plain router takes the handshake for the beginning of a long message.
                with self._connect() as plain:
                    if self._message(self._begin_session(plain)) in (_INIT, _CLOSE):
                        return "does not speak TLS", "leave out tls, ca, cert and key"
                raise
            with secured:
                try:
                    return self._explain(self._begin_session(secured))
                except ssl.SSLError as error:
                    if "CERTIFICATE_REQUIRED" in str(error):
                        return (
                            "asks for a certificate",
                            "add cert=FILE&key=FILE to the URL's options",
                        )
                    return (
                        f"refuses this program's certificate ({_text(error)})",
                        "have it signed by the router's authority",
                    )

    def _connect(self) -> socket.socket:
        return socket.create_connection((self._host, self._port), self._timeout)

    def _begin_session(self, sock: socket.socket) -> bytes:
        """Send a session's first message, without user; return the answer."""
        message = bytes([_INIT, _VERSION, _CLIENT_WITH_LONG_ID]) + os.urandom(16)
        sock.sendall(len(message).to_bytes(2, "little") + message)
        return sock.recv(_MAX_ANSWER)

    def _message(self, answer: bytes) -> int:
        return answer[2] & _MESSAGE if len(answer) > 2 else 0

    def _explain(self, answer: bytes) -> _Refusal | None:
        """Return the meaning for this session of the answer to one without a user."""
        message = self._message(answer)
        if message == _CLOSE:
            if not self._user:
                return "asks for a user and a password", "connect to zenoh://USER:PASSWORD@HOST"
            return _WRONG_USER
        if message == _INIT and self._user:
            return "has no users, and refuses sessions with one", f"leave out {self._user!r}"
        return None

    def _explain_certificate(self, reason: str) -> _Refusal:
        if "match" in reason or "not valid for" in reason:
            return f"has a certificate for another host ({reason})", "use the name that it is for"
        if "expired" in reason or "not yet valid" in reason:
            return (
                f"has a certificate that is not valid now ({reason})",
                "renew it, or correct a clock",
            )
        given = self._tls["root_ca_certificate"]
        fix = f"{given} is not that of its authority" if given else f"add {_CA} to the URL"
        return f"has a certificate that is not trusted ({reason})", fix

    def _context(self) -> ssl.SSLContext:
        """Return Python's TLS settings for the session's; raises ValueError for a bad file."""
        settings = self._tls
        authority, certificate = settings["root_ca_certificate"], settings["connect_certificate"]
        try:
            context = ssl.create_default_context(cafile=authority)
        except OSError as error:
            raise ValueError(f"{authority}: {_text(error)}") from None
        try:
            if certificate and settings["connect_private_key"]:
                context.load_cert_chain(certificate, settings["connect_private_key"])
        except OSError as error:
            raise ValueError(f"{certificate} and its key: {_text(error)}") from None
        if settings["verify_name_on_connect"] is False:
            context.check_hostname = False
        return context


def _text(error: OSError) -> str:
    if isinstance(error, ssl.SSLError) and error.reason:
        return error.reason.replace("_", " ").lower()
    return error.strerror or str(error)
