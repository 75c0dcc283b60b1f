"""Drivers for the independent codecs that ours is held against.

Each driver turns a plain nested dict (see ``corpus``) into bytes and back. Known faults of a
peer are worked around here by a line naming the fault, so that the rest of the type can still be
compared; ``test_peers_faults.py`` shows each fault bare.
"""

from __future__ import annotations

import importlib.util
import sys
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from . import corpus
from .corpus import PLACEHOLDER, TIMES, Field, Types, integer_type, text

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosbags.typesys.store import Typestore

GENPY_MISSING = "python3-genpy is not installed: apt install python3-genpy"
MCAP_MISSING = "mcap-ros2-support is not installed: pip install 'rosglass[peers]'"
CYCLONE_MISSING = "cyclonedds is not installed: pip install 'rosglass[peers]'"
DEBIAN_PACKAGES = "/usr/lib/python3/dist-packages"
_NUMPY = {"float32": np.float32, "float64": np.float64, "bool": np.bool_}


def need_genpy() -> Any:
    """genpy's dynamic module, from Debian's pure-Python package; skips without it."""
    if importlib.util.find_spec("genpy") is None and DEBIAN_PACKAGES not in sys.path:
        # At the end, so that everything else still comes from the virtual environment.
        sys.path.append(DEBIAN_PACKAGES)
        importlib.invalidate_caches()
    if importlib.util.find_spec("genpy") is None:
        pytest.skip(GENPY_MISSING)
    import genpy.dynamic

    return genpy.dynamic


def need_mcap() -> Any:
    """mcap-ros2-support's module of run-time types; skips without it."""
    return pytest.importorskip("mcap_ros2._dynamic", reason=MCAP_MISSING)


class Rosbags:
    """rosbags, both wires."""

    def __init__(self, types: Types, ros: int, known: Typestore | None = None) -> None:
        self.types, self.ros = types, ros
        self.store = known or get_typestore(Stores.EMPTY)
        if known is None:
            if ros == 1:
                self.store.register(
                    get_types_from_msg("int32 sec\nuint32 nanosec", "builtin_interfaces/msg/Time")
                    | get_types_from_msg(
                        "int32 sec\nuint32 nanosec", "builtin_interfaces/msg/Duration"
                    )
                )
            definitions: dict[str, Any] = {}
            for name in types:
                definitions |= get_types_from_msg(text(types, name, ros), name)
            self.store.register(definitions)

    def encode(self, name: str, value: dict[str, Any], byteorder: str = "little") -> bytes:
        message = self.build(name, value)
        if self.ros == 1:
            return bytes(self.store.serialize_ros1(message, name))
        little = byteorder == "little"
        return bytes(self.store.serialize_cdr(message, name, little_endian=little))

    def decode(self, name: str, data: bytes) -> dict[str, Any]:
        reader = self.store.deserialize_ros1 if self.ros == 1 else self.store.deserialize_cdr
        return self._plain(name, reader(data, name))

    def build(self, name: str, value: dict[str, Any]) -> Any:
        arguments = {f.name: self._into(f, value[f.name]) for f in self.types[name]}
        if not arguments and self.ros == 2:
            arguments = {PLACEHOLDER: 0}
        return self.store.types[name](**arguments)

    def _into(self, field: Field, value: Any) -> Any:
        if field.kind != "one":
            kind = self._dtype(field.base)
            if kind is None:
                return [self._one(field, item) for item in value]
            if field.base == "byte" and self.ros == 2:
                return np.array(value, np.uint8).view(np.int8)  # fault 2
            return np.array(value, kind)
        return self._one(field, value)

    def _dtype(self, base: str) -> Any:
        if base == "string" or "/" in base or base in TIMES:
            return None
        # Fault 2: rosbags has one byte in both ROS versions, ROS 1's.
        return _NUMPY.get(base) or getattr(np, integer_type(base, 1))

    def _one(self, field: Field, value: Any) -> Any:
        if field.is_compound:
            return self.build(field.base, value)
        if field.base in TIMES:
            # Fault 4: time's seconds are signed there, duration's nanoseconds unsigned.
            seconds = value["secs"] - 2**32 if value["secs"] >= 2**31 else value["secs"]
            kind = self.store.types[f"builtin_interfaces/msg/{field.base.capitalize()}"]
            return kind(sec=seconds, nanosec=value["nsecs"] & 0xFFFFFFFF)
        if field.base == "byte" and self.ros == 2 and value > 127:
            return value - 256  # fault 2
        return value

    def _plain(self, name: str, message: Any) -> dict[str, Any]:
        return {f.name: self._out(f, getattr(message, f.name)) for f in self.types[name]}

    def _out(self, field: Field, value: Any) -> Any:
        if field.kind == "one":
            return self._one_out(field, value)
        return [self._one_out(field, item) for item in corpus.plain(list(value))]

    def _one_out(self, field: Field, value: Any) -> Any:
        if field.is_compound:
            return self._plain(field.base, value)
        if field.base in TIMES:
            seconds, nanoseconds = value.sec, value.nanosec
            if field.base == "time":
                seconds &= 0xFFFFFFFF  # fault 4
            elif nanoseconds >= 2**31:
                nanoseconds -= 2**32  # fault 4
            return {"secs": seconds, "nsecs": nanoseconds}
        if field.base == "byte" and self.ros == 2:
            return int(value) & 0xFF  # fault 2
        return corpus.plain(value)


class FromObjects:
    """Base of peers whose messages are objects with attributes and lists."""

    types: Types

    def _plain(self, name: str, message: Any) -> dict[str, Any]:
        return {f.name: self._out(f, getattr(message, f.name)) for f in self.types[name]}

    def _out(self, field: Field, value: Any) -> Any:
        if field.kind == "one":
            return self._one_out(field, value)
        return [self._one_out(field, item) for item in value]

    def _one_out(self, field: Field, value: Any) -> Any:
        raise NotImplementedError


class Genpy(FromObjects):
    """genpy's run-time generated classes, ROS 1."""

    def __init__(self, types: Types, ros: int = 1) -> None:
        self.types, self.dynamic = types, need_genpy()
        self.classes: dict[str, dict[str, Any]] = {}

    def _class(self, root: str, name: str) -> Any:
        if root not in self.classes:
            package, _, base = root.split("/")
            self.classes[root] = self.dynamic.generate_dynamic(
                f"{package}/{base}", text(self.types, root, 1)
            )
        package, _, base = name.split("/")
        return self.classes[root][f"{package}/{base}"]

    def encode(self, name: str, value: dict[str, Any], byteorder: str = "little") -> bytes:
        from io import BytesIO

        buffer = BytesIO()
        self.build(name, name, value).serialize(buffer)
        return buffer.getvalue()

    def decode(self, name: str, data: bytes) -> dict[str, Any]:
        return self._plain(name, self._class(name, name)().deserialize(data))

    def build(self, root: str, name: str, value: dict[str, Any]) -> Any:
        message = self._class(root, name)()
        for field in self.types[name]:
            setattr(message, field.name, self._into(root, field, value[field.name]))
        return message

    def _into(self, root: str, field: Field, value: Any) -> Any:
        if field.kind == "one":
            return self._one(root, field, value)
        if integer_type(field.base, 1) == "uint8":
            return bytes(value)
        return [self._one(root, field, item) for item in value]

    def _one(self, root: str, field: Field, value: Any) -> Any:
        if field.is_compound:
            return self.build(root, field.base, value)
        if field.base in TIMES:
            import genpy

            stamp = genpy.Time() if field.base == "time" else genpy.Duration()
            # Set one by one: the constructors rewrite what they think is not canonical.
            stamp.secs, stamp.nsecs = value["secs"], value["nsecs"]
            return stamp
        return value

    def _one_out(self, field: Field, value: Any) -> Any:
        if field.is_compound:
            return self._plain(field.base, value)
        if field.base in TIMES:
            return {"secs": value.secs, "nsecs": value.nsecs}
        return bool(value) if field.base == "bool" else value


class Mcap(FromObjects):
    """mcap-ros2-support, CDR little endian."""

    def __init__(self, types: Types, ros: int = 2) -> None:
        self.types, self.dynamic = types, need_mcap()
        self.readers: dict[str, Callable[[bytes], Any]] = {}
        self.writers: dict[str, Callable[[Any], bytes]] = {}

    def encode(self, name: str, value: dict[str, Any], byteorder: str = "little") -> bytes:
        if name not in self.writers:
            definition = text(self.types, name, 2)
            self.writers[name] = self.dynamic.serialize_dynamic(name, definition)[name]
        return self.writers[name](self._into(name, value))

    def decode(self, name: str, data: bytes) -> dict[str, Any]:
        if name not in self.readers:
            definition = text(self.types, name, 2)
            self.readers[name] = self.dynamic.generate_dynamic(name, definition)[name]
        return self._plain(name, self.readers[name](data))

    def _into(self, name: str, value: dict[str, Any]) -> dict[str, Any]:
        result: dict[str, Any] = {}
        for field in self.types[name]:
            given = value[field.name]
            if field.kind == "one":
                result[field.name] = self._one(field, given)
            else:
                result[field.name] = [self._one(field, item) for item in given]
        return result

    def _one(self, field: Field, value: Any) -> Any:
        if field.is_compound:
            return self._into(field.base, value)
        if field.base == "char" and value > 127:
            return value - 256  # fault 3: char is signed there
        return value

    def _one_out(self, field: Field, value: Any) -> Any:
        if field.is_compound:
            return self._plain(field.base, value)
        return value & 0xFF if field.base == "char" else value  # fault 3


class Cyclone:
    """Eclipse Cyclone DDS' Python serialiser with types made at run time: XCDR1."""

    def __init__(self, types: Types, ros: int = 2) -> None:
        cyclone = pytest.importorskip("cyclonedds.idl", reason=CYCLONE_MISSING)
        self.types, self.idl = types, cyclone.types
        self.make, self.orders = cyclone.make_idl_struct, cyclone.Endianness
        self.classes: dict[str, Any] = {}

    def encode(self, name: str, value: dict[str, Any], byteorder: str = "little") -> bytes:
        order = self.orders.Little if byteorder == "little" else self.orders.Big
        message = self._build(name, value)
        return bytes(message.serialize(endianness=order, use_version_2=False))

    def decode(self, name: str, data: bytes) -> dict[str, Any]:
        # Not through deserialize(): that wants the middleware to have checked the bytes.
        return self._plain(name, self._class(name).deserialize(data))

    def _class(self, name: str) -> Any:
        if name not in self.classes:
            fields = {f.name: self._annotation(f) for f in self.types[name]}
            fields = fields or {PLACEHOLDER: self.idl.uint8}
            flat = name.replace("/", "_")
            self.classes[name] = self.make(flat, flat, fields)
        return self.classes[name]

    def _annotation(self, field: Field) -> Any:
        if field.is_compound:
            base = self._class(field.base)
        elif field.base == "string":
            base = self.idl.bounded_str[field.string_bound] if field.string_bound else str
        elif field.base == "bool":
            base = bool
        else:
            base = getattr(self.idl, integer_type(field.base, 2))
        if field.kind == "fixed":
            return self.idl.array[base, field.size]
        if field.kind == "seq":
            return self.idl.sequence[base, field.size] if field.size else self.idl.sequence[base]
        return base

    def _build(self, name: str, value: dict[str, Any]) -> Any:
        arguments = {f.name: self._into(f, value[f.name]) for f in self.types[name]}
        return self._class(name)(**(arguments or {PLACEHOLDER: 0}))

    def _into(self, field: Field, value: Any) -> Any:
        if not field.is_compound:
            return value
        if field.kind == "one":
            return self._build(field.base, value)
        return [self._build(field.base, item) for item in value]

    def _plain(self, name: str, message: Any) -> dict[str, Any]:
        return {f.name: self._out(f, getattr(message, f.name)) for f in self.types[name]}

    def _out(self, field: Field, value: Any) -> Any:
        if not field.is_compound:
            return corpus.plain(value)
        if field.kind == "one":
            return self._plain(field.base, value)
        return [self._plain(field.base, item) for item in value]
