"""Values that don't fit: whatever is put anywhere into a message, the error names the place."""

from __future__ import annotations

import copy
import math
import struct
from dataclasses import dataclass
from decimal import Decimal
from fractions import Fraction
from functools import cache
from typing import TYPE_CHECKING, Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import rosglass
from rosglass import ConversionError

from . import corpus
from .corpus import INTEGERS, TIMES, Field, integer_type
from .ours import from_text

if TYPE_CHECKING:
    from rosglass.messages import MessageType

WIRE = {1: "ros1", 2: "cdr"}
NAMES = [(ros, name) for ros in (1, 2) for name, fields in corpus.standard(ros).items() if fields]
quick = settings(
    max_examples=400, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck)
)

NOT_A_NUMBER = st.sampled_from([None, "1", "", b"1", [], {}, [1], object(), 1j])
NOT_A_STRING = st.sampled_from([None, 1, 1.5, True, b"bytes", [], {}, ["a"]])
NOT_A_BOOL = st.sampled_from([None, 2, -1, 0.5, "true", "", b"\1", [], {}])
NOT_A_LIST = st.sampled_from([None, 1, 1.5, "text", True, object()])
NOT_A_MESSAGE = st.sampled_from([None, 1, "text", 2.5, True, [1], b"abc"])


def bad_integers(base: str, ros: int) -> st.SearchStrategy[Any]:
    low, high = INTEGERS[integer_type(base, ros)]
    return st.one_of(
        st.integers(min_value=high + 1),
        st.integers(max_value=low - 1),
        st.floats().filter(lambda x: not math.isfinite(x) or x != int(x)),
        st.sampled_from([Decimal("1.5"), Fraction(1, 2)]),
        NOT_A_NUMBER,
    )


def bad_values(field: Field, ros: int) -> st.SearchStrategy[Any]:
    """Values that do not fit one element of the field."""
    if field.is_compound or field.base in TIMES:
        return NOT_A_MESSAGE
    if field.base == "string":
        if field.string_bound:
            long = st.text("ab", min_size=field.string_bound + 1, max_size=field.string_bound + 9)
            return st.one_of(NOT_A_STRING, long)
        return NOT_A_STRING
    if field.base == "bool":
        return NOT_A_BOOL
    if field.base in {"float32", "float64"}:
        return NOT_A_NUMBER
    return bad_integers(field.base, ros)


def bad_lists(field: Field, item: list[Any]) -> st.SearchStrategy[Any]:
    """Values that do not fit the field as a whole."""
    if field.kind == "fixed":
        return st.one_of(NOT_A_LIST, st.sampled_from([item[:-1], [*item, item[0]]]))
    if field.size:
        filler = item[0] if item else 0
        return st.one_of(NOT_A_LIST, st.just([filler] * (field.size + 1)))
    return NOT_A_LIST


@dataclass
class Broken:
    """A message's value with one thing wrong at `path`."""

    ros: int
    name: str
    value: dict[str, Any]
    path: str


@st.composite
def broken(draw: st.DrawFn) -> Broken:
    ros, root = draw(st.sampled_from(NAMES))
    types = corpus.standard(ros)
    style = draw(st.sampled_from(["random-1", "random-2", "random-3", "high"]))
    whole = copy.deepcopy(corpus.sample(types, root, ros, style, draw(st.integers(0, 3))))
    value, name, path = whole, root, ""
    while True:
        field = draw(st.sampled_from(types[name]))
        path += field.name
        holder: Any = value
        key: Any = field.name
        if field.kind != "one":
            if not holder[key] or draw(st.booleans()):
                holder[key] = draw(bad_lists(field, holder[key]))
                return Broken(ros, root, whole, path)
            holder, key = holder[key], draw(st.integers(0, len(holder[key]) - 1))
            path += f"[{key}]"
        deeper = field.is_compound and types[field.base]
        if not deeper or draw(st.integers(0, 3)) == 0:
            holder[key] = draw(bad_values(field, ros))
            return Broken(ros, root, whole, path)
        value, name, path = holder[key], field.base, path + "."


@quick
@given(broken())
def test_error_names_the_place(case: Broken) -> None:
    kind = rosglass.load(case.name, ros=case.ros)
    for encode in (kind.encode, kind.encode_parts):
        with pytest.raises(ConversionError) as caught:
            encode(case.value, wire=WIRE[case.ros])
        assert caught.value.path == case.path
        assert caught.value.expected
        assert case.path in str(caught.value)
        assert case.name in str(caught.value)


@quick
@given(st.sampled_from(NAMES), st.integers(0, 5), st.data())
def test_unknown_fields_are_refused_where_they_are(
    which: tuple[int, str], seed: int, data: st.DataObject
) -> None:
    ros, name = which
    types = corpus.standard(ros)
    value = copy.deepcopy(corpus.sample(types, name, ros, "random-1", seed))
    holder, inner, path = value, name, ""
    while data.draw(st.booleans()):
        nested = [f for f in types[inner] if f.is_compound and f.kind == "one"]
        if not nested:
            break
        field = data.draw(st.sampled_from(nested))
        holder, inner, path = holder[field.name], field.base, f"{path}{field.name}."
    holder["no_such_field"] = 1
    with pytest.raises(ConversionError, match="no_such_field") as caught:
        rosglass.load(name, ros=ros).encode(value, wire=WIRE[ros])
    assert caught.value.path == f"{path}no_such_field"


@quick
@given(st.sampled_from(NAMES), st.integers(0, 5), st.data())
def test_missing_fields_take_their_defaults(
    which: tuple[int, str], seed: int, data: st.DataObject
) -> None:
    ros, name = which
    types, kind = corpus.standard(ros), rosglass.load(name, ros=ros)
    value = corpus.sample(types, name, ros, "random-2", seed)
    kept = data.draw(st.sets(st.sampled_from(sorted(value))))
    partial = {key: value[key] for key in value if key in kept}
    usual = defaults(name, ros)
    whole = {key: value[key] if key in kept else usual[key] for key in value}
    assert kind.encode(partial, wire=WIRE[ros]) == kind.encode(whole, wire=WIRE[ros])


def defaults(name: str, ros: int) -> dict[str, Any]:
    """Zero and empty, but for the standard sets' only default: ROS 2's unit quaternion."""
    types = corpus.standard(ros)
    value = corpus.sample(types, name, ros, "zero")
    if name == "geometry_msgs/msg/Quaternion" and ros == 2:
        value["w"] = 1.0
    for field in types[name]:
        if field.is_compound and field.kind == "one":
            value[field.name] = defaults(field.base, ros)
    return value


@quick
@given(
    st.sampled_from(["int8", "uint16", "int32", "uint64", "float32", "float64", "bool", "string"]),
    st.sampled_from(["", "[]", "[2]", "[<=2]"]),
    st.one_of(
        st.none(),
        st.booleans(),
        st.integers(),
        st.floats(),
        st.text(),
        st.binary(),
        st.lists(st.one_of(st.integers(), st.floats(), st.text(), st.none()), max_size=3),
        st.dictionaries(st.text(), st.integers(), max_size=2),
    ),
)
def test_anything_converts_or_raises_conversion_error(base: str, array: str, value: Any) -> None:
    kind = define(f"{base}{array} field")
    try:
        data = kind.encode({"field": value}, wire="cdr")
    except ConversionError as error:
        place = error.path
    else:
        place = "field"
        # What was taken comes back as the same value: nothing was rounded off, cut or parsed.
        got = corpus.plain(kind.decode(data, wire="cdr").to_dict())["field"]
        if isinstance(value, bytes):
            # Bytes are taken as they are for arrays of 8-bit integers, signed ones too.
            assert bytes(item & 0xFF for item in got) == value
        else:
            assert not lost(base, got, corpus.plain(value))
    assert place.split("[")[0] == "field"


def lost(base: str, got: Any, given_value: Any) -> bool:
    if isinstance(got, list):
        pairs = zip(got, given_value, strict=True)
        return any(lost(base, one, other) for one, other in pairs)
    if isinstance(got, float):
        wanted = float(given_value)
        if base == "float32":
            wanted = struct.unpack("f", struct.pack("f", wanted))[0]
        return bool(corpus.difference(got, wanted)) and got != wanted
    return bool(got != given_value)


@cache
def define(text: str) -> MessageType:
    return from_text("a_msgs/msg/A", text, ros=2)
