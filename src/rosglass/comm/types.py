"""Looks up the types of topics, services and actions."""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING, Protocol, TypeVar

from rosglass.errors import Error, TypeNotFoundError, UnsupportedError
from rosglass.interfaces import announced_hashes
from rosglass.messages import (
    ActionType,
    MessageType,
    OpaqueType,
    ServiceType,
    default_library,
    load,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from rosglass.comm.graph import EndpointInfo
    from rosglass.comm.promise import Promise
    from rosglass.interfaces import InterfaceDefinition, Library

    _T = TypeVar("_T", MessageType, ServiceType, ActionType)

__all__ = ["Fetcher", "Types"]

#: How long a create_...() method waits for the robot to send a definition.
_FETCH_TIMEOUT_S = 2.0
#: By ROS version: the call that loads its types, and an example of each kind.
_LOADED = {1: "rosglass.load(..., ros=1)", 2: "rosglass.load()"}
_EXAMPLES = {
    1: {
        "message": "std_msgs/String",
        "service": "std_srvs/Trigger",
        "action": "actionlib_tutorials/Fibonacci",
    },
    2: {
        "message": "std_msgs/msg/String",
        "service": "std_srvs/srv/Trigger",
        "action": "example_interfaces/action/Fibonacci",
    },
}


class Fetcher(Protocol):
    """Requests definitions from the robot; see :meth:`Types.request` and :meth:`Types.ensure`."""

    def __call__(
        self,
        name: str,
        hash: str,
        endpoints: Sequence[EndpointInfo],
        on_done: Callable[[], None],
    ) -> str:
        """Start a request, unless one is in progress; does not wait."""

    def knows(self, name: str) -> bool:
        """Return whether a node in the graph uses a type, and so may send its definition."""

    def fetch(
        self, name: str, *, timeout: float | None
    ) -> Promise[MessageType | ServiceType | ActionType]:
        """Request the version of a type that is used in the graph."""


class Types:
    """Looks up types for one node, in its library.

    Args:
        library: Source of definitions; None for the shared library.
        url: The node's URL, for messages.
        ros: The ROS version of the types.

    Attributes:
        fetcher: Requests definitions from the robot; None if that is not possible.
    """

    def __init__(self, library: Library | None, url: str, ros: int = 2) -> None:
        self._library, self._url, self._ros = library, url, ros
        self.fetcher: Fetcher | None = None
        #: Definitions in use that are not in `_by_hash` yet, each once.
        self._used: list[InterfaceDefinition] = []
        self._by_hash: dict[str, InterfaceDefinition] = {}

    @property
    def library(self) -> Library:
        """The source of definitions."""
        return default_library() if self._library is None else self._library

    def message(self, wanted: str | MessageType, hash: str = "") -> MessageType:
        """Return a message type.

        Args:
            wanted: Its name, or the type itself.
            hash: RIHS01 hash, or md5 sum in ROS 1, that a peer announced; selects the version.

        Raises:
            TypeNotFoundError: No source has a definition, or it is not a message type.
            UnsupportedError: It is a type of the other ROS version.
            DefinitionConflictError: No definition has `hash`.
        """
        return self._find(wanted, MessageType, hash, "message")

    def opaque(self, name: str, hash: str, reason: str) -> OpaqueType:
        """Return a placeholder for a message type without definition."""
        return OpaqueType(name, hash, reason, ros=self._ros)

    def service(self, wanted: str | ServiceType, hash: str = "") -> ServiceType:
        """Return a service type; arguments and errors as in :meth:`message`."""
        return self._find(wanted, ServiceType, hash, "service")

    def action(self, wanted: str | ActionType, hash: str = "") -> ActionType:
        """Return an action type; arguments and errors as in :meth:`message`."""
        return self._find(wanted, ActionType, hash, "action")

    def request(
        self,
        name: str,
        hash: str,
        endpoints: Sequence[EndpointInfo],
        on_done: Callable[[], None],
    ) -> str:
        """Request a definition missing in the library from the robot; does not wait.

        Call it again with the same arguments while the definition is missing.

        Args:
            name: Full name of the message, service or action.
            hash: Its announced RIHS01 hash; empty if none was announced.
            endpoints: The endpoints that use it; their nodes are queried.
            on_done: Called, from any thread, when an answer has arrived: the library then has the
                definition, or another call returns why not.

        Returns:
            Why the definition is not available; empty while an answer is pending.
        """
        if self.fetcher is None:
            return "the robot cannot be asked for it"
        return self.fetcher(name, hash, endpoints, on_done)

    def ensure(self, wanted: object) -> None:
        """Wait for the robot to send a named type that the library does not have.

        For create_...() methods: waits up to 2 s, and only if a node in the graph uses the type.

        Raises:
            TypeNotFoundError: No node that uses it sends its definition; the message has the
                reason.
        """
        if not isinstance(wanted, str) or self.fetcher is None:
            return
        try:
            self.library.definition(wanted)
        except TypeNotFoundError:
            if self.fetcher.knows(wanted):
                self.fetcher.fetch(wanted, timeout=_FETCH_TIMEOUT_S).result()
        except Error:
            pass  # it exists; the error is raised when it is used

    def in_use(self, hash: str) -> InterfaceDefinition | None:
        """Return the definition in use here that has an announced hash."""
        found = self._by_hash.get(hash)
        if found is None:
            while True:
                try:
                    definition = self._used.pop()
                except IndexError:
                    break
                for announced in announced_hashes(definition):
                    self._by_hash.setdefault(announced, definition)
            found = self._by_hash.get(hash)
        return found

    def _find(self, wanted: object, kind: type[_T], hash: str, word: str) -> _T:
        if not isinstance(wanted, str):
            return self._check(wanted, kind, word)
        found = load(wanted, ros=self._ros, library=self._library, hash=hash)
        return self._check(found, kind, word)

    def _check(self, found: object, kind: type[_T], word: str) -> _T:
        if not isinstance(found, kind):
            article = "an" if word == "action" else "a"
            raise TypeNotFoundError(
                f"{found!r} is not {article} {word} type; give a name such as "
                f"{_EXAMPLES[self._ros][word]} or what {_LOADED[self._ros]} returns for "
                f"{article} {word}"
            )
        if found.ros != self._ros:
            raise UnsupportedError(
                f"{found.name} is ROS {found.ros}'s definition, and {self._url} is a ROS "
                f"{self._ros} graph; load it with rosglass.load({found.name!r}, ros={self._ros})"
            )
        with suppress(TypeNotFoundError):  # opaque types have none
            if found.definition not in self._used:
                self._used.append(found.definition)
        return found
