"""The element ``TwistCommand``: the one publisher of a robot's velocity, behind all its inputs."""
# ruff: noqa: N815 - the names of properties and signals are QML's

from __future__ import annotations

import math
from contextlib import suppress
from typing import TYPE_CHECKING, Any
from weakref import ref

from rosglass.comm.qos import QoS
from rosglass.controls.steering.command_sender import CommandSender, Limits, Velocity
from rosglass.controls.steering.heartbeat import Heartbeat
from rosglass.controls.steering.in_front import FocusWatch, find_item, obstruction, popup_layer
from rosglass.errors import Error, UnsupportedError
from rosglass.interfaces.names import join_name
from rosglass.qml.elements.element import Element
from rosglass.qml.elements.image_sinks import window_of
from rosglass.qml.engine.dialect import within_namespace
from rosglass.qml.engine.log import context_of, plain_path
from rosglass.qml.engine.properties import ReadOnly, Writable, report, within
from rosglass.qml.engine.session import weak_callback
from rosglass.qt import QtCore, QtGui, QtQuick, Signal, Slot, is_alive

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from rosglass.comm.events import Matched
    from rosglass.comm.node import Node
    from rosglass.qt import QtQml

__all__ = ["TwistCommand"]

_TWIST, _STAMPED = "geometry_msgs/msg/Twist", "geometry_msgs/msg/TwistStamped"
_CAR, _CAR_STAMPED = "ackermann_msgs/msg/AckermannDrive", "ackermann_msgs/msg/AckermannDriveStamped"
#: The types, the first of which is preferred.
_TYPES = (_TWIST, _STAMPED, _CAR, _CAR_STAMPED)
#: Ticks of the session without steering after which an input counts as let go. They are counted
#: on the GUI thread: while that is blocked, a held input cannot steer either.
_SILENT_TICKS = 3
#: Those that have a session, by id: those of one topic steer one at a time.
_COMMANDS: dict[int, ref[TwistCommand]] = {}
#: Errors that QML reports as warnings.
_SCRIPT_ERROR = "Error"


def _command_type(name: str) -> str:
    if not name:
        return ""
    try:
        full = join_name(name)
    except Error as error:
        raise ValueError(f"is not a type name: {error}") from None
    if full not in _TYPES:
        raise ValueError(f"is not one of {', '.join(_TYPES)}")
    return full


class _Input:
    """A control that has steered.

    Attributes:
        item: The control.
        name: Its name for users.
        file: The QML file that calls :meth:`TwistCommand.steer` for it.
        held: Whether it is held.
        off: Why it does not steer until it was let go; empty while it steers.
        silent: Ticks since it steered last.
        shown: The item or window that must be in front.
        kept: See :func:`find_item`.
        window: The window whose changes are observed.
    """

    def __init__(self, item: QtCore.QObject, fallback: QtCore.QObject) -> None:
        context = context_of(item)
        name = context.nameForObject(item) if context is not None else ""
        self.item, self.name = item, item.objectName() or name or type(item).__name__
        self.file, self.off = "", ""
        self.held, self.silent = False, 0
        self.kept: list[Any] = []
        self.shown = find_item(item, self.kept) or find_item(fallback, self.kept)
        self.window: Any = None


class TwistCommand(Element):
    """Steers a robot for several inputs, one at a time. See its page in ``docs/controls``.

    The arbitration between inputs is done on the GUI thread, where they are; the freshness of
    commands is judged on the thread of the :class:`CommandSender`, which also publishes them.
    """

    _HOLDS = ("_inputs", "_steers", "_robot")
    _refusal: str

    #: Steering has ended by another cause than the hand that let go: the reason.
    halted = Signal(str)

    topic = Writable(str, "cmd_vel", then="_move")
    #: Namespace of a relative topic name.
    ns = Writable(str, "", then="_move")
    #: Message type; empty for that of the topic's subscribers.
    type = Writable(str, "", _command_type, then="_move")
    #: Frame of messages with a header.
    frame = Writable(str, "base_link", then="_configure")
    #: Largest speed forward and back, in m/s.
    maxSpeed = Writable(float, 0.5, within(0, 1000, "m/s"), then="_configure")
    #: Largest speed to the sides, in m/s; 0 for robots that cannot.
    maxSideways = Writable(float, 0.0, within(0, 1000, "m/s"), then="_configure")
    #: Largest turn, in rad/s.
    maxTurn = Writable(float, 1.0, within(0, 1000, "rad/s"), then="_configure")
    #: Largest steering angle of car-like robots, in rad.
    maxSteering = Writable(float, 0.5, within(0, math.pi / 2, "rad"), then="_configure")
    #: Largest increase and decrease of the speed, in m/s²; 0 for no limit.
    acceleration = Writable(float, 1.0, within(0, 1000, "m/s²"), then="_configure")
    deceleration = Writable(float, 2.0, within(0, 1000, "m/s²"), then="_configure")
    #: Largest change of the turn, in rad/s²; 0 for no limit.
    turnAcceleration = Writable(float, 4.0, within(0, 1000, "rad/s²"), then="_configure")
    #: Why driving is not allowed now; empty when it is.
    obstacle = Writable(str, "", then="_check")
    #: Whether the robot answers: zeros are repeated until it has for a second.
    reachable = Writable(bool, True, then="_on_connection")
    #: The topic that must be fresh for the robot to be driven, once it was received; empty for its
    #: odometry. And the milliseconds after which it is not; 0 to drive without it.
    heartbeat = Writable(str, "", then="_follow_robot")
    heartbeatTimeout = Writable(int, 1000, within(0, 60_000, "ms"), then="_follow_robot")
    #: Whether an input steers now, and its name.
    active = ReadOnly(bool, False)
    holder = ReadOnly(str, "")
    #: Why what is held does not steer; empty if it does, or nothing is held.
    refusal = ReadOnly(str, "")
    #: The velocity sent now: m/s forward, m/s to the left, and rad/s to the left or a car's angle.
    speed = ReadOnly(float, 0.0)
    sideways = ReadOnly(float, 0.0)
    turn = ReadOnly(float, 0.0)

    def __init__(self, parent: QtCore.QObject | None = None) -> None:
        super().__init__(parent)
        self._inputs: dict[int, _Input] = {}
        self._steers: _Input | None = None
        self._focus = FocusWatch(weak_callback(self._on_focus_lost))
        #: Receives the robot's data; None until there is a session.
        self._robot: Heartbeat | None = None
        #: The type of the topic's subscribers.
        self._found = _TWIST

    # -- what inputs call ------------------------------------------------------------------------

    @Slot(QtCore.QObject, float, float, result=bool)
    @Slot(QtCore.QObject, float, float, float, result=bool)
    def steer(
        self, input: QtCore.QObject | None, forward: float, left: float, sideways: float = 0.0
    ) -> bool:
        """Steer, each from -1 to 1; to be called again within 150 ms for as long as it is held.

        Args:
            input: The control that steers.
            forward: Forward; negative for back.
            left: Turn to the left; negative for the right.
            sideways: To the left without turning.

        Returns:
            Whether it steers the robot; if not, it has to be let go first.
        """
        if input is None:
            self._complain("the first argument is the control that steers")
            return False
        one = self._inputs.get(id(input)) or self._add(input)
        one.silent, was_held, one.held = 0, one.held, True
        wanted = (forward, left, sideways)
        if not all(map(math.isfinite, wanted)):
            self._complain(f"{one.name} steers by {wanted}, which are not all numbers")
            self._end(one, "it steers by what is not a number")
        elif not was_held:
            one.file = self._caller().file
            one.off = self._reason_against(one)
            if not one.off:
                self._begin(one, wanted)
        elif not one.off:
            reason = self._reason_against(one) or self._endpoint.steer(*map(_unit, wanted))
            if reason:
                self._end(one, reason)
        self._show()
        return self._steers is one

    def _complain(self, text: str) -> None:
        text = f"{self.label}.steer(): {text}"
        if self._limit.allows(text):
            self._refuse(text)

    @Slot(QtCore.QObject)
    def release(self, input: QtCore.QObject | None) -> None:
        """Let go: the robot is halted if this control steered it."""
        one = self._inputs.get(id(input))
        if one is None or not one.held:
            return
        one.held, one.off = False, ""
        if one is self._steers:
            self._let_go()
        self._show()

    @Slot()
    def halt(self) -> None:
        """Halt; nothing moves until everything was let go."""
        self._halt("halted by the program")

    # -- the holder ------------------------------------------------------------------------------

    def _add(self, item: QtCore.QObject) -> _Input:
        key = id(item)
        one = self._inputs[key] = _Input(item, self)
        weak, inputs = ref(self), self._inputs

        def on_destroyed(*_: object) -> None:
            command = weak()
            if command is not None and is_alive(command) and inputs.get(key) is one:
                was_held, one.held = one.held, False
                del inputs[key]
                if was_held:
                    command._end(one, f"{one.name} was destroyed")
                    command._show()

        item.destroyed.connect(on_destroyed)
        if isinstance(one.shown, QtQuick.QQuickItem):
            one.shown.visibleChanged.connect(self._check)
            one.shown.enabledChanged.connect(self._check)
            one.shown.windowChanged.connect(self._check)
        return one

    def _reason_against(self, one: _Input) -> str:
        """Return why an input may not steer now; empty if it may."""
        reason = self.obstacle or self._silence()
        if reason:
            return reason
        other = next((i for i in self._inputs.values() if i.held and i is not one), None)
        if other is not None and self._steers is not one:
            return f"{other.name} is held"
        elsewhere = next((c._steers for c in self._others() if c._steers is not None), None)
        if elsewhere is not None:
            return f"{elsewhere.name} is held"
        if self._endpoint is None:
            return self._problem or self._disconnected() or "the topic is not advertised yet"
        return self._disconnected() or obstruction(one.shown)

    def _silence(self) -> str:
        return self._robot.silence() if self._robot is not None else ""

    def _begin(self, one: _Input, wanted: tuple[float, float, float]) -> None:
        self._watch_window(one)
        if one.window is not None:
            self._focus.start()
        self._steers = one
        self._endpoint.begin(*map(_unit, wanted))

    def _others(self) -> list[TwistCommand]:
        """Return the other commands of the same topic: each control without one makes its own."""
        if self._endpoint is None:
            return []
        topic, commands = self._endpoint.publisher.topic, [one() for one in _COMMANDS.values()]
        return [
            one
            for one in commands
            if one is not None and one is not self and is_alive(one) and one.node is self.node
            if one._endpoint is not None and one._endpoint.publisher.topic == topic
        ]

    def _watch_window(self, one: _Input) -> None:
        window = window_of(one.shown) if isinstance(one.shown, QtQuick.QQuickItem) else one.shown
        if window is not None and window is not one.window:
            one.window = window
            window.visibleChanged.connect(self._check)
            window.windowStateChanged.connect(self._check)
            layer = popup_layer(window) if isinstance(window, QtQuick.QQuickWindow) else None
            if layer is not None:
                layer.visibleChanged.connect(self._check)

    def _let_go(self) -> None:
        self._steers = None
        if self._endpoint is not None:
            self._endpoint.halt()

    def _end(self, one: _Input, reason: str) -> None:
        """Keep an input off until it was let go; halt if it is the one that steers."""
        one.off = reason
        if one is self._steers:
            self._let_go()
            self._show()
            if is_alive(self):
                self.halted.emit(reason)

    def _halt(self, reason: str) -> None:
        """Keep all inputs off that are held, and halt."""
        for one in list(self._inputs.values()):
            if one.held and one is not self._steers:
                one.off = one.off or reason
        if self._steers is not None:
            self._end(self._steers, reason)

    @Slot()
    def _check(self) -> None:
        """Halt if the input that steers may no longer do so."""
        holder = self._steers
        if not is_alive(self) or holder is None:
            return
        reason = self._reason_against(holder)
        if reason:
            self._halt(reason)

    def _on_focus_lost(self) -> None:
        if is_alive(self):
            self._halt("the window is not in front")

    def _on_sender_halt(self, _: str) -> None:
        """Follow a halt of the sender's own."""
        if is_alive(self) and self._endpoint is not None and self._endpoint.ended:
            self._halt(self._endpoint.ended)

    @Slot()
    def _on_quit(self) -> None:
        self._halt("the program ends")

    @Slot()
    def _on_reload(self) -> None:
        if is_alive(self):
            self._halt("the interface is loaded again")

    def _on_script_errors(self, warnings: Sequence[QtQml.QQmlError]) -> None:
        """Halt if an error is in the file that steers: it may never let go."""
        holder = self._steers
        if not is_alive(self) or holder is None:
            return
        for warning in warnings:
            file, text = plain_path(warning.url().toString()), warning.description()
            if file == holder.file and _SCRIPT_ERROR in text:
                self._halt(f"{file}:{warning.line()}: {text}")

    # -- what QML sees ---------------------------------------------------------------------------

    def _show(self) -> None:
        if not is_alive(self):
            return
        holder, sender = self._steers, self._endpoint
        now = sender.velocity if sender is not None else Velocity()
        off = next((one for one in self._inputs.values() if one.held and one.off), None)
        report(
            self,
            refusal=f"{off.off}: let go first" if off is not None else "",
            active=holder is not None,
            holder=holder.name if holder is not None else "",
            speed=now.forward,
            sideways=now.sideways,
            turn=now.turn,
        )
        if is_alive(self):
            self._announce_problem()

    def _get_problem(self) -> str:
        sender = self._endpoint
        failed = sender.problem if sender is not None and self._steers is not None else ""
        return self._refusal or failed or super()._get_problem()

    @Slot()
    def _on_tick(self) -> None:
        for one in list(self._inputs.values()):
            one.silent += 1
            if one.held and one.silent >= _SILENT_TICKS:
                one.held, one.off = False, ""
                if one is self._steers:
                    self._let_go()
        if self._steers is None:
            self._focus.stop()
        if self._endpoint is not None:
            self._set_problem(self._endpoint.publisher.problem)
        self._show()

    # -- the endpoint ----------------------------------------------------------------------------

    def _find_session(self) -> bool:
        if not super()._find_session():
            return False
        key = id(self)
        _COMMANDS[key] = ref(self)
        self._cleanup["commands"] = lambda: _COMMANDS.pop(key, None)  # type: ignore[assignment]
        app: Any = QtCore.QCoreApplication.instance()
        app.aboutToQuit.connect(self._on_quit)
        if self._session is not None:
            self._session.reloading.connect(self._on_reload)
        self._robot = Heartbeat(self, self._runtime)
        self._robot.staleChanged.connect(self._on_connection)
        self._cleanup["focus"] = self._focus.stop
        if isinstance(app, QtGui.QGuiApplication):
            app.focusWindowChanged.connect(self._check)
        engine = self._runtime.engine if self._runtime is not None else None
        if engine is not None:
            on_errors = weak_callback(self._on_script_errors)
            engine.warnings.connect(on_errors)

            def disconnect() -> None:
                if is_alive(engine):
                    engine.warnings.disconnect(on_errors)

            self._cleanup["warnings"] = disconnect
        return True

    @Slot()
    def _move(self) -> None:
        """Halt on the old topic before it is left."""
        self._halt("the topic has changed")
        self._schedule()

    @Slot()
    def _configure(self) -> None:
        """Pass the limits to the sender."""
        sender = self._endpoint
        if sender is None or self._config is None:
            return
        is_car = self._config[2] in (_CAR, _CAR_STAMPED)
        fastest = Velocity(
            self.maxSpeed,
            0.0 if is_car else self.maxSideways,
            self.maxSteering if is_car else self.maxTurn,
        )
        turn = 0.0 if is_car else self.turnAcceleration
        sender.limits = Limits(fastest, self.acceleration, self.deceleration, turn)
        sender.frame = self.frame

    def _update(self) -> None:
        super()._update()
        self._follow_robot()

    @Slot()
    def _follow_robot(self) -> None:
        if self._robot is not None:
            commands = self._config[1] if self._config is not None else ""
            self._robot.follow(commands, self.heartbeat, self.ns, self.heartbeatTimeout)

    def _wanted(self) -> tuple[Node, str, str] | None:
        node = self.node
        if node is None or not self.topic:
            return None
        try:
            topic = node.resolve(within_namespace(self.ns, self.topic))
        except Error as error:
            self._set_problem(str(error))
            return None
        return node, topic, self.type or self._find_type(node, topic)

    def _find_type(self, node: Node, topic: str) -> str:
        """Return the type of the topic's subscribers; the last one found if there are none."""
        try:
            known = {one.type for one in node.subscriptions(topic)}
        except Error:  # the node has just been closed
            known = set()
        if self._found not in known:
            self._found = next((kind for kind in _TYPES if kind in known), self._found)
        return self._found

    def _factory(self, node: Node, topic: str, kind: str) -> Callable[[], CommandSender]:
        executor, on_halt = self._executor, weak_callback(self._on_sender_halt)

        def make() -> CommandSender:
            publisher = node.create_publisher(topic, kind, QoS.command())
            return CommandSender(
                publisher,
                _composer(kind, node),
                lambda reason: executor.post(lambda: on_halt(reason)),
            )

        return make

    def _on_created(self, endpoint: CommandSender) -> None:
        self._configure()
        endpoint.connected = self.reachable and not self._disconnected() and not self._silence()
        with suppress(UnsupportedError):  # a recording, which has no subscribers
            endpoint.publisher.on_matched(weak_callback(self._on_matched), self._executor)
        self._set_problem("")

    def _dispose(self, session: Any, endpoint: CommandSender) -> None:
        endpoint.halt()  # now, whatever the worker is doing
        super()._dispose(session, endpoint)

    def _on_closed(self, endpoint: CommandSender | None) -> None:
        if endpoint is not None:
            self._halt("the topic is no longer advertised")
            self._show()

    def _on_matched(self, event: Matched) -> None:
        # Any of them: the one that left may be the robot, and the others recorders.
        if is_alive(self) and event.change < 0 and self._endpoint is not None:
            self._halt(f"{self._endpoint.publisher.topic} has lost a subscriber")

    @Slot()
    def _on_graph(self) -> None:
        if not self.type:
            self._schedule()

    @Slot()
    def _on_connection(self) -> None:
        if not is_alive(self):
            return
        lost = self._disconnected() or self._silence()
        if self._endpoint is not None:
            self._endpoint.connected = self.reachable and not lost
        if lost:
            self._halt(lost)
            self._show()


def _unit(value: float) -> float:
    return max(-1.0, min(1.0, value))


def _composer(kind: str, node: Node) -> Callable[[Velocity, str], dict[str, Any]]:
    """Return a function that makes messages of a type, given the velocity and the frame."""

    def twist(now: Velocity, _: str) -> dict[str, Any]:
        return {
            "linear": {"x": now.forward, "y": now.sideways, "z": 0.0},
            "angular": {"x": 0.0, "y": 0.0, "z": now.turn},
        }

    def car(now: Velocity, _: str) -> dict[str, Any]:
        return {"speed": now.forward, "steering_angle": now.turn}

    plain, name = (twist, "twist") if kind in (_TWIST, _STAMPED) else (car, "drive")
    if kind in (_TWIST, _CAR):
        return plain
    return lambda now, frame: {
        "header": {"stamp": node.now(), "frame_id": frame},
        name: plain(now, frame),
    }
