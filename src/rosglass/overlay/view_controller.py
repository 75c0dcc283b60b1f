"""Control of the camera by ROS topics and services, and by keys: of RViz's, and of a scene's."""
# ruff: noqa: N802 - C++ calls these methods by their RViz names

from __future__ import annotations

import logging
import math
import time
from typing import TYPE_CHECKING, Any, NamedTuple

from rosglass.comm.qos import QoS
from rosglass.errors import Error, ServiceError
from rosglass.overlay.view import ViewMode
from rosglass.qml.engine.log import RateLimit
from rosglass.qt import QtCore, Signal, Slot, is_alive
from rosglass.wires.tcpros.graph import expand, split

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.comm.handle import Handle
    from rosglass.comm.node import Node
    from rosglass.comm.publisher import Publisher
    from rosglass.messages import Message
    from rosglass.overlay.view import View
    from rosglass.qml.engine.session import Session

__all__ = ["ViewKeys", "ViewServices"]


_log = logging.getLogger("rosglass.overlay")
_E, _Key = QtCore.QEvent.Type, QtCore.Qt.Key
_Modifier = QtCore.Qt.KeyboardModifier
#: Arrow keys -> direction ahead and to the left.
_ARROWS: dict[Any, tuple[int, int]] = {
    _Key.Key_Up: (1, 0),
    _Key.Key_Down: (-1, 0),
    _Key.Key_Left: (0, 1),
    _Key.Key_Right: (0, -1),
}
#: Maximum seconds of movement per frame, for slow frames.
_MAX_STEP_S = 0.2
#: Milliseconds until services that another part of the program offers are tried again.
_RETRY_MS = 1000


class ViewKeys(QtCore.QObject):
    """Keyboard control: arrow keys shift the view, faster with Shift; Ctrl+D toggles 2D and 3D.

    Args:
        target: Receiver of keys while the 3D view has the keyboard focus.
        view: The camera.
        before_frame: Signal that the view is about to draw.
        focus_is_elsewhere: Returns whether keys are meant for something over the view.
    """

    def __init__(
        self,
        target: Any,
        view: View,
        before_frame: Any,
        focus_is_elsewhere: Callable[[], bool] = bool,
    ) -> None:
        super().__init__()
        self._target, self._view = target, view
        self._before_frame, self._focus_is_elsewhere = before_frame, focus_is_elsewhere
        self._settings = view.settings
        self._pressed: set[Any] = set()
        self._fast = False
        self._last_step = 0.0
        target.installEventFilter(self)
        before_frame.connect(self._step)

    @Slot()
    def close(self) -> None:
        """Stop handling keys; safe to call twice."""
        self._pressed.clear()
        if is_alive(self._target):
            self._target.removeEventFilter(self)

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
        if key == _Key.Key_Shift:
            self._fast = pressed
            return False
        if key not in _ARROWS:
            return False
        if not pressed:
            ours = key in self._pressed
            if not event.isAutoRepeat():
                self._pressed.discard(key)
            return ours
        if event.modifiers() & ~(_Modifier.ShiftModifier | _Modifier.KeypadModifier):
            return False
        self._fast = bool(event.modifiers() & _Modifier.ShiftModifier)
        if not self._pressed:
            self._last_step = time.monotonic()
        self._pressed.add(key)
        self._view.request_frame()
        return True

    def _toggle_mode(self) -> None:
        in_2d = self._view.mode is ViewMode.MODE_2D
        self._view.set_mode(ViewMode.MODE_3D if in_2d else ViewMode.MODE_2D)

    @Slot()
    def _step(self) -> None:
        if not self._pressed:
            return
        self._view.request_frame()
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
    return bool(event.key() == _Key.Key_D and event.modifiers() == _Modifier.ControlModifier)


#: Package of the messages, by whether the node is in ROS 1.
_PACKAGES = {True: "hector_rviz_plugins", False: "hector_rviz_plugins_msgs"}
#: Namespace of hector_rviz_plugins, likewise; ~ is the node.
_NAMESPACES = {True: "~hector_view_controller", False: "hector_view_controller"}


class ViewServices(QtCore.QObject):
    """The ROS topics and services of the camera.

    Latched topics ``tracked_frame`` and ``view_mode``; services ``move_eye``,
    ``move_eye_and_focus``, ``set_view_mode`` and ``set_tracked_frame``. A failed request is a
    service error with the reason; in ROS 2, which has none, it is answered and logged.

    Args:
        view: The camera.
        session: The session whose node provides them.
        node_name: Full name of the node that ``~`` in the namespace stands for, as RViz has one of
            its own; by default the session's.
    """

    #: :attr:`problem` has changed. Argument: the new text.
    problem_changed = Signal(str)
    #: All topics and services are available.
    opened = Signal()

    def __init__(
        self,
        view: View,
        session: Session,
        node_name: str = "",
    ) -> None:
        super().__init__()
        self._view, self._session = view, session
        self._settings = view.settings
        self._node_name = node_name
        self._node: Node | None = None
        self._applied = self._read_settings()
        self._problem = ""
        self._limit = RateLimit()
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
        """True while topics or services are available."""
        return bool(self._handles)

    def close(self) -> None:
        """Close topics and services; safe to call twice."""
        if not self._closed:
            self._closed = True
            self._close_handles()

    def _read_settings(self) -> _EndpointSettings:
        settings, node = self._settings, self._node
        if node is None:
            return _EndpointSettings(settings.topics, settings.services, "", "")
        above, name = split(self._node_name) if self._node_name else (node.namespace, node.name)
        try:
            wanted = settings.namespace or _NAMESPACES[node.wire == "ros1"]
            namespace = expand(wanted, name, above).rstrip("/")
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
            self._applied = self._read_settings()
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
        if not is_alive(self._session):
            return  # at the end of the program
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
        made = self._pending = _Endpoints()

        def done(result: _Endpoints | Error) -> None:
            if generation != self._generation:
                return
            self._pending = None
            if isinstance(result, Error):
                self._set_problem(str(result))
                if isinstance(result, ServiceError):
                    # An interface that is reloaded offers them until the old one is gone.
                    QtCore.QTimer.singleShot(_RETRY_MS, lambda: self._try_again(generation))
            else:
                self._handles, self._publishers = made.handles, made.publishers
                self._set_problem("")
                self._publish_mode()
                self._publish_frame()
                self.opened.emit()

        self._session.background(lambda: self._make(node, wanted, made), done)

    def _try_again(self, generation: int) -> None:
        if generation == self._generation and not self._closed:
            self._open()

    def _make(self, node: Node, wanted: _EndpointSettings, made: _Endpoints) -> _Endpoints:
        """Create topics and services; runs in the worker thread."""
        package = _PACKAGES[node.wire == "ros1"]
        try:
            if wanted.topics:
                for topic, kind in (
                    ("tracked_frame", "std_msgs/String"),
                    ("view_mode", f"{package}/ViewMode"),
                ):
                    name = f"{wanted.namespace}/{topic}"
                    made.publishers[topic] = node.create_publisher(name, kind, QoS.latched())
                    made.handles.append(made.publishers[topic])
            for name, kind, answer in self._services() if wanted.services else ():
                made.handles.append(
                    node.create_service_server(
                        f"{wanted.namespace}/{name}",
                        f"{package}/srv/{kind}",
                        self._answering(name, answer, raises=node.wire == "ros1"),
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

    def _answering(
        self, name: str, answer: Callable[[Message], None], *, raises: bool
    ) -> Callable[[Message], None]:
        """Return a service's callback; its Errors become failed responses, or are logged."""

        def call(request: Message) -> None:
            try:
                answer(request)
            except Error as error:
                if raises:
                    raise ServiceError(str(error)) from error
                # Without a response the robot would wait for ever.
                if self._limit.allows(name):
                    _log.warning("%s/%s: not done: %s", self.namespace, name, error)

        return call

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


def _close_all(handles: list[Handle]) -> None:
    for handle in handles:
        handle.close()


def _point(point: Any) -> tuple[float, float, float]:
    return point.x, point.y, point.z
