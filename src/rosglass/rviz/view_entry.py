"""The view controller's entry in RViz's Displays panel."""
# ruff: noqa: N802 - C++ calls these methods by their RViz names

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any

from rosglass.errors import Error
from rosglass.overlay.property_values import plain_config
from rosglass.overlay.registered_properties import RegisteredProperties
from rosglass.overlay.view import ViewMode
from rosglass.overlay.view_controller_settings import CONTROLLER_CLASS
from rosglass.qt import QtCore, Slot
from rosglass.rviz.entries import camera_icon, display_class, set_status
from rosglass.rviz.host import pyqt
from rosglass.rviz.properties import PropertyTree, log_errors, owned_by_rviz, remove_from_tree

if TYPE_CHECKING:
    from rosglass.overlay.view import View
    from rosglass.overlay.view_controller import ViewServices
    from rosglass.rviz.entries import Entries
    from rosglass.rviz.window import Window

__all__ = ["ViewEntry"]


_NAME = "View Controller"
_OK, _WARN = 0, 1


@cache
def _class() -> Any:
    """Return a subclass of our display class without a check box."""
    base, core = display_class(), pyqt()

    class Display(base):  # type: ignore[misc,valid-type]
        @log_errors()
        def getViewData(self, column: int, role: int) -> Any:
            if column == 1 and role == core.Qt.CheckStateRole:
                return None
            return base.getViewData(self, column, role)

        @log_errors(core.Qt.ItemFlags())
        def getViewFlags(self, column: int) -> Any:
            return base.getViewFlags(self, column) & ~core.Qt.ItemIsUserCheckable

    return Display


class _PanelEntry:
    """One entry of the view controller; duplicates show the same settings."""

    def __init__(self, view: View, now: RegisteredProperties, entries: Entries) -> None:
        self._settings = view.settings
        #: RViz's display.
        self.display: Any = owned_by_rviz(_class()())
        self.display.entry = self
        self.display.setClassId(CONTROLLER_CLASS)
        self.display.setName(_NAME)
        self.display.setIcon(camera_icon())
        self.display.setDescription(
            "Settings for moving the camera by keys, overlays and robots. "
            "Without this entry, the defaults apply."
        )
        self._trees = [
            PropertyTree(owner, self.display, entries.choices)
            for owner in (now, view.settings.properties)
        ]

    @property
    def alive(self) -> bool:
        """True until RViz deletes the display."""
        return not pyqt("sip").isdeleted(self.display)

    def save(self, config: Any) -> None:
        """Save the settings to RViz's ``Config``."""
        for name, value in self._settings.save().items():
            config.mapSetValue(name, value)

    def load(self, config: Any) -> None:
        """Restore the settings from RViz's ``Config``."""
        self._settings.load(plain_config(config))

    def close(self) -> None:
        """Disconnect from the settings."""
        for tree in self._trees:
            tree.close()


class ViewEntry(QtCore.QObject):
    """The view controller's entry in the panel, added by the Overlays menu or by a config file.

    Without an entry, the settings are the program's or the defaults.
    """

    def __init__(
        self, window: Window, entries: Entries, view: View, services: ViewServices
    ) -> None:
        super().__init__()
        self._window, self._entries, self._view, self._services = window, entries, view, services
        self._shown: list[_PanelEntry] = []
        self._loading = self._loaded = False
        #: State of the camera, shown in the panel but not saved.
        self._shown_state = RegisteredProperties()
        about = "The frame that the camera follows and turns with; empty for none."
        self._frame = self._shown_state.register("frame", "Tracked Frame", description=about)
        about = "Whether to look straight down, without perspective."
        self._in_2d = self._shown_state.register("bool", "2D Mode", description=about)
        self._frame.valueChanged.connect(self._track)
        self._in_2d.valueChanged.connect(self._set_2d)
        menu = window.menu("&Overlays")
        self._action = menu.addAction("&View controller")
        self._action.setCheckable(True)
        self._action.setToolTip("Show the settings of the camera in the Displays panel")
        self._choose = log_errors()(self._on_action)
        self._action.triggered.connect(self._choose)
        window.config_loading.connect(self._on_loading)
        window.config_loaded.connect(self._on_loaded)
        window.closing.connect(self.close)
        window.before_frame.connect(self._check_deleted)
        entries.replaced.connect(self._reset_without_entry)
        services.problem_changed.connect(self._update)
        services.opened.connect(self._update)
        view.problem_changed.connect(self._update)
        view.tracked_frame_changed.connect(self._update)
        view.mode_changed.connect(self._update)
        entries.register_class(CONTROLLER_CLASS, self._make)

    @property
    def shown(self) -> bool:
        """True while the panel has an entry; setting it adds or removes one."""
        return bool(self._shown)

    @shown.setter
    def shown(self, shown: bool) -> None:
        if shown and not self._shown:
            self._window.manager.addDisplay(self._make().display, True)
        elif not shown:
            self.close()
            self._reset_without_entry()
        self._action.setChecked(shown)

    def close(self) -> None:
        """Remove the entry from the panel; safe to call twice."""
        shown, self._shown = self._shown, []
        for entry in shown:
            entry.close()
            remove_from_tree(entry.display)

    def _make(self) -> _PanelEntry:
        entry = _PanelEntry(self._view, self._shown_state, self._entries)
        self._shown.append(entry)
        self._action.setChecked(True)
        self._update()
        return entry

    def _on_action(self, *_: Any) -> None:
        self.shown = not self.shown

    @Slot()
    def _check_deleted(self) -> None:
        """Detect entries that RViz has deleted, for which Python gets no signal."""
        deleted = [entry for entry in self._shown if not entry.alive]
        for entry in deleted:
            self._shown.remove(entry)
            entry.close()
        if deleted and not self._loading:
            self._reset_without_entry()

    @Slot()
    def _on_loading(self) -> None:
        self._loading = True

    @Slot()
    def _on_loaded(self) -> None:
        self._loaded = True

    @Slot()
    def _reset_without_entry(self) -> None:
        """Reset the settings if there is no entry, but not before a file is loaded completely."""
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
            self._entries.choices.report(f"Tracked Frame: {error}")
            self._frame.set(self._view.tracked_frame)

    def _set_2d(self, in_2d: bool) -> None:
        self._view.set_mode(ViewMode.MODE_2D if in_2d else ViewMode.MODE_3D)

    @Slot()
    def _update(self, *_: Any) -> None:
        services, view = self._services, self._view
        self._frame.set(view.tracked_frame)
        self._in_2d.set(view.mode is ViewMode.MODE_2D)
        where = services.namespace if services.is_open else "not connected, or switched off"
        follows = view.tracked_frame or "no frame is followed"
        for entry in self._shown:
            for row, problem, fine in (
                ("Robots", services.problem, where),
                ("Tracked Frame", view.problem, follows),
            ):
                if entry.alive:
                    set_status(entry.display, row, _WARN if problem else _OK, problem or fine)
