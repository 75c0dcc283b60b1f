"""Finding message, service and action types by name, cached for each library."""

from __future__ import annotations

import threading
import weakref
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from rosglass import interfaces
from rosglass.errors import UnsupportedError
from rosglass.interfaces.definition import ActionDefinition, ServiceDefinition
from rosglass.messages.types import MessageType, portable

if TYPE_CHECKING:
    from rosglass.interfaces import Library
    from rosglass.interfaces.definition import Field, InterfaceDefinition
    from rosglass.messages.types import Constants

__all__ = ["ActionType", "ServiceType", "default_library", "load"]


class _Interface:
    """The common base of types with several messages."""

    parts: dict[str, MessageType]

    def __init__(self, definition: ServiceDefinition | ActionDefinition) -> None:
        self.definition = definition
        self.name, self.ros = definition.name, definition.ros

    @property
    def md5(self) -> str:
        """ROS 1's md5 sum of the definition."""
        return interfaces.md5(self.definition)

    @property
    def rihs01(self) -> str:
        """ROS 2's type hash (REP 2016)."""
        return interfaces.rihs01(self.definition)

    @property
    def fields(self) -> dict[str, tuple[Field, ...]]:
        """The fields of each part."""
        return {name: part.fields for name, part in self.parts.items()}

    @property
    def constants(self) -> dict[str, Constants]:
        """The constants of each part."""
        return {name: part.constants for name, part in self.parts.items()}

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, _Interface):
            return NotImplemented
        return (self.name, self.parts) == (other.name, other.parts)

    def __hash__(self) -> int:
        return hash((self.name, self.ros))

    def __reduce__(self) -> tuple[Any, ...]:
        parts: dict[str, Any] = {
            name: portable(part.definition) for name, part in self.parts.items()
        }
        return type(self), (replace(self.definition, **parts),)

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.name} (ROS {self.ros})>"


class ServiceType(_Interface):
    """A service type.

    Attributes:
        definition: The definition it was made from.
        name: Full name, ``pkg/srv/Type``.
        ros: 1 or 2.
        request: Type of the request.
        response: Type of the response.
        parts: Both by these names.
    """

    definition: ServiceDefinition

    def __init__(self, definition: ServiceDefinition) -> None:
        super().__init__(definition)
        self.request = MessageType(definition.request)
        self.response = MessageType(definition.response)
        self.parts = {"request": self.request, "response": self.response}


class ActionType(_Interface):
    """An action type.

    Attributes:
        definition: The definition it was made from.
        name: Full name, ``pkg/action/Type``.
        ros: 1 or 2.
        goal: Type of the goal.
        result: Type of the result.
        feedback: Type of the feedback.
        parts: All three by these names.
    """

    definition: ActionDefinition

    def __init__(self, definition: ActionDefinition) -> None:
        super().__init__(definition)
        self.goal = MessageType(definition.goal)
        self.result = MessageType(definition.result)
        self.feedback = MessageType(definition.feedback)
        self.parts = {"goal": self.goal, "result": self.result, "feedback": self.feedback}


_lock = threading.RLock()
_libraries: weakref.WeakKeyDictionary[
    Library, dict[tuple[str, int, str], MessageType | ServiceType | ActionType]
] = weakref.WeakKeyDictionary()
_default: list[Library] = []


def default_library() -> Library:
    """Return the shared library, created on first use."""
    with _lock:
        if not _default:
            _default.append(interfaces.Library())
        return _default[0]


def load(
    name: str, ros: int = 2, library: Library | None = None, *, hash: str = ""
) -> MessageType | ServiceType | ActionType:
    """Return the type `name`.

    Args:
        name: ``pkg/msg/Type`` or ``pkg/Type`` (also ``srv`` and ``action``).
        ros: 2 for ROS 2's definition, 1 for ROS 1's.
        library: Where to look it up; None for :func:`default_library`.
        hash: RIHS01 hash (ROS 1: md5 sum) that a peer announced for it; picks the version of the
            definition that has it.

    Raises:
        TypeNotFoundError: No provider has a definition.
        DefinitionConflictError: No provider has the version with this hash.
        DefinitionError: The definition has errors, or is cyclic.
        UnsupportedError: `library` is no library, or `ros` neither 1 nor 2.
    """
    if library is not None and not isinstance(library, interfaces.Library):
        raise UnsupportedError(f"a library is a rosglass.Library, not {library!r:.80}")
    source = default_library() if library is None else library
    definition = source.definition(name, ros=ros, hash=hash)
    with _lock:
        types = _libraries.setdefault(source, {})
        found, usual = types.get((name, ros, hash)), types.get((name, ros, ""))
    if found is not None and found.definition is definition:
        return found
    # If the usual version is the requested one, return the same object. Without the lock: a large
    # type must not delay the loading of others.
    same = usual is not None and usual.definition is definition
    made = usual if usual and same else _make(definition)
    with _lock:
        found = types.get((name, ros, hash))
        if found is None or found.definition is not definition:
            found = types[name, ros, hash] = made
    return found


def _make(definition: InterfaceDefinition) -> MessageType | ServiceType | ActionType:
    if isinstance(definition, ServiceDefinition):
        return ServiceType(definition)
    if isinstance(definition, ActionDefinition):
        return ActionType(definition)
    return MessageType(definition)
