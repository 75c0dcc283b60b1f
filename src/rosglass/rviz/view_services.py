"""The ROS interface of the camera: that of hector_rviz_plugins' view controller."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING, Any, NamedTuple

from rosglass.comm.qos import QoS
from rosglass.errors import Error, ServiceError
from rosglass.qt import QtCore, Signal
from rosglass.ros1.names import expand, split

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.comm.handle import Handle
    from rosglass.comm.node import Node
    from rosglass.comm.publisher import Publisher
    from rosglass.messages import Message
    from rosglass.qml.session import Session
    from rosglass.rviz.view import View

__all__ = ["ViewServices"]

_log = logging.getLogger("rosglass.rviz")
_PACKAGE = "hector_rviz_plugins"


class ViewServices(QtCore.QObject):
    """Lets robots move the camera, and tells them what it does.

    Topics ``tracked_frame`` and ``view_mode``, both latched; services ``move_eye``,
    ``move_eye_and_focus``, ``set_view_mode`` and ``set_tracked_frame``. What cannot be done is an
    error of the service, with the reason.

    Args:
        view: The camera.
        session: Whose node offers them; one of ROS 1.
        node_name: Full name of RViz's own node, which ``~`` stands for.
    """

    #: Why they are not there; empty when they are, or nothing has to be.
    problem_changed = Signal(str)
    #: All that is wanted is there now.
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
        self._rviz = split(node_name)
        self._wanted = self._asked_for()
        self._problem = ""
        self._node: Node | None = None
        self._generation = 0
        self._handles: list[Handle] = []
        #: What the worker is making now.
        self._making: _Made | None = None
        self._publishers: dict[str, Publisher] = {}
        self._closed = False
        session.node_changed.connect(self._node_changed)
        session.connection_changed.connect(self._connection_changed)
        view.mode_changed.connect(self._tell_mode)
        view.tracked_frame_changed.connect(self._tell_frame)
        self._settings.properties.edited.connect(self._on_edited)
        self._node_changed()

    @property
    def namespace(self) -> str:
        """Where topics and services are, as an absolute name; empty where that is no valid one."""
        return self._wanted.namespace

    @property
    def problem(self) -> str:
        """Why they are not there; empty when they are, or nothing has to be."""
        return self._problem

    @property
    def is_open(self) -> bool:
        """Whether there is anything now."""
        return bool(self._handles)

    def close(self) -> None:
        """Withdraw them; safe to call twice."""
        if not self._closed:
            self._closed = True
            self._shut()

    def _asked_for(self) -> _Wanted:
        settings, (above, name) = self._settings, self._rviz
        try:
            namespace = expand(settings.namespace, name, above).rstrip("/")
        except Error as error:
            return _Wanted(settings.topics, settings.services, "", str(error))
        return _Wanted(settings.topics, settings.services, namespace, "")

    def _on_edited(self) -> None:
        wanted = self._asked_for()
        if wanted != self._wanted and not self._closed:
            self._wanted = wanted
            self._open()

    def _node_changed(self) -> None:
        if self._session.node is not self._node and not self._closed:
            self._node = self._session.node
            self._open()

    def _connection_changed(self) -> None:
        """Tell that others have ended the node, and what was made from it with it."""
        if self._node is not None and self._session.state == "failed" and not self._closed:
            self._shut()
            self._tell_problem(self._session.detail)

    def _shut(self) -> None:
        self._generation += 1
        handles, self._handles, self._publishers = self._handles, [], {}
        making, self._making = self._making, None
        if handles:
            self._session.background(lambda: _close_all(handles))
        if making is not None:
            # Made by then, and closed before others take its names: jobs keep their order.
            self._session.background(lambda: _close_all(making.handles))

    def _open(self) -> None:
        self._shut()
        node, generation, wanted = self._node, self._generation, self._wanted
        if node is None or not (wanted.topics or wanted.services):
            self._tell_problem("")
            return
        if wanted.wrong:
            self._tell_problem(wanted.wrong)
            return
        if node.wire != "ros1":
            self._tell_problem(f"{node.url}: the services of the camera are of ROS 1")
            return
        made = self._making = _Made()

        def done(result: _Made | Error) -> None:
            if generation != self._generation:
                return
            self._making = None
            if isinstance(result, Error):
                self._tell_problem(str(result))
            else:
                self._handles, self._publishers = made.handles, made.publishers
                self._tell_problem("")
                self._tell_mode()
                self._tell_frame()
                self.opened.emit()

        self._session.background(lambda: self._make(node, wanted, made), done)

    def _make(self, node: Node, wanted: _Wanted, made: _Made) -> _Made:
        """Make topics and services, on the worker thread."""
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
                        _refusing(answer),
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

    def _tell_mode(self) -> None:
        self._publish("view_mode", mode=int(self._view.mode))

    def _tell_frame(self) -> None:
        self._publish("tracked_frame", data=self._view.tracked_frame)

    def _publish(self, topic: str, **fields: Any) -> None:
        publisher = self._publishers.get(topic)
        if publisher is not None:
            try:
                publisher.publish(**fields)
            except Error as error:
                _log.warning("%s/%s: %s", self.namespace, topic, error)

    def _tell_problem(self, problem: str) -> None:
        if problem != self._problem:
            self._problem = problem
            if problem:
                _log.warning("robots cannot move the camera: %s", problem)
            self.problem_changed.emit(problem)


class _Wanted(NamedTuple):
    """What is to be there, and where; what is wrong with that."""

    topics: bool
    services: bool
    namespace: str
    wrong: str


class _Made:
    """What the worker has made."""

    def __init__(self) -> None:
        self.handles: list[Handle] = []
        self.publishers: dict[str, Publisher] = {}


def _refusing(answer: Callable[[Message], None]) -> Callable[[Message], None]:
    """Have what a callback cannot do be an answer, not a fault of ours."""

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
