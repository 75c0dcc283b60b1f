"""Changes that panels make by themselves, kept in the text of the layout.

A plugin of RQml changes its context; a field of a message is dropped on a gauge, a lamp or a plot.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

from rosglass.cockpit.live_layout import LiveLayout, content_items, qml_type
from rosglass.cockpit.qml_document import Code, Document
from rosglass.errors import Error
from rosglass.qt import QtCore, Signal, is_alive

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rosglass.cockpit.qml_document import Object

__all__ = ["OwnChanges"]

#: Type -> its property that the user changes in the control itself.
_PROPERTIES = {"Gauge": "path", "Lamp": "path", "Plot": "paths", "Plugin": "context"}
#: Dynamic property of objects that are followed.
_FOLLOWED = "rosglass_followed"


class OwnChanges(QtCore.QObject):
    """Follows the contents of a layout's panels.

    Args:
        live: The layout.
    """

    #: A panel has changed itself: name of the action, and the document with the change.
    edited = Signal(str, object)
    #: A change cannot be kept: the reason.
    refused = Signal(str)

    def __init__(self, live: LiveLayout) -> None:
        super().__init__()
        self._live = live
        #: Whether the layout is being changed by its document.
        self.paused = False

    def follow(self) -> None:
        """Follow the panels of the document that is shown; safe to call again."""
        for panel, item, name in self._contents():
            if item.property(_FOLLOWED):
                continue
            item.setProperty(_FOLLOWED, True)
            signal = item.contextEdited if name == "context" else getattr(item, f"{name}Changed")
            signal.connect(partial(self._keep, panel, item, name))

    def _contents(self) -> Iterator[tuple[Any, Any, str]]:
        """Yield the living panels with such a content, the content and its property."""
        document = self._live.document
        for found in document.objects() if document is not None else ():
            kind = found.type.rpartition(".")[2]
            panel = self._live.item_of(found.parent) if found.parent is not None else None
            if kind not in _PROPERTIES or panel is None:
                continue
            for item in content_items(panel):
                if qml_type(item) == kind:
                    yield panel, item, _PROPERTIES[kind]

    def _keep(self, panel: Any, item: Any, name: str) -> None:
        if self.paused or not (is_alive(panel) and is_alive(item)):
            return
        document, found = self._live.document, content_of(self._live.object_of(panel))
        if document is None or found is None:
            return
        try:
            changed = _with_value(document, found, name, item)
        except Error as error:
            self.refused.emit(str(error))
            return
        if changed.text != document.text:
            self.edited.emit(self.tr("Settings of {}").format(found.type), changed)


def _with_value(document: Document, found: Object, name: str, item: Any) -> Document:
    """Return the document with the living value of a property."""
    if name == "context":
        return document.set_property(found, name, Code(item.contextText()), overwrite=True)
    value = item.property(name)
    value = value.toVariant() if hasattr(value, "toVariant") else value
    return document.set_property(found, name, value, overwrite=True)


def content_of(panel: Object | None) -> Object | None:
    """Return the object that a panel shows; None without one."""
    return next(iter(panel.children), None) if panel is not None else None
