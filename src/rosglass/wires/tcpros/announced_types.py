"""The types of ROS 1's connection headers, as publishers and services announce them."""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING

from rosglass.comm.types import Types
from rosglass.errors import DefinitionConflictError, Error, TypeNotFoundError
from rosglass.interfaces import adding_definitions, full_text, join_name, split_name
from rosglass.messages import MessageType, ServiceType, load
from rosglass.wires.tcpros.connection import ANY

if TYPE_CHECKING:
    from rosglass.interfaces import Library
    from rosglass.messages import ActionType

__all__ = ["AnnouncedTypes"]


class AnnouncedTypes(Types):
    """Finds types for one node: in its library, or in the headers of publishers.

    Args:
        library: Library for definitions; None for the shared one.
        url: The node's URL, for messages.
    """

    def __init__(self, library: Library | None, url: str) -> None:
        super().__init__(library, url, ros=1)
        #: By name and md5 sum. Used by any thread; every use is atomic.
        self._learned: dict[tuple[str, str], MessageType] = {}
        self._texts: dict[MessageType | ServiceType, str] = {}

    def action(self, wanted: str | ActionType, hash: str = "") -> ActionType:
        """Return an action type; arguments and errors as in :meth:`message`.

        ROS 1's name of the whole action's message, ``pkg/TypeAction``, is accepted, too.
        """
        if isinstance(wanted, str) and wanted.endswith("Action"):
            package, kind, base = split_name(wanted)
            if kind != "action" and base != "Action":
                with suppress(TypeNotFoundError):
                    return super().action(f"{package}/action/{base.removesuffix('Action')}", hash)
        return super().action(wanted, hash)

    def learn(self, name: str, md5: str, text: str) -> MessageType:
        """Return the type that a publisher's connection header describes.

        Adds it to the library, unless that has another definition of the name: then only this
        node's subscriptions use it.

        Args:
            name: As in the header, ``pkg/Type``.
            md5: Its md5 sum.
            text: Its full definition; may be empty.

        Raises:
            TypeNotFoundError: The text is missing or does not match the sum, and no other source
                has the definition.
            DefinitionError: The text breaks a rule.
            InvalidNameError: `name` is not a type name.
        """
        full = join_name(name)
        found = self._learned.get((full, md5))
        if found is None:
            found = self._known(full, md5) or self._from_text(full, md5, text)
            found = self._learned.setdefault((full, md5), found)
        return found

    def announced_service(self, name: str, md5: str) -> ServiceType:
        """Return the service type that a server announces; servers send no definitions.

        Args:
            name: Full name, ``pkg/srv/Type``; empty when the server does not send it.
            md5: Its md5 sum, ``*`` for any.

        Raises:
            TypeNotFoundError: The definition is not found.
            DefinitionConflictError: The definitions that are found have other sums.
            DefinitionError: The definition breaks a rule.
            InvalidNameError: `name` is not a type name.
        """
        if not name:
            raise TypeNotFoundError("its server does not announce its type; give the type")
        hint = "ROS 1 servers send no definitions"
        try:
            found = load(name, ros=1, library=self._library, hash="" if md5 == ANY else md5)
        except (TypeNotFoundError, DefinitionConflictError) as error:
            raise type(error)(f"{error}. {hint}") from None
        if not isinstance(found, ServiceType):
            raise TypeNotFoundError(f"{name} is not a service type here. {hint}")
        return found

    def text(self, type: MessageType | ServiceType) -> str:
        """Return a type's definition with all that it needs, as connection headers carry it."""
        known = self._texts.get(type)
        if known is None:
            known = self._texts[type] = full_text(type.definition)
        return known

    def _known(self, full: str, md5: str) -> MessageType | None:
        with suppress(Error):
            found = load(full, ros=1, library=self._library, hash=md5)
            if isinstance(found, MessageType):
                return found
        return None

    def _from_text(self, full: str, md5: str, text: str) -> MessageType:
        if not text.strip():
            raise TypeNotFoundError(
                f"{full}: its publisher sends no definition, and no other one with md5 {md5} is "
                f"known; {adding_definitions(full, 1)}"
            )
        found = MessageType.from_text(full, text, ros=1)
        if found.md5 != md5:
            raise TypeNotFoundError(
                f"{full}: its publisher announces md5 {md5}, but the definition it sends has "
                f"{found.md5}; {adding_definitions(full, 1)}"
            )
        with suppress(DefinitionConflictError):
            self.library.add(found.definition)
        return found
