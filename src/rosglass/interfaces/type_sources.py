"""Definitions' texts as type descriptions carry them, for what descriptions leave out.

``type_description_interfaces/msg/TypeSource``: a text for every type that a description mentions.
Constants, comments and units are in the texts only. No hash covers those, so a text is used only
where it says the same about the fields as the description, which the hash covers.
"""

from __future__ import annotations

import re
from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from rosglass.errors import Error
from rosglass.interfaces.definition import (
    Definition,
    Field,
    FieldType,
    ServiceDefinition,
    parts_of,
)
from rosglass.interfaces.derived import derive, derived_from
from rosglass.interfaces.hashes import type_description
from rosglass.interfaces.idl import parse_idl
from rosglass.interfaces.parser import MAX_TEXT, parse
from rosglass.interfaces.resolver import Resolver
from rosglass.interfaces.writing import message_text

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from rosglass.interfaces.definition import InterfaceDefinition

__all__ = ["add_type_sources", "type_sources"]

#: The encoding of types that have no text of their own: requests, goals and the like.
_IMPLICIT = "implicit"
_KINDS = ("msg", "srv", "action")
# What Python prints of bytes, line by line.
_ESCAPED = re.compile(r"(?:[ -\[\]-~]|\\[\\'\"tnr]|\\x[0-9a-f]{2})*")
_ESCAPE = re.compile(rb"\\(x..|.)")
_CONTROLS = {b"t": b"\t", b"n": b"\n", b"r": b"\r"}


def type_sources(definition: InterfaceDefinition) -> list[dict[str, str]]:
    """Return the texts of a definition and of all it needs, as ``TypeSource`` messages in dicts.

    Args:
        definition: A resolved ROS 2 definition.

    Raises:
        UnsupportedError: `definition` is a ROS 1 one, or no definition.
    """
    described = type_description(definition)
    names = [part["type_name"] for part in described["referenced_type_descriptions"]]
    messages = {
        name: nested for part in parts_of(definition) for name, nested in part.nested.items()
    }
    sources = [_source(definition)]
    for name in names:
        message = messages.get(name)
        sources.append(_record(name, _IMPLICIT, "") if message is None else _source(message))
    return sources


def _source(definition: InterfaceDefinition) -> dict[str, str]:
    name, text = definition.name, definition.text.partition("\n===")[0]
    kind = name.split("/")[1]
    for encoding in (kind, "idl"):
        with suppress(Error):
            parsed = _parse(name, encoding, text)
            if _fields(parsed) == _fields(definition):
                return _record(name, encoding, text)
    if isinstance(definition, Definition) and kind == "msg":
        return _record(name, kind, message_text(definition))
    return _record(name, _IMPLICIT, "")


def _record(name: str, encoding: str, text: str) -> dict[str, str]:
    return {"type_name": name, "encoding": encoding, "raw_file_contents": text}


def _fields(definition: InterfaceDefinition) -> list[tuple[Field, ...]]:
    return [part.fields for part in parts_of(definition)]


def _parse(name: str, encoding: str, text: str, provider: str = "text") -> InterfaceDefinition:
    file = f"<{name} from {provider}>"
    if encoding == "idl":
        return parse_idl(text, name, file=file, provider=provider)
    return parse(text, name, file=file, provider=provider)


def add_type_sources(
    definition: InterfaceDefinition,
    sources: Iterable[Mapping[str, Any]],
    *,
    verbatim: bool = False,
) -> InterfaceDefinition:
    """Return a definition with the constants, comments and defaults that its texts have.

    A text that cannot be read, or is about something else, is left out: then its type stays as
    described.

    Args:
        definition: As :func:`rosglass.interfaces.parse_type_description` returns it.
        sources: The texts.
        verbatim: Whether the texts are as people wrote them. rosidl's generator sends them with
            tabs, quotes and everything beyond ASCII escaped, and cuts off as many characters at
            the end as that adds (seen in Iron to Kilted); this is undone.
    """
    texts = _Texts(definition.source.provider, sources, verbatim)
    parts = parts_of(definition)
    found, whole = texts.interface(definition.name)
    written = parts_of(found) if type(found) is type(definition) and found else (None,) * len(parts)
    merged = {
        part.name: _merged(part, text, whole) for part, text in zip(parts, written, strict=True)
    }
    for part in parts:
        for name, inner in part.nested.items():
            if name not in merged:
                text, whole = texts.interface(name)
                merged[name] = _merged(inner, text, whole)
    resolver = Resolver(lambda name, _owner, _field: merged[name])
    done = [resolver.message(merged[part.name]) for part in parts]
    if isinstance(definition, Definition):
        return done[0]
    together = _text(found, done)
    if isinstance(definition, ServiceDefinition):
        return replace(definition, request=done[0], response=done[1], text=together)
    return replace(definition, goal=done[0], result=done[1], feedback=done[2], text=together)


def _text(found: InterfaceDefinition | None, parts: list[Definition]) -> str:
    """Return the text of a service or action: as sent, if it has all, else put together."""
    if found is not None and _fields(found) == [part.fields for part in parts]:
        return found.text
    return "\n---\n".join(message_text(part) for part in parts)


def _merged(described: Definition, written: InterfaceDefinition | None, whole: bool) -> Definition:
    """Return what is described, with what a text adds to it."""
    if not isinstance(written, Definition):
        return described
    pairs = list(zip(described.fields, written.fields, strict=False))
    missing = described.fields[len(written.fields) :]
    fits = len(written.fields) <= len(described.fields) and not (missing and whole)
    if not fits or not all(_same(ours, theirs) for ours, theirs in pairs):
        return described
    merged = replace(
        described,
        fields=(*written.fields, *missing),
        constants=written.constants,
        comment=written.comment,
        text=written.text,
    )
    return merged if whole else replace(merged, text=message_text(merged))


class _Texts:
    """The texts that came with one description."""

    def __init__(self, provider: str, sources: Iterable[Mapping[str, Any]], verbatim: bool) -> None:
        self._provider, self._verbatim = provider, verbatim
        self._known: dict[str, tuple[str, str]] = {}
        for source in sources:
            values = [source.get(key) for key in ("type_name", "encoding", "raw_file_contents")]
            name, encoding, text = (value if isinstance(value, str) else "" for value in values)
            if encoding in (*_KINDS, "idl") and len(text) <= MAX_TEXT:
                self._known.setdefault(name, (encoding, text))

    def interface(self, name: str) -> tuple[InterfaceDefinition | None, bool]:
        """Return what the text of a type says, and whether that is all of it.

        A request, goal or the like is part of the text of its service or action, where that came
        along.
        """
        found, whole = self._read(name)
        if found is None:
            for owner, suffix in derived_from(name, 2):
                outer, whole = self._read(owner)
                found = None if outer is None else derive(outer, suffix)
                if found is not None:
                    break
        return found, whole

    def _read(self, name: str) -> tuple[InterfaceDefinition | None, bool]:
        encoding, text = self._known.get(name, ("", ""))
        text = text.rstrip("\0")
        if not encoding:
            return None, True
        restored, whole = (text, True) if self._verbatim else _restore(text)
        with suppress(Error):
            return _parse(name, encoding, restored, self._provider), whole
        return None, True


def _same(ours: Field, theirs: Field) -> bool:
    return ours.name == theirs.name and _described(ours.type) == _described(theirs.type)


def _described(kind: FieldType) -> FieldType:
    return replace(kind, name="uint8") if kind.name == "char" else kind


def _restore(text: str) -> tuple[str, bool]:
    """Undo what rosidl's generator does to texts.

    rosidl_generator_c's ``idl__description.c.em`` prints each line as Python's ``repr`` of bytes
    and gives the string the length of the original: where something was escaped, the end is lost.

    Returns:
        The text, and whether its end is there; without its last, broken line otherwise.
    """
    if "\\" not in text:
        return text, True
    lines = text.split("\n")[:-1]
    if not all(_ESCAPED.fullmatch(line) for line in lines):
        return text, True
    with suppress(UnicodeDecodeError):
        return _ESCAPE.sub(_unescape, "\n".join(lines).encode()).decode(), False
    return text, True


def _unescape(match: re.Match[bytes]) -> bytes:
    code = match.group(1)
    return bytes([int(code[1:], 16)]) if len(code) > 1 else _CONTROLS.get(code, code)
