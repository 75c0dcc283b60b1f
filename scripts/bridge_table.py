"""Print the table of corresponding ROS 1 and ROS 2 types, or write it into docs/bridge.md.

    python scripts/bridge_table.py [--write]

The table lists the result of rosglass.interfaces.Counterparts for the types that ship with
rosglass: Noetic's and Jazzy's. A test compares the two.
"""

from __future__ import annotations

import sys
from collections import defaultdict
from pathlib import Path
from typing import TYPE_CHECKING

from rosglass.errors import Error
from rosglass.interfaces import Counterparts, Definition, Library, ServiceDefinition, ros1_name

if TYPE_CHECKING:
    from rosglass.interfaces.definition import InterfaceDefinition

PAGE = Path(__file__).parents[1] / "docs" / "bridge.md"
BEGIN, END = "<!-- table: types -->\n", "<!-- end -->\n"


def table() -> str:
    """Return the table in Markdown."""
    library = Library(distribution="jazzy")
    counterparts = Counterparts(library)
    same: dict[str, list[str]] = defaultdict(list)
    own: dict[str, list[str]] = defaultdict(list)
    rows = []
    other: InterfaceDefinition
    for name in library.names(1):
        try:
            source = library.definition(name, ros=1)
        except Error:
            continue
        package, _, base = name.split("/")
        lost: list[str] = []
        added: list[str] = []
        if isinstance(source, Definition):
            pair = counterparts.message(source)
            other = pair.two
            lost, added = list(pair.lost(1)), list(pair.lost(2))
        elif isinstance(source, ServiceDefinition):
            found = counterparts.service(source)
            other = found[0]
        else:
            other = counterparts.action(source)[0]
            base = f"{base} (action)"
        if other.source.provider.startswith("derived"):
            own[package].append(base)
        elif other.name != name or lost or added:
            differences = "; ".join(
                f"{which} only: {', '.join(f'`{path}`' for path in paths)}"
                for which, paths in (("ROS 1", lost), ("ROS 2", added))
                if paths
            )
            rows.append(f"| `{ros1_name(name)}` | `{ros1_name(other.name)}` | {differences} |")
        else:
            same[package].append(base)
    lines = ["The same in both, except for `Header.seq` and times:", "", "| Package | Types |"]
    lines += ["|---|---|"]
    lines += [f"| `{package}` | {', '.join(names)} |" for package, names in same.items()]
    lines += ["", "Different in name, or with fields that only one of them has:", ""]
    lines += ["| ROS 1 | ROS 2 | |", "|---|---|---|", *rows]
    lines += ["", "Types of ROS 1 without a counterpart in ROS 2; they are derived:", ""]
    lines += ["| Package | Types |", "|---|---|"]
    lines += [f"| `{package}` | {', '.join(names)} |" for package, names in own.items()]
    return "\n".join(lines) + "\n"


def page(text: str) -> str:
    """Return the page's text with the table as it is to be."""
    before, _, rest = text.partition(BEGIN)
    _, _, after = rest.partition(END)
    return f"{before}{BEGIN}\n{table()}\n{END}{after}"


if __name__ == "__main__":
    if sys.argv[1:] == ["--write"]:
        PAGE.write_text(page(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
    else:
        sys.stdout.write(table())
