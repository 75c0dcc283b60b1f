"""Service servers over DDS, for clients of every DDS implementation.

A service's replies go to all its clients, who pick their own. How, depends on the client; see
:class:`rosglass.wires.dds.service_ends.Scheme`.
"""

from __future__ import annotations

import logging
import threading
from collections import OrderedDict
from dataclasses import dataclass
from typing import TYPE_CHECKING

from rosglass.errors import TimeoutError  # noqa: A004 - the field's own word
from rosglass.wires.base import Replier, RequestId
from rosglass.wires.dds import cyclone_inline_qos, cyclone_origins
from rosglass.wires.dds.discovery_info import parse_user_data
from rosglass.wires.dds.headers import header_of, unpack, with_header, without_header
from rosglass.wires.dds.identity import UNKNOWN_GUID, Identity, Origin
from rosglass.wires.dds.service_ends import (
    PREFIX,
    REMEDY,
    Ends,
    Scheme,
    in_main_thread,
    names_of,
    scheme_of,
)

if TYPE_CHECKING:
    from rosglass.comm import EndpointInfo
    from rosglass.comm.graph import Graph
    from rosglass.wires.base import OnRequest
    from rosglass.wires.dds.cyclone_builtin import Discovered
    from rosglass.wires.dds.endpoints import Taken
    from rosglass.wires.dds.participant import Participant

__all__ = ["DdsReplier"]

_log = logging.getLogger("rosglass.ros2")
#: Seconds that a reply waits for its client's reader to be found, or to take something.
_REPLY_PATIENCE = 3.0
#: Clients whose newest request is remembered, beside those that are there.
_MAX_REMEMBERED = 1024
#: Seconds that closing waits for replies that are on their way.
_FAREWELL = 0.5


@dataclass(frozen=True)
class _Answer:
    """What a reply needs.

    Attributes:
        client: The writer of the request.
        identity: The request's identity.
        header: What its payload began with, where the reply's is to begin with it, too.
        reader: The client's reader of replies, where it told.
    """

    client: Discovered
    identity: Identity
    header: bytes = b""
    reader: bytes = b""


class DdsReplier(Replier):
    """The ends of a service server; arguments as :class:`Ends`'s.

    Attributes:
        gid: Identity of its reader of requests, by which the server is known.
    """

    def __init__(
        self,
        participant: Participant,
        graph: Graph,
        endpoint: EndpointInfo,
        on_request: OnRequest,
    ) -> None:
        self._service, self._on_request = endpoint.name, on_request
        #: Clients whose readers of replies are matched, as found out since the last change.
        self._hearing: set[bytes] = set()
        self._strangers = False
        #: The newest request of each client that was taken, by its writer; not Cyclone DDS's.
        self._newest: dict[bytes, int] = {}
        #: Origins, by their identity, of requests left to the pump: none may overtake them.
        self._left: OrderedDict[int, Origin] = OrderedDict()
        self._leaving = threading.Lock()
        self._ends = Ends(participant, graph, endpoint, self._on_requests, self._link)
        self._pump = participant.pump
        self.gid = self._ends.reader.guid
        self._ends.origins.hasten(self._hasten)
        self._ends.start()

    @property
    def problem(self) -> str:  # type: ignore[override]
        """Why some clients in the graph cannot be served."""
        strangers = self._ends.strangers()
        reason = cyclone_origins.problem() or cyclone_inline_qos.problem()
        if not strangers or not reason:
            return ""
        return f"{names_of(strangers)} cannot be answered: {reason}; {REMEDY}"

    def reply(self, request: RequestId, data: bytes | bytearray) -> None:
        """Answer a request, once the client can hear it; a client that is gone is no error."""
        answer = request.handle
        if not isinstance(answer, _Answer):
            return

        def expired() -> None:
            who = self._ends.who(answer.client.guid)
            text = "%s did not get its reply: its reader of replies is not found, or takes nothing"
            self._ends.name(answer.client.guid, text, who)

        self._ends.outbox.put(
            lambda: self._answer(answer, data),
            _REPLY_PATIENCE,
            expired,
            # See cyclone_inline_qos.create_topic() for what the main thread must not do.
            now=not in_main_thread(),
        )

    def close(self) -> None:
        """Withdraw the server."""
        self._ends.origins.hasten(None)
        if not self._pump.current:
            self._ends.outbox.drain(_FAREWELL)
        self._ends.close()

    def _hasten(self, origin: Origin, data: bytes | memoryview) -> bool:
        """Take a request while it is received; return False when it should come again later."""
        guid = origin.guid
        client = self._ends.writers.by_guid.get(guid)
        odd = client is None or (scheme_of(guid) is Scheme.HEADER and unpack(data) is None)
        with self._leaving:
            if odd or client is None or self._left or not self.quick:
                self._left[id(origin)] = origin
                return False
        try:
            self._take(client, data, origin)
        except Exception:
            _log.exception("%s: a request is lost", self._service)
        return True

    def _on_requests(self, taken: list[Taken]) -> None:
        for data, _, handle, told in taken:
            client, origin = self._ends.sender(handle, told)
            if origin is not None and origin.taken:
                continue
            try:
                if client is not None:
                    self._take(client, data, origin)
                else:
                    _log.error("%s: a request is lost: who sent it is gone", self._service)
            except Exception:
                _log.exception("%s: a request is lost", self._service)
            if origin is not None:
                self._has_come(origin)

    def _has_come(self, origin: Origin) -> None:
        """Wait no longer for a request that was left, nor for those before it, which are lost."""
        with self._leaving:
            waiting, gone = len(self._left), 0
            if id(origin) not in self._left:
                return
            while self._left.popitem(last=False)[0] != id(origin):
                gone += 1
        if gone and waiting > self._ends.depth:
            text = "%s: %d requests are lost, as more than %d waited"
            _log.error(text, self._service, gone, self._ends.depth)

    def _take(self, client: Discovered, data: bytes | memoryview, origin: Origin | None) -> None:
        if scheme_of(client.guid) is Scheme.HEADER:
            header = unpack(data)
            if header is None:
                text = "ignoring a request of %s, which is too short for its header: %d bytes"
                self._ends.name(client.guid, text, self._ends.who(client.guid), len(data))
                return
            kept = header_of(data)
            sequence = 0 if origin is None else origin.sequence
            answer = _Answer(client, Identity(client.guid, sequence), kept)
            self._on_request(RequestId(client.guid, header[1], answer), without_header(data))
        elif origin is None:
            text = "cannot answer %s: %s; %s"
            why = cyclone_origins.problem() or "its requests have no identity"
            self._ends.name(client.guid, text, self._ends.who(client.guid), why, REMEDY)
        elif origin.sequence > self._newest.get(client.guid, 0):
            # A client that was out of reach and is back sends what it holds once more.
            self._newest[client.guid] = origin.sequence
            given = origin.related
            reader = b"" if given is None or given.guid == UNKNOWN_GUID else given.guid
            identity = Identity(reader or client.guid, origin.sequence)
            answer = _Answer(client, identity, reader=reader)
            self._on_request(RequestId(client.guid, origin.sequence, answer), data)

    def _answer(self, answer: _Answer, data: bytes | bytearray) -> bool:
        """Send a reply; return whether nothing more is to be done for it."""
        if not self._hears(answer):
            # Its coming may not have been told yet.
            self._ends.look()
        writer = self._ends.writer
        if writer is None or not self._hears(answer):
            # A reply to a reader that is not matched yet would be lost.
            return answer.client not in self._ends.writers.all
        parts = with_header(data, answer.header) if answer.header else (data,)
        try:
            if answer.header and not self._strangers:
                writer.write(parts)
            elif not cyclone_inline_qos.write(writer, answer.identity, parts) and not answer.header:
                who = self._ends.who(answer.client.guid)
                text = "%s did not get its reply: Cyclone DDS sent it without identity; %s"
                self._ends.name(answer.client.guid, text, who, REMEDY)
        except TimeoutError:
            return False
        return True

    def _link(self) -> None:
        """Take note of the clients that are there now."""
        self._hearing = set()
        readers = () if self._ends.readers is None else self._ends.readers.all
        if len(self._newest) > _MAX_REMEMBERED:
            here = self._ends.writers.by_guid
            self._newest = {guid: last for guid, last in self._newest.items() if guid in here}
        # RustDDS's clients fail when they get a reply without identity, whosever it is.
        self._strangers = not cyclone_inline_qos.problem() and any(
            scheme_of(found.guid) is Scheme.IDENTITY for found in readers
        )

    def _hears(self, answer: _Answer) -> bool:
        """Return whether the client's reader of replies is matched."""
        hearing = self._hearing
        key = answer.reader or answer.client.guid
        if key in hearing:
            return True
        readers = () if self._ends.readers is None else self._ends.readers.all
        if answer.reader:
            heard = any(found.guid == answer.reader for found in readers)
        else:
            client = _client_of(answer.client)
            heard = any(_client_of(found) == client for found in readers)
        if heard:
            hearing.add(key)
        return heard


def _client_of(found: Discovered) -> str | bytes:
    """Return what a client's reader and writer have in common."""
    return parse_user_data(found.user_data).get("clientid") or found.guid[:PREFIX]
