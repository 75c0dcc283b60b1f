"""A QML file as an editor changes it: every edit touches only the text that it has to.

``Document`` is a text with its objects. Each edit returns a new document and leaves the old one as
it is. Everything that an edit does not concern is kept byte by byte, understood or not.

    document = Document(text, "drive.qml")
    panel = document.find("camera")
    document = document.set_property(panel, "topic", "/camera/image")
    print(document.text)
"""

from __future__ import annotations

import re
from bisect import bisect_left
from collections import Counter
from itertools import islice, pairwise
from typing import TYPE_CHECKING

from rosglass.cockpit.history import History
from rosglass.cockpit.qml_scanner import Import, Member, Object, Scanner, Span
from rosglass.cockpit.qml_values import Code, from_qml, is_literal, quote, to_qml, translated
from rosglass.errors import ArgumentError, BoundError, QmlSyntaxError, shown

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

__all__ = [
    "Code",
    "Document",
    "History",
    "Import",
    "Member",
    "Object",
    "Span",
    "from_qml",
    "to_qml",
]

#: Objects on one line are broken into several lines beyond this.
_MOST_COLUMNS = 100
_NEWLINE = re.compile(r"\r\n|[\n\r\u2028\u2029]")
_LINE_ENDS = "\n\r\u2028\u2029"
#: Those that editors write; QML knows two more.
_USUAL_NEWLINE = re.compile(r"\r\n|\n|\r")
_BLANKS = re.compile(r"[^\S\r\n\u2028\u2029]*")
_COMMENT = re.compile(r"//[^\r\n\u2028\u2029]*|/\*(?s:.*?)\*/")
#: A comment behind an object, up to the end of the line.
_OPEN_END = re.compile(r"\}[^}]*//[^\r\n\u2028\u2029]*$")
_SPACE = re.compile(r"\s*")
_ID = re.compile(r"[a-z_][A-Za-z0-9_]*")
_PROPERTY = re.compile(r"(?!\d)[$\w]+(?:\.(?!\d)[$\w]+)*")
_MODULE = re.compile(r"[A-Za-z_]\w*(?:\.[A-Za-z_]\w*)*")
_VERSION = re.compile(r"\d+(?:\.\d+)?")


class Document:
    """A QML file.

    Attributes:
        text: Its text.
        file: Its name, for errors.
        root: Its root object.
        imports: Its imports.

    Objects and members belong to the document that they were taken from: after an edit, take them
    from the new one, by their id or their `path`.

    Args:
        text: A whole file; a byte order mark and any line ends are kept.
        file: Its name, for errors.
        is_part: The text is an object of a file, which may be ``Behavior on x {}``.

    Raises:
        QmlSyntaxError: The text is not QML: line, column, and what was expected.
    """

    def __init__(self, text: str, file: str = "<text>", *, is_part: bool = False) -> None:
        self._scan = Scanner(text, file, is_part)
        self.text, self.file = text, file
        self.root, self.imports = self._scan.root, self._scan.imports
        found = _USUAL_NEWLINE.search(text)
        self._newline = found[0] if found else "\n"
        self._unit = self._indent_unit()

    # ---- looking things up

    def objects(self) -> Iterator[Object]:
        """Yield all objects, in the order of the text."""
        return self.root.walk()

    def find(self, id: str) -> Object | None:
        """Return the object with an id; None without one."""
        return next((found for found in self.objects() if found.id == id), None)

    def at(self, path: Sequence[int]) -> Object:
        """Return the object with a path.

        Raises:
            ArgumentError: There is no such object.
        """
        found = self.root
        for index in path:
            if not 0 <= index < len(found.objects):
                raise ArgumentError("path", tuple(path), f"an object of {self.file}")
            found = found.objects[index]
        return found

    def object_at(self, offset: int) -> Object | None:
        """Return the innermost object at an offset; None outside of the root."""
        found = None
        for candidate in self.objects():
            if candidate.span.start <= offset < candidate.span.end:
                found = candidate
        return found

    def position(self, offset: int) -> tuple[int, int]:
        """Return line and column of an offset, counted from 1."""
        return self._scan.position(offset)

    # ---- edits of properties

    def set_property(
        self, target: Object, name: str, value: object, *, overwrite: bool = False
    ) -> Document:
        """Return the document with another value of a property.

        The value is replaced where it is; `qsTr()` and the quotation marks stay. A property that is
        not set yet goes behind the other properties. A value that is already there changes nothing.

        Args:
            target: The object.
            name: Such as ``topic`` or ``anchors.margins``.
            value: As :func:`to_qml` takes it; `Code` for an expression.
            overwrite: Replace expressions and objects as well.

        Raises:
            BoundError: The property has an expression or an object, and `overwrite` is not set.
            ArgumentError: The value, the name or the object is invalid.
        """
        self._own(target)
        if not isinstance(name, str) or _PROPERTY.fullmatch(name) is None:
            raise ArgumentError("name", name, "the name of a property")
        if name == "id":
            return self.set_id(target, str(value))
        member = target.get(name)
        if member is not None and member.form in {"function", "group"}:
            raise ArgumentError(
                "name", name, f"a property: in line {self._line(member)} is a {member.form}"
            )
        if member is not None and member.type == "alias" and not isinstance(value, Code):
            raise ArgumentError("value", value, f"the name of a property, as {name} is an alias")
        text, closed = self._value_text(value)
        if member is None:
            return self._add_property(target, name, text, closed)
        if member.value_span is None:
            at = member.name_span.end
            return self._splice([(at, at, f": {text}")])
        if member.kind != "literal" and member.text != text and not overwrite:
            raise BoundError(name, member.text, self.file, *self.position(member.value_span.start))
        return self._replace_value(member, value, text, closed)

    def _replace_value(self, member: Member, value: object, text: str, closed: bool) -> Document:
        old = member.text
        assert member.value_span is not None
        start, end = member.value_span
        if is_literal(old):
            known = from_qml(old)
            if known == value and type(known) is type(value):
                return self
        if isinstance(value, str) and not isinstance(value, Code):
            place = translated(old)
            if place is not None:
                start, end = start + place[0], start + place[1]
                old = old[slice(*place)]
            if old.startswith("'"):
                text = quote(value, "'")
        closed = closed and not member.type.startswith("list<")
        if closed and not member.closed:
            end = member.span.end
        elif member.closed and not closed:
            _, follower, ended = self._rest_of_line(end)
            text += "" if ended or self.text[follower] == "}" else ";"
        return self._splice([(start, end, text)])

    def _add_property(self, target: Object, name: str, text: str, closed: bool) -> Document:
        for member in target.members:
            if member.group is not None and f"{name}.".startswith(f"{member.name}."):
                rest = name[len(member.name) + 1 :]
                return self._add_property(member.group, rest, text, closed)
        after: Member | Object | None = None
        for item in target.items:
            if isinstance(item, Object):
                break
            if item.form in {"value", "required", "group"} and not item.is_handler:
                after = item
        return self._insert(target, after, f"{name}: {text}", closed)

    def remove_property(self, target: Object, name: str) -> Document:
        """Return the document without a property, with the comment behind it on its line.

        Args:
            target: The object.
            name: Its name; a handler or function can be removed too.

        Raises:
            ArgumentError: The object has no such member.
        """
        self._own(target)
        member = target.get(name)
        if member is None:
            raise ArgumentError("name", name, f"a member that the {target.type} has")
        return self._remove_member(member)

    def _remove_member(self, member: Member) -> Document:
        # A group does not stay behind empty, unless it has comments.
        while member.owner.member is not None and member.owner.member.group is member.owner:
            group = member.owner
            around = self.text[group.body.start + 1 : member.span.start]
            around += self.text[member.span.end : group.body.end - 1]
            if len(group.items) > 1 or around.strip():
                break
            member = member.owner.member
        return self._splice([self._removal(member.owner, member, comments=False)])

    def set_id(self, target: Object, id: str) -> Document:
        """Return the document with another id of an object; uses of the old one are not renamed.

        Args:
            target: The object.
            id: The id; an empty one removes it.

        Raises:
            ArgumentError: It is not an id, or another object has it.
        """
        self._own(target)
        member = target.get("id")
        if not id:
            return self if member is None else self._remove_member(member)
        if _ID.fullmatch(id) is None:
            raise ArgumentError("id", id, "a lower-case letter, then letters, digits and _")
        other = self.find(id)
        if other is not None and other is not target:
            line = self.position(other.span.start)[0]
            raise ArgumentError(
                "id", id, f"an id that no other object has ({other.type}, line {line})"
            )
        if member is None:
            return self._insert(target, None, f"id: {id}")
        assert member.value_span is not None
        return self._splice([(*member.value_span, id)])

    # ---- edits of objects

    def insert_object(
        self,
        parent: Object,
        text: str,
        index: int | None = None,
        *,
        before: Object | None = None,
        after: Object | None = None,
    ) -> Document:
        """Return the document with one more object.

        Args:
            parent: The object that gets it as a child.
            text: The new object, with comments before it if wanted; its indentation is adapted.
            index: Place among the `children` of the parent; at the end without `index`, `before`
                and `after`.
            before: The child that it goes in front of.
            after: The child that it goes behind.

        Raises:
            QmlSyntaxError: The text is not one object.
            ArgumentError: The place does not exist.
        """
        self._own(parent)
        text = self._object_text(text)
        children = parent.children
        place = self._place(children, index, before, after)
        if place < len(children):
            return self._insert_before(children[place], text)
        return self._insert(parent, parent.items[-1] if parent.items else None, text, closed=True)

    def remove_object(self, target: Object) -> Document:
        """Return the document without an object, its comments included.

        These are the ones directly above it, and the one behind it on its line. An object that is a
        value goes with its property.

        Raises:
            ArgumentError: It is the root, or not of this document.
        """
        self._own(target)
        if target.parent is None:
            raise ArgumentError("target", target.type, "an object inside the root")
        member = target.member
        if member is None:
            return self._splice([self._removal(self._holder(target), target, comments=True)])
        splices = self._list_removal(member, target) if member.form == "list" else []
        return self._splice(splices) if splices else self._remove_member(member)

    def move_object(
        self,
        target: Object,
        parent: Object,
        index: int | None = None,
        *,
        before: Object | None = None,
        after: Object | None = None,
    ) -> Document:
        """Return the document with an object at another place, its comments included.

        Its lines are indented for the new place; strings and templates with several lines stay.

        Args:
            target: The object.
            parent: The object that gets it as a child.
            index: Place among the other `children` of the parent; at the end without `index`,
                `before` and `after`.
            before: The child that it goes in front of.
            after: The child that it goes behind.

        Raises:
            ArgumentError: The object would be inside itself, or the place does not exist.
        """
        self._own(target)
        self._own(parent)
        if target.span.start <= parent.span.start < target.span.end:
            raise ArgumentError("parent", parent.type, "an object outside of the one that moves")
        others = [child for child in parent.children if child is not target]
        place = self._place(others, index, before, after)
        if target.member is None and self._holder(target) is parent:
            own = parent.children.index(target) if target in parent.children else -1
            if place == own:
                return self
        path, target_path = list(parent.path), target.path
        depth = len(target_path) - 1
        if list(target_path[:-1]) == path[:depth] and len(path) > depth:
            path[depth] -= path[depth] > target_path[-1]
        text = self._block(target)
        without = self.remove_object(target)
        parent = without.at(path)
        children = parent.children
        if place < len(children):
            return without._insert_before(children[place], text)
        last = parent.items[-1] if parent.items else None
        return without._insert(parent, last, text, closed=True)

    def wrap_object(self, target: Object, text: str, index: int | None = None) -> Document:
        """Return the document with an object put into a new one, which takes its place.

        Args:
            target: The object.
            text: The new object, such as ``Split { orientation: Qt.Vertical }``; it may have
                children.
            index: Place of the object among the children of the new one; at the end by default.

        Raises:
            QmlSyntaxError: The text is not one object.
            ArgumentError: The place does not exist.
        """
        self._own(target)
        if target.on:
            raise ArgumentError("target", target.type, f"an object that is not on {target.on}")
        wrapper = Document(self._object_text(text))
        # The file's style, since the wrapper has none of its own yet.
        wrapper._newline, wrapper._unit = self._newline, self._unit
        wrapper = wrapper._broken(wrapper.root)
        start, end = target.span
        content = self._unindented(start, end, start)
        if target.parent is not None and target.member is None:
            holder = self._holder(target)
            start = self._leading(holder, target)
            broken = self if self._starts_line(start) else self._broken(holder)
            if broken is not self:
                return broken.wrap_object(broken.at(target.path), text, index)
            content = self._block(target)
            end = self._rest_of_line(end)[0]
        wrapped = wrapper.insert_object(wrapper.root, content, index)
        return self._splice([(start, end, self._indented(wrapped.text, self._indent(start)))])

    def unwrap(self, target: Object) -> Document:
        """Return the document with the children of an object in its place.

        Everything else in the object is lost: properties, handlers, comments between them.

        Raises:
            ArgumentError: It has no children, or several where only one object can be.
        """
        self._own(target)
        children = target.children
        if not children:
            raise ArgumentError("target", target.type, "an object with children")
        if target.parent is None or target.member is not None:
            if len(children) > 1:
                raise ArgumentError("target", target.type, "one child, as the value of a property")
            child = children[0]
            blocks = [self._unindented(*child.span, child.span.start)]
        else:
            blocks = [self._block(child) for child in children]
        indent = self._indent(target.span.start)
        between = self._newline + indent
        text = between.join(self._indented(block, indent) for block in blocks)
        if self._is_open_ended(text) and not self._ends_line(self._blanks(target.span.end)):
            text += between
        return self._splice([(*target.span, text)])

    # ---- the header

    def add_import(self, name: str, version: str = "", alias: str = "") -> Document:
        """Return the document with an import: Qt's modules come first, then others, then paths.

        An import that is there stays, with a higher version if it has a lower one.

        Args:
            name: A module, or a path: it contains ``/``, starts with ``.`` or ends with ``.js``.
            version: Such as ``2.15``; empty for none.
            alias: A name that its types are used with.

        Raises:
            ArgumentError: The name, version or alias is invalid.
        """
        is_path = "/" in name or name.startswith(".") or name.endswith((".js", ".mjs"))
        if not is_path and _MODULE.fullmatch(name) is None:
            raise ArgumentError("name", name, "a module such as QtQuick, or a path")
        if version and (is_path or _VERSION.fullmatch(version) is None):
            raise ArgumentError("version", version, "a version such as 2.15, for modules only")
        if alias and re.fullmatch(r"[A-Z]\w*", alias) is None:
            raise ArgumentError("alias", alias, "a name that starts with a capital letter")
        for known in self.imports:
            if (known.name, known.alias, known.is_path) == (name, alias, is_path):
                return self._raise_version(known, version)
        line = f"import {quote(name) if is_path else name}"
        line += f" {version}" if version else ""
        line += f" as {alias}" if alias else ""
        order = _import_order(name, is_path)
        after = None
        for known in self.imports:
            if _import_order(known.name, known.is_path) <= order:
                after = known.span
        if after is None and self.imports:
            at = self._line_start(self.imports[0].span.start)
            at += self.text.startswith("\ufeff", at)
            return self._splice([(at, at, line + self._newline)])
        if after is None and self._scan.pragmas:
            after = self._scan.pragmas[-1]
        if after is not None:
            at, follower, ended = self._rest_of_line(after.end)
            at = follower if ended else at
            return self._splice(
                [(at, at, f"{self._newline}{line}{'' if ended else self._newline}")]
            )
        at = self._header_end()
        return self._splice([(at, at, line + self._newline * 2)])

    def _raise_version(self, known: Import, version: str) -> Document:
        def number(text: str) -> tuple[int, ...]:
            return tuple(int(part) for part in text.split(".") if part)

        if not known.version or not version or number(known.version) >= number(version):
            return self
        start, end = known.span
        text = self.text[start:end]
        return self._splice([(start, end, text.replace(f" {known.version}", f" {version}", 1))])

    def _header_end(self) -> int:
        """Return where imports go in a file without any: behind a comment that stands alone."""
        start = int(self.text.startswith("\ufeff"))
        found = _COMMENT.match(self.text, start)
        at = start
        while found is not None:
            end = found.end()
            after = self._space(end)
            if len(_NEWLINE.findall(self.text, end, after)) > 1:
                at = after
            found = _COMMENT.match(self.text, after)
        return at

    # ---- what edits are made of

    def _own(self, target: Object) -> None:
        if target.source is not self.text and target.source != self.text:
            raise ArgumentError("target", target.type, "an object of this document, not of another")

    def _line(self, item: Member | Object) -> int:
        return self.position(item.span.start)[0]

    def _splice(self, splices: Iterable[tuple[int, int, str]]) -> Document:
        parts, at = [], 0
        for start, end, new in sorted(splices):
            parts += [self.text[at:start], new]
            at = end
        text = "".join([*parts, self.text[at:]])
        if text == self.text:
            return self
        changed = Document(text, self.file)
        changed._newline, changed._unit = self._newline, self._unit
        return changed

    def _value_text(self, value: object) -> tuple[str, bool]:
        """Return the text of a value, and whether no semicolon may follow it."""
        text, closed = to_qml(value), False
        if isinstance(value, Code):
            text = self._with_newlines(text)
            head = "X { p:\n"
            root = Scanner(f"{head}{text}\n}}", f"<{shown(str(value))}>").root
            only = root.members[0]
            expected = (len(head), len(head) + len(text))
            if len(root.items) > 1 or only.value_span != expected:
                raise ArgumentError("value", str(value), "one expression, without blanks around it")
            closed = only.closed
        return text, closed

    def _with_newlines(self, text: str) -> str:
        return _USUAL_NEWLINE.sub(lambda _: self._newline, text)

    def _object_text(self, text: str) -> str:
        """Return a new object without indentation, checked."""
        text = self._with_newlines(text.strip("\ufeff"))
        new = Document(text, "<new object>", is_part=True)
        if new.imports or new._scan.pragmas:
            raise QmlSyntaxError("expected an object without imports", new.file)
        start = len(new.text) - len(new.text.lstrip())
        text = new._unindented(start, len(new.text.rstrip()), new.root.span.start)
        return Document(text, is_part=True)._with_unit(self._unit)

    def _with_unit(self, unit: str) -> str:
        """Return the text of a new object with the indentation unit of a file."""
        text, old = self.text, self._unit
        if old == unit:
            return text
        parts, at = [], 0
        for found in _NEWLINE.finditer(text):
            line = found.end()
            depth = 0
            while text.startswith(old, line + depth * len(old)) and not self._is_fixed(line):
                depth += 1
            parts.append(text[at:line] + unit * depth)
            at = line + depth * len(old)
        return "".join(parts) + text[at:]

    def _is_fixed(self, line: int) -> bool:
        """Return whether a line starts inside a string, so that its indentation is content."""
        index = bisect_left(self._scan.fixed, Span(line, 0)) - 1
        return index >= 0 and line <= self._scan.fixed[index].end

    def _is_open_ended(self, text: str) -> bool:
        """Return whether a new text must end its line, because a comment does."""
        return _OPEN_END.search(text) is not None

    # Lines

    def _line_start(self, at: int) -> int:
        return max(self.text.rfind(end, 0, at) for end in _LINE_ENDS) + 1

    def _blanks(self, at: int) -> int:
        """Return the offset behind blanks on the line."""
        found = _BLANKS.match(self.text, at)
        return found.end() if found else at

    def _space(self, at: int) -> int:
        """Return the offset behind blanks and empty lines."""
        found = _SPACE.match(self.text, at)
        return found.end() if found else at

    def _indent(self, at: int) -> str:
        start = self._line_start(at)
        return self.text[start : min(self._blanks(start), at)]

    def _starts_line(self, at: int) -> bool:
        return self._blanks(self._line_start(at)) >= at

    def _ends_line(self, at: int) -> bool:
        return at == len(self.text) or self.text[at] in _LINE_ENDS

    def _rest_of_line(self, at: int) -> tuple[int, int, bool]:
        """Return the end of the comments behind an offset, what follows, and if the line ends.

        Comments with something behind them on the line belong to that.
        """
        end, follower = at, self._blanks(at)
        while (found := _COMMENT.match(self.text, follower)) is not None:
            end = found.end()
            follower = self._blanks(end)
        ended = self._ends_line(follower)
        return (end if ended else at), follower, ended

    def _next_line(self, at: int) -> int:
        found = _NEWLINE.search(self.text, at)
        return found.end() if found else len(self.text)

    def _leading(self, owner: Object, item: Member | Object) -> int:
        """Return where the comments directly above an item start, or the item itself."""
        index = owner.items.index(item)
        previous = owner.items[index - 1].span.end if index else owner.body.start + 1
        return self._first_comment(previous, item.span.start)

    def _first_comment(self, previous: int, start: int) -> int:
        """Return where the comments directly above an offset start, or the offset itself."""
        comments = list(_COMMENT.finditer(self.text, self._rest_of_line(previous)[0], start))
        for found in reversed(comments):
            if len(_NEWLINE.findall(self.text, found.end(), start)) > 1:
                break
            start = found.start()
        return start

    def _holder(self, target: Object) -> Object:
        """Return the object, or the group in it, whose item a child is."""
        assert target.parent is not None
        waiting = [target.parent]
        for holder in waiting:
            if target in holder.items:
                return holder
            waiting.extend(member.group for member in holder.members if member.group is not None)
        return target.parent

    def _indent_unit(self) -> str:
        """Return the most frequent step of indentation at the beginning of the file."""
        counts: Counter[str] = Counter()
        for found in islice(self.objects(), 200):
            outer = self._indent(found.span.start)
            for item in found.items[:1]:
                inner = self._indent(item.span.start)
                if self._starts_line(item.span.start) and inner.startswith(outer):
                    counts[inner[len(outer) :]] += inner != outer
        unit, count = counts.most_common(1)[0] if counts else ("", 0)
        return unit if count else "    "

    def _child_indent(self, owner: Object, near: Member | Object | None) -> str:
        """Return the indentation of the items of an object."""
        items = owner.items[:20]
        items = [near, *items] if near is not None else items
        for item in items:
            if self._starts_line(item.span.start):
                return self._indent(item.span.start)
        return self._indent(owner.span.start) + self._unit

    def _shifted(self, start: int, end: int, old: str, new: str) -> str:
        """Return a part of the text with another indentation; its first line has none."""
        text = self.text
        parts, at = [], start
        for found in _NEWLINE.finditer(text, start, end):
            line = found.end()
            if self._is_fixed(line):
                continue
            parts.append(text[at:line])
            at = line
            if text.startswith(old, line, end) and not self._ends_line(self._blanks(line)):
                parts.append(new)
                at = line + len(old)
        parts.append(text[at:end])
        return "".join(parts)

    def _unindented(self, start: int, end: int, near: int) -> str:
        """Return a part of the text without the indentation of the line with `near`."""
        return self._shifted(start, end, self._indent(near), "")

    def _block(self, target: Object) -> str:
        """Return an object with its comments, without indentation."""
        start, end = target.span
        if target.member is None:
            start = self._leading(self._holder(target), target)
            end = self._rest_of_line(end)[0]
        elif target.member.form == "list":
            start, comma, behind = self._list_place(target.member, target)
            trail = self._rest_of_line(behind)[0]
            comments = f"{self.text[end:comma].strip()} {self.text[behind:trail].strip()}".strip()
            text = self._unindented(start, end, target.span.start)
            return f"{text} {comments}" if comments else text
        return self._unindented(start, end, target.span.start)

    def _indented(self, block: str, indent: str) -> str:
        """Return a text with one object, indented; its first line is not."""
        if not indent or not _NEWLINE.search(block):
            return block
        return Document(block, is_part=True)._shifted(0, len(block), "", indent)

    # Insertions

    @staticmethod
    def _place(
        children: Sequence[Object], index: int | None, before: Object | None, after: Object | None
    ) -> int:
        if sum(place is not None for place in (index, before, after)) > 1:
            raise ArgumentError("index", index, "only one of index, before and after")
        near = before if before is not None else after
        if near is not None:
            if near not in children:
                raise ArgumentError("before or after", near.type, "a child of the parent")
            return children.index(near) + (after is not None)
        if index is None:
            return len(children)
        if not isinstance(index, int) or not 0 <= index <= len(children):
            raise ArgumentError("index", index, f"0 to {len(children)}")
        return index

    def _spaced(self, owner: Object) -> bool:
        """Return whether the children of an object have empty lines between them."""
        children = owner.children[:8]
        return len(children) > 1 and all(
            len(_NEWLINE.findall(self.text, first.span.end, self._leading(owner, second))) > 1
            for first, second in pairwise(children)
        )

    def _insert(
        self, owner: Object, after: Member | Object | None, text: str, closed: bool = False
    ) -> Document:
        """Insert a member or child behind an item, or as the first one."""
        behind = owner.body.start + 1 if after is None else after.span.end
        at, follower, ended = self._rest_of_line(behind)
        newline = self._newline
        if ended:
            # Behind blanks at the end of the line, so that it stays as it is.
            at, indent = follower, self._child_indent(owner, after)
            blank = newline if isinstance(after, Object) and self._spaced(owner) else ""
            return self._splice(
                [(at, at, f"{blank}{newline}{indent}{self._indented(text, indent)}")]
            )
        if not _NEWLINE.search(text) and not self._is_open_ended(text):
            closing = self.text[follower] == "}"
            new = f" {text}" if closing or closed else f" {text};"
            if after is not None and not after.closed and self.text[behind - 1] != ";":
                new = f";{new}"
            end = behind
            if after is None and closing and self._blanks(behind) == follower:
                new, end = f" {text} ", follower
            elif not closing and not self.text[behind].isspace():
                new += " "
            changed = self._splice([(behind, end, new)])
            line = changed._line_start(behind)
            if len(changed.text[line : changed._next_line(behind)].rstrip()) <= _MOST_COLUMNS:
                return changed
        broken = self._broken(owner)
        if broken is self:
            return self._splice([(behind, behind, f"{newline}{text}{newline}")])
        place = owner.items.index(after) if after is not None else -1
        owner = broken._same(owner)
        return broken._insert(
            owner, owner.items[place] if after is not None else None, text, closed
        )

    def _insert_before(self, child: Object, text: str) -> Document:
        owner = self._holder(child)
        at = self._leading(owner, child)
        if self._starts_line(at):
            indent = self._indent(at)
            blank = self._newline if self._spaced(owner) else ""
            new = f"{self._indented(text, indent)}{self._newline}{blank}{indent}"
            return self._splice([(at, at, new)])
        if not _NEWLINE.search(text) and not self._is_open_ended(text):
            line = self.text[self._line_start(at) : self._next_line(at)].rstrip()
            if len(line) + len(text) < _MOST_COLUMNS:
                return self._splice([(at, at, f"{text} ")])
        place = owner.items.index(child)
        broken = self._broken(owner)
        if broken is self:
            return self._splice([(at, at, f"{text}{self._newline}")])
        moved = broken._same(owner).items[place]
        assert isinstance(moved, Object)
        return broken._insert_before(moved, text)

    def _same(self, owner: Object) -> Object:
        """Return the object, or group, at the same path as one of another document."""
        names = []
        while owner.member is not None and owner.member.group is owner:
            names.append(owner.member.owner.items.index(owner.member))
            owner = owner.member.owner
        found = self.at(owner.path)
        for index in reversed(names):
            member = found.items[index]
            assert isinstance(member, Member)
            assert member.group is not None
            found = member.group
        return found

    def _broken(self, owner: Object) -> Document:
        """Return the document with each item of an object on lines of its own."""
        document = self
        if owner.parent is not None and not self._starts_line(owner.span.start):
            if owner.member is None:
                document = self._broken(self._holder(owner))
            elif owner.member.form == "group":
                document = self._broken(owner.member.owner)
        if document is not self:
            return document._broken(document._same(owner))
        base = self._indent(owner.span.start)
        inner, newline = base + self._unit, self._newline
        splices = []
        end = owner.body.start + 1
        previous: Member | Object | None = None
        for item in owner.items:
            start = item.span.start
            if not _NEWLINE.search(self.text, end, start):
                bare = end if previous is None else self._bare_end(previous)
                splices.append((bare, self._blanks(end), newline + inner))
                stop = self._bare_end(item)
                splices.append((start, stop, self._shifted(start, stop, base, inner)))
            previous, end = item, item.span.end
        stop = owner.body.end - 1
        gap = self.text[end:stop]
        if not _NEWLINE.search(gap):
            bare = end if previous is None else self._bare_end(previous)
            comment = gap.strip()
            if comment:
                bare = end
                comment = f" {comment}" if previous else f"{newline}{inner}{comment}"
            splices.append((bare, stop, f"{comment}{newline}{base}"))
        return self._splice(splices)

    def _bare_end(self, item: Member | Object) -> int:
        """Return the end of an item without the semicolon behind its value."""
        end = item.span.end
        if isinstance(item, Object) or self.text[end - 1] != ";":
            return end
        return end - (item.value_span is None or item.value_span.end < end)

    # Removals

    def _removal(
        self, owner: Object, item: Member | Object, comments: bool
    ) -> tuple[int, int, str]:
        start = self._leading(owner, item) if comments else item.span.start
        end = item.span.end
        trail, follower, ended = self._rest_of_line(end)
        if self._starts_line(start):
            if ended:
                return self._whole_lines(owner, start, trail, comments)
            return start, self._blanks(end), ""
        if not ended and self.text[follower] != "}":
            return start, self._blanks(end), ""
        line = self._line_start(start)
        while start > line and self.text[start - 1].isspace():
            start -= 1
        index = owner.items.index(item)
        if index and owner.items[index - 1].span.end == start:
            start = self._bare_end(owner.items[index - 1])
        if ended:
            return start, trail, ""
        return start, follower if self.text[start - 1] == "{" else end, ""

    def _whole_lines(
        self, owner: Object, start: int, end: int, blanks: bool
    ) -> tuple[int, int, str]:
        """Return the removal of whole lines, with empty lines around them if `blanks` is set."""
        first, last = self._line_start(start), self._next_line(end)
        if blanks:
            before = self.text[owner.body.start + 1 : first]
            after = self._space(last)
            empty_before = len(_NEWLINE.findall(before[len(before.rstrip()) :])) > 1
            empty_after = _NEWLINE.search(self.text, last, after) is not None
            if empty_after and (empty_before or not before.strip()):
                last = self._line_start(after)
            elif empty_before and self.text.startswith("}", after):
                at = owner.body.start + 1 + len(before.rstrip())
                first = self._next_line(at)
        return first, last, ""

    def _list_place(self, member: Member, target: Object) -> tuple[int, int, int]:
        """Return where an object of a list, its comma, and what is behind it start."""
        assert member.value_span is not None
        index = member.objects.index(target)
        previous = member.value_span.start + 1
        if index:
            previous = self._scan._skip(member.objects[index - 1].span.end)[0] + 1
        start, end = self._first_comment(previous, target.span.start), target.span.end
        comma = self._scan._skip(end)[0]
        return (start, comma, comma + 1) if self.text[comma] == "," else (start, end, end)

    def _list_removal(self, member: Member, target: Object) -> list[tuple[int, int, str]]:
        """Return the removal of an object from a list; none if nothing else is in the list."""
        assert member.value_span is not None
        start, comma, end = self._list_place(member, target)
        trail, _, ended = self._rest_of_line(end)
        splices = []
        index = member.objects.index(target)
        if comma == end and index:
            comma = self._scan._skip(member.objects[index - 1].span.end)[0]
            splices.append((comma, comma + 1, ""))
        around = self.text[member.value_span.start + 1 : start]
        around += self.text[trail : member.value_span.end - 1]
        if not around.strip():
            return []
        if self._starts_line(start) and ended:
            splices.append((self._line_start(start), self._next_line(trail), ""))
        else:
            stop = self._blanks(end)
            while self.text.startswith("]", stop) and self.text[start - 1] in " \t":
                start -= 1
            splices.append((start, stop, ""))
        return splices


def _import_order(name: str, is_path: bool) -> int:
    return 2 if is_path else 0 if name.startswith("Qt") else 1
