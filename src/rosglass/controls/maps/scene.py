"""The element ``MapScene``: the topics of a map, their layers, the transforms, and the robot."""
# ruff: noqa: N802, N815 - the names of slots and signals are QML's

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from rosglass.comm.executor import Dispatcher
from rosglass.controls.maps.camera import MapCamera, Plane, Track
from rosglass.controls.maps.tiles import TileImages
from rosglass.errors import Error
from rosglass.interfaces.names import ros1_name
from rosglass.qml.elements.element import Element
from rosglass.qml.elements.tf_buffer import TfLink
from rosglass.qml.engine.dialect import resolve_namespace, within_namespace
from rosglass.qml.engine.properties import ReadOnly, Writable, at_least, one_of, report
from rosglass.qml.engine.session import GuiExecutor, weak_callback
from rosglass.qt import Property, QtCore, QtGui, Signal, Slot, is_alive

if TYPE_CHECKING:
    from collections.abc import Iterable

    from rosglass.comm.node import Node
    from rosglass.controls.maps.layers import MapLayer
    from rosglass.tf import TransformBuffer

__all__ = ["MapScene"]

#: In a list of topics: all that have the type.
_ALL = "*"
#: Topics of a kind that are found by their type.
_MOST_FOUND = 4
#: Types of actions that drive to one goal, or through several; the preferred one first.
_GOAL_ACTIONS = ("nav2_msgs/action/NavigateToPose", "move_base_msgs/action/MoveBase")
_WAYPOINT_ACTIONS = ("nav2_msgs/action/FollowWaypoints", "nav2_msgs/action/NavigateThroughPoses")
#: move_base's topic for goals.
_OLD_GOAL = "move_base_simple/goal"
#: Milliseconds between two looks at the transforms, while they change.
_PLACE_MS = 33
#: Metres between two points of the track, and in one step beyond which a new one begins.
_TRACK_STEP_M, _JUMP_M = 0.05, 1.0


def _found(kind: str, name: str, types: Iterable[str], wanted: tuple[str, ...]) -> bool:
    """Return whether a topic belongs to a kind of layers, by its type and name."""
    if not any(ros1_name(one) in wanted for one in types):
        return False
    if kind in ("map", "costmap"):
        return ("costmap" in name) == (kind == "costmap")
    return kind not in ("particles", "footprint") or kind.rstrip("s") in name


def _topics(names: list[Any]) -> list[str]:
    return [str(name) for name in names]


def _frame_name(name: str) -> str:
    """Return a frame without ROS 1's leading slash."""
    return name.lstrip("/")


class MapScene(Element):
    """The contents of a map: its layers, and where the robot is. See the page of ``MapView``."""

    _HOLDS = ("worker", "images", "_link", "track")

    layersChanged = Signal()
    #: The layers, or where they and the robot are, changed: paint again.
    repaint = Signal()

    #: The map; empty for the first one by its type. And further topics; ``*`` for those by type.
    topic = Writable(str, "")
    costmaps = Writable(list, [_ALL], _topics)
    scans = Writable(list, [_ALL], _topics)
    paths = Writable(list, [_ALL], _topics)
    footprints = Writable(list, [_ALL], _topics)
    particles = Writable(list, [_ALL], _topics)
    ns = Writable(str, "")
    #: The namespace of the topics ``tf`` and ``tf_static``, where they are not global.
    tfNs = Writable(str, "")
    #: The fixed frame; empty for that of the map.
    frame = Writable(str, "", _frame_name, then="_on_frame")
    #: The frame of the robot; without a namespace.
    robotFrame = Writable(str, "base_link", _frame_name, then="_on_frame")
    #: Milliseconds without a new transform after which the robot's position is old.
    timeout = Writable(int, 1500, at_least(0), then="_on_tick", unit="ms")
    camera = Writable(QtCore.QObject, None, then="_on_camera")
    #: Colours of the map: ``theme``, ``map``, ``costmap`` or ``raw``.
    colorScheme = Writable(
        str, "theme", one_of("theme", "map", "costmap", "raw"), then="_on_colors"
    )
    freeColor = Writable(QtGui.QColor, QtGui.QColor(255, 255, 255), then="_on_colors")
    occupiedColor = Writable(QtGui.QColor, QtGui.QColor(0, 0, 0), then="_on_colors")

    layers = Property(list, lambda self: list(self._layers.values()), notify=layersChanged)
    fixedFrame = ReadOnly(str, "")
    #: Whether a map is shown, at a known place.
    hasMap = ReadOnly(bool, False)
    #: Metres and radians, counter-clockwise from x, in the fixed frame.
    robotX = ReadOnly(float, 0.0, notify="robotMoved")
    robotY = ReadOnly(float, 0.0, notify="robotMoved")
    robotYaw = ReadOnly(float, 0.0, notify="robotMoved")
    robotMoved = Signal()
    #: Whether the robot's position is known, and not old.
    robotKnown = ReadOnly(bool, False)
    robotSeen = ReadOnly(bool, False)
    #: Metres driven since the track began.
    driven = ReadOnly(float, 0.0)
    #: Whether nothing of what is shown is up to date.
    stale = ReadOnly(bool, True)
    age = ReadOnly(float, -1.0)
    #: How many topics by type are not shown.
    more = ReadOnly(int, 0)
    #: The servers' names and types, by what they do: ``goal``, ``waypoints``; empty without one.
    goalAction = ReadOnly(str, "")
    goalType = ReadOnly(str, "")
    waypointsAction = ReadOnly(str, "")
    waypointsType = ReadOnly(str, "")
    #: The topic for goals without such a server: ROS 1's if it has subscribers.
    goalTopic = ReadOnly(str, "goal_pose")

    def __init__(self, parent: QtCore.QObject | None = None) -> None:
        super().__init__(parent)
        self._layers: dict[tuple[str, str], MapLayer] = {}
        self._link: TfLink | None = None
        #: Why the robot has no position; what is wrong with the layers and the robot.
        self._lost = self._wrong = ""
        self.worker = Dispatcher("rosglass map")
        self._images: TileImages | None = None
        self.track = Track(_TRACK_STEP_M, _JUMP_M)
        self._timer = QtCore.QTimer(self)
        self._timer.setSingleShot(True)
        self._timer.setInterval(_PLACE_MS)
        self._timer.timeout.connect(weak_callback(self._place))
        worker = self.worker
        self.destroyed.connect(worker.close)

    # For its layers.

    @property
    def images(self) -> TileImages:
        """The images of the tiles."""
        if self._images is None:
            images = self._images = TileImages(
                self._runtime.engine if self._runtime is not None else None
            )
            self._cleanup["images"] = images.close
        return self._images

    @property
    def gui(self) -> GuiExecutor:
        """The executor of the GUI thread."""
        return self._executor

    @property
    def buffer(self) -> TransformBuffer | None:
        """The transforms; None while there is no node."""
        return None if self._link is None else self._link.buffer

    def changed(self) -> None:
        """Place and paint what a layer has received, soon."""
        if not self._timer.isActive():
            self._timer.start(0)

    # Topics.

    def _wanted(self) -> tuple[Any, ...] | None:
        node = self.node
        return None if node is None else (node, self.tfNs)

    def _create_endpoint(self, wanted: tuple[Any, ...]) -> None:
        session = self._session
        assert session is not None
        node, _ = wanted
        link = self._link = TfLink.join(session, node, self.tfNs or "/", self)
        watch = link.buffer.on_update(weak_callback(self._on_transforms), session.executor)
        self._set_endpoint((link, watch))

    def _dispose(self, session: Any, endpoint: Any) -> None:  # noqa: ARG002 - the base's
        link, watch = endpoint
        watch.close()
        link.leave(self)

    def _on_closed(self, endpoint: Any) -> None:  # noqa: ARG002 - the base's
        self._link = None
        self._forget_robot()

    def _update(self) -> None:
        super()._update()
        self._find_topics()

    @Slot()
    def _on_graph(self) -> None:
        self._find_topics()

    def _find_topics(self) -> None:
        """Create layers for topics that appeared, and remove those that are not wanted."""
        node = self.node
        if node is None:
            wanted: list[tuple[str, str]] = []
        else:
            try:
                wanted = self._select(node)
            except Error:  # the node was closed
                return
        if wanted == [*self._layers]:
            return
        before, self._layers = self._layers, {}
        for key in wanted:
            self._layers[key] = before.pop(key) if key in before else self._new_layer(*key)
        self.layersChanged.emit()
        for layer in before.values():
            layer.deleteLater()
        self.changed()

    def _new_layer(self, kind: str, topic: str) -> MapLayer:
        from rosglass.controls.maps.layers import LAYERS  # noqa: PLC0415 - numpy takes 70 ms

        return LAYERS[kind](self, topic)

    def _select(self, node: Node) -> list[tuple[str, str]]:
        """Return kind and topic of the wanted layers, those at the bottom first."""
        from rosglass.controls.maps.layers import LAYERS  # noqa: PLC0415 - as above

        lists = {
            "map": [self.topic or _ALL],
            "costmap": self.costmaps,
            "particles": self.particles,
            "path": self.paths,
            "footprint": self.footprints,
            "scan": self.scans,
        }
        within = resolve_namespace(node, self.ns).rstrip("/") + "/" if self.ns else "/"
        graph = {name: types for name, types in node.topics().items() if name.startswith(within)}
        chosen: dict[tuple[str, str], None] = {}
        more, problem = 0, ""
        for kind, layer in LAYERS.items():
            named = []
            for one in lists[kind]:
                if one != _ALL:
                    try:
                        named.append(node.resolve(within_namespace(self.ns, one)))
                    except Error as error:  # the others are shown
                        problem = f"MapView: {error}"
            found: list[str] = []
            if _ALL in lists[kind]:
                # Those that are shown stay: their publisher may come back.
                found = [
                    topic
                    for shown, topic in self._layers
                    if shown == kind and topic.startswith(within)
                ]
                found += [
                    name
                    for name, types in sorted(graph.items())
                    if name not in found
                    and _found(kind, name, types, layer.FOUND)
                    and not name.endswith("_updates")
                ]
            most = 1 if kind == "map" else _MOST_FOUND
            more += 0 if kind == "map" else max(0, len(found) - most)
            chosen |= dict.fromkeys((kind, name) for name in [*named, *found[:most]])
        self._set_problem(problem)
        report(self, more=more)
        self._find_actions(node, within)
        return [*chosen]

    def _find_actions(self, node: Node, within: str) -> None:
        """Report the servers that drive the robot."""
        found = {
            kind: name
            for name, kinds in sorted(node.actions().items(), reverse=True)
            for kind in kinds
            if name.startswith(within)
        }
        (goal, waypoints) = (
            next((kind for kind in kinds if kind in found), "")
            for kinds in (_GOAL_ACTIONS, _WAYPOINT_ACTIONS)
        )
        report(
            self,
            goalAction=found.get(goal, ""),
            goalType=goal,
            waypointsAction=found.get(waypoints, ""),
            waypointsType=waypoints,
            goalTopic=_OLD_GOAL if self.subscribers(within + _OLD_GOAL) else "goal_pose",
        )

    # Transforms.

    def _on_transforms(self) -> None:
        if is_alive(self) and not self._timer.isActive():
            self._timer.start(_PLACE_MS)

    def _on_frame(self) -> None:
        self._forget_robot()
        self.changed()

    def _on_camera(self) -> None:
        camera = self.camera
        if camera is not None and not isinstance(camera, MapCamera):
            self._refuse(f"{self.label}: camera is not a MapCamera")
            self._camera = None
        elif camera is not None:
            # Signals do not reach methods of objects that QML extends, but they reach functions.
            camera.changed.connect(weak_callback(self._follow_camera))
        self.changed()

    def _follow_camera(self) -> None:
        if not is_alive(self):
            return
        for layer in self._layers.values():
            tiles = getattr(layer, "layer", None)
            if tiles is not None:
                tiles.refresh()
        self.repaint.emit()

    def _on_colors(self) -> None:
        for layer in self._layers.values():
            if layer.KIND == "map":
                layer.recolor()  # type: ignore[attr-defined]

    def _find_frame(self, buffer: TransformBuffer) -> str:
        """Return the fixed frame: the one that is set, the map's, or the robot's root."""
        if self.frame:
            return str(self.frame)
        for layer in self._layers.values():
            if layer.frame and layer.KIND == "map":
                return layer.frame
        names = buffer.frame_names()
        if "map" in names:
            return "map"
        if self.robotFrame in names:
            tree, name = buffer.tree(), self.robotFrame
            for _ in range(len(names)):
                parent = tree[name].parent
                if not parent:
                    break
                name = parent
            return name
        return next((layer.frame for layer in self._layers.values() if layer.frame), "")

    def _place(self) -> None:
        """Place the layers and the robot by the newest transforms."""
        buffer = self.buffer if is_alive(self) else None
        if buffer is None:
            return
        fixed = self._find_frame(buffer)
        if fixed != self.fixedFrame:
            self._forget_robot()
            for layer in self._layers.values():
                if hasattr(layer, "on_fixed_frame"):
                    layer.on_fixed_frame()
            report(self, fixedFrame=fixed)
        if not fixed:
            return
        for layer in self._layers.values():
            layer.place(buffer, fixed)
        self._place_robot(buffer, fixed)
        self._judge()
        self.repaint.emit()

    def _place_robot(self, buffer: TransformBuffer, fixed: str) -> None:
        from rosglass.controls.maps.layers import place_of  # noqa: PLC0415 - as above

        self._lost = ""
        if not self.robotFrame:
            report(self, robotKnown=False, robotSeen=False)
            return
        pose, self._lost = place_of(buffer, fixed, self.robotFrame, 0)
        if pose is None:
            report(self, robotKnown=False)
            return
        x, y, yaw = pose.e, pose.f, math.atan2(pose.c, pose.a)
        if (x, y, yaw) != (self.robotX, self.robotY, self.robotYaw) or not self.robotSeen:
            self.track.append(x, y)
        # At once: who follows the robot moves there at its first pose, also if it stands still.
        report(
            self,
            robotX=x,
            robotY=y,
            robotYaw=yaw,
            driven=self.track.length,
            robotKnown=not self._is_robot_old(),
            robotSeen=True,
        )

    def _is_robot_old(self) -> bool:
        buffer = self.buffer
        if buffer is None or not self.fixedFrame or not self.robotFrame:
            return True
        if self._session is None or self._session.state != "connected":
            return True
        return 0 < self.timeout / 1000 < buffer.silence(self.fixedFrame, self.robotFrame)

    def _forget_robot(self) -> None:
        self.track = Track(_TRACK_STEP_M, _JUMP_M)
        self._lost = ""
        report(self, robotKnown=False, robotSeen=False, driven=0.0)

    @Slot()
    def clearTrack(self) -> None:
        """Begin a new track."""
        self.track.clear()
        report(self, driven=0.0)
        self.repaint.emit()

    # Judging.

    def _get_problem(self) -> str:
        return super()._get_problem() or self._wrong

    @Slot()
    def _on_tick(self) -> None:
        if self.robotSeen:
            report(self, robotKnown=not self._lost and not self._is_robot_old())
        if any(layer.waits for layer in self._layers.values()):
            self.changed()
        self._judge()

    def _judge(self) -> None:
        shown = [layer for layer in self._layers.values() if layer.shown]
        fresh = [layer for layer in shown if not layer.stale]
        wrong = [f"{layer.topic}: {layer.problem}" for layer in shown if layer.problem]
        disconnected = self._disconnected()
        if disconnected:
            wrong = [disconnected]
        elif self._link is not None and self._link.problem:
            wrong.append(self._link.problem)
        elif self.robotSeen and not self.robotKnown:
            wrong.insert(0, self._describe_robot())
        elif self._lost and any(layer.age >= 0 for layer in shown):
            wrong.append(f"no robot: {self._lost}")
        self._wrong = "; ".join(wrong)[:1000]
        ages = [layer.age for layer in shown if layer.age >= 0]
        if report(
            self,
            hasMap=any(layer.KIND == "map" and layer.pose is not None for layer in shown),
            stale=not fresh or (self.robotSeen and not self.robotKnown) or bool(disconnected),
            age=min(ages, default=-1.0),
        ):
            self._announce_problem()

    def _describe_robot(self) -> str:
        if self._lost:
            return f"the robot's position is unknown: {self._lost}"
        buffer = self.buffer
        seconds = 0.0 if buffer is None else buffer.silence(self.fixedFrame, self.robotFrame)
        return f"the robot's position is {seconds:.1f} s old"

    # For QML.

    @Slot(str, result=str)
    def absolute(self, topic: str) -> str:
        """Return the absolute name of a topic; unchanged if it is invalid or there is no node."""
        node = self.node
        try:
            return topic if node is None else node.resolve(topic)
        except Error:
            return topic

    @Slot(str, result=int)
    def subscribers(self, topic: str) -> int:
        """Return how many nodes receive a topic."""
        node = self.node
        try:
            return 0 if node is None else len(node.subscriptions(node.resolve(topic)))
        except Error:
            return 0

    @Slot(result=QtCore.QRectF)
    def bounds(self) -> QtCore.QRectF:
        """Return the rectangle of all maps and the robot in metres; its y is the lower edge."""
        boxes = [
            box
            for layer in self._layers.values()
            if layer.shown and layer.KIND in ("map", "costmap")
            for box in [layer.bounds()]  # type: ignore[attr-defined]
            if box is not None
        ]
        if not boxes and self.robotSeen:
            boxes.append((self.robotX - 5, self.robotY - 5, self.robotX + 5, self.robotY + 5))
        if not boxes:
            return QtCore.QRectF()
        left, bottom, right, top = (
            pick(box[n] for box in boxes) for n, pick in enumerate((min, min, max, max))
        )
        return QtCore.QRectF(left, bottom, right - left, top - bottom)

    @Slot(float, float, result=str)
    def describe(self, x: float, y: float) -> str:
        """Return the coordinates of a point, in metres, and the value of the map there."""
        text = f"{x:.2f}, {y:.2f}"
        for layer in self._layers.values():
            grid = getattr(layer, "grid", None)
            if layer.KIND == "map" and grid is not None and layer.pose is not None:
                pose = layer.pose.after(Plane.pose(*grid.pose))
                value = grid.tiles.value_at(*pose.inverse().apply(x, y))
                if value is not None:
                    text += f" · {'unknown' if value < 0 else value}"
        return text
