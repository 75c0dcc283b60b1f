"""The view controller as an entry of RViz's Displays panel, which shows and keeps its settings."""
# ruff: noqa: N802 - the names of what C++ calls are RViz's

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any

from rosglass.errors import Error
from rosglass.qt import QtCore, Slot
from rosglass.rviz.display import display_class, tell_status
from rosglass.rviz.host import pyqt
from rosglass.rviz.icons import camera_icon
from rosglass.rviz.properties import PropertyTree, given_to_rviz, quiet, take_out
from rosglass.rviz.registered_properties import RegisteredProperties
from rosglass.rviz.saved_values import plain_config
from rosglass.rviz.view import ViewMode

if TYPE_CHECKING:
    from rosglass.rviz.entries import Entries
    from rosglass.rviz.view import View
    from rosglass.rviz.view_services import ViewServices
    from rosglass.rviz.window import Window

__all__ = ["VIEW_CLASS", "ViewEntry"]

#: Class id in ``.rviz`` files.
VIEW_CLASS = "rosglass/ViewController"
_NAME = "View Controller"
_OK, _WARN = 0, 1


@cache
def _class() -> Any:
    """Return our kind of RViz's display: one that cannot be switched off."""
    base, core = display_class(), pyqt()

    class Display(base):  # type: ignore[misc,valid-type]
        @quiet()
        def getViewData(self, column: int, role: int) -> Any:
            if column == 1 and role == core.Qt.CheckStateRole:
                return None
            return base.getViewData(self, column, role)

        @quiet(core.Qt.ItemFlags())
        def getViewFlags(self, column: int) -> Any:
            return base.getViewFlags(self, column) & ~core.Qt.ItemIsUserCheckable

    return Display


class _Entry:
    """One entry; a second one, as when it was duplicated, shows the same settings."""

    def __init__(self, view: View, now: RegisteredProperties, entries: Entries) -> None:
        self._settings = view.settings
        #: RViz's display.
        self.display: Any = given_to_rviz(_class()())
        self.display.entry = self
        self.display.setClassId(VIEW_CLASS)
        self.display.setName(_NAME)
        self.display.setIcon(camera_icon())
        self.display.setDescription(
            "How the camera is moved by keys, by interfaces and by robots. "
            "Without this entry, it is as at first."
        )
        self._trees = [
            PropertyTree(owner, self.display, entries.sources)
            for owner in (now, view.settings.properties)
        ]

    @property
    def alive(self) -> bool:
        """Whether RViz still has it."""
        return not pyqt("sip").isdeleted(self.display)

    def save(self, config: Any) -> None:
        """Write what a ``.rviz`` file keeps of it to RViz's ``Config``."""
        for name, value in self._settings.save().items():
            config.mapSetValue(name, value)

    def load(self, config: Any) -> None:
        """Take what a ``.rviz`` file has."""
        self._settings.load(plain_config(config))

    def close(self) -> None:
        """Follow the settings no longer."""
        for tree in self._trees:
            tree.close()


class ViewEntry(QtCore.QObject):
    """Shows the settings of the camera in the panel: by the menu Overlays, or as a file has it.

    A file that has no entry, and removing it, leave the settings as a program has made them, or as
    at first.

    Args:
        window: RViz.
        entries: The entries of the overlays.
        view: The camera.
        services: What robots reach it by.
    """

    def __init__(
        self, window: Window, entries: Entries, view: View, services: ViewServices
    ) -> None:
        super().__init__()
        self._window, self._entries, self._view, self._services = window, entries, view, services
        self._shown: list[_Entry] = []
        self._loading = self._loaded = False
        #: What no file keeps.
        self._now = RegisteredProperties()
        about = "What the camera follows and turns with; empty for nothing."
        self._frame = self._now.register("frame", "Tracked Frame", description=about)
        about = "Whether it is seen straight from above, without perspective."
        self._flat = self._now.register("bool", "2D Mode", description=about)
        self._frame.valueChanged.connect(self._track)
        self._flat.valueChanged.connect(self._flatten)
        menu = window.menu("&Overlays")
        self._action = menu.addAction("&View controller")
        self._action.setCheckable(True)
        self._action.setToolTip("Settings of the camera, among the displays")
        self._choose = quiet()(self._on_action)
        self._action.triggered.connect(self._choose)
        window.config_loading.connect(self._on_loading)
        window.config_loaded.connect(self._on_loaded)
        window.closing.connect(self.close)
        window.before_frame.connect(self._look)
        entries.replaced.connect(self._settle)
        services.problem_changed.connect(self._tell)
        services.opened.connect(self._tell)
        view.problem_changed.connect(self._tell)
        view.tracked_frame_changed.connect(self._tell)
        view.mode_changed.connect(self._tell)
        entries.welcome(VIEW_CLASS, self._make)

    @property
    def shown(self) -> bool:
        """Whether there is an entry; one that is set to False is removed."""
        return bool(self._shown)

    @shown.setter
    def shown(self, shown: bool) -> None:
        if shown and not self._shown:
            self._window.manager.addDisplay(self._make().display, True)
        elif not shown:
            self.close()
            self._settle()
        self._action.setChecked(shown)

    def close(self) -> None:
        """Take the entry out of the panel; safe to call twice."""
        shown, self._shown = self._shown, []
        for entry in shown:
            entry.close()
            take_out(entry.display)

    def _make(self) -> _Entry:
        entry = _Entry(self._view, self._now, self._entries)
        self._shown.append(entry)
        self._action.setChecked(True)
        self._tell()
        return entry

    def _on_action(self, *_: Any) -> None:
        self.shown = not self.shown

    @Slot()
    def _look(self) -> None:
        """See what RViz has deleted, which no signal tells to Python."""
        gone = [entry for entry in self._shown if not entry.alive]
        for entry in gone:
            self._shown.remove(entry)
            entry.close()
        if gone and not self._loading:
            self._settle()

    @Slot()
    def _on_loading(self) -> None:
        self._loading = True

    @Slot()
    def _on_loaded(self) -> None:
        self._loaded = True

    @Slot()
    def _settle(self) -> None:
        """Have the settings be as without an entry if there is none, once a file is loaded."""
        if self._loading and not self._loaded:
            return
        self._loading = self._loaded = False
        if not any(entry.alive for entry in self._shown):
            self._action.setChecked(False)
            self._view.settings.load({})

    def _track(self, frame: str) -> None:
        try:
            self._view.track(frame)
        except Error as error:
            self._entries.sources.complain(f"Tracked Frame: {error}")
            self._frame.set(self._view.tracked_frame)

    def _flatten(self, flat: bool) -> None:
        self._view.set_mode(ViewMode.MODE_2D if flat else ViewMode.MODE_3D)

    @Slot()
    def _tell(self, *_: Any) -> None:
        services, view = self._services, self._view
        self._frame.set(view.tracked_frame)
        self._flat.set(view.mode is ViewMode.MODE_2D)
        where = services.namespace if services.is_open else "not connected, or switched off"
        follows = view.tracked_frame or "nothing is followed"
        for entry in self._shown:
            for row, problem, fine in (
                ("Robots", services.problem, where),
                ("Tracked Frame", view.problem, follows),
            ):
                if entry.alive:
                    tell_status(entry.display, row, _WARN if problem else _OK, problem or fine)
