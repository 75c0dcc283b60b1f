"""The display InteractiveMarkers: what a robot lets the user drag, click, and choose from menus.

A server publishes changes on ``<namespace>/update``, each with a number. A client gets all markers
first: in ROS 1 from the latched topic ``update_full``, in ROS 2 from a service. After a gap in the
numbers it gets them again. What the user does goes to ``<namespace>/feedback``.
"""
# ruff: noqa: N815 - the names of properties and signals are QML's

from __future__ import annotations

import contextlib
import logging
import time
from collections import deque
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, cast

from rosglass.errors import Error
from rosglass.qml.elements.element import single_shot
from rosglass.qml.elements.message_queue import MessageQueue, drop_oldest
from rosglass.qml.engine.properties import ReadOnly, report
from rosglass.qml.engine.session import weak_callback
from rosglass.qt import QtCore, QtQml, Signal, Slot, is_alive
from rosglass.scene.configs.rviz_formats import read_marker_namespace, write_marker_namespace
from rosglass.scene.configs.settings import Setting
from rosglass.scene.displays.display import OUTDATED_ALPHA
from rosglass.scene.displays.interactive_marker_controls import (
    MENU_SELECT,
    Control,
    InteractiveMarker,
)
from rosglass.scene.displays.interactive_marker_messages import (
    MAX_PARTS,
    MarkerUpdate,
    read_update,
)
from rosglass.scene.displays.marker_meshes import MarkerMeshes
from rosglass.scene.displays.topic_display import TopicDisplay
from rosglass.scene.render.scene_tree import Group

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Mapping

    from rosglass.comm.node import Node
    from rosglass.comm.qos import QoS
    from rosglass.messages import Message
    from rosglass.qml.engine.runtime import Runtime
    from rosglass.scene.data.resource_retriever import ResourceRetriever
    from rosglass.scene.displays.scene_frames import SceneFrames
    from rosglass.scene.render.camera import Camera
    from rosglass.scene.tools.pointer_event import PointerEvent


__all__ = ["InteractiveMarkersDisplay"]

_MAX_SERVERS, _MAX_EARLY, _MAX_LINES = 20, 100, 20
#: Letters of a name in the status.
_MAX_NAME = 80
#: Seconds without a message after which a server that sends keep-alives, usually twice a second, is
#: gone.
_KEEP_ALIVE_TIMEOUT_S = 3.0
#: Milliseconds until markers that were not received are requested again.
_RETRY_MS = 2000
#: Milliseconds between two feedbacks of a drag.
_FEEDBACK_MS = 33
_MENU_FILE = Path(__file__).with_name("MarkerMenu.qml")


class _Connection:
    """The endpoints of a client of interactive markers; created and closed by the worker.

    Args:
        node: The node.
        namespace: Absolute namespace of the server.
        qos: QoS to request for updates.
        queue: Receives all that is sent.
        on_failed: Called, in any thread, with why the markers were not received.
    """

    def __init__(
        self,
        node: Node,
        namespace: str,
        qos: QoS,
        queue: MessageQueue,
        on_failed: Callable[[str], None],
    ) -> None:
        self._node, self._namespace, self._qos = node, namespace, qos
        self._queue, self._on_failed = queue, on_failed
        #: The subscription of all markers in ROS 1, while they are wanted.
        self._full: Any = None
        self._open: list[Any] = []
        self.client: Any = None
        try:
            self._open.append(
                node.create_subscription(
                    f"{namespace}/update", None, qos=qos, raw_callback=queue.receive
                )
            )
            self.feedback = node.create_publisher(
                f"{namespace}/feedback", "visualization_msgs/InteractiveMarkerFeedback", 100
            )
            self._open.append(self.feedback)
            if node.wire != "ros1":
                self.client = node.create_service_client(
                    f"{namespace}/get_interactive_markers",
                    "visualization_msgs/GetInteractiveMarkers",
                )
                self._open.append(self.client)
        except Error:
            self.close()
            raise

    def request(self) -> None:
        """Request all markers; they go to the queue."""
        if self.client is None:
            self.stop_request()
            self._full = self._node.create_subscription(
                f"{self._namespace}/update_full",
                None,
                qos=self._qos,
                raw_callback=self._queue.receive,
            )
        else:
            self.client.call_async(timeout=None).on_done(self._on_response)

    def _on_response(self, call: Any) -> None:
        error = call.exception()
        if error is None:
            self._queue.put(call.result, "visualization_msgs/GetInteractiveMarkers")
        else:
            self._on_failed(str(error))

    def stop_request(self) -> None:
        """Receive changes only."""
        full, self._full = self._full, None
        if full is not None:
            full.close()

    def close(self) -> None:
        """Close all endpoints; safe to call twice."""
        self.stop_request()
        while self._open:
            self._open.pop().close()


class _Server:
    """The known state of a server.

    Attributes:
        number: The number of its last change; None while its markers are requested.
        early: Changes that were received before its markers.
        beats: True if it sends keep-alives.
        heard: Time of the last message, by :func:`time.monotonic`.
        silent: True once its keep-alives have stopped.
        root: Its markers.
    """

    def __init__(self) -> None:
        self.number: int | None = None
        self.early: deque[MarkerUpdate] = deque()
        self.beats = self.silent = False
        self.heard = time.monotonic()
        self.root = Group()
        self.markers: dict[str, InteractiveMarker] = {}


class InteractiveMarkersDisplay(TopicDisplay):
    """Markers that the user drags and clicks. See its page in ``docs/scene.md``."""

    TYPE = "InteractiveMarkers"
    MESSAGES = ("visualization_msgs/InteractiveMarkerUpdate",)
    #: Both RViz name the server differently.
    TOPIC_KEYS = ("Interactive Markers Namespace", "Update Topic")
    KEEPS_ALL: ClassVar[bool] = True
    EAGER: ClassVar[bool] = True
    SETTINGS: ClassVar[dict[str, Setting]] = {}
    _HOLDS = ("_view", "used_view", "_camera", "_asked")

    topic = Setting(
        "Interactive Markers Namespace", "topic", "",
        "Namespace of the server, or its update topic.", then="_on_topic",
    )  # fmt: skip
    showDescriptions = Setting(
        "Show Descriptions", "bool", True, "Show the descriptions of markers."
    )
    showAxes = Setting("Show Axes", "bool", False, "Show the axes of markers.")
    showVisualAids = Setting(
        "Show Visual Aids", "bool", False, "Show the axis of a drag while it lasts."
    )
    enableTransparency = Setting(
        "Enable Transparency", "bool", True, "Draw arrows and rings translucent.",
        then="_redraw",
    )  # fmt: skip

    #: A menu is wanted: entries with ``id``, ``title`` and ``children``, and x and y in the view.
    #: With a handler, no menu is opened; the handler calls :meth:`selectMenuEntry`.
    menuRequested = Signal("QVariantList", float, float)  # type: ignore[arg-type]
    #: Names of the interactive markers.
    markersChanged = Signal()
    markers: ReadOnly[list[str]] = ReadOnly(cast("type[list[str]]", "QStringList"), [])

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        self._servers: dict[str, _Server] = {}
        self.meshes = MarkerMeshes(self._in_background, self._on_mesh)
        self._dragging: InteractiveMarker | None = None
        self._requested = False
        #: The control whose menu is open, and where it was clicked.
        self._asked: tuple[Control, Any] | None = None
        self._ready: Any = None
        #: True while the service exists.
        self._is_served = False
        #: The view that the scene belongs to, and that in which the mouse has used a marker.
        self._view: Any = None
        self.used_view: Any = None
        #: Its camera, until that moves.
        self._camera: Camera | None = None
        super().__init__(parent, runtime)
        self._retry_request = single_shot(self, self._request_again)
        self._feedback_timer = QtCore.QTimer(self)
        self._feedback_timer.setInterval(_FEEDBACK_MS)
        self._feedback_timer.timeout.connect(self._send_drag)

    # -- the view --------------------------------------------------------------------------------

    def join(self, scene: SceneFrames) -> None:
        """Start to be shown in a scene, and turn texts to its view."""
        super().join(scene)
        view: Any = scene.parent()
        if view is not None and hasattr(view, "cameraChanged"):
            self._view = view
            view.cameraChanged.connect(self._on_camera)
            view.toolChanged.connect(self._on_tool)

    @property
    def camera(self) -> Camera | None:
        """The camera that controls are turned to; None before the view has a size."""
        if self._view is None or not is_alive(self._view):
            return None
        if self._camera is None:
            with contextlib.suppress(Error):
                self._camera = self._view.camera()
        return self._camera

    @Slot()
    def _on_camera(self) -> None:
        self._camera = None
        for marker in self.all_markers():
            marker.face()

    @Slot()
    def _on_tool(self) -> None:
        self._restyle()

    def is_active(self, control: Control) -> bool:
        """Return whether a control that is not always visible is shown now."""
        if self._view is None or not is_alive(self._view):
            return True
        if self._view.tool != "Interact":
            return False
        dragging = self._dragging
        if dragging is None or dragging.dragged is control:
            return True
        return not self._view.tools.current.hideInactiveObjects

    def _restyle(self) -> None:
        for marker in self.all_markers():
            marker.restyle()

    def _redraw(self) -> None:
        for marker in self.all_markers():
            marker.draw()

    def all_markers(self) -> list[InteractiveMarker]:
        """Return the markers of all servers."""
        return [marker for server in self._servers.values() for marker in server.markers.values()]

    # -- the connection --------------------------------------------------------------------------

    @property
    def namespace(self) -> str:
        """The namespace of the server, as it was given."""
        return str(self.topic).removesuffix("/update_full").removesuffix("/update").rstrip("/")

    def preparer(self) -> Callable[[Message], Any]:
        """Return the function that reads updates."""
        named = self.node is not None and self.node.wire == "ros1"
        return lambda message: read_update(message, named=named)

    def _wanted(self) -> tuple[Any, ...] | None:
        node = self.node
        if not self._find_topic() or not self.namespace:
            return None
        self._resolved = self._resolve(f"{self.namespace}/update")
        if not self._resolved:
            return None
        return node, self._resolved.removesuffix("/update"), self.profile()

    def _factory(self, *wanted: Any) -> Callable[[], Any]:
        node, namespace, qos = wanted
        executor, failed = self._executor, weak_callback(self._on_request_failed)
        types = (*self.MESSAGES, "visualization_msgs/InteractiveMarkerInit")
        queue = self._queue = MessageQueue(
            self.preparer(), types, executor, weak_callback(self._on_items), 1000, eager=True
        )

        def on_failed(text: str) -> None:
            executor.post(lambda: failed(text))

        return lambda: _Connection(node, namespace, qos, queue, on_failed)

    def _on_created(self, endpoint: Any) -> None:
        super()._on_created(endpoint)
        self._drop_markers()
        self._requested = False
        if endpoint.client is None:
            self._request()
            return
        self._is_served = False
        ready = weak_callback(self._on_service)
        self._ready = endpoint.client.on_ready_change(ready, self._executor)
        self._on_service(endpoint.client.ready)

    def _on_closed(self, endpoint: Any) -> None:
        watch, self._ready = self._ready, None
        if watch is not None:
            watch.close()
        self._retry_request.stop()
        super()._on_closed(endpoint)

    def _on_service(self, ready: bool) -> None:
        """Request the markers of a server that has appeared."""
        if not is_alive(self) or self._endpoint is None:
            return
        # What a listener added just before the first check reports is known by then.
        is_new, self._is_served = ready and not self._is_served, ready
        if is_new:
            self._request_all()
        elif not ready and not self._servers:
            self.set_status("Server", "warn", f"no server in {self.namespace}")

    def _request_all(self) -> None:
        """Request the markers of all servers anew: others may be there by the same names."""
        for server in self._servers.values():
            server.number = None
            server.early.clear()
        self._requested = False
        self._request()

    def _request(self) -> None:
        """Request all markers, unless they are requested already."""
        connection, session = self._endpoint, self._session
        if connection is None or session is None or self._requested:
            return
        self._requested = True
        session.background(connection.request)
        if connection.client is None:
            self._retry_request.start(_RETRY_MS)

    @Slot()
    def _request_again(self) -> None:
        if is_alive(self):
            self._requested = False
            # In ROS 1, the request of a first server lasts until there is one.
            is_first = not self._servers and self._endpoint is not None
            if is_first and self._endpoint.client is None:
                self._requested = True
            elif is_first or any(one.number is None for one in self._servers.values()):
                self._request()

    def _on_request_failed(self, text: str) -> None:
        if is_alive(self) and self._endpoint is not None:
            self.set_status("Server", "warn", f"the markers were not received: {text}")
            self._retry_request.start(_RETRY_MS)

    def publish(
        self, marker: InteractiveMarker, feedback: dict[str, Any], command: str = ""
    ) -> bool:
        """Send a feedback; the status says so if no server receives it.

        Args:
            marker: The marker.
            feedback: Fields of the message, without `client_id`.
            command: What the user wants, for the status bar if it is not received; empty for what
                is sent again until it is, or is of no consequence.

        Returns:
            Whether a server receives it.
        """
        problem = self._publish(marker, feedback)
        if not problem:
            self.delete_status("Feedback")
            return True
        self.set_status("Feedback", "error", problem)
        if command:
            self.announce(f"{command}: {problem}")
        return False

    def _publish(self, marker: InteractiveMarker, feedback: dict[str, Any]) -> str:
        """Send a feedback; return why no server receives it, as far as is known."""
        connection, node, why = self._endpoint, self.node, self._disconnected()
        if connection is None or node is None:
            return f"not sent: {why or 'its topic is not advertised yet'}"
        feedback["client_id"] = f"{node.namespace.rstrip('/')}/{node.name}/{self.name}"
        try:
            count = connection.feedback.subscription_count()
            # In ROS 1, servers stay connected without the master.
            if why and not count:
                return f"not sent: {why}"
            connection.feedback.publish(feedback)
        except Error as error:
            return f"not sent: {error}"
        topic = connection.feedback.topic
        if not count:
            return f"sent on {topic}, which no server receives"
        servers = [one for one in self._servers.values() if marker.record.name in one.markers]
        if not why and self._outdated:
            why = "the server is gone"
        elif not why and servers and all(one.silent for one in servers):
            why = f"the server has sent no keep-alive for more than {_KEEP_ALIVE_TIMEOUT_S:g} s"
        return f"sent on {topic}, but {why}" if why else ""

    def announce(self, text: str) -> None:
        """Log feedback that did not reach a server, and show it in the last used view."""
        self._log(f"{self.label}: {text}", logging.WARNING)
        view = self.used_view or self._view
        if view is not None and is_alive(view):
            view.tools.announce(text)

    # -- updates ---------------------------------------------------------------------------------

    def _on_items(self) -> None:
        if not is_alive(self):  # it has no attributes then
            return
        if self._outdated:
            self._request_all()
        super()._on_items()
        # It may be the answer that cannot be read.
        is_unread = self._requested and "Message" in self.status_lines
        if is_unread and not self._retry_request.isActive():
            self._retry_request.start(_RETRY_MS)

    def _show_waiting(self) -> None:
        while self._waiting:
            item = self._waiting.popleft()
            self._on_update(item.data._replace(size=item.size))

    def _on_update(self, update: MarkerUpdate) -> None:
        server = self._servers.get(update.server)
        if server is None:
            if len(self._servers) >= _MAX_SERVERS:
                self.set_status("Server", "error", f"only {_MAX_SERVERS} servers are shown")
                return
            server = self._servers[update.server] = _Server()
            self.root.add(server.root)
        server.heard = time.monotonic()
        # ROS 1's always do; in ROS 2, some still do.
        is_ros1 = self._endpoint is not None and self._endpoint.client is None
        server.beats = server.beats or update.alive or is_ros1
        if update.full:
            self._begin(server, update)
        elif server.number is None:
            if not update.alive:
                # What is dropped is a gap: all are requested again.
                server.early.append(update)
                drop_oldest(server.early, _MAX_EARLY, lambda one: one.size)
            self._request()
        elif update.number != server.number + (not update.alive):
            self._on_gap(server, update)
        else:
            self._apply(server, update)
        self._report(update.server, server)

    def _begin(self, server: _Server, update: MarkerUpdate) -> None:
        """Show all markers of a server, then what has changed since."""
        if server.number is not None:
            return  # ROS 1 publishes them after each change
        early = [one for one in server.early if one.number > update.number]
        if early and early[0].number != update.number + 1:
            # Not the newest: in ROS 1, that will follow.
            self._requested = False
            self._retry_request.start(_RETRY_MS)
            return
        server.number = update.number
        server.early.clear()
        kept = {one.name for one in update.markers}
        for name in [name for name in server.markers if name not in kept]:
            self._erase(server, name)
        self._apply(server, update)
        for one in early:
            if server.number is not None and one.number == server.number + 1:
                self._apply(server, one)
            else:
                self._on_gap(server, one)
        if all(one.number is not None for one in self._servers.values()):
            self._requested = False
            self._retry_request.stop()
            if self._endpoint is not None and self._session is not None:
                self._session.background(self._endpoint.stop_request)

    def _on_gap(self, server: _Server, update: MarkerUpdate) -> None:
        """Request all markers anew, as changes are missing; show the old ones until then."""
        server.number = None
        server.early.clear()
        if not update.alive:
            server.early.append(update)
        self._request()

    def _apply(self, server: _Server, update: MarkerUpdate) -> None:
        server.number = update.number
        parts = sum(marker.record.parts for marker in self.all_markers())
        for record in update.markers:
            marker = server.markers.get(record.name)
            parts -= 0 if marker is None else marker.record.parts
            are_too_many = parts + record.parts > MAX_PARTS
            if are_too_many or not record.controls:
                self._erase(server, record.name)
                text = f"it is not shown: all have more than {MAX_PARTS} controls and shapes"
                self.set_line(record.name, text if are_too_many else record.problem)
                continue
            parts += record.parts
            if marker is not None:
                marker.change(record)
            else:
                marker = server.markers[record.name] = InteractiveMarker(self, record)
                server.root.add(marker.root)
        for name, frame, stamp, pose in update.poses:
            marker = server.markers.get(name)
            if marker is None:
                self.set_line(name, "its pose was received, but not the marker")
            elif isinstance(pose, str):
                self.set_line(name, pose)
            else:
                marker.take_pose(frame, stamp, pose)
        for name in update.erased:
            self._erase(server, name)
        names = sorted(marker.record.name for marker in self.all_markers())
        if names != self.markers:
            report(self, markers=names)

    def _erase(self, server: _Server, name: str) -> None:
        marker = server.markers.pop(name, None)
        self.set_line(name, "")
        if marker is not None:
            if marker is self._dragging:
                self.on_drag(None)
            marker.controls.clear()
            marker.root.remove()

    def _drop_markers(self) -> None:
        self.on_drag(None)
        for server in self._servers.values():
            for marker in server.markers.values():
                marker.controls.clear()
            server.root.remove()
        self._servers.clear()
        for line in [one for one in self.status_lines if one.startswith("Marker ")]:
            self.delete_status(line)
        report(self, markers=[])

    def reset(self) -> None:
        """Drop all markers, and request them again."""
        self._waiting.clear()
        self._drop_markers()
        self.meshes.forget_failed()
        self.delete_status("Mesh")
        self._asked = None
        if self._endpoint is not None and self.shown:
            self._requested = False
            self._request()

    # -- status ----------------------------------------------------------------------------------

    def set_line(self, name: str, problem: str) -> None:
        """Set the problem of a marker; an empty text if there is none."""
        line = f"Marker {name[:_MAX_NAME]}"
        if not problem:
            self.delete_status(line)
        elif line in self.status_lines or len(self.status_lines) < _MAX_LINES:
            self.set_status(line, "error", problem)

    def _report(self, name: str, server: _Server) -> None:
        line = f"Server {name[:_MAX_NAME]}".strip()
        if server.silent:
            text = f"no keep-alive for more than {_KEEP_ALIVE_TIMEOUT_S:g} s"
            self.set_status(line, "warn", f"{text}; its markers may be out of date")
        elif server.number is None:
            self.set_status(line, "warn", "waiting for its markers")
        else:
            self.set_status(line, "ok", f"{len(server.markers)} markers")

    def _on_tick(self) -> None:
        now = time.monotonic()
        for name, server in self._servers.items():
            silent = server.beats and now - server.heard > _KEEP_ALIVE_TIMEOUT_S
            if silent != server.silent:
                server.silent = silent
                server.root.alpha = OUTDATED_ALPHA if silent else 1.0
                if not silent:
                    # It may be another one by the same name.
                    server.number = None
                    self._request()
                self._report(name, server)
        super()._on_tick()

    def _is_old(self) -> bool:
        return not any(one.number is not None and not one.silent for one in self._servers.values())

    def _show_age(self) -> None:
        self._is_gone = self._outdated and bool(self.all_markers()) and bool(self.enabled)
        self._fade()
        if self._is_gone:
            when = time.strftime("%H:%M:%S", time.localtime(self._arrived))
            self.set_status("Data", "warn", f"the server is gone; its last message is of {when}")
        else:
            self.delete_status("Data")

    # -- frames ----------------------------------------------------------------------------------

    def on_transforms(self) -> None:
        """Follow the frames of markers."""
        for marker in self.all_markers():
            marker.place()

    def on_fixed_frame(self) -> None:
        """Place all markers in another fixed frame."""
        for marker in self.all_markers():
            marker.place_anew()

    def followed_frames(self) -> set[str]:
        """Return the frames that markers follow."""
        return {marker.frame for marker in self.all_markers() if not marker.stamp}

    def _fade(self) -> None:
        self.root.alpha = OUTDATED_ALPHA if self._is_gone else 1.0
        for marker in self.all_markers():
            is_outdated = not marker.stamp and marker.frame in self._outdated_frames
            marker.root.alpha = OUTDATED_ALPHA if is_outdated else 1.0

    # -- drags and menus -------------------------------------------------------------------------

    def on_drag(self, marker: InteractiveMarker | None) -> None:
        """Send the poses of a marker that is dragged; None after the drag."""
        if marker is self._dragging:
            return
        self._dragging = marker
        if marker is None:
            self._feedback_timer.stop()
        else:
            self._feedback_timer.start()
        self._restyle()

    @Slot()
    def _send_drag(self) -> None:
        if self._dragging is not None:
            self._dragging.send_drag()

    def show_menu(self, control: Control, event: PointerEvent) -> None:
        """Open the menu of a marker, or let a handler in QML do so."""
        entries = list(control.marker.record.menu)
        if not entries:
            return
        self._asked = (control, event.point)
        meta = self.metaObject()
        method = meta.method(meta.indexOfSignal("menuRequested(QVariantList,double,double)"))
        if self.isSignalConnected(method):
            self.menuRequested.emit(entries, event.x, event.y)
            return
        view: Any = event.view
        engine = QtQml.qmlEngine(view)
        if engine is None:
            return  # a view without QML has no menus
        component = QtQml.QQmlComponent(engine, QtCore.QUrl.fromLocalFile(str(_MENU_FILE)))
        place = QtCore.QPointF(event.x, event.y)
        menu: Any = component.createWithInitialProperties(
            {"entries": entries, "parent": view, "place": place}
        )
        if menu is None:
            self.set_status("Menu", "error", component.errorString())
            return
        menu.setParent(view)
        menu.picked.connect(self.selectMenuEntry)
        menu.closed.connect(menu.deleteLater)

    @Slot(float)
    def selectMenuEntry(self, entry: float) -> None:  # noqa: N802 - QML's name
        """Choose an entry of the menu that was requested last.

        Args:
            entry: Its ``id``.
        """
        asked, number = self._asked, int(entry)
        if asked is None:
            self.announce(
                f"menu entry {number}: not sent: no marker has opened a menu, or not since"
            )
            return
        control, point = asked
        program = control.marker.record.programs.get(number)
        if program is not None:
            # RViz runs commands of a robot's message; a robot must not do that.
            text = f"entry {number} asks to run {program!r} on this computer, which is not done"
            self.set_status("Menu", "warn", text)
            return
        control.marker.send(MENU_SELECT, control.record.name, point, number)

    # -- meshes ----------------------------------------------------------------------------------

    def _in_background(
        self, work: Callable[[ResourceRetriever], Any], then: Callable[[Any], None]
    ) -> None:
        if self.scene is not None:
            self.scene.load(work, then)

    def _on_mesh(self, uri: str, problem: str) -> None:
        if not is_alive(self):
            return
        if problem:
            self.set_status("Mesh", "error", problem)
            return
        self._draw_mesh(uri)

    def _draw_mesh(self, uri: str) -> None:
        for marker in self.all_markers():
            for control in marker.controls.values():
                if control.uses_mesh(uri):
                    control.draw()

    def on_files(self, uris: Collection[str]) -> None:
        """Read meshes again that were missing."""
        failed = self.meshes.forget_failed(uris)
        if failed:
            self.delete_status("Mesh")
        for uri in failed:
            self._draw_mesh(uri)

    # -- files -----------------------------------------------------------------------------------

    def _load_topic(self, saved: Mapping[str, Any]) -> list[str]:
        self.set("Interactive Markers Namespace", read_marker_namespace(saved))
        return []

    def _save_topic(self, kept: dict[str, Any], before: Mapping[str, Any], ros: int) -> None:  # noqa: ARG002
        write_marker_namespace(kept, self.namespace, ros)
