"""The libraries of the codec benchmark behind one interface.

What is timed are Python statements with the names they need, as they stand, so that no wrapper
of ours is part of anybody's figure. Every library gets values in the form it likes best (numpy
arrays, bytes or lists).
"""

from __future__ import annotations

import importlib.util
import itertools
import re
import sys
from dataclasses import dataclass
from io import BytesIO
from typing import TYPE_CHECKING, Any

import numpy as np
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from samples import Sample, Value, build_any, builder, definition, store, walker

if TYPE_CHECKING:
    from collections.abc import Callable

#: A timed statement, and the names that it uses.
Statement = tuple[str, dict[str, Any]]

DEBIAN_PACKAGES = "/usr/lib/python3/dist-packages"


class MissingError(Exception):
    """A library cannot be imported; the message says how to get it."""


@dataclass(frozen=True)
class Library:
    """A library prepared for one sample and wire.

    Attributes:
        encodings: Every route from the sample's value to bytes, by name; takes the encoded sample.
        decode: Bytes to the library's message.
        statements: What is timed, by metric; all may use the name ``data``.
        first_use: Definition text and bytes to a decoded message, without any cache.
    """

    encodings: dict[str, Callable[[bytes], bytes]]
    decode: Callable[[bytes], Any]
    statements: dict[str, Statement]
    first_use: Callable[[bytes], Any]


def rosglass(sample: Sample, ros: int, value: Value) -> Library:
    import rosglass
    from rosglass.interfaces.provider import MemoryProvider
    from rosglass.messages import MessageType

    wire = "ros1" if ros == 1 else "cdr"
    kind = rosglass.load(sample.type, ros=ros)
    text, path = definition(sample.type, ros), sample.leaf
    if ros == 1:
        value, path = _ros1_times(value), path.replace(".sec", ".secs")
    leaf = compile(f"m.{path}", "<leaf>", "eval")
    fresh = itertools.count()

    def first_use(data: bytes) -> Any:
        # A new constant in every type each time, so that no cache knows the text.
        constant = f"uint32 FRESH_{next(fresh)}=1\n"
        changed = constant + re.sub(r"(?m)^(MSG: .*\n)", rf"\1{constant}", text)
        library = rosglass.Library(MemoryProvider("empty"))
        library.add_text(sample.type, changed, ros=ros)
        unknown = MessageType(library.definition(sample.type, ros=ros))
        return eval(leaf, {"m": unknown.decode(data, wire=wire)})

    names = {
        "decode": kind.decode,
        "encode": kind.encode,
        "parts": kind.encode_parts,
        "path": kind.path(path, wire=wire),
        "walk": walker(sample.type, ros, ("secs", "nsecs") if ros == 1 else ("sec", "nanosec")),
        "value": value,
    }
    given = f"wire={wire!r}"
    return Library(
        encodings={
            "dict": lambda _: kind.encode(value, wire=wire),
            "parts": lambda _: b"".join(kind.encode_parts(value, wire=wire)),
            "untouched": lambda data: kind.encode(kind.decode(data, wire=wire), wire=wire),
            "eager": lambda data: kind.encode(kind.decode_all(data, wire=wire), wire=wire),
            "to_dict": lambda data: kind.encode(kind.decode(data, wire=wire).to_dict(), wire=wire),
        },
        decode=lambda data: kind.decode(data, wire=wire),
        statements={
            "decode": (f"decode(data, {given})", names),
            "path": ("path(data)", names),
            "attribute": (f"decode(data, {given}).{path}", names),
            "every leaf": (f"walk(decode(data, {given}))", names),
            "encode": (f"encode(value, {given})", names),
            "parts": (f"parts(value, {given})", names),
        },
        first_use=first_use,
    )


def rosbags(sample: Sample, ros: int, value: Value) -> Library:
    types, name, text = store(ros), sample.type, definition(sample.type, ros)
    by_hand = builder(name, ros, types.types.__getitem__)
    wire = "ros1" if ros == 1 else "cdr"
    read, write = getattr(types, f"deserialize_{wire}"), getattr(types, f"serialize_{wire}")
    base = get_typestore(Stores.EMPTY)
    if ros == 1:
        for builtin in ("Time", "Duration"):
            full = f"builtin_interfaces/msg/{builtin}"
            base.register(get_types_from_msg("int32 sec\nuint32 nanosec", full))

    def first_use(data: bytes) -> Any:
        fresh = Typestore()
        fresh.fielddefs.update(base.fielddefs)
        fresh.types.update(base.types)
        fresh.register(get_types_from_msg(text, name))
        return getattr(fresh, f"deserialize_{wire}")(data, name)

    names = {
        "read": read,
        "write": write,
        "build": build_any,
        "by_hand": by_hand,
        "types": types,
        "walk": walker(name, ros),
        "value": value,
        "name": name,
    }
    return Library(
        encodings={
            "dict": lambda _: bytes(write(build_any(types, name, value), name)),
            "by hand": lambda _: bytes(write(by_hand(value), name)),
            "message": lambda data: bytes(write(read(data, name), name)),
        },
        decode=lambda data: read(data, name),
        statements={
            "decode": ("read(data, name)", names),
            "decode view": ("read(view, name)", names),
            "attribute": (f"read(data, name).{sample.leaf}", names),
            "every leaf": ("walk(read(data, name))", names),
            "encode": ("write(build(types, name, value), name)", names),
            "encode by hand": ("write(by_hand(value), name)", names),
        },
        first_use=first_use,
    )


def genpy(sample: Sample, ros: int, value: Value) -> Library | None:
    if ros != 1:
        return None
    if importlib.util.find_spec("genpy") is None and DEBIAN_PACKAGES not in sys.path:
        sys.path.append(DEBIAN_PACKAGES)
    try:
        import genpy
        import genpy.dynamic
    except ImportError:
        raise MissingError("python3-genpy is not installed: apt install python3-genpy") from None
    short, text = sample.type.replace("/msg/", "/"), definition(sample.type, 1)
    classes = genpy.dynamic.generate_dynamic(short, text)
    message = classes[short]

    def class_of(name: str) -> Any:
        if name.startswith("builtin_interfaces/"):
            return getattr(genpy, name.rsplit("/", 1)[1])
        return classes[name.replace("/msg/", "/")]

    def write(message: Any) -> bytes:
        buffer = BytesIO()
        message.serialize(buffer)
        return buffer.getvalue()

    build, listed = builder(sample.type, 1, class_of), _listed(value)
    leaf = sample.leaf.replace(".sec", ".secs")
    names = {
        "message": message,
        "write": write,
        "build": build,
        "walk": walker(sample.type, 1, ("secs", "nsecs")),
        "value": listed,
    }
    return Library(
        encodings={
            "dict": lambda _: write(build(listed)),
            "message": lambda data: write(message().deserialize(data)),
        },
        decode=lambda data: message().deserialize(data),
        statements={
            "decode": ("message().deserialize(data)", names),
            "attribute": (f"message().deserialize(data).{leaf}", names),
            "every leaf": ("walk(message().deserialize(data))", names),
            "encode": ("write(build(value))", names),
        },
        first_use=lambda data: genpy.dynamic.generate_dynamic(short, text)[short]().deserialize(
            data
        ),
    )


def mcap_ros2(sample: Sample, ros: int, value: Value) -> Library | None:
    if ros != 2:
        return None
    try:
        from mcap_ros2 import _dynamic
    except ImportError:
        raise MissingError("not installed: pip install mcap-ros2-support") from None
    name, text, listed = sample.type, definition(sample.type, 2), _listed(value)
    read = _dynamic.generate_dynamic(name, text)[name]
    write = _dynamic.serialize_dynamic(name, text)[name]
    names = {"read": read, "write": write, "walk": walker(name, 2), "value": listed}

    def first_use(data: bytes) -> Any:
        return _dynamic.generate_dynamic(name, text)[name](data)

    return Library(
        encodings={
            "dict": lambda _: write(listed),
            "message": lambda data: write(read(data)),
        },
        decode=read,
        statements={
            "decode": ("read(data)", names),
            "attribute": (f"read(data).{sample.leaf}", names),
            "every leaf": ("walk(read(data))", names),
            "encode": ("write(value)", names),
        },
        first_use=first_use,
    )


#: Ours first; a peer returns None for a wire it does not speak.
LIBRARIES: dict[str, Callable[[Sample, int, Value], Library | None]] = {
    "rosglass": rosglass,
    "rosbags": rosbags,
    "genpy": genpy,
    "mcap-ros2": mcap_ros2,
}


def _ros1_times(value: Any) -> Any:
    # ROS 1 calls the parts of a time secs and nsecs.
    if isinstance(value, dict):
        if value.keys() == {"sec", "nanosec"}:
            return {"secs": value["sec"], "nsecs": value["nanosec"]}
        return {key: _ros1_times(item) for key, item in value.items()}
    return [_ros1_times(item) for item in value] if isinstance(value, list) else value


def _listed(value: Any) -> Any:
    # The form that genpy and mcap-ros2 take: bytes for uint8[], lists for other arrays.
    if isinstance(value, dict):
        return {key: _listed(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_listed(item) for item in value]
    if isinstance(value, np.ndarray):
        return value.tobytes() if value.dtype == np.uint8 else value.tolist()
    return value
