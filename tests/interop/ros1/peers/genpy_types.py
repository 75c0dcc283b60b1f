"""Prints every installed message type, one JSON object a line, with samples as genpy writes them.

Services are printed as their requests and responses.
"""

import base64
import importlib
import io
import json
import random
import sys
from pathlib import Path

import genpy

INTEGERS = {
    "byte": (-128, 127), "char": (0, 255), "int8": (-128, 127), "uint8": (0, 255),
    "int16": (-(2**15), 2**15 - 1), "uint16": (0, 2**16 - 1),
    "int32": (-(2**31), 2**31 - 1), "uint32": (0, 2**32 - 1),
    "int64": (-(2**63), 2**63 - 1), "uint64": (0, 2**64 - 1),
}  # fmt: skip
STRINGS = ("", "map", "Grüße", "カメラ", "🤖", 'a "b"\n\t\\', "x" * 300)
FLOATS = (0.0, -1.5, 0.1, float("inf"), float("-inf"), 5e-324, 1.7e308)
SINGLES = (0.0, -1.5, 0.15625, float("inf"), float("-inf"), 2.0**127)


def value_of(kind, style, chance):
    """Return a value for a field of a type, as plain data."""
    base, bracket, size = kind.partition("[")
    if bracket:
        length = int(size[:-1]) if size[:-1] else {"low": 0, "high": 3}.get(style)
        if length is None:
            length = chance.randint(0, 5)
        return [value_of(base, style, chance) for _ in range(length)]
    if base in INTEGERS:
        low, high = INTEGERS[base]
        return {"low": low, "high": high}.get(style, chance.randint(low, high))
    if base == "bool":
        return style == "high" or (style == "random" and chance.random() < 0.5)
    if base == "string":
        return chance.choice(STRINGS)
    if base in ("float32", "float64"):
        return chance.choice(SINGLES if base == "float32" else FLOATS)
    if base == "time":
        return {"secs": value_of("uint32", style, chance), "nsecs": chance.randrange(10**9)}
    if base == "duration":
        return {"secs": value_of("int32", style, chance), "nsecs": chance.randrange(10**9)}
    kind = genpy.message.get_message_class(base)
    return values_of(kind, style, chance)


def values_of(kind, style, chance):
    """Return a message's fields as plain data."""
    types = zip(kind.__slots__, kind._slot_types, strict=True)
    return {name: value_of(type_name, style, chance) for name, type_name in types}


def build(kind, value):
    """Return genpy's message with these fields."""
    message = kind()
    for name, type_name in zip(kind.__slots__, kind._slot_types, strict=True):
        setattr(message, name, build_field(type_name, value[name]))
    return message


def build_field(type_name, value):
    """Return a field as genpy wants it."""
    base, bracket, _ = type_name.partition("[")
    if bracket:
        if base in ("uint8", "char"):
            return bytes(value)
        return [build_field(base, item) for item in value]
    if base in ("time", "duration"):
        made = genpy.Time() if base == "time" else genpy.Duration()
        made.secs, made.nsecs = value["secs"], value["nsecs"]
        return made
    if isinstance(value, dict):
        return build(genpy.message.get_message_class(base), value)
    return value


def classes():
    """Yield name and class of all message types."""
    for folder in sorted(Path(genpy.__file__).parent.parent.glob("*/[ms][sr][gv]")):
        module = importlib.import_module(f"{folder.parent.name}.{folder.name}")
        for name in sorted(vars(module)):
            found = getattr(module, name)
            if (
                isinstance(found, type)
                and issubclass(found, genpy.Message)
                and folder.name == "msg"
            ):
                yield found
            elif hasattr(found, "_request_class"):
                yield found._request_class
                yield found._response_class


def main():
    """Print them."""
    chance = random.Random(int(sys.argv[1]))
    for kind in classes():
        samples = []
        for style in ("low", "high", "random", "random", "random"):
            value = values_of(kind, style, chance)
            buffer = io.BytesIO()
            build(kind, value).serialize(buffer)
            data = base64.b64encode(buffer.getvalue()).decode()
            samples.append({"value": value, "data": data})
        described = {"type": kind._type, "md5": kind._md5sum, "text": kind._full_text}
        print(json.dumps({"type": described, "samples": samples}))
    print(json.dumps({"end": True}))


if __name__ == "__main__":
    main()
