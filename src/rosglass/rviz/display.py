"""An overlay as an entry of RViz's Displays panel: check box, properties, status, saved state."""
# ruff: noqa: N802 - the names of what C++ calls are RViz's

from __future__ import annotations

from contextlib import suppress
from functools import cache
from typing import TYPE_CHECKING, Any

from rosglass.errors import Error, QmlError
from rosglass.qml.places import locate
from rosglass.qt import QtCore, is_alive
from rosglass.rviz.display_classes import QML_CLASS, REFERENCE_QML_CLASS, maker_of
from rosglass.rviz.host import pyqt, rviz
from rosglass.rviz.icons import overlay_icon
from rosglass.rviz.overlay import SCALES
from rosglass.rviz.properties import PropertyTree, given_to_rviz, quiet, take_out
from rosglass.rviz.qml_overlay import QmlOverlay
from rosglass.rviz.registered_properties import RegisteredProperties
from rosglass.rviz.saved_values import from_config, plain_config, to_config

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from rosglass.qml.session import Session
    from rosglass.rviz.overlay import Overlay
    from rosglass.rviz.property_sources import Sources

__all__ = ["Entry", "display_class", "tell_status"]

_OK, _WARN, _ERROR = 0, 1, 2
_QML = (QML_CLASS, REFERENCE_QML_CLASS)
_CONFIGURATION, _CONFIG = "Configuration", "Overlay Configuration"
#: Properties of an entry -> attributes of its overlay.
_ATTRIBUTES = {
    "Z-Index": "z",
    "Scale": "scale",
    "Opacity": "opacity",
    "Live Reload": "watch",
    "Style Sheet": "style_sheet",
}


@cache
def _classes() -> tuple[Any, Any]:
    """Return our kind of RViz's display, and of the property that holds the registered ones."""
    bindings, core = rviz(), pyqt()

    class Held(bindings.Property):  # type: ignore[name-defined,misc]
        def load(self, config: Any) -> None:
            """The entry knows the types of what is in it."""

        def save(self, config: Any) -> None:
            """The entry writes it."""

    # A plain display cannot be derived from in Python.
    class Display(bindings.DisplayGroup):  # type: ignore[name-defined,misc]
        entry: Any = None

        @quiet()
        def save(self, config: Any) -> None:
            bindings.Display.save(self, config)
            if self.entry is not None:
                self.entry.save(config)

        @quiet()
        def load(self, config: Any) -> None:
            bindings.Display.load(self, config)
            if self.entry is not None:
                self.entry.load(config)

        @quiet(core.Qt.ItemFlags())
        def getViewFlags(self, column: int) -> Any:
            # Nothing can be dropped into it.
            return bindings.DisplayGroup.getViewFlags(self, column) & ~core.Qt.ItemIsDropEnabled

    return Display, Held


def display_class() -> Any:
    """Return our kind of RViz's display; its `entry` is told to save and load."""
    return _classes()[0]


def tell_status(display: Any, row: str, level: int, text: str) -> None:
    """Show a line below a display's status: 0 for what is fine, 1 for a warning, 2 for an error."""
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
    """One entry, with its overlay as soon as there is one.

    Args:
        class_id: RViz's name for what it is.
        session: The node that QML talks through.
        sources: What choosers of properties offer.
        import_paths: Further folders with QML modules.
    """

    def __init__(
        self,
        class_id: str,
        session: Session,
        sources: Sources,
        import_paths: Sequence[Path] = (),
    ) -> None:
        super().__init__()
        self.class_id, self._session, self._sources = class_id, session, sources
        self._import_paths = import_paths
        #: Called when its check box, or that of a group it is in, was clicked, when it is to show
        #: something else, and when RViz has deleted it. No signal: PySide2 takes entries that have
        #: gone for ones that it can still tell to disconnect.
        self.touched: Callable[[], object] = _nothing
        #: Called when it has another name; with itself.
        self.renamed: Callable[[Entry], object] = _nothing
        #: Called when something that RViz does not see, and its file would keep, is another now.
        self.edited: Callable[[], object] = _nothing
        self.overlay: Overlay | None = None
        self._failed, self._taken_file = "", ""
        self._registered: dict[str, Any] = {}
        self._config: dict[str, Any] = {}
        self._tree: PropertyTree | None = None
        display, _ = _classes()
        #: RViz's display.
        self.display: Any = given_to_rviz(display())
        self.display.entry = self
        self.display.setClassId(class_id)
        self.display.setIcon(overlay_icon())
        self.display.setDescription(
            "Drawn over the 3D view by rosglass. "
            + ("A QML file." if self.is_qml else f"Of the class {class_id}.")
        )
        self.own = RegisteredProperties(self)
        self._fill()
        self._own_tree = PropertyTree(self.own, self.display, sources)
        self._holder: Any = None
        renamed = quiet()(lambda _name: self.renamed(self))
        shown = [
            (self.display.changed, quiet()(lambda *_: self.touched())),
            (self.display.objectNameChanged, renamed),
            (self.display.destroyed, quiet()(lambda *_: self.touched())),
        ]
        for signal, slot in shown:
            signal.connect(slot)
        #: Of the display, and of its own properties; Python does not see what connections hold.
        self._watches: tuple[list[Any], list[Any]] = (shown, [])
        for name in self.own.properties:
            self._watch_own(name)

    @property
    def is_qml(self) -> bool:
        """Whether it shows a QML file."""
        return self.class_id in _QML

    @property
    def alive(self) -> bool:
        """Whether RViz still has it."""
        return not pyqt("sip").isdeleted(self.display)

    @property
    def file(self) -> str:
        """The QML file, as it was given."""
        return str(self.own.properties["Path"].get()) if self.is_qml else ""

    def _fill(self) -> None:
        own = self.own
        if self.is_qml:
            about = "The QML file; package://name/path for one in a ROS package."
            own.register(
                "path", "Path", description=about, filter="QML files (*.qml);;All files (*)"
            )
        about = "Overlays of higher numbers are above those of lower."
        own.register("int", "Z-Index", description=about)
        low, high = SCALES
        about = "Pixels of the 3D view for one unit of the overlay."
        own.register("float", "Scale", default=1.0, min=low, max=high, description=about)
        about = "From 0, where nothing is seen, to 1."
        own.register("float", "Opacity", default=1.0, min=0.0, max=1.0, description=about)
        if self.is_qml:
            about = "Show the file anew when it, or one that it uses, is saved."
            own.register("bool", "Live Reload", description=about)

    def _watch_own(self, name: str) -> None:
        changed = self.own.properties[name].valueChanged

        def slot(value: Any) -> None:
            self._apply(name, value)

        changed.connect(slot)
        self._watches[1].append((changed, slot))

    # The overlay.

    def ensure(self) -> None:
        """Make the overlay that the entry stands for; what prevents it is told as its status."""
        if self.overlay is not None or self._failed or not self.alive:
            return
        name = str(self.display.getName())
        try:
            if self.is_qml and not self.file:
                self.status("Qml", _WARN, "Choose a QML file as Path")
                return
            make = maker_of(self.class_id)
            if self.is_qml:
                paths = self._import_paths
                self.take(QmlOverlay(self.file, self._session, name, import_paths=paths))
            elif make is None:
                advice = f"its class {self.class_id} is unknown; rosglass.rviz.register() it"
                self._failed = f"the program has shown no overlay {name!r} yet, and {advice}"
                self.status(self._row, _WARN, self._failed)
            else:
                self.take(make(name))
        except Exception as error:
            self._failed = str(error) or repr(error)
            self.status(self._row, _ERROR, self._failed)

    @property
    def waiting(self) -> bool:
        """Whether there can be no overlay as it is."""
        return self.overlay is None and (bool(self._failed) or (self.is_qml and not self.file))

    @property
    def outdated(self) -> bool:
        """Whether its overlay shows another file than it is to show."""
        return self.overlay is not None and self.file != self._taken_file

    def shows(self, file: Path) -> bool:
        """Whether a file is what it is to show."""
        try:
            return self.is_qml and locate(self.file) == locate(file)
        except QmlError:
            return False

    def retry(self) -> None:
        """Forget why there was no overlay."""
        self._failed = ""
        self.touched()

    def take(self, overlay: Overlay) -> None:
        """Show an overlay as this entry, with what was saved for it.

        Args:
            overlay: As yet without an entry; one of QML may be loaded already or not.
        """
        self.overlay, self._taken_file = overlay, self.file
        if hasattr(overlay, "style_sheet") and "Style Sheet" not in self.own.properties:
            about = "A .qss file, a package:// URL of one, or a style sheet itself."
            self.own.register(
                "string", "Style Sheet", default=overlay.style_sheet, description=about
            )
            self._watch_own("Style Sheet")
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
        # One whose file has errors has told them.
        if isinstance(overlay, QmlOverlay) and not overlay.loaded and not overlay.problem:
            try:
                overlay.load()
            except Error as error:
                overlay.tell_problem(str(error))

    def drop(self) -> Overlay | None:
        """Return the overlay, which is no longer this entry's, and keep what it had saved."""
        overlay, self.overlay = self.overlay, None
        if overlay is None:
            return None
        properties = overlay.properties
        self._registered, self._config = properties.save(), properties.get_config()
        if is_alive(overlay):
            overlay.arranged.disconnect(self._follow)
            overlay.problem_changed.disconnect(self._show_problem)
        # Those of QML end with their engine.
        if is_alive(properties):
            properties.registered.disconnect(self._show_registered)
            properties.configChanged.disconnect(self._on_config)
        tree, self._tree = self._tree, None
        if tree is not None:
            tree.close()
            take_out(self._holder)
        return overlay

    def close(self) -> None:
        """Let go of RViz's display, which is for others to take away; once, after :meth:`drop`."""
        self._own_tree.close()
        shown, own = self._watches
        # Those of a display that is gone have ended with it.
        for signal, slot in (*own, *(shown if self.alive else ())):
            # RViz disconnects a display from everything before it removes it.
            with suppress(TypeError):
                signal.disconnect(slot)
        self._watches = ([], [])
        self.touched = self.renamed = self.edited = _nothing
        if self.alive:
            self.display.entry = None

    def reflect(self, overlay: Overlay) -> None:
        """Take the numbers of an overlay that a program has made, before :meth:`take`."""
        if isinstance(overlay, QmlOverlay):
            self.own.properties["Path"].set(str(overlay.file))
        for name, attribute in _ATTRIBUTES.items():
            if name in self.own.properties and hasattr(overlay, attribute):
                self.own.properties[name].set(getattr(overlay, attribute))

    def _on_config(self) -> None:
        self.edited()

    def _apply(self, name: str, value: Any) -> None:
        overlay = self.overlay
        if name == "Path":
            self._failed = ""
            self.touched()
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
        """Show what the overlay has registered, as soon as that is anything."""
        overlay = self.overlay
        if overlay is not None and overlay.properties.properties and self._tree is None:
            _, held = _classes()
            about = "What the overlay itself has declared to be set by you."
            self._holder = given_to_rviz(held(_CONFIGURATION, None, about, self.display))
            self._tree = PropertyTree(overlay.properties, self._holder, self._sources)

    # Status.

    @property
    def _row(self) -> str:
        return "Qml" if self.is_qml else "Overlay"

    def status(self, row: str, level: int, text: str) -> None:
        """Show a line below the entry's status."""
        if self.alive:
            tell_status(self.display, row, level, text)

    def _show_problem(self, problem: str) -> None:
        self.status("Overlay", _OK, "OK")
        if problem or self.is_qml:
            self.status(self._row, _ERROR if problem else _OK, problem or "OK")

    # Files.

    def save(self, config: Any) -> None:
        """Write what a ``.rviz`` file keeps of it to RViz's ``Config``."""
        for name, value in self.own.save().items():
            config.mapSetValue(name, value)
        overlay = self.overlay
        registered = overlay.properties.save() if overlay is not None else self._registered
        free = overlay.properties.get_config() if overlay is not None else self._config
        to_config(config.mapMakeChild(_CONFIGURATION), registered, plain=True)
        to_config(config.mapMakeChild(_CONFIG), free)

    def load(self, config: Any) -> None:
        """Take what a ``.rviz`` file has."""
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
        self.touched()


def _nothing(*_: Any) -> None:
    """Be told what nobody follows."""
