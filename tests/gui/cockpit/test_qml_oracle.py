"""The scanner of QML agrees with tree-sitter's grammar about objects, members, ids and spans."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import pytest

import rosglass
from rosglass.cockpit.qml_scanner import Member, Object, Scanner

tree_sitter = pytest.importorskip(
    "tree_sitter", reason="scripts/setup.sh test could not install it"
)
grammar = pytest.importorskip(
    "tree_sitter_qmljs", reason="scripts/setup.sh test could not compile it"
)

ROOT = Path(rosglass.__file__).parents[2]
#: An entry of a file: its category, its name, its text, and the text of its value.
Found = tuple[str, str, str, str]


def qml_files() -> list[Path]:
    import PySide6

    roots = [ROOT / "src", ROOT / "examples", Path(PySide6.__path__[0])]
    roots.append(Path("/usr/lib/x86_64-linux-gnu/qt5/qml"))
    return [path for root in roots for path in sorted(root.rglob("*.qml"))]


def bare(text: str) -> str:
    """Return a text without the semicolon at its end."""
    return text.rstrip().removesuffix(";").rstrip()


def ours(text: str) -> list[tuple[int, Found]]:
    found = []
    scanner = Scanner(text)
    for item in scanner.imports:
        version = f" {item.version}" if item.version else ""
        found.append((item.span.start, ("import", item.name, version, item.alias)))

    waiting: list[Member | Object] = [scanner.root]
    while waiting:
        item = waiting.pop()
        span = item.span
        if isinstance(item, Object):
            start = span.start
            what = "on" if item.on else "object"
            found.append((start, (what, item.type, text[slice(*span)], item.on)))
            waiting += item.items
            continue
        if item.group is not None:
            found.append((span.start, ("object", item.name, text[slice(*span)], "")))
            waiting += item.group.items
            continue
        what = item.form if item.form in {"signal", "required", "function", "enum"} else "member"
        what = "component" if item.form == "component" else what
        if item.type or item.modifiers:
            what = item.type or what
        value = bare(item.text)
        found.append((span.start, (what, item.name, bare(text[slice(*span)]), value)))
        waiting += item.objects
    return sorted(found)


def theirs(text: str) -> list[tuple[int, Found]]:
    data = text.encode()
    offsets, at = {}, 0
    for index, character in enumerate(text):
        offsets[at] = index
        at += len(character.encode())
    offsets[at] = len(text)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        language = tree_sitter.Language(grammar.language())
    tree = tree_sitter.Parser(language).parse(data)

    def end(node: Any) -> int:
        # A semicolon that tree-sitter inserts ends behind the comments after the value.
        last = [child for child in node.named_children if child.type != "comment"]
        inserted = node.type in {"expression_statement", "ui_signal"}
        inserted = inserted or last[-1:] == [node.child_by_field_name("value")]
        return end(last[-1]) if inserted and last else int(node.end_byte)

    def get(node: Any, name: str = "") -> str:
        node = node.child_by_field_name(name) if name else node
        return data[node.start_byte : end(node)].decode() if node is not None else ""

    if tree.root_node.has_error:
        raise ValueError("tree-sitter reports errors")
    found: list[tuple[int, Found]] = []
    waiting = [tree.root_node]
    while waiting:
        node = waiting.pop()
        if node.type in {"statement_block", "expression_statement", "ui_annotation"}:
            continue
        waiting += node.named_children
        start, text_of = offsets[node.start_byte], bare(get(node))
        value = bare(get(node, "value"))
        name = "".join(get(node, "name").split())
        if node.type == "ui_import":
            version = get(node, "version")
            entry = ("import", get(node, "source").strip("\"'"), version and f" {version}")
            found.append((start, (*entry, get(node, "alias"))))
        elif node.type == "ui_object_definition":
            found.append((start, ("object", get(node, "type_name"), text_of, "")))
        elif node.type == "ui_object_definition_binding":
            found.append((start, ("on", get(node, "type_name"), text_of, name)))
        elif node.type == "ui_binding":
            found.append((start, ("member", name, text_of, value)))
        elif node.type == "ui_property":
            found.append((start, (get(node, "type"), name, text_of, value)))
        elif node.type == "ui_signal":
            found.append((start, ("signal", name, text_of, "")))
        elif node.type == "ui_required":
            found.append((start, ("required", name, text_of, "")))
        elif node.type in {"function_declaration", "generator_function_declaration"}:
            found.append((start, ("function", name, text_of, get(node, "body"))))
        elif node.type == "enum_declaration":
            found.append((start, ("enum", name, text_of, get(node, "body"))))
        elif node.type == "ui_inline_component":
            found.append((start, ("component", name, text_of, get(node, "component"))))
    return sorted(found)


CASES = """\
Item { a: 1; b: 2 }
Item { a: b / 2 / c; d: /a[/]"/.test(x) ; e: x++ / 2 }
Item { a: `x ${ `y ${ {z: "}"} }` } }`; b: 1 }
Item { a: x
  b: 2 }
Item { a: x ?
  1 :
  2
  b: y
    ? 1
    : 2
}
Item { a: x +
   1
  b: x
   + 1
  c: f
  (1)
  d: [1,
   2]
  e: (a) => { return 1 }
  f: a => b
  g: function() { return /}/ }
  h: function foo(a) { } }
Item { onA: { if (a) /}/.test(b) } onB: if (a) b(); else c()
  onC: if (a) { b() } else if (c) { d() }
  onD: switch (a) { case 1: break }
  onE: try { a() } catch (e) { } finally { }
  onG: if (a) /}/.test(b); onH: if (a) if (b) c(); else do d(); while (e)
  onI: with (a) for (;;) while (b) switch (c) { default: d() }
  onF: a, b
}
Item { states: [ State { name: "a" }, State { } ] l: [ ]; m: [a, b]; n: [{a: 1}] }
Item { property list<Item> l: [ Item { } ]; property var x: ({a: 1}); property int y }
Item { component A: Item { id: a } enum B { C, D = 2 } signal e(int f); signal g
  required property int h; required i; readonly property Q.Item j: Item { }
  default property alias k: a.b }
Item { anchors { fill: parent; margins: 3 } font.bold: true; Behavior on x.y { A { } } }
Item { a: "x\\"y"; b: 'z\\'"'; /* c */ // d
  // e }
  /* } */ c: 1 /* f
  g */
  d: 2 }
Item { a: typeof b; c: !d; e: -f; g: void 0; h: new I(j); k: l instanceof M; n: o in p }
Item { a: b?.c; d: e ?? f; g: h.if; i: j[k].l(m)`n`; o: p ** q; r: ++s; t: u-- }
Item { function a(b: int): string { return "}" } function *c() { yield 1 } }
Item { a: x as Item; b: (y as Item).z }
Item { é: "ü"; ñ: 1 }
Item { delegate: A { b: 1 } c: D.E { } }
"""


def cases() -> list[str]:
    found: list[str] = []
    for line in CASES.splitlines(keepends=True):
        if line.startswith("Item"):
            found.append("")
        found[-1] += line
    return found


@pytest.mark.parametrize("text", cases())
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_case_is_read_as_tree_sitter_reads_it(text: str, end: str) -> None:
    text = text.replace("\n", end)
    assert ours(text) == theirs(text)


def test_files_are_read_as_tree_sitter_reads_them() -> None:
    compared, differ, unread = 0, [], []
    for path in qml_files():
        text = path.read_bytes().decode().removeprefix("\ufeff")
        try:
            expected = theirs(text)
        except ValueError:
            unread.append(path)
            continue
        compared += 1
        if ours(text) != expected:
            differ.append(path)
    assert not differ
    assert compared > 900
    assert len(unread) < compared // 100, unread
