"""Which displays, tools and views RViz can make: what installed packages declare."""

from __future__ import annotations

import os
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple
from xml.etree import ElementTree

from rosglass.comm.names import similar
from rosglass.errors import Error
from rosglass.interfaces.folders import workspace
from rosglass.rviz.shown import shown

if TYPE_CHECKING:
    from collections.abc import Iterator

__all__ = ["DISPLAY", "TOOL", "VIEW", "Plugin", "declared", "require_class_id"]

DISPLAY, TOOL, VIEW = "rviz::Display", "rviz::Tool", "rviz::ViewController"
_EXAMPLES = {DISPLAY: "rviz/Grid", TOOL: "rviz/Measure", VIEW: "rviz/Orbit"}
#: Where Debian has its packages, which rospack finds without any variable.
_SYSTEM = "/usr/share"
_LONGEST = 200


class Plugin(NamedTuple):
    """A class that RViz can make."""

    #: E.g. ``rviz/Measure``.
    class_id: str
    #: What its package says about it.
    description: str


@cache
def declared(base: str) -> dict[str, Plugin]:
    """Return the classes of a kind by their id; found once per process, as RViz does.

    Args:
        base: :data:`DISPLAY`, :data:`TOOL` or :data:`VIEW`.
    """
    found: dict[str, Plugin] = {}
    for file in _descriptions():
        for element in _classes(file):
            name = element.get("name") or element.get("type", "").replace("::", "/")
            if element.get("base_class_type") == base and name:
                about = " ".join((element.findtext("description") or "").split())
                found.setdefault(name, Plugin(name, about))
    return dict(sorted(found.items()))


def require_class_id(class_id: object, base: str) -> str:
    """Return the id of a class, if it is one.

    Raises:
        Error: It is no text of the form ``package/Class``.
    """
    if isinstance(class_id, str) and len(class_id) <= _LONGEST:
        package, slash, name = class_id.partition("/")
        if slash and all(p.replace("_", "").isalnum() and p.isascii() for p in (package, name)):
            return class_id
    near = similar(class_id, declared(base)) if isinstance(class_id, str) else ""
    example = _EXAMPLES[base]
    raise Error(f"expected the id of a class, e.g. {example!r}, got {shown(class_id)}{near}")


def _descriptions() -> Iterator[str]:
    """Iterate over files that describe plugins of RViz (REP 140, section "<export>")."""
    folders = dict(workspace(os.environ).packages())
    for manifest in Path(_SYSTEM).glob("*/package.xml"):
        folders.setdefault(manifest.parent.name, str(manifest.parent))
    for folder in folders.values():
        try:
            root = ElementTree.parse(Path(folder, "package.xml")).getroot()
        except (OSError, ElementTree.ParseError):
            continue
        for element in root.iterfind("./export/rviz"):
            yield element.get("plugin", "").replace("${prefix}", folder)


def _classes(file: str) -> list[ElementTree.Element]:
    try:
        return list(ElementTree.parse(file).getroot().iter("class"))
    except (OSError, ElementTree.ParseError):
        # RViz tells it in its log.
        return []
