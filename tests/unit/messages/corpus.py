"""Message types and seeded sample values, independent of the code under test.

The layouts come from rosbags' tables (or are invented here), never from rosglass, so that a
misread definition cannot hide: a value made for the right layout would not fit ours.
"""

from __future__ import annotations

import math
import random
import struct
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any

from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_typestore

if TYPE_CHECKING:
    from collections.abc import Iterator

INTEGERS = {
    "int8": (-(2**7), 2**7 - 1),
    "uint8": (0, 2**8 - 1),
    "int16": (-(2**15), 2**15 - 1),
    "uint16": (0, 2**16 - 1),
    "int32": (-(2**31), 2**31 - 1),
    "uint32": (0, 2**32 - 1),
    "int64": (-(2**63), 2**63 - 1),
    "uint64": (0, 2**64 - 1),
}
TIMES = {"time": ("uint32", "uint32"), "duration": ("int32", "int32")}
PLACEHOLDER = "structure_needs_at_least_one_member"
STRINGS = (
    "",
    "a",
    "map",
    "base_link",
    "Grüße",
    "カメラ/画像",
    "🤖 drives",
    'tab\t "quote" \\ \n',
    "seven77",
    "eight888",
    "x" * 100,
)
# Every style is one sample of each type.
STYLES = ("zero", "low", "high", "long", "random-1", "random-2", "random-3")


@dataclass(frozen=True)
class Field:
    """One field: `base` is a primitive's or a type's name, `kind` is one, fixed or seq."""

    name: str
    base: str
    kind: str = "one"
    size: int = 0
    string_bound: int = 0

    @property
    def is_compound(self) -> bool:
        return "/" in self.base


Types = dict[str, tuple[Field, ...]]


def integer_type(base: str, ros: int) -> str:
    """The integer type that byte and char stand for: ROS 1 has a signed byte."""
    if base == "byte":
        return "int8" if ros == 1 else "uint8"
    return "uint8" if base == "char" else base


@cache
def store(ros: int) -> Any:
    """The rosbags type store of the set that stands for this ROS: Noetic or Jazzy."""
    return get_typestore(Stores.ROS1_NOETIC if ros == 1 else Stores.ROS2_JAZZY)


@cache
def standard(ros: int) -> Types:
    """All types of the Noetic (1) or Jazzy (2) set."""
    types: Types = {}
    for name, (_, fields) in store(ros).fielddefs.items():
        if ros == 1 and name.startswith("builtin_interfaces/"):
            continue
        types[name] = tuple(
            _from_rosbags(field, description, ros)
            for field, description in fields
            if field != PLACEHOLDER
        )
    return types


def _from_rosbags(name: str, description: Any, ros: int) -> Field:
    node, detail = description
    if node in {Nodetype.ARRAY, Nodetype.SEQUENCE}:
        inner = _from_rosbags(name, detail[0], ros)
        kind = "fixed" if node == Nodetype.ARRAY else "seq"
        return Field(name, inner.base, kind, detail[1], inner.string_bound)
    if node == Nodetype.NAME:
        if ros == 1 and detail.startswith("builtin_interfaces/"):
            return Field(name, detail.rsplit("/", 1)[1].lower())
        return Field(name, detail)
    return Field(name, detail[0], string_bound=detail[1])


def text(types: Types, name: str, ros: int) -> str:
    """The definition of `name` with all it needs, as bags and connection headers carry it."""
    seen = list(_closure(types, name))
    parts = [_lines(types[name], ros)]
    for other in seen[1:]:
        package, _, base = other.split("/")
        label = f"{package}/{base}"
        # The empty line: genpy misreads an empty definition without it.
        parts.append(f"\n{'=' * 80}\nMSG: {label}\n{_lines(types[other], ros)}")
    return "".join(parts)


def _closure(types: Types, name: str) -> Iterator[str]:
    seen, queue = {name}, [name]
    while queue:
        current = queue.pop(0)
        yield current
        for field in types[current]:
            if field.is_compound and field.base not in seen:
                seen.add(field.base)
                queue.append(field.base)


def _lines(fields: tuple[Field, ...], ros: int) -> str:
    lines = []
    for field in fields:
        base = field.base
        if field.is_compound:
            package, _, short = base.split("/")
            base = f"{package}/{short}"
        if field.string_bound:
            base += f"<={field.string_bound}"
        if field.kind == "fixed":
            base += f"[{field.size}]"
        elif field.kind == "seq":
            base += f"[<={field.size}]" if field.size else "[]"
        lines.append(f"{base} {field.name}\n")
    return "".join(lines)


def samples(types: Types, name: str, ros: int, seed: int = 0) -> list[dict[str, Any]]:
    """One value of the type per style; the same for the same arguments, always."""
    return [sample(types, name, ros, style, seed) for style in STYLES]


def sample(types: Types, name: str, ros: int, style: str, seed: int = 0) -> dict[str, Any]:
    """A nested dict of plain ints, floats, bools, strings and lists."""
    rng = random.Random(f"{seed}/{ros}/{name}/{style}")
    return _message(types, name, ros, style, rng, 0)


def _message(
    types: Types, name: str, ros: int, style: str, rng: random.Random, depth: int
) -> dict[str, Any]:
    value: dict[str, Any] = {}
    for field in types[name]:
        if field.kind == "one":
            value[field.name] = _single(types, field, ros, style, rng, depth)
            continue
        count = field.size if field.kind == "fixed" else _length(field, style, rng, depth)
        value[field.name] = [
            _single(types, field, ros, style, rng, depth + 1) for _ in range(count)
        ]
    return value


def _length(field: Field, style: str, rng: random.Random, depth: int) -> int:
    limit = field.size or 10_000
    if style == "zero":
        return 0
    if style == "long":
        # More than 64 strings or compounds: codecs switch strategy on long lists.
        if depth == 0:
            return min(70 if field.is_compound or field.base == "string" else 301, limit)
        return min(2, limit)
    if field.size and style == "high":
        return min(field.size, 3) if depth else field.size
    return min(rng.randint(0, max(1, 4 - depth)), limit)


def _single(
    types: Types, field: Field, ros: int, style: str, rng: random.Random, depth: int
) -> Any:
    base = field.base
    if field.is_compound:
        return _message(types, base, ros, style, rng, depth)
    if base in TIMES:
        # nanoseconds stay below a second: genpy rewrites what is not canonical.
        high = INTEGERS[TIMES[base][0]]
        seconds = {"zero": 0, "low": high[0], "high": high[1]}.get(style, rng.randint(*high))
        nanoseconds = {"zero": 0, "low": 0, "high": 999_999_999}.get(
            style, rng.randint(0, 999_999_999)
        )
        return {"secs": seconds, "nsecs": nanoseconds}
    if base == "string":
        return _string(field, style, rng)
    if base == "bool":
        return {"zero": False, "low": False, "high": True}.get(style, rng.random() < 0.5)
    if base in {"float32", "float64"}:
        return _float(base, style, rng)
    low, high_value = INTEGERS[integer_type(base, ros)]
    if style.startswith("random") and rng.random() < 0.5:
        return rng.randint(max(low, -100), min(high_value, 100))
    chosen = {"zero": 0, "low": low, "high": high_value}
    return chosen.get(style, rng.randint(low, high_value))


def _string(field: Field, style: str, rng: random.Random) -> str:
    if style in {"zero", "low"}:
        return ""
    if style == "high":
        # Bounds are meant in characters here; ASCII, since peers count bytes.
        return "x" * field.string_bound if field.string_bound else "日" * 50
    if style == "long":
        return rng.choice(STRINGS[:6])
    return rng.choice(STRINGS)[: field.string_bound or None]


def _float(base: str, style: str, rng: random.Random) -> float:
    code = "<f" if base == "float32" else "<d"
    largest = 3.4028234663852886e38 if base == "float32" else 1.7976931348623157e308
    smallest = 1.401298464324817e-45 if base == "float32" else 5e-324
    if style == "zero":
        return 0.0
    if style == "low":
        return rng.choice([-largest, -math.inf, -0.0])
    if style == "high":
        return rng.choice([largest, math.inf, smallest])
    value = rng.choice([rng.gauss(0, 1), rng.gauss(0, 1e6), math.nan, -0.0, 1.0])
    rounded: float = struct.unpack(code, struct.pack(code, value))[0]
    return rounded


def plain(value: Any) -> Any:
    """Reduce numpy arrays, bytes and tuples in a value to lists and Python scalars."""
    if isinstance(value, dict):
        return {key: plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    if isinstance(value, (bytes, bytearray, memoryview)):
        return list(value)
    return value.tolist() if hasattr(value, "tolist") else value


def difference(ours: Any, theirs: Any, path: str = "") -> str:
    """Return where two values differ, in words; empty when they are the same.

    NaN equals NaN, 0.0 differs from -0.0, True differs from 1.
    """
    if isinstance(theirs, dict) and isinstance(ours, dict):
        if list(ours) != list(theirs):
            return f"{path}: fields {list(ours)} against {list(theirs)}"
        pairs: Any = ((f"{path}.{k}".lstrip("."), ours[k], theirs[k]) for k in theirs)
    elif isinstance(theirs, list) and isinstance(ours, list):
        if len(ours) != len(theirs):
            return f"{path}: {len(ours)} against {len(theirs)} elements"
        pairs = ((f"{path}[{i}]", a, b) for i, (a, b) in enumerate(zip(ours, theirs, strict=True)))
    else:
        return "" if _same_scalar(ours, theirs) else f"{path}: {ours!r} against {theirs!r}"
    return next((found for p, a, b in pairs if (found := difference(a, b, p))), "")


def _same_scalar(a: Any, b: Any) -> bool:
    if type(a) is not type(b):
        return False
    if isinstance(a, float):
        return (math.isnan(a) and math.isnan(b)) or struct.pack("d", a) == struct.pack("d", b)
    return bool(a == b)


def invented(seed: int, count: int, ros: int) -> Types:
    """Random type definitions that mix alignments, nesting, fixed arrays and sequences.

    Every type may contain the earlier ones; together they reach layouts that the standard sets
    do not have (odd strides, empty types inside arrays, strings before wide numbers).
    """
    rng = random.Random(f"{seed}/{ros}")
    primitives = [*INTEGERS, "bool", "byte", "char", "float32", "float64", "string"]
    if ros == 1:
        primitives += list(TIMES)
    types: Types = {}
    for index in range(count):
        fields = []
        for position in range(rng.choice([0, 1, 1, 2, 3, 4, 6, 9])):
            known = list(types)
            base = rng.choice(known[-12:]) if known and rng.random() < 0.3 else ""
            base = base or rng.choice(primitives)
            kind = rng.choice(["one", "one", "one", "fixed", "seq", "seq"])
            size = rng.randint(1, 4) if kind == "fixed" else 0
            if kind == "seq" and ros == 2 and rng.random() < 0.2:
                size = rng.randint(1, 5)
            bound = 120 if base == "string" and ros == 2 and rng.random() < 0.2 else 0
            fields.append(Field(f"f{position}", base, kind, size, bound))
        name = f"invented_msgs/msg/T{index}"
        types[name] = tuple(fields)
        if _weight(types, name) > 3_000:
            types[name] = tuple(f for f in fields if not f.is_compound)
    return types


def _weight(types: Types, name: str) -> int:
    # Upper estimate of the leaves of a sample, so that nesting cannot explode.
    total = 1
    for field in types[name]:
        times = field.size if field.kind == "fixed" else 3 if field.kind == "seq" else 1
        total += times * (_weight(types, field.base) if field.is_compound else 1)
    return total
