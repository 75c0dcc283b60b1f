"""Changes of a layout: each takes a document and returns another one.

    edits = LayoutEdits(document)
    edits.move(panel, target, "right")
    document = edits.document

Only the objects of ``RosCockpit`` are moved, wrapped and unwrapped; what is written by hand stays.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from rosglass.cockpit.qml_document import Code, Document, to_qml
from rosglass.errors import ArgumentError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rosglass.cockpit.qml_document import Object

__all__ = ["EDGES", "ELEMENTS", "LayoutEdits", "element_of"]

#: The types of which a layout is made.
ELEMENTS = ("Cockpit", "Page", "PanelWindow", "Split", "Tabs", "Panel")
#: Places a panel can go to; see :meth:`LayoutEdits.move`.
EDGES = ("left", "right", "top", "bottom", "center", "before", "after")
#: Those that lay children out side by side, or one below the other.
_ROWS = {"Page", "PanelWindow", "Split"}
#: Properties without which nothing is lost when a Split or Tabs with one child is replaced by it.
_OF_CONTAINERS = {"share", "orientation", "spacing", "currentIndex"}
_VERTICAL = Code("Qt.Vertical")

Path = tuple[int, ...]


def element_of(found: Object) -> str:
    """Return the type of ``RosCockpit`` that an object is of; empty if it is another one."""
    name = found.type.rpartition(".")[2]
    return name if name in ELEMENTS else ""


class LayoutEdits:
    """Changes a layout step by step.

    Objects that are passed to its methods are those of the document it began with, or of the
    current :attr:`document`.

    Args:
        document: The layout; its root is a ``Cockpit``.

    Raises:
        ArgumentError: It is not a layout.
    """

    def __init__(self, document: Document) -> None:
        if element_of(document.root) != "Cockpit":
            raise ArgumentError("document", document.root.type, "a layout, whose root is a Cockpit")
        self._first = document
        #: The layout with all changes so far.
        self.document = document
        #: Path in the first document -> path now; None once it is gone. Objects that are new have
        #: keys of their own.
        self._paths: dict[Path, Path | None] = {}
        for found in document.objects():
            self._paths[found.path] = found.path

    # -- changes ---------------------------------------------------------------------------------

    def move(self, panel: Object, target: Object, edge: str) -> None:
        """Move a panel; a Split or Tabs that it leaves with one child is replaced by that.

        Args:
            panel: The panel; a Split or Tabs as well.
            target: The element it goes to.
            edge: ``left``, ``right``, ``top`` or ``bottom`` of the target, which shares its room;
                ``center`` for tabs with it, or the end of a Page, Tabs or PanelWindow; ``before``
                and ``after`` for its place among the children of the same parent.

        Raises:
            ArgumentError: It cannot go there.
        """
        if edge not in EDGES:
            raise ArgumentError("edge", edge, f"one of {', '.join(EDGES)}")
        start, goal = self._track(panel), self._track(target)
        self._check_element("panel", start, ("Panel", "Split", "Tabs"))
        self._check_element("target", goal, ELEMENTS[1:])
        if self._path(goal)[: len(self._path(start))] == self._path(start):
            raise ArgumentError("target", target.type, "an element outside of the one that moves")
        source = self._parent(start)
        self._put(start, goal, edge)
        if source is not None:
            self._collapse(source)
        self._tidy(start)

    def add(self, text: str, target: Object | None = None, edge: str = "center") -> Path:
        """Add a panel.

        Args:
            text: Its QML, such as ``Panel { Battery {} }``.
            target: The element it goes to; the last page without one.
            edge: As for :meth:`move`.

        Returns:
            Its path in the current :attr:`document`.

        Raises:
            QmlSyntaxError: The text is not an object.
            ArgumentError: It cannot go there.
        """
        if target is None:
            pages = [one for one in self.document.root.children if element_of(one) == "Page"]
            if not pages:
                self.add_page("Page 1")
                pages = self.document.root.children[-1:]
            target = pages[-1]
        goal = self._track(target)
        self._check_element("target", goal, ELEMENTS[1:])
        # At the end of the root first, so that it moves as any other.
        self._insert(text, (), None)
        panel = self.document.root.children[-1]
        start = self._track(panel)
        self._check_element("text", start, ("Panel", "Split", "Tabs"))
        if self._can_center(goal) or edge != "center":
            self._put(start, goal, edge)
        else:
            self._put(start, goal, "right")
        self._tidy(start)
        return self._path(start)

    def remove(self, element: Object) -> None:
        """Remove an element with all in it; the Split or Tabs around it as for :meth:`move`."""
        key = self._track(element)
        self._check_element("element", key, ELEMENTS[1:])
        source = self._parent(key)
        self._drop(key)
        if source is not None:
            self._collapse(source)

    def resize(self, split: Object, shares: Sequence[float]) -> None:
        """Set the shares of a Split's elements.

        Args:
            split: A Split, Page or PanelWindow.
            shares: A number above 0 for each of its elements.

        Raises:
            ArgumentError: They do not fit the elements.
            BoundError: The share of one is an expression.
        """
        key = self._track(split)
        children = self._elements(key)
        if len(shares) != len(children) or not all(0 < share < 1e6 for share in shares):
            raise ArgumentError("shares", list(shares), f"{len(children)} numbers above 0")
        for child, share in zip(children, shares, strict=True):
            if round(share, 2) != self._share(child):
                self._set_share(child, share)
        self._simplify_shares(key)

    def rename(self, element: Object, title: str) -> None:
        """Set the title of a Page, Panel or PanelWindow.

        Raises:
            BoundError: The title is an expression.
        """
        key = self._track(element)
        self._check_element("element", key, ("Cockpit", "Page", "PanelWindow", "Panel"))
        self._edit(self.document.set_property(self._object(key), "title", title))

    def add_page(self, title: str, index: int | None = None) -> Path:
        """Add an empty page; at the end, unless `index` says after how many pages.

        Returns:
            Its path in the current :attr:`document`.
        """
        pages = [one for one in self.document.root.children if element_of(one) == "Page"]
        if index is not None and not 0 <= index <= len(pages):
            raise ArgumentError("index", index, f"a number from 0 to {len(pages)}")
        root = self.document.root
        if index is None or index == len(pages):
            place = root.children.index(pages[-1]) + 1 if pages else len(root.children)
        else:
            place = root.children.index(pages[index])
        self._insert(f"Page {{\n    title: {to_qml(title)}\n}}", (), place)
        return self.document.root.children[place].path

    def move_page(self, page: Object, index: int) -> None:
        """Give a page another place among the pages, counted from 0."""
        key = self._track(page)
        self._check_element("page", key, ("Page",))
        pages = [one for one in self.document.root.children if element_of(one) == "Page"]
        if not 0 <= index < len(pages):
            raise ArgumentError("index", index, f"a number from 0 to {len(pages) - 1}")
        others = [one for one in pages if one is not self._object(key)]
        if index < len(others):
            self._move(key, (), before=others[index])
        elif others:
            self._move(key, (), after=others[-1])

    def to_window(
        self, panel: Object, screen: str, x: float, y: float, width: float, height: float
    ) -> None:
        """Move a panel into a new window.

        Args:
            panel: The panel.
            screen: Name of the screen; empty for the primary one.
            x: Pixels from the left edge of the screen.
            y: Pixels from the upper edge of the screen.
            width: Width of the window in pixels.
            height: Height of the window in pixels.
        """
        key = self._track(panel)
        self._check_element("panel", key, ("Panel", "Split", "Tabs"))
        source = self._parent(key)
        lines = [f"x: {round(x)}", f"y: {round(y)}"]
        lines += [f"width: {max(1, round(width))}", f"height: {max(1, round(height))}"]
        self._insert("PanelWindow {\n    " + "\n    ".join(lines) + "\n}", (), None)
        path = self.document.root.children[-1].path
        window = self._track_path(path)
        if screen:
            self._edit(self.document.set_property(self._object(window), "screenName", screen))
        title = self._object(key).get("title")
        if title is not None and title.kind == "literal":
            self._edit(self.document.set_property(self._object(window), "title", title.value))
        self._move(key, self._path(window))
        self._unset_share(key)
        if source is not None:
            self._collapse(source)

    def place_window(
        self, window: Object, screen: str, x: float, y: float, width: float, height: float
    ) -> None:
        """Set the screen, place and size of a window; arguments as for :meth:`to_window`.

        Raises:
            BoundError: One of them is an expression.
        """
        key = self._track(window)
        self._check_element("window", key, ("PanelWindow",))
        if screen or self._object(key).get("screenName") is not None:
            self._edit(self.document.set_property(self._object(key), "screenName", screen))
        for name, value in (("x", x), ("y", y), ("width", width), ("height", height)):
            self._edit(self.document.set_property(self._object(key), name, round(value)))

    def close_window(self, window: Object) -> None:
        """Put the panels of a window onto the last page, and remove it."""
        key = self._track(window)
        self._check_element("window", key, ("PanelWindow",))
        pages = [one for one in self.document.root.children if element_of(one) == "Page"]
        if not pages:
            self.add_page("Page 1")
            pages = [one for one in self.document.root.children if element_of(one) == "Page"]
        page = self._track(pages[-1])
        for child in self._elements(key):
            self._put(child, page, "center")
            self._tidy(child)
        if self._path_or_none(key) is not None:
            self._drop(key)

    # -- placing ---------------------------------------------------------------------------------

    def _can_center(self, goal: Path) -> bool:
        return element_of(self._object(goal)) in {"Panel", "Tabs", "Page", "PanelWindow"}

    def _put(self, panel: Path, goal: Path, edge: str) -> None:
        """Move a panel; what it leaves behind stays."""
        target = element_of(self._object(goal))
        if edge in {"before", "after"}:
            self._put_beside(panel, goal, edge)
        elif edge == "center":
            self._put_into(panel, goal)
        elif target in {"Page", "PanelWindow"}:
            self._put_at_rim(panel, goal, edge)
        else:
            self._put_at_edge(panel, goal, edge)

    def _put_beside(self, panel: Path, goal: Path, edge: str) -> None:
        parent = self._object(goal).parent
        assert parent is not None
        others = {edge: self._object(goal)}
        self._unset_share(panel)
        others = {edge: self._object(goal)}
        parent = self._object(goal).parent
        assert parent is not None
        self._move(panel, parent.path, **others)

    def _put_into(self, panel: Path, goal: Path) -> None:
        target = self._object(goal)
        kind = element_of(target)
        parent = target.parent
        if kind == "Panel" and parent is not None and element_of(parent) == "Tabs":
            self._put_beside(panel, goal, "after")
            return
        if kind == "Panel":
            goal = self._wrap(goal, "Tabs {}")
        elif kind in {"Page", "PanelWindow"}:
            inner = self._only_split(goal)
            goal = inner if inner is not None else goal
        self._unset_share(panel)
        self._move(panel, self._path(goal))

    def _put_at_rim(self, panel: Path, goal: Path, edge: str) -> None:
        """Put a panel along a whole side of a page or window."""
        vertical, first = edge in {"top", "bottom"}, edge in {"left", "top"}
        children = [one for one in self._elements(goal) if one != panel]
        inner = self._only_split(goal, besides=panel)
        if inner is not None and self._is_vertical(inner) == vertical:
            goal = inner
        elif len(children) <= 1:
            self._set_orientation(goal, vertical)
        elif self._is_vertical(goal) != vertical:
            self._wrap_children(goal, besides=panel)
            self._set_orientation(goal, vertical)
        self._unset_share(panel)
        children = [one for one in self._elements(goal) if one != panel]
        if not children:
            self._move(panel, self._path(goal))
        elif first:
            self._move(panel, self._path(goal), before=self._object(children[0]))
        else:
            self._move(panel, self._path(goal), after=self._object(children[-1]))

    def _put_at_edge(self, panel: Path, goal: Path, edge: str) -> None:
        """Put a panel beside an element, which shares its room with it."""
        vertical, side = edge in {"top", "bottom"}, "before" if edge in {"left", "top"} else "after"
        parent = self._parent(goal)
        if parent is not None and element_of(self._object(parent)) == "Tabs":
            goal = parent
            parent = self._parent(goal)
        kind = element_of(self._object(parent)) if parent is not None else ""
        assert parent is not None
        if kind in _ROWS:
            others = [one for one in self._elements(parent) if one not in (goal, panel)]
            is_row = self._is_vertical(parent) == vertical
            if not is_row and not others and kind != "Split":
                self._set_orientation(parent, vertical)
                is_row = True
        else:
            others, is_row = [], False
        if is_row:
            share = self._share(goal)
            self._unset_share(panel)
            self._move(panel, self._path(parent), **{side: self._object(goal)})
            if others and share is not None:
                self._set_share(goal, share / 2)
                self._set_share(panel, share / 2)
            elif share is not None and share != 1:
                self._set_share(panel, share)
        else:
            text = "Split {\n    orientation: Qt.Vertical\n}" if vertical else "Split {}"
            wrapper = self._wrap(goal, text)
            self._unset_share(panel)
            self._move(panel, self._path(wrapper), **{side: self._object(goal)})

    def _wrap(self, goal: Path, text: str) -> Path:
        """Put an element into a new one, which gets its share; return that."""
        share = self._object(goal).get("share")
        value = share.text if share is not None else ""
        if share is not None:
            self._unset_share(goal)
        at = self._path(goal)
        self._edit(self.document.wrap_object(self._object(goal), text))
        inside = self.document.at(at).children[-1].path
        self._shift(lambda path: inside + path[len(at) :] if path[: len(at)] == at else path)
        wrapper = self._track_path(at)
        if value:
            self._edit(self.document.set_property(self._object(wrapper), "share", Code(value)))
        return wrapper

    def _wrap_children(self, goal: Path, besides: Path) -> None:
        """Put the elements of a page or window into a Split of the same orientation."""
        vertical = self._is_vertical(goal)
        text = "Split {\n    orientation: Qt.Vertical\n}" if vertical else "Split {\n}"
        children = [one for one in self._elements(goal) if one != besides]
        place = self._object(goal).children.index(self._object(children[0]))
        self._insert(text, self._path(goal), place)
        split = self._track_path(self._object(goal).children[place].path)
        for child in children:
            self._move(child, self._path(split))

    def _only_split(self, goal: Path, besides: Path | None = None) -> Path | None:
        """Return the Split that is the only element of a page or window."""
        children = [one for one in self._elements(goal) if one != besides]
        if len(children) == 1 and element_of(self._object(children[0])) == "Split":
            return children[0]
        return None

    # -- what is left behind ---------------------------------------------------------------------

    def _collapse(self, key: Path) -> None:
        """Replace an element that has lost a child by its last one, or remove it."""
        if self._path_or_none(key) is None:
            return
        found = self._object(key)
        kind, parent = element_of(found), self._parent(key)
        if kind in {"Split", "Tabs", "PanelWindow"} and not found.children:
            if kind == "PanelWindow" or self._is_plain(found):
                self._drop(key)
                if parent is not None:
                    self._collapse(parent)
            return
        if kind not in {"Split", "Tabs"} or len(found.children) != 1 or not self._is_plain(found):
            if kind in _ROWS:
                self._simplify_shares(key)
            return
        child = self._track(found.children[0])
        share = found.get("share")
        value = share.text if share is not None else ""
        is_element = bool(element_of(found.children[0]))
        if value and not is_element:
            return
        at, inside = self._path(key), self._path(child)
        if is_element:
            self._unset_share(child)
            inside = self._path(child)
        self._edit(self.document.unwrap(self._object(key)))
        self._paths = {old: None if now == at else now for old, now in self._paths.items()}
        self._shift(
            lambda path: at + path[len(inside) :] if path[: len(inside)] == inside else path
        )
        if value:
            self._edit(self.document.set_property(self._object(child), "share", Code(value)))
        if parent is not None and element_of(self._object(parent)) in _ROWS:
            self._simplify_shares(parent)

    def _is_plain(self, found: Object) -> bool:
        """Return whether an element has nothing that was written by hand."""
        return all(
            member.kind in {"literal", "binding"} and member.name in _OF_CONTAINERS
            for member in found.members
        ) and len(found.objects) == len(found.children)

    def _tidy(self, key: Path) -> None:
        """Simplify the shares around an element."""
        parent = self._parent(key)
        if parent is not None and element_of(self._object(parent)) in _ROWS:
            self._simplify_shares(parent)

    def _simplify_shares(self, key: Path) -> None:
        """Leave out shares that are all alike."""
        children = self._elements(key)
        shares = [self._share(child) for child in children]
        if len(set(shares)) == 1 and shares[0] is not None:
            for child in children:
                self._unset_share(child)

    # -- properties ------------------------------------------------------------------------------

    def _is_vertical(self, key: Path) -> bool:
        member = self._object(key).get("orientation")
        return member is not None and member.text == _VERTICAL

    def _set_orientation(self, key: Path, vertical: bool) -> None:
        found = self._object(key)
        if vertical:
            changed = self.document.set_property(found, "orientation", _VERTICAL, overwrite=True)
            self._edit(changed)
        elif found.get("orientation") is not None:
            self._edit(self.document.remove_property(found, "orientation"))

    def _share(self, key: Path) -> float | None:
        """Return the share of an element; None if it is an expression."""
        member = self._object(key).get("share")
        if member is None:
            return 1.0
        value = member.value if member.kind == "literal" else None
        return float(value) if isinstance(value, (int, float)) else None

    def _set_share(self, key: Path, share: float) -> None:
        value = max(0.01, round(share, 2))
        if value == 1 and self._object(key).get("share") is None:
            return
        self._edit(self.document.set_property(self._object(key), "share", value))

    def _unset_share(self, key: Path) -> None:
        found = self._object(key)
        if element_of(found) and found.get("share") is not None:
            self._edit(self.document.remove_property(found, "share"))

    # -- objects by their paths ------------------------------------------------------------------

    def _track(self, found: Object) -> Path:
        """Return the key of an object, by which it is found after each change."""
        if found.source is self.document.text:
            return self._track_path(found.path)
        if found.source is not self._first.text or self._paths[found.path] is None:
            raise ArgumentError("element", found.type, "an object of this layout")
        return found.path

    def _track_path(self, path: Path) -> Path:
        for key, now in self._paths.items():
            if now == path:
                return key
        key = (-1, len(self._paths))
        self._paths[key] = path
        return key

    def _path_or_none(self, key: Path) -> Path | None:
        return self._paths[key]

    def _path(self, key: Path) -> Path:
        path = self._paths[key]
        assert path is not None, key
        return path

    def _object(self, key: Path) -> Object:
        return self.document.at(self._path(key))

    def _parent(self, key: Path) -> Path | None:
        """Return the element around an object; None if that is something else."""
        parent = self._object(key).parent
        if parent is None or not element_of(parent):
            return None
        return self._track_path(parent.path)

    def _elements(self, key: Path) -> list[Path]:
        """Return what an element lays out."""
        children = self._object(key).children
        return [self._track_path(one.path) for one in children if element_of(one)]

    def _check_element(self, name: str, key: Path, kinds: Sequence[str]) -> None:
        found = self._object(key)
        if element_of(found) not in kinds:
            raise ArgumentError(name, found.type, f"one of {', '.join(kinds)}")

    def _edit(self, document: Document) -> None:
        """Take a change that leaves all paths as they are."""
        self.document = document

    def _shift(self, moved: object) -> None:
        assert callable(moved)
        self._paths = {key: None if now is None else moved(now) for key, now in self._paths.items()}

    def _insert(self, text: str, parent: Path, place: int | None) -> None:
        self._edit(self.document.insert_object(self.document.at(parent), text, place))
        children = self.document.at(parent).children
        new = children[len(children) - 1 if place is None else place].path
        self._shift(lambda path: _inserted(path, new))

    def _drop(self, key: Path) -> None:
        gone = self._path(key)
        self._edit(self.document.remove_object(self._object(key)))
        self._shift(lambda path: _removed(path, gone))

    def _move(
        self,
        key: Path,
        parent: Path,
        *,
        before: Object | None = None,
        after: Object | None = None,
    ) -> None:
        """Move an object to a child of another one, by the paths of now."""
        holder, gone = self.document.at(parent), self._path(key)
        target = self._object(key)
        others = [child for child in holder.children if child is not target]
        if before is not None:
            place = others.index(before)
        elif after is not None:
            place = others.index(after) + 1
        else:
            place = len(others)
        self._edit(self.document.move_object(target, holder, place))
        inside = {old: now for old, now in self._paths.items() if now and now[: len(gone)] == gone}
        self._shift(lambda path: _removed(path, gone))
        to = _removed(parent, gone)
        assert to is not None
        new = self.document.at(to).children[place].path
        self._shift(lambda path: _inserted(path, new))
        for old, now in inside.items():
            self._paths[old] = new + now[len(gone) :]


def _removed(path: Path, gone: Path) -> Path | None:
    """Return the path of an object after another one was removed; None if it was in that."""
    last = len(gone) - 1
    if path[: len(gone)] == gone:
        return None
    if len(path) > last and path[:last] == gone[:last] and path[last] > gone[last]:
        return (*path[:last], path[last] - 1, *path[last + 1 :])
    return path


def _inserted(path: Path, new: Path) -> Path:
    """Return the path of an object after another one was inserted."""
    last = len(new) - 1
    if len(path) > last and path[:last] == new[:last] and path[last] >= new[last]:
        return (*path[:last], path[last] + 1, *path[last + 1 :])
    return path
