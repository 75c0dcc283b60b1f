"""Telling other nodes what types look like, and understanding what they tell.

REP 2016's service ``~/get_type_description``. ``rcl``'s ``node.c`` takes the hash alone and knows
the types that its node uses; here those of the library are told, too.
"""

from __future__ import annotations

import re
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from rosglass.comm import Handle
from rosglass.errors import DefinitionConflictError, DefinitionError, Error, TypeNotFoundError
from rosglass.interfaces import (
    ActionDefinition,
    add_type_sources,
    announced_hashes,
    join_name,
    parse_type_description,
    rihs01,
    type_description,
    type_sources,
)
from rosglass.interfaces.definition import parts_of
from rosglass.interfaces.derived import derive, derived_from

if TYPE_CHECKING:
    from collections.abc import Mapping

    from rosglass.comm.types import Types
    from rosglass.interfaces import Definition, InterfaceDefinition
    from rosglass.messages import Message, ServiceType
    from rosglass.ros2.core import Core

__all__ = [
    "ACTION_PARTS",
    "SERVICE",
    "TypeDescriptionServer",
    "WrongHashError",
    "compose_action",
    "describe",
    "is_hash",
    "read_answer",
    "service_type",
]

#: The service's name below the node's.
SERVICE = "get_type_description"
_TYPE = "type_description_interfaces/srv/GetTypeDescription"
#: What of an action is in the graph, with hashes; the action itself is not.
ACTION_PARTS = ("_SendGoal", "_GetResult", "_FeedbackMessage")

_GOAL_PARTS = ("_Goal", "_Result", "_Feedback")
#: Key in ``extra_information`` of those whose texts are as people wrote them; see
#: :func:`rosglass.interfaces.add_type_sources`.
_VERBATIM = "rosglass"
_HASH = re.compile(r"RIHS[0-9]{2}_[0-9a-f]{64}")
#: Largest answer that is read, in bytes; those of real types have less than a hundredth of it.
_MAX_ANSWER = 8 << 20


def service_type() -> ServiceType:
    """Return the type of the service, whatever the node's own library has."""
    from rosglass.messages import ServiceType, load  # noqa: PLC0415 - numpy

    found = load(_TYPE)
    assert isinstance(found, ServiceType)
    return found


def is_hash(text: object) -> bool:
    """Return whether something is a type hash, as a text."""
    return isinstance(text, str) and _HASH.fullmatch(text) is not None


class TypeDescriptionServer(Handle):
    """Offers ``~/get_type_description`` of a node.

    Args:
        core: The node.
    """

    def __init__(self, core: Core) -> None:
        self._core = core
        self._server: Handle | None = None
        self._closed = False

    def open(self) -> None:
        """Begin to offer it; raises NodeClosedError, or UnsupportedError without services."""
        from rosglass.ros2.service_replier import create_service_server  # noqa: PLC0415

        core = self._core
        name = f"{core.name.full}/{SERVICE}"
        kind = service_type()
        server = create_service_server(core, name, kind, self._answer, executor=core.own_dispatcher)
        self._server = server
        if self._closed:
            server.close()

    def close(self) -> None:
        """Withdraw it; safe to call twice."""
        self._closed = True
        if self._server is not None:
            self._server.close()

    def _answer(self, request: Message) -> dict[str, Any]:
        try:
            return describe(
                self._core.types,
                request["type_name"],
                request["type_hash"],
                sources=request["include_type_sources"],
            )
        except Error as error:
            return {"successful": False, "failure_reason": f"{self._core.name}: {error}"}


def describe(types: Types, name: str, type_hash: str, *, sources: bool) -> dict[str, Any]:
    """Return what ``~/get_type_description`` answers, as a dict.

    Args:
        types: The node's types.
        name: Name of the asked type; empty when only the hash is known.
        type_hash: Its hash, or for a service that of its request; empty takes the definition in
            use here.
        sources: Whether to add the definitions' texts.

    Raises:
        Error: There is none; the text says why.
    """
    if type_hash and not is_hash(type_hash):
        raise DefinitionError(f"{type_hash!r:.90} is no RIHS01 hash", "the request")
    definition = _find(types, name, type_hash)
    texts: list[dict[str, str]] = []
    if sources:
        texts = type_sources(definition)
        known = {text["type_name"] for text in texts}
        for owner, _ in derived_from(definition.name, 2):
            # The constants of a goal or request are in the text of its action or service only.
            with suppress(Error):
                texts += [
                    text
                    for text in type_sources(types.library.definition(owner))[:1]
                    if owner not in known
                ]
    return {
        "successful": True,
        "type_description": type_description(definition),
        "type_sources": texts,
        "extra_information": [{"key": _VERBATIM, "value": "type_sources are verbatim"}],
    }


def _find(types: Types, name: str, type_hash: str) -> InterfaceDefinition:
    used = types.in_use(type_hash) if type_hash else None
    if used is not None:
        return used
    if not (name or type_hash):
        raise TypeNotFoundError("neither a type's name nor its hash was asked for")
    if not name:
        raise TypeNotFoundError(f"no type with the hash {type_hash} is in use here")
    return types.library.definition(join_name(name), hash=type_hash)


class WrongHashError(DefinitionConflictError):
    """A node sent a definition whose hash is not the announced one."""


def read_answer(answer: Message, name: str, wanted: str, node: str) -> InterfaceDefinition:
    """Return the definition that a node sent.

    Args:
        answer: The response.
        name: Full name of the type that it was asked for.
        wanted: The hash that was announced for it.
        node: The node's name.

    Raises:
        WrongHashError: It sent something else.
        Error: It sent nothing, or rubbish; the text says why.
    """
    size = len(answer.type.encode(answer))
    if size > _MAX_ANSWER:
        raise TypeNotFoundError(f"its answer has {size} bytes, the limit is {_MAX_ANSWER}")
    if not answer["successful"]:
        reason = "".join(sign if sign.isprintable() else " " for sign in answer["failure_reason"])
        raise TypeNotFoundError(f"it answered: {reason[:300].strip() or 'no'}")
    described = parse_type_description(
        answer["type_description"].to_dict(), provider=f"wire {node}"
    )
    extra = {entry["key"] for entry in answer["extra_information"]}
    sources = [source.to_dict() for source in answer["type_sources"]]
    found = add_type_sources(described, sources, verbatim=_VERBATIM in extra)
    if found.name != name or wanted not in announced_hashes(found):
        raise WrongHashError(
            f"it sent a definition of {found.name} with the hash {rihs01(found)}, where {wanted} "
            f"is announced for {name}"
        )
    return found


def compose_action(name: str, parts: Mapping[str, InterfaceDefinition]) -> ActionDefinition:
    """Put an action together from what the graph has of it.

    Args:
        name: The action's full name.
        parts: The definition of each of :data:`ACTION_PARTS`.

    Raises:
        DefinitionError: They are not the parts of one action.
    """
    nested: dict[str, Definition] = {}
    for part in parts.values():
        for message in parts_of(part):
            nested.update(message.nested)
    missing = [suffix for suffix in _GOAL_PARTS if name + suffix not in nested]
    if missing:
        raise DefinitionError(f"its parts do not mention {name}{missing[0]}", f"<{name}>")
    goal, result, feedback = (nested[name + suffix] for suffix in _GOAL_PARTS)
    text = "\n---\n".join(part.text for part in (goal, result, feedback))
    action = ActionDefinition(name, 2, goal, result, feedback, text, goal.source)
    for suffix, part in parts.items():
        derived = derive(action, suffix)
        if derived is None or rihs01(derived) != rihs01(part):
            raise DefinitionError(f"{part.name} is not what ROS 2 makes of it", f"<{name}>")
    return action
