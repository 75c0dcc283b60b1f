"""Type descriptions of ROS 2 nodes (REP 2016), their texts, and the cache of received types.

``type_description_interfaces/msg/TypeDescription`` has all that the wire format and the RIHS01 hash
depend on, but neither constants nor comments. ``TypeSource`` has the text of each type, which no
hash covers: a text is used only if its fields equal those of the description. Types without text
are written as ``.msg``.
"""

# pathlib takes longer to import than the first definition to load.
# ruff: noqa: PTH100, PTH103, PTH105, PTH108, PTH111, PTH117, PTH118, PTH123

from __future__ import annotations

import logging
import os
import re
import sys
import threading
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from rosglass.errors import DefinitionError, Error, InvalidNameError
from rosglass.interfaces.definition import (
    PLACEHOLDER,
    ActionDefinition,
    ArrayKind,
    Definition,
    Field,
    FieldType,
    ServiceDefinition,
    Source,
    parts_of,
)
from rosglass.interfaces.derived import derive, derived_from
from rosglass.interfaces.hashes import announced_hashes, load_json, type_description
from rosglass.interfaces.idl import parse_idl
from rosglass.interfaces.names import (
    check_field_name,
    check_package_name,
    check_type_name,
    split_name,
)
from rosglass.interfaces.parser import MAX_TEXT, LiteralError, parse, parse_default
from rosglass.interfaces.resolver import MAX_TYPES, Resolver
from rosglass.interfaces.texts import message_text

if TYPE_CHECKING:
    from collections.abc import Iterable

    from rosglass.interfaces.definition import InterfaceDefinition, Value

__all__ = [
    "CACHE_VARIABLE",
    "TypeCache",
    "add_type_sources",
    "cache_folder",
    "parse_type_description",
    "type_sources",
]


#: The encoding of types that have no text of their own: requests, goals and the like.
_IMPLICIT = "implicit"
_FILE_KINDS = ("msg", "srv", "action")
# A line of escaped text, as Python prints bytes.
_ESCAPED = re.compile(r"(?:[ -\[\]-~]|\\[\\'\"tnr]|\\x[0-9a-f]{2})*")
_ESCAPE = re.compile(rb"\\(x..|.)")
_CONTROLS = {b"t": b"\t", b"n": b"\n", b"r": b"\r"}


def type_sources(definition: InterfaceDefinition) -> list[dict[str, str]]:
    """Return the texts of a definition and of the ones it uses, as dicts of ``TypeSource``.

    Args:
        definition: A resolved ROS 2 definition.

    Raises:
        UnsupportedError: `definition` belongs to ROS 1, or is not a definition.
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
        with suppress(DefinitionError):  # it is in another language
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
    """Return a definition with the constants, comments and defaults of its texts.

    A text that cannot be parsed, or describes something else, is left out: its type stays as
    described.

    Args:
        definition: As :func:`rosglass.interfaces.parse_type_description` returns it.
        sources: The texts.
        verbatim: Whether the texts are unescaped. rosidl's generator escapes tabs, quotes and
            non-ASCII characters, and cuts off as many characters at the end as that adds (seen in
            Iron to Kilted); this is undone.
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
    """Return the text of a service or action, as sent if it is complete, or else composed."""
    if found is not None and _fields(found) == [part.fields for part in parts]:
        return found.text
    return "\n---\n".join(message_text(part) for part in parts)


def _merged(described: Definition, written: InterfaceDefinition | None, whole: bool) -> Definition:
    """Return the description with the additions of a text."""
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
    """The texts received with a description."""

    def __init__(self, provider: str, sources: Iterable[Mapping[str, Any]], verbatim: bool) -> None:
        self._provider, self._verbatim = provider, verbatim
        self._known: dict[str, tuple[str, str]] = {}
        for source in sources:
            values = [source.get(key) for key in ("type_name", "encoding", "raw_file_contents")]
            name, encoding, text = (value if isinstance(value, str) else "" for value in values)
            if encoding in (*_FILE_KINDS, "idl") and len(text) <= MAX_TEXT:
                self._known.setdefault(name, (encoding, text))

    def interface(self, name: str) -> tuple[InterfaceDefinition | None, bool]:
        """Return the parsed text of a type, and whether it is complete.

        A request, goal or the like is part of the text of its service or action, if that was
        received.
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
        with suppress(DefinitionError, InvalidNameError):  # the peer sent no valid text
            return _parse(name, encoding, restored, self._provider), whole
        return None, True


def _same(ours: Field, theirs: Field) -> bool:
    return ours.name == theirs.name and _described(ours.type) == _described(theirs.type)


def _described(kind: FieldType) -> FieldType:
    return replace(kind, name="uint8") if kind.name == "char" else kind


def _restore(text: str) -> tuple[str, bool]:
    """Undo the escaping by rosidl's generator.

    rosidl_generator_c's ``idl__description.c.em`` prints each line as Python's ``repr`` of bytes,
    but gives the string the length of the original: escapes cut off the end.

    Returns:
        The text, and whether it is complete; otherwise it lacks its last, broken line.
    """
    if "\\" not in text:
        return text, True
    lines = text.split("\n")[:-1]
    if not all(_ESCAPED.fullmatch(line) for line in lines):
        return text, True
    with suppress(UnicodeDecodeError):  # then these are not our escapes
        return _ESCAPE.sub(_unescape, "\n".join(lines).encode()).decode(), False
    return text, True


def _unescape(match: re.Match[bytes]) -> bytes:
    code = match.group(1)
    return bytes([int(code[1:], 16)]) if len(code) > 1 else _CONTROLS.get(code, code)


_log = logging.getLogger("rosglass.interfaces")

_NESTED_ID = 1
_BLOCK = 48
_KINDS = (ArrayKind.NONE, ArrayKind.FIXED, ArrayKind.BOUNDED, ArrayKind.UNBOUNDED)
_NAMES = {
    2: "int8", 3: "uint8", 4: "int16", 5: "uint16", 6: "int32", 7: "uint32", 8: "int64",
    9: "uint64", 10: "float32", 11: "float64", 15: "bool", 16: "byte", 17: "string",
    18: "wstring", 21: "string", 22: "wstring",
}  # fmt: skip
_BOUNDED_STRINGS = (21, 22)
# A .msg file's char is IDL's uint8 (id 3); the ids below come from hand-written IDL only.
_FOREIGN = {
    12: "IDL's long double",
    13: "IDL's char",
    14: "IDL's wchar",
    19: "strings of fixed length",
    20: "wide strings of fixed length",
}
_MAX_COUNT = 2**32 - 1
#: Number of fields of a description in total; real ones have less than a thousand.
_MAX_FIELDS = 50_000

_SERVICE = {"request_message": "_Request", "response_message": "_Response"}
_ACTION = {"goal": "_Goal", "result": "_Result", "feedback": "_Feedback"}


def parse_type_description(
    description: Mapping[str, Any], *, provider: str = "description"
) -> InterfaceDefinition:
    """Create a definition from a type description.

    Args:
        description: ``type_description`` and ``referenced_type_descriptions``, as in the message
            ``type_description_interfaces/msg/TypeDescription`` as a dict.
        provider: Recorded in the definition's source.

    Returns:
        The definition, resolved; a service or action if the description is of one.

    Raises:
        DefinitionError: The description is invalid; the message names the type and the field.
        CyclicTypeError: A type contains itself.
    """
    reader = _Reader(provider)
    main = reader.individual(_get(description, "type_description", Mapping, "the description"))
    referenced = _get(description, "referenced_type_descriptions", Sequence, "the description")
    if len(referenced) > MAX_TYPES:
        raise DefinitionError(f"it needs more than {MAX_TYPES} other types", _label(main.name))
    messages = {main.name: main}
    for part in referenced:
        found = reader.individual(part)
        if messages.setdefault(found.name, found) is not found:
            raise DefinitionError("it is described twice", found.source.file)
    resolver = Resolver(lambda name, owner, field: _referenced(messages, name, owner, field))
    services = ("srv", "action")  # an action's are X_SendGoal and X_GetResult
    kind = main.name.split("/")[1]
    if kind == "action" and _has_parts(main, _ACTION):
        goal, result, feedback = parts = _parts(main, _ACTION, messages, resolver)
        return ActionDefinition(main.name, 2, goal, result, feedback, _joined(parts), main.source)
    if kind in services and _has_parts(main, _SERVICE):
        request, response = parts = _parts(main, _SERVICE, messages, resolver)
        return ServiceDefinition(main.name, 2, request, response, _joined(parts), main.source)
    return resolver.message(main)


def _has_parts(main: Definition, members: Mapping[str, str]) -> bool:
    """Return whether a description is that of a service or action."""
    types = {field.name: field.type for field in main.fields}
    return all(types.get(name) == FieldType(main.name + suffix) for name, suffix in members.items())


def _parts(
    main: Definition,
    members: Mapping[str, str],
    messages: Mapping[str, Definition],
    resolver: Resolver,
) -> list[Definition]:
    fields = {field.name: field for field in main.fields}
    return [
        resolver.message(_referenced(messages, main.name + suffix, main, fields[name]))
        for name, suffix in members.items()
    ]


def _joined(parts: Sequence[Definition]) -> str:
    return "\n---\n".join(part.text for part in parts)


def _referenced(
    messages: Mapping[str, Definition], name: str, owner: Definition, field: Field
) -> Definition:
    found = messages.get(name)
    if found is None:
        raise DefinitionError(
            f"field {field.name} has the type {name}, which the description leaves out",
            owner.source.file,
        )
    return found


class _Reader:
    """Parses individual descriptions, up to a limit of fields."""

    def __init__(self, provider: str) -> None:
        self._provider = provider
        self._fields = 0

    def individual(self, part: object) -> Definition:
        """Return one type's definition, not resolved."""
        if not isinstance(part, Mapping):
            raise DefinitionError(f"expected a description, got {part!r:.80}", "<description>")
        name = _get(part, "type_name", str, "the description")
        label = _label(name)
        _check_type_name(name, label)
        described = _get(part, "fields", Sequence, "the description", label)
        self._fields += len(described)
        if self._fields > _MAX_FIELDS:
            raise DefinitionError(f"it has more than {_MAX_FIELDS} fields", label)
        fields = tuple(_field(field, label) for field in described)
        names = [field.name for field in fields]
        seen: set[str] = set()
        for twice in names:
            if twice in seen:
                raise DefinitionError(f"field {twice} appears twice", label)
            seen.add(twice)
        if names == [PLACEHOLDER] and fields[0].type == FieldType("uint8"):
            fields = ()  # rosidl's placeholder in empty structs
        source = Source(self._provider, f"<{name} from {self._provider}>")
        definition = Definition(name, 2, fields, source=source)
        return replace(definition, text=message_text(definition))


def _label(name: str) -> str:
    return f"<description of {name[:300]}>"


def _check_type_name(name: str, label: str) -> None:
    try:
        package, kind, base = split_name(name)
    except InvalidNameError as error:
        raise DefinitionError(str(error), label) from None
    fault = check_package_name(package, 2) or check_type_name(base, 2)
    if fault or not kind:
        raise DefinitionError(fault or f"{name!r:.80} has no kind (msg, srv or action)", label)


def _field(field: object, label: str) -> Field:
    if not isinstance(field, Mapping):
        raise DefinitionError(f"expected a field, got {field!r:.80}", label)
    name = _get(field, "name", str, "a field", label)
    fault = check_field_name(name[:300], 1)  # IDL takes any identifier
    if fault:
        raise DefinitionError(fault, label)
    where = f"field {name}"
    kind = _field_type(_get(field, "type", Mapping, where, label), where, label)
    return Field(name, kind, _default(field, kind, where, label))


def _field_type(described: Mapping[str, Any], where: str, label: str) -> FieldType:
    type_id = _get(described, "type_id", int, where, label)
    capacity = _get(described, "capacity", int, where, label)
    bound = _get(described, "string_capacity", int, where, label)
    nested = _get(described, "nested_type_name", str, where, label)
    block, base = divmod(type_id, _BLOCK)
    known = 0 <= block < len(_KINDS)
    name = nested if base == _NESTED_ID else _NAMES.get(base, "")
    if known and base in _FOREIGN:
        raise DefinitionError(
            f"{where} has type id {type_id}: {_FOREIGN[base]}, which no .msg file has, "
            "cannot be read",
            label,
        )
    if not known or not (name or base == _NESTED_ID):
        raise DefinitionError(f"{where} has type id {type_id}, which means nothing", label)
    if base == _NESTED_ID:
        _check_type_name(nested, label)
    elif nested:
        raise DefinitionError(f"{where} is a {name}, yet names the type {nested!r:.80}", label)
    kind = _KINDS[block]
    _check_count(capacity, kind in (ArrayKind.FIXED, ArrayKind.BOUNDED), "capacity", where, label)
    _check_count(bound, base in _BOUNDED_STRINGS, "string capacity", where, label)
    return FieldType(name, kind, capacity or None, bound or None)


def _check_count(count: int, wanted: bool, what: str, where: str, label: str) -> None:
    if (1 <= count <= _MAX_COUNT) if wanted else count == 0:
        return
    rule = f"must be from 1 to {_MAX_COUNT}" if wanted else "has to be 0 for its type"
    raise DefinitionError(f"{where}: the {what} {rule}, got {count}", label)


def _default(field: Mapping[str, Any], kind: FieldType, where: str, label: str) -> Value | None:
    """Parse a default value in Python syntax, as rosidl's generator writes it."""
    text: str = _get(field, "default_value", str, where, label)
    if not text:
        return None
    single = kind.array is ArrayKind.NONE
    try:
        if single and kind.name in ("string", "wstring"):
            if kind.string_bound is not None and len(text) > kind.string_bound:
                raise LiteralError(f"it is longer than {kind.string_bound} characters")
            return text
        if not single:
            text = text.strip().removeprefix("(").removesuffix(")").strip().removesuffix(",")
            text = f"[{text}]"
        return parse_default(kind, text)
    except LiteralError as error:
        # No hash covers defaults, and decoding does not depend on them.
        _log.warning("%s: %s is used without its default value: %s", label, where, error)
        return None


def _get(part: object, key: str, kind: type[Any], where: str, label: str = "<description>") -> Any:
    value = part.get(key) if isinstance(part, Mapping) else None
    wrong = kind is Sequence and isinstance(value, str)
    if wrong or not isinstance(value, kind) or isinstance(value, bool):
        raise DefinitionError(f"{where} has no proper {key}: {value!r:.80}", label)
    return value


#: Environment variable with the cache's folder, or ``off``.
CACHE_VARIABLE = "ROSGLASS_TYPE_CACHE"
_OFF = ("off", "0", "no", "false", "none")
_HASH = re.compile(r"RIHS[0-9]{2}_[0-9a-f]{64}")
#: The errors of reading a file with any content.
_RUBBISH = (Error, ValueError, TypeError, LookupError, AttributeError, RecursionError)
#: Size limits in bytes of an entry and of all entries.
_MAX_ENTRY = 8 << 20
_MAX_TOTAL = 64 << 20


def cache_folder() -> str:
    """Return the folder of the cache; empty if it is disabled.

    ``ROSGLASS_TYPE_CACHE`` if it is set, otherwise a folder in the system's cache folder:
    ``rosglass/types`` in ``XDG_CACHE_HOME`` or ``~/.cache`` (Linux), ``~/Library/Caches`` (macOS),
    ``%LOCALAPPDATA%`` (Windows).
    """
    chosen = os.environ.get(CACHE_VARIABLE, "").strip()
    if chosen.lower() in _OFF:
        return ""
    if chosen:
        return os.path.abspath(os.path.expanduser(chosen))
    return system_cache_folder("types")


def system_cache_folder(name: str) -> str:
    """Return the path of a folder of rosglass in the system's cache folder."""
    home = os.path.expanduser("~")
    if sys.platform == "win32":
        base = os.environ.get("LOCALAPPDATA") or os.path.join(home, "AppData", "Local")
    elif sys.platform == "darwin":
        base = os.path.join(home, "Library", "Caches")
    else:
        base = os.environ.get("XDG_CACHE_HOME", "")
        # The specification says that relative paths count as unset.
        base = base if os.path.isabs(base) else os.path.join(home, ".cache")
    return os.path.join(base, "rosglass", name)


class TypeCache:
    """A cache with one file per definition, named by its hash; errors are ignored.

    Args:
        folder: Folder of the files, created when needed; empty for no cache.
    """

    def __init__(self, folder: str) -> None:
        self.folder = folder
        self._has_warned = False

    def get(self, name: str, type_hash: str) -> InterfaceDefinition | None:
        """Return the definition of a type with a hash, None if it is not in the cache."""
        path = self._path(type_hash)
        if not path:
            return None
        try:
            with open(path, encoding="utf-8") as file:
                text = file.read(_MAX_ENTRY)
        except (OSError, ValueError):
            return None
        try:
            return _read(text, name, type_hash)
        except _RUBBISH as error:
            # It is useless, whatever wrote it.
            _log.warning("%s is not a definition of %s and is removed: %s", path, name, error)
            with suppress(OSError):  # another process was faster
                os.unlink(path)
            return None

    def put(self, definition: InterfaceDefinition, type_hash: str) -> None:
        """Keep a definition under the hash that a robot announced for it.

        Old entries make room: all together take 64 MB at most.
        """
        path = self._path(type_hash)
        if not path:
            return
        entry = {
            "type_name": definition.name,
            "source": definition.source.provider,
            "type_description": type_description(definition),
            "type_sources": type_sources(definition),
        }
        data = load_json().dumps(entry, indent=1).encode()
        if len(data) > _MAX_ENTRY:
            return
        try:
            os.makedirs(self.folder, mode=0o700, exist_ok=True)
            self._make_room(len(data))
            # Other processes see either the whole file or none.
            part = f"{path}.{os.getpid()}.{threading.get_ident()}"
            with open(part, "wb") as file:
                file.write(data)
            os.replace(part, path)
        except (OSError, ValueError) as error:
            if not self._has_warned:
                self._has_warned = True
                _log.info("definitions from robots are not kept in %s: %s", self.folder, error)

    def _path(self, type_hash: str) -> str:
        if not (self.folder and _HASH.fullmatch(type_hash)):
            return ""
        return os.path.join(self.folder, f"{type_hash}.json")

    def _make_room(self, size: int) -> None:
        entries = []
        with os.scandir(self.folder) as found:
            for entry in found:
                with suppress(OSError):  # another process removed it
                    about = entry.stat()
                    entries.append((about.st_mtime, about.st_size, entry.path))
        total = size + sum(entry[1] for entry in entries)
        for _, taken, path in sorted(entries):
            if total <= _MAX_TOTAL:
                return
            with suppress(OSError):  # another process was faster
                os.unlink(path)
            total -= taken


def _read(text: str, name: str, type_hash: str) -> InterfaceDefinition:
    entry = load_json().loads(text)
    provider = f"cache, from {entry['source'].removeprefix('wire ')}"
    described = parse_type_description(entry["type_description"], provider=provider)
    definition = add_type_sources(described, entry["type_sources"], verbatim=True)
    if definition.name != name or type_hash not in announced_hashes(definition):
        raise DefinitionError(f"it is {definition.name}, with another hash", "<cache>")
    return definition
