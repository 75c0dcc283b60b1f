"""RViz's plugin classes, as packages declare them."""

from __future__ import annotations

import os
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING
from xml.etree import ElementTree

from rosglass.interfaces.provider import workspace

if TYPE_CHECKING:
    from collections.abc import Iterator

__all__ = ["DISPLAY", "TOOL", "VIEW", "declared"]


DISPLAY, TOOL, VIEW = "rviz::Display", "rviz::Tool", "rviz::ViewController"
#: Prefix of Debian's ROS packages, which rospack finds without environment variables.
_SYSTEM = "/usr/share"


@cache
def declared(base: str) -> tuple[str, ...]:
    """Return the class ids of all plugins of a type; like RViz, searches once per process.

    Args:
        base: Base class: :data:`DISPLAY`, :data:`TOOL` or :data:`VIEW`.
    """
    found = [element for file in _descriptions() for element in _classes(file)]
    names = {
        element.get("name") or element.get("type", "").replace("::", "/")
        for element in found
        if element.get("base_class_type") == base
    }
    return tuple(sorted(names - {""}))


def _descriptions() -> Iterator[str]:
    """Iterate over the plugin description files of RViz (REP 140, section "<export>")."""
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
        # RViz itself logs the error.
        return []
