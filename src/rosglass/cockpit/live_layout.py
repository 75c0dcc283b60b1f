"""The layout on the screen, which follows its document while it lives.

Each change is a new text: by the hand, an undo, a form, or another program. The living panels
follow it: they are moved, not made again, so that nothing restarts and no image flickers.
"""

from __future__ import annotations

import logging
import re
from functools import partial
from typing import TYPE_CHECKING, Any
from weakref import ref

from rosglass.cockpit.layout_changes import Changes, elements_in, elements_of, text_of
from rosglass.cockpit.layout_edits import LayoutEdits, element_of
from rosglass.cockpit.qml_document import Document, to_qml
from rosglass.errors import Error, QmlError
from rosglass.qml.run.live_file import LiveFile, create, register_imports
from rosglass.qml.run.load_errors import error_list
from rosglass.qt import QtCore, QtQml, QtQuick, Signal, address, is_alive

if TYPE_CHECKING:
    import os
    from collections.abc import Callable, Sequence

    from rosglass.cockpit.layout_changes import Path
    from rosglass.cockpit.qml_document import Object
    from rosglass.qml.engine.session import Session

__all__ = ["LiveLayout", "content_items", "qml_type"]

_log = logging.getLogger("rosglass.cockpit")
#: ``element_`` of the QML files -> type.
_KINDS = {
    "cockpit": "Cockpit",
    "page": "Page",
    "window": "PanelWindow",
    "split": "Split",
    "tabs": "Tabs",
    "panel": "Panel",
}
#: Properties that a panel keeps when its content cannot be shown.
_KEPT = ("id", "objectName", "title", "share", "minimumSize")
#: Suffixes of classes that QML derives, and prefixes of Qt's own.
_CLASS = re.compile(r"^(?:QQuick|QQml)?(\w+?)(?:_QML(?:TYPE)?_\d+)*\(")


class _NotFollowedError(Exception):
    """The living objects cannot follow a change: the file has to be loaded again."""


class LiveLayout(QtCore.QObject):
    """Shows a layout in an item, and keeps it like its document.

    Args:
        file: The file of the layout, which need not exist yet; its folder has its own types.
        session: The node that the layout uses.
        container: The item that it fills; see :meth:`put_into`.
        import_paths: Further folders with QML modules.

    Raises:
        QmlError: There is no such folder.
    """

    #: The layout was loaded from its text: :attr:`root` and all items are new ones.
    loaded = Signal()
    #: The hand has changed the layout: name of the action, and the new document, for
    #: :meth:`show`.
    edited = Signal(str, object)
    #: A change by the hand is not possible: the reason.
    refused = Signal(str)
    #: :attr:`problem` has changed.
    problem_changed = Signal()

    def __init__(
        self,
        file: str | os.PathLike[str],
        session: Session,
        container: QtQuick.QQuickItem | None = None,
        *,
        import_paths: Sequence[str | os.PathLike[str]] = (),
    ) -> None:
        super().__init__()
        self._live = LiveFile(file, session, import_paths=import_paths, must_exist=False)
        self._container: Any = container
        self._document: Document | None = None
        #: The root; Python must know it, or PySide forgets what it was.
        self._root: Any = None
        #: Path in the document -> item.
        self._items: dict[Path, Any] = {}
        #: Whether the items are known: not with elements of types written by hand.
        self._is_known = False
        #: Address of an item that was created by itself -> its component, and its ids.
        self._apart: dict[int, tuple[QtQml.QQmlComponent, frozenset[str]]] = {}
        self._problem = ""
        self._follow_size()

    # -- what is shown ---------------------------------------------------------------------------

    @property
    def root(self) -> Any:
        """The living Cockpit; None before the first :meth:`show`, or if that failed."""
        return self._root

    @property
    def document(self) -> Document | None:
        """The document that is shown; None before the first."""
        return self._document

    @property
    def problem(self) -> str:
        """Why the last document is not shown; empty if it is."""
        return self._problem

    @property
    def live(self) -> LiveFile:
        """The file with its engine."""
        return self._live

    def put_into(self, container: Any) -> None:
        """Show the layout in an item, which it fills; None takes it off the screen."""
        self._container = container
        self._follow_size()
        if is_alive(self._root):
            self._root.setParentItem(container)
            self._fill()

    def item_of(self, found: Object) -> Any:
        """Return the living item of an element of the document; None if it is not known."""
        return self._items.get(found.path) if self._is_known else None

    def object_of(self, item: QtQuick.QQuickItem | None) -> Object | None:
        """Return the element in the document of an item; None if it is not known."""
        if item is None or self._document is None or not self._is_known:
            return None
        wanted = address(item)
        for path, one in self._items.items():
            if is_alive(one) and address(one) == wanted:
                return self._document.at(path)
        return None

    # -- showing ---------------------------------------------------------------------------------

    def show(self, document: Document) -> bool:
        """Make the screen like a document; the last one stays if it has errors.

        Panels that are in both go on as they are, wherever they are now. What cannot be followed
        loads the whole file again.

        Returns:
            Whether it is shown; if not, :attr:`problem` says why.
        """
        try:
            if not self._follow(document):
                self._load(document)
        except Error as error:
            self._set_problem(str(error))
            return False
        self._set_problem("")
        return True

    def reload(self) -> bool:
        """Load the document again, e.g. as a file of its folder has changed."""
        if self._document is None:
            return False
        try:
            self._load(self._document)
        except Error as error:
            self._set_problem(str(error))
            return False
        self._set_problem("")
        return True

    def close(self) -> None:
        """Destroy what is shown; safe to call twice."""
        self._items, self._apart, self._root = {}, {}, None
        self._live.close()

    def _set_problem(self, text: str) -> None:
        if text != self._problem:
            self._problem = text
            if text:
                _log.error("%s", text)
            self.problem_changed.emit()

    # -- the whole file --------------------------------------------------------------------------

    def _load(self, document: Document) -> None:
        """Load a document as a whole; panels whose content has errors say them.

        Raises:
            QmlError: It has errors outside of panels.
        """
        made = self._create(document)
        self._apart, self._items = {}, {}

        def put() -> None:
            self._root = made.root
            if isinstance(made.root, QtQuick.QQuickItem):
                made.root.setParentItem(self._container)

        before = self._state()
        self._live.replace(made, put)
        self._document = document
        self._fill()
        self._is_known = self._find_items()
        self._connect()
        for name, value in before.items():
            self._root.setProperty(name, value)
        self.loaded.emit()

    def _state(self) -> dict[str, Any]:
        """Return what a Cockpit keeps when it is loaded again."""
        if not is_alive(self._root):
            return {}
        return {name: self._root.property(name) for name in ("editing", "pageIndex")}

    def _create(self, document: Document) -> Any:
        shown = document
        while True:
            try:
                made = self._live.create(shown.text)
            except QmlError as error:
                panel = self._failing_panel(shown, str(error))
                if panel is None:
                    raise
                _log.error("%s", error)
                shown = _with_problem(shown, panel, str(error))
                continue
            if _kind_of(made.root) != "Cockpit":
                self._live.drop(made)
                name = document.root.type
                raise QmlError(f"{self._live.path}: a layout's root is a Cockpit, not {name}")
            return made

    def _failing_panel(self, document: Document, text: str) -> Object | None:
        """Return the panel that an error is in; None if it is outside of all."""
        place = re.compile(rf"{re.escape(str(self._live.path))}:(\d+):(\d+): ")
        starts = [0]
        starts += [found.end() for found in re.finditer(r"\r\n|\n|\r", document.text)]
        for line in text.splitlines():
            found = place.match(line)
            if found is None or int(found[1]) > len(starts):
                continue
            inside = document.object_at(starts[int(found[1]) - 1] + int(found[2]) - 1)
            while inside is not None and element_of(inside) != "Panel":
                inside = inside.parent
            if inside is not None and inside.get("problem") is None:
                return inside
        return None

    def _follow_size(self) -> None:
        """Keep the root as large as the container, from now on."""
        weak, box = ref(self), self._container
        if box is None:
            return

        def resize() -> None:
            layout = weak()
            # Another container may have taken its place.
            if layout is not None and is_alive(layout) and layout._container is box:
                layout._fill()

        box.widthChanged.connect(resize)
        box.heightChanged.connect(resize)

    def _fill(self) -> None:
        root, box = self._root, self._container
        if isinstance(root, QtQuick.QQuickItem) and is_alive(root) and is_alive(box):
            root.setSize(QtCore.QSizeF(box.width(), box.height()))

    # -- the living items ------------------------------------------------------------------------

    def _find_items(self) -> bool:
        """Find the item of each element; return whether all are known."""
        assert self._document is not None
        self._items = {(): self._root}
        for found in elements_in(self._document):
            item = self._items.get(found.path)
            if item is None:
                return False
            wanted = elements_of(found)
            living = _elements_on_screen(item)
            for kind in ("windows", "others"):
                names = [
                    one
                    for one in wanted
                    if (element_of(one) == "PanelWindow") == (kind == "windows")
                ]
                items = living[kind]
                if [element_of(one) for one in names] != [_kind_of(one) for one in items]:
                    _log.info(
                        "%s: elements of types written by hand: each change loads it again",
                        self._live.path,
                    )
                    return False
                for one, item_ in zip(names, items, strict=True):
                    self._items[one.path] = item_
        return True

    def _living(self, element: Path, inside: Path, found: Object) -> Any:
        """Return the living object that is written in an element.

        Args:
            element: Path of the element, in the old document.
            inside: See :class:`Setting`.
            found: The element in the old document.

        Raises:
            _NotFollowedError: It is not certain which one it is.
        """
        living, is_element = self._items[element], True
        for number in inside:
            children = found.children
            if is_element:
                around = elements_of(found)
                children = [one for one in children if one not in around]
            is_element = False
            wanted = children[number]
            name = wanted.type.rpartition(".")[2]
            alike = [one for one in children if one.type == wanted.type]
            candidates = [one for one in content_items(living) if qml_type(one) == name]
            if len(alike) != len(candidates):
                raise _NotFollowedError
            living, found = candidates[alike.index(wanted)], wanted
        return living

    # -- following a change ----------------------------------------------------------------------

    def _follow(self, document: Document) -> bool:
        """Change what is shown; return whether that is possible."""
        old = self._document
        if old is None or not self._is_known or not is_alive(self._root):
            return False
        if document.text == old.text:
            self._document = document
            return True
        ids: frozenset[str] = frozenset().union(*(ids for _, ids in self._apart.values()))
        changes = Changes.between(old, document, ids)
        if changes is None:
            return False
        try:
            self._set_all(old, changes)
            made = self._create_elements(document, changes)
        except _NotFollowedError:
            return False
        if changes.is_moved:
            self._call(self._root, "halt")
            self._root.setProperty("maximized_", None)
        page = self._root.property("page")
        items = {path: self._items[before] for path, before in changes.kept.items()}
        current = {
            path: item.property("currentItem")
            for path, item in items.items()
            if element_of(document.at(path)) == "Tabs"
        }
        items.update(made)
        if changes.is_moved:
            self._arrange(document, items)
        removed = [self._items[path] for path in changes.removed]
        self._items, self._document = items, document
        for item in removed:
            self._destroy(item)
        if changes.is_moved:
            for found in reversed(list(elements_in(document))):
                if element_of(found) != "Panel":
                    self._call(items[found.path], "arrange")
            set_tabs = {one.element for one in changes.settings if one.name == "currentIndex"}
            for path, shown in current.items():
                if path not in set_tabs:
                    _show_tab(items[path], shown)
            self._show_page(page)
        return True

    def _create_elements(self, document: Document, changes: Changes) -> dict[Path, Any]:
        """Create the items of new elements, without their places.

        Raises:
            _NotFollowedError: One cannot be created alone.
        """
        if changes.created:
            register_imports(self._live.path, self._live.engine, document.text)
        made: dict[Path, Any] = {}
        for path in changes.created:
            found = document.at(path)
            text = text_of(document, found)
            item = self._create_alone(text, found)
            if item is None:
                for one in made.values():
                    self._destroy(one)
                raise _NotFollowedError
            made[path] = item
        return made

    def _create_alone(self, text: str, found: Object) -> Any:
        """Create the item of an element from a text that has it alone; None with errors."""
        engine = self._live.engine
        context = QtQml.QQmlEngine.contextForObject(self._root)
        component = QtQml.QQmlComponent(engine)
        component.setData(text.encode(), QtCore.QUrl.fromLocalFile(str(self._live.path)))
        item = create(component, context)
        if item is None:
            errors = error_list(component.errors(), self._live.path, engine.importPathList())
            component.deleteLater()
            if element_of(found) != "Panel" or found.get("problem") is not None:
                return None
            _log.error("%s", errors)
            alone = Document(text, str(self._live.path))
            # The text has the panel as its root.
            return self._create_alone(_with_problem(alone, alone.root, errors).text, alone.root)
        ids = frozenset(one.id for one in found.walk() if one.id)
        self._apart[address(item)] = component, ids
        return item

    def _arrange(self, document: Document, items: dict[Path, Any]) -> None:
        """Put each element where the document has it, those around it first."""
        for found in elements_in(document):
            outer = items[found.path]
            children = [(one, items[one.path]) for one in elements_of(found)]
            for kind in ("windows", "others"):
                inner = [
                    item
                    for one, item in children
                    if (element_of(one) == "PanelWindow") == (kind == "windows")
                ]
                holder = (
                    outer.property("area_" if kind == "windows" else "holder_") if inner else None
                )
                before = None
                for item in inner:
                    if item.parentItem() is not holder:
                        item.setParent(outer)
                        item.setParentItem(holder)
                    if before is not None and not _is_before(holder, before, item):
                        item.stackAfter(before)
                    before = item

    def _set_all(self, old: Document, changes: Changes) -> None:
        """Set the properties that have another literal; none of them if one cannot be set.

        Raises:
            _NotFollowedError: One cannot be set.
        """
        found = []
        for one in changes.settings:
            before = changes.kept[one.element]
            found.append((self._living(before, one.inside, old.at(before)), one))
        undo: list[Callable[[], object]] = []
        for living, one in found:
            context = QtQml.QQmlEngine.contextForObject(living)
            known = QtQml.QQmlProperty(living, one.name, context)
            value = known.read() if known.isWritable() else None
            # As QML itself converts it, enumerations and colours too.
            expression = QtQml.QQmlExpression(context, living, f"this.{one.name} = {one.text}")
            if known.isWritable():
                expression.evaluate()
            if not known.isWritable() or expression.hasError():
                for job in undo:
                    job()
                raise _NotFollowedError
            undo.append(partial(known.write, value))

    def _destroy(self, item: Any) -> None:
        component = self._apart.pop(address(item), (None, None))[0]
        item.setParentItem(None)
        item.deleteLater()
        if component is not None:
            item.destroyed.connect(component.deleteLater)

    def _show_page(self, page: Any) -> None:
        pages = _list(self._root.property("pages"))
        wanted = address(page) if is_alive(page) else 0
        for number, one in enumerate(pages):
            if address(one) == wanted:
                self._root.setProperty("pageIndex", number)
                return
        self._root.setProperty(
            "pageIndex", max(0, min(self._root.property("pageIndex"), len(pages) - 1))
        )

    def _call(self, item: Any, function: str) -> None:
        QtCore.QMetaObject.invokeMethod(item, function)

    # -- the hand --------------------------------------------------------------------------------

    def _connect(self) -> None:
        """Turn the wishes of the hand into edits."""
        weak, root = ref(self), self._root

        def connect(signal: str, name: str, change: Callable[..., None]) -> None:
            def on_signal(*arguments: Any) -> None:
                layout = weak()
                if layout is not None and is_alive(layout):
                    layout._edit(name, change, arguments)

            getattr(root, signal).connect(on_signal)

        connect("moved", self.tr("Move {}"), LayoutEdits.move)
        connect("resized", self.tr("Resize"), LayoutEdits.resize)
        connect("detached", self.tr("Move {} to a window"), LayoutEdits.to_window)
        connect("windowMoved", self.tr("Move window {}"), LayoutEdits.place_window)
        connect("windowClosed", self.tr("Close window {}"), LayoutEdits.close_window)
        connect("renamed", self.tr("Rename {}"), LayoutEdits.rename)
        connect("removed", self.tr("Remove {}"), LayoutEdits.remove)
        connect("pageMoved", self.tr("Move page {}"), LayoutEdits.move_page)
        title = self.tr("Page {}")

        def add_page(edits: LayoutEdits) -> None:
            pages = [one for one in edits.document.root.children if element_of(one) == "Page"]
            edits.add_page(title.format(len(pages) + 1))

        connect("pageAdded", self.tr("Add a page"), add_page)

    def _edit(self, name: str, change: Callable[..., None], arguments: Sequence[Any]) -> None:
        document = self._document
        if document is None:
            return
        values: list[Any] = []
        for value in arguments:
            if isinstance(value, QtQuick.QQuickItem):
                found = self.object_of(value)
                if found is None:
                    self.refused.emit(
                        self.tr("This was written by hand: change it in the text of the layout")
                    )
                    return
                values.append(found)
            else:
                values.append(_list(value) if hasattr(value, "toVariant") else value)
        title = values[0].get("title") if values and hasattr(values[0], "get") else None
        shown = str(title.value) if title is not None and title.kind == "literal" else ""
        try:
            edits = LayoutEdits(document)
            change(edits, *values)
        except Error as error:
            self.refused.emit(str(error))
            return
        if edits.document.text != document.text:
            self.edited.emit(name.format(shown).strip(), edits.document)


def _with_problem(document: Document, panel: Object, text: str) -> Document:
    """Return a document with an error in the place of a panel's content."""
    members = [panel.get(name) for name in _KEPT]
    kept = "; ".join(panel.source[slice(*one.span)].rstrip("; \t") for one in members if one)
    # As many lines as before, for the errors of others.
    lines = "\n" * panel.text.count("\n")
    made = f"{panel.type} {{ {kept}{'; ' if kept else ''}problem: {to_qml(text)}{lines}}}"
    start, end = panel.span
    return Document(document.text[:start] + made + document.text[end:], document.file)


def _kind_of(item: Any) -> str:
    return _KINDS.get(str(item.property("element_") or ""), "")


def _list(value: Any) -> list[Any]:
    """Return an array of JavaScript."""
    made = value.toVariant() if hasattr(value, "toVariant") else value
    return list(made or [])


def _elements_on_screen(item: Any) -> dict[str, list[Any]]:
    """Return the elements in an element; the windows of a Cockpit by themselves."""
    kind = _kind_of(item)
    if kind == "Panel":
        return {"windows": [], "others": []}
    holder = item.property("holder_")
    others = [one for one in holder.childItems() if _kind_of(one)]
    windows = _list(item.property("windows")) if kind == "Cockpit" else []
    return {"windows": windows, "others": others}


def content_items(item: Any) -> list[Any]:
    """Return the objects of the default property."""
    # Not by metaObject(), whose wrapper outlives the object: PySide takes the next one at its
    # address for it.
    name: Any = QtQml.QQmlProperty(item).name()
    found = QtQml.QQmlListReference(item, name) if name else None
    if found is None or not found.isReadable():
        return []
    return [found.at(number) for number in range(found.count())]


def qml_type(item: Any) -> str:
    """Return the type of an object; see :func:`content_items`."""
    context = QtQml.QQmlEngine.contextForObject(item)
    if context is None:
        return ""
    text = QtQml.QQmlExpression(context, item, "'' + this").evaluate()
    found = _CLASS.match(str(text[0] if isinstance(text, tuple) else text))
    return found[1] if found else ""


def _is_before(holder: Any, one: Any, other: Any) -> bool:
    order = [address(child) for child in holder.childItems()]
    return order.index(address(one)) < order.index(address(other))


def _show_tab(tabs: Any, shown: Any) -> None:
    if not is_alive(shown):
        return
    for number, one in enumerate(_list(tabs.property("elements_"))):
        if address(one) == address(shown):
            tabs.setProperty("currentIndex", number)
