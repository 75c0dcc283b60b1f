"""What relaying a service and relaying an action have in common: a client here, a server there."""

from __future__ import annotations

import logging
from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, ClassVar, Generic, TypeVar

from rosglass.bridge.status import RelayStatus
from rosglass.comm import IMMEDIATE, ActionClient, ActionServer, ServiceClient, ServiceServer
from rosglass.errors import Error, NodeClosedError
from rosglass.messages import ActionTranslation, ActionType, ServiceTranslation, ServiceType

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.bridge.side import Side

__all__ = ["OfferedRelay", "notes"]

_log = logging.getLogger("rosglass.bridge")

_Client = TypeVar("_Client", ServiceClient, ActionClient)
_Server = TypeVar("_Server", ServiceServer, ActionServer)
_Type = TypeVar("_Type", ServiceType, ActionType)
_Translation = TypeVar("_Translation", ServiceTranslation, ActionTranslation)


class OfferedRelay(ABC, Generic[_Client, _Server, _Type, _Translation]):
    """Offers in one world what a server in the other offers.

    Args:
        source: Where the server is.
        target: Where it is to be asked.
        name: Its name at the source.
        other: Its name at the target.
        kind: Name of its type at the source, when it is not told there; empty to be told.
        timeout: Seconds that the server has to answer.
    """

    #: ``service`` or ``action``.
    KIND: ClassVar[str]
    #: The messages that its type is made of.
    PARTS: ClassVar[tuple[str, ...]]

    def __init__(
        self,
        source: Side,
        target: Side,
        name: str,
        other: str,
        *,
        kind: str = "",
        timeout: float = 10.0,
    ) -> None:
        self._source, self._target = source, target
        self.name, self.other = name, other
        self._kind, self._timeout = kind, timeout
        self._client: _Client | None = None
        self._server: _Server | None = None
        self._translation: _Translation | None = None
        self._type: _Type | None = None
        self._problem = ""
        self._count = self._refused = 0

    @abstractmethod
    def _ask(self) -> _Client:
        """Return a client of the server."""

    @abstractmethod
    def _type_of(self, client: _Client) -> _Type | None:
        """Return the type that a client has found."""

    @abstractmethod
    def _translate(self, kind: _Type) -> _Translation:
        """Return the translation into the other world."""

    @abstractmethod
    def _offer(self, kind: _Type) -> _Server:
        """Return a server in the other world."""

    @abstractmethod
    def close(self) -> None:
        """Stop relaying; safe to call twice."""

    def follow(self, wake: Callable[[], None]) -> None:
        """Do what is to be done; on the bridge's thread."""
        try:
            client = self._client
            if client is None:
                client = self._client = self._ask()
                client.on_ready_change(lambda _: wake(), IMMEDIATE)
            kind = self._type_of(client)
            if self._server is None and kind is not None and not self._problem:
                self._serve(kind)
        except NodeClosedError:
            return
        except Error as error:
            if str(error) != self._problem:
                self._problem = str(error)
                _log.warning("%s is not relayed: %s", self.name, error)

    def _serve(self, kind: _Type) -> None:
        offered = kind
        if self._source.node.wire != self._target.node.wire:
            self._translation = self._translate(kind)
            self._target.teach(self._translation)
            offered = self._translation.type  # type: ignore[assignment]
        self._type = kind
        self._server = self._offer(offered)

    def status(self) -> RelayStatus:
        """Return how it is doing."""
        kind, translation = self._type, self._translation
        problem = self._problem
        if not problem and self._client is not None:
            problem = self._client.problem
        return RelayStatus(
            self.KIND,
            self.name,
            self.other,
            "->" if self._source.number == 0 else "<-",
            "" if kind is None else kind.name,
            translation.type.name if translation is not None else kind.name if kind else "",
            count=self._count,
            refused=self._refused,
            notes=() if translation is None else notes(translation, self.PARTS),
            problem=problem,
        )


def notes(
    translation: ServiceTranslation | ActionTranslation, parts: tuple[str, ...]
) -> tuple[str, ...]:
    """Say what a translation loses, and makes up."""
    told = []
    for name in parts:
        told += [f"left out of the {name}: {path}" for path in getattr(translation, name).left_out]
    if translation.derived:
        told.append(f"ROS {translation.type.ros} has no such type of its own")
    return tuple(told)
