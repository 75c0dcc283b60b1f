"""Control of RViz's camera by ROS services, by keys, and by its entry in the Displays panel."""
# ruff: noqa: N802 - C++ calls these methods by their RViz names

from __future__ import annotations

import logging
import math
import time
from functools import cache
from typing import TYPE_CHECKING, Any, NamedTuple

from rosglass.comm.qos import QoS
from rosglass.errors import Error, ServiceError
from rosglass.qt import QtCore, Signal, Slot, is_alive
from rosglass.ros1.names import expand, split
from rosglass.rviz.entries import camera_icon, display_class, set_status
from rosglass.rviz.host import pyqt
from rosglass.rviz.properties import PropertyTree, log_errors, owned_by_rviz, remove_from_tree
from rosglass.rviz.property_values import plain_config
from rosglass.rviz.qt5 import QtCore as Qt5Core
from rosglass.rviz.registered_properties import RegisteredProperties
from rosglass.rviz.view import ViewMode

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.comm.handle import Handle
    from rosglass.comm.node import Node
    from rosglass.comm.publisher import Publisher
    from rosglass.messages import Message
    from rosglass.qml.session import Session
    from rosglass.rviz.entries import Entries
    from rosglass.rviz.stack import Stack
    from rosglass.rviz.view import View
    from rosglass.rviz.window import Window

__all__ = ["VIEW_CLASS", "ViewEntry", "ViewKeys", "ViewServices"]


_log = logging.getLogger("rosglass.rviz")
_E, _Qt = Qt5Core.QEvent, Qt5Core.Qt
#: Arrow keys -> direction ahead and to the left.
_ARROWS = {
    _Qt.Key_Up: (1, 0),
    _Qt.Key_Down: (-1, 0),
    _Qt.Key_Left: (0, 1),
    _Qt.Key_Right: (0, -1),
}
#: Maximum seconds of movement per frame, for slow frames.
_MAX_STEP_S = 0.2


class ViewKeys(QtCore.QObject):
    """Keyboard control: arrow keys shift the view, faster with Shift; Ctrl+D toggles 2D and 3D.

    Only while the 3D view has the keyboard focus, and no overlay has it.
    """

    def __init__(self, window: Window, view: View, overlays: Stack) -> None:
        super().__init__()
        self._window, self._view, self._overlays = window, view, overlays
        self._panel = window.panel
        self._settings = view.settings
        self._pressed: set[int] = set()
        self._fast = False
        self._last_step = 0.0
        self._panel.installEventFilter(self)
        window.before_frame.connect(self._step)
        window.closing.connect(self.close)

    def close(self) -> None:
        """Stop handling keys; safe to call twice."""
        self._pressed.clear()
        if is_alive(self._panel):
            self._panel.removeEventFilter(self)

    def eventFilter(self, watched: Any, event: Any) -> bool:
        """Return whether a key moves the camera, so that RViz must not get it."""
        del watched
        kind = event.type()
        if kind in (_E.FocusOut, _E.Hide, _E.WindowDeactivate):
            self._pressed.clear()
        if kind not in (_E.KeyPress, _E.KeyRelease, _E.ShortcutOverride) or not self._settings.keys:
            return False
        if self._focus_is_elsewhere():
            self._pressed.clear()
            return False
        if _is_toggle(event):
            if kind == _E.ShortcutOverride:
                # Otherwise RViz's Displays panel would handle it as its shortcut.
                event.accept()
            elif kind == _E.KeyPress and not event.isAutoRepeat():
                self._toggle_mode()
            return True
        return self._arrow(event)

    def _arrow(self, event: Any) -> bool:
        kind, key = event.type(), event.key()
        if kind == _E.ShortcutOverride:
            return False
        pressed = kind == _E.KeyPress
        if key == _Qt.Key_Shift:
            self._fast = pressed
            return False
        if key not in _ARROWS:
            return False
        if not pressed:
            ours = key in self._pressed
            if not event.isAutoRepeat():
                self._pressed.discard(key)
            return ours
        if event.modifiers() & ~(_Qt.ShiftModifier | _Qt.KeypadModifier):
            return False
        self._fast = bool(event.modifiers() & _Qt.ShiftModifier)
        if not self._pressed:
            self._last_step = time.monotonic()
        self._pressed.add(key)
        return True

    def _focus_is_elsewhere(self) -> bool:
        shown = self._overlays.topmost_first()
        return self._overlays.input.focused is not None or any(o.is_modal for o in shown)

    def _toggle_mode(self) -> None:
        in_2d = self._view.mode is ViewMode.MODE_2D
        self._view.set_mode(ViewMode.MODE_3D if in_2d else ViewMode.MODE_2D)

    def _step(self) -> None:
        if not self._pressed:
            return
        now = time.monotonic()
        passed, self._last_step = min(now - self._last_step, _MAX_STEP_S), now
        if self._focus_is_elsewhere() or not self._settings.keys:
            # The key releases go to the new owner of the keyboard focus.
            self._pressed.clear()
            return
        ahead = sum(_ARROWS[key][0] for key in self._pressed)
        left = sum(_ARROWS[key][1] for key in self._pressed)
        length = math.hypot(ahead, left)
        if not length or not passed:
            return
        metres = self._settings.speed * (2 if self._fast else 1) * passed / length
        try:
            self._view.nudge(ahead * metres, left * metres)
        except Error as error:
            self._pressed.clear()
            _log.warning("%s", error)


def _is_toggle(event: Any) -> bool:
    return bool(event.key() == _Qt.Key_D and event.modifiers() == _Qt.ControlModifier)


_PACKAGE = "hector_rviz_plugins"


class ViewServices(QtCore.QObject):
    """The ROS topics and services of the camera.

    Latched topics ``tracked_frame`` and ``view_mode``; services ``move_eye``,
    ``move_eye_and_focus``, ``set_view_mode`` and ``set_tracked_frame``. A failed request is a
    service error with the reason.

    Args:
        view: The camera.
        session: The session whose ROS 1 node provides them.
        node_name: Full name of RViz's own node, for ``~`` in the namespace.
    """

    #: :attr:`problem` has changed. Argument: the new text.
    problem_changed = Signal(str)
    #: All topics and services are available.
    opened = Signal()

    def __init__(
        self,
        view: View,
        session: Session,
        node_name: str = "/rviz",
    ) -> None:
        super().__init__()
        self._view, self._session = view, session
        self._settings = view.settings
        self._rviz_name = split(node_name)
        self._applied = self._read_settings()
        self._problem = ""
        self._node: Node | None = None
        self._generation = 0
        self._handles: list[Handle] = []
        #: The endpoints that the worker thread is creating.
        self._pending: _Endpoints | None = None
        self._publishers: dict[str, Publisher] = {}
        self._closed = False
        session.node_changed.connect(self._node_changed)
        session.connection_changed.connect(self._connection_changed)
        view.mode_changed.connect(self._publish_mode)
        view.tracked_frame_changed.connect(self._publish_frame)
        self._settings.properties.edited.connect(self._on_edited)
        self._node_changed()

    @property
    def namespace(self) -> str:
        """The absolute namespace of topics and services; empty if the setting is invalid."""
        return self._applied.namespace

    @property
    def problem(self) -> str:
        """Why topics and services are missing; empty if they are available."""
        return self._problem

    @property
    def is_open(self) -> bool:
        """Whether topics or services are available."""
        return bool(self._handles)

    def close(self) -> None:
        """Close topics and services; safe to call twice."""
        if not self._closed:
            self._closed = True
            self._close_handles()

    def _read_settings(self) -> _EndpointSettings:
        settings, (above, name) = self._settings, self._rviz_name
        try:
            namespace = expand(settings.namespace, name, above).rstrip("/")
        except Error as error:
            return _EndpointSettings(settings.topics, settings.services, "", str(error))
        return _EndpointSettings(settings.topics, settings.services, namespace, "")

    def _on_edited(self) -> None:
        wanted = self._read_settings()
        if wanted != self._applied and not self._closed:
            self._applied = wanted
            self._open()

    def _node_changed(self) -> None:
        if self._session.node is not self._node and not self._closed:
            self._node = self._session.node
            self._open()

    def _connection_changed(self) -> None:
        """Close topics and services if the node was shut down, and report it."""
        if self._node is not None and self._session.state == "failed" and not self._closed:
            self._close_handles()
            self._set_problem(self._session.detail)

    def _close_handles(self) -> None:
        self._generation += 1
        handles, self._handles, self._publishers = self._handles, [], {}
        making, self._pending = self._pending, None
        if handles:
            self._session.background(lambda: _close_all(handles))
        if making is not None:
            # Background jobs run in order: the endpoints exist by then, and their names are free
            # before new endpoints use them.
            self._session.background(lambda: _close_all(making.handles))

    def _open(self) -> None:
        self._close_handles()
        node, generation, wanted = self._node, self._generation, self._applied
        if node is None or not (wanted.topics or wanted.services):
            self._set_problem("")
            return
        if wanted.wrong:
            self._set_problem(wanted.wrong)
            return
        if node.wire != "ros1":
            self._set_problem(f"{node.url}: the camera's services need ROS 1")
            return
        made = self._pending = _Endpoints()

        def done(result: _Endpoints | Error) -> None:
            if generation != self._generation:
                return
            self._pending = None
            if isinstance(result, Error):
                self._set_problem(str(result))
            else:
                self._handles, self._publishers = made.handles, made.publishers
                self._set_problem("")
                self._publish_mode()
                self._publish_frame()
                self.opened.emit()

        self._session.background(lambda: self._make(node, wanted, made), done)

    def _make(self, node: Node, wanted: _EndpointSettings, made: _Endpoints) -> _Endpoints:
        """Create topics and services; runs in the worker thread."""
        try:
            if wanted.topics:
                for topic, kind in (
                    ("tracked_frame", "std_msgs/String"),
                    ("view_mode", f"{_PACKAGE}/ViewMode"),
                ):
                    name = f"{wanted.namespace}/{topic}"
                    made.publishers[topic] = node.create_publisher(name, kind, QoS.latched())
                    made.handles.append(made.publishers[topic])
            for name, kind, answer in self._services() if wanted.services else ():
                made.handles.append(
                    node.create_service_server(
                        f"{wanted.namespace}/{name}",
                        f"{_PACKAGE}/srv/{kind}",
                        _raising_service_errors(answer),
                        executor=self._session.executor,
                    )
                )
        except Error:
            _close_all(made.handles)
            raise
        return made

    def _services(self) -> tuple[tuple[str, str, Callable[[Message], None]], ...]:
        return (
            ("move_eye", "MoveEye", self._move_eye),
            ("move_eye_and_focus", "MoveEyeAndFocus", self._move_eye_and_focus),
            ("set_view_mode", "SetViewMode", self._set_view_mode),
            ("set_tracked_frame", "TrackFrame", self._set_tracked_frame),
        )

    def _move_eye(self, request: Any) -> None:
        self._view.move_eye(
            _point(request.eye),
            request.header.frame_id,
            animate=not request.disable_animation,
            stop_tracking=request.stop_tracking,
            switch_to_3d=request.switch_to_3d_mode,
        )

    def _move_eye_and_focus(self, request: Any) -> None:
        self._view.move_eye_and_focus(
            _point(request.eye),
            _point(request.focus),
            request.header.frame_id,
            animate=not request.disable_animation,
            stop_tracking=request.stop_tracking,
        )

    def _set_view_mode(self, request: Any) -> None:
        self._view.set_mode(request.mode.mode, animate=not request.disable_animation)

    def _set_tracked_frame(self, request: Any) -> None:
        self._view.track(request.frame)

    def _publish_mode(self) -> None:
        self._publish("view_mode", mode=int(self._view.mode))

    def _publish_frame(self) -> None:
        self._publish("tracked_frame", data=self._view.tracked_frame)

    def _publish(self, topic: str, **fields: Any) -> None:
        publisher = self._publishers.get(topic)
        if publisher is not None:
            try:
                publisher.publish(**fields)
            except Error as error:
                _log.warning("%s/%s: %s", self.namespace, topic, error)

    def _set_problem(self, problem: str) -> None:
        if problem != self._problem:
            self._problem = problem
            if problem:
                _log.warning("robots cannot move the camera: %s", problem)
            self.problem_changed.emit(problem)


class _EndpointSettings(NamedTuple):
    """The settings for topics and services; `wrong` is the error of an invalid namespace."""

    topics: bool
    services: bool
    namespace: str
    wrong: str


class _Endpoints:
    """The publishers and service servers created by the worker thread."""

    def __init__(self) -> None:
        self.handles: list[Handle] = []
        self.publishers: dict[str, Publisher] = {}


def _raising_service_errors(answer: Callable[[Message], None]) -> Callable[[Message], None]:
    """Return a service callback whose Errors become failed responses."""

    def call(request: Message) -> None:
        try:
            answer(request)
        except Error as error:
            raise ServiceError(str(error)) from error

    return call


def _close_all(handles: list[Handle]) -> None:
    for handle in handles:
        handle.close()


def _point(point: Any) -> tuple[float, float, float]:
    return point.x, point.y, point.z


#: Class id of the view controller's entry in ``.rviz`` files.
VIEW_CLASS = "rosglass/ViewController"
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
        self.display.setClassId(VIEW_CLASS)
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
        """Whether RViz has not deleted the display."""
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
        entries.register_class(VIEW_CLASS, self._make)

    @property
    def shown(self) -> bool:
        """Whether the panel has an entry; setting it adds or removes one."""
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
