"""Texts in our interfaces, examples and documentation are plain: robots' are not interpreted.

Qt takes a text that looks like HTML for rich text, fetches its images, and may show anything.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import pytest

if TYPE_CHECKING:
    from collections.abc import Iterator

ROOT = Path(__file__).parents[2]
#: Take ``textFormat``.
TEXTS = {"Text", "Label"}
#: Have a text of their own inside, which takes what looks like HTML for rich text.
CONTROLS = {
    *("Button", "ToolButton", "RoundButton", "DelayButton", "TabButton", "CheckBox", "RadioButton"),
    *("Switch", "MenuItem", "Menu", "Action", "ItemDelegate", "CheckDelegate", "SwitchDelegate"),
    *("RadioDelegate", "SwipeDelegate", "ToolTip", "ComboBox", "GroupBox", "Dialog"),
}
#: Expressions that texts of controls may contain besides literals: nothing of a robot.
OURS = {"isOn", "replay.playing", "replay.rate", "modelData.name", "label.text", "readonly"}
#: Shows pages of rosglass's own documentation.
HELP = "src/rosglass/cockpit/editor/HelpBox.qml"
LITERAL = r'(?:"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])*\')'


class Element(NamedTuple):
    place: str
    kind: str
    #: Between its braces, and the same with what is nested, quoted or commented blanked.
    text: str
    outline: str
    file_text: str
    is_own: bool


def _blank(text: str) -> str:
    """Return a text of the same length without comments and what is between quotes."""

    def blank(found: re.Match[str]) -> str:
        kept = found[0][0] if found[0][0] in "\"'`" else " "
        inner = "".join("\n" if c == "\n" else " " for c in found[0][1:-1])
        return kept + inner + kept

    pattern = rf"//[^\n]*|/\*.*?\*/|{LITERAL}|`(?:\\.|[^`\\])*`"
    return re.sub(pattern, blank, text, flags=re.DOTALL)


def elements(
    text: str, place: str, first_line: int = 1, own: frozenset[str] = frozenset()
) -> Iterator[Element]:
    """Iterate over the objects that a QML text declares."""
    blanked = _blank(text)
    for found in re.finditer(r"\b([A-Z]\w*)\s*\{", blanked):
        depth, end, outline = 1, found.end(), []
        while depth and end < len(blanked):
            depth += {"{": 1, "}": -1}.get(blanked[end], 0)
            outline.append(blanked[end] if depth == 1 or blanked[end] == "\n" else " ")
            end += 1
        line = first_line + text.count("\n", 0, found.start())
        inner = text[found.end() : end]
        yield Element(f"{place}:{line}", found[1], inner, "".join(outline), text, found[1] in own)


def sources() -> list[Path]:
    folders = [ROOT / "src", ROOT / "examples", ROOT / "docs"]
    found = [p for folder in folders for end in ("qml", "md") for p in folder.rglob(f"*.{end}")]
    return sorted([ROOT / "README.md", *found])


def elements_of(file: Path) -> Iterator[Element]:
    text, place = file.read_text(encoding="utf-8"), str(file.relative_to(ROOT))
    if file.suffix == ".qml":
        own = frozenset(one.stem for one in file.parent.glob("*.qml"))
        yield from elements(text, place, own=own)
        return
    for block in re.finditer(r"```qml\n(.*?)```", text, re.DOTALL):
        yield from elements(block[1], place, 1 + text.count("\n", 0, block.start(1)))


def problem(element: Element) -> str:
    """Return what may show rich text, or take long to wrap a long word; empty for nothing.

    For ``Text.Wrap`` without ``maximumLineCount``, it grows with the square of a word's length.
    """
    bound = re.search(r"(?:^|[\s;])(?:text|title|displayText)[ \t]*:[ \t]*", element.outline)
    value = element.text[bound.end() :].partition("\n")[0] if bound else ""
    if element.kind in TEXTS:
        name = re.search(r"\bid\s*:\s*(\w+)", element.outline)
        assigned = name and re.search(rf"\b{name[1]}\.text\s*=[^=]", element.file_text)
        written = re.match(rf"(?:qsTr\()?{LITERAL}\)?[ \t]*(?:[;}}]|$|//)", value)
        if written and not assigned:
            return ""
        wraps = re.search(
            r"wrapMode\s*:\s*Text\.Wrap(?:AtWordBoundaryOrAnywhere)?\b", element.outline
        )
        if wraps and "maximumLineCount" not in element.outline:
            return f"{element.kind} wraps without maximumLineCount"
        if re.search(r"textFormat\s*:\s*Text\.PlainText\b", element.outline):
            return ""
        if element.place.startswith(HELP) and "Text.MarkdownText" in element.outline:
            return ""
        return f"{element.kind} without textFormat"
    if element.kind == "ComboBox":  # its own text is in a text field, which shows plain text
        return "" if "delegate" in element.outline else "ComboBox without a delegate"
    if element.kind in CONTROLS and element.is_own:
        return ""  # another type of this name, in the same folder
    if element.kind in CONTROLS and bound and "contentItem" not in element.outline:
        names = re.findall(r"[A-Za-z_][\w.]*", _blank(re.split(r";|\}", value)[0]))
        foreign = set(names) - OURS - {"qsTr"}
        return f"{element.kind} shows {', '.join(sorted(foreign))}" if foreign else ""
    return ""


def test_texts_are_plain() -> None:
    found = [element for file in sources() for element in elements_of(file)]
    assert sum(element.kind in TEXTS for element in found) > 100
    wrong = [f"{e.place}: {problem(e)}" for e in found if problem(e)]
    assert wrong == []
    # A tool tip that is attached has no format at all.
    attached = re.compile(rf"ToolTip\.text\s*:\s*(?!{LITERAL}\s*[\n;}}])")
    assert [f for f in sources() if attached.search(f.read_text(encoding="utf-8"))] == []


@pytest.mark.parametrize(
    ("text", "wrong"),
    [
        ('Text { text: "LIVE" }', False),
        ("Text { text: sub.message.data }", True),
        ('Text { text: "state: " + sub.message.data }', True),
        ("Label { color: 'red'; text: robot.name; textFormat: Text.PlainText }", False),
        ("Label { text: robot.name; Item { property int textFormat: Text.PlainText } }", True),
        ("Label { id: note }", True),
        ('Item { Label { id: note; text: "a" } function f(x) { note.text = x } }', True),
        ("Text { text: a.b; textFormat: Text.PlainText; wrapMode: Text.Wrap }", True),
        ("Text { text: a.b; textFormat: Text.PlainText; wrapMode: Text.WordWrap }", False),
        ("Text { text: 'a b'; wrapMode: Text.Wrap }", False),
        ("Button { text: sub.message.data }", True),
        ('Button { text: isOn ? "On" : "Off" }', False),
        ("ToolTip { text: status.name }", True),
        ("ComboBox { model: frames }", True),
        ("ComboBox { model: frames; delegate: ItemDelegate { } }", False),
    ],
)
def test_rich_text_is_found(text: str, wrong: bool) -> None:
    assert any(problem(element) for element in elements(text, "a")) == wrong
