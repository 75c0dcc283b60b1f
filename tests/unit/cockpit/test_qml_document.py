"""Editing QML: each edit changes only its lines, and undo gives back the bytes."""

from __future__ import annotations

import difflib

import pytest

import rosglass
from rosglass.cockpit.history import History
from rosglass.cockpit.qml_document import Code, Document, Object
from rosglass.errors import ArgumentError, BoundError, QmlSyntaxError

LAYOUT = """\
import QtQuick 2.15
import RosCockpit 1.0

Cockpit {
    TwistCommand { id: command; topic: "cmd_vel" }
    // written by hand
    EmergencyStop { x: a / 2 } // stop
    Page {
        title: qsTr("Drive")
        Split {
            id: split
            Panel { title: "Front"; share: 2; CameraView { topic: "/camera/image" } }
            Split {
                orientation: Qt.Vertical
                // the stick
                Panel { title: "Stick"; DriveStick { command: c } } // here
                Tabs {
                    Panel { title: "Map"; MapView {} }
                    Panel { title: "Battery"; Battery {} }
                }
            }
        }
    }
}
"""


def change(before: Document, after: Document) -> list[str]:
    """Return the changed lines, with - and + in front."""
    found = difflib.unified_diff(
        before.text.splitlines(), after.text.splitlines(), n=0, lineterm=""
    )
    return [line for line in list(found)[2:] if not line.startswith("@@")]


def named(document: Document, title: str) -> Object:
    """Return the object with a title."""
    for found in document.objects():
        member = found.get("title")
        if member is not None and member.value == title:
            return found
    raise AssertionError(title)


@pytest.fixture
def layout() -> Document:
    return Document(LAYOUT, "layout.qml")


class TestProperties:
    def test_value_is_replaced_in_place_and_stays_translated(self, layout: Document) -> None:
        after = layout.set_property(named(layout, "Drive"), "title", 'Say "go"')
        assert change(layout, after) == [
            '-        title: qsTr("Drive")',
            '+        title: qsTr("Say \\"go\\"")',
        ]

    @pytest.mark.parametrize(
        ("value", "text"),
        [
            (3.5, "3.5"),
            (2.0, "2"),
            (True, "true"),
            (None, "null"),
            ([1, "a"], '[1, "a"]'),
            ({"a": [1], "b c": 2}, '({a: [1], "b c": 2})'),
            (Code("Qt.Horizontal"), "Qt.Horizontal"),
            (Code("a ? b : c"), "a ? b : c"),
        ],
    )
    def test_value_of_any_type(self, layout: Document, value: object, text: str) -> None:
        after = layout.set_property(named(layout, "Front"), "share", value)
        assert f'title: "Front"; share: {text}; CameraView' in after.text

    def test_equal_value_changes_nothing(self, layout: Document) -> None:
        assert layout.set_property(named(layout, "Front"), "share", 2) is layout
        assert layout.set_property(named(layout, "Drive"), "title", "Drive") is layout

    def test_expression_is_not_overwritten_by_accident(self, layout: Document) -> None:
        stop = layout.root.children[1]
        with pytest.raises(BoundError, match=r"layout.qml:7:24: x is bound .*: a / 2") as caught:
            layout.set_property(stop, "x", 3)
        assert (caught.value.expression, caught.value.line) == ("a / 2", 7)
        assert "{ x: 3 } // stop" in layout.set_property(stop, "x", 3, overwrite=True).text
        assert layout.set_property(stop, "x", Code("a / 2")) is layout

    def test_new_property_goes_behind_the_others(self, layout: Document) -> None:
        after = layout.set_property(named(layout, "Drive"), "anchors.margins", 4)
        assert change(layout, after) == ["+        anchors.margins: 4"]
        assert after.text.index("margins") < after.text.index("Split")
        after = layout.set_property(named(layout, "Map").children[0], "zoom", 1)
        assert 'Panel { title: "Map"; MapView { zoom: 1 } }' in after.text
        after = layout.set_property(layout.root.children[0], "limit", 1)
        assert '{ id: command; topic: "cmd_vel"; limit: 1 }' in after.text

    def test_object_on_one_line_is_broken_when_the_line_gets_too_long(
        self, layout: Document
    ) -> None:
        after = layout.set_property(named(layout, "Stick"), "help", "x" * 70)
        assert change(layout, after) == [
            '-                Panel { title: "Stick"; DriveStick { command: c } } // here',
            "+                Panel {",
            '+                    title: "Stick"',
            f'+                    help: "{"x" * 70}"',
            "+                    DriveStick { command: c }",
            "+                } // here",
        ]

    def test_blanks_at_the_ends_of_lines_stay(self) -> None:
        document = Document("import QtQuick  \n\nItem {  \n    x: 1 // m \n}\n")
        after = document.set_property(document.root, "y", 2).add_import("QtA")
        assert change(document, after) == ["+import QtA", "+    y: 2"]
        after = document.set_id(document.root, "a")
        assert change(document, after) == ["+    id: a"]

    def test_group_gets_its_own(self) -> None:
        document = Document("Item {\n    anchors { fill: parent }\n    font {\n    }\n}\n")
        after = document.set_property(document.root, "anchors.margins", 4)
        assert "anchors { fill: parent; margins: 4 }" in after.text
        member = after.root.get("anchors.margins")
        assert member is not None
        assert member.value == 4
        bare = after.remove_property(after.root, "anchors.fill")
        assert "anchors { margins: 4 }" in bare.text
        bare = bare.remove_property(bare.root, "anchors.margins")
        assert bare.text == "Item {\n    font {\n    }\n}\n"
        assert (
            "font {\n        bold: true\n    }"
            in bare.set_property(bare.root, "font.bold", True).text
        )

    def test_removed_property_takes_its_line(self, layout: Document) -> None:
        after = layout.set_id(layout.find("split") or layout.root, "")
        assert change(layout, after) == ["-            id: split"]
        after = layout.remove_property(named(layout, "Front"), "share")
        assert 'Panel { title: "Front"; CameraView { topic: "/camera/image" } }' in after.text
        with pytest.raises(ArgumentError, match="a member that the Page has"):
            layout.remove_property(named(layout, "Drive"), "share")

    def test_ids(self, layout: Document) -> None:
        drive = named(layout, "Drive")
        assert change(layout, layout.set_id(drive, "drive")) == ["+        id: drive"]
        assert "Panel { id: front; title:" in layout.set_id(named(layout, "Front"), "front").text
        renamed = layout.set_property(layout.find("split") or drive, "id", "other")
        assert change(layout, renamed) == ["-            id: split", "+            id: other"]
        with pytest.raises(ArgumentError, match="lower-case"):
            layout.set_id(drive, "Drive")
        with pytest.raises(ArgumentError, match=r"no other object has \(Split, line 10\)"):
            layout.set_id(drive, "split")

    @pytest.mark.parametrize(
        "code", ["1; y: 2", "1 }", "a b", "(", "", "1 // c", "Item {}\nItem {}"]
    )
    def test_code_that_is_not_one_expression_is_refused(self, layout: Document, code: str) -> None:
        with pytest.raises(rosglass.Error):
            layout.set_property(named(layout, "Front"), "share", Code(code))

    def test_names_and_values_that_qml_does_not_have_are_refused(self, layout: Document) -> None:
        front = named(layout, "Front")
        for name in ("", "a b", "a: 1; b", "1a", "a."):
            with pytest.raises(ArgumentError, match="name: expected"):
                layout.set_property(front, name, 1)
        alias = Document("Item { property alias a: b.c }")
        with pytest.raises(ArgumentError, match="as a is an alias"):
            alias.set_property(alias.root, "a", 1, overwrite=True)
        for value in (2**60, object(), b"", {1: 2}):
            with pytest.raises(ArgumentError, match="value: expected"):
                layout.set_property(front, "share", value)

    def test_object_of_an_earlier_text_is_refused(self, layout: Document) -> None:
        front = named(layout, "Front")
        after = layout.set_property(front, "share", 3)
        with pytest.raises(ArgumentError, match="an object of this document"):
            after.set_property(front, "share", 4)


class TestObjects:
    def test_insert(self, layout: Document) -> None:
        tabs = named(layout, "Map").parent
        assert tabs is not None
        new = ["+                    // c", "+                    Panel {"]
        new += ['+                        title: "New"', "+                    }"]
        text = '// c\nPanel {\n  title: "New"\n}'
        for place in ({}, {"index": 0}, {"before": tabs.children[1]}, {"after": tabs.children[0]}):
            after = layout.insert_object(tabs, text, **place)  # type: ignore[arg-type]
            assert change(layout, after) == new
            index = {"{}": 2, "{'index': 0}": 0}.get(str(place), 1)
            assert named(after, "New") is after.at(tabs.path).children[index]

    def test_insert_on_one_line(self, layout: Document) -> None:
        front = named(layout, "Front")
        after = layout.insert_object(front, "Battery {}")
        assert 'topic: "/camera/image" } Battery {} }' in after.text
        after = layout.insert_object(front, "Battery {\n    x: 1\n}")
        assert change(layout, after)[1:] == [
            "+            Panel {",
            '+                title: "Front"',
            "+                share: 2",
            '+                CameraView { topic: "/camera/image" }',
            "+                Battery {",
            "+                    x: 1",
            "+                }",
            "+            }",
        ]

    @pytest.mark.parametrize("text", ["", "a: 1", "A {} B {}", "import Q\nA {}", "A {", "}"])
    def test_text_other_than_one_object_is_refused(self, layout: Document, text: str) -> None:
        with pytest.raises(QmlSyntaxError, match="<new object>"):
            layout.insert_object(layout.root, text)

    def test_remove_takes_the_comments_along(self, layout: Document) -> None:
        assert change(layout, layout.remove_object(named(layout, "Stick"))) == [
            "-                // the stick",
            '-                Panel { title: "Stick"; DriveStick { command: c } } // here',
        ]
        map_view = named(layout, "Map").children[0]
        assert 'Panel { title: "Map" }' in layout.remove_object(map_view).text
        with pytest.raises(ArgumentError, match="inside the root"):
            layout.remove_object(layout.root)

    def test_remove_from_lists(self) -> None:
        states = "states: [\n        A {}, // a\n        // b\n        B {}\n    ]"
        document = Document(f"Item {{\n    {states}\n    l: [A {{}}, B {{}}]\n}}\n")
        a, b, c, d = document.root.objects
        assert "[\n        // b\n        B {}\n    ]" in document.remove_object(a).text
        assert "[\n        A {} // a\n    ]" in document.remove_object(b).text
        moved = document.move_object(a, document.root)
        assert moved.text.endswith("    A {} // a\n}\n")
        moved = moved.move_object(moved.root.objects[0], moved.root, 0)
        assert "Item {\n    // b\n    B {}\n    A {} // a\n" in moved.text.replace(
            "    l: [A {}, B {}]\n", ""
        )
        kept = Document("Item {\n    states: [\n        A {},\n\n        // later\n    ]\n}\n")
        kept = kept.remove_object(kept.root.objects[0])
        assert kept.text == "Item {\n    states: [\n\n        // later\n    ]\n}\n"
        assert "l: [B {}]" in document.remove_object(c).text
        after = document.remove_object(d)
        assert "l: [A {}]" in after.text
        assert change(after, after.remove_object(after.root.objects[2])) == ["-    l: [A {}]"]

    def test_move_keeps_comments_and_indents(self, layout: Document) -> None:
        stick, tabs = named(layout, "Stick"), named(layout, "Map").parent
        assert tabs is not None
        after = layout.move_object(stick, tabs, 1)
        assert change(layout, after)[2:] == [
            "+                    // the stick",
            '+                    Panel { title: "Stick"; DriveStick { command: c } } // here',
        ]
        split = stick.parent
        assert split is not None
        assert after.move_object(named(after, "Stick"), after.at(split.path), 0).text == LAYOUT
        with pytest.raises(ArgumentError, match="outside of the one that moves"):
            layout.move_object(layout.find("split") or stick, tabs)
        assert layout.move_object(stick, stick.parent or stick, 0) is layout

    def test_move_does_not_touch_strings_of_several_lines(self) -> None:
        strings = 'x: `one\n    two ${\n        a\n        } three`\n        y: "a\\\n        b"'
        text = f"Item {{\n    A {{\n        {strings}\n        z: 1\n    }}\n"
        text += "    B {\n        C {\n        }\n    }\n}\n"
        document = Document(text)
        a, b = document.root.children
        after = document.move_object(a, b.children[0])
        moved = after.at((0, 0, 0))
        assert moved.type == "A"
        assert moved.get("y").value == "a        b"  # type: ignore[union-attr]
        assert "`one\n    two ${" in moved.text
        assert "} three`" in moved.text
        assert "\n                z: 1\n            }" in after.text
        assert after.move_object(moved, after.root, 0).text == text

    def test_wrap_and_unwrap(self, layout: Document) -> None:
        after = layout.wrap_object(named(layout, "Stick"), "Tabs {}")
        assert change(layout, after)[2:] == [
            "+                Tabs {",
            "+                    // the stick",
            '+                    Panel { title: "Stick"; DriveStick { command: c } } // here',
            "+                }",
        ]
        assert after.unwrap(named(after, "Stick").parent or after.root).text == LAYOUT
        wrapper = 'Split { orientation: Qt.Vertical; Panel { title: "b" } }'
        after = layout.wrap_object(named(layout, "Front"), wrapper, 0)
        split = named(after, "b").parent
        assert split is not None
        assert [child.type for child in split.children] == ["Panel", "Panel"]
        assert split.children[0].text == named(layout, "Front").text
        inner = Document("Item {\n    W {\n        A {} // a\n    } /* w\n    */\n}\n")
        assert inner.unwrap(inner.root.children[0]).text == (
            "Item {\n    A {} // a\n     /* w\n    */\n}\n"
        )
        with pytest.raises(ArgumentError, match="with children"):
            layout.unwrap(named(layout, "Map").children[0])


class TestFile:
    def test_imports_are_sorted_and_added_once(self, layout: Document) -> None:
        assert layout.add_import("QtQuick", "2.15") is layout
        assert layout.add_import("QtQuick") is layout
        assert change(layout, layout.add_import("RosScene", "1.0")) == ["+import RosScene 1.0"]
        after = layout.add_import("QtQuick.Window", "2.15").add_import("../x.js", alias="X")
        assert after.text.startswith(
            "import QtQuick 2.15\nimport QtQuick.Window 2.15\nimport RosCockpit 1.0\n"
            'import "../x.js" as X\n\nCockpit {'
        )
        assert layout.add_import("QtQuick", "2.16").text == LAYOUT.replace("2.15", "2.16")
        bare = Document("// licence\n\n// mine\nItem {}\n").add_import("QtQuick")
        assert bare.text == "// licence\n\nimport QtQuick\n\n// mine\nItem {}\n"
        assert Document("pragma Singleton\nItem {}").add_import("A").text == (
            "pragma Singleton\nimport A\nItem {}"
        )

    def test_windows_files(self) -> None:
        text = "\ufeffimport QtQuick\r\n\r\nItem {\r\n\tid: a\r\n\tRectangle {\r\n\t}\r\n}\r\n"
        document = Document(text)
        after = document.set_property(document.root, "width", 3)
        after = after.insert_object(after.root, "A {\n    x: 1\n}")
        after = after.add_import("QtA")
        assert after.text == (
            "\ufeffimport QtQuick\r\nimport QtA\r\n\r\nItem {\r\n\tid: a\r\n\twidth: 3\r\n"
            "\tRectangle {\r\n\t}\r\n\tA {\r\n\t\tx: 1\r\n\t}\r\n}\r\n"
        )

    def test_lookups(self, layout: Document) -> None:
        for found in layout.objects():
            assert layout.at(found.path) is found
            assert layout.object_at(found.span.start) is found
            assert layout.object_at(found.span.end - 1) is found
        assert layout.object_at(0) is None
        assert layout.position(LAYOUT.index("EmergencyStop")) == (7, 5)
        with pytest.raises(ArgumentError):
            layout.at((9,))


class TestHistory:
    def test_undo_and_redo(self) -> None:
        history = History("a")
        history.push("one", "ab")
        history.push("two", "aXb")
        history.push("nothing", "aXb")
        assert (history.undo_name, history.redo_name) == ("two", "")
        assert history.undo() == "ab"
        assert (history.undo_name, history.redo_name) == ("one", "two")
        assert history.redo() == "aXb"
        assert [history.undo(), history.undo(), history.undo()] == ["ab", "a", "a"]
        history.push("three", "c")
        assert history.redo_name == ""

    def test_changes_of_one_drag_are_undone_together(self) -> None:
        history = History("share: 1")
        for share in (2, 3, 4):
            history.push("Resize", f"share: {share}", merge="share")
        assert history.undo() == "share: 1"
        assert history.redo() == "share: 4"
        history.push("Resize", "share: 1", merge="share")
        assert history.undo_name == ""

    def test_memory_is_limited(self) -> None:
        history = History("", most_bytes=10_000)
        for number in range(1000):
            history.push(str(number), str(number) * 10)
        texts = []
        while history.undo_name:
            texts.append(history.undo())
        assert 10 < len(texts) < 60
        assert texts[:2] == ["998" * 10, "997" * 10]


class TestHostileText:
    @pytest.mark.parametrize(
        "text",
        [
            "Item { x: " + "(" * 1_000_000,
            "Item { x: " + "[" * 1_000_000,
            "Item { x: " + "{" * 1_000_000,
            "Item { x: " + "`${" * 300_000,
            "Item { x: " + "!" * 300_000,
            "Item { x: " + "a?" * 150_000,
            "Item { x: " + "if(a)" * 60_000,
            "Item { x: " + "do " * 100_000,
            "Item { x: " + "/[" * 500_000,
            "Item { x: " + "a / " * 80_000,
            "Item { x: " + "'" + "\\" * 999_999,
            "Item { x: /*" + "*" * 1_000_000,
            "Item { x: " + "1" * 1_000_000,
            "Item { x: " + "function f() {} " * 20_000,
            "Item {" * 100_000,
            "Item { x: " * 100_000,
            "Item { a {" * 100_000,
            "Item { l: [" * 100_000,
            "/*" * 500_000,
            "//" * 500_000,
            "import " * 150_000,
            "pragma a: " + "b, " * 100_000,
            "a." * 200_000,
            "@A {}" * 60_000,
            " " * 1_000_000,
            "\0" * 1_000_000,
            "}" * 1_000_000,
            "Item { x: a" + " " * 1_000_000,
        ],
        ids=lambda text: f"{text[:20]}...",
    )
    @pytest.mark.timeout(60)  # hours, if the cost were quadratic
    def test_large_nonsense_is_an_error_in_linear_time(self, text: str) -> None:
        with pytest.raises(QmlSyntaxError, match="expected"):
            Document(text)

    @pytest.mark.parametrize(
        "text",
        [
            "Item { " + "A { b: 1 } " * 2_000 + "}",
            "Item {\n" + "// a\n" * 30_000 + "A {}\n}",
            "Item {\n" + "a: `\n`\n" * 3_000 + "A {}\n}",
            "Item { l: [\n" + "A {}, // x\n" * 3_000 + "A {}] }",
        ],
        ids=lambda text: f"{text[:20]}...",
    )
    def test_files_with_much_of_one_thing_are_edited(self, text: str) -> None:
        document = Document(text)
        last = document.root.objects[-1]
        assert document.at(last.path) is last
        after = document.set_property(last, "new", "x" * 200)
        after = after.move_object(after.at(last.path), after.root, 0)
        assert after.root.children[0].get("new") is not None
        after = after.wrap_object(after.root.children[0], "W {}")
        after = after.remove_object(after.root.children[0])
        assert len(after.root.objects) == len(document.root.objects) - 1
        assert document.set_id(document.root, "a").root.id == "a"
