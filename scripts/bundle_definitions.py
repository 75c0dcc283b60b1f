"""Write the message sets of the ROS distributions, as rosbags ships them, into text bundles.

rosglass reads its standard definitions from ``src/rosglass/interfaces/distributions/*.txt`` and not
from rosbags itself, because importing rosbags costs 40 ms (120 ms once numpy comes along) and a
bundle less than one; rosbags stays the source of truth, which a test holds the bundles against.
rosbags has neither default values nor comments: those come from ``scripts/interface_notes.txt``.

Run it after updating rosbags: ``python scripts/bundle_definitions.py``.
"""

from __future__ import annotations

from collections import defaultdict
from pathlib import Path
from typing import Any

from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_typestore

ROOT = Path(__file__).resolve().parent.parent
TARGET = ROOT / "src/rosglass/interfaces/distributions"
NOTES = ROOT / "scripts/interface_notes.txt"
ROS2 = ["dashing", "eloquent", "foxy", "galactic", "humble", "iron", "jazzy", "kilted", "lyrical"]
PLACEHOLDER = "structure_needs_at_least_one_member"
ROS1_TIME = {"builtin_interfaces/msg/Time": "time", "builtin_interfaces/msg/Duration": "duration"}


def type_text(description: Any, package: str, ros: int) -> str:
    kind, rest = description
    if kind == Nodetype.BASE:
        name, bound = rest
        return f"{name}<={bound}" if bound else str(name)
    if kind == Nodetype.NAME:
        if ros == 1 and rest in ROS1_TIME:
            return ROS1_TIME[rest]
        owner, _, base = rest.split("/")
        return base if owner == package else f"{owner}/{base}"
    inner, size = rest
    text = type_text(inner, package, ros)
    if kind == Nodetype.ARRAY:
        return f"{text}[{size}]"
    return f"{text}[<={size}]" if size else f"{text}[]"


def constant_text(kind: str, value: Any) -> str:
    return repr(value) if kind.startswith("float") else str(value)


def definition_text(name: str, store: Any, ros: int, notes: dict[tuple[str, str], str]) -> str:
    package = name.split("/", maxsplit=1)[0]
    constants, fields = store[name]
    lines = [f"{kind} {key}={constant_text(kind, value)}" for key, kind, value in constants]
    for field, description in fields:
        if field != PLACEHOLDER:
            note = notes.get((name, field), "")
            line = f"{type_text(description, package, ros)} {field}"
            lines.append(f"{line} {note}" if note else line)
    return "\n".join(lines)


def read_notes() -> dict[tuple[str, str], str]:
    """Read the lines ``pkg/Type.field [default] [# comment]``."""
    notes = {}
    for line in NOTES.read_text(encoding="utf-8").splitlines():
        if line and not line.startswith("#"):
            place, _, note = line.partition(" ")
            name, _, field = place.partition(".")
            notes[name.replace("/", "/msg/"), field] = note.strip()
    return notes


def bundle(distributions: dict[str, Any], ros: int, notes: dict[tuple[str, str], str]) -> str:
    """Join definitions; one that differs between distributions appears once per variant."""
    variants: dict[str, dict[str, list[str]]] = defaultdict(lambda: defaultdict(list))
    for distribution, store in distributions.items():
        for name in store:
            if ros == 2 or name not in ROS1_TIME:
                variants[name][definition_text(name, store, ros, notes)].append(distribution)
    parts = []
    for name in sorted(variants):
        for text, found in variants[name].items():
            everywhere = len(found) == len(distributions)
            label = "" if everywhere else " " + " ".join(found)
            parts.append(f"=== {name}{label}\n{text}\n" if text else f"=== {name}{label}\n")
    return "".join(parts)


def main() -> None:
    worlds = {
        1: {"noetic": get_typestore(Stores.ROS1_NOETIC).fielddefs},
        2: {name: get_typestore(Stores(f"ros2_{name}")).fielddefs for name in ROS2},
    }
    notes = read_notes()
    known = {
        (name, field)
        for stores in worlds.values()
        for store in stores.values()
        for name, (_, fields) in store.items()
        for field, _ in fields
    }
    unknown = sorted(set(notes) - known)
    if unknown:
        raise SystemExit(f"{NOTES.name} names fields that rosbags doesn't know: {unknown}")
    TARGET.mkdir(exist_ok=True)
    for ros, distributions in worlds.items():
        # Default values exist in ROS 2 only.
        usable = {key: note for key, note in notes.items() if ros == 2 or note.startswith("#")}
        path = TARGET / f"ros{ros}.txt"
        path.write_text(bundle(distributions, ros, usable), encoding="utf-8")
        print(f"{path.relative_to(ROOT)}: {path.stat().st_size} bytes")


if __name__ == "__main__":
    main()
