"""Print what each member of the QML modules is to the reference plugins, or write it into the docs.

    python scripts/compatibility.py [--write]

The members come from the registered types themselves, so that none can be forgotten; a test
compares the page with them, and them with the members that the reference plugins have.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parent))

from reference_members import NOTES, REFERENCE

from rosglass.qml.elements import ros1, ros2
from rosglass.qml.elements.action_client import ActionClient, RosActionClient
from rosglass.qml.elements.goal_handle import GoalHandle, RosGoalHandle, ServerGoalHandle
from rosglass.qml.elements.logger import Console, Logger
from rosglass.qml.elements.publisher import Publisher, RosPublisher
from rosglass.qml.elements.ros1 import Package
from rosglass.qml.elements.services import ServiceClient
from rosglass.qml.elements.yaml_io import Io
from rosglass.qt import QtCore

PAGE = Path(__file__).parents[1] / "docs" / "compatibility.md"
#: Types that only functions return, by the name in the reference.
RETURNED = {
    "Ros": {
        "ActionClient": RosActionClient,
        "Console": Console,
        "GoalHandle": RosGoalHandle,
        "IO": Io,
        "Package": Package,
        "Publisher": RosPublisher,
    },
    "Ros2": {
        "ActionClient": ActionClient,
        "ActionServerGoalHandle": ServerGoalHandle,
        "GoalHandle": GoalHandle,
        "IO": Io,
        "Logger": Logger,
        "Publisher": Publisher,
        "ServiceClient": ServiceClient,
    },
}
BEGIN, END = "<!-- members -->\n", "<!-- end -->\n"


def types(module: str) -> dict[str, Any]:
    """Return the types of a module by the names that QML users know, those returned included."""
    found = ros1 if module == "Ros" else ros2
    named = {name.removesuffix("Native"): kind for name, kind in found.NATIVE.items()}
    return named | dict(found.TYPES) | RETURNED[module]


def members(kind: Any) -> list[str]:
    """Return the names of a type's properties, functions, signals and enumerators."""
    meta = kind.staticMetaObject
    base = meta
    while base.className()[0] != "Q" or base.className().startswith("QPy"):
        base = base.superClass()
    properties = range(base.propertyCount(), meta.propertyCount())
    names = sorted(meta.property(index).name() for index in properties)
    notifiers = {f"{name}Changed" for name in names}
    methods = []
    for index in range(base.methodCount(), meta.methodCount()):
        method = meta.method(index)
        name = bytes(method.name()).decode()
        public = method.access() == QtCore.QMetaMethod.Access.Public
        if public and not name.startswith("_") and name not in notifiers:
            methods.append(name)
    names += sorted(methods)
    for index in range(base.enumeratorCount(), meta.enumeratorCount()):
        enum = meta.enumerator(index)
        names += [str(enum.key(place)) for place in range(enum.keyCount())]
    return list(dict.fromkeys(names))


def table() -> str:
    """Return the tables of both modules in Markdown."""
    parts = []
    for module in ("Ros", "Ros2"):
        parts.append(f"### `import {module} 1.0`\n")
        for name, kind in sorted(types(module).items()):
            reference = REFERENCE[module].get(name, "").split()
            parts += [f"#### {name} ({module})\n", "| member | is | |", "|---|---|---|"]
            for member in members(kind):
                known = "same" if member in reference else "new"
                verdict, why = NOTES.get((module, name, member), (known, ""))
                parts.append(f"| `{member}` | {verdict} | {why} |")
            parts.append("")
    return "\n".join(parts) + "\n"


def page(text: str) -> str:
    """Return the page with its tables as they should be."""
    begin, end = text.index(BEGIN) + len(BEGIN), text.index(END)
    return f"{text[:begin]}\n{table()}{text[end:]}"


if __name__ == "__main__":
    if "--write" in sys.argv[1:]:
        PAGE.write_text(page(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
    else:
        print(table())
