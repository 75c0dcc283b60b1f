"""The element ``TfBroadcaster``: tells the robot where a frame is."""
# ruff: noqa: N815 - the names of slots and signals are QML's

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from rosglass.errors import Error
from rosglass.qml.dialect import Dialect
from rosglass.qml.element import Element
from rosglass.qml.from_js import fields_from_js
from rosglass.qt import Property, QJSValue, QtCore, Signal, Slot

if TYPE_CHECKING:
    from rosglass.comm.node import Node
    from rosglass.qml.runtime import Runtime
    from rosglass.tf import StaticTransformBroadcaster, Transform, TransformBroadcaster

__all__ = ["RosTfBroadcaster", "TfBroadcaster"]


class TfBroadcaster(Element):
    """Publishes a transform, again and again or once for all. See its page in ``docs/elements``."""

    frameIdChanged = Signal()
    childFrameIdChanged = Signal()
    translationChanged = Signal()
    rotationChanged = Signal()
    rateChanged = Signal()
    isStaticChanged = Signal()
    enabledChanged = Signal()
    nsChanged = Signal()
    readyChanged = Signal()
    problemChanged = Signal()

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        super().__init__(parent, runtime)
        self._frame = self._child = self._ns = ""
        self._translation: tuple[float, ...] = (0.0, 0.0, 0.0)
        self._rotation: tuple[float, ...] = (0.0, 0.0, 0.0, 1.0)
        self._rate, self._static, self._enabled = 10.0, False, True
        self._sender: TransformBroadcaster | StaticTransformBroadcaster | None = None
        self._have: tuple[Node, str, bool] | None = None
        self._timer = QtCore.QTimer(self)
        self._timer.timeout.connect(self._send_current)

    # Properties.

    def _set_frame(self, frame: str) -> None:
        if frame != self._frame:
            self._frame = frame
            self.frameIdChanged.emit()
            self._schedule()

    def _set_child(self, frame: str) -> None:
        if frame != self._child:
            self._child = frame
            self.childFrameIdChanged.emit()
            self._schedule()

    def _get_translation(self) -> QJSValue:
        return self._value(dict(zip("xyz", self._translation, strict=True)))

    def _set_translation(self, value: QJSValue) -> None:
        fields = self._numbers(value, "geometry_msgs/msg/Vector3", "translation", "xyz")
        if fields is not None and fields != self._translation:
            self._translation = fields
            self.translationChanged.emit()
            self._changed()

    def _get_rotation(self) -> QJSValue:
        return self._value(dict(zip("xyzw", self._rotation, strict=True)))

    def _set_rotation(self, value: QJSValue) -> None:
        fields = self._numbers(value, "geometry_msgs/msg/Quaternion", "rotation", "xyzw")
        if fields is not None and fields != self._rotation:
            self._rotation = fields
            self.rotationChanged.emit()
            self._changed()

    def _set_rate(self, rate: float) -> None:
        if not math.isfinite(rate) or rate < 0 or rate > 1000:
            self._refuse(f"TfBroadcaster: rate {rate:g} is not from 0 to 1000 per second")
        elif rate != self._rate:
            self._rate = rate
            self.rateChanged.emit()
            self._schedule()

    def _set_static(self, static: bool) -> None:
        if static != self._static:
            self._static = static
            self.isStaticChanged.emit()
            self._schedule()

    def _set_enabled(self, enabled: bool) -> None:
        if enabled != self._enabled:
            self._enabled = enabled
            self.enabledChanged.emit()
            self._schedule()

    def _set_ns(self, namespace: str) -> None:
        if namespace != self._ns:
            self._ns = namespace
            self.nsChanged.emit()
            self._schedule()

    frameId = Property(str, lambda self: self._frame, _set_frame, notify=frameIdChanged)
    childFrameId = Property(str, lambda self: self._child, _set_child, notify=childFrameIdChanged)
    translation = Property(QJSValue, _get_translation, _set_translation, notify=translationChanged)
    rotation = Property(QJSValue, _get_rotation, _set_rotation, notify=rotationChanged)
    rate = Property(float, lambda self: self._rate, _set_rate, notify=rateChanged)
    isStatic = Property(bool, lambda self: self._static, _set_static, notify=isStaticChanged)
    enabled = Property(bool, lambda self: self._enabled, _set_enabled, notify=enabledChanged)
    ns = Property(str, lambda self: self._ns, _set_ns, notify=nsChanged)
    ready = Property(bool, lambda self: self._sender is not None, notify=readyChanged)
    problem = Property(str, lambda self: self._problem, notify=problemChanged)

    def _value(self, value: Any) -> QJSValue:
        runtime = self._find_runtime()
        return QJSValue() if runtime is None else runtime.value(value)

    def _numbers(
        self, value: QJSValue, type_name: str, what: str, names: str
    ) -> tuple[float, ...] | None:
        from rosglass.messages import load  # noqa: PLC0415 - brings in the definitions
        from rosglass.messages.schema import schema_of  # noqa: PLC0415 - the same

        kind: Any = load(type_name, ros=2)
        try:
            given = kind.create(fields_from_js(value, schema_of(kind.definition), what))
        except Error as error:
            self._refuse(f"TfBroadcaster: {error}")
            return None
        return tuple(float(getattr(given, name)) for name in names)

    # Sending.

    @Slot(result=bool)
    @Slot(QJSValue, result=bool)
    def send(self, transforms: QJSValue | None = None) -> bool:
        """Send the current transform now, or others: a TransformStamped, or a list of them.

        A value that does not fit throws a JavaScript Error.

        Returns:
            Whether it was handed to a node.
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
        from rosglass.messages import load  # noqa: PLC0415 - brings in the definitions
        from rosglass.messages.schema import schema_of  # noqa: PLC0415 - the same
        from rosglass.tf import Transform  # noqa: PLC0415 - the same

        kind: Any = load("geometry_msgs/msg/TransformStamped", ros=2)
        schema = schema_of(kind.definition)
        count = value.property("length").toInt() if value.isArray() else None
        items = [value] if count is None else [value.property(at) for at in range(count)]
        return [
            Transform.from_message(kind.create(fields_from_js(item, schema, "", self.DIALECT)))
            for item in items
        ]

    def _current(self) -> Transform:
        from rosglass.comm.time import Time  # noqa: PLC0415 - loaded by now
        from rosglass.tf import Transform  # noqa: PLC0415 - brings in the transforms

        node = self.node
        now = Time() if node is None else node.now()
        x, y, z = self._translation
        qx, qy, qz, qw = self._rotation
        return Transform((x, y, z), (qx, qy, qz, qw), now, self._frame, self._child)

    def _send(self, transforms: list[Transform]) -> bool:
        sender = self._sender
        if sender is None:
            return False
        try:
            sender.send_transform(transforms)
        except Error as error:
            self._say(f"TfBroadcaster: {error}")
            return False
        self._say("")
        return True

    @Slot()
    def _send_current(self) -> None:
        if self._enabled and self._frame and self._child:
            self._send([self._current()])

    def _changed(self) -> None:
        if self._static and self._sender is not None:
            self._send_current()

    def _update(self) -> None:
        node, session = self.node, self._session
        want = None
        if node is not None and self._enabled:
            want = (node, self._ns or "/", self._static)
        if want != self._have and session is not None:
            self._withdraw()
            self._have = want
            if want is not None:
                self._open(*want)
        self._run_timer()
        self._changed()

    def _open(self, node: Node, namespace: str, static: bool) -> None:
        session, want = self._session, self._have
        assert session is not None

        def work() -> TransformBroadcaster | StaticTransformBroadcaster:
            from rosglass import tf  # noqa: PLC0415 - brings in the transforms

            kind = tf.StaticTransformBroadcaster if static else tf.TransformBroadcaster
            return kind(node, namespace)

        def done(result: TransformBroadcaster | StaticTransformBroadcaster | Error) -> None:
            if isinstance(result, Error):
                self._say(f"TfBroadcaster: {result}")
            else:
                self._sender = result
                self._at_end["sender"] = lambda: session.background(result.close)
                self.readyChanged.emit()
                self._run_timer()
                self._send_current()

        self._make(work, lambda: self._have is want, done)

    def _run_timer(self) -> None:
        if self._sender is None or self._static or not self._rate:
            self._timer.stop()
        else:
            self._timer.start(round(1000 / self._rate))

    def _withdraw(self) -> None:
        sender, self._sender = self._sender, None
        self._at_end.pop("sender", None)
        if sender is not None and self._session is not None:
            self._session.background(sender.close)
            self.readyChanged.emit()

    def _problem_changed(self) -> None:
        self.problemChanged.emit()


class RosTfBroadcaster(TfBroadcaster):
    """The element ``TfBroadcaster`` of ``Ros 1.0``."""

    DIALECT = Dialect.ROS1
