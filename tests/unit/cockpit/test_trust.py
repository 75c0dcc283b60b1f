"""Layouts of others: what of them can send, and which are trusted."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from rosglass.cockpit.qml_document import Document
from rosglass.cockpit.trust import TrustedLayouts, senders

if TYPE_CHECKING:
    from pathlib import Path

HEAD = "import QtQuick 2.15\nimport RosControls 1.0\nimport RosCockpit 1.0\n"


@pytest.mark.parametrize(
    ("body", "found"),
    [
        ('Battery { topic: "/b"; low: 0.2 }', []),
        ("Split { orientation: Qt.Vertical }", []),
        ("DriveStick {}", ["DriveStick (line 4)"]),
        ("Battery { Component.onCompleted: go() }", ["Component.onCompleted of Battery (line 4)"]),
        ("Battery { low: go() }", ["low of Battery (line 4)"]),
        ("Battery { low: a + b }", ["low of Battery (line 4)"]),
        ("Battery { anchors { margins: go() } }", ["margins of Battery (line 4)"]),
        ("Battery { property int a: go() }", ["a of Battery (line 4)"]),
        ("Battery { function go() { } }", ["go of Battery (line 4)"]),
        ("Battery { Timer { running: true } }", ["Timer (line 4)"]),
        ("Battery { source: Publisher { } }", ["Publisher (line 4)"]),
        ("Battery { parts: [Battery {}, Publisher {}] }", ["Publisher (line 4)"]),
        ("Own.Battery {}", ["Own.Battery (line 4)"]),
    ],
)
def test_senders_are_named_with_lines(body: str, found: list[str]) -> None:
    assert senders(Document(f"{HEAD}Panel {{ {body} }}")) == found


def test_other_modules_may_have_types_of_the_same_names() -> None:
    text = 'import "mine"\n' + HEAD + "Panel { Battery {} }"
    assert senders(Document(text)) == ["import mine (line 1)"]


def test_folders_and_saved_texts_are_trusted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    path, other = tmp_path / "a" / "x.qml", tmp_path / "b" / "y.qml"
    trusted = TrustedLayouts()
    assert not trusted.knows(path, "1")
    trusted.trust(path, "1")
    assert TrustedLayouts().knows(path, "1")
    assert not trusted.knows(path, "2")
    trusted.trust_folder(other.parent)
    assert trusted.knows(other, "any text")
    assert not trusted.knows(other.parent / "deeper" / "z.qml", "any text")
    (tmp_path / "state/rosglass/cockpit/trusted.json").write_text("[[[[")
    assert not trusted.knows(path, "1")
