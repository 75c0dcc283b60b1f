"""RViz's Displays panel and our overlays, kept in step: what is in one is in the other."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

from rosglass.qt import QtCore, Signal, Slot
from rosglass.rviz.display import Entry
from rosglass.rviz.display_classes import (
    QML_CLASS,
    REFERENCE_QML_CLASS,
    class_id_of,
    maker_of,
)
from rosglass.rviz.host import pyqt, rviz
from rosglass.rviz.properties import quiet, take_out
from rosglass.rviz.property_sources import Sources
from rosglass.rviz.qml_overlay import QmlOverlay
from rosglass.rviz.renderer_choice import choice
from rosglass.rviz.watch import AfterEvent

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence
    from pathlib import Path

    from rosglass.qml.session import Session
    from rosglass.rviz.overlay import Overlay
    from rosglass.rviz.stack import Stack
    from rosglass.rviz.window import Window

__all__ = ["Entries"]


class Entries(QtCore.QObject):
    """Gives each overlay an entry in the panel, and each entry of a config file its overlay.

    RViz makes a placeholder of each display whose class it cannot load, which keeps what the file
    has for it; ours take the places of those that are overlays.

    Args:
        window: RViz.
        stack: The overlays.
        session: The node that QML talks through.
        import_paths: Further folders with QML modules.
    """

    #: Placeholders have been looked for, and replaced.
    replaced = Signal()

    def __init__(
        self, window: Window, stack: Stack, session: Session, import_paths: Sequence[Path] = ()
    ) -> None:
        super().__init__()
        self._window, self._stack, self._session = window, stack, session
        self._import_paths = import_paths
        #: What choosers of properties offer.
        self.sources = Sources(session, lambda text: window.widget.statusBar().showMessage(text))
        self._entries: list[Entry] = []
        #: Overlays that the program has brought, which outlive the displays of a config file.
        self._programs: list[Overlay] = []
        #: As the panel has shown them last; what came since may belong between others.
        self._order: list[Overlay] = []
        self._new = False
        self._guests: dict[str, Callable[[], Any]] = {}
        self._held = False
        self._scheduled = self._settling = self._closed = False
        self._watched: set[int] = set()
        # RViz's panel handles other events while it duplicates displays, too.
        self._look_again = AfterEvent(self._replace_placeholders)
        stack.changed.connect(self._schedule)
        window.before_frame.connect(self._look)
        window.config_loading.connect(self._hold)
        self._replace_placeholders()

    def __iter__(self) -> Iterator[Entry]:
        """Iterate over the entries, in the order in which they came."""
        return iter(list(self._entries))

    def of(self, overlay: Overlay) -> Entry | None:
        """Return the entry of an overlay."""
        return next((entry for entry in self._entries if entry.overlay is overlay), None)

    def add_qml(self, file: str, name: str = "") -> Entry:
        """Put an entry for a QML file into the panel; what is wrong with it is told there."""
        entry = self._make(QML_CLASS)
        entry.own.properties["Path"].set(file)
        entry.display.setName(name or QtCore.QFileInfo(file).completeBaseName())
        self._window.manager.addDisplay(entry.display, True)
        self._settle()
        return entry

    def welcome(self, class_id: str, make: Callable[[], Any]) -> None:
        """Have placeholders of a class be replaced by what is no overlay.

        Args:
            class_id: The class.
            make: Returns an object with a `display`, which has that object as its `entry`.
        """
        self._guests[class_id] = make
        self._replace_placeholders()

    def remove(self, entry: Entry) -> None:
        """Take an entry and its overlay away."""
        self._forget(entry)
        take_out(entry.display)

    def close(self) -> None:
        """Leave RViz's panel as it is, and follow nothing any longer; safe to call twice."""
        if self._closed:
            return
        self._closed = True
        self.sources.close()
        for entry in list(self._entries):
            self.remove(entry)

    # Keeping in step.

    @Slot()
    def _schedule(self, *_: Any) -> None:
        if not self._scheduled and not self._closed:
            self._scheduled = True
            QtCore.QTimer.singleShot(0, self._settle)

    @Slot()
    def _settle(self) -> None:
        self._scheduled = False
        if self._closed or self._settling or self._held:
            return
        self._settling = True
        try:
            quiet()(self._bring_about)()
        finally:
            self._settling = False

    def _bring_about(self) -> None:
        self._watch_panel()
        shown = list(self._stack)
        for entry in list(self._entries):
            overlay = entry.overlay
            if not entry.alive:
                self._forget(entry)
            elif overlay is not None and overlay not in shown:
                self.remove(entry)
            elif entry.outdated:
                self._let_go(entry.drop())
        known = {id(entry.overlay) for entry in self._entries}
        for overlay in list(self._stack):
            if id(overlay) not in known and not overlay.is_popup:
                self._enter(overlay)
        for entry in list(self._entries):
            self._show(entry)
        self._follow_panel()

    def _follow_panel(self) -> None:
        """Have overlays lie above each other as the panel shows them, once the user moves any."""
        order = [
            display.entry.overlay
            for display in self._displays()
            if isinstance(getattr(display, "entry", None), Entry) and display.entry.overlay
        ]
        before, self._order = self._order, order
        moved = [o for o in before if o in order] != [o for o in order if o in before]
        if moved or self._new:
            self._stack.put_in_order(order)
        if moved and not self._new:
            # RViz itself does not count it as a change.
            self._window.manager.notifyConfigChanged()
        self._new = False

    def _enter(self, overlay: Overlay) -> None:
        """Give an overlay of the program's an entry: one that waits for it, or a new one."""
        if overlay not in self._programs:
            self._programs.append(overlay)
            # A file may have one of a class that nobody has registered.
            self._replace_all()
        class_id = QML_CLASS if isinstance(overlay, QmlOverlay) else class_id_of(type(overlay))
        for entry in self._entries:
            if entry.overlay is None and self._waits_for(entry, overlay, class_id):
                self._untouched(partial(entry.take, overlay))
                return
        entry = self._make(class_id)
        entry.display.setName(overlay.name)
        entry.reflect(overlay)
        self._window.manager.addDisplay(entry.display, overlay.visible)
        entry.take(overlay)

    @staticmethod
    def _waits_for(entry: Entry, overlay: Overlay, class_id: str) -> bool:
        if str(entry.display.getName()) != overlay.name:
            return False
        if isinstance(overlay, QmlOverlay):
            return entry.is_qml and entry.shows(overlay.file)
        return entry.class_id == class_id

    def _show(self, entry: Entry) -> None:
        """Have an overlay be seen or not as its entry says; make it when it is seen first."""
        enabled = bool(entry.display.isEnabled())
        if entry.overlay is None and enabled:
            self._untouched(entry.ensure)
        overlay = entry.overlay
        if overlay is None:
            return
        if overlay not in list(self._stack):
            overlay.name = self._free_name(str(entry.display.getName()), overlay)
            self._stack.add(overlay)
            self._new = True
        overlay.visible = enabled

    def _rename(self, entry: Entry) -> None:
        if entry.overlay is not None and entry.alive:
            entry.overlay.name = self._free_name(str(entry.display.getName()), entry.overlay)

    def _free_name(self, wanted: str, overlay: Overlay) -> str:
        wanted = wanted or type(overlay).__name__
        name, number = wanted, 2
        while self._stack.find(name) not in (None, overlay):
            name, number = f"{wanted} {number}", number + 1
        return name

    def _make(self, class_id: str) -> Entry:
        entry = Entry(class_id, self._session, self.sources, self._import_paths)
        self._entries.append(entry)
        entry.touched, entry.renamed = self._schedule, self._rename
        entry.edited = quiet()(self._window.manager.notifyConfigChanged)
        return entry

    def _forget(self, entry: Entry) -> None:
        if entry in self._entries:
            self._entries.remove(entry)
            overlay = entry.drop()
            entry.close()
            self._let_go(overlay)

    def _let_go(self, overlay: Overlay | None) -> None:
        if overlay is not None:
            if overlay in self._programs:
                self._programs.remove(overlay)
            overlay.visible = False
            self._stack.remove(overlay)

    def _look(self) -> None:
        """See what no signal tells: groups that are switched, placeholders without a panel."""
        for entry in self._entries if not self._closed else ():
            overlay = entry.overlay
            enabled = entry.alive and bool(entry.display.isEnabled())
            if enabled != (overlay is not None and overlay.visible) and not (
                enabled and entry.waiting
            ):
                self._schedule()
                return

    # Config files.

    @Slot()
    def _hold(self) -> None:
        """Take the program's overlays out of the displays that RViz is about to delete."""
        self._held = self._new = True
        self._look_again.ask()
        for entry in list(self._entries):
            if entry.overlay in self._programs:
                self._entries.remove(entry)
                entry.drop()
                entry.close()

    # Placeholders.

    def _watch_panel(self) -> None:
        """Follow the panel's tree, which there may be another one of since the last config."""
        for view in self._window.frame.findChildren(pyqt("QtWidgets").QTreeView):
            model = view.model()
            if model is None or model.metaObject().className() != "rviz::PropertyTreeModel":
                continue
            address = int(pyqt("sip").unwrapinstance(model))
            if address not in self._watched:
                self._watched.add(address)
                model.rowsInserted.connect(quiet()(lambda *_: self._look_again.ask()))

    def _replace_placeholders(self) -> None:
        if not self._closed:
            quiet()(self._replace_all)()
            self.replaced.emit()
            self._held = False
            self._schedule()

    def _replace_all(self) -> None:
        for display in list(self._displays()):
            if getattr(display, "entry", None) is None and self._is_ours(display):
                self._untouched(partial(self._replace, display))

    def _displays(self, group: Any = None) -> Iterator[Any]:
        """Iterate over the displays in the order of the panel, those in groups included."""
        group = self._window.manager.getRootDisplayGroup() if group is None else group
        for at in range(group.numDisplays()):
            display = group.getDisplayAt(at)
            if display.metaObject().className() == "rviz::DisplayGroup":
                yield from self._displays(pyqt("sip").cast(display, rviz().DisplayGroup))
            else:
                yield display

    def _replace(self, placeholder: Any) -> None:
        config = rviz().Config()
        placeholder.save(config)
        above, row = placeholder.getParent(), placeholder.rowNumberInParent()
        class_id = str(placeholder.getClassId())
        guest = self._guests.get(class_id)
        entry = self._make(class_id) if guest is None else guest()
        entry.display.setName(placeholder.getName())
        manager = self._window.manager
        manager.addDisplay(entry.display, False)
        manager.getRootDisplayGroup().takeChild(entry.display)
        above.takeChildAt(row)
        above.addChild(entry.display, row)
        entry.display.load(config)
        if isinstance(entry, Entry) and entry.file:
            choice.expect(entry.file)
        placeholder.deleteLater()

    def _untouched(self, do: Callable[[], None]) -> None:
        """Do what changes nothing that the user would have to save."""
        modified = self._window.modified
        do()
        if not modified:
            self._window.widget.setWindowModified(False)

    def _is_ours(self, display: Any) -> bool:
        class_id = str(display.getClassId())
        programs = (class_id_of(type(o)) for o in self._programs if not isinstance(o, QmlOverlay))
        ours = {QML_CLASS, REFERENCE_QML_CLASS, *self._guests, *programs}
        return class_id in ours or maker_of(class_id) is not None
