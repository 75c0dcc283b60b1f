"""Pages for all robots of a fleet, made from the page of one."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, NamedTuple

from rosglass.cockpit.layout_edits import element_of
from rosglass.cockpit.qml_values import Code, to_qml
from rosglass.errors import Error, shown

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from rosglass.cockpit.qml_document import Document, Member, Object

__all__ = ["RobotPages", "pages_for_robots"]

#: Types with `ns` that are not in the catalogue of panels.
_WITH_NS = frozenset({"TwistCommand", "LiveTopic", "LiveValue"})
#: Types that are about all robots.
_OVERVIEWS = ("RobotTiles", "RobotSwitch")
#: Robots that get a page.
_MAX_PAGES = 50
_NAMES = re.compile(r"[A-Za-z_$][\w$]*(?:\.[A-Za-z_$][\w$]*)*", re.ASCII)
_TOPIC = re.compile(r"/[A-Za-z]\w*(?:/\w+)*(?::.*)?", re.ASCII)


class RobotPages(NamedTuple):
    """A layout with a page for each robot.

    Attributes:
        document: The layout.
        made: Namespaces of the robots that got a page.
        same: What is the same on all pages, in words with lines.
    """

    document: Document
    made: tuple[str, ...]
    same: tuple[str, ...]


def pages_for_robots(
    document: Document, robots: Sequence[str], has_ns: Callable[[str], bool]
) -> RobotPages:
    """Return a layout with a page for each robot, made from the first page of one robot.

    That is the first page with an `ns`, or the first page that is not an overview, which becomes
    the one of the first robot: its controls without `ns` get one, so that none takes the topic of
    another robot. Robots that have a page keep it.

    Args:
        document: The layout.
        robots: Namespaces of the robots, such as ``/anna``.
        has_ns: Returns whether a type of panel has the property `ns`.

    Raises:
        Error: There is no such page, or something in it cannot be copied; its line, and what to
            change.
    """
    if not robots:
        raise Error("no robot is found: robots are namespaces in which a node uses cmd_vel")
    if len(robots) > _MAX_PAGES:
        raise Error(
            f"{len(robots)} robots are too many for a page each; at most {_MAX_PAGES}. Use one "
            "page that follows RobotTiles: ns: robots.selected"
        )
    page, ns = _chosen(document, robots)
    # Before anything is changed, so that the lines are those of the file.
    _check_outside(document, page, ns)
    for found in page.walk():
        for member in _members(found):
            _value(document, member, ns, ns, {one.id: one.id for one in page.walk() if one.id})
    same = _same(document, page, ns)
    path = page.path
    document = _named(document, path, ns, has_ns)
    page = document.at(path)
    taken = {_literal(one, "ns") for one in _pages(document)}
    ids = {found.id for found in document.objects() if found.id}
    made = [one for one in robots if one not in taken]
    copies = [_copy(document, page, ns, robot, ids) for robot in made]
    place = document.root.children.index(page) + 1
    for at, copy in enumerate(copies):
        document = document.insert_object(document.root, copy, place + at)
    return RobotPages(document, tuple(made), tuple(same) if made else ())


def _pages(document: Document) -> list[Object]:
    return [one for one in document.root.children if element_of(one) == "Page"]


def _literal(found: Object, name: str) -> str:
    """Return a text of an object; empty if it is an expression or not set."""
    member = found.get(name)
    value = member.value if member is not None and member.kind == "literal" else ""
    return value if isinstance(value, str) else ""


def _name(ns: str) -> str:
    return ns.strip("/") or "robot"


def _chosen(document: Document, robots: Sequence[str]) -> tuple[Object, str]:
    """Return the page of one robot, and its namespace."""
    pages = _pages(document)
    page = next((one for one in pages if _literal(one, "ns")), None)
    for one in pages:
        member = one.get("ns")
        if page is None and member is not None and member.kind != "literal":
            raise Error(
                f"{document.file}:{document.position(member.span.start)[0]}: this page follows "
                f"{member.text[:80]}, and serves all robots already"
            )
    if page is None:
        page = next((one for one in pages if not _is_overview(one)), None)
    if page is None:
        raise Error(f"{document.file}: it has no page with panels of one robot; make one first")
    ns = _literal(page, "ns") or next((one for one in robots if one != "/"), "/")
    if not ns.startswith("/") or (ns != "/" and ns.endswith("/")):
        raise Error(
            f"{document.file}:{document.position(page.span.start)[0]}: its ns is {shown(ns)}; "
            f'write it as "/{ns.strip("/")}"'
        )
    if ns == "/":
        raise Error(
            f"{document.file}: the first page is about the robot without a namespace, whose topics "
            "look like those of others; make the page of a robot with one first"
        )
    return page, ns


def _named(
    document: Document, path: tuple[int, ...], ns: str, has_ns: Callable[[str], bool]
) -> Document:
    """Return the document with the namespace on the page and on all its controls."""
    if not _literal(document.at(path), "ns"):
        document = document.set_property(document.at(path), "ns", ns)
        title = _literal(document.at(path), "title")
        if _name(ns) not in title:
            new = f"{title} {_name(ns)}".strip()
            document = document.set_property(document.at(path), "title", new)
    inner = [
        found.path
        for found in document.at(path).walk()
        if (found.type in _WITH_NS or has_ns(found.type)) and found.type not in _OVERVIEWS
    ]
    for one in inner:
        if document.at(one).get("ns") is None:
            document = document.set_property(document.at(one), "ns", ns)
    return document


def _is_overview(page: Object) -> bool:
    return any(found.type in _OVERVIEWS for found in page.walk())


def _members(found: Object) -> Iterator[Member]:
    """Yield the members of an object that have a value, those of groups included."""
    for member in found.members:
        if member.group is not None:
            yield from _members(member.group)
        elif not member.objects and member.value_span is not None:
            yield member


def _check_outside(document: Document, page: Object, ns: str) -> None:
    """Check that what the page uses from outside is not of one robot.

    Raises:
        Error: It is: on the page of another robot, a stick would steer this one.
    """
    outside = {
        found.id: found
        for found in document.objects()
        if found.id and not page.span.start <= found.span.start < page.span.end
    }
    for found in page.walk():
        for member in _members(found):
            if member.kind in ("literal", "id"):
                continue
            for name in set(re.findall(r"(?<![\w$.])[A-Za-z_$][\w$]*", member.text)) & {*outside}:
                other = outside[name]
                given = other.get("ns")
                follows = given is not None and given.kind == "binding"
                owned = any(
                    _moved(one.value, ns, "") != one.value
                    for part in other.walk()
                    for one in _members(part)
                    if one.kind == "literal"
                )
                if (owned and other.parent is not None) or (
                    other.type == "TwistCommand" and not follows
                ):
                    raise Error(
                        f"{document.file}:{document.position(member.span.start)[0]}: {name} "
                        f"({other.type}, line {document.position(other.span.start)[0]}) would be "
                        "the same for all robots: move it into the page, or bind its ns to that "
                        "of the page that is shown"
                    )


def _same(document: Document, page: Object, ns: str) -> list[str]:
    """Return the topics of the page that are not the robot's."""
    found = []
    for one in page.walk():
        for member in _members(one):
            if member.kind != "literal" or one is page:
                continue
            for text in _texts(member.value):
                if _TOPIC.fullmatch(text) and _moved(text, ns, "") == text:
                    line = document.position(member.span.start)[0]
                    found.append(f"{text[:80]} (line {line})")
    return found


def _texts(value: object) -> Iterator[str]:
    if isinstance(value, str) and not isinstance(value, Code):
        yield value
    for one in value if isinstance(value, list) else ():
        yield from _texts(one)


def _moved(value: object, ns: str, to: str) -> object:
    """Return a literal with names in one namespace put into another."""
    if isinstance(value, Code):
        return value
    if isinstance(value, str):
        inside = value == ns or value.startswith((f"{ns}/", f"{ns}:"))
        return f"{to}{value[len(ns) :]}" or "/" if inside else value
    if isinstance(value, list):
        return [_moved(one, ns, to) for one in value]
    if isinstance(value, dict):
        return {key: _moved(one, ns, to) for key, one in value.items()}
    return value


def _copy(document: Document, page: Object, ns: str, robot: str, ids: set[str]) -> str:
    """Return the text of the page for another robot.

    Args:
        document: The layout.
        page: The page of one robot.
        ns: Its namespace.
        robot: The other one's.
        ids: Ids of the layout; those of the copy are added.
    """
    renamed = {}
    for found in page.walk():
        if found.id:
            base = f"{found.id}_{re.sub(r'[^0-9A-Za-z]', '_', _name(robot))}"
            new = next(
                one for one in (base, *(f"{base}{at}" for at in range(2, 999))) if one not in ids
            )
            ids.add(new)
            renamed[found.id] = new
    splices = []
    for found in page.walk():
        for member in _members(found):
            new = _value(document, member, ns, robot, renamed)
            if found is page and member.name == "title" and member.kind == "literal":
                new = to_qml(str(member.value).replace(_name(ns), _name(robot)))
            if new != member.text:
                assert member.value_span is not None
                splices.append((member.value_span, new))
    # With its indentation, by which that of its lines is adapted.
    line = document.text.rfind("\n", 0, page.span.start) + 1
    text, at = [], page.span.start if document.text[line : page.span.start].strip() else line
    for span, new in sorted(splices):
        text += [document.text[at : span.start], new]
        at = span.end
    return "".join([*text, document.text[at : page.span.end]])


def _value(document: Document, member: Member, ns: str, robot: str, renamed: dict[str, str]) -> str:
    """Return the text of a member's value for another robot."""
    text = member.text
    if member.kind == "id":
        return renamed[text]
    if member.kind == "literal":
        value = member.value
        moved = _moved(value, ns, "" if robot == "/" else robot)
        return text if moved == value else to_qml(moved)
    head, dot, rest = text.partition(".")
    if _NAMES.fullmatch(text):
        return f"{renamed.get(head, head)}{dot}{rest}"
    used = next((one for one in renamed if re.search(rf"(?<![\w$]){one}(?![\w$])", text)), "")
    if used or ns in text:
        raise Error(
            f"{document.file}:{document.position(member.span.start)[0]}: {member.name} is code "
            f"that uses {used or ns}, which is another one on each page; write it without code, "
            "or outside of the page"
        )
    return text
