"""Publishing on a ROS 2 topic."""

from __future__ import annotations

import logging
import os
from typing import TYPE_CHECKING, Any

from rosglass.comm import EndpointKind, Publisher
from rosglass.errors import ConversionError, NodeClosedError
from rosglass.ros2.core import Member

if TYPE_CHECKING:
    from rosglass.comm import EndpointInfo, QoS
    from rosglass.messages import Message, MessageType
    from rosglass.ros2.core import Core

__all__ = ["Ros2Publisher"]

_log = logging.getLogger("rosglass.ros2")
#: Tells `publish()` from `publish(None)`.
_NO_MESSAGE: Any = object()


class Ros2Publisher(Publisher, Member):
    """A publisher; made by :meth:`Node.create_publisher`."""

    def __init__(self, core: Core, topic: str, type: MessageType, qos: QoS) -> None:
        self.topic, self.type, self.qos = topic, type, qos
        self._core = core
        self._hash = type.rihs01
        self._closed = False
        self._process = os.getpid()
        self._warned: set[EndpointInfo] = set()
        self._writer = core.middleware.create_writer(core.name, topic, type.name, self._hash, qos)
        core.add(self)
        self._writer.match(self._matching())

    def publish(self, message: Message | dict[str, Any] = _NO_MESSAGE, /, **fields: Any) -> None:
        """Encode and send a message; see :meth:`rosglass.comm.Publisher.publish`."""
        if message is not _NO_MESSAGE and fields:
            raise ConversionError(
                "", fields, "either a message or keyword fields, not both", self.type.name
            )
        self._check_open()
        if message is None:
            # Most likely a function that forgot its return: it must not become a zero command.
            raise ConversionError("", None, "a message, a dict or keyword fields", self.type.name)
        value = fields if message is _NO_MESSAGE else message
        self._writer.write(self.type.encode(value, wire="cdr"))

    def publish_serialized(self, data: bytes | bytearray | memoryview) -> None:
        """Send `data`, which starts with its 4-byte encapsulation header, unchanged."""
        self._check_open()
        if not isinstance(data, (bytes, bytearray, memoryview)):
            raise ConversionError("", data, "bytes, a bytearray or a memoryview", self.type.name)
        # Copied: the caller may reuse its buffer at once.
        payload = bytes(data)
        if len(payload) < 4 or payload[0] != 0:
            raise ConversionError(
                "", payload, "CDR bytes with their 4-byte encapsulation header", self.type.name
            )
        self._writer.write(payload)

    def subscription_count(self) -> int:
        """Return how many subscriptions in the graph match now; 0 after closing."""
        return 0 if self._closed else len(self._matching())

    def follow(self, moved: bool, idle: bool) -> None:  # noqa: ARG002 - the graph alone matters
        """Follow a change of the graph."""
        if moved and not self._closed:
            self._writer.match(self._matching())

    def close(self) -> None:
        """Withdraw the publisher; safe to call twice."""
        if not self._closed:
            self._closed = True
            if self._process != os.getpid():
                return
            self._writer.close()
            self._core.remove(self)

    def _matching(self) -> list[EndpointInfo]:
        found = []
        for endpoint in self._core.graph.endpoints(EndpointKind.SUBSCRIPTION, self.topic):
            if endpoint.type != self.type.name:
                continue
            if endpoint.type_hash not in ("", self._hash):
                self._warn(endpoint)
            elif not (self._core.middleware.matches_qos and endpoint.qos.incompatibility(self.qos)):
                found.append(endpoint)
        return found

    def _warn(self, endpoint: EndpointInfo) -> None:
        if endpoint not in self._warned:
            self._warned.add(endpoint)
            _log.warning(
                "%s: %s has another definition of %s (%s; ours is %s) and receives nothing from us",
                self.topic,
                endpoint.node,
                self.type.name,
                endpoint.type_hash,
                self._hash,
            )

    def _check_open(self) -> None:
        if self._process != os.getpid():
            raise NodeClosedError(
                f"the publisher of {self.topic} belongs to the process that made it, and does not "
                "work after a fork; connect again in this process"
            )
        if self._closed:
            raise NodeClosedError(f"the publisher of {self.topic} is closed; create another one")
