"""The program ``rosglass view``: RViz's window, on any robot, without RViz."""
# ruff: noqa: N802, N815 - the names of slots, signals and properties are QML's

from __future__ import annotations

import logging
import pickle
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rosglass.errors import Error, QmlError
from rosglass.qml.engine.properties import ReadOnly, report
from rosglass.qml.engine.runtime import runtime_of
from rosglass.qml.run.modules import interface_file, locate, show_plain_labels
from rosglass.qt import QtCore, Slot, is_alive
from rosglass.scene.app.modules import register_window
from rosglass.scene.configs.rviz_config import RvizConfig

if TYPE_CHECKING:
    import os
    from collections.abc import Sequence

    from rosglass.qml.engine.session import Session
    from rosglass.scene.app.window_recorder import WindowRecorder
    from rosglass.scene.view.scene_view import SceneView

__all__ = ["WINDOW", "ViewProgram", "config_file"]

_log = logging.getLogger("rosglass.scene")
#: The program's window.
WINDOW = Path(__file__).with_name("panels") / "View.qml"
#: Milliseconds between two looks at clock, frame rate and changes.
_REFRESH_MS = 500
#: Seconds between two looks at whether the view has changed.
_LOOK_S = 2.0
#: RViz's names in ``Window Geometry`` for hidden panels.
_LEFT_DOCK, _RIGHT_DOCK = "Hide Left Dock", "Hide Right Dock"
#: Seconds for which a message stays in the status bar.
_MESSAGE_S = 10.0


def _plain_path(file: str) -> str:
    """Return the path of an overlay's file; empty if it is missing."""
    try:
        return str(interface_file(file))
    except QmlError:
        return ""


def config_file(place: str | os.PathLike[str]) -> Path:
    """Return the path of a config, if it is one.

    Args:
        place: A path, or ``package://name/path``.

    Raises:
        Error: There is no such file, or it is a folder.
    """
    path = locate(place)
    if path.is_dir():
        inside = ", ".join(sorted(file.name for file in path.glob("*.rviz"))[:5])
        raise Error(f"{place}: this is a folder; name a config in it{f': {inside}' * bool(inside)}")
    if not path.is_file():
        raise Error(f"{place}: there is no such file")
    return path


class ViewProgram(QtCore.QObject):
    """The model of the window of ``rosglass view``: its texts, and the actions of its buttons.

    Args:
        config: The ``.rviz`` file to open; empty for RViz's default, a grid.
        fixed_frame: The fixed frame instead of the config's; empty for none.
        kiosk: Whether the panels are hidden.
        overlays: QML files to show over the view, the last one on top.
        watch: Whether to reload these when a file in their folders is saved.
        import_paths: Additional folders with QML modules, for these.
        recorder: The recorder of the window; None without one.

    Raises:
        Error: The config cannot be read.
    """

    configName = ReadOnly(str, "")
    modified = ReadOnly(bool, False)
    #: State of the connection, in words.
    connection = ReadOnly(str, "")
    connected = ReadOnly(bool, False)
    #: The robot's time, and this machine's.
    time = ReadOnly(str, "")
    message = ReadOnly(str, "")
    frameRate = ReadOnly(int, 0)
    #: For how long the window is being recorded; empty while it is not.
    recording = ReadOnly(str, "")
    kiosk = ReadOnly(bool, False)
    #: Whether the config hides RViz's docks, i.e. the panels on this side.
    hidesLeftDock = ReadOnly(bool, False)
    hidesRightDock = ReadOnly(bool, False)

    def __init__(
        self,
        config: str | os.PathLike[str] = "",
        fixed_frame: str = "",
        *,
        kiosk: bool = False,
        overlays: Sequence[str | os.PathLike[str]] = (),
        watch: bool = False,
        import_paths: Sequence[str | os.PathLike[str]] = (),
        recorder: WindowRecorder | None = None,
    ) -> None:
        super().__init__()
        register_window()
        self._session: Session | None = None
        self._path = config_file(config) if config else None
        # Read before the window is shown: a mistake in its name is an error of the command.
        self._config = RvizConfig.load(self._path) if self._path is not None else None
        self._fixed_frame = fixed_frame
        self._overlays = list(overlays)
        self._overlay_options: dict[str, Any] = {"watch": watch, "import_paths": import_paths}
        self._view: SceneView | None = None
        self._saved = b""
        self._discarded = False
        self._said_at = self._next_look = 0.0
        self._counted, self._counted_at = 0, time.monotonic()
        self._recorder = recorder
        if recorder is not None:
            recorder.failed.connect(self._on_recording_failed)
        report(self, kiosk=kiosk)
        self._timer = QtCore.QTimer(self)
        self._timer.setInterval(_REFRESH_MS)
        self._timer.timeout.connect(self._refresh)

    @property
    def view(self) -> SceneView | None:
        """The view, once the window has made it."""
        return self._view

    @Slot(QtCore.QObject)
    def begin(self, view: Any) -> None:
        """Set the window's view, and show the config in it; called by the window."""
        self._view = view
        runtime = runtime_of(view)
        assert runtime is not None
        self._session = session = runtime.session
        view.configLoaded.connect(self._on_config_loaded)
        view.configSaved.connect(self._on_config_saved)
        if self._config is None:
            view.scene.add("Grid")
            view.scene.add("TF")
        else:
            self._show(self._config)
        if self._fixed_frame:
            view.scene.fixed_frame = self._fixed_frame
        # An overlay may choose the node's name.
        self._show_overlays(view)
        if not session.is_initialized:
            session.init("rosglass_view")
        self._remember()
        self._timer.start()
        self._refresh()

    @Slot()
    def prepare_controls(self) -> None:
        """Make controls of Qt safe for texts of robots, before they are loaded."""
        show_plain_labels()

    def _show_overlays(self, view: SceneView) -> None:
        if not self._overlays:
            return
        # Slow to load; most views have none.
        from rosglass.scene.overlays.qml_overlay import QmlOverlayDisplay  # noqa: PLC0415
        from rosglass.scene.overlays.scene_overlay import add_overlay  # noqa: PLC0415

        shown = {
            _plain_path(one.path)
            for one in view.scene.displays
            if isinstance(one, QmlOverlayDisplay)
        }
        try:
            for file in self._overlays:
                # The config may have it already.
                if str(file) not in shown:
                    add_overlay(view, file, **self._overlay_options)
        except Error as error:
            _log.error("%s", error)
            # The command fails, as it does over RViz; its event loop may not run yet.
            QtCore.QTimer.singleShot(0, lambda: QtCore.QCoreApplication.exit(1))

    @Slot(bool, bool)
    def hideDocks(self, left: bool, right: bool) -> None:
        """Hide or show the panels on both sides; saved with the config, as RViz does."""
        report(self, hidesLeftDock=left, hidesRightDock=right)
        self._keep_docks()

    def _keep_docks(self) -> None:
        """Make the view write the hidden docks into configs, also if an overlay saves them."""
        view = self._view
        if view is None:
            return
        known = {} if view.config is None else _geometry(view.config)
        docks = {_LEFT_DOCK: self.hidesLeftDock, _RIGHT_DOCK: self.hidesRightDock}
        # A config without them stays so while none is hidden.
        view.window_geometry = {
            name: hidden for name, hidden in docks.items() if hidden or name in known
        }

    def _show(self, config: RvizConfig) -> None:
        assert self._view is not None
        notes = self._view.show_config(config)
        for note in notes:
            _log.warning("%s: %s", config.source, note)
        if notes:
            count = "a note" if len(notes) == 1 else f"{len(notes)} notes"
            self.say(f"{count} on {Path(config.source).name}: {notes[0]}")

    @Slot(str)
    def _on_config_loaded(self, source: str) -> None:
        """Follow a config that an overlay may have loaded."""
        assert self._view is not None
        assert self._view.config is not None
        geometry = _geometry(self._view.config)
        report(
            self,
            hidesLeftDock=geometry.get(_LEFT_DOCK) is True,
            hidesRightDock=geometry.get(_RIGHT_DOCK) is True,
        )
        self._keep_docks()
        self._on_config_saved(source)

    @Slot(str)
    def _on_config_saved(self, source: str) -> None:
        report(self, configName=Path(source).name)
        self._remember()

    @Slot(str)
    def _on_recording_failed(self, problem: str) -> None:
        self.say(f"the recording has ended: {problem}")

    @Slot(str)
    def say(self, text: str) -> None:
        """Show a message in the status bar for some seconds."""
        self._said_at = time.monotonic()
        report(self, message=text)

    def _remember(self) -> None:
        self._saved = self._state()
        report(self, modified=False)

    def _state(self) -> bytes:
        """Return the state that would be saved, to detect changes."""
        if self._view is None:
            return b""
        config = self._view.collect_config()
        manager = dict(config.manager)
        # A moved camera alone does not ask the user to save.
        manager["Views"] = {**manager.get("Views", {}), "Current": None}
        return pickle.dumps(manager)

    @Slot(QtCore.QUrl)
    @Slot(str)
    def open(self, place: Any) -> None:
        """Open a config; an error is shown in the status bar."""
        try:
            self._show(RvizConfig.load(config_file(_local(place))))
        except Error as error:
            _log.error("%s", error)
            self.say(str(error))
            return
        self._refresh()

    @Slot(QtCore.QUrl, result=QtCore.QUrl)
    def typedFile(self, file: QtCore.QUrl) -> QtCore.QUrl:
        """Return the path that the user meant by text typed into Qt's file dialog.

        It joins absolute ones, and those with ``~``, to the folder that it shows.

        Returns:
            That file; an empty URL for one that is in the folder.
        """
        _, found, typed = file.path().partition("//")
        if not found:
            _, found, typed = file.path().partition("/~/")
            return QtCore.QUrl.fromLocalFile(str(Path.home() / typed)) if found else QtCore.QUrl()
        return QtCore.QUrl.fromLocalFile("/" + typed.lstrip("/"))

    @Slot(QtCore.QObject, result=QtCore.QObject)
    def findNameField(self, window: QtCore.QObject) -> QtCore.QObject | None:
        """Return where the name is typed in Qt's own file dialog; None in those of the system."""
        found = window.findChildren(QtCore.QObject, "fileNameTextField")
        return next((one for one in found if one.property("visible")), None)

    @Slot(QtCore.QUrl, result=bool)
    def exists(self, file: QtCore.QUrl) -> bool:
        """Return whether there is a file."""
        return Path(_local(file)).exists()

    @Slot(QtCore.QUrl)
    @Slot(str)
    def save(self, place: Any) -> None:
        """Save the config; where it was opened for an empty place."""
        if self._view is None:
            return
        try:
            self._view.save_config(_local(place))
        except Error as error:
            _log.error("%s", error)
            self.say(str(error))
            return
        assert self._view.config is not None
        self.say(f"saved to {self._view.config.source}")
        self._refresh()

    @Slot(result=bool)
    def mayClose(self) -> bool:
        """Return whether nothing would be lost."""
        return self._discarded or self.kiosk or self._state() == self._saved

    @Slot()
    def discard(self) -> None:
        """Allow the window to close without saving."""
        self._discarded = True

    def _refresh(self) -> None:
        view, session = self._view, self._session
        if view is None or session is None or not is_alive(view):
            self._timer.stop()
            return
        now = time.monotonic()
        if now >= self._next_look and not self.kiosk:
            self._next_look = now + _LOOK_S
            report(self, modified=self._state() != self._saved)
        if self.message and now - self._said_at > _MESSAGE_S:
            report(self, message="")
        drawn = view.pictures_drawn()
        rate = round((drawn - self._counted) / max(now - self._counted_at, 0.001))
        self._counted, self._counted_at = drawn, now
        node = session.node
        ros_time = node.now().seconds if node is not None else 0.0
        report(
            self,
            frameRate=rate,
            connected=session.state == "connected",
            connection=f"{session.state}: {session.detail}" if session.detail else session.state,
            time=f"ROS {ros_time:.2f}   wall {time.strftime('%H:%M:%S')}",
            recording="" if self._recorder is None else self._recorder.text,
        )


def _geometry(config: RvizConfig) -> dict[str, Any]:
    """Return a config's mapping of RViz's window and docks."""
    found = config.root.get("Window Geometry")
    return found if isinstance(found, dict) else {}


def _local(place: Any) -> str:
    if isinstance(place, QtCore.QUrl):
        return place.toLocalFile()
    return str(place)
