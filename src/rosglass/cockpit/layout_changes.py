"""Compares two versions of a layout: which elements stay, and what of them changes.

It decides what :class:`~rosglass.cockpit.live_layout.LiveLayout` does with the living objects: no
object is touched for a change that would need the whole file to be loaded again.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

from rosglass.cockpit.layout_edits import element_of
from rosglass.cockpit.qml_document import Member, Object, Span

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from rosglass.cockpit.qml_document import Document

__all__ = ["Changes", "Setting", "elements_in", "elements_of", "text_of"]

#: Properties of elements, and what they are where a layout does not say it.
_DEFAULTS = {
    "share": "1",
    "title": '""',
    "ns": '""',
    "orientation": "Qt.Horizontal",
    "screenName": '""',
    "fullScreen": "false",
    "currentIndex": "0",
    "minimumSize": "Qt.size(0, 0)",
}
_PRAGMA = re.compile(r"^[^\S\n]*pragma\b.*$", re.MULTILINE)
_WORD = re.compile(r"[A-Za-z_]\w*")

Path = tuple[int, ...]


class Setting(NamedTuple):
    """A property that gets another literal.

    Attributes:
        element: Path of the element, in the new document.
        inside: Place of the object in the element: for each object on the way, its index among
            the children; empty for the element itself.
        name: The property.
        text: Its value, as it is written.
    """

    element: Path
    inside: Path
    name: str
    text: str


class _NotFollowedError(Exception):
    """The living objects cannot follow a change."""


@dataclass
class Changes:
    """The steps that lead from a layout to another one.

    Attributes:
        kept: Path in the new document -> path in the old one, of the elements that stay.
        created: Paths in the new document of the elements that are created.
        removed: Paths in the old document of the elements that are destroyed.
        settings: Properties of the elements that stay.
        is_moved: Whether an element is created, removed, or at another place.
    """

    kept: dict[Path, Path] = field(default_factory=dict)
    created: list[Path] = field(default_factory=list)
    removed: list[Path] = field(default_factory=list)
    settings: list[Setting] = field(default_factory=list)
    is_moved: bool = False

    @classmethod
    def between(
        cls, old: Document, new: Document, apart: frozenset[str] = frozenset()
    ) -> Changes | None:
        """Return the changes; None if the file has to be loaded again.

        Args:
            old: The layout that is shown.
            new: The one to show.
            apart: Ids that only the element they are in can use, as it was created by itself.
        """
        try:
            return _Comparison(old, new).changes(apart)
        except _NotFollowedError:
            return None


def elements_of(found: Object) -> list[Object]:
    """Return the elements that an element lays out; those in a panel are its own affair."""
    if element_of(found) == "Panel":
        return []
    return [child for child in found.children if element_of(child)]


def elements_in(document: Document) -> Iterator[Object]:
    """Yield all elements of a layout, each after the one around it."""
    waiting = [document.root]
    while waiting:
        found = waiting.pop(0)
        yield found
        waiting = [*elements_of(found), *waiting]


def text_of(document: Document, found: Object) -> str:
    """Return a file that has an element alone, without the elements in it.

    Imports stay, and so do all lines and columns.
    """
    text = document.text
    kept = [*(one.span for one in document.imports), *_pragmas(document)]
    start = found.span.start
    for child in elements_of(found):
        kept.append(Span(start, child.span.start))
        start = child.span.end
    kept.append(Span(start, found.span.end))
    parts, at = [], 0
    for begin, end in sorted(kept):
        parts += [_blanked(text[at:begin]), text[begin:end]]
        at = end
    return "".join(parts)


def _pragmas(document: Document) -> list[Span]:
    head = document.text[: document.root.span.start]
    return [Span(*found.span()) for found in _PRAGMA.finditer(head)]


def _blanked(text: str) -> str:
    return re.sub(r"[^\r\n]", " ", text)


def _plain(text: str) -> str:
    """Return a value without its indentation."""
    return "\n".join(line.strip() for line in text.splitlines())


def _member_signature(member: Member) -> tuple[object, ...]:
    if member.objects or member.group is not None:
        value: object = tuple(_signature(one) for one in member.objects)
        if member.group is not None:
            value = _signature(member.group)
    else:
        value = _plain(member.text)
    return (member.name, member.form, member.type, member.modifiers, value)


def _signature(found: Object, leave_out: frozenset[str] = frozenset()) -> object:
    """Return what makes up an object: two with the same one do the same."""
    items = [
        _member_signature(item) if isinstance(item, Member) else _signature(item)
        for item in found.items
        if not (isinstance(item, Member) and item.name in leave_out)
    ]
    return (found.type, found.on, tuple(items))


def _content(panel: Object) -> object:
    """Return the signature of what a panel shows."""
    return _signature(panel, frozenset(_DEFAULTS))


def _kinds(panel: Object) -> tuple[str, ...]:
    return tuple(child.type for child in panel.children)


def _title(found: Object) -> str:
    member = found.get("title")
    return member.text if member is not None else ""


def _ids(found: Object) -> set[str]:
    return {one.id for one in found.walk() if one.id}


class _Comparison:
    def __init__(self, old: Document, new: Document) -> None:
        self._old, self._new = old, new
        self._before = {one.path: one for one in elements_in(old)}
        self._after = {one.path: one for one in elements_in(new)}
        self._kept: dict[Path, Path] = {}
        self._left = dict(self._before)
        self._made = Changes()

    def changes(self, apart: frozenset[str]) -> Changes:
        self._check_head()
        self._keep((), ())
        self._match_panels()
        self._match_containers()
        made = self._made
        self._compare_all()
        made.kept = self._kept
        made.created = [path for path in self._after if path not in self._kept]
        kept = set(self._kept.values())
        made.removed = [path for path in self._before if path not in kept]
        made.is_moved = bool(made.created or made.removed) or self._is_rearranged()
        self._check_ids(apart)
        return made

    def _check_head(self) -> None:
        def imports(document: Document) -> set[tuple[object, ...]]:
            return {(one.name, one.version, one.alias, one.is_path) for one in document.imports}

        def pragmas(document: Document) -> list[str]:
            return [document.text[slice(*one)].strip() for one in _pragmas(document)]

        if not imports(self._old) <= imports(self._new) or pragmas(self._old) != pragmas(self._new):
            raise _NotFollowedError
        if self._old.root.type != self._new.root.type:
            raise _NotFollowedError

    # -- which elements are the same -------------------------------------------------------------

    def _keep(self, path: Path, before: Path) -> None:
        self._kept[path] = before
        del self._left[before]

    def _match(self, kinds: set[str], same: Callable[[Object, Object], bool]) -> None:
        """Pair the elements that are left; of several, the one at the same place first."""
        for path, found in self._after.items():
            if path in self._kept or element_of(found) not in kinds:
                continue
            fitting = [
                before
                for before, one in self._left.items()
                if one.type == found.type and same(one, found)
            ]
            if fitting:
                self._keep(path, path if path in fitting else fitting[0])

    def _match_panels(self) -> None:
        panels = {"Panel"}
        contents = {id(one): _content(one) for one in self._before.values()}
        contents |= {id(one): _content(one) for one in self._after.values()}
        self._match(panels, lambda old, new: bool(old.id) and old.id == new.id)
        self._match(
            panels,
            lambda old, new: contents[id(old)] == contents[id(new)] and _title(old) == _title(new),
        )
        self._match(panels, lambda old, new: contents[id(old)] == contents[id(new)])
        self._match(
            panels,
            lambda old, new: _kinds(old) == _kinds(new) and _title(old) == _title(new) != "",
        )
        self._match(panels, lambda old, new: old.path == new.path and _kinds(old) == _kinds(new))
        self._match(panels, lambda old, new: _kinds(old) == _kinds(new) != ())

    def _match_containers(self) -> None:
        others = {"Page", "PanelWindow", "Split", "Tabs"}
        self._match(others, lambda old, new: bool(old.id) and old.id == new.id)

        def shares_panels(old: Object, new: Object) -> bool:
            inside = {one.path for one in elements_of(old)}
            return any(self._kept.get(one.path) in inside for one in elements_of(new))

        self._match({"Page", "PanelWindow"}, lambda old, new: _title(old) == _title(new) != "")
        # The innermost ones first: those around them are recognised by these.
        after = self._after
        self._after = dict(reversed(after.items()))
        self._match(others, shares_panels)
        self._after = after
        self._match(others, lambda old, new: old.path == new.path)

    def _is_rearranged(self) -> bool:
        for path, before in self._kept.items():
            now = [self._kept.get(one.path) for one in elements_of(self._after[path])]
            if now != [one.path for one in elements_of(self._before[before])]:
                return True
        return False

    # -- what of them changes --------------------------------------------------------------------

    def _compare_all(self) -> None:
        for path, before in list(self._kept.items()):
            old, new = self._before[before], self._after[path]
            made: list[Setting] = []
            try:
                self._compare(old, new, path, (), made)
                if self._has_others(old) and not self._has_same_order(old, new):
                    raise _NotFollowedError
            except _NotFollowedError:
                # Created again from its text, if nothing else is lost with it.
                if (
                    not path
                    or old.id
                    or new.id
                    or (self._has_others(old) and element_of(old) != "Panel")
                ):
                    raise
                del self._kept[path]
            else:
                self._made.settings += made

    def _has_others(self, found: Object) -> bool:
        return any(not element_of(child) for child in found.children)

    def _has_same_order(self, old: Object, new: Object) -> bool:
        """Return whether nothing has moved among children that are written by hand."""
        if element_of(old) in {"Cockpit", "Panel"}:
            return True

        def order(found: Object, path: Callable[[Object], object]) -> list[object]:
            return [path(child) if element_of(child) else "" for child in found.children]

        return order(old, lambda one: one.path) == order(new, lambda one: self._kept.get(one.path))

    def _compare(
        self, old: Object, new: Object, element: Path, inside: Path, made: list[Setting]
    ) -> None:
        """Collect the settings that lead from an object to another one."""
        if old.type != new.type or old.on != new.on:
            raise _NotFollowedError
        is_element = not inside
        self._compare_members(old, new, element, inside, made, is_element)
        if [_signature(one) for one in _modifiers(old)] != [
            _signature(one) for one in _modifiers(new)
        ]:
            raise _NotFollowedError
        befores, afters = (
            [one for one in found.children if not (is_element and one in elements_of(found))]
            for found in (old, new)
        )
        if len(befores) != len(afters):
            raise _NotFollowedError
        for number, (one, other) in enumerate(zip(befores, afters, strict=True)):
            self._compare(one, other, element, (*inside, number), made)

    def _compare_members(
        self,
        old: Object,
        new: Object,
        element: Path,
        inside: Path,
        made: list[Setting],
        is_element: bool,
    ) -> None:
        before, after = _flat_members(old), _flat_members(new)
        for name, member in after.items():
            known = before.get(name)
            if known is not None and _member_signature(known) == _member_signature(member):
                continue
            is_declared = bool(member.type) or (known is not None and bool(known.type))
            if member.kind != "literal" or (is_declared and known is None):
                raise _NotFollowedError
            if known is not None and (
                known.kind not in {"literal", "binding"} or known.type != member.type
            ):
                raise _NotFollowedError
            made.append(Setting(element, inside, name, member.text))
        for name, member in before.items():
            if name in after:
                continue
            if not is_element or name not in _DEFAULTS or member.kind not in {"literal", "binding"}:
                raise _NotFollowedError
            made.append(Setting(element, inside, name, _DEFAULTS[name]))

    # -- ids -------------------------------------------------------------------------------------

    def _check_ids(self, apart: frozenset[str]) -> None:
        """Refuse what would leave a name without its object."""
        made = self._made
        gone: set[str] = set()
        for path in made.removed:
            gone |= self._own_ids(self._before[path])
        apart = apart | gone
        for path in made.created:
            apart |= self._own_ids(self._after[path])
        if not apart:
            return
        uses: dict[str, set[Path]] = {}
        for path, found in self._after.items():
            for word in apart & set(_WORD.findall(text_of(self._new, found))):
                uses.setdefault(word, set()).add(path)
        if any(len(paths) > 1 for paths in uses.values()):
            raise _NotFollowedError
        declared = {one.id for one in self._new.objects() if one.id}
        if any(word in uses and word not in declared for word in gone):
            raise _NotFollowedError

    def _own_ids(self, found: Object) -> set[str]:
        """Return the ids in an element, without those of the elements in it."""
        ids = _ids(found)
        for child in elements_of(found):
            ids -= _ids(child)
        return ids


def _modifiers(found: Object) -> list[Object]:
    """Return the objects that change a property, such as ``Behavior on x {}``."""
    return [item for item in found.items if isinstance(item, Object) and item.on]


def _flat_members(found: Object) -> dict[str, Member]:
    """Return the members by their names; those in ``anchors { }`` as ``anchors.fill``."""
    made: dict[str, Member] = {}
    for member in found.members:
        if member.group is not None:
            for name, inner in _flat_members(member.group).items():
                made[f"{member.name}.{name}"] = inner
        else:
            made[
                f"{member.form}:{member.name}"
                if member.form in {"signal", "enum", "component"}
                else member.name
            ] = member
    return made
