"""Random edits of all QML files here: nothing else changes, and undo gives back the bytes."""

from __future__ import annotations

import json
import random
import re
import subprocess
from collections import Counter
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import rosglass
from rosglass.cockpit.history import History
from rosglass.cockpit.qml_document import Code, Document, Member, Object

if TYPE_CHECKING:
    from collections.abc import Iterable

ROOT = Path(rosglass.__file__).parents[2]
VALUES = (1, -2.5, 'it\'s "so"\n', True, None, [1, "a"], {"a": 1}, Code("Qt.Vertical"))
CODES = ("Item {}", "[Item {}, Item { x: 1 }]", "{ a() }", "if (a) b(); else c()", "a / 2")
NEW_OBJECTS = ("A {}", "A { b: 1 }", "// c\nA {\n  b: 1\n}", "A {} // c", "/* c */ A {\n}")
WRAPPERS = ("W {}", "W { a: 1 }", "W {\n a: 1\n W {\n } }", "W { /* c */ }")


@cache
def files() -> tuple[Path, ...]:
    """Return the QML files of this project and of Qt's own modules."""
    import PySide6

    roots = [ROOT / "src", ROOT / "examples", Path(PySide6.__path__[0])]
    return tuple(path for root in roots for path in sorted(root.rglob("*.qml")))


CRASHED = "qmllint crashed"


def refused_by_qt(folder: Path) -> dict[str, str]:
    """Return the names of files in a folder that Qt's parser refuses, and why."""
    names = sorted(path.name for path in folder.glob("*.qml"))
    refused = {}
    for start in range(0, len(names), 50):
        refused.update(_refused(folder, names[start : start + 50]))
    return refused


def _refused(folder: Path, names: list[str]) -> dict[str, str]:
    import PySide6

    done = subprocess.run(
        [str(Path(PySide6.__path__[0]) / "qmllint"), "--bare", "--json", "-", *names],
        cwd=folder,
        capture_output=True,
        check=False,
    )
    if done.returncode < 0:
        if len(names) == 1:
            return {names[0]: CRASHED}
        halves = names[: len(names) // 2], names[len(names) // 2 :]
        return _refused(folder, halves[0]) | _refused(folder, halves[1])
    refused = {}
    files = json.loads(done.stdout)["files"]
    assert [Path(file["filename"]).name for file in files] == names
    for file in files:
        messages = [one["message"] for one in file["warnings"] if one["id"] == "syntax"]
        if messages or (not file["success"] and not file["warnings"]):
            refused[Path(file["filename"]).name] = " ".join(messages)
    return refused


def entries(found: Object) -> tuple[object, ...]:
    """Return the contents of an object, without the layout of its text."""
    parts: list[object] = [found.type, found.on]
    for item in found.items:
        if isinstance(item, Object):
            parts.append(entries(item))
        elif item.group is not None:
            parts.append((item.name, *entries(item.group)))
        else:
            value = tuple(map(entries, item.objects)) or " ".join(item.text.split())
            parts.append((item.form, item.name, item.type, value))
    return tuple(parts)


def members(document: Document) -> Counter[tuple[str, str, str]]:
    """Return all members with their values, those that are objects left out."""
    waiting: list[Member | Object] = list(document.objects())
    counts: Counter[tuple[str, str, str]] = Counter()
    while waiting:
        item = waiting.pop()
        if isinstance(item, Object):
            waiting += item.members
        elif item.group is not None:
            waiting.append(item.group)
        elif not item.objects:
            counts[item.form, item.name, " ".join(item.text.split())] += 1
    return counts


class Editor:
    """Makes random edits, and checks that nothing else has changed."""

    def __init__(self, seed: int) -> None:
        self.random = random.Random(seed)
        self.edits: Counter[str] = Counter()
        self._number = 0

    def edit(self, document: Document) -> Document:
        """Return the document after one more edit."""
        name = self.random.choice(
            [
                "value",
                "code",
                "add",
                "remove",
                "insert",
                "take",
                "move",
                "wrap",
                "unwrap",
                "id",
                "head",
            ]
        )
        target = self.random.choice(list(document.objects()))
        after: Document = getattr(self, f"_{name}")(document, target)
        self.edits[name] += after is not document
        return after

    def _with_value(self, target: Object) -> Member | None:
        found = [item for item in target.members if item.form == "value" and item.value_span]
        found = [item for item in found if item.name != "id" and item.type != "alias"]
        found = [item for item in found if target.get(item.name) is item]
        return self.random.choice(found) if found else None

    def _value(self, document: Document, target: Object) -> Document:
        member, value = self._with_value(target), self.random.choice(VALUES)
        if member is None:
            return document
        after = document.set_property(target, member.name, value, overwrite=True)
        changed = after.at(target.path).get(member.name)
        assert changed is not None
        assert changed.value == value
        assert (members(document) - members(after)).total() <= 1
        assert (members(after) - members(document)).total() <= 1
        return after

    def _code(self, document: Document, target: Object) -> Document:
        member, code = self._with_value(target), Code(self.random.choice(CODES))
        if member is None or member.type:
            return document
        after = document.set_property(target, member.name, code, overwrite=True)
        changed = after.at(target.path).get(member.name)
        assert changed is not None
        assert changed.text == code
        return after

    def _add(self, document: Document, target: Object) -> Document:
        self._number += 1
        name = self.random.choice(["", "anchors.", "font."]) + f"zzz{self._number}"
        after = document.set_property(target, name, "a" * self.random.choice([1, 90]))
        assert not members(document) - members(after)
        assert (members(after) - members(document)).total() == 1
        assert members(after.remove_property(after.at(target.path), name)) == members(document)
        return after

    def _remove(self, document: Document, target: Object) -> Document:
        member = self._with_value(target)
        if member is None:
            return document
        after = document.remove_property(target, member.name)
        assert (members(document) - members(after)).total() == 1
        assert not members(after) - members(document)
        return after

    def _insert(self, document: Document, target: Object) -> Document:
        index = self.random.choice([None, self.random.randint(0, len(target.children))])
        after = document.insert_object(target, self.random.choice(NEW_OBJECTS), index)
        place = len(target.children) if index is None else index
        assert after.at(target.path).children[place].type == "A"
        assert not members(document) - members(after)
        return after

    def _take(self, document: Document, target: Object) -> Document:
        if target.parent is None:
            return document
        after = document.remove_object(target)
        assert not members(after) - members(document)
        return after

    def _move(self, document: Document, target: Object) -> Document:
        parent = self.random.choice(list(document.objects()))
        if target.parent is None or target.span.start <= parent.span.start < target.span.end:
            return document
        others = [child for child in parent.children if child is not target]
        after = document.move_object(target, parent, self.random.randint(0, len(others)))
        assert entries(target) in [entries(found) for found in after.objects()]
        assert len(list(after.objects())) == len(list(document.objects()))
        assert members(after) == members(document)
        return after

    def _wrap(self, document: Document, target: Object) -> Document:
        if target.on:
            return document
        after = document.wrap_object(target, self.random.choice(WRAPPERS))
        wrapper = after.at(target.path)
        assert wrapper.type == "W"
        assert entries(wrapper.children[-1]) == entries(target)
        assert not members(document) - members(after)
        return after

    def _unwrap(self, document: Document, target: Object) -> Document:
        children = target.children
        is_value = target.parent is None or target.member is not None
        if not children or (is_value and len(children) > 1):
            return document
        after = document.unwrap(target)
        found = [entries(other) for other in after.objects()]
        assert all(entries(child) in found for child in children)
        return after

    def _id(self, document: Document, target: Object) -> Document:
        self._number += 1
        after = document.set_id(target, f"zzz{self._number}")
        assert after.at(target.path).id == f"zzz{self._number}"
        return after

    def _head(self, document: Document, _: Object) -> Document:
        self._number += 1
        name = self.random.choice(["QtZ", "Ab.C", "./x.js"])
        after = document.add_import(name, alias=f"Z{self._number}")
        assert len(after.imports) == len(document.imports) + 1
        assert entries(after.root) == entries(document.root)
        return after


def test_thousand_edits_of_all_files_and_their_undo(tmp_path: Path) -> None:
    editor = Editor(1)
    chosen = editor.random.sample(files(), 300)
    for index, path in enumerate(chosen):
        text = path.read_bytes().decode()
        if editor.random.random() < 0.3:
            text = text.replace("\r\n", "\n").replace("\n", "\r\n")
        document, history, texts = Document(text, str(path)), History(text), [text]
        for number in range(5):
            document = editor.edit(document)
            history.push(str(number), document.text)
            texts += [document.text] if document.text != texts[-1] else []
            if "\r\n" in text and text.count("\r\n") == text.count("\n"):
                assert document.text.count("\r\n") == document.text.count("\n")
        assert [history.undo() for _ in texts[1:]] == texts[-2::-1]
        assert [history.redo() for _ in texts[1:]] == texts[1:]
        (tmp_path / f"{index}.qml").write_bytes(document.text.encode())
    assert editor.edits.total() > 1000
    assert min(editor.edits.values()) > 10
    assert set(refused_by_qt(tmp_path).values()) <= {CRASHED}


def test_one_changed_property_is_one_line_for_git(tmp_path: Path) -> None:
    choose = random.Random(2)
    old, new = tmp_path / "old", tmp_path / "new"
    old.mkdir()
    new.mkdir()
    changed = 0
    for index, path in enumerate(choose.sample(files(), 150)):
        document = Document(path.read_bytes().decode(), str(path))
        literals = [
            (found, item)
            for found in document.objects()
            for item in found.members
            if item.kind == "literal" and "\n" not in item.text and found.get(item.name) is item
        ]
        if literals:
            target, member = choose.choice(literals)
            after = document.set_property(target, member.name, "another value")
            (old / f"{index}.qml").write_bytes(document.text.encode())
            (new / f"{index}.qml").write_bytes(after.text.encode())
            changed += 1
    done = subprocess.run(
        ["git", "diff", "--no-index", "--numstat", "old", "new"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert changed > 100
    assert [line.split("\t")[:2] for line in done.stdout.splitlines()] == [["1", "1"]] * changed


# ---- texts of every shape

NAMES = st.sampled_from(["a", "width", "anchors.fill", "onClicked", "Keys.onUpPressed", "é", "on"])
EXPRESSIONS = st.sampled_from(
    [
        *("1", '"}"', "'\\'{'", "a / b / c", "/[/}]{/.test(a)", "`${`}`}{`", "(a, b) => ({c: 1})"),
        *("function(a) { return /}/ }", "a ? b : c", "[1, {a: 2}]", "!a++ / 2", "a\n  .b"),
        *(
            "a ||\n b",
            "typeof /}/",
            "a.if / 2",
            "new A({})",
            "f(/)/)",
            "a => { return 1 }",
            "(1\n)",
        ),
    ]
)
CLOSED = st.sampled_from(
    [
        *("{ a() }", "{ if (a) /}/.test(b) }", "if (a) { b() } else { /[}]/ }", "switch (a) { }"),
        *("try { } catch (e) { }", "Item { }", "Item { a: 1 }", "[A { }, B { }]"),
    ]
)
GAPS = st.sampled_from(
    [
        "\u2028",
        " // a\u2029",
        "\r",
        " /* a\n */\n",
        " ",
        "\n    ",
        "\r\n\t",
        ' /* } " */ ',
        " // it's {\n",
    ]
)


@st.composite
def items(draw: st.DrawFn, depth: int) -> tuple[str, tuple[object, ...], bool]:
    """Return the text of an item, what it is, and whether it ends with a bracket."""
    what = draw(
        st.sampled_from(["value", "closed", "child", "group", "signal", "function", "property"])
    )
    if depth > 2 and what in {"child", "group"}:
        what = "value"
    gap = draw(GAPS)
    if what in {"child", "group"}:
        name = draw(st.sampled_from(["A", "B.C"] if what == "child" else ["font", "q.anchors"]))
        body, expected = draw(bodies(depth=depth + 1))
        on = draw(st.sampled_from(["", " on x", " on a.b"])) if what == "child" else ""
        return f"{name}{on}{gap}{body}", (what, name, on[4:], expected), True
    if what == "signal":
        return draw(st.sampled_from([("signal a(int b)", ("signal", "a"), False)] * 2))
    if what == "function":
        return "function a(b: int): int { return '}' }", ("function", "a"), True
    if what == "property":
        value = draw(EXPRESSIONS)
        return f"readonly property var x:{gap}{value}", ("x", value), False
    name, value = draw(NAMES), draw(CLOSED if what == "closed" else EXPRESSIONS)
    return f"{name}{gap}:{draw(GAPS)}{value}", (name, value), what == "closed"


@st.composite
def bodies(draw: st.DrawFn, depth: int = 0) -> tuple[str, list[tuple[object, ...]]]:
    """Return the text of a body, and what is in it."""
    text, expected = "{", []
    for item, what, closed in draw(st.lists(items(depth), max_size=4)):
        text += draw(GAPS) + item
        expected.append(what)
        if closed and what[0] != "x":
            text += draw(GAPS)
        else:
            text += draw(st.sampled_from(["\n", "\r\n", "; ", " ;\n", " // }\n"]))
    return text + "}", expected


def read(found: Object) -> list[tuple[object, ...]]:
    """Return what is in an object, as `bodies` gives it."""
    parts: list[tuple[object, ...]] = []
    for item in found.items:
        if isinstance(item, Object):
            parts.append(("child", item.type, item.on, read(item)))
        elif item.group is not None:
            parts.append(("group", item.name, "", read(item.group)))
        elif item.form in {"signal", "function"}:
            parts.append((item.form, item.name))
        else:
            parts.append((item.name, item.text))
    return parts


@settings(max_examples=400, deadline=None)
@given(body=bodies(), seed=st.integers(0, 1000))
def test_text_of_any_shape_is_read_and_edited(
    body: tuple[str, list[tuple[object, ...]]], seed: int
) -> None:
    text, expected = f"Item {body[0]}\n", body[1]
    document = Document(text)
    assert read(document.root) == expected
    editor, history = Editor(seed), History(text)
    for number in range(4):
        document = editor.edit(document)
        history.push(str(number), document.text)
    while history.undo_name:
        history.undo()
    assert history.text == text


SNIPPETS = """\
a: 1 b: 2
a: 1; b: 2
a: A {}; b: 1
a: A {} b: 1
A {}; A {}
a: 1;; b: 2
;
a: {}; b: 1
a: {} b: 1
a: ; b: 1
a: return 1
a: for (;;) b()
a: if (b) c() else d()
a: if (b) c(); else d(); e: 1
a: if (b) { } else { } e: 1
a: if (b) c();; d: 1
a: do b(); while (c)
a: var b = 1
a: b /* c */ d: 1
l: [A {}, A {}] b: 1
l: [A {}, A {}]; b: 1
l: [A {} A {}]
l: [A {},]
l: [,]
property list<Item> l: [A {}]; property int b
property list<Item> l: [A {}] property int b
property var l: [A {}]
property Item a: A {}; property int b
property Item a: A {} property int b
property int a: {1}; property int b
property int a property int b
property int a; property int b
function f() {}; b: 1
function f() {} b: 1
function f(a: int, b = "}"): string { return "{" }
enum E { A }; b: 1
component B: A {}; b: 1
component B: { }
signal a signal b
signal a(int b); signal c
required a; b: 1
default readonly property int a: 1
final property int a: 3
@A { b: 1 } c: 1
font { bold: true }; b: 1
font . bold: true
A on b {}
a.b on c {}
a: /b]/.c
a: /[/]/.c
a: /[/
a: `${`}`}`
a: `${`
a: "b
a: (b))
a: b ? c
a: b ? c : d ? e : f
a: async
a: b => { return 1 }
a: new (b)
a: typeof
a: !
a: b++ / 2
a: 3px
a: b as A
a:
:
a
"a": 1
import A
""".splitlines()


def test_qt_and_the_scanner_refuse_the_same(tmp_path: Path) -> None:
    refused = set()
    for index, snippet in enumerate(SNIPPETS):
        text = f"Item {{ {snippet} }}\n"
        (tmp_path / f"{index}.qml").write_text(text)
        try:
            Document(text)
        except rosglass.QmlSyntaxError:
            refused.add(snippet)
    assert 30 < len(refused) < 45
    assert refused == {SNIPPETS[int(Path(name).stem)] for name in refused_by_qt(tmp_path)}


def test_changed_tokens_that_qt_reads_are_read(tmp_path: Path) -> None:
    choose = random.Random(3)
    tokens = re.compile(r"\s+|\w+|\W")
    extra = [
        *"{}()[];:,/`'\".?+1x",
        "if",
        "else",
        "function",
        "on",
        "as",
        "=>",
        "//c\n",
        "\n",
        "in",
    ]
    small = [path for path in files() if path.stat().st_size < 6000]
    refused = {}
    for index in range(600):
        parts = tokens.findall(choose.choice(small).read_bytes().decode())
        at = choose.randrange(len(parts))
        if choose.random() < 0.6:
            parts.insert(at, choose.choice(extra))
        else:
            del parts[at]
        name, text = f"{index}.qml", "".join(parts)
        (tmp_path / name).write_bytes(text.encode())
        try:
            Document(text)
        except rosglass.QmlSyntaxError as error:
            refused[name] = str(error)
    assert 100 < len(refused) < 500
    assert not refused.keys() - refused_by_qt(tmp_path).keys()


@settings(max_examples=600, deadline=None)
@given(
    inner=st.text(st.sampled_from("AaIt{}[]():;,.?/*'\"`$\\\n\r =>+-onif1\ufeff"), max_size=60),
    around=st.sampled_from(["{}", "Item {{ a: {} }}", "Item {{ {} }}"]),
)
def test_arbitrary_text_is_read_or_refused(inner: str, around: str) -> None:
    text = around.format(inner)
    try:
        document = Document(text)
    except rosglass.QmlSyntaxError as error:
        lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
        assert error.column <= len(lines[error.line - 1]) + 1  # noqa: PT017
    else:
        assert document.root.text in text


@pytest.mark.parametrize("old", ["", "a", "abab", "x" * 1000])
@given(texts=st.lists(st.text("abx", max_size=8), max_size=8))
def test_history_gives_back_any_text(old: str, texts: Iterable[str]) -> None:
    history, known = History(old), [old]
    for text in texts:
        history.push("edit", text)
        known += [text] if text != known[-1] else []
    assert [history.undo() for _ in known[1:]] == known[-2::-1]
    assert [history.redo() for _ in known[1:]] == known[1:]


def test_all_files_of_the_project_and_of_qt_are_read() -> None:
    assert len(files()) > 900
    for path in files():
        text = path.read_bytes().decode()
        document = Document(text, str(path))
        for found in document.objects():
            assert document.at(found.path) is found
