"""A robot's text is shown as it is, whatever it contains: at run time."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from rosglass.qt import QT6

pytestmark = pytest.mark.both_qt

CONTROLS = Path(__file__).with_name("controls_with_texts.qml")
#: Debian's Qt 5 lacks QtGraphicalEffects, which its style Imagine needs.
STYLES = (
    ["Basic", "Fusion", "Imagine", "Material", "Universal", "FluentWinUI3"]
    if QT6
    else ["Default", "Fusion", "Material", "Universal"]
)
HOSTILE = "<img src='http://0.0.0.0:9/a.png'><b>all good</b>"


@pytest.mark.parametrize("style", STYLES)
def test_no_text_of_a_control_ends_the_interface(style: str, start: Any) -> None:
    """Qt's own IconLabel crashes at each image, in buttons, menu items and delegates."""
    program = start("run", CONTROLS, QT_QUICK_CONTROLS_STYLE=style)
    program.until("all texts were shown")
    program.kill(15)
    assert program.end() == 143
    assert "loaded before" not in program.text


def test_controls_show_markup_as_it_is(bench: Any) -> None:
    root: Any = bench.load(
        """Item {
            Button { id: button; text: HOSTILE }
            ItemDelegate { id: item; text: HOSTILE; icon.name: "x"; spacing: 3 }
            Button { id: less; text: "a < b" }
            Button { id: word; text: "a b" }
            function texts() {
                return JSON.stringify([button, item].map(c => [c.text, c.contentItem.text]))
            }
            function widths() {
                return JSON.stringify([button, item, word, less].map(c => c.implicitWidth))
            }
        }""".replace("HOSTILE", json.dumps(HOSTILE)),
        "import QtQuick 2.15\nimport QtQuick.Controls 2.15",
    )
    assert json.loads(root.texts()) == [[HOSTILE, HOSTILE]] * 2
    button, item, word, less = json.loads(root.widths())
    # As wide as its letters; as markup it would be two words.
    assert button > 250
    assert item > 250
    assert less >= word


def test_labels_of_controls_are_as_large_as_a_screen(bench: Any) -> None:
    """In the style Material, 54 kB of text took 840 MB: a button's shadow is as large as it is."""
    root: Any = bench.load(
        """Item {
            Button { id: wide; text: "x".repeat(50000) }
            Button { id: high; text: "x\\n".repeat(50000) }
            function sizes() { return JSON.stringify([wide.implicitWidth, high.implicitHeight]) }
        }""",
        "import QtQuick 2.15\nimport QtQuick.Controls 2.15",
    )
    assert all(4000 < size < 5000 for size in json.loads(root.sizes()))


def test_labels_of_controls_have_the_baseline_of_their_text(bench: Any) -> None:
    root: Any = bench.load(
        """Item {
            Label { id: label; text: "x" }
            Button { id: button; text: "x"; font: label.font; padding: 0 }
            ItemDelegate { id: item; text: "x"; font: label.font; padding: 0 }
            function baselines() {
                return JSON.stringify([label, button, item].map(c => c.baselineOffset))
            }
        }""",
        "import QtQuick 2.15\nimport QtQuick.Controls 2.15",
    )
    label, button, item = json.loads(root.baselines())
    assert 0 < label <= button
    assert label <= item


@pytest.mark.parametrize("version", ["2.4", "2.15", *(["6.0", ""] if QT6 else [])])
def test_labels_are_plain_whatever_version_is_imported(version: str, bench: Any) -> None:
    root: Any = bench.load(
        "Item { property string label: String(one); IconLabel { id: one; text: 'x' } }",
        f"import QtQuick 2.15\nimport QtQuick.Controls.impl {version}",
    )
    assert root.property("label").startswith("IconLabel_")


LONG_WORD = "x" * 50_000


def test_tool_tips_show_limited_plain_text(bench: Any) -> None:
    """Tool tips that are attached have no text format to choose."""
    root: Any = bench.load(
        """Item {
            id: root
            property string late
            ToolTip { id: initial; text: HOSTILE }
            ToolTip { id: changed; text: root.late }
            ToolTip { id: short_; text: "two words" }
            ToolTip { id: own; text: HOSTILE; contentItem: Text { textFormat: Text.StyledText } }
            Item { id: attached; ToolTip.text: HOSTILE }
            function tip(t) {
                const label = t.contentItem
                return [label.textFormat === Text.PlainText, label.lineCount, label.truncated]
            }
            function tips() {
                attached.ToolTip.toolTip.text = WORD
                return JSON.stringify(
                    [initial, changed, short_, own, attached.ToolTip.toolTip].map(tip))
            }
        }""".replace("HOSTILE", json.dumps(HOSTILE)).replace("WORD", json.dumps(LONG_WORD)),
        "import QtQuick 2.15\nimport QtQuick.Controls 2.15",
    )
    root.setProperty("late", HOSTILE)
    initial, changed, short, own, attached = json.loads(root.tips())
    assert initial[0]
    assert changed[0]
    assert short == [True, 1, False]
    assert not own[0]
    assert attached[0]
    assert attached[1] <= 40


@pytest.mark.parametrize("style", STYLES)
def test_a_tool_tip_opens_no_image_and_wraps_no_long_word(
    style: str, start: Any, tmp_path: Path
) -> None:
    file = tmp_path / "Main.qml"
    file.write_text("""import QtQuick 2.15
import QtQuick.Controls 2.15
ApplicationWindow {
    width: 600; height: 400; visible: true
    Item { ToolTip { id: image; visible: true; text: "<img src='file:///nothing.png'>" } }
    Item { ToolTip { id: word; visible: true; text: "x".repeat(50000) } }
    Item { id: attached }
    Timer {
        running: true
        interval: 1
        onTriggered: {
            attached.ToolTip.show("<img src='file:///nothing.png'>")
            console.log("bounded:", word.contentItem.lineCount <= 40)
        }
    }
}
""")
    program = start("run", file, QT_QUICK_CONTROLS_STYLE=style)
    assert "bounded: true" in program.until("bounded:")
    program.kill(15)
    assert program.end() == 143
    assert "nothing.png" not in program.text
