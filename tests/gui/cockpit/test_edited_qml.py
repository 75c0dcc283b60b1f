"""QML that was edited still loads, and has the values that the edits gave it."""

from __future__ import annotations

import random
from typing import Any

import pytest

from rosglass.cockpit.qml_document import Code, Document
from rosglass.qt import QtCore, QtQml

TEXT = """\
import QtQuick 2.15

// The robot's screen.
Item {
    id: root; property real speed: 1 / 2 // m/s
    property var limits: ({ low: 1, high: [2, 3] })
    property string help: `a
      b ${ "}" } c`
    height: speed > /1/.exec("1")[0] ? 3 : 4
    function half(x) { return x / 2 }
    // left
    Rectangle {
        objectName: "left"; anchors { left: parent.left; margins: 3 } // here
        color: Qt.rgba(0, 0, 1, 1)
        Text { text: qsTr("go") } Item { Item { objectName: "deep" } }
    }

    Rectangle { objectName: "right"; width: root.half(8); Behavior on x { NumberAnimation {} } }
    states: [
        State { name: "a" }, // first
        State { name: "b"; PropertyChanges { target: root; width: 9 } }
    ]
    onWidthChanged: if (width > 5) { speed = 5 } else speed = 6
}
"""


class Loader:
    def __init__(self) -> None:
        self.engine = QtQml.QQmlEngine()

    def load(self, document: Document) -> Any:
        component = QtQml.QQmlComponent(self.engine)
        component.setData(document.text.encode(), QtCore.QUrl("file:///edited.qml"))
        made = component.create()
        assert made is not None, (
            f"{[error.toString() for error in component.errors()]}\n{document.text}"
        )
        made.setParent(self.engine)
        return made


@pytest.fixture
def loader(app: Any) -> Loader:
    return Loader()


def named(document: Document, name: str) -> Any:
    for found in document.objects():
        member = found.get("objectName")
        if member is not None and member.value == name:
            return found
    raise AssertionError(name)


@pytest.mark.parametrize("end", ["\n", "\r\n"])
@pytest.mark.parametrize("seed", range(8))
def test_random_edits_load(loader: Loader, seed: int, end: str) -> None:
    choose = random.Random(seed)
    document = Document(TEXT.replace("\n", end))
    for number in range(25):
        # Other objects have no visual children.
        items = [one for one in document.objects() if one.type in {"Item", "Rectangle", "Text"}]
        target = choose.choice(items)
        action = choose.randrange(7)
        if action == 0:
            value = choose.choice([number, number / 7, Code(f"{number} / 2"), Code("{ return 1 }")])
            document = document.set_property(target, "height", value, overwrite=True)
        elif action == 1:
            text = choose.choice(
                ["Item {}", "Text {\n  text: 'x'\n} // new", "/* new */ Item { x: 1 }"]
            )
            index = choose.randint(0, len(target.children))
            document = document.insert_object(target, text, index)
        elif action == 2:
            parent = choose.choice(items)
            inside = target.span.start <= parent.span.start < target.span.end
            if target.parent is not None and not inside:
                document = document.move_object(target, parent)
        elif action == 3 and target.parent is not None:
            document = document.wrap_object(target, choose.choice(["Item {}", "Item { y: 1 }"]))
        elif action == 4:
            document = document.set_id(target, choose.choice([f"id{number}", target.id]))
        elif action == 5:
            document = document.set_property(target, "objectName", f'it\'s "{number}"\n\u2028')
        else:
            document = document.add_import("QtQuick.Window", "2.15")
        made = loader.load(document)
        # JavaScript ends lines of templates in its own way.
        assert made.property("help") == "a\n      b } c"
        assert made.property("limits").toVariant() == {"low": 1, "high": [2, 3]}


def test_values_arrive(loader: Loader) -> None:
    document = Document(TEXT)
    texts = [
        "",
        "'",
        '"',
        "\\",
        "a\nb\r\tc",
        "\u2028\u2029\ufeff",
        "ü😀",
        "${`}",
        "\0\x7f",
        "*/ //",
    ]
    for text in texts:
        document = document.set_property(document.root, "help", text, overwrite=True)
        assert loader.load(document).property("help") == text
        member = document.root.get("help")
        assert member is not None
        assert member.value == text
    for number in (0, -1, 2**53, 1e300, 5e-324, 0.1, -2.5, 1e21, float("inf")):
        document = document.set_property(document.root, "speed", number, overwrite=True)
        document = document.set_property(document.root, "width", 1, overwrite=True)
        made = loader.load(document.remove_property(document.root, "onWidthChanged"))
        assert made.property("speed") == number
    limits = {"a": [1, {"b c": None}], "d": "'", "é": [[], {}], "if": True}
    document = document.set_property(document.root, "limits", limits)
    assert loader.load(document).property("limits").toVariant() == limits
    member = document.root.get("limits")
    assert member is not None
    assert member.value == limits


def test_objects_keep_their_places(loader: Loader) -> None:
    document = Document(TEXT)
    document = document.move_object(
        named(document, "left"), document.root, after=named(document, "right")
    )
    names = [child.objectName() for child in loader.load(document).childItems()]
    assert names == ["right", "left"]
    deep = named(document, "deep")
    document = document.move_object(deep, document.root, 0)
    names = [child.objectName() for child in loader.load(document).childItems()]
    assert names == ["deep", "right", "left"]
