"""Byte-for-byte agreement with independent codecs, over every type of the Noetic and Jazzy sets.

The standard sets are joined by invented types, whose layouts (odd strides, empty types in arrays,
strings before wide numbers) the standard ones lack.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import rosglass

from . import corpus, peers
from .ours import from_text

if TYPE_CHECKING:
    from rosglass.messages import MessageType

    from .corpus import Field, Types

pytestmark = pytest.mark.exhaustive

WIRE = {1: "ros1", 2: "cdr"}
SEED = 20_26
INVENTED = {ros: corpus.invented(SEED, 40, ros) for ros in (1, 2)}
MARKS = {
    "rosbags": (),
    "genpy": pytest.mark.genpy,
    "mcap-ros2": pytest.mark.peers,
    "cyclone": pytest.mark.peers,
}
PEERS = {1: ("rosbags", "genpy"), 2: ("rosbags", "mcap-ros2", "cyclone")}
ALL_TYPES = [
    pytest.param(ros, name, id=f"ros{ros}-{name}")
    for ros in (1, 2)
    for name in (*corpus.standard(ros), *INVENTED[ros])
]


def types_of(name: str, ros: int) -> Types:
    return INVENTED[ros] if name in INVENTED[ros] else corpus.standard(ros)


@cache
def ours(name: str, ros: int) -> MessageType:
    types = types_of(name, ros)
    if types is INVENTED[ros]:
        return from_text(name, corpus.text(types, name, ros), ros)
    return rosglass.load(name, ros=ros)


@cache
def peer(which: str, ros: int, invented: bool) -> Any:
    types = INVENTED[ros] if invented else corpus.standard(ros)
    if which == "rosbags":
        return peers.Rosbags(types, ros, None if invented else corpus.store(ros))
    kind = {"genpy": peers.Genpy, "mcap-ros2": peers.Mcap, "cyclone": peers.Cyclone}[which]
    return kind(types, ros)


@cache
def samples(name: str, ros: int) -> list[dict[str, Any]]:
    return corpus.samples(types_of(name, ros), name, ros, SEED)


@pytest.mark.parametrize(
    ("which", "ros", "name"),
    [
        pytest.param(which, ros, name, id=f"{which}-ros{ros}-{name}", marks=MARKS[which])
        for ros in (1, 2)
        for which in PEERS[ros]
        for name in (*corpus.standard(ros), *INVENTED[ros])
    ],
)
def test_bytes_and_values_agree_with_peer(which: str, ros: int, name: str) -> None:
    other = peer(which, ros, name in INVENTED[ros])
    for value in samples(name, ros):
        data = ours(name, ros).encode(value, wire=WIRE[ros])
        assert data == other.encode(name, value)
        assert not corpus.difference(other.decode(name, data), value)


@pytest.mark.parametrize(
    "which", [pytest.param(which, marks=MARKS[which]) for which in ("rosbags", "cyclone")]
)
@pytest.mark.parametrize("name", [*corpus.standard(2), *INVENTED[2]])
def test_big_endian_agrees_with_peer(which: str, name: str) -> None:
    kind, other = ours(name, 2), peer(which, 2, name in INVENTED[2])
    for value in samples(name, 2):
        data = other.encode(name, value, "big")
        assert kind.encode(value, wire="cdr", byteorder="big") == data
        message = kind.decode(data, wire="cdr")
        assert not corpus.difference(corpus.plain(message.to_dict()), value)
        assert kind.encode(kind.decode_all(data, wire="cdr"), wire="cdr", byteorder="big") == data


@pytest.mark.parametrize(("ros", "name"), ALL_TYPES)
def test_every_route_gives_the_bytes_back(ros: int, name: str) -> None:
    kind, other, wire = ours(name, ros), peer("rosbags", ros, name in INVENTED[ros]), WIRE[ros]
    for value in samples(name, ros):
        data = other.encode(name, value)
        lazy, eager = kind.decode(data, wire=wire), kind.decode_all(data, wire=wire)
        assert kind.encode(lazy, wire=wire) == data, "untouched"
        assert kind.encode(eager, wire=wire) == data, "eager"
        assert not corpus.difference(corpus.plain(lazy.to_dict()), value), "lazy"
        assert not corpus.difference(corpus.plain(eager.to_dict()), value), "eager"
        assert kind.encode(lazy.to_dict(), wire=wire) == data, "dict"
        read_by_attribute(types_of(name, ros), name, lazy)
        assert kind.encode(lazy, wire=wire) == data, "read"
        assert b"".join(kind.encode_parts(value, wire=wire)) == data, "parts"
        arrays = as_arrays(types_of(name, ros), name, ros, value)
        assert kind.encode(arrays, wire=wire) == data, "numpy"
        assert kind.encode(lazy.copy(), wire=wire) == data, "copy"
        kind.validate(data, wire=wire)
        kind.validate(memoryview(data), wire=wire)


@pytest.mark.parametrize(("ros", "name"), ALL_TYPES)
def test_paths_read_what_attributes_read(ros: int, name: str) -> None:
    kind, other, wire = ours(name, ros), peer("rosbags", ros, name in INVENTED[ros]), WIRE[ros]
    types = types_of(name, ros)
    # Longest lists last: every index of the first sample exists in its own data only.
    for value in samples(name, ros)[-3:]:
        data = other.encode(name, value)
        for path, leaf in leaves(types, name, value)[:40]:
            found = corpus.plain(kind.path(path, wire=wire)(data))
            assert not corpus.difference(found, leaf, path)


def read_by_attribute(types: Types, name: str, message: Any) -> None:
    for field in types[name]:
        value = getattr(message, field.name)
        if field.base in corpus.TIMES:
            continue
        if not field.is_compound:
            list(value) if field.kind != "one" else None
        elif field.kind == "one":
            read_by_attribute(types, field.base, value)
        else:
            for index in range(len(value)):
                read_by_attribute(types, field.base, value[index])


def as_arrays(types: Types, name: str, ros: int, value: dict[str, Any]) -> dict[str, Any]:
    return {f.name: _as_array(types, f, ros, value[f.name]) for f in types[name]}


def _as_array(types: Types, field: Field, ros: int, value: Any) -> Any:
    if field.is_compound:
        if field.kind == "one":
            return as_arrays(types, field.base, ros, value)
        return [as_arrays(types, field.base, ros, item) for item in value]
    if field.kind == "one" or field.base == "string" or field.base in corpus.TIMES:
        return value
    return np.array(value, corpus.integer_type(field.base, ros))


def leaves(types: Types, name: str, value: dict[str, Any], prefix: str = "") -> list[Any]:
    """Every (path, value) below a message, lists as a whole and by their last element."""
    found: list[Any] = []
    for field in types[name]:
        item, path = value[field.name], f"{prefix}{field.name}"
        if field.kind == "one":
            if field.is_compound:
                found += leaves(types, field.base, item, f"{path}.")
            elif field.base in corpus.TIMES:
                found += [(f"{path}.{part}", item[part]) for part in item]
            else:
                found.append((path, item))
        elif field.is_compound:
            for index in sorted({0, len(item) - 1}) if item else ():
                found += leaves(types, field.base, item[index], f"{path}[{index}].")
        elif field.base in corpus.TIMES:
            found += [(f"{path}[{len(item) - 1}].secs", item[-1]["secs"])] if item else []
        else:
            found.append((path, item))
            found += [(f"{path}[{len(item) - 1}]", item[-1])] if item else []
    return found


@pytest.mark.parametrize(("ros", "name"), ALL_TYPES)
def test_columns_indexes_and_slices_read_what_loops_read(ros: int, name: str) -> None:
    kind, other, wire = ours(name, ros), peer("rosbags", ros, name in INVENTED[ros]), WIRE[ros]
    types = types_of(name, ros)
    arrays = [f for f in types[name] if f.kind != "one" and f.is_compound]
    for value in samples(name, ros)[2:]:
        data = other.encode(name, value)
        for field in arrays:
            rows = value[field.name]
            for path in scalars(types, field.base):
                column = [pick(row, path) for row in rows]
                found = kind.path(f"{field.name}[*].{path}", wire=wire)(data)
                assert not corpus.difference(corpus.plain(found), column, path)
                found = kind.path(f"{field.name}[1:].{path}", wire=wire)(data)
                assert not corpus.difference(corpus.plain(found), column[1:], path)
                if rows:
                    found = kind.path(f"{field.name}[-1].{path}", wire=wire)(data)
                    assert not corpus.difference(found, column[-1], path)


@pytest.mark.parametrize(("ros", "name"), ALL_TYPES)
def test_several_paths_at_once_read_what_single_ones_read(ros: int, name: str) -> None:
    kind, other, wire = ours(name, ros), peer("rosbags", ros, name in INVENTED[ros]), WIRE[ros]
    types = types_of(name, ros)
    for value in samples(name, ros)[-3:]:
        data = other.encode(name, value)
        found = leaves(types, name, value)[:12]
        # Backwards, too: the order of the paths is not the order on the wire.
        for chosen in (found, found[::-1]):
            if len(chosen) > 1:
                got = kind.path(*(path for path, _ in chosen), wire=wire)(data)
                wanted = [leaf for _, leaf in chosen]
                assert not corpus.difference([corpus.plain(item) for item in got], wanted)


@pytest.mark.parametrize(("ros", "name"), ALL_TYPES)
def test_changed_messages_encode_the_changes(ros: int, name: str) -> None:
    kind, other, wire = ours(name, ros), peer("rosbags", ros, name in INVENTED[ros]), WIRE[ros]
    types = types_of(name, ros)
    *_, first, second = samples(name, ros)
    before, after = other.encode(name, first), other.encode(name, second)
    message, source = kind.decode(before, wire=wire), kind.decode(after, wire=wire)
    for field in types[name]:
        setattr(message, field.name, getattr(source, field.name))
    assert kind.encode(message, wire=wire) == after, "fields of another message"
    message = kind.decode(before, wire=wire)
    change(types, name, ros, message, second)
    assert kind.encode(message, wire=wire) == after, "every field by itself"
    assert kind.encode(source, wire=wire) == after, "the source is as it was"
    assert kind.decode(before, wire=wire) != kind.decode(after, wire=wire) or before == after


def change(types: Types, name: str, ros: int, message: Any, value: dict[str, Any]) -> None:
    """Put a value into a decoded message, element by element where the lengths allow it."""
    for field in types[name]:
        item, target = value[field.name], getattr(message, field.name)
        if field.is_compound and field.kind == "one":
            change(types, field.base, ros, target, item)
        elif field.is_compound and len(target) == len(item):
            for index, element in enumerate(item):
                change(types, field.base, ros, target[index], element)
        elif field.base in corpus.TIMES and field.kind == "one":
            target.secs, target.nsecs = item["secs"], item["nsecs"]
        else:
            setattr(message, field.name, item)


def scalars(types: Types, name: str, prefix: str = "") -> list[str]:
    """Paths of the single values in a message, without those inside arrays."""
    found: list[str] = []
    for field in types[name]:
        if field.kind != "one":
            continue
        if field.is_compound:
            found += scalars(types, field.base, f"{prefix}{field.name}.")
        elif field.base in corpus.TIMES:
            found.append(f"{prefix}{field.name}.nsecs")
        else:
            found.append(f"{prefix}{field.name}")
    return found


def pick(value: Any, path: str) -> Any:
    for part in path.split("."):
        value = value[part]
    return value
