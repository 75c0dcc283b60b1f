"""The element ``Gamepad``: a gamepad that steers, and is published as ``sensor_msgs/Joy``."""
# ruff: noqa: N815 - the names of slots and signals are QML's

from __future__ import annotations

import logging
import math
import threading
import time
from collections import deque
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from rosglass.comm.qos import QoS
from rosglass.controls.steering.gamepad_devices import Element as Control
from rosglass.controls.steering.gamepad_devices import Pad, Snapshot, devices, parse_element
from rosglass.controls.steering.in_front import find_item, obstruction
from rosglass.errors import Error
from rosglass.qml.elements.element import Element
from rosglass.qml.engine.dialect import resolve_namespace, within_namespace
from rosglass.qml.engine.properties import ReadOnly, Writable, report, within
from rosglass.qml.engine.session import weak_callback
from rosglass.qt import QJSValue, QtCore, QtGui, Signal, Slot, is_alive

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.comm.node import Node
    from rosglass.messages import Message
    from rosglass.qml.engine.runtime import Runtime

__all__ = ["Gamepad"]

_log = logging.getLogger("rosglass.gamepad")

_JOY, _FEEDBACK = "sensor_msgs/msg/Joy", "sensor_msgs/msg/JoyFeedbackArray"
#: Seconds after which a state of the gamepad is too old to steer with.
_FRESH_S = 0.15
#: Seconds after its connection in which a gamepad may not have reported yet what is held.
_SETTLE_S = 0.5
#: Milliseconds between two updates of what is shown of it.
_SHOW_MS = 33
#: Messages with everything let go that end what was published.
_NEUTRAL = 3
_NEUTRAL_RATE = 20.0
#: Seconds that a rumble lasts, as with joy_node; a newer one replaces it.
_RUMBLE_S = 1.0
_MAX_RUMBLE_S = 10.0
_TYPE_RUMBLE = 1
#: Entries of a feedback message that are looked at.
_MOST_FEEDBACK = 64
_MOST_SNAPSHOTS = 64


class _Inbox:
    """States on their way to the GUI thread: each change of a button, and the newest of axes.

    Args:
        wake: Has :meth:`take` called soon; from any thread.
    """

    def __init__(self, wake: Callable[[], None]) -> None:
        self._wake = wake
        self._lock = threading.Lock()
        self._waiting: deque[Snapshot] = deque(maxlen=_MOST_SNAPSHOTS)
        self._keys: Any = None

    def put(self, snapshot: Snapshot) -> None:
        keys = [(pad.id, pad.buttons, pad.hats) for pad in snapshot.pads]
        with self._lock:
            first = not self._waiting
            if not first and keys == self._keys:
                self._waiting.pop()
            self._waiting.append(snapshot)
            self._keys = keys
        if first:
            self._wake()

    def take(self) -> list[Snapshot]:
        with self._lock:
            taken = list(self._waiting)
            self._waiting.clear()
        return taken


class _Motors:
    """The motors of the gamepad in use; for the node's thread as well."""

    def __init__(self) -> None:
        self.pad_id = -1
        self._strong = self._weak = 0.0

    def feed(self, message: Message) -> None:
        """Apply a JoyFeedbackArray, or the JoyFeedback that ROS 2's joy_node receives."""
        entries: Any = message.array if hasattr(message, "array") else [message]
        for entry in list(entries[:_MOST_FEEDBACK]):
            if entry.type != _TYPE_RUMBLE or entry.id not in (0, 1):
                _log.debug("feedback of type %d, id %d is not supported", entry.type, entry.id)
            elif not 0 <= entry.intensity <= 1:
                _log.warning("feedback is ignored: intensity %g is not 0 to 1", entry.intensity)
            elif entry.id == 0:
                self._strong = float(entry.intensity)
            else:
                self._weak = float(entry.intensity)
        devices.rumble(self.pad_id, self._strong, self._weak, _RUMBLE_S)


class _Endpoints:
    """The publisher of Joy, and the subscription of its feedback; either can be missing."""

    def __init__(self, node: Node, topic: str, feedback: str, motors: _Motors) -> None:
        self._node = node
        self._handles: list[Any] = []
        self._publisher: Any = None
        #: The state published last, and its dead zone; None after everything was let go.
        self._last: tuple[Pad, float] | None = None
        if topic:
            self._publisher = node.create_publisher(topic, _JOY, QoS.command())
            self._handles.append(self._publisher)
        try:
            if feedback:
                # Without a type: ROS 1's nodes send arrays, ROS 2's joy_node gets single ones.
                self._handles.append(node.create_subscription(feedback, None, motors.feed))
        except Error:
            self.close()
            raise

    @property
    def problem(self) -> str:
        """The publisher's problem; empty without one."""
        return "" if self._publisher is None else str(self._publisher.problem)

    def send(self, pad: Pad, dead_zone: float, is_last: bool = False) -> None:
        """Publish a gamepad's state."""
        if self._publisher is not None:
            self._last = None if is_last else (pad, dead_zone)
            self._publisher.publish(
                header={"stamp": self._node.now(), "frame_id": "joy"},
                axes=pad.joy_axes(dead_zone),
                buttons=list(pad.buttons),
            )

    def close(self) -> None:
        """End; the last message says that everything was let go."""
        if self._last is not None:
            pad, dead_zone = self._last
            with suppress(Error):
                for _ in range(_NEUTRAL):
                    self.send(pad.released(), dead_zone, is_last=True)
        for handle in self._handles:
            handle.close()


class Gamepad(Element):
    """A gamepad that steers a robot. See its page in ``docs/controls``."""

    #: A button of the gamepad, by name; while the window is in front.
    pressed = Signal(str, arguments=["button"])
    released = Signal(str, arguments=["button"])
    #: The button that stops; whichever window is in front.
    stopPressed = Signal()

    enabled = Writable(bool, True, then="_judge")
    #: Name of the gamepad, a part of it, or its number in `devices`; empty for the first one.
    device = Writable(str, "", then="_judge")
    #: Whether it counts while another window is in front, too.
    anyWindow = Writable(bool, False, then="_judge")
    deadZone = Writable(float, 0.05, within(0, 0.9), then="_judge")
    #: Names of controls, such as ``({ boost: "b5" })``, in addition to SDL's.
    names = Writable(QJSValue, write="_set_names", read=lambda self: self._names_value)

    #: Topic of sensor_msgs/Joy; empty to publish none.
    topic = Writable(str, "")
    feedbackTopic = Writable(str, "")
    ns = Writable(str, "")
    autorepeat = Writable(float, 20.0, within(0, 1000, "per second"), then="_judge")

    #: The TwistCommand that it steers.
    command = Writable(QtCore.QObject, write="_set_command", read=lambda self: self._command)
    forward = Writable(str, "lefty", then="_judge")
    left = Writable(str, "leftx", then="_judge")
    sideways = Writable(str, "", then="_judge")
    deadMan = Writable(str, "leftshoulder", then="_judge")
    turbo = Writable(str, "rightshoulder", then="_judge")
    #: Share of the highest speed without turbo, and with it.
    speedShare = Writable(float, 0.5, within(0, 1), then="_judge")
    turboShare = Writable(float, 1.0, within(0, 1), then="_judge")
    stopButton = Writable(str, "", then="_judge")

    devices = ReadOnly(list, [])
    connected = ReadOnly(bool, False)
    name = ReadOnly(str, "")
    axes = ReadOnly(list, [])
    buttons = ReadOnly(list, [])
    axisNames = ReadOnly(list, [])
    buttonNames = ReadOnly(list, [])
    #: Whether a hand steers with it.
    held = ReadOnly(bool, False)
    #: Why it does not steer now; empty if it would.
    refusal = ReadOnly(str, "")

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        super().__init__(parent, runtime)
        self._command: Any = None
        self._names_value = QJSValue()
        self._own_names: dict[str, Control] = {}
        self._snapshot = Snapshot()
        self._pad: Pad | None = None
        self._inbox: _Inbox | None = None
        self._motors = _Motors()
        #: Whether a hand was off the gamepad since it was connected, or its window came to front.
        self._is_armed = False
        self._is_steering = False
        #: When the gamepad in use was found, by :func:`time.monotonic`.
        self._found_at = 0.0
        #: The state that was published last; and messages to send before falling silent.
        self._published: Pad | None = None
        self._neutral_left = 0
        #: Why there is no gamepad, and which controls it does not have.
        self._device_problem = self._missing_problem = ""
        #: The item or window that it is declared in, and the objects between them.
        self._item: Any = None
        self._kept: list[Any] = []
        self._repeat = QtCore.QTimer(self)
        self._repeat.setTimerType(QtCore.Qt.TimerType.PreciseTimer)
        self._repeat.timeout.connect(self._on_repeat)
        self._show = QtCore.QTimer(self)
        self._show.setSingleShot(True)
        self._show.setInterval(_SHOW_MS)
        self._show.timeout.connect(self._report_state)

    # -- devices -----------------------------------------------------------------------------------

    def _find_session(self) -> bool:
        if not super()._find_session():
            return False
        executor, on_change = self._executor, weak_callback(self._on_change)
        inbox = self._inbox = _Inbox(lambda: executor.post(on_change))
        self._cleanup["devices"] = devices.listen(inbox.put)
        app = QtGui.QGuiApplication.instance()
        if isinstance(app, QtGui.QGuiApplication):
            judge = weak_callback(self._judge_if_alive)

            def on_focus(_window: object) -> None:
                judge()

            app.focusWindowChanged.connect(on_focus)

            def disconnect() -> None:
                if is_alive(app):
                    app.focusWindowChanged.disconnect(on_focus)

            self._cleanup["focus"] = disconnect
        return True

    def _judge_if_alive(self) -> None:
        if is_alive(self):
            self._judge()

    def _on_change(self) -> None:
        """Handle the states that have arrived from the devices' thread."""
        if not is_alive(self) or self._inbox is None:
            return
        for snapshot in self._inbox.take():
            self._apply(snapshot)
            if not is_alive(self):
                return

    def _apply(self, snapshot: Snapshot) -> None:
        before = self._pad
        self._snapshot = snapshot
        if not self._show.isActive():
            self._show.start()
        self._judge()
        if is_alive(self) and before is not None and self._pad is not None:
            self._signal_buttons(before, self._pad)

    def _choose(self) -> Pad | None:
        """Return the gamepad to use: the present one while it is connected and wanted."""
        pads, wanted = self._snapshot.pads, self.device.strip()
        if wanted.isdigit():
            return pads[int(wanted)] if int(wanted) < len(pads) else None
        fitting = [pad for pad in pads if wanted.lower() in pad.name.lower()]
        exact = [pad for pad in fitting if pad.name == wanted]
        for pad in exact or fitting:
            if self._pad is not None and pad.id == self._pad.id:
                return pad
        return next(iter(exact or fitting), None)

    def _set_device_problems(self, device: str, missing: str) -> None:
        if (device, missing) != (self._device_problem, self._missing_problem):
            self._device_problem, self._missing_problem = device, missing
            self._log(device or missing, logging.ERROR if device else logging.WARNING)
            self._announce_problem()

    def _get_problem(self) -> str:
        return self._device_problem or self._missing_problem or self._problem

    # -- controls ----------------------------------------------------------------------------------

    def _set_names(self, value: QJSValue | None) -> None:
        given = value.toVariant() if isinstance(value, QJSValue) else value
        names: dict[str, Control] = {}
        for name, text in (given or {}).items() if isinstance(given or {}, dict) else ():
            control = parse_element(str(text))
            if control is None:
                self._refuse(
                    f"Gamepad: names: {name}: {str(text)!r:.40} is not an axis (a0, or -a0 for the "
                    "other direction), a button (b0) or a direction of a hat (h0.1 up, .2 right, "
                    ".4 down, .8 left)"
                )
                return
            names[str(name)] = control
        if given and not names:
            self._refuse('Gamepad: names is an object such as ({ boost: "b5" })')
            return
        self._names_value = value if isinstance(value, QJSValue) else QJSValue()
        self._own_names = names
        self.namesChanged.emit()  # type: ignore[attr-defined]
        self._judge()

    def _find(self, pad: Pad, text: str) -> tuple[Control, bool] | None:
        """Return the control with a name, and whether it is reversed; None if it has none."""
        is_reversed = text.startswith("-")
        name = text[1:] if is_reversed else text
        control = self._own_names.get(name) or pad.names.get(name) or parse_element(name)
        return (control, is_reversed) if control is not None and pad.has(control) else None

    def _axis(self, pad: Pad, text: str) -> float:
        found = self._find(pad, text) if text else None
        if found is None:
            return 0.0
        value = pad.axis(found[0], self.deadZone)
        return 0.0 - value if found[1] else value

    def _is_down(self, pad: Pad, text: str) -> bool:
        found = self._find(pad, text) if text else None
        return found is not None and pad.is_pressed(found[0])

    def _missing(self, pad: Pad) -> str:
        """Return which of the named controls the gamepad does not have; empty if it has all."""
        used = ["stopButton"]
        if self._command is not None:
            used += ["forward", "left", "sideways", "deadMan", "turbo"]
        for key in used:
            text = getattr(self, key)
            if text and self._find(pad, text) is None:
                has = ", ".join(sorted(pad.names)) or (
                    f"a0 to a{len(pad.axes) - 1}, b0 to b{len(pad.buttons) - 1}"
                )
                return f'{pad.name} has no control "{text}" (Gamepad.{key}); it has {has}'
        return ""

    def _label(self, pad: Pad, control: Control) -> str:
        for names in (self._own_names, pad.names):
            for name, one in names.items():
                if str(one) == str(control):
                    return name
        return str(control)

    def _signal_buttons(self, before: Pad, after: Pad) -> None:
        """Emit signals for buttons that changed."""
        if before.id != after.id:
            return
        if self._is_down(after, self.stopButton) and not self._is_down(before, self.stopButton):
            self.stopPressed.emit()
        for at, (old, new) in enumerate(zip(before.buttons, after.buttons, strict=True)):
            if old != new and is_alive(self) and not self._window_obstacle():
                signal = self.pressed if new else self.released
                signal.emit(self._label(after, Control("b", at)))

    # -- steering ----------------------------------------------------------------------------------

    def _set_command(self, command: QtCore.QObject | None) -> None:
        if command is not None and not all(
            callable(getattr(command, name, None)) for name in ("steer", "release", "halt")
        ):
            self._refuse("Gamepad: command is not a TwistCommand")
            return
        if command is self._command:
            return
        self._let_go()
        self._command = command
        self.commandChanged.emit()  # type: ignore[attr-defined]
        self._judge()

    def _window_obstacle(self) -> str:
        """Return why the gamepad does not count; empty if it does."""
        if not self.enabled:
            return "switched off"
        if self.anyWindow:
            return ""
        if not is_alive(self._item):
            self._item = find_item(self, self._kept)
        return obstruction(self._item)

    def _judge(self) -> None:
        """Choose the gamepad, and steer or let go by its present state."""
        chosen, before = self._choose(), self._pad
        if before is not None and (chosen is None or chosen.id != before.id):
            self._lose(before)
        if chosen is not None and (before is None or chosen.id != before.id):
            self._found_at = self._snapshot.at
        pad = self._pad = chosen
        self._motors.pad_id = -1 if pad is None else pad.id
        self._set_device_problems(self._snapshot.problem, "" if pad is None else self._missing(pad))
        is_fresh = time.monotonic() - self._snapshot.at < _FRESH_S
        obstacle = refusal = self._window_obstacle() if pad is not None else "no gamepad"
        if obstacle or pad is None:
            self._let_go()
            self._is_armed = False
        elif is_alive(self._command) and is_fresh:
            refusal = self._steer(pad)
        if is_alive(self):
            self._publish_change(None if obstacle else pad)
            report(
                self,
                connected=pad is not None,
                name="" if pad is None else pad.name,
                held=self._is_steering,
                refusal=refusal,
            )

    def _steer(self, pad: Pad) -> str:
        """Steer or let go; return why what is held does not count, empty if it does."""
        share = self.turboShare if self._is_down(pad, self.turbo) else self.speedShare
        names = (self.forward, self.left, self.sideways)
        wanted = [share * self._axis(pad, name) for name in names]
        is_held = self._is_down(pad, self.deadMan) if self.deadMan else any(wanted)
        if not is_held:
            self._is_armed |= self._snapshot.at - self._found_at >= _SETTLE_S
            self._let_go()
        elif self._is_armed:
            command = self._command
            if not self._is_steering:
                self._is_steering = True
                # If QML destroys this object.
                self._cleanup["steering"] = lambda: command.halt() if is_alive(command) else None
            command.steer(self, *wanted[: 3 if self.sideways else 2])
        else:
            return "let go first"
        return ""

    def _let_go(self) -> None:
        if self._is_steering:
            self._is_steering = False
            self._cleanup.pop("steering", None)
            if is_alive(self._command):
                self._command.release(self)

    def _lose(self, pad: Pad) -> None:
        """Let go of a gamepad that is unplugged, or not wanted any more."""
        if self._is_steering:
            self._log(f"{pad.name} was disconnected while it steered", logging.WARNING)
        self._let_go()
        self._is_armed = False

    # -- Joy ---------------------------------------------------------------------------------------

    def _wanted(self) -> tuple[Node, str, str] | None:
        node = self.node
        if node is None or not (self.topic or self.feedbackTopic):
            return None
        feedback = self.feedbackTopic or f"{self.topic}/set_feedback"
        namespace = resolve_namespace(node, self.ns) if self.ns else ""
        return (
            node,
            within_namespace(namespace, self.topic),
            within_namespace(namespace, feedback),
        )

    def _factory(self, node: Node, topic: str, feedback: str) -> Callable[[], _Endpoints]:
        motors = self._motors
        return lambda: _Endpoints(node, topic, feedback, motors)

    def _on_created(self, endpoint: _Endpoints) -> None:  # noqa: ARG002 - the base's
        self._set_problem("")
        self._published = None
        self._judge()

    def _publish_change(self, pad: Pad | None) -> None:
        """Publish a state that has changed; None is the end of publishing."""
        if pad is None:
            if self._published is not None and not self._neutral_left:
                self._neutral_left = _NEUTRAL
                self._published = self._published.released()
                self._on_repeat()
                self._start_repeat(_NEUTRAL_RATE)
            return
        self._neutral_left = 0
        if pad != self._published:
            self._published = pad
            self._send(pad)
            self._start_repeat(self.autorepeat)

    def _start_repeat(self, rate: float) -> None:
        if rate > 0:
            self._repeat.start(max(1, round(1000 / rate)))
        else:
            self._repeat.stop()

    @Slot()
    def _on_repeat(self) -> None:
        """Publish the last state again; or, at the end, everything let go for some times."""
        pad = self._published
        if pad is None:
            self._repeat.stop()
        elif self._neutral_left:
            self._send(pad)
            self._neutral_left -= 1
            if not self._neutral_left:
                self._published = None
                self._repeat.stop()
        elif time.monotonic() - self._snapshot.at < _FRESH_S:
            self._send(pad)

    def _send(self, pad: Pad) -> None:
        endpoint: _Endpoints | None = self._endpoint
        if endpoint is None:
            return
        try:
            endpoint.send(pad, self.deadZone, is_last=self._neutral_left > 0)
        except Error as error:
            self._log(f"Gamepad: nothing was published: {error}", logging.WARNING)

    @Slot(float, float, float)
    def rumble(self, strong: float, weak: float, seconds: float) -> None:
        """Let the motors run.

        Args:
            strong: The slow, heavy motor, 0 to 1.
            weak: The fast, light one, 0 to 1.
            seconds: 0 to 10.
        """
        for what, value, most in (
            ("strong", strong, 1.0),
            ("weak", weak, 1.0),
            ("seconds", seconds, _MAX_RUMBLE_S),
        ):
            if not (math.isfinite(value) and 0 <= value <= most):
                self._refuse(f"Gamepad.rumble: {what} {value:g} is not from 0 to {most:g}")
                return
        devices.rumble(self._motors.pad_id, strong, weak, seconds)

    # -- what is shown -----------------------------------------------------------------------------

    @Slot(str, result=float)
    def value(self, control: str) -> float:
        """Return a control's value: left and forward positive; 0 to 1 of buttons and triggers.

        Args:
            control: Its name; 0 is returned for one that the gamepad does not have.
        """
        return self._axis(self._pad, control) if self._pad is not None else 0.0

    @Slot()
    def _report_state(self) -> None:
        pad = self._pad
        values: dict[str, object] = {"devices": [one.name for one in self._snapshot.pads]}
        if pad is None:
            values |= {"axes": [], "buttons": [], "axisNames": [], "buttonNames": []}
        else:
            hats = [f"h{at // 2}.{8 if at % 2 == 0 else 1}" for at in range(2 * len(pad.hats))]
            values |= {
                "axes": pad.joy_axes(self.deadZone),
                "buttons": list(pad.buttons),
                "axisNames": [
                    *(self._label(pad, Control("a", at)) for at in range(len(pad.axes))),
                    *hats,
                ],
                "buttonNames": [
                    self._label(pad, Control("b", at)) for at in range(len(pad.buttons))
                ],
            }
        report(self, **values)

    @Slot()
    def _on_tick(self) -> None:
        # Without news from the devices' thread, which may hang in a driver, nothing is held.
        if self._is_steering and time.monotonic() - self._snapshot.at >= _FRESH_S:
            self._let_go()
            report(self, held=False)
        elif self._pad is not None:
            self._judge()
        if self._endpoint is not None:
            self._set_problem(self._endpoint.problem)
