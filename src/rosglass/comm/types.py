"""Finding the types that a node's topics, services and actions have."""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING, Protocol, TypeVar

from rosglass.errors import Error, TypeNotFoundError, UnsupportedError
from rosglass.interfaces import announced_hashes

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from rosglass.comm.graph import EndpointInfo
    from rosglass.comm.promise import Promise
    from rosglass.interfaces import InterfaceDefinition, Library
    from rosglass.messages import ActionType, MessageType, OpaqueType, ServiceType

    _T = TypeVar("_T", MessageType, ServiceType, ActionType)

__all__ = ["Fetcher", "Types"]

#: Seconds that creating something may wait for the robot to send the type.
_PATIENCE = 2.0
#: By the ROS: how its types are loaded, and an example of each kind.
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
    """Asks the robot for definitions; see :meth:`Types.request` and :meth:`Types.ensure`."""

    def __call__(
        self,
        name: str,
        hash: str,
        endpoints: Sequence[EndpointInfo],
        on_done: Callable[[], None],
    ) -> str:
        """Start asking, unless that goes on already, and return at once."""

    def knows(self, name: str) -> bool:
        """Return whether somebody in the graph uses a type, so that asking makes sense."""

    def fetch(
        self, name: str, *, timeout: float | None
    ) -> Promise[MessageType | ServiceType | ActionType]:
        """Ask for the version of a type that is in the graph."""


class Types:
    """Finds types for one node, in its library.

    Args:
        library: Where definitions come from; None for the shared library.
        url: The node's URL, for messages.
        ros: The ROS whose types these are.

    Attributes:
        fetcher: Asks the robot; None while nobody can.
    """

    def __init__(self, library: Library | None, url: str, ros: int = 2) -> None:
        self._library, self._url, self._ros = library, url, ros
        self.fetcher: Fetcher | None = None
        #: Each once: those of an action are derived anew for each server and client.
        self._used: list[InterfaceDefinition] = []
        self._by_hash: dict[str, InterfaceDefinition] = {}

    @property
    def library(self) -> Library:
        """Where definitions come from."""
        from rosglass.messages import default_library  # noqa: PLC0415 - numpy

        return default_library() if self._library is None else self._library

    def message(self, wanted: str | MessageType, hash: str = "") -> MessageType:
        """Return a message type.

        Args:
            wanted: Its name, or the type itself.
            hash: RIHS01 hash, or md5 sum in ROS 1, that a peer announced for it; picks the version
                that has it.

        Raises:
            TypeNotFoundError: Nobody has it, or it is not a message.
            UnsupportedError: It is the other ROS's.
            DefinitionConflictError: Nobody's definition has `hash`.
        """
        from rosglass.messages import MessageType  # noqa: PLC0415 - numpy

        return self._find(wanted, MessageType, hash, "message")

    def opaque(self, name: str, hash: str, reason: str) -> OpaqueType:
        """Return what stands for a message type without definition."""
        from rosglass.messages import OpaqueType  # noqa: PLC0415 - numpy

        return OpaqueType(name, hash, reason, ros=self._ros)

    def service(self, wanted: str | ServiceType, hash: str = "") -> ServiceType:
        """Return a service type; arguments and errors as in :meth:`message`."""
        from rosglass.messages import ServiceType  # noqa: PLC0415 - numpy

        return self._find(wanted, ServiceType, hash, "service")

    def action(self, wanted: str | ActionType, hash: str = "") -> ActionType:
        """Return an action type; arguments and errors as in :meth:`message`."""
        from rosglass.messages import ActionType  # noqa: PLC0415 - numpy

        return self._find(wanted, ActionType, hash, "action")

    def request(
        self,
        name: str,
        hash: str,
        endpoints: Sequence[EndpointInfo],
        on_done: Callable[[], None],
    ) -> str:
        """Ask the robot for a definition that the library does not have; returns at once.

        Meant to be called again, with the same arguments, for as long as it is missing.

        Args:
            name: Full name of the message, service or action.
            hash: RIHS01 hash that was announced for it; empty when none was.
            endpoints: Who uses it, and may be asked.
            on_done: Called, from any thread, when there is an answer: the library has the
                definition then, or calling this again says why not.

        Returns:
            Why the definition cannot be had; empty while an answer is awaited.
        """
        if self.fetcher is None:
            return "the robot cannot be asked for it"
        return self.fetcher(name, hash, endpoints, on_done)

    def ensure(self, wanted: object) -> None:
        """Wait for the robot to send a type that is named and that the library does not have.

        For what a user creates: takes 2 s at most, and no time at all unless somebody in the graph
        uses the type.

        Raises:
            TypeNotFoundError: Somebody uses it, but nobody sends it; says why.
        """
        if not isinstance(wanted, str) or self.fetcher is None:
            return
        try:
            self.library.definition(wanted)
        except TypeNotFoundError:
            if self.fetcher.knows(wanted):
                self.fetcher.fetch(wanted, timeout=_PATIENCE).result()
        except Error:
            pass  # it is known, and what is wrong with it is said by who uses it

    def in_use(self, hash: str) -> InterfaceDefinition | None:
        """Return the definition, among those in use here, that is announced by a hash."""
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
        from rosglass.messages import load  # noqa: PLC0415 - numpy

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
