"""Uses definitions in processes of their own, each with little memory and processor time.

    python bounded.py

Reads a line of JSON for each job from standard input: ``use`` (one of USES), ``ros`` and ``types``.
The first type is the one that is used. Types are lists of ``[type, array, count]``: so many fields,
of a primitive or of the type with a number, with the array ``""``, ``"[]"`` or ``"[n]"``.
Prints a line for each: how it went, seconds of processor time, and bytes of memory that were added.
A job that exceeds its limits is ended by the system, and its line says so.
"""

from __future__ import annotations

import json
import os
import resource
import sys
import time
from contextlib import suppress
from types import SimpleNamespace
from typing import Any

import numpy as np

from rosglass.errors import DecodeError, Error
from rosglass.interfaces import (
    Library,
    full_text,
    parse_type_description,
    type_description,
)
from rosglass.interfaces.type_descriptions import add_type_sources, type_sources
from rosglass.messages import Message, MessageType, Translation, load
from rosglass.wires.dds.type_lookup import describe_struct
from rosglass.wires.tcpros.core import AnnouncedTypes

CPU_S, MEMORY = 4, 200 << 20
_IDL = {
    "float64": "double",
    "int32": "long",
    "string": "string",
    "uint8": "uint8",
    "bool": "boolean",
}
_XTYPES = {"float64": 10, "int32": 4, "uint8": 13, "bool": 1}


def expanded(fields: list[Any]) -> list[tuple[str, str]]:
    """Return the type and name of each field."""
    found = []
    for kind, array, count in fields:
        name = f"T{kind}" if isinstance(kind, int) else kind
        found += [(f"{name}{array}", f"f{len(found) + at}") for at in range(count)]
    return found


def text_of(types: list[Any]) -> str:
    """Return the types as connection headers and MCAP files carry them."""
    parts = ["\n".join(" ".join(field) for field in expanded(fields)) for fields in types]
    head, *rest = parts
    blocks = [f"{'=' * 80}\nMSG: b/T{at}\n{part}" for at, part in enumerate(rest, 1)]
    return "\n".join([head, *blocks])


def idl_of(types: list[Any]) -> str:
    """Return the types as an .idl file."""
    structs = []
    for number, fields in reversed(list(enumerate(types))):
        lines = []
        for kind, name in expanded(fields):
            base, _, size = kind.partition("[")
            base, size = _IDL.get(base, f"b::msg::{base}"), size.rstrip("]")
            lines.append(
                f"{base} {name}[{size}];"
                if size
                else f"sequence<{base}> {name};"
                if "[" in kind
                else f"{base} {name};"
            )
        structs.append(f"struct T{number} {{ {' '.join(lines) or 'uint8 x;'} }};")
    return f"module b {{ module msg {{ {' '.join(structs)} }}; }};"


def description_of(types: list[Any]) -> dict[str, Any]:
    """Return the types as a node's ~/get_type_description answers."""
    ids = {"float64": 11, "int32": 6, "string": 17, "uint8": 3, "bool": 15}
    described = []
    for number, fields in enumerate(types):
        made = []
        for kind, name in expanded(fields):
            base, bracket, size = kind.partition("[")
            size = size.rstrip("]")
            offset = 48 if size else 144 if bracket else 0
            nested = "" if base in ids else f"b/msg/{base}"
            kind_of = {
                "type_id": ids.get(base, 1) + offset, "capacity": int(size or 0),
                "string_capacity": 0, "nested_type_name": nested,
            }  # fmt: skip
            made.append({"name": name, "type": kind_of, "default_value": ""})
        described.append({"type_name": f"b/msg/T{number}", "fields": made})
    return {"type_description": described[0], "referenced_type_descriptions": described[1:]}


def objects_of(types: list[Any]) -> tuple[Any, Any]:
    """Return the types as XTypes' TypeLookup has them: the first one's identifier, and a lookup."""

    def identifier(number: int) -> Any:
        return SimpleNamespace(discriminator=242, equivalence_hash=number.to_bytes(14, "big"))

    def element(base: str) -> Any:
        if base in _XTYPES:
            return SimpleNamespace(discriminator=_XTYPES[base])
        if base == "string":
            return SimpleNamespace(discriminator=112, string_sdefn=SimpleNamespace(bound=0))
        return identifier(int(base[1:]))

    def field(kind: str, name: str) -> Any:
        base, bracket, size = kind.partition("[")
        found = element(base)
        if bracket and size != "]":
            array = SimpleNamespace(
                element_identifier=found, array_bound_seq=[int(size.rstrip("]"))]
            )
            found = SimpleNamespace(discriminator=145, array_ldefn=array)
        elif bracket:
            sequence = SimpleNamespace(element_identifier=found, bound=0)
            found = SimpleNamespace(discriminator=128, seq_sdefn=sequence)
        flags = SimpleNamespace(IS_OPTIONAL=False)
        return SimpleNamespace(
            detail=SimpleNamespace(name=name),
            common=SimpleNamespace(member_flags=flags, member_type_id=found),
        )

    def fetch(type_id: Any) -> Any:
        number = int.from_bytes(type_id.equivalence_hash, "big")
        header = SimpleNamespace(
            detail=SimpleNamespace(type_name=f"b::msg::dds_::T{number}_"),
            base_type=SimpleNamespace(discriminator=0),
        )
        members = [field(kind, name) for kind, name in expanded(types[number])]
        struct = SimpleNamespace(
            header=header, struct_flags=SimpleNamespace(IS_MUTABLE=False), member_seq=members
        )
        return SimpleNamespace(discriminator=81, struct_type=struct)

    return identifier(0), fetch


def from_text(types: list[Any], ros: int) -> MessageType:
    return MessageType.from_text("b/msg/T0", text_of(types), ros)


def use_text(types: list[Any], ros: int) -> None:
    """As from MCAP files and ROS 1's recordings; both hashes are."""
    kind = from_text(types, ros)
    assert kind.md5 if ros == 1 else kind.rihs01
    full_text(kind.definition)


def use_library(types: list[Any], ros: int) -> None:
    library = Library()
    library.add_text("b/msg/T0", text_of(types), ros)
    for number in range(min(len(types), 5)):
        load(f"b/msg/T{number}", ros, library)


def use_header(types: list[Any], _: int) -> None:
    """As from connection headers of ROS 1."""
    kind = from_text(types, 1)
    AnnouncedTypes(Library(), "ros1://here").learn("b/T0", kind.md5, text_of(types))


def use_idl(types: list[Any], _: int) -> None:
    library = Library()
    library.add_text("b/msg/T0", idl_of(types), encoding="idl")
    load("b/msg/T0", 2, library)


def use_description(types: list[Any], _: int) -> None:
    found = parse_type_description(description_of(types))
    library = Library()
    kind = load("b/msg/T0", 2, library, hash=library.add_version(found))
    add_type_sources(found, type_sources(found), verbatim=True)
    assert type_description(kind.definition)


def use_type_lookup(types: list[Any], _: int) -> None:
    assert parse_type_description(describe_struct(*objects_of(types)))


def use_writing(types: list[Any], ros: int) -> None:
    kind = from_text(types, ros)
    message = kind.create()
    data = kind.encode(message)
    assert b"".join(kind.encode_parts(message)) == data


def use_dicts(types: list[Any], ros: int) -> None:
    kind = from_text(types, ros)
    assert kind.encode({}) == kind.encode(kind.create().to_dict())


def use_reading(types: list[Any], ros: int) -> None:
    kind = from_text(types, ros)
    for data in (bytes([0, 1, 0, 0]) if ros == 2 else b"", bytes([0, 1]) + bytes(1 << 16)):
        for read in (kind.decode_all, kind.validate):
            with suppress(DecodeError):
                read(data)


def use_lazily(types: list[Any], ros: int) -> None:
    """Look into every nested message, and through a path to the last field."""
    kind = from_text(types, ros)
    data = bytes([0, 1]) + bytes(1 << 20)

    def look(message: Message, depth: int) -> None:
        for name in message:
            inner = message[name]
            if isinstance(inner, Message) and depth < 3:
                look(inner, depth + 1)

    with suppress(DecodeError):
        look(kind.decode(data), 0)
        for field in kind.fields[-1:]:
            kind.path(field.name)(data)


def use_translation(types: list[Any], ros: int) -> None:
    kind = from_text(types, ros)
    there = Translation(kind)
    assert there.type.ros == 3 - ros


USES = {
    "text": use_text,
    "library": use_library,
    "connection header": use_header,
    "idl": use_idl,
    "description": use_description,
    "TypeLookup": use_type_lookup,
    "writing": use_writing,
    "dicts": use_dicts,
    "reading": use_reading,
    "lazily": use_lazily,
    "translation": use_translation,
}


def _memory() -> int:
    with open("/proc/self/statm", encoding="ascii") as file:  # noqa: PTH123
        return int(file.read().split()[0]) * resource.getpagesize()


def _in_child(job: dict[str, Any], pipe: int) -> None:
    before, begun = _memory(), time.process_time()
    resource.setrlimit(resource.RLIMIT_AS, (before + MEMORY, before + MEMORY))
    resource.setrlimit(resource.RLIMIT_CPU, (CPU_S, CPU_S))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    try:
        USES[job["use"]](job["types"], job["ros"])
        outcome = "used"
    except Error as error:
        outcome = f"refused: {error}"
    except MemoryError:
        outcome = "out of memory"
    except BaseException as error:
        outcome = f"raised {type(error).__name__}: {error}"
    spent = time.process_time() - begun
    os.write(pipe, json.dumps([outcome[:2000], round(spent, 3), _memory() - before]).encode())
    os._exit(0)


def main() -> None:
    """Do the jobs."""
    load("std_msgs/msg/Header")
    np.zeros(1)
    Translation(load("std_msgs/msg/String"))
    for line in sys.stdin:
        job = json.loads(line)
        reading, writing = os.pipe()
        child = os.fork()
        if not child:
            _in_child(job, writing)
        os.close(writing)
        _, status = os.waitpid(child, 0)
        outcome = os.read(reading, 1 << 16)
        os.close(reading)
        signal = os.WTERMSIG(status) if os.WIFSIGNALED(status) else 0
        print(outcome.decode() or json.dumps([f"ended by signal {signal}", CPU_S, 0]), flush=True)


if __name__ == "__main__":
    main()
