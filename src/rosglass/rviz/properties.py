"""Registered properties in RViz's property tree, each with the editor that suits its kind.

What is derived from RViz's classes is called by C++, where an exception would end the process.
"""
# ruff: noqa: N802 - the names of what C++ calls are RViz's

from __future__ import annotations

import logging
from functools import cache, wraps
from typing import TYPE_CHECKING, Any

from rosglass.errors import Error
from rosglass.qt import is_alive
from rosglass.rviz.editors import make_editor
from rosglass.rviz.host import pyqt, rviz
from rosglass.rviz.registered_property import RegisteredProperty

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.rviz.property_sources import Sources
    from rosglass.rviz.registered_properties import RegisteredProperties

__all__ = ["PropertyTree", "given_to_rviz", "quiet", "take_out"]

_log = logging.getLogger("rosglass.rviz")


def quiet(otherwise: Any = None) -> Callable[[Any], Any]:
    """Make a function that C++ calls log what it raises, and return something else instead."""

    def decorate(function: Any) -> Any:
        # To make the help text of one of its functions, PySide2 loads whatever it knows.
        @wraps(function, assigned=("__name__", "__qualname__"))
        def call(*arguments: Any) -> Any:
            try:
                return function(*arguments)
            except Exception:
                _log.exception("RViz goes on without %s", function.__qualname__)
                return otherwise

        return call

    return decorate


def given_to_rviz(item: Any) -> Any:
    """Return a property whose end is RViz's to decide, with the property that it stands below."""
    pyqt("sip").transferto(item, None)
    return item


@cache
def _classes() -> tuple[Any, Any]:
    """Return our kind of RViz's ``Property``, and of its ``BoolProperty``."""
    bindings, core = rviz(), pyqt()

    class _Shown:
        """What both share; `view` is set right after it is made."""

        view: PropertyView | None = None

        def load(self, config: Any) -> None:
            """Values come from the display, which knows their types."""

        def save(self, config: Any) -> None:
            """And go there."""

    def flags(item: Any, base: Any, column: int) -> Any:
        found = base.getViewFlags(item, column)
        if item.view is not None and item.view.model.readOnly:
            found &= ~(core.Qt.ItemIsEditable | core.Qt.ItemIsUserCheckable)
        return found

    class Item(_Shown, bindings.Property):  # type: ignore[name-defined,misc]
        @quiet()
        def getViewData(self, column: int, role: int) -> Any:
            view = self.view
            if view is not None and column == 1 and role == core.Qt.DecorationRole:
                swatch = view.swatch()
                if swatch is not None:
                    return swatch
            return bindings.Property.getViewData(self, column, role)

        @quiet(core.Qt.ItemFlags())
        def getViewFlags(self, column: int) -> Any:
            return flags(self, bindings.Property, column)

        @quiet()
        def createEditor(self, parent: Any, option: Any) -> Any:
            view = self.view
            made = make_editor(view.model, parent, view.sources) if view is not None else None
            return bindings.Property.createEditor(self, parent, option) if made is None else made

    class Check(_Shown, bindings.BoolProperty):  # type: ignore[name-defined,misc]
        @quiet(core.Qt.ItemFlags())
        def getViewFlags(self, column: int) -> Any:
            return flags(self, bindings.BoolProperty, column)

    return Item, Check


class PropertyView:
    """One property in the tree, with the parts of a vector and the properties below it.

    Args:
        model: The property.
        above: RViz's property that it stands below.
        sources: What choosers offer, and who is told of refused edits.
    """

    def __init__(self, model: RegisteredProperty, above: Any, sources: Sources) -> None:
        self.model, self.sources = model, sources
        item, check = _classes()
        kind = item if model.kind.NAME != "bool" else check
        about = model.description
        name = model.path[-1]
        #: RViz's property.
        self.item: Any = given_to_rviz(kind(name, _for_rviz(model), about, above))
        self.item.view = self
        self._parts: dict[str, Any] = {}
        self._busy = False
        self._show_about()
        if hasattr(model.kind, "parts"):
            for part, number in model.kind.parts(model.get()).items():
                self._parts[part] = given_to_rviz(item(part, number, "", self.item))
        self.item.changed.connect(quiet()(lambda: self._edited(self.item, None)))
        for part, below in self._parts.items():
            below.changed.connect(quiet()(lambda part=part, below=below: self._edited(below, part)))
        self._watches = [
            (model.valueChanged, lambda _value: self._show()),
            (model.aboutChanged, self._show_about),
        ]
        self._watches = [(signal, quiet()(slot)) for signal, slot in self._watches]
        for signal, slot in self._watches:
            signal.connect(slot)

    def swatch(self) -> Any:
        """Return the colour that is shown beside the value, if it is one."""
        if self.model.kind.NAME != "color":
            return None
        return pyqt("QtGui").QColor(self.model.kind.saved(self.model.get()))

    def close(self) -> None:
        """Follow the property no longer."""
        watches, self._watches = self._watches, []
        for signal, slot in watches if is_alive(self.model) else ():
            signal.disconnect(slot)

    def _edited(self, item: Any, part: str | None) -> None:
        if self._busy:
            return
        model = self.model
        value = _plain(item.getValue())
        try:
            if part is not None:
                value = model.kind.with_part(model.get(), part, value)  # type: ignore[attr-defined]
            elif self._parts:
                value = _from_text(str(value), list(self._parts))
            if not model.readOnly:
                model.set(value)
        except Error as error:
            self.sources.complain(f"{'/'.join(model.path)}: {error}")
        self._show()

    def _show(self) -> None:
        if self._busy or _is_deleted(self.item):
            return
        self._busy = True
        try:
            self.item.setValue(_for_rviz(self.model))
            if self._parts:
                for part, number in self.model.kind.parts(self.model.get()).items():  # type: ignore[attr-defined]
                    self._parts[part].setValue(number)
        finally:
            self._busy = False

    def _show_about(self) -> None:
        if _is_deleted(self.item):
            return
        model = self.model
        self.item.setDescription(model.description)
        for item in (self.item, *self._parts.values()):
            item.setReadOnly(model.readOnly)


def _for_rviz(model: RegisteredProperty) -> Any:
    """Return a value as RViz's tree shows it."""
    saved = model.kind.saved(model.get())
    return "; ".join(f"{part:g}" for part in saved.values()) if isinstance(saved, dict) else saved


def _from_text(text: str, parts: list[str]) -> dict[str, str]:
    given = text.replace(",", ";").split(";")
    if len(given) != len(parts):
        raise Error(f"expected {len(parts)} numbers, e.g. {'; '.join('0' for _ in parts)}")
    return dict(zip(parts, given, strict=True))


def _plain(value: Any) -> Any:
    """Return what an editor gave as Python has it."""
    return value.value() if isinstance(value, pyqt().QVariant) else value


class PropertyTree:
    """All properties of one owner, below one of RViz's.

    Args:
        owner: Whose properties.
        above: RViz's property that they stand below.
        sources: See :class:`PropertyView`.
    """

    def __init__(self, owner: RegisteredProperties, above: Any, sources: Sources) -> None:
        self._owner, self._above, self._sources = owner, above, sources
        self._views: dict[RegisteredProperty, PropertyView] = {}
        self._watched: dict[RegisteredProperty, Any] = {}
        self._added, self._gone = quiet()(self._on_registered), quiet()(self._on_unregistered)
        owner.registered.connect(self._added)
        owner.unregistered.connect(self._gone)
        for found in owner.all():
            self._enter(found)

    def item(self, found: RegisteredProperty) -> Any:
        """Return what stands for a property in RViz's tree."""
        return self._views[found].item

    def close(self) -> None:
        """Follow the owner no longer, and take its properties out of the tree."""
        if is_alive(self._owner):
            self._owner.registered.disconnect(self._added)
            self._owner.unregistered.disconnect(self._gone)
        for found in list(self._owner.properties.values()):
            self._leave(found)

    def _on_registered(self, found: object) -> None:
        # QML can emit every signal that it sees, with anything.
        if isinstance(found, RegisteredProperty) and found not in self._watched:
            self._enter(found)

    def _on_unregistered(self, found: object) -> None:
        if isinstance(found, RegisteredProperty) and found in self._watched:
            self._leave(found)

    def _enter(self, found: RegisteredProperty) -> None:
        watch = self._watched[found] = quiet()(lambda: self._show(found))
        found.aboutChanged.connect(watch)
        self._show(found)

    def _leave(self, found: RegisteredProperty) -> None:
        for below in found.properties.values():
            self._leave(below)
        watch = self._watched.pop(found, None)
        if watch is not None and is_alive(found):
            found.aboutChanged.disconnect(watch)
        self._hide(found)

    def _show(self, found: RegisteredProperty) -> None:
        """Have a property be in the tree or not.

        RViz's own way of hiding one, by a signal that comes later, crashes when it is gone by then.
        """
        if found.hidden:
            self._hide(found)
        elif found not in self._views:
            view = self._views.get(found.container) if found.container is not None else None
            above = view.item if view is not None else self._above
            if (found.container is None or view is not None) and not _is_deleted(above):
                self._views[found] = PropertyView(found, above, self._sources)
                for below in found.properties.values():
                    self._show(below)

    def _hide(self, found: RegisteredProperty) -> None:
        for below in found.properties.values():
            self._hide(below)
        view = self._views.pop(found, None)
        if view is not None:
            view.close()
            take_out(view.item)


def take_out(item: Any) -> None:
    """Take a property out of RViz's tree, and have it end once nobody uses it any more."""
    if not _is_deleted(item):
        above = item.getParent()
        if above is not None:
            above.takeChild(item)
        item.deleteLater()


def _is_deleted(item: Any) -> bool:
    return bool(pyqt("sip").isdeleted(item))
