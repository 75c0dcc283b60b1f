"""The elements ``TfTransform``, which follows a transform, and ``TfBroadcaster``."""
# ruff: noqa: N815 - the names of slots and signals are QML's

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING, Any

import rosglass
from rosglass.comm.statistics import StampMonitor
from rosglass.comm.time import Time
from rosglass.errors import Error, TransformException
from rosglass.qml.elements.element import DEFAULT_TIMEOUT_MS, Element, Pace, single_shot
from rosglass.qml.elements.tf_buffer import TfBuffer, TfLink, shown_transform
from rosglass.qml.engine.dialect import Dialect
from rosglass.qml.engine.from_js import fields_from_js
from rosglass.qml.engine.properties import ReadOnly, Writable, at_least, report, within
from rosglass.qml.engine.session import weak_callback
from rosglass.qt import QJSValue, QtCore, Signal, Slot, is_alive

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.comm.handle import Handle
    from rosglass.comm.node import Node
    from rosglass.qml.engine.runtime import Runtime
    from rosglass.qml.engine.session import Session
    from rosglass.tf import (
        StaticTransformBroadcaster,
        Transform,
        TransformBroadcaster,
        TransformBuffer,
    )


__all__ = ["RosTfBroadcaster", "RosTfTransform", "TfBroadcaster", "TfTransform"]

#: Seconds after which the reason for a missing transform is looked up again.
_LOOK_UP_S = 1.0


def _finite(rate: float) -> float:
    if not math.isfinite(rate):
        raise ValueError("is not a number of updates per second")
    return rate


class TfTransform(Element):
    """Follows a transform. See its page in ``docs/elements``."""

    messageChanged = Signal()
    translationChanged = Signal()
    rotationChanged = Signal()
    bufferChanged = Signal()

    #: The frame that is looked up, and the frame in which its pose is given.
    sourceFrame = Writable(str, "")
    targetFrame = Writable(str, "")
    enabled = Writable(bool, True)
    active = Writable(
        bool, read=lambda self: self.enabled, write="_set_enabled", notify="enabledChanged"
    )
    #: Maximum updates per second; 0 stops updates, and in ``Ros 1.0`` means no limit.
    rate = Writable(float, 62.5, _finite)  # one per 16 ms
    timeout = Writable(int, DEFAULT_TIMEOUT_MS, at_least(0), then="_update_stale", unit="ms")
    buffer = Writable(QtCore.QObject, read=lambda self: self._own_buffer, write="_set_buffer")
    message = ReadOnly(QJSValue, read="_get_message")
    transform = ReadOnly(QJSValue, read="_get_message", notify="messageChanged")
    translation = ReadOnly(QJSValue, read=lambda self: self._get_part("translation"))
    rotation = ReadOnly(QJSValue, read=lambda self: self._get_part("rotation"))
    valid = ReadOnly(bool, False)
    stale = ReadOnly(bool, True)
    age = ReadOnly(float, -1.0)

    _HOLDS = ("_shown", "_link")
    #: Whether a rate of 0 means no limit; otherwise it stops the updates.
    _ZERO_IS_UNLIMITED = False
    _valid: bool

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        super().__init__(parent, runtime)
        self._own_buffer: TfBuffer | None = None
        self._link: TfLink | None = None
        #: Error text for invalid frame names; empty if they are valid.
        self._bad_frames = ""
        self._transform: Transform | None = None
        self._exception, self._why = "Uninitialized", "nothing was looked up yet"
        self._shown: QJSValue | None = None
        self._updated, self._pace = 0.0, Pace()
        #: When the transform last changed; None before. And the seconds by which it was late.
        self._arrived: float | None = None
        self._late, self._stamps = 0.0, StampMonitor()
        #: When the connection was lost; later transforms are live, e.g. without a ROS 1 master.
        self._lost: float | None = None
        self._timer = single_shot(self, self._refresh)
        self._look_again = lambda *_: self._schedule() if is_alive(self) else None

    def _set_enabled(self, enabled: bool) -> None:
        self.enabled = enabled

    def _set_buffer(self, buffer: QtCore.QObject | None) -> None:
        if buffer is not None and not isinstance(buffer, TfBuffer):
            self._refuse("TfTransform: buffer is not a TfBuffer")
            return
        if buffer is self._own_buffer:
            return
        self._own_buffer = buffer
        if buffer is not None:
            # Signals do not reach methods of objects that QML extends, but they reach functions.
            buffer.bufferChanged.connect(self._look_again)
            buffer.destroyed.connect(self._look_again)
        self.bufferChanged.emit()
        self._schedule()

    def _get_message(self) -> QJSValue:
        if self._shown is None:
            runtime = self._find_runtime()
            if runtime is None:
                return QJSValue()
            self._shown = shown_transform(runtime, self._known(), self._exception, self._why, self)
        return self._shown

    def _known(self) -> Transform:
        if self._transform is not None:
            return self._transform
        return rosglass.tf.Transform(frame_id=self.targetFrame, child_frame_id=self.sourceFrame)

    def _get_part(self, name: str) -> QJSValue:
        message: QJSValue = self._get_message()
        return message.property("transform").property(name)

    # Following.

    def _is_complete(self) -> bool:
        return bool(self.enabled and self.sourceFrame and self.targetFrame)

    def _find_buffer(self) -> TransformBuffer | None:
        """Return the buffer to use: the one that was set, or the node's."""
        node, session = self.node, self._session
        if node is None or session is None or self._own_buffer is not None:
            self._leave_link()
            own = self._own_buffer
            return own.buffer if own is not None and is_alive(own) else None
        if not self._is_complete():
            self._leave_link()
            return None
        if self._link is None:
            link = self._link = TfLink.join(session, node, "/", self)
            self._cleanup["link"] = lambda: link.leave(self)
        return self._link.buffer

    def _leave_link(self) -> None:
        link, self._link = self._link, None
        self._cleanup.pop("link", None)
        if link is not None:
            link.leave(self)

    def _wanted(self) -> tuple[TransformBuffer, str, str] | None:
        buffer = self._find_buffer()
        running = self.rate > 0 or self._ZERO_IS_UNLIMITED
        if buffer is None or not self._is_complete() or not running:
            return None
        return buffer, self.targetFrame, self.sourceFrame

    def _create_endpoint(self, wanted: tuple[Any, ...]) -> None:
        buffer, target, source = wanted
        on_change = weak_callback(self._on_change)
        try:
            self._set_endpoint(buffer.on_change(target, source, on_change, self._executor))
        except TransformException as error:
            self._bad_frames = f"TfTransform: {error}"
            self._set_problem(self._bad_frames)

    def _dispose(self, session: Session, endpoint: Handle) -> None:  # noqa: ARG002
        endpoint.close()

    def _on_closed(self, endpoint: Handle | None) -> None:  # noqa: ARG002 - the base's signature
        self._timer.stop()
        self._arrived, self._bad_frames = None, ""

    def _update(self) -> None:
        super()._update()
        if self._config is not None:
            # Transforms in the buffer may be from a previous robot: wait for a new one.
            self._look_up(moved=False)
        elif self.enabled and self._find_buffer() is None:
            self._show(None, "Uninitialized", "there is no node yet")

    def _on_change(self) -> None:
        if not is_alive(self) or self._config is None:
            return
        if self._timer.isActive():
            return
        wait = self._pace.wait(self._interval, time.monotonic())
        if wait > 0.0005:
            self._timer.start(math.ceil(wait * 1000))
        else:
            self._refresh()

    @property
    def _interval(self) -> float:
        """Minimum seconds between two updates."""
        return 1 / self.rate if self.rate > 0 else 0.0

    @Slot()
    def _refresh(self) -> None:
        self._look_up(moved=True)

    def _look_up(self, *, moved: bool) -> None:
        """Look up the transform; `moved`: one of its links has just been received."""
        if self._config is None:
            return
        buffer, target, source = self._config
        self._updated = time.monotonic()
        self._pace.take(self._interval, self._updated)
        try:
            found = buffer.lookup_transform(target, source)
        except TransformException as error:
            self._show(None, type(error).__name__, str(error))
            return
        # In a chain, the newest common time only changes with the link that is furthest behind.
        if moved and (self._transform is None or found.stamp != self._transform.stamp):
            self._arrived = self._steady()
            self._late = self._lateness(found.stamp.nanoseconds)
        self._show(found, "", "")

    def _lateness(self, stamp: int) -> float:
        """Return how much longer than usual a transform took that has just arrived, in seconds."""
        node, frames = self.node, f"{self.targetFrame} {self.sourceFrame}"
        if node is None or node.has_simulated_stamps:
            return 0.0
        return self._stamps.add(frames.encode(), time.time_ns(), stamp)

    def _show(self, found: Transform | None, exception: str, why: str) -> None:
        before, valid = self._transform, self._valid
        if (found, exception, why) == (before, self._exception, self._why):
            self._update_stale()
            return
        self._transform, self._exception, self._why = found, exception, why
        # Update all properties before emitting the first signal.
        self._shown, self._valid = None, found is not None
        self.messageChanged.emit()
        if before is None or found is None or before.translation != found.translation:
            self.translationChanged.emit()
        if before is None or found is None or before.rotation != found.rotation:
            self.rotationChanged.emit()
        if is_alive(self) and valid != self._valid:
            self.validChanged.emit()  # type: ignore[attr-defined]
        if is_alive(self):
            self._update_stale()

    # Judging.

    def _update_stale(self) -> None:
        """Report the age, and whether the transform is stale."""
        moving = self._transform is not None and self._transform.stamp.nanoseconds > 0
        arrived = self._arrived
        age = self._steady() - arrived if moving and arrived is not None else -1.0
        connected = self._session is not None and self._session.state == "connected"
        lost = not connected and (arrived is None or self._lost is None or arrived <= self._lost)
        late = arrived is None or age + self._late > self.timeout / 1000 + self._interval
        old = moving and self.timeout > 0 and late
        stale = self._transform is None or self._config is None or lost or old
        report(self, age=age, stale=stale)

    @Slot()
    def _on_connection(self) -> None:
        self._lost = self._steady()
        self._update_stale()

    @Slot()
    def _on_tick(self) -> None:
        missing = self._config is not None and self._transform is None
        if missing and not self._timer.isActive() and time.monotonic() - self._updated > _LOOK_UP_S:
            # The reason may have changed: only watched frames emit signals.
            self._refresh()
        own = self._own_buffer
        source = self._link if own is None or not is_alive(own) else own
        self._set_problem(self._bad_frames or (str(source.problem) if source is not None else ""))
        self._update_stale()


class RosTfTransform(TfTransform):
    """The element ``TfTransform`` of ``Ros 1.0``, where a rate of 0 means no limit."""

    DIALECT = Dialect.ROS1
    _ZERO_IS_UNLIMITED = True


class TfBroadcaster(Element):
    """Publishes a transform, periodically or as a static one. See its page in ``docs/elements``."""

    #: The parent frame, and the frame whose pose is sent.
    frameId = Writable(str, "")
    childFrameId = Writable(str, "")
    translation = Writable(
        QJSValue,
        (0.0, 0.0, 0.0),
        lambda value: _numbers(value, "geometry_msgs/msg/Vector3", "translation", "xyz"),
        then="_send_static",
        read=lambda self: self._value(dict(zip("xyz", self._translation, strict=True))),
    )
    rotation = Writable(
        QJSValue,
        (0.0, 0.0, 0.0, 1.0),
        lambda value: _numbers(value, "geometry_msgs/msg/Quaternion", "rotation", "xyzw"),
        then="_send_static",
        read=lambda self: self._value(dict(zip("xyzw", self._rotation, strict=True))),
    )
    #: Transforms per second; 0 sends only on request.
    rate = Writable(float, 10.0, within(0, 1000, "per second"))
    isStatic = Writable(bool, False)
    enabled = Writable(bool, True)
    ns = Writable(str, "")
    ready = ReadOnly(bool, False)

    _endpoint: TransformBroadcaster | StaticTransformBroadcaster | None
    _translation: tuple[float, ...]
    _rotation: tuple[float, ...]

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        super().__init__(parent, runtime)
        self._pace = Pace()
        self._timer = single_shot(self, self._send_next)

    def _value(self, value: Any) -> QJSValue:
        runtime = self._find_runtime()
        return QJSValue() if runtime is None else runtime.value(value)

    # Sending.

    @Slot(result=bool)
    @Slot(QJSValue, result=bool)
    def send(self, transforms: QJSValue | None = None) -> bool:
        """Send the current transform now, or a given TransformStamped or list of them.

        An invalid value throws a JavaScript Error.

        Returns:
            Whether it was passed to a node.
        """
        if transforms is None or transforms.isUndefined():
            return self._send([self._current()])
        runtime = self._find_runtime()
        try:
            made = self._given(transforms)
        except Error as error:
            if runtime is not None:
                runtime.throw(f"TfBroadcaster.send: {error}")
            return False
        return self._send(made)

    def _given(self, value: QJSValue) -> list[Transform]:
        kind: Any = rosglass.load("geometry_msgs/msg/TransformStamped", ros=2)
        count = value.property("length").toInt() if value.isArray() else None
        items = [value] if count is None else [value.property(at) for at in range(count)]
        return [
            rosglass.tf.Transform.from_message(
                kind.create(fields_from_js(item, kind, "", self.DIALECT))
            )
            for item in items
        ]

    def _current(self) -> Transform:
        node = self.node
        now = Time() if node is None else node.now()
        x, y, z = self._translation
        qx, qy, qz, qw = self._rotation
        frames = self.frameId, self.childFrameId
        return rosglass.tf.Transform((x, y, z), (qx, qy, qz, qw), now, *frames)

    def _send(self, transforms: list[Transform]) -> bool:
        sender = self._endpoint
        if sender is None:
            return False
        try:
            sender.send_transform(transforms)
        except Error as error:
            self._set_problem(f"TfBroadcaster: {error}")
            return False
        self._set_problem("")
        return True

    @Slot()
    def _send_current(self) -> None:
        if self.enabled and self.frameId and self.childFrameId:
            self._send([self._current()])

    @Slot()
    def _send_next(self) -> None:
        if self.rate:  # otherwise 0 since just now
            self._timer.start(self._pace.take_ms(self.rate))
            self._send_current()

    def _send_static(self) -> None:
        if self.isStatic and self._endpoint is not None:
            self._send_current()

    def _update(self) -> None:
        super()._update()
        self._run_timer()
        self._send_static()

    def _wanted(self) -> tuple[Node, str, bool] | None:
        node = self.node
        return (node, self.ns or "/", self.isStatic) if node is not None and self.enabled else None

    def _factory(self, node: Node, namespace: str, static: bool) -> Callable[[], Any]:
        def create() -> TransformBroadcaster | StaticTransformBroadcaster:
            if static:
                return rosglass.tf.StaticTransformBroadcaster(node, namespace)
            return rosglass.tf.TransformBroadcaster(node, namespace)

        return create

    def _on_created(self, endpoint: Any) -> None:  # noqa: ARG002 - the base's signature
        report(self, ready=True)
        self._run_timer()
        self._send_current()

    def _on_closed(self, endpoint: Any) -> None:  # noqa: ARG002 - the base's signature
        report(self, ready=False)

    def _run_timer(self) -> None:
        if self._endpoint is None or self.isStatic or not self.rate:
            self._timer.stop()
        else:
            self._pace = Pace()
            self._timer.start(self._pace.take_ms(self.rate))


def _numbers(value: QJSValue, type_name: str, what: str, names: str) -> tuple[float, ...]:
    """Return the components of a vector from QML; raises Error."""
    kind: Any = rosglass.load(type_name, ros=2)
    given = kind.create(fields_from_js(value, kind, what))
    return tuple(float(getattr(given, name)) for name in names)


class RosTfBroadcaster(TfBroadcaster):
    """The element ``TfBroadcaster`` of ``Ros 1.0``."""

    DIALECT = Dialect.ROS1
