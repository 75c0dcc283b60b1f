"""The overlays' entries in RViz's Displays panel, and the Overlays menu."""
# ruff: noqa: N802 - C++ calls these methods by their RViz names

from __future__ import annotations

from contextlib import suppress
from functools import cache, partial
from typing import TYPE_CHECKING, Any

from rosglass.errors import Error, QmlError
from rosglass.overlay.overlay import SCALE_LIMITS
from rosglass.overlay.property_values import from_config, plain_config, to_config
from rosglass.overlay.registered_properties import RegisteredProperties
from rosglass.qml.run.modules import locate
from rosglass.qt import QtCore, Signal, Slot, is_alive
from rosglass.rviz.host import AfterEvent, pyqt, rviz
from rosglass.rviz.overlay import QML_CLASS, REFERENCE_QML_CLASS, class_id_of, factory_of
from rosglass.rviz.properties import (
    Choices,
    PropertyTree,
    log_errors,
    owned_by_rviz,
    remove_from_tree,
)
from rosglass.rviz.qml_overlay import QmlOverlay
from rosglass.rviz.qt5 import QtWidgets
from rosglass.rviz.rendering import choice

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence
    from pathlib import Path

    from rosglass.overlay.overlay import Overlay
    from rosglass.overlay.trackers import Frames
    from rosglass.qml.engine.session import Session
    from rosglass.rviz.stack import Stack
    from rosglass.rviz.window import Window

__all__ = [
    "Entries",
    "Entry",
    "OverlayMenu",
    "camera_icon",
    "display_class",
    "overlay_icon",
    "set_status",
]


@cache
def overlay_icon() -> Any:
    """Return the icon of overlays: a pane over a view."""
    rect = pyqt().QRectF
    return _icon(lambda painter: painter.drawRoundedRect(rect(2, 2, 24, 20), 3, 3), 9, 11, 21, 19)


@cache
def camera_icon() -> Any:
    """Return the icon of the view controller: a camera."""
    lens = [pyqt().QPointF(x, y) for x, y in ((17, 16), (29, 8), (29, 24))]
    return _icon(lambda painter: painter.drawPolygon(*lens), 2, 8, 19, 16)


def _icon(draw_grey: Callable[[Any], None], *blue: float) -> Any:
    """Return an icon: a grey shape behind a blue pane.

    Args:
        draw_grey: Draws the shape, within 32x32 pixels.
        blue: Left, top, width and height of the pane.
    """
    core, gui = pyqt(), pyqt("QtGui")
    picture = gui.QPixmap(32, 32)
    picture.fill(core.Qt.transparent)
    painter = gui.QPainter(picture)
    painter.setRenderHint(gui.QPainter.Antialiasing)
    painter.setPen(gui.QPen(gui.QColor("#404850"), 2))
    painter.setBrush(gui.QColor("#a8b4c0"))
    draw_grey(painter)
    painter.setBrush(gui.QColor(33, 150, 243, 200))
    painter.drawRoundedRect(core.QRectF(*blue), 3, 3)
    painter.end()
    return gui.QIcon(picture)


_OK, _WARN, _ERROR = 0, 1, 2
_QML = (QML_CLASS, REFERENCE_QML_CLASS)
_CONFIGURATION, _CONFIG = "Configuration", "Overlay Configuration"
#: Names of an entry's properties -> attributes of its overlay.
_ATTRIBUTES = {
    "Z-Index": "z",
    "Scale": "scale",
    "Opacity": "opacity",
    "Live Reload": "watch",
    "Style Sheet": "style_sheet",
}


@cache
def _classes() -> tuple[Any, Any]:
    """Return our subclasses of RViz's display, and of the property that holds registered ones."""
    bindings, core = rviz(), pyqt()

    class PropertyGroup(bindings.Property):  # type: ignore[name-defined,misc]
        def load(self, config: Any) -> None:
            """Do nothing: the entry loads it."""

        def save(self, config: Any) -> None:
            """Do nothing: the entry saves it."""

    # Python cannot derive from a plain Display.
    class Display(bindings.DisplayGroup):  # type: ignore[name-defined,misc]
        entry: Any = None

        @log_errors()
        def save(self, config: Any) -> None:
            bindings.Display.save(self, config)
            if self.entry is not None:
                self.entry.save(config)

        @log_errors()
        def load(self, config: Any) -> None:
            bindings.Display.load(self, config)
            if self.entry is not None:
                self.entry.load(config)

        @log_errors(core.Qt.ItemFlags())
        def getViewFlags(self, column: int) -> Any:
            # Unlike other groups, it accepts no dropped displays.
            return bindings.DisplayGroup.getViewFlags(self, column) & ~core.Qt.ItemIsDropEnabled

    return Display, PropertyGroup


def display_class() -> Any:
    """Return our subclass of RViz's display, whose `entry` saves and loads it."""
    return _classes()[0]


def set_status(display: Any, row: str, level: int, text: str) -> None:
    """Set a row of a display's status; the level is 0 for ok, 1 for a warning, 2 for an error."""
    core = pyqt()
    core.QMetaObject.invokeMethod(
        display,
        "setStatusInternal",
        core.Qt.DirectConnection,
        core.Q_ARG(int, level),
        core.Q_ARG("QString", row),
        core.Q_ARG("QString", text),
    )


class Entry(QtCore.QObject):
    """An overlay's entry in the Displays panel; it may exist before its overlay.

    Args:
        class_id: The overlay's class id.
        session: The session of QML overlays.
        choices: Suggestions of the property editors.
        import_paths: Additional folders with QML modules.
    """

    def __init__(
        self,
        class_id: str,
        session: Session,
        choices: Choices,
        import_paths: Sequence[Path] = (),
    ) -> None:
        super().__init__()
        self.class_id, self._session, self._choices = class_id, session, choices
        self._import_paths = import_paths
        #: Called when the entry was switched on or off (also by its group), when its Path has
        #: changed, and when RViz has deleted it. Not a signal, because PySide2 would try to
        #: disconnect deleted entries.
        self.on_changed: Callable[[], object] = _nothing
        #: Called with the entry when it was renamed.
        self.on_renamed: Callable[[Entry], object] = _nothing
        #: Called when data that belongs into the config file has changed unknown to RViz.
        self.on_edited: Callable[[], object] = _nothing
        self.overlay: Overlay | None = None
        self._failed, self._loaded_file = "", ""
        self._registered: dict[str, Any] = {}
        self._config: dict[str, Any] = {}
        self._tree: PropertyTree | None = None
        display, _ = _classes()
        #: RViz's display.
        self.display: Any = owned_by_rviz(display())
        self.display.entry = self
        self.display.setClassId(class_id)
        self.display.setIcon(overlay_icon())
        self.display.setDescription(
            "Drawn over the 3D view by rosglass. "
            + ("A QML file." if self.is_qml else f"Of the class {class_id}.")
        )
        self.own = RegisteredProperties(self)
        self._register_properties()
        self._own_tree = PropertyTree(self.own, self.display, choices)
        self._group: Any = None
        on_renamed = log_errors()(lambda _name: self.on_renamed(self))
        shown = [
            (self.display.changed, log_errors()(lambda *_: self.on_changed())),
            (self.display.objectNameChanged, on_renamed),
            (self.display.destroyed, log_errors()(lambda *_: self.on_changed())),
        ]
        for signal, slot in shown:
            signal.connect(slot)
        #: Connections of the display and of its own properties; kept here because Qt's
        #: connections hold no reference to their Python slots.
        self._connections: tuple[list[Any], list[Any]] = (shown, [])
        for name in self.own.properties:
            self._connect_own(name)

    @property
    def is_qml(self) -> bool:
        """True if the overlay is a QML file."""
        return self.class_id in _QML

    @property
    def alive(self) -> bool:
        """True until RViz deletes the display."""
        return not pyqt("sip").isdeleted(self.display)

    @property
    def file(self) -> str:
        """The QML file, as given in Path."""
        return str(self.own.properties["Path"].get()) if self.is_qml else ""

    def _register_properties(self) -> None:
        own = self.own
        if self.is_qml:
            about = "The QML file; package://name/path for one in a ROS package."
            own.register(
                "path", "Path", description=about, filter="QML files (*.qml);;All files (*)"
            )
        about = "Overlays with higher numbers are on top."
        own.register("int", "Z-Index", description=about)
        low, high = SCALE_LIMITS
        about = "Pixels of the 3D view per unit of the overlay."
        own.register("float", "Scale", default=1.0, min=low, max=high, description=about)
        about = "From 0 (invisible) to 1."
        own.register("float", "Opacity", default=1.0, min=0.0, max=1.0, description=about)
        if self.is_qml:
            about = "Reload when the file, or one that it uses, is saved."
            own.register("bool", "Live Reload", description=about)

    def _connect_own(self, name: str) -> None:
        changed = self.own.properties[name].valueChanged

        def slot(value: Any) -> None:
            self._apply(name, value)

        changed.connect(slot)
        self._connections[1].append((changed, slot))

    # Overlay.

    def make_overlay(self) -> None:
        """Create the overlay; an error becomes the entry's status."""
        if self.overlay is not None or self._failed or not self.alive:
            return
        name = str(self.display.getName())
        try:
            if self.is_qml and not self.file:
                self.status("Qml", _WARN, "Choose a QML file as Path")
                return
            make = factory_of(self.class_id)
            if self.is_qml:
                paths = self._import_paths
                self.attach(QmlOverlay(self.file, self._session, name, import_paths=paths))
            elif make is None:
                advice = f"its class {self.class_id} is unknown; call rosglass.rviz.register()"
                self._failed = f"the program has not added an overlay {name!r}, and {advice}"
                self.status(self._status_row, _WARN, self._failed)
            else:
                self.attach(make(name))
        except Exception as error:  # of the program's function that creates the overlay
            self._failed = str(error) or repr(error)
            self.status(self._status_row, _ERROR, self._failed)

    @property
    def is_waiting(self) -> bool:
        """True while it has no overlay because of an error or a missing Path."""
        return self.overlay is None and (bool(self._failed) or (self.is_qml and not self.file))

    @property
    def is_outdated(self) -> bool:
        """True while its overlay shows a file other than Path."""
        return self.overlay is not None and self.file != self._loaded_file

    def shows(self, file: Path) -> bool:
        """Return whether Path refers to the given file."""
        try:
            return self.is_qml and locate(self.file) == locate(file)
        except QmlError:
            return False

    def retry(self) -> None:
        """Try again to create the overlay."""
        self._failed = ""
        self.on_changed()

    def attach(self, overlay: Overlay) -> None:
        """Connect an overlay to this entry, and restore its saved values.

        Args:
            overlay: An overlay without an entry; a QML overlay that is not loaded is loaded.
        """
        self.overlay, self._loaded_file = overlay, self.file
        if hasattr(overlay, "style_sheet") and "Style Sheet" not in self.own.properties:
            about = "A .qss file, its package:// URL, or a literal style sheet."
            self.own.register(
                "string", "Style Sheet", default=overlay.style_sheet, description=about
            )
            self._connect_own("Style Sheet")
        properties = overlay.properties
        if self._registered:
            properties.load(self._registered)
        if self._config:
            properties.set_config(self._config)
        for name, attribute in _ATTRIBUTES.items():
            if name in self.own.properties and hasattr(overlay, attribute):
                self._apply(name, self.own.properties[name].get())
        overlay.arranged.connect(self._follow)
        overlay.problem_changed.connect(self._show_problem)
        properties.registered.connect(self._show_registered)
        properties.configChanged.connect(self._on_config)
        self._show_registered()
        self._show_problem(overlay.problem)
        # A problem means that loading has failed already.
        if isinstance(overlay, QmlOverlay) and not overlay.loaded and not overlay.problem:
            try:
                overlay.load()
            except Error as error:
                overlay.show_problem(str(error))

    def detach(self) -> Overlay | None:
        """Disconnect and return the overlay, and keep the values it would save."""
        overlay, self.overlay = self.overlay, None
        if overlay is None:
            return None
        properties = overlay.properties
        self._registered, self._config = properties.save(), properties.get_config()
        if is_alive(overlay):
            overlay.arranged.disconnect(self._follow)
            overlay.problem_changed.disconnect(self._show_problem)
        # The properties of QML overlays are deleted with their engine.
        if is_alive(properties):
            properties.registered.disconnect(self._show_registered)
            properties.configChanged.disconnect(self._on_config)
        tree, self._tree = self._tree, None
        if tree is not None:
            tree.close()
            remove_from_tree(self._group)
        return overlay

    def close(self) -> None:
        """Disconnect from the display, which the caller removes; call it after :meth:`detach`."""
        self._own_tree.close()
        shown, own = self._connections
        # The signals of a deleted display are gone.
        for signal, slot in (*own, *(shown if self.alive else ())):
            # RViz disconnects a display from everything before removing it.
            with suppress(TypeError):
                signal.disconnect(slot)
        self._connections = ([], [])
        self.on_changed = self.on_renamed = self.on_edited = _nothing
        if self.alive:
            self.display.entry = None

    def copy_from(self, overlay: Overlay) -> None:
        """Copy the values of an overlay that the program created; call before :meth:`attach`."""
        if isinstance(overlay, QmlOverlay):
            self.own.properties["Path"].set(str(overlay.file))
        for name, attribute in _ATTRIBUTES.items():
            if name in self.own.properties and hasattr(overlay, attribute):
                self.own.properties[name].set(getattr(overlay, attribute))

    def _on_config(self) -> None:
        self.on_edited()

    def _apply(self, name: str, value: Any) -> None:
        overlay = self.overlay
        if name == "Path":
            self._failed = ""
            self.on_changed()
        elif overlay is not None:
            attribute = _ATTRIBUTES[name]
            if getattr(overlay, attribute, None) != value:
                setattr(overlay, attribute, value)

    def _follow(self) -> None:
        overlay = self.overlay
        if overlay is None or not self.alive:
            return
        for name in ("Z-Index", "Scale", "Opacity"):
            self.own.properties[name].set(getattr(overlay, _ATTRIBUTES[name]))
        if overlay.visible != self.display.isEnabled():
            self.display.setEnabled(overlay.visible)

    def _show_registered(self, _found: object = None) -> None:
        """Add the overlay's registered properties to the panel, once there are any."""
        overlay = self.overlay
        if overlay is not None and overlay.properties.properties and self._tree is None:
            _, held = _classes()
            about = "Settings that the overlay provides."
            self._group = owned_by_rviz(held(_CONFIGURATION, None, about, self.display))
            self._tree = PropertyTree(overlay.properties, self._group, self._choices)

    # Status.

    @property
    def _status_row(self) -> str:
        return "Qml" if self.is_qml else "Overlay"

    def status(self, row: str, level: int, text: str) -> None:
        """Set a row of the entry's status."""
        if self.alive:
            set_status(self.display, row, level, text)

    def _show_problem(self, problem: str) -> None:
        self.status("Overlay", _OK, "OK")
        if problem or self.is_qml:
            self.status(self._status_row, _ERROR if problem else _OK, problem or "OK")

    # Files.

    def save(self, config: Any) -> None:
        """Save the entry to RViz's ``Config``."""
        for name, value in self.own.save().items():
            config.mapSetValue(name, value)
        overlay = self.overlay
        registered = overlay.properties.save() if overlay is not None else self._registered
        free = overlay.properties.get_config() if overlay is not None else self._config
        to_config(config.mapMakeChild(_CONFIGURATION), registered, plain=True)
        to_config(config.mapMakeChild(_CONFIG), free)

    def load(self, config: Any) -> None:
        """Restore the entry from RViz's ``Config``."""
        found = plain_config(config)
        own = {name: found[name] for name in self.own.properties if name in found}
        if "Style Sheet" in found:
            own["Style Sheet"] = found["Style Sheet"]
        registered = found.get(_CONFIGURATION)
        free = from_config(config.mapGetChild(_CONFIG))
        self._registered = registered if isinstance(registered, dict) else {}
        self._config = free if isinstance(free, dict) else {}
        self.own.load(own)
        if self.overlay is not None:
            self.overlay.properties.load(self._registered)
            self.overlay.properties.set_config(self._config)
        self.on_changed()


def _nothing(*_: Any) -> None:
    """Do nothing: the default callback."""


class Entries(QtCore.QObject):
    """Keeps the panel's entries and the overlays in sync: one entry per overlay, and vice versa.

    RViz creates a placeholder for each display of a config file whose class it cannot load, and
    keeps the display's config in it. Entries replace the placeholders of overlays.
    """

    #: The panel was searched for placeholders, and those found were replaced.
    replaced = Signal()

    def __init__(
        self,
        window: Window,
        stack: Stack,
        session: Session,
        frames: Frames,
        import_paths: Sequence[Path] = (),
    ) -> None:
        super().__init__()
        self._window, self._stack, self._session = window, stack, session
        self._import_paths = import_paths
        #: Suggestions of the property editors.
        self.choices = Choices(
            session, frames, lambda text: window.widget.statusBar().showMessage(text)
        )
        self._entries: list[Entry] = []
        #: Overlays added by the program: they stay when another config file is loaded.
        self._program_overlays: list[Overlay] = []
        #: The overlays in the panel's order at the last synchronization.
        self.panel_order: list[Overlay] = []
        self._has_new = False
        self._other_classes: dict[str, Callable[[], Any]] = {}
        self._loading = False
        self._scheduled = self._synchronizing = self._closed = False
        self._watched: set[int] = set()
        # RViz processes other events in the middle of duplicating displays.
        self._after_event = AfterEvent(self._replace_placeholders)
        stack.changed.connect(self._schedule)
        window.before_frame.connect(self._check_displays)
        window.config_loading.connect(self._on_config_loading)
        self._replace_placeholders()

    def __iter__(self) -> Iterator[Entry]:
        """Iterate over the entries in the order of their creation."""
        return iter(list(self._entries))

    def of(self, overlay: Overlay) -> Entry | None:
        """Return the entry of an overlay."""
        return next((entry for entry in self._entries if entry.overlay is overlay), None)

    def add_qml(self, file: str, name: str = "") -> Entry:
        """Add an entry for a QML file to the panel; the entry shows the file's errors."""
        entry = self._make(QML_CLASS)
        entry.own.properties["Path"].set(file)
        entry.display.setName(name or QtCore.QFileInfo(file).completeBaseName())
        self._window.manager.addDisplay(entry.display, True)
        self._on_scheduled()
        return entry

    def register_class(self, class_id: str, make: Callable[[], Any]) -> None:
        """Register another class of displays whose placeholders are replaced.

        Args:
            class_id: The displays' class id.
            make: Returns an object whose attribute `display` has the object as its `entry`.
        """
        self._other_classes[class_id] = make
        self._replace_placeholders()

    def remove(self, entry: Entry) -> None:
        """Remove an entry and its overlay."""
        self._remove_entry(entry)
        remove_from_tree(entry.display)

    def close(self) -> None:
        """Remove all entries; safe to call twice."""
        if self._closed:
            return
        self._closed = True
        for entry in list(self._entries):
            self.remove(entry)

    # Synchronization.

    @Slot()
    def _schedule(self, *_: Any) -> None:
        if not self._scheduled and not self._closed:
            self._scheduled = True
            QtCore.QTimer.singleShot(0, self._on_scheduled)

    @Slot()
    def _on_scheduled(self) -> None:
        self._scheduled = False
        if self._closed or self._synchronizing or self._loading:
            return
        self._synchronizing = True
        try:
            log_errors()(self._synchronize)()
        finally:
            self._synchronizing = False

    def _synchronize(self) -> None:
        self._watch_panel()
        shown = list(self._stack)
        for entry in list(self._entries):
            overlay = entry.overlay
            if not entry.alive:
                self._remove_entry(entry)
            elif overlay is not None and overlay not in shown:
                self.remove(entry)
            elif entry.is_outdated:
                self._remove_overlay(entry.detach())
        known = {id(entry.overlay) for entry in self._entries}
        for overlay in list(self._stack):
            if id(overlay) not in known and not overlay.is_popup:
                self._add_entry(overlay)
        for entry in list(self._entries):
            self._apply_enabled(entry)
        self._apply_panel_order()

    def _apply_panel_order(self) -> None:
        """Stack overlays in the order of the panel, after the user has moved any."""
        order = [
            display.entry.overlay
            for display in self._displays()
            if isinstance(getattr(display, "entry", None), Entry) and display.entry.overlay
        ]
        before, self.panel_order = self.panel_order, order
        moved = [o for o in before if o in order] != [o for o in order if o in before]
        if moved or self._has_new:
            self._stack.reorder(order)
        if moved and not self._has_new:
            # RViz itself does not mark its config as modified.
            self._window.manager.notifyConfigChanged()
        self._has_new = False

    def _add_entry(self, overlay: Overlay) -> None:
        """Connect an overlay of the program to an entry that waits for it, or to a new one."""
        if overlay not in self._program_overlays:
            self._program_overlays.append(overlay)
            # The config may have a placeholder of its class, if that was not registered before.
            self._replace_all()
        class_id = QML_CLASS if isinstance(overlay, QmlOverlay) else class_id_of(type(overlay))
        for entry in self._entries:
            if entry.overlay is None and self._waits_for(entry, overlay, class_id):
                self._keep_unmodified(partial(entry.attach, overlay))
                return
        entry = self._make(class_id)
        entry.display.setName(overlay.name)
        entry.copy_from(overlay)
        self._window.manager.addDisplay(entry.display, overlay.visible)
        entry.attach(overlay)

    @staticmethod
    def _waits_for(entry: Entry, overlay: Overlay, class_id: str) -> bool:
        if str(entry.display.getName()) != overlay.name:
            return False
        if isinstance(overlay, QmlOverlay):
            return entry.is_qml and entry.shows(overlay.file)
        return entry.class_id == class_id

    def _apply_enabled(self, entry: Entry) -> None:
        """Show or hide the overlay of an entry; create it on first use."""
        enabled = bool(entry.display.isEnabled())
        if entry.overlay is None and enabled:
            self._keep_unmodified(entry.make_overlay)
        overlay = entry.overlay
        if overlay is None:
            return
        if overlay not in list(self._stack):
            self._rename(entry)
            self._stack.add(overlay)
            self._has_new = True
        overlay.visible = enabled

    def _rename(self, entry: Entry) -> None:
        overlay = entry.overlay
        if overlay is not None and entry.alive:
            wanted = str(entry.display.getName()) or type(overlay).__name__
            overlay.name = self._stack.free_name(wanted, overlay)

    def _make(self, class_id: str) -> Entry:
        entry = Entry(class_id, self._session, self.choices, self._import_paths)
        self._entries.append(entry)
        entry.on_changed, entry.on_renamed = self._schedule, self._rename
        entry.on_edited = log_errors()(self._window.manager.notifyConfigChanged)
        return entry

    def _remove_entry(self, entry: Entry) -> None:
        if entry in self._entries:
            self._entries.remove(entry)
            overlay = entry.detach()
            entry.close()
            self._remove_overlay(overlay)

    def _remove_overlay(self, overlay: Overlay | None) -> None:
        if overlay is not None:
            if overlay in self._program_overlays:
                self._program_overlays.remove(overlay)
            overlay.visible = False
            self._stack.remove(overlay)

    def _check_displays(self) -> None:
        """Detect changes for which RViz has no signal, e.g. of a group's check box."""
        for entry in self._entries if not self._closed else ():
            overlay = entry.overlay
            enabled = entry.alive and bool(entry.display.isEnabled())
            if enabled != (overlay is not None and overlay.visible) and not (
                enabled and entry.is_waiting
            ):
                self._schedule()
                return

    # Config files.

    @Slot()
    def _on_config_loading(self) -> None:
        """Detach the program's overlays from the displays that RViz is about to delete."""
        self._loading = self._has_new = True
        self._after_event.schedule()
        for entry in list(self._entries):
            if entry.overlay in self._program_overlays:
                self._entries.remove(entry)
                entry.detach()
                entry.close()

    # Placeholders.

    def _watch_panel(self) -> None:
        """Connect to the panel's tree model, which loading a config may have replaced."""
        for view in self._window.frame.findChildren(pyqt("QtWidgets").QTreeView):
            model = view.model()
            if model is None or model.metaObject().className() != "rviz::PropertyTreeModel":
                continue
            address = int(pyqt("sip").unwrapinstance(model))
            if address not in self._watched:
                self._watched.add(address)
                model.rowsInserted.connect(log_errors()(lambda *_: self._after_event.schedule()))

    def _replace_placeholders(self) -> None:
        if not self._closed:
            log_errors()(self._replace_all)()
            self.replaced.emit()
            self._loading = False
            self._schedule()

    def _replace_all(self) -> None:
        for display in list(self._displays()):
            if getattr(display, "entry", None) is None and self._is_replaceable(display):
                self._keep_unmodified(partial(self._replace, display))

    def _displays(self, group: Any = None) -> Iterator[Any]:
        """Iterate over the displays in the panel's order, including those in groups."""
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
        guest = self._other_classes.get(class_id)
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

    def _keep_unmodified(self, do: Callable[[], None]) -> None:
        """Call a function without marking RViz as modified."""
        modified = self._window.modified
        do()
        if not modified:
            self._window.widget.setWindowModified(False)

    def _is_replaceable(self, display: Any) -> bool:
        class_id = str(display.getClassId())
        programs = (
            class_id_of(type(o)) for o in self._program_overlays if not isinstance(o, QmlOverlay)
        )
        ours = {QML_CLASS, REFERENCE_QML_CLASS, *self._other_classes, *programs}
        return class_id in ours or factory_of(class_id) is not None


_FILTER = "QML files (*.qml);;All files (*)"


class OverlayMenu(QtCore.QObject):
    """The Overlays menu; opening it fills its lists."""

    def __init__(self, window: Window, entries: Entries) -> None:
        super().__init__()
        self._window, self._entries = window, entries
        self._dialog: Any = None
        menu = window.menu("&Overlays")
        self._add = menu.addAction("&Add QML overlay...")
        self._choose = log_errors()(lambda *_: self._open())
        self._add.triggered.connect(self._choose)
        self._lists = [
            self._list(menu, "&Reload", self._reload, lambda entry: entry.is_qml),
            self._list(menu, "Re&move", entries.remove, lambda _entry: True),
        ]

    def _list(
        self, menu: Any, title: str, act: Callable[[Entry], None], fits: Callable[[Entry], bool]
    ) -> Any:
        part = QtWidgets.QMenu(title, menu)
        menu.addMenu(part)

        def fill() -> None:
            part.clear()
            for entry in self._entries:
                if entry.alive and fits(entry):
                    # A single ampersand marks the shortcut key.
                    name = str(entry.display.getName()).replace("&", "&&")
                    chosen = part.addAction(name)
                    chosen.triggered.connect(log_errors()(lambda *_, entry=entry: act(entry)))
            part.setEnabled(bool(part.actions()))

        filled = log_errors()(fill)
        menu.aboutToShow.connect(filled)
        return part, filled

    def _open(self) -> None:
        dialog = QtWidgets.QFileDialog(self._window.widget, "Add QML overlay", "", _FILTER)
        dialog.setFileMode(QtWidgets.QFileDialog.ExistingFile)
        dialog.setAttribute(QtCore.Qt.WidgetAttribute.WA_DeleteOnClose)
        dialog.fileSelected.connect(log_errors()(self._entries.add_qml))
        self._dialog = dialog
        dialog.open()

    @staticmethod
    def _reload(entry: Entry) -> None:
        overlay = entry.overlay
        if isinstance(overlay, QmlOverlay):
            overlay.reload()
        else:
            entry.retry()
