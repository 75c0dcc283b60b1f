"""The parser of ``.msg``, ``.srv`` and ``.action`` definitions of ROS 1 and ROS 2.

Line formats: http://wiki.ros.org/msg, http://wiki.ros.org/srv, and for ROS 2
https://docs.ros.org/en/rolling/Concepts/Basic/About-Interfaces.html. The results are not resolved:
``nested`` holds only what the text itself brought along (definitions joined by ``===`` lines, as
ROS 1 connection headers and MCAP files carry them). :class:`rosglass.Library` resolves.
"""

from __future__ import annotations

import re
from itertools import pairwise

from rosglass.errors import InvalidNameError
from rosglass.interfaces.definition import (
    ActionDefinition,
    Definition,
    InterfaceDefinition,
    ServiceDefinition,
    Source,
)
from rosglass.interfaces.message_parser import PRIMITIVES, Context, Part, build_message
from rosglass.interfaces.names import check_package_name, check_type_name, join_name

__all__ = ["MAX_TEXT", "PRIMITIVES", "parse", "parse_action", "parse_message", "parse_service"]

#: Longest definition that is read, in characters; real ones have less than a tenth of it.
MAX_TEXT = 1024 * 1024

_NEWLINE = re.compile(r"\r\n|\r|\n")
_SEPARATOR = re.compile(r"={3,}[ \t]*")
_BLOCK_NAME = re.compile(r"[ \t]*MSG:[ \t]*(\S+)[ \t]*")


def parse(
    text: str, name: str, *, ros: int = 2, file: str = "", provider: str = "text"
) -> InterfaceDefinition:
    """Parse a definition whose kind is in its name (``pkg/msg/..``, ``pkg/srv/..``, ...).

    Args:
        text: The definition, optionally with those it needs appended after ``===`` lines.
        name: Full type name; ``pkg/Type`` means a message.
        ros: 1 or 2.
        file: Label for error messages, by default the name in angle brackets.
        provider: Recorded in the definition's source.

    Raises:
        DefinitionError: The text breaks a rule; says where.
        InvalidNameError: `name` is not a type name.
    """
    kind = join_name(name).split("/")[1]
    if kind == "srv":
        return parse_service(text, name, ros=ros, file=file, provider=provider)
    if kind == "action":
        return parse_action(text, name, ros=ros, file=file, provider=provider)
    return parse_message(text, name, ros=ros, file=file, provider=provider)


def parse_message(
    text: str, name: str, *, ros: int = 2, file: str = "", provider: str = "text"
) -> Definition:
    """Parse a message definition; arguments and errors as in :func:`parse`."""
    full, context = _check(text, name, "msg", ros, file, provider)
    main, nested = _split_blocks(text, context)
    return build_message(full, main, context, nested)


def parse_service(
    text: str, name: str, *, ros: int = 2, file: str = "", provider: str = "text"
) -> ServiceDefinition:
    """Parse a service definition; arguments and errors as in :func:`parse`.

    The request and response are called ``pkg/srv/Type_Request`` and ``_Response`` in ROS 2,
    ``pkg/srv/TypeRequest`` and ``TypeResponse`` in ROS 1.
    """
    full, context = _check(text, name, "srv", ros, file, provider)
    main, nested = _split_blocks(text, context)
    parts = _split_parts(main, context)
    if len(parts) == 1 and ros == 1:
        parts.append(Part(0, []))  # genmsg reads it as a service that answers nothing
    if len(parts) != 2:
        raise context.error(
            f"a service has one line '---' between request and response, found {len(parts) - 1}",
            parts[2].first - 1 if len(parts) > 2 else 0,
        )
    stem = full if ros == 1 else f"{full}_"
    return ServiceDefinition(
        name=full,
        ros=ros,
        request=build_message(f"{stem}Request", parts[0], context, nested),
        response=build_message(f"{stem}Response", parts[1], context, nested),
        text=main.text,
        source=Source(provider, context.file),
    )


def parse_action(
    text: str, name: str, *, ros: int = 2, file: str = "", provider: str = "text"
) -> ActionDefinition:
    """Parse an action definition; arguments and errors as in :func:`parse`.

    Goal, result and feedback are called ``pkg/action/Type_Goal`` and so on in ROS 2,
    ``pkg/msg/TypeGoal`` and so on in ROS 1.
    """
    full, context = _check(text, name, "action", ros, file, provider)
    main, nested = _split_blocks(text, context)
    parts = _split_parts(main, context)
    if len(parts) != 3:
        raise context.error(
            "an action has two lines '---', between goal, result and feedback, found "
            f"{len(parts) - 1}",
            parts[3].first - 1 if len(parts) > 3 else 0,
        )
    stem = full.replace("/action/", "/msg/") if ros == 1 else f"{full}_"
    return ActionDefinition(
        name=full,
        ros=ros,
        goal=build_message(f"{stem}Goal", parts[0], context, nested),
        result=build_message(f"{stem}Result", parts[1], context, nested),
        feedback=build_message(f"{stem}Feedback", parts[2], context, nested),
        text=main.text,
        source=Source(provider, context.file),
    )


def _check(
    text: str, name: str, kind: str, ros: int, file: str, provider: str
) -> tuple[str, Context]:
    """Check the arguments; returns the full name and the context."""
    full = join_name(name, kind)
    context = Context(file or f"<{full}>", provider, ros)
    if ros not in (1, 2):
        raise context.error(f"ros must be 1 or 2, got {ros!r}")
    if not isinstance(text, str):
        raise context.error(f"the definition must be a str, got {type(text).__name__}")
    if len(text) > MAX_TEXT:
        raise context.error(f"the definition has {len(text)} characters, the limit is {MAX_TEXT}")
    package, found, base = full.split("/")
    # Requests, goals and such are messages that live in a service's or action's namespace.
    if kind not in (found, "msg"):
        raise InvalidNameError(f"{name} names a {found}, but a {kind} is to be parsed")
    fault = check_package_name(package, ros) or check_type_name(base, ros)
    if fault:
        raise context.error(fault)
    return full, context


def _split_blocks(text: str, context: Context) -> tuple[Part, dict[str, Definition]]:
    """Split joined definitions at their ``===`` and ``MSG: pkg/Type`` lines; parse the others."""
    lines = _NEWLINE.split(text.removeprefix("\ufeff"))
    starts = [
        index
        for index, line in enumerate(lines)
        if line.startswith("===") and _SEPARATOR.fullmatch(line)
    ]
    nested: dict[str, Definition] = {}
    for start, end in pairwise([*starts, len(lines)]):
        header = lines[start + 1] if start + 1 < end else ""
        match = _BLOCK_NAME.fullmatch(header)
        if match is None:
            raise context.error("expected 'MSG: package/Type' after a '===' line", start + 2, 1)
        try:
            name = join_name(match.group(1))
        except InvalidNameError as error:
            raise context.error(str(error), start + 2, match.start(1) + 1) from None
        block = build_message(name, Part(start + 3, lines[start + 2 : end]), context, {})
        # Some recorders repeat definitions.
        known = nested.setdefault(name, block)
        if (known.fields, known.constants) != (block.fields, block.constants):
            raise context.error(f"{name} is defined twice, differently", start + 2, 1)
    main = lines[: starts[0]] if starts else lines
    return Part(1, main), nested


def _split_parts(part: Part, context: Context) -> list[Part]:
    """Split at the ``---`` lines of services and actions."""
    cuts = [index for index, line in enumerate(part.lines) if line.startswith("---")]
    for cut in cuts:
        # genmsg takes any line that starts so, rosidl only '---' itself.
        if context.ros == 2 and part.lines[cut].strip("- \t"):
            raise context.error("a line that separates is just '---'", part.first + cut, 1)
    bounds = [-1, *cuts, len(part.lines)]
    return [
        Part(part.first + start + 1, part.lines[start + 1 : end]) for start, end in pairwise(bounds)
    ]
