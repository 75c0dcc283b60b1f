"""Layouts of others: what of them can send to a robot, and which the user has agreed to open.

A layout is a program: it runs as soon as it is opened. One that only receives is opened at once;
for others the user is asked, once for a folder. What was saved here is known by its text.
"""

from __future__ import annotations

import hashlib
import json
import os
from typing import TYPE_CHECKING

from rosglass.cockpit.layout_file import state_folder
from rosglass.errors import Error

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from rosglass.cockpit.qml_document import Document, Member

__all__ = ["TrustedLayouts", "senders"]

#: Types that send nothing, whatever the operator does with them.
_RECEIVERS = frozenset(
    {"Cockpit", "Page", "Split", "Tabs", "Panel", "PanelWindow", "AlarmList", "Attitude", "Battery"}
    | {"CameraGrid", "CameraView", "Compass", "DiagnosticsView", "Gauge", "GeoMap", "JointView"}
    | {"Lamp", "LogView", "NodeGraph", "Plot", "PlotSeries", "RobotSwitch", "RobotTiles", "Speed"}
    | {"TfTree", "WhoSteers"}
)
#: Modules whose types are known; by any other one, the same name may be another type.
_KNOWN_MODULES = frozenset({"QtQuick", "QtQml", "Ros2", "Ros", "RosControls", "RosCockpit"})
#: Entries that are kept.
_MAX_ENTRIES = 500


def senders(document: Document) -> list[str]:
    """Return what in a layout may send to a robot, in words with lines; empty if nothing can.

    Types other than the controls that only receive count, and so does code: handlers, functions
    and expressions may call anything.
    """
    found = [
        f"import {one.name} (line {document.position(one.span.start)[0]})"
        for one in document.imports
        if one.name not in _KNOWN_MODULES
    ]
    for item in document.objects():
        if item.type not in _RECEIVERS:
            found.append(f"{item.type} (line {document.position(item.span.start)[0]})")
        found += [
            f"{member.name} of {item.type} (line {document.position(member.span.start)[0]})"
            for member in _code(document, item.members)
        ]
    return found


def _code(document: Document, members: object) -> Iterator[Member]:
    for member in members:  # type: ignore[attr-defined]
        if member.group is not None:
            yield from _code(document, member.group.members)
        elif not (member.objects or member.kind in ("literal", "id") or _is_plain(member.text)):
            yield member


def _is_plain(text: str) -> bool:
    """Return whether an expression is a name such as ``Qt.Vertical``, which calls nothing."""
    return all(word.isidentifier() for word in text.strip().split("."))


class TrustedLayouts:
    """The folders and layouts that the user has agreed to, kept in the user's state folder."""

    def __init__(self) -> None:
        self._file = state_folder() / "trusted.json"

    def knows(self, path: Path, text: str) -> bool:
        """Return whether a layout is in a trusted folder, or was saved here with this text."""
        entries = self._read()
        folder = os.path.realpath(path.parent)
        return entries.get(folder) == "" or entries.get(os.path.realpath(path)) == _digest(text)

    def trust_folder(self, folder: Path) -> None:
        """Trust all layouts in a folder from now on.

        Raises:
            Error: This cannot be kept.
        """
        self._add(os.path.realpath(folder), "")

    def trust(self, path: Path, text: str) -> None:
        """Trust a layout for as long as it has this text.

        Raises:
            Error: This cannot be kept.
        """
        self._add(os.path.realpath(path), _digest(text))

    def _read(self) -> dict[str, str]:
        try:
            found = json.loads(self._file.read_text(encoding="utf-8"))
        except (OSError, ValueError, RecursionError):
            return {}
        return found if isinstance(found, dict) else {}

    def _add(self, path: str, digest: str) -> None:
        entries = self._read()
        entries.pop(path, None)
        entries[path] = digest
        kept = dict(list(entries.items())[-_MAX_ENTRIES:])
        try:
            self._file.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
            self._file.write_text(json.dumps(kept, indent=1), encoding="utf-8")
        except OSError as error:
            raise Error(f"{self._file} cannot be written: {error.strerror or error}") from None


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode(errors="surrogatepass")).hexdigest()
