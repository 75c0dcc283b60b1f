"""The first layout of a robot, made of the panels that its topics call for."""

from __future__ import annotations

from textwrap import indent
from typing import TYPE_CHECKING

from rosglass.cockpit.qml_values import to_qml

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from rosglass.cockpit.panels import Panel, Proposal

__all__ = ["empty_layout", "first_layout", "panel_text"]

#: Groups whose panels need room.
_LARGE_GROUPS = ("See", "Map")
#: Groups whose panels share a place as tabs.
_TABBED_GROUPS = ("Lists", "Call", "Record", "Robots")
#: Panels in one column, beyond which they share places as tabs.
_MAX_COLUMN = 4
_HEAD = "import QtQuick 2.15\nimport Ros2 1.0\nimport RosControls 1.0\nimport RosCockpit 1.0\n"


def panel_text(panel: Panel, snippet: str, title: str = "") -> str:
    """Return the QML of a panel with a snippet of the catalogue in it.

    Args:
        panel: The entry of the catalogue.
        snippet: The object to show; see :attr:`Panel.snippet`.
        title: The panel's title; the name of the type in words by default.
    """
    title = title or words_of(panel.name)
    return f"Panel {{\n    title: {to_qml(title)}\n{indent(snippet, '    ')}\n}}"


def words_of(name: str) -> str:
    """Return the name of a type as words: ``Camera view`` for ``CameraView``."""
    spaced = "".join(
        f" {letter.lower()}" if letter.isupper() and before.islower() else letter
        for before, letter in zip(f" {name}", name, strict=False)
    )
    return spaced[:1].upper() + spaced[1:]


def empty_layout(title: str = "Cockpit") -> str:
    """Return a layout with an empty page."""
    return _file(title, "", ())


def _file(title: str, content: str, modules: Iterable[str]) -> str:
    known = _HEAD.splitlines()
    more = sorted({f"import {module}" for module in modules} - {*known})
    head = _HEAD + "".join(f"{line}\n" for line in more)
    titled = f"title: {to_qml(title)}\n"
    page = _container("Page", [f"{titled}{content}".rstrip()])
    return f"{head}\n{_container('Cockpit', [f'{titled}{page}'])}\n"


def first_layout(
    proposals: Sequence[Proposal],
    title: str = "Robot",
    title_of: Callable[[str], str] | None = None,
) -> str:
    """Return a layout of one page with all proposed panels.

    Cameras and maps have the room on the left, what is steered and watched is beside them in a
    column, and lists share a place as tabs.

    Args:
        proposals: The panels, best first.
        title: Title of the layout and its page.
        title_of: Returns the title of a panel from the name of its type; by default, its words.
    """
    if not proposals:
        return empty_layout(title)
    modules = {module for one in proposals for module in one.panel.imports}
    return _file(title, _arranged(proposals, title_of or words_of), modules)


def _arranged(proposals: Sequence[Proposal], title_of: Callable[[str], str]) -> str:
    large, column, tabbed = [], [], []
    for one in proposals:
        if one.panel.group in _LARGE_GROUPS and _is_large(one.panel):
            large.append(one)
        elif one.panel.group in _TABBED_GROUPS:
            tabbed.append(one)
        else:
            column.append(one)
    left = _stack([_text(one, title_of) for one in large])
    places = [_text(one, title_of) for one in column[: _MAX_COLUMN - 1]]
    rest = [_text(one, title_of) for one in (*column[_MAX_COLUMN - 1 :], *tabbed)]
    if rest:
        places.append(_tabs(rest))
    right = _stack(places)
    if not left or not right:
        return left or right
    return f"Split {{\n{indent(_with_share(left, 2), '    ')}\n{indent(right, '    ')}\n}}"


def _is_large(panel: Panel) -> bool:
    return panel.name not in ("Compass", "Attitude")


def _text(proposal: Proposal, title_of: Callable[[str], str]) -> str:
    title = title_of(proposal.panel.name)
    if proposal.topic and proposal.panel.group == "See":
        title = proposal.topic.strip("/").split("/")[0] or title
    return panel_text(proposal.panel, proposal.snippet, title)


def _stack(places: Sequence[str]) -> str:
    if len(places) < 2:
        return "".join(places)
    return _container("Split", ["orientation: Qt.Vertical", *places])


def _tabs(places: Sequence[str]) -> str:
    return places[0] if len(places) == 1 else _container("Tabs", places)


def _container(name: str, parts: Iterable[str]) -> str:
    inner = "\n".join(parts)
    return f"{name} {{\n{indent(inner, '    ')}\n}}"


def _with_share(text: str, share: int) -> str:
    """Return a panel or container with a share of its Split."""
    head, _, rest = text.partition("{\n")
    return f"{head}{{\n    share: {share}\n{rest}"
