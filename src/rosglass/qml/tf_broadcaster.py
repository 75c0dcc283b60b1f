"""The element ``TfBroadcaster``: tells the robot where a frame is."""
# ruff: noqa: N815 - the names of slots and signals are QML's

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rosglass.errors import Error
from rosglass.qml.dialect import Dialect
from rosglass.qml.element import Element
from rosglass.qml.from_js import fields_from_js
from rosglass.qml.properties import ReadOnly, Writable, report, within
from rosglass.qt import QJSValue, QtCore, Slot

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.comm.node import Node
    from rosglass.qml.runtime import Runtime
    from rosglass.tf import StaticTransformBroadcaster, Transform, TransformBroadcaster

__all__ = ["RosTfBroadcaster", "TfBroadcaster"]


class TfBroadcaster(Element):
    """Publishes a transform, again and again or once for all. See its page in ``docs/elements``."""

    #: The frame that is given, and the one it is given in.
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
        self._timer = QtCore.QTimer(self)
        self._timer.timeout.connect(self._send_current)

    def _value(self, value: Any) -> QJSValue:
        runtime = self._find_runtime()
        return QJSValue() if runtime is None else runtime.value(value)

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
        return Transform((x, y, z), (qx, qy, qz, qw), now, self.frameId, self.childFrameId)

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
            from rosglass import tf  # noqa: PLC0415 - brings in the transforms

            kind = tf.StaticTransformBroadcaster if static else tf.TransformBroadcaster
            return kind(node, namespace)

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
            self._timer.start(round(1000 / self.rate))


def _numbers(value: QJSValue, type_name: str, what: str, names: str) -> tuple[float, ...]:
    """Return the numbers of a vector that QML gave; raises Error."""
    from rosglass.messages import load  # noqa: PLC0415 - brings in the definitions
    from rosglass.messages.schema import schema_of  # noqa: PLC0415 - the same

    kind: Any = load(type_name, ros=2)
    given = kind.create(fields_from_js(value, schema_of(kind.definition), what))
    return tuple(float(getattr(given, name)) for name in names)


class RosTfBroadcaster(TfBroadcaster):
    """The element ``TfBroadcaster`` of ``Ros 1.0``."""

    DIALECT = Dialect.ROS1
